//! Import: cameras of other programs against where those put points, meshes, and what people
//! really bring. The sources and their projections are made by `tests/golden/import/make.py`.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DVec2, DVec3};
use lobelia::exposures::MergeOptions;
use lobelia::io::import::{
    Axis, Copying, Holds, Import, Options, Shot, Surfaces, Tidied, Unit, Writing, check_shot,
    holds, read, survey, write,
};
use lobelia::io::{Error, capture, exr, mesh, model};
use lobelia::scene::{Camera, Distortion};
use lobelia::watch::Watch;
use serde_json::Value;

use crate::{data, folder, message, put};

fn golden() -> Value {
    serde_json::from_str(include_str!("../golden/import/projections.json")).unwrap()
}

fn import(source: &Path, options: &Options) -> Result<Import, Error> {
    read(source, options, &Watch::new())
}

fn with_images(folder: &Path) -> Options {
    Options { images: vec![folder.to_owned()], ..Default::default() }
}

/// Photographs of the sizes that a case's cameras have.
fn photographs(folder: &Path, case: &Value) {
    for image in case["images"].as_array().unwrap() {
        let [width, height]: [usize; 2] = serde_json::from_value(image["size"].clone()).unwrap();
        let name = image["name"].as_str().unwrap().rsplit_once('.').unwrap().0.to_owned() + ".exr";
        let file = folder.join(name);
        std::fs::create_dir_all(file.parent().unwrap()).unwrap();
        exr::write_rgb(&file, width, height, &vec![[1.0; 3]; width * height]).unwrap();
    }
}

fn case(name: &str) -> Value {
    let cases = golden()["cases"].as_array().unwrap().clone();
    cases.into_iter().find(|case| case["name"] == name).unwrap()
}

/// The largest distance between where a camera puts the points and where its program does.
fn distance(camera: &Camera, image: &Value, points: &[[f64; 3]]) -> f64 {
    let pixels: Vec<[f64; 2]> = serde_json::from_value(image["pixels"].clone()).unwrap();
    let (mut largest, mut compared) = (0.0_f64, 0);
    for (point, pixel) in points.iter().zip(pixels) {
        if let Some((ours, _)) = camera.project(DVec3::from(*point)) {
            largest = largest.max(ours.distance(DVec2::from(pixel)));
            compared += 1;
        }
    }
    assert!(compared >= points.len() / 2, "{compared} points are in the image {}", image["name"]);
    largest
}

fn points() -> Vec<[f64; 3]> {
    serde_json::from_value(golden()["points"].clone()).unwrap()
}

fn stem(name: &str) -> String {
    let name = name.rsplit(['/', '\\']).next().unwrap();
    name.rsplit_once('.').map_or(name, |(stem, _)| stem).to_owned()
}

fn shot<'a>(import: &'a Import, image: &Value) -> &'a Shot {
    let wanted = stem(image["name"].as_str().unwrap());
    import.shots.iter().find(|shot| stem(&shot.name) == wanted).expect("a camera of that name")
}

#[test]
fn cameras_put_points_where_their_programs_do() {
    let (golden, points) = (golden(), points());
    for case in golden["cases"].as_array().unwrap() {
        let folder = folder();
        photographs(folder.path(), case);
        let name = case["name"].as_str().unwrap();
        let source = data("import").join(case["source"].as_str().unwrap());
        let import = import(&source, &with_images(folder.path())).unwrap();
        let images = case["images"].as_array().unwrap();
        assert_eq!(import.shots.len(), images.len(), "{name}: {:?}", import.warnings);
        // glTF's poses are in single precision.
        let tolerance = if name == "glTF" { 1e-3 } else { 1e-7 };
        for image in images {
            let shot = shot(&import, image);
            assert!(shot.is_measurement && shot.image.is_some());
            let distance = distance(&shot.camera, image, &points);
            assert!(distance < tolerance, "{name}, {}: {distance} px", image["name"]);
        }
    }
}

/// The camera with something about its lens changed.
fn changed(camera: &Camera, change: impl FnOnce(&mut DVec2, &mut Distortion)) -> Camera {
    let (mut principal, mut distortion) = (camera.principal_px, camera.distortion);
    change(&mut principal, &mut distortion);
    let (rotation, position) = (camera.world_from_camera, camera.position);
    let size = (camera.width, camera.height);
    Camera::new(size, camera.focal_px, principal, distortion, rotation, position)
}

