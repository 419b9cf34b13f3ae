//! Parameters and corners of things.

use super::{Shape, Side, Support, Thing};
use crate::model::jet::{Jet, Jet3};

/// What a parameter measures, which says how it changes when the world is moved, turned about the
/// vertical, or scaled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A coordinate in the world, in metres; 0, 1, 2 for x, y, z.
    Coordinate(usize),
    /// Metres.
    Length,
    /// An angle about the vertical, in radians, counted from x towards y.
    Yaw,
    /// A pure number.
    Ratio,
}

/// A parameter of a thing.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// As files and messages call it.
    pub name: String,
    /// What it measures.
    pub kind: Kind,
}

/// The parameters of a thing, in the order that [`corners`] takes them in.
///
/// | shape | parameters |
/// |---|---|
/// | room | `x1 y1 … xn yn height`; rectilinear `x1 … x(n/2) y1 … y(n/2) height`; then for each opening `ID.left ID.bottom ID.width ID.height` |
/// | box | `x y yaw width depth height` of its middle; flush: `along width depth height` |
/// | prism | `x1 y1 … xn yn height` |
/// | cylinder | `x y radius height` |
/// | polygon | lying: `x1 y1 …`; in a side `along1 up1 …`; free `x1 y1 z1 x2 … z3`, then `a4 b4 …` |
pub fn parameters(thing: &Thing) -> Vec<Parameter> {
    let mut list = Vec::new();
    let mut put = |name: String, kind: Kind| list.push(Parameter { name, kind });
    let axis = ["x", "y", "z"];
    match &thing.shape {
        Shape::Room { corners, rectilinear, openings } => {
            if *rectilinear {
                for (k, name) in axis.iter().enumerate().take(2) {
                    (1..=corners / 2).for_each(|i| put(format!("{name}{i}"), Kind::Coordinate(k)));
                }
            } else {
                outline(*corners, &mut put);
            }
            put("height".into(), Kind::Length);
            for opening in openings {
                for name in ["left", "bottom", "width", "height"] {
                    put(format!("{}.{name}", opening.id), Kind::Length);
                }
            }
        }
        Shape::Box { flush: None } => {
            put("x".into(), Kind::Coordinate(0));
            put("y".into(), Kind::Coordinate(1));
            put("yaw".into(), Kind::Yaw);
            ["width", "depth", "height"].into_iter().for_each(|n| put(n.into(), Kind::Length));
        }
        Shape::Box { flush: Some(_) } => {
            for name in ["along", "width", "depth", "height"] {
                put(name.into(), Kind::Length);
            }
        }
        Shape::Prism { corners } => {
            outline(*corners, &mut put);
            put("height".into(), Kind::Length);
        }
        Shape::Cylinder => {
            put("x".into(), Kind::Coordinate(0));
            put("y".into(), Kind::Coordinate(1));
            ["radius", "height"].into_iter().for_each(|n| put(n.into(), Kind::Length));
        }
        Shape::Polygon { corners } => match thing.on {
            Support::Floor | Support::Top(_) => outline(*corners, &mut put),
            Support::Side(_) => {
                for i in 1..=*corners {
                    put(format!("along{i}"), Kind::Length);
                    put(format!("up{i}"), Kind::Length);
                }
            }
            Support::Free => {
                for i in 1..=3 {
                    (0..3).for_each(|k| put(format!("{}{i}", axis[k]), Kind::Coordinate(k)));
                }
                for i in 4..=*corners {
                    put(format!("a{i}"), Kind::Ratio);
                    put(format!("b{i}"), Kind::Ratio);
                }
            }
        },
    }
    list
}

fn outline(corners: usize, put: &mut impl FnMut(String, Kind)) {
    for i in 1..=corners {
        put(format!("x{i}"), Kind::Coordinate(0));
        put(format!("y{i}"), Kind::Coordinate(1));
    }
}

