//! Parts of stored edits that could not be read. A project keeps them and writes them back, so that
//! a missing file, or a kind of light of a later version, is not lost.

use std::path::{Path, PathBuf};

use serde_json::{Map, Value};

use super::{Error, write};
use crate::io::json::Field;
use crate::io::paths::{absolute, relative, tidy};
use crate::render::edits::Edits;

/// The members of a light or an object that name a file.
const FILES: [&str; 2] = ["mesh", "image"];

/// A part of stored edits that could not be read.
#[derive(Clone, Debug, PartialEq)]
pub struct Unread {
    /// Where it stands among the edits.
    pub place: Place,
    /// As the file has it, but for the path of a file that it names, which is absolute.
    pub value: Value,
    /// What is wrong, for people; `None` of a member that this version does not know.
    pub problem: Option<String>,
    /// The file that it names is not there.
    pub is_missing: bool,
}

/// Where a part of stored edits stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// In the list of lights.
    Light,
    /// In the list of objects.
    Object,
    /// A member of an object of the edits, and that object's key.
    Within(&'static str, String),
    /// A member of the edits themselves.
    Member(String),
}

/// Edits of a project, with what of them could not be read.
#[derive(Clone, Debug, Default)]
pub struct StoredEdits {
    /// What could be read.
    pub edits: Edits,
    /// What could not.
    pub unread: Vec<Unread>,
    /// What is odd about what could.
    pub warnings: Vec<String>,
}

impl Unread {
    pub(in crate::io) fn new(place: Place, field: &Field, error: Option<&Error>) -> Self {
        let mut own = Self {
            place,
            value: field.value.clone(),
            problem: None,
            is_missing: matches!(error, Some(Error::Missing(_))),
        };
        let folder = absolute(field.file.parent().unwrap_or(Path::new("")));
        own.change_file(|name| tidy(&folder.join(name.replace('\\', "/"))).display().to_string());
        own.problem = match (error, own.file()) {
            (Some(Error::Missing(_)), Some(file)) => Some(format!(
                "\"{}\" needs the file {}, which is not there.",
                own.name(),
                file.display()
            )),
            (error, _) => error.map(Error::to_string),
        };
        own
    }

    /// What it is called.
    pub fn name(&self) -> String {
        match (&self.place, self.value.get("name").and_then(Value::as_str)) {
            (Place::Light | Place::Object, Some(name)) => name.to_owned(),
            (Place::Light, None) => "light".to_owned(),
            (Place::Object, None) => "object".to_owned(),
            (Place::Within(_, key) | Place::Member(key), _) => key.clone(),
        }
    }

    /// The file that it names.
    pub fn file(&self) -> Option<PathBuf> {
        let names = FILES.iter().find_map(|key| self.value.get(key)?.as_str());
        names.filter(|_| matches!(self.place, Place::Light | Place::Object)).map(PathBuf::from)
    }

    /// Edits of nothing but this, with another file in place of the one that it names.
    pub fn with_file(&self, file: &Path) -> Value {
        let mut own = self.clone();
        own.change_file(|_| file.display().to_string());
        let list = if own.place == Place::Light { "lights" } else { "objects" };
        Value::Object(Map::from_iter([(list.to_owned(), Value::Array(vec![own.value]))]))
    }

    fn change_file(&mut self, change: impl Fn(&str) -> String) {
        if self.file().is_none() {
            return;
        }
        for key in FILES {
            if let Some(Value::String(name)) = self.value.get_mut(key) {
                *name = change(name);
            }
        }
    }
}

/// What a file in `folder` would hold: the edits, and what could not be read, where nothing has
/// taken its place meanwhile.
pub fn stored_value(edits: &Edits, unread: &[Unread], folder: &Path) -> Value {
    let mut value = write::value(edits, folder);
    let folder = absolute(folder);
    for part in unread {
        let mut part = part.clone();
        part.change_file(|name| relative(&folder, Path::new(name)));
        let Some(members) = value.as_object_mut() else { continue };
        match part.place {
            Place::Light | Place::Object => {
                let key = if part.place == Place::Light { "lights" } else { "objects" };
                let items = members.entry(key).or_insert_with(|| Value::Array(Vec::new()));
                if let Value::Array(items) = items {
                    items.push(part.value);
                }
            }
            Place::Within(key, name) => {
                let within = members.entry(key).or_insert_with(|| Value::Object(Map::new()));
                if let Value::Object(within) = within {
                    within.entry(name).or_insert(part.value);
                }
            }
            Place::Member(key) => {
                members.entry(key).or_insert(part.value);
            }
        }
    }
    value
}
