//! A written solution, read back to be rendered.

use std::path::Path;
use std::sync::Arc;

use glam::{Vec2, Vec3};
use lobelia::geometry::mesh::Mesh;
use lobelia::io::project::{ProjectFile, Tag};
use lobelia::io::{Error, export, results, solved};
use lobelia::math::rgb::{Radiance, Rgb};
use lobelia::reconstruct::equations::Equations;
use lobelia::reconstruct::lights::{LightKind, VirtualLight};
use lobelia::reconstruct::lobes::Lobe;
use lobelia::reconstruct::samples::SampleCloud;
use lobelia::reconstruct::solution::{Solution, Stopped};
use lobelia::reconstruct::textures::Texture;
use lobelia::reconstruct::transport::{PatchRadiosity, Transport};
use lobelia::reconstruct::unwrap::Unwrap;
use lobelia::reconstruct::{Options, Reconstruction};
use lobelia::render::scene::Solved;
use lobelia::scene::Brdf;
use lobelia::scene::{Capture, Emitter, KnownLight, Material, MaterialKind, Role, Surface};
use lobelia::watch::Watch;

use crate::{folder, message};

const PANEL: Emitter = Emitter::Sphere { center: Vec3::new(1.0, 2.0, 3.0), radius_m: 0.25 };

/// A glossy floor, two walls of one textured material, which differ in the case of their names
/// alone, and a door that nobody saw.
fn capture() -> Capture {
    let names = ["floor", "wall", "Wall", "door"];
    let materials = ["floor", "wall", "door"];
    let surface_of = |material| match material {
        1 => vec![1, 2],
        0 => vec![0],
        _ => vec![3],
    };
    let corner = |k: usize| Vec3::new(k as f32, (k * k % 7) as f32, (k % 3) as f32);
    let triangles: Vec<[u32; 3]> = (0..6).map(|k| [k, k + 1, k + 2]).collect();
    let uv = |k: usize| Vec2::new(0.1 * k as f32, 1.0 - 0.15 * k as f32);
    Capture {
        mesh: Mesh {
            positions: (0..8).map(corner).collect(),
            surface: vec![0, 1, 1, 2, 3, 2],
            polygon: (0..6).collect(),
            texcoords: (0..6).map(|k| [uv(k), uv(k + 1), uv(0)]).collect(),
            triangles,
        }
        .into(),
        surfaces: names
            .iter()
            .zip([0, 1, 1, 2])
            .map(|(name, material)| Surface {
                name: name.to_string(),
                role: Role::Material(material),
                has_texcoords: true,
            })
            .collect(),
        materials: materials
            .iter()
            .enumerate()
            .map(|(index, name)| Material {
                name: name.to_string(),
                kind: if index == 0 { MaterialKind::Specular } else { MaterialKind::Diffuse },
                surfaces: surface_of(index),
                textured: index == 1,
                known_diffuse: None,
                known_diffuse_sd: None,
            })
            .collect(),
        lights: vec![KnownLight::Shape {
            name: "panel".into(),
            emitter: PANEL,
            emission: None,
            color: None,
        }],
        ..Capture::default()
    }
}

/// Lights of every kind, all of whose lobes shine.
fn solution() -> Solved {
    let mut found = Solved::default();
    let floor = Brdf::phong([0.5, 0.4, 0.3], [0.05, 0.06, 0.07], 40.0);
    found.reflectances = vec![Some(floor), Some(Brdf::diffuse([0.2, 0.3, 0.4])), None];
    let (place, aside) = (Vec3::new(1.0, 2.0, 3.0), Vec3::new(0.6, 0.0, -0.8));
    let kind = LightKind::Known(0);
    for (light, lobes) in [
        (VirtualLight::disc(LightKind::Sphere, place, aside, 0.5), 3),
        (VirtualLight::disc(LightKind::Surface, -place, -Vec3::Z, 0.25), 1),
        (VirtualLight::lamp(place, 0.125), 2),
        (VirtualLight::distant(LightKind::Sky, -Vec3::Z, 0.2), 1),
        (VirtualLight::distant(LightKind::Sun, aside, 0.5 * Emitter::SUN_DIAMETER), 1),
        (VirtualLight { kind, ..VirtualLight::lamp(place, 0.25) }, 1),
    ] {
        found.light.lobes.first.push(found.light.lobes.lobes.len());
        for k in 0..lobes {
            let index = found.light.lights.lights.len();
            let (direction, exponent) = ([aside, -Vec3::Z, Vec3::Y][k], [20.0, 1.0, 0.0][k]);
            found.light.lobes.lobes.push(Lobe { light: index, direction, exponent });
            found.light.emission.push([0.1 + index as f64, 1.0 / 3.0, k as f64]);
        }
        found.light.lights.lights.push(light);
    }
    found.light.lobes.first.push(found.light.lobes.lobes.len());
    let texture = |surface: usize, triangles: Vec<usize>, is_own: bool| {
        let (width, height) = (5, 4);
        let mesh = capture().mesh;
        let corners = triangles
            .iter()
            .map(|&triangle| match is_own {
                true => mesh.texcoords[triangle],
                false => [0.1f32, 0.2, 0.7].map(|x| Vec2::new(x / 3.0, x * triangle as f32 / 6.0)),
            })
            .collect();
        let value = |k: usize| 0.01 * (k + surface) as f32;
        let texels: Vec<Radiance> =
            (0..width * height).map(|k| [value(k), value(2 * k), 0.5]).collect();
        let seen = (0..width * height).map(|k| k % 3 > 0).collect();
        let unwrap = Unwrap { triangles, corners, width, height, is_own };
        Texture { surface, material: 1, unwrap, texels, seen }
    };
    found.textures = Arc::new(vec![texture(1, vec![1, 2], false), texture(2, vec![3, 5], true)]);
    found
}