/// The names of the corners, in the order in which [`corners`] gives them. Outlines run
/// counter-clockwise seen from above (from the front, for what lies in a side).
pub fn corner_names(thing: &Thing) -> Vec<String> {
    let ring = |name: &str, count: usize| -> Vec<String> {
        (1..=count).map(|i| format!("{name}{i}")).collect()
    };
    match &thing.shape {
        Shape::Room { corners, openings, .. } => {
            let mut names = [ring("floor", *corners), ring("ceiling", *corners)].concat();
            openings.iter().for_each(|opening| names.extend(ring(&opening.id, 4)));
            names
        }
        Shape::Box { .. } => [ring("bottom", 4), ring("top", 4)].concat(),
        Shape::Prism { corners } => [ring("bottom", *corners), ring("top", *corners)].concat(),
        Shape::Cylinder => Vec::new(),
        Shape::Polygon { corners } => ring("corner", *corners),
    }
}

/// The corners of thing `index`, in metres. `values` has the parameters of every thing.
pub fn corners(things: &[Thing], index: usize, values: &[Vec<Jet>]) -> Vec<Jet3> {
    let (thing, own) = (&things[index], values[index].as_slice());
    let low = base(things, index, values);
    match &thing.shape {
        Shape::Room { corners, rectilinear, openings } => {
            let floor = floor_of_room(*corners, *rectilinear, own);
            let (tall, rest) = heights(own, if *rectilinear { *corners } else { 2 * corners });
            let mut all = raised(&floor, &low, tall);
            for (opening, numbers) in openings.iter().zip(rest.chunks_exact(4)) {
                let wall = Wall::between(&all[(opening.wall + 1) % corners], &all[opening.wall]);
                let [left, bottom, width, height] = numbers else { continue };
                let (right, top) = (left + width, bottom + height);
                for (s, t) in [(left, bottom), (&right, bottom), (&right, &top), (left, &top)] {
                    let corner = wall.at(s, t);
                    all.push(corner);
                }
            }
            all
        }
        Shape::Box { flush: None } => {
            let [x, y, yaw, width, depth, height] = own else { return Vec::new() };
            let (sin, cos) = yaw.sin_cos();
            let ring = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(a, b)| {
                let (u, v) = (width * a, depth * b);
                let along_x = &(&u * &cos) - &(&v * &sin);
                let along_y = &(&u * &sin) + &(&v * &cos);
                [x + &along_x, y + &along_y]
            });
            raised(&ring, &low, height)
        }
        Shape::Box { flush: Some(side) } => {
            let [along, width, depth, height] = own else { return Vec::new() };
            let wall = side_of(things, *side, values);
            let far = along + width;
            let none = Jet::constant(0.0);
            let ring = [(&far, &none), (along, &none), (along, depth), (&far, depth)]
                .map(|(s, out)| wall.before(s, out));
            raised(&ring, &low, height)
        }
        Shape::Prism { corners } => {
            let (tall, _) = heights(own, 2 * corners);
            raised(&pairs(&own[..2 * corners]), &low, tall)
        }
        Shape::Cylinder => Vec::new(),
        Shape::Polygon { corners } => match thing.on {
            Support::Floor | Support::Top(_) => {
                let ring = pairs(&own[..2 * corners]);
                ring.into_iter().map(|[x, y]| [x, y, low.clone()]).collect()
            }
            Support::Side(side) => {
                let wall = side_of(things, side, values);
                own.as_chunks::<2>().0.iter().map(|[s, t]| wall.at(s, t)).collect()
            }
            Support::Free => free_polygon(own),
        },
    }
}

/// The middles of a cylinder's bottom and top circle and their radius; `None` for other things.
pub fn rims(things: &[Thing], index: usize, values: &[Vec<Jet>]) -> Option<([Jet3; 2], Jet)> {
    let [x, y, radius, height] = values[index].as_slice() else { return None };
    if things[index].shape != Shape::Cylinder {
        return None;
    }
    let low = base(things, index, values);
    let high = &low + height;
    Some(([[x.clone(), y.clone(), low], [x.clone(), y.clone(), high]], radius.clone()))
}

