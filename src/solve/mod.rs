//! Numerical methods that know nothing of light: bounded linear least squares and a
//! derivative-free minimiser.

pub mod bounded;
pub(crate) mod kernels;
pub mod subplex;
