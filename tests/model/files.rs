//! `model.json`: read again as it was written, and damaged in every way.

use lobelia::model::Stroke;
use serde_json::{Value, json};

use crate::{golden, read};

#[test]
fn what_is_written_is_read_again() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["corner-diffuse.json", "boxes-artificial.json", "things.json"] {
        let model = read(name);
        let file = folder.path().join(name);
        lobelia::io::model::write(&file, &model).unwrap();
        let again = lobelia::io::model::read(&file).unwrap();
        assert_eq!(again, model, "{name}");
        let text = std::fs::read_to_string(&file).unwrap();
        assert_eq!(lobelia::io::model::to_text(&again), text, "{name}");
    }
}

/// Lines that were found to be edges keep their standard deviation, and stand behind what was drawn.
#[test]
fn found_edges_are_read_again() {
    let mut model = read("boxes-one.json");
    let drawn = model.strokes.len();
    let own = model.strokes.iter().find_map(|stroke| match stroke {
        Stroke::Edge { photograph, between, from, to, .. } => {
            Some((*photograph, *between, *from, *to))
        }
        _ => None,
    });
    let (photograph, between, from, to) = own.expect("an edge");
    let edge = |sd_px| Stroke::Edge { photograph, between, from, to, sd_px };
    model.strokes.push(edge(Some(0.125)));
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("model.json");
    lobelia::io::model::write(&file, &model).unwrap();
    assert_eq!(lobelia::io::model::read(&file).unwrap(), model);
    assert!(lobelia::io::model::to_text(&model).contains("\"version\": 3"));
    assert_eq!(model.drawn(), drawn);
    // What is drawn next stands before it.
    assert_eq!(model.add_stroke(edge(None)), drawn);
    assert_eq!(model.strokes[drawn + 1], edge(Some(0.125)));
    model.forget_found(None);
    assert!(lobelia::io::model::to_text(&model).contains("\"version\": 1"));
    for (sd_px, is_sound) in [(1e-4, false), (1e-3, true), (f64::NAN, false), (1e4, false)] {
        let mut model = model.clone();
        model.strokes.push(edge(Some(sd_px)));
        let solved = lobelia::model::solve(&model, &Default::default());
        let problem = solved.err().map(|error| error.to_string()).unwrap_or_default();
        assert_eq!(problem.contains("sd_px"), !is_sound, "{sd_px}: {problem}");
    }
}

#[test]
fn a_damaged_file_is_told_with_its_place() {
    let sound: Value =
        serde_json::from_str(&std::fs::read_to_string(golden("things.json")).unwrap()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("model.json");
    type Change = fn(&mut Value);
    let cases: [(Change, &[&str]); 14] = [
        (|m| m["format"] = json!("other"), &["format", "lobelia-model"]),
        (|m| m["version"] = json!(7), &["version", "versions up to 3"]),
        (|m| m["lenses"][0]["focal_px"] = json!("long"), &["lenses[0].focal_px", "finite number"]),
        (|m| m["lenses"][0]["fit"] = json!(["zoom"]), &["lenses[0].fit[0]", "focal_px"]),
        (
            |m| m["photographs"][0]["lens"] = json!("lans"),
            &["photographs[0].lens", "Did you mean \"lens\""],
        ),
        (
            |m| m["photographs"][0]["w"] = Value::Null,
            &["photographs[0]", "does not exist", "w and h"],
        ),
        (|m| m["things"][1]["kind"] = json!("boxx"), &["things[1].kind", "\"box\""]),
        (|m| m["things"][1]["on"] = json!("tabel.top"), &["things[1].on", "no thing", "tabel"]),
        (
            |m| m["things"][1]["flush"] = json!("room.wall9"),
            &["things[1].flush", "no upright side"],
        ),
        (|m| m["strokes"][0]["kind"] = json!("scribble"), &["strokes[0].kind", "line"]),
        (|m| m["strokes"][0]["axis"] = json!("w"), &["strokes[0].axis", "no axis"]),
        (|m| m["strokes"][1]["at"] = json!("room.flor1"), &["strokes[1].at", "room.floor1"]),
        (|m| m["strokes"][1]["pixel"] = json!([1]), &["strokes[1].pixel", "2 numbers"]),
        (|m| m["strokes"] = json!(3), &["strokes", "list"]),
    ];
    for (change, parts) in cases {
        let mut value = sound.clone();
        change(&mut value);
        std::fs::write(&file, value.to_string()).unwrap();
        let error = lobelia::io::model::read(&file).unwrap_err().to_string();
        for part in parts.iter().chain(&["model.json"]) {
            assert!(error.contains(part), "\"{part}\" is missing in: {error}");
        }
    }
    let text = sound.to_string();
    std::fs::write(&file, &text[..text.len() / 2]).unwrap();
    let error = lobelia::io::model::read(&file).unwrap_err().to_string();
    assert!(error.contains("not valid JSON") && error.contains("cut off"), "{error}");
}
