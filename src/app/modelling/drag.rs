//! What a press of the pointer on the photograph starts: a stroke that is drawn, or a part that is
//! dragged, until the button is released.

use std::sync::Arc;

use glam::DVec2;

use super::tool::{Target, Tool};
use crate::model::{Model, Place, Point, Stroke};

/// Strokes along a line are longer than this, in pixels of the photograph.
const SHORTEST_PX: f64 = 2.0;
/// What typed numbers are believed to, in metres.
const TYPED_SD_M: f64 = 1e-3;

/// A movement of the hand on the photograph.
#[derive(Clone, Debug)]
pub struct Drag {
    pub what: Dragged,
    pub photograph: usize,
    /// Where it began, in pixels.
    pub from: DVec2,
    /// The model before it.
    pub before: Arc<Model>,
    /// What it is worth now, in pixels.
    pub at: DVec2,
    /// The way to there, where an outline is drawn.
    pub way: Vec<DVec2>,
}

/// What is drawn or moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Dragged {
    /// Something new, by the tool's rules.
    New(Tool),
    /// An end of a stroke: the first or the second.
    End(usize, bool),
    /// A whole line.
    Body(usize),
    /// The pixel of a pick or a rim.
    Pixel(usize),
    /// A corner or point that is not marked in this photograph yet.
    Corner(Place),
}

impl Drag {
    /// The model that it makes with the pointer at a pixel, and what it is called; `None` while it
    /// is nothing yet. `near` tells the corner or point at a pixel, and `length_m` the distance
    /// between two of them where they are placed.
    pub fn model(
        &self,
        near: impl Fn(DVec2) -> Option<Place>,
        length_m: impl Fn([Place; 2]) -> Option<f64>,
    ) -> Option<(String, Model)> {
        let mut model = Model::clone(&self.before);
        let (photograph, from, to) = (self.photograph, self.from, self.at);
        let is_long = from.distance(to) > SHORTEST_PX;
        let name = match self.what {
            Dragged::New(Tool::Line(axis)) => {
                let line = Stroke::Line { photograph, axis, from, to };
                model.add_stroke(line);
                is_long.then(|| format!("line along {}", axis.name()))?
            }
            Dragged::New(Tool::Mark(Target::Edge(between))) => {
                let name = Target::Edge(between).name(&model);
                model.add_stroke(Stroke::Edge { photograph, between, from, to, sd_px: None });
                is_long.then(|| format!("edge {name}"))?
            }
            Dragged::New(Tool::Mark(Target::Rim(thing, top))) => {
                model.add_stroke(Stroke::Rim { photograph, thing, top, pixel: to });
                format!("point on {}", Target::Rim(thing, top).name(&model))
            }
            Dragged::New(Tool::Mark(Target::Place(place))) => {
                mark(&mut model, photograph, place, to);
                format!("show {}", model.place_name(place))
            }
            Dragged::New(Tool::Mark(Target::NewPoint)) => {
                let place = new_point(&mut model, photograph, to);
                format!("show {}", model.place_name(place))
            }
            Dragged::New(Tool::Origin) => {
                let at = near(to).unwrap_or_else(|| new_point(&mut model, photograph, to));
                model.strokes.retain(|stroke| !is_origin(stroke));
                let position = glam::DVec3::ZERO;
                model.add_stroke(Stroke::Position { at, position, sd_m: TYPED_SD_M });
                "origin".to_owned()
            }
            Dragged::New(Tool::Length) => {
                let (a, b) = (near(from), near(to));
                if !is_long || a.is_some() && a == b {
                    return None;
                }
                let mut end = |own: Option<Place>, pixel| {
                    own.unwrap_or_else(|| new_point(&mut model, photograph, pixel))
                };
                let between = [end(a, from), end(b, to)];
                let length_m = length_m(between).unwrap_or(1.0);
                model.add_stroke(Stroke::Length { between, length_m, sd_m: TYPED_SD_M });
                "known length".to_owned()
            }
            Dragged::New(Tool::Select | Tool::Lasso(_)) => return None,
            Dragged::Corner(place) => {
                mark(&mut model, photograph, place, to);
                (from != to).then(|| format!("show {}", model.place_name(place)))?
            }
            Dragged::End(stroke, is_second) => {
                let (a, b) = ends(model.strokes.get_mut(stroke)?)?;
                let (own, other) = if is_second { (b, a) } else { (a, b) };
                *own += to - from;
                (own.distance(*other) > SHORTEST_PX).then(|| "move end".to_owned())?
            }
            Dragged::Body(stroke) => {
                let (a, b) = ends(model.strokes.get_mut(stroke)?)?;
                *a += to - from;
                *b += to - from;
                "move line".to_owned()
            }
            Dragged::Pixel(stroke) => {
                match model.strokes.get_mut(stroke)? {
                    Stroke::Pick { pixel, .. } | Stroke::Rim { pixel, .. } => *pixel += to - from,
                    _ => return None,
                }
                "move point".to_owned()
            }
        };
        // Lines that were found to be edges of a thing would hold it where it was.
        if let Some(thing) = self.thing() {
            model.forget_found(Some(thing));
        }
        Some((name, model))
    }

