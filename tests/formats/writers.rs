//! What is written reads back as it was.

use lobelia::io::solution::{Light, LightModel, Lights, Lobe, Material, Scale, Solution};
use lobelia::io::table::{ConvergenceRow, SampleRow, write_convergence, write_samples};
use lobelia::io::{atomic, exr, picture, truth::Truth};

use crate::{folder, message, put};

fn solution() -> Solution {
    let mut solution = Solution::new("paper");
    solution.materials = vec![
        Material {
            name: "floor, \"old\"".into(),
            kind: "specular".into(),
            surfaces: vec!["floor".into()],
            diffuse: Some([0.1 + 0.2, 1.0 / 3.0, 5e-324]),
            diffuse_interval: Some([Some([0.1 + 0.2, 1.0]), None, Some([0.0, 1e-300])]),
            specular_interval: Some([None, None, Some([0.02, 0.04])]),
            exponent: Some(40.0),
            exponent_interval: Some([30.0, 52.0]),
            identified: Some([true, true, false]),
            samples: 812,
            ..Default::default()
        },
        Material { name: "unseen".into(), ..Default::default() },
    ];
    solution.rms.final_ = Some([1e-3, 2e-3, std::f64::consts::PI]);
    solution.light_model = Some(LightModel {
        world: Some("open".into()),
        light_sets: 5,
        lamps: 2,
        sun: true,
        notes: vec!["a note".into()],
    });
    solution.scale =
        Some(Scale { singular_value: [0.1 + 0.2; 3], log_rms: [0.02; 3], log_sd: [1.0 / 3.0; 3] });
    solution
}

#[test]
fn solutions_read_back_bit_by_bit() {
    let folder = folder();
    let file = folder.path().join("new/solution.json");
    solution().write(&file).unwrap();
    assert_eq!(Solution::read(&file).unwrap(), solution());
    let text = std::fs::read_to_string(&file).unwrap();
    let value: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(value["format"], "lobelia-solution");
    assert!(value["materials"][1]["diffuse"].is_null() && value["materials"][1]["samples"] == 0);
    assert!(value["rms"]["held_out"].is_null() && value["rms"]["final"].is_array());
    assert_eq!(
        value["materials"][0]["diffuse_interval"],
        serde_json::json!([[0.1 + 0.2, 1.0], null, [0.0, 1e-300]])
    );
    assert!(value["materials"][1]["diffuse_interval"].is_null());
    assert_eq!(value["light_model"]["world"], "open");
    assert_eq!(value["scale"]["log_sd"][2], 1.0 / 3.0);
    let lobes = vec![Lobe { direction: [0.0, 0.0, 1.0], exponent: 0.0, emission: [0.1, 0.2, 0.3] }];
    let lights = Lights::new(vec![
        Light {
            kind: "lamp".into(),
            position: Some([1.0, 2.0, 0.1]),
            radius_m: Some(0.3),
            lobes: lobes.clone(),
            ..Default::default()
        },
        Light {
            kind: "sky".into(),
            direction: Some([0.0, 0.6, -0.8]),
            solid_angle_sr: Some(0.1 + 0.2),
            lobes: lobes.clone(),
            ..Default::default()
        },
        Light { kind: "known".into(), name: Some("bulb".into()), lobes, ..Default::default() },
    ]);
    let file = folder.path().join("lights.json");
    lights.write(&file).unwrap();
    assert_eq!(Lights::read(&file).unwrap(), lights);
}

