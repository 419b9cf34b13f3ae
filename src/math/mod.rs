//! Sampling patterns, directions, colour triples and small statistics. Knows nothing of scenes.

pub mod blackbody;
pub mod rgb;
pub mod sampling;
pub mod statistics;
