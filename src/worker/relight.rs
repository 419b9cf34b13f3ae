//! A recovered scene that is looked at while it is changed: pictures that are coarse within a
//! moment of every change, and get clearer until the next.

use std::collections::BTreeMap;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use glam::DVec2;
use rayon::prelude::*;

use crate::geometry::bvh::RayCaster;
use crate::math::rgb::{CHANNELS, Radiance};
use crate::render::composite::compose;
use crate::render::denoise::denoised;
use crate::render::edits::{Edits, Object};
use crate::render::film::Film;
use crate::render::lights::{IrradianceGrid, Recovered};
use crate::render::scene::{Geometry, Scene, Solved};
use crate::render::{RenderOptions, add_paths};
use crate::scene::{Camera, Capture, Image, Photograph, Views};
use crate::watch::{Cancelled, Watch};
use crate::worker::event::JobEvent;

/// A session over one recovered scene; it lasts until it is cancelled.
#[derive(Clone, Debug)]
pub struct Relighting {
    /// The capture that was reconstructed.
    pub capture: Arc<Capture>,
    /// What was recovered.
    pub solved: Arc<Solved>,
    /// Where requests come in while this runs.
    pub latest: LatestRequest,
}

/// A picture that is asked for: which scene, from where.
#[derive(Clone, Debug, PartialEq)]
pub struct PreviewRequest {
    /// Added lights and objects, and changed materials.
    pub edits: Arc<Edits>,
    /// The view; its size is that of the finest picture.
    pub camera: Camera,
    /// Index of the photograph, taken from the same place, that the edits are composited into.
    pub photograph: Option<usize>,
    /// Also give the scene without edits.
    pub before: bool,
}

/// The picture of a request, as far as it is refined.
#[derive(Clone, Debug)]
pub struct Relit {
    /// The number that [`LatestRequest::put`] gave the request.
    pub number: u64,
    /// In pixels.
    pub width: usize,
    /// In pixels.
    pub height: usize,
    /// Radiance, and the part of the pixel that it covers.
    pub after: Vec<(Radiance, f32)>,
    /// The scene without edits, or the photograph.
    pub before: Option<Vec<(Radiance, f32)>>,
    /// Paths per pixel.
    pub paths: usize,
    /// No finer picture of this request follows.
    pub is_done: bool,
}

/// A slot that holds the newest request alone: an older one that is not finished is dropped. Clones
/// share the slot.
#[derive(Clone, Debug, Default)]
pub struct LatestRequest(Arc<(Mutex<Slot>, Condvar)>);

#[derive(Debug, Default)]
struct Slot {
    request: Option<Arc<PreviewRequest>>,
    number: u64,
    /// Cancels the picture in progress.
    answering: Option<Watch>,
}

impl LatestRequest {
    /// Replaces the request before, whose picture is cancelled; returns the new request's number.
    pub fn put(&self, request: PreviewRequest) -> u64 {
        let mut slot = self.lock();
        slot.request = Some(Arc::new(request));
        slot.number += 1;
        if let Some(watch) = &slot.answering {
            watch.cancel();
        }
        self.0.1.notify_all();
        slot.number
    }