#[test]
fn files_from_before_certainty_are_read() {
    let folder = folder();
    let mut value = serde_json::to_value(solution()).unwrap();
    for new in ["light_model", "scale"] {
        value.as_object_mut().unwrap().remove(new).unwrap();
    }
    value["materials"][0]["diffuse_interval"] = serde_json::json!([[0.1, 0.2], [0, 1], [0.3, 1]]);
    let old = Solution::read(&put(folder.path(), "solution.json", value.to_string())).unwrap();
    assert_eq!((&old.light_model, old.scale), (&None, None));
    let intervals = [Some([0.1, 0.2]), Some([0.0, 1.0]), Some([0.3, 1.0])];
    assert_eq!(old.materials[0].diffuse_interval, Some(intervals));
    assert_eq!((&old.materials[1], old.rms), (&solution().materials[1], solution().rms));
    // Parts that a later version may add or leave out.
    value["light_model"] = serde_json::json!({"world": null, "moon": true});
    let text = value.to_string();
    let sparse = Solution::read(&put(folder.path(), "solution.json", text)).unwrap();
    assert_eq!(sparse.light_model, Some(LightModel::default()));
    // An interval has two ends.
    value["materials"][0]["diffuse_interval"] = serde_json::json!([[0.1], null, null]);
    let broken = put(folder.path(), "solution.json", value.to_string());
    message(Solution::read(&broken), &["solution.json, line 1"]);

    let text = r#"{"format": "lobelia-lights", "version": 1, "lights": [{"kind": "sphere",
        "position": [1, 2, 3], "direction": null, "normal": [0, 0, 1], "area_m2": 0.5,
        "radius_m": 0.4, "lobes": []}]}"#;
    let old = Lights::read(&put(folder.path(), "lights.json", text)).unwrap();
    assert_eq!((&old.lights[0].name, old.lights[0].solid_angle_sr), (&None, None));
    assert_eq!(old.lights[0].position, Some([1.0, 2.0, 3.0]));
}

#[test]
fn no_number_is_written_that_is_not_finite() {
    let folder = folder();
    let refused = |part: &str, spoil: &dyn Fn(&mut Solution, f64)| {
        for number in [f64::NAN, f64::INFINITY] {
            let mut wrong = solution();
            spoil(&mut wrong, number);
            let file = folder.path().join("solution.json");
            message(wrong.write(&file), &[part, "not finite"]);
            assert!(!file.exists());
        }
    };
    // A null beside it hides nothing.
    refused("floor", &|wrong, number| {
        wrong.materials[0].diffuse_interval = Some([None, Some([0.0, number]), None]);
    });
    refused("floor", &|wrong, number| {
        wrong.materials[0].specular_interval = Some([None, None, Some([number, 1.0])]);
    });
    refused("floor", &|wrong, number| {
        wrong.materials[0].exponent_interval = Some([1.0, number]);
    });
    refused("rms", &|wrong, number| wrong.rms.held_out = Some([0.0, 0.0, number]));
    refused("scale", &|wrong, number| wrong.scale.as_mut().unwrap().singular_value[0] = number);
    refused("scale", &|wrong, number| wrong.scale.as_mut().unwrap().log_rms[1] = number);
    refused("scale", &|wrong, number| wrong.scale.as_mut().unwrap().log_sd[2] = number);

    let file = folder.path().join("lights.json");
    let sky = Light { solid_angle_sr: Some(f64::NAN), ..Default::default() };
    message(Lights::new(vec![Light::default(), sky]).write(&file), &["lights[1]", "not finite"]);
    assert!(!file.exists());
}

#[test]
fn foreign_versions_and_infinite_numbers_are_refused() {
    let folder = folder();
    let file = folder.path().join("solution.json");
    let mut wrong = solution();
    wrong.materials[0].exponent = Some(f64::NAN);
    message(wrong.write(&file), &["floor", "not finite"]);
    assert!(!file.exists());
    solution().write(&file).unwrap();
    let text = std::fs::read_to_string(&file).unwrap();
    let newer = text.replace("\"version\": 1", "\"version\": 7, \"news\": {}");
    message(
        Solution::read(&put(folder.path(), "b.json", newer)),
        &["version 7", "reads version 1"],
    );
    let unknown = text.replace("\"version\": 1", "\"version\": 1, \"news\": {}");
    assert!(Solution::read(&put(folder.path(), "b.json", unknown)).is_ok());
    let other = text.replace("lobelia-solution", "other");
    message(Solution::read(&put(folder.path(), "b.json", other)), &["\"other\""]);
    message(Solution::read(&put(folder.path(), "b.json", &text[..100])), &["b.json, line"]);
    message(Lights::read(&file), &["lobelia-lights"]);
}

