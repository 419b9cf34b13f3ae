//! What must come back, and what cannot.

use lobelia::exposures::options::Weights;
use lobelia::exposures::times::recover_checked;
use lobelia::exposures::{Codes, MergeOptions, Merged, Response, Vignetting, merge};
use lobelia::watch::{Cancelled, Watch};

use super::*;

const TIMES: [f64; 6] = [1.0 / 64.0, 1.0 / 16.0, 0.25, 1.0, 4.0, 16.0];

fn merged(exposures: &[Exposure], response: &Response, options: &MergeOptions) -> Merged {
    let trusted = vec![true; exposures.len()];
    merge(exposures, &trusted, exposures.len() / 2, response, options, &Watch::new()).unwrap()
}

fn recovered(exposures: &[Exposure]) -> Response {
    let checked = recover_checked(&read(exposures), MergeOptions::default().smoothness).unwrap();
    assert!(checked.trusted[0].iter().all(|trusted| *trusted), "{:?}", checked.links);
    checked.response
}

#[test]
fn response_and_radiance_come_back() {
    let exposures = photograph(&TIMES, &still(6), 0.6);
    let response = recovered(&exposures);
    let middle = exposure_of_film(128.0).ln();
    for code in (12..=240).step_by(4) {
        let truth = exposure_of_film(f64::from(code)).ln() - middle;
        for channel in 0..3 {
            let error = response.ln_exposure(channel, code as f32) - truth;
            assert!(error.abs() < 0.05, "code {code}, channel {channel}: {error}");
        }
    }
    for (weights, limit) in [(Weights::Noise, 0.01), (Weights::Hat, 0.015)] {
        let options = MergeOptions { weights, ..MergeOptions::default() };
        let merged = merged(&exposures, &response, &options);
        let error = median_error(&merged.pixels, |x, y| radiance(x as f64, y as f64));
        assert!(error < limit, "{weights:?}: {error}");
    }
}

#[test]
fn weights_by_noise_are_better_than_the_triangle() {
    let exposures = photograph(&TIMES, &still(6), 1.5);
    let response = recovered(&exposures);
    let [noise, hat] = [Weights::Noise, Weights::Hat].map(|weights| {
        let options = MergeOptions { weights, ..MergeOptions::default() };
        let merged = merged(&exposures, &response, &options);
        median_error(&merged.pixels, |x, y| radiance(x as f64, y as f64))
    });
    assert!(noise < hat, "{noise} {hat}");
}

#[test]
fn what_no_exposure_measures_is_marked_and_counted() {
    let mut exposures = photograph(&TIMES[2..4], &still(2), 0.0);
    for exposure in &mut exposures {
        let Codes::Eight(codes) = &mut exposure.codes else { unreachable!() };
        // Blue borders of film scans; one channel saturated is enough.
        codes[0] = [0, 0, 255];
        codes[1] = [90, 255, 90];
        codes[2] = [90, 0, 90];
        codes[3] = [90, 91, 92];
    }
    let response = recovered(&photograph(&TIMES, &still(6), 0.0));
    let all = merged(&exposures, &response, &MergeOptions::default());
    for index in 0..3 {
        assert!(all.pixels[index].iter().all(|value| value.is_nan()), "{index}");
    }
    assert!(all.pixels[3].iter().all(|value| value.is_finite() && *value > 0.0));
    let unmeasured = all.pixels.iter().filter(|pixel| pixel[0].is_nan()).count();
    assert_eq!(unmeasured, all.too_bright + all.too_dark);
    // By hand: saturated is 0.98 of 255 and above, nothing is 0.
    let codes: Vec<[[f32; 3]; 2]> = (0..WIDTH * HEIGHT)
        .map(|index| [exposures[0].codes.at(index), exposures[1].codes.at(index)])
        .collect();
    let any = |pixel: &[[f32; 3]; 2], is: fn(f32) -> bool| {
        (0..3).any(|c| pixel.iter().all(|code| is(code[c])))
    };
    let bright = codes.iter().filter(|pixel| any(pixel, |code| code >= 249.9)).count();
    let lost =
        codes.iter().filter(|pixel| any(pixel, |code| !(1.0..249.9).contains(&code))).count();
    assert_eq!([all.too_bright, all.too_dark], [bright, lost - bright]);
}

