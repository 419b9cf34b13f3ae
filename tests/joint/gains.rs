use std::path::Path;
use std::sync::Arc;

use glam::Vec3;
use lobelia::geometry::bvh::RayCaster;
use lobelia::io::capture;
use lobelia::math::sampling::Random;
use lobelia::reconstruct::gain::{Gain, GainUse, corrected, estimate, warnings};
use lobelia::reconstruct::samples::{Sample, SampleCloud, SampleOptions, View, place};
use lobelia::reconstruct::{Options, Quality, run};
use lobelia::scene::{Capture, Material, MaterialKind, Photograph, Views};
use lobelia::watch::Watch;

fn example() -> Capture {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/examples/corner");
    capture::load(&folder, &Watch::new()).unwrap()
}

fn gains_of(capture: &Capture) -> Vec<Gain> {
    let watch = Watch::new();
    let caster = RayCaster::build(&capture.mesh.positions, &capture.mesh.triangles);
    let views = Views::new(capture, &caster, &watch).unwrap();
    let samples = place(&views, &SampleOptions::default(), 1, &watch).unwrap();
    estimate(capture, &samples)
}

/// Multiplies the pixels of a photograph.
fn expose(capture: &mut Capture, photograph: usize, gain: f32) {
    let image = capture.photographs[photograph].image.as_mut().unwrap();
    Arc::make_mut(image).scale(|_, _| gain);
}

#[test]
fn an_exact_capture_has_no_gains_worth_a_word() {
    let capture = example();
    let gains = gains_of(&capture);
    assert_eq!(gains.len(), 6);
    for gain in &gains {
        assert!((gain.gain - 1.0).abs() < 0.01 && gain.samples > 100, "{gain:?}");
    }
    assert!(corrected(&capture, &gains).is_none());
    assert!(warnings(&capture, &gains, false).is_empty());
}

#[test]
fn photographs_of_other_exposure_are_found_and_set_right() {
    let plain = gains_of(&example());
    let mut capture = example();
    expose(&mut capture, 1, 1.3);
    expose(&mut capture, 4, 0.93);
    let gains = gains_of(&capture);
    for (gain, before) in gains.iter().zip(&plain) {
        let expected = match gain.photograph {
            1 => 1.3,
            4 => 0.93,
            _ => 1.0,
        };
        let own = gain.gain / before.gain;
        assert!((own / expected - 1.0).abs() < 0.01, "{gain:?} is not {expected}");
        assert_eq!(gain.is_significant(), expected != 1.0, "{gain:?}");
    }
    let told = warnings(&capture, &gains, false);
    assert_eq!(told.len(), 2);
    assert!(told[0].contains("brighter") && told[1].contains("darker"), "{told:?}");
    let right = corrected(&capture, &gains).unwrap();
    for gain in gains_of(&right) {
        assert!((gain.gain - 1.0).abs() < 0.01, "{gain:?}");
    }
}

#[test]
fn reflectances_come_back_once_the_gain_is_divided_out() {
    let exact = example();
    let mut exposed = example();
    expose(&mut exposed, 2, 1.25);
    let (mut report, mut apply) = (0.0, 0.0);
    let seeds = [1, 2, 3];
    for seed in seeds {
        let reflectances = |capture: &Capture, gain: GainUse| -> Vec<f64> {
            let mut options = Options::of_quality(Quality::Draft);
            // Which lamps are found is partly chance, and not what is asked here.
            options.joint.max_lamps = 0;
            options.general.seed = seed;
            options.photographs.gain = gain;
            let found = run(capture, &options, &Watch::new(), &|_| ()).unwrap();
            let own = found.solution.reflectances.iter().flatten();
            own.flat_map(|reflectance| reflectance.diffuse).collect()
        };
        let plain = reflectances(&exact, GainUse::Off);
        assert_eq!(
            reflectances(&exact, GainUse::Apply),
            plain,
            "nothing is done to exact captures"
        );
        let away = |found: Vec<f64>| {
            let sum: f64 = std::iter::zip(&found, &plain).map(|(a, b)| (a - b).abs()).sum();
            sum / plain.len() as f64
        };
        let [as_it_is, divided_out] =
            [GainUse::Report, GainUse::Apply].map(|gain| away(reflectances(&exposed, gain)));
        println!("seed {seed}: mean change {as_it_is:.4} as it is, {divided_out:.4} divided out");
        report += as_it_is / seeds.len() as f64;
        apply += divided_out / seeds.len() as f64;
    }
    assert!(apply < 0.1 * report && apply < 0.002, "{report} {apply}");
}

