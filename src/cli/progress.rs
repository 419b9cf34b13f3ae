//! Progress on stderr: a bar with count and time left on a terminal, plain lines elsewhere.

use std::io::IsTerminal;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::cli::print::note_line;
use crate::reconstruct::Update;
use crate::watch::Progress;

pub(super) struct Display {
    bar: ProgressBar,
    /// stderr is no terminal: a line a stage and an iteration instead of a bar.
    plain: bool,
}

impl Display {
    pub(super) fn new(quiet: bool) -> Self {
        let terminal = std::io::stderr().is_terminal();
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
        Self { bar, plain: !quiet && !terminal }
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
            Update::Samples(cloud) => self.note(&format!("{} samples", cloud.samples.len())),
            Update::Lights(lights, lobes) => self.note(&format!(
                "{} virtual lights, {} lobes",
                lights.lights.len(),
                lobes.lobes.len()
            )),
            Update::Transport(_) => {}
            Update::Iteration(iteration) => {
                let [red, green, blue] =
                    iteration.rms.relative.map(|v| format!("{:.2}", 100.0 * v));
                self.note(&format!(
                    "iteration {}: relative RMS {red} / {green} / {blue} %",
                    iteration.index
                ));
            }
        }
    }

    fn note(&self, text: &str) {
        self.bar.set_message(text.to_owned());
        if self.plain {
            note_line!("  {text}");
        }
    }

    /// Takes the bar away.
    pub(super) fn clear(&self) {
        self.bar.finish_and_clear();
    }
}
