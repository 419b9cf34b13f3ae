use serde_json::Value;

use crate::{Copy, Run, Table, coarse_by, files_below, json};

#[track_caller]
pub fn keys(value: &Value, expected: &[&str]) {
    let mut found: Vec<_> = value.as_object().expect("an object").keys().cloned().collect();
    let mut expected = expected.to_vec();
    found.sort();
    expected.sort_unstable();
    assert_eq!(found, expected);
}

#[track_caller]
pub fn triple(value: &Value) -> [f64; 3] {
    let numbers: Vec<f64> = value
        .as_array()
        .unwrap_or_else(|| panic!("no list: {value}"))
        .iter()
        .map(|number| number.as_f64().expect("a number"))
        .collect();
    numbers.try_into().expect("three numbers")
}

fn length(v: [f64; 3]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

#[test]
fn exactly_the_documented_files_are_written() {
    let copy = Copy::new();
    let run = Run::of(&mut coarse_by("paper", &copy.capture(), &copy.out())).succeeds();
    assert!(run.out.contains(&format!("written to {}", copy.out().display())), "{}", run.out);
    assert_eq!(
        files_below(&copy.out()),
        ["convergence.csv", "lights.json", "samples.csv", "solution.json"]
    );
    the_summary_has_every_field(&copy);
    the_tables_agree_with_the_summary(&copy);
    the_lights_are_discs_with_lobes(&copy);
}

fn the_summary_has_every_field(copy: &Copy) {
    let solution = json(&copy.out().join("solution.json"));
    keys(
        &solution,
        &[
            "format",
            "version",
            "method",
            "photographs",
            "materials",
            "scene",
            "rms",
            "light_model",
            "scale",
            "iterations",
            "stopped",
            "seconds",
            "warnings",
        ],
    );
    assert_eq!(solution["format"], "lobelia-solution");
    assert_eq!(solution["version"], 1);
    assert_eq!(solution["method"], "paper");
    assert!(solution["iterations"].as_u64().unwrap() > 1);
    assert!(!solution["stopped"].as_str().unwrap().is_empty());
    assert!(solution["warnings"].as_array().unwrap().iter().all(Value::is_string));

    let names = ["floor", "wall1", "wall2", "box1", "box2", "box3"];
    let materials = solution["materials"].as_array().unwrap();
    assert_eq!(materials.iter().map(|m| m["name"].as_str().unwrap()).collect::<Vec<_>>(), names);
    for (material, name) in materials.iter().zip(names) {
        keys(
            material,
            &[
                "name",
                "kind",
                "surfaces",
                "diffuse",
                "diffuse_interval",
                "specular",
                "specular_interval",
                "exponent",
                "exponent_interval",
                "model",
                "roughness",
                "roughness_interval",
                "identified",
                "samples",
            ],
        );
        assert_eq!(material["kind"], "diffuse");
        assert_eq!(material["surfaces"], serde_json::json!([name]));
        assert!(triple(&material["diffuse"]).iter().all(|v| (0.0..=1.0).contains(v)));
        assert!(material["samples"].as_u64().unwrap() > 0);
        // What the method does not give is null, not a number.
        for absent in [
            "diffuse_interval",
            "specular",
            "specular_interval",
            "exponent",
            "exponent_interval",
            "model",
            "roughness",
            "roughness_interval",
            "identified",
        ] {
            assert!(material[absent].is_null(), "{name}.{absent}: {}", material[absent]);
        }
    }

    let scene = &solution["scene"];
    keys(
        scene,
        &[
            "triangles",
            "surfaces",
            "images",
            "samples",
            "virtual_lights",
            "candidate_lobes",
            "active_lobes",
        ],
    );
    let count = |name: &str| scene[name].as_u64().unwrap_or_else(|| panic!("{name}"));
    assert_eq!((count("triangles"), count("surfaces"), count("images")), (42, 6, 6));
    assert!(count("active_lobes") > 0 && count("active_lobes") <= count("candidate_lobes"));

    keys(&solution["rms"], &["initial", "final", "relative_final", "held_out"]);
    for name in ["initial", "final", "relative_final"] {
        assert!(triple(&solution["rms"][name]).iter().all(|&v| v > 0.0), "{name}");
    }
    assert!(solution["rms"]["held_out"].is_null());

    assert!(solution["scale"].is_null());
    let room = serde_json::json!({"world": "room", "light_sets": 1, "lamps": 0, "sun": false,
        "notes": []});
    assert_eq!(solution["light_model"], room);

    let stages = ["load", "samples", "lights", "transport", "solve", "textures"];
    keys(&solution["seconds"], &[&stages[..], &["total"]].concat());
    let seconds = |name: &str| solution["seconds"][name].as_f64().unwrap();
    let sum: f64 = stages.iter().map(|stage| seconds(stage)).sum();
    assert!((seconds("total") - sum).abs() < 1e-9 * sum);
}

fn the_tables_agree_with_the_summary(copy: &Copy) {
    let solution = json(&copy.out().join("solution.json"));
    let convergence = Table::read(&copy.out().join("convergence.csv"));
    assert_eq!(convergence.rows.len() as u64, solution["iterations"].as_u64().unwrap());
    let last = convergence.rows.len() - 1;
    for (channel, name) in ["r", "g", "b"].into_iter().enumerate() {
        let rms = format!("rms_{name}");
        assert!(convergence.number(last, &rms) < convergence.number(0, &rms));
        for (row, field) in [(0, "initial"), (last, "final")] {
            let expected = triple(&solution["rms"][field])[channel];
            assert_eq!(convergence.number(row, &rms), expected);
        }
        // The alternation minimises no one thing.
        let objective = convergence.place(&format!("objective_{name}"));
        assert!(convergence.rows.iter().all(|cells| cells[objective].is_empty()));
        let relative = convergence.number(last, &format!("relative_rms_{name}"));
        assert_eq!(relative, triple(&solution["rms"]["relative_final"])[channel]);
    }
    for row in 0..=last {
        assert_eq!(convergence.number(row, "iteration"), row as f64 + 1.0);
        assert_eq!(convergence.number(row, "largest_change") > 0.0, row > 0);
        assert!(
            row == 0
                || convergence.number(row, "elapsed_s") >= convergence.number(row - 1, "elapsed_s")
        );
    }

    let samples = Table::read(&copy.out().join("samples.csv"));
    assert_eq!(samples.rows.len() as u64, solution["scene"]["samples"].as_u64().unwrap());
    for material in solution["materials"].as_array().unwrap() {
        let place = samples.place("material");
        let own = samples.rows.iter().filter(|row| row[place] == material["name"]).count();
        assert_eq!(own as u64, material["samples"].as_u64().unwrap());
    }
    let (mut close, mut count) = (0, 0);
    for row in 0..samples.rows.len() {
        let number = |column: &str| samples.number(row, column);
        assert!((length(["nx", "ny", "nz"].map(number)) - 1.0).abs() < 1e-5);
        assert!((1.0..=6.0).contains(&number("views")));
        assert!(number("weight") >= 0.0);
        for channel in ["r", "g", "b"] {
            let of = |name: &str| number(&format!("{name}_{channel}"));
            let (observed, computed) = (of("observed"), of("computed"));
            assert!(observed >= 0.0 && of("photographed") >= 0.0 && of("virtual") >= 0.0);
            let sum = of("photographed") + of("virtual");
            assert!((computed - sum).abs() <= 1e-6 * computed, "{computed} is not {sum}");
            // Dark samples are held against a floor, so the error may be less than the plain one.
            let error = of("relative_error");
            assert!(error.abs() <= (computed / observed - 1.0).abs() * (1.0 + 1e-6));
            assert!(error * (computed - observed) >= 0.0);
            close += usize::from(error.abs() < 0.2);
            count += 1;
        }
    }
    assert!(close * 10 > count * 9, "{close} of {count} equations are met within 20 %");
}

fn the_lights_are_discs_with_lobes(copy: &Copy) {
    let solution = json(&copy.out().join("solution.json"));
    let file = json(&copy.out().join("lights.json"));
    assert_eq!((&file["format"], &file["version"]), (&"lobelia-lights".into(), &1.into()));
    let lights = file["lights"].as_array().unwrap();
    assert_eq!(lights.len() as u64, solution["scene"]["virtual_lights"].as_u64().unwrap());
    let (mut lobes, mut active) = (0, 0);
    for light in lights {
        let places = ["position", "direction", "normal", "area_m2", "radius_m", "solid_angle_sr"];
        keys(light, &[&["kind", "name", "lobes"][..], &places].concat());
        assert!(light["name"].is_null() && light["solid_angle_sr"].is_null());
        assert!(["sphere", "surface"].contains(&light["kind"].as_str().unwrap()));
        assert!(light["direction"].is_null());
        triple(&light["position"]);
        assert!((length(triple(&light["normal"])) - 1.0).abs() < 1e-5);
        let (area, radius) =
            (light["area_m2"].as_f64().unwrap(), light["radius_m"].as_f64().unwrap());
        assert!(radius > 0.0);
        assert!((area / (std::f64::consts::PI * radius * radius) - 1.0).abs() < 1e-5);
        for lobe in light["lobes"].as_array().unwrap() {
            keys(lobe, &["direction", "exponent", "emission"]);
            assert!((length(triple(&lobe["direction"])) - 1.0).abs() < 1e-5);
            if light["kind"] == "sphere" {
                assert_eq!(lobe["exponent"], 20.0);
            } else {
                // What nobody sees of a known surface is taken to be diffuse.
                assert_eq!(
                    (&lobe["exponent"], &lobe["direction"]),
                    (&1.0.into(), &light["normal"])
                );
            }
            let emission = triple(&lobe["emission"]);
            assert!(emission.iter().all(|&v| v >= 0.0));
            lobes += 1;
            active += u64::from(emission.iter().any(|&v| v > 0.0));
        }
    }
    assert_eq!(lobes, solution["scene"]["candidate_lobes"].as_u64().unwrap());
    assert_eq!(active, solution["scene"]["active_lobes"].as_u64().unwrap());
}

#[test]
fn a_material_out_of_sight_has_no_numbers() {
    let copy = Copy::new();
    // A plate behind all cameras, which look into the corner at the origin.
    let plate = "usemtl plate\nv 9 9 0\nv 9 9 1\nv 9 8 0\nf -3 -2 -1\n";
    copy.put("scene.obj", copy.text("scene.obj") + plate);
    copy.edit("tags.json", |tags| {
        let material =
            serde_json::json!({"name": "plate", "kind": "diffuse", "surfaces": ["plate"]});
        tags["materials"].as_array_mut().unwrap().push(material);
    });
    let run = copy.reconstruct().succeeds().says(&["warning: material \"plate\""]);
    assert!(run.out.contains("not measured"), "{}", run.out);
    let solution = json(&copy.out().join("solution.json"));
    let plate = &solution["materials"][6];
    assert_eq!((&plate["name"], &plate["samples"]), (&"plate".into(), &0.into()));
    assert!(plate["diffuse"].is_null() && plate["specular"].is_null());
    assert!(solution["warnings"].to_string().contains("plate"));
}
