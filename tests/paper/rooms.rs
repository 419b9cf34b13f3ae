//! Scenes built in memory. Rays are intersected in double precision by testing every triangle,
//! and camera rays are made from the definition of the camera, so nothing is shared with the
//! library but its plain data types.

use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3, Vec2, Vec3};
use lobelia::geometry::bvh::RayCaster;
use lobelia::geometry::mesh::Mesh;
use lobelia::math::rgb::{Radiance, Rgb};
use lobelia::reconstruct::options::{Method, Options};
use lobelia::reconstruct::samples::{Sample, SampleCloud};
use lobelia::reconstruct::{Error, Reconstruction};
use lobelia::scene::{
    Camera, Capture, Distortion, Image, KnownLight, Material, MaterialKind, Photograph, Role,
    Surface,
};
use lobelia::watch::Watch;
use rayon::prelude::*;

/// A capture in the making.
#[derive(Clone, Default)]
pub struct Room {
    pub capture: Capture,
    polygons: u32,
}

impl Room {
    /// A material with one surface of its own; returns the surface, which has the material's
    /// index where only this function makes surfaces.
    pub fn material(&mut self, name: &str, kind: MaterialKind) -> usize {
        let surface = self.capture.surfaces.len();
        let role = Role::Material(self.capture.materials.len());
        self.capture.surfaces.push(Surface { name: name.into(), role, has_texcoords: false });
        self.capture.materials.push(Material {
            name: name.into(),
            kind,
            surfaces: vec![surface],
            textured: false,
            known_diffuse: None,
            known_diffuse_sd: None,
        });
        surface
    }

    pub fn diffuse(&mut self, name: &str) -> usize {
        self.material(name, MaterialKind::Diffuse)
    }

    pub fn luminaire(&mut self, name: &str) -> usize {
        let surface = self.capture.surfaces.len();
        let role = Role::Luminaire(self.capture.lights.len());
        self.capture.surfaces.push(Surface { name: name.into(), role, has_texcoords: false });
        self.capture
            .lights
            .push(KnownLight::Visible { name: name.into(), surfaces: vec![surface] });
        surface
    }

    pub fn untagged(&mut self, name: &str) -> usize {
        self.capture.surfaces.push(Surface {
            name: name.into(),
            role: Role::Untagged,
            has_texcoords: false,
        });
        self.capture.surfaces.len() - 1
    }

    /// A planar convex polygon, counter-clockwise seen from outside.
    pub fn polygon(&mut self, surface: usize, corners: &[DVec3]) {
        let mesh = Arc::make_mut(&mut self.capture.mesh);
        let base = mesh.positions.len() as u32;
        mesh.positions.extend(corners.iter().map(|corner| corner.as_vec3()));
        for k in 1..corners.len() as u32 - 1 {
            mesh.triangles.push([base, base + k, base + k + 1]);
            mesh.surface.push(surface as u32);
            mesh.polygon.push(self.polygons);
            if !mesh.texcoords.is_empty() {
                mesh.texcoords.push([Vec2::ZERO; 3]);
            }
        }
        self.polygons += 1;
    }

    /// A rectangle from a corner along two edges; its normal is `u × v`.
    pub fn rectangle(&mut self, surface: usize, corner: DVec3, u: DVec3, v: DVec3) {
        self.polygon(surface, &[corner, corner + u, corner + u + v, corner + v]);
    }

    /// The horizontal square |x|, |y| ≤ `half` at height `z`, facing up.
    pub fn square(&mut self, surface: usize, half: f64, z: f64) {
        let side = 2.0 * half;
        self.rectangle(surface, DVec3::new(-half, -half, z), DVec3::X * side, DVec3::Y * side);
    }

    /// The four walls and the top of a box, facing outwards.
    pub fn open_box(&mut self, surface: usize, low: DVec3, high: DVec3) {
        let size = high - low;
        let (x, y, z) = (DVec3::X * size.x, DVec3::Y * size.y, DVec3::Z * size.z);
        self.rectangle(surface, low + z, x, y);
        self.rectangle(surface, low, x, z);
        self.rectangle(surface, low + y, z, x);
        self.rectangle(surface, low, z, y);
        self.rectangle(surface, low + x, y, z);
    }

