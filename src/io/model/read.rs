//! Reads `model.json`.

use std::path::Path;
use std::sync::Arc;

use glam::DVec2;

use super::cameras::orientation;
use super::found;
use super::strokes::{Names, no_such};
use super::{FORMAT, VERSION};
use crate::io::json::{self, Field};
use crate::io::{Error, exif_lens, inside, picture};
use crate::model::{
    Fit, Lens, Model, Opening, Photograph, Point, Shape, Side, Stroke, Support, Surfaces, Thing,
};

/// Most parts of each kind: files of others must not fill the memory.
const MOST: usize = 100_000;

/// Reads a model. Images are looked for beside the file, for sizes and EXIF alone.
pub fn read(file: &Path) -> Result<Model, Error> {
    let value = json::read(file)?;
    let root = Field::root(file, &value)?;
    let format = root.need("format")?;
    if format.text()? != FORMAT {
        return Err(format.wrong(&format!("this is no model: the format must be \"{FORMAT}\"")));
    }
    let version = root.need("version")?;
    if ![1.0, 2.0, VERSION as f64].contains(&version.number()?) {
        return Err(version.wrong_with(
            &format!("this program reads versions up to {VERSION} of the format"),
            "Open the file with the program that wrote it, or with a newer one",
        ));
    }
    let folder = file.parent().unwrap_or(Path::new(""));
    let mut model = Model::default();
    for item in list(&root, "lenses")? {
        model.lenses.push(lens(&item)?);
    }
    if model.lenses.is_empty() {
        model.lenses.push(Lens {
            id: "lens".to_owned(),
            focal_px: None,
            principal_px: None,
            radial: DVec2::ZERO,
            fit: Fit::default(),
        });
    }
    for item in list(&root, "photographs")? {
        let photograph = photograph(&item, &model, folder)?;
        let own = &mut model.lenses[photograph.lens];
        if own.focal_px.is_none()
            && let Some(image) = inside::join(folder, &photograph.name).filter(|p| p.is_file())
        {
            own.focal_px = exif_lens::read(&image)?.focal_px;
        }
        model.photographs.push(photograph);
    }
    for item in list(&root, "things")? {
        let thing = thing(&item, &model)?;
        model.things.push(thing);
    }
    for item in list(&root, "points")? {
        model.points.push(Point { id: item.need("id")?.text()?.to_owned() });
    }
    let names = Names::of(&model);
    let strokes =
        list(&root, "strokes")?.iter().map(|item| names.stroke(item)).collect::<Result<_, _>>()?;
    model.strokes = strokes;
    model.strokes.sort_by_key(Stroke::is_found);
    let items = list(&root, "found_points")?;
    model.found_points = Arc::new(found::points(items, model.photographs.len())?);
    model.found_in_metres = root.get("found_in_metres").map_or(Ok(false), |own| own.truth())?;
    Ok(model)
}

fn list<'a>(root: &Field<'a>, key: &str) -> Result<Vec<Field<'a>>, Error> {
    let items = root.get(key).map_or(Ok(Vec::new()), |field| field.items())?;
    if items.len() > MOST {
        return Err(root.wrong(&format!("\"{key}\" has more than {MOST} entries")));
    }
    Ok(items)
}

fn lens(item: &Field) -> Result<Lens, Error> {
    let number = |key: &str| item.get(key).map_or(Ok(0.0), |field| field.number());
    let fit = match item.get("fit") {
        None => Fit::default(),
        Some(field) => {
            let mut fit = Fit { focal: false, principal: false, k1: false, k2: false };
            for name in field.items()? {
                match name.text()? {
                    "focal_px" => fit.focal = true,
                    "principal_px" => fit.principal = true,
                    "k1" => fit.k1 = true,
                    "k2" => fit.k2 = true,
                    _ => {
                        return Err(name.wrong_with(
                            "this is nothing of a lens that can be adjusted",
                            "The choices are \"focal_px\", \"principal_px\", \"k1\" and \"k2\"",
                        ));
                    }
                }
            }
            fit
        }
    };
    Ok(Lens {
        id: item.need("id")?.text()?.to_owned(),
        focal_px: item.get("focal_px").map(|field| field.number()).transpose()?,
        principal_px: item
            .get("principal_px")
            .map(|field| field.numbers::<2>().map(DVec2::from))
            .transpose()?,
        radial: DVec2::new(number("k1")?, number("k2")?),
        fit,
    })
}

fn photograph(item: &Field, model: &Model, folder: &Path) -> Result<Photograph, Error> {
    let name = item.need("file_path")?.text()?.to_owned();
    let lens = match item.get("lens") {
        None => 0,
        Some(field) => {
            let id = field.text()?;
            let found = model.lenses.iter().position(|lens| lens.id == id);
            let known = || model.lenses.iter().map(|lens| lens.id.as_str());
            found.ok_or_else(|| no_such(&field, "lens", id, known().collect()))?
        }
    };
    let side = |key: &str| -> Result<Option<usize>, Error> {
        let Some(field) = item.get(key) else { return Ok(None) };
        let value = field.number()?;
        if value.fract() != 0.0 || !(1.0..=1e6).contains(&value) {
            return Err(field.wrong("this must be a whole number of pixels, 1 or more"));
        }
        Ok(Some(value as usize))
    };
    let size = match (side("w")?, side("h")?) {
        (Some(width), Some(height)) => (width, height),
        _ => match inside::join(folder, &name).filter(|image| image.is_file()) {
            Some(image) => orientation(folder, &name)?.size(picture::dimensions(&image)?),
            None => {
                return Err(item.wrong_with(
                    &format!("the image {name} does not exist, and its size is missing"),
                    "Put the image there, or give w and h",
                ));
            }
        },
    };
    Ok(Photograph { name, lens, size, found: found::pose(item)? })
}

