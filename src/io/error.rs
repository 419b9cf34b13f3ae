//! Errors of files, with messages that say what to do.

use std::fmt;
use std::path::{Path, PathBuf};

use crate::watch::Cancelled;

/// Why a file could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    #[error("{} cannot be read: {source}. {}", .file.display(), what_to_do(.source))]
    Read { file: PathBuf, source: std::io::Error },
    #[error(
        "{} cannot be written: {source}. Check the free space and the permissions of its folder.",
        .file.display()
    )]
    Write { file: PathBuf, source: std::io::Error },
    /// Something that a capture needs is not there.
    #[error("{0}")]
    Missing(Fault),
    /// The file is damaged, or says what cannot be.
    #[error("{0}")]
    Invalid(Fault),
    /// The file may be sound, but this program does not read its variety.
    #[error("{0}")]
    Unsupported(Fault),
    /// The file asks for more memory than it should.
    #[error("{0}")]
    TooLarge(Fault),
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// What helps where a file cannot be read.
fn what_to_do(source: &std::io::Error) -> &'static str {
    match source.kind() {
        std::io::ErrorKind::IsADirectory => "It is a folder: name a file in it.",
        _ => "Check that it exists and that you may read it.",
    }
}

/// A fault with its place and its remedy.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    pub file: PathBuf,
    /// The line, field, frame or byte; empty where the whole file is meant.
    pub place: String,
    /// What is wrong there: a clause without a full stop.
    pub problem: String,
    /// What to do about it: a sentence without a full stop.
    pub remedy: String,
}

impl Fault {
    pub fn new(
        file: &Path,
        place: impl Into<String>,
        problem: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self {
            file: file.to_owned(),
            place: place.into(),
            problem: problem.into(),
            remedy: remedy.into(),
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{}", self.file.display())?;
        if !self.place.is_empty() {
            write!(out, ", {}", self.place)?;
        }
        write!(out, ": {}. {}.", self.problem, self.remedy)
    }
}

/// The whole file, refused beyond `limit` bytes so that a wrong file (a video, a disk image)
/// does not fill the memory.
pub(crate) fn read_bounded(file: &Path, limit: u64) -> Result<Vec<u8>, Error> {
    let failed = |source| Error::Read { file: file.to_owned(), source };
    let metadata = std::fs::metadata(file).map_err(failed)?;
    if !metadata.is_file() {
        return Err(Error::Invalid(Fault::new(
            file,
            "",
            "this is no file",
            "Replace it with a file of that name",
        )));
    }
    if metadata.len() > limit {
        return Err(Error::TooLarge(Fault::new(
            file,
            "",
            format!(
                "the file has {:.0} MB, and at most {:.0} MB are read",
                metadata.len() as f64 / 1e6,
                limit as f64 / 1e6
            ),
            "Check that it is the right file, or make it smaller",
        )));
    }
    std::fs::read(file).map_err(failed)
}

/// Longest name that is compared with others, in characters.
const LONGEST_NAME: usize = 200;

/// `name`, quoted, with the closest of `choices` if one is close enough to be a slip of the pen.
pub(crate) fn suggestion<'a>(
    name: &str,
    choices: impl Iterator<Item = &'a str>,
) -> Option<&'a str> {
    let length = name.chars().count();
    let limit = 1 + length / 4;
    let distance = |choice: &str| strsim::levenshtein(&name.to_lowercase(), &choice.to_lowercase());
    choices
        // No name is long; a damaged file's may be, and the time grows with the square.
        .filter(|choice| length.max(choice.chars().count()) <= LONGEST_NAME)
        .map(|choice| (distance(choice), choice))
        .filter(|(distance, _)| *distance <= limit)
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, choice)| choice)
}

/// The first few of `names`, quoted, and how many more there are.
pub(crate) fn listed<'a>(names: impl ExactSizeIterator<Item = &'a str>) -> String {
    let (count, shown) = (names.len(), 8);
    let mut text =
        names.take(shown).map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ");
    if count > shown {
        text += &format!(" and {} more", count - shown);
    }
    text
}
