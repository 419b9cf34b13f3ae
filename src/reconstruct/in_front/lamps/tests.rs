use super::*;

/// Surfaces whose brightness falls by a power, like that of walls beside lamps.
fn surfaces() -> Vec<(f32, f32)> {
    (0..10_000).map(|k| (0.1 * (10_000.0 / (k as f32 + 1.0)).powf(0.3), 0.001)).collect()
}

#[test]
fn a_lamp_stands_out_by_a_gap_and_the_brightest_surface_does_not() {
    assert_eq!(stand_out(surfaces()), None);
    assert_eq!(stand_out(Vec::new()), None);
    let mut cells = surfaces();
    // Thirty cells of a lamp, 0.3 % of the area, with three on its edge.
    cells.extend([(60.0, 0.001); 30]);
    cells.extend([(10.0, 0.001), (20.0, 0.001), (40.0, 0.001)]);
    let limit = stand_out(cells.clone()).unwrap();
    // Above all surfaces, which reach 1.6, and below the lamp.
    assert!((2.0..60.0).contains(&limit), "{limit}");
    // As much light without a gap: sunlit patches of every brightness between, none sending more.
    let patch = |brightness: f32| (brightness, 0.006 / brightness);
    cells.extend((0..300).map(|k| patch(0.4 * 1.0168f32.powi(k))));
    assert_eq!(stand_out(cells), None);
}

#[test]
fn a_white_wall_in_a_dark_room_does_not_stand_out() {
    // Twenty times as bright, on a third of the area.
    let cells = (0..900).map(|k| (if k % 3 == 0 { 2.0 } else { 0.1 }, 0.01)).collect();
    assert_eq!(stand_out(cells), None);
}
