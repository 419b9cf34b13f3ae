//! Reads a source: its cameras, the photographs they belong to, and a mesh.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use super::photographs::{Found, Photographs};
use super::source::{self, LARGEST, Source};
use super::world::{self, Change};
use super::{
    Import, Options, Parsed, Shot, View, alicevision, bundler, colmap, gathered, metashape,
    opensfm, reality_capture, reprojection,
};
use crate::io::error::read_bounded;
use crate::io::mesh::{self, regions, weld};
use crate::io::obj::Geometry;
use crate::io::picture::{self, Format};
use crate::io::transforms::{self, Images};
use crate::io::{Error, Fault, capture, json};
use crate::scene::{Camera, Distortion};
use crate::watch::Watch;

/// Sides may differ by this many pixels from an exact scaling.
const ROUNDED_PX: f64 = 1.0;

/// Reads a source without writing anything. `watch` counts the photographs.
pub fn read(path: &Path, options: &Options, watch: &Watch) -> Result<Import, Error> {
    let source = source::detect(path)?;
    let mut reader = Reader { options, watch, import: Import::default() };
    let own_mesh = reader.cameras(&source)?;
    reader.mesh(&source, own_mesh)?;
    let mut import = reader.import;
    if import.shots.is_empty() && import.geometry.is_none() {
        return Err(Error::Missing(Fault::new(
            path,
            "",
            "there is neither a camera nor a mesh in it",
            "Give a file that holds cameras, and --mesh",
        )));
    }
    import.warnings.extend(blind(&import));
    Ok(import)
}

struct Reader<'a> {
    options: &'a Options,
    watch: &'a Watch,
    import: Import,
}