    /// The thing whose strokes are drawn or moved.
    fn thing(&self) -> Option<usize> {
        let of_place = |place: &Place| match place {
            Place::Corner { thing, .. } => Some(*thing),
            Place::Point(_) => None,
        };
        match self.what {
            Dragged::New(Tool::Mark(Target::Rim(thing, _))) => Some(thing),
            Dragged::New(Tool::Mark(Target::Edge([place, _]) | Target::Place(place)))
            | Dragged::Corner(place) => of_place(&place),
            Dragged::End(stroke, _) | Dragged::Body(stroke) | Dragged::Pixel(stroke) => {
                match self.before.strokes.get(stroke)? {
                    Stroke::Rim { thing, .. } => Some(*thing),
                    own => own.places().first().and_then(of_place),
                }
            }
            Dragged::New(_) => None,
        }
    }
}

impl Drag {
    /// Where the corner or point that is shown lies, with the pointer at a pixel; `None` where
    /// something else is drawn or moved.
    pub fn corner(&self, pointer: DVec2) -> Option<DVec2> {
        match self.what {
            Dragged::New(Tool::Mark(Target::Place(_) | Target::NewPoint)) | Dragged::Corner(_) => {
                Some(pointer)
            }
            Dragged::Pixel(stroke) => match self.before.strokes.get(stroke)? {
                Stroke::Pick { pixel, .. } => Some(*pixel + pointer - self.from),
                _ => None,
            },
            _ => None,
        }
    }

    /// Whether what is there already is only selected as long as the pointer stays.
    pub fn moves(&self) -> bool {
        matches!(self.what, Dragged::Corner(_) | Dragged::Pixel(_))
    }
}

/// Shows where a photograph has a corner or point, anew where it was shown before.
fn mark(model: &mut Model, photograph: usize, at: Place, pixel: DVec2) {
    let pick = Stroke::Pick { photograph, at, pixel };
    match model.pick_of(photograph, at) {
        Some(index) => model.strokes[index] = pick,
        None => drop(model.add_stroke(pick)),
    }
}

fn new_point(model: &mut Model, photograph: usize, pixel: DVec2) -> Place {
    let id = model.free_name("p");
    model.points.push(Point { id });
    let place = Place::Point(model.points.len() - 1);
    mark(model, photograph, place, pixel);
    place
}

/// The two ends of a line or edge.
fn ends(stroke: &mut Stroke) -> Option<(&mut DVec2, &mut DVec2)> {
    match stroke {
        Stroke::Line { from, to, .. } | Stroke::Edge { from, to, .. } => Some((from, to)),
        _ => None,
    }
}

/// Whether a stroke says where the origin is.
pub fn is_origin(stroke: &Stroke) -> bool {
    matches!(stroke, Stroke::Position { position, .. } if *position == glam::DVec3::ZERO)
}
