//! Changes of the edits for relighting. Every function returns the edits as a whole, so that each
//! change can be undone.

use std::f32::consts::TAU;

use glam::{DAffine3, DQuat, DVec3, Quat, Vec3};

use crate::math::blackbody::blackbody;
use crate::math::rgb::Rgb;
use crate::render::edits::{AddedLight, Edits, Shape};
use crate::scene::{Capture, Emitter};

/// Something that was set into the scene, or is known of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Added {
    Light(usize),
    Object(usize),
    /// A known light; it is no part of the edits.
    Known(usize),
}

/// A kind of light that can be made without a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NewLight {
    Area,
    Sphere,
    Point,
    Spot,
    Sun,
}

/// How something is moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motion {
    /// By metres along the axes.
    Move(Vec3),
    /// About its middle.
    Turn(Quat),
    /// By a factor above 0, about its middle.
    Scale(f32),
}

impl NewLight {
    pub const ALL: [Self; 5] = [Self::Area, Self::Sphere, Self::Point, Self::Spot, Self::Sun];

    pub fn name(self) -> &'static str {
        match self {
            Self::Area => "Area",
            Self::Sphere => "Sphere",
            Self::Point => "Point",
            Self::Spot => "Spot",
            Self::Sun => "Sun",
        }
    }

    pub fn help(self) -> &'static str {
        match self {
            Self::Area => "A rectangle that shines from its front, like a panel or a window",
            Self::Sphere => "A ball that shines to all sides, like a frosted bulb",
            Self::Point => "A point that shines to all sides alike; its shadows are hard",
            Self::Spot => "A point that shines into a cone",
            Self::Sun => "Light from one direction, infinitely far away",
        }
    }

    /// Warm white, over the middle of the geometry, about as bright as what lit the photographs.
    pub fn light(self, capture: &Capture, bright: f32) -> AddedLight {
        let (low, high) = capture.mesh.bounds().unwrap_or((Vec3::splat(-1.0), Vec3::ONE));
        let size = (high - low).length().max(1e-3);
        let middle = 0.5 * (low + high);
        let position = middle + Vec3::Z * 0.25 * (high.z - low.z).max(0.4 * size);
        let (side, distance) = (0.06 * size, 0.4 * size);
        // A surface of half reflectance at that distance becomes as bright as the photographs.
        let irradiance = std::f64::consts::PI * f64::from(bright);
        let intensity = irradiance * f64::from(distance * distance);
        let area = |area: f32| intensity / f64::from(area);
        let (emitter, strength) = match self {
            Self::Area => {
                let corner = |x: f32, y: f32| position + Vec3::new(x, y, 0.0) * side;
                let corners =
                    [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
                let panel = Emitter::Rectangle { corners, normal: -Vec3::Z };
                (panel, area(4.0 * side * side))
            }
            Self::Sphere => {
                let radius_m = 0.5 * side;
                let ball = Emitter::Sphere { center: position, radius_m };
                (ball, area(std::f32::consts::PI * radius_m * radius_m))
            }
            Self::Point => (Emitter::Point { position }, intensity),
            Self::Spot => {
                let direction = -Vec3::Z;
                let (inner_angle, outer_angle) = (0.4, 0.6);
                (Emitter::Spot { position, direction, inner_angle, outer_angle }, intensity)
            }
            Self::Sun => {
                let direction = Vec3::new(0.4, 0.5, -0.8).normalize_or(-Vec3::Z);
                let angular_diameter = Emitter::SUN_DIAMETER;
                (Emitter::Sun { direction, angular_diameter }, irradiance)
            }
        };
        let emission = blackbody(4000.0).map(|value| value * strength);
        AddedLight { name: String::new(), shape: Shape::Emitter(emitter), emission, is_on: true }
    }
}

/// A name that none of the others has.
pub fn free_name<'a>(base: &str, others: impl Iterator<Item = &'a str> + Clone) -> String {
    if !base.is_empty() && !others.clone().any(|other| other == base) {
        return base.to_owned();
    }
    let base = base.trim_end_matches(|letter: char| letter.is_ascii_digit()).trim_end();
    let mut number = 1;
    let name = |number: usize| format!("{base} {number}");
    while others.clone().any(|other| other == name(number)) {
        number += 1;
    }
    name(number)
}

