//! The photographs of the page as they are displayed: the current one at full size, the others as
//! thumbnails.

use std::collections::BTreeMap;
use std::sync::Arc;

use eframe::egui::{self, Color32, ColorImage, TextureHandle, Vec2, vec2};

use glam::DVec2;

use crate::io::import::Shown;
use crate::io::model::LONGEST;
use crate::model::lines::Picture as Pixels;
use crate::worker::Job;

/// Longer side of the small photographs, in pixels.
const SMALL: usize = 192;
/// As many are kept in full.
const MOST: usize = 3;

/// A photograph, or why it cannot be shown.
pub enum Picture {
    /// With the part of the photograph that it covers, in its pixels.
    Shown(TextureHandle, Vec2),
    Failed(String),
}

#[derive(Default)]
pub struct Pictures {
    full: BTreeMap<usize, Picture>,
    /// The pixels of those in full.
    pixels: BTreeMap<usize, Arc<Shown>>,
    small: BTreeMap<usize, Picture>,
    /// In the order of their use.
    used: Vec<usize>,
    reading: Option<(Job, usize, bool)>,
}

/// What is to be read next.
pub struct Wanted {
    pub photograph: usize,
    pub is_full: bool,
    pub longest: usize,
}

impl Pictures {
    pub fn full(&self, photograph: usize) -> Option<&Picture> {
        self.full.get(&photograph)
    }

    pub fn small(&self, photograph: usize) -> Option<&Picture> {
        self.small.get(&photograph)
    }

    /// The pixels of a photograph that is there in full.
    pub fn pixels(&self, photograph: usize) -> Option<&Arc<Shown>> {
        self.pixels.get(&photograph)
    }

    pub fn is_reading(&self) -> bool {
        self.reading.is_some()
    }

    /// What is to be read next while `shown` is looked at.
    pub fn wanted(&mut self, shown: usize, count: usize) -> Option<Wanted> {
        if self.reading.is_some() || count == 0 {
            return None;
        }
        self.used.retain(|other| *other != shown);
        self.used.push(shown);
        while self.used.len() > MOST {
            let gone = self.used.remove(0);
            self.full.remove(&gone);
            self.pixels.remove(&gone);
        }
        if !self.full.contains_key(&shown) {
            return Some(Wanted { photograph: shown, is_full: true, longest: LONGEST });
        }
        let photograph = (0..count).find(|index| !self.small.contains_key(index))?;
        Some(Wanted { photograph, is_full: false, longest: SMALL })
    }

    /// How bright a photograph is shown at one of its pixels: 1 is white; `None` outside, and where
    /// it is not there in full.
    pub fn brightness(&self, photograph: usize, pixel: DVec2) -> Option<f64> {
        let shown = self.pixels.get(&photograph)?;
        let Shown { step, width, height, ref pixels } = **shown;
        Pixels { pixels, width, height, step }.brightness(pixel)
    }

    pub fn asked(&mut self, job: Job, wanted: &Wanted) {
        self.reading = Some((job, wanted.photograph, wanted.is_full));
    }

    /// Takes the answer of a job, where it is one of these; says whether it was.
    pub fn take(
        &mut self,
        ctx: &egui::Context,
        job: Job,
        read: Result<&Arc<Shown>, String>,
    ) -> bool {
        let Some((_, photograph, is_full)) = self.reading.take_if(|own| own.0 == job) else {
            return false;
        };
        let picture = match read {
            Ok(shown) => {
                if is_full {
                    self.pixels.insert(photograph, shown.clone());
                }
                let pixels = shown.pixels.iter().map(|[r, g, b]| Color32::from_rgb(*r, *g, *b));
                let image = ColorImage::new([shown.width, shown.height], pixels.collect());
                let name = format!("model photograph {photograph} {is_full}");
                // Magnified, single pixels are to be told apart.
                let options = egui::TextureOptions {
                    magnification: egui::TextureFilter::Nearest,
                    ..egui::TextureOptions::LINEAR
                };
                let covered =
                    vec2((shown.width * shown.step) as f32, (shown.height * shown.step) as f32);
                Picture::Shown(ctx.load_texture(name, image, options), covered)
            }
            Err(problem) => Picture::Failed(problem),
        };
        let list = if is_full { &mut self.full } else { &mut self.small };
        list.insert(photograph, picture);
        true
    }
}
