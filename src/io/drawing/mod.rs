//! Line drawings as files: one list of shapes becomes an SVG, which follows the reader's light or
//! dark background, and PNGs for both.
//!
//! Colours are named by what they are for. Series have those of Okabe and Ito (2008), which
//! readers with any kind of colour vision tell apart.

mod font;
mod png;
mod svg;

use std::path::Path;

use super::{Error, atomic};

pub use font::width as text_width;
pub use svg::{escaped, svg};

/// What a colour is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ink {
    /// The background.
    Paper,
    Text,
    /// Notes beside what matters.
    Quiet,
    /// Lines of the grid.
    Grid,
    /// Of a series of data, by its number.
    Series(usize),
}

impl Ink {
    /// Red, green and blue for a light or a dark background.
    pub fn rgb(self, dark: bool) -> [u8; 3] {
        let [light, night] = match self {
            Self::Paper => [[0xff, 0xff, 0xff], [0x16, 0x1a, 0x20]],
            Self::Text => [[0x1c, 0x1e, 0x21], [0xec, 0xee, 0xf0]],
            Self::Quiet => [[0x59, 0x5f, 0x69], [0xa9, 0xb1, 0xbc]],
            Self::Grid => [[0xdd, 0xe0, 0xe4], [0x35, 0x3c, 0x46]],
            Self::Series(number) => SERIES[number % SERIES.len()],
        };
        if dark { night } else { light }
    }

    fn class(self) -> String {
        match self {
            Self::Paper => "paper".to_owned(),
            Self::Text => "text".to_owned(),
            Self::Quiet => "quiet".to_owned(),
            Self::Grid => "grid".to_owned(),
            Self::Series(number) => format!("s{}", number % SERIES.len()),
        }
    }
}

/// Blue (sky blue on dark), vermilion, bluish green, reddish purple, orange.
const SERIES: [[[u8; 3]; 2]; 5] = [
    [[0x00, 0x72, 0xb2], [0x56, 0xb4, 0xe9]],
    [[0xd5, 0x5e, 0x00], [0xd5, 0x5e, 0x00]],
    [[0x00, 0x9e, 0x73], [0x00, 0x9e, 0x73]],
    [[0xcc, 0x79, 0xa7], [0xcc, 0x79, 0xa7]],
    [[0xe6, 0x9f, 0x00], [0xe6, 0x9f, 0x00]],
];

/// The form of a mark: series differ in it, too.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    Circle,
    Triangle,
    Square,
    Diamond,
    Star,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    Start,
    Middle,
    End,
}

/// Coordinates are pixels from the top left corner.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    Line {
        points: Vec<[f32; 2]>,
        ink: Ink,
        width: f32,
        dashed: bool,
    },
    Area {
        points: Vec<[f32; 2]>,
        ink: Ink,
        opacity: f32,
    },
    Mark {
        at: [f32; 2],
        form: Form,
        radius: f32,
        ink: Ink,
        /// Filled, or an outline on paper.
        filled: bool,
    },
    Text {
        /// Of the baseline.
        at: [f32; 2],
        text: String,
        size: f32,
        anchor: Anchor,
        ink: Ink,
        /// Reads upwards.
        upright: bool,
    },
}

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drawing {
    pub width: f32,
    pub height: f32,
    /// What it shows, for readers who do not see it.
    pub description: String,
    pub shapes: Vec<Shape>,
}

impl Form {
    /// Its corners about a centre; none for the circle.
    fn corners(self, [x, y]: [f32; 2], radius: f32) -> Vec<[f32; 2]> {
        let around = |count: usize, first: f32, inner: f32| {
            (0..count)
                .map(|k| {
                    let angle = (first + 360.0 * k as f32 / count as f32).to_radians();
                    let r = if k % 2 == 1 { radius * inner } else { radius };
                    [x + r * angle.cos(), y + r * angle.sin()]
                })
                .collect()
        };
        match self {
            Self::Circle => Vec::new(),
            Self::Triangle => around(3, -90.0, 1.0),
            Self::Square => around(4, 45.0, 1.0),
            Self::Diamond => around(4, -90.0, 1.0),
            Self::Star => around(10, -90.0, 0.45),
        }
    }
}

/// Writes `NAME.svg`, `NAME.png` and `NAME-dark.png` into a folder.
pub fn write(folder: &Path, name: &str, drawing: &Drawing) -> Result<(), Error> {
    atomic::write_bytes(&folder.join(format!("{name}.svg")), svg(drawing).as_bytes())?;
    for (suffix, dark) in [("", false), ("-dark", true)] {
        png::write(&folder.join(format!("{name}{suffix}.png")), drawing, dark)?;
    }
    Ok(())
}
