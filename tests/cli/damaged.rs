use std::fs;
use std::path::Path;

use glam::{DMat3, DVec3};
use lobelia::io::exr;
use serde_json::{Value, json};

use crate::{Copy, Run, coarse, coarse_by, lobelia};

/// Damages a JSON file.
type Change = fn(&mut Value);

/// Reconstructing and looking both end with 1 and a message that contains all `parts`, and
/// nothing is written.
#[track_caller]
fn refused(copy: &Copy, parts: &[&str]) {
    Run::of(lobelia().arg("info").arg(copy.capture())).fails(1, parts);
    unusable(copy, parts);
}

/// The capture can be loaded, but not reconstructed.
#[track_caller]
fn unusable(copy: &Copy, parts: &[&str]) {
    copy.reconstruct().fails(1, parts).says(&["error: "]);
    assert!(!copy.out().exists());
}

/// The rest is used, and a warning contains all `parts`, on the terminal and in the solution.
#[track_caller]
fn tolerated(copy: &Copy, parts: &[&str]) {
    let run = copy.reconstruct().succeeds();
    let is_it = |line: &str| parts.iter().all(|part| line.contains(part));
    let told = run.err.lines().any(|line| line.starts_with("warning: ") && is_it(line));
    assert!(told, "no warning with {parts:?}: {}", run.err);
    let solution = crate::json(&copy.out().join("solution.json"));
    let written = solution["warnings"].as_array().unwrap();
    assert!(written.iter().any(|warning| is_it(warning.as_str().unwrap())), "{written:?}");
}

#[test]
fn a_folder_that_is_not_there() {
    let folder = tempfile::tempdir().unwrap();
    let (lost, out) = (folder.path().join("lost"), folder.path().join("out"));
    Run::of(&mut coarse(&lost, &out)).fails(1, &["lost", "Check that it exists"]);
    let told =
        Run::of(lobelia().arg("info").arg(&lost)).fails(1, &["lost", "Check that it exists"]);
    assert_eq!(told.err.matches("(os error").count(), 1, "{told:#?}");
    let mut new = lobelia();
    new.arg("new").arg(&lost).arg("--images").arg(folder.path());
    Run::of(&mut new).fails(1, &["It is a folder: name a file in it"]);
    let file = folder.path().join("file");
    fs::write(&file, "").unwrap();
    Run::of(&mut coarse(&file, &out))
        .fails(1, &["file", "this is a file, and a capture is a folder"]);
    assert!(!out.exists());
}

#[test]
fn files_that_are_not_there() {
    let copy = Copy::new();
    fs::remove_file(copy.file("scene.obj")).unwrap();
    unusable(&copy, &["there is no geometry", "scene.obj"]);
    let copy = Copy::new();
    fs::remove_file(copy.file("transforms.json")).unwrap();
    refused(&copy, &["transforms.json", "no camera file", "nerfstudio"]);
    let copy = Copy::new();
    fs::remove_file(copy.file("images/003.exr")).unwrap();
    tolerated(&copy, &["transforms.json", "frames[3] (images/003.exr)", "skipped"]);
    fs::remove_dir_all(copy.file("images")).unwrap();
    Run::of(lobelia().arg("info").arg(copy.capture()))
        .fails(1, &["transforms.json", "none of the 6 images", "file_path"]);
}

#[test]
fn folders_in_place_of_files() {
    for (name, parts) in [
        ("scene.obj", &["there is no geometry", "scene.obj"][..]),
        ("transforms.json", &["transforms.json", "this is no file"]),
        ("tags.json", &["tags.json", "this is no file"]),
    ] {
        let copy = Copy::new();
        fs::remove_file(copy.file(name)).unwrap();
        fs::create_dir(copy.file(name)).unwrap();
        // Without a mesh it is a capture that was begun, of which `info` tells what is to do.
        if name == "scene.obj" { unusable(&copy, parts) } else { refused(&copy, parts) }
    }
    let copy = Copy::new();
    fs::remove_file(copy.file("images/000.exr")).unwrap();
    fs::create_dir(copy.file("images/000.exr")).unwrap();
    tolerated(&copy, &["frames[0] (images/000.exr)", "skipped"]);
}

