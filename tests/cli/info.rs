use std::fs;

use crate::{Copy, Run, example, lobelia};

#[test]
fn images_surfaces_and_materials_are_told() {
    let run = Run::of(lobelia().arg("info").arg(example())).succeeds();
    assert_eq!(run.err, "", "a sound capture gives no warning");
    for part in [
        "42 triangles in 6 surfaces",
        "3.50 × 3.30 × 3.00 m",
        "photographs: 6 (6 measure radiance)",
        "images/005.exr  320×240",
        "0 invalid or saturated pixels",
        "materials: 6",
        "box2  diffuse: box2",
    ] {
        assert!(run.out.contains(part), "\"{part}\" is missing in: {}", run.out);
    }
}

#[test]
fn without_tags_every_surface_is_a_material() {
    let copy = Copy::new();
    fs::remove_file(copy.file("tags.json")).unwrap();
    let run = Run::of(lobelia().arg("info").arg(copy.capture())).succeeds();
    assert_eq!(run.err, "");
    assert!(run.out.contains("materials: 6") && run.out.contains("floor  diffuse: floor"));
    copy.reconstruct().succeeds();
}

#[test]
fn tags_and_frames_are_told() {
    let copy = Copy::new();
    copy.edit("tags.json", |tags| {
        tags["materials"][0]["kind"] = "specular".into();
        tags["materials"][1]["textured"] = true.into();
        tags["materials"][2]["known_diffuse"] = serde_json::json!([0.3, 0.5, 0.7]);
        tags["materials"][2]["known_diffuse_sd"] = 0.02.into();
        tags["materials"].as_array_mut().unwrap().truncate(5);
        tags["lights"] = serde_json::json!([
            {"name": "sun", "kind": "sun", "direction": [0, 0, -1], "irradiance": null},
            {"kind": "sphere", "center": [1, 2, 3], "radius_m": 0.1, "radiance": [4, 5, 6]},
            {"name": "tube", "kind": "rectangle", "corners": [[0,0,2],[1,0,2],[1,0.5,2],[0,0.5,2]],
             "normal": [0, 0, -1], "color": [1, 0.9, 0.8]}]);
        // The brightest pixels of the example lie above.
        tags["saturation"] = 0.5.into();
    });
    copy.edit("transforms.json", |cameras| {
        cameras["frames"][1]["use"] = "geometry".into();
        cameras["frames"][2]["file_path"] = "images/lost.exr".into();
    });
    let run = Run::of(lobelia().arg("info").arg(copy.capture())).succeeds();
    let run = run.says(&["warning: ", "frames[2] (images/lost.exr)", "skipped", "\"box3\""]);
    for part in [
        "photographs: 5 (4 measure radiance)",
        "images/001.exr  320×240  geometry only",
        "floor  specular: floor",
        "wall1  diffuse, textured: wall1",
        "wall2  diffuse, known diffuse 0.3 0.5 0.7 (standard deviation 0.02 0.02 0.02): wall2",
        "surfaces without a material: box3",
        "known lights: 3",
        "sun  sun along 0.000 0.000 -1.000, diameter 0.53°, irradiance unknown\n",
        "light 2  sphere at 1 2 3, radius 0.1 m, radiance 4 5 6\n",
        "tube  rectangle with the corners 0 0 2, 1 0 2, 1 0.5 2, 0 0.5 2, facing 0.000 0.000 -1.000, \
         radiance unknown in the ratio 1 0.9 0.8\n",
    ] {
        assert!(run.out.contains(part), "\"{part}\" is missing in: {}", run.out);
    }
    assert!(!run.out.contains(" 0 invalid or saturated"), "{}", run.out);
}
