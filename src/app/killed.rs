//! Tests that the last save is complete when the process is killed during the next one.

use std::io::{BufRead, BufReader, Write as _};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::Arc;

use super::change::Change;
use super::relight::{self, NewLight};
use super::walk::{capture, count_of, open, save};
use crate::math::sampling::Random;
use crate::render::edits::Edits;

/// Tells the child which file to save to.
const FILE: &str = "LOBELIA_TEST_SAVES_TO";
const KILLED: usize = 24;

/// The lights of the state of a number: any other count would be half a state.
fn lights_of(number: usize) -> usize {
    number % 40
}

/// Saves states of rising numbers until it is killed, and tells each that is saved.
fn save_on_and_on(file: &Path) {
    let loaded = capture();
    let mut project = open(file, &loaded);
    let mut number = project.edit().options.samples.count;
    let mut out = std::io::stdout();
    loop {
        number += 1;
        project.change(&count_of(number)).unwrap();
        let mut edits = Edits::default();
        for _ in 0..lights_of(number) {
            edits = relight::with_light(&edits, NewLight::Spot, &loaded, 1.0);
        }
        let edits = Arc::new(edits);
        project.change(&Change::Relight { name: "lights", of: None, edits }).unwrap();
        save(&project, file);
        writeln!(out, "saved {number}").unwrap();
        out.flush().unwrap();
    }
}

#[test]
fn what_was_saved_is_whole_after_kill_9() {
    if let Some(file) = std::env::var_os(FILE) {
        save_on_and_on(Path::new(&file));
    }
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("killed.lobelia");
    std::fs::write(&file, r#"{"version": 3, "capture": ".", "materials": []}"#).unwrap();
    let loaded = capture();
    let mut project = open(&file, &loaded);
    // Twice, so that the file before it is one of these, too.
    for number in [960, 1000] {
        project.change(&count_of(number)).unwrap();
        save(&project, &file);
    }
    let mut random = Random::new(3, 0, 0);
    let mut last = 1000;
    for round in 0..KILLED {
        let own = "app::killed::what_was_saved_is_whole_after_kill_9";
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args([own, "--exact", "--nocapture"])
            .env(FILE, &file)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let lines = BufReader::new(child.stdout.take().unwrap()).lines().map_while(Result::ok);
        let mut numbers = lines.filter_map(|line| {
            line.split_once("saved ").and_then(|(_, number)| number.parse::<usize>().ok())
        });
        // After some saves, into the middle of whatever comes next.
        let first = numbers.nth(random.below(6)).expect("the child saves");
        for _ in 0..random.below(400) {
            std::thread::yield_now();
        }
        child.kill().unwrap();
        child.wait().unwrap();
        let saved = numbers.last().unwrap_or(first);
        for file in [file.clone(), folder.path().join("killed.lobelia~")] {
            let project = open(&file, &loaded);
            let number = project.edit().options.samples.count;
            let lights = project.edit().relight.lights.len();
            assert_eq!(lights, lights_of(number), "round {round}: {number}");
        }
        let number = open(&file, &loaded).edit().options.samples.count;
        assert!(number >= saved, "round {round}: {number} is there, {saved} was saved");
        assert!(saved > last, "round {round}");
        last = number;
    }
}