#[test]
fn images_read_back_exactly() {
    let folder = folder();
    let file = folder.path().join("textures/wall.exr");
    let pixels: Vec<[f32; 3]> =
        (0..35).map(|i| [i as f32 * 0.1, 1e-30 / (i + 1) as f32, 1e30 * i as f32]).collect();
    let seen: Vec<f32> = (0..35).map(|i| (i % 2) as f32).collect();
    exr::write_rgb_with(&file, 7, 5, &pixels, &[("seen", &seen)]).unwrap();
    let read = picture::read(&file).unwrap();
    assert_eq!((read.width, read.height, read.pixels), (7, 5, pixels));
    assert_eq!(exr::dimensions(&file).unwrap(), (7, 5));
    // The further channel, by the crate's own reader.
    let image = ::exr::prelude::read_first_flat_layer_from_file(&file).unwrap();
    let channel =
        image.layer_data.channel_data.list.iter().find(|channel| channel.name == *"seen").unwrap();
    assert_eq!(channel.sample_data.values_as_f32().collect::<Vec<_>>(), seen);
}

#[test]
fn tables_have_a_header_with_units() {
    let folder = folder();
    let file = folder.path().join("samples.csv");
    let row = SampleRow {
        material: "a,\"b\"".into(),
        views: 3,
        weight: f64::NAN,
        position: [0.1, 2.0, -3.5],
        ..Default::default()
    };
    write_samples(&file, &[row]).unwrap();
    let text = std::fs::read_to_string(&file).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert!(lines[0].starts_with("x_m,y_m,z_m,nx,ny,nz,material,views,observed_r,"));
    assert_eq!(lines[0].split(',').count(), 24);
    assert!(
        lines[1].starts_with("0.1,2,-3.5,0,0,0,\"a,\"\"b\"\"\",3,0,") && lines[1].ends_with(",0,")
    );
    let file = folder.path().join("convergence.csv");
    write_convergence(
        &file,
        &[
            ConvergenceRow {
                iteration: 1,
                rms: [0.5; 3],
                elapsed_secs: 0.75,
                ..Default::default()
            },
            ConvergenceRow {
                iteration: 2,
                objective: Some([3.0, 2.0, 0.1]),
                largest_change: 0.25,
                elapsed_secs: 1.5,
                ..Default::default()
            },
        ],
    )
    .unwrap();
    let text = std::fs::read_to_string(&file).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert!(lines[0].starts_with("iteration,rms_r,"));
    assert!(lines[0].ends_with(",objective_r,objective_g,objective_b,largest_change,elapsed_s"));
    assert_eq!(lines[0].split(',').count(), 12);
    // Without an objective its cells are empty, not 0.
    assert_eq!(lines[1..], ["1,0.5,0.5,0.5,0,0,0,,,,0,0.75", "2,0,0,0,0,0,0,3,2,0.1,0.25,1.5"]);
}

#[test]
fn a_failed_write_leaves_the_old_file_and_no_rest() {
    let folder = folder();
    let file = put(folder.path(), "a.txt", "old");
    let failing = atomic::write(&file, |out| {
        std::io::Write::write_all(out, b"half")?;
        Err(std::io::Error::other("disk full"))
    });
    message(failing, &["a.txt", "disk full"]);
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "old");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    message(atomic::write_bytes(&file.join("below/b.txt"), b""), &["b.txt", "cannot be written"]);
}

#[test]
fn truth_is_read_with_its_groups() {
    let folder = folder();
    let text = r#"{"name": "x", "groups": {"wall_left": "paint"}, "materials": {
        "paint": {"model": "modified_phong", "rho_d": [0.1, 0.2, 0.3], "rho_s": [0.1, 0.1, 0.1], "n": 40.0,
                  "texture": "truth/textures/paint.exr"},
        "floor": {"model": "diffuse", "rho_d": [0.5, 0.5, 0.5]}}, "lights": []}"#;
    let truth = Truth::read(&put(folder.path(), "truth.json", text)).unwrap();
    let (name, material) = truth.of_surface("wall_left").unwrap();
    assert_eq!((name, material.n, material.rho_d[2]), ("paint", Some(40.0), 0.3));
    assert_eq!(truth.of_surface("floor").unwrap().0, "floor");
    assert!(truth.of_surface("roof").is_none());
}
