pub mod geometry;
pub mod io;
pub mod math;
pub mod scene;
pub mod solve;
pub mod study;
pub mod watch;
