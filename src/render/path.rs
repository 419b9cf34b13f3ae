//! Paths from the camera into the scene.
//!
//! The estimator is path tracing with next-event estimation. At every vertex, light is sampled from
//! one of the recovered lights (at the first vertices from a few) and from every added light, and
//! the path continues in a direction that is sampled by the BRDF. Two kinds of light are kept
//! apart, because the recovered light already includes the light that the unmodelled part of the
//! room reflects:
//!
//! - recovered light reaches a vertex directly or by reflection at known surfaces and objects;
//! - added light is also reflected by the [`Shell`](super::scene::Shell), a box in place of the
//!   room.
//!
//! If virtual lights lie on known surfaces that no photograph shows, they include all light that
//! these surfaces reflect. A path that meets such a surface is continued for added light only.
//!
//! A ray that leaves the known scene gathers no recovered light except the sky: all other recovered
//! light was sampled at the vertex before. This holds for the specular lobe too, which is widened
//! by the size of the light as in the solve. The sky is sampled in both ways, combined by multiple
//! importance sampling (Veach 1997): beside a window directions of the BRDF are better, deep in a
//! room the cells behind the window.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use crate::geometry::bvh::Ray;
use crate::math::rgb::{CHANNELS, Radiance};
use crate::math::sampling::{Random, mirrored};
use crate::render::lights::{Arriving, Light};
use crate::render::looks::BrdfF32;
use crate::render::scatter::scatter;
use crate::render::scene::{Met, Scene};
use crate::scene::{SurfacePoint, Viewing};

/// Low-discrepancy numbers of one path (Owen-scrambled Sobol; Burley 2020).
///
/// Every vertex of a path has numbers of its own for the path and for each kind of light. A change
/// of the sampled lights therefore changes neither the path nor the contributions of the other
/// lights.
pub struct Sequence {
    index: u32,
    seed: u32,
    /// For what comes after the last dimension, and where points of a set would gain nothing; of
    /// the path alone.
    pub random: Random,
    /// The same for recovered light.
    further: Random,
}

/// Points of one set; the next set has another seed.
const SET: u64 = 1 << 16;
/// Places of a path that have low-discrepancy numbers: of 64 times four dimensions the camera takes
/// four, every place four, and the light of every place four for each sample.
const PLACES: usize = 28;

impl Sequence {
    /// Path `index` of a pixel. Even and odd paths are two independent sets, so that their
    /// difference gives the noise.
    pub fn new(seed: u64, pixel: u64, index: u64) -> Self {
        let (half, index) = (index % 2, index / 2);
        let mut mixed = Random::new(seed, pixel, 2 * (index / SET) + half);
        let (seed, further) = (mixed.next_u64(), mixed.next_u64());
        Self {
            index: (index % SET) as u32,
            seed: seed as u32,
            random: Random::new(seed, pixel, index),
            further: Random::new(further, pixel, index),
        }
    }

    fn four(&self, set: usize) -> [f32; 4] {
        sobol_burley::sample_4d(self.index, set as u32, self.seed)
    }

    /// Where the path begins.
    pub fn point(&self) -> Vec2 {
        let [x, y, ..] = self.four(0);
        Vec2::new(x, y)
    }

    /// A direction to go on in, and a point of every added light.
    fn place(&mut self, depth: usize) -> (Vec2, Vec2) {
        if depth < PLACES {
            let [a, b, c, d] = self.four(1 + depth);
            return (Vec2::new(a, b), Vec2::new(c, d));
        }
        (self.random.point(), self.random.point())
    }

    /// A choice among the recovered lights, and a point of the chosen one.
    fn recovered(&mut self, depth: usize, sample: usize) -> (f32, Vec2) {
        if depth < PLACES {
            let before: usize = (0..depth.min(SAMPLES.len())).map(|depth| SAMPLES[depth]).sum();
            let later = depth.saturating_sub(SAMPLES.len());
            let [a, b, c, _] = self.four(1 + PLACES + before + later + sample);
            return (a, Vec2::new(b, c));
        }
        (self.further.uniform(), self.further.point())
    }
}

