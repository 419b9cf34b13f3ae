//! Changes of a model that keep it consistent: if something is removed, everything that refers to
//! it is removed too, and a thing stays listed before those that stand on it.

use super::things::{corner_names, parameters};
use super::{Axis, Model, Place, Shape, Side, Stroke, Support, Surfaces, Thing};

impl Model {
    /// A name that no thing or point has yet: `base1`, `base2` and so on.
    pub fn free_name(&self, base: &str) -> String {
        let mut names = (1..).map(|number| format!("{base}{number}"));
        names.find(|name| self.is_free_name(name)).unwrap_or_default()
    }

    /// Whether a thing or a point may get this name: no other has it, and it holds no full stop,
    /// which separates a thing from its corners.
    pub fn is_free_name(&self, name: &str) -> bool {
        !name.is_empty()
            && !name.contains('.')
            && self.things.iter().all(|own| own.id != name)
            && self.points.iter().all(|own| own.id != name)
    }

    /// Adds a thing with a name of its own, on the floor where it can stand there; its index.
    pub fn add_thing(&mut self, shape: Shape) -> usize {
        let on = match shape {
            Shape::Polygon { .. } => Support::Free,
            _ => Support::Floor,
        };
        let id = self.free_name(shape.name());
        let surfaces = Surfaces::default();
        self.things.push(Thing { id, shape, on, held: Vec::new(), surfaces });
        self.things.len() - 1
    }

    /// A twin of a thing without its strokes: its shape, support, surfaces and typed sizes, but
    /// not where it stands; its index.
    pub fn duplicate_thing(&mut self, index: usize) -> usize {
        let mut twin = self.things[index].clone();
        twin.id = self.free_name(twin.shape.name());
        let is_place = |name: &str| {
            let letters = name.trim_end_matches(|c: char| c.is_ascii_digit());
            ["x", "y", "z", "yaw", "along", "up"].contains(&letters)
        };
        twin.held.retain(|(name, _)| !is_place(name));
        self.things.push(twin);
        self.things.len() - 1
    }

    /// Removes a thing and the strokes about it. What stood on it stands on the floor then, what
    /// lay in a side of it lies free, and a box that was flush with it stands by itself.
    pub fn remove_thing(&mut self, index: usize) {
        self.strokes.retain(|stroke| !is_about(stroke, index));
        for thing in &mut self.things {
            leave(thing, |host, _| host == index);
        }
        self.things.remove(index);
        self.refer(|other| if other > index { other - 1 } else { other });
    }

    /// Puts another thing in the place of one. Corners are known by their names: strokes about
    /// those that are gone go with them, and so do typed numbers. Lines that were found to be its
    /// edges go if it may lie elsewhere now. The index that it has then: it is listed behind what
    /// carries it.
    pub fn change_thing(&mut self, index: usize, mut thing: Thing) -> usize {
        let old = &self.things[index];
        if (&old.shape, old.on, &old.held) != (&thing.shape, thing.on, &thing.held) {
            self.forget_found(Some(index));
        }
        let before = corner_names(&self.things[index]);
        let after = corner_names(&thing);
        let is_round = thing.shape == Shape::Cylinder;
        self.strokes.retain_mut(|stroke| {
            let mut stays = match stroke {
                Stroke::Rim { thing, .. } => *thing != index || is_round,
                _ => true,
            };
            for place in stroke.places_mut() {
                if let Place::Corner { thing, corner } = place
                    && *thing == index
                {
                    match after.iter().position(|name| *name == before[*corner]) {
                        Some(new) => *corner = new,
                        None => stays = false,
                    }
                }
            }
            stays
        });
        let known = parameters(&thing);
        thing.held.retain(|(name, _)| known.iter().any(|own| own.name == *name));
        let (sides, has_top) = (thing.shape.sides(), thing.shape.has_top());
        self.things[index] = thing;
        for other in &mut self.things {
            leave(other, |host, side| host == index && side.map_or(!has_top, |own| own >= sides));
        }
        self.order(index)
    }

    /// Whether thing `host` can carry thing `index`: it is not carried by that itself.
    pub fn can_carry(&self, host: usize, index: usize) -> bool {
        let mut next = vec![host];
        let mut steps = 0;
        while let Some(own) = next.pop() {
            steps += 1;
            if own == index || steps > self.things.len() * self.things.len() + 1 {
                return false;
            }
            next.extend(carriers(&self.things[own]));
        }
        true
    }

    /// Removes a point and the strokes about it.
    pub fn remove_point(&mut self, index: usize) {
        self.strokes.retain(|stroke| !stroke.places().contains(&Place::Point(index)));
        self.points.remove(index);
        for place in self.strokes.iter_mut().flat_map(|stroke| stroke.places_mut()) {
            if let Place::Point(own) = place
                && *own > index
            {
                *own -= 1;
            }
        }
    }

