//! Charts in `tags.json`.

use std::path::Path;

use lobelia::io::{capture, exr};
use lobelia::scene::Capture;
use lobelia::watch::Watch;
use serde_json::{Value, json};

use crate::{folder, message, put};

/// A camera 2 m above the middle of a floor of one radiance: 40 × 30 pixels, 1 / 20 m each.
fn write(folder: &Path, charts: &Value) {
    put(folder, "scene.obj", "v -9 -9 0\nv 9 -9 0\nv 9 9 0\nv -9 9 0\nusemtl floor\nf 1 2 3 4\n");
    let frame = json!({"file_path": "images/a.exr",
        "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,2],[0,0,0,1]]});
    let cameras = json!({"fl_x": 40, "w": 40, "h": 30, "frames": [frame]});
    put(folder, "transforms.json", cameras.to_string());
    let materials = json!([{"name": "wood", "surfaces": ["floor"]}]);
    put(folder, "tags.json", json!({"materials": materials, "charts": charts}).to_string());
    std::fs::create_dir_all(folder.join("images")).unwrap();
    exr::write_rgb(&folder.join("images/a.exr"), 40, 30, &[[1.0; 3]; 1200]).unwrap();
}

fn card(change: impl FnOnce(&mut Value)) -> Value {
    let corners = [[10, 10], [22, 10], [22, 20], [10, 20]];
    let mut card = json!({"name": "card", "kind": "grey",
        "views": [{"file_path": "./images/a.exr", "corners": corners}]});
    change(&mut card);
    json!([card])
}

fn load(charts: &Value) -> Result<Capture, lobelia::io::Error> {
    let folder = folder();
    write(folder.path(), charts);
    capture::load(folder.path(), &Watch::new())
}

#[test]
fn a_grey_card_becomes_a_surface_of_its_own() {
    let capture = load(&card(|_| {})).unwrap();
    assert!(capture.warnings.is_empty(), "{:?}", capture.warnings);
    let (material, mesh) = (&capture.materials[1], &capture.mesh);
    assert_eq!((material.name.as_str(), material.surfaces.as_slice()), ("card", &[1usize][..]));
    assert_eq!(material.known_diffuse, Some([0.18; 3]));
    assert_eq!(material.known_diffuse_sd, Some([0.01; 3]));
    let area: f32 =
        (0..mesh.triangles.len()).filter(|&t| mesh.surface[t] == 1).map(|t| mesh.area(t)).sum();
    // 12 × 10 pixels of 5 cm.
    assert!((area - 0.3).abs() < 1e-4, "{area}");
}

#[test]
fn whites_have_the_reflectance_that_is_given() {
    let white = |more: Value| {
        card(|card| {
            card["kind"] = json!("white");
            card.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        })
    };
    message(load(&white(json!({}))), &["charts[0]", "known_diffuse", "data sheet"]);
    let capture = load(&white(json!({"known_diffuse": [0.9, 0.8, 0.7]}))).unwrap();
    assert_eq!(capture.materials[1].known_diffuse, Some([0.9, 0.8, 0.7]));
    let sd = capture.materials[1].known_diffuse_sd.unwrap();
    assert!(std::iter::zip(sd, [0.045, 0.04, 0.035]).all(|(a, b)| (a - b).abs() < 1e-12), "{sd:?}");
    let given = load(&white(json!({"known_diffuse": [0.9, 0.8, 0.7], "known_diffuse_sd": 0.01})));
    assert_eq!(given.unwrap().materials[1].known_diffuse_sd, Some([0.01; 3]));
}

#[test]
fn charts_that_cannot_be_understood_are_named() {
    let refused = |change: &dyn Fn(&mut Value), parts: &[&str]| {
        message(load(&card(|card| change(card))), parts);
    };
    refused(&|card| card["name"] = json!(""), &["charts[0].name", "empty"]);
    refused(&|card| card["name"] = json!("floor"), &["charts[0]", "\"floor\"", "surface"]);
    refused(&|card| card["name"] = json!("wood"), &["\"wood\"", "material"]);
    refused(&|card| card["kind"] = json!("gray"), &["charts[0].kind", "\"gray\"", "\"grey\""]);
    refused(&|card| card["known_diffuse"] = json!([0.1, 2, 0.1]), &["between 0 and 1"]);
    refused(&|card| card["known_diffuse_sd"] = json!(-1), &["negative"]);
    refused(&|card| card["kind"] = json!("table"), &["charts[0]", "\"table\""]);
    let table = |card: &mut Value| {
        card["kind"] = json!("table");
        card["table"] = json!("none.csv");
    };
    refused(&table, &["none.csv"]);
    refused(&|card| card["size"] = json!([0.3, 0]), &["charts[0].size", "above 0", "metres"]);
    refused(&|card| card["size"] = json!(0.3), &["charts[0].size"]);
    refused(&|card| card["views"] = json!([]), &["charts[0].views", "no photograph"]);
    refused(&|card| card["views"][0]["corners"] = json!([[1, 2]]), &["corners", "four"]);
    refused(&|card| card["views"][0]["corners"][2] = json!([1]), &["corners[2]"]);
}

/// 12 × 10 pixels at the distance where a card of 30 × 25 cm covers them, 1 m away; from straight above,
/// where its tilt is least certain.
#[test]
fn a_card_of_known_size_stands_free() {
    let capture = load(&card(|card| card["size"] = json!([0.3, 0.25]))).unwrap();
    assert!(capture.warnings.is_empty(), "{:?}", capture.warnings);
    let names: Vec<&str> = capture.surfaces.iter().map(|own| own.name.as_str()).collect();
    assert_eq!(names, ["floor", "card back", "card"]);
    let mesh = &capture.mesh;
    let normals = [(1, -1.0), (2, 1.0)];
    for (surface, up) in normals {
        for triangle in (0..mesh.triangles.len()).filter(|&t| mesh.surface[t] == surface) {
            assert!((mesh.normal(triangle).z - up).abs() < 1e-3, "{:?}", mesh.normal(triangle));
            for corner in mesh.corners(triangle) {
                // Front and back are apart by a part of the scene's size.
                assert!((corner.z - 1.0).abs() < 5e-3, "{corner}");
            }
        }
    }
    assert!(capture.materials[1].known_diffuse_sd.unwrap()[0] > 0.02);
}

/// What can be corrected later is no reason to refuse the capture.
#[test]
fn charts_that_cannot_be_used_are_left_out() {
    let left_out = |change: &dyn Fn(&mut Value), parts: &[&str]| {
        let capture = load(&card(|card| change(card))).unwrap();
        assert_eq!((capture.materials.len(), capture.surfaces.len()), (1, 1));
        assert_eq!(capture.warnings.len(), 1, "{:?}", capture.warnings);
        message(Err::<(), _>(capture.warnings[0].clone()), parts);
    };
    let elsewhere = |card: &mut Value| card["views"][0]["file_path"] = json!("images/b.exr");
    left_out(&elsewhere, &["charts[0]", "\"card\" is left out", "images/b.exr", "did you mean"]);
    let crossed = json!([[10, 10], [22, 20], [22, 10], [10, 20]]);
    left_out(
        &|card| card["views"][0]["corners"] = crossed.clone(),
        &["nothing is pinned", "in turn"],
    );
}
