//! A floor with a print under cameras that stand around it, with and without a red ball that the
//! mesh lacks. What a pixel shows is worked out in closed form.

use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3, Vec3};

use super::*;
use crate::geometry::mesh::Mesh;
use crate::scene::{Camera, Distortion, Image, Material, MaterialKind, Photograph, Role, Surface};

const WIDTH: usize = 96;
const HEIGHT: usize = 72;
const BALL: (DVec3, f64) = (DVec3::new(0.1, -0.2, 0.4), 0.35);

fn camera(angle: f64) -> Camera {
    let position = DVec3::new(2.4 * angle.cos(), 2.4 * angle.sin(), 1.7);
    let back = (position - DVec3::new(0.0, 0.0, 0.1)).normalize();
    let right = DVec3::Z.cross(back).normalize();
    let axes = DMat3::from_cols(right, back.cross(right), back);
    let focal = DVec2::splat(90.0);
    let principal = DVec2::new(0.5 * WIDTH as f64, 0.5 * HEIGHT as f64);
    Camera::new((WIDTH, HEIGHT), focal, principal, Distortion::default(), axes, position)
}

fn meets_ball(camera: &Camera, direction: DVec3) -> bool {
    let from = camera.position - BALL.0;
    let along = from.dot(direction);
    along < 0.0 && from.length_squared() - along * along < BALL.1 * BALL.1
}

/// The photographs, and for each pixel whether it shows the ball.
fn scene(has_ball: bool, highlight: f32) -> (Capture, Vec<Vec<bool>>) {
    let corner = |x: f32, y: f32| Vec3::new(3.0 * x, 3.0 * y, 0.0);
    let positions =
        vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    let mesh = Mesh {
        positions,
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        surface: vec![0, 0],
        polygon: vec![0, 0],
        ..Mesh::default()
    };
    let (mut photographs, mut balls) = (Vec::new(), Vec::new());
    for index in 0..6 {
        let camera = camera(index as f64);
        let (mut pixels, mut ball) = (Vec::new(), Vec::new());
        for (y, x) in (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| (y, x))) {
            let direction = camera.direction(DVec2::new(x as f64 + 0.5, y as f64 + 0.5)).unwrap();
            ball.push(has_ball && meets_ball(&camera, direction));
            if ball[pixels.len()] {
                pixels.push([0.4, 0.08, 0.05]);
                continue;
            }
            let place = camera.position - direction * (camera.position.z / direction.z);
            let print = 0.3 + 0.1 * ((3.0 * place.x).sin() * (2.0 * place.y).cos()) as f32;
            // A lamp over the middle, mirrored by the floor.
            let mirrored = DVec3::new(direction.x, direction.y, -direction.z);
            let lamp = (DVec3::new(0.0, 0.0, 2.0) - place).normalize();
            let gloss = highlight * (mirrored.dot(lamp).max(0.0).powi(20)) as f32;
            pixels.push([print + gloss, 0.9 * print + gloss, 0.7 * print + gloss]);
        }
        let image = Some(Arc::new(Image::new(WIDTH, HEIGHT, pixels, None)));
        photographs.push(Photograph { name: format!("{index}.exr"), camera, image, display: None });
        balls.push(ball);
    }
    let surface = Surface { name: "floor".into(), role: Role::Untagged, has_texcoords: false };
    let capture = Capture {
        mesh: Arc::new(mesh),
        surfaces: vec![surface],
        photographs,
        ..Capture::default()
    };
    (capture, balls)
}

/// The parts of the ball, and of all else, that are masked at a threshold.
fn parts(capture: &Capture, balls: &[Vec<bool>], threshold: f64) -> [f64; 2] {
    let masks = suggest(capture, threshold, &Watch::new()).unwrap();
    assert_eq!(masks.len(), balls.len());
    let pairs = || {
        let both = |(mask, ball): (&Suggestion, &Vec<bool>)| {
            std::iter::zip(mask.is_masked.clone(), ball.clone()).collect::<Vec<_>>()
        };
        std::iter::zip(&masks, balls).flat_map(both)
    };
    [true, false].map(|of_ball| {
        let all = pairs().filter(|(_, ball)| *ball == of_ball);
        let masked = all.clone().filter(|(masked, _)| *masked).count();
        masked as f64 / all.count().max(1) as f64
    })
}

#[test]
fn a_ball_that_was_not_modelled_is_found() {
    let (capture, balls) = scene(true, 0.0);
    let [ball, rest] = parts(&capture, &balls, SUGGESTED);
    assert!(ball > 0.9, "{ball}");
    // The mask is widened by a pixel, and photographs are smoothed.
    assert!(rest < 0.06, "{rest}");
}

#[test]
fn nothing_is_found_where_nothing_is() {
    for (highlight, threshold) in [(0.0, SUGGESTED), (0.2, CERTAIN)] {
        let (capture, balls) = scene(false, highlight);
        let [_, rest] = parts(&capture, &balls, threshold);
        assert!(rest < 0.01, "{highlight}: {rest}");
    }
}

