use super::*;
use crate::io::solution::Material;
use crate::io::truth::TrueMaterial;
use crate::math::sampling::Random;

fn material(name: &str, surfaces: &[&str], diffuse: Option<Rgb>) -> Material {
    Material {
        name: name.into(),
        kind: "diffuse".into(),
        surfaces: surfaces.iter().map(|surface| surface.to_string()).collect(),
        diffuse,
        samples: diffuse.map_or(0, |_| 10),
        ..Default::default()
    }
}

fn truth() -> Truth {
    let groups = [("a", "wall"), ("b", "wall"), ("c", "floor")];
    let materials = [("wall", [0.2, 0.4, 0.6]), ("floor", [0.4, 0.4, 0.4])];
    Truth {
        groups: groups.map(|(surface, name)| (surface.into(), name.into())).into(),
        materials: materials
            .map(|(name, rho_d)| (name.into(), TrueMaterial { rho_d, ..Default::default() }))
            .into(),
    }
}

#[test]
fn a_scale_is_found_and_taken_out() {
    let mut solution = Solution::new("paper");
    // Twice too bright in red, right in green, half in blue.
    let mut walls = material("walls", &["a", "b"], Some([0.4, 0.4, 0.3]));
    walls.diffuse_interval = Some([Some([0.1, 0.3]), Some([0.3, 0.5]), Some([0.7, 0.8])]);
    solution.materials =
        vec![walls, material("floor", &["c"], Some([0.8, 0.4, 0.2])), material("x", &[], None)];
    let score = compare(&solution, &truth());
    let raw = score.raw.unwrap();
    assert!((raw.mean_diffuse - 1.1 / 6.0).abs() < 1e-12);
    assert!((raw.largest_diffuse - 0.4).abs() < 1e-12 && raw.mean_specular.is_none());
    // Ratios below 1 have 1.2 of the weight of 2.5, those above it 0.5.
    assert_eq!(score.common_scale.unwrap().scale, [1.0; 3]);
    let channels = score.channel_scale.unwrap();
    for (scale, expected) in std::iter::zip(channels.scale, [0.5, 1.0, 2.0]) {
        assert!((scale - expected).abs() < 1e-12);
    }
    assert!(channels.errors.largest_diffuse < 1e-12);
    assert_eq!((score.intervals.inside, score.intervals.of, score.intervals.without), (2, 3, 3));
    assert_eq!(score.skipped[0].reason, "no photograph sees it");
}

#[test]
fn specular_values_do_not_enter_the_scale() {
    let mut solution = Solution::new("joint");
    // Diffuse right but for one value, specular ten times too dim.
    let mut walls = material("walls", &["a"], Some([0.2, 0.4, 0.63]));
    walls.specular = Some([0.01; 3]);
    solution.materials = vec![walls, material("floor", &["c"], Some([0.4; 3]))];
    let mut truth = truth();
    truth.materials.get_mut("wall").unwrap().rho_s = Some([0.1; 3]);
    let score = compare(&solution, &truth);
    let raw = score.raw.unwrap().mean_diffuse;
    assert!((raw - 0.03 / 6.0).abs() < 1e-12);
    let common = score.common_scale.unwrap();
    assert_eq!((common.scale, common.errors.mean_diffuse), ([1.0; 3], raw));
    assert_eq!(common.errors.mean_specular, score.raw.unwrap().mean_specular);
}

#[test]
fn no_scale_makes_the_mean_error_larger() {
    let mut random = Random::new(1, 0, 0);
    for _ in 0..200 {
        let mut solution = Solution::new("joint");
        let mut truth = truth();
        let mut triple = || [0.0; 3].map(|_: f64| f64::from(random.uniform()));
        let surfaces = [("wall", "a"), ("floor", "c")];
        solution.materials = surfaces
            .map(|(name, surface)| {
                let true_material = truth.materials.get_mut(name).unwrap();
                (true_material.rho_d, true_material.rho_s) = (triple(), Some(triple()));
                let specular = Some(triple());
                Material { specular, ..material(name, &[surface], Some(triple())) }
            })
            .into();
        let score = compare(&solution, &truth);
        let raw = score.raw.unwrap().mean_diffuse;
        let one = score.common_scale.unwrap();
        let three = score.channel_scale.unwrap();
        assert!(one.errors.mean_diffuse <= raw + 1e-12);
        assert!(three.errors.mean_diffuse <= one.errors.mean_diffuse + 1e-12);
        // The least, since no factor nearby is better.
        for factor in [0.99, 1.01] {
            let other = errors(&score.materials, one.scale.map(|s| factor * s)).unwrap();
            assert!(other.mean_diffuse >= one.errors.mean_diffuse - 1e-12);
        }
    }
}

