//! What comes of a look at the disk.

use std::path::PathBuf;

use super::{Action, PathRequest};

/// What the window does once a thread has looked.
#[derive(Debug)]
pub enum Outcome {
    Do(Action),
    /// A file or results are there: may they be replaced?
    AskToReplace(PathRequest, PathBuf),
    Notice(String),
    /// Headline and text.
    Error(&'static str, String),
}
