//! Every degradation does to the shipped example what it says, by measures of its own.

use std::path::Path;
use std::sync::LazyLock;

use lobelia::io::capture;
use lobelia::reconstruct::Options;
use lobelia::scene::Capture;
use lobelia::study::degradation::Degradation;
use lobelia::study::degrade::{Degraded, degrade};
use lobelia::watch::Watch;

static CORNER: LazyLock<Capture> = LazyLock::new(|| {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/examples/corner");
    capture::load(&folder, &Watch::new()).unwrap()
});

fn worse(degradation: Degradation, level: f64, seed: u64) -> Degraded {
    degrade(&CORNER, &Options::default(), degradation, level, seed, &Watch::new()).unwrap()
}

/// Valid pixels of both captures, side by side.
fn pixels(other: &Capture) -> Vec<([f32; 3], [f32; 3])> {
    CORNER
        .measurements()
        .zip(other.measurements())
        .flat_map(|((_, _, a), (_, _, b))| {
            (0..a.height()).flat_map(move |y| {
                (0..a.width()).filter_map(move |x| Some((a.radiance(x, y)?, b.radiance(x, y)?)))
            })
        })
        .collect()
}

#[test]
fn noise_is_as_strong_as_it_says() {
    let worse = worse(Degradation::Noise, 5.0, 1);
    let pairs = pixels(&worse.capture);
    let mean = pairs.iter().flat_map(|(a, _)| a).map(|&v| f64::from(v)).sum::<f64>()
        / (3 * pairs.len()) as f64;
    // Where noise is far below the value, so that nothing was cut off at zero.
    let scaled: Vec<f64> = pairs
        .iter()
        .flat_map(|(a, b)| (0..3).map(move |c| (f64::from(a[c]), f64::from(b[c]))))
        .filter(|(a, _)| *a > 0.1 * mean)
        .map(|(a, b)| (b - a) / (a * mean).sqrt())
        .collect();
    let count = scaled.len() as f64;
    let average = scaled.iter().sum::<f64>() / count;
    let sd = (scaled.iter().map(|v| v * v).sum::<f64>() / count).sqrt();
    // Five standard errors.
    assert!(average.abs() < 5.0 * 0.05 / count.sqrt(), "{average}");
    assert!((sd / 0.05 - 1.0).abs() < 5.0 / (2.0 * count).sqrt(), "{sd}");
}

#[test]
fn saturation_takes_its_part_of_the_pixels() {
    let clean = pixels(&CORNER).len() as f64;
    for level in [5.0, 30.0] {
        let left = pixels(&worse(Degradation::Saturation, level, 1).capture).len() as f64;
        assert!((1.0 - left / clean - 0.01 * level).abs() < 0.005, "{level}: {left} of {clean}");
    }
}

#[test]
fn cameras_are_misplaced_by_their_pixels() {
    let worse = worse(Degradation::Misregistration, 2.0, 3);
    for (a, b) in CORNER.photographs.iter().zip(&worse.capture.photographs) {
        let squares: Vec<f64> = CORNER
            .mesh
            .positions
            .iter()
            .map(|p| p.as_dvec3())
            .filter_map(|p| Some(a.camera.project(p)?.0.distance_squared(b.camera.project(p)?.0)))
            .collect();
        let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        assert!((rms - 2.0).abs() < 0.05, "{rms}");
        let turned = b.camera.world_from_camera;
        assert!((turned.determinant() - 1.0).abs() < 1e-9, "a rotation");
    }
}