#[test]
fn the_known_faults_of_importers_would_show() {
    let points = points();
    let of = |name: &str, options: &dyn Fn(&Path) -> Options| {
        let case = case(name);
        let folder = folder();
        photographs(folder.path(), &case);
        let source = data("import").join(case["source"].as_str().unwrap());
        let import = import(&source, &options(folder.path())).unwrap();
        let image = case["images"][0].clone();
        (shot(&import, &image).camera, image)
    };
    // A principal point that is half a pixel off, as where AliceVision's is taken as it stands.
    let (camera, image) = of("AliceVision 1.2.6", &with_images);
    assert!(distance(&camera, &image, &points) < 1e-7);
    let fault = changed(&camera, |principal, _| *principal -= 0.5);
    assert!(distance(&fault, &image, &points) > 0.7);
    // Tangential terms in OpenCV's order where Metashape's is the other.
    let (camera, image) = of("Metashape", &with_images);
    assert!(distance(&camera, &image, &points) < 1e-7);
    let fault = changed(&camera, |_, distortion| distortion.tangential.reverse());
    assert!(distance(&fault, &image, &points) > 0.1);
    // Photographs that are undistorted already: the lens terms once more would move points.
    let (camera, image) = of("AliceVision 1.2.8", &with_images);
    let undistorted = |folder: &Path| Options { undistorted: true, ..with_images(folder) };
    let (plain, _) = of("AliceVision 1.2.8", &undistorted);
    assert!(plain.distortion.is_none() && !camera.distortion.is_none());
    let gone = changed(&camera, |_, distortion| *distortion = Distortion::default());
    assert_eq!(plain, gone);
    assert!(distance(&plain, &image, &points) > 0.5);
}

#[test]
fn photographs_that_meshroom_has_undistorted_are_known_by_their_names() {
    let folder = folder();
    for view in [100, 101, 102] {
        let file = folder.path().join(format!("{view}.exr"));
        exr::write_rgb(&file, 160, 120, &vec![[1.0; 3]; 160 * 120]).unwrap();
    }
    let import = import(&data("import/meshroom_1.2.6.sfm"), &with_images(folder.path())).unwrap();
    assert_eq!(import.shots.len(), 3);
    assert!(import.shots.iter().all(|shot| shot.camera.distortion.is_none()));
    let warnings = import.warnings.join("\n");
    assert!(warnings.contains("undistorted already"), "{warnings}");
    assert!(warnings.contains("never seen.jpg"), "{warnings}");
}

#[test]
fn colmaps_points_fall_on_their_observations() {
    let [text, binary] = ["colmap_text", "colmap_binary"].map(|name| {
        let import = import(&data("import").join(name), &Options::default()).unwrap();
        assert_eq!(import.shots.len(), 6);
        import.reprojection.expect("points")
    });
    let images = case("COLMAP text")["images"].as_array().unwrap().clone();
    let pixels = images.iter().flat_map(|image| image["pixels"].as_array().unwrap().clone());
    let pixels: Vec<[f64; 2]> =
        pixels.map(|pixel| serde_json::from_value(pixel).unwrap()).collect();
    let is_outside = |p: &&[f64; 2]| !(0.0..160.0).contains(&p[0]) || !(0.0..120.0).contains(&p[1]);
    let outside = pixels.iter().filter(is_outside).count();
    assert!(pixels.len() == 72 && outside < 5);
    for check in [text, binary] {
        assert_eq!((check.observations, check.unseen), (72 - outside, outside));
        assert!(check.points >= 12 - outside);
        // Noise of 0.4 px a coordinate; COLMAP's own figures to the last digit but rounding.
        assert!((0.4..0.7).contains(&check.rms_px), "{check:?}");
        assert!(check.disagreement_px < 1e-7, "{check:?}");
    }
}

#[test]
fn photographs_know_what_colmap_observed_in_them() {
    let photos = folder();
    let case = case("COLMAP text");
    photographs(photos.path(), &case);
    // One is half as large as its camera was.
    let half = photos.path().join("sub folder/4 ä.exr");
    exr::write_rgb(&half, 80, 60, &vec![[1.0; 3]; 80 * 60]).unwrap();
    let options =
        Options { unit: Unit::of("cm").unwrap(), up: Axis::MinusY, ..with_images(photos.path()) };
    let import = import(&data("import/colmap_text"), &options).unwrap();
    assert_eq!((import.shots.len(), import.points.len()), (6, 12));
    let survey = survey(Arc::new(import), &Watch::new()).unwrap();
    assert!(survey.caster.is_none() && survey.edges.is_empty());
    for (shot, own) in survey.import.shots.iter().enumerate() {
        assert_eq!(own.observations.len(), 12);
        let check = check_shot(&survey, shot, &Watch::new()).unwrap();
        let shown = check.picture.unwrap().unwrap();
        assert_eq!(shown.width, own.camera.width);
        // Noise of 0.4 px a coordinate, in pixels of the photograph as it is.
        let factor = own.camera.width as f64 / 160.0;
        assert!((0.1 * factor..0.9 * factor).contains(&check.median_px), "{}", check.median_px);
        assert!(check.worst_px >= check.median_px && check.worst_px < 2.0 * factor);
    }
}

