//! What the study of stability predicts of a sound capture, beside captures that were degraded so
//! by another program (`LOBELIA_CAPTURES`).

use std::path::Path;

use lobelia::io::export::summary;
use lobelia::io::{capture, truth::Truth};
use lobelia::reconstruct::{self, Options};
use lobelia::scene::Capture;
use lobelia::study::degradation::Degradation;
use lobelia::study::degrade::degrade;
use lobelia::study::score;
use lobelia::watch::Watch;

fn error(capture: &Capture, options: &Options, truth: &Truth) -> f64 {
    let whole = reconstruct::run(capture, options, &Watch::new(), &|_| ()).unwrap();
    score::compare(&summary(capture, options, &whole, 0.0), truth).raw.unwrap().mean_diffuse
}

#[test]
fn predicted_errors_are_those_of_captures_degraded_elsewhere() {
    let Some(captures) = std::env::var_os("LOBELIA_CAPTURES") else {
        crate::skip::skip("LOBELIA_CAPTURES names no folder of captures");
        return;
    };
    let captures = Path::new(&captures);
    let load = |name: &str| capture::load(&captures.join(name), &Watch::new()).unwrap();
    let truth = |name: &str| Truth::read(&captures.join(name).join("truth.json")).unwrap();
    let (sound, options) = (load("corner-diffuse"), Options::default());
    // `corner-lens` gives its lens and vignetting, so nothing is wrong with it.
    let variants = [
        ("corner-noise", Some((Degradation::Noise, 5.0))),
        ("corner-saturated", Some((Degradation::Saturation, 5.0))),
        ("corner-lens", None),
        ("corner-misregistered", Some((Degradation::Misregistration, 2.0))),
        ("corner-half", Some((Degradation::FewerImages, 50.0))),
    ];
    let mut pairs = Vec::new();
    for (name, degradation) in variants {
        let scored = error(&load(name), &options, &truth(name));
        // Which cameras move, and how, is chance: the mean over some seeds is predicted.
        let seeds: &[u64] = match degradation {
            Some((Degradation::Misregistration | Degradation::FewerImages, _)) => &[2, 4, 6],
            _ => &[2],
        };
        let errors: Vec<f64> = seeds
            .iter()
            .map(|&seed| match degradation {
                None => error(&sound, &options, &truth("corner-diffuse")),
                Some((degradation, level)) => {
                    let worse =
                        degrade(&sound, &options, degradation, level, seed, &Watch::new()).unwrap();
                    error(&worse.capture, &worse.options, &truth("corner-diffuse"))
                }
            })
            .collect();
        let predicted = errors.iter().sum::<f64>() / errors.len() as f64;
        println!("{name}: predicted {predicted:.4} {errors:.4?}, scored {scored:.4}");
        pairs.push((name, predicted, scored));
    }
    for (name, predicted, scored) in &pairs {
        let ratio = predicted / scored;
        assert!((0.5..=2.0).contains(&ratio), "{name}: {predicted} for {scored}");
    }
}
