//! Writes `model.json`, so that reading it again gives the same model.

use std::path::Path;

use serde_json::{Map, Value, json};

use super::{FORMAT, VERSION, found};
use crate::io::{Error, atomic};
use crate::model::{Model, Place, Shape, Side, Stroke, Support, Thing};

/// Writes a model, whole or not at all.
pub fn write(file: &Path, model: &Model) -> Result<(), Error> {
    atomic::write_bytes(file, to_text(model).as_bytes())
}

/// The text of the file.
pub fn to_text(model: &Model) -> String {
    let lens = |lens: &crate::model::Lens| {
        let fit = lens.fit;
        let named = [
            (fit.focal, "focal_px"),
            (fit.principal, "principal_px"),
            (fit.k1, "k1"),
            (fit.k2, "k2"),
        ];
        let fit: Vec<&str> = named.iter().filter(|own| own.0).map(|own| own.1).collect();
        let mut item = Map::new();
        item.insert("id".into(), json!(lens.id));
        if let Some(focal) = lens.focal_px {
            item.insert("focal_px".into(), json!(focal));
        }
        if let Some(principal) = lens.principal_px {
            item.insert("principal_px".into(), json!(principal.to_array()));
        }
        item.insert("k1".into(), json!(lens.radial.x));
        item.insert("k2".into(), json!(lens.radial.y));
        item.insert("fit".into(), json!(fit));
        Value::Object(item)
    };
    let photograph = |own: &crate::model::Photograph| {
        let mut item = json!({"file_path": own.name, "w": own.size.0, "h": own.size.1,
               "lens": model.lenses.get(own.lens).map(|lens| &lens.id)});
        if let Some(pose) = &own.found {
            item["found"] = found::pose_value(pose);
        }
        item
    };
    // Version 1 has no pixels of points, and version 2 no lines that were found; what needs no newer
    // one is read by older programs.
    let version = match () {
        () if model.strokes.iter().any(Stroke::is_found) => VERSION,
        () if model.found_points.iter().any(|own| !own.pixels.is_empty()) => 2,
        () => 1,
    };
    let mut value = json!({
        "format": FORMAT,
        "version": version,
        "lenses": model.lenses.iter().map(lens).collect::<Vec<_>>(),
        "photographs": model.photographs.iter().map(photograph).collect::<Vec<_>>(),
        "things": model.things.iter().map(|own| thing(model, own)).collect::<Vec<_>>(),
        "points": model.points.iter().map(|own| json!({"id": own.id})).collect::<Vec<_>>(),
        "strokes": model.strokes.iter().map(|own| stroke(model, own)).collect::<Vec<_>>(),
    });
    if !model.found_points.is_empty() {
        let points = model.found_points.iter().map(found::point_value);
        value["found_points"] = points.collect();
    }
    if model.found_in_metres {
        value["found_in_metres"] = json!(true);
    }
    format!("{value:#}\n")
}

fn thing(model: &Model, own: &Thing) -> Value {
    let mut item = Map::new();
    let mut put = |key: &str, value: Value| drop(item.insert(key.to_owned(), value));
    put("id", json!(own.id));
    put("kind", json!(own.shape.name()));
    match &own.shape {
        Shape::Room { corners, rectilinear, openings } => {
            put("corners", json!(corners));
            put("rectilinear", json!(rectilinear));
            let opening = |own: &crate::model::Opening| json!({"id": own.id, "wall": own.wall + 1});
            put("openings", openings.iter().map(opening).collect());
        }
        Shape::Prism { corners } | Shape::Polygon { corners } => put("corners", json!(corners)),
        Shape::Box { flush: Some(wall) } => put("flush", json!(side(model, *wall))),
        Shape::Box { flush: None } | Shape::Cylinder => {}
    }
    put(
        "on",
        match own.on {
            Support::Floor => json!("floor"),
            Support::Free => json!("free"),
            Support::Top(host) => json!(format!("{}.top", model.things[host].id)),
            Support::Side(wall) => json!(side(model, wall)),
        },
    );
    let held: Map<String, Value> = own.held.iter().map(|(n, v)| (n.clone(), json!(v))).collect();
    if !held.is_empty() {
        put("hold", held.into());
    }
    if let Some(all) = &own.surfaces.all {
        put("surface", json!(all));
    }
    let named: Map<String, Value> =
        own.surfaces.named.iter().map(|(face, name)| (face.clone(), json!(name))).collect();
    if !named.is_empty() {
        put("surfaces", named.into());
    }
    Value::Object(item)
}

fn side(model: &Model, Side { thing, index }: Side) -> String {
    let word = match model.things[thing].shape {
        Shape::Room { .. } => "wall",
        _ => "side",
    };
    format!("{}.{word}{}", model.things[thing].id, index + 1)
}

fn stroke(model: &Model, own: &Stroke) -> Value {
    let name = |place: &Place| model.place_name(*place);
    let mut item = match own {
        Stroke::Line { axis, from, to, .. } => {
            json!({"axis": axis.name(), "from": from.to_array(), "to": to.to_array()})
        }
        Stroke::Pick { at, pixel, .. } => json!({"at": name(at), "pixel": pixel.to_array()}),
        Stroke::Edge { between, from, to, sd_px, .. } => {
            let mut item = json!({
                "between": between.each_ref().map(name), "from": from.to_array(), "to": to.to_array()
            });
            if let Some(sd_px) = sd_px {
                item["sd_px"] = json!(sd_px);
            }
            item
        }
        Stroke::Rim { thing, top, pixel, .. } => {
            let circle = if *top { "top" } else { "bottom" };
            let at = format!("{}.{circle}", model.things[*thing].id);
            json!({"at": at, "pixel": pixel.to_array()})
        }
        Stroke::Position { at, position, sd_m } => {
            json!({"at": name(at), "position": position.to_array(), "sd_m": sd_m})
        }
        Stroke::Length { between, length_m, sd_m } => {
            json!({"between": between.each_ref().map(name), "length_m": length_m, "sd_m": sd_m})
        }
    };
    item["kind"] = json!(own.name());
    if let Some(photograph) = own.photograph() {
        item["photograph"] = json!(model.photographs[photograph].name);
    }
    item
}