#[test]
fn the_edges_of_the_mesh_fall_where_its_camera_sees_them() {
    let photos = folder();
    let case = case("Metashape");
    photographs(photos.path(), &case);
    let options =
        Options { mesh: Some(data("import/boxes_little.ply")), ..with_images(photos.path()) };
    let import = import(&data("import/metashape.xml"), &options).unwrap();
    let survey = survey(Arc::new(import), &Watch::new()).unwrap();
    assert_eq!(survey.edges.len(), 24, "two boxes, and no diagonals");
    for shot in 0..survey.import.shots.len() {
        let camera = &survey.import.shots[shot].camera;
        assert!(!camera.distortion.is_none());
        let check = check_shot(&survey, shot, &Watch::new()).unwrap();
        let ends: Vec<DVec2> = survey
            .edges
            .iter()
            .flatten()
            .filter_map(|end| Some(camera.project(end.as_dvec3())?.0))
            .collect();
        // Every corner that is seen ends a stroke, hidden or not.
        for end in ends {
            let strokes = check.strokes.iter().flat_map(|stroke| &stroke.points);
            let nearest = strokes.map(|p| f64::from(p.distance(end.as_vec2()))).fold(9.0, f64::min);
            assert!(nearest < 1e-3, "{end}: {nearest} px");
        }
    }
}

#[test]
fn surfaces_are_what_is_asked_for() {
    let folder = folder();
    let quad = |z: i32| format!("v 0 0 {z}\nv 1 0 {z}\nv 1 1 {z}\nv 0 1 {z}\n");
    let text = format!(
        "{}{}{}o table\ng top\nusemtl wood\nf 1 2 3 4\ng leg\nf 5 6 7 8\no lamp\ng shade\n\
         usemtl cloth\nf 9 10 11\nf 9 9 10\n",
        quad(0),
        quad(1),
        quad(2)
    );
    let file = put(folder.path(), "room.obj", text.as_bytes());
    for (surfaces, names) in [
        (Surfaces::Auto, vec!["wood", "cloth"]),
        (Surfaces::Materials, vec!["wood", "cloth"]),
        (Surfaces::Groups, vec!["top", "leg", "shade"]),
        (Surfaces::Objects, vec!["table", "lamp"]),
        (Surfaces::Regions, vec!["plane_1", "plane_2", "plane_3"]),
    ] {
        let options = Options { surfaces, ..Default::default() };
        let import = import(&file, &options).unwrap();
        let geometry = import.geometry.unwrap();
        let found: Vec<&str> = geometry.surfaces.iter().map(|own| own.name.as_str()).collect();
        assert_eq!(found, names, "{surfaces:?}");
    }
    // A single mesh of glTF tells no surfaces apart, but is one object.
    let of = |surfaces| {
        let options = Options { surfaces, ..Default::default() };
        import(&data("import/boxes_scene.glb"), &options).unwrap().geometry.unwrap().surfaces
    };
    assert_eq!((of(Surfaces::Objects).len(), of(Surfaces::Auto).len()), (1, 12));
}

#[test]
fn what_is_joined_and_left_out_is_counted() {
    let folder = folder();
    // Two triangles with their own vertices, of which one edge is the same, and a sliver.
    let facet = |p: [[f32; 3]; 3]| {
        let line = |v: [f32; 3]| format!("vertex {} {} {}\n", v[0], v[1], v[2]);
        format!("facet normal 0 0 1\nouter loop\n{}endloop\nendfacet\n", p.map(line).concat())
    };
    let text = [
        "solid a\n".to_owned(),
        facet([[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]]),
        facet([[1., 0., 0.], [1., 1., 0.], [0., 1., 0.]]),
        facet([[1., 1., 0.], [1.0001, 1., 0.], [1., 1.0001, 0.]]),
        "endsolid a\n".to_owned(),
    ];
    let file = put(folder.path(), "a.stl", text.concat().as_bytes());
    let plain = import(&file, &Options::default()).unwrap().tidied;
    assert_eq!(plain, Tidied { vertices: 9, joined: 3, degenerate: 0 });
    let welded = import(&file, &Options { weld_m: 0.001, ..Default::default() }).unwrap().tidied;
    assert_eq!(welded, Tidied { vertices: 9, joined: 5, degenerate: 1 });
}

