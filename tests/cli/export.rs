use std::fs;
use std::path::{Path, PathBuf};

use lobelia::io::{obj, picture};
use serde_json::{Value, json as object};

use crate::{Copy, Run, coarse, example, files_below, json, lobelia};

/// A copy of the example with a luminaire and a glossy wall, its solution, and edits of all kinds.
struct Elsewhere {
    copy: Copy,
}

impl Elsewhere {
    fn new() -> Self {
        let copy = Copy::new();
        copy.edit("tags.json", |tags| {
            let materials = tags["materials"].as_array_mut().unwrap();
            materials[1]["kind"] = "specular".into();
            let surfaces = materials.pop().unwrap()["surfaces"].clone();
            tags["lights"] = object!([{"name": "glow", "kind": "visible", "surfaces": surfaces}]);
        });
        let folder = copy.capture();
        Run::of(&mut coarse(&folder, &copy.out())).succeeds();
        fs::write(
            folder.join("block.obj"),
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl new\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n",
        )
        .unwrap();
        let corners = [[2, 2, 2], [3, 2, 2], [3, 3, 2], [2, 3, 2]];
        copy.put(
            "edits.json",
            object!({
                "lights": [
                    {"name": "<panel & \"co\">", "kind": "rectangle", "corners": corners,
                     "normal": [0, 0, -1], "radiance": [3, 2, 1]},
                    {"kind": "sphere", "center": [1, 2, 2], "radius_m": 0.1, "radiance": [1, 1, 1]},
                    {"kind": "point", "position": [1, 2, 1.5], "intensity": [1, 1, 1]},
                    {"kind": "spot", "position": [1, 2, 1.5], "direction": [0, 0, -1],
                     "inner_angle": 0.2, "outer_angle": 0.4, "intensity": [1, 1, 1]},
                    {"kind": "sun", "direction": [0, 0.6, -0.8], "irradiance": [1, 1, 1]}],
                "objects": [{"mesh": "block.obj", "name": "block",
                    "world_from_object": [[1, 0, 0, 1.2], [0, 1, 0, 1.2], [0, 0, 1, 0], [0, 0, 0, 1]],
                    "materials": {"new": {"diffuse": [0.5, 0.4, 0.3]}}}]})
            .to_string(),
        );
        Self { copy }
    }

    fn at(&self, name: &str) -> PathBuf {
        self.copy.capture().parent().unwrap().join(name)
    }

    fn export(&self, out: &str, arguments: &[&str]) -> std::process::Command {
        let mut command = lobelia();
        command.arg("export").arg(self.copy.capture()).arg("--solution").arg(self.copy.out());
        command.arg("--out").arg(self.at(out)).args(["--probe-width", "16", "--probe-spp", "2"]);
        command.args(arguments);
        command
    }
}

/// The two chunks of a .glb file.
fn chunks(file: &Path) -> (Value, Vec<u8>) {
    let bytes = fs::read(file).unwrap();
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    assert_eq!((&bytes[..4], word(4), word(8)), (&b"glTF"[..], 2, bytes.len()));
    let json = 20 + word(12);
    assert_eq!((&bytes[16..20], &bytes[json + 4..json + 8]), (&b"JSON"[..], &b"BIN\0"[..]));
    assert_eq!(json + 8 + word(json), bytes.len());
    (serde_json::from_slice(&bytes[20..json]).unwrap(), bytes[json + 8..].to_vec())
}

