//! What the window stores between sessions in the user's folder: settings, recent projects, and
//! unsaved work for recovery after a crash.

use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::project::{self, ProjectFile};
use super::{Error, atomic, results};

/// As many recent projects are remembered.
const RECENT: usize = 12;

/// Settings of the window. Reading is lenient: a damaged or newer file means the defaults, since
/// losing a preference is no reason not to start.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Settings {
    /// "dark", "light" or "system".
    pub theme: String,
    /// 1 is the system's own scale.
    pub scale: f32,
    /// What traces the paths of pictures: "auto" or "processor".
    pub engine: String,
    /// Captures and project files, the latest first.
    pub recent: Vec<PathBuf>,
    /// Width and height of the window in points at 100 %; `None` before it was closed once.
    pub window: Option<[f32; 2]>,
    /// Whether it filled the screen.
    pub is_maximized: bool,
    /// How the panels were arranged.
    pub layout: Value,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            theme: "dark".to_owned(),
            scale: 1.0,
            engine: "auto".to_owned(),
            recent: Vec::new(),
            window: None,
            is_maximized: false,
            layout: Value::Null,
        }
    }
}

impl Settings {
    /// Reads the settings of a folder.
    pub fn read(folder: &Path) -> Self {
        let text = std::fs::read_to_string(settings_file(folder)).unwrap_or_default();
        let mut settings: Self = serde_json::from_str(&text).unwrap_or_default();
        settings.scale =
            if settings.scale.is_finite() { settings.scale.clamp(0.75, 2.0) } else { 1.0 };
        settings.recent.truncate(RECENT);
        settings.window = settings.window.filter(|size| size.iter().all(|side| side.is_finite()));
        settings
    }

    pub fn write(&self, folder: &Path) -> Result<(), Error> {
        let file = settings_file(folder);
        let text = serde_json::to_string_pretty(self)
            .map_err(|error| Error::Write { file: file.clone(), source: error.into() })?;
        atomic::write_bytes(&file, text.as_bytes())
    }

    /// Puts a path in front of the recent ones.
    pub fn remember(&mut self, path: &Path) {
        self.recent.retain(|other| other != path);
        self.recent.insert(0, path.to_owned());
        self.recent.truncate(RECENT);
    }
}

fn settings_file(folder: &Path) -> PathBuf {
    folder.join("studio.json")
}

/// The user's folder for this program's settings; `None` where the system names no home.
pub fn home() -> Option<PathBuf> {
    user_folder("XDG_CONFIG_HOME", ".config", "APPDATA")
}

/// The user's folder for the log; `None` where the system names no home.
pub fn state() -> Option<PathBuf> {
    user_folder("XDG_STATE_HOME", ".local/state", "LOCALAPPDATA")
}

/// The user's folder for what programs install; `None` where the system names no home.
pub fn data() -> Option<PathBuf> {
    user_folder("XDG_DATA_HOME", ".local/share", "LOCALAPPDATA")
}

/// A folder by the conventions of the system: of freedesktop.org a variable or a place in the
/// home, on Windows a variable.
fn user_folder(variable: &str, in_home: &str, on_windows: &str) -> Option<PathBuf> {
    let folder = |name: &str| {
        let value = std::env::var_os(name).filter(|value| !value.is_empty());
        value.map(PathBuf::from)
    };
    let base = if cfg!(windows) {
        folder(on_windows)?
    } else if cfg!(target_os = "macos") {
        folder("HOME")?.join("Library/Application Support")
    } else {
        folder(variable).or_else(|| Some(folder("HOME")?.join(in_home)))?
    };
    Some(base.join("lobelia"))
}

/// The place of one running window's unsaved work. A lock on a file beside it tells other
/// windows that its owner lives; what a crash leaves behind is not locked.
pub struct Recovery {
    file: PathBuf,
    lock: Option<File>,
}

impl Recovery {
    /// Takes a place of its own in the settings' folder.
    pub fn claim(folder: &Path) -> std::io::Result<Self> {
        let folder = recovery_folder(folder);
        std::fs::create_dir_all(&folder)?;
        let mut number = 0;
        loop {
            let file = folder.join(format!("unsaved-{number}.{}", project::EXTENSION));
            let lock = File::create(lock_file(&file))?;
            match lock.try_lock() {
                // A file without an owner is somebody's unsaved work, still to be offered.
                Ok(()) if !file.exists() => return Ok(Self { file, lock: Some(lock) }),
                Ok(()) | Err(TryLockError::WouldBlock) => number += 1,
                // Where nothing can be locked there is no free place to be found.
                Err(TryLockError::Error(error)) => return Err(error),
            }
        }
    }