#[test]
fn of_factors_that_are_as_good_the_one_nearest_to_1_is_taken() {
    let mut solution = Solution::new("joint");
    // Ratios of 0.5 and 2 with the same weight.
    solution.materials =
        vec![material("walls", &["a"], Some([0.4; 3])), material("floor", &["c"], Some([0.4; 3]))];
    let mut truth = truth();
    truth.materials.get_mut("wall").unwrap().rho_d = [0.2; 3];
    truth.materials.get_mut("floor").unwrap().rho_d = [0.8; 3];
    let scale = |truth: &Truth| compare(&solution, truth).common_scale.unwrap().scale[0];
    assert_eq!(scale(&truth), 1.0);
    truth.materials.get_mut("wall").unwrap().rho_d = [0.6; 3];
    assert!((scale(&truth) - 1.5).abs() < 1e-12);
    // A material that truly is black has a ratio of 0.
    truth.materials.get_mut("wall").unwrap().rho_d = [0.0; 3];
    assert_eq!(scale(&truth), 1.0);
}

#[test]
fn intervals_count_where_there_are_any() {
    let mut solution = Solution::new("joint");
    let mut walls = material("walls", &["a"], Some([0.4; 3]));
    walls.diffuse_interval = Some([Some([0.1, 0.3]), None, Some([0.7, 0.8])]);
    walls.specular = Some([0.1; 3]);
    walls.specular_interval = Some([Some([0.0, 0.4]), Some([0.02, 0.08]), None]);
    walls.exponent_interval = Some([30.0, 52.0]);
    let mut floor = material("floor", &["c"], Some([0.4; 3]));
    // No specular reflectance was estimated, so there is nothing to be inside of it.
    floor.specular_interval = Some([Some([0.0, 1.0]); 3]);
    floor.exponent_interval = Some([1.0, 9.0]);
    // Not compared, so its intervals do not count.
    let mut unknown = material("unknown", &["z"], Some([0.4; 3]));
    unknown.diffuse_interval = Some([Some([0.0, 1.0]); 3]);
    solution.materials = vec![walls, floor, unknown];
    let mut truth = truth();
    truth.materials.get_mut("wall").unwrap().rho_s = Some([0.05, 0.09, 0.05]);
    truth.materials.get_mut("wall").unwrap().n = Some(52.5);

    let score = compare(&solution, &truth);
    assert_eq!(score.materials[0].diffuse_inside, [Some(true), None, Some(false)]);
    assert_eq!(score.materials[0].specular_inside, [Some(true), Some(false), None]);
    assert_eq!(score.materials[0].exponent_inside, Some(false));
    assert_eq!(score.materials[1].specular_inside, [None; 3]);
    // The floor truly has no exponent.
    assert_eq!(score.materials[1].exponent_inside, None);
    let intervals = score.intervals;
    assert_eq!((intervals.inside, intervals.of, intervals.without), (2, 4, 5));
    let mean = (0.1 + 0.05 + 0.2 + 0.03) / 4.0;
    assert!((intervals.mean_half_width.unwrap() - mean).abs() < 1e-12);
    assert_eq!((intervals.exponents_inside, intervals.exponents_of), (0, 1));

    truth.materials.get_mut("wall").unwrap().n = Some(30.0);
    assert_eq!(compare(&solution, &truth).intervals.exponents_inside, 1);
}

#[test]
fn mixed_and_unknown_surfaces_are_not_compared() {
    let mut solution = Solution::new("paper");
    solution.materials = vec![
        material("mixed", &["a", "c"], Some([0.5; 3])),
        material("unknown", &["z"], Some([0.5; 3])),
    ];
    let score = compare(&solution, &truth());
    assert_eq!((score.materials.len(), score.skipped.len(), score.raw), (0, 2, None));
}
