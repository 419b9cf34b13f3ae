//! `lobelia info CAPTURE`.

use std::path::Path;

use clap::ArgMatches;
use glam::Vec3;

use crate::cli::print::{note_line, say, say_line};
use crate::cli::progress::Display;
use crate::cli::{Ending, arguments, job};
use crate::io::{Error, capture, model};
use crate::math::rgb::Rgb;
use crate::scene::{Capture, Emitter, KnownLight, MaterialKind, Role};
use crate::worker::{Command, JobEvent, Worker};

pub(super) fn run(matches: &ArgMatches) -> Result<(), Ending> {
    let path = arguments::required_path(matches, "capture");
    if let Some(begun) = begun(&path)? {
        begun.iter().for_each(|line| say_line!("{line}"));
        return Ok(());
    }
    job::catch_interrupts()?;
    let mut worker = Worker::start(|| ())?;
    let mut display = Display::new(true);
    let event = job::wait(&mut worker, Command::Load { path }, &mut display)?;
    if let JobEvent::Loaded(capture) = event {
        print(&capture);
    }
    Ok(())
}

/// What a capture without a mesh, or without a camera, has and what is still to do; `None` for one
/// that can be loaded, or that is damaged.
fn begun(folder: &Path) -> Result<Option<Vec<String>>, Error> {
    let cameras = folder.join("transforms.json");
    if !cameras.is_file() {
        return Ok(None);
    }
    let has_mesh = !matches!(capture::find_geometry(folder), Err(Error::Missing(_)));
    let (count, unplaced) = model::unplaced(&cameras)?;
    if count == 0 || (has_mesh && unplaced.len() < count) {
        return Ok(None);
    }
    let mut lines = vec![capture::name(folder), format!("photographs: {count}")];
    if !unplaced.is_empty() {
        lines.push(format!("without a camera: {}", unplaced.join(", ")));
    }
    lines.push(if has_mesh { "geometry: there" } else { "geometry: none" }.to_owned());
    let strokes = folder.join(model::NAME);
    if strokes.is_file() {
        let model = model::read(&strokes)?;
        let (things, strokes) = (model.things.len(), model.strokes.len());
        lines.push(format!("{}: {things} things, {strokes} strokes", model::NAME));
        lines.push(format!("to do: lobelia model {}", folder.display()));
    } else {
        lines.push(format!(
            "to do: draw on the photographs ({}), then lobelia model {}; or bring the mesh as \
             scene.obj and the cameras as transforms.json (lobelia import)",
            model::NAME,
            folder.display()
        ));
    }
    Ok(Some(lines))
}

