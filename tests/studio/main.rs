//! The window, drawn off screen by whatever adapter the machine has; a software one will do.
#![cfg(feature = "studio")]

mod viewport; // the 3D view: what is drawn, picked and named
