//! Where the photographs are that a source names: below the folders that the user gave, by the
//! ends of their paths.
//!
//! Programs write absolute paths, paths of other machines, or names without extension; photographs
//! are developed to another format after the cameras were found. So the file's name decides, then
//! as many of its folders as agree. An image of radiance is taken before one for display, and a
//! RAW photograph where it is named, or lies there alone.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use crate::io::{inside, raw};

const EXTENSIONS: [&str; 7] = ["exr", "hdr", "png", "jpg", "jpeg", "tif", "tiff"];
/// Folders within folders: deep in those that the user gives, less so near a source, which may lie
/// in anybody's home.
const DEEPEST: usize = 8;
const DEEPEST_NEAR: usize = 2;
/// Beyond this it is no folder of photographs.
const MOST_FILES: usize = 500_000;

/// All images below some folders.
#[derive(Default)]
pub(super) struct Photographs {
    /// With the lower-case parts of the path below the folder, the file's stem last.
    files: Vec<(PathBuf, Vec<String>)>,
    by_stem: HashMap<String, Vec<usize>>,
}

/// What a name led to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Found {
    One(PathBuf),
    /// Several are as likely.
    Several,
    None,
}

impl Photographs {
    pub fn below(folders: &[PathBuf]) -> Self {
        let (mut own, mut visited) = (Self::default(), HashSet::new());
        for folder in folders {
            own.add(folder, &mut Vec::new(), DEEPEST, &mut visited);
        }
        own
    }

    /// The images of a folder that the user has not named.
    pub fn near(folder: &Path) -> Self {
        let mut own = Self::default();
        own.add(folder, &mut Vec::new(), DEEPEST_NEAR, &mut HashSet::new());
        own
    }

    pub fn is_empty(&self) -> bool {
        self.files.is_empty()
    }

    fn add(
        &mut self,
        folder: &Path,
        parts: &mut Vec<String>,
        deepest: usize,
        visited: &mut HashSet<PathBuf>,
    ) {
        // Links may lead in circles.
        let real = dunce::canonicalize(folder).unwrap_or_else(|_| folder.to_owned());
        if parts.len() > deepest || !visited.insert(real) {
            return;
        }
        let Ok(entries) = std::fs::read_dir(folder) else { return };
        let mut paths: Vec<PathBuf> = entries.filter_map(|e| e.ok().map(|e| e.path())).collect();
        paths.sort();
        for path in paths {
            let Some(name) = path.file_name().map(|name| name.to_string_lossy().to_lowercase())
            else {
                continue;
            };
            if path.is_dir() {
                if !name.starts_with('.') {
                    parts.push(name);
                    self.add(&path, parts, deepest, visited);
                    parts.pop();
                }
            } else if is_image(&name) && self.files.len() < MOST_FILES {
                let stem = stem(&name).to_owned();
                self.by_stem.entry(stem.clone()).or_default().push(self.files.len());
                let own = parts.iter().cloned().chain([stem]).collect();
                self.files.push((path, own));
            }
        }
    }

    /// The photograph that a source's name or path means.
    pub fn find(&self, name: &str) -> Found {
        let name = inside::tail(name).to_lowercase();
        let mut parts: Vec<&str> = name.split('/').collect();
        let last = parts.pop().unwrap_or_default();
        // "img.001" has a dot, but no extension of an image.
        let own_stem = if is_image(last) { stem(last) } else { last };
        parts.push(own_stem);
        let Some(candidates) = self.by_stem.get(own_stem) else { return Found::None };
        let score = |index: usize| {
            let (path, own) = &self.files[index];
            let shared =
                own.iter().rev().zip(parts.iter().rev()).take_while(|(a, b)| a == b).count();
            let extension = path
                .extension()
                .map_or_else(String::new, |own| own.to_string_lossy().to_lowercase());
            let is_radiance = ["exr", "hdr"].contains(&extension.as_str());
            let is_same = last.ends_with(&format!(".{extension}"));
            (shared, is_radiance, is_same, !raw::is_raw(path))
        };
        let best = candidates.iter().map(|&index| score(index)).max();
        let mut winners = candidates.iter().filter(|&&index| Some(score(index)) == best);
        match (winners.next(), winners.next()) {
            (Some(&only), None) => Found::One(self.files[only].0.clone()),
            (Some(_), Some(_)) => Found::Several,
            _ => Found::None,
        }
    }

    /// All photographs in the order of their paths: RAW files only where there is no other of that
    /// name.
    pub fn all(&self) -> Vec<PathBuf> {
        let developed: HashSet<&[String]> = self
            .files
            .iter()
            .filter(|(path, _)| !raw::is_raw(path))
            .map(|(_, own)| &own[..])
            .collect();
        self.files
            .iter()
            .filter(|(path, own)| !raw::is_raw(path) || !developed.contains(&own[..]))
            .map(|(path, _)| path.clone())
            .collect()
    }
}

/// Whether a file's name is one that photographs have.
pub fn is_photograph(file: &Path) -> bool {
    file.file_name().is_some_and(|name| is_image(&name.to_string_lossy().to_lowercase()))
}

fn is_image(name: &str) -> bool {
    raw::is_raw(Path::new(name))
        || name.rsplit_once('.').is_some_and(|(_, own)| EXTENSIONS.contains(&own))
}

fn stem(name: &str) -> &str {
    name.rsplit_once('.').map_or(name, |(stem, _)| stem)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_other_machines_are_found() {
        let folder = tempfile::tempdir().unwrap();
        let put = |name: &str| {
            let path = folder.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(&path, "").unwrap();
            path
        };
        let (left, right) = (put("left/a.png"), put("right/a.png"));
        let (jpeg, exr) = (put("É b.JPG"), put("hdr/é b.exr"));
        let (dotted, _) = (put("img.001.png"), put("notes.txt"));
        let photographs = Photographs::below(&[folder.path().to_owned()]);
        let one = |path: &PathBuf| Found::One(path.clone());
        assert_eq!(photographs.find("D:\\photos\\LEFT\\a.png"), one(&left));
        assert_eq!(photographs.find("/x/right/a.jpg"), one(&right));
        assert_eq!(photographs.find("a.png"), Found::Several);
        assert_eq!(photographs.find("É b.jpg"), one(&exr));
        assert_ne!(photographs.find("É b.jpg"), one(&jpeg));
        assert_eq!(photographs.find("./img.001"), one(&dotted));
        assert_eq!(photographs.find("notes.txt"), Found::None);
        // Cameras write both; programs were given one of them.
        let (raw, jpeg) = (put("c.NEF"), put("c.jpg"));
        let photographs = Photographs::below(&[folder.path().to_owned()]);
        assert_eq!(photographs.find("c.nef"), one(&raw));
        assert_eq!(photographs.find("c"), one(&jpeg));
        assert!(photographs.all().contains(&jpeg) && !photographs.all().contains(&raw));
    }
}
