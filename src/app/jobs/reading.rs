//! Reads the parts of a project that have to be read before it is shown, and the files of known
//! lights.

use std::sync::Arc;

use serde_json::Value;

use super::Jobs;
use super::tasks::Lane;
use crate::app::opening::Opening;
use crate::app::project::Project;
use crate::app::state::State;
use crate::app::{lighting, relighting, reopening};
use crate::io::capture::TAGS;
use crate::io::project::Relight;
use crate::scene::Capture;
use crate::worker::{Command, EditSource, JobEvent};

macro_rules! readings {
    ($($(#[$doc:meta])* $reading:ident $(($index:ident))?, $failed:literal;)*) => {
        /// What a file is read for, a line each.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Reading {
            $($(#[$doc])* $reading $(($index))?,)*
        }

        impl Reading {
            /// What is told when it fails.
            pub fn failed(self) -> &'static str {
                match self {
                    $(Self::$reading { .. } => $failed,)*
                }
            }
        }
    };
}

readings! {
    File, "These edits cannot be used";
    Object, "This object cannot be added";
    Dome, "This image cannot be used";
    /// A part of the project that could not be read, by its index, from another file.
    Found(usize), "This file cannot take its place";
    /// A known sky.
    Sky, "This image cannot be used";
    /// A known light that could not be read, by its index, from another file.
    FoundLight(usize), "This file cannot take its place";
    /// The camera file is being changed.
    Cameras, "The camera file cannot be changed";
}

/// Edits or known lights are read, or a camera file is changed.
pub(super) struct Read(Reading);

impl Read {
    pub(super) fn ended(self, state: &mut State, answer: JobEvent) {
        match answer {
            JobEvent::Edits(edits, warnings) => {
                relighting::edits_read(state, self.0, edits, warnings);
            }
            JobEvent::StoredLights(stored) => lighting::lights_read(state, self.0, *stored),
            JobEvent::CamerasChanged(folder) => reopening::reopen(state, &folder),
            JobEvent::Failed(text) => state.messages.error(self.0.failed(), text),
            _ => {}
        }
    }
}

impl Jobs {
    /// Reads what else a project holds, before it is shown: its charts, its known lights, then what it changes
    /// of the recovered scene. Gives the project back once all has been read.
    pub fn read_stored(
        &mut self,
        opening: Opening,
        capture: Arc<Capture>,
    ) -> Option<(Opening, Arc<Capture>)> {
        let (file, project) = (opening.path.clone(), opening.project.as_deref());
        if let Some(values) = opening.charts.clone() {
            let command = Command::ReadStoredCharts { capture: capture.clone(), file, values };
            return self.go_on_reading(command, opening, capture);
        }
        let command = match project.map(|project| (&project.lights, &project.relight)) {
            Some((Some(values), _)) if opening.lights.is_none() => {
                let (capture, values) = (capture.clone(), values.clone());
                Command::ReadStoredLights { capture, file, values }
            }
            Some((_, Relight::Stored(value))) if !value.is_null() && opening.edits.is_none() => {
                let (capture, value) = (capture.clone(), Box::new(value.clone()));
                Command::ReadStoredEdits { capture, file, value }
            }
            _ => return Some((opening, capture)),
        };
        self.go_on_reading(command, opening, capture)
    }

    fn go_on_reading(
        &mut self,
        command: Command,
        opening: Opening,
        capture: Arc<Capture>,
    ) -> Option<(Opening, Arc<Capture>)> {
        self.opening = Some((self.loader.send(command), opening));
        self.loaded = Some(capture);
        None
    }

    /// Takes the photographs for radiance by the curve of sRGB; the capture is then read anew.
    pub fn take_as_srgb(&mut self, project: Option<&Project>) {
        let Some(project) = project else { return };
        let command = Command::TakeAsSrgb { folder: project.folder.clone() };
        self.begin_task(Lane::Loader, command, Read(Reading::Cameras));
    }

    /// Reads known lights for the open project.
    pub fn read_lights(&mut self, project: Option<&Project>, reading: Reading, values: Vec<Value>) {
        let Some(project) = project else { return };
        let (capture, file) = (project.loaded.clone(), project.folder.join(TAGS));
        let command = Command::ReadStoredLights { capture, file, values };
        self.begin_task(Lane::Loader, command, Read(reading));
    }

    /// Reads edits for the open project.
    pub fn read_edits(&mut self, project: Option<&Project>, reading: Reading, source: EditSource) {
        let Some(project) = project else { return };
        let capture = project.loaded.clone();
        self.begin_task(Lane::Loader, Command::ReadEdits { capture, source }, Read(reading));
    }
}
