//! Shows the faces of the model over the photograph, while a key is held or until they are switched
//! off.

use std::collections::BTreeMap;
use std::sync::Arc;

use eframe::egui::{Color32, TextureHandle};

use super::ModelPage;
use crate::worker::{Command, Job, Modelling, Reprojection};

/// What is shown of the faces, and their picture.
#[derive(Default)]
pub struct Blink {
    /// Switched on.
    pub is_on: bool,
    /// The key is held, which shows the other.
    pub is_held: bool,
    pub picture: Option<Arc<Reprojection>>,
    /// The picture in the colours of its surfaces.
    pub painted: Option<(Arc<Reprojection>, BTreeMap<String, Color32>, TextureHandle)>,
    pub(super) job: Option<Job>,
}

impl Blink {
    /// Whether faces are to be seen now.
    pub fn is_shown(&self) -> bool {
        self.is_on != self.is_held
    }

    /// Whether a picture is on its way.
    pub fn is_awaited(&self) -> bool {
        self.job.is_some()
    }
}

impl ModelPage {
    /// The picture of what is solved, as the photograph that is looked at shows it.
    pub fn reprojection(&self) -> Option<&Arc<Reprojection>> {
        let solved = self.solved.as_ref()?;
        let is_it =
            |own: &&Arc<Reprojection>| Arc::ptr_eq(&own.of, solved) && own.photograph == self.shown;
        self.blink.picture.as_ref().filter(is_it)
    }

    /// Has that made, where it is to be seen.
    pub(super) fn reproject_what_is_shown(&mut self) {
        if !self.blink.is_shown() || self.blink.job.is_some() || self.reprojection().is_some() {
            return;
        }
        if let Some(of) = self.solved.clone() {
            let job = Modelling::Reproject { of, photograph: self.shown };
            self.blink.job = Some(self.solver.send(Command::Model(job)));
        }
    }
}
