//! Cameras that an external program (an engine) has found in coordinates of its own, and the guess
//! of their place in the world where no stroke determines it.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DMat3, DQuat, DVec2, DVec3};

use super::things::{self, Kind};
use super::tracks;
use super::{Fit, Lens, Model, Pose, Stroke, Thing};
use crate::scene::Camera;

/// How far what is photographed is taken to be, in metres, where no length is known.
const ORDINARY_M: f64 = 2.0;
/// The cosine of the largest angle between up by both rules: 30°.
const ALIKE: f64 = 0.866;
/// Height of a camera above the floor, in metres, where no point tells where that is.
const EYE_M: f64 = 1.5;
/// Part of the points that is taken to lie below the floor, by error.
const BELOW: f64 = 0.05;

/// The cameras and points that an engine has found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FoundCameras {
    /// Its name.
    pub engine: String,
    /// By photograph; `None` where it could not be placed.
    pub cameras: Vec<Option<Camera>>,
    /// Points that several photographs show.
    pub points: Vec<FoundPoint>,
    /// How far points are from where the photographs show them: the median, in pixels.
    pub error_px: Option<f64>,
    /// Its unit is the metre.
    pub in_metres: bool,
}

/// A point of an engine.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundPoint {
    /// In the engine's coordinates.
    pub position: DVec3,
    /// The photographs that show it, by index.
    pub photographs: Vec<usize>,
    /// Where each of these shows it, in pixels; empty where that is not known.
    pub pixels: Vec<DVec2>,
}

/// Where an engine has placed a photograph.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FoundPose {
    /// In the engine's coordinates.
    pub pose: Pose,
    /// How far what it shows is, in the engine's unit.
    pub distance: f64,
}

/// From the coordinates of an engine to the world: world = scale · rotation · found + shift.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Similarity {
    /// Metres in the engine's unit.
    pub scale: f64,
    /// A rotation.
    pub rotation: DMat3,
    /// In metres.
    pub shift: DVec3,
}

impl Default for Similarity {
    fn default() -> Self {
        Self { scale: 1.0, rotation: DMat3::IDENTITY, shift: DVec3::ZERO }
    }
}

impl Similarity {
    /// After a change of the scale's logarithm, a turn about the world's axes, and a shift.
    pub fn moved(&self, [scale, x, y, z, shift @ ..]: [f64; 7]) -> Self {
        let turn = DQuat::from_scaled_axis(DVec3::new(x, y, z));
        let turned = DMat3::from_quat(turn) * self.rotation;
        Self {
            scale: self.scale * scale.exp(),
            // Many small turns would let rounding grow.
            rotation: DMat3::from_quat(DQuat::from_mat3(&turned).normalize()),
            shift: self.shift + DVec3::from(shift),
        }
    }

    /// Brings a point into the world.
    pub fn point(&self, found: DVec3) -> DVec3 {
        self.scale * (self.rotation * found) + self.shift
    }

    /// A camera's pose in the world, as it is in the coordinates of what was found.
    pub fn back(&self, pose: &Pose) -> Pose {
        let back = self.rotation.transpose();
        Pose {
            world_from_camera: back * pose.world_from_camera,
            position: back * ((pose.position - self.shift) / self.scale),
        }
    }

    /// Brings a camera's pose into the world.
    pub fn pose(&self, found: &Pose) -> Pose {
        let world_from_camera = self.rotation * found.world_from_camera;
        Pose { world_from_camera, position: self.point(found.position) }
    }
}

/// Whether each point is among the first so many that one of its photographs shows.
pub fn are_first<'a>(points: impl IntoIterator<Item = &'a FoundPoint>, count: usize) -> Vec<bool> {
    let mut counts: HashMap<usize, usize> = HashMap::new();
    let is_first = |point: &FoundPoint| {
        let mut is_first = false;
        for &photograph in &point.photographs {
            let before = counts.entry(photograph).or_default();
            is_first |= *before < count;
            *before += 1;
        }
        is_first
    };
    points.into_iter().map(is_first).collect()
}

