//! The program as a whole: arguments, messages, exit codes and files, through the binary.

mod cameras; // `new --cameras` with engines that are scripts
mod chart; // cards and charts read, refused, pinned
mod damaged; // captures that are broken: a message that helps, or a warning
mod determinism; // the same bytes on any number of threads
mod ending; // interrupts, places that cannot be written, closed pipes
mod export; // a recovered scene for other programs
mod files; // what `reconstruct` writes
mod import; // captures of other programs' cameras and meshes
mod info; // what `info` tells
mod joint; // a whole run with the default method
mod masks; // masks suggested, written, found again
mod memory; // what a run takes of memory, foreseen and measured
mod merge; // exposures merged: EXIF, grouping, times, refusals
mod modelling; // captures begun with photographs alone: new, model
mod options; // flags, options files, help
mod probe; // the light at a place from a mirror ball
mod reference; // the guide is what the program says
mod render; // pictures of a recovered scene
mod score; // `score` against the truth
mod surfaces; // textures and gloss

#[path = "../shared/displaced.rs"]
mod displaced;
#[path = "../shared/drawn_chart.rs"]
mod drawn_chart;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

/// The program, to be run where relative paths would show.
fn lobelia() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lobelia"));
    command.env("XDG_STATE_HOME", env!("CARGO_TARGET_TMPDIR"));
    command
}

/// Coarse settings for what does not ask how accurate the result is.
const COARSE: [&str; 8] = [
    "--samples.count",
    "400",
    "--transport.rays",
    "36",
    "--lobes.mask_px",
    "24",
    "--lights.rays_per_sample",
    "4",
];

/// The capture that comes with the program.
fn example() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/examples/corner")
}

/// What a finished run left.
#[derive(Debug)]
struct Run {
    code: Option<i32>,
    out: String,
    err: String,
}

impl Run {
    fn of(command: &mut Command) -> Self {
        let output = command.output().expect("the program starts");
        let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
        let run =
            Self { code: output.status.code(), out: text(output.stdout), err: text(output.stderr) };
        assert!(!run.err.contains("panicked"), "{run:#?}");
        assert!(!run.err.contains("internal error"), "{run:#?}");
        run
    }

    #[track_caller]
    fn succeeds(self) -> Self {
        assert_eq!(self.code, Some(0), "{self:#?}");
        self
    }

    /// Ended with `code`, and its message contains all `parts`.
    #[track_caller]
    fn fails(self, code: i32, parts: &[&str]) -> Self {
        assert_eq!(self.code, Some(code), "{self:#?}");
        assert_eq!(self.out, "", "results of a failure");
        self.says(parts)
    }

    /// stderr contains all `parts`.
    #[track_caller]
    fn says(self, parts: &[&str]) -> Self {
        for part in parts {
            assert!(self.err.contains(part), "\"{part}\" is missing in: {}", self.err);
        }
        self
    }
}

/// `reconstruct` with coarse settings and a single set of lights.
fn coarse(capture: &Path, out: &Path) -> Command {
    let mut command = coarse_by("joint", capture, out);
    command.args(["--joint.light_sets", "1"]);
    command
}

/// `reconstruct` with coarse settings and the method of that name.
fn coarse_by(method: &str, capture: &Path, out: &Path) -> Command {
    let mut command = lobelia();
    command.arg("reconstruct").arg(capture).arg("--out").arg(out).args(COARSE);
    command.args(["--method", method]);
    command
}

/// A copy of the example to be damaged, and a place for results.
struct Copy {
    folder: tempfile::TempDir,
}

impl Copy {
    fn new() -> Self {
        let copy = Self { folder: tempfile::tempdir().expect("a temporary folder") };
        fs::create_dir_all(copy.file("images")).unwrap();
        for file in ["scene.obj", "scene.mtl", "transforms.json", "tags.json", "truth.json"] {
            fs::copy(example().join(file), copy.file(file)).unwrap();
        }
        for image in fs::read_dir(example().join("images")).unwrap() {
            let image = image.unwrap();
            fs::copy(image.path(), copy.file("images").join(image.file_name())).unwrap();
        }
        copy
    }

    fn capture(&self) -> PathBuf {
        self.folder.path().join("capture")
    }

    fn file(&self, name: &str) -> PathBuf {
        self.capture().join(name)
    }

    fn out(&self) -> PathBuf {
        self.folder.path().join("out")
    }

    fn text(&self, name: &str) -> String {
        fs::read_to_string(self.file(name)).unwrap()
    }

    fn put(&self, name: &str, contents: impl AsRef<[u8]>) -> &Self {
        fs::write(self.file(name), contents).unwrap();
        self
    }

    /// Changes a text, which must contain `from`.
    #[track_caller]
    fn replace(&self, name: &str, from: &str, to: &str) -> &Self {
        let text = self.text(name);
        assert!(text.contains(from), "{name} has no \"{from}\"");
        self.put(name, text.replacen(from, to, 1))
    }

    /// Changes a JSON file.
    fn edit(&self, name: &str, change: impl FnOnce(&mut Value)) -> &Self {
        let mut value = json(&self.file(name));
        change(&mut value);
        self.put(name, value.to_string())
    }

    fn reconstruct(&self) -> Run {
        Run::of(&mut coarse(&self.capture(), &self.out()))
    }
}

fn json(file: &Path) -> Value {
    let text =
        fs::read_to_string(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", file.display()))
}

/// A table's columns by name; no cell of these tables is quoted.
struct Table {
    columns: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    fn read(file: &Path) -> Self {
        let text = fs::read_to_string(file).unwrap();
        let cells = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<_>>();
        let mut lines = text.lines();
        let columns = cells(lines.next().expect("a heading"));
        let rows: Vec<_> = lines.map(cells).collect();
        assert!(rows.iter().all(|row| row.len() == columns.len()));
        Self { columns, rows }
    }

    fn place(&self, column: &str) -> usize {
        let found = self.columns.iter().position(|name| name == column);
        found.unwrap_or_else(|| panic!("no column {column} in {:?}", self.columns))
    }

    /// A finite number.
    fn number(&self, row: usize, column: &str) -> f64 {
        let cell = &self.rows[row][self.place(column)];
        let number: f64 = cell.parse().unwrap_or_else(|_| panic!("{column}: \"{cell}\""));
        assert!(number.is_finite());
        number
    }
}

/// All files below a folder, by their path in it.
fn files_below(folder: &Path) -> Vec<String> {
    fn collect(root: &Path, folder: &Path, found: &mut Vec<String>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                collect(root, &path, found);
            } else {
                let path = path.strip_prefix(root).unwrap();
                found.push(path.to_string_lossy().replace('\\', "/"));
            }
        }
    }
    let mut found = Vec::new();
    if folder.exists() {
        collect(folder, folder, &mut found);
    }
    found.sort();
    found
}
