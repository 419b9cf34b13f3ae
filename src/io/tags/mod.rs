//! `tags.json`: statements of the user about surfaces, lights and photographs.

pub mod charts;
pub(in crate::io) mod lights;
pub mod pin;
mod stored;

use std::collections::{HashMap, HashSet};
use std::path::Path;

use glam::{DMat3, DVec3};

pub use self::charts::{ChartTag, StoredCharts, chart_values, stored_charts};
pub use self::stored::{StoredLights, light_values, stored_lights};
use super::error::{listed, suggestion};
use super::json::{self, Field};
use super::{Error, Fault};
use crate::math::rgb::Rgb;
use crate::scene::{Environment, KnownLight, Material, MaterialKind, Role, Surface};

/// The tags, resolved against the surfaces of a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tags {
    pub materials: Vec<Material>,
    pub lights: Vec<KnownLight>,
    /// Cards of known reflectance, to be laid onto the surfaces behind them.
    pub charts: Vec<ChartTag>,
    pub environment: Environment,
    /// Pixels at or above it are no measurements.
    pub saturation: Option<f32>,
    /// By which the radiance of every pixel is multiplied, what is a measurement being settled
    /// before: to linear Rec. 709, as a chart told it.
    pub color_matrix: Option<DMat3>,
    pub warnings: Vec<String>,
}

/// Reads the tags and sets the role of each surface. A surface name that the mesh does not have
/// is left out with a warning, and so is a material that is left without surfaces; it is an
/// error only when no material is left.
pub fn read(file: &Path, surfaces: &mut [Surface]) -> Result<Tags, Error> {
    let value = json::read(file)?;
    let root = Field::root(file, &value)?;
    let mut tags = Tags {
        environment: environment(&root)?,
        saturation: saturation(&root)?,
        color_matrix: color_matrix(&root)?,
        ..Default::default()
    };
    let mut reader =
        Reader { surfaces, owners: HashMap::new(), absent: Vec::new(), warnings: Vec::new() };
    if let Some(field) = root.get("lights") {
        for item in field.items()? {
            let index = tags.lights.len();
            tags.lights.push(reader.light(&item, index)?);
        }
    }
    let described = root.get("materials").map_or(Ok(Vec::new()), |field| field.items())?;
    let mut names = HashSet::new();
    for item in &described {
        if let Some(material) = reader.material(item, &mut names, tags.materials.len())? {
            tags.materials.push(material);
        }
    }
    if tags.materials.is_empty()
        && let Some(absent) = reader.absent.first()
    {
        return Err(Error::Invalid(Fault::new(
            file,
            absent.0.clone(),
            absent.1.clone(),
            "No material is left: correct the surface names in this file",
        )));
    }
    if tags.materials.is_empty() {
        return Err(Error::Invalid(Fault::new(
            file,
            "materials",
            "no material is listed",
            "List the materials, or remove the file: then every usemtl group is one material",
        )));
    }
    if let Some(field) = root.get("charts") {
        for item in field.items()? {
            let chart = charts::read(&item)?;
            if chart.views.is_empty() {
                return Err(item.need("views")?.wrong_with(
                    "no photograph is listed",
                    "Give one photograph or more, each with the four corners",
                ));
            }
            let is_taken = !names.insert(chart.name.clone())
                || reader.surfaces.iter().any(|surface| surface.name == chart.name);
            if is_taken {
                return Err(item.wrong_with(
                    &format!("the name \"{}\" is that of a material or surface", chart.name),
                    "Give the chart a name of its own: it becomes a surface and a material",
                ));
            }
            tags.charts.push(chart);
        }
    }
    tags.warnings.append(&mut reader.warnings);
    for (place, problem) in &reader.absent {
        tags.warnings.push(format!("{}, {place}: {problem}. It is left out.", file.display()));
    }
    let untagged: Vec<&str> = surfaces
        .iter()
        .filter(|surface| surface.role == Role::Untagged)
        .map(|surface| surface.name.as_str())
        .collect();
    if !untagged.is_empty() {
        tags.warnings.push(format!(
            "{}: no material or light names {} {}: no reflectance is estimated there.",
            file.display(),
            if untagged.len() == 1 { "the surface" } else { "the surfaces" },
            listed(untagged.into_iter()),
        ));
    }
    Ok(tags)
}

/// Without tags every surface is a material of its own name.
pub fn from_surfaces(surfaces: &mut [Surface], specular: &[bool]) -> Tags {
    let mut tags = Tags::default();
    for (index, surface) in surfaces.iter_mut().enumerate() {
        surface.role = Role::Material(index);
        let is_specular = specular.get(index).copied().unwrap_or(false);
        tags.materials.push(Material {
            name: surface.name.clone(),
            kind: if is_specular { MaterialKind::Specular } else { MaterialKind::Diffuse },
            surfaces: vec![index],
            textured: false,
            known_diffuse: None,
            known_diffuse_sd: None,
        });
    }
    tags
}

fn environment(root: &Field) -> Result<Environment, Error> {
    let Some(field) = root.get("environment") else { return Ok(Environment::Auto) };
    let text = field.text()?;
    environment_of(text).ok_or_else(|| {
        field.wrong(&format!(
            "\"{text}\" is no light model; the choices are \"room\", \"open\" and \"auto\""
        ))
    })
}