impl FoundCameras {
    /// The photographs that were placed.
    pub fn placed(&self) -> usize {
        self.cameras.iter().flatten().count()
    }

    /// Where each photograph was placed.
    pub fn poses(&self) -> Vec<Option<FoundPose>> {
        let centre = mean(self.cameras.iter().flatten().map(|camera| camera.position));
        let pose = |index: usize| {
            let camera = self.cameras[index].as_ref()?;
            let (world_from_camera, position) = (camera.world_from_camera, camera.position);
            let seen = self.points.iter().filter(|own| own.photographs.contains(&index));
            let far = median(seen.map(|own| own.position.distance(position)).collect());
            let distance = far.unwrap_or_else(|| position.distance(centre)).max(1e-9);
            Some(FoundPose { pose: Pose { world_from_camera, position }, distance })
        };
        (0..self.cameras.len()).map(pose).collect()
    }
}

impl Model {
    /// Takes over what an engine has found, in place of what another found before. Focal length and
    /// k1 are adjusted further where its points tell of them, and lenses are held as it says
    /// otherwise. Photographs that it could not place keep their strokes.
    pub fn take_found(&mut self, found: &FoundCameras) {
        for (photograph, pose) in self.photographs.iter_mut().zip(found.poses()) {
            photograph.found = pose;
        }
        self.found_points = Arc::new(found.points.clone());
        self.found_in_metres = found.in_metres;
        let count = self.photographs.len();
        let tracked = tracks::is_tracked(&tracks::chosen(&self.found_points, count), count);
        let mut taken: Vec<(usize, &Camera)> = Vec::new();
        for (index, camera) in found.cameras.iter().enumerate() {
            let (Some(camera), true) = (camera, index < self.photographs.len()) else { continue };
            let shared = taken.iter().find(|own| is_one_lens(own.1, camera)).map(|own| own.0);
            self.photographs[index].lens = shared.unwrap_or_else(|| {
                let old = self.photographs[index].lens;
                let lens = match taken.iter().any(|own| own.0 == old) {
                    true => self.further_lens(old),
                    false => old,
                };
                taken.push((lens, camera));
                lens
            });
        }
        for (lens, camera) in taken {
            let [k1, k2, ..] = camera.distortion.radial;
            let own = &mut self.lenses[lens];
            own.focal_px = Some(0.5 * (camera.focal_px.x + camera.focal_px.y));
            own.principal_px = Some(camera.principal_px);
            own.radial = DVec2::new(k1, k2);
            let is_told = |photograph: usize| {
                tracked[photograph] && self.photographs[photograph].lens == lens
            };
            let is_told = (0..tracked.len()).any(is_told);
            own.fit = Fit { focal: is_told, principal: false, k1: is_told, k2: false };
        }
    }

    /// Whether an engine has placed any photograph.
    pub fn has_found(&self) -> bool {
        self.photographs.iter().any(|own| own.found.is_some())
    }

    /// Forgets what an engine found: of one photograph, or of all.
    pub fn drop_found(&mut self, photograph: Option<usize>) {
        for (index, own) in self.photographs.iter_mut().enumerate() {
            if photograph.is_none_or(|wanted| wanted == index) {
                own.found = None;
            }
        }
        if !self.has_found() {
            self.found_points = Arc::default();
            self.found_in_metres = false;
        }
    }

    /// Whether the unit of what was found is all that tells how large the world is: it is in metres,
    /// and no length is given.
    pub fn scale_is_found(&self) -> bool {
        let tells = |stroke: &Stroke| match stroke {
            Stroke::Length { .. } => 2,
            Stroke::Position { .. } => 1,
            _ => 0,
        };
        let told: usize = self.strokes.iter().map(tells).sum();
        let is_length = |thing: &Thing, name: &String| {
            let all = things::parameters(thing);
            all.iter().any(|own| own.name == *name && own.kind == Kind::Length)
        };
        let is_held = |thing: &Thing| thing.held.iter().any(|(name, _)| is_length(thing, name));
        self.found_in_metres && self.has_found() && told < 2 && !self.things.iter().any(is_held)
    }

