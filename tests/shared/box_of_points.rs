//! Points on a box among wrong ones, as an engine would have found them: a scene of known answer.

use glam::{DMat3, DVec2, DVec3};
use lobelia::model::{FoundCameras, FoundPoint, Lens, Model, Photograph, Place, Point, Stroke};
use lobelia::scene::Camera;

pub const SIZE: (usize, usize) = (1280, 960);
const FOCAL_PX: f64 = 1100.0;
/// The box: middle, turn about the vertical, width, depth and height.
const MIDDLE: DVec2 = DVec2::new(0.4, 0.3);
const YAW: f64 = 0.35;
pub const BOX: DVec3 = DVec3::new(0.5, 0.36, 0.42);
/// Error of points, in metres: half a pixel to one at the distance of the box.
const NOISE_M: f64 = 0.0015;

/// Marsaglia's xorshift.
struct Chance(u64);

impl Chance {
    /// From -1 to 1.
    fn uniform(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn gaussian(&mut self) -> f64 {
        (0..12).map(|_| 0.5 * self.uniform()).sum()
    }

    fn off(&mut self) -> DVec3 {
        NOISE_M * DVec3::new(self.gaussian(), self.gaussian(), self.gaussian())
    }
}

/// Five cameras before the box that look at it from above.
pub fn cameras() -> Vec<Camera> {
    let camera = |k: i32| {
        let angle = -2.1 + 0.12 * f64::from(k);
        let height = 1.3 + 0.1 * f64::from(k % 2);
        let position =
            MIDDLE.extend(0.0) + DVec3::new(2.4 * angle.cos(), 2.4 * angle.sin(), height);
        let back = (position - MIDDLE.extend(0.2)).normalize();
        let x = DVec3::Z.cross(back).normalize();
        let axes = DMat3::from_cols(x, back.cross(x), back);
        let middle = DVec2::new(SIZE.0 as f64, SIZE.1 as f64) / 2.0;
        Camera::new(SIZE, DVec2::splat(FOCAL_PX), middle, Default::default(), axes, position)
    };
    (0..5).map(camera).collect()
}

/// From the middle of the box's bottom, along its axes.
fn on_box(a: f64, b: f64, c: f64) -> DVec3 {
    let x = DVec2::from_angle(YAW);
    (MIDDLE + 0.5 * BOX.x * a * x + 0.5 * BOX.y * b * x.perp()).extend(BOX.z * c)
}

pub fn corners() -> Vec<DVec3> {
    let ring =
        |c: f64| [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(a, b)| on_box(a, b, c));
    [ring(0.0), ring(1.0)].concat()
}

/// Points on the three faces that the cameras see, and wrong ones in the same part of the middle
/// photograph, up to two metres behind and half a metre before: 30 % of all.
pub fn points(per_face: usize) -> Vec<DVec3> {
    let mut chance = Chance(11);
    let mut list = Vec::new();
    for _ in 0..per_face {
        let (a, b) = (chance.uniform(), chance.uniform());
        let c = 0.5 * (1.0 + b);
        list.extend([on_box(a, b, 1.0), on_box(a, -1.0, c), on_box(-1.0, a, c)]);
    }
    for own in &mut list {
        *own += chance.off();
    }
    let eye = cameras()[2].position;
    let wrong = list.len() * 3 / 7;
    for index in 0..wrong {
        let way = list[index * 2] - eye;
        let far = way.length() + 0.75 + 1.25 * chance.uniform();
        list.push(eye + far * way.normalize());
    }
    list
}

/// A model of these points as an engine has them, in coordinates of its own.
pub fn found(points: &[DVec3]) -> Model {
    let turn = DMat3::from_euler(glam::EulerRot::XYZ, 0.3, -1.1, 2.0);
    let own = |place: DVec3| 0.37 * (turn * place) + DVec3::new(3.0, -1.0, 2.0);
    let camera = |mut camera: Camera| {
        camera.world_from_camera = turn * camera.world_from_camera;
        camera.position = own(camera.position);
        camera
    };
    let photographs: Vec<usize> = (0..5).collect();
    let point = |place: &DVec3| FoundPoint {
        position: own(*place),
        photographs: photographs.clone(),
        pixels: Vec::new(),
    };
    let cameras = FoundCameras {
        engine: "test".to_owned(),
        cameras: cameras().into_iter().map(|own| Some(camera(own))).collect(),
        points: points.iter().map(point).collect(),
        ..FoundCameras::default()
    };
    let photograph = |index: usize| Photograph {
        name: format!("images/{index}.exr"),
        lens: 0,
        size: SIZE,
        found: None,
    };
    let lens = Lens {
        id: "lens".into(),
        focal_px: None,
        principal_px: None,
        radial: DVec2::ZERO,
        fit: Default::default(),
    };
    let mut model = Model {
        lenses: vec![lens],
        photographs: (0..5).map(photograph).collect(),
        ..Model::default()
    };
    model.take_found(&cameras);
    model
}

/// The same with four points of known position, which tell where the world lies.
pub fn told(points: &[DVec3]) -> Model {
    let mut model = found(points);
    let places = [(0.0, 0.0, 0.0), (0.8, 0.0, 0.0), (0.0, 0.7, 0.0), (0.9, 0.8, 0.3)];
    for (index, position) in places.map(DVec3::from).into_iter().enumerate() {
        model.points.push(Point { id: format!("p{index}") });
        let at = Place::Point(index);
        model.strokes.push(Stroke::Position { at, position, sd_m: 1e-3 });
        for photograph in [0, 2, 4] {
            let pixel = cameras()[photograph].project(position).unwrap().0;
            model.strokes.push(Stroke::Pick { photograph, at, pixel });
        }
    }
    model
}
