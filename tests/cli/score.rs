use std::fs;

use crate::{Copy, Run, coarse_by, example, json, lobelia};

const TRUE_START: [&str; 6] = [
    "floor=0.7,0.6,0.5",
    "wall1=0.2,0.7,0.3",
    "wall2=0.3,0.5,0.7",
    "box1=0.7,0.7,0.7",
    "box2=0.7,0.2,0.1",
    "box3=0.1,0.2,0.7",
];

#[test]
fn from_the_truth_the_truth_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    let (out, file) = (folder.path().join("out"), folder.path().join("score.json"));
    let mut command = lobelia();
    command.arg("reconstruct").arg(example()).arg("--out").arg(&out).args(["--method", "paper"]);
    for start in TRUE_START {
        command.args(["--start", start]);
    }
    Run::of(&mut command).succeeds();

    let run = Run::of(lobelia().arg("score").arg(example()).arg(&out).arg("--json").arg(&file))
        .succeeds();
    let score = json(&file);
    let mean = score["raw"]["mean_diffuse"].as_f64().unwrap();
    // The images' noise and the samples leave 0.007.
    assert!(mean <= 0.04, "{mean}");
    assert!(score["raw"]["largest_diffuse"].as_f64().unwrap() >= mean);
    assert!(run.out.contains(&format!("raw: mean {mean:.4}")), "{}", run.out);

    let materials = score["materials"].as_array().unwrap();
    assert_eq!(materials.len(), 6);
    let mut sum = 0.0;
    for material in materials {
        let name = material["name"].as_str().unwrap();
        assert!(run.out.lines().any(|line| line.starts_with(name)), "{name}: {}", run.out);
        assert_eq!(material["true_name"], name);
        assert!(material["samples"].as_u64().unwrap() > 0);
        for channel in 0..3 {
            let value = |field: &str| material[field][channel].as_f64().unwrap();
            sum += (value("estimated_diffuse") - value("true_diffuse")).abs();
            assert_eq!(value("true_specular"), 0.0);
        }
        assert!(material["estimated_specular"].is_null());
        assert_eq!(material["diffuse_inside"], serde_json::json!([null, null, null]));
    }
    assert!((sum / 18.0 - mean).abs() < 1e-12);
    for scaled in ["common_scale", "channel_scale"] {
        assert!((score[scaled]["scale"][0].as_f64().unwrap() - 1.0).abs() < 0.05);
        assert!(score[scaled]["mean_diffuse"].is_number());
    }
    let none = serde_json::json!({"inside": 0, "of": 0, "without": 18, "mean_half_width": null,
        "exponents_inside": 0, "exponents_of": 0});
    assert_eq!(score["intervals"], none);
    assert!(run.out.contains("no intervals given"), "{}", run.out);
    assert_eq!(score["skipped"], serde_json::json!([]));

    // The file itself may be named as well.
    let other = Run::of(lobelia().arg("score").arg(example()).arg(out.join("solution.json")));
    assert_eq!(other.succeeds().out, run.out);
}

#[test]
fn what_cannot_be_scored_is_refused_by_name() {
    let copy = Copy::new();
    copy.reconstruct().succeeds();
    let score = || Run::of(lobelia().arg("score").arg(copy.capture()).arg(copy.out()));
    score().succeeds();

    let file = copy.out().join("solution.json");
    let sound = fs::read_to_string(&file).unwrap();
    fs::write(&file, sound.replacen("\"version\": 1", "\"version\": 2", 1)).unwrap();
    score().fails(1, &["solution.json", "version 2 is not known", "version 1"]);
    fs::write(&file, sound.replacen("lobelia-solution", "something", 1)).unwrap();
    score().fails(1, &["solution.json", "format", "something", "lobelia-solution"]);
    fs::write(&file, &sound[..sound.floor_char_boundary(sound.len() / 2)]).unwrap();
    score().fails(1, &["solution.json", "line ", "cut off"]);
    fs::remove_file(&file).unwrap();
    score().fails(1, &["solution.json", "cannot be read"]);

    fs::write(&file, &sound).unwrap();
    fs::remove_file(copy.file("truth.json")).unwrap();
    score().fails(1, &["truth.json", "cannot be read"]);
    copy.put("truth.json", "{\"materials\": {\"floor\": {}}}");
    score().fails(1, &["truth.json", "line 1", "rho_d"]);
}

