//! Strokes: what a person draws on photographs or types.

use glam::{DVec2, DVec3};

/// Standard deviation that drawn strokes are taken to have before residuals say otherwise, in pixels.
pub const HAND_PX: f64 = 1.0;

/// A corner of a thing, or a free point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[allow(missing_docs, reason = "the variants say what their fields are")]
pub enum Place {
    /// Corner `corner` of thing `thing`, in the order of [`super::things::corner_names`].
    Corner { thing: usize, corner: usize },
    /// `Model::points[index]`.
    Point(usize),
}

/// An axis of the world. z is up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// Level.
    X,
    /// Level, a quarter turn to the left of x.
    Y,
    /// Up.
    Z,
}

/// Something that a person has said. Pixels are counted from the image's top left corner, so the
/// middle of the first pixel is (0.5, 0.5).
#[derive(Clone, Debug, PartialEq)]
#[allow(missing_docs, reason = "the variants say what their fields are")]
pub enum Stroke {
    /// A line in a photograph along an axis of the world, drawn in the axis' direction.
    Line { photograph: usize, axis: Axis, from: DVec2, to: DVec2 },
    /// Where a photograph shows a corner or point.
    Pick { photograph: usize, at: Place, pixel: DVec2 },
    /// A piece of the straight line between two corners, in either direction. `sd_px` is `None` where
    /// it was drawn. Where a line of the photograph was found to be that edge
    /// ([`super::to_edges::find`]), it is the standard deviation of that line's distance from it.
    Edge { photograph: usize, between: [Place; 2], from: DVec2, to: DVec2, sd_px: Option<f64> },
    /// A point on the bottom (`top` false) or top circle of a cylinder.
    Rim { photograph: usize, thing: usize, top: bool, pixel: DVec2 },
    /// A corner or point of known position, in metres, with its standard deviation in metres.
    Position { at: Place, position: DVec3, sd_m: f64 },
    /// A known distance, in metres, with its standard deviation in metres.
    Length { between: [Place; 2], length_m: f64, sd_m: f64 },
}

impl Stroke {
    /// The photograph that it is drawn on.
    pub fn photograph(&self) -> Option<usize> {
        match self {
            Self::Line { photograph, .. }
            | Self::Pick { photograph, .. }
            | Self::Edge { photograph, .. }
            | Self::Rim { photograph, .. } => Some(*photograph),
            Self::Position { .. } | Self::Length { .. } => None,
        }
    }

    /// The corners and points that it is about.
    pub fn places(&self) -> &[Place] {
        match self {
            Self::Line { .. } | Self::Rim { .. } => &[],
            Self::Pick { at, .. } | Self::Position { at, .. } => std::slice::from_ref(at),
            Self::Edge { between, .. } | Self::Length { between, .. } => between,
        }
    }

    /// Whether it is a line that was found in a photograph, and not drawn.
    pub fn is_found(&self) -> bool {
        matches!(self, Self::Edge { sd_px: Some(_), .. })
    }

    /// Standard deviation of a residual, in pixels (metres, of what was typed).
    pub fn sd(&self) -> f64 {
        match self {
            Self::Edge { sd_px, .. } => sd_px.unwrap_or(HAND_PX),
            Self::Line { .. } | Self::Pick { .. } | Self::Rim { .. } => HAND_PX,
            Self::Position { sd_m, .. } | Self::Length { sd_m, .. } => *sd_m,
        }
    }

    /// What such a stroke is called in files and messages.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Line { .. } => "line",
            Self::Pick { .. } => "pick",
            Self::Edge { .. } => "edge",
            Self::Rim { .. } => "rim",
            Self::Position { .. } => "position",
            Self::Length { .. } => "length",
        }
    }
}

impl Axis {
    /// In their order.
    pub const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];

    /// The unit vector along it.
    pub fn direction(self) -> DVec3 {
        DVec3::AXES[self as usize]
    }

    /// Its name in files.
    pub fn name(self) -> &'static str {
        ["x", "y", "z"][self as usize]
    }
}
