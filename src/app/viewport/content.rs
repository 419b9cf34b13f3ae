//! The input and the output of the 3D view in one frame.

use std::collections::BTreeSet;
use std::sync::Arc;

use glam::{DVec2, Vec3};

use crate::app::derived::Derived;
use crate::app::project::Focus;
use crate::app::relight::Added;
use crate::app::things::Things;
use crate::app::viewport::palette::MaterialColors;
use crate::math::rgb::{Radiance, Rgb};
use crate::reconstruct::lights::VirtualLights;
use crate::reconstruct::lobes::Lobes;
use crate::reconstruct::samples::SampleCloud;
use crate::reconstruct::solution::Solution;
use crate::render::scene::Solved;
use crate::scene::charts::LaidChart;
use crate::scene::{Capture, Shape};
use crate::worker::Relit;

/// What there is to draw; all products are shared and read-only.
#[derive(Clone, Default)]
pub struct Content {
    pub capture: Option<Arc<Capture>>,
    /// The capture whose materials samples and solution number: tags may have been edited since.
    pub result_capture: Option<Arc<Capture>>,
    /// The colours of the materials of both.
    pub colors: MaterialColors,
    pub result_colors: MaterialColors,
    pub samples: Option<Arc<SampleCloud>>,
    pub lights: Option<(Arc<VirtualLights>, Arc<Lobes>)>,
    /// Emission per lobe (R, G, B), where a solution (or an iteration) has it.
    pub solution: Option<Arc<Solution>>,
    /// The numbers of each sample, once they have been worked out.
    pub derived: Option<Arc<Derived>>,
    /// Which of the selections was made last.
    pub focus: Focus,
    pub selected_surfaces: BTreeSet<usize>,
    pub hidden_surfaces: BTreeSet<usize>,
    pub selected_sample: Option<usize>,
    pub selected_light: Option<usize>,
    pub selected_photograph: Option<usize>,
    /// The charts whose corners photographs show, as they are wanted now.
    pub charts: Arc<Vec<LaidChart>>,
    pub selected_chart: Option<usize>,
    /// What was set into the scene, and known lights.
    pub things: Things,
    pub selected_added: Option<Added>,
    /// Results as they were found now or read with the project: reflectances, and what can be
    /// relit.
    pub solved: Option<Arc<Solved>>,
    /// The newest picture of the relit scene.
    pub relit: Option<Arc<Relit>>,
}

impl Content {
    /// The capture whose materials samples and solution number.
    pub fn of_results(&self) -> Option<&Arc<Capture>> {
        self.result_capture.as_ref().or(self.capture.as_ref())
    }
}

/// User input in the viewport, as the rest of the window sees it.
#[derive(Clone, Debug, PartialEq)]
pub enum ViewportEvent {
    /// A surface was clicked (None: the background), with shift to add.
    PickSurface { surface: Option<usize>, add: bool },
    /// Surfaces inside a dragged box.
    BoxSurfaces { surfaces: BTreeSet<usize>, add: bool },
    /// A sample was clicked.
    PickSample(usize),
    /// A virtual light was clicked.
    PickLight(usize),
    /// A photograph was clicked or looked through.
    PickPhotograph(usize),
    /// An added light or object was clicked.
    PickAdded(Added),
    /// The added one is being moved: what becomes of it, and what undo calls that.
    Moved { item: Added, name: &'static str, things: Things },
    /// Something was drawn over a photograph: its pixels are left out, or kept.
    Masked { photograph: usize, shape: Shape, is_left_out: bool },
    /// The corners of the selected chart were placed in a photograph, in turn.
    Cornered { photograph: usize, corners_px: [DVec2; 4] },
    /// It stays where it was moved to.
    Kept,
    /// It goes back to where it was before.
    LeftAsItWas,
}

/// What colours the mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Shading {
    #[default]
    Photograph,
    Material,
    Reflectance,
    Plain,
    Relit,
}

/// What colours the samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SampleColor {
    #[default]
    Radiance,
    Material,
    Error,
    Weight,
    Views,
}

/// How radiance becomes a colour on screen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ToneMapping {
    #[default]
    Linear,
    Neutral,
    FalseColor,
}

