//! Loading a capture: geometry, cameras, photographs and tags of one folder.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use rayon::prelude::*;

use super::accept::{Loaded, Sensor, accept, bytes};
use super::brackets::Series;
use super::picture::{self, Format, Picture};
use super::tags::ChartTag;
use super::tags::charts::left_out;
use super::transforms::{self, Cameras, Frame, Images};
use super::{Error, Fault, brackets, mesh, photograph, raw, scratch, single, tags};
use crate::exposures::{MergeOptions, Merged};
use crate::scene::{Capture, Display, Image, Photograph, charts};
use crate::watch::Watch;

const GEOMETRY: &str = "scene.obj";
const CAMERAS: &str = "transforms.json";
pub const TAGS: &str = "tags.json";

/// Loads a capture folder. `watch` counts the photographs.
pub fn load(folder: &Path, watch: &Watch) -> Result<Capture, Error> {
    if folder.is_file() {
        return Err(Error::Invalid(Fault::new(
            folder,
            "",
            "this is a file, and a capture is a folder",
            "Open the folder with scene.obj, transforms.json and the photographs",
        )));
    }
    let geometry = mesh::load(&find_geometry(folder)?)?;
    let mut surfaces = geometry.surfaces;
    let mut warnings = geometry.warnings;
    let tag_file = folder.join(TAGS);
    let tags = if tag_file.exists() {
        tags::read(&tag_file, &mut surfaces)?
    } else {
        warnings.extend(geometry.library_warnings);
        tags::from_surfaces(&mut surfaces, &geometry.specular)
    };
    warnings.extend(tags.warnings);
    let camera_file = folder.join(CAMERAS);
    if !camera_file.exists() {
        return Err(Error::Missing(Fault::new(
            &camera_file,
            "",
            "the capture has no camera file",
            "Export the cameras of the photographs as transforms.json (nerfstudio's format)",
        )));
    }
    let mut cameras = transforms::read(&camera_file, Images::Needed)?;
    warnings.append(&mut cameras.warnings);
    let sensor = Sensor {
        saturation: tags.saturation,
        vignetting: cameras.vignetting,
        color_matrix: tags.color_matrix,
        in_files: bytes(&cameras) > scratch::MOST_IN_MEMORY,
    };
    let images = load_images(&camera_file, &cameras, &sensor, watch, &mut warnings)?;
    let photographs = std::iter::zip(cameras.frames, images)
        .map(|(frame, image)| {
            let orientation = frame.orientation.exif();
            let display = frame.image.map(|file| Display { file, orientation });
            let display = display.filter(|_| image.is_none());
            let image = image.map(Arc::new);
            Photograph { name: frame.name, camera: frame.camera, image, display }
        })
        .collect();
    let mut capture = Capture {
        name: name(folder),
        mesh: Arc::new(geometry.mesh),
        surfaces,
        photographs,
        materials: tags.materials,
        lights: tags.lights,
        environment: tags.environment,
        charts: Arc::default(),
        color_matrix: tags.color_matrix,
        warnings,
    };
    lay_charts(&mut capture, &tags.charts, &tag_file);
    Ok(capture)
}

/// Makes surfaces of the charts; one that cannot be used is left out with a warning.
fn lay_charts(capture: &mut Capture, tags: &[ChartTag], tag_file: &Path) {
    let names: Vec<&str> = capture.photographs.iter().map(|own| own.name.as_str()).collect();
    let mut problems = Vec::new();
    let (mut charts, mut places) = (Vec::new(), Vec::new());
    for tag in tags {
        match tag.resolved(&names) {
            Ok(chart) => {
                charts.push(chart);
                places.push(&tag.place);
            }
            Err(problem) => problems.push((&tag.place, &tag.name, problem)),
        }
    }
    let laid = charts::find(capture, charts);
    for (place, own) in places.into_iter().zip(&laid) {
        if let Err(problem) = &own.placed {
            problems.push((place, &own.chart.name, problem.clone()));
        }
    }
    let warning = |(place, name, problem): (&String, &String, String)| {
        format!("{}, {place}: {}", tag_file.display(), left_out(name, &problem))
    };
    let mut warnings: Vec<String> = problems.into_iter().map(warning).collect();
    *capture = capture.with_charts(Arc::new(laid));
    capture.warnings.append(&mut warnings);
}

/// What a capture is called: its folder's name.
pub fn name(folder: &Path) -> String {
    let absolute = dunce::canonicalize(folder).unwrap_or_else(|_| folder.to_owned());
    absolute.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}

