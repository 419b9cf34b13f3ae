use std::fs;

use crate::{Copy, Run, example, json, lobelia};

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
    command.arg("reconstruct").arg(example()).arg("--out").arg(&out);
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
    }
    assert!((sum / 18.0 - mean).abs() < 1e-12);
    for scaled in ["common_scale", "channel_scale"] {
        assert!((score[scaled]["scale"][0].as_f64().unwrap() - 1.0).abs() < 0.05);
        assert!(score[scaled]["mean_diffuse"].is_number());
    }
    assert_eq!(score["intervals"], serde_json::json!({"inside": 0, "of": 0}));
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
    fs::write(&file, &sound[..sound.len() / 2]).unwrap();
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
