//! A scene as flat arrays of words, for tracers that cannot follow references: those on graphics
//! cards. What the words mean stands beside the structures of `src/gpu/*.wgsl`, which read them.

mod tables;

use std::sync::Arc;

use glam::Vec3;

use crate::geometry::bvh::RayCaster;
use crate::math::rgb::Radiance;
use crate::reconstruct::lights::LightKind;
use crate::reconstruct::textures::Texture;
use crate::render::Pass;
use crate::render::added::{Added, Packed as PackedAdded};
use crate::render::light::Light;
use crate::render::lights::Recovered;
use crate::render::scene::{Look, Scene};
use crate::scene::Image;

pub use tables::{Places, Tables};

/// Trees of a scene: of the geometry that light meets, of that which cameras see, of the capture
/// alone.
pub const TREES: usize = 3;
/// Of what is not there.
pub const NOTHING: u32 = u32::MAX;

/// What Sobol's points of `sobol_burley` are made from: per set of four dimensions, per four bits of a
/// point's index of 16 bits, the highest first, and per value of these, its part of the four numbers.
/// A point is the exclusive or of its parts.
pub fn sobol() -> Vec<[u32; 4]> {
    let part = |set: u32, bits: u32, value: u32| {
        let index = value << (28 - 4 * bits);
        std::array::from_fn(|of| sobol_burley::parts::sobol_rev(index, 4 * set + of as u32))
    };
    (0..sobol_burley::NUM_DIMENSION_SETS_4D)
        .flat_map(|set| {
            (0..4).flat_map(move |bits| (0..16).map(move |value| part(set, bits, value)))
        })
        .collect()
}

/// By what lies in memory for long, the parts of a scene are told apart: who holds these knows
/// that they do not change.
#[derive(Clone)]
pub struct Parts {
    geometry: [Arc<[Vec3]>; 2],
    textures: Arc<Vec<Texture>>,
    /// Surfaces that have one of them.
    textured: Vec<usize>,
    domes: Vec<Arc<Added>>,
    recovered: Arc<Recovered>,
    photographs: Vec<Arc<Image>>,
}

/// Words that change seldom, in groups that are packed anew one by one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// The trees, and of every triangle its normal and plane.
    Geometry,
    /// Textures and environment maps.
    Images,
    /// The probabilities by which recovered lights are sampled.
    Choices,
    /// Triangles and radiance of every pixel of every photograph.
    Photographs,
}

/// The trees in one array.
#[derive(Clone, Default)]
pub struct PackedTrees {
    pub words: Vec<u32>,
    /// Per tree where its nodes and leaves begin, in four words; [`NOTHING`] for an empty tree.
    pub nodes: [u32; TREES],
    pub leaves: [u32; TREES],
    pub bounds: [[[f32; 3]; 2]; TREES],
    /// Children that a traversal can have put aside at most.
    pub stack_size: usize,
}

/// What occurs in a scene; a tracer may leave out what does not.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Occurring {
    pub sky: bool,
    pub photographed: bool,
    pub glossy: bool,
    pub glass: bool,
    pub added: bool,
    pub recovered: bool,
}

impl Parts {
    /// Of the scene of a pass.
    pub fn new(pass: &Pass) -> Self {
        let Pass { scene, sought, .. } = pass;
        let photographs = scene.photographs;
        let domes = sought.added.iter().map(|&index| &scene.added[index]);
        let images = photographs
            .buffers
            .iter()
            .filter_map(|buffer| photographs.capture.photographs[buffer.photograph].image.clone());
        Self {
            geometry: [scene.geometry.normals.clone(), photographs.normals.clone()],
            textures: scene.textures.clone(),
            textured: scene.maps.iter().map(|map| map.texture.surface).collect(),
            domes: domes.filter(|added| added.emitter().is_none()).cloned().collect(),
            recovered: scene.recovered.clone(),
            photographs: if needs_photographs(scene) { images.collect() } else { Vec::new() },
        }
    }

    /// Whether a group is the same in both.
    pub fn has_same(&self, group: Group, other: &Self) -> bool {
        fn same<T: ?Sized>(a: &[Arc<T>], b: &[Arc<T>]) -> bool {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| Arc::ptr_eq(a, b))
        }
        match group {
            Group::Geometry => same(&self.geometry, &other.geometry),
            Group::Images => {
                Arc::ptr_eq(&self.textures, &other.textures)
                    && self.textured == other.textured
                    && same(&self.domes, &other.domes)
            }
            Group::Choices => Arc::ptr_eq(&self.recovered, &other.recovered),
            Group::Photographs => {
                same(&self.photographs, &other.photographs)
                    && Arc::ptr_eq(&self.geometry[1], &other.geometry[1])
            }
        }
    }
}

/// Whether paths in a scene ask what photographs show.
fn needs_photographs(scene: &Scene) -> bool {
    let shines = |look: &u32| matches!(scene.looks[*look as usize], Look::Photographed);
    scene.unseen_shines || scene.look_of.iter().any(shines)
}