    /// Triangles sharing vertices, each a polygon of its own, on the surface `surface_of` says.
    pub fn triangles(
        &mut self,
        positions: &[DVec3],
        triangles: &[[usize; 3]],
        surface_of: impl Fn([DVec3; 3]) -> usize,
    ) {
        let mesh = Arc::make_mut(&mut self.capture.mesh);
        let base = mesh.positions.len();
        mesh.positions.extend(positions.iter().map(|p| p.as_vec3()));
        for &triangle in triangles {
            let surface = surface_of(triangle.map(|vertex| positions[vertex]));
            mesh.triangles.push(triangle.map(|vertex| (base + vertex) as u32));
            mesh.surface.push(surface as u32);
            mesh.polygon.push(self.polygons);
            self.polygons += 1;
        }
    }

    /// Adds a photograph of what is there so far.
    pub fn photograph(&mut self, camera: Camera, radiance: impl Fn(Struck) -> Radiance + Sync) {
        let pixels = Tracer::new(&self.capture.mesh).render(&camera, radiance);
        self.photograph_of(camera, pixels, None);
    }

    pub fn photograph_of(
        &mut self,
        camera: Camera,
        pixels: Vec<Radiance>,
        saturation: Option<f32>,
    ) {
        let image = Image::new(camera.width, camera.height, pixels, saturation);
        self.capture.photographs.push(Photograph {
            name: format!("photograph {}", self.capture.photographs.len()),
            camera,
            image: Some(Arc::new(image)),
            display: None,
        });
    }

    pub fn caster(&self) -> RayCaster {
        RayCaster::build(&self.capture.mesh.positions, &self.capture.mesh.triangles)
    }
}

/// What a camera ray meets.
#[derive(Clone, Copy, Debug)]
pub struct Struck {
    pub surface: usize,
    pub position: DVec3,
}

/// Brute force in double precision.
pub struct Tracer {
    faces: Vec<Face>,
}

struct Face {
    corners: [DVec3; 3],
    /// Normal of the plane, not of unit length.
    normal: DVec3,
    centre: DVec3,
    radius_squared: f64,
    surface: usize,
}

impl Tracer {
    pub fn new(mesh: &Mesh) -> Self {
        let face = |(triangle, surface): (&[u32; 3], &u32)| {
            let corners = triangle.map(|vertex| mesh.positions[vertex as usize].as_dvec3());
            let [a, b, c] = corners;
            let centre = (a + b + c) / 3.0;
            let radius_squared =
                corners.iter().map(|p| p.distance_squared(centre)).fold(0.0, f64::max);
            Face {
                corners,
                normal: (b - a).cross(c - a),
                centre,
                radius_squared,
                surface: *surface as usize,
            }
        };
        Self { faces: mesh.triangles.iter().zip(&mesh.surface).map(face).collect() }
    }

    /// The nearest hit along a unit direction with its distance.
    pub fn nearest(&self, origin: DVec3, direction: DVec3) -> Option<(f64, usize)> {
        let mut best: Option<(f64, usize)> = None;
        for (index, face) in self.faces.iter().enumerate() {
            // A ray that misses the sphere around a triangle misses the triangle.
            let offset = face.centre - origin;
            if offset.cross(direction).length_squared() > face.radius_squared * (1.0 + 1e-9) {
                continue;
            }
            let along = face.normal.dot(direction);
            if along == 0.0 {
                continue;
            }
            let distance = face.normal.dot(face.corners[0] - origin) / along;
            if distance <= 0.0 || best.is_some_and(|(nearest, _)| distance >= nearest) {
                continue;
            }
            // Inside means to the left of every edge.
            let p = origin + distance * direction;
            let inside = (0..3).all(|k| {
                let (from, to) = (face.corners[k], face.corners[(k + 1) % 3]);
                let slack = 1e-12 * face.normal.length_squared();
                (to - from).cross(p - from).dot(face.normal) >= -slack
            });
            if inside {
                best = Some((distance, index));
            }
        }
        best
    }

