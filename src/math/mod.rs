//! Sampling patterns, directions, colour triples, colours to the eye and small statistics. Knows nothing of scenes.

pub mod blackbody;
pub mod color;
pub mod rgb;
pub mod sampling;
pub mod spectrum;
pub mod statistics;
