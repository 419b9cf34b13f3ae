//! Builds a mesh from the faces of a file of any format. Faces that cannot be used are left out and
//! counted.

use std::collections::HashMap;
use std::path::Path;

use glam::{Vec2, Vec3};

use crate::geometry::mesh::Mesh;
use crate::io::obj::{Geometry, split_if_bent};
use crate::io::obj_text::is_usable;
use crate::io::polygon::{self, Shape};
use crate::io::{Error, Fault};
use crate::scene::{Role, Surface};

/// The surface of a file that names none.
pub(super) const NAMELESS: &str = "surface";
/// Point tests of the triangulation of all concave polygons: about a second.
const PATIENCE: u64 = 300_000_000;

/// A mesh that grows.
pub(super) struct Assembly {
    pub mesh: Mesh,
    texcoords: Vec<[Vec2; 3]>,
    /// Name, textured faces, all faces.
    surfaces: Vec<(String, usize, usize)>,
    known: HashMap<String, usize>,
    polygons: u32,
    patience: u64,
    broken: usize,
    flat: usize,
    crossed: usize,
    small: usize,
}

impl Assembly {
    pub fn new(positions: Vec<Vec3>) -> Self {
        Self {
            mesh: Mesh { positions, ..Default::default() },
            texcoords: Vec::new(),
            surfaces: Vec::new(),
            known: HashMap::new(),
            polygons: 0,
            patience: PATIENCE,
            broken: 0,
            flat: 0,
            crossed: 0,
            small: 0,
        }
    }

    /// The index of the surface of that name.
    pub fn surface(&mut self, name: &str) -> usize {
        if let Some(&index) = self.known.get(name) {
            return index;
        }
        self.surfaces.push((name.to_owned(), 0, 0));
        self.known.insert(name.to_owned(), self.surfaces.len() - 1);
        self.surfaces.len() - 1
    }

    /// Adds a polygon; indices that name no vertex make it broken.
    pub fn face(&mut self, corners: &[u32], texcoords: Option<&[Vec2]>, surface: usize) {
        if corners.len() < 3 {
            self.small += 1;
            return;
        }
        let position = |index: &u32| self.mesh.positions.get(*index as usize).copied();
        let Some(positions) = corners
            .iter()
            .map(|index| position(index).filter(|position| is_usable(*position)))
            .map(|position| position.map(|position| position.as_dvec3()))
            .collect::<Option<Vec<_>>>()
        else {
            self.broken += 1;
            return;
        };
        let mut triangles = Vec::with_capacity(corners.len() - 2);
        match polygon::triangulate(&positions, &mut triangles, &mut self.patience) {
            Shape::Flat => {
                self.flat += 1;
                return;
            }
            Shape::Fan => self.crossed += 1,
            Shape::Sound => {}
        }
        let texcoords = texcoords.filter(|own| own.iter().all(|texcoord| texcoord.is_finite()));
        let first = self.mesh.triangles.len();
        for triangle in triangles {
            self.mesh.triangles.push(triangle.map(|corner| corners[corner]));
            self.mesh.surface.push(surface as u32);
            self.mesh.polygon.push(self.polygons);
            self.texcoords.push(texcoords.map_or([Vec2::ZERO; 3], |own| triangle.map(|c| own[c])));
        }
        self.polygons += 1;
        split_if_bent(&mut self.mesh, first, &mut self.polygons);
        self.surfaces[surface].1 += usize::from(texcoords.is_some());
        self.surfaces[surface].2 += 1;
    }

    pub fn finish(mut self, file: &Path) -> Result<Geometry, Error> {
        if self.mesh.triangles.is_empty() {
            return Err(self.nothing(file));
        }
        let warnings = self.warnings(file);
        // Surfaces of which no face is left are not there.
        let mut kept = vec![u32::MAX; self.surfaces.len()];
        let mut surfaces = Vec::new();
        for (index, (name, textured, all)) in self.surfaces.into_iter().enumerate() {
            if all > 0 {
                kept[index] = surfaces.len() as u32;
                let has_texcoords = textured == all;
                surfaces.push(Surface { name, role: Role::Untagged, has_texcoords });
            }
        }
        self.mesh.surface.iter_mut().for_each(|surface| *surface = kept[*surface as usize]);
        if surfaces.iter().any(|surface| surface.has_texcoords) {
            for (texcoords, &surface) in self.texcoords.iter_mut().zip(&self.mesh.surface) {
                if !surfaces[surface as usize].has_texcoords {
                    *texcoords = [Vec2::ZERO; 3];
                }
            }
            self.mesh.texcoords = self.texcoords;
        }
        let specular = vec![false; surfaces.len()];
        Ok(Geometry { mesh: self.mesh, surfaces, specular, warnings, ..Default::default() })
    }

    fn nothing(&self, file: &Path) -> Error {
        let problem = match (self.broken, self.flat, self.mesh.positions.len()) {
            (0, 0, 0) => "there is no geometry in the file".to_owned(),
            (0, 0, count) => format!("the file has {count} vertices but no faces"),
            (0, ..) => "no face of the mesh has any area".to_owned(),
            _ => "every face has a vertex that is missing or no position in metres".to_owned(),
        };
        let remedy = "Export the mesh with its faces; a point cloud must be meshed first";
        Error::Invalid(Fault::new(file, "", problem, remedy))
    }

    fn warnings(&self, file: &Path) -> Vec<String> {
        let counted = [
            (self.broken, "with vertices that are missing or no positions left out."),
            (self.flat, "without area left out."),
            (self.small, "with fewer than three corners left out."),
            (self.crossed, "with an outline that crosses itself triangulated as a fan."),
        ];
        let sentence = |(count, what): (usize, &str)| {
            let faces = if count == 1 { "face" } else { "faces" };
            (count > 0).then(|| format!("{}: {count} {faces} {what}", file.display()))
        };
        counted.into_iter().filter_map(sentence).collect()
    }
}