fn write(folder: &Path, solved: &Solved) {
    let (options, watch) = (Options::default(), Watch::new());
    let run = reconstruction(solved);
    export::write(folder, &capture(), &options, &run, 0.0, &watch).unwrap();
}

fn reconstruction(solved: &Solved) -> Reconstruction {
    Reconstruction {
        samples: Arc::new(SampleCloud::default()),
        lights: Arc::new(solved.light.lights.clone()),
        lobes: Arc::new(solved.light.lobes.clone()),
        transport: Arc::new(Transport {
            irradiance: Vec::new(),
            records: Arc::default(),
            first_record: vec![0],
            bright: Arc::default(),
            coupling: faer::Mat::zeros(0, solved.light.lobes.lobes.len()),
            unphotographed: Arc::default(),
            first_unphotographed: vec![0],
            patch_radiosity: PatchRadiosity::default(),
        }),
        equations: Arc::new(Equations::default()),
        solution: Arc::new(Solution {
            reflectances: solved.reflectances.clone(),
            optics: solved.optics.clone(),
            emission: solved.light.emission.clone(),
            iterations: Vec::new(),
            stopped: Stopped::GradientConverged,
            computed: Vec::new(),
            certainty: None,
            notes: Vec::new(),
            warnings: Vec::new(),
        }),
        textures: solved.textures.clone(),
        gains: Vec::new(),
        seconds: [0.0; 5],
        kept: [false; 5],
        warnings: vec!["a warning".into()],
    }
}

/// Writes results as a project has them, of the capture's own tags.
fn store(folder: &Path, capture: &Capture, run: &Reconstruction) -> Result<(), Error> {
    let inputs = ProjectFile {
        tags: capture.materials.iter().map(|own| Tag::of(own, capture)).collect(),
        ..ProjectFile::default()
    };
    results::write(folder, &inputs, capture, run, 0.0, &Watch::new())
}

#[test]
fn results_of_a_project_come_back_bit_for_bit() {
    let (folder, run) = (folder(), reconstruction(&solution()));
    let data = results::folder_of(&folder.path().join("a.lobelia"));
    store(&data, &capture(), &run).unwrap();
    // Again, over what is there.
    store(&data, &capture(), &run).unwrap();
    let found = results::read(&data, &capture()).unwrap();
    assert_eq!(found.capture.materials, capture().materials);
    let own = &found.reconstruction;
    assert_eq!(own.textures, run.textures);
    assert_eq!(own.lights.lights, run.lights.lights);
    assert_eq!((&own.lobes.lobes, &own.lobes.first), (&run.lobes.lobes, &run.lobes.first));
    assert_eq!(own.solution.emission, run.solution.emission);
    assert_eq!(own.solution.reflectances, run.solution.reflectances);
    assert_eq!(own.transport.coupling.ncols(), run.lobes.lobes.len());
    assert_eq!(own.warnings, ["a warning"]);
    // Nothing is left beside them.
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    // A crash between two steps leaves them under the other name.
    std::fs::rename(&data, folder.path().join("a.lobelia-data~")).unwrap();
    assert!(results::read(&data, &capture()).is_ok());
}

#[test]
fn results_that_do_not_fit_are_refused() {
    let (folder, run) = (folder(), reconstruction(&solution()));
    let data = folder.path().join("a.lobelia-data");
    std::fs::create_dir(&data).unwrap();
    std::fs::write(data.join("notes.txt"), "mine").unwrap();
    let parts = ["a.lobelia-data", "other files are in the way", "Move that folder away"];
    message(store(&data, &capture(), &run), &parts);
    std::fs::remove_file(data.join("notes.txt")).unwrap();
    store(&data, &capture(), &run).unwrap();
    let mut other = capture();
    Arc::make_mut(&mut other.mesh).positions[3].x += 1.0;
    message(results::read(&data, &other), &["run.bin", "another state", "Run again"]);
    let bytes = std::fs::read(data.join("run.bin")).unwrap();
    for end in [0, 10, 20, bytes.len() / 2, bytes.len() - 1] {
        std::fs::write(data.join("run.bin"), &bytes[..end]).unwrap();
        message(results::read(&data, &capture()), &["run.bin", "Run again"]);
    }
    let mut spoiled = bytes.clone();
    spoiled[bytes.len() / 2] ^= 1;
    std::fs::write(data.join("run.bin"), &spoiled).unwrap();
    message(results::read(&data, &capture()), &["run.bin", "cut off or damaged"]);
}

