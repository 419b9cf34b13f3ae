//! The tables of a pass: looks of surfaces, recovered and added lights, cameras of photographs.

use super::NOTHING;
use crate::reconstruct::lights::LightKind;
use crate::render::Pass;
use crate::render::added::Packed as PackedAdded;
use crate::render::lights::Recovered;
use crate::render::looks::BrdfF32;
use crate::render::scene::{Look, Map, Scene};
use crate::scene::emitter::Quadrilateral;
use crate::scene::{Emitter, Views};

/// Where parts of the tables begin that a pass needs anew, and what they are.
#[derive(Clone, Copy, Debug, Default)]
pub struct Places {
    pub look_of: u32,
    pub light_count: u32,
    pub choice_starts: u32,
    pub sky_cells: u32,
    pub sky_first: u32,
    pub sky_members: u32,
    pub lights: u32,
    pub added: u32,
    pub added_count: u32,
    pub photographs: u32,
    pub photograph_count: u32,
}

/// The tables of a pass that change with every edit.
#[derive(Clone, Default)]
pub struct Tables {
    pub words: Vec<u32>,
    pub places: Places,
}

const LOOK_WORDS: usize = 16;
const LIGHT_WORDS: usize = 16;
const LOBE_WORDS: usize = 8;
const EMITTER_WORDS: usize = 20;
const CELL_WORDS: usize = 12;
const ADDED_WORDS: usize = 8;
const PHOTOGRAPH_WORDS: usize = 32;

/// A record that is being written.
struct Record(Vec<u32>);

impl Record {
    fn of(kind: u32) -> Self {
        Self(vec![kind])
    }

    fn word(mut self, word: usize) -> Self {
        self.0.push(word as u32);
        self
    }

    fn number(mut self, value: f32) -> Self {
        self.0.push(value.to_bits());
        self
    }

    fn numbers(mut self, values: impl IntoIterator<Item = f32>) -> Self {
        self.0.extend(values.into_iter().map(f32::to_bits));
        self
    }

    fn add_to(mut self, words: &mut Vec<u32>, size: usize) {
        debug_assert!(self.0.len() <= size, "{} words in a record of {size}", self.0.len());
        self.0.resize(size, 0);
        words.extend(self.0);
    }
}

impl Tables {
    /// Of the scene of a pass.
    pub fn new(pass: &Pass) -> Self {
        let mut tables = Self::default();
        let scene = pass.scene;
        let textures_end = tables.add_looks(scene);
        tables.add_recovered(&scene.recovered);
        tables.add_added(pass, textures_end);
        tables.add_photographs(scene.photographs);
        tables
    }

    fn end(&self) -> u32 {
        self.words.len() as u32
    }

    /// Returns where the words of all textures end, behind which those of environment maps come.
    fn add_looks(&mut self, scene: &Scene) -> usize {
        let first = self.end();
        let mut image = 0;
        let maps: Vec<[usize; 6]> =
            scene.maps.iter().map(|map| map_words(map, &mut image)).collect();
        for look in &scene.looks {
            let reflecting = |kind: u32, brdf: &BrdfF32| {
                Record::of(kind)
                    .numbers(brdf.diffuse)
                    .numbers(brdf.specular)
                    .number(brdf.exponent)
                    .number(brdf.coat.unwrap_or(-1.0))
            };
            let plain = |diffuse| BrdfF32 { diffuse, ..BrdfF32::default() };
            let record = match look {
                Look::Reflects(brdf) => reflecting(0, brdf),
                Look::Textured(brdf, map) => {
                    maps[*map].into_iter().fold(reflecting(1, brdf), Record::word)
                }
                Look::Mirror(reflected) => reflecting(2, &plain(*reflected)),
                Look::Glass => reflecting(3, &plain([1.0; 3])),
                Look::Photographed => reflecting(4, &plain([0.0; 3])),
            };
            record.add_to(&mut self.words, LOOK_WORDS);
        }
        self.places.look_of = self.end();
        self.words.extend(scene.look_of.iter().map(|look| first + look * LOOK_WORDS as u32));
        image
    }

    fn add_recovered(&mut self, recovered: &Recovered) {
        let mut lights = Vec::new();
        for light in recovered.lights() {
            let lobes = self.words.len();
            for (lobe, emission) in &light.lobes {
                Record(Vec::new())
                    .numbers(lobe.direction.to_array())
                    .number(lobe.exponent)
                    .numbers(*emission)
                    .add_to(&mut self.words, LOBE_WORDS);
            }
            let emitter = self.words.len();
            if let Some(emitter) = &light.emitter {
                self.add_emitter(emitter);
            }
            let shape = &light.shape;
            let kind = match shape.kind {
                LightKind::Sphere | LightKind::Surface => 0,
                LightKind::Lamp => 1,
                LightKind::Sky => 2,
                LightKind::Sun => 3,
                LightKind::Known(_) => 4,
            };
            Record::of(kind)
                .word(light.layer)
                .word(lobes)
                .word(light.lobes.len())
                .numbers(shape.position.to_array())
                .number(shape.radius_m)
                .numbers(shape.normal.to_array())
                .number(shape.half_angle)
                .number(shape.solid_angle_sr())
                .number(shape.area_m2())
                .word(emitter)
                .add_to(&mut lights, LIGHT_WORDS);
        }
        self.places.lights = self.end();
        self.places.light_count = recovered.lights().len() as u32;
        self.places.choice_starts = recovered.choices().0.len() as u32;
        self.words.extend(lights);

        let sky = recovered.sky_cells();
        let cells = self.end();
        for cell in sky.cells() {
            Record(Vec::new())
                .numbers(cell.towards.to_array())
                .number((0.5 * cell.half_angle).sin())
                .word(cell.light)
                .word(cell.layer)
                .numbers(cell.radiance)
                .add_to(&mut self.words, CELL_WORDS);
        }
        self.places.sky_cells = if sky.cells().is_empty() { NOTHING } else { cells };
        let (first, members) = sky.buckets();
        self.places.sky_first = self.end();
        self.words.extend(first);
        self.places.sky_members = self.end();
        self.words.extend(members);
    }

