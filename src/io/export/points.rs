//! Samples and lights as point clouds and tables: `samples.ply`, `samples.csv`, `lights.ply` and
//! `lights.csv`.

use std::io::Write;
use std::path::Path;

use glam::Vec3;

use super::super::table::{self, SampleRow};
use super::super::{Error, atomic};
use super::pictures::percentile;
use super::ply::{Points, write_points};
use crate::math::rgb::{Radiance, srgb_code};
use crate::reconstruct::lights::LightKind;
use crate::render::lights::Light;
use crate::render::model::Model;
use crate::scene::{Capture, KnownLight};

const SAMPLE_FLOATS: [&str; 16] = [
    "x",
    "y",
    "z",
    "nx",
    "ny",
    "nz",
    "observed_r",
    "observed_g",
    "observed_b",
    "computed_r",
    "computed_g",
    "computed_b",
    "relative_error_r",
    "relative_error_g",
    "relative_error_b",
    "weight",
];
const COLOUR: [&str; 3] = ["red", "green", "blue"];

/// The 99th percentile of what was observed is white in the points' colour.
pub fn write_samples(folder: &Path, rows: &[SampleRow]) -> Result<(), Error> {
    table::write_samples(&folder.join("samples.csv"), rows)?;
    let observed: Vec<Radiance> =
        rows.iter().map(|row| row.observed.map(|value| value as f32)).collect();
    let white = percentile(&observed, 0.99).max(f32::MIN_POSITIVE);
    let row = |row: &SampleRow| {
        let numbers = row
            .position
            .iter()
            .chain(&row.normal)
            .chain(&row.observed)
            .chain(&row.computed)
            .chain(&row.relative_error)
            .chain([&row.weight]);
        (numbers.map(|&value| value as f32).collect(), colour(row.observed, white))
    };
    let points = Points {
        comment: "samples of the reconstruction; metres, radiance in the photographs' unit",
        floats: &SAMPLE_FLOATS,
        bytes: &COLOUR,
        rows: rows.iter().map(row).collect(),
    };
    write_points(&folder.join("samples.ply"), &points)
}

fn colour(radiance: [f64; 3], white: f32) -> Vec<u8> {
    radiance.iter().map(|&value| srgb_code(value as f32 / white)).collect()
}

const LIGHT_FLOATS: [&str; 10] =
    ["x", "y", "z", "nx", "ny", "nz", "radius_m", "irradiance_r", "irradiance_g", "irradiance_b"];

/// Lights at infinity stand at three times the scene's radius. The irradiance is that of a surface
/// in the middle of the scene that faces the light, were nothing in the way.
pub fn write_lights(folder: &Path, capture: &Capture, model: &Model) -> Result<(), Error> {
    let lights = &model.recovered;
    let powers: Vec<Radiance> = lights
        .iter()
        .map(|light| light.facing(model.middle).map_or([0.0; 3], |facing| facing.irradiance))
        .collect();
    let white = powers.iter().flatten().copied().fold(f32::MIN_POSITIVE, f32::max);
    let row = |(light, power): (&Light, &Radiance)| {
        let (position, normal) = place(light, model);
        let mut numbers = position.to_array().to_vec();
        numbers.extend(normal.to_array());
        numbers.push(light.shape.radius_m);
        numbers.extend(power);
        (numbers, colour(power.map(f64::from), white))
    };
    let points = Points {
        comment: "recovered lights; metres, irradiance of the middle of the scene",
        floats: &LIGHT_FLOATS,
        bytes: &COLOUR,
        rows: lights.iter().zip(&powers).map(row).collect(),
    };
    write_points(&folder.join("lights.ply"), &points)?;
    atomic::write(&folder.join("lights.csv"), |out| {
        writeln!(
            out,
            "light,kind,name,x_m,y_m,z_m,travels_x,travels_y,travels_z,radius_m,area_m2,\
             solid_angle_sr,lobe,lobe_x,lobe_y,lobe_z,exponent,emission_r,emission_g,emission_b"
        )?;
        for (index, light) in lights.iter().enumerate() {
            let shape = &light.shape;
            let name = match shape.kind {
                LightKind::Known(known) => capture.lights.get(known).map_or("", KnownLight::name),
                _ => "",
            };
            let (kind, name) = (kind(shape.kind), table::quoted(name));
            // A light at infinity has no place, one at a finite distance no solid angle.
            let is_distant = shape.is_distant();
            let (position, normal) = (shape.position.to_array(), shape.normal.to_array());
            let place = if is_distant { ",,".into() } else { listed(&position) };
            let size = if is_distant {
                format!(",,{}", shape.solid_angle_sr())
            } else {
                format!("{},{},", shape.radius_m, shape.area_m2())
            };
            for (number, (lobe, emission)) in light.lobes.iter().enumerate() {
                let travels = listed(&normal);
                let direction = listed(&lobe.direction.to_array());
                let (exponent, emission) = (lobe.exponent, listed(emission));
                writeln!(
                    out,
                    "{index},{kind},{name},{place},{travels},{size},{number},{direction},\
                     {exponent},{emission}"
                )?;
            }
        }
        Ok(())
    })
}

fn listed(values: &[f32; 3]) -> String {
    values.map(|value| value.to_string()).join(",")
}

pub(super) fn kind(kind: LightKind) -> &'static str {
    match kind {
        LightKind::Sphere => "sphere",
        LightKind::Surface => "surface",
        LightKind::Lamp => "lamp",
        LightKind::Sky => "sky",
        LightKind::Sun => "sun",
        LightKind::Known(_) => "known",
    }
}

fn place(light: &Light, model: &Model) -> (Vec3, Vec3) {
    let shape = &light.shape;
    if shape.is_distant() {
        (model.middle - 3.0 * model.radius_m * shape.normal, shape.normal)
    } else {
        (shape.position, shape.normal)
    }
}