impl Shading {
    pub const ALL: [Self; 5] =
        [Self::Photograph, Self::Material, Self::Reflectance, Self::Plain, Self::Relit];

    pub fn name(self) -> &'static str {
        match self {
            Self::Photograph => "Photographs",
            Self::Material => "Materials",
            Self::Reflectance => "Reflectance",
            Self::Plain => "Plain",
            Self::Relit => "Relit",
        }
    }

    pub fn help(self) -> &'static str {
        match self {
            Self::Photograph => {
                "The photographs projected onto the geometry; dark where no photograph shows it"
            }
            Self::Material => "A colour for each material; striped where no tag names a surface",
            Self::Reflectance => "Diffuse reflectance that the reconstruction found",
            Self::Plain => "The geometry alone",
            Self::Relit => "A rendering with the recovered light and everything that was added",
        }
    }
}

impl SampleColor {
    pub const ALL: [Self; 5] =
        [Self::Radiance, Self::Material, Self::Error, Self::Weight, Self::Views];

    pub fn name(self) -> &'static str {
        match self {
            Self::Radiance => "Radiance",
            Self::Material => "Material",
            Self::Error => "Error",
            Self::Weight => "Weight",
            Self::Views => "Views",
        }
    }

    pub fn help(self) -> &'static str {
        match self {
            Self::Radiance => "Radiance that the photographs measured at each sample",
            Self::Material => "The material that each sample lies on",
            Self::Error => {
                "ln (computed / measured radiance), as in the tables; grey without a result"
            }
            Self::Weight => {
                "1 / radiance over the mean: the weight of an error if errors are relative"
            }
            Self::Views => "Number of photographs that show each sample",
        }
    }
}

impl ToneMapping {
    pub const ALL: [Self; 3] = [Self::Linear, Self::Neutral, Self::FalseColor];

    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "Linear",
            Self::Neutral => "PBR Neutral",
            Self::FalseColor => "False colour",
        }
    }

    pub fn help(self) -> &'static str {
        match self {
            Self::Linear => "As exposed; what is brighter than white is clipped",
            Self::Neutral => {
                "Khronos PBR Neutral: colours up to 0.8 of white are kept, 0.04 darker; brighter \
                 ones are compressed below white, so that lamps keep their shape"
            }
            Self::FalseColor => "Luminance as a colour scale over ten stops",
        }
    }
}

/// How things are shown.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewSettings {
    pub shading: Shading,
    pub wireframe: bool,
    pub cameras: bool,
    /// The photographs in their cameras.
    pub thumbnails: bool,
    pub samples: bool,
    pub sample_color: SampleColor,
    pub lights: bool,
    pub lobes: bool,
    pub grid: bool,
    /// Stops relative to the exposure that suits the photographs.
    pub exposure_ev: f32,
    pub tone_mapping: ToneMapping,
    /// Of the photograph over the geometry, 0 to 1.
    pub look_through_opacity: f32,
    /// The part of the width, from the left, that shows the scene before it was relit.
    pub before: Option<f32>,
}

impl Default for ViewSettings {
    fn default() -> Self {
        Self {
            shading: Shading::default(),
            wireframe: true,
            cameras: true,
            thumbnails: true,
            samples: true,
            sample_color: SampleColor::default(),
            lights: true,
            lobes: true,
            grid: true,
            exposure_ev: 0.0,
            tone_mapping: ToneMapping::default(),
            look_through_opacity: 1.0,
            before: None,
        }
    }
}

/// The value that the picture on the screen has under the cursor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PictureValue {
    /// Linear radiance, in the unit of the photographs.
    Radiance(Radiance),
    /// Diffuse reflectance.
    Reflectance(Rgb),
    /// Saturated or invalid.
    NoMeasurement,
}

/// The value under the cursor.
#[derive(Clone, Debug, PartialEq)]
pub struct Hovered {
    pub surface: usize,
    /// In metres.
    pub position: Vec3,
    pub material: Option<usize>,
    /// Radiance in the photograph that is drawn there, with that photograph's index.
    pub radiance: Option<(Radiance, usize)>,
    /// That photograph where it shows the place, but as no measurement: saturated or invalid.
    pub no_measurement: Option<usize>,
}
