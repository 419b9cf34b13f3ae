//! `lobelia info CAPTURE`.

use clap::ArgMatches;

use crate::cli::print::{note_line, say, say_line};
use crate::cli::progress::Display;
use crate::cli::{Ending, arguments, job};
use crate::scene::{Capture, KnownLight, MaterialKind, Role};
use crate::worker::{Command, Happening, Worker};

pub(super) fn run(matches: &ArgMatches) -> Result<(), Ending> {
    let path = arguments::required_path(matches, "capture");
    job::catch_interrupts()?;
    let mut worker = Worker::start(|| ())?;
    let mut display = Display::new(true);
    let happening = job::wait(&mut worker, Command::Load { path }, &mut display)?;
    if let Happening::Loaded(capture) = happening {
        print(&capture);
    }
    Ok(())
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
                say_line!(
                    "  radiance up to {largest:.4}, {} invalid or saturated pixels",
                    image.invalid_count()
                );
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
        let known = match material.known_diffuse {
            Some([r, g, b]) => format!(", known diffuse {r} {g} {b}"),
            None => String::new(),
        };
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
            KnownLight::Shape { name, kind } => say_line!("  {name}  {kind}"),
        }
    }
}