/// The environment of that name.
pub(in crate::io) fn environment_of(name: &str) -> Option<Environment> {
    Environment::ALL.into_iter().find(|own| own.name() == name)
}

fn saturation(root: &Field) -> Result<Option<f32>, Error> {
    let Some(field) = root.get("saturation") else { return Ok(None) };
    let level = field.number()?;
    if level <= 0.0 {
        return Err(field.wrong_with(
            "the saturation level must be positive",
            "Give the pixel value at which the sensor clips, or leave the field out",
        ));
    }
    Ok(Some(level as f32))
}

/// Three rows of three numbers.
fn color_matrix(root: &Field) -> Result<Option<DMat3>, Error> {
    let Some(field) = root.get("color_matrix") else { return Ok(None) };
    let rows = field.items()?;
    let [x, y, z] = rows.as_slice() else {
        return Err(field.wrong("a colour matrix has three rows of three numbers"));
    };
    let row = |row: &Field| row.numbers::<3>().map(DVec3::from_array);
    let matrix = DMat3::from_cols(row(x)?, row(y)?, row(z)?).transpose();
    if !matrix.is_finite() || !matrix.inverse().is_finite() {
        return Err(field.wrong_with(
            "this matrix makes different colours the same",
            "Have it found again with lobelia chart --matrix, or leave the field out",
        ));
    }
    Ok(Some(matrix))
}

struct Reader<'a> {
    surfaces: &'a mut [Surface],
    /// Which material or light took each surface, by the path of its mention.
    owners: HashMap<usize, String>,
    /// Mentions of surfaces that the mesh does not have: path and problem.
    absent: Vec<(String, String)>,
    /// What else was read with reservations.
    warnings: Vec<String>,
}

impl Reader<'_> {
    fn material(
        &mut self,
        item: &Field,
        names: &mut HashSet<String>,
        index: usize,
    ) -> Result<Option<Material>, Error> {
        let name_field = item.need("name")?;
        let name = name_field.text()?.to_owned();
        if name.is_empty() || !names.insert(name.clone()) {
            return Err(name_field.wrong_with(
                &format!("the name \"{name}\" is empty or taken by another material"),
                "Give every material a name of its own",
            ));
        }
        let kind = match item.get("kind") {
            None => MaterialKind::Diffuse,
            Some(field) => match field.text()? {
                "diffuse" => MaterialKind::Diffuse,
                "specular" => MaterialKind::Specular,
                other => {
                    return Err(field.wrong(&format!(
                        "\"{other}\" is no kind of material; the choices are \"diffuse\" and \
                         \"specular\""
                    )));
                }
            },
        };
        let known_diffuse =
            item.get("known_diffuse").map(|field| reflectance(&field)).transpose()?;
        let known_diffuse_sd = match item.get("known_diffuse_sd") {
            Some(field) if known_diffuse.is_none() => {
                return Err(field.wrong_with(
                    "the deviation of a reflectance is given, but no known_diffuse",
                    "Give known_diffuse as well, or leave both out",
                ));
            }
            field => field.map(|field| deviation(&field)).transpose()?,
        };
        let textured = item.get("textured").map_or(Ok(false), |field| field.truth())?;
        let surfaces = self.claim(&item.need("surfaces")?, Role::Material(index))?;
        Ok((!surfaces.is_empty()).then_some(Material {
            name,
            kind,
            surfaces,
            textured,
            known_diffuse,
            known_diffuse_sd,
        }))
    }

    /// The surfaces of a list, which from now on have that role.
    fn claim(&mut self, field: &Field, role: Role) -> Result<Vec<usize>, Error> {
        let mut claimed = Vec::new();
        for item in field.items()? {
            let name = item.text()?;
            let Some(index) = self.surfaces.iter().position(|surface| surface.name == name) else {
                self.absent.push((item.path.clone(), self.no_surface(name)));
                continue;
            };
            if let Some(owner) = self.owners.insert(index, item.path.clone()) {
                return Err(item.wrong_with(
                    &format!("the surface \"{name}\" is already taken by {owner}"),
                    "Name every surface once, in one material or one visible light",
                ));
            }
            self.surfaces[index].role = role;
            claimed.push(index);
        }
        Ok(claimed)
    }

    fn no_surface(&self, name: &str) -> String {
        let names = self.surfaces.iter().map(|surface| surface.name.as_str());
        let guess = suggestion(name, names.clone())
            .map_or(String::new(), |guess| format!(" (did you mean \"{guess}\"?)"));
        format!("the mesh has no surface \"{name}\", but {}{guess}", listed(names))
    }
}

fn reflectance(field: &Field) -> Result<Rgb, Error> {
    let values = field.numbers::<3>()?;
    if values.iter().any(|value| !(0.0..=1.0).contains(value)) {
        return Err(field.wrong_with(
            "a reflectance lies between 0 and 1",
            "Give linear red, green and blue as fractions, such as 0.18",
        ));
    }
    Ok(values)
}

/// A standard deviation, one for all channels or one for each.
fn deviation(field: &Field) -> Result<Rgb, Error> {
    let values = if field.value.is_array() { field.numbers::<3>()? } else { [field.number()?; 3] };
    if values.iter().any(|value| *value < 0.0) {
        return Err(field.wrong_with(
            "a standard deviation cannot be negative",
            "Give one number or three, 0 or more, in the unit of the reflectance, such as 0.02",
        ));
    }
    Ok(values)
}