/// Properties of the first vertex of a path.
#[derive(Clone, Copy, Debug, Default)]
pub struct First {
    /// Diffuse and specular reflectance together; 0 where nothing is met.
    pub albedo: Radiance,
    pub normal: Vec3,
    /// Metres along the ray; 0 where nothing is met.
    pub distance_m: f32,
    pub is_known: bool,
    pub is_object: bool,
}

/// The lights that a path samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Sought {
    pub recovered: bool,
    /// Indices into the added lights of the scene.
    pub added: Vec<usize>,
}

/// The light of a path: one entry for each of the scene's layers, then one for direct light at the
/// first vertex and for emission that is seen directly.
pub struct Gathered<'a> {
    pub layers: &'a mut [Radiance],
}

impl Gathered<'_> {
    fn add(&mut self, layer: usize, depth: usize, light: Radiance) {
        add(&mut self.layers[layer], light);
        if depth == 0
            && let Some(direct) = self.layers.last_mut()
        {
            add(direct, light);
        }
    }
}

/// The present vertex of a path and its throughput.
#[derive(Clone, Copy)]
struct Place {
    point: SurfacePoint,
    brdf: BrdfF32,
    viewing: Viewing,
    throughput: Radiance,
    depth: usize,
}

/// A direction that a place's surface chose for the path to go on in.
struct Chose {
    place: Place,
    direction: Vec3,
    /// By solid angle.
    density: f32,
    /// The chance with which the path went on.
    survives: f32,
}

/// Recovered lights that are sampled at the first vertices of a path; one is sampled at the later
/// ones. Most visible light is direct light, and a shadow ray costs less than a path.
const SAMPLES: [usize; 2] = [4, 2];

fn samples_at(depth: usize) -> usize {
    SAMPLES.get(depth).copied().unwrap_or(1)
}

/// Vertices from which a path always continues; after them it ends by Russian roulette.
const SURE_DEPTH: usize = 3;

fn add(sum: &mut Radiance, light: Radiance) {
    for (sum, value) in sum.iter_mut().zip(light) {
        *sum += value;
    }
}

fn times(a: Radiance, b: Radiance) -> Radiance {
    std::array::from_fn(|c| a[c] * b[c])
}

fn scaled(a: Radiance, factor: f32) -> Radiance {
    a.map(|value| value * factor)
}

fn largest(a: Radiance) -> f32 {
    a[0].max(a[1]).max(a[2])
}