fn read(capture: &Capture, solved: &Solved) -> Result<Solved, Error> {
    let folder = folder();
    write(folder.path(), solved);
    solved::read(folder.path(), capture)
}

#[test]
fn what_is_written_reads_back() {
    let (written, found) = (solution(), read(&capture(), &solution()).unwrap());
    assert_eq!(found.textures, written.textures);
    assert_eq!(found.light.emission, written.light.emission);
    assert_eq!(found.light.lobes.first, written.light.lobes.first);
    assert_eq!(found.light.lobes.lobes, written.light.lobes.lobes);
    assert_eq!(found.light.lights.lights.len(), written.light.lights.lights.len());
    for (found, written) in found.light.lights.lights.iter().zip(&written.light.lights.lights) {
        // A sky cell's angle goes by way of its solid angle.
        assert!((found.half_angle - written.half_angle).abs() < 1e-7, "{found:?}, {written:?}");
        assert_eq!(VirtualLight { half_angle: written.half_angle, ..*found }, *written);
    }
    assert_eq!(found.reflectances[0], written.reflectances[0]);
    assert_eq!(found.reflectances[2], None);
    // Of a textured material the mean of its texture is written, over what was seen.
    let texels = written.textures.iter().flat_map(|t| t.texels.iter().zip(&t.seen));
    let seen: Vec<_> = texels.filter(|(_, seen)| **seen).map(|(texel, _)| texel[0]).collect();
    let mean = f64::from(seen.iter().sum::<f32>()) / seen.len() as f64;
    let wall: Rgb = found.reflectances[1].unwrap().diffuse;
    assert!((wall[0] - mean).abs() < 1e-6, "{wall:?}, {mean}");
}

#[test]
fn a_coat_is_written_by_its_roughness() {
    let mut written = solution();
    written.reflectances[0] = Some(Brdf { coat: Some(0.15), ..Brdf::diffuse([0.5, 0.4, 0.3]) });
    let folder = folder();
    write(folder.path(), &written);
    let found = solved::read(folder.path(), &capture()).unwrap();
    assert_eq!(found.reflectances[0], written.reflectances[0]);
    let text = std::fs::read_to_string(folder.path().join("solution.json")).unwrap();
    let solution: serde_json::Value = serde_json::from_str(&text).unwrap();
    let floor = &solution["materials"][0];
    assert_eq!(
        (floor["model"].as_str(), floor["roughness"].as_f64()),
        (Some("coated"), Some(0.15))
    );
    assert!(floor["specular"].is_null() && floor["exponent"].is_null(), "{floor}");
}

#[test]
fn dark_lights_are_left_out_without_disorder() {
    let mut written = solution();
    // The lamp and one lobe of the disc.
    written.light.emission[4] = [0.0; 3];
    written.light.emission[5] = [0.0; 3];
    let found = read(&capture(), &written).unwrap();
    assert_eq!(found.light.lights.lights.len(), 5);
    assert_eq!(found.light.lobes.first, [0, 3, 4, 5, 6, 7]);
    assert!(found.light.lobes.lobes[4..].iter().zip(2..).all(|(lobe, light)| lobe.light == light));
}

#[test]
fn a_solution_of_another_capture_is_refused() {
    let mut other = capture();
    other.materials[1].name = "plaster".into();
    message(
        read(&other, &solution()),
        &["solution.json", "no material \"plaster\"", "Reconstruct the capture again"],
    );
    let mut other = capture();
    other.lights.clear();
    let parts = ["lights.json", "lights[5]", "no light of this name", "Reconstruct again"];
    message(read(&other, &solution()), &parts);
    let mut other = capture();
    Arc::make_mut(&mut other.mesh).surface[4] = 1;
    message(read(&other, &solution()), &["wall.exr", "another geometry"]);
}

#[test]
fn damaged_files_are_refused_by_name() {
    let spoil = |name: &str, from: &str, to: &str, parts: &[&str]| {
        let folder = folder();
        write(folder.path(), &solution());
        let file = folder.path().join(name);
        let text = std::fs::read_to_string(&file).unwrap();
        assert!(text.contains(from), "{from}");
        std::fs::write(&file, text.replacen(from, to, 1)).unwrap();
        message(solved::read(folder.path(), &capture()), parts);
    };
    let again = "Reconstruct again";
    spoil("lights.json", "\"lamp\"", "\"bulb\"", &["lights[2]", "\"bulb\" is no kind", again]);
    spoil("lights.json", "\"position\"", "\"place\"", &["lights[0]", "has a position", again]);
    spoil("lights.json", "0.333", "-0.333", &["lights[0]", "0 or more", again]);
    spoil("textures/wall.obj", "vt 0", "vt x", &["wall.obj", "line ", "two texture", again]);
    spoil("textures/wall.obj", "vt 0", "vx 0", &["wall.exr", "another geometry"]);
}
