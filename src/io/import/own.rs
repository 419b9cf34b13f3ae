//! Sources that are not merely a list of views: `transforms.json`, whose frames are whole cameras,
//! glTF, which holds meshes too, and Bundler, whose photographs are named beside it.

use std::path::Path;

use super::fit::{fit, is_radiance, measured, scale};
use super::notes::Notes;
use super::photographs::{Found, Photographs};
use super::read::Reader;
use super::world;
use super::{Lens, Parsed, Shot, View, bundler};
use crate::io::error::read_bounded;
use crate::io::mesh;
use crate::io::obj::Geometry;
use crate::io::transforms::{self, Images};
use crate::io::{Error, Fault, capture, json, masks};
use crate::scene::{Camera, Distortion};

impl Reader<'_> {
    pub(super) fn transforms(&mut self, file: &Path) -> Result<(), Error> {
        let folder = file.parent().unwrap_or(Path::new(""));
        let photographs = match self.options.images.as_slice() {
            [] => Photographs::default(),
            folders => Photographs::below(folders),
        };
        let value = json::read(file)?;
        let find = |name: &str| match photographs.find(name) {
            Found::One(path) => Some(path),
            _ => transforms::find_below(folder, name),
        };
        let cameras = transforms::interpret(file, &value, Images::Wanted, &find)?;
        self.import.warnings.extend(cameras.warnings);
        if cameras.vignetting.is_some() {
            self.import.warnings.push(format!(
                "{}, vignetting: not carried over; copy that field into the new transforms.json.",
                file.display()
            ));
        }
        self.watch.begin(cameras.frames.len() as u64);
        let (mut notes, mut shots) = (Notes::default(), Vec::new());
        for frame in cameras.frames {
            self.watch.tick()?;
            let mut camera = frame.camera;
            if let Some(applied) = cameras.applied.as_ref().filter(|_| self.options.undo_applied) {
                camera = world::undo(applied, &camera).ok_or_else(|| {
                    let problem = "the matrix cannot be undone";
                    let remedy = "Leave out --undo-applied-transform";
                    Error::Invalid(Fault::new(file, "applied_transform", problem, remedy))
                })?;
            }
            if self.options.undistorted && !camera.distortion.is_none() {
                let size = (camera.width, camera.height);
                let (focal, principal) = (camera.focal_px, camera.principal_px);
                let (rotation, position) = (camera.world_from_camera, camera.position);
                let none = Distortion::default();
                camera = Camera::new(size, focal, principal, none, rotation, position);
                notes.undistorted.push(frame.place.clone());
            }
            let listed = frame.image.as_ref().filter(|_| !frame.brackets.is_empty());
            if let Some(image) = listed {
                let exposures = capture::series(&frame, image)?;
                self.brackets.insert(image.clone(), exposures);
            }
            if frame.image.is_none() {
                notes.missing.push(frame.place.clone());
            }
            let (image, actual) = measured(frame.image, &mut notes);
            let place = &frame.place;
            let fitted = if frame.orientation.is_upright() {
                fit(camera, image, actual, place, &mut notes)
            } else {
                // A capture of this program, whose cameras are of upright photographs.
                let actual = actual.map(|stored| frame.orientation.size(stored));
                let scaled = scale(camera, actual, place, &mut notes);
                scaled.map(|camera| (camera, image, frame.orientation))
            };
            let Some((camera, image, orientation)) = fitted else { continue };
            let is_measurement = frame.is_measurement && is_radiance(image.as_deref());
            let (name, observations) = (frame.name, Vec::new());
            let mask = frame.mask.or_else(|| masks::of_photograph(image.as_deref()?));
            shots.push(Shot {
                name,
                camera,
                image,
                orientation,
                mask,
                is_measurement,
                observations,
            });
        }
        if cameras.applied.is_some() && !self.options.undo_applied {
            self.import.warnings.push(format!(
                "{}, applied_transform: the cameras were turned or scaled by nerfstudio. If the \
                 mesh is in the coordinates before that, import with --undo-applied-transform.",
                file.display()
            ));
        }
        self.finish(file, shots, notes)
    }

    pub(super) fn gltf(&mut self, file: &Path) -> Result<Option<Geometry>, Error> {
        self.import.format = "glTF";
        let contents = mesh::gltf::load(file)?;
        let (cameras, notes) = contents.cameras(file)?;
        if cameras.is_empty() && !contents.has_geometry() {
            return Err(Error::Missing(Fault::new(
                file,
                "nodes",
                "no node of the scene places a mesh or a perspective camera",
                "Export the scene with its cameras and meshes in place",
            )));
        }
        self.import.warnings.extend(notes);
        let views = cameras
            .into_iter()
            .enumerate()
            .map(|(index, camera)| View {
                place: format!("camera {index} ({})", camera.name),
                name: camera.name,
                undistorted: None,
                size: None,
                lens: Lens::Angle { yfov: camera.yfov, aspect_ratio: camera.aspect_ratio },
                distortion: Distortion::default(),
                world_from_camera: glam::DMat3::from_mat4(camera.world_from_camera),
                position: camera.world_from_camera.w_axis.truncate(),
            })
            .collect::<Vec<_>>();
        if !views.is_empty() {
            self.take_file(file, Parsed { views, warnings: Vec::new() })?;
        }
        // Another mesh may have been given, and a file of cameras has none.
        if self.options.mesh.is_none() && contents.has_geometry() {
            return mesh::read(file, self.options.surfaces.by()).map(Some);
        }
        Ok(None)
    }

    pub(super) fn names_beside(&self, file: &Path) -> Result<Vec<String>, Error> {
        let folder = file.parent().unwrap_or(Path::new(""));
        let stem = file.file_stem().unwrap_or_default().to_string_lossy();
        let own = file.file_name().unwrap_or_default().to_string_lossy();
        let names = [
            format!("{stem}.list.txt"),
            format!("{own}.list.txt"),
            "list.txt".to_owned(),
            "../list.txt".to_owned(),
            "pictures.txt".to_owned(),
        ];
        if let Some(list) = names.iter().map(|name| folder.join(name)).find(|path| path.is_file()) {
            return Ok(bundler::names(&String::from_utf8_lossy(&read_bounded(&list, 64 << 20)?)));
        }
        // Without a list the photographs of a folder, one a camera, in the order of their names.
        let paths = self.photographs(folder).all();
        Ok(paths.iter().map(|path| path.to_string_lossy().into_owned()).collect())
    }
}