impl Scene<'_> {
    /// Follows one path from a camera through at most `most` reflections.
    pub fn trace(
        &self,
        ray: Ray,
        most: usize,
        sequence: &mut Sequence,
        sought: &Sought,
        gathered: Gathered,
    ) -> First {
        self.follow(ray, most, sequence, sought, gathered, false)
    }

    /// The same from within the scene, where also the surroundings are met, which no camera sees.
    pub fn incident(
        &self,
        ray: Ray,
        most: usize,
        sequence: &mut Sequence,
        sought: &Sought,
        gathered: Gathered,
    ) {
        self.follow(ray, most, sequence, sought, gathered, true);
    }

    fn follow(
        &self,
        ray: Ray,
        most: usize,
        sequence: &mut Sequence,
        sought: &Sought,
        mut gathered: Gathered,
        is_within: bool,
    ) -> First {
        let mut first = First::default();
        let mut throughput = [1.0f32; CHANNELS];
        let mut ray = ray;
        // Where the ray began, and the density with which its direction was chosen; none for the
        // camera's.
        let mut from: Option<(SurfacePoint, f32)> = None;
        // From here on the recovered light is counted already, or not looked for.
        let mut is_counted = !sought.recovered;
        // Whether the ray comes from a camera or a mirror, where nothing was gathered. Whoever asks from
        // within adds the sky themselves.
        let mut meets_sky = !is_within;
        // Where recovered light was gathered before the ray.
        let mut last: Option<Chose> = None;
        for depth in 0..=most {
            let hit = self.closest(&ray, from.is_none(), &mut sequence.random);
            let distance_m = hit.as_ref().map_or(f32::INFINITY, |hit| hit.t);
            for &index in &sought.added {
                self.added_met(index, &ray, distance_m, from, throughput, depth, &mut gathered);
            }

            let (point, brdf) = match hit {
                Some(hit) => {
                    let point = self.geometry.surface_point(&ray, &hit);
                    let met = self.met(point, hit.triangle, (hit.u, hit.v));
                    if depth == 0 {
                        first = self.first(point, hit.t, &met, self.is_object(hit.triangle));
                    }
                    if let Met::Mirror(reflected) = met {
                        throughput = times(throughput, reflected);
                        ray = self.geometry.ray(point, mirrored(-ray.direction, point.normal));
                        (from, meets_sky, last) = (None, true, None);
                        continue;
                    }
                    // What a camera sees there has to be guessed: what it would reflect.
                    is_counted = is_counted
                        || (depth > 0 || is_within)
                            && !self.is_object(hit.triangle)
                            && self.is_counted(point);
                    match met {
                        Met::Surface(brdf) => (point, brdf),
                        Met::Mirror(_) => unreachable!("mirrors are followed above"),
                        Met::Shining(radiance) => {
                            if !is_counted {
                                let depth = depth.saturating_sub(1);
                                gathered.add(0, depth, times(throughput, radiance));
                            }
                            break;
                        }
                    }
                }
                None => {
                    if meets_sky
                        && !is_counted
                        && let Some((layer, sky)) = self.recovered.sky(ray.direction)
                    {
                        let sky = scaled(sky, self.original_light);
                        gathered.add(layer, depth.saturating_sub(1), times(throughput, sky));
                    }
                    if let Some(chose) = &last {
                        self.sky_met(chose, &mut gathered);
                    }
                    let Some(shell) = self.shell.filter(|_| depth > 0 || is_within) else { break };
                    is_counted = true;
                    let grey = [shell.albedo; CHANNELS];
                    let brdf = BrdfF32 { diffuse: grey, ..BrdfF32::default() };
                    (shell.exit(ray.origin, ray.direction), brdf)
                }
            };
            if depth == most || is_counted && sought.added.is_empty() {
                break;
            }
            let viewing = Viewing::from(-ray.direction, point.normal);
            let place = Place { point, brdf, viewing, throughput, depth };
            if !is_counted {
                self.recovered_at(&place, sequence, &mut gathered);
            }
            let (square, of_light) = sequence.place(depth);
            for &index in &sought.added {
                self.added_at(index, &place, of_light, &mut gathered);
            }

            let Some((direction, weight, density)) = scatter(&brdf, viewing, square) else {
                break;
            };
            throughput = times(throughput, weight);
            let mut survives = 1.0f32;
            if depth + 1 >= SURE_DEPTH {
                survives = largest(throughput).min(0.95);
                if sequence.random.uniform() >= survives {
                    break;
                }
            }
            if largest(throughput) <= 0.0 {
                break;
            }
            throughput = scaled(throughput, 1.0 / survives);
            ray = self.geometry.ray(point, direction);
            (from, meets_sky) = (Some((point, density)), false);
            last = (!is_counted).then_some(Chose { place, direction, density, survives });
        }
        first
    }

    fn first(&self, point: SurfacePoint, distance_m: f32, met: &Met, is_object: bool) -> First {
        let albedo = match met {
            Met::Surface(brdf) => std::array::from_fn(|c| brdf.diffuse[c] + brdf.specular[c]),
            Met::Mirror(reflected) => *reflected,
            Met::Shining(_) => [0.0; CHANNELS],
        };
        First { albedo, normal: point.normal, distance_m, is_known: true, is_object }
    }

    /// An added light that the ray meets, which sampling it might have found as well.
    #[expect(clippy::too_many_arguments, reason = "the state of a path, which nothing else needs")]
    fn added_met(
        &self,
        index: usize,
        ray: &Ray,
        distance_m: f32,
        from: Option<(SurfacePoint, f32)>,
        throughput: Radiance,
        depth: usize,
        gathered: &mut Gathered,
    ) {
        let eye = SurfacePoint { position: ray.origin, normal: ray.direction };
        let (point, density) = from.unwrap_or((eye, f32::INFINITY));
        let found = self.added[index].met(&self.geometry, point, ray.direction, distance_m);
        let Some((radiance, by_light)) = found else { return };
        // The balance heuristic (Veach 1997); a camera looks at lights in one way only.
        let share = if density.is_finite() { density / (density + by_light) } else { 1.0 };
        let light = scaled(times(throughput, radiance), share);
        gathered.add(self.layer_of_added[index], depth.saturating_sub(1), light);
    }

    /// Light of the sky from a direction that a surface chose, which sampling the sky might have
    /// found as well.
    fn sky_met(&self, chose: &Chose, gathered: &mut Gathered) {
        let Chose { place, direction, density, survives } = chose;
        let samples = samples_at(place.depth) as f32;
        for (arriving, light, probability) in self.recovered.cells(place.point, *direction) {
            let over = samples * probability + density * light.shape.solid_angle_sr();
            let reflected = self.reflected(place, arriving, light, over * survives);
            gathered.add(light.layer, place.depth, reflected);
        }
    }

    /// Light of a recovered light that a place reflects, divided by `over`.
    fn reflected(&self, place: &Place, arriving: Arriving, light: &Light, over: f32) -> Radiance {
        let Place { point, brdf, viewing, throughput, .. } = *place;
        let strength = brdf.strength();
        let lobe = if brdf.is_specular() {
            light.shape.lobe(point.position, viewing, brdf.gloss()) as f32
        } else {
            0.0
        };
        let factor = self.original_light / (PI * over);
        let reflected = std::array::from_fn(|c| {
            factor * (brdf.diffuse[c] + strength[c] * lobe) * arriving.irradiance[c]
        });
        times(throughput, reflected)
    }

    fn recovered_at(&self, place: &Place, sequence: &mut Sequence, gathered: &mut Gathered) {
        let Place { point, brdf, viewing, depth, .. } = *place;
        let samples = samples_at(depth);
        for sample in 0..samples {
            let (choice, square) = sequence.recovered(depth, sample);
            let found = self.recovered.choose(&self.geometry, point, choice, square);
            let Some(chosen) = found.filter(|chosen| chosen.is_free(&self.geometry, point)) else {
                continue;
            };
            // The balance heuristic (Veach 1997) over all samples of the light and the one of the
            // surface; both have the sum of their densities below, times the cell's solid angle.
            let mut over = samples as f32 * chosen.probability;
            if let Some((direction, solid_angle_sr)) = chosen.of_sky() {
                let cosine = direction.dot(point.normal);
                over += brdf.density(viewing, direction, cosine) * solid_angle_sr;
            }
            let light = self.reflected(place, chosen.arriving, chosen.light, over);
            gathered.add(chosen.light.layer, depth, light);
        }
    }

    fn added_at(&self, index: usize, place: &Place, square: Vec2, gathered: &mut Gathered) {
        let Place { point, brdf, viewing, throughput, depth } = *place;
        let Some(direct) = self.added[index].sample(&self.geometry, point, square) else { return };
        let reflected = brdf.value(viewing, direct.direction);
        let share = if direct.density > 0.0 {
            let by_surface = brdf.density(viewing, direct.direction, direct.cosine);
            direct.density / (direct.density + by_surface)
        } else {
            1.0
        };
        let light = scaled(times(reflected, direct.light), direct.cosine * share);
        gathered.add(self.layer_of_added[index], depth, times(throughput, light));
    }
}
