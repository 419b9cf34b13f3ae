//! The job that exports the recovered scene to files for other programs.

use super::Jobs;
use crate::app::messages::Messages;
use crate::worker::{Command, JobEvent, SceneExport};

impl Jobs {
    /// Whether the recovered scene is being written.
    pub fn is_exporting_scene(&self) -> bool {
        self.scene_export.is_some()
    }

    /// Writes the recovered scene for other programs, after pictures that are under way.
    pub fn export_scene(&mut self, scene: SceneExport) {
        self.scene_export = Some(self.render_worker.send(Command::ExportScene(Box::new(scene))));
    }

    pub fn stop_scene_export(&mut self) {
        if let Some(job) = self.scene_export {
            self.render_worker.cancel(job);
        }
    }

    /// Takes an event of the scene that is written.
    pub(super) fn scene_event(&mut self, event: &JobEvent, messages: &mut Messages) {
        match event {
            JobEvent::Exported(folder) => {
                messages.notice(format!("Scene written to {}", folder.display()));
            }
            JobEvent::Failed(text) => messages.error("The scene cannot be written", text.clone()),
            JobEvent::Cancelled => messages.notice("Exporting was stopped."),
            _ => {}
        }
        if event.is_ending() {
            self.scene_export = None;
        }
    }
}
