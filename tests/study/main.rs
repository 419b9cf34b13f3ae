//! The studies: FLIP beside its authors' own, degradations against what they say they do, and the
//! commands as a whole.

mod accuracy;
mod captures;
mod commands;
mod degradations;
mod figures;
mod flip;

#[path = "../shared/skip.rs"]
mod skip;