#[test]
fn linear_codes_give_radiance_in_units_of_the_middle_code() {
    let options = MergeOptions { black: 0.01, weights: Weights::Noise, ..MergeOptions::default() };
    let response = Response::Linear { black: 2.55 };
    let exposures: Vec<Exposure> = [0.02, 0.2, 2.0]
        .iter()
        .map(|&time| {
            let codes = (0..WIDTH * HEIGHT)
                .map(|index| {
                    radiance((index % WIDTH) as f64, (index / WIDTH) as f64).map(|radiance| {
                        let code = 655.35 + radiance * time * 20_000.0;
                        code.round().clamp(0.0, 65_535.0) as u16
                    })
                })
                .collect();
            exposure(Codes::Sixteen(codes), time)
        })
        .collect();
    let merged = merged(&exposures, &response, &options);
    // Code 128 of 255, above black, in one second is 1.
    let unit = 20_000.0 / 257.0 / (128.0 - 2.55);
    let mut worst = 0.0_f64;
    for (index, pixel) in merged.pixels.iter().enumerate().filter(|(_, p)| p[0].is_finite()) {
        let truth = radiance((index % WIDTH) as f64, (index / WIDTH) as f64);
        for (own, truth) in std::iter::zip(pixel, truth) {
            worst = worst.max((f64::from(*own) / (truth * unit) - 1.0).abs());
        }
    }
    assert!(worst < 2e-3, "{worst}");
    assert!(merged.too_bright + merged.too_dark < WIDTH * HEIGHT / 100);
}

#[test]
fn vignetting_is_divided_out() {
    let vignetting = Vignetting { a: -0.4, b: 0.1 };
    let response = Response::Linear { black: 0.0 };
    let falloff = |x: usize, y: usize| {
        let (dx, dy) = (x as f64 + 0.5 - 90.0, y as f64 + 0.5 - 60.0);
        let r2 = (dx * dx + dy * dy) / (90.0 * 90.0 + 60.0 * 60.0);
        1.0 - 0.4 * r2 + 0.1 * r2 * r2
    };
    let codes = (0..WIDTH * HEIGHT)
        .map(|index| [(40_000.0 * falloff(index % WIDTH, index / WIDTH)) as u16; 3])
        .collect::<Vec<_>>();
    let exposures = [exposure(Codes::Sixteen(codes), 1.0)];
    let options = MergeOptions {
        vignetting_a: vignetting.a,
        vignetting_b: vignetting.b,
        ..MergeOptions::default()
    };
    let merged = merged(&exposures, &response, &options);
    let (low, high) = merged
        .pixels
        .iter()
        .fold((f32::MAX, 0.0_f32), |(low, high), pixel| (low.min(pixel[1]), high.max(pixel[1])));
    assert!(high / low < 1.001, "{low} to {high}");
    assert!((vignetting.darkest() - 0.7).abs() < 1e-12);
}

#[test]
fn the_bytes_do_not_depend_on_threads_and_a_cancel_stops() {
    let exposures = photograph(&TIMES, &still(6), 0.6);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let response = recovered(&exposures);
            let pixels = merged(&exposures, &response, &MergeOptions::default()).pixels;
            pixels.iter().flatten().map(|value| value.to_bits()).collect::<Vec<u32>>()
        })
    };
    assert_eq!(run(1), run(3));
    let watch = Watch::new();
    watch.cancel();
    let response = Response::Linear { black: 0.0 };
    let cancelled = merge(&exposures, &[true; 6], 0, &response, &MergeOptions::default(), &watch);
    assert_eq!(cancelled, Err(Cancelled));
}

#[test]
fn exposures_without_a_common_pixel_determine_nothing() {
    let black = exposure(Codes::Eight(vec![[0; 3]; WIDTH * HEIGHT]), 0.1);
    let white = exposure(Codes::Eight(vec![[255; 3]; WIDTH * HEIGHT]), 1.0);
    assert!(recover_checked(&read(&[black, white]), 20.0).is_err());
    assert!(recover_checked(&[], 20.0).is_err());
}