/// Photographs whose names and times say that they are exposures, with cameras at `places`.
fn exposures(folder: &Path, places: &[(&str, f64)]) -> PathBuf {
    let frames: Vec<Value> = places
        .iter()
        .map(|(name, x)| {
            serde_json::json!({
                "file_path": name,
                "transform_matrix": [[1, 0, 0, x], [0, 1, 0, 0], [0, 0, 1, 3], [0, 0, 0, 1]],
            })
        })
        .collect();
    let cameras = serde_json::json!({
        "camera_model": "PINHOLE", "w": 16, "h": 12, "fl_x": 16, "fl_y": 16, "cx": 8, "cy": 6,
        "frames": frames,
    });
    put(folder, "transforms.json", cameras.to_string().as_bytes())
}

#[test]
fn exposures_of_a_view_are_found_and_merged() {
    let folder = folder();
    let mut table = String::new();
    for view in ["a", "b"] {
        for (index, time) in [0.1, 0.4, 1.6].into_iter().enumerate() {
            let picture = image::RgbImage::from_fn(16, 12, |x, y| {
                let light = (-2.5 + 0.3 * f64::from(x) + 0.1 * f64::from(y)).exp();
                image::Rgb([(255.0 * (light * time).sqrt()).round().min(255.0) as u8; 3])
            });
            let name = format!("{view}_{index}.png");
            picture.save(folder.path().join(&name)).unwrap();
            table += &format!("{name},{time}\n");
        }
    }
    let times = put(folder.path(), "times.csv", table.as_bytes());
    // Both views have a camera; the first has three, of which one is enough.
    let source = exposures(
        folder.path(),
        &[("a_0.png", 0.0), ("a_1.png", 0.001), ("a_2.png", 0.0), ("b_2.png", 2.0)],
    );
    let times = Some(times.display().to_string());
    let options = Options { times, ..Default::default() };
    let import = import(&source, &options).unwrap();
    let views: Vec<(usize, Vec<usize>)> =
        import.series.iter().map(|view| (view.shot, view.others.clone())).collect();
    assert_eq!(views, [(1, vec![0, 2]), (3, vec![])]);
    assert_eq!(import.series[1].series.reference, 2, "the camera was found on the longest");
    let out = folder.path().join("made");
    let merge = MergeOptions { align: false, ..Default::default() };
    let writing = Writing { merge: Some(merge), ..Default::default() };
    let written = write(&import, &out, &writing, &Watch::new()).unwrap();
    assert!(written.found.is_some());
    assert!(written.warnings.iter().any(|warning| warning.contains("2 cameras")));
    let names = ["a_1", "b_2"].map(|name| out.join(format!("images/{name}.exr")));
    let [a, b] = names.map(|file| exr::read(&file).unwrap().pixels);
    assert_eq!(a.len(), 192);
    let same = a.iter().zip(&b).filter(|(a, b)| (a[1] / b[1] - 1.0).abs() < 1e-3).count();
    assert!(same > 150, "{same} of 192 pixels agree");
    let text = std::fs::read_to_string(out.join("transforms.json")).unwrap();
    assert!(text.contains("a_1.exr") && !text.contains("hdr") && !text.contains("a_0"));
    // Without merging all cameras are written as they are, and a word says so.
    let out = folder.path().join("plain");
    let written = write(&import, &out, &Writing::default(), &Watch::new()).unwrap();
    assert!(written.warnings[0].contains("--series"), "{:?}", written.warnings);
    assert!(out.join("images/a_0.png").is_file());
}

#[test]
fn views_with_times_of_their_own_are_no_series() {
    let folder = folder();
    for name in ["p_1", "p_2", "p_3"] {
        let picture = image::RgbImage::from_pixel(16, 12, image::Rgb([90; 3]));
        picture.save(folder.path().join(format!("{name}.png"))).unwrap();
    }
    let times = put(folder.path(), "times.csv", b"p_1.png,0.1\np_2.png,0.2\np_3.png,0.3\n");
    let places = [("p_1.png", 0.0), ("p_2.png", 1.0), ("p_3.png", 2.0)];
    let source = exposures(folder.path(), &places);
    let times = Some(times.display().to_string());
    let options = Options { times, ..Default::default() };
    message(import(&source, &options).map(drop), &["p_1.png", "exposures"]);
}

#[test]
fn a_capture_is_replaced_only_on_request_and_nothing_else_is() {
    let folder = folder();
    let import = import(&data("import/boxes_little.ply"), &Options::default()).unwrap();
    let out = folder.path().join("made");
    let replace = Writing { replace: true, ..Default::default() };
    let save = |writing: &Writing| write(&import, &out, writing, &Watch::new()).map(drop);
    assert_eq!(holds(&out).unwrap(), Holds::Nothing);
    save(&Writing::default()).unwrap();
    assert_eq!(holds(&out).unwrap(), Holds::Capture);
    message(save(&Writing::default()), &["made", "not empty"]);
    put(&out, "tags.json", b"{}");
    save(&replace).unwrap();
    assert!(!out.join("tags.json").exists());
    put(&out, "novel.txt", b"chapter one");
    assert_eq!(holds(&out).unwrap(), Holds::Other);
    message(save(&replace), &["made", "other things"]);
    assert!(out.join("novel.txt").is_file());
    let beside = std::fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(beside, 1, "nothing is left of what was replaced");
}