#[test]
fn gains_are_per_photograph_and_colour_is_per_channel() {
    let color = pixels(&worse(Degradation::LightColor, 9.0, 1).capture);
    for (a, b) in color.iter().step_by(97) {
        for (c, gain) in [3.0, 1.0, 1.0 / 3.0].into_iter().enumerate() {
            assert!((b[c] - gain * a[c]).abs() <= 1e-5 * a[c].max(1e-3));
        }
    }
    let exposed = worse(Degradation::Exposure, 20.0, 1);
    let mut gains = Vec::new();
    for ((_, _, a), (_, _, b)) in CORNER.measurements().zip(exposed.capture.measurements()) {
        let ratio =
            |x: usize, y: usize| b.radiance(x, y).unwrap()[1] / a.radiance(x, y).unwrap()[1];
        assert!((ratio(10, 10) - ratio(50, 30)).abs() < 1e-4);
        gains.push(ratio(10, 10));
    }
    assert!(gains.windows(2).any(|pair| (pair[0] - pair[1]).abs() > 0.01));
}

#[test]
fn geometry_and_tags_change_alone() {
    let missing = worse(Degradation::MissingSurfaces, 2.0, 1).capture;
    let surfaces = |capture: &Capture| {
        let mut all = capture.mesh.surface.clone();
        all.sort_unstable();
        all.dedup();
        all.len()
    };
    assert_eq!(surfaces(&missing) + 2, surfaces(&CORNER));

    let moved = worse(Degradation::MovedVertices, 1.0, 1).capture;
    let (low, high) = CORNER.mesh.bounds().unwrap();
    let half_diagonal = 0.5 * (high - low).length();
    let pairs = || CORNER.mesh.positions.iter().zip(&moved.mesh.positions);
    let rms = (pairs().map(|(a, b)| (*a - *b).length_squared()).sum::<f32>()
        / (3 * CORNER.mesh.positions.len()) as f32)
        .sqrt();
    let expected = 0.01 * half_diagonal;
    assert!(rms > 0.6 * expected && rms < 1.6 * expected, "{rms}, not {expected}");
    for (a, b) in pairs() {
        for (c, d) in pairs() {
            assert!(a != c || b == d, "corners at one place move together");
        }
    }

    let merged = worse(Degradation::MergedTags, 1.0, 1).capture;
    let empty = merged.materials.iter().filter(|material| material.surfaces.is_empty()).count();
    assert_eq!(empty, 1);
    let split = worse(Degradation::SplitTags, 2.0, 1);
    assert_eq!(split.cut.len(), 2);
    assert_eq!(split.capture.materials.len(), CORNER.materials.len() + 2);
    for (index, material) in split.capture.materials.iter().enumerate() {
        for &surface in &material.surfaces {
            assert_eq!(split.capture.surfaces[surface].material(), Some(index));
            assert!(split.capture.mesh.surface.contains(&(surface as u32)), "no empty half");
        }
    }
}

#[test]
fn a_texture_keeps_the_mean() {
    let pairs = pixels(&worse(Degradation::Texture, 35.0, 1).capture);
    let ratios: Vec<f32> =
        pairs.iter().filter(|(a, _)| a[1] > 0.0).map(|(a, b)| b[1] / a[1]).collect();
    assert!(ratios.iter().all(|r| [0.65, 1.0, 1.35].iter().any(|e| (r - e).abs() < 1e-3)));
    let mean = ratios.iter().sum::<f32>() / ratios.len() as f32;
    assert!((mean - 1.0).abs() < 0.03, "{mean}");
}

#[test]
fn the_same_seed_gives_the_same_capture() {
    for degradation in Degradation::ALL {
        let level = degradation.levels()[0];
        let (a, b) = (worse(degradation, level, 5), worse(degradation, level, 5));
        assert_eq!(a.options, b.options, "{degradation:?}");
        assert_eq!(a.capture.mesh.positions, b.capture.mesh.positions, "{degradation:?}");
        let same =
            a.capture.measurements().zip(b.capture.measurements()).all(|((i, c, x), (j, d, y))| {
                let bits = |image: &lobelia::scene::Image| -> Vec<u32> {
                    image.pixels().flatten().map(f32::to_bits).collect()
                };
                i == j && c == d && bits(x) == bits(y)
            });
        assert!(same, "{degradation:?}");
    }
}
