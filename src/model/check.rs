//! Checks of a model before anything is computed: strokes and things that are invalid or contradict
//! themselves.

use std::collections::HashSet;
use std::ops::RangeInclusive;

use glam::DVec2;

use super::things::{self, Kind};
use super::{Model, ModelError, Place, Shape, Side, Stroke, Support, Thing};

/// Most corners of an outline.
const MOST_CORNERS: usize = 1000;
/// Strokes lie in their photograph, or not farther outside than this many times its size.
const OUTSIDE: f64 = 3.0;
/// Shortest stroke along a line, in pixels: shorter ones have no direction.
const SHORTEST_PX: f64 = 2.0;
/// Standard deviations that a line found in a photograph may have, in pixels.
const PLAUSIBLE_SD_PX: RangeInclusive<f64> = 1e-3..=1e3;
/// No room is larger, and no number that is typed, in metres.
pub(super) const LARGEST_M: f64 = 1e6;

/// Checks that every part of a model refers to what is there, and that all numbers are possible.
pub fn check(model: &Model) -> Result<(), ModelError> {
    names(model)?;
    for (index, photograph) in model.photographs.iter().enumerate() {
        let place = format!("photographs[{index}]");
        if photograph.lens >= model.lenses.len() {
            return Err(ModelError::new(
                place,
                "its lens does not exist",
                "Name one of the lenses",
            ));
        }
        if photograph.size.0 == 0 || photograph.size.1 == 0 {
            return Err(ModelError::new(place, "it has no pixels", "Give its size"));
        }
    }
    for (index, lens) in model.lenses.iter().enumerate() {
        let place = || format!("lenses[{index}] ({})", lens.id);
        let numbers = [lens.focal_px.unwrap_or(1.0), lens.radial.x, lens.radial.y];
        let principal = lens.principal_px.unwrap_or_default();
        if !numbers.iter().all(|n| n.is_finite()) || !principal.is_finite() {
            return Err(ModelError::new(place(), "a number is not finite", "Correct it"));
        }
        if numbers[0] <= 0.0 {
            let remedy = "Give it in pixels, or leave it out";
            return Err(ModelError::new(place(), "a focal length must be positive", remedy));
        }
    }
    for index in 0..model.things.len() {
        thing(model, index)?;
    }
    for index in 0..model.strokes.len() {
        stroke(model, index)?;
    }
    Ok(())
}

fn names(model: &Model) -> Result<(), ModelError> {
    let lists: [(&str, Vec<&String>); 2] = [
        ("lenses", model.lenses.iter().map(|own| &own.id).collect()),
        ("photographs", model.photographs.iter().map(|own| &own.name).collect()),
    ];
    let places = model.things.iter().map(|own| &own.id).chain(model.points.iter().map(|p| &p.id));
    for (list, names) in lists.into_iter().chain([("things and points", places.collect())]) {
        let mut seen = HashSet::new();
        for name in names {
            if name.is_empty() || (list == "things and points" && name.contains('.')) {
                let problem = format!("\"{name}\" is no name");
                let remedy = "Give each a name of its own, without a full stop";
                return Err(ModelError::new(list, problem, remedy));
            }
            if !seen.insert(name) {
                let problem = format!("two are called \"{name}\"");
                return Err(ModelError::new(list, problem, "Give each a name of its own"));
            }
        }
    }
    Ok(())
}

fn thing(model: &Model, index: usize) -> Result<(), ModelError> {
    let own = &model.things[index];
    let wrong = |problem: String, remedy: &str| {
        Err(ModelError::new(format!("things[{index}] ({})", own.id), problem, remedy))
    };
    let is_earlier = |other: usize| other < index;
    let is_side =
        |side: &Side| is_earlier(side.thing) && side.index < model.things[side.thing].shape.sides();
    let is_polygon = matches!(own.shape, Shape::Polygon { .. });
    match &own.on {
        Support::Floor => {}
        Support::Top(host) if is_earlier(*host) && model.things[*host].shape.has_top() => {}
        Support::Side(side) if is_polygon && is_side(side) => {}
        Support::Free if is_polygon => {}
        _ => {
            return wrong(
                format!("a {} cannot stand there", own.shape.name()),
                "Let it stand on the floor or on the top of a thing that is listed before it; \
                 only polygons lie in sides",
            );
        }
    }
    match &own.shape {
        Shape::Room { .. } if own.on != Support::Floor => {
            return wrong("a room stands on the floor".into(), "Leave \"on\" out");
        }
        Shape::Room { corners, rectilinear: true, .. } if *corners < 4 || corners % 2 == 1 => {
            return wrong(
                format!("a rectilinear room cannot have {corners} corners"),
                "Give 4, 6, 8 or more corners, or let \"rectilinear\" be false",
            );
        }
        Shape::Room { corners, .. } | Shape::Prism { corners } | Shape::Polygon { corners }
            if !(3..=MOST_CORNERS).contains(corners) =>
        {
            return wrong(
                format!("an outline cannot have {corners} corners"),
                "Give 3 corners or more",
            );
        }
        Shape::Room { corners, openings, .. } => {
            if let Some(opening) = openings.iter().find(|opening| opening.wall >= *corners) {
                return wrong(
                    format!("the opening {} is in a wall that does not exist", opening.id),
                    "Name one of the walls, wall1 being that from floor1 to floor2",
                );
            }
        }
        Shape::Box { flush: Some(side) } if !is_side(side) => {
            return wrong(
                "it is flush with a side that does not exist".into(),
                "Name a side of a thing that is listed before it",
            );
        }
        _ => {}
    }
    let corners = things::corner_names(own);
    if corners.iter().collect::<HashSet<_>>().len() < corners.len()
        || corners.iter().any(|name| name.contains('.'))
    {
        return wrong(
            "two of its corners have one name".into(),
            "Give each opening a name of its own, without a full stop",
        );
    }
    held(own, index)
}

