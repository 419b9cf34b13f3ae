//! Sampling patterns, directions, colour triples, differences of colours and small statistics. Knows
//! nothing of scenes.

pub mod blackbody;
pub mod color;
pub mod latlong;
pub mod rgb;
pub mod sampling;
pub mod spectrum;
pub mod statistics;
