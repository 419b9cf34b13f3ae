//! Project files (`.lobelia`): the tags, options and edits of a capture, as versioned JSON.
//!
//! A project refers to its capture by a path relative to the project's own folder, so that both can
//! be moved together. It contains tags and those options that differ from their defaults. The state
//! of the window is stored with them as JSON that this module does not interpret.

mod masks;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::edits::{self, Unread};
use super::json::{self, Field};
use super::paths::{absolute, relative, tidy};
use super::{Error, Fault, atomic, tags};
use crate::math::rgb::Rgb;
use crate::reconstruct::Options;
use crate::render::edits::Edits;
use crate::scene::{Capture, Environment, KnownLight, Material, MaterialKind, Role};

pub use masks::{Masks, put_masks};
use masks::{StoredMask, stored_masks};

/// The version that is written; older ones are read, too.
pub const VERSION: u64 = 5;
/// The extension of project files.
pub const EXTENSION: &str = "lobelia";

/// A project as it is in its file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ProjectFile {
    /// Absolute.
    pub capture: PathBuf,
    /// The file that this is an unsaved state of; only in files for recovery.
    pub original: Option<PathBuf>,
    pub tags: Vec<Tag>,
    /// Known lights in the form of `tags.json`, the files that they name absolute; `None` for
    /// those of the capture's own tags.
    pub lights: Option<Vec<Value>>,
    /// `None` for that of the capture's own tags.
    pub environment: Option<Environment>,
    /// Charts in the form of `tags.json`, the files that they name absolute; `None` for those of the
    /// capture's own tags.
    pub charts: Option<Vec<Value>>,
    pub options: Options,
    pub relight: Relight,
    /// What is left out of photographs.
    pub masks: Masks,
    /// The folder that the results were exported to, absolute.
    pub solution: Option<PathBuf>,
    /// The folder beside the project with the results of its last run, absolute.
    pub results: Option<PathBuf>,
    /// How the viewport was set.
    pub view: Value,
    /// How the panels were arranged.
    pub layout: Value,
}

/// How the scene is relit.
#[derive(Clone, Debug, PartialEq)]
pub enum Relight {
    /// As the file has it, in the format of [`edits`]; `Null` where nothing was changed. It is
    /// understood once the capture is there.
    Stored(Value),
    /// To be written, with what of them could not be read.
    Edits(Arc<Edits>, Arc<Vec<Unread>>),
}

impl Default for Relight {
    fn default() -> Self {
        Self::Stored(Value::Null)
    }
}

/// One material, with its surfaces by name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tag {
    pub name: String,
    pub specular: bool,
    #[serde(default)]
    pub textured: bool,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub known_diffuse: Option<Rgb>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub known_diffuse_sd: Option<Rgb>,
    pub surfaces: Vec<String>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Stored {
    version: u64,
    capture: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    original: Option<PathBuf>,
    materials: Vec<Tag>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    lights: Option<Vec<Value>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    environment: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    charts: Option<Vec<Value>>,
    /// By section and name, as they would be written on the command line.
    #[serde(default)]
    options: BTreeMap<String, BTreeMap<String, String>>,
    #[serde(default)]
    start: BTreeMap<String, Rgb>,
    #[serde(default, skip_serializing_if = "Value::is_null")]
    relight: Value,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    masks: BTreeMap<String, StoredMask>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    solution: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    results: Option<String>,
    #[serde(default)]
    view: Value,
    #[serde(default)]
    layout: Value,
}

/// Whether a path looks like a project file by its name.
pub fn is_project(path: &Path) -> bool {
    path.extension().is_some_and(|own| own.eq_ignore_ascii_case(EXTENSION))
}

/// Reads a project. The capture is not looked at: it may have moved.
pub fn read(file: &Path) -> Result<ProjectFile, Error> {
    let mut value = json::read(file)?;
    migrate(file, &mut value)?;
    let stored = Stored::deserialize(&value).map_err(|problem| {
        Error::Invalid(Fault::new(
            file,
            "",
            format!("this is no project of version {VERSION} ({problem})"),
            "Correct the file there, or open the capture's folder instead",
        ))
    })?;
    let mut options = Options::default();
    let wrong = |error: crate::options::OptionError| {
        Error::Invalid(Fault::new(
            file,
            format!("options.{}.{}", error.section, error.name),
            error.problem,
            "Correct the value, or remove it to have the default",
        ))
    };
    for (section, values) in &stored.options {
        for (name, text) in values {
            options.set(section, name, text).map_err(wrong)?;
        }
    }
    for (material, diffuse) in &stored.start {
        options.set_start(material, *diffuse).map_err(wrong)?;
    }
    for tag in &stored.materials {
        check(file, tag)?;
    }
    let environment = stored.environment.map(|name| {
        tags::environment_of(&name).ok_or_else(|| {
            Error::Invalid(Fault::new(
                file,
                "environment",
                format!("\"{name}\" is no light model"),
                "Give \"room\", \"open\" or \"auto\", or remove it to have the capture's own",
            ))
        })
    });
    let folder = absolute(file.parent().unwrap_or(Path::new("")));
    let from_here = |name: &str| tidy(&folder.join(name)).display().to_string();
    Ok(ProjectFile {
        capture: tidy(&folder.join(&stored.capture)),
        original: stored.original,
        tags: stored.materials,
        lights: stored.lights.map(|lights| with_files(lights, "image", from_here)),
        environment: environment.transpose()?,
        charts: stored.charts.map(|charts| with_files(charts, "table", from_here)),
        options,
        relight: Relight::Stored(stored.relight),
        masks: masks::read(file, stored.masks)?,
        solution: stored.solution.map(|path| tidy(&folder.join(path))),
        results: stored.results.map(|path| tidy(&folder.join(path))),
        view: stored.view,
        layout: stored.layout,
    })
}