impl Reader<'_> {
    /// Reads the cameras; gives the geometry of sources that hold both.
    fn cameras(&mut self, source: &Source) -> Result<Option<Geometry>, Error> {
        let bytes = |file: &Path| read_bounded(file, LARGEST);
        match source {
            Source::Colmap(folder) => {
                self.import.format = "COLMAP";
                let model = colmap::read(folder)?;
                let parsed = colmap::views(folder, &model)?;
                self.import.reprojection = reprojection::check(folder, &model, &parsed)?;
                self.import.warnings.extend(model.warnings);
                self.take(folder, folder, parsed)?;
            }
            Source::AliceVision(file) => {
                self.import.format = "AliceVision (Meshroom)";
                self.take_file(file, alicevision::parse(file, &bytes(file)?)?)?;
            }
            Source::OpenSfm(file) => {
                self.import.format = "OpenSfM";
                self.take_file(file, opensfm::parse(file, &bytes(file)?)?)?;
            }
            Source::RealityCapture(file) => {
                self.import.format = "RealityCapture CSV";
                self.take_file(file, reality_capture::parse(file, &bytes(file)?)?)?;
            }
            Source::Metashape(file) => {
                self.import.format = "Metashape XML";
                self.take_file(file, metashape::parse(file, &bytes(file)?)?)?;
            }
            Source::Bundler(file) => {
                self.import.format = "Bundler";
                let names = self.bundler_names(file)?;
                self.take_file(file, bundler::parse(file, &bytes(file)?, &names)?)?;
            }
            Source::Transforms(files) => {
                self.import.format = "transforms.json";
                for file in files {
                    self.transforms(file)?;
                }
            }
            Source::Gltf(file) => return self.gltf(file),
            Source::Mesh(file) => {
                self.import.format = "mesh";
                return mesh::load(file).map(Some);
            }
        }
        Ok(None)
    }

    fn take_file(&mut self, file: &Path, parsed: Parsed) -> Result<(), Error> {
        self.take(file, file.parent().unwrap_or(Path::new("")), parsed)
    }

    /// The images below the user's folders, or else those near the source.
    fn photographs(&self, folder: &Path) -> Photographs {
        if !self.options.images.is_empty() {
            return Photographs::below(&self.options.images);
        }
        // A model lies in sparse/0 beside images.
        let near = ["", "images", "../images", "../../images"].map(|place| folder.join(place));
        let mut own = Photographs::default();
        for place in near {
            if own.is_empty() && place.is_dir() {
                own = Photographs::near(&place);
            }
        }
        own
    }

    fn take(&mut self, file: &Path, folder: &Path, parsed: Parsed) -> Result<(), Error> {
        let photographs = self.photographs(folder);
        self.import.warnings.extend(parsed.warnings);
        self.watch.begin(parsed.views.len() as u64);
        let mut notes = Notes::default();
        let mut shots = Vec::new();
        for view in &parsed.views {
            self.watch.tick()?;
            shots.extend(self.shot(file, view, &photographs, &mut notes)?);
        }
        self.finish(file, shots, notes)
    }

    fn shot(
        &self,
        file: &Path,
        view: &View,
        photographs: &Photographs,
        notes: &mut Notes,
    ) -> Result<Option<Shot>, Error> {
        let mut view = view.clone();
        let mut found = photographs.find(&view.name);
        let mut is_undistorted = self.options.undistorted;
        if found == Found::None
            && let Some(name) = &view.undistorted
        {
            found = photographs.find(name);
            is_undistorted |= found != Found::None;
        }
        if is_undistorted && view.distortion != Distortion::default() {
            view.distortion = Distortion::default();
            notes.undistorted.push(view.place.clone());
        }
        let image = match found {
            Found::One(path) => Some(path),
            Found::Several => {
                notes.ambiguous.push(view.place.clone());
                None
            }
            Found::None => {
                notes.missing.push(view.place.clone());
                None
            }
        };
        self.complete(file, &view, image, notes)
    }

    /// Brings camera and image together.
    fn complete(
        &self,
        file: &Path,
        view: &View,
        image: Option<PathBuf>,
        notes: &mut Notes,
    ) -> Result<Option<Shot>, Error> {
        let (image, actual) = measured(image, notes);
        let Some(size) = view.size.or(actual) else {
            notes.sizeless.push(view.place.clone());
            return Ok(None);
        };
        let camera = view.camera(file, size)?;
        Ok(fit(camera, image, actual, &view.place, notes).map(|(camera, image)| Shot {
            name: view.name.clone(),
            camera,
            is_measurement: is_radiance(image.as_deref()),
            image,
        }))
    }

    fn transforms(&mut self, file: &Path) -> Result<(), Error> {
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
            if !frame.brackets.is_empty() {
                notes.brackets.push(frame.place.clone());
            }
            if frame.image.is_none() {
                notes.missing.push(frame.place.clone());
            }
            let (image, actual) = measured(frame.image, &mut notes);
            let Some((camera, image)) = fit(camera, image, actual, &frame.place, &mut notes) else {
                continue;
            };
            let is_measurement = frame.is_measurement && is_radiance(image.as_deref());
            shots.push(Shot { name: frame.name, camera, image, is_measurement });
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

    fn gltf(&mut self, file: &Path) -> Result<Option<Geometry>, Error> {
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
                lens: super::Lens::Angle { yfov: camera.yfov, aspect_ratio: camera.aspect_ratio },
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
            return mesh::load(file).map(Some);
        }
        Ok(None)
    }

    fn bundler_names(&self, file: &Path) -> Result<Vec<String>, Error> {
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

    /// Turns into the capture's coordinates, and says what was odd.
    fn finish(&mut self, file: &Path, mut shots: Vec<Shot>, notes: Notes) -> Result<(), Error> {
        let change = Change::of_cameras(self.options);
        shots.iter_mut().for_each(|shot| change.shot(shot));
        let found = shots.iter().filter(|shot| shot.image.is_some()).count();
        if found == 0 && !self.options.images.is_empty() {
            let places = notes.missing.iter().chain(&notes.ambiguous).chain(&notes.misshapen);
            return Err(Error::Missing(Fault::new(
                file,
                places.map(String::as_str).next().unwrap_or_default(),
                "none of its photographs is below the folder given by --images, or fits its camera",
                "Give the folder that holds the photographs of these cameras",
            )));
        }
        if shots.is_empty() {
            return Err(Error::Missing(Fault::new(
                file,
                notes.sizeless.first().map(String::as_str).unwrap_or_default(),
                "no photograph was found, and without them the image sizes are not known",
                "Give the folder of the photographs by --images",
            )));
        }
        // Some found: the others are left out, or no capture could be loaded. None found and none
        // asked for: the cameras alone are of use.
        if found > 0 {
            shots.retain(|shot| shot.image.is_some());
        }
        self.import.warnings.extend(notes.warnings(file, found));
        let mut seen: HashMap<PathBuf, usize> = HashMap::new();
        let mut repeated = Vec::new();
        for image in shots.iter().filter_map(|shot| shot.image.clone()) {
            let count = seen.entry(image.clone()).or_default();
            *count += 1;
            if *count == 2 {
                repeated.push(image.display().to_string());
            }
        }
        let what = "several cameras claim this photograph: all but one are wrong.";
        self.import.warnings.extend(gathered(file, &repeated, what));
        self.import.shots.append(&mut shots);
        Ok(())
    }

    fn mesh(&mut self, source: &Source, own: Option<Geometry>) -> Result<(), Error> {
        let geometry = match (&self.options.mesh, own, source) {
            (Some(file), ..) => Some(mesh::load(file)?),
            (None, Some(own), _) => Some(own),
            // A capture, or what nearly is one.
            (None, None, Source::Transforms(files)) => {
                let folder = files[0].parent().unwrap_or(Path::new(""));
                capture::find_geometry(folder).ok().map(|file| mesh::load(&file)).transpose()?
            }
            _ => None,
        };
        let Some(mut geometry) = geometry else {
            self.import.warnings.push(
                "there is no mesh: give one by --mesh, or put it into the capture as scene.obj."
                    .to_owned(),
            );
            return Ok(());
        };
        Change::of_mesh(self.options).mesh(&mut geometry.mesh);
        let before = geometry.mesh.positions.len();
        weld::exactly(&mut geometry.mesh);
        let dropped = weld::within(&mut geometry.mesh, self.options.weld_m as f32);
        let joined = before - geometry.mesh.positions.len();
        if joined > 0 && self.options.weld_m > 0.0 {
            geometry.warnings.push(format!("{joined} vertices of the mesh were joined to others."));
        }
        if dropped > 0 {
            geometry
                .warnings
                .push(format!("{dropped} triangles without area left out of the mesh."));
        }
        if geometry.mesh.triangles.is_empty() {
            return Err(Error::Invalid(Fault::new(
                self.options.mesh.as_deref().unwrap_or(Path::new("mesh")),
                "",
                "no triangle of the mesh has any area after welding",
                "Give a smaller --weld, or the right unit",
            )));
        }
        if self.options.regions || mesh::is_without_surfaces(&geometry) {
            let angle = self.options.planar_angle as f32;
            regions::split(&mut geometry, &regions::Options { angle, ..Default::default() });
        }
        self.import.warnings.append(&mut geometry.warnings);
        self.import.warnings.append(&mut geometry.library_warnings);
        self.import.geometry = Some(geometry);
        Ok(())
    }
}

