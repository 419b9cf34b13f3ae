//! Checks that cannot be made on this machine.

use std::io::Write as _;

/// Says that a check is not made, and why. `tests/run.sh` counts these lines at its end: a test that
/// skips its check passes, and nobody reads what passing tests print.
pub fn skip(reason: &str) {
    println!("skipped: {reason}");
    let Some(file) = std::env::var_os("LOBELIA_SKIPPED") else { return };
    let test = std::thread::current().name().unwrap_or("a test").to_owned();
    let mut file = std::fs::OpenOptions::new().append(true).create(true).open(file).unwrap();
    file.write_all(format!("{test}: {reason}\n").as_bytes()).unwrap();
}
