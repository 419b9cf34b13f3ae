//! The terminal commands. Thin: they parse, drive the worker, and print.

mod arguments;
mod chart;
mod color_space;
mod export;
mod import;
mod info;
mod job;
mod masks;
mod merge;
mod model;
mod modelling;
mod new;
mod photographs;
mod print;
mod probe;
mod progress;
mod reconstruct;
mod recovered;
mod reference;
mod render;
mod report;
mod score;
mod study;
#[cfg(feature = "studio")]
mod window;

use std::process::ExitCode;

use print::note_line;

use crate::io;
use crate::worker::record_panics;

/// How a command ended otherwise than well.
#[derive(Debug)]
pub(crate) enum Ending {
    /// The input or an option is at fault.
    Failed(anyhow::Error),
    /// Ctrl-C.
    Cancelled,
}

impl<E: Into<anyhow::Error>> From<E> for Ending {
    fn from(error: E) -> Self {
        Self::Failed(error.into())
    }
}

/// Runs the command line and gives its exit code: 0 done, 1 input or option at fault, 2 wrong
/// usage, 130 cancelled.
pub fn main() -> ExitCode {
    record_panics();
    let matches = match arguments::command().try_get_matches() {
        Ok(matches) => matches,
        Err(error) => {
            // Help and version come this way too, with code 0.
            let code = error.exit_code();
            let _ = error.print();
            return ExitCode::from(code as u8);
        }
    };
    let state = io::settings::state();
    io::logfile::start(state.as_deref(), matches.get_flag("verbose"));
    let arguments: Vec<_> = std::env::args_os().skip(1).collect();
    log::info!(
        "lobelia {} on {} {}: {}",
        env!("CARGO_PKG_VERSION"),
        std::env::consts::OS,
        std::env::consts::ARCH,
        arguments.join(" ".as_ref()).display()
    );
    let ending = match matches.subcommand() {
        Some(("reconstruct", matches)) => reconstruct::run(matches),
        Some(("chart", matches)) => chart::run(matches),
        Some(("masks", matches)) => masks::run(matches),
        Some(("probe", matches)) => probe::run(matches),
        Some(("render", matches)) => render::run(matches),
        Some(("merge", matches)) => merge::run(matches),
        Some(("new", matches)) => new::run(matches),
        Some(("model", matches)) => model::run(matches),
        Some(("export", matches)) => export::run(matches),
        Some(("import", matches)) => import::run(matches),
        Some(("info", matches)) => info::run(matches),
        Some(("score", matches)) => score::run(matches),
        Some(("study", matches)) => study::run(matches),
        Some(("reference", matches)) => reference::run(matches),
        #[cfg(feature = "studio")]
        _ => window::run(matches.get_one::<std::path::PathBuf>("open").cloned()),
        #[cfg(not(feature = "studio"))]
        _ => Ok(()),
    };
    match ending {
        Ok(()) => ExitCode::SUCCESS,
        Err(Ending::Failed(error)) => {
            let message = once_each(error.chain().map(ToString::to_string));
            log::error!("{message}");
            note_line!("error: {message}");
            ExitCode::from(1)
        }
        Err(Ending::Cancelled) => {
            note_line!("cancelled; nothing was half-written");
            ExitCode::from(130)
        }
    }
}

/// The messages of an error and of its causes in a line, without those that an earlier one repeats.
fn once_each(messages: impl Iterator<Item = String>) -> String {
    messages.fold(String::new(), |told, next| match told.as_str() {
        "" => next,
        _ if told.contains(&next) => told,
        _ => format!("{told}: {next}"),
    })
}
