//! The terminal commands. Thin: they parse, drive the worker, and print.

mod arguments;
mod export;
mod import;
mod info;
mod job;
mod merge;
mod model;
mod modelling;
mod new;
mod print;
mod progress;
mod reconstruct;
mod recovered;
mod render;
mod report;
mod score;
mod study;
#[cfg(feature = "studio")]
mod window;

use std::process::ExitCode;

use print::note_line;

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
    quieten_caught_panics();
    let matches = match arguments::command().try_get_matches() {
        Ok(matches) => matches,
        Err(error) => {
            // Help and version come this way too, with code 0.
            let code = error.exit_code();
            let _ = error.print();
            return ExitCode::from(code as u8);
        }
    };
    let ending = match matches.subcommand() {
        Some(("reconstruct", matches)) => reconstruct::run(matches),
        Some(("render", matches)) => render::run(matches),
        Some(("merge", matches)) => merge::run(matches),
        Some(("new", matches)) => new::run(matches),
        Some(("model", matches)) => model::run(matches),
        Some(("export", matches)) => export::run(matches),
        Some(("import", matches)) => import::run(matches),
        Some(("info", matches)) => info::run(matches),
        Some(("score", matches)) => score::run(matches),
        Some(("study", matches)) => study::run(matches),
        #[cfg(feature = "studio")]
        _ => window::run(matches.get_one::<std::path::PathBuf>("open").cloned()),
        #[cfg(not(feature = "studio"))]
        _ => Ok(()),
    };
    match ending {
        Ok(()) => ExitCode::SUCCESS,
        Err(Ending::Failed(error)) => {
            note_line!("error: {error:#}");
            ExitCode::from(1)
        }
        Err(Ending::Cancelled) => {
            note_line!("cancelled; nothing was half-written");
            ExitCode::from(130)
        }
    }
}

/// Panics off the main thread are caught and become error messages: those of decoders on damaged
/// files, and the worker's. Rust's own report of them only confuses, unless it is asked for.
fn quieten_caught_panics() {
    if std::env::var_os("RUST_BACKTRACE").is_some() {
        return;
    }
    let report = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        if std::thread::current().name() == Some("main") {
            report(panic);
        }
    }));
}