#[test]
fn images_that_are_damaged() {
    let copy = Copy::new();
    let sound = fs::read(copy.file("images/002.exr")).unwrap();
    let parts = ["images/002.exr", "damaged or cut off", "Export or copy it again"];
    for length in [10, 300, sound.len() / 2, sound.len() - 1] {
        copy.put("images/002.exr", &sound[..length]);
        refused(&copy, &parts);
    }
    copy.put("images/002.exr", "");
    refused(&copy, &parts);
    copy.put("images/002.exr", "no picture at all");
    refused(&copy, &["images/002.exr"]);

    // 65536 x 32768 pixels, of which the file holds nothing.
    let mut claim = sound;
    let at = |bytes: &[u8], text: &[u8]| bytes.windows(text.len()).position(|w| w == text).unwrap();
    for name in [b"dataWindow\0box2i\0".as_slice(), b"displayWindow\0box2i\0"] {
        let corner = at(&claim, name) + name.len() + 12;
        claim[corner..corner + 4].copy_from_slice(&65535_i32.to_le_bytes());
        claim[corner + 4..corner + 8].copy_from_slice(&32767_i32.to_le_bytes());
    }
    copy.put("images/002.exr", claim);
    refused(&copy, &["images/002.exr", "65536 x 32768 pixels", "Scale it down"]);
}

#[test]
fn an_image_of_another_size_than_its_camera() {
    let copy = Copy::new();
    copy.edit("transforms.json", |cameras| cameras["w"] = 640.into());
    refused(&copy, &["images/000.exr", "320 x 240", "640 x 240", "frames[0]", "intrinsics"]);
}

#[test]
fn camera_files_that_are_damaged() {
    let copy = Copy::new();
    let sound = copy.text("transforms.json");
    copy.put("transforms.json", &sound[..sound.len() / 2]);
    refused(&copy, &["transforms.json", "line ", "cut off", "export it again"]);
    copy.put("transforms.json", "");
    refused(&copy, &["transforms.json", "line 1"]);
    let changes: [(Change, &[&str]); 5] = [
        (|cameras| cameras["frames"] = json!([]), &["frames", "no camera"]),
        (|cameras| cameras["frames"][4]["transform_matrix"][1][2] = Value::Null, &["frames[4]"]),
        (
            |cameras| cameras["frames"][4]["transform_matrix"][0] = json!([0, 0, 0, 9]),
            &["frames[4] (images/004.exr)", "no rotation"],
        ),
        (|cameras| cameras["fl_x"] = (-1).into(), &["fl_x", "positive"]),
        (|cameras| cameras["camera_model"] = "FISHEYE".into(), &["FISHEYE", "Undistort"]),
    ];
    for (change, parts) in changes {
        copy.put("transforms.json", &sound);
        copy.edit("transforms.json", change);
        refused(&copy, &[&["transforms.json"], parts].concat());
    }
}

#[test]
fn geometry_that_is_damaged() {
    let copy = Copy::new();
    // One broken vertex takes its faces with it; the rest is used.
    copy.replace("scene.obj", "v 3.5 3.3 0\n", "v NaN 3.3 0\n");
    tolerated(&copy, &["scene.obj", "line 9", "broken vertices"]);
    let copy = Copy::new();
    copy.replace("scene.obj", "f 1 4 2\n", "f 1 4 2\nf 1 1 2\nf 3 4 3\n");
    tolerated(&copy, &["scene.obj", "line 11", "2 faces", "without area"]);
    let sound = copy.text("scene.obj");
    fs::remove_dir_all(copy.out()).unwrap();
    for (text, parts) in [
        ("", &["scene.obj", "no geometry"][..]),
        (&sound.replacen("f 1 4 2\n", "f 1 4 2222\n", 1), &["scene.obj", "line 10", "2222", "36"]),
        ("v 0 0 0\nv 1 0 0\nv 1 1 0\n", &["scene.obj", "no faces"]),
        ("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", &["scene.obj", "line 4", "area"]),
        ("v nan 0 0\nv 1 0 0\nv 2 1 0\nf 1 2 3\n", &["scene.obj", "line ", "vert"]),
        ("\u{0}\u{1}\u{2}binary\u{0}", &["scene.obj", "binary"]),
    ] {
        copy.put("scene.obj", text);
        refused(&copy, parts);
    }
}

