//! The dialog that asks which formats of the recovered scene are exported, and into which folder.

use glam::DVec3;

use crate::io::export::elsewhere::Format;
use crate::render::probe::ProbeSettings;

/// The choices, while they are on the screen.
pub struct ExportQuestion {
    pub formats: Vec<Format>,
    pub probe: ProbeSettings,
    /// In metres; without one a place before the first camera.
    pub probe_at: Option<DVec3>,
    /// The place that is proposed: the geometry's middle.
    pub middle: DVec3,
    pub folder: String,
    /// The folder has had the focus, which it has at first.
    pub is_focused: bool,
    /// Why it cannot be written there.
    pub problem: Option<String>,
}

impl ExportQuestion {
    /// What is missing, in words.
    pub fn obstacle(&self) -> Option<&'static str> {
        if self.formats.is_empty() {
            Some("Choose at least one format.")
        } else if self.folder.trim().is_empty() {
            Some("Choose a folder first.")
        } else {
            None
        }
    }

    /// Whether a light probe is made.
    pub fn has_probe(&self) -> bool {
        self.formats.iter().any(|format| matches!(format, Format::Probe | Format::Blender))
    }
}