    /// Whether nothing lies between two points, `margin` in metres kept free at both ends.
    pub fn is_free(&self, from: DVec3, to: DVec3, margin: f64) -> bool {
        let length = from.distance(to);
        let direction = (to - from) / length;
        let hit = self.nearest(from + margin * direction, direction);
        hit.is_none_or(|(distance, _)| distance > length - 2.0 * margin)
    }

    /// One value for every pixel centre; black where nothing is met.
    pub fn render(
        &self,
        camera: &Camera,
        radiance: impl Fn(Struck) -> Radiance + Sync,
    ) -> Vec<Radiance> {
        (0..camera.width * camera.height)
            .into_par_iter()
            .map(|index| {
                let pixel =
                    DVec2::new((index % camera.width) as f64, (index / camera.width) as f64) + 0.5;
                let direction = sight(camera, pixel);
                match self.nearest(camera.position, direction) {
                    Some((distance, triangle)) => radiance(Struck {
                        surface: self.faces[triangle].surface,
                        position: camera.position + distance * direction,
                    }),
                    None => [0.0; 3],
                }
            })
            .collect()
    }
}

/// OpenCV's model, written down again: the distorted image of an undistorted point.
pub fn distort(distortion: &Distortion, x: f64, y: f64) -> (f64, f64) {
    let r2 = x * x + y * y;
    let [k1, k2, k3, k4] = distortion.radial;
    let [p1, p2] = distortion.tangential;
    let radial = 1.0 + k1 * r2 + k2 * r2.powi(2) + k3 * r2.powi(3) + k4 * r2.powi(4);
    (
        x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
        y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
    )
}

/// The direction in which a camera looks through a pixel position.
pub fn sight(camera: &Camera, pixel: DVec2) -> DVec3 {
    let wanted = (pixel - camera.principal_px) / camera.focal_px;
    let (mut x, mut y) = (wanted.x, wanted.y);
    // Fixed-point iteration; it contracts for the mild distortions used here.
    for _ in 0..200 {
        let (u, v) = distort(&camera.distortion, x, y);
        (x, y) = (x + wanted.x - u, y + wanted.y - v);
    }
    (camera.world_from_camera * DVec3::new(x, -y, -1.0)).normalize_or_zero()
}

/// Where a camera shows a point in front of it, in pixels, whether inside the image or not.
pub fn image_of(camera: &Camera, point: DVec3) -> Option<DVec2> {
    let local = camera.world_from_camera.transpose() * (point - camera.position);
    if local.z >= 0.0 {
        return None;
    }
    let (u, v) = distort(&camera.distortion, local.x / -local.z, local.y / local.z);
    Some(DVec2::new(u, v) * camera.focal_px + camera.principal_px)
}

/// A pinhole camera; `focal` is in units of the image's width.
pub fn camera(size: (usize, usize), focal: f64, position: DVec3, target: DVec3) -> Camera {
    bent_camera(size, focal, position, target, Distortion::default())
}

pub fn bent_camera(
    size: (usize, usize),
    focal: f64,
    position: DVec3,
    target: DVec3,
    distortion: Distortion,
) -> Camera {
    let forward = (target - position).normalize_or_zero();
    let up = if forward.z.abs() > 0.99 { DVec3::Y } else { DVec3::Z };
    let right = forward.cross(up).normalize_or_zero();
    let axes = DMat3::from_cols(right, right.cross(forward), -forward);
    let centre = DVec2::new(size.0 as f64, size.1 as f64) / 2.0;
    Camera::new(size, DVec2::splat(focal * size.0 as f64), centre, distortion, axes, position)
}

/// Six cameras that together see everything around a point, each a little more than 90°.
pub fn cube_cameras(position: DVec3, side: usize) -> Vec<Camera> {
    [DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y, DVec3::Z, -DVec3::Z]
        .map(|axis| camera((side, side), 0.5 / 1.06, position, position + axis))
        .to_vec()
}