    /// Waits for a request with a number above `seen`.
    fn next(&self, seen: u64, watch: &Watch) -> Result<(u64, Arc<PreviewRequest>), Cancelled> {
        let mut slot = self.lock();
        loop {
            watch.check()?;
            if let Some(request) = slot.request.clone().filter(|_| slot.number > seen) {
                return Ok((slot.number, request));
            }
            // Cancelling a watch does not signal the condition variable, so it is polled.
            let waited = self.0.1.wait_timeout(slot, Duration::from_millis(50));
            slot = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// A watch that is cancelled as soon as there is a request with a number above `number`.
    fn until_later(&self, number: u64, watch: &Watch) -> Watch {
        let part = watch.part();
        let mut slot = self.lock();
        if slot.number > number {
            part.cancel();
        }
        slot.answering = Some(part.clone());
        part
    }

    fn lock(&self) -> MutexGuard<'_, Slot> {
        self.0.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Pixels along a side of one of the picture's, coarsest first.
const STEPS: [usize; 3] = [4, 2, 1];
/// Paths per pixel at which a picture is shown; between them it would hardly change.
const SHOWN: [usize; 7] = [4, 8, 16, 32, 64, 128, 256];
/// Pixels of the finest picture; larger ones would take minutes, and memory.
const MOST_PIXELS: usize = 1 << 20;

type Picture = Vec<(Radiance, f32)>;

/// Renders requests until cancelled, on threads of low priority: refinement uses every core all the
/// time, and the window must stay responsive on a machine that has few.
pub(super) fn perform(
    relighting: &Relighting,
    watch: &Watch,
    emit: &(dyn Fn(JobEvent) + Sync),
) -> Result<JobEvent, Cancelled> {
    let threads = rayon::ThreadPoolBuilder::new()
        .thread_name(|_| "relight".to_owned())
        .start_handler(|_| lower_thread_priority())
        .build();
    match threads {
        Ok(threads) => threads.install(|| answer_all(relighting, watch, emit)),
        Err(_) => answer_all(relighting, watch, emit),
    }
}

/// Lowers the priority of this thread, where that is possible.
fn lower_thread_priority() {
    #[cfg(target_os = "linux")]
    // SAFETY: takes numbers only. On Linux, process 0 is the calling thread. Whether it succeeds
    // changes no result.
    unsafe {
        libc::setpriority(libc::PRIO_PROCESS, 0, 10);
    }
}

fn answer_all(
    relighting: &Relighting,
    watch: &Watch,
    emit: &(dyn Fn(JobEvent) + Sync),
) -> Result<JobEvent, Cancelled> {
    let Relighting { capture, solved, latest } = relighting;
    let caster = RayCaster::build(&capture.mesh.positions, &capture.mesh.triangles);
    let views = Views::new(capture, &caster, watch)?;
    let bare = Edits::default();
    let bare_geometry = Geometry::new(capture, solved, &bare);
    let grid = Arc::new(IrradianceGrid::new(&views, solved));
    let bare_lit = Arc::new(Recovered::new(grid, capture, solved, &bare));
    let mut placed: Option<(Vec<Object>, Geometry)> = None;
    // The recovered lights with the edits' changes of their groups.
    let (mut groups, mut lit) = (BTreeMap::new(), bare_lit.clone());
    let mut without = BaselineCache::default();
    let mut seen = 0;
    loop {
        let (number, request) = latest.next(seen, watch)?;
        seen = number;
        let PreviewRequest { edits, camera, photograph, before } = &*request;
        let geometry = if edits.objects.is_empty() {
            &bare_geometry
        } else {
            let kept = placed.take().filter(|(objects, _)| *objects == edits.objects);
            let new = || (edits.objects.clone(), Geometry::new(capture, solved, edits));
            &placed.insert(kept.unwrap_or_else(new)).1
        };
        if groups != edits.groups {
            groups.clone_from(&edits.groups);
            lit = Arc::new(bare_lit.with_groups(capture, solved, edits));
        }
        let places = [camera.position.as_vec3()];
        let scene = Scene::lit_by(lit.clone(), &views, geometry, solved, edits, &places);
        let plain = Scene::lit_by(bare_lit.clone(), &views, &bare_geometry, solved, &bare, &places);
        let photograph = photograph.and_then(|index| capture.photographs.get(index));
        without.keep_for(camera);
        let mut answer = || -> Result<(), Cancelled> {
            let finest = (1..)
                .find(|step| {
                    camera.width.div_ceil(*step) * camera.height.div_ceil(*step) <= MOST_PIXELS
                })
                .unwrap_or(1);
            for step in STEPS {
                let is_last = step == 1;
                let reduced = camera.reduced(step * finest);
                if reduced.width * reduced.height == 0 {
                    continue;
                }
                let photograph = photograph.map(|photograph| seen_by(&reduced, photograph));
                // While the view turns, requests come faster than pictures are made: the coarsest
                // picture is never cancelled, or nothing would be shown.
                let answering = if step == STEPS[0] {
                    watch.clone()
                } else {
                    latest.until_later(number, watch)
                };
                let counts = if is_last { &SHOWN[..] } else { &SHOWN[..1] };
                let mut film = Film::new(reduced.width, reduced.height, 1 + scene.added.len());
                for &paths in counts {
                    grow(&mut film, &scene, &reduced, paths, &answering)?;
                    let clear = denoised(&film);
                    let plain = if *before || photograph.is_some() {
                        Some(without.picture(step, paths, &plain, &reduced, &answering)?)
                    } else {
                        None
                    };
                    let light = edits.original_light as f32;
                    let (after, before) = pictures(&clear, plain, photograph.as_ref(), light);
                    emit(JobEvent::Relit(Arc::new(Relit {
                        number,
                        width: reduced.width,
                        height: reduced.height,
                        after,
                        before: before.filter(|_| request.before),
                        paths,
                        is_done: is_last && Some(&paths) == SHOWN.last(),
                    })));
                }
            }
            Ok(())
        };
        // Cancelled by a newer request the loop goes on; cancelled by the session it ends.
        if answer().is_err() {
            watch.check()?;
        }
    }
}

/// Traces until every pixel has so many paths. On an error the film is incomplete and must be
/// dropped.
fn grow(
    film: &mut Film,
    scene: &Scene,
    camera: &Camera,
    paths: usize,
    watch: &Watch,
) -> Result<(), Cancelled> {
    let count = paths.saturating_sub(film.paths);
    add_paths(scene, camera, &RenderOptions::default(), film, count, watch)
}

/// Pictures of the scene without edits from one camera; they stay valid while lights and objects
/// are moved.
#[derive(Default)]
struct BaselineCache {
    camera: Option<Camera>,
    /// By the side of a coarse pixel, in pixels of the full picture.
    films: BTreeMap<usize, Film>,
    /// By that side and paths per pixel: the difference of two pictures has least noise where both
    /// have the same number of paths.
    pictures: BTreeMap<(usize, usize), Arc<Picture>>,
}

impl BaselineCache {
    fn keep_for(&mut self, camera: &Camera) {
        if self.camera != Some(*camera) {
            *self = Self { camera: Some(*camera), ..Self::default() };
        }
    }

    fn picture(
        &mut self,
        step: usize,
        paths: usize,
        scene: &Scene,
        camera: &Camera,
        watch: &Watch,
    ) -> Result<Arc<Picture>, Cancelled> {
        if let Some(picture) = self.pictures.get(&(step, paths)) {
            return Ok(picture.clone());
        }
        let mut film =
            self.films.remove(&step).unwrap_or_else(|| Film::new(camera.width, camera.height, 1));
        grow(&mut film, scene, camera, paths, watch)?;
        let picture = Arc::new(covered(&denoised(&film)));
        self.films.insert(step, film);
        self.pictures.insert((step, paths), picture.clone());
        Ok(picture)
    }
}

fn covered(film: &Film) -> Picture {
    film.beauty().into_iter().zip(film.coverage()).collect()
}

/// The pictures after and before the edits: composited into a photograph, or of the scene alone.
fn pictures(
    film: &Film,
    plain: Option<Arc<Picture>>,
    photograph: Option<&Image>,
    light: f32,
) -> (Picture, Option<Picture>) {
    let Some((plain, photograph)) = plain.as_ref().zip(photograph) else {
        return (covered(film), plain.map(Arc::unwrap_or_clone));
    };
    let without: Vec<Radiance> = plain.iter().map(|(radiance, _)| *radiance).collect();
    let composed = compose(film, &without, photograph, light).picture;
    let measured =
        |index: usize| photograph.radiance(index % photograph.width(), index / photograph.width());
    let coverage = film.coverage().into_iter().enumerate();
    let coverage = coverage.map(|(index, c)| if measured(index).is_some() { 1.0 } else { c });
    let after = composed.into_iter().zip(coverage).collect();
    let before = plain.iter().enumerate();
    let before = before.map(|(index, plain)| measured(index).map_or(*plain, |seen| (seen, 1.0)));
    (after, Some(before.collect()))
}

/// A photograph as another camera at the same place would have taken it, without distortion:
/// nothing where it shows nothing, or no measurement.
fn seen_by(camera: &Camera, photograph: &Photograph) -> Image {
    let nothing = [f32::NAN; CHANNELS];
    let at = |index: usize| {
        let image = photograph.image.as_ref()?;
        let corner = DVec2::new((index % camera.width) as f64, (index / camera.width) as f64);
        let direction = camera.direction(corner + 0.5)?;
        let (place, _) = photograph.camera.project(photograph.camera.position + direction)?;
        image.radiance(
            (place.x as usize).min(image.width() - 1),
            (place.y as usize).min(image.height() - 1),
        )
    };
    let pixels = (0..camera.width * camera.height)
        .into_par_iter()
        .map(|index| at(index).unwrap_or(nothing))
        .collect();
    Image::new(camera.width, camera.height, pixels, None)
}
