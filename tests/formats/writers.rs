//! What is written reads back as it was.

use lobelia::io::solution::{Light, Lights, Lobe, Material, Solution};
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
            diffuse_interval: Some([[0.0, 1.0]; 3]),
            exponent: Some(40.0),
            identified: Some([true, true, false]),
            samples: 812,
            ..Default::default()
        },
        Material { name: "unseen".into(), ..Default::default() },
    ];
    solution.rms.final_ = Some([1e-3, 2e-3, std::f64::consts::PI]);
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
    let lights = Lights::new(vec![Light {
        kind: "sphere".into(),
        position: Some([1.0, 2.0, 0.1]),
        radius_m: Some(0.3),
        lobes: vec![Lobe { direction: [0.0, 0.0, 1.0], exponent: 0.0, emission: [0.1, 0.2, 0.3] }],
        ..Default::default()
    }]);
    let file = folder.path().join("lights.json");
    lights.write(&file).unwrap();
    assert_eq!(Lights::read(&file).unwrap(), lights);
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
        &[ConvergenceRow { iteration: 1, rms: [0.5; 3], ..Default::default() }],
    )
    .unwrap();
    let text = std::fs::read_to_string(&file).unwrap();
    assert!(text.starts_with("iteration,rms_r,") && text.contains("\n1,0.5,0.5,0.5,0,0,0,0\n"));
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
