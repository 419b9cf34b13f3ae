//! Progress on stderr: a bar with count and time left on a terminal, plain lines elsewhere.

use std::io::IsTerminal;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::cli::print::note_line;
use crate::io::logfile;
use crate::reconstruct::Update;
use crate::reconstruct::solution::Iteration;
use crate::watch::Progress;

pub(super) struct Display {
    bar: ProgressBar,
    /// stderr is no terminal: a line a stage and an iteration instead of a bar.
    plain: bool,
    quiet: bool,
}

impl Display {
    pub(super) fn new(quiet: bool) -> Self {
        // Lines of the log would tear a bar.
        let terminal = std::io::stderr().is_terminal() && !logfile::is_verbose();
        let bar = if quiet || !terminal {
            ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden())
        } else {
            ProgressBar::new(0)
        };
        bar.set_style(
            ProgressStyle::with_template(
                "{prefix:<10} {wide_bar} {human_pos}/{human_len}  {eta} left  {msg}",
            )
            .unwrap_or_else(|_| ProgressStyle::default_bar()),
        );
        Self { bar, plain: !quiet && !terminal, quiet }
    }

    /// Names the stage that begins.
    pub(super) fn stage(&self, name: &str) {
        self.bar.reset();
        // Until the stage says how much there is to do.
        self.bar.set_length(1);
        self.bar.set_position(0);
        self.bar.set_prefix(name.to_owned());
        self.bar.set_message("");
        if self.plain {
            note_line!("{name}");
        }
    }

    pub(super) fn progress(&self, progress: Progress) {
        self.bar.set_length(progress.total.max(progress.done));
        self.bar.set_position(progress.done);
    }

    pub(super) fn update(&self, update: &Update) {
        match update {
            Update::Stage(stage) => self.stage(stage.name()),
            Update::Reused(stage) => self.note(&format!("{} kept", stage.name())),
            Update::Samples(cloud) => self.note(&format!("{} samples", cloud.samples.len())),
            Update::Lights(lights, lobes) => self.note(&format!(
                "{} virtual lights, {} lobes",
                lights.lights.len(),
                lobes.lobes.len()
            )),
            Update::Transport(_) => {}
            Update::Iteration(iteration) => self.note(&iteration_line(iteration)),
        }
    }

    /// Tells a step.
    pub(super) fn note(&self, text: &str) {
        self.bar.set_message(text.to_owned());
        if self.plain {
            note_line!("  {text}");
        }
    }

    /// Prints a line that stays, unless nothing is to be shown.
    pub(super) fn say(&self, text: &str) {
        if !self.quiet {
            self.bar.suspend(|| note_line!("{text}"));
        }
    }

    /// Takes the bar away.
    pub(super) fn clear(&self) {
        self.bar.finish_and_clear();
    }
}

fn iteration_line(iteration: &Iteration) -> String {
    let mut line = format!(
        "iteration {}: relative RMS {} %",
        iteration.index,
        iteration.rms.relative.map(|v| format!("{:.2}", 100.0 * v)).join(" / ")
    );
    if let Some(objective) = iteration.objective {
        let objective = objective.map(|v| format!("{v:.4e}")).join(" / ");
        line.push_str(&format!(", objective {objective}"));
    }
    // Before the first iteration there is nothing to have changed.
    if iteration.index > 1 {
        line.push_str(&format!(", change {:.1e}", iteration.change));
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reconstruct::solution::Rms;

    #[test]
    fn an_iteration_tells_what_it_minimises_and_changed() {
        let mut iteration = Iteration {
            index: 2,
            rms: Rms { absolute: [9.0; 3], relative: [0.1, 0.2, 0.3] },
            objective: Some([1234.56, 0.5, 0.25]),
            change: 0.0031,
            elapsed_secs: 1.0,
        };
        assert_eq!(
            iteration_line(&iteration),
            "iteration 2: relative RMS 10.00 / 20.00 / 30.00 %, \
             objective 1.2346e3 / 5.0000e-1 / 2.5000e-1, change 3.1e-3"
        );
        (iteration.index, iteration.objective) = (1, None);
        assert_eq!(iteration_line(&iteration), "iteration 1: relative RMS 10.00 / 20.00 / 30.00 %");
    }
}
