//! Visibility: which photographs show a point of the known surfaces, and the radiance that they
//! measured there.
//!
//! Every photograph has a visibility buffer: one ray is cast through the centre of each pixel, and
//! the position and triangle that it hits are kept. Where the nine hits around a pixel lie on one
//! smooth piece of surface, the buffer alone decides whether a point is seen, as a depth buffer
//! would; a point that projects beside an edge is tested with a ray of its own. A surface point has
//! a side, and is seen only by photographs in front of that side.

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{Mat3, Vec2, Vec3};

use super::hits::Hits;
use super::look::Look;
use crate::geometry::bvh::{Blocker, Hit, Ray, RayCaster};
use crate::geometry::mesh::Mesh;
use crate::math::rgb::{CHANNELS, Radiance};
use crate::scene::agreement::Readings;
use crate::scene::{Camera, Capture, Image, Optics};
use crate::watch::{Cancelled, Watch};

/// The photographs that are measurements, with their visibility buffers.
pub struct Views<'a> {
    pub capture: &'a Capture,
    /// The geometry that light meets: without the glass, which it passes.
    pub caster: &'a RayCaster,
    /// The geometry that cameras see.
    pub seen_caster: &'a RayCaster,
    /// Per material, as far as known, which are mirrors or glass.
    pub optics: &'a [Optics],
    /// The visibility buffer of each measurement, in their order.
    pub buffers: Vec<VisibilityBuffer<'a>>,
    /// Unit normal of each triangle, by winding.
    pub normals: Arc<[Vec3]>,
    /// Distance in metres by which rays are started off a surface, against hitting it again.
    pub offset_m: f32,
}

/// The visibility buffer of one photograph: for each pixel the position and triangle that the ray
/// through its centre hits.
pub struct VisibilityBuffer<'a> {
    /// Index into `Capture::photographs`.
    pub photograph: usize,
    pub camera: &'a Camera,
    pub image: &'a Image,
    position: Vec3,
    /// The camera in single precision, for projections of which there are millions.
    camera_from_world: Mat3,
    focal_px: Vec2,
    principal_px: Vec2,
    mesh: &'a Mesh,
    hits: Hits,
}

/// The hits of all visibility buffers, without the photographs, to be used by later runs: they
/// depend on the mesh, the cameras and on which photographs are measurements, and on no tag. 16
/// bytes a pixel, or of more than [`WHOLE_PIXELS`] about one.
#[derive(Clone)]
pub struct VisibilityCache {
    hits: Vec<Hits>,
    normals: Arc<[Vec3]>,
}

/// A side of a point on the known surfaces.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    pub position: Vec3,
    /// Unit normal of the side that is meant.
    pub normal: Vec3,
}

/// Up to so many pixels of all photographs their positions are held, which makes them quicker to
/// read: 256 MB.
pub const WHOLE_PIXELS: usize = 1 << 24;

/// Points whose pixels stay in memory: the system maps 64 kB about a pixel that is read from a file.
const POINTS_HELD: usize = 64;

impl<'a> Views<'a> {
    /// Casts every pixel of every measurement.
    pub fn new(
        capture: &'a Capture,
        caster: &'a RayCaster,
        watch: &Watch,
    ) -> Result<Self, Cancelled> {
        Self::holding(capture, caster, WHOLE_PIXELS, watch)
    }

    /// As [`Self::new`], holding positions of up to so many pixels; whatever their number, what is
    /// read is the same.
    pub fn holding(
        capture: &'a Capture,
        caster: &'a RayCaster,
        most: usize,
        watch: &Watch,
    ) -> Result<Self, Cancelled> {
        let normals: Arc<[Vec3]> = (0..capture.mesh.triangles.len())
            .map(|triangle| capture.mesh.normal(triangle))
            .collect();
        let mut buffers = Vec::new();
        watch.begin(capture.measurements().map(|(_, camera, _)| camera.height as u64).sum());
        let pixels: usize =
            capture.measurements().map(|(_, camera, _)| camera.width * camera.height).sum();
        for (photograph, camera, image) in capture.measurements() {
            let mut buffer = VisibilityBuffer::new(photograph, camera, image, &capture.mesh);
            let look = Look { caster, camera, mesh: &capture.mesh, normals: &normals };
            buffer.hits = look.hits(pixels > most, watch)?;
            buffers.push(buffer);
        }
        let offset_m = offset_m(capture);
        Ok(Self { capture, caster, seen_caster: caster, optics: &[], buffers, normals, offset_m })
    }

