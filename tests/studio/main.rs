//! The window, drawn off screen by whatever adapter the machine has; a software one will do.
#![cfg(feature = "studio")]

mod hand; // mouse and keys in the 3D view
mod viewport; // the 3D view: what is drawn and named