/// A unit sphere of 20 × 4^`subdivisions` triangles, wound outwards.
pub fn icosphere(subdivisions: usize) -> (Vec<DVec3>, Vec<[usize; 3]>) {
    let golden = (1.0 + 5.0f64.sqrt()) / 2.0;
    let mut positions: Vec<DVec3> = Vec::new();
    for (s, t) in [(-1.0, -golden), (1.0, -golden), (-1.0, golden), (1.0, golden)] {
        positions.push(DVec3::new(s, t, 0.0).normalize_or_zero());
        positions.push(DVec3::new(0.0, s, t).normalize_or_zero());
        positions.push(DVec3::new(t, 0.0, s).normalize_or_zero());
    }
    // The faces are the triples of mutual neighbours.
    let edge =
        positions.iter().skip(1).map(|p| p.distance(positions[0])).fold(f64::INFINITY, f64::min);
    let near = |a: usize, b: usize| positions[a].distance(positions[b]) < 1.01 * edge;
    let mut faces = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(c, a) {
                    let [p, q, r] = [a, b, c].map(|vertex| positions[vertex]);
                    let outwards = (q - p).cross(r - p).dot(p) > 0.0;
                    faces.push(if outwards { [a, b, c] } else { [a, c, b] });
                }
            }
        }
    }
    assert_eq!(faces.len(), 20);
    for _ in 0..subdivisions {
        let mut middles = std::collections::BTreeMap::new();
        let mut middle = |a: usize, b: usize| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                positions.push((positions[a] + positions[b]).normalize_or_zero());
                positions.len() - 1
            })
        };
        faces = faces
            .iter()
            .flat_map(|&[a, b, c]| {
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    (positions, faces)
}

/// Random numbers of the tests' own (xorshift64*; Vigna 2016).
pub struct Dice(u64);

impl Dice {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(2).wrapping_add(1))
    }

    /// Uniform in [0, 1).
    pub fn uniform(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// A sample that no photograph sees.
pub fn bare_sample(position: Vec3, normal: Vec3, material: usize, radiance: Radiance) -> Sample {
    Sample { position, normal, material, surface: material, views: 0..0, radiance }
}

pub fn cloud(samples: Vec<Sample>) -> SampleCloud {
    SampleCloud { spacing_m: 0.1, samples, ..SampleCloud::default() }
}

/// Options for a whole reconstruction with the paper's own method.
pub fn paper_options() -> Options {
    let mut options = Options::default();
    options.general.method = Method::Paper;
    options
}

/// [`paper_options`] that keep a whole reconstruction well below a second.
pub fn quick() -> Options {
    let mut options = paper_options();
    options.samples.count = 300;
    options.samples.min_per_material = 30;
    options.lights.count = 20;
    options.lobes.mask_px = 32;
    options.lobes.grid = 3;
    options.transport.rays = 64;
    options.transport.glossy_rays = 64;
    options.transport.disc_rays = 4;
    options.refine.max_iterations = 6;
    options.textures.max_side = 64;
    options
}

pub fn run(room: &Room, options: &Options) -> Result<Reconstruction, Error> {
    lobelia::reconstruct::run(&room.capture, options, &Watch::new(), &|_| {})
}

/// A floor with a box on it, two photographs, three materials, in colours that vary smoothly
/// with the place. It has no exact answer; it is for questions that need none.
pub fn box_room() -> Room {
    let mut room = Room::default();
    let floor = room.diffuse("floor");
    let sides = room.diffuse("box");
    room.square(floor, 1.0, 0.0);
    room.open_box(sides, DVec3::new(-0.3, -0.2, 0.0), DVec3::new(0.25, 0.3, 0.5));
    let shade = move |struck: Struck| {
        let base: Rgb = if struck.surface == floor { [0.5, 0.4, 0.3] } else { [0.2, 0.5, 0.7] };
        let lit = 1.0 + 0.3 * (2.0 * struck.position.x).sin() + 0.2 * struck.position.y;
        base.map(|value| (value * lit) as f32)
    };
    for position in [DVec3::new(1.6, -1.8, 1.4), DVec3::new(-1.7, -1.2, 1.5)] {
        room.photograph(camera((96, 72), 0.9, position, DVec3::new(0.0, 0.0, 0.15)), shade);
    }
    room
}