#[test]
fn an_import_is_a_capture() {
    let (photos, made) = (folder(), folder());
    let case = case("COLMAP binary");
    photographs(photos.path(), &case);
    // One is for display only, one is missing, one was halved.
    std::fs::remove_file(photos.path().join("sub folder/2 ä.exr")).unwrap();
    let png = include_bytes!("../data/import/grey_160x120.png");
    put(photos.path(), "sub folder/2 ä.png", png);
    std::fs::remove_file(photos.path().join("sub folder/3 ä.exr")).unwrap();
    let half = photos.path().join("sub folder/4 ä.exr");
    exr::write_rgb(&half, 80, 60, &vec![[1.0; 3]; 80 * 60]).unwrap();
    let options = Options {
        mesh: Some(data("import/boxes_little.ply")),
        unit: Unit::of("cm").unwrap(),
        up: Axis::Y,
        ..with_images(photos.path())
    };
    let source = data("import/colmap_binary");
    let import = import(&source, &options).unwrap();
    let warnings = import.warnings.join("\n");
    for part in ["3 ä.png", "not found", "4 ä.png", "scaled"] {
        assert!(warnings.contains(part), "{part}: {warnings}");
    }
    for (name, copying) in [("copied", Copying::Copy), ("linked", Copying::Link)] {
        let out = made.path().join(name);
        let writing = Writing { copying, ..Writing::default() };
        write(&import, &out, &writing, &Watch::new()).unwrap();
        let capture = capture::load(&out, &Watch::new()).unwrap();
        assert_eq!(capture.photographs.len(), 5, "{:?}", capture.warnings);
        assert_eq!(capture.measurements().count(), 4);
        for (photograph, shot) in capture.photographs.iter().zip(&import.shots) {
            assert!(photograph.name.starts_with("images/sub folder/"), "{}", photograph.name);
            assert_eq!(photograph.image.is_some(), shot.is_measurement);
            let (ours, theirs) = (photograph.camera, shot.camera);
            assert_eq!((ours.width, ours.height), (theirs.width, theirs.height));
            assert!((ours.focal_px - theirs.focal_px).length() < 1e-9);
            assert_eq!(
                (ours.principal_px, ours.distortion),
                (theirs.principal_px, theirs.distortion)
            );
            assert!((ours.position - theirs.position).length() < 1e-12);
        }
        // The boxes of 2 × 3 × 1 and 0.5³, in centimetres, y up.
        let (low, high) = capture.mesh.bounds().unwrap();
        let size = high - low;
        assert!((size - glam::Vec3::new(0.0425, 0.01, 0.03)).length() < 1e-6, "{size}");
        assert_eq!(capture.surfaces.len(), 12);
        message(write(&import, &out, &writing, &Watch::new()), &[name, "not empty"]);
    }
    // Halving pixels halves the lens about the corner.
    let (whole, halved) = (&import.shots[0].camera, &import.shots[2].camera);
    assert_eq!((halved.width, whole.width), (80, 160));
    assert_eq!(halved.principal_px, DVec2::new(79.2, 60.4) * 0.5);
}

#[test]
fn every_mesh_format_gives_the_same_boxes() {
    // Two boxes: 2 × 3 × 1 and 0.5³.
    let area = 2.0 * (6.0 + 3.0 + 2.0) + 6.0 * 0.25;
    for name in [
        "ascii.ply",
        "little.ply",
        "big.ply",
        "text.stl",
        "binary.stl",
        "scene.glb",
        "materials.glb",
    ] {
        let geometry = mesh::load(&data("import").join(format!("boxes_{name}"))).unwrap();
        let mesh = &geometry.mesh;
        assert!(geometry.warnings.is_empty(), "{name}: {:?}", geometry.warnings);
        assert_eq!((mesh.triangles.len(), mesh.positions.len()), (24, 16), "{name}");
        let own: f32 = (0..24).map(|triangle| mesh.area(triangle)).sum();
        assert!((own - area).abs() < 1e-4, "{name}: {own}");
        // Outwards: the volume by the divergence theorem.
        let volume: f32 = (0..24)
            .map(|triangle| {
                let [a, b, c] = mesh.corners(triangle);
                a.dot(b.cross(c)) / 6.0
            })
            .sum();
        assert!((volume - 6.125).abs() < 1e-4, "{name}: {volume}");
        let names: Vec<&str> = geometry.surfaces.iter().map(|s| s.name.as_str()).collect();
        if name == "materials.glb" {
            assert_eq!(names, ["house", "shed"]);
        } else {
            // Each side of a box is a plane of its own, the largest first.
            assert_eq!(names.len(), 12, "{name}: {names:?}");
            let first: f32 = (0..24).filter(|&t| mesh.surface[t] == 0).map(|t| mesh.area(t)).sum();
            assert!((first - 6.0).abs() < 1e-4, "{name}: {first}");
        }
    }
}

