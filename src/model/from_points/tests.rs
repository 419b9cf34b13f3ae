use glam::{DVec2, DVec3};

use super::holds;
use super::plane::{dense, ends, most, rectangle};
use super::solid::{Known, NoBox, solid};
use crate::math::sampling::Random;

/// Uniform from -1 to 1.
fn uniform(random: &mut Random) -> f64 {
    2.0 * f64::from(random.uniform()) - 1.0
}

/// Nearly Gaussian, of standard deviation 1.
fn gaussian(random: &mut Random) -> f64 {
    (0..12).map(|_| 0.5 * uniform(random)).sum()
}

fn cube(random: &mut Random) -> DVec3 {
    DVec3::new(uniform(random), uniform(random), uniform(random))
}

/// Of 500 points 30 % lie anywhere, the others 2 mm from the plane: it comes back to 1 mm over its
/// whole extent, and hardly a wrong point is taken for one of it.
#[test]
fn a_plane_among_outliers_comes_back() {
    for seed in 0..20 {
        let mut random = Random::new(seed, 0, 0);
        let normal = cube(&mut random).normalize();
        let (x, y) = normal.any_orthonormal_pair();
        let on = |random: &mut Random| {
            let (a, b) = (uniform(random), 0.6 * uniform(random));
            (0.3 + 0.002 * gaussian(random)) * normal + a * x + b * y
        };
        let mut points: Vec<DVec3> = (0..350).map(|_| on(&mut random)).collect();
        points.extend((0..150).map(|_| cube(&mut random)));
        let (plane, found) = most(&points, 0.01).unwrap();
        let corners = [(1.0, 0.6), (-1.0, 0.6), (1.0, -0.6), (-1.0, -0.6)];
        for (a, b) in corners {
            let off = plane.distance(0.3 * normal + a * x + b * y).abs();
            assert!(off < 0.001, "{off} m at a corner, seed {seed}");
        }
        let own = found.iter().filter(|&&index| index < 350).count();
        let wrong = found.len() - own;
        assert!(own >= 340 && wrong <= 6, "{own} and {wrong} wrong, seed {seed}");
        // The same points give the same plane.
        assert_eq!(most(&points, 0.01).unwrap().1, found);
    }
}

#[test]
fn points_that_show_no_plane_give_none() {
    assert!(most(&[], 0.01).is_none());
    assert!(most(&[DVec3::ZERO, DVec3::X], 0.01).is_none());
    assert!(most(&[DVec3::ONE; 40], 0.01).is_none(), "one place");
    let line: Vec<DVec3> = (0..40).map(|k| DVec3::X * f64::from(k)).collect();
    assert!(most(&line, 0.01).is_none_or(|own| own.0.normal.is_finite()), "on a line");
}

/// The smallest rectangle around a turned one, its first axis nearest to the first of the plane.
#[test]
fn rectangles_are_the_smallest_or_level() {
    let mut random = Random::new(3, 0, 0);
    for degrees in [0.0_f64, 20.0, -40.0, 75.0] {
        let axis = DVec2::from_angle(degrees.to_radians());
        let point = |random: &mut Random| {
            axis * (2.0 * uniform(random)) + axis.perp() * uniform(random) + DVec2::splat(5.0)
        };
        let points: Vec<DVec2> = (0..3000).map(|_| point(&mut random)).collect();
        let found = rectangle(&points).unwrap();
        let size = found.high - found.low;
        let turned = found.axis.perp_dot(axis).abs().min(found.axis.dot(axis).abs());
        assert!(turned < 0.02, "{degrees}°: {found:?}");
        assert!(found.axis.x >= found.axis.y.abs());
        let [a, b] = [size.max_element(), size.min_element()];
        assert!((a - 4.0).abs() < 0.05 && (b - 2.0).abs() < 0.05, "{degrees}°: {size}");
    }
    // A disc has no direction of its own: it stays level.
    let disc: Vec<DVec2> = (0..90).map(|k| DVec2::from_angle(f64::from(k) * 0.07)).collect();
    assert_eq!(rectangle(&disc).unwrap().axis, DVec2::X);
    assert!(rectangle(&[]).is_none() && rectangle(&[DVec2::ONE; 5]).is_none());
}

#[test]
fn points_by_themselves_are_left_out() {
    let mut points: Vec<DVec2> =
        (0..100).map(|k| DVec2::new(f64::from(k % 10), f64::from(k / 10))).collect();
    points.extend([DVec2::new(40.0, 3.0), DVec2::new(41.0, 3.0)]);
    assert_eq!(dense(&points), (0..100).collect::<Vec<_>>());
}

/// Numbers of one row reach as far as they do; one or two beyond it belong to something else.
#[test]
fn ends_are_those_of_the_row() {
    let row: Vec<f64> = (0..100).map(|k| f64::from(k) * 0.01).collect();
    assert_eq!(ends(row.clone()), [0.0, 0.99]);
    for beyond in [vec![-0.3], vec![1.4], vec![-0.5, -0.49, 1.3], vec![-4.0, 1.2, 9.0]] {
        assert_eq!(ends([row.clone(), beyond.clone()].concat()), [0.0, 0.99], "{beyond:?}");
    }
    assert_eq!(ends(vec![]), [0.0, 0.0]);
    assert_eq!(ends(vec![2.0, 1.0]), [1.0, 2.0]);
    assert_eq!(ends(vec![0.0, 1.0, 5.0]), [0.0, 5.0], "too few to tell");
}

#[test]
fn outlines_go_around_places() {
    let outline = [(0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (5.0, 4.0), (0.0, 10.0)];
    let outline = outline.map(DVec2::from);
    assert!(holds(&outline, DVec2::new(2.0, 5.0)) && holds(&outline, DVec2::new(5.0, 3.0)));
    assert!(!holds(&outline, DVec2::new(5.0, 7.0)) && !holds(&outline, DVec2::new(-1.0, 5.0)));
    assert!(!holds(&[], DVec2::ONE) && !holds(&outline[..2], DVec2::new(5.0, 0.0)));
}

/// What is no box is told by what is missing.
#[test]
fn points_without_a_box_are_told_apart() {
    let mut random = Random::new(5, 0, 0);
    let floor = |_: DVec2, _: f64| None;
    let eye = DVec3::new(0.5, -4.0, 3.0);
    let known = Known { up: DVec3::Z, is_up_told: true, eye, reach: 0.02, floor: &floor };
    let face = |random: &mut Random, normal: DVec3| -> Vec<DVec3> {
        (0..200).map(|_| cube(random).reject_from(normal)).collect()
    };
    let scattered: Vec<DVec3> = (0..300).map(|_| cube(&mut random)).collect();
    assert_eq!(solid(&scattered, &known).unwrap_err(), NoBox::Shapeless);
    let slanted = face(&mut random, DVec3::ONE.normalize());
    assert_eq!(solid(&slanted, &known).unwrap_err(), NoBox::Shapeless);
    let side = face(&mut random, DVec3::Y);
    assert_eq!(solid(&side, &known).unwrap_err(), NoBox::Flat);
    let top = face(&mut random, DVec3::Z);
    assert_eq!(solid(&top, &known).unwrap_err(), NoBox::Bottomless);
    // The same with a floor that is known: a box between the two.
    let floor = |_: DVec2, _: f64| Some(-0.5);
    let own = solid(&top, &Known { floor: &floor, ..known }).unwrap();
    assert!((own.corners[0].z + 0.5).abs() < 1e-9 && own.corners[4].z.abs() < 1e-3);
}
