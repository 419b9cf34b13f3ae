//! `edits.json`: the changes to a recovered scene.

mod unread;
mod write;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DAffine3, DMat4, DVec4, Vec3};

use serde_json::Value;

use super::error::listed;
use super::json::{self, Field};
use super::paths::absolute;
use super::tags::lights::{dome, emitter, emitter_kinds, not_negative};
use super::{Error, Fault, mesh};
use crate::geometry::mesh::Mesh;
use crate::geometry::solid::Solid;
use crate::math::rgb::Rgb;
use crate::render::edits::{AddedLight, Edits, GREY, Object, Override, Shape, Surroundings};
use crate::scene::Brdf;
use crate::scene::Capture;

pub use unread::{Place, StoredEdits, Unread, stored_value};
pub(in crate::io) use write::{emitter_value, short};
pub use write::{value, write};

/// Reads edits and the files that they name, whose paths are relative to the folder of this one;
/// with what is odd about them.
pub fn read(file: &Path, capture: &Capture) -> Result<(Edits, Vec<String>), Error> {
    of_value(file, &json::read(file)?, capture)
}

/// The same of what a file holds among other things.
pub fn of_value(
    file: &Path,
    value: &Value,
    capture: &Capture,
) -> Result<(Edits, Vec<String>), Error> {
    let Parts { edits, unread, warnings } = parts(file, value, capture)?;
    match unread.into_iter().find_map(|(_, error)| error) {
        Some(error) => Err(error),
        None => Ok((edits, warnings)),
    }
}

/// The same as far as they can be read; what cannot be is kept. Only where the outermost form is
/// damaged nothing is read.
pub fn stored(file: &Path, value: &Value, capture: &Capture) -> Result<StoredEdits, Error> {
    let Parts { edits, unread, warnings } = parts(file, value, capture)?;
    let unread = unread.into_iter().map(|(part, _)| part).collect();
    Ok(StoredEdits { edits, unread, warnings })
}

/// What was read of edits, and what was not, with the reason.
#[derive(Default)]
struct Parts {
    edits: Edits,
    unread: Vec<(Unread, Option<Error>)>,
    warnings: Vec<String>,
}

impl Parts {
    /// What was read of a part; where that failed, it is noted.
    fn keep<T>(&mut self, place: Place, field: &Field, read: Result<T, Error>) -> Option<T> {
        match read {
            Ok(read) => Some(read),
            Err(error) => {
                self.unread.push((Unread::new(place, field, Some(&error)), Some(error)));
                None
            }
        }
    }
}

/// The members of edits that are known.
const MEMBERS: [&str; 6] = [
    "original_light",
    "original_light_groups",
    "lights",
    "objects",
    "materials",
    "surroundings_albedo",
];

fn parts(file: &Path, value: &Value, capture: &Capture) -> Result<Parts, Error> {
    let root = Field::root(file, value)?;
    let mut parts = Parts::default();
    let member = |key: &str| Place::Member(key.to_owned());
    if let Some(field) = root.get("original_light")
        && let Some(value) = parts.keep(member("original_light"), &field, at_least_0(&field))
    {
        parts.edits.original_light = value;
    }
    if let Some(field) = root.get("original_light_groups") {
        let Some(members) = field.value.as_object() else {
            return Err(field.wrong("this must hold one factor per group of the recovered light"));
        };
        for name in members.keys() {
            if let Some(factor) = field.get(name) {
                let place = Place::Within("original_light_groups", name.clone());
                let value = parts.keep(place, &factor, at_least_0(&factor));
                parts.edits.groups.extend(value.map(|value| (name.clone(), value)));
            }
        }
    }
    for (index, item) in items(&root, "lights")?.iter().enumerate() {
        let read = light(item, index, &mut parts.warnings);
        let light = parts.keep(Place::Light, item, read);
        parts.edits.lights.extend(light);
    }
    for (index, item) in items(&root, "objects")?.iter().enumerate() {
        let read = object(item, index, &mut parts.warnings);
        let object = parts.keep(Place::Object, item, read);
        parts.edits.objects.extend(object);
    }
    if let Some(field) = root.get("materials") {
        overrides(&field, capture, &mut parts)?;
    }
    // `null` is a word here: no surroundings.
    match root.value.get("surroundings_albedo") {
        None => {}
        Some(serde_json::Value::Null) => parts.edits.surroundings = Surroundings::Open,
        Some(_) => {
            let field = root.need("surroundings_albedo")?;
            let read = field.number().and_then(|albedo| part(&field, albedo));
            if let Some(albedo) = parts.keep(member("surroundings_albedo"), &field, read) {
                parts.edits.surroundings = Surroundings::Albedo(albedo);
            }
        }
    }
    for key in root.value.as_object().into_iter().flat_map(|members| members.keys()) {
        if let Some(field) = root.get(key).filter(|_| !MEMBERS.contains(&key.as_str())) {
            parts.unread.push((Unread::new(member(key), &field, None), None));
        }
    }
    Ok(parts)
}