/// The height of what a thing stands on.
fn base(things: &[Thing], index: usize, values: &[Vec<Jet>]) -> Jet {
    let Support::Top(host) = things[index].on else { return Jet::constant(0.0) };
    let low = base(things, host, values);
    let place = parameters(&things[host]).iter().position(|own| own.name == "height");
    place.map_or(low.clone(), |place| &low + &values[host][place])
}

fn heights(own: &[Jet], at: usize) -> (&Jet, &[Jet]) {
    (&own[at], &own[at + 1..])
}

fn pairs(own: &[Jet]) -> Vec<[Jet; 2]> {
    own.as_chunks::<2>().0.to_vec()
}

fn floor_of_room(corners: usize, rectilinear: bool, own: &[Jet]) -> Vec<[Jet; 2]> {
    if !rectilinear {
        return pairs(&own[..2 * corners]);
    }
    // Corners 1 and 2 share y1, 2 and 3 share x2, and so on around to x1.
    let half = corners / 2;
    let at = |i: usize| [own[i.div_ceil(2) % half].clone(), own[half + i / 2].clone()];
    (0..corners).map(at).collect()
}

/// The outline at the height `low`, and then again `tall` above it.
fn raised(ring: &[[Jet; 2]], low: &Jet, tall: &Jet) -> Vec<Jet3> {
    let high = low + tall;
    let at = |z: &Jet| -> Vec<Jet3> {
        ring.iter().map(|[x, y]| [x.clone(), y.clone(), z.clone()]).collect()
    };
    [low, &high].map(at).concat()
}

/// Three free corners, and others as p1 + a (p2 − p1) + b (p3 − p1).
fn free_polygon(own: &[Jet]) -> Vec<Jet3> {
    let (first, rest) = own.split_at(9);
    let mut all: Vec<Jet3> = first.as_chunks::<3>().0.to_vec();
    for [a, b] in rest.as_chunks::<2>().0 {
        let corner = std::array::from_fn(|k| {
            let u = a * &(&all[1][k] - &all[0][k]);
            let v = b * &(&all[2][k] - &all[0][k]);
            &(&all[0][k] + &u) + &v
        });
        all.push(corner);
    }
    all
}

/// The upright side of a thing. A room is seen from inside, other things from outside.
fn side_of(things: &[Thing], side: Side, values: &[Vec<Jet>]) -> Wall {
    let corners = corners(things, side.thing, values);
    let count = things[side.thing].shape.sides();
    let ends = [&corners[side.index], &corners[(side.index + 1) % count]];
    match things[side.thing].shape {
        Shape::Room { .. } => Wall::between(ends[1], ends[0]),
        _ => Wall::between(ends[0], ends[1]),
    }
}

/// An upright plane with metres along it, from the left to the right as it is seen, and up.
struct Wall {
    from: Jet3,
    along: [Jet; 2],
}

impl Wall {
    fn between(from: &Jet3, to: &Jet3) -> Self {
        let (dx, dy) = (&to[0] - &from[0], &to[1] - &from[1]);
        let inverse = (&(&dx * &dx) + &(&dy * &dy)).sqrt().recip();
        Self { from: from.clone(), along: [&dx * &inverse, &dy * &inverse] }
    }

    fn at(&self, s: &Jet, t: &Jet) -> Jet3 {
        let [dx, dy] = &self.along;
        [&self.from[0] + &(s * dx), &self.from[1] + &(s * dy), &self.from[2] + t]
    }

    /// A place in plan, `out` metres before the wall.
    fn before(&self, s: &Jet, out: &Jet) -> [Jet; 2] {
        let [dx, dy] = &self.along;
        let x = &(&self.from[0] + &(s * dx)) + &(out * dy);
        let y = &(&self.from[1] + &(s * dy)) - &(out * dx);
        [x, y]
    }
}