    /// Adds a drawn stroke or a typed number, before the lines that were found to be edges; its index.
    pub fn add_stroke(&mut self, stroke: Stroke) -> usize {
        let index = self.drawn();
        self.strokes.insert(index, stroke);
        index
    }

    /// How many strokes were drawn or typed.
    pub fn drawn(&self) -> usize {
        self.strokes.iter().position(Stroke::is_found).unwrap_or(self.strokes.len())
    }

    /// Removes the lines that were found to be edges: those of one thing, or of all.
    pub fn forget_found(&mut self, thing: Option<usize>) {
        let is_about = |stroke: &Stroke| thing.is_none_or(|thing| is_about(stroke, thing));
        self.strokes.retain(|stroke| !(stroke.is_found() && is_about(stroke)));
    }

    /// The pick of a place in a photograph, by its index.
    pub fn pick_of(&self, photograph: usize, place: Place) -> Option<usize> {
        self.strokes.iter().position(|stroke| match stroke {
            Stroke::Pick { photograph: own, at, .. } => *own == photograph && *at == place,
            _ => false,
        })
    }

    /// Sorts things behind what carries them, all else in its order; where `index` is then.
    fn order(&mut self, index: usize) -> usize {
        let count = self.things.len();
        let mut sorted: Vec<usize> = Vec::with_capacity(count);
        while sorted.len() < count {
            let is_ready = |own: &usize| {
                !sorted.contains(own)
                    && carriers(&self.things[*own]).all(|host| sorted.contains(&host))
            };
            // A circle has no order: it is left for the check to name.
            let Some(next) = (0..count).find(is_ready) else { return index };
            sorted.push(next);
        }
        let place = |own: usize| sorted.iter().position(|other| *other == own).unwrap_or(own);
        let places: Vec<usize> = (0..count).map(place).collect();
        let things = sorted.iter().map(|&own| self.things[own].clone()).collect();
        self.things = things;
        self.refer(|own| places[own]);
        places[index]
    }

    /// Gives things new indices wherever they are named.
    fn refer(&mut self, to: impl Fn(usize) -> usize) {
        for thing in &mut self.things {
            match &mut thing.on {
                Support::Top(host) | Support::Side(Side { thing: host, .. }) => *host = to(*host),
                Support::Floor | Support::Free => {}
            }
            if let Shape::Box { flush: Some(side) } = &mut thing.shape {
                side.thing = to(side.thing);
            }
        }
        for stroke in &mut self.strokes {
            if let Stroke::Rim { thing, .. } = stroke {
                *thing = to(*thing);
            }
            for place in stroke.places_mut() {
                if let Place::Corner { thing, .. } = place {
                    *thing = to(*thing);
                }
            }
        }
    }
}

impl Stroke {
    /// The corners and points that it is about, to be replaced.
    pub fn places_mut(&mut self) -> &mut [Place] {
        match self {
            Self::Line { .. } | Self::Rim { .. } => &mut [],
            Self::Pick { at, .. } | Self::Position { at, .. } => std::slice::from_mut(at),
            Self::Edge { between, .. } | Self::Length { between, .. } => between,
        }
    }

    /// The axis of a line.
    pub fn axis(&self) -> Option<Axis> {
        match self {
            Self::Line { axis, .. } => Some(*axis),
            _ => None,
        }
    }
}

/// What a thing stands on, lies in or is flush with.
fn carriers(thing: &Thing) -> impl Iterator<Item = usize> + use<> {
    let on = match thing.on {
        Support::Top(host) | Support::Side(Side { thing: host, .. }) => Some(host),
        Support::Floor | Support::Free => None,
    };
    let flush = match thing.shape {
        Shape::Box { flush: Some(side) } => Some(side.thing),
        _ => None,
    };
    on.into_iter().chain(flush)
}

fn is_about(stroke: &Stroke, index: usize) -> bool {
    let is_own = |place: &Place| matches!(place, Place::Corner { thing, .. } if *thing == index);
    matches!(stroke, Stroke::Rim { thing, .. } if *thing == index)
        || stroke.places().iter().any(is_own)
}

