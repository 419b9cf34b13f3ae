//! A recovered scene with its edits, prepared for path tracing.

use std::sync::Arc;

use glam::{Vec2, Vec3};

use crate::geometry::bvh::{Hit, Ray, RayCaster};
use crate::geometry::mesh::Mesh;
use crate::math::rgb::{CHANNELS, Radiance};
use crate::math::sampling::Random;
use crate::reconstruct::lights::LightKind;
use crate::reconstruct::materials::Materials;
use crate::reconstruct::solution::MaterialCertainty;
use crate::reconstruct::textures::Texture;
use crate::reconstruct::{Reconstruction, RecoveredLight};
use crate::render::added::Added;
use crate::render::edits::{AddedLight, Edits, GREY, Shape, Surroundings};
use crate::render::lights::{IrradianceGrid, Recovered};
use crate::render::looks::{BrdfF32, SurfaceLook, surface_looks};
use crate::render::path::Sought;
use crate::scene::{Brdf, Capture, Emitter, Optics, SurfacePoint, Views, fresnel, without_glass};

/// The parts of a reconstruction that rendering needs.
#[derive(Clone, Debug, Default)]
pub struct Solved {
    /// Per material of the capture; `None` where no photograph shows it.
    pub reflectances: Vec<Option<Brdf>>,
    /// Per material which are mirrors or glass; those beyond its end are opaque.
    pub optics: Vec<Optics>,
    pub textures: Arc<Vec<Texture>>,
    pub light: RecoveredLight,
    /// Per material the intervals of its reflectance; empty where the method gives none.
    pub certainty: Vec<Option<MaterialCertainty>>,
}

impl Solved {
    /// Of a reconstruction of `capture`.
    pub fn new(capture: &Capture, whole: &Reconstruction) -> Self {
        let Materials { reflectances, certainty } = whole.materials(capture);
        Self {
            reflectances,
            optics: whole.solution.optics.clone(),
            textures: whole.textures.clone(),
            light: whole.light(),
            certainty,
        }
    }

    /// Whether a sky is seen where no surface is.
    pub fn shows_sky(&self) -> bool {
        self.light.lights.lights.iter().any(|light| light.kind == LightKind::Sky)
    }
}

/// The capture's geometry with the objects that are set into it.
pub struct Geometry {
    /// `None` without objects: the capture's own will do.
    caster: Option<RayCaster>,
    /// Without the glass, which light passes; `None` where there is none.
    light_caster: Option<RayCaster>,
    pub normals: Arc<[Vec3]>,
    /// Triangles of the capture; those of objects follow.
    pub known: usize,
    /// Of each object's triangle the index into `Edits::objects`, and its surface there.
    owner: Vec<(u32, u32)>,
    low: Vec3,
    high: Vec3,
}

impl Geometry {
    pub fn new(capture: &Capture, solved: &Solved, edits: &Edits) -> Self {
        let known = &capture.mesh;
        let (positions, triangles) = (known.positions.clone(), known.triangles.clone());
        let mut mesh = Mesh { positions, triangles, ..Mesh::default() };
        let mut owner = Vec::new();
        for (index, object) in edits.objects.iter().enumerate() {
            let first = mesh.positions.len() as u32;
            let placed = object.placed();
            mesh.positions.extend(placed.positions);
            mesh.triangles.extend(placed.triangles.iter().map(|t| t.map(|v| v + first)));
            owner.extend(object.mesh.surface.iter().map(|&surface| (index as u32, surface)));
        }
        let normals = (0..mesh.triangles.len()).map(|triangle| mesh.normal(triangle)).collect();
        let (low, high) = mesh.bounds().unwrap_or_default();
        let build = || RayCaster::build(&mesh.positions, &mesh.triangles);
        let caster = (!edits.objects.is_empty()).then(build);
        let light_caster = without_glass(capture, &solved.optics, &mesh);
        Self { caster, light_caster, normals, known: known.triangles.len(), owner, low, high }
    }

    /// The corners of the box around all of it.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        (self.low, self.high)
    }
}

/// The optical behaviour of a triangle.
#[derive(Clone, Copy, Debug)]
pub(super) enum Look {
    Reflects(BrdfF32),
    /// The same with the diffuse reflectance of `Scene::textures[index]`.
    Textured(BrdfF32, usize),
    Mirror(Radiance),
    Glass,
    /// Nothing is known but what the photographs show: it sends that, and reflects nothing.
    Photographed,
}