fn is_radiance(image: Option<&Path>) -> bool {
    image.is_some_and(|image| Format::of(image).is_ok_and(Format::is_radiance))
}

/// An image with its size; an image that is damaged is none.
fn measured(
    image: Option<PathBuf>,
    notes: &mut Notes,
) -> (Option<PathBuf>, Option<(usize, usize)>) {
    let Some(path) = image else { return (None, None) };
    if matches!(Format::of(&path), Ok(Format::Tiff)) {
        // Only shown, and its size is not read.
        return (Some(path), None);
    }
    match picture::dimensions(&path) {
        Ok(size) => (Some(path), Some(size)),
        Err(error) => {
            notes.damaged.push(error.to_string());
            (None, None)
        }
    }
}

/// The camera for the image as it is: scaled where that is smaller or larger; `None` where it
/// cannot be the image of this camera.
fn fit(
    camera: Camera,
    image: Option<PathBuf>,
    actual: Option<(usize, usize)>,
    place: &str,
    notes: &mut Notes,
) -> Option<(Camera, Option<PathBuf>)> {
    let own = (camera.width, camera.height);
    let Some(actual) = actual.filter(|actual| *actual != own) else { return Some((camera, image)) };
    let size = |(width, height): (usize, usize)| glam::DVec2::new(width as f64, height as f64);
    let (ours, theirs) = (size(own), size(actual));
    let factor = theirs / ours;
    // The same shape but for rounding to whole pixels.
    let skew = (theirs - ours * factor.max_element()).abs().max_element();
    if skew > ROUNDED_PX * factor.max_element().max(1.0) {
        notes.misshapen.push(format!(
            "{place}, {} x {} pixels where the camera has {} x {}",
            actual.0, actual.1, own.0, own.1
        ));
        return None;
    }
    notes.scaled.push(place.to_owned());
    let (focal, principal) = (camera.focal_px * factor, camera.principal_px * factor);
    let (rotation, position) = (camera.world_from_camera, camera.position);
    Some((Camera::new(actual, focal, principal, camera.distortion, rotation, position), image))
}