/// `scene.obj`, or the only mesh of the folder.
pub fn find_geometry(folder: &Path) -> Result<PathBuf, Error> {
    let named = folder.join(GEOMETRY);
    if named.is_file() {
        return Ok(named);
    }
    let entries = std::fs::read_dir(folder)
        .map_err(|source| Error::Read { file: folder.to_owned(), source })?;
    let mut files: Vec<PathBuf> = entries
        .filter_map(|entry| entry.ok().map(|entry| entry.path()))
        .filter(|path| path.is_file())
        .collect();
    files.sort();
    // An OBJ file is meant before others beside it, as the one that can be tagged by name.
    let is_obj =
        |path: &&PathBuf| path.extension().is_some_and(|own| own.eq_ignore_ascii_case("obj"));
    let mut meshes: Vec<&PathBuf> = files.iter().filter(is_obj).collect();
    if meshes.is_empty() {
        meshes = files.iter().filter(|path| mesh::is_mesh(path)).collect();
    }
    match meshes.as_slice() {
        [only] => Ok((*only).clone()),
        [] => Err(Error::Missing(Fault::new(
            folder,
            "",
            "there is no geometry in this folder",
            "Put the mesh there as scene.obj, beside transforms.json and the photographs, or draw it \
             on them in the studio",
        ))),
        several => {
            let named = |path: &&&PathBuf| path.file_stem().is_some_and(|stem| stem == "scene");
            match several.iter().find(named) {
                Some(scene) => Ok((**scene).clone()),
                None => Err(Error::Invalid(Fault::new(
                    folder,
                    "",
                    format!("there are {} meshes and none is named scene.obj", several.len()),
                    "Name the one to use scene.obj",
                ))),
            }
        }
    }
}

