//! `lobelia chart`: what it reads, refuses, and writes into tags.json.

use std::path::Path;

use glam::DVec3;
use lobelia::scene::charts::Table;
use serde_json::{Value, json};

use crate::drawn_chart::{CAMERA, SIZE, capture, chart};
use crate::{Run, lobelia};

/// From the corner of dark skin on, clockwise.
const CORNERS: [&str; 4] = ["20,24", "128,24", "128,96", "20,96"];

fn read(folder: &Path, corners: &[&str], more: &[&str]) -> Run {
    let mut command = lobelia();
    command.args(["chart", "--quiet", "--image", "images/a.exr", "--corners"]).args(corners);
    Run::of(command.args(more).arg("--").arg(folder))
}

fn sound() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    capture(folder.path(), &chart(|_, _, own| own));
    folder
}

fn parsed(run: &Run) -> Value {
    serde_json::from_str(&run.out).unwrap()
}

#[test]
fn a_chart_tells_the_cameras_colours() {
    let folder = sound();
    let run = read(folder.path(), &CORNERS, &["--json"]).succeeds();
    let value = parsed(&run);
    let patches = value["patches"].as_array().unwrap();
    assert_eq!(patches.len(), 24);
    for patch in patches {
        let of = |key: &str| patch["delta_e_2000"][key].as_f64().unwrap();
        assert!(of("matrix") < 0.1 && of("matrix") < 0.5 * of("as_is"), "{patch}");
        assert_eq!(patch["missing"], 0.0);
    }
    assert_eq!(value["linearity"]["curve_is_better"], false);
    // In one argument, as many programs write positions; as a table.
    let run = read(folder.path(), &[&CORNERS.join(",")], &["--kind", "classic24"]).succeeds();
    assert!(run.out.contains("dark skin") && run.out.contains("matrix"), "{}", run.out);
    assert!(!folder.path().join("tags.json").exists());
}

#[test]
fn a_photograph_that_is_not_linear_is_named() {
    let folder = tempfile::tempdir().unwrap();
    capture(folder.path(), &chart(|_, _, own| own.powf(1.0 / 2.2)));
    let run = read(folder.path(), &CORNERS, &[]).succeeds();
    run.says(&["not linear", "to the power 2."]);
}

#[test]
fn what_is_no_chart_is_said_so_and_nothing_pinned() {
    let folder = sound();
    let refused = |corners: [usize; 4], parts: &[&str]| {
        let corners = corners.map(|k| CORNERS[k]);
        read(folder.path(), &corners, &["--pin"]).fails(1, parts);
        assert!(!folder.path().join("tags.json").exists());
    };
    // Upside down, from another corner on, and the other way round.
    let order = "20,24 128,24 128,96 20,96";
    refused([2, 3, 0, 1], &["turned", order]);
    refused([1, 2, 3, 0], &["turned", order]);
    refused([0, 3, 2, 1], &["mirrored", order]);
    refused([0, 2, 1, 3], &["in turn"]);
    let elsewhere = |corners: [&str; 4], parts: &[&str]| {
        read(folder.path(), &corners, &["--pin"]).fails(1, parts);
    };
    elsewhere(["129,1", "159,1", "159,119", "129,119"], &["another chart"]);
    elsewhere(["20,24", "170,24", "170,96", "20,96"], &["outside of the picture"]);
    elsewhere(["20,24", "24,24", "24,28", "20,28"], &["too small"]);
    elsewhere(["1,2", "3", "4", "5"], &["--corners", "four positions"]);
    let spoilt = |change: &dyn Fn(usize, usize, DVec3) -> DVec3, parts: &[&str]| {
        let folder = tempfile::tempdir().unwrap();
        capture(folder.path(), &chart(change));
        read(folder.path(), &CORNERS, &["--pin"]).fails(1, parts);
        assert!(!folder.path().join("tags.json").exists());
    };
    let inf = DVec3::splat(f64::INFINITY);
    spoilt(&|x, y, own| if x < 40 && y > 78 { inf } else { own }, &["burnt out", "white 9.5"]);
    spoilt(&|x, _, own| if x > 70 { DVec3::ONE } else { own }, &["half hidden"]);
    spoilt(&|x, y, own| if x + y < 62 { 0.2 * own } else { own }, &["dark skin", "uneven"]);
    spoilt(&|x, y, own| if x < 38 && y > 78 { 0.4 * own } else { own }, &["white 9.5", "hidden"]);
}

