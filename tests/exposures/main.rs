//! Exposure series merged to radiance: against scenes of known radiance photographed by a camera
//! of known response, and against OpenCV.

mod alignment; // hand-held series, tripods
mod known; // radiance, response, what is never measured, linear codes, vignetting
mod opencv; // the same exposures through createCalibrateDebevec and createMergeDebevec
mod profiles; // ICC profiles of JPEG, PNG and TIFF
mod raw; // RAW photographs: levels, mosaic, crop, colours, damage
mod times; // times that contradict the pixels

use lobelia::exposures::samples::{self, Readings};
use lobelia::exposures::{Codes, Exposure};
use lobelia::math::sampling::Random;

const WIDTH: usize = 180;
const HEIGHT: usize = 120;

/// Radiance over about four decades, with edges and texture, different in each channel.
fn radiance(x: f64, y: f64) -> [f64; 3] {
    let (u, v) = (x / WIDTH as f64, y / HEIGHT as f64);
    let blocks = f64::from(((u * 7.0) as i32 * 3 + (v * 5.0) as i32 * 5) % 4) * 0.35;
    let texture = 0.15 * (31.0 * u + 4.0 * (17.0 * v).sin()).sin();
    let ln = -3.5 + 7.0 * u * (0.6 + 0.4 * v) + blocks + texture;
    [ln.exp(), (ln + 0.4 * (v - 0.5)).exp(), (ln - 0.3 + 0.5 * (1.0 - u)).exp()]
}

/// A film-like response: the exposure's share of full scale as a code, not clipped.
fn film(exposure: f64) -> f64 {
    let root = exposure.powf(0.6);
    270.0 * root / (root + 0.9)
}

/// The exposure that [`film`] gives a code for.
fn exposure_of_film(code: f64) -> f64 {
    (0.9 * code / (270.0 - code)).powf(1.0 / 0.6)
}

/// About a standard normal: twelve uniforms.
fn normal(random: &mut Random) -> f64 {
    (0..12).map(|_| f64::from(random.uniform())).sum::<f64>() - 6.0
}

/// Exposures of the scene: `times` as they really were, `shifts` of the camera, noise in codes.
fn photograph(times: &[f64], shifts: &[[isize; 2]], noise: f64) -> Vec<Exposure> {
    std::iter::zip(times, shifts)
        .enumerate()
        .map(|(index, (&time, shift))| {
            let mut random = Random::new(1, index as u64, 0);
            let codes = (0..WIDTH * HEIGHT)
                .map(|pixel| {
                    let x = (pixel % WIDTH) as f64 - shift[0] as f64;
                    let y = (pixel / WIDTH) as f64 - shift[1] as f64;
                    radiance(x, y).map(|radiance| {
                        let code = film(radiance * time) + noise * normal(&mut random);
                        code.round().clamp(0.0, 255.0) as u8
                    })
                })
                .collect();
            exposure(Codes::Eight(codes), time)
        })
        .collect()
}

fn exposure(codes: Codes, seconds: f64) -> Exposure {
    Exposure { width: WIDTH, height: HEIGHT, codes, seconds, shift: [0, 0] }
}

fn still(count: usize) -> Vec<[isize; 2]> {
    vec![[0, 0]; count]
}

fn read(exposures: &[Exposure]) -> Vec<Readings> {
    vec![samples::read(exposures, exposures.len() / 2, 3000, 0)]
}

fn median(mut values: Vec<f64>) -> f64 {
    assert!(!values.is_empty());
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// The median over pixels of |merged × scale / truth − 1|, with one scale for all channels.
fn median_error(pixels: &[[f32; 3]], truth: impl Fn(usize, usize) -> [f64; 3]) -> f64 {
    let ratios: Vec<f64> = pixels
        .iter()
        .enumerate()
        .filter(|(_, pixel)| pixel[0].is_finite())
        .flat_map(|(index, pixel)| {
            let truth = truth(index % WIDTH, index / WIDTH);
            std::array::from_fn::<f64, 3, _>(|c| f64::from(pixel[c]) / truth[c])
        })
        .collect();
    let scale = median(ratios.clone());
    median(ratios.iter().map(|ratio| (ratio / scale - 1.0).abs()).collect())
}
