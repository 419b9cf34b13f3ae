use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3};

use super::*;
use crate::scene::{Camera, Distortion, Image, Photograph};

fn capture(photographs: usize, side: usize) -> Capture {
    let photograph = || {
        let focal = DVec2::splat(side as f64);
        let camera = Camera::new(
            (side, side),
            focal,
            0.5 * focal,
            Distortion::default(),
            DMat3::IDENTITY,
            DVec3::ZERO,
        );
        let image = Image::new(side, side, vec![[0.5; 3]; side * side], None);
        Photograph { name: String::new(), camera, image: Some(Arc::new(image)), display: None }
    };
    Capture { photographs: (0..photographs).map(|_| photograph()).collect(), ..Capture::default() }
}

#[test]
fn what_photographs_take_grows_with_their_pixels() {
    let options = Options::default();
    let need = |count, side| MemoryNeed::on_threads(&capture(count, side), &options, 2);
    let (one, two) = (need(1, 100), need(2, 100));
    assert_eq!(two.loaded - one.loaded, 6 * 100 * 100);
    assert_eq!(two.held - one.held, 16 * 100 * 100);
    // From some number of pixels on, less is held of each.
    let many = need(2, 4000);
    assert_eq!(many.held, 2 * 4000 * 4000);
    assert_eq!(many.peak(), many.loaded + many.more().max(many.loading));
}

/// The shipped example takes 0.13 GB, and 0.5 GB were foreseen once: twenty times the lobes that it has.
#[test]
fn little_is_foreseen_for_a_small_capture() {
    let need = MemoryNeed::on_threads(&capture(6, 600), &Options::default(), 2);
    assert!((130 << 20..360 << 20).contains(&need.peak()), "{}", need.peak() >> 20);
}

#[test]
fn a_run_that_does_not_fit_is_refused_with_what_to_change() {
    let few = MemoryNeed {
        loaded: 0,
        in_files: 0,
        loading: 0,
        held: 0,
        stages: [3 << 30, 0, 0, 5 << 30, 4 << 30],
    };
    assert!(few.check(5 << 30, Method::Joint).is_ok());
    let refused = |need: &MemoryNeed, method| need.check(1 << 29, method).unwrap_err().to_string();
    let text = refused(&few, Method::Joint);
    assert!(text.contains("5.0 GB") && text.contains("solve") && text.contains("0.5 GB"), "{text}");
    assert!(text.contains("joint.light_sets"), "{text}");
    assert!(refused(&few, Method::Paper).contains("lobes.grid"));
    let textures = MemoryNeed { stages: [0, 0, 0, 0, 1 << 30], ..few };
    assert!(refused(&textures, Method::Joint).contains("textures.max_side"));
    let photographs = MemoryNeed { held: 9 << 30, ..few };
    let text = refused(&photographs, Method::Joint);
    assert!(text.contains("14.0 GB") && text.contains("leave photographs out"), "{text}");
}
