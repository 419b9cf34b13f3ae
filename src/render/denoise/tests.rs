use super::*;
use crate::math::sampling::Random;
use crate::render::film::{STRIP, SURFACE_STRIDE};
use crate::render::tracer::Processor;

/// A wall and a floor, lit by light of which one path in `rare` finds `rare` times as much.
fn noisy(rare: f32, lit: [f32; 2]) -> Film {
    const SIZE: usize = 96;
    const PATHS: u32 = 8;
    let mut film = Film::new(SIZE, SIZE, 1);
    let mut random = Random::new(4, 0, 0);
    film.paths = PATHS as usize;
    let strips = film.light.strips_mut().zip(film.surfaces.strips_mut());
    for (strip, ((paths, light), (seen, surfaces))) in strips.enumerate() {
        (*paths, *seen) = (PATHS, PATHS);
        let pixels = light.chunks_exact_mut(2 * CHANNELS + 1);
        for (k, (light, surface)) in
            pixels.zip(surfaces.chunks_exact_mut(SURFACE_STRIDE)).enumerate()
        {
            let place = strip * STRIP + k;
            let side = place % SIZE / (SIZE / 2);
            // Paintings, which the denoiser divides out.
            let albedo = [0.2, 0.8][place / SIZE / 8 % 2];
            for path in 0..PATHS {
                let found = random.uniform() * rare < 1.0;
                let value = if found { rare * lit[side] * albedo } else { 0.0 };
                light[..2 * CHANNELS].iter_mut().for_each(|sum| *sum += value);
                light[2 * CHANNELS] += value * (path % 2) as f32;
            }
            let normal = [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]][side];
            let one = [albedo, albedo, albedo, normal[0], normal[1], normal[2], 2.0, 1.0, 0.0];
            surface.iter_mut().zip(one).for_each(|(sum, value)| *sum = value * PATHS as f32);
        }
    }
    film
}

/// Mean light on each side, were the albedo 1, and its standard error over the pixels.
fn light(film: &Film) -> [(f64, f64); 2] {
    let albedo = film.albedo();
    let (width, beauty) = (film.width, film.beauty());
    [0, 1].map(|side| {
        let own = (0..beauty.len()).filter(|index| index % width / (width / 2) == side);
        let values: Vec<f64> =
            own.map(|index| f64::from(beauty[index][1] / albedo[index][1])).collect();
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let squares = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
        (mean, (squares / (count - 1.0) / count).sqrt())
    })
}

/// Light that few paths find is not taken for an error: many dark pixels beside a few much too
/// bright ones are as bright on average as they should be.
#[test]
fn the_mean_of_noise_with_a_long_tail_is_kept() {
    let lit = [1.0, 4.0];
    for rare in [2.0, 10.0, 100.0] {
        let raw = noisy(rare, lit);
        let clean = denoised(&raw, &Processor);
        for (side, (before, after)) in light(&raw).into_iter().zip(light(&clean)).enumerate() {
            let expected = f64::from(lit[side]);
            let (mean, error) = before;
            assert!((mean - expected).abs() < 3.5 * error, "{before:?}, not {expected}");
            let off = (after.0 - expected).abs();
            assert!(off < 3.5 * error, "{after:?} ± {error}, not {expected} (1 in {rare})");
            assert!((after.0 / mean - 1.0).abs() < 1e-3, "{after:?} of {before:?}");
            assert!(after.1 < 0.6 * error, "{after:?} is hardly clearer than {before:?}");
        }
    }
}