/// Known lights or charts with another name for the file that is their member `key`.
fn with_files(mut items: Vec<Value>, key: &str, name: impl Fn(&str) -> String) -> Vec<Value> {
    for item in &mut items {
        if let Some(Value::String(file)) = item.get_mut(key) {
            *file = name(file);
        }
    }
    items
}

/// Brings a project of an older version to this one.
fn migrate(file: &Path, value: &mut Value) -> Result<(), Error> {
    let root = Field::root(file, value)?;
    // The first projects had no number.
    let version = root.get("version").map_or(Some(1), |version| version.value.as_u64());
    match version {
        // Version 2 has gained "results", version 3 "lights" and "environment", version 4 "masks",
        // version 5 "charts";
        // older projects do without.
        Some(1..=VERSION) => {
            value["version"] = VERSION.into();
            Ok(())
        }
        _ => Err(Error::Unsupported(Fault::new(
            file,
            "version",
            format!(
                "the project has version {}, and this program reads versions up to {VERSION}",
                value["version"]
            ),
            "Open it with the program that wrote it, or install a newer lobelia",
        ))),
    }
}

fn check(file: &Path, tag: &Tag) -> Result<(), Error> {
    let known = tag.known_diffuse.iter().flatten().all(|value| (0.0..=1.0).contains(value));
    let deviations = tag.known_diffuse_sd.iter().flatten().all(|value| *value >= 0.0);
    if known && deviations && (tag.known_diffuse.is_some() || tag.known_diffuse_sd.is_none()) {
        return Ok(());
    }
    Err(Error::Invalid(Fault::new(
        file,
        format!("materials, \"{}\"", tag.name),
        "the known reflectance must lie between 0 and 1, its deviation be 0 or more",
        "Correct the numbers, or remove them",
    )))
}

/// Writes a project, whole or not at all.
pub fn write(file: &Path, project: &ProjectFile) -> Result<(), Error> {
    atomic::write_bytes(file, text(file, project)?.as_bytes())
}

/// What the file of a project holds.
fn text(file: &Path, project: &ProjectFile) -> Result<String, Error> {
    let folder = absolute(file.parent().unwrap_or(Path::new("")));
    // A quality is stored with what was changed beside it.
    let defaults = Options::of_quality(project.options.general.quality);
    let mut options: BTreeMap<String, BTreeMap<String, String>> = BTreeMap::new();
    for declaration in defaults.declarations() {
        let Some(text) = project.options.get(declaration.section, declaration.name) else {
            continue;
        };
        let is_quality = (declaration.section, declaration.name) == ("general", "quality");
        let default = match is_quality {
            true => Some(declaration.default),
            false => defaults.get(declaration.section, declaration.name),
        };
        if Some(&text) != default.as_ref() {
            let section = options.entry(declaration.section.to_owned()).or_default();
            section.insert(declaration.name.to_owned(), text);
        }
    }
    let to_here = |file: &str| relative(&folder, Path::new(file));
    let stored = Stored {
        version: VERSION,
        capture: relative(&folder, &absolute(&project.capture)),
        original: project.original.clone(),
        materials: project.tags.clone(),
        lights: project.lights.clone().map(|lights| with_files(lights, "image", to_here)),
        environment: project.environment.map(|own| own.name().to_owned()),
        charts: project.charts.clone().map(|charts| with_files(charts, "table", to_here)),
        options,
        start: project.options.start.clone(),
        relight: match &project.relight {
            Relight::Stored(value) => value.clone(),
            Relight::Edits(edits, unread) => match edits::stored_value(edits, unread, &folder) {
                Value::Object(members) if members.is_empty() => Value::Null,
                value => value,
            },
        },
        masks: stored_masks(&project.masks),
        solution: project.solution.as_ref().map(|path| relative(&folder, &absolute(path))),
        results: project.results.as_ref().map(|path| relative(&folder, &absolute(path))),
        view: project.view.clone(),
        layout: project.layout.clone(),
    };
    let mut text = serde_json::to_string_pretty(&stored)
        .map_err(|error| Error::Write { file: file.to_owned(), source: error.into() })?;
    text.push('\n');
    Ok(text)
}