#[test]
fn tags_that_are_damaged() {
    let copy = Copy::new();
    let sound = copy.text("tags.json");
    copy.put("tags.json", sound.replacen("\"box3\"\n", "\"box33\"\n", 1));
    tolerated(
        &copy,
        &["tags.json", "materials[5].surfaces[0]", "\"box33\"", "did you mean \"box3\"?"],
    );
    copy.put("tags.json", &sound[..sound.len() - 9]);
    fs::remove_dir_all(copy.out()).unwrap();
    refused(&copy, &["tags.json", "line ", "cut off"]);
    let changes: [(Change, &[&str]); 5] = [
        (|tags| tags["materials"] = json!([]), &["materials", "remove the file"]),
        (|tags| tags["materials"][1]["name"] = "floor".into(), &["materials[1].name", "taken"]),
        (|tags| tags["materials"][1]["kind"] = "shiny".into(), &["materials[1].kind", "shiny"]),
        (|tags| tags["materials"][1]["surfaces"] = json!(["floor"]), &["surfaces[0]", "already"]),
        (|tags| tags["saturation"] = 0.into(), &["saturation", "positive"]),
    ];
    for (change, parts) in changes {
        copy.put("tags.json", &sound);
        copy.edit("tags.json", change);
        refused(&copy, &[&["tags.json"], parts].concat());
    }
}

#[test]
fn a_camera_inside_a_box() {
    let copy = Copy::new();
    copy.edit("transforms.json", |cameras| {
        for (row, place) in [0.75, 1.45, 0.4].into_iter().enumerate() {
            cameras["frames"][0]["transform_matrix"][row][3] = place.into();
        }
    });
    tolerated(&copy, &["images/000.exr", "inside a wall or box"]);
}

#[test]
fn cameras_that_look_away() {
    let copy = Copy::new();
    let turn = |frame: &mut Value| {
        // Half a turn about the camera's own y.
        for row in 0..3 {
            for column in [0, 2] {
                let entry = &mut frame["transform_matrix"][row][column];
                *entry = (-entry.as_f64().unwrap()).into();
            }
        }
    };
    copy.edit("transforms.json", |cameras| turn(&mut cameras["frames"][3]));
    tolerated(&copy, &["images/003.exr", "none of the geometry"]);
    fs::remove_dir_all(copy.out()).unwrap();
    copy.edit("transforms.json", |cameras| {
        for frame in [0, 1, 2, 4, 5] {
            turn(&mut cameras["frames"][frame]);
        }
    });
    unusable(&copy, &["no pixel", "geometry", "scene.obj", "same coordinates"]);
}

#[test]
fn photographs_without_a_valid_pixel() {
    let copy = Copy::new();
    copy.edit("tags.json", |tags| tags["saturation"] = 1e-9.into());
    unusable(&copy, &["saturated", "tags.json"]);
    let info = Run::of(lobelia().arg("info").arg(copy.capture())).succeeds();
    info.says(&["images/000.exr", "no pixel is a measurement"]);
    // One of six is no trouble.
    let copy = Copy::new();
    exr::write_rgb(&copy.file("images/004.exr"), 320, 240, &[[f32::NAN; 3]; 320 * 240]).unwrap();
    tolerated(&copy, &["images/004.exr", "no pixel is a measurement"]);
}

