//! The studies as commands: parts of them, taken up again, collected and charted.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn corner() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/examples/corner")
}

fn study(arguments: &[&str], out: &Path) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lobelia"));
    command.env("XDG_STATE_HOME", env!("CARGO_TARGET_TMPDIR"));
    command
        .arg("study")
        .arg(arguments[0])
        .arg(corner())
        .args(["--out", out.to_str().unwrap(), "--quick", "--quiet"])
        .args(&arguments[1..])
        .output()
        .unwrap()
}

fn text(output: &Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout.clone()).unwrap()
}

/// The number of the run with a name.
fn number_of(listed: &str, name: &str) -> String {
    let line = listed.lines().find(|line| line.contains(name)).unwrap();
    line.split('\t').next().unwrap().to_owned()
}

fn rows(file: &Path) -> Vec<Vec<String>> {
    // None of the cells looked at here has a comma of its own but the setting's, which is quoted.
    let unquoted = |line: &str| -> Vec<String> {
        let mut cells = vec![String::new()];
        let mut quoted = false;
        for letter in line.chars() {
            match letter {
                '"' => quoted = !quoted,
                ',' if !quoted => cells.push(String::new()),
                other => cells.last_mut().unwrap().push(other),
            }
        }
        cells
    };
    fs::read_to_string(file).unwrap().lines().map(unquoted).collect()
}

fn column(rows: &[Vec<String>], name: &str) -> Vec<String> {
    let index = rows[0].iter().position(|cell| cell == name).unwrap();
    rows[1..].iter().map(|row| row[index].clone()).collect()
}

#[test]
fn runs_of_a_study_of_speed_are_done_one_by_one_and_collected() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path();
    let listed = text(&study(&["speed", "--list"], out));
    assert!(!out.join("runs").exists(), "a list runs nothing");
    for name in ["paper, least", "least, 150 samples"] {
        text(&study(&["speed", "--only", &number_of(&listed, name)], out));
    }
    assert!(!out.join("speed.csv").exists(), "a part makes no charts");
    let told = text(&study(&["speed", "--collect"], out));
    assert!(told.contains("2 of "), "{told}");

    let table = rows(&out.join("speed.csv"));
    assert_eq!(column(&table, "setting"), ["paper, least", "least, 150 samples"]);
    for name in [
        "total_s",
        "error_raw",
        "error_one_scale",
        "blocks_relative_rms",
        "photograph_relative_rms",
        "photograph_flip",
        "photograph_hdr_flip",
    ] {
        for cell in column(&table, name) {
            let value: f64 = cell.parse().unwrap();
            assert!(value.is_finite() && value > 0.0 && value < 100.0, "{name}: {value}");
        }
    }
    let svg = fs::read_to_string(out.join("corner.svg")).unwrap();
    assert!(svg.contains("prefers-color-scheme") && svg.contains("least, 150 samples"));
    assert!(!svg.contains("NaN") && !svg.contains("inf"));
    for file in ["corner.png", "corner-dark.png"] {
        assert_eq!(&fs::read(out.join(file)).unwrap()[1..4], b"PNG");
    }

    // Taken up again, what is done is left as it is.
    let files = || -> Vec<(PathBuf, Vec<u8>)> {
        let mut all: Vec<_> =
            fs::read_dir(out.join("runs")).unwrap().map(|e| e.unwrap().path()).collect();
        all.sort();
        all.into_iter().map(|file| (file.clone(), fs::read(file).unwrap())).collect()
    };
    let before = files();
    text(&study(&["speed", "--only", &number_of(&listed, "paper, least")], out));
    assert_eq!(files(), before);

    let wrong = study(&["speed", "--only", "9999"], out);
    assert_eq!(wrong.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&wrong.stderr).contains("--list"));
}

#[test]
fn a_study_of_stability_reports_in_words_and_charts() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path();
    let listed = text(&study(&["stability", "--list"], out));
    for name in
        ["as it is · paper · 1", "Image noise 80 · paper · 1", "Surfaces missing 3 · paper · 1"]
    {
        text(&study(&["stability", "--only", &number_of(&listed, name)], out));
    }
    let told = text(&study(&["stability", "--collect"], out));
    assert!(told.contains("0 stopped with an internal error, 0 gave a number"), "{told}");
    let table = rows(&out.join("stability.csv"));
    let errors = column(&table, "error");
    assert_eq!(errors.len(), 3);
    assert!(errors.iter().all(|cell| cell.parse::<f64>().is_ok_and(|e| e > 0.0 && e < 1.0)));
    assert!(column(&table, "finite").iter().all(|cell| cell == "true"));
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains("<svg") && page.contains("Image noise"));
    for outside in ["src=", "href=", "url("] {
        assert!(!page.contains(outside), "the page needs nothing beside it");
    }
}

/// The job template, run by Open Job Description's own program where Python has it.
#[test]
fn the_template_of_a_farm_runs() {
    let Some(python) = std::env::var_os("LOBELIA_PYTHON") else {
        crate::skip::skip("LOBELIA_PYTHON names no Python with openjd-cli");
        return;
    };
    let openjd = |arguments: &[&str]| {
        let template = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/farm/study.openjd.yaml");
        Command::new(&python)
            .args(["-m", "openjd", arguments[0]])
            .arg(template)
            .args(&arguments[1..])
            .output()
            .unwrap()
    };
    if !openjd(&["check"]).status.success() {
        let found = Command::new(&python).args(["-c", "import openjd.cli"]).status().unwrap();
        assert!(!found.success(), "the template is refused");
        crate::skip::skip("this Python has no openjd-cli");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let (captures, out_text) = (corner(), out.to_str().unwrap().to_owned());
    let run = openjd(&[
        "run",
        "--step",
        "Charts",
        "--run-dependencies",
        "-p",
        &format!("Program={}", env!("CARGO_BIN_EXE_lobelia")),
        "-p",
        &format!("Captures={}", captures.display()),
        "-p",
        &format!("Out={out_text}"),
        "-p",
        "Last=0",
    ]);
    let told = String::from_utf8_lossy(&run.stdout).into_owned();
    assert!(run.status.success(), "{told}{}", String::from_utf8_lossy(&run.stderr));
    assert_eq!(rows(&out.join("speed.csv")).len(), 2, "a heading and the one run");
}
