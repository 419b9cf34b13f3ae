use std::fs;
use std::path::{Path, PathBuf};

use lobelia::io::{exr, picture};
use serde_json::json as object;

use crate::{Copy, Run, coarse, example, files_below, json, lobelia};

/// A solution of the example and a place for pictures.
struct Pictures {
    folder: tempfile::TempDir,
}

impl Pictures {
    fn new() -> Self {
        let pictures = Self { folder: tempfile::tempdir().unwrap() };
        Run::of(&mut coarse(&example(), &pictures.at("solution"))).succeeds();
        pictures
    }

    fn at(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn put(&self, name: &str, value: serde_json::Value) -> PathBuf {
        let file = self.at(name);
        fs::write(&file, value.to_string()).unwrap();
        file
    }

    /// Small cameras where the example's own are; the frames' names are these.
    fn cameras(&self, names: &[&str]) -> PathBuf {
        let mut cameras = json(&example().join("transforms.json"));
        for key in ["w", "h", "fl_x", "fl_y", "cx", "cy"] {
            cameras[key] = (cameras[key].as_f64().unwrap() / 10.0).into();
        }
        for key in ["w", "h"] {
            cameras[key] = (cameras[key].as_f64().unwrap() as u64).into();
        }
        let frames = cameras["frames"].as_array_mut().unwrap();
        frames.truncate(names.len());
        for (frame, name) in frames.iter_mut().zip(names) {
            frame["file_path"] = (*name).into();
        }
        self.put("cameras.json", cameras)
    }

    /// A panel, a bulb of the same name, and a block that the picture shows.
    fn edits(&self) -> PathBuf {
        fs::write(
            self.at("block.obj"),
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl new\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n",
        )
        .unwrap();
        let corners = [[2, 2, 2], [3, 2, 2], [3, 3, 2], [2, 3, 2]];
        self.put(
            "edits.json",
            object!({
                "lights": [
                    {"name": "lamp", "kind": "rectangle", "corners": corners,
                     "normal": [0, 0, -1], "radiance": [3, 2, 1]},
                    {"name": "Lamp", "kind": "point", "position": [1, 2, 1.5],
                     "intensity": [1, 1, 1]}],
                "objects": [{"mesh": "block.obj",
                    "world_from_object": [[1, 0, 0, 1.2], [0, 1, 0, 1.2], [0, 0, 1, 0], [0, 0, 0, 1]],
                    "materials": {"new": {"diffuse": [0.5, 0.5, 0.5]}}}],
                "materials": {"floor": {"diffuse": [0.2, 0.2, 0.2]}}}),
        )
    }

    fn render(&self, out: &str, arguments: &[&str]) -> std::process::Command {
        let mut command = lobelia();
        command.arg("render").arg(example()).arg("--solution").arg(self.at("solution"));
        command.arg("--out").arg(self.at(out)).args(arguments);
        command
    }
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn channel(file: &Path, name: &str) -> Vec<f32> {
    exr::read_channel(file, name).unwrap().unwrap_or_else(|| panic!("no channel {name}"))
}

#[test]
fn layers_add_up_and_files_are_named_after_their_frames() {
    let pictures = Pictures::new();
    let (cameras, edits) =
        (pictures.cameras(&["a/000.exr", "b/000.png", "last.exr"]), pictures.edits());
    let flags = ["--cameras", text(&cameras), "--edits", text(&edits), "--spp", "4", "--png"];
    let run = Run::of(&mut pictures.render("out", &flags)).succeeds();
    assert!(run.out.contains("3 pictures in"), "{}", run.out);
    let names =
        ["000-2.exr", "000-2.png", "000.exr", "000.png", "last.exr", "last.png"].map(String::from);
    assert_eq!(files_below(&pictures.at("out")), names);

    for name in ["000.exr", "000-2.exr", "last.exr"] {
        let file = pictures.at("out").join(name);
        assert_eq!(picture::dimensions(&file).unwrap(), (32, 24));
        for c in ["R", "G", "B"] {
            let beauty = channel(&file, c);
            let sum = |layers: &[&str]| {
                let layers: Vec<_> =
                    layers.iter().map(|layer| channel(&file, &format!("{layer}.{c}"))).collect();
                (0..beauty.len()).map(move |k| layers.iter().map(|l| l[k]).sum::<f32>())
            };
            let lights = sum(&["light recovered", "light lamp", "light Lamp-2"]);
            let detours = sum(&["direct", "indirect"]);
            for ((beauty, lights), detours) in beauty.iter().zip(lights).zip(detours) {
                assert!((beauty - lights).abs() <= 1e-5 * beauty.abs(), "{beauty} {lights}");
                assert!((beauty - detours).abs() <= 1e-5 * beauty.abs(), "{beauty} {detours}");
            }
            assert!(beauty.iter().sum::<f32>() > 0.0);
        }
        let (known, distance) = (channel(&file, "A"), channel(&file, "Z"));
        assert!(known.iter().zip(distance).all(|(known, z)| (*known > 0.0) == (z > 0.0)));
        let objects = channel(&file, "object.A");
        assert!(objects.iter().any(|&part| part > 0.9) && objects.contains(&0.0));
    }
    assert_eq!(picture::dimensions(&pictures.at("out/000.png")).unwrap(), (32, 24));

    // The same on one thread and another number of them.
    let mut one = pictures.render("one", &flags[..6]);
    Run::of(one.env("RAYON_NUM_THREADS", "1")).succeeds();
    for name in ["000.exr", "last.exr"] {
        let bytes = |folder: &str| fs::read(pictures.at(folder).join(name)).unwrap();
        assert!(bytes("out") == bytes("one"), "{name}");
    }
}

/// Read again, which converts by the chromaticities of the file, it is the same picture.
#[test]
fn pictures_in_acescg_state_it_and_are_the_same_light() {
    let pictures = Pictures::new();
    let (cameras, edits) = (pictures.cameras(&["one.exr"]), pictures.edits());
    let flags = ["--cameras", text(&cameras), "--edits", text(&edits), "--spp", "1"];
    Run::of(&mut pictures.render("plain", &flags)).succeeds();
    let wide = [&flags[..], &["--color-space", "acescg"]].concat();
    Run::of(&mut pictures.render("wide", &wide)).succeeds();
    let (plain, wide) = (pictures.at("plain/one.exr"), pictures.at("wide/one.exr"));
    let read = |file: &Path| exr::read(file).unwrap().pixels;
    for (plain, wide) in read(&plain).iter().zip(&read(&wide)) {
        for (plain, wide) in plain.iter().zip(wide) {
            assert!((plain - wide).abs() < 1e-4 * plain.abs().max(0.1), "{plain} {wide}");
        }
    }
    assert!(channel(&plain, "R") != channel(&wide, "R"));
    // Layers of colours are converted like the picture, others are not.
    let sum = |layers: [&str; 2]| -> Vec<f32> {
        let layers = layers.map(|layer| channel(&wide, &format!("{layer}.G")));
        std::iter::zip(&layers[0], &layers[1]).map(|(a, b)| a + b).collect()
    };
    for (whole, parts) in channel(&wide, "G").iter().zip(sum(["direct", "indirect"])) {
        assert!((whole - parts).abs() <= 1e-5 * whole.abs().max(0.01), "{whole} {parts}");
    }
    for layer in ["Z", "normal.X"] {
        assert_eq!(channel(&plain, layer), channel(&wide, layer));
    }
    let unknown = [&flags[..], &["--color-space", "xyz"]].concat();
    Run::of(&mut pictures.render("none", &unknown)).fails(2, &["rec709, acescg"]);
}

#[test]
fn without_edits_the_composite_is_the_photograph() {
    let (pictures, copy) = (Pictures::new(), Copy::new());
    copy.edit("transforms.json", |cameras| cameras["frames"].as_array_mut().unwrap().truncate(2));
    let (capture, solution, out) = (copy.capture(), pictures.at("solution"), pictures.at("out"));
    let mut command = lobelia();
    command.arg("render").arg(&capture).arg("--solution").arg(&solution).arg("--out").arg(&out);
    Run::of(command.args(["--spp", "1", "--composite", "-q"])).succeeds();
    for index in 0..2 {
        let file = pictures.at(&format!("out/00{index}-composite.exr"));
        let composite = exr::read(&file).unwrap();
        let photograph = exr::read(&example().join(format!("images/00{index}.exr"))).unwrap();
        assert!(composite.pixels == photograph.pixels, "{index}");
        assert!(channel(&file, "change.G").iter().all(|&change| change == 0.0));
    }
    // A quarter of the light gives a quarter of the photograph, modelled or not.
    let dim = pictures.put("dim.json", object!({"original_light": 0.25}));
    let out = pictures.at("dim");
    let mut command = lobelia();
    command.arg("render").arg(&capture).arg("--solution").arg(&solution).arg("--out").arg(&out);
    command.arg("--edits").arg(&dim).args(["--spp", "1", "--composite", "-q"]);
    Run::of(&mut command).succeeds();
    let composite = exr::read(&out.join("000-composite.exr")).unwrap();
    let photograph = exr::read(&example().join("images/000.exr")).unwrap();
    for (composed, taken) in composite.pixels.iter().zip(&photograph.pixels) {
        for (composed, taken) in composed.iter().zip(taken) {
            assert!((composed - 0.25 * taken).abs() <= 1e-5 * taken.abs() + 1e-6);
        }
    }
    // The rendering is no copy of it, but of the same brightness.
    let mean = |file: PathBuf| {
        let pixels = exr::read(&file).unwrap().pixels;
        pixels.iter().map(|pixel| f64::from(pixel[1])).sum::<f64>() / pixels.len() as f64
    };
    let ratio = mean(pictures.at("out/001.exr")) / mean(example().join("images/001.exr"));
    assert!((0.9..1.1).contains(&ratio), "{ratio}");
}

#[test]
fn the_recovered_light_is_turned_off_in_parts() {
    let pictures = Pictures::new();
    let cameras = pictures.cameras(&["000.exr"]);
    let off = pictures.put("off.json", object!({"original_light_groups": {"lamp 99": 0}}));
    let arguments = ["--cameras", text(&cameras), "--edits", text(&off), "--spp", "4"];
    // What there is instead is told: all of it.
    let run = Run::of(&mut pictures.render("same", &arguments))
        .succeeds()
        .says(&["no group \"lamp 99\"", "lamp 1"]);
    let names = run.err.lines().find_map(|line| line.split_once("it has ")).unwrap().1;
    let groups: serde_json::Map<String, serde_json::Value> =
        names.trim().split(", ").map(|name| (name.to_owned(), 0.into())).collect();
    let off = pictures.put("dark.json", object!({ "original_light_groups": groups }));
    let arguments = ["--cameras", text(&cameras), "--edits", text(&off), "--spp", "4"];
    let run = Run::of(&mut pictures.render("dark", &arguments)).succeeds();
    assert!(!run.err.contains("no group"), "{}", run.err);
    let brightest = |folder: &str| {
        let pixels = exr::read(&pictures.at(folder).join("000.exr")).unwrap().pixels;
        pixels.iter().flatten().copied().fold(0.0f32, f32::max)
    };
    assert!(brightest("same") > 0.0);
    assert_eq!(brightest("dark"), 0.0);
}

#[test]
fn what_cannot_be_rendered_is_refused() {
    let pictures = Pictures::new();
    let cameras = pictures.cameras(&["000.exr"]);
    let refused = |arguments: &[&str], code: i32, parts: &[&str]| {
        Run::of(&mut pictures.render("out", arguments)).fails(code, parts);
        assert!(!pictures.at("out").exists());
    };
    refused(&["--spp", "0"], 1, &["spp", "0 is outside 1 to"]);
    refused(&["--time", "soon"], 1, &["time", "soon"]);
    refused(&["--sp", "4"], 2, &["--sp"]);
    refused(&["--cameras", "none.json"], 1, &["none.json", "cannot be read"]);
    refused(&["--edits", "none.json"], 1, &["none.json", "cannot be read"]);
    let edits = pictures.put("bad.json", object!({"lights": [{"kind": "lamp"}]}));
    let parts = ["bad.json, lights[0].kind", "\"lamp\" is no kind", "\"sphere\""];
    refused(&["--cameras", text(&cameras), "--edits", text(&edits)], 1, &parts);

    let bare = |arguments: &[&str]| Run::of(lobelia().arg("render").args(arguments));
    bare(&[text(&example())]).fails(2, &["--solution", "--out"]);
    let out = pictures.at("out");
    let none = pictures.at("none");
    bare(&[text(&example()), "--solution", text(&none), "--out", text(&out)])
        .fails(1, &["solution.json", "cannot be read"]);
    bare(&[text(&none), "--solution", text(&none), "--out", text(&out)]).fails(1, &["none"]);
    fs::write(&out, "a file").unwrap();
    Run::of(&mut pictures.render("out", &[])).fails(1, &["out", "a file is there"]);

    // Another capture's solution: of the example with another material.
    let copy = Copy::new();
    copy.edit("tags.json", |tags| tags["materials"][0]["name"] = "ground".into());
    let (capture, solution, out) = (copy.capture(), pictures.at("solution"), copy.out());
    bare(&[text(&capture), "--solution", text(&solution), "--out", text(&out)])
        .fails(1, &["no material \"ground\"", "Reconstruct the capture again"]);
}

#[test]
fn renders_are_scored_beside_true_pictures() {
    let pictures = Pictures::new();
    let cameras = pictures.cameras(&["a.exr", "b.exr"]);
    let flags = ["--cameras", text(&cameras), "--spp", "2", "-q"];
    Run::of(&mut pictures.render("out", &flags)).succeeds();
    // A truth that is 10 % brighter; b is right, but for a pixel that nobody knows.
    let truth = pictures.at("truth");
    for (name, factor) in [("a.exr", 1.1f32), ("b.exr", 1.0)] {
        let mut pixels = exr::read(&pictures.at("out").join(name)).unwrap().pixels;
        pixels.iter_mut().flatten().for_each(|value| *value *= factor);
        pixels[24 * 32 - 1] = [f32::NAN; 3];
        exr::write_rgb(&truth.join(name), 32, 24, &pixels).unwrap();
    }
    let score = |more: &[&str]| {
        let mut command = lobelia();
        command.arg("score").arg(example()).arg(pictures.at("solution")).args(more);
        Run::of(&mut command)
    };
    let (out, file) = (pictures.at("out"), pictures.at("score.json"));
    let folders = ["--renders", text(&out), "--truth-images", text(&truth)];
    let run = score(&[&folders[..], &["--json", text(&file)]].concat()).succeeds();
    let scored = json(&file);
    let number = |k: usize, field: &str| scored["pictures"][k][field].as_f64().unwrap();
    assert!((number(0, "relative_rms") - 0.1 / 1.1).abs() < 1e-6);
    let known = channel(&out.join("a.exr"), "A");
    let count = known[..24 * 32 - 1].iter().filter(|&&a| a > 0.999).count();
    assert_eq!(scored["pictures"][0]["pixels"], count);
    assert!((20.0..40.0).contains(&number(0, "psnr_db")) && number(0, "mean_flip") > 0.01);
    assert_eq!((number(1, "relative_rms"), number(1, "mean_flip")), (0.0, 0.0));
    assert!(scored["pictures"][1]["psnr_db"].is_null() && scored["raw"].is_object());
    let line = run.out.lines().find(|line| line.starts_with("a ")).unwrap();
    assert!(line.contains("0.0909") && run.out.contains("PSNR in dB"), "{}", run.out);

    score(&folders[..2]).fails(2, &["--truth-images"]);
    let none = pictures.at("none");
    score(&["--renders", text(&out), "--truth-images", text(&none)])
        .fails(1, &["none", "cannot be read"]);
    fs::create_dir(&none).unwrap();
    score(&["--renders", text(&out), "--truth-images", text(&none)])
        .fails(1, &["out", "none of its pictures has the name", "--cameras"]);
    exr::write_rgb(&truth.join("b.exr"), 4, 4, &[[1.0; 3]; 16]).unwrap();
    score(&folders).fails(1, &["b.exr", "32 x 24", "4 x 4", "camera"]);
}

/// A ball of radius 1 about the origin, as OBJ.
fn ball() -> String {
    let (rows, columns) = (24, 48);
    let mut text = String::new();
    for row in 0..=rows {
        let polar = std::f64::consts::PI * f64::from(row) / f64::from(rows);
        for column in 0..columns {
            let around = std::f64::consts::TAU * f64::from(column) / f64::from(columns);
            let across = polar.sin();
            let (x, y, z) = (across * around.cos(), across * around.sin(), polar.cos());
            text += &format!("v {x} {y} {z}\n");
        }
    }
    text += "usemtl ball\n";
    for row in 0..rows {
        for column in 0..columns {
            let at = |row: i32, column: i32| row * columns + column % columns + 1;
            let [a, b] = [at(row, column), at(row, column + 1)];
            let [c, d] = [at(row + 1, column + 1), at(row + 1, column)];
            text += &format!("f {a} {d} {c} {b}\n");
        }
    }
    text
}

/// How many pixels that objects cover in part stand out: brighter, or darker, by a tenth than all
/// near them that objects cover wholly or not at all.
fn outliers(pixels: &[[f32; 3]], object: &[f32], (width, height): (usize, usize)) -> usize {
    let luminance = |at: usize| pixels[at].iter().sum::<f32>();
    let stands_out = |x: usize, y: usize| {
        let own = y * width + x;
        let near = (y - 2..=y + 2).flat_map(|v| (x - 2..=x + 2).map(move |u| v * width + u));
        let whole: Vec<usize> = near.filter(|at| [0.0, 1.0].contains(&object[*at])).collect();
        let has = |part: f32| whole.iter().any(|at| object[*at] == part);
        if [0.0, 1.0].contains(&object[own]) || !has(0.0) || !has(1.0) {
            return false;
        }
        let values = whole.iter().map(|at| luminance(*at));
        let (low, high) = values
            .fold((f32::INFINITY, 0.0f32), |(low, high), value| (low.min(value), high.max(value)));
        luminance(own) > 1.1 * high || 1.1 * luminance(own) < low
    };
    let places = (2..height - 2).flat_map(|y| (2..width - 2).map(move |x| (x, y)));
    places.filter(|(x, y)| stands_out(*x, *y)).count()
}

#[test]
fn silhouettes_of_a_composite_are_as_smooth_as_those_of_the_plain_picture() {
    let (pictures, copy) = (Pictures::new(), Copy::new());
    copy.edit("transforms.json", |cameras| cameras["frames"].as_array_mut().unwrap().truncate(1));
    let (capture, solution) = (copy.capture(), pictures.at("solution"));
    // A photograph that the model does not explain shows what is taken from which of the two.
    let file = capture.join("images/000.exr");
    let mut photograph = exr::read(&file).unwrap();
    photograph.pixels.iter_mut().flatten().for_each(|value| *value *= 3.0);
    exr::write_rgb(&file, photograph.width, photograph.height, &photograph.pixels).unwrap();
    fs::write(pictures.at("ball.obj"), ball()).unwrap();
    // Their rims cross walls, floor and box.
    let objects: Vec<serde_json::Value> = [(1.6, 0.9, 0.35), (0.8, 1.5, 1.1), (1.3, 1.9, 0.3)]
        .iter()
        .map(|(x, y, z)| {
            object!({"mesh": "ball.obj",
                "world_from_object":
                    [[0.3, 0, 0, x], [0, 0.3, 0, y], [0, 0, 0.3, z], [0, 0, 0, 1]],
                "materials": {"ball": {"diffuse": [0.9, 0.9, 0.9]}}})
        })
        .collect();
    let edits = pictures.put("balls.json", object!({ "objects": objects }));
    let render = |out: &str, more: &[&str]| {
        let mut command = lobelia();
        command.arg("render").arg(&capture).arg("--solution").arg(&solution);
        command.arg("--out").arg(pictures.at(out)).args(more);
        Run::of(command.args(["--spp", "24", "-q"])).succeeds();
    };
    render("with", &["--edits", text(&edits), "--composite"]);
    render("without", &[]);
    let read = |file: &str| exr::read(&pictures.at(file)).unwrap();
    let plain = read("with/000.exr");
    let object = channel(&pictures.at("with/000.exr"), "object.A");
    let count = |pixels: &[[f32; 3]]| outliers(pixels, &object, (plain.width, plain.height));
    let rims = object.iter().filter(|part| **part > 0.0 && **part < 1.0).count();
    assert!(rims > 200, "{rims} pixels that balls cover in part");
    let (composed, rendered) =
        (count(&read("with/000-composite.exr").pixels), count(&plain.pixels));
    // Without coverage, each pixel is the object's or the background's.
    let without = read("without/000.exr").pixels;
    let all_or_nothing = |most: f32| {
        let pixel = |at: usize| match object[at] > most {
            true => plain.pixels[at],
            false => std::array::from_fn(|c| {
                (photograph.pixels[at][c] + plain.pixels[at][c] - without[at][c]).max(0.0)
            }),
        };
        count(&(0..object.len()).map(pixel).collect::<Vec<_>>())
    };
    let dotted = [0.0, 0.5].map(all_or_nothing);
    println!("of {rims}: {composed} composed, {rendered} rendered, {dotted:?} without coverage");
    assert!(composed <= rendered + rims / 50, "{composed} stand out, {rendered} in the rendering");
    assert!(dotted.iter().all(|dotted| *dotted > rendered + rims / 10), "{dotted:?}");
}
