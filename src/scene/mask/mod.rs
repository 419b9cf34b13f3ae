//! Masks as a person makes them: which pixels of a photograph are left out, and how strokes, boxes
//! and outlines change that.

mod surface;

use glam::DVec2;

pub use surface::{showing, surface_at};

/// Which pixels of a photograph are left out. Stored as the lengths of runs, since hundreds of
/// states are kept for undo: row by row from the top, first those that are kept, then in turn.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mask {
    width: usize,
    height: usize,
    runs: Vec<u32>,
}

/// What is drawn over a photograph, in pixels from its top left corner.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A round brush along a line.
    Brush { line: Vec<DVec2>, radius_px: f64 },
    /// The inside of a closed outline.
    Lasso(Vec<DVec2>),
    /// Two opposite corners.
    Box([DVec2; 2]),
    /// For each pixel, row by row from the top, whether it is meant.
    Pixels(Vec<bool>),
}

impl Mask {
    /// For each pixel, row by row from the top, whether it is left out.
    ///
    /// # Panics
    /// If there is not an entry for each pixel.
    pub fn new((width, height): (usize, usize), is_left_out: &[bool]) -> Self {
        assert_eq!(is_left_out.len(), width * height);
        let mut runs = Vec::new();
        let mut kind = false;
        let mut length = 0;
        for &own in is_left_out {
            if own != kind {
                runs.push(length);
                (kind, length) = (own, 0);
            }
            length += 1;
        }
        runs.push(length);
        Self { width, height, runs }
    }

    /// From lengths of runs; `None` where they are not those of so many pixels.
    pub fn from_runs((width, height): (usize, usize), runs: Vec<u32>) -> Option<Self> {
        let total: u64 = runs.iter().map(|&run| u64::from(run)).sum();
        let pixels = (width as u64).checked_mul(height as u64)?;
        (total == pixels && !runs.is_empty()).then_some(Self { width, height, runs })
    }

    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    pub fn runs(&self) -> &[u32] {
        &self.runs
    }

    /// For each pixel, row by row from the top, whether it is left out.
    pub fn pixels(&self) -> Vec<bool> {
        let mut pixels = Vec::with_capacity(self.width * self.height);
        for (index, &run) in self.runs.iter().enumerate() {
            pixels.extend(std::iter::repeat_n(index % 2 == 1, run as usize));
        }
        pixels
    }

    /// The part of the photograph that is left out, 0 to 1.
    pub fn share(&self) -> f64 {
        let left_out: u64 = self.runs.iter().skip(1).step_by(2).map(|&run| u64::from(run)).sum();
        left_out as f64 / (self.width * self.height).max(1) as f64
    }

    /// With what a shape covers left out, or kept.
    pub fn with(&self, shape: &Shape, is_left_out: bool) -> Self {
        let size = self.size();
        let mut pixels = self.pixels();
        let mut fill = |y: usize, from: f64, to: f64| {
            // Pixels whose middle lies between.
            let first = (from - 0.5).ceil().clamp(0.0, size.0 as f64) as usize;
            let last = (to - 0.5).floor().clamp(-1.0, size.0 as f64 - 1.0) + 1.0;
            if first < last as usize {
                pixels[y * size.0 + first..y * size.0 + last as usize].fill(is_left_out);
            }
        };
        match shape {
            Shape::Brush { line, radius_px } => {
                for ends in line.windows(2.min(line.len()).max(1)) {
                    stroke(ends[0], ends[ends.len() - 1], *radius_px, size.1, &mut fill);
                }
            }
            Shape::Lasso(outline) => inside(outline, size.1, &mut fill),
            Shape::Box([a, b]) => {
                let (low, high) = (a.min(*b), a.max(*b));
                for y in 0..size.1 {
                    if (low.y..=high.y).contains(&(y as f64 + 0.5)) {
                        fill(y, low.x, high.x);
                    }
                }
            }
            Shape::Pixels(meant) => {
                for (own, _) in pixels.iter_mut().zip(meant).filter(|(_, meant)| **meant) {
                    *own = is_left_out;
                }
            }
        }
        Self::new(size, &pixels)
    }

    /// With all pixels kept that are left out, and the other way round.
    pub fn inverted(&self) -> Self {
        let pixels: Vec<bool> = self.pixels().into_iter().map(|own| !own).collect();
        Self::new(self.size(), &pixels)
    }
}

/// Fills what is within a radius of a line from `a` to `b`, row by row.
fn stroke(a: DVec2, b: DVec2, radius: f64, height: usize, fill: &mut impl FnMut(usize, f64, f64)) {
    let first = (a.y.min(b.y) - radius).floor().clamp(0.0, height as f64) as usize;
    let last = (a.y.max(b.y) + radius).ceil().clamp(0.0, height as f64) as usize;
    let (along, length) = ((b - a).normalize_or_zero(), a.distance(b));
    for row in first..last {
        let y = row as f64 + 0.5;
        let mut span: Option<(f64, f64)> = None;
        let mut widen = |from: f64, to: f64| {
            let (low, high) = span.unwrap_or((from, to));
            span = Some((low.min(from), high.max(to)));
        };
        // A convex shape: two discs and the band between them.
        for end in [a, b] {
            let half = radius * radius - (y - end.y) * (y - end.y);
            if half >= 0.0 {
                widen(end.x - half.sqrt(), end.x + half.sqrt());
            }
        }
        if length > 0.0 {
            let side = DVec2::new(-along.y, along.x) * radius;
            let corners = [a + side, b + side, b - side, a - side];
            for index in 0..4 {
                let (from, to) = (corners[index], corners[(index + 1) % 4]);
                if (from.y <= y) != (to.y <= y) {
                    let x = from.x + (to.x - from.x) * (y - from.y) / (to.y - from.y);
                    widen(x, x);
                }
            }
        }
        if let Some((from, to)) = span {
            fill(row, from, to);
        }
    }
}

/// Fills the inside of an outline, by the even-odd rule.
fn inside(outline: &[DVec2], height: usize, fill: &mut impl FnMut(usize, f64, f64)) {
    for row in 0..height {
        let y = row as f64 + 0.5;
        let mut crossings: Vec<f64> = (0..outline.len())
            .filter_map(|index| {
                let (from, to) = (outline[index], outline[(index + 1) % outline.len()]);
                ((from.y <= y) != (to.y <= y))
                    .then(|| from.x + (to.x - from.x) * (y - from.y) / (to.y - from.y))
            })
            .collect();
        crossings.sort_by(f64::total_cmp);
        for pair in crossings.chunks_exact(2) {
            fill(row, pair[0], pair[1]);
        }
    }
}

#[cfg(test)]
mod tests;
