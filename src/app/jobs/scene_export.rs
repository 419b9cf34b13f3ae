//! The job that exports the recovered scene to files for other programs.

use super::{Jobs, Lane, Task};
use crate::app::messages::Messages;
use crate::worker::{Command, JobEvent, SceneExport};

impl Jobs {
    /// Whether the recovered scene is being written.
    pub fn is_exporting_scene(&self) -> bool {
        self.is_at(|task| matches!(task, Task::ExportScene))
    }

    /// Writes the recovered scene for other programs, after pictures that are under way.
    pub fn export_scene(&mut self, scene: SceneExport) {
        self.begin_task(Lane::Renderer, Command::ExportScene(Box::new(scene)), Task::ExportScene);
    }

    pub fn stop_scene_export(&mut self) {
        self.cancel_tasks(|task| matches!(task, Task::ExportScene));
    }
}

/// The scene was written, or cannot be.
pub(super) fn ended(messages: &mut Messages, what: JobEvent) {
    match what {
        JobEvent::Exported(folder) => {
            messages.notice(format!("Scene written to {}", folder.display()));
        }
        JobEvent::Failed(text) => messages.error("The scene cannot be written", text),
        JobEvent::Cancelled => messages.notice("Exporting was stopped."),
        _ => {}
    }
}