fn print(capture: &Capture) {
    for warning in &capture.warnings {
        note_line!("warning: {warning}");
    }
    let mesh = &capture.mesh;
    say_line!("{}", capture.name);
    say!("geometry: {} triangles in {} surfaces", mesh.triangles.len(), capture.surfaces.len());
    if let Some((low, high)) = mesh.bounds() {
        let size = high - low;
        say!(", {:.2} × {:.2} × {:.2} m", size.x, size.y, size.z);
    }
    say_line!();

    let measured = capture.measurements().count();
    say_line!("photographs: {} ({measured} measure radiance)", capture.photographs.len());
    for photograph in &capture.photographs {
        let camera = &photograph.camera;
        say!("  {}  {}×{}", photograph.name, camera.width, camera.height);
        match &photograph.image {
            None => say_line!("  geometry only"),
            Some(image) => {
                let largest = (0..image.height())
                    .flat_map(|y| (0..image.width()).filter_map(move |x| image.radiance(x, y)))
                    .flatten()
                    .fold(0.0, f32::max);
                image.release();
                say!(
                    "  radiance up to {largest:.4}, {} invalid or saturated pixels",
                    image.invalid_count()
                );
                match image.masked_count() {
                    0 => say_line!(),
                    count => say_line!(
                        ", {count} masked ({:.1} %)",
                        100.0 * count as f64 / (image.width() * image.height()) as f64
                    ),
                }
            }
        }
    }

    say_line!("materials: {}", capture.materials.len());
    for material in &capture.materials {
        let surfaces: Vec<&str> =
            material.surfaces.iter().map(|&s| capture.surfaces[s].name.as_str()).collect();
        let kind = match material.kind {
            MaterialKind::Diffuse => "diffuse",
            MaterialKind::Specular => "specular",
        };
        let textured = if material.textured { ", textured" } else { "" };
        let mut known = String::new();
        if let Some([r, g, b]) = material.known_diffuse {
            known = format!(", known diffuse {r} {g} {b}");
        }
        if let Some([r, g, b]) = material.known_diffuse_sd {
            known += &format!(" (standard deviation {r} {g} {b})");
        }
        say_line!("  {}  {kind}{textured}{known}: {}", material.name, surfaces.join(", "));
    }
    let untagged: Vec<&str> = capture
        .surfaces
        .iter()
        .filter(|surface| surface.role == Role::Untagged)
        .map(|surface| surface.name.as_str())
        .collect();
    if !untagged.is_empty() {
        say_line!("surfaces without a material: {}", untagged.join(", "));
    }
    if !capture.lights.is_empty() {
        say_line!("known lights: {}", capture.lights.len());
    }
    for light in &capture.lights {
        match light {
            KnownLight::Visible { name, surfaces } => {
                let surfaces: Vec<&str> =
                    surfaces.iter().map(|&s| capture.surfaces[s].name.as_str()).collect();
                say_line!("  {name}  visible: {}", surfaces.join(", "));
            }
            KnownLight::Shape { name, emitter, emission, color } => {
                say_line!("  {name}  {}, {}", place(emitter), strength(emitter, *emission, *color));
            }
            KnownLight::Dome { name, dome } => {
                let (width, height) = (dome.image.width(), dome.image.height());
                let turn = match dome.turn {
                    0.0 => String::new(),
                    turn => format!(", turned by {:.1}°", turn.to_degrees()),
                };
                say_line!("  {name}  dome, {width}×{height} pixels, scale {}{turn}", dome.scale);
            }
        }
    }
}

/// Where a light is and which way it shines.
fn place(emitter: &Emitter) -> String {
    let at = |v: Vec3| format!("{} {} {}", v.x, v.y, v.z);
    // Adding 0 turns -0 into 0.
    let along = |v: Vec3| format!("{:.3} {:.3} {:.3}", v.x + 0.0, v.y + 0.0, v.z + 0.0);
    let kind = emitter.kind();
    match emitter {
        Emitter::Rectangle { corners, normal } => {
            let corners = corners.map(at).join(", ");
            format!("{kind} with the corners {corners}, facing {}", along(*normal))
        }
        Emitter::Sphere { center, radius_m } => {
            format!("{kind} at {}, radius {radius_m} m", at(*center))
        }
        Emitter::Point { position } => format!("{kind} at {}", at(*position)),
        Emitter::Spot { position, direction, inner_angle, outer_angle } => format!(
            "{kind} at {} along {}, full within {:.1}°, dark beyond {:.1}°",
            at(*position),
            along(*direction),
            inner_angle.to_degrees(),
            outer_angle.to_degrees()
        ),
        Emitter::Sun { direction, angular_diameter } => format!(
            "{kind} along {}, diameter {:.2}°",
            along(*direction),
            angular_diameter.to_degrees()
        ),
    }
}

fn strength(emitter: &Emitter, emission: Option<Rgb>, color: Option<Rgb>) -> String {
    let quantity = emitter.quantity();
    match (emission, color) {
        (Some([r, g, b]), _) => format!("{quantity} {r} {g} {b}"),
        (None, Some([r, g, b])) => format!("{quantity} unknown in the ratio {r} {g} {b}"),
        (None, None) => format!("{quantity} unknown"),
    }
}