/// Adds a light; `bright` is the radiance of what is bright in the photographs.
pub fn with_light(edits: &Edits, kind: NewLight, capture: &Capture, bright: f32) -> Edits {
    let mut light = kind.light(capture, bright);
    let names = edits.lights.iter().map(|light| light.name.as_str());
    light.name = free_name(&format!("{} light 1", kind.name()).to_lowercase(), names);
    let mut edits = edits.clone();
    edits.lights.push(light);
    edits
}

/// Adds what other edits hold: lights and objects get names of their own, all else takes the
/// place of what was there.
pub fn with_edits(edits: &Edits, more: &Edits) -> Edits {
    let mut all = more.clone();
    all.lights.clone_from(&edits.lights);
    all.objects.clone_from(&edits.objects);
    for light in &more.lights {
        let name = free_name(&light.name, all.lights.iter().map(|light| light.name.as_str()));
        all.lights.push(AddedLight { name, ..light.clone() });
    }
    for object in &more.objects {
        let mut object = object.clone();
        object.name = free_name(&object.name, all.objects.iter().map(|own| own.name.as_str()));
        all.objects.push(object);
    }
    all
}

pub fn without(edits: &Edits, item: Added) -> Edits {
    let mut edits = edits.clone();
    match item {
        Added::Light(index) if index < edits.lights.len() => drop(edits.lights.remove(index)),
        Added::Object(index) if index < edits.objects.len() => drop(edits.objects.remove(index)),
        _ => {}
    }
    edits
}

pub fn twin(edits: &Edits, item: Added) -> Edits {
    let one = match item {
        Added::Light(index) => Edits {
            lights: edits.lights.get(index).cloned().into_iter().collect(),
            ..Edits::default()
        },
        Added::Object(index) => Edits {
            objects: edits.objects.get(index).cloned().into_iter().collect(),
            ..Edits::default()
        },
        Added::Known(_) => Edits::default(),
    };
    let mut all = with_edits(edits, &one);
    // Only the one is new.
    all = Edits { lights: all.lights, objects: all.objects, ..edits.clone() };
    all
}

pub fn exists(edits: &Edits, item: Added) -> bool {
    match item {
        Added::Light(index) => index < edits.lights.len(),
        Added::Object(index) => index < edits.objects.len(),
        Added::Known(_) => false,
    }
}

/// The point that something is turned about and drawn at; of what is infinitely far away a point over
/// the scene.
pub fn middle(edits: &Edits, item: Added, bounds: (Vec3, Vec3)) -> Option<Vec3> {
    match item {
        Added::Light(index) => match &edits.lights.get(index)?.shape {
            Shape::Dome(_) => {
                let (low, high) = bounds;
                // On top of the scene, so that it is seen wherever that is.
                Some((0.5 * (low + high)).with_z(high.z))
            }
            Shape::Emitter(Emitter::Sun { direction, .. }) => {
                let (low, high) = bounds;
                Some(0.5 * (low + high) - *direction * 0.4 * (high - low).length())
            }
            Shape::Emitter(emitter) => Some(emitter.extent().0),
        },
        Added::Object(index) => {
            let object = edits.objects.get(index)?;
            let (low, high) = object.mesh.bounds()?;
            let middle = (0.5 * (low + high)).as_dvec3();
            Some(object.world_from_object.transform_point3(middle).as_vec3())
        }
        Added::Known(_) => None,
    }
}

/// How far something reaches from its middle against a direction: what it needs to stand on a
/// surface of that normal.
pub fn reach_m(edits: &Edits, item: Added, normal: Vec3) -> f32 {
    let middle = middle(edits, item, Default::default()).unwrap_or_default();
    match item {
        Added::Light(index) => match edits.lights.get(index).map(|light| &light.shape) {
            Some(Shape::Emitter(Emitter::Sphere { radius_m, .. })) => *radius_m,
            Some(Shape::Emitter(Emitter::Rectangle { corners, .. })) => {
                let away = |corner: &Vec3| (middle - *corner).dot(normal);
                corners.iter().map(away).fold(0.0, f32::max) + 1e-3
            }
            _ => 0.02,
        },
        Added::Object(index) => {
            edits.objects.get(index).map_or(0.0, |object| object.reach_m(middle, normal))
        }
        Added::Known(_) => 0.0,
    }
}