/// The surface that a ray meets.
pub enum Met {
    Surface(BrdfF32),
    /// A mirror, or glass where it reflects, with the part of the light that it reflects.
    Mirror(Radiance),
    /// Radiance that it is known to send.
    Shining(Radiance),
}

/// Texture coordinates of one surface's triangles.
pub(super) struct Map<'a> {
    pub texture: &'a Texture,
    /// The triangle's entry in the unwrap, from the surface's first triangle on.
    pub entry: Vec<u32>,
    pub first: usize,
}

/// Everything that light meets.
pub struct Scene<'a> {
    /// The geometry with objects, through which nothing is seen; its `maps` are empty.
    pub geometry: Views<'a>,
    /// The capture alone with its photographs.
    pub(super) photographs: &'a Views<'a>,
    /// Triangles of the capture; those of objects follow.
    pub known: usize,
    pub(super) looks: Vec<Look>,
    /// Per triangle the index of its look.
    pub(super) look_of: Vec<u32>,
    pub(super) maps: Vec<Map<'a>>,
    /// Among them those of `maps`.
    pub(super) textures: Arc<Vec<Texture>>,
    pub original_light: f32,
    pub recovered: Arc<Recovered>,
    pub added: Vec<Arc<Added>>,
    /// The layer that each of them goes into.
    pub layer_of_added: Vec<usize>,
    /// Layers of all lights together; the first ones are of the recovered light.
    pub layers: usize,
    pub shell: Option<Shell>,
    /// Places that no photograph measures have recovered lights of their own.
    pub unseen_shines: bool,
}

/// The box that takes the place of the unmodelled room.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shell {
    pub low: Vec3,
    pub high: Vec3,
    pub albedo: f32,
}

impl<'a> Scene<'a> {
    /// `places` are points that the surroundings have to hold, such as cameras.
    pub fn new(
        photographs: &'a Views<'a>,
        geometry: &'a Geometry,
        solved: &'a Solved,
        edits: &Edits,
        places: &[Vec3],
    ) -> Self {
        let grid = Arc::new(IrradianceGrid::new(photographs, solved));
        let recovered = Arc::new(Recovered::new(grid, photographs.capture, solved, edits));
        let added = edits.lights.iter().map(|light| Arc::new(Added::new(light))).collect();
        Self::lit_by(recovered, added, photographs, geometry, solved, edits, places)
    }

    /// The same with lights that are at hand, in place of those of the edits.
    pub fn lit_by(
        recovered: Arc<Recovered>,
        added: Vec<Arc<Added>>,
        photographs: &'a Views<'a>,
        geometry: &'a Geometry,
        solved: &'a Solved,
        edits: &Edits,
        places: &[Vec3],
    ) -> Self {
        let capture = photographs.capture;
        let mut looks = vec![Look::Photographed];
        // Per surface of the capture its look.
        let mut of_surface = Vec::with_capacity(capture.surfaces.len());
        let mut maps = Vec::new();
        for look in surface_looks(capture, solved, edits) {
            of_surface.push(match look {
                SurfaceLook::Photographed => 0,
                _ => looks.len() as u32,
            });
            match look {
                SurfaceLook::Photographed => {}
                SurfaceLook::Mirror(reflected) => looks.push(Look::Mirror(reflected)),
                SurfaceLook::Glass => looks.push(Look::Glass),
                SurfaceLook::Reflects(brdf) => looks.push(Look::Reflects(brdf)),
                SurfaceLook::Textured(brdf, texture) => {
                    looks.push(Look::Textured(brdf, maps.len()));
                    maps.push(Map::new(texture));
                }
            }
        }
        let mut look_of: Vec<u32> =
            capture.mesh.surface.iter().map(|&surface| of_surface[surface as usize]).collect();
        let first: Vec<usize> = edits
            .objects
            .iter()
            .map(|object| {
                let first = looks.len();
                let reflectances = object.surfaces.iter().map(|(_, reflectance)| reflectance);
                looks.extend(reflectances.map(|r| Look::Reflects(BrdfF32::from(r))));
                first
            })
            .collect();
        look_of.extend(
            geometry
                .owner
                .iter()
                .map(|&(object, surface)| (first[object as usize] + surface as usize) as u32),
        );

        let original_light = edits.original_light as f32;
        let offset_m = photographs.offset_m;
        let seen_caster = geometry.caster.as_ref().unwrap_or(photographs.seen_caster);
        let lit = Views {
            capture,
            caster: geometry.light_caster.as_ref().unwrap_or(seen_caster),
            seen_caster,
            optics: &solved.optics,
            buffers: Vec::new(),
            normals: geometry.normals.clone(),
            offset_m,
        };
        let shell = Shell::around(capture, solved, geometry, edits, places);
        Self {
            geometry: lit,
            photographs,
            known: geometry.known,
            looks,
            look_of,
            maps,
            textures: solved.textures.clone(),
            original_light,
            recovered,
            layer_of_added: (1..=added.len()).collect(),
            layers: 1 + added.len(),
            added,
            shell,
            unseen_shines: unseen_shines(solved),
        }
    }