    /// Without casting anything: with the visibility buffers of an earlier capture of the same
    /// mesh, cameras and measurements.
    ///
    /// # Panics
    /// If there is no buffer for each measurement, with an entry for each of its pixels.
    pub fn with_visibility(
        capture: &'a Capture,
        caster: &'a RayCaster,
        cache: &VisibilityCache,
    ) -> Self {
        assert_eq!(capture.measurements().count(), cache.hits.len());
        let buffers = std::iter::zip(capture.measurements(), &cache.hits)
            .map(|((photograph, camera, image), hits)| {
                assert_eq!(camera.width * camera.height, hits.len());
                VisibilityBuffer {
                    hits: hits.clone(),
                    ..VisibilityBuffer::new(photograph, camera, image, &capture.mesh)
                }
            })
            .collect();
        let normals = cache.normals.clone();
        let offset_m = offset_m(capture);
        Self { capture, caster, seen_caster: caster, optics: &[], buffers, normals, offset_m }
    }

    /// The hits of all visibility buffers, for [`Self::with_visibility`].
    pub fn visibility(&self) -> VisibilityCache {
        let hits = self.buffers.iter().map(|buffer| buffer.hits.clone()).collect();
        VisibilityCache { hits, normals: self.normals.clone() }
    }

    /// Whether any pixel of any photograph shows the known geometry.
    pub fn shows_anything(&self) -> bool {
        self.buffers.iter().any(VisibilityBuffer::shows_anything)
    }

    /// To be called with a count, from any thread, for each of many points at which pixels are read:
    /// what was read for other points leaves memory, where pixels are kept elsewhere.
    pub fn count_point(&self, count: &AtomicUsize) {
        if count.fetch_add(1, Ordering::Relaxed) % POINTS_HELD == POINTS_HELD - 1 {
            self.buffers.iter().for_each(|buffer| buffer.image.release());
        }
    }

    /// The side of the surface that a ray met.
    pub fn surface_point(&self, ray: &Ray, hit: &Hit) -> SurfacePoint {
        self.side(ray.origin + ray.direction * hit.t, hit.triangle, -ray.direction)
    }

    /// A position on a triangle, with the normal of the side that the direction `towards` leaves from.
    pub fn side(&self, position: Vec3, triangle: u32, towards: Vec3) -> SurfacePoint {
        let normal = self.normals[triangle as usize];
        let normal = if normal.dot(towards) < 0.0 { -normal } else { normal };
        SurfacePoint { position, normal }
    }

    /// A ray from a surface point into its hemisphere.
    pub fn ray(&self, point: SurfacePoint, direction: Vec3) -> Ray {
        Ray {
            origin: point.position + point.normal * self.offset_m,
            direction,
            t_min: 0.0,
            t_max: f32::INFINITY,
        }
    }

    /// Whether the segment from a surface point to a point above its surface is free.
    pub fn is_free(&self, point: SurfacePoint, target: Vec3) -> bool {
        self.is_free_after(point, target, &mut Blocker::default())
    }

    /// The same, but the triangles that blocked an earlier segment are tested first
    /// ([`RayCaster::occluded_after`]).
    pub fn is_free_after(&self, point: SurfacePoint, target: Vec3, last: &mut Blocker) -> bool {
        self.is_free_in(self.caster, point, target, last)
    }

    fn is_free_in(
        &self,
        caster: &RayCaster,
        point: SurfacePoint,
        target: Vec3,
        last: &mut Blocker,
    ) -> bool {
        let origin = point.position + point.normal * self.offset_m;
        let offset = target - origin;
        let length = offset.length();
        if length <= self.offset_m {
            return true;
        }
        // The segment ends short of the target, which may lie on a surface itself.
        let t_max = length * (1.0 - 1e-4) - self.offset_m;
        !caster.occluded_after(&Ray { origin, direction: offset / length, t_min: 0.0, t_max }, last)
    }

