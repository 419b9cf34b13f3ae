//! `tags.json`: what the artist says about surfaces, lights and the photographs.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use super::error::{listed, suggestion};
use super::json::{self, Field};
use super::{Error, Fault};
use crate::scene::{Environment, KnownLight, Material, MaterialKind, Role, Surface};

/// The tags, resolved against the surfaces of a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tags {
    pub materials: Vec<Material>,
    pub lights: Vec<KnownLight>,
    pub environment: Environment,
    /// Pixels at or above it are no measurements.
    pub saturation: Option<f32>,
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
        ..Default::default()
    };
    let mut reader = Reader { surfaces, owners: HashMap::new(), absent: Vec::new() };
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
        });
    }
    tags
}

fn environment(root: &Field) -> Result<Environment, Error> {
    let Some(field) = root.get("environment") else { return Ok(Environment::Auto) };
    Ok(match field.text()? {
        "room" => Environment::Room,
        "open" => Environment::Open,
        "auto" => Environment::Auto,
        other => {
            return Err(field.wrong(&format!(
                "\"{other}\" is no light model; the choices are \"room\", \"open\" and \"auto\""
            )));
        }
    })
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

struct Reader<'a> {
    surfaces: &'a mut [Surface],
    /// Which material or light took each surface, by the path of its mention.
    owners: HashMap<usize, String>,
    /// Mentions of surfaces that the mesh does not have: path and problem.
    absent: Vec<(String, String)>,
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
        let textured = item.get("textured").map_or(Ok(false), |field| field.truth())?;
        let surfaces = self.claim(&item.need("surfaces")?, Role::Material(index))?;
        Ok((!surfaces.is_empty()).then_some(Material {
            name,
            kind,
            surfaces,
            textured,
            known_diffuse,
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

    fn light(&mut self, item: &Field, index: usize) -> Result<KnownLight, Error> {
        let name = match item.get("name") {
            Some(field) => field.text()?.to_owned(),
            None => format!("light {}", index + 1),
        };
        let kind_field = item.need("kind")?;
        let kind = kind_field.text()?;
        let Some((_, check)) = LIGHT_KINDS.iter().find(|(known, _)| *known == kind) else {
            let kinds: Vec<&str> = LIGHT_KINDS.iter().map(|(kind, _)| *kind).collect();
            return Err(kind_field.wrong(&format!(
                "\"{kind}\" is no kind of light; the choices are {}",
                listed(kinds.into_iter())
            )));
        };
        check(item)?;
        if kind != "visible" {
            return Ok(KnownLight::Shape { name, kind: kind.to_owned() });
        }
        let field = item.need("surfaces")?;
        let surfaces = self.claim(&field, Role::Luminaire(index))?;
        if surfaces.is_empty() {
            return Err(field.wrong_with(
                "the mesh has none of the surfaces of this visible light",
                "Name at least one usemtl group of the mesh, or remove the light",
            ));
        }
        Ok(KnownLight::Visible { name, surfaces })
    }
}

fn reflectance(field: &Field) -> Result<[f64; 3], Error> {
    let values = field.numbers::<3>()?;
    if values.iter().any(|value| !(0.0..=1.0).contains(value)) {
        return Err(field.wrong_with(
            "a reflectance lies between 0 and 1",
            "Give linear red, green and blue as fractions, such as 0.18",
        ));
    }
    Ok(values)
}

type Check = fn(&Field) -> Result<(), Error>;

/// The kinds of light and the fields that each must have.
const LIGHT_KINDS: [(&str, Check); 7] = [
    ("visible", |_| Ok(())),
    ("rectangle", |item| {
        let field = item.need("corners")?;
        let corners = field.items()?;
        if corners.len() != 4 {
            return Err(field.wrong("a rectangle has four corners"));
        }
        corners.iter().try_for_each(|corner| corner.numbers::<3>().map(drop))?;
        direction(item, "normal")?;
        power(item, "radiance")
    }),
    ("sphere", |item| {
        item.need("center")?.numbers::<3>()?;
        positive(item, "radius_m")?;
        power(item, "radiance")
    }),
    ("point", |item| {
        item.need("position")?.numbers::<3>()?;
        power(item, "intensity")
    }),
    ("spot", |item| {
        item.need("position")?.numbers::<3>()?;
        direction(item, "direction")?;
        positive(item, "outer_angle")?;
        let (inner, outer) = (item.need("inner_angle")?, item.need("outer_angle")?.number()?);
        if !(0.0..=outer).contains(&inner.number()?) {
            return Err(inner.wrong("the inner angle lies between 0 and the outer one"));
        }
        power(item, "intensity")
    }),
    ("sun", |item| {
        direction(item, "direction")?;
        if item.get("angular_diameter").is_some() {
            positive(item, "angular_diameter")?;
        }
        power(item, "irradiance")
    }),
    ("dome", |item| {
        item.need("image")?.text()?;
        if item.get("scale").is_some() { positive(item, "scale") } else { Ok(()) }
    }),
];

fn direction(item: &Field, key: &str) -> Result<(), Error> {
    let field = item.need(key)?;
    let [x, y, z] = field.numbers::<3>()?;
    if x == 0.0 && y == 0.0 && z == 0.0 {
        return Err(field.wrong("a direction must not be zero"));
    }
    Ok(())
}

fn positive(item: &Field, key: &str) -> Result<(), Error> {
    let field = item.need(key)?;
    if field.number()? <= 0.0 {
        return Err(field.wrong("this must be positive"));
    }
    Ok(())
}

/// A colour that is not negative, or nothing: then it is an unknown of the solve.
fn power(item: &Field, key: &str) -> Result<(), Error> {
    let Some(field) = item.get(key) else { return Ok(()) };
    if field.numbers::<3>()?.iter().any(|value| *value < 0.0) {
        return Err(field.wrong("light cannot be negative"));
    }
    Ok(())
}
