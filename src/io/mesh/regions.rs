//! Surfaces for a mesh that names none: connected planar regions.
//!
//! A region grows from the largest triangle that is left over neighbours across an edge whose
//! normals stay within an angle of the region's mean normal. Regions too small to be worth a tag
//! are gathered, connected ones together, as parts.

use std::collections::{BTreeMap, HashMap};

use glam::{DVec3, Vec3};

use crate::geometry::mesh::Mesh;
use crate::io::obj::Geometry;
use crate::scene::{Role, Surface};

/// What counts as a plane that is worth a tag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Largest angle between a triangle's normal and its region's mean normal, in radians.
    pub angle: f32,
    /// Smallest share of the whole area.
    pub share: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self { angle: 15_f32.to_radians(), share: 0.005 }
    }
}

/// Replaces the surfaces by planes and parts, the largest first: `plane_1`, `part_1`.
pub fn split(geometry: &mut Geometry, options: &Options) {
    let mesh = &geometry.mesh;
    let areas: Vec<f64> = (0..mesh.triangles.len()).map(|t| f64::from(mesh.area(t))).collect();
    let neighbours = neighbours(mesh);
    let mut region = grow(mesh, &areas, &neighbours, options.angle.cos());
    let total: f64 = areas.iter().sum();
    let planes = region_areas(&region, &areas);
    let is_plane = |index: u32| planes[&index] >= options.share * total;
    // What is no plane becomes parts: connected leftovers.
    let loose: Vec<bool> = region.iter().map(|&index| !is_plane(index)).collect();
    let first_part = areas.len() as u32;
    let mut next = first_part;
    for start in 0..region.len() {
        if !loose[start] || region[start] >= first_part {
            continue;
        }
        let mut stack = vec![start];
        region[start] = next;
        while let Some(triangle) = stack.pop() {
            for &other in &neighbours[triangle] {
                let other = other as usize;
                if loose[other] && region[other] < first_part {
                    region[other] = next;
                    stack.push(other);
                }
            }
        }
        next += 1;
    }
    name(geometry, &region, &region_areas(&region, &areas), first_part);
}

fn region_areas(region: &[u32], areas: &[f64]) -> BTreeMap<u32, f64> {
    let mut sums = BTreeMap::new();
    for (index, area) in region.iter().zip(areas) {
        *sums.entry(*index).or_default() += area;
    }
    sums
}

/// Numbers and names the surfaces by area. Crumbs that touch nothing share one surface, or a scan
/// with dust would have thousands.
fn name(geometry: &mut Geometry, region: &[u32], areas: &BTreeMap<u32, f64>, first_part: u32) {
    const MOST_PARTS: usize = 20;
    let mut order: Vec<(u32, f64)> = areas.iter().map(|(index, area)| (*index, *area)).collect();
    order.sort_by(|a, b| {
        (a.0 >= first_part).cmp(&(b.0 >= first_part)).then(b.1.total_cmp(&a.1)).then(a.0.cmp(&b.0))
    });
    let (mut names, mut numbers) = (Vec::new(), HashMap::new());
    let (mut planes, mut parts) = (0, 0);
    for (index, _) in order {
        if index < first_part {
            planes += 1;
            names.push(format!("plane_{planes}"));
        } else if parts < MOST_PARTS {
            parts += 1;
            names.push(format!("part_{parts}"));
        } else if names.last().is_none_or(|name| name != "crumbs") {
            names.push("crumbs".to_owned());
        }
        numbers.insert(index, names.len() as u32 - 1);
    }
    let has_texcoords = geometry.surfaces.first().is_some_and(|surface| surface.has_texcoords);
    geometry.mesh.surface = region.iter().map(|index| numbers[index]).collect();
    geometry.specular = vec![false; names.len()];
    geometry.surfaces = names
        .into_iter()
        .map(|name| Surface { name, role: Role::Untagged, has_texcoords })
        .collect();
}

/// The triangles across each edge. An edge of more than two triangles joins none: the surface
/// branches there.
fn neighbours(mesh: &Mesh) -> Vec<Vec<u32>> {
    let mut edges: HashMap<(u32, u32), (u32, u32, u32)> = HashMap::new();
    for (index, &[a, b, c]) in mesh.triangles.iter().enumerate() {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let edge = edges.entry((from.min(to), from.max(to))).or_insert((0, 0, 0));
            match edge.2 {
                0 => edge.0 = index as u32,
                1 => edge.1 = index as u32,
                _ => {}
            }
            edge.2 += 1;
        }
    }
    let mut neighbours = vec![Vec::new(); mesh.triangles.len()];
    for (first, second, count) in edges.into_values() {
        if count == 2 {
            neighbours[first as usize].push(second);
            neighbours[second as usize].push(first);
        }
    }
    // The map's order is random; the result must not be.
    neighbours.iter_mut().for_each(|list| list.sort_unstable());
    neighbours
}

/// The region of each triangle, numbered in the order in which they were begun.
fn grow(mesh: &Mesh, areas: &[f64], neighbours: &[Vec<u32>], cosine: f32) -> Vec<u32> {
    let normals: Vec<Vec3> = (0..mesh.triangles.len()).map(|t| mesh.normal(t)).collect();
    let mut seeds: Vec<usize> = (0..areas.len()).collect();
    seeds.sort_by(|&a, &b| areas[b].total_cmp(&areas[a]).then(a.cmp(&b)));
    let mut region = vec![u32::MAX; areas.len()];
    let mut next = 0;
    for seed in seeds {
        if region[seed] != u32::MAX {
            continue;
        }
        region[seed] = next;
        let mut sum = normals[seed].as_dvec3() * areas[seed].max(f64::MIN_POSITIVE);
        let mut queue = std::collections::VecDeque::from([seed]);
        while let Some(triangle) = queue.pop_front() {
            for &other in &neighbours[triangle] {
                let other = other as usize;
                let mean: DVec3 = sum.normalize_or_zero();
                if region[other] == u32::MAX && normals[other].dot(mean.as_vec3()) >= cosine {
                    region[other] = next;
                    sum += normals[other].as_dvec3() * areas[other];
                    queue.push_back(other);
                }
            }
        }
        next += 1;
    }
    region
}
