//! Studies of the results: how far they are from the truth, and how stable they are.

pub mod pictures;
pub mod score;
