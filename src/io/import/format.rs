//! The description of a camera format that has everything in one file. It is in the reader of the
//! format, and `source.rs` lists it.

use std::path::Path;

use serde_json::Value;

use super::Parsed;
use crate::io::Error;

/// A format whose cameras are in one file.
pub(super) struct Format {
    /// What it is, for a person.
    pub name: &'static str,
    /// Any of them makes a file one of the format.
    pub signs: &'static [Sign],
    /// Reads the bytes of a file, whose path is for messages.
    pub parse: fn(&Path, &[u8], &Names<'_>) -> Result<Parsed, Error>,
}

/// By what it is known that a file is of a format.
pub(super) enum Sign {
    /// The end of its name.
    End(&'static str),
    /// The end of its name, and its text; then in words what a file of that name is without.
    Text(&'static str, fn(&str) -> bool, &'static str),
    /// Its value, if it is JSON.
    Json(fn(&Value) -> bool),
}

/// Finds the names of the photographs, one a camera, for a format that has none in its file.
pub(super) type Names<'a> = dyn Fn() -> Result<Vec<String>, Error> + 'a;