/// Cameras that see nothing of the mesh: other units, axes or coordinates.
fn blind(import: &Import) -> Option<String> {
    let mesh = &import.geometry.as_ref()?.mesh;
    let step = (mesh.triangles.len() / 2000).max(1);
    let sees = |shot: &Shot| {
        mesh.triangles.iter().step_by(step).any(|triangle| {
            let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize].as_dvec3());
            shot.camera.project((a + b + c) / 3.0).is_some()
        })
    };
    let count = import.shots.iter().filter(|shot| !sees(shot)).count();
    (count > 0).then(|| {
        format!(
            "{count} of {} cameras see nothing of the mesh: if that is not so, mesh and cameras are \
             in different coordinates (--mesh-units, --mesh-up, --undo-applied-transform).",
            import.shots.len()
        )
    })
}

/// What is worth a word, gathered over all photographs.
#[derive(Default)]
struct Notes {
    missing: Vec<String>,
    ambiguous: Vec<String>,
    sizeless: Vec<String>,
    damaged: Vec<String>,
    misshapen: Vec<String>,
    scaled: Vec<String>,
    undistorted: Vec<String>,
    brackets: Vec<String>,
}

impl Notes {
    fn warnings(&self, file: &Path, found: usize) -> Vec<String> {
        let missing = match found {
            0 => {
                "the photograph was not found, as none was. The cameras are written all the same: \
                 import again with --images, or put the photographs where the new transforms.json \
                 names them."
            }
            _ => "the photograph was not found; its camera is left out.",
        };
        let lists = [
            (&self.missing, missing),
            (&self.ambiguous, "several photographs have this name; its camera is left out."),
            (
                &self.sizeless,
                "without the photograph its size is not known; the camera is left out.",
            ),
            (&self.misshapen, "the photograph has another shape than its camera; left out."),
            (&self.scaled, "the photograph was scaled after its camera was found; so is the lens."),
            (
                &self.undistorted,
                "the photograph is undistorted already; the lens terms are left out.",
            ),
            (&self.brackets, "exposure series are not carried over."),
        ];
        let mut warnings: Vec<String> =
            lists.iter().filter_map(|(places, what)| gathered(file, places, what)).collect();
        if let Some(first) = self.damaged.first() {
            let count = self.damaged.len();
            warnings.push(format!("{count} photographs cannot be used; the first: {first}"));
        }
        warnings
    }
}
