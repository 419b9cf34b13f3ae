//! File formats: one source file for each format (`assets/guide/files.md` describes them). No other
//! module opens files.
//!
//! Reading starts at [`capture::load`]. Everything that is written goes through [`atomic`], so that
//! a file appears under its final name only when it is complete. The contents of a file are checked
//! before they are used: sizes are bounded before memory is allocated, and every [`Error`] names
//! the file, the place, what is wrong and what to do.

mod accept;
pub mod atomic;
mod binary;
pub mod brackets;
pub mod chart_table;
pub mod capture;
pub mod drawing;
mod error;
pub mod exif_lens;
pub mod export;
pub mod exr;
pub mod edits;
pub mod engines;
pub mod hdr;
pub mod grouping;
pub mod import;
pub(crate) mod inside;
mod json;
pub mod logfile;
pub mod masks;
pub mod mesh;
pub mod model;
pub mod mtl;
pub mod obj;
mod obj_text;
pub mod options;
pub mod orientation;
mod paths;
pub mod photograph;
pub mod picture;
mod png;
pub mod polygon;
mod pose;
pub mod process;
pub mod profile;
pub mod project;
pub mod raw;
pub mod records;
pub mod response;
pub mod results;
pub mod scratch;
pub mod settings;
mod single;
pub mod solution;
pub mod solved;
pub mod table;
mod surfaces;
pub mod tags;
pub mod transforms;
pub mod truth;

pub use error::{Error, Fault};
