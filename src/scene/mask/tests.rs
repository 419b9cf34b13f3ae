use glam::{DMat3, DVec3, Vec3};

use super::*;
use crate::geometry::bvh::RayCaster;
use crate::geometry::mesh::Mesh;
use crate::scene::{Camera, Distortion};

const SIZE: (usize, usize) = (40, 30);

fn empty() -> Mask {
    Mask::new(SIZE, &[false; 40 * 30])
}

fn is_inside(mask: &Mask, of: impl Fn(DVec2) -> bool) {
    for (index, own) in mask.pixels().into_iter().enumerate() {
        let middle = DVec2::new((index % 40) as f64 + 0.5, (index / 40) as f64 + 0.5);
        assert_eq!(own, of(middle), "{middle}");
    }
}

/// Distance of a point from a line between two, by the nearest of many points on it.
fn distance(from: DVec2, a: DVec2, b: DVec2) -> f64 {
    (0..=4000).map(|t| from.distance(a.lerp(b, f64::from(t) / 4000.0))).fold(f64::MAX, f64::min)
}

#[test]
fn a_brush_covers_what_is_near_its_line() {
    let line = vec![DVec2::new(5.2, 20.1), DVec2::new(22.7, 6.3), DVec2::new(38.0, 29.0)];
    let brush = Shape::Brush { line: line.clone(), radius_px: 3.3 };
    let near = |p: DVec2| line.windows(2).any(|own| distance(p, own[0], own[1]) <= 3.3);
    is_inside(&empty().with(&brush, true), near);
    let dot = Shape::Brush { line: vec![DVec2::new(10.0, 10.0)], radius_px: 4.0 };
    is_inside(&empty().with(&dot, true), |p| p.distance(DVec2::new(10.0, 10.0)) <= 4.0);
    let outside = Shape::Brush { line: vec![DVec2::new(-90.0, 900.0)], radius_px: 4.0 };
    assert_eq!(empty().with(&outside, true), empty());
    assert_eq!(empty().with(&Shape::Brush { line: vec![], radius_px: 4.0 }, true), empty());
}

#[test]
fn lasso_and_box_cover_their_inside() {
    let corners = [DVec2::new(30.2, 4.0), DVec2::new(11.0, 22.4)];
    let between = |p: DVec2| (11.0..=30.2).contains(&p.x) && (4.0..=22.4).contains(&p.y);
    is_inside(&empty().with(&Shape::Box(corners), true), between);
    let (a, b, c) = (DVec2::new(2.3, 3.1), DVec2::new(35.2, 9.4), DVec2::new(14.7, 28.2));
    let left = |p: DVec2, a: DVec2, b: DVec2| (b - a).perp_dot(p - a) > 0.0;
    is_inside(&empty().with(&Shape::Lasso(vec![a, b, c]), true), |p| {
        left(p, a, b) && left(p, b, c) && left(p, c, a)
    });
    assert_eq!(empty().with(&Shape::Lasso(vec![]), true), empty());
}

#[test]
fn what_is_erased_is_kept_again() {
    let all = empty().inverted();
    assert_eq!(all.share(), 1.0);
    assert_eq!(all.inverted(), empty());
    let corners = [DVec2::new(0.0, 0.0), DVec2::new(40.0, 15.0)];
    let half = all.with(&Shape::Box(corners), false);
    assert_eq!(half.share(), 0.5);
    assert_eq!(half.runs(), [600, 600]);
    let meant: Vec<bool> = (0..1200).map(|index| index % 2 == 0).collect();
    assert_eq!(half.with(&Shape::Pixels(meant), true).share(), 0.75);
}

#[test]
fn runs_that_do_not_fill_the_photograph_are_refused() {
    assert_eq!(Mask::from_runs(SIZE, vec![600, 600]).unwrap().share(), 0.5);
    for runs in [vec![], vec![600], vec![600, 601], vec![u32::MAX; 9]] {
        assert_eq!(Mask::from_runs(SIZE, runs), None);
    }
}

/// A square of 1 m, 2 m before the camera, and a wall of two triangles 3 m before it.
#[test]
fn a_surface_is_where_nothing_stands_before_it() {
    let square = |half: f32, z: f32| {
        [[-1, -1], [1, -1], [1, 1], [-1, 1]]
            .map(|[x, y]: [i8; 2]| Vec3::new(half * f32::from(x), half * f32::from(y), -z))
    };
    let mesh = Mesh {
        positions: [square(0.5, 2.0), square(2.0, 3.0)].concat(),
        triangles: vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]],
        surface: vec![3, 3, 7, 7],
        polygon: vec![0, 0, 1, 1],
        ..Mesh::default()
    };
    let caster = RayCaster::build(&mesh.positions, &mesh.triangles);
    let (focal, principal) = (DVec2::splat(20.0), DVec2::new(20.0, 15.0));
    let camera =
        Camera::new(SIZE, focal, principal, Distortion::default(), DMat3::IDENTITY, DVec3::ZERO);
    // 20 pixels a metre at 1 m: 5 to each side for the square, 13.3 for the wall.
    let within = |p: DVec2, half: f64| (p - principal).abs().max_element() < half;
    let of = |surface| showing(&camera, &mesh, &caster, surface, &|| true).unwrap();
    is_inside(&Mask::new(SIZE, &of(3)), |p| within(p, 5.0));
    is_inside(&Mask::new(SIZE, &of(7)), |p| within(p, 40.0 / 3.0) && !within(p, 5.0));
    assert!(of(0).iter().all(|shown| !shown));
    assert_eq!(surface_at(&camera, &mesh, &caster, principal), Some(3));
    assert_eq!(surface_at(&camera, &mesh, &caster, DVec2::new(1.0, 15.0)), None);
    assert_eq!(showing(&camera, &mesh, &caster, 3, &|| false), None);
}