fn items<'a>(root: &Field<'a>, key: &str) -> Result<Vec<Field<'a>>, Error> {
    root.get(key).map_or(Ok(Vec::new()), |field| field.items())
}

fn light(item: &Field, index: usize, warnings: &mut Vec<String>) -> Result<AddedLight, Error> {
    let name = match item.get("name") {
        Some(field) => field.text()?.to_owned(),
        None => format!("light {}", index + 1),
    };
    let is_on = match item.get("on") {
        Some(field) => {
            field.value.as_bool().ok_or_else(|| field.wrong("this must be true or false"))?
        }
        None => true,
    };
    let kind = item.need("kind")?;
    if kind.text()? == "dome" {
        let file = named_file(&item.need("image")?, "image")?;
        let dome = dome(item, file, warnings)?;
        return Ok(AddedLight { name, shape: Shape::Dome(dome), emission: [1.0; 3], is_on });
    }
    let Some(emitter) = emitter(item, kind.text()?) else {
        let kinds: Vec<&str> = emitter_kinds().chain(["dome"]).collect();
        return Err(kind.wrong(&format!(
            "\"{}\" is no kind of added light; the choices are {}",
            kind.text()?,
            listed(kinds.into_iter())
        )));
    };
    let emitter = emitter?;
    let field = item.need(emitter.quantity())?;
    let emission = not_negative(&field)?;
    if emission.iter().any(|&value| value > BRIGHTEST) {
        return Err(too_bright(&field));
    }
    Ok(AddedLight { name, shape: Shape::Emitter(emitter), emission, is_on })
}

fn object(item: &Field, index: usize, warnings: &mut Vec<String>) -> Result<Object, Error> {
    let file = named_file(&item.need("mesh")?, "mesh")?;
    let name = match item.get("name") {
        Some(field) => field.text()?.to_owned(),
        None => format!("object {}", index + 1),
    };
    let geometry = mesh::load(&file)?;
    warnings.extend(geometry.warnings);
    let world_from_object = match item.get("world_from_object") {
        Some(field) => placement(&geometry.mesh, &field)?,
        None => DAffine3::IDENTITY,
    };
    let given = item.get("materials");
    let materials = given.as_ref().and_then(|field| field.value.as_object());
    if let (Some(field), None) = (&given, materials) {
        return Err(field.wrong("this must hold one object {…} per material of the mesh"));
    }
    let known = || geometry.surfaces.iter().map(|surface| surface.name.as_str());
    for name in materials.iter().flat_map(|materials| materials.keys()) {
        if !known().any(|surface| surface == name) {
            let field = given.as_ref().unwrap_or(item);
            return Err(field.wrong_with(
                &format!("{} has no material \"{name}\"", file.display()),
                &format!("It has {}", listed(known())),
            ));
        }
    }
    let mut surfaces = Vec::new();
    for surface in &geometry.surfaces {
        let field = given.as_ref().and_then(|field| field.get(&surface.name));
        let change = field.as_ref().map(change).transpose()?;
        let Some(change) = change else {
            let own = geometry.reflectances.get(&surface.name).copied();
            surfaces.push((surface.name.clone(), own.unwrap_or_else(|| {
                warnings.push(format!(
                    "{}, {}: nothing is said of the material \"{}\"; it is a diffuse grey of {GREY}",
                    item.file.display(),
                    item.path,
                    surface.name
                ));
                Brdf::diffuse([GREY; 3])
            })));
            continue;
        };
        let reflectance = Brdf::phong(
            change.diffuse.unwrap_or([GREY; 3]),
            change.specular.unwrap_or_default(),
            change.exponent.unwrap_or(1.0),
        );
        surfaces.push((surface.name.clone(), reflectance));
    }
    if given.is_none() {
        warnings.extend(geometry.image_notes);
    }
    let mesh = Arc::new(Solid::from(geometry.mesh));
    Ok(Object { name, file, mesh, surfaces, world_from_object })
}