#[test]
fn regions_follow_planes_and_gather_the_rest() {
    // A floor of many slightly noisy triangles, and a ball on it.
    let folder = folder();
    let mut obj = String::new();
    let steps = 20;
    for y in 0..=steps {
        for x in 0..=steps {
            let noise = 0.002 * f64::from((x * 7 + y * 13) % 5);
            obj += &format!("v {} {} {noise}\n", f64::from(x) * 0.1, f64::from(y) * 0.1);
        }
    }
    for y in 0..steps {
        for x in 0..steps {
            let a = y * (steps + 1) + x + 1;
            obj += &format!("f {} {} {} {}\n", a, a + 1, a + steps + 2, a + steps + 1);
        }
    }
    let base = (steps + 1) * (steps + 1);
    let (rings, sides) = (16, 24);
    for ring in 0..=rings {
        for side in 0..sides {
            let (t, p) = (
                std::f64::consts::PI * f64::from(ring) / f64::from(rings),
                std::f64::consts::TAU * f64::from(side) / f64::from(sides),
            );
            let r = 0.05;
            let (x, y) = (1.0 + r * t.sin() * p.cos(), 1.0 + r * t.sin() * p.sin());
            obj += &format!("v {x} {y} {}\n", 0.3 + r * t.cos());
        }
    }
    for ring in 0..rings {
        for side in 0..sides {
            let at = |ring: i32, side: i32| base + ring * sides + side % sides + 1;
            obj += &format!(
                "f {} {} {}\n",
                at(ring, side),
                at(ring + 1, side),
                at(ring + 1, side + 1)
            );
            obj += &format!(
                "f {} {} {}\n",
                at(ring, side),
                at(ring + 1, side + 1),
                at(ring, side + 1)
            );
        }
    }
    let file = put(folder.path(), "scan.obj", obj);
    let import = import(&file, &Options { weld_m: 1e-5, ..Default::default() }).unwrap();
    let names: Vec<String> =
        import.geometry.as_ref().unwrap().surfaces.iter().map(|s| s.name.clone()).collect();
    assert_eq!(names, ["plane_1", "part_1"], "{:?}", import.warnings);
    // The same on every run and any number of threads.
    let again = import_again(&file);
    assert_eq!(again, import.geometry.unwrap().mesh.surface);
}

fn import_again(file: &Path) -> Vec<u32> {
    let options = Options { weld_m: 1e-5, ..Default::default() };
    import(file, &options).unwrap().geometry.unwrap().mesh.surface
}

#[test]
fn polygons_and_unwraps_survive_being_written() {
    let (folder, out) = (folder(), folder());
    let obj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
               usemtl floor é\nf 1/1 2/2 3/3 4/4\nusemtl wall\nf 1 2 5\n";
    let file = put(folder.path(), "scene.obj", obj);
    let import = import(&file, &Options::default()).unwrap();
    let written = out.path().join("capture");
    write(&import, &written, &Writing::default(), &Watch::new()).unwrap();
    let (before, after) =
        (mesh::load(&file).unwrap(), mesh::load(&written.join("scene.obj")).unwrap());
    assert_eq!(before.surfaces, after.surfaces);
    assert_eq!(before.mesh.polygon, after.mesh.polygon);
    assert_eq!(before.mesh.positions.len(), after.mesh.positions.len());
    for triangle in 0..3 {
        assert_eq!(before.mesh.normal(triangle), after.mesh.normal(triangle));
    }
    let text = std::fs::read_to_string(written.join("scene.obj")).unwrap();
    assert!(text.contains("f 1/1 2/2 3/3 4/4\n"), "{text}");
}

#[test]
fn sources_without_photographs_or_mesh_say_so() {
    let source = data("import/meshroom_1.2.6.sfm");
    let import_it = |options: &Options| import(&source, options);
    let alone = import_it(&Options::default()).unwrap();
    let warnings = alone.warnings.join("\n");
    assert!(alone.shots.len() == 3 && alone.geometry.is_none());
    for part in ["--images", "no mesh", "a 0.jpg"] {
        assert!(warnings.contains(part), "{part}: {warnings}");
    }
    let empty = folder();
    message(import_it(&with_images(empty.path())), &["meshroom_1.2.6.sfm", "--images"]);
    // Sizes come from the photographs there.
    message(import(&data("import/realitycapture.csv"), &Options::default()), &["--images"]);
}

