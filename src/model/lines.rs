//! Straight lines in a photograph.
//!
//! They are detected by LSD (Grompone von Gioi et al., "LSD: a Line Segment Detector", IPOL 2012;
//! the crate `lsdetect`). LSD distinguishes lines from texture well, but its positions are accurate
//! only to about half a pixel, and it divides long lines where there is noise. Each line is
//! therefore moved to the steepest change of brightness ([`snap`]), and extended as far as that
//! change continues. In the end it is moved to the steepest change of radiance, which is accurate to
//! a tenth of a pixel: a pixel that an edge divides is the mean of both sides' radiance, and its
//! code in sRGB lies nearer to that of the brighter side. Pieces of the same line are then left out.

use glam::DVec2;

use super::snap;
use crate::math::rgb::srgb_to_linear;

/// Shortest line that is kept, in pixels of the picture that is searched.
const SHORTEST_PX: f64 = 10.0;
/// Standard deviation of the ends of a line of 100 pixels or more across it, in pixels of the picture:
/// that of painted edges with noise of four grey levels (tests/model/lines.rs). That of shorter lines
/// is larger, as the root of their length is smaller.
const SD_PX: f64 = 0.05;
const LONG_PX: f64 = 100.0;
/// As many are kept, the longest first.
const MOST: usize = 3000;
/// How far a line is moved to the steepest change of brightness, in pixels of the picture.
const REACH_PX: f64 = 2.5;
/// Where along a line radiance is looked at beside it.
const AROUND: [f64; 5] = [0.1, 0.3, 0.5, 0.7, 0.9];
/// Between places along a line that is followed beyond its ends, and half the distance across it over
/// which radiance is compared, in pixels of the picture.
const FOLLOW_PX: f64 = 0.5;
const ACROSS_PX: f64 = 1.0;
/// How far inside the ends that is begun.
const INSIDE_PX: f64 = 4.0;
/// A line goes on where the change of radiance is this part of its own.
const GOES_ON: f64 = 0.5;
/// So many pixels of the picture are averaged there.
const AVERAGED: usize = 3;
/// A line of which both ends are as near to a longer one is a piece of that, in pixels of the picture.
const PIECE_PX: f64 = 1.5;

/// A straight line in a photograph, by its ends, in pixels from the image's top left corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// In no order that means anything.
    pub ends: [DVec2; 2],
    /// Standard deviation of the distance of its ends from the edge that the photograph shows.
    pub sd_px: f64,
}

/// A photograph as the screen shows it.
#[derive(Clone, Copy, Debug)]
pub struct Picture<'a> {
    /// sRGB, row by row from the top.
    pub pixels: &'a [[u8; 3]],
    /// Pixels of a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Pixels of the photograph along a side of one of these.
    pub step: usize,
}

impl Line {
    /// In pixels.
    pub fn length(&self) -> f64 {
        self.ends[0].distance(self.ends[1])
    }

    /// Along the line, from its first end to its second; zero for a line without length.
    pub fn direction(&self) -> DVec2 {
        (self.ends[1] - self.ends[0]).normalize_or_zero()
    }

    /// The place nearest to another on the line that goes on beyond both ends.
    pub fn foot(&self, place: DVec2) -> DVec2 {
        let along = self.direction();
        self.ends[0] + along * (place - self.ends[0]).dot(along)
    }

    /// How far a place is from the line between its ends.
    pub fn distance(&self, place: DVec2) -> f64 {
        let along = self.direction();
        let part = (place - self.ends[0]).dot(along).clamp(0.0, self.length());
        (self.ends[0] + along * part).distance(place)
    }
}

impl Picture<'_> {
    /// How bright it is at a place in the photograph: 1 is white; `None` outside.
    pub fn brightness(&self, pixel: DVec2) -> Option<f64> {
        self.interpolated(pixel, |pixel| grey(pixel) / 255.0)
    }

    /// Between the middles of pixels, for a value of each; `None` outside.
    fn interpolated(&self, pixel: DVec2, value: impl Fn([u8; 3]) -> f64) -> Option<f64> {
        let place = pixel / self.step as f64 - 0.5;
        let (x, y) = (place.x.floor(), place.y.floor());
        let is_inside =
            x >= 0.0 && y >= 0.0 && x + 1.0 < self.width as f64 && y + 1.0 < self.height as f64;
        if !is_inside {
            return None;
        }
        let at = |dx: usize, dy: usize| {
            value(self.pixels[(y as usize + dy) * self.width + x as usize + dx])
        };
        let (s, t) = (place.x - x, place.y - y);
        let row = |dy| (1.0 - s) * at(0, dy) + s * at(1, dy);
        Some((1.0 - t) * row(0) + t * row(1))
    }
}

fn grey([r, g, b]: [u8; 3]) -> f64 {
    f64::from(u32::from(r) + u32::from(g) + u32::from(b)) / 3.0
}