/// Moves a light or an object.
pub fn moved(edits: &Edits, item: Added, motion: Motion) -> Edits {
    let mut edits = edits.clone();
    let pivot = middle(&edits, item, Default::default()).unwrap_or_default();
    let place = |point: Vec3| match motion {
        Motion::Move(by) => point + by,
        Motion::Turn(turn) => pivot + turn * (point - pivot),
        Motion::Scale(factor) => pivot + factor * (point - pivot),
    };
    let turned = |direction: Vec3| match motion {
        Motion::Turn(turn) => (turn * direction).normalize_or(direction),
        _ => direction,
    };
    let factor = if let Motion::Scale(factor) = motion { factor } else { 1.0 };
    match item {
        Added::Light(index) => match edits.lights.get_mut(index) {
            Some(AddedLight { shape: Shape::Dome(dome), emission, .. }) => {
                if let Motion::Turn(turn) = motion {
                    dome.turn = (dome.turn + about_z(turn)).rem_euclid(TAU);
                }
                *emission = emission.map(|value| value * f64::from(factor));
            }
            Some(AddedLight { shape: Shape::Emitter(emitter), .. }) => {
                *emitter = match *emitter {
                    Emitter::Rectangle { corners, normal } => {
                        Emitter::Rectangle { corners: corners.map(place), normal: turned(normal) }
                    }
                    Emitter::Sphere { center, radius_m } => {
                        let radius_m = (factor * radius_m).clamp(1e-4, 1e4);
                        Emitter::Sphere { center: place(center), radius_m }
                    }
                    Emitter::Point { position } => Emitter::Point { position: place(position) },
                    Emitter::Spot { position, direction, inner_angle, outer_angle } => {
                        let (position, direction) = (place(position), turned(direction));
                        Emitter::Spot { position, direction, inner_angle, outer_angle }
                    }
                    Emitter::Sun { direction, angular_diameter } => {
                        Emitter::Sun { direction: turned(direction), angular_diameter }
                    }
                };
            }
            None => {}
        },
        Added::Object(index) => {
            if let Some(object) = edits.objects.get_mut(index) {
                let about = |inner: DAffine3| {
                    let pivot = pivot.as_dvec3();
                    DAffine3::from_translation(pivot) * inner * DAffine3::from_translation(-pivot)
                };
                let by = match motion {
                    Motion::Move(by) => DAffine3::from_translation(by.as_dvec3()),
                    Motion::Turn(turn) => {
                        let turn: DQuat = turn.as_dquat();
                        about(DAffine3::from_quat(turn.normalize()))
                    }
                    Motion::Scale(factor) => {
                        about(DAffine3::from_scale(DVec3::splat(f64::from(factor))))
                    }
                };
                object.world_from_object = by * object.world_from_object;
            }
        }
        Added::Known(_) => {}
    }
    edits
}

/// The part of a rotation that is about z: the only one that a dome can make.
fn about_z(turn: Quat) -> f32 {
    2.0 * turn.z.atan2(turn.w)
}