    /// All of its lights that send anything.
    pub fn all_lights(&self) -> Sought {
        let sends = |index: &usize| self.added[*index].emission.iter().any(|&value| value != 0.0);
        let added = (0..self.added.len()).filter(sends).collect();
        Sought { recovered: self.original_light > 0.0, added }
    }

    /// Whether what the capture's surface sends from a surface point is the light of recovered
    /// lights on it already (Section 4.2: virtual lights on known surfaces that no photograph
    /// shows).
    pub fn is_counted(&self, point: SurfacePoint) -> bool {
        self.unseen_shines && !self.photographs.is_measured(point)
    }

    /// Radiance of all added domes from a direction.
    pub fn domes(&self, direction: Vec3) -> Radiance {
        let domes = self.added.iter().filter_map(|added| added.dome(direction));
        domes.fold([0.0; CHANNELS], |sum, dome| std::array::from_fn(|c| sum[c] + dome[c]))
    }

    /// Whether a triangle belongs to an object that was set in.
    pub fn is_object(&self, triangle: u32) -> bool {
        triangle as usize >= self.known
    }

    /// What a ray meets. Light passes glass whole, as in the solve; but `from_camera`, directly or by
    /// way of mirrors, a part of it chosen at random is reflected, and the rest goes straight on.
    pub fn closest(&self, ray: &Ray, from_camera: bool, random: &mut Random) -> Option<Hit> {
        if !from_camera {
            return self.geometry.caster.closest(ray);
        }
        let mut ray = *ray;
        loop {
            let hit = self.geometry.seen_caster.closest(&ray)?;
            if !matches!(self.looks[self.look_of[hit.triangle as usize] as usize], Look::Glass) {
                return Some(hit);
            }
            let cosine = ray.direction.dot(self.geometry.normals[hit.triangle as usize]).abs();
            if random.uniform() < fresnel(cosine.into()) as f32 {
                return Some(hit);
            }
            ray.t_min = hit.t + self.geometry.offset_m;
        }
    }

    /// What a hit at barycentric (u, v) on the side of `surface point` does with light.
    pub fn met(&self, point: SurfacePoint, triangle: u32, (u, v): (f32, f32)) -> Met {
        match self.looks[self.look_of[triangle as usize] as usize] {
            Look::Reflects(brdf) => Met::Surface(brdf),
            Look::Textured(brdf, map) => {
                let diffuse = self.maps[map].diffuse(triangle as usize, u, v);
                Met::Surface(BrdfF32 { diffuse, ..brdf })
            }
            Look::Mirror(reflected) => Met::Mirror(reflected),
            Look::Glass => Met::Mirror([1.0; CHANNELS]),
            Look::Photographed => {
                let radiance = self.photographs.radiance(point).unwrap_or_default();
                Met::Shining(radiance.map(|value| value * self.original_light))
            }
        }
    }
}

impl<'a> Map<'a> {
    fn new(texture: &'a Texture) -> Self {
        let triangles = &texture.unwrap.triangles;
        let first = triangles.iter().copied().min().unwrap_or(0);
        let last = triangles.iter().copied().max().unwrap_or(0);
        let mut entry = vec![0; last + 1 - first];
        for (index, &triangle) in triangles.iter().enumerate() {
            entry[triangle - first] = index as u32;
        }
        Self { texture, entry, first }
    }