    /// A lens of its own, like another; its index.
    fn further_lens(&mut self, like: usize) -> usize {
        let is_free = |id: &String| self.lenses.iter().all(|other| other.id != *id);
        let id = (2..).map(|number| format!("lens{number}")).find(is_free).unwrap_or_default();
        self.lenses.push(Lens { id, ..self.lenses[like].clone() });
        self.lenses.len() - 1
    }
}

fn is_one_lens(a: &Camera, b: &Camera) -> bool {
    let numbers =
        |own: &Camera| ((own.width, own.height), own.focal_px, own.principal_px, own.distortion);
    numbers(a) == numbers(b)
}

/// A place in the world for what an engine has found, where nothing is said: up is as the
/// photographs were held, what they show is two metres away, its lowest points lie on the floor,
/// and the origin is below its middle. The rotation may be known, and the scale.
pub fn guess(
    poses: &[Option<FoundPose>],
    points: &[DVec3],
    rotation: Option<DMat3>,
    scale: Option<f64>,
) -> Similarity {
    let placed: Vec<&FoundPose> = poses.iter().flatten().collect();
    let rotation = rotation.unwrap_or_else(|| level(&placed));
    let far = median(placed.iter().map(|own| own.distance).collect()).unwrap_or(1.0);
    let scale = scale.unwrap_or(ORDINARY_M / far.max(1e-12));
    let turned = Similarity { scale, rotation, shift: DVec3::ZERO };
    let cameras = || placed.iter().map(|own| turned.point(own.pose.position));
    let mut points: Vec<DVec3> = points.iter().map(|own| turned.point(*own)).collect();
    let (middle, floor) = if points.is_empty() {
        let middle = mean(cameras());
        (middle, middle.z - EYE_M)
    } else {
        let axis = |k: usize| median(points.iter().map(|own| own[k]).collect()).unwrap_or(0.0);
        let middle = DVec3::new(axis(0), axis(1), 0.0);
        points.sort_by(|a, b| a.z.total_cmp(&b.z));
        (middle, points[(BELOW * points.len() as f64) as usize].z)
    };
    Similarity { shift: -middle.with_z(floor), ..turned }
}

/// The rotation after which photographs were held upright, as far as possible at once: people tilt
/// cameras up and down, and seldom to the side, so that the horizontal axes of all photographs lie
/// in one plane. The first photograph looks along y.
fn level(placed: &[&FoundPose]) -> DMat3 {
    let up = mean(placed.iter().map(|own| own.pose.world_from_camera.y_axis));
    let mut up = up.try_normalize().unwrap_or(DVec3::Z);
    // The direction that is most nearly at right angles to all horizontal axes, by the power method
    // on what they leave; where all look alike, it stays near the mean.
    let mut moments = DMat3::ZERO;
    for own in placed {
        let x = own.pose.world_from_camera.x_axis;
        moments += DMat3::from_cols(x * x.x, x * x.y, x * x.z);
    }
    let rest = DMat3::IDENTITY * (placed.len() as f64 + 1e-9) - moments;
    let held = up;
    for _ in 0..200 {
        up = (rest * up).try_normalize().unwrap_or(up);
    }
    // Photographs from nearly one direction do not tell it, and some are held to the side.
    if up.dot(held) < ALIKE {
        up = held;
    }
    let first = placed.first().map_or(DVec3::Y, |own| -own.pose.world_from_camera.z_axis);
    turned(up, first)
}

/// The rotation that takes `up` to z, and `ahead` as nearly to y as that allows.
pub(super) fn turned(up: DVec3, ahead: DVec3) -> DMat3 {
    let ahead = ahead - up * ahead.dot(up);
    let y = ahead.try_normalize().filter(|_| ahead.length() > 1e-6);
    let y = y.unwrap_or_else(|| up.any_orthonormal_vector());
    DMat3::from_cols(y.cross(up), y, up).transpose()
}

fn mean(positions: impl Iterator<Item = DVec3>) -> DVec3 {
    let (sum, count) = positions.fold((DVec3::ZERO, 0), |(sum, count), own| (sum + own, count + 1));
    sum / f64::from(count.max(1))
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.retain(|own| own.is_finite());
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}
