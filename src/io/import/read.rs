//! Reads a source: its cameras, the photographs they belong to, and a mesh.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use glam::DVec3;

use super::fit::{fit, is_radiance, measured};
use super::notes::{self, Notes};
use super::photographs::{Found, Photographs};
use super::source::{self, LARGEST, Source};
use super::world::Change;
use super::{Import, Options, Parsed, Shot, View, colmap, gathered, reprojection, series};
use crate::io::brackets::Series;
use crate::io::error::read_bounded;
use crate::io::mesh;
use crate::io::obj::Geometry;
use crate::io::{Error, Fault, grouping, masks};
use crate::scene::Distortion;
use crate::watch::Watch;

/// Reads a source without writing anything. `watch` counts the photographs.
pub fn read(path: &Path, options: &Options, watch: &Watch) -> Result<Import, Error> {
    let source = source::detect(path)?;
    let times = options.times.as_deref().map(grouping::read_times).transpose()?;
    let mut reader = Reader { options, watch, import: Import::default(), brackets: HashMap::new() };
    let own_mesh = reader.cameras(&source)?;
    watch.check()?;
    reader.mesh(&source, own_mesh)?;
    watch.check()?;
    let Reader { mut import, brackets, .. } = reader;
    series::find(&mut import, brackets, times.as_ref(), watch)?;
    if import.shots.is_empty() && import.geometry.is_none() {
        return Err(Error::Missing(Fault::new(
            path,
            "",
            "there is neither a camera nor a mesh in it",
            "Give a file that holds cameras, and --mesh",
        )));
    }
    import.warnings.extend(notes::blind(&import));
    Ok(import)
}

pub(super) struct Reader<'a> {
    pub options: &'a Options,
    pub watch: &'a Watch,
    pub import: Import,
    /// The exposures that a source itself names, by the image that they belong to.
    pub brackets: HashMap<PathBuf, Series>,
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
                self.take(folder, folder, parsed)?;
                let change = Change::of_cameras(self.options);
                let place = |point: DVec3| change.point(point);
                self.import.points = reprojection::observe(&model, &mut self.import.shots, place);
                self.import.warnings.extend(model.warnings);
            }
            Source::Cameras(format, file) => {
                self.import.format = format.name;
                let names = || self.names_beside(file);
                let parsed = (format.parse)(file, &bytes(file)?, &names)?;
                self.take_file(file, parsed)?;
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
                return mesh::read(file, self.options.surfaces.by()).map(Some);
            }
        }
        Ok(None)
    }

    pub(super) fn take_file(&mut self, file: &Path, parsed: Parsed) -> Result<(), Error> {
        self.take(file, file.parent().unwrap_or(Path::new("")), parsed)
    }

    /// The images below the user's folders, or else those near the source.
    pub(super) fn photographs(&self, folder: &Path) -> Photographs {
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
        Ok(fit(camera, image, actual, &view.place, notes).map(|(camera, image, orientation)| {
            Shot {
                name: view.name.clone(),
                camera,
                mask: image.as_deref().and_then(masks::of_photograph),
                is_measurement: is_radiance(image.as_deref()),
                image,
                orientation,
                observations: Vec::new(),
            }
        }))
    }

    /// Turns into the capture's coordinates, and says what was odd.
    pub(super) fn finish(
        &mut self,
        file: &Path,
        mut shots: Vec<Shot>,
        notes: Notes,
    ) -> Result<(), Error> {
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
}
