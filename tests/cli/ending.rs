use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};

#[cfg(unix)]
use nix::sys::signal::{Signal, kill};
#[cfg(unix)]
use nix::unistd::Pid;

use crate::{Copy, Run, coarse, coarse_by, example, files_below, lobelia};

/// Starts a reconstruction that takes minutes and returns once it gathers rays.
fn start_long(out: &Path) -> (Child, BufReader<std::process::ChildStderr>) {
    let mut command = lobelia();
    command.arg("reconstruct").arg(example()).arg("--out").arg(out);
    command.args(["--transport.rays", "100000", "--threads", "1"]);
    let mut child =
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the program starts");
    let mut lines = BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    while line.trim() != "transport" {
        line.clear();
        assert!(lines.read_line(&mut line).unwrap() > 0, "it ended before its transport");
    }
    (child, lines)
}

#[cfg(unix)]
fn send(child: &Child, signal: Signal) {
    kill(Pid::from_raw(child.id().try_into().unwrap()), signal).expect("the signal is sent");
}

#[cfg(unix)]
#[test]
fn an_interrupt_ends_with_130_and_leaves_nothing_behind() {
    for signal in [Signal::SIGINT, Signal::SIGTERM] {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        let (child, mut lines) = start_long(&out);
        send(&child, signal);
        let mut rest = String::new();
        lines.read_to_string(&mut rest).unwrap();
        let ended = child.wait_with_output().unwrap();
        assert_eq!(ended.status.code(), Some(130), "{rest}");
        assert!(ended.stdout.is_empty());
        assert!(rest.contains("cancelled") && !rest.contains("panicked"), "{rest}");
        assert_eq!(files_below(folder.path()), [] as [String; 0]);
    }
}

#[cfg(unix)]
#[test]
fn an_interrupt_leaves_an_earlier_solution_as_it_was() {
    let copy = Copy::new();
    copy.reconstruct().succeeds();
    let contents = || -> Vec<(String, Vec<u8>)> {
        let read = |name: String| (name.clone(), fs::read(copy.out().join(name)).unwrap());
        files_below(&copy.out()).into_iter().map(read).collect()
    };
    let before = contents();
    let (child, mut lines) = start_long(&copy.out());
    send(&child, Signal::SIGINT);
    lines.read_to_end(&mut Vec::new()).unwrap();
    assert_eq!(child.wait_with_output().unwrap().status.code(), Some(130));
    assert!(before == contents());
}

#[test]
fn a_place_that_cannot_be_written_is_refused_before_work_begins() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, "mine").unwrap();
    let refused = |out: &Path, parts: &[&str]| {
        let run = Run::of(&mut coarse(&example(), out)).fails(1, parts);
        assert!(!run.err.contains("samples"), "work has begun: {}", run.err);
    };
    refused(&file, &["file", "cannot be written", "no folder"]);
    refused(&file.join("below"), &["file", "cannot be written"]);
    assert_eq!(fs::read_to_string(&file).unwrap(), "mine");
    if cfg!(target_os = "linux") {
        // Nobody may make a folder there, not even root.
        refused(Path::new("/proc/lobelia/out"), &["/proc", "cannot be written", "permissions"]);
    }
}

#[test]
fn missing_folders_are_made_and_others_files_kept() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("a/b c/ö");
    fs::create_dir_all(&out).unwrap();
    fs::write(out.join("notes.txt"), "mine").unwrap();
    Run::of(&mut coarse(&example(), &out)).succeeds();
    assert_eq!(fs::read_to_string(out.join("notes.txt")).unwrap(), "mine");
    let deeper = out.join("c/d");
    Run::of(&mut coarse(&example(), &deeper)).succeeds();
    assert!(deeper.join("solution.json").exists());
}