/// The lines of a photograph, the longest first. The same picture gives the same lines.
pub fn detect(picture: &Picture) -> Vec<Line> {
    let greys: Vec<f64> = picture.pixels.iter().map(|pixel| grey(*pixel)).collect();
    // A picture whose pixels are not as many as it says has no lines.
    let found = lsdetect::detect(&greys, picture.width, picture.height, lsdetect::SCALE);
    let mut found = found.unwrap_or_default();
    found.retain(|own| own.length() >= SHORTEST_PX);
    found.truncate(MOST);
    // All is measured in pixels of the picture.
    let own = Picture { step: 1, ..*picture };
    let on_edge = |line: Line| {
        let moved = snap::line(line.ends, REACH_PX, |pixel| own.brightness(pixel));
        moved.map_or(line, |ends| Line { ends, ..line })
    };
    let linear: Vec<f64> = (0..256).map(|code| srgb_to_linear(f64::from(code) / 255.0)).collect();
    let radiance = |pixel| {
        own.interpolated(pixel, |rgb| rgb.map(|code| linear[usize::from(code)]).iter().sum())
    };
    let in_radiance = |line: Line| {
        // As a part of what is brightest near it, so that dark edges are edges, too.
        let near = AROUND.map(|part| line.ends[0].lerp(line.ends[1], part));
        let across = REACH_PX * line.direction().perp();
        let beside = near.into_iter().flat_map(|place| [place - across, place + across]);
        let most = beside.filter_map(radiance).fold(f64::MIN_POSITIVE, f64::max);
        let moved = snap::line(line.ends, REACH_PX, |pixel| Some(radiance(pixel)? / most));
        moved.map_or(line, |ends| Line { ends, ..line })
    };
    let whole = |found: &lsdetect::Segment| {
        // The crate counts from the middle of the first pixel.
        let ends = [(found.x1, found.y1), (found.x2, found.y2)];
        let ends = ends.map(|(x, y)| DVec2::new(x, y) + 0.5);
        in_radiance(on_edge(followed(&radiance, on_edge(Line { ends, sd_px: SD_PX }))))
    };
    let mut lines: Vec<Line> = found.iter().map(whole).collect();
    lines.sort_by(|a, b| b.length().total_cmp(&a.length()));
    let mut kept: Vec<Line> = Vec::with_capacity(lines.len());
    for line in lines {
        let is_piece = |longer: &Line| line.ends.iter().all(|end| longer.distance(*end) < PIECE_PX);
        if !kept.iter().any(is_piece) {
            kept.push(line);
        }
    }
    let step = picture.step as f64;
    let scaled = |line: Line| {
        let sd_px = SD_PX * (LONG_PX / line.length()).sqrt().max(1.0);
        Line { ends: line.ends.map(|end| step * end), sd_px: step * sd_px }
    };
    kept.into_iter().map(scaled).collect()
}

/// A line with its ends where the change of radiance across it ends, in a picture of `step` 1.
fn followed(radiance: &impl Fn(DVec2) -> Option<f64>, line: Line) -> Line {
    let along = line.direction();
    let across = ACROSS_PX * along.perp();
    let change = |place: DVec2| Some(radiance(place + across)? - radiance(place - across)?);
    let count = line.length() as usize;
    let part = |k: usize| (k as f64 + 0.5) / count as f64;
    let mut own: Vec<f64> =
        (0..count).filter_map(|k| change(line.ends[0].lerp(line.ends[1], part(k)))).collect();
    if own.is_empty() {
        return line;
    }
    own.sort_by(f64::total_cmp);
    let usual = own[own.len() / 2];
    let follow = |end: DVec2, outward: DVec2| {
        // From a little inside: the end that was found may lie beyond the true one.
        let inside = (0.25 * line.length()).min(INSIDE_PX);
        let at = |k: usize| end + outward * (k as f64 * FOLLOW_PX - inside);
        let strength = |k: usize| {
            let near = k.saturating_sub(AVERAGED / 2)..=k + AVERAGED / 2;
            let list: Option<Vec<f64>> = near.map(|k| change(at(k))).collect();
            let list = list?;
            Some(list.iter().sum::<f64>() / (list.len() as f64 * usual))
        };
        let (mut last, mut before) = (0, strength(0)?);
        if before < GOES_ON {
            return None;
        }
        loop {
            let Some(next) = strength(last + 1) else { return Some(at(last)) };
            if next < GOES_ON {
                let part = (before - GOES_ON) / (before - next);
                return Some(at(last).lerp(at(last + 1), part));
            }
            (last, before) = (last + 1, next);
        }
    };
    let [a, b] = line.ends;
    Line { ends: [follow(a, -along).unwrap_or(a), follow(b, along).unwrap_or(b)], ..line }
}
