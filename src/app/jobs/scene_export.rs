//! The job that exports the recovered scene to files for other programs.

use super::Jobs;
use super::tasks::Lane;
use crate::app::state::State;
use crate::worker::{Command, JobEvent, SceneExport};

pub(super) struct ExportScene;

impl ExportScene {
    pub(super) fn ended(self, state: &mut State, answer: JobEvent) {
        match answer {
            JobEvent::Exported(folder) => {
                state.messages.notice(format!("Scene written to {}", folder.display()));
            }
            JobEvent::Failed(text) => state.messages.error("The scene cannot be written", text),
            JobEvent::Cancelled => state.messages.notice("Exporting was stopped."),
            _ => {}
        }
    }
}

impl Jobs {
    /// Writes the recovered scene for other programs, after pictures that are under way.
    pub fn export_scene(&mut self, scene: SceneExport) {
        self.begin_task(Lane::Renderer, Command::ExportScene(Box::new(scene)), ExportScene);
    }

    /// Whether the recovered scene is being written.
    pub fn is_exporting_scene(&self) -> bool {
        self.is_at::<ExportScene>()
    }

    pub fn stop_scene_export(&mut self) {
        self.cancel_tasks::<ExportScene>();
    }
}
