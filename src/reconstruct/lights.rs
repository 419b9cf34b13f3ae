//! Section 4.2: virtual light sources, which replace the unmodelled surroundings.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::geometry::bvh::Blocker;
use crate::geometry::spaced::select_spaced;
use crate::math::sampling::{
    Frame, Random, grid_side, square_to_disc, square_to_uniform_hemisphere, stratified,
};
use crate::options;
use crate::reconstruct::Stream;
use crate::reconstruct::samples::{SampleCloud, spacing_for};
use crate::scene::{Gloss, SurfacePoint, Viewing, Views};
use crate::watch::{Cancelled, Watch};

options! {
    /// Where virtual lights are placed.
    LightOptions in "lights" {
        /// Rays sent from each sample to find places for virtual lights (Section 4.2).
        rays_per_sample: usize = 16, Some((1.0, 1e4)), "";
        /// Number of virtual lights aimed at when their spacing is chosen automatically.
        count: usize = 140, Some((1.0, 1e5)), "";
        /// Minimum distance between virtual lights (5 to 10 in Section 4.2); auto: chosen to
        /// reach the count, but at least 5.
        spacing_factor: Option<f64> = None, Some((0.1, 1e3)), "sample spacings";
        /// Radius of the bounding sphere that carries lights where no geometry is known,
        /// measured from the geometry's centre.
        radius_factor: f64 = 1.2, Some((1.0, 100.0)), "half-diagonals";
        /// Radius of a light's disc. The paper's print has 1; discs that overlap less fit
        /// better.
        disc_radius_factor: f64 = 0.5, Some((0.01, 10.0)), "light spacings";
    }
}

/// The virtual light sources, without their emissions.
#[derive(Clone, Debug, Default)]
pub struct VirtualLights {
    /// The lights; lobes refer to them by index.
    pub lights: Vec<VirtualLight>,
    /// Minimum distance between lights in metres.
    pub spacing_m: f32,
    /// Centre of the sphere around the geometry on which lights are placed where no surface is
    /// known.
    pub sphere_center: Vec3,
    /// Its radius in metres.
    pub sphere_radius_m: f32,
}

/// One virtual light: where it is, and the shape it is taken to have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VirtualLight {
    /// Which of the other fields have a meaning.
    pub kind: LightKind,
    /// Centre; without meaning for a light at infinity.
    pub position: Vec3,
    /// Unit normal: into the bounding sphere, or the known surface's own; for a light at
    /// infinity the direction in which its light travels.
    pub normal: Vec3,
    /// Radius of the disc or ball that the light is taken to be.
    pub radius_m: f32,
    /// Half the angle of the cone from which the light of a sky cell or the sun comes, in
    /// radians; 0 for lights at a finite distance.
    pub half_angle: f32,
}

/// The kind of light source that a virtual light represents.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightKind {
    /// A disc on the bounding sphere.
    Sphere,
    /// A disc on a known surface that no photograph measures.
    Surface,
    /// A ball anywhere in space: a luminaire that the reconstruction found.
    Lamp,
    /// A part of the sky, at infinity.
    Sky,
    /// At infinity; its emission is the irradiance of a surface that faces it.
    Sun,
    /// A known light, `Capture::lights[index]`; its emission is its radiance, intensity or
    /// irradiance.
    Known(usize),
}

impl VirtualLight {
    /// A disc at a finite distance.
    pub fn disc(kind: LightKind, position: Vec3, normal: Vec3, radius_m: f32) -> Self {
        Self { kind, position, normal, radius_m, half_angle: 0.0 }
    }

    /// A ball that emits from all of its surface.
    pub fn lamp(position: Vec3, radius_m: f32) -> Self {
        Self::disc(LightKind::Lamp, position, Vec3::Z, radius_m)
    }

    /// A cone of directions at infinity, whose light travels along `normal`.
    pub fn distant(kind: LightKind, normal: Vec3, half_angle: f32) -> Self {
        Self { kind, position: Vec3::ZERO, normal, radius_m: 0.0, half_angle }
    }