fn held(own: &Thing, index: usize) -> Result<(), ModelError> {
    let parameters = things::parameters(own);
    for (name, value) in &own.held {
        let place = format!("things[{index}] ({}).hold.{name}", own.id);
        let Some(parameter) = parameters.iter().find(|parameter| parameter.name == *name) else {
            let known: Vec<&str> = parameters.iter().map(|own| own.name.as_str()).collect();
            let problem = format!("a {} has no such number", own.shape.name());
            let remedy = format!("It has {}", known.join(", "));
            return Err(ModelError::new(place, problem, remedy));
        };
        // An opening may begin at the floor or in the corner.
        let is_size = parameter.kind == Kind::Length
            && ["width", "depth", "height", "radius"].iter().any(|size| name.ends_with(size));
        if !value.is_finite() || value.abs() > LARGEST_M || (is_size && *value <= 0.0) {
            let problem = format!("{value} is no possible value");
            return Err(ModelError::new(place, problem, "Give metres, or radians for an angle"));
        }
    }
    Ok(())
}

fn stroke(model: &Model, index: usize) -> Result<(), ModelError> {
    let own = &model.strokes[index];
    let place = format!("strokes[{index}]");
    let exists = |at: &Place| match *at {
        Place::Corner { thing, corner } => {
            model.things.get(thing).is_some_and(|thing| corner < things::corner_names(thing).len())
        }
        Place::Point(point) => point < model.points.len(),
    };
    let is_known = own.photograph().is_none_or(|index| index < model.photographs.len());
    if !is_known || !own.places().iter().all(exists) {
        let problem = "it is about something that does not exist";
        return Err(ModelError::new(place, problem, "Correct the stroke or remove it"));
    }
    let wrong = |problem: &str, remedy: &str| {
        Err(ModelError::new(
            place.clone(),
            format!("{problem} ({})", model.stroke_name(index)),
            remedy,
        ))
    };
    let pixels: Vec<DVec2> = match own {
        Stroke::Line { from, to, .. } | Stroke::Edge { from, to, .. } => vec![*from, *to],
        Stroke::Pick { pixel, .. } | Stroke::Rim { pixel, .. } => vec![*pixel],
        Stroke::Position { .. } | Stroke::Length { .. } => Vec::new(),
    };
    if let Some(photograph) = own.photograph() {
        let (width, height) = model.photographs[photograph].size;
        let size = DVec2::new(width as f64, height as f64);
        let is_near = |pixel: &DVec2| {
            pixel.is_finite() && ((*pixel - 0.5 * size).abs().cmple(size * OUTSIDE)).all()
        };
        if !pixels.iter().all(is_near) {
            return wrong("it lies far outside of its photograph", "Give pixels of the photograph");
        }
    }
    if let [from, to] = pixels[..]
        && from.distance(to) < SHORTEST_PX
    {
        return wrong("it has no length", "Draw it from one end of the line to the other");
    }
    match own {
        Stroke::Rim { thing, .. }
            if model.things.get(*thing).map(|thing| &thing.shape) != Some(&Shape::Cylinder) =>
        {
            Err(ModelError::new(place, "a rim is picked on a cylinder", "Name a cylinder"))
        }
        Stroke::Edge { sd_px: Some(sd_px), .. } if !PLAUSIBLE_SD_PX.contains(sd_px) => {
            wrong("its sd_px is no standard deviation of a line", "Give 0.001 to 1000 pixels")
        }
        Stroke::Position { position, sd_m, .. }
            if !position.is_finite() || position.length() > LARGEST_M || !is_positive(*sd_m) =>
        {
            wrong("a known position is metres, with a positive sd_m", "Correct the numbers")
        }
        Stroke::Length { between: [a, b], length_m, sd_m }
            if a == b || !is_positive(*length_m) || !is_positive(*sd_m) =>
        {
            wrong(
                "a known length is positive metres between two places, with a positive sd_m",
                "Correct the numbers",
            )
        }
        _ => Ok(()),
    }
}

fn is_positive(value: f64) -> bool {
    value > 0.0 && value <= LARGEST_M
}
