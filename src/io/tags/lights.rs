//! The lights of `tags.json`.

use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;

use super::Reader;
use crate::io::error::listed;
use crate::io::json::Field;
use crate::io::{Error, Fault, picture};
use crate::math::rgb::Rgb;
use crate::scene::{Dome, Emitter, Image, KnownLight, Role};

/// Coordinates beyond it, in metres, are no part of a scene: their squares would soon leave the
/// range of single precision.
const FARTHEST_M: f64 = 1e9;
/// How far a corner may lie off the plane of a rectangle, of its longest extent: corners are
/// measured by hand.
const OFF_PLANE: f64 = 0.01;
/// The cosine of 5°, by which a rectangle's normal may differ from that of its corners.
const NORMAL_COSINE: f64 = 0.9962;

type Shape = fn(&Field) -> Result<Emitter, Error>;

/// The kinds of light outside the photographs that have a place.
const SHAPES: [(&str, Shape); 5] = [
    ("rectangle", rectangle),
    ("sphere", |item| {
        let center = position(&item.need("center")?)?.as_vec3();
        Ok(Emitter::Sphere { center, radius_m: length(item, "radius_m")? })
    }),
    ("point", |item| Ok(Emitter::Point { position: position(&item.need("position")?)?.as_vec3() })),
    ("spot", spot),
    ("sun", sun),
];

/// The emitter of a light with a place; `None` where the kind is another.
pub(in crate::io) fn emitter(item: &Field, kind: &str) -> Option<Result<Emitter, Error>> {
    SHAPES.iter().find(|(known, _)| *known == kind).map(|(_, shape)| shape(item))
}

/// The kinds of light with a place.
pub(in crate::io) fn emitter_kinds() -> impl Iterator<Item = &'static str> {
    SHAPES.iter().map(|(kind, _)| *kind)
}

impl Reader<'_> {
    pub(super) fn light(&mut self, item: &Field, index: usize) -> Result<KnownLight, Error> {
        let name = match item.get("name") {
            Some(field) => field.text()?.to_owned(),
            None => format!("light {}", index + 1),
        };
        let kind_field = item.need("kind")?;
        let kind = kind_field.text()?;
        if let Some(emitter) = emitter(item, kind) {
            return known_shape(item, name, emitter?);
        }
        let light = match kind {
            "visible" => KnownLight::Visible { name, surfaces: self.luminaire(item, index)? },
            "dome" => KnownLight::Dome { name, dome: self.dome(item)? },
            _ => {
                let kinds: Vec<&str> =
                    ["visible"].into_iter().chain(emitter_kinds()).chain(["dome"]).collect();
                return Err(kind_field.wrong(&format!(
                    "\"{kind}\" is no kind of light; the choices are {}",
                    listed(kinds.into_iter())
                )));
            }
        };
        match item.get("color") {
            Some(field) => Err(field.wrong_with(
                &format!("the color of a {kind} light is read from images"),
                "Leave the color out: it is for lights whose strength is unknown",
            )),
            None => Ok(light),
        }
    }

    fn luminaire(&mut self, item: &Field, index: usize) -> Result<Vec<usize>, Error> {
        let field = item.need("surfaces")?;
        let surfaces = self.claim(&field, Role::Luminaire(index))?;
        if surfaces.is_empty() {
            return Err(field.wrong_with(
                "the mesh has none of the surfaces of this visible light",
                "Name at least one usemtl group of the mesh, or remove the light",
            ));
        }
        Ok(surfaces)
    }

    fn dome(&mut self, item: &Field) -> Result<Dome, Error> {
        let file = image_file(&item.need("image")?)?;
        dome(item, file, &mut self.warnings)
    }
}

/// The sky of an image, with what is odd about it.
pub(in crate::io) fn dome(
    item: &Field,
    file: PathBuf,
    warnings: &mut Vec<String>,
) -> Result<Dome, Error> {
    let field = item.need("image")?;
    let scale = item.get("scale").map_or(Ok(1.0), |_| positive(item, "scale"))? as f32;
    let picture = picture::read(&file).map_err(|error| unusable(&field, error))?;
    warnings.extend(picture.notes);
    let (width, height) = (picture.width, picture.height);
    let image = Image::new(width, height, picture.pixels, None);
    let mut warn = |problem: String| {
        warnings.push(format!("{}, {}: {problem}", field.file.display(), field.path));
    };
    if width != 2 * height {
        warn(format!(
            "the image has {width} x {height} pixels, but a sky in latitude and longitude is \
             twice as wide as high. It is stretched over the whole sphere."
        ));
    }
    if image.invalid_count() > 0 {
        warn(format!(
            "{} of the {} pixels are negative or not finite. They count as black.",
            image.invalid_count(),
            width * height
        ));
    }
    let turn = item.get("turn").map_or(Ok(0.0), |field| field.number())?;
    let turn = turn.rem_euclid(std::f64::consts::TAU) as f32;
    Ok(Dome { file, image: Arc::new(image), scale, turn })
}