/// Writes a project over its file, whose former state is kept beside it as `NAME.lobelia~`.
pub fn write_over(file: &Path, project: &ProjectFile) -> Result<(), Error> {
    let text = text(file, project)?;
    match std::fs::read(file) {
        // Writing the same again must not push the state before it out.
        Ok(former) if former == text.as_bytes() => {}
        Ok(former) => {
            let mut name = file.as_os_str().to_owned();
            name.push("~");
            atomic::write_bytes(Path::new(&name), &former)?;
        }
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {}
        Err(source) => return Err(Error::Read { file: file.to_owned(), source }),
    }
    atomic::write_bytes(file, text.as_bytes())
}

impl Tag {
    /// A material of a capture as a tag.
    pub fn of(material: &Material, capture: &Capture) -> Self {
        let name = |&surface: &usize| capture.surfaces[surface].name.clone();
        Self {
            name: material.name.clone(),
            specular: material.kind == MaterialKind::Specular,
            textured: material.textured,
            known_diffuse: material.known_diffuse,
            known_diffuse_sd: material.known_diffuse_sd,
            surfaces: material.surfaces.iter().map(name).collect(),
        }
    }
}

/// Names of surfaces that tags give to materials, and that the capture cannot, by the material's
/// name. They are written back: the capture may have them again.
pub type Absent = BTreeMap<String, Vec<String>>;

/// The materials of tags, resolved against a capture's surfaces.
#[derive(Clone, Debug, Default)]
pub struct Resolved {
    pub materials: Vec<Material>,
    pub absent: Absent,
    /// What could not be used, a sentence each.
    pub warnings: Vec<String>,
}

/// Resolves tags against a capture's surfaces.
pub fn materials(tags: &[Tag], capture: &Capture) -> Resolved {
    let mut resolved = Resolved::default();
    let mut taken = vec![false; capture.surfaces.len()];
    for tag in tags {
        let mut surfaces = Vec::new();
        for name in &tag.surfaces {
            let index = capture.surfaces.iter().position(|surface| surface.name == *name);
            let problem = match index {
                Some(index)
                    if !taken[index]
                        && !matches!(capture.surfaces[index].role, Role::Luminaire(_)) =>
                {
                    taken[index] = true;
                    surfaces.push(index);
                    continue;
                }
                Some(_) => format!(
                    "the surface \"{name}\" belongs to another material or to a visible light; \
                     material \"{}\" goes without it",
                    tag.name
                ),
                None => format!(
                    "the capture has no surface \"{name}\" any more; material \"{}\" goes \
                     without it",
                    tag.name
                ),
            };
            resolved.warnings.push(problem);
            resolved.absent.entry(tag.name.clone()).or_default().push(name.clone());
        }
        resolved.materials.push(Material {
            name: tag.name.clone(),
            kind: if tag.specular { MaterialKind::Specular } else { MaterialKind::Diffuse },
            surfaces,
            textured: tag.textured,
            known_diffuse: tag.known_diffuse,
            known_diffuse_sd: tag.known_diffuse_sd,
        });
    }
    resolved
}

/// The capture with these lights in place of its own.
pub fn lit(loaded: &Capture, lights: &[KnownLight], environment: Environment) -> Capture {
    let mut capture = loaded.clone();
    capture.lights = lights.to_vec();
    capture.environment = environment;
    for surface in &mut capture.surfaces {
        if let Role::Luminaire(_) = surface.role {
            surface.role = Role::Untagged;
        }
    }
    for (index, light) in lights.iter().enumerate() {
        if let KnownLight::Visible { surfaces, .. } = light {
            for &surface in surfaces {
                capture.surfaces[surface].role = Role::Luminaire(index);
            }
        }
    }
    capture
}

/// The capture with these materials: what loading it with such a tag file would give. Materials
/// without surfaces are left out, as there.
pub fn tagged(lit: &Capture, materials: &[Material]) -> Capture {
    let mut capture = lit.clone();
    for surface in &mut capture.surfaces {
        if let Role::Material(_) = surface.role {
            surface.role = Role::Untagged;
        }
    }
    let materials = materials.iter().filter(|material| !material.surfaces.is_empty());
    capture.materials = materials.cloned().collect();
    for (index, material) in capture.materials.iter().enumerate() {
        for &surface in &material.surfaces {
            capture.surfaces[surface].role = Role::Material(index);
        }
    }
    capture
}
#[cfg(test)]
mod tests;