    fn add_emitter(&mut self, emitter: &Emitter) {
        let record = match *emitter {
            Emitter::Rectangle { corners, normal } => {
                let Quadrilateral { corners, areas_m2 } = Quadrilateral::of(&corners);
                Record::of(0)
                    .numbers(corners.into_iter().flat_map(|corner| corner.to_array()))
                    .numbers(normal.to_array())
                    .numbers(areas_m2)
            }
            Emitter::Sphere { center, radius_m } => {
                Record::of(1).numbers(center.to_array()).number(radius_m)
            }
            Emitter::Point { position } => Record::of(2).numbers(position.to_array()),
            Emitter::Spot { position, direction, inner_angle, outer_angle } => Record::of(3)
                .numbers(position.to_array())
                .numbers(direction.to_array())
                .numbers([inner_angle.cos(), outer_angle.cos()]),
            Emitter::Sun { direction, angular_diameter } => {
                let cap = 2.0 * (0.25 * angular_diameter).sin().powi(2);
                Record::of(4).numbers(direction.to_array()).number(cap)
            }
        };
        record.add_to(&mut self.words, EMITTER_WORDS);
    }

    fn add_added(&mut self, pass: &Pass, mut image: usize) {
        let Pass { scene, sought, .. } = pass;
        let mut lights = Vec::new();
        for &index in &sought.added {
            let added = &scene.added[index];
            let record = self.words.len();
            let kind = match added.packed() {
                PackedAdded::Emitter(emitter) => {
                    self.add_emitter(emitter);
                    0
                }
                PackedAdded::Dome { dome, columns, rows, cumulated } => {
                    let (width, height) = (dome.image.width(), dome.image.height());
                    let table = image + 3 * width * height;
                    Record(Vec::new())
                        .word(width)
                        .word(height)
                        .word(image)
                        .numbers([dome.scale, dome.turn])
                        .word(columns)
                        .word(rows)
                        .word(table)
                        .add_to(&mut self.words, EMITTER_WORDS);
                    image = table + cumulated.len();
                    5
                }
            };
            Record::of(kind)
                .word(scene.layer_of_added[index])
                .numbers(added.emission)
                .word(record)
                .add_to(&mut lights, ADDED_WORDS);
        }
        self.places.added = self.end();
        self.places.added_count = sought.added.len() as u32;
        self.words.extend(lights);
    }

    fn add_photographs(&mut self, views: &Views) {
        self.places.photographs = self.end();
        self.places.photograph_count = views.buffers.len() as u32;
        let mut first = 0;
        for buffer in &views.buffers {
            let camera = buffer.camera;
            let distortion = &camera.distortion;
            let single =
                |values: &[f64]| values.iter().map(|&value| value as f32).collect::<Vec<_>>();
            let rotation = camera.world_from_camera;
            let axes = [rotation.x_axis, rotation.y_axis, rotation.z_axis];
            Record(Vec::new())
                .word(camera.width)
                .word(camera.height)
                .word(first)
                .word(usize::from(!distortion.is_none()))
                .numbers(camera.position.as_vec3().to_array())
                .word(0)
                .numbers(axes.into_iter().flat_map(|axis| axis.as_vec3().to_array()))
                .numbers(camera.focal_px.as_vec2().to_array())
                .numbers(camera.principal_px.as_vec2().to_array())
                .numbers(single(&distortion.radial))
                .numbers(single(&distortion.tangential))
                .numbers(single(&distortion.denominator))
                .number(camera.reach().min(1e30) as f32)
                .add_to(&mut self.words, PHOTOGRAPH_WORDS);
            first += camera.width * camera.height;
        }
    }
}

/// Width, height, and where texels, corners and entries begin, and the first triangle of a texture,
/// whose words begin at `first`, which is moved behind them.
fn map_words(map: &Map, first: &mut usize) -> [usize; 6] {
    let unwrap = &map.texture.unwrap;
    let texels = *first;
    let corners = texels + 3 * map.texture.texels.len();
    let entries = corners + 6 * unwrap.corners.len();
    *first = entries + map.entry.len();
    [unwrap.width, unwrap.height, texels, corners, entries, map.first]
}