#[test]
fn a_summary_never_stands_beside_files_of_another_solution() {
    let copy = Copy::new();
    copy.reconstruct().succeeds();
    // Something is in the way of the second file that is written.
    fs::remove_file(copy.out().join("samples.csv")).unwrap();
    fs::create_dir_all(copy.out().join("samples.csv/mine")).unwrap();
    copy.reconstruct().fails(1, &["samples.csv", "cannot be written"]);
    // No solution.json, and no temporary file either.
    assert_eq!(files_below(&copy.out()), ["convergence.csv", "lights.json"]);
}

#[test]
fn scores_that_cannot_be_written_are_refused() {
    let copy = Copy::new();
    copy.reconstruct().succeeds();
    let mut command = lobelia();
    command.arg("score").arg(copy.capture()).arg(copy.out());
    let run = Run::of(command.arg("--json").arg(copy.file("tags.json").join("score.json")));
    assert_eq!(run.code, Some(1), "{run:?}");
    run.says(&["score.json", "cannot be written"]);
}

#[test]
fn progress_is_plain_lines_and_stdout_has_results_only() {
    let copy = Copy::new();
    let run = copy.reconstruct().succeeds();
    let lines: Vec<&str> = run.err.lines().collect();
    for stage in ["load", "samples", "lights", "transport", "solve", "textures"] {
        assert_eq!(lines.iter().filter(|line| **line == stage).count(), 1, "{stage}: {lines:?}");
    }
    assert!(lines.iter().any(|line| line.starts_with("  iteration 1: relative RMS")));
    assert!(!run.err.contains(['\r', '\u{1b}']), "{:?}", run.err);
    assert!(!run.out.contains("iteration 1:") && !run.out.lines().any(|line| line == "solve"));
    for part in ["samples, ", "floor  diffuse", "seconds: load", "written to"] {
        assert!(run.out.contains(part), "\"{part}\" is missing in: {}", run.out);
    }
    let quiet = Run::of(coarse_by("paper", &copy.capture(), &copy.out()).arg("--quiet")).succeeds();
    assert_eq!(quiet.err, "");
    assert!(quiet.out.contains("written to"));
}

#[test]
fn a_reader_that_has_seen_enough_is_no_fault() {
    // As with `lobelia … 2>&1 | head -1`.
    let copy = Copy::new();
    let ends_with = |command: &mut Command, code: i32| {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        command.stdout(writer.try_clone().unwrap()).stderr(writer);
        assert_eq!(command.status().unwrap().code(), Some(code), "{command:?}");
    };
    ends_with(lobelia().arg("--help"), 0);
    ends_with(lobelia().arg("info").arg(copy.capture()), 0);
    ends_with(lobelia().arg("info").arg(copy.file("lost")), 1);
    ends_with(&mut coarse(&copy.capture(), &copy.out()), 0);
    ends_with(lobelia().arg("score").arg(copy.capture()).arg(copy.out()), 0);
}

#[test]
fn the_log_tells_what_was_run_and_what_failed() {
    let folder = tempfile::tempdir().unwrap();
    let lost = folder.path().join("lost");
    let info = |state: &std::path::Path| {
        let mut command = lobelia();
        command.env("XDG_STATE_HOME", state).arg("info").arg(&lost);
        command
    };
    let quiet = Run::of(&mut info(folder.path())).fails(1, &["lost", "Check that it exists"]);
    assert!(!quiet.err.contains("ERROR"), "{quiet:#?}");
    let log = std::fs::read_to_string(folder.path().join("lobelia/lobelia.log")).unwrap();
    for part in [concat!("INFO  lobelia ", env!("CARGO_PKG_VERSION")), "ERROR ", "lost"] {
        assert!(log.contains(part), "\"{part}\" is missing in: {log}");
    }
    // Shown as well; and a place that cannot be written harms nothing.
    let nowhere = lost.join("under/nothing");
    std::fs::write(&lost, "a file").unwrap();
    Run::of(info(&nowhere).arg("--verbose")).fails(1, &["INFO  lobelia ", "ERROR "]);
}