/// What is to be done with a frame's image.
enum Job<'a> {
    Decode(&'a Path),
    /// Exposures, to be merged.
    Merge(Series),
    /// No measurement; only the size is compared.
    Show(&'a Path),
}

/// The image of each frame, `None` where it is no measurement. Files are decoded in parallel;
/// results and complaints are in the order of the frames whatever the number of threads.
fn load_images(
    camera_file: &Path,
    cameras: &Cameras,
    sensor: &Sensor,
    watch: &Watch,
    warnings: &mut Vec<String>,
) -> Result<Vec<Option<Image>>, Error> {
    let frames = &cameras.frames;
    let lone: Vec<&Path> = match cameras.response {
        None => Vec::new(),
        Some(_) => {
            frames.iter().map(lone).collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect()
        }
    };
    let (lone, note) = single::series(&lone)?;
    warnings.extend(note);
    let mut lone = lone.into_iter().peekable();
    let mut displayed = Vec::new();
    let mut jobs = Vec::with_capacity(frames.len());
    for frame in frames {
        let Some(file) = frame.image.as_deref() else { continue };
        let is_radiance = Format::of(file)?.is_radiance();
        let is_measurement = frame.is_measurement;
        let stands = frame.is_geometry || is_measurement && is_radiance;
        if !stands && !frame.brackets.is_empty() {
            jobs.push(Job::Merge(series(frame, file)?));
            continue;
        }
        if let Some(series) = lone.next_if(|series| series.files[0] == file) {
            jobs.push(Job::Merge(series));
            continue;
        }
        if is_measurement && !is_radiance && !looks_like_radiance(file) {
            displayed.push(frame);
        }
        jobs.push(if is_measurement && (is_radiance || looks_like_radiance(file)) {
            Job::Decode(file)
        } else {
            Job::Show(file)
        });
    }
    if jobs.iter().all(|job| matches!(job, Job::Show(_))) {
        warnings.push(nothing_measured(camera_file));
    }
    if let Some(first) = displayed.first() {
        warnings.push(format!(
            "{}, {}{}: PNG, JPEG and TIFF hold values for display and are no measurements of \
             radiance; shown, but not used. Give OpenEXR or .hdr, mark such frames \"hdr\": false, or \
             say \"response\": \"srgb\" if their curve is that of sRGB.",
            camera_file.display(),
            first.place,
            and_more(displayed.len())
        ));
    }
    let all_series: Vec<Series> = jobs
        .iter()
        .filter_map(|job| if let Job::Merge(series) = job { Some(series.clone()) } else { None })
        .collect();
    let decoded = jobs.iter().filter(|job| matches!(job, Job::Decode(_))).count();
    if decoded > 0 && !all_series.is_empty() {
        warnings.push(format!(
            "{}: {decoded} of the photographs are images of radiance, {} are merged from \
             exposures. Merged radiance is that which gives the middle code in one second; the \
             others must be in the same unit.",
            camera_file.display(),
            all_series.len()
        ));
    }
    watch.begin((jobs.len() - all_series.len()) as u64 + brackets::steps(&all_series));
    let results: Vec<Result<Loaded, Error>> = jobs
        .par_iter()
        .zip(frames)
        .map(|(job, frame)| {
            watch.check()?;
            let result = match job {
                // Their turn comes below: one series at a time, all with one response.
                Job::Merge(_) => return Ok((None, Vec::new())),
                Job::Show(file) => Ok((None, check_shown(file, frame))),
                Job::Decode(file) => measured(file, frame, sensor),
            };
            watch.tick()?;
            result
        })
        .collect();
    watch.check()?;
    let mut images = Vec::with_capacity(results.len());
    for result in results {
        let (image, notes) = result?;
        images.push(image);
        warnings.extend(notes);
    }
    if !all_series.is_empty() {
        let is_series = |job: &Job| matches!(job, Job::Merge(_));
        let places: Vec<usize> = (0..jobs.len()).filter(|&i| is_series(&jobs[i])).collect();
        let options = MergeOptions::default();
        let found = brackets::merge_all(
            &all_series,
            cameras.response.clone(),
            &options,
            watch,
            |index, merged| {
                let frame = &frames[places[index]];
                let Merged { width, height, pixels, .. } = merged;
                let picture = Picture { width, height, pixels: pixels.into(), notes: Vec::new() };
                let series = &all_series[index];
                let file = &series.files[series.reference];
                let (image, notes) = accept(picture, file, frame, sensor)?;
                images[places[index]] = image;
                warnings.extend(notes);
                Ok(())
            },
        )?;
        warnings.extend(found.warnings);
    }
    Ok(images)
}

/// The image of a frame that is one exposure and not radiance already. RAW files have no curve.
fn lone(frame: &Frame) -> Result<Option<&Path>, Error> {
    let Some(file) = frame.image.as_deref() else { return Ok(None) };
    let is_lone = frame.is_measurement && frame.brackets.is_empty() && !looks_like_radiance(file);
    let is_lone = is_lone && !Format::of(file)?.is_radiance() && !raw::is_raw(file);
    Ok(is_lone.then_some(file))
}

fn and_more(count: usize) -> String {
    if count > 1 { format!(" and {} more", count - 1) } else { String::new() }
}

/// By its name this should be radiance, so a wrong content is a fault and no choice.
fn looks_like_radiance(file: &Path) -> bool {
    file.extension()
        .is_some_and(|own| ["exr", "hdr"].iter().any(|known| own.eq_ignore_ascii_case(known)))
}

fn nothing_measured(camera_file: &Path) -> String {
    format!(
        "{}: no photograph is a measurement of radiance, so nothing can be reconstructed. Give at \
         least one OpenEXR or .hdr image.",
        camera_file.display()
    )
}

/// The exposures of a frame; the frame's own image is the reference if it is among them.
pub(super) fn series(frame: &Frame, image: &Path) -> Result<Series, Error> {
    let mut seconds = Vec::with_capacity(frame.brackets.len());
    for bracket in &frame.brackets {
        let time = match bracket.exposure_secs {
            Some(time) => Some(time),
            None => photograph::shot(&bracket.file)?.exposure_secs,
        };
        seconds.push(time.ok_or_else(|| {
            Error::Missing(Fault::new(
                &bracket.file,
                frame.place.clone(),
                "neither the camera file nor the photograph says its exposure time",
                "Give exposure_time, in seconds, in the frame's brackets",
            ))
        })?);
    }
    let files: Vec<PathBuf> = frame.brackets.iter().map(|bracket| bracket.file.clone()).collect();
    let reference = files.iter().position(|file| file == image).unwrap_or(files.len() / 2);
    Ok(Series { files, seconds, reference })
}

/// What is wrong with an image that is only shown.
fn check_shown(file: &Path, frame: &Frame) -> Vec<String> {
    match picture::dimensions(file).map(|stored| frame.orientation.size(stored)) {
        Ok(size) if size != (frame.camera.width, frame.camera.height) => vec![format!(
            "{}: the image has {} x {} pixels, but its camera in {} has {} x {}: they will not \
             match when shown.",
            file.display(),
            size.0,
            size.1,
            frame.place,
            frame.camera.width,
            frame.camera.height,
        )],
        Ok(_) => Vec::new(),
        Err(error) => vec![format!("{error} The frame is for geometry only, so work goes on.")],
    }
}

fn measured(file: &Path, frame: &Frame, sensor: &Sensor) -> Result<Loaded, Error> {
    accept(picture::read_values(file)?, file, frame, sensor)
}