impl Occurring {
    /// In the scene of a pass.
    pub fn new(pass: &Pass) -> Self {
        let Pass { scene, sought, .. } = pass;
        let is_sky = |light: &Light| light.shape.kind == LightKind::Sky;
        let is_glossy = |look: &Look| match look {
            Look::Reflects(brdf) | Look::Textured(brdf, _) => brdf.is_specular(),
            _ => false,
        };
        Self {
            sky: sought.recovered && scene.recovered.lights().iter().any(is_sky),
            photographed: needs_photographs(scene) && sought.recovered,
            glossy: scene.looks.iter().any(is_glossy),
            glass: scene.looks.iter().any(|look| matches!(look, Look::Glass)),
            added: !sought.added.is_empty(),
            // Surfaces that shine as photographs show them are recovered light, too.
            recovered: sought.recovered,
        }
    }
}

/// The trees of the scene of a pass.
pub fn trees(pass: &Pass) -> PackedTrees {
    let scene = pass.scene;
    let casters =
        [scene.geometry.caster, scene.geometry.seen_caster, scene.photographs.seen_caster];
    let mut packed = PackedTrees::default();
    for (index, caster) in casters.into_iter().enumerate() {
        packed.bounds[index] = caster.bounds();
        packed.stack_size = packed.stack_size.max(caster.stack_size());
        let same = |other: &&RayCaster| std::ptr::eq(*other, caster);
        if let Some(former) = casters[..index].iter().position(same) {
            packed.nodes[index] = packed.nodes[former];
            packed.leaves[index] = packed.leaves[former];
            continue;
        }
        let tree = caster.words();
        let place = |words: &[u32]| (words.len() / 4) as u32;
        packed.nodes[index] = if tree.nodes.is_empty() { NOTHING } else { place(&packed.words) };
        packed.words.extend(tree.nodes);
        packed.leaves[index] = place(&packed.words);
        packed.words.extend(tree.leaves);
    }
    packed
}

/// Of every triangle its unit normal and, of the capture's, the product of that with a corner.
pub fn planes(pass: &Pass) -> Vec<[f32; 4]> {
    let scene = pass.scene;
    let mesh = &scene.photographs.capture.mesh;
    let normals = scene.geometry.normals.iter().enumerate();
    normals
        .map(|(triangle, normal)| {
            let corner =
                mesh.triangles.get(triangle).map(|corners| mesh.positions[corners[0] as usize]);
            normal.extend(corner.map_or(0.0, |corner| normal.dot(corner))).to_array()
        })
        .collect()
}

/// Textures, then the environment maps of the lights that a pass looks for.
pub fn images(pass: &Pass) -> Vec<u32> {
    let mut words = Vec::new();
    for map in &pass.scene.maps {
        words.extend(map.texture.texels.iter().flatten().map(|value| value.to_bits()));
        let corners = map.texture.unwrap.corners.iter().flatten();
        words.extend(corners.flat_map(|corner| corner.to_array()).map(f32::to_bits));
        words.extend(&map.entry);
    }
    for &index in &pass.sought.added {
        if let PackedAdded::Dome { dome, cumulated, .. } = pass.scene.added[index].packed() {
            let (width, height) = (dome.image.width(), dome.image.height());
            for index in 0..width * height {
                let radiance = dome.image.radiance(index % width, index / width);
                words.extend(radiance.unwrap_or_default().map(f32::to_bits));
            }
            words.extend(cumulated.iter().map(|value| value.to_bits()));
        }
    }
    words
}

/// Per bin of the grid the recovered lights' cumulated probabilities, then per bin and part of
/// [0, 1) the light with which a search begins.
pub fn choices(pass: &Pass) -> Vec<u32> {
    let (cumulated, starts) = pass.scene.recovered.choices();
    let cumulated = cumulated.iter().map(|value| value.to_bits());
    cumulated.chain(starts.iter().map(|&start| start.into())).collect()
}

/// Of a pixel that is no measurement.
const NO_RADIANCE: Radiance = [-3e38; 3];

/// Of every pixel of every photograph the triangle, with the highest bit where it is off every
/// edge, and the radiance; nothing where no path asks for them.
pub fn photographs(pass: &Pass) -> Vec<[u32; 4]> {
    if !needs_photographs(pass.scene) {
        return Vec::new();
    }
    let mut pixels = Vec::new();
    for buffer in &pass.scene.photographs.buffers {
        let (width, height) = (buffer.camera.width, buffer.camera.height);
        pixels.reserve(width * height);
        for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
            let triangle = buffer.triangle(x, y).unwrap_or(NOTHING >> 1);
            let clean = u32::from(buffer.is_off_edges(x, y)) << 31;
            let [r, g, b] = buffer.image.radiance(x, y).unwrap_or(NO_RADIANCE).map(f32::to_bits);
            pixels.push([triangle | clean, r, g, b]);
        }
    }
    pixels
}
