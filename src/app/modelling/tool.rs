//! The drawing tools of the Model page, and the selection there.

use crate::model::from_points::Wanted;
use crate::model::things::{corner_names, edges};
use crate::model::{Axis, Model, Place, Shape, Stroke};

/// What the next press on the photograph does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tool {
    /// Selects and moves what is drawn.
    #[default]
    Select,
    /// Draws lines along an axis of the world.
    Line(Axis),
    /// Shows where something is.
    Mark(Target),
    /// Says where the world's origin is.
    Origin,
    /// Says how long something is.
    Length,
    /// Draws around points that a thing is fitted to.
    Lasso(Wanted),
}

/// What is marked on a photograph.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// A corner or point.
    Place(Place),
    /// A point that does not exist yet.
    NewPoint,
    /// The edge between two corners.
    Edge([Place; 2]),
    /// A circle of a cylinder: of this thing, the top or the bottom.
    Rim(usize, bool),
}

/// What the panels show the numbers of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Selected {
    #[default]
    Nothing,
    Thing(usize),
    Point(usize),
    Stroke(usize),
}

impl Tool {
    /// Whether everything that it is about exists.
    pub fn is_of(self, model: &Model) -> bool {
        match self {
            Self::Mark(target) => target.is_of(model),
            _ => true,
        }
    }

    /// What to do with it, for the bar above the photograph.
    pub fn hint(self, model: &Model) -> String {
        match self {
            Self::Select => "Click to select, drag to move. Drag a corner of the model to where \
                             the photograph shows it."
                .to_owned(),
            Self::Line(axis) => {
                let name = axis.name();
                let what = match axis {
                    Axis::X => "runs along x, towards larger x",
                    Axis::Y => "runs along y, towards larger y (a quarter turn left of x)",
                    Axis::Z => "is upright, from below to above",
                };
                format!("Line along {name}: drag along an edge of the room that {what}.")
            }
            Self::Mark(Target::NewPoint) => {
                "Click a point that other photographs show, too; then show it there.".to_owned()
            }
            Self::Mark(target @ Target::Edge(_)) => {
                format!("Drag along the edge {}; any piece of it will do.", target.name(model))
            }
            Self::Mark(target @ Target::Rim(..)) => {
                format!("Click points on the circle {}, far apart.", target.name(model))
            }
            Self::Mark(target) => {
                format!("Click {}. Hold and drag to place it exactly.", target.name(model))
            }
            Self::Origin => "Click the corner or point that is to lie at (0, 0, 0).".to_owned(),
            Self::Lasso(Wanted::Plane) => {
                "Draw around points of one plane, on the photograph; Esc gives it up.".to_owned()
            }
            Self::Lasso(Wanted::Box) => {
                "Draw around points of one box, two or three of its faces; Esc gives it up."
                    .to_owned()
            }
            Self::Length => {
                "Drag from one corner or point to another, then type their distance.".to_owned()
            }
        }
    }
}

impl Target {
    fn is_of(self, model: &Model) -> bool {
        let exists = |place: &Place| match *place {
            Place::Corner { thing, corner } => {
                model.things.get(thing).is_some_and(|own| corner < corner_names(own).len())
            }
            Place::Point(point) => point < model.points.len(),
        };
        match self {
            Self::NewPoint => true,
            Self::Place(place) => exists(&place),
            Self::Edge(between) => between.iter().all(exists),
            Self::Rim(thing, _) => {
                model.things.get(thing).is_some_and(|own| own.shape == Shape::Cylinder)
            }
        }
    }

    /// `box1.top2`, `box1.top1 to box1.top2`, `can.top`.
    pub fn name(self, model: &Model) -> String {
        match self {
            // What was drawn in this frame is there in the next.
            _ if !self.is_of(model) => String::new(),
            Self::NewPoint => "new point".to_owned(),
            Self::Place(place) => model.place_name(place),
            Self::Edge([a, b]) => format!("{} to {}", model.place_name(a), model.place_name(b)),
            Self::Rim(thing, top) => {
                format!("{}.{}", model.things[thing].id, if top { "top" } else { "bottom" })
            }
        }
    }

    /// How many strokes of a photograph are about it.
    pub fn count(self, model: &Model, photograph: usize) -> usize {
        let is_it = |stroke: &&Stroke| {
            let is_about = match (stroke, self) {
                (Stroke::Pick { at, .. }, Self::Place(place)) => *at == place,
                (Stroke::Edge { between: [a, b], .. }, Self::Edge(own)) => {
                    own == [*a, *b] || own == [*b, *a]
                }
                (Stroke::Rim { thing, top, .. }, Self::Rim(own, side)) => {
                    (*thing, *top) == (own, side)
                }
                _ => false,
            };
            is_about && !stroke.is_found() && stroke.photograph() == Some(photograph)
        };
        model.strokes.iter().filter(is_it).count()
    }

    /// What comes after it in a photograph: the next corner of the thing without a pick there.
    pub fn next(self, model: &Model, photograph: usize) -> Option<Self> {
        let Self::Place(Place::Corner { thing, corner }) = self else { return Some(self) };
        let count = corner_names(model.things.get(thing)?).len();
        let others = (corner + 1..count).chain(0..corner);
        let places = others.map(|corner| Place::Corner { thing, corner });
        let mut open = places.filter(|place| model.pick_of(photograph, *place).is_none());
        open.next().map(Self::Place)
    }

    /// What a thing begins with in a photograph.
    pub fn first(model: &Model, thing: usize, photograph: usize) -> Option<Self> {
        match model.things.get(thing)?.shape {
            Shape::Cylinder => Some(Self::Rim(thing, true)),
            _ => {
                let first = Place::Corner { thing, corner: 0 };
                match model.pick_of(photograph, first) {
                    None => Some(Self::Place(first)),
                    Some(_) => Self::Place(first).next(model, photograph),
                }
            }
        }
    }
}

impl Selected {
    /// Whether it exists.
    pub fn is_of(self, model: &Model) -> bool {
        match self {
            Self::Nothing => true,
            Self::Thing(index) => index < model.things.len(),
            Self::Point(index) => index < model.points.len(),
            Self::Stroke(index) => index < model.strokes.len(),
        }
    }

    /// The thing that it is or is about.
    pub fn thing(self, model: &Model) -> Option<usize> {
        match self {
            Self::Thing(index) => Some(index),
            Self::Stroke(index) => match model.strokes.get(index)? {
                Stroke::Rim { thing, .. } => Some(*thing),
                stroke => stroke.places().iter().find_map(|place| match place {
                    Place::Corner { thing, .. } => Some(*thing),
                    Place::Point(_) => None,
                }),
            },
            _ => None,
        }
    }
}

/// The edges of a thing as targets.
pub fn edge_targets(model: &Model, thing: usize) -> Vec<Target> {
    let place = |corner: usize| Place::Corner { thing, corner };
    let pairs = edges(&model.things[thing]).into_iter();
    pairs.map(|[a, b]| Target::Edge([place(a), place(b)])).collect()
}
