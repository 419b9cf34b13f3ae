//! Lines that are found in pictures of known lines.

use glam::DVec2;
use lobelia::model::lines::{Line, Picture, detect};

use crate::painted::painted;

const SIZE: (usize, usize) = (240, 240);

/// A rectangle of 150 × 90 px, turned.
fn rectangle(turn: f64, middle: DVec2) -> Vec<DVec2> {
    let turn = DVec2::from_angle(turn);
    let corners = [(-75.0, -45.0), (75.0, -45.0), (75.0, 45.0), (-75.0, 45.0)];
    corners.map(|(x, y)| middle + turn.rotate(DVec2::new(x, y))).into()
}

fn found(pixels: &[[u8; 3]], step: usize) -> Vec<Line> {
    detect(&Picture { pixels, width: SIZE.0, height: SIZE.1, step })
}

/// By how much the line nearest to a side misses it: the farther end along the side, both ends
/// across it (in pixels), and its direction in degrees.
fn errors(lines: &[Line], [a, b]: [DVec2; 2]) -> [f64; 3] {
    let along = (b - a).normalize();
    let across = |place: DVec2| (place - a).perp_dot(along).abs();
    let off = |line: &Line| across(line.ends[0]).max(across(line.ends[1]));
    let line = lines.iter().min_by(|a, b| off(a).total_cmp(&off(b))).expect("a line");
    let mut ends = line.ends;
    if (ends[1] - ends[0]).dot(along) < 0.0 {
        ends.swap(0, 1);
    }
    let ends_off = (ends[0] - a).dot(along).abs().max((ends[1] - b).dot(along).abs());
    let turn = line.direction().perp_dot(along).abs().asin().to_degrees();
    [ends_off, off(line), turn]
}

/// Four lines and no more, in every direction, light on dark and dark on light. The ends are within
/// 0.15 px along the line without noise and 0.4 px with noise of four of 255 greys, where the step is
/// of 60 or 110; across it and in direction the lines are within 0.2 px and 0.2°.
#[test]
fn the_sides_of_rectangles_are_found() {
    for (noise, most) in [(0.0, 0.15), (4.0, 0.4)] {
        let mut worst = [0.0_f64; 3];
        let mut squares = 0.0;
        for k in 0..24 {
            let turn = (k as f64 * 7.5 + 0.3).to_radians();
            let middle = DVec2::new(120.0 + 0.37 * k as f64 % 1.0, 119.0 + 0.61 * k as f64 % 1.0);
            let corners = rectangle(turn, middle);
            let [ground, grey] = if k % 2 == 0 { [90.0, 150.0] } else { [170.0, 60.0] };
            let lines = found(&painted(SIZE, &[(corners.clone(), grey)], ground, noise), 1);
            assert_eq!(lines.len(), 4, "turned by {:.1}°, noise {noise}", turn.to_degrees());
            for side in 0..4 {
                let own = errors(&lines, [corners[side], corners[(side + 1) % 4]]);
                worst = std::array::from_fn(|k| worst[k].max(own[k]));
                squares += own[1] * own[1];
            }
        }
        let rms = (squares / 96.0_f64).sqrt();
        println!("noise {noise}: along {}, across {} px, {}°, {rms}", worst[0], worst[1], worst[2]);
        // Of the farther end; the sides are of 90 and 150 pixels.
        assert!(rms < 0.055, "{rms}");
        assert!(worst[0] < most && worst[1] < 0.2 && worst[2] < 0.2, "{worst:?}");
    }
}

#[test]
fn pixels_are_those_of_the_photograph() {
    let corners = rectangle(0.4, DVec2::new(120.2, 118.9));
    let pixels = painted(SIZE, &[(corners, 60.0)], 170.0, 0.0);
    let (own, large) = (found(&pixels, 1), found(&pixels, 3));
    assert_eq!(own.len(), large.len());
    for (a, b) in own.iter().zip(&large) {
        for (a, b) in a.ends.iter().zip(&b.ends) {
            assert!((*a * 3.0).distance(*b) < 1e-9, "{a} {b}");
        }
    }
    assert_eq!(own, found(&pixels, 1));
}

#[test]
fn where_there_are_no_lines_none_are_found() {
    let count = SIZE.0 * SIZE.1;
    assert_eq!(found(&vec![[120; 3]; count], 1), []);
    let ramp: Vec<[u8; 3]> = (0..count).map(|index| [(index % SIZE.0) as u8; 3]).collect();
    assert_eq!(found(&ramp, 1), []);
    let noise = painted(SIZE, &[], 120.0, 20.0);
    // LSD lets one line in noise pass on average, by its construction.
    assert!(found(&noise, 1).len() <= 1, "noise alone");
    // Fewer pixels than the picture says that it has, and none.
    assert_eq!(found(&[[0; 3]; 7], 1), []);
    assert_eq!(detect(&Picture { pixels: &[], width: 0, height: 0, step: 1 }), []);
}
