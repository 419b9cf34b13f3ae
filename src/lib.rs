pub mod geometry;
pub mod math;
pub mod scene;
pub mod solve;
pub mod watch;