/// A file of the folder that the JSON file is in: a tag file from elsewhere must not have others opened.
fn image_file(field: &Field) -> Result<PathBuf, Error> {
    let name = field.text()?.replace('\\', "/");
    let is_inside = |part| matches!(part, Component::Normal(_) | Component::CurDir);
    if !Path::new(&name).components().all(is_inside) {
        return Err(field.wrong_with(
            &format!("\"{name}\" does not lie in the folder of this file"),
            "Put the image there, and give its path from there without \"..\"",
        ));
    }
    let file = field.file.parent().unwrap_or(Path::new("")).join(&name);
    if !file.is_file() {
        return Err(Error::Missing(Fault::new(
            field.file,
            field.path.clone(),
            format!("there is no image \"{name}\" in the folder of this file"),
            "Put it there, or correct its path, which is relative to that folder",
        )));
    }
    Ok(file)
}

/// The fault of an image, as one of the field that names it. What to do about a photograph is
/// not what to do about a sky.
fn unusable(field: &Field, error: Error) -> Error {
    let (file, problem) = match error {
        Error::Read { file, source } => (file, source.to_string()),
        Error::Missing(fault)
        | Error::Invalid(fault)
        | Error::Unsupported(fault)
        | Error::TooLarge(fault) => (fault.file, fault.problem),
        other => return other,
    };
    field.wrong_with(
        &format!("{} cannot be used: {problem}", file.display()),
        "Give a sky in latitude and longitude as OpenEXR or Radiance .hdr",
    )
}

/// A light of that shape with what is said of its strength.
fn known_shape(item: &Field, name: String, emitter: Emitter) -> Result<KnownLight, Error> {
    let quantity = emitter.quantity();
    for other in ["radiance", "intensity", "irradiance"] {
        // Passed over, a misnamed strength would make a known light an unknown one.
        if let Some(field) = item.get(other).filter(|_| other != quantity) {
            return Err(field.wrong_with(
                &format!("the strength of a {} is its {quantity}", emitter.kind()),
                &format!("Give \"{quantity}\", or null there to have it solved for"),
            ));
        }
    }
    let emission = item.get(quantity).map(|field| not_negative(&field)).transpose()?;
    let color = match (item.get("color"), &emission) {
        (None, _) => None,
        (Some(field), Some(_)) => {
            return Err(field.wrong_with(
                &format!("the {quantity} of this light is known, and its color with it"),
                &format!(
                    "Leave one out: a color is the ratio of the channels of an unknown {quantity}"
                ),
            ));
        }
        (Some(field), None) => {
            let color = not_negative(&field)?;
            if color == [0.0; 3] {
                return Err(field.wrong("a color must not be black"));
            }
            Some(color)
        }
    };
    Ok(KnownLight::Shape { name, emitter, emission, color })
}

fn rectangle(item: &Field) -> Result<Emitter, Error> {
    let field = item.need("corners")?;
    let items = field.items()?;
    if items.len() != 4 {
        return Err(field.wrong("a rectangle has four corners"));
    }
    let mut corners = [DVec3::ZERO; 4];
    for (corner, item) in corners.iter_mut().zip(&items) {
        *corner = position(item)?;
    }
    let normal = plane_normal(&field, corners)?;
    let wanted = direction(item, "normal")?;
    let cosine = normal.dot(wanted);
    if cosine.abs() < NORMAL_COSINE {
        return Err(item.need("normal")?.wrong_with(
            &format!(
                "the normal is {:.0} degrees off that of the corners",
                cosine.abs().acos().to_degrees()
            ),
            "Correct the normal, or the corner that is out of place",
        ));
    }
    Ok(Emitter::Rectangle {
        corners: corners.map(|corner| corner.as_vec3()),
        normal: (normal * cosine.signum()).as_vec3(),
    })
}