/// Tags the floor with a material of this kind.
fn tagged(mut capture: Capture, kind: MaterialKind) -> Capture {
    capture.materials = vec![Material {
        name: "floor".into(),
        kind,
        surfaces: vec![0],
        textured: false,
        known_diffuse: None,
        known_diffuse_sd: None,
    }];
    capture.surfaces[0].role = Role::Material(0);
    capture
}

#[test]
fn a_highlight_is_nothing_odd_on_a_specular_floor() {
    let (capture, balls) = scene(false, 2.0);
    let [_, diffuse] = parts(&tagged(capture.clone(), MaterialKind::Diffuse), &balls, SUGGESTED);
    let [_, specular] = parts(&tagged(capture, MaterialKind::Specular), &balls, SUGGESTED);
    assert!(specular < 0.002 && specular < 0.5 * diffuse, "{specular}, {diffuse}");
    let (capture, balls) = scene(true, 0.0);
    let [ball, _] = parts(&tagged(capture, MaterialKind::Specular), &balls, SUGGESTED);
    assert!(ball > 0.5, "{ball}");
}

#[test]
fn what_one_photograph_shows_is_compared_with_the_usual_color() {
    let (mut capture, balls) = scene(true, 0.0);
    // The others measure nothing.
    for photograph in &mut capture.photographs[1..] {
        let nothing = vec![[f32::NAN; 3]; WIDTH * HEIGHT];
        photograph.image = Some(Arc::new(Image::new(WIDTH, HEIGHT, nothing, None)));
    }
    let masked = |threshold: f64| {
        let masks = suggest(&capture, threshold, &Watch::new()).unwrap();
        let of_ball = |of_ball: bool| {
            let pairs = std::iter::zip(&masks[0].is_masked, &balls[0]);
            let own: Vec<bool> = pairs.filter(|own| *own.1 == of_ball).map(|own| *own.0).collect();
            own.iter().filter(|&&own| own).count() as f64 / own.len() as f64
        };
        [of_ball(true), of_ball(false)]
    };
    let [ball, rest] = masked(SUGGESTED);
    assert!(ball > 0.8 && rest < 0.06, "{ball}, {rest}");
    assert_eq!(masked(CERTAIN), [0.0, 0.0]);
}

#[test]
fn a_value_between_those_of_the_pixels_around_is_nothing_odd() {
    let camera = camera(0.0);
    let ramp = (0..WIDTH * HEIGHT).map(|index| [(0.1 * (index % WIDTH) as f32).exp(); 3]).collect();
    let image = Some(Arc::new(Image::new(WIDTH, HEIGHT, ramp, None)));
    let mut capture = scene(false, 0.0).0;
    capture.photographs = vec![Photograph { name: "0.exr".into(), camera, image, display: None }];
    let caster = RayCaster::build(&capture.mesh.positions, &capture.mesh.triangles);
    let views = Views::new(&capture, &caster, &Watch::new()).unwrap();
    let small = SmallView::new(&views, 0, LONGEST_SIDE).unwrap();
    let beyond = |log: f32| small.beyond(DVec2::new(40.0, 30.0), [log; 3]).unwrap()[0];
    // Around are columns 39 and 40.
    let [least, most] = [39, 40].map(|x| small.log[30 * WIDTH + x][0]);
    assert_eq!(beyond(least + 0.3 * (most - least)), 0.0);
    assert!((beyond(most + 0.2) - 0.2).abs() < 1e-5);
    assert!((beyond(least - 0.1) + 0.1).abs() < 1e-5);
}

#[test]
fn a_photograph_that_is_exposed_differently_is_nothing_odd() {
    let (mut capture, balls) = scene(false, 0.0);
    let image = Arc::make_mut(capture.photographs[2].image.as_mut().unwrap());
    image.scale(|_, _| 1.25);
    let [_, rest] = parts(&capture, &balls, SUGGESTED);
    assert!(rest < 0.01, "{rest}");
}

#[test]
fn two_photographs_do_not_tell_which_of_them_is_right() {
    let (mut capture, _) = scene(true, 0.0);
    capture.photographs.truncate(2);
    let masks = suggest(&capture, SUGGESTED, &Watch::new()).unwrap();
    assert!(masks.iter().all(|mask| mask.share() == 0.0));
    capture.photographs.clear();
    assert!(suggest(&capture, SUGGESTED, &Watch::new()).unwrap().is_empty());
}

#[test]
fn masks_that_are_there_and_the_number_of_threads_change_nothing() {
    let (mut capture, _) = scene(true, 0.1);
    let on = |capture: &Capture, threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| suggest(capture, SUGGESTED, &Watch::new()).unwrap())
    };
    let alone = on(&capture, 1);
    let image = capture.photographs[0].image.as_mut().unwrap();
    Arc::make_mut(image).mask(|x, _| x < 30);
    assert_eq!(alone, on(&capture, 3));
}

#[test]
fn a_suggestion_can_be_cancelled() {
    let watch = Watch::new();
    watch.cancel();
    assert!(suggest(&scene(true, 0.0).0, SUGGESTED, &watch).is_err());
}