#[test]
fn a_material_the_truth_does_not_know_is_not_compared() {
    let copy = Copy::new();
    copy.edit("truth.json", |truth| {
        truth["materials"].as_object_mut().unwrap().remove("box3");
    });
    copy.reconstruct().succeeds();
    let file = copy.folder.path().join("score.json");
    let mut command = lobelia();
    command.arg("score").arg(copy.capture()).arg(copy.out()).arg("--json").arg(&file);
    let run = Run::of(&mut command).succeeds();
    assert!(run.out.contains("not compared"), "{}", run.out);
    let score = json(&file);
    assert_eq!(score["materials"].as_array().unwrap().len(), 5);
    assert_eq!(score["skipped"][0]["name"], "box3");
}

#[test]
fn intervals_are_held_against_the_truth() {
    let copy = Copy::new();
    copy.edit("truth.json", |truth| {
        let floor = &mut truth["materials"]["floor"];
        floor["rho_s"] = serde_json::json!([0.05, 0.05, 0.05]);
        floor["n"] = 40.0.into();
    });
    Run::of(&mut coarse_by("paper", &copy.capture(), &copy.out())).succeeds();
    let file = copy.out().join("solution.json");
    let mut solution = json(&file);
    // The floor is 0.7, 0.6, 0.5.
    let floor = &mut solution["materials"][0];
    floor["diffuse_interval"] = serde_json::json!([[0.6, 0.8], null, [0.1, 0.3]]);
    floor["specular"] = serde_json::json!([0.04, 0.05, 0.06]);
    floor["specular_interval"] = serde_json::json!([null, [0.04, 0.06], null]);
    floor["exponent"] = 45.0.into();
    floor["exponent_interval"] = serde_json::json!([30, 52]);
    fs::write(&file, solution.to_string()).unwrap();

    let written = copy.folder.path().join("score.json");
    let mut command = lobelia();
    command.arg("score").arg(copy.capture()).arg(copy.out()).arg("--json").arg(&written);
    let run = Run::of(&mut command).succeeds();
    let score = json(&written);
    let intervals = &score["intervals"];
    assert_eq!((&intervals["inside"], &intervals["of"]), (&2.into(), &3.into()));
    assert_eq!(intervals["without"], 18);
    assert_eq!(score["materials"][0]["exponent_inside"], true);
    assert!(
        run.out.contains("in their intervals: 2 of 3 (18 have none); mean half-width 0.0700"),
        "{}",
        run.out
    );
    assert!(run.out.contains("true exponents in their intervals: 1 of 1"), "{}", run.out);

    // What is said of the intervals is below its heading.
    let lines: Vec<&str> = run.out.lines().collect();
    let column = lines[0].find("in its interval").unwrap();
    let samples = lines[0].find("samples").unwrap();
    let of = |start: &str| *lines.iter().find(|line| line.trim_start().starts_with(start)).unwrap();
    assert_eq!(of("floor")[column..samples].trim_end(), "yes -   no");
    assert_eq!(of("box1")[column..samples].trim_end(), "-   -   -");
    assert_eq!(of("specular")[column..].trim_end(), "-   yes -");
    assert_eq!(of("exponent")[column..].trim_end(), "yes");
    assert!(of("exponent").contains("45.0 [30.0, 52.0]") && of("exponent").contains(" 40.0 "));
    for name in ["floor", "wall1", "box3"] {
        assert!(of(name)[samples..].parse::<usize>().unwrap() > 0);
    }
}