/// The file that a field names, relative to the folder of the field's own file.
pub(in crate::io) fn named_file(field: &Field, what: &str) -> Result<PathBuf, Error> {
    let folder = field.file.parent().unwrap_or(Path::new(""));
    let name = field.text()?.replace('\\', "/");
    let file = folder.join(&name);
    if file.is_file() {
        return Ok(absolute(&file));
    }
    Err(Error::Missing(Fault::new(
        field.file,
        field.path.clone(),
        format!("there is no {what} \"{name}\""),
        "Correct its path, which is relative to the folder of this file",
    )))
}

/// A matrix of four rows that places a mesh.
fn placement(mesh: &Mesh, field: &Field) -> Result<DAffine3, Error> {
    let rows = field.items()?;
    if rows.len() != 4 {
        return Err(field.wrong("a matrix has four rows of four numbers"));
    }
    let mut matrix = [DVec4::ZERO; 4];
    for (row, item) in matrix.iter_mut().zip(&rows) {
        *row = DVec4::from_array(item.numbers::<4>()?);
    }
    if matrix[3] != DVec4::W {
        return Err(field.wrong("the last row of a placement is 0 0 0 1"));
    }
    let world_from_object =
        DMat4::from_cols_array_2d(&matrix.map(|row| row.to_array())).transpose();
    let world_from_object = DAffine3::from_mat4(world_from_object);
    if is_flat(&world_from_object) {
        return Err(field.wrong_with(
            "the matrix makes the object flat: it is singular",
            "Give a rotation with a scale that is not 0 along any axis",
        ));
    }
    let is_in_range = |position: &Vec3| {
        world_from_object.transform_point3(position.as_dvec3()).as_vec3().is_finite()
    };
    if !mesh.positions.iter().all(is_in_range) {
        return Err(field.wrong("the matrix moves the object out of all range"));
    }
    Ok(world_from_object)
}

/// Whether a placement leaves nothing of some direction.
fn is_flat(world_from_object: &DAffine3) -> bool {
    let linear = world_from_object.matrix3;
    let size = linear.x_axis.length().max(linear.y_axis.length()).max(linear.z_axis.length());
    linear.determinant().abs() <= 1e-9 * size.powi(3)
}

fn overrides(field: &Field, capture: &Capture, parts: &mut Parts) -> Result<(), Error> {
    let Some(members) = field.value.as_object() else {
        return Err(field.wrong("this must hold one object {…} per material"));
    };
    let known = || capture.materials.iter().map(|material| material.name.as_str());
    for name in members.keys() {
        let Some(item) = field.get(name) else { continue };
        let read = if known().any(|material| material == name) {
            change(&item)
        } else {
            Err(field.wrong_with(
                &format!("the capture has no material \"{name}\""),
                &format!("It has {}", listed(known())),
            ))
        };
        let change = parts.keep(Place::Within("materials", name.clone()), &item, read);
        parts.edits.materials.extend(change.map(|change| (name.clone(), change)));
    }
    Ok(())
}

fn change(item: &Field) -> Result<Override, Error> {
    let colour = |key: &str| -> Result<Option<Rgb>, Error> {
        let Some(field) = item.get(key) else { return Ok(None) };
        let values = field.numbers::<3>()?;
        for value in values {
            part(&field, value)?;
        }
        Ok(Some(values))
    };
    let exponent = match item.get("exponent") {
        None => None,
        Some(field) => Some(match field.number()? {
            n if (0.0..=1e6).contains(&n) => n,
            _ => return Err(field.wrong("an exponent lies between 0 and 1000000")),
        }),
    };
    let change = Override { diffuse: colour("diffuse")?, specular: colour("specular")?, exponent };
    if let (Some(diffuse), Some(specular)) = (change.diffuse, change.specular)
        && diffuse.iter().zip(specular).any(|(d, s)| d + s > 1.0 + 1e-9)
    {
        return Err(item.wrong_with(
            "diffuse and specular reflectance together are more than 1",
            "Lower one: a surface reflects no more light than falls on it",
        ));
    }
    Ok(change)
}

/// Squared distances and many reflections are still within single precision.
const BRIGHTEST: f64 = 1e20;

fn too_bright(field: &Field) -> Error {
    field.wrong_with("this is brighter than pictures can hold", "Give it in the capture's unit")
}

fn at_least_0(field: &Field) -> Result<f64, Error> {
    let value = field.number()?;
    if value < 0.0 {
        return Err(field.wrong("light cannot be negative"));
    }
    if value > BRIGHTEST {
        return Err(too_bright(field));
    }
    Ok(value)
}

fn part(field: &Field, value: f64) -> Result<f64, Error> {
    if !(0.0..=1.0).contains(&value) {
        return Err(field.wrong("a reflectance lies between 0 and 1"));
    }
    Ok(value)
}