/// A capture of so many photographs and one material, and samples that the listed photographs see:
/// `radiance` gives what each of them measures.
fn cloud(
    kind: MaterialKind,
    photographs: usize,
    seen: &[&[usize]],
    mut radiance: impl FnMut(usize, usize) -> f32,
) -> (Capture, SampleCloud) {
    let mut cloud = SampleCloud::default();
    for (index, own) in seen.iter().enumerate() {
        let first = cloud.views.len();
        cloud.views.extend(own.iter().map(|&photograph| View {
            photograph,
            pixel: [0, 0],
            direction: Vec3::Z,
            radiance: [radiance(index, photograph); 3],
        }));
        cloud.samples.push(Sample {
            position: Vec3::ZERO,
            normal: Vec3::Z,
            material: 0,
            surface: 0,
            views: first..cloud.views.len(),
            radiance: [1.0; 3],
        });
    }
    let camera = example().photographs[0].camera;
    let photograph = |index: usize| Photograph {
        name: format!("{index}.exr"),
        camera,
        image: None,
        display: None,
    };
    let material = Material {
        name: "wall".into(),
        kind,
        surfaces: Vec::new(),
        textured: false,
        known_diffuse: None,
        known_diffuse_sd: None,
    };
    let capture = Capture {
        photographs: (0..photographs).map(photograph).collect(),
        materials: vec![material],
        ..Capture::default()
    };
    (capture, cloud)
}

#[test]
fn gains_pass_along_a_chain_and_not_beyond() {
    // 0 and 2 share nothing but 1; 3 and 4 share nothing with these; 5 is seen with none.
    let truth = [1.0, 1.1, 0.8, 1.0, 1.5, 7.0];
    let seen: Vec<&[usize]> = [&[0, 1][..], &[1, 2], &[3, 4], &[5]].repeat(40);
    let radiance =
        |sample: usize, photograph: usize| (1.0 + 0.01 * sample as f32) * truth[photograph] as f32;
    let (capture, samples) = cloud(MaterialKind::Diffuse, 6, &seen, radiance);
    let gains = estimate(&capture, &samples);
    let photographs: Vec<usize> = gains.iter().map(|gain| gain.photograph).collect();
    assert_eq!(photographs, [0, 1, 2, 3, 4]);
    let ratio = |a: usize, b: usize| gains[a].gain / gains[b].gain;
    assert!((ratio(2, 0) - 0.8).abs() < 1e-5 && (ratio(1, 0) - 1.1).abs() < 1e-5);
    assert!((ratio(4, 3) - 1.5).abs() < 1e-5);
    // The median of the three is the first.
    assert!((gains[0].gain - 1.0).abs() < 1e-5);
    // Glossy samples differ from view to view for reasons of their own.
    let (capture, samples) = cloud(MaterialKind::Specular, 6, &seen, radiance);
    assert!(estimate(&capture, &samples).is_empty());
    // A handful of samples says nothing.
    let (capture, samples) = cloud(MaterialKind::Diffuse, 6, &seen[..12], radiance);
    assert!(estimate(&capture, &samples).is_empty());
}

#[test]
fn outliers_do_not_move_gains_and_the_deviations_are_honest() {
    let truth = [1.0, 1.0, 1.05, 0.97, 1.0];
    let seen: Vec<&[usize]> = vec![&[0, 1, 2, 3, 4]; 150];
    let (mut inside, mut all) = (0, 0);
    for seed in 0..60 {
        let mut random = Random::new(seed, 1, 0);
        let mut normal = move || (0..12).map(|_| f64::from(random.uniform())).sum::<f64>() - 6.0;
        let mut outlier = Random::new(seed, 2, 0);
        let (capture, samples) = cloud(MaterialKind::Diffuse, 5, &seen, |_, photograph| {
            // A tenth is shadowed or shines.
            let own = if outlier.uniform() < 0.1 { 3.0 * outlier.uniform() } else { 1.0 };
            (truth[photograph] * (0.05 * normal()).exp()) as f32 * own
        });
        for gain in estimate(&capture, &samples) {
            let error = (gain.gain / truth[gain.photograph]).ln();
            assert!(error.abs() < 0.03, "{gain:?} in run {seed}");
            inside += usize::from(error.abs() < 2.0 * gain.log_sd);
            all += 1;
        }
    }
    let share = inside as f64 / all as f64;
    assert!((0.85..=1.0).contains(&share), "{share} within two deviations");
}
