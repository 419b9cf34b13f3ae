//! The text of a report of a problem: version, graphics adapter, options and log. It contains no
//! photographs.

use std::fmt::Write;

use super::state::State;
use crate::io::logfile;

/// What is known of the program, the open project and the last things that happened.
pub fn of(state: &State) -> String {
    let mut text = format!(
        "lobelia {} on {} {}, {} threads\nGraphics adapter: {}\n",
        env!("CARGO_PKG_VERSION"),
        std::env::consts::OS,
        std::env::consts::ARCH,
        std::thread::available_parallelism().map_or(1, usize::from),
        state.adapter
    );
    match &state.project {
        None => text.push_str("No capture is open\n"),
        Some(project) => {
            let capture = &project.loaded;
            let _ = writeln!(
                text,
                "Capture: {} photographs, {} triangles, {} materials",
                capture.photographs.len(),
                capture.mesh.triangles.len(),
                project.edit().materials.len()
            );
            let options = &project.edit().options;
            let changed: Vec<String> = options
                .declarations()
                .into_iter()
                .filter_map(|own| {
                    let value = options.get(own.section, own.name)?;
                    (value != own.default).then(|| format!("{}={value}", own.flag()))
                })
                .collect();
            let changed = if changed.is_empty() { "none".to_owned() } else { changed.join(" ") };
            let _ = writeln!(text, "Options that differ from the defaults: {changed}");
        }
    }
    if let Some(path) = logfile::path() {
        let _ = writeln!(text, "Log file: {}", path.display());
    }
    text.push_str("\nWhat happened:\n");
    for line in logfile::recent() {
        text.push_str(&line);
        text.push('\n');
    }
    text
}