#[test]
fn pinned_it_is_known_to_the_solve() {
    let folder = sound();
    let run = read(folder.path(), &CORNERS, &["--pin", "--matrix"]).succeeds();
    run.says(&["5 known reflectances", "colour matrix"]);
    let info = Run::of(lobelia().arg("info").arg(folder.path())).succeeds();
    for part in
        ["chart neutral 5", "known diffuse 0.1876 0.1923 0.1918", "without a material: chart"]
    {
        assert!(info.out.contains(part), "{part}: {}", info.out);
    }
    assert!(!info.err.contains("left out"), "{}", info.err);
    // Read by that matrix it is as it should be, and so is a second matrix.
    let value = parsed(&read(folder.path(), &CORNERS, &["--json", "--pin", "--matrix"]).succeeds());
    for patch in value["patches"].as_array().unwrap() {
        assert!(patch["delta_e_2000"]["gains"].as_f64().unwrap() < 0.7, "{patch}");
    }
    let tags: Value =
        serde_json::from_str(&std::fs::read_to_string(folder.path().join("tags.json")).unwrap())
            .unwrap();
    assert_eq!(tags["charts"].as_array().unwrap().len(), 1);
    assert_eq!(
        tags["materials"],
        json!([{"name": "floor", "kind": "diffuse", "surfaces": ["floor"]}])
    );
    // White keeps its colour.
    let row = |k: usize| {
        DVec3::from_array([0, 1, 2].map(|c| tags["color_matrix"][k][c].as_f64().unwrap()))
    };
    let white = CAMERA * DVec3::ONE;
    for k in 0..3 {
        assert!((row(k).dot(white) / white[k] - 1.0).abs() < 0.01);
    }
}

#[test]
fn cards_and_tables_of_ones_own() {
    let folder = sound();
    // The patch neutral 6.5, and what its table says.
    let card = ["57,79", "71,79", "71,95", "57,95"];
    read(folder.path(), &card, &["--kind", "white"]).fails(1, &["data sheet"]);
    read(folder.path(), &card, &["--sd", "0.1"]).fails(1, &["its table"]);
    read(folder.path(), &card, &["--kind", "none.csv"]).fails(1, &["none.csv", "colorchecker"]);
    let known = ["--kind", "white", "--reflectance", "0.36,0.36,0.36", "--sd", "0.01", "--pin"];
    read(folder.path(), &card, &known).succeeds();
    let info = Run::of(lobelia().arg("info").arg(folder.path())).succeeds();
    assert!(info.out.contains("card  diffuse, known diffuse 0.36 0.36 0.36"), "{}", info.out);

    let mut table = "row,column,name,red,green,blue,sd\n".to_owned();
    for (k, patch) in Table::color_checker().patches.iter().enumerate() {
        let [r, g, b] = patch.reflectance;
        table += &format!("{},{},{},{r},{g},{b},0.01\n", k / 6 + 1, k % 6 + 1, patch.name);
    }
    let file = folder.path().join("own.csv");
    std::fs::write(&file, table).unwrap();
    let file = file.to_str().unwrap();
    let run = read(folder.path(), &CORNERS, &["--kind", file, "--name", "own", "--pin"]).succeeds();
    assert!(run.out.contains("bluish green"), "{}", run.out);
    let info = Run::of(lobelia().arg("info").arg(folder.path())).succeeds();
    assert!(info.out.contains("own neutral 8  diffuse, known diffuse"), "{}", info.out);
    assert!(info.out.contains("card  diffuse"), "{}", info.out);
}

#[test]
fn a_card_that_stands_free_is_pinned_by_its_size() {
    let folder = tempfile::tempdir().unwrap();
    capture(folder.path(), &vec![[1.0; 3]; SIZE.0 * SIZE.1]);
    let pinned = |corners: &[&str], size: &str| {
        read(folder.path(), corners, &["--kind", "grey", "--pin", "--size", size])
    };
    let aside = ["130,20", "150,20", "150,40", "130,40"];
    pinned(&aside, "0.2,0.2")
        .fails(1, &["two poses fit", "another photograph", "nothing is pinned"]);
    pinned(&CORNERS, "0.6,0.9").fails(1, &["does not fit", "check its size"]);
    pinned(&CORNERS, "0.9").fails(2, &["--size", "two lengths"]);
    pinned(&CORNERS, "3,2").fails(1, &["a known surface is", "in front of it"]);
    assert!(!folder.path().join("tags.json").exists());
    // 108 pixels are 90 cm where the focal length is 160 pixels: 1.333 m below the camera. Again, as it
    // is there already; half as large it is half as far away, before the card that is there.
    for (size, place) in [
        ("0.9,0.6", "-0.050, 0.000, 0.667"),
        ("0.9,0.6", "-0.050, 0.000, 0.667"),
        ("0.45,0.3", "-0.025, 0.000, 1.333"),
    ] {
        pinned(&CORNERS, size).succeeds().says(&["its middle is at", place, "is pinned", "tilt"]);
    }
    let text = std::fs::read_to_string(folder.path().join("tags.json")).unwrap();
    let tags: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(tags["charts"].as_array().unwrap().len(), 1);
    assert_eq!(tags["charts"][0]["size"], json!([0.45, 0.3]));
    let info = Run::of(lobelia().arg("info").arg(folder.path())).succeeds();
    assert!(info.out.contains("card back"), "{}", info.out);
}

#[test]
fn several_photographs_each_need_their_corners() {
    let folder = sound();
    let twice = ["--image", "images/a.exr"];
    read(folder.path(), &CORNERS, &twice).fails(1, &["2 --image and 1 --corners"]);
    let again = [&twice[..], &["--corners"], &CORNERS].concat();
    let value =
        parsed(&read(folder.path(), &CORNERS, &[&again[..], &["--json"]].concat()).succeeds());
    assert_eq!(value.as_array().unwrap().len(), 2);
    let matrix = [&again[..], &["--matrix"]].concat();
    read(folder.path(), &CORNERS, &matrix).fails(1, &["--matrix", "one photograph"]);
}