#[test]
fn a_capture_for_geometry_only() {
    let copy = Copy::new();
    copy.edit("transforms.json", |cameras| {
        for frame in cameras["frames"].as_array_mut().unwrap() {
            frame["hdr"] = false.into();
        }
    });
    unusable(&copy, &["no photograph", "measures radiance", "OpenEXR"]);
}

/// The inside of a cube whose ceiling shines, seen as a whole by six cameras in its middle.
fn closed_room(folder: &Path, tags: &Value) {
    let mut obj =
        "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv 0 0 2\nv 2 0 2\nv 2 2 2\nv 0 2 2\n".to_owned();
    obj += "usemtl floor\nf 1 2 3 4\nusemtl ceiling\nf 5 8 7 6\n";
    obj += "usemtl walls\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n";
    fs::write(folder.join("scene.obj"), obj).unwrap();
    fs::write(folder.join("tags.json"), tags.to_string()).unwrap();
    let size = 48;
    let mut frames = Vec::new();
    for (index, sight) in
        [DVec3::X, DVec3::Y, DVec3::Z, -DVec3::X, -DVec3::Y, -DVec3::Z].into_iter().enumerate()
    {
        let right = sight.any_orthonormal_vector();
        let pose = DMat3::from_cols(right, right.cross(sight), -sight);
        assert!((pose.determinant() - 1.0).abs() < 1e-12);
        let (rows, name) = (pose.transpose(), format!("{index}.exr"));
        let row = |row: DVec3| json!([row.x, row.y, row.z, 1.0]);
        frames.push(json!({"file_path": name, "transform_matrix": [
            row(rows.x_axis), row(rows.y_axis), row(rows.z_axis), [0, 0, 0, 1]]}));
        // The field of view of 100 degrees overlaps that of the neighbours.
        let tangent = 50_f64.to_radians().tan();
        let pixel = |place: usize| {
            let across = |count: usize| (2.0 * (count as f64 + 0.5) / size as f64 - 1.0) * tangent;
            let ray = pose * DVec3::new(across(place % size), -across(place / size), -1.0);
            if ray.z > ray.x.abs().max(ray.y.abs()) { [2.0; 3] } else { [0.5, 0.4, 0.3] }
        };
        let pixels: Vec<[f32; 3]> = (0..size * size).map(pixel).collect();
        exr::write_rgb(&folder.join(name), size, size, &pixels).unwrap();
    }
    let cameras = json!({"camera_angle_x": 100_f64.to_radians(), "w": size, "h": size,
        "frames": frames});
    fs::write(folder.join("transforms.json"), cameras.to_string()).unwrap();
}

#[test]
fn a_closed_room_without_unknown_light() {
    let surfaces = |name: &str| json!({"name": name, "kind": "diffuse", "surfaces": [name]});
    for tags in [
        json!({"materials": [surfaces("floor"), surfaces("walls")],
            "lights": [{"name": "sky", "kind": "visible", "surfaces": ["ceiling"]}]}),
        json!({"materials": [surfaces("floor"), surfaces("walls"), surfaces("ceiling")]}),
    ] {
        let folder = tempfile::tempdir().unwrap();
        closed_room(folder.path(), &tags);
        let out = folder.path().join("out");
        let run = Run::of(&mut coarse_by("paper", folder.path(), &out)).succeeds();
        run.says(&["warning: no virtual light was placed", "tagged as visible lights"]);
        let lights = crate::json(&out.join("lights.json"));
        assert_eq!(lights["lights"], json!([]));
        let solution = crate::json(&out.join("solution.json"));
        assert_eq!(solution["scene"]["virtual_lights"], 0);
        for material in solution["materials"].as_array().unwrap() {
            assert!(material["samples"].as_u64().unwrap() > 0);
            for value in material["diffuse"].as_array().unwrap() {
                assert!((0.0..=1.0).contains(&value.as_f64().unwrap()), "{material}");
            }
        }
    }
}