#[test]
fn every_format_with_every_edit_on_any_number_of_threads() {
    let elsewhere = Elsewhere::new();
    let edits = elsewhere.copy.file("edits.json");
    let flags = ["--edits", edits.to_str().unwrap()];
    Run::of(&mut elsewhere.export("all", &flags)).succeeds();
    Run::of(elsewhere.export("again", &flags).env("RAYON_NUM_THREADS", "1")).succeeds();
    let files = files_below(&elsewhere.at("all"));
    for name in [
        "blender/cameras.json",
        "blender/open_in_blender.py",
        "blender/scene.glb",
        "blender/world.exr",
        "lights.csv",
        "lights.ply",
        "mitsuba/added.xml",
        "mitsuba/lights.json",
        "mitsuba/lobelia_mitsuba.py",
        "mitsuba/recovered.xml",
        "mitsuba/render.py",
        "obj/scene.mtl",
        "obj/scene.obj",
        "probe.exr",
        "samples.csv",
        "samples.ply",
        "scene.glb",
    ] {
        assert!(files.iter().any(|file| file == name), "no {name} in {files:?}");
    }
    for name in &files {
        let bytes = |folder: &str| fs::read(elsewhere.at(folder).join(name)).unwrap();
        assert!(bytes("all") == bytes("again"), "{name}");
    }

    // glTF: what refers to something refers to what is there.
    let (root, binary) = chunks(&elsewhere.at("all/scene.glb"));
    let list = |name: &str| root[name].as_array().cloned().unwrap_or_default();
    let names = |name: &str| -> Vec<String> {
        list(name).iter().map(|item| item["name"].as_str().unwrap_or("").to_owned()).collect()
    };
    assert_eq!(root["buffers"][0]["byteLength"], binary.len());
    for accessor in list("accessors") {
        let view = &root["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
        let parts = match accessor["type"].as_str().unwrap() {
            "SCALAR" => 1,
            "VEC2" => 2,
            _ => 3,
        };
        assert_eq!(view["byteLength"], 4 * parts * accessor["count"].as_u64().unwrap());
    }
    let mesh = obj::load(&example().join("scene.obj")).unwrap();
    for surface in &mesh.surfaces {
        assert!(names("meshes").contains(&surface.name), "{}", surface.name);
    }
    assert!(names("meshes").contains(&"block".to_owned()));
    let photographs = json(&example().join("transforms.json"))["frames"].as_array().unwrap().len();
    assert_eq!(list("cameras").len(), photographs);
    let lights = root["extensions"]["KHR_lights_punctual"]["lights"].as_array().unwrap();
    let kinds: Vec<&str> =
        lights[lights.len() - 5..].iter().map(|light| light["type"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["spot", "point", "point", "spot", "directional"]);
    assert!(list("materials").iter().any(|m| m["emissiveTexture"].is_object()));

    // OBJ: what our own reader makes of it.
    let back = obj::load(&elsewhere.at("all/obj/scene.obj")).unwrap();
    assert_eq!(back.mesh.triangles.len(), mesh.mesh.triangles.len() + 4);
    assert!(mesh.surfaces.iter().all(|s| back.surfaces.iter().any(|b| b.name == s.name)));
    assert!((back.mesh.bounds().unwrap().1 - mesh.mesh.bounds().unwrap().1).length() < 1e-5);

    // Probes and points.
    assert_eq!(picture::dimensions(&elsewhere.at("all/probe.exr")).unwrap(), (16, 8));
    let rows = fs::read_to_string(elsewhere.at("all/samples.csv")).unwrap();
    assert_eq!(rows, fs::read_to_string(elsewhere.copy.out().join("samples.csv")).unwrap());
    let ply = fs::read(elsewhere.at("all/samples.ply")).unwrap();
    let end = ply.windows(11).position(|part| part == b"end_header\n").unwrap() + 11;
    let count = rows.lines().count() - 1;
    assert!(String::from_utf8_lossy(&ply[..end]).contains(&format!("element vertex {count}\n")));
    assert_eq!(ply.len() - end, count * (16 * 4 + 3));

    // Mitsuba: names are escaped, and every file that a scene names is there.
    for scene in ["recovered.xml", "added.xml"] {
        let text = fs::read_to_string(elsewhere.at("all/mitsuba").join(scene)).unwrap();
        for path in text.split("name=\"filename\" value=\"").skip(1) {
            let path = path.split('"').next().unwrap();
            assert!(elsewhere.at("all/mitsuba").join(path).is_file(), "{scene}: {path}");
        }
    }
    let table = json(&elsewhere.at("all/mitsuba/lights.json"));
    let added = |light: &&Value| light["set"] == "added";
    assert_eq!(table["lights"].as_array().unwrap().iter().filter(added).count(), 3);
}

#[test]
fn only_what_is_asked_for_and_where() {
    let elsewhere = Elsewhere::new();
    let flags = ["--format", "probe,glb", "--probe-at", "-0.5,1,0.4", "-q"];
    Run::of(&mut elsewhere.export("some", &flags)).succeeds();
    assert_eq!(files_below(&elsewhere.at("some")), ["probe.exr", "scene.glb"]);
    // Without edits there is no added light, and that of an earlier export goes.
    let old = elsewhere.at("mi/mitsuba/added.xml");
    fs::create_dir_all(old.parent().unwrap()).unwrap();
    fs::write(&old, "old").unwrap();
    Run::of(&mut elsewhere.export("mi", &["--format", "mitsuba"])).succeeds();
    assert!(!old.exists());

    Run::of(&mut elsewhere.export("no", &["--format", "fbx"])).fails(2, &["fbx", "mitsuba"]);
    Run::of(&mut elsewhere.export("no", &["--probe-at", "1,2"])).fails(2, &["three numbers"]);
    Run::of(&mut elsewhere.export("no", &["--edits", "none.json"])).fails(1, &["none.json"]);
    let table = elsewhere.copy.out().join("samples.csv");
    let text = fs::read_to_string(&table).unwrap();
    fs::write(&table, text.replacen("\n", "\nx", 1)).unwrap();
    Run::of(&mut elsewhere.export("no", &["--format", "ply"])).fails(1, &["samples.csv", "line 2"]);
    assert!(!elsewhere.at("no").exists());
}
