//! A photograph, its render and their difference as pictures, worked out away from the window's
//! thread.

use std::sync::{Arc, Weak};

use eframe::egui::{self, Color32, ColorImage, TextureHandle, TextureOptions};

use super::numbers::exposed;
use crate::app::jobs::Picture;
use crate::app::pending::{Answer, Pending};
use crate::app::viewport::{INVALID, signed};
use crate::math::rgb::{CHANNELS, Radiance};
use crate::reconstruct::Reconstruction;
use crate::render::film::Film;
use crate::scene::{Capture, Image};

/// The relative difference at which the colours end.
pub const RANGE: f32 = 0.5;

/// Radiance of the photograph at the pixels of a film; `None` where it has no value.
type Averages = Arc<Vec<Option<Radiance>>>;

/// What pictures are made of.
#[derive(Clone)]
struct Source {
    results: Weak<Reconstruction>,
    film: Weak<Film>,
    capture: Weak<Capture>,
    photograph: usize,
    /// Pixels of the photograph for one of the film, along each side.
    step: usize,
    exposure: f32,
}

impl Source {
    /// Whether the photograph and the pixels it is averaged to are the same.
    fn has_averages_of(&self, other: &Self) -> bool {
        self.capture.ptr_eq(&other.capture)
            && (self.photograph, self.step) == (other.photograph, other.step)
    }

    fn is(&self, other: &Self) -> bool {
        self.has_averages_of(other)
            && self.film.ptr_eq(&other.film)
            && self.exposure == other.exposure
    }
}

/// A film beside its photograph, in numbers.
pub struct Comparison {
    source: Source,
    averages: Averages,
    /// Pixels across.
    pub width: usize,
    /// Each pixel of the photograph and of the render.
    pub values: Vec<(Option<Radiance>, Radiance)>,
    /// Relative RMS over the pixels that both have, of all channels.
    pub rms: Option<f64>,
    pub noise: Option<f64>,
}

/// The pictures of one film, with their numbers.
pub struct Shown {
    pub comparison: Comparison,
    pub pictures: [TextureHandle; 3],
}

/// The newest pictures, and those that are on their way.
#[derive(Default)]
pub struct ComparedPictures {
    shown: Option<Shown>,
    /// What the latest pictures were made of, whether they came or not.
    tried: Option<Source>,
    pending: Option<Pending<(Comparison, [ColorImage; 3])>>,
}

impl ComparedPictures {
    /// The newest ones, if they are of these results and this photograph.
    pub fn shown(&self, results: &Arc<Reconstruction>, photograph: usize) -> Option<&Shown> {
        self.shown.as_ref().filter(|shown| {
            let source = &shown.comparison.source;
            std::ptr::eq(source.results.as_ptr(), Arc::as_ptr(results))
                && source.photograph == photograph
        })
    }

    /// Has the pictures of a film made, one film after the other; of several that come meanwhile,
    /// the last.
    pub fn follow(
        &mut self,
        ctx: &egui::Context,
        capture: &Arc<Capture>,
        picture: &Picture,
        exposure: f32,
    ) {
        let Picture { photograph, step, .. } = *picture;
        let Some(film) = &picture.film else { return };
        match self.pending.as_ref().map(Pending::answer) {
            Some(Answer::Waiting) => return,
            Some(Answer::Ready((comparison, pictures))) => {
                let mut names = ["photograph", "render", "difference"].into_iter();
                let pictures = pictures.map(|picture| {
                    let name = names.next().unwrap_or_default();
                    ctx.load_texture(name, picture, TextureOptions::LINEAR)
                });
                self.shown = Some(Shown { comparison, pictures });
            }
            Some(Answer::Lost) | None => {}
        }
        self.pending = None;
        let source = Source {
            results: Arc::downgrade(&picture.of),
            film: Arc::downgrade(film),
            capture: Arc::downgrade(capture),
            photograph,
            step,
            exposure,
        };
        if self.tried.as_ref().is_some_and(|tried| tried.is(&source)) {
            return;
        }
        self.tried = Some(source.clone());
        let known = self.shown.as_ref().map(|shown| &shown.comparison);
        let known = known.filter(|known| known.source.has_averages_of(&source));
        let known = known.map(|known| known.averages.clone());
        let (film, capture) = (film.clone(), capture.clone());
        self.pending = Some(Pending::start("compare", ctx, move || {
            let image = capture.photographs[photograph].image.as_deref();
            let size = [film.width, film.height];
            let averages = known.unwrap_or_else(|| Arc::new(averages(image, size, step)));
            compared(&film, source, averages)
        }));
    }
}

/// Photograph, render and difference.
fn compared(film: &Film, source: Source, averages: Averages) -> (Comparison, [ColorImage; 3]) {
    let (beauty, coverage) = (film.beauty(), film.coverage());
    let exposure = source.exposure;
    let mut pictures = [const { Vec::new() }; 3];
    let mut values = Vec::with_capacity(beauty.len());
    let (mut sum, mut count) = (0.0f64, 0usize);
    for ((made, seen), coverage) in beauty.iter().zip(averages.iter()).zip(coverage.iter()) {
        let seen = *seen;
        pictures[0].push(seen.map_or(INVALID, |radiance| exposed(radiance, exposure)));
        pictures[1].push(exposed(*made, exposure));
        values.push((seen, *made));
        // A pixel of which a part shows what nobody modelled cannot be compared.
        pictures[2].push(match seen.filter(|_| *coverage > 0.999) {
            None => Color32::TRANSPARENT,
            Some(seen) => {
                let mut mean = 0.0;
                for c in 0..CHANNELS {
                    let relative = (made[c] - seen[c]) / seen[c].max(f32::MIN_POSITIVE);
                    sum += f64::from(relative).powi(2);
                    count += 1;
                    mean += relative / CHANNELS as f32;
                }
                signed(mean / RANGE)
            }
        });
    }
    let size = [film.width, film.height];
    let pictures = pictures.map(|pixels| ColorImage::new(size, pixels));
    let comparison = Comparison {
        source,
        averages,
        width: film.width,
        values,
        rms: (count > 0).then(|| (sum / count as f64).sqrt()).filter(|rms| rms.is_finite()),
        noise: film.noise(),
    };
    (comparison, pictures)
}

/// The photograph, averaged to the pixels of a film.
fn averages(image: Option<&Image>, size: [usize; 2], step: usize) -> Vec<Option<Radiance>> {
    let pixel = |index: usize| {
        let (x, y) = (index % size[0], index / size[0]);
        mean(image?, (x * step, y * step), step)
    };
    (0..size[0] * size[1]).map(pixel).collect()
}

fn mean(image: &Image, (x, y): (usize, usize), step: usize) -> Option<Radiance> {
    let (mut sum, mut count) = ([0.0; CHANNELS], 0);
    for v in y..y + step {
        for u in x..x + step {
            if u < image.width()
                && v < image.height()
                && let Some(radiance) = image.radiance(u, v)
            {
                for (sum, value) in sum.iter_mut().zip(radiance) {
                    *sum += value;
                }
                count += 1;
            }
        }
    }
    (count > 0).then(|| sum.map(|value| value / count as f32))
}