#[test]
fn nothing_outside_of_the_folder_is_read() {
    let (inner, outer) = (folder(), folder());
    let secret = outer.path().join("secret.exr");
    exr::write_rgb(&secret, 4, 2, &[[1.0; 3]; 8]).unwrap();
    put(outer.path(), "lib.mtl", "newmtl a\nillum 2\nKs 1 1 1\nNs 9\n");
    let lib = outer.path().join("lib.mtl");
    let obj = format!("mtllib {}\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n", lib.display());
    put(inner.path(), "scene.obj", obj);
    exr::write_rgb(&inner.path().join("a.exr"), 4, 2, &[[1.0; 3]; 8]).unwrap();
    let pose = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 2], [0, 0, 0, 1]];
    let away = Path::new("..").join(outer.path().file_name().unwrap()).join("secret.exr");
    let names = [secret.to_string_lossy(), away.to_string_lossy(), "a.exr".into()];
    let frames: Vec<Value> = names
        .iter()
        .map(|name| serde_json::json!({"file_path": name, "transform_matrix": pose}))
        .collect();
    let cameras = serde_json::json!({"fl_x": 5, "w": 4, "h": 2, "frames": frames});
    put(inner.path(), "transforms.json", cameras.to_string());
    let capture = capture::load(inner.path(), &Watch::new()).unwrap();
    assert_eq!(capture.photographs.len(), 1);
    let warnings = capture.warnings.join("\n");
    assert!(warnings.contains("outside") && warnings.contains("lib.mtl"), "{warnings}");
    // A link in the folder was put there by somebody, and is followed.
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(&secret, inner.path().join("linked é.exr")).unwrap();
        let frame = serde_json::json!({"file_path": "linked é.exr", "transform_matrix": pose});
        let cameras = serde_json::json!({"fl_x": 5, "w": 4, "h": 2, "frames": [frame]});
        put(inner.path(), "transforms.json", cameras.to_string());
        let capture = capture::load(inner.path(), &Watch::new()).unwrap();
        assert_eq!(capture.measurements().count(), 1);
    }
}

#[test]
fn damaged_models_are_named() {
    let whole = data("import/colmap_binary");
    let with = |name: &str, bytes: Vec<u8>| -> (tempfile::TempDir, PathBuf) {
        let folder = folder();
        for file in ["cameras.bin", "images.bin", "points3D.bin"] {
            std::fs::copy(whole.join(file), folder.path().join(file)).unwrap();
        }
        let file = put(folder.path(), name, bytes);
        (folder, file)
    };
    let refused = |name: &str, bytes: Vec<u8>, parts: &[&str]| {
        let (folder, _) = with(name, bytes);
        message(import(folder.path(), &Options::default()), parts);
    };
    let cameras = std::fs::read(whole.join("cameras.bin")).unwrap();
    refused("cameras.bin", cameras[..60].to_vec(), &["cameras.bin", "byte", "cut off"]);
    let mut foreign = cameras.clone();
    foreign[12] = 99;
    refused("cameras.bin", foreign, &["cameras.bin", "camera model 99"]);
    let mut no_focal = cameras.clone();
    no_focal[32..40].copy_from_slice(&f64::NAN.to_le_bytes());
    refused("cameras.bin", no_focal, &["focal length"]);
    let images = std::fs::read(whole.join("images.bin")).unwrap();
    let endless: Vec<u8> = images[..72].iter().copied().chain([b'a'; 500]).collect();
    refused("images.bin", endless, &["images.bin", "does not end"]);
    let mut huge = images;
    huge[0..8].copy_from_slice(&(1_u64 << 60).to_le_bytes());
    refused("images.bin", huge, &["images.bin", "cut off"]);
    // Points are only a check.
    let (folder, _) = with("points3D.bin", vec![255; 40]);
    let import_it = import(folder.path(), &Options::default()).unwrap();
    assert!(import_it.shots.len() == 6 && import_it.reprojection.is_none());
    assert!(import_it.warnings.join("\n").contains("points3D.bin"));
    // Fisheye lenses are refused by name.
    let text = crate::folder();
    put(text.path(), "cameras.txt", "1 OPENCV_FISHEYE 160 120 100 100 80 60 0 0 0 0\r\n");
    put(text.path(), "images.txt", "1 1 0 0 0 0 0 0 1 a b.png\r\n\r\n");
    message(import(text.path(), &Options::default()), &["OPENCV_FISHEYE", "a b.png"]);
    put(text.path(), "cameras.txt", "1 PINHOLE 160 120 100,5 100 80 60\n");
    message(import(text.path(), &Options::default()), &["cameras.txt, line 1", "comma"]);
    put(text.path(), "cameras.txt", "1 OPENCV 160 120 100 100 80\n");
    message(import(text.path(), &Options::default()), &["line 1", "8 parameters", "3"]);
    put(text.path(), "cameras.txt", "2 PINHOLE 160 120 100 100 80 60\n");
    message(import(text.path(), &Options::default()), &["camera 1", "a b.png"]);
}