    /// Where the results of a run that is not saved are kept.
    pub fn results(&self) -> PathBuf {
        results::folder_of(&self.file)
    }

    /// Keeps a state of unsaved work.
    pub fn keep(&self, project: &ProjectFile) -> Result<(), Error> {
        project::write(&self.file, project)
    }

    /// Forgets it: all is saved, or not wanted.
    pub fn forget(&self) {
        // There may be none.
        let _ = std::fs::remove_file(&self.file);
        results::remove(&self.results());
    }
}

impl Drop for Recovery {
    fn drop(&mut self) {
        // What is still kept was neither saved nor given up: it is left to be recovered.
        self.lock = None;
        let _ = std::fs::remove_file(lock_file(&self.file));
    }
}

/// Unsaved work that can be recovered.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LeftBehind {
    pub file: PathBuf,
    /// The project file or capture that it is a state of.
    pub of: PathBuf,
    pub kept: Option<SystemTime>,
}

/// Unsaved work whose owner is gone.
pub fn left_behind(folder: &Path) -> Vec<LeftBehind> {
    let entries = std::fs::read_dir(recovery_folder(folder)).into_iter().flatten().flatten();
    let mut files: Vec<PathBuf> = entries
        .map(|entry| entry.path())
        .filter(|path| project::is_project(path))
        .filter(|path| match File::open(lock_file(path)) {
            Ok(lock) => lock.try_lock().is_ok(),
            Err(_) => true,
        })
        .collect();
    files.sort();
    let describe = |file: PathBuf| {
        let read = project::read(&file).ok();
        // What cannot be read is offered too: opening it says why.
        let of = read.map_or_else(|| file.clone(), |read| read.original.unwrap_or(read.capture));
        let kept = std::fs::metadata(&file).and_then(|metadata| metadata.modified()).ok();
        LeftBehind { file, of, kept }
    };
    files.into_iter().map(describe).collect()
}

/// Removes unsaved work that was recovered or is not wanted.
pub fn discard(file: &Path) {
    let _ = std::fs::remove_file(file);
    let _ = std::fs::remove_file(lock_file(file));
    results::remove(&results::folder_of(file));
}

fn recovery_folder(folder: &Path) -> PathBuf {
    folder.join("recovery")
}

fn lock_file(file: &Path) -> PathBuf {
    file.with_extension("lock")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damaged_settings_are_the_defaults() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(Settings::read(folder.path()), Settings::default());
        std::fs::write(folder.path().join("studio.json"), "{\"scale\": 1e9").unwrap();
        assert_eq!(Settings::read(folder.path()), Settings::default());
        let mut settings = Settings { scale: 1.25, ..Settings::default() };
        settings.remember(Path::new("/a"));
        settings.remember(Path::new("/b"));
        settings.remember(Path::new("/a"));
        assert_eq!(settings.recent, [PathBuf::from("/a"), PathBuf::from("/b")]);
        settings.write(folder.path()).unwrap();
        assert_eq!(Settings::read(folder.path()), settings);
    }

    #[test]
    fn only_what_a_crash_left_is_offered() {
        let folder = tempfile::tempdir().unwrap();
        let project = ProjectFile { capture: folder.path().to_owned(), ..Default::default() };
        let living = Recovery::claim(folder.path()).unwrap();
        living.keep(&project).unwrap();
        let offered = || -> Vec<PathBuf> {
            left_behind(folder.path()).into_iter().map(|left| left.file).collect()
        };
        assert_eq!(offered(), [] as [PathBuf; 0]);
        let crashed = Recovery::claim(folder.path()).unwrap();
        crashed.keep(&project).unwrap();
        let file = crashed.file.clone();
        drop(crashed);
        let left = left_behind(folder.path());
        assert_eq!((&left[0].file, left.len()), (&file, 1));
        assert!(
            left[0].of == dunce::canonicalize(folder.path()).unwrap() && left[0].kept.is_some()
        );
        // A new window takes a place of its own beside it.
        let next = Recovery::claim(folder.path()).unwrap();
        assert!(next.file != file && next.file != living.file);
        discard(&file);
        living.forget();
        drop((living, next));
        assert_eq!(offered(), [] as [PathBuf; 0]);
    }
}
