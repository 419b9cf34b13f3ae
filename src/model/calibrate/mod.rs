//! Start values in closed form: focal length, rotations and positions from strokes.
//!
//! 1. [`lines`]: strokes and edges of things that run along the axes of the world, or of a box.
//! 2. [`vanishing`]: their vanishing points give focal length, principal point and rotation.
//! 3. [`linear`]: with rotations known, all positions follow from one linear system.
//! 4. [`resect`]: cameras without lines follow from corners that are placed by then.

mod connected;
pub mod lines;
pub mod linear;
pub mod resect;
mod rig;
mod shapes;
mod start;
pub mod vanishing;

pub use shapes::set_angles;
pub use start::{Start, start};
