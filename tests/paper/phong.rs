//! The modified Phong lobe of Eq. 12 under uniform radiance, against quadrature.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DVec3, Vec3};
use lobelia::math::rgb::Rgb;
use lobelia::reconstruct::equations::Equations;
use lobelia::reconstruct::hemisphere::Record;
use lobelia::reconstruct::lights::VirtualLights;
use lobelia::reconstruct::samples::View;
use lobelia::reconstruct::transport::{PatchRadiosity, Transport};
use lobelia::scene::Brdf;
use lobelia::scene::{Capture, MaterialKind};

use crate::rooms::{Room, bare_sample, cloud, cube_cameras, icosphere, quick, run};

const EXPONENTS: [f64; 3] = [1.0, 10.0, 100.0];

/// ∫ cosⁿγ cos θ dω over the hemisphere about z, γ from a mirror direction at `tilt` from z, by
/// the midpoint rule in sin²θ and φ: cos θ dω = ½ d(sin²θ) dφ.
fn quadrature(exponent: f64, tilt: f64, rings: usize, spokes: usize) -> f64 {
    let mirror = DVec3::new(tilt.sin(), 0.0, tilt.cos());
    let mut sum = 0.0;
    for direction in grid(rings, spokes) {
        sum += mirror.dot(direction).max(0.0).powf(exponent);
    }
    sum * PI / (rings * spokes) as f64
}

/// Directions of equal projected solid angle.
fn grid(rings: usize, spokes: usize) -> impl Iterator<Item = DVec3> {
    (0..rings * spokes).map(move |index| {
        let square = ((index / spokes) as f64 + 0.5) / rings as f64;
        let angle = 2.0 * PI * ((index % spokes) as f64 + 0.5) / spokes as f64;
        let sine = square.sqrt();
        DVec3::new(sine * angle.cos(), sine * angle.sin(), (1.0 - square).sqrt())
    })
}

fn specular_capture() -> Capture {
    let mut room = Room::default();
    room.material("gloss", MaterialKind::Specular);
    room.capture
}

/// The equation of one specular sample on the xy plane under uniform radiance, seen so that the
/// mirror direction has `tilt` from the normal.
fn equations(tilt: f64, rings: usize, spokes: usize, radiance: [f32; 3]) -> Equations {
    let mut samples = cloud(vec![bare_sample(Vec3::ZERO, Vec3::Z, 0, radiance)]);
    samples.samples[0].views = 0..1;
    samples.views.push(View {
        photograph: 0,
        pixel: [0, 0],
        direction: DVec3::new(-tilt.sin(), 0.0, tilt.cos()).as_vec3(),
        radiance,
    });
    let sr = std::f32::consts::PI / (rings * spokes) as f32;
    let irradiance = radiance.map(|value| value * sr);
    let records: Vec<Record> = grid(rings, spokes)
        .map(|direction| Record { direction: direction.as_vec3(), irradiance })
        .collect();
    let transport = Transport {
        irradiance: vec![radiance.map(|value| value * std::f32::consts::PI)],
        first_record: vec![0, records.len()],
        records: records.into(),
        bright: Arc::default(),
        coupling: faer::Mat::zeros(1, 0),
        unphotographed: Arc::default(),
        first_unphotographed: Vec::new(),
        patch_radiosity: PatchRadiosity::default(),
    };
    Equations::new(&specular_capture(), &samples, &VirtualLights::default(), &transport, 1)
}

/// 16,384 records, 2,048 in each of eight partial sums of single precision.
const RINGS: usize = 512;
const SPOKES: usize = 32;
/// Rounding of such a sum, 2048 × 2⁻²⁴ at worst, and of the power, whose exponent (n log₂ cos γ)
/// is rounded: 100 × 2⁻²⁴ × a few for the directions.
const ROUNDING: f64 = 1.5e-4;

#[test]
fn seen_along_the_normal_the_lobe_integrates_to_one() {
    let radiance = [0.25f32, 1.0, 3.0];
    let equations = equations(0.0, RINGS, SPOKES, radiance);
    for exponent in [0.5, 1.0, 2.5, 10.0, 100.0] {
        let records = equations.glossy[0].records(exponent);
        for (found, radiance) in records.into_iter().zip(radiance) {
            let whole = (exponent + 2.0) / (2.0 * PI) * found / f64::from(radiance);
            // Midpoint rule for (1 − u)^(n/2) on 512 rings: f'/24 N² at the end u = 0.
            let midpoint = (exponent / 2.0) * (exponent / 2.0 + 1.0) / 24.0 / (512.0f64).powi(2);
            // Below n = 2 the derivative is infinite at u = 1; the last ring holds N^(−1−n/2).
            let end = 512.0f64.powf(-1.0 - exponent / 2.0);
            let tolerance = ROUNDING + 2.0 * midpoint + end;
            assert!((whole - 1.0).abs() < tolerance, "n = {exponent}: {whole}");
        }
    }
}