#[test]
fn nerfstudios_applied_transform_can_be_undone() {
    let folder = folder();
    exr::write_rgb(&folder.path().join("a.exr"), 4, 2, &[[1.0; 3]; 8]).unwrap();
    // new = 2 (turn old + (1, 2, 3)), turned by a quarter about z.
    let value = serde_json::json!({"fl_x": 5, "applied_scale": 2.0,
        "applied_transform": [[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3]],
        "frames": [{"file_path": "a", "transform_matrix":
            [[0, -1, 0, 2], [1, 0, 0, 4], [0, 0, 1, 8], [0, 0, 0, 1]]}]});
    let file = put(folder.path(), "transforms.json", value.to_string());
    let kept = import(&file, &Options::default()).unwrap();
    assert!(kept.warnings.join("\n").contains("--undo-applied-transform"));
    let undone = import(&file, &Options { undo_applied: true, ..Default::default() }).unwrap();
    let camera = undone.shots[0].camera;
    assert!((camera.position - DVec3::new(0.0, 0.0, 1.0)).length() < 1e-12);
    assert!((camera.world_from_camera.x_axis - DVec3::X).length() < 1e-12);
}

#[test]
fn colmaps_points_come_with_its_cameras_into_the_model() {
    let photos = folder();
    photographs(photos.path(), &case("COLMAP text"));
    let options =
        Options { unit: Unit::of("cm").unwrap(), up: Axis::MinusY, ..with_images(photos.path()) };
    let import = import(&data("import/colmap_text"), &options).unwrap();
    let capture = photos.path().join("capture");
    write(&import, &capture, &Writing::default(), &Watch::new()).unwrap();
    let opened = || {
        let opened = model::open(&capture).unwrap();
        (opened.model, opened.warnings.join("\n"))
    };
    let (own, warnings) = opened();
    assert_eq!(own.found_points.len(), 12);
    assert!(!warnings.contains("points"), "{warnings}");
    let mut compared = 0;
    for point in own.found_points.iter() {
        assert_eq!(point.photographs.len(), point.pixels.len());
        for (&photograph, &pixel) in point.photographs.iter().zip(&point.pixels) {
            let shot = &import.shots[photograph];
            // Some were observed beyond the edge.
            let Some((seen, _)) = shot.camera.project(point.position) else { continue };
            // Noise of 0.4 px a coordinate.
            assert!(seen.distance(pixel) < 2.0, "{}: {seen} and {pixel}", shot.name);
            compared += 1;
        }
    }
    assert!(compared > 60, "{compared}");
    // Twelve points in each photograph tell of its lens.
    assert!(own.lenses.iter().all(|lens| lens.fit.focal && lens.fit.k1));
    let solution = lobelia::model::solve(&own, &Default::default()).unwrap();
    assert!(solution.is_usable(), "{:?}", solution.problems);
    // Of other cameras they would say nonsense, and damage does not keep the cameras away.
    let file = capture.join("points.json");
    let text = std::fs::read_to_string(&file).unwrap();
    let upside_down = text.replace('@', "@-");
    std::fs::write(&file, upside_down).unwrap();
    let (own, warnings) = opened();
    assert!(own.found_points.is_empty() && own.has_found());
    assert!(warnings.contains("not of the cameras"), "{warnings}");
    std::fs::write(&file, text.replace("lobelia-points", "points")).unwrap();
    let (own, warnings) = opened();
    assert!(own.found_points.is_empty() && own.has_found());
    assert!(warnings.contains("these are no points"), "{warnings}");
    // Photographs that are no longer there show nothing.
    let one = import.shots.len() - 1;
    let name = own.photographs[one].name.clone();
    std::fs::write(&file, text.replace(&name, "gone.exr")).unwrap();
    let (own, warnings) = opened();
    assert!(!warnings.contains("points"), "{warnings}");
    assert!(own.found_points.iter().all(|point| !point.photographs.contains(&one)));
    assert!(own.found_points.iter().all(|point| point.photographs.len() == point.pixels.len()));
}
