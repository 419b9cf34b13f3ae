//! What traces paths and takes the noise out of pictures: this processor, or another device that gives
//! the same means.

use crate::render::denoise::{Guides, Light};
use crate::render::film::SurfaceFilm;
use crate::render::{Exposure, PASS, Pass};
use crate::watch::{Cancelled, Watch};

/// Traces the paths of a pass.
pub trait Tracer: Send + Sync {
    /// As people are told it, such as the name of a graphics card.
    fn name(&self) -> String;

    /// Why something else traces in its place; `None` while it does itself.
    fn trouble(&self) -> Option<String> {
        None
    }

    /// Paths per pixel between two looks at noise and clock, which must be even.
    fn paths_at_once(&self, pixels: usize) -> usize;

    /// Adds paths to films until every pixel has as many as the pass says; see [`Pass::trace`].
    fn trace(
        &self,
        pass: &Pass,
        surfaces: &mut SurfaceFilm,
        exposures: &mut [Exposure],
        watch: &Watch,
    ) -> Result<(), Cancelled>;

    /// The light of a picture with less noise; see [`denoise`](crate::render::denoise).
    fn denoise(&self, guides: &Guides, light: Light) -> Light {
        light.filtered(guides)
    }
}

/// This processor, on all threads. The same seed gives the same numbers.
#[derive(Clone, Copy, Debug, Default)]
pub struct Processor;

impl Tracer for Processor {
    fn name(&self) -> String {
        "processor".to_owned()
    }

    fn paths_at_once(&self, _: usize) -> usize {
        PASS
    }

    fn trace(
        &self,
        pass: &Pass,
        surfaces: &mut SurfaceFilm,
        exposures: &mut [Exposure],
        watch: &Watch,
    ) -> Result<(), Cancelled> {
        pass.trace(surfaces, exposures, watch)
    }
}