#[test]
fn seen_obliquely_the_lobe_equals_its_quadrature() {
    for tilt in [0.4, 0.9, 1.4f64] {
        let equations = equations(tilt, RINGS, SPOKES, [1.0, 1.0, 1.0]);
        for exponent in EXPONENTS {
            let fine = quadrature(exponent, tilt, 2048, 512);
            let same_grid = quadrature(exponent, tilt, RINGS, SPOKES);
            let found = equations.glossy[0].records(exponent)[0];
            // The error of the grid that the records lie on is known from the test's own sum.
            let tolerance = ROUNDING * fine + 1.01 * (same_grid - fine).abs();
            assert!((found - fine).abs() < tolerance, "{tilt}, n = {exponent}: {found}, {fine}");
            // And the same sum must come out of the same directions.
            assert!((found / same_grid - 1.0).abs() < ROUNDING, "{found} for {same_grid}");
            // Oblique lobes lose what lies below the horizon.
            assert!((exponent + 2.0) / (2.0 * PI) * fine < 1.0);
        }
    }
}

#[test]
fn equation_7_adds_the_diffuse_and_the_specular_part() {
    let radiance = [0.5f32, 1.0, 2.0];
    let equations = equations(0.9, RINGS, SPOKES, radiance);
    let transport = Transport {
        irradiance: vec![radiance.map(|value| value * std::f32::consts::PI)],
        records: Arc::default(),
        first_record: vec![0, 0],
        bright: Arc::default(),
        coupling: faer::Mat::zeros(1, 0),
        unphotographed: Arc::default(),
        first_unphotographed: Vec::new(),
        patch_radiosity: PatchRadiosity::default(),
    };
    let reflectance = Brdf::phong([0.3, 0.2, 0.1], [0.1, 0.4, 0.0], 10.0);
    let lobe = quadrature(10.0, 0.9, RINGS, SPOKES);
    for (channel, &radiance) in radiance.iter().enumerate() {
        let expected = f64::from(radiance)
            * (reflectance.diffuse[channel]
                + 12.0 / (2.0 * PI) * reflectance.specular[channel] * lobe);
        let found = equations.photographed(&equations.rows[0], &reflectance, &transport)[channel];
        assert!((found / expected - 1.0).abs() < ROUNDING, "{channel}: {found} for {expected}");
    }
}

#[test]
fn in_a_glossy_furnace_every_view_sees_the_lobes_integral() {
    let mut room = Room::default();
    let wall = room.material("wall", MaterialKind::Specular);
    let (positions, faces) = icosphere(3);
    room.triangles(&positions, &faces, |_| wall);
    // Two eyes: from the second the sphere is seen at up to 45°.
    let radiance = [1.0f32, 0.5, 2.0];
    for eye in [DVec3::new(0.03, -0.02, 0.05), DVec3::new(0.1, 0.6, -0.3)] {
        for camera in cube_cameras(eye, 40) {
            room.photograph(camera, |_| radiance);
        }
    }
    let mut options = quick();
    options.samples.count = 120;
    options.transport.glossy_rays = 900;
    options.refine.max_iterations = 1;
    let result = run(&room, &options).unwrap();
    assert!(result.lights.lights.is_empty());
    for exponent in [1.0f64, 10.0] {
        // Neighbouring samples share no rays, but the rows of one sample do: count samples.
        let (mut error, mut variance, mut count) = (0.0, 0.0, 0.0);
        let mut last = usize::MAX;
        for row in &result.equations.rows {
            if row.sample == last {
                continue;
            }
            last = row.sample;
            let sample = &result.samples.samples[row.sample];
            let view = result.samples.views[sample.views.start];
            let cosine = f64::from(view.direction.dot(sample.normal)).clamp(-1.0, 1.0);
            let expected = quadrature(exponent, cosine.acos(), 128, 64);
            let found = result.equations.glossy[row.glossy.unwrap()].records(exponent);
            let ratios: Rgb = std::array::from_fn(|c| found[c] / f64::from(radiance[c]));
            assert!((ratios[0] / ratios[1] - 1.0).abs() < 1e-5, "channels differ");
            error += ratios[0] - expected;
            // A ray gives π cosⁿγ; its second moment is the integral with 2n, times π.
            let second = PI * quadrature(2.0 * exponent, cosine.acos(), 128, 64);
            variance += (second - expected * expected) / 900.0;
            count += 1.0;
        }
        assert!(count > 60.0);
        // Stratified rays have no more variance than independent ones; five deviations.
        let bound = 5.0 * variance.sqrt();
        assert!(error.abs() < bound, "n = {exponent}: {} ± {}", error / count, bound / count);
    }
}
