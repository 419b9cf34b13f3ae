//! Triangles, the rays that meet them, and point sets with a minimum distance.

pub mod bvh;
pub mod mesh;
pub mod solid;
pub mod spaced;
