//! The numbers of a dispatch, as `Params` of `path.wgsl` has them.

use bytemuck::{Pod, Zeroable};

use crate::render::Pass;
use crate::render::packed::{PackedTrees, Places, TREES};
use crate::render::tiles::Tile;

#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct Parameters {
    axis_x: [f32; 3],
    width: u32,
    axis_y: [f32; 3],
    height: u32,
    axis_z: [f32; 3],
    has_distortion: u32,
    eye: [f32; 3],
    reach: f32,
    focal: [f32; 2],
    principal: [f32; 2],
    radial: [f32; 4],
    bend: [f32; 2],
    first_pixel: u32,
    pixels: u32,
    below: [f32; 3],
    from_path: u32,
    to_path: u32,
    surfaces_from: u32,
    seed: u32,
    reflections: u32,
    shell_low: [f32; 3],
    has_shell: u32,
    shell_high: [f32; 3],
    shell_albedo: f32,
    grid_low: [f32; 3],
    grid_side: u32,
    grid_cell: [f32; 3],
    offset_m: f32,
    tree_low: [[f32; 4]; TREES],
    tree_high: [[f32; 4]; TREES],
    tree_nodes: [u32; TREES],
    photographed_tree: u32,
    tree_leaves: [u32; TREES],
    layers: u32,
    original_light: f32,
    unseen_shines: u32,
    known: u32,
    look_of: u32,
    light_count: u32,
    choice_starts: u32,
    sky_cells: u32,
    sky_first: u32,
    sky_members: u32,
    lights: u32,
    added: u32,
    added_count: u32,
    photographs: u32,
    photograph_count: u32,
    unused: [u32; 2],
}

impl Parameters {
    /// Of a pass, whose tiles follow.
    pub fn new(pass: &Pass, trees: &PackedTrees, places: &Places) -> Self {
        let Pass { scene, camera, options, .. } = pass;
        let single = |values: [f64; 3]| values.map(|value| value as f32);
        let four = |[x, y, z]: [f32; 3]| [x, y, z, 0.0];
        let rotation = camera.world_from_camera;
        let distortion = &camera.distortion;
        let grid = scene.recovered.grid();
        let shell = scene.shell;
        Self {
            axis_x: rotation.x_axis.as_vec3().to_array(),
            width: camera.width as u32,
            axis_y: rotation.y_axis.as_vec3().to_array(),
            height: camera.height as u32,
            axis_z: rotation.z_axis.as_vec3().to_array(),
            has_distortion: (!distortion.is_none()).into(),
            eye: camera.position.as_vec3().to_array(),
            reach: camera.reach().min(1e30) as f32,
            focal: camera.focal_px.as_vec2().to_array(),
            principal: camera.principal_px.as_vec2().to_array(),
            radial: distortion.radial.map(|value| value as f32),
            bend: distortion.tangential.map(|value| value as f32),
            below: single(distortion.denominator),
            // The low half tells the seeds apart that people give.
            seed: options.seed as u32,
            reflections: options.reflections as u32,
            shell_low: shell.map_or([0.0; 3], |shell| shell.low.to_array()),
            has_shell: shell.is_some().into(),
            shell_high: shell.map_or([0.0; 3], |shell| shell.high.to_array()),
            shell_albedo: shell.map_or(0.0, |shell| shell.albedo),
            grid_low: grid.low.to_array(),
            grid_side: grid.side as u32,
            grid_cell: grid.cell_m.to_array(),
            offset_m: scene.geometry.offset_m,
            tree_low: trees.bounds.map(|[low, _]| four(low)),
            tree_high: trees.bounds.map(|[_, high]| four(high)),
            tree_nodes: trees.nodes,
            photographed_tree: 2,
            tree_leaves: trees.leaves,
            layers: scene.layers as u32,
            original_light: scene.original_light,
            unseen_shines: scene.unseen_shines.into(),
            known: scene.known as u32,
            look_of: places.look_of,
            light_count: places.light_count,
            choice_starts: places.choice_starts,
            sky_cells: places.sky_cells,
            sky_first: places.sky_first,
            sky_members: places.sky_members,
            lights: places.lights,
            added: places.added,
            added_count: places.added_count,
            photographs: places.photographs,
            photograph_count: places.photograph_count,
            ..Self::zeroed()
        }
    }

    /// For some paths of a tile.
    pub fn of_tile(self, tile: &Tile, paths: &std::ops::Range<usize>) -> Self {
        Self {
            first_pixel: tile.pixels.start as u32,
            pixels: tile.pixels.len() as u32,
            from_path: paths.start as u32,
            to_path: paths.end as u32,
            surfaces_from: tile.surfaces_from as u32,
            ..self
        }
    }
}