    /// The pixel in which a photograph shows a surface point, and the cosine of the angle of view.
    pub fn seen(&self, buffer: &VisibilityBuffer, point: SurfacePoint) -> Option<Seen> {
        let towards = buffer.position - point.position;
        // Facing away: the commonest case, and the cheapest to tell.
        if towards.dot(point.normal) <= 0.0 {
            return None;
        }
        let (x, y) = buffer.pixel(point.position)?;
        let distance = towards.length();
        let direction = towards / distance;
        let seen = Seen { x, y, direction, cosine: direction.dot(point.normal) };
        let index = y * buffer.camera.width + x;
        let hit = buffer.hits.seen(index);
        if let Some(triangle) = hit.triangle().filter(|_| hit.is_clean()) {
            let position = buffer.hits.position(buffer.camera, buffer.mesh, index);
            let footprint = distance / buffer.focal_px.min_element();
            let normal = self.normals[triangle as usize];
            // How far along the line of sight the point is off the pixel's tangent plane.
            let cosine = normal.dot(direction).abs().max(0.02);
            let off_plane = normal.dot(point.position - position).abs() / cosine;
            if off_plane <= footprint {
                return Some(seen);
            }
            if distance > buffer.position.distance(position) + 4.0 * footprint
                && off_plane > 4.0 * footprint
            {
                return None;
            }
        }
        self.is_in_sight(buffer, point).then_some(seen)
    }

    /// Whether nothing lies between a surface point and a camera. [`Self::seen`] does not tell apart
    /// what lies less than a pixel behind what the photograph shows.
    pub fn is_in_sight(&self, buffer: &VisibilityBuffer, point: SurfacePoint) -> bool {
        self.is_free_in(self.seen_caster, point, buffer.position, &mut Blocker::default())
    }

    /// Whether any photograph has a measurement at a surface point.
    pub fn is_measured(&self, point: SurfacePoint) -> bool {
        self.buffers.iter().any(|buffer| {
            self.seen(buffer, point)
                .is_some_and(|seen| buffer.image.radiance(seen.x, seen.y).is_some())
        })
    }

    /// The radiance that a surface point sends all around, on which the photographs that measure it agree
    /// ([`agreed`](super::agreed)); `None` where none does. Pixels beside an edge, which show a part of
    /// another surface, count only where fewer than two others show the point. Of many photographs, a few
    /// are asked, beginning with one that depends on the surface point, so that a mean over surface points
    /// is one over all photographs; more are asked where those few do not agree.
    pub fn radiance(&self, point: SurfacePoint) -> Option<Radiance> {
        let bits = point.position.to_array().map(f32::to_bits);
        let mixed =
            (bits[0] ^ bits[1].rotate_left(11) ^ bits[2].rotate_left(22)).wrapping_mul(0x9e37_79b9);
        let first = (mixed >> 8) as usize % self.buffers.len().max(1);
        let (mut off_edges, mut beside_edges) = (Readings::default(), Readings::default());
        for buffer in self.buffers[first..].iter().chain(&self.buffers[..first]) {
            let Some(Seen { x, y, .. }) = self.seen(buffer, point) else { continue };
            let Some(radiance) = buffer.image.radiance(x, y) else { continue };
            if buffer.is_off_edges(x, y) { &mut off_edges } else { &mut beside_edges }
                .add(radiance);
            if off_edges.is_enough() {
                break;
            }
        }
        off_edges.agreed_or_with(&beside_edges)
    }
}

/// Neighbouring pixels that show the same triangle.
#[derive(Clone, Debug)]
pub struct Run {
    pub columns: Range<usize>,
    pub triangle: u32,
    /// Whether they are off every face and silhouette edge by a pixel.
    pub is_off_edges: bool,
}

/// The position of a surface point in a photograph.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    pub x: usize,
    pub y: usize,
    /// Unit direction from the surface point to the camera.
    pub direction: Vec3,
    /// Cosine between that direction and the surface point's normal.
    pub cosine: f32,
}

impl<'a> VisibilityBuffer<'a> {
    /// Without hits.
    fn new(photograph: usize, camera: &'a Camera, image: &'a Image, mesh: &'a Mesh) -> Self {
        Self {
            photograph,
            camera,
            image,
            position: camera.position.as_vec3(),
            camera_from_world: camera.world_from_camera.transpose().as_mat3(),
            focal_px: camera.focal_px.as_vec2(),
            principal_px: camera.principal_px.as_vec2(),
            mesh,
            hits: Hits::default(),
        }
    }