/// A light's strength, its largest channel, and its colour relative to that.
pub fn strength_and_colour(emission: Rgb) -> (f64, Rgb) {
    let strength = emission.into_iter().fold(0.0, f64::max);
    let colour = if strength > 0.0 { emission.map(|value| value / strength) } else { [1.0; 3] };
    (strength, colour)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::geometry::mesh::Mesh;
    use crate::geometry::solid::Solid;
    use crate::render::edits::Object;
    use crate::scene::Image;

    fn object() -> Object {
        Object {
            name: "cube".into(),
            file: Default::default(),
            mesh: Arc::new(Solid::from(Mesh {
                positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(1.0, 1.0, 2.0)],
                triangles: vec![[0, 1, 2], [1, 2, 3]],
                surface: vec![0, 0],
                polygon: vec![0, 1],
                texcoords: Vec::new(),
            })),
            surfaces: Vec::new(),
            world_from_object: DAffine3::IDENTITY,
        }
    }

    #[test]
    fn every_light_is_moved_turned_and_scaled_about_its_middle() {
        let capture = Capture::default();
        let mut edits = Edits::default();
        for kind in NewLight::ALL {
            edits = with_light(&edits, kind, &capture, 1.0);
        }
        edits = with_light(&edits, NewLight::Area, &capture, 1.0);
        let names: Vec<&str> = edits.lights.iter().map(|light| light.name.as_str()).collect();
        assert_eq!(names[..2], ["area light 1", "sphere light 1"]);
        assert_eq!(names[5], "area light 2");
        let bounds = (-Vec3::ONE, Vec3::ONE);
        for index in 0..4 {
            let item = Added::Light(index);
            let before = middle(&edits, item, bounds).unwrap();
            let by = Vec3::new(0.1, -0.2, 0.3);
            let after = moved(&edits, item, Motion::Move(by));
            assert!((middle(&after, item, bounds).unwrap() - before - by).length() < 1e-5);
            for motion in [Motion::Turn(Quat::from_rotation_x(0.7)), Motion::Scale(2.0)] {
                let after = moved(&edits, item, motion);
                assert!((middle(&after, item, bounds).unwrap() - before).length() < 1e-5);
            }
        }
        let turned = moved(&edits, Added::Light(0), Motion::Turn(Quat::from_rotation_x(0.5)));
        let Shape::Emitter(Emitter::Rectangle { corners, normal }) = turned.lights[0].shape else {
            panic!("an area light")
        };
        assert!(normal.dot(corners[1] - corners[0]).abs() < 1e-5);
        assert!((normal + Quat::from_rotation_x(0.5) * Vec3::Z).length() < 1e-6);
        // A sun has a direction only.
        let sun = moved(&edits, Added::Light(4), Motion::Move(Vec3::ONE));
        assert_eq!(sun.lights[4], edits.lights[4]);
        let grown = moved(&edits, Added::Light(1), Motion::Scale(3.0));
        assert!(
            (reach_m(&grown, Added::Light(1), Vec3::Z) / reach_m(&edits, Added::Light(1), Vec3::Z)
                - 3.0)
                .abs()
                < 1e-5
        );
    }

    #[test]
    fn objects_turn_about_their_middle_and_stand_on_their_lowest_point() {
        let edits = Edits { objects: vec![object()], ..Edits::default() };
        let item = Added::Object(0);
        let at = Vec3::new(0.5, 0.5, 1.0);
        assert_eq!(middle(&edits, item, Default::default()), Some(at));
        let turned = moved(&edits, item, Motion::Turn(Quat::from_rotation_z(1.0)));
        assert!((middle(&turned, item, Default::default()).unwrap() - at).length() < 1e-6);
        assert!((reach_m(&turned, item, Vec3::Z) - 1.0).abs() < 1e-6);
        let scaled = moved(&turned, item, Motion::Scale(0.5));
        assert!((reach_m(&scaled, item, Vec3::Z) - 0.5).abs() < 1e-6);
        let two = twin(&scaled, item);
        assert_eq!((two.objects.len(), two.objects[1].name.as_str()), (2, "cube 1"));
        assert_eq!(without(&two, Added::Object(1)), scaled);
        assert_eq!(without(&two, Added::Light(3)), two, "what is not there is not missed");
    }

    #[test]
    fn a_dome_is_turned_about_the_vertical_and_scaled_in_brightness() {
        let image = Arc::new(Image::new(2, 1, vec![[1.0; 3]; 2], None));
        let shape = Shape::Dome(crate::scene::Dome::new(image, 1.0));
        let sky = AddedLight { name: "sky".into(), shape, emission: [1.0; 3], is_on: true };
        let edits = Edits { lights: vec![sky], ..Edits::default() };
        let (item, bounds) = (Added::Light(0), (-Vec3::ONE, Vec3::ONE));
        assert_eq!(middle(&edits, item, bounds), Some(Vec3::Z));
        assert_eq!(moved(&edits, item, Motion::Move(Vec3::X)), edits);
        let dome = |edits: &Edits| match &edits.lights[0].shape {
            Shape::Dome(dome) => dome.clone(),
            Shape::Emitter(_) => panic!("a dome"),
        };
        let by = |angle: f32| Motion::Turn(Quat::from_rotation_z(angle));
        let turned = moved(&edits, item, by(0.5));
        assert!((dome(&turned).turn - 0.5).abs() < 1e-6);
        // What shone from −y shines from there turned.
        let towards = Quat::from_rotation_z(0.5) * -Vec3::Y;
        assert!((dome(&turned).middle() - towards).length() < 1e-6);
        let back = moved(&turned, item, by(-0.7));
        assert!((dome(&back).turn - (std::f32::consts::TAU - 0.2)).abs() < 1e-5);
        let scaled = moved(&edits, item, Motion::Scale(2.0));
        assert_eq!((scaled.lights[0].emission, dome(&scaled)), ([2.0; 3], dome(&edits)));
        assert_eq!(with_edits(&edits, &edits).lights[1].name, "sky 1");
    }
}