    /// A_i, the area of its disc (of a lamp, its cross section) in m².
    pub fn area_m2(&self) -> f32 {
        std::f32::consts::PI * self.radius_m * self.radius_m
    }

    /// The solid angle of a light at infinity, in sr.
    pub fn solid_angle_sr(&self) -> f32 {
        // 1 − cos written so that it does not cancel for the sun.
        4.0 * std::f32::consts::PI * (0.5 * self.half_angle).sin().powi(2)
    }

    /// Whether the light is at infinity.
    pub fn is_distant(&self) -> bool {
        matches!(self.kind, LightKind::Sky | LightKind::Sun)
    }

    /// Unit direction from a point to the light's middle, −ω_i.
    pub fn direction_from(&self, position: Vec3) -> Vec3 {
        if self.is_distant() {
            -self.normal
        } else {
            (self.position - position).normalize_or_zero()
        }
    }

    /// π f/ρ_s of a specular lobe ([`Gloss::value`]), averaged over the light's extent.
    pub fn lobe(&self, position: Vec3, viewing: Viewing, gloss: Gloss) -> f64 {
        gloss.value(viewing, self.direction_from(position), self.angle_from(position).into())
    }

    /// Its angular radius seen from a position, in radians, at most 1.
    pub fn angle_from(&self, position: Vec3) -> f32 {
        if self.is_distant() {
            return self.half_angle;
        }
        let distance = self.position.distance(position).max(f32::MIN_POSITIVE);
        (self.radius_m / distance).min(1.0)
    }

    /// V(x, A_i): the fraction of the light that is visible from a surface point.
    pub fn visibility(&self, views: &Views, point: SurfacePoint, rays: &mut VisibilityRays) -> f32 {
        // The sun is smaller than the angle that samples resolve.
        let side = if self.kind == LightKind::Sun { 1 } else { rays.side };
        let discs: Vec<Vec2> = stratified(side, &mut rays.random).map(square_to_disc).collect();
        self.visible_part(views, point, &discs, &mut rays.last)
    }

    /// The same by rays to places of the light that points of the unit disc stand for.
    pub fn visible_part(
        &self,
        views: &Views,
        point: SurfacePoint,
        discs: &[Vec2],
        last: &mut Blocker,
    ) -> f32 {
        let frame = self.frame(point);
        let is_free = |disc: &&Vec2| self.is_free(views, point, frame, **disc, last);
        let free = discs.iter().filter(is_free).count();
        free as f32 / discs.len() as f32
    }

    /// Whether the place of the light for a point of the unit square is visible from a surface
    /// point.
    pub fn is_seen(&self, views: &Views, point: SurfacePoint, square: Vec2) -> bool {
        let frame = self.frame(point);
        self.is_free(views, point, frame, square_to_disc(square), &mut Blocker::default())
    }

    /// About the direction that the light's disc faces.
    fn frame(&self, point: SurfacePoint) -> Frame {
        Frame::about(match self.kind {
            // A ball shows every surface point the same disc.
            LightKind::Lamp => self.direction_from(point.position),
            _ => self.normal,
        })
    }

    /// The direction to the place of a light at infinity for a point of the unit square: uniform
    /// over its cone.
    pub fn direction_within(&self, square: Vec2) -> Vec3 {
        self.distant_direction(Frame::about(self.normal), square_to_disc(square))
    }

    fn distant_direction(&self, frame: Frame, disc: Vec2) -> Vec3 {
        let spread = (0.5 * self.half_angle).sin() * disc;
        let height = 1.0 - 2.0 * spread.length_squared();
        let out = 2.0 * spread * (1.0 - spread.length_squared()).max(0.0).sqrt();
        -(frame.tangent * out.x + frame.bitangent * out.y + frame.normal * height)
    }

    fn is_free(
        &self,
        views: &Views,
        point: SurfacePoint,
        frame: Frame,
        disc: Vec2,
        last: &mut Blocker,
    ) -> bool {
        if self.is_distant() {
            let direction = self.distant_direction(frame, disc);
            direction.dot(point.normal) > 0.0
                && !views.caster.occluded_after(&views.ray(point, direction), last)
        } else {
            let out = frame.tangent * disc.x + frame.bitangent * disc.y;
            let target = self.position + self.radius_m * out;
            // The part of a disc below a surface point's horizon is hidden by the surface point's
            // own surface.
            let above = (target - point.position).dot(point.normal) > 0.0;
            above && views.is_free_after(point, target, last)
        }
    }
}