    /// Bilinear; texels beyond the edge repeat it.
    fn diffuse(&self, triangle: usize, u: f32, v: f32) -> Radiance {
        let unwrap = &self.texture.unwrap;
        let [a, b, c] = unwrap.corners[self.entry[triangle - self.first] as usize];
        let uv = a * (1.0 - u - v) + b * u + c * v;
        let size = Vec2::new(unwrap.width as f32, unwrap.height as f32);
        let place = Vec2::new(uv.x, 1.0 - uv.y) * size - 0.5;
        let (low, part) = (place.floor(), place - place.floor());
        let texel = |x: f32, y: f32| {
            let x = x.clamp(0.0, size.x - 1.0) as usize;
            let y = y.clamp(0.0, size.y - 1.0) as usize;
            Vec3::from(self.texture.texels[y * unwrap.width + x])
        };
        let top = texel(low.x, low.y).lerp(texel(low.x + 1.0, low.y), part.x);
        let bottom = texel(low.x, low.y + 1.0).lerp(texel(low.x + 1.0, low.y + 1.0), part.x);
        top.lerp(bottom, part.y).to_array()
    }
}

/// Whether known surfaces that no photograph shows emit light.
pub fn unseen_shines(solved: &Solved) -> bool {
    solved.light.lights.lights.iter().any(|light| light.kind == LightKind::Surface)
}

/// Room that the surroundings leave around what they hold, in diagonals.
const MARGIN: f32 = 0.02;
/// Distance to surfaces of added lights that shine to all sides, in diagonals: closer to a wall a
/// lamp would light one small spot alone.
const LAMP_MARGIN: f32 = 0.1;

/// Steps in which the surroundings grow to hold added lights, in diagonals.
const LIGHT_STEP: f32 = 0.125;

impl Shell {
    /// The box of the surroundings that edits ask for; `places` are points that it has to hold.
    pub fn around(
        capture: &Capture,
        solved: &Solved,
        geometry: &Geometry,
        edits: &Edits,
        places: &[Vec3],
    ) -> Option<Self> {
        let is_open = solved.light.lights.lights.iter().any(|light| light.kind == LightKind::Sky)
            || edits.lights.iter().any(|light| matches!(light.shape, Shape::Dome(_)));
        let albedo = match edits.surroundings {
            Surroundings::Open => return None,
            Surroundings::Auto if is_open => return None,
            Surroundings::Auto => GREY,
            // What returns nothing need not be met.
            Surroundings::Albedo(0.0) => return None,
            Surroundings::Albedo(albedo) => albedo,
        };
        // Photographs are taken in the room, too; without them it would change with the frames that
        // happen to be rendered.
        let cameras =
            capture.photographs.iter().map(|photograph| photograph.camera.position.as_vec3());
        let hold = |(low, high): (Vec3, Vec3), p: Vec3| (low.min(p), high.max(p));
        let (low, high) =
            places.iter().copied().chain(cameras).fold((geometry.low, geometry.high), hold);
        let below = LAMP_MARGIN * (high - low).length();
        let ball = |center: Vec3, radius_m: f32| vec![center - radius_m, center + radius_m];
        let lights = edits.lights.iter().flat_map(|AddedLight { shape, .. }| match shape {
            Shape::Emitter(Emitter::Rectangle { corners, .. }) => corners.to_vec(),
            Shape::Emitter(Emitter::Sphere { center, radius_m }) => ball(*center, radius_m + below),
            Shape::Emitter(Emitter::Point { position } | Emitter::Spot { position, .. }) => {
                ball(*position, below)
            }
            Shape::Emitter(Emitter::Sun { .. }) | Shape::Dome(_) => Vec::new(),
        });
        // In steps, so that a light can be moved without what surrounds all of them.
        let held = lights.fold((low, high), hold);
        let step = (LIGHT_STEP * (high - low).length()).max(f32::MIN_POSITIVE);
        let low = low - ((low - held.0) / step).ceil() * step;
        let high = high + ((held.1 - high) / step).ceil() * step;
        let margin = MARGIN * (high - low).length();
        Some(Self { low: low - margin, high: high + margin, albedo: albedo as f32 })
    }

    /// Where a ray from within leaves, on the inner side.
    pub fn exit(&self, origin: Vec3, direction: Vec3) -> SurfacePoint {
        let far = Vec3::select(direction.cmpgt(Vec3::ZERO), self.high, self.low);
        let along = (far - origin) / direction;
        // Along axes that the ray does not move on the quotient is infinite, or NaN on a face.
        let along = along.to_array().map(|t| if t.is_nan() { f32::INFINITY } else { t.max(0.0) });
        let axis = (0..3).min_by(|&a, &b| along[a].total_cmp(&along[b])).unwrap_or(0);
        let mut normal = Vec3::ZERO;
        normal[axis] = -direction[axis].signum();
        SurfacePoint { position: origin + direction * along[axis], normal }
    }
}