/// The unit normal of four corners, which must lie in one plane in order around an edge that
/// does not cross itself.
fn plane_normal(field: &Field, corners: [DVec3; 4]) -> Result<DVec3, Error> {
    const ORDER: &str = "List the four corners in order around the edge, in metres";
    let [a, b, c, d] = corners;
    let extent = (a - c).length().max((b - d).length());
    // Twice the area, even where the four are not quite in one plane.
    let area = (c - a).cross(d - b);
    if area.length() <= 1e-6 * extent * extent {
        return Err(field.wrong_with("the corners enclose no area", ORDER));
    }
    let normal = area.normalize_or_zero();
    let middle = 0.25 * (a + b + c + d);
    let off_plane =
        corners.iter().map(|corner| (corner - middle).dot(normal).abs()).fold(0.0, f64::max);
    if off_plane > OFF_PLANE * extent {
        return Err(field.wrong_with(
            &format!("the corners do not lie in one plane: they are {off_plane:.3} m off it"),
            "Correct them, or make two lights of them",
        ));
    }
    // An edge that crosses itself turns twice to either side.
    let turns_back = (0..4).filter(|&k| {
        let [from, at, to] = [corners[k], corners[(k + 1) % 4], corners[(k + 2) % 4]];
        (at - from).cross(to - at).dot(normal) < 0.0
    });
    if turns_back.count() > 1 {
        return Err(field.wrong_with("the edges of the rectangle cross", ORDER));
    }
    Ok(normal)
}

fn spot(item: &Field) -> Result<Emitter, Error> {
    let position = position(&item.need("position")?)?.as_vec3();
    let direction = direction(item, "direction")?.as_vec3();
    let outer_angle = angle(item, "outer_angle")?;
    let inner = item.need("inner_angle")?;
    let inner_angle = inner.number()? as f32;
    if !(0.0..=outer_angle).contains(&inner_angle) {
        return Err(inner.wrong("the inner angle lies between 0 and the outer one"));
    }
    Ok(Emitter::Spot { position, direction, inner_angle, outer_angle })
}

/// A sun by its direction, or by a point that casts a shadow and the place of the shadow, which
/// a photograph of a stick shows better than any compass.
fn sun(item: &Field) -> Result<Emitter, Error> {
    let direction = match item.get("point").or_else(|| item.get("shadow")) {
        None => direction(item, "direction")?,
        Some(field) if item.get("direction").is_some() => {
            return Err(field.wrong_with(
                "the direction of this sun is given already",
                "Leave out either direction, or point and shadow",
            ));
        }
        Some(_) => {
            let shadow = item.need("shadow")?;
            let towards = position(&shadow)? - position(&item.need("point")?)?;
            unit(towards).ok_or_else(|| {
                shadow.wrong("the shadow must not fall on the point that casts it")
            })?
        }
    };
    let angular_diameter = match item.get("angular_diameter") {
        Some(_) => angle(item, "angular_diameter")?,
        None => Emitter::SUN_DIAMETER,
    };
    Ok(Emitter::Sun { direction: direction.as_vec3(), angular_diameter })
}

fn position(field: &Field) -> Result<DVec3, Error> {
    let values = field.numbers::<3>()?;
    if values.iter().any(|value| value.abs() > FARTHEST_M) {
        return Err(field.wrong_with(
            "this lies more than a million kilometres away",
            "Give it in metres, in the coordinates of the geometry",
        ));
    }
    Ok(DVec3::from_array(values))
}

/// A direction, made a unit vector.
fn direction(item: &Field, key: &str) -> Result<DVec3, Error> {
    let field = item.need(key)?;
    let values = DVec3::from_array(field.numbers::<3>()?);
    unit(values).ok_or_else(|| field.wrong("a direction must not be zero"))
}

fn unit(vector: DVec3) -> Option<DVec3> {
    // By its largest component first, so that squares neither overflow nor vanish.
    (vector / vector.abs().max_element()).try_normalize()
}

fn positive(item: &Field, key: &str) -> Result<f64, Error> {
    let field = item.need(key)?;
    let value = field.number()?;
    if value <= 0.0 {
        return Err(field.wrong("this must be positive"));
    }
    Ok(value)
}

fn length(item: &Field, key: &str) -> Result<f32, Error> {
    let value = positive(item, key)?;
    if value > FARTHEST_M {
        return Err(item.need(key)?.wrong("this is more than a million kilometres"));
    }
    Ok(value as f32)
}

fn angle(item: &Field, key: &str) -> Result<f32, Error> {
    let value = positive(item, key)?;
    if value > std::f64::consts::PI {
        return Err(item.need(key)?.wrong("an angle is at most pi (it is in radians)"));
    }
    Ok((value as f32).min(std::f32::consts::PI))
}

pub(in crate::io) fn not_negative(field: &Field) -> Result<Rgb, Error> {
    let values = field.numbers::<3>()?;
    if values.iter().any(|value| *value < 0.0) {
        return Err(field.wrong("light cannot be negative"));
    }
    Ok(values)
}
