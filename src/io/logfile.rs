//! The log: what the program did, for reports of problems. Lines go to a file in the user's state
//! folder, to memory, and to stderr where that was asked for.
//!
//! It never holds what photographs show; paths of files are in it.

use std::collections::VecDeque;
use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::{SystemTime, UNIX_EPOCH};

use log::{Level, LevelFilter, Log, Metadata, Record};

/// Size at which the file becomes `lobelia.log.old` and a new one is begun.
const LARGEST: u64 = 1 << 20;
/// As many lines are kept in memory.
const KEPT: usize = 300;

static LOGGER: OnceLock<Logger> = OnceLock::new();

struct Logger {
    path: Option<PathBuf>,
    verbose: bool,
    lines: Mutex<Lines>,
}

#[derive(Default)]
struct Lines {
    file: Option<File>,
    written: u64,
    recent: VecDeque<String>,
}

/// Begins to log into a folder, or into memory alone; with `verbose` also to stderr, in more
/// detail. Later calls change nothing. Where the file cannot be written, all else works.
pub fn start(folder: Option<&Path>, verbose: bool) {
    let path = folder.map(|folder| folder.join("lobelia.log"));
    let lines = Mutex::new(path.as_deref().map(Lines::opened).unwrap_or_default());
    let has_file = lines.lock().is_ok_and(|lines| lines.file.is_some());
    let logger = LOGGER.get_or_init(|| Logger { path: path.filter(|_| has_file), verbose, lines });
    if log::set_logger(logger).is_ok() {
        log::set_max_level(if verbose { LevelFilter::Debug } else { LevelFilter::Info });
    }
}

/// The file that is written, if there is one.
pub fn path() -> Option<&'static Path> {
    LOGGER.get()?.path.as_deref()
}

/// Whether lines are shown on stderr.
pub fn is_verbose() -> bool {
    LOGGER.get().is_some_and(|logger| logger.verbose)
}

/// The newest lines, oldest first.
pub fn recent() -> Vec<String> {
    let Some(logger) = LOGGER.get() else { return Vec::new() };
    let lines = logger.lines.lock().unwrap_or_else(PoisonError::into_inner);
    lines.recent.iter().cloned().collect()
}

impl Log for Logger {
    fn enabled(&self, metadata: &Metadata) -> bool {
        // The crates of the window tell much; of them only what is wrong counts.
        let is_own = metadata.target().starts_with("lobelia");
        metadata.level() <= if is_own { Level::Debug } else { Level::Warn }
    }

    fn log(&self, record: &Record) {
        if !self.enabled(record.metadata()) {
            return;
        }
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let text = record.args().to_string().replace('\n', "\n    ");
        let line = format!("{} {:<5} {text}", utc(since.as_secs()), record.level());
        if self.verbose {
            // Nobody may be left to read it.
            let _ = writeln!(std::io::stderr(), "{line}");
        }
        let mut lines = self.lines.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(path) = self.path.as_deref().filter(|_| lines.written > LARGEST) {
            let recent = std::mem::take(&mut lines.recent);
            *lines = Lines { recent, ..Lines::opened(path) };
        }
        lines.add(line);
    }

    fn flush(&self) {}
}

impl Lines {
    /// Goes on with the file, or with a new one where it is large. Several running programs may
    /// append to it, each line in one piece.
    fn opened(path: &Path) -> Self {
        let open = || -> std::io::Result<(File, u64)> {
            if let Some(folder) = path.parent() {
                fs::create_dir_all(folder)?;
            }
            if fs::metadata(path).is_ok_and(|file| file.len() > LARGEST) {
                fs::rename(path, path.with_extension("log.old"))?;
            }
            let file = OpenOptions::new().create(true).append(true).open(path)?;
            let written = file.metadata()?.len();
            Ok((file, written))
        };
        match open() {
            Ok((file, written)) => Self { file: Some(file), written, ..Self::default() },
            Err(_) => Self::default(),
        }
    }

    fn add(&mut self, mut line: String) {
        if self.recent.len() >= KEPT {
            self.recent.pop_front();
        }
        self.recent.push_back(line.clone());
        if let Some(file) = &mut self.file {
            line.push('\n');
            if file.write_all(line.as_bytes()).is_err() {
                // The disk is full or gone: memory goes on.
                self.file = None;
            }
            self.written += line.len() as u64;
        }
    }
}

/// Seconds since 1970 as a date and time of day, in UTC: `2026-11-23 19:00:00`.
fn utc(seconds: u64) -> String {
    // The Gregorian calendar repeats every 400 years of 146,097 days; years begin in March here, so
    // that a leap day is the last of its year.
    let days = seconds / 86_400 + 719_468;
    let (era, day) = (days / 146_097, days % 146_097);
    let year = (day - day / 1_460 + day / 36_524 - day / 146_096) / 365;
    let day = day - (365 * year + year / 4 - year / 100);
    let month = (5 * day + 2) / 153;
    let day = day - (153 * month + 2) / 5 + 1;
    let (year, month) = match month {
        0..=9 => (400 * era + year, month + 3),
        _ => (400 * era + year + 1, month - 9),
    };
    let (hour, minute, second) = (seconds / 3600 % 24, seconds / 60 % 60, seconds % 60);
    format!("{year}-{month:02}-{day:02} {hour:02}:{minute:02}:{second:02}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_are_dates() {
        // From `date -u -d @SECONDS`.
        for (seconds, text) in [
            (0, "1970-01-01 00:00:00"),
            (951_782_399, "2000-02-28 23:59:59"),
            (951_868_799, "2000-02-29 23:59:59"),
            (951_868_800, "2000-03-01 00:00:00"),
            (1_735_689_599, "2024-12-31 23:59:59"),
            (4_107_542_400, "2100-03-01 00:00:00"),
        ] {
            assert_eq!(utc(seconds), text);
        }
    }

    #[test]
    fn a_large_file_is_put_aside_once() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("state/lobelia.log");
        let mut lines = Lines::opened(&path);
        lines.add("first".to_owned());
        lines.add("x".repeat(LARGEST as usize));
        assert!(lines.written > LARGEST);
        let mut lines = Lines::opened(&path);
        lines.add("second".to_owned());
        let old = fs::read_to_string(folder.path().join("state/lobelia.log.old")).unwrap();
        assert!(old.starts_with("first\n"));
        assert_eq!(fs::read_to_string(&path).unwrap(), "second\n");
        assert_eq!(Lines::opened(&path).written, 7);
    }

    #[test]
    fn without_a_place_lines_are_kept_in_memory() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        fs::write(&file, "").unwrap();
        let mut lines = Lines::opened(&file.join("lobelia.log"));
        assert!(lines.file.is_none());
        for number in 0..KEPT + 5 {
            lines.add(number.to_string());
        }
        assert_eq!((lines.recent.len(), lines.recent[0].as_str()), (KEPT, "5"));
    }
}