    /// The pixel that a point in front of the camera projects into.
    pub(super) fn pixel(&self, point: Vec3) -> Option<(usize, usize)> {
        if !self.camera.distortion.is_none() {
            let (pixel, _) = self.camera.project(point.as_dvec3())?;
            return Some((pixel.x as usize, pixel.y as usize));
        }
        let local = self.camera_from_world * (point - self.position);
        if local.z >= 0.0 {
            return None;
        }
        let image = Vec2::new(local.x, -local.y) / -local.z;
        let pixel = image * self.focal_px + self.principal_px;
        let inside = pixel.x >= 0.0
            && pixel.y >= 0.0
            && pixel.x < self.camera.width as f32
            && pixel.y < self.camera.height as f32;
        inside.then_some((pixel.x as usize, pixel.y as usize))
    }

    /// The triangle and position at a pixel's centre.
    pub fn hit(&self, x: usize, y: usize) -> Option<(Vec3, u32)> {
        let index = y * self.camera.width + x;
        let triangle = self.hits.seen(index).triangle()?;
        Some((self.hits.position(self.camera, self.mesh, index), triangle))
    }

    /// The triangle alone, which is quicker to read.
    pub fn triangle(&self, x: usize, y: usize) -> Option<u32> {
        self.hits.seen(y * self.camera.width + x).triangle()
    }

    /// The pixels of a row that show the known geometry, in runs from the left.
    pub fn runs(&self, y: usize) -> impl Iterator<Item = Run> + '_ {
        let (first, end) = (y * self.camera.width, (y + 1) * self.camera.width);
        let mut next = first;
        let run = move || {
            while next < end {
                let begin = next;
                let seen;
                (seen, next) = self.hits.run(begin, end);
                if let Some(triangle) = seen.triangle() {
                    let columns = begin - first..next - first;
                    return Some(Run { columns, triangle, is_off_edges: seen.is_clean() });
                }
            }
            None
        };
        std::iter::from_fn(run)
    }

    /// Whether a pixel is off every face and silhouette edge by a pixel.
    pub fn is_off_edges(&self, x: usize, y: usize) -> bool {
        self.hits.seen(y * self.camera.width + x).is_clean()
    }

    /// Whether any pixel shows the known geometry.
    pub fn shows_anything(&self) -> bool {
        self.hits.any()
    }

    /// The mean radiance in a window of `width_px` (odd) pixels about a pixel. Where one of these pixels is
    /// not valid, lies beside an edge or beyond the border, the radiance of the pixel alone: part of what a
    /// pixel beside an edge shows belongs to another surface, and the mean of the others is that of points
    /// farther from the edge.
    pub fn window(&self, x: usize, y: usize, width_px: usize) -> Option<Radiance> {
        let alone = self.image.radiance(x, y)?;
        Some(self.whole_window(x, y, width_px / 2).unwrap_or(alone))
    }

    /// The mean over all pixels up to `reach` columns and rows from a pixel; `None` unless all are valid and
    /// off the edges.
    fn whole_window(&self, x: usize, y: usize, reach: usize) -> Option<Radiance> {
        let (left, top) = (x.checked_sub(reach)?, y.checked_sub(reach)?);
        let (right, bottom) = (x + reach, y + reach);
        if right >= self.camera.width || bottom >= self.camera.height {
            return None;
        }
        let mut sum = [0.0f32; CHANNELS];
        for v in top..=bottom {
            for u in left..=right {
                let radiance = self.image.radiance(u, v).filter(|_| self.is_off_edges(u, v))?;
                sum.iter_mut().zip(radiance).for_each(|(sum, value)| *sum += value);
            }
        }
        let count = (2 * reach + 1).pow(2);
        Some(sum.map(|sum| sum / count as f32))
    }
}

/// By which rays are started off the surfaces of a capture.
pub(super) fn offset_m(capture: &Capture) -> f32 {
    let extent = capture.mesh.bounds().map_or(1.0, |(low, high)| {
        (high - low).length().max(low.abs().max_element()).max(high.abs().max_element())
    });
    2e-5 * extent
}