/// The rays that measure which part of each light is visible from a surface point: `side`² jittered rays
/// for each light, one light after the other.
pub struct VisibilityRays {
    /// Rays along each side of the grid.
    pub side: usize,
    /// Where in their cells they are.
    pub random: Random,
    /// What blocked the last one that was blocked.
    last: Blocker,
}

impl VisibilityRays {
    /// Before any of them.
    pub fn new(side: usize, random: Random) -> Self {
        Self { side, random, last: Blocker::default() }
    }
}

/// Lights closer together than this many sample spacings illuminate the samples almost alike.
const SMALLEST_FACTOR: f32 = 5.0;

/// Places virtual lights where rays from the samples leave what is known.
pub fn place(
    views: &Views,
    cloud: &SampleCloud,
    options: &LightOptions,
    seed: u64,
    watch: &Watch,
) -> Result<VirtualLights, Cancelled> {
    let (low, high) = views.capture.mesh.bounds().unwrap_or_default();
    let sphere_center = 0.5 * (low + high);
    let sphere_radius_m = options.radius_factor as f32 * 0.5 * (high - low).length();
    let side = grid_side(options.rays_per_sample);

    watch.begin(cloud.samples.len() as u64);
    let found: Vec<Vec<VirtualLight>> = cloud
        .samples
        .par_iter()
        .enumerate()
        .map(|(index, sample)| {
            watch.tick()?;
            let mut random = Random::new(seed, Stream::Lights as u64, index as u64);
            let frame = Frame::about(sample.normal);
            let point = sample.surface_point();
            let squares: Vec<_> = stratified(side, &mut random).collect();
            let place = |square| {
                let ray = views.ray(point, frame.to_world(square_to_uniform_hemisphere(square)));
                let (kind, position, normal) = match views.caster.closest(&ray) {
                    Some(hit) => {
                        let point = views.surface_point(&ray, &hit);
                        if views.is_measured(point) {
                            return None;
                        }
                        (LightKind::Surface, point.position, point.normal)
                    }
                    None => {
                        let offset = ray.origin - sphere_center;
                        let along = offset.dot(ray.direction);
                        let beyond = along * along - offset.length_squared()
                            + sphere_radius_m * sphere_radius_m;
                        if beyond < 0.0 {
                            return None;
                        }
                        let position = ray.origin + ray.direction * (beyond.sqrt() - along);
                        let inward = (sphere_center - position).normalize_or_zero();
                        (LightKind::Sphere, position, inward)
                    }
                };
                Some(VirtualLight::disc(kind, position, normal, 0.0))
            };
            Ok(squares.into_iter().filter_map(place).collect())
        })
        .collect::<Result<_, Cancelled>>()?;

    let candidates: Vec<VirtualLight> = found.into_iter().flatten().collect();
    // The rays of one sample come one after the other; in that order the first samples would
    // decide where all lights are.
    let mut order: Vec<u32> = (0..candidates.len() as u32).collect();
    Random::new(seed, Stream::Lights as u64, u64::MAX).shuffle(&mut order);
    let positions: Vec<Vec3> = candidates.iter().map(|light| light.position).collect();
    let spacing_m = match options.spacing_factor {
        Some(factor) => factor as f32 * cloud.spacing_m,
        None => spacing_for(&positions, &order, options.count, watch)?
            .max(SMALLEST_FACTOR * cloud.spacing_m),
    };
    let kept = select_spaced(&positions, &order, spacing_m, watch)?;
    let radius_m = options.disc_radius_factor as f32 * spacing_m;
    let light = |index: u32| VirtualLight { radius_m, ..candidates[index as usize] };
    Ok(VirtualLights {
        lights: kept.into_iter().map(light).collect(),
        spacing_m,
        sphere_center,
        sphere_radius_m,
    })
}
