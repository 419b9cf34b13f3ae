//! Strokes of `model.json`: names become indices.

use std::collections::HashMap;

use glam::{DVec2, DVec3};

use super::TYPED_SD_M;
use crate::io::Error;
use crate::io::error::{listed, suggestion};
use crate::io::json::Field;
use crate::model::things::corner_names;
use crate::model::{Axis, Model, Place, Stroke};

/// What strokes refer to, by name.
pub(super) struct Names<'a> {
    photographs: HashMap<&'a str, usize>,
    places: HashMap<String, Place>,
    things: HashMap<&'a str, usize>,
}

impl<'a> Names<'a> {
    pub(super) fn of(model: &'a Model) -> Self {
        let mut places = HashMap::new();
        for (thing, own) in model.things.iter().enumerate() {
            for (corner, name) in corner_names(own).into_iter().enumerate() {
                places.insert(format!("{}.{name}", own.id), Place::Corner { thing, corner });
            }
        }
        for (index, point) in model.points.iter().enumerate() {
            places.insert(point.id.clone(), Place::Point(index));
        }
        let photographs = model.photographs.iter().enumerate();
        let things = model.things.iter().enumerate();
        Self {
            photographs: photographs.map(|(index, own)| (own.name.as_str(), index)).collect(),
            places,
            things: things.map(|(index, own)| (own.id.as_str(), index)).collect(),
        }
    }

    pub(super) fn stroke(&self, item: &Field) -> Result<Stroke, Error> {
        let kind = item.need("kind")?;
        let pixel = |key: &str| item.need(key)?.numbers::<2>().map(DVec2::from);
        let sd_m = || item.get("sd_m").map_or(Ok(TYPED_SD_M), |field| field.number());
        Ok(match kind.text()? {
            "line" => Stroke::Line {
                photograph: self.photograph(item)?,
                axis: axis(&item.need("axis")?)?,
                from: pixel("from")?,
                to: pixel("to")?,
            },
            "pick" => Stroke::Pick {
                photograph: self.photograph(item)?,
                at: self.place(&item.need("at")?)?,
                pixel: pixel("pixel")?,
            },
            "edge" => Stroke::Edge {
                photograph: self.photograph(item)?,
                between: self.pair(item)?,
                from: pixel("from")?,
                to: pixel("to")?,
                sd_px: item.get("sd_px").map(|field| field.number()).transpose()?,
            },
            "rim" => {
                let (thing, top) = self.rim(&item.need("at")?)?;
                let photograph = self.photograph(item)?;
                Stroke::Rim { photograph, thing, top, pixel: pixel("pixel")? }
            }
            "position" => Stroke::Position {
                at: self.place(&item.need("at")?)?,
                position: DVec3::from(item.need("position")?.numbers::<3>()?),
                sd_m: sd_m()?,
            },
            "length" => Stroke::Length {
                between: self.pair(item)?,
                length_m: item.need("length_m")?.number()?,
                sd_m: sd_m()?,
            },
            other => {
                let known = vec!["line", "pick", "edge", "rim", "position", "length"];
                return Err(no_such(&kind, "kind of stroke", other, known));
            }
        })
    }

    fn photograph(&self, item: &Field) -> Result<usize, Error> {
        let field = item.need("photograph")?;
        let name = field.text()?;
        let found = self.photographs.get(name).copied();
        let mut known: Vec<&str> = self.photographs.keys().copied().collect();
        known.sort_unstable();
        found.ok_or_else(|| no_such(&field, "photograph", name, known))
    }

    fn place(&self, field: &Field) -> Result<Place, Error> {
        let name = field.text()?;
        if let Some(place) = self.places.get(name) {
            return Ok(*place);
        }
        // Corners of the thing that is named, or else everything.
        let thing = name.split_once('.').map_or("", |(thing, _)| thing);
        let mut known: Vec<&str> = self.places.keys().map(String::as_str).collect();
        known.sort_unstable();
        if self.things.contains_key(thing) {
            known.retain(|own| own.split_once('.').is_some_and(|(other, _)| other == thing));
        }
        Err(no_such(field, "corner or point", name, known))
    }

    fn pair(&self, item: &Field) -> Result<[Place; 2], Error> {
        let field = item.need("between")?;
        match field.items()?.as_slice() {
            [a, b] => Ok([self.place(a)?, self.place(b)?]),
            _ => Err(field.wrong("two places are due here: [\"box1.top1\", \"box1.top2\"]")),
        }
    }

    fn rim(&self, field: &Field) -> Result<(usize, bool), Error> {
        let name = field.text()?;
        let found = name.rsplit_once('.').and_then(|(thing, circle)| {
            let top = match circle {
                "top" => true,
                "bottom" => false,
                _ => return None,
            };
            Some((*self.things.get(thing)?, top))
        });
        found.ok_or_else(|| {
            field.wrong_with(
                &format!("\"{name}\" is no rim"),
                "Write the cylinder's name and its circle: \"can.top\" or \"can.bottom\"",
            )
        })
    }
}

fn axis(field: &Field) -> Result<Axis, Error> {
    let name = field.text()?;
    let found = Axis::ALL.into_iter().find(|axis| axis.name() == name);
    found.ok_or_else(|| no_such(field, "axis", name, vec!["x", "y", "z"]))
}

/// Words for something that is not there, with the one that may have been meant.
pub(super) fn no_such(field: &Field, what: &str, name: &str, known: Vec<&str>) -> Error {
    let remedy = match suggestion(name, known.iter().copied()) {
        Some(close) => format!("Did you mean \"{close}\"?"),
        None if known.is_empty() => format!("The file has no {what}: add it"),
        None => format!("There are {}", listed(known.iter().copied())),
    };
    field.wrong_with(&format!("there is no {what} \"{name}\""), remedy.trim_end_matches('?'))
}