/// Takes a thing off the hosts that are gone, which are told by index and side.
fn leave(thing: &mut Thing, is_gone: impl Fn(usize, Option<usize>) -> bool) {
    let is_polygon = matches!(thing.shape, Shape::Polygon { .. });
    match thing.on {
        Support::Top(host) if is_gone(host, None) => thing.on = Support::Floor,
        Support::Side(side) if is_polygon && is_gone(side.thing, Some(side.index)) => {
            thing.on = Support::Free;
        }
        _ => {}
    }
    if let Shape::Box { flush } = &mut thing.shape
        && flush.is_some_and(|side| is_gone(side.thing, Some(side.index)))
    {
        *flush = None;
    }
    let known = parameters(thing);
    thing.held.retain(|(name, _)| known.iter().any(|own| own.name == *name));
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;
    use crate::model::Point;

    fn cube() -> Shape {
        Shape::Box { flush: None }
    }

    fn pick(thing: usize, corner: usize) -> Stroke {
        let at = Place::Corner { thing, corner };
        Stroke::Pick { photograph: 0, at, pixel: DVec2::splat(corner as f64) }
    }

    /// A room, a table flush with its wall, a box on the table, a poster in the wall.
    fn furnished() -> Model {
        let mut model = Model::default();
        let room = Shape::Room { corners: 6, rectilinear: true, openings: Vec::new() };
        model.add_thing(room);
        model.add_thing(Shape::Box { flush: Some(Side { thing: 0, index: 4 }) });
        model.add_thing(cube());
        model.things[2].on = Support::Top(1);
        model.add_thing(Shape::Polygon { corners: 4 });
        model.things[3].on = Support::Side(Side { thing: 0, index: 1 });
        model.points = vec![Point { id: "p1".into() }, Point { id: "p2".into() }];
        let between = [Place::Point(1), Place::Corner { thing: 2, corner: 7 }];
        let length = Stroke::Length { between, length_m: 1.0, sd_m: 1e-3 };
        model.strokes = vec![pick(0, 11), pick(1, 3), pick(2, 6), pick(3, 0), length];
        model
    }

    #[test]
    fn names_are_free() {
        let mut model = furnished();
        let ids: Vec<&str> = model.things.iter().map(|own| own.id.as_str()).collect();
        assert_eq!(ids, ["room1", "box1", "box2", "polygon1"]);
        model.things[0].held.push(("height".into(), 2.5));
        model.things[0].held.push(("x1".into(), 0.0));
        let twin = model.duplicate_thing(0);
        assert_eq!(model.things[twin].id, "room2");
        assert_eq!(model.things[twin].held, [("height".to_owned(), 2.5)]);
    }

    #[test]
    fn what_is_removed_takes_its_strokes_along_and_lets_go_of_others() {
        let mut model = furnished();
        model.remove_thing(1);
        assert_eq!(model.things[1].on, Support::Floor, "the box on it");
        assert_eq!(model.strokes.len(), 4);
        assert_eq!(model.strokes[1], pick(1, 6));
        model.remove_thing(0);
        assert_eq!(model.things[1].on, Support::Free, "the poster");
        assert_eq!(model.strokes[..2], [pick(0, 6), pick(1, 0)]);
        model.remove_point(0);
        let between = [Place::Point(0), Place::Corner { thing: 0, corner: 7 }];
        assert_eq!(model.strokes[2].places(), between);
        model.remove_point(0);
        assert_eq!(model.strokes.len(), 2);
    }

    #[test]
    fn corners_keep_their_strokes_by_name() {
        let mut model = furnished();
        let mut room = model.things[0].clone();
        room.shape = Shape::Room { corners: 8, rectilinear: true, openings: Vec::new() };
        model.change_thing(0, room.clone());
        // ceiling6 is corner 13 of sixteen.
        assert_eq!(
            model.strokes[0],
            Stroke::Pick {
                photograph: 0,
                at: Place::Corner { thing: 0, corner: 13 },
                pixel: DVec2::splat(11.0),
            }
        );
        room.shape = Shape::Room { corners: 4, rectilinear: true, openings: Vec::new() };
        model.change_thing(0, room);
        assert_eq!(model.strokes.len(), 4, "ceiling6 is gone");
        assert_eq!(model.things[1].shape, cube(), "and wall 5");
    }

    #[test]
    fn things_come_behind_what_carries_them() {
        let mut model = furnished();
        let last = model.add_thing(cube());
        assert!(model.can_carry(last, 2) && !model.can_carry(2, 1) && !model.can_carry(1, 1));
        let moved = Thing { on: Support::Top(last), ..model.things[2].clone() };
        let index = model.change_thing(2, moved);
        let ids: Vec<&str> = model.things.iter().map(|own| own.id.as_str()).collect();
        assert_eq!(ids, ["room1", "box1", "polygon1", "box3", "box2"]);
        assert_eq!((index, model.things[4].on), (4, Support::Top(3)));
        assert_eq!(model.strokes[2], pick(4, 6));
        assert_eq!(model.strokes[3], pick(2, 0));
    }
}