fn thing(item: &Field, model: &Model) -> Result<Thing, Error> {
    let id = item.need("id")?.text()?.to_owned();
    let corners = |default: usize| -> Result<usize, Error> {
        let Some(field) = item.get("corners") else { return Ok(default) };
        let value = field.number()?;
        if value.fract() != 0.0 || !(0.0..=1e6).contains(&value) {
            return Err(field.wrong("this must be a whole number of corners"));
        }
        Ok(value as usize)
    };
    let kind = item.need("kind")?;
    let shape = match kind.text()? {
        "room" => Shape::Room {
            corners: corners(4)?,
            rectilinear: item.get("rectilinear").map_or(Ok(false), |field| field.truth())?,
            openings: list(item, "openings")?.iter().map(opening).collect::<Result<_, _>>()?,
        },
        "box" => Shape::Box { flush: item.get("flush").map(|f| side(&f, model)).transpose()? },
        "prism" => Shape::Prism { corners: corners(4)? },
        "cylinder" => Shape::Cylinder,
        "polygon" => Shape::Polygon { corners: corners(4)? },
        other => {
            let known = vec!["room", "box", "prism", "cylinder", "polygon"];
            return Err(no_such(&kind, "kind of thing", other, known));
        }
    };
    let on = match item.get("on") {
        None => Support::Floor,
        Some(field) => match field.text()? {
            "floor" => Support::Floor,
            "free" => Support::Free,
            name => match name.strip_suffix(".top") {
                Some(host) => Support::Top(thing_index(&field, model, host)?),
                None => Support::Side(side(&field, model)?),
            },
        },
    };
    let mut held = Vec::new();
    if let Some(field) = item.get("hold") {
        for (name, value) in members(&field)? {
            held.push((name, value.number()?));
        }
    }
    Ok(Thing { id, shape, on, held, surfaces: surfaces(item)? })
}

fn opening(item: &Field) -> Result<Opening, Error> {
    let wall = item.need("wall")?;
    let number = wall.number()?;
    if number.fract() != 0.0 || !(1.0..=1e6).contains(&number) {
        return Err(
            wall.wrong("this must be the number of a wall: 1 is that from floor1 to floor2")
        );
    }
    Ok(Opening { id: item.need("id")?.text()?.to_owned(), wall: number as usize - 1 })
}

fn surfaces(item: &Field) -> Result<Surfaces, Error> {
    let name = |field: &Field| -> Result<String, Error> {
        let text = field.text()?;
        let is_plain = !text.chars().any(|c| c.is_control() || c == '\\')
            && text.split_whitespace().collect::<Vec<_>>().join(" ") == text;
        if text.is_empty() || !is_plain {
            return Err(field.wrong("a surface is named by plain text"));
        }
        Ok(text.to_owned())
    };
    let all = item.get("surface").map(|field| name(&field)).transpose()?;
    let mut named = Vec::new();
    if let Some(field) = item.get("surfaces") {
        for (face, value) in members(&field)? {
            let surface = if value.value.is_null() { None } else { Some(name(&value)?) };
            named.push((face, surface));
        }
    }
    Ok(Surfaces { all, named })
}

/// The members of an object, in the order of their names.
fn members<'a>(field: &Field<'a>) -> Result<Vec<(String, Field<'a>)>, Error> {
    let Some(object) = field.value.as_object() else {
        return Err(field.wrong("this must be an object {…}"));
    };
    let member = |(name, value): (&String, &'a serde_json::Value)| {
        let path = format!("{}.{name}", field.path);
        (name.clone(), Field { file: field.file, path, value })
    };
    Ok(object.iter().map(member).collect())
}

fn thing_index(field: &Field, model: &Model, id: &str) -> Result<usize, Error> {
    let found = model.things.iter().position(|thing| thing.id == id);
    let known = || model.things.iter().map(|thing| thing.id.as_str()).collect();
    found.ok_or_else(|| no_such(field, "thing listed before it", id, known()))
}

/// An upright side: `room.wall1`, `box1.side3`.
fn side(field: &Field, model: &Model) -> Result<Side, Error> {
    let text = field.text()?;
    let wrong = || {
        field.wrong_with(
            &format!("\"{text}\" is no upright side of a thing"),
            "Write it as \"room.wall1\" or \"box1.side2\"",
        )
    };
    let (id, face) = text.split_once('.').ok_or_else(wrong)?;
    let thing = thing_index(field, model, id)?;
    let word = match model.things[thing].shape {
        Shape::Room { .. } => "wall",
        _ => "side",
    };
    let number: usize =
        face.strip_prefix(word).and_then(|digits| digits.parse().ok()).ok_or_else(wrong)?;
    if !(1..=model.things[thing].shape.sides()).contains(&number) {
        return Err(wrong());
    }
    Ok(Side { thing, index: number - 1 })
}
