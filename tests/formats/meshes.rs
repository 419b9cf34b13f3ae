//! Wavefront OBJ.

use std::path::Path;

use glam::{DVec3, Vec3};
use lobelia::io::obj::{self, Geometry};

use crate::{data, folder, message, put};

fn load(text: impl AsRef<[u8]>) -> Result<Geometry, lobelia::io::Error> {
    let folder = folder();
    obj::load(&put(folder.path(), "scene.obj", text))
}

fn area(geometry: &Geometry) -> f32 {
    (0..geometry.mesh.triangles.len()).map(|triangle| geometry.mesh.area(triangle)).sum()
}

const SQUARE: &str = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\n";

/// Area, and the vector area, which is the same however a polygon is cut.
fn areas(triangles: impl Iterator<Item = [Vec3; 3]>) -> (f64, DVec3) {
    let halves = triangles.map(|triangle| {
        let [a, b, c] = triangle.map(Vec3::as_dvec3);
        0.5 * (b - a).cross(c - a)
    });
    halves.fold((0.0, DVec3::ZERO), |(area, sum), half| (area + half.length(), sum + half))
}

#[test]
fn another_reader_sees_the_same_surfaces() {
    let names = ["tobj_cornell_box", "cube-vertexcol", "usemtl-issue-104"];
    let mut files = names.map(|name| data(&format!("formats/obj/{name}.obj"))).to_vec();
    files.push(Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/examples/corner/scene.obj"));
    for file in files {
        let mesh = obj::load(&file).unwrap().mesh;
        let own = areas((0..mesh.triangles.len()).map(|triangle| mesh.corners(triangle)));
        let (models, _) = tobj::load_obj(&file, &tobj::GPU_LOAD_OPTIONS).unwrap();
        let triangles = models.iter().flat_map(|model| {
            let corner =
                |&index: &u32| Vec3::from_slice(&model.mesh.positions[3 * index as usize..]);
            model
                .mesh
                .indices
                .chunks_exact(3)
                .map(move |t| [corner(&t[0]), corner(&t[1]), corner(&t[2])])
        });
        let other = areas(triangles);
        let is_same =
            (own.0 - other.0).abs() < 1e-6 * own.0 && own.1.distance(other.1) < 1e-6 * own.0;
        assert!(own.0 > 0.0 && is_same, "{}: {own:?} {other:?}", file.display());
    }
}

#[test]
fn concave_polygons_keep_their_shape() {
    // An L and, from its second corner, a fan that would leave it.
    let ell = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nf 2 3 4 5 6 1\n";
    let geometry = load(ell).unwrap();
    assert!((area(&geometry) - 3.0).abs() < 1e-6);
    assert!((0..4).all(|triangle| geometry.mesh.normal(triangle).z > 0.99));
    assert_eq!(geometry.mesh.polygon, [0; 4]);
    let others = obj::load(&data("formats/obj/assimp/concave_polygon.obj")).unwrap();
    assert_eq!(others.mesh.triangles.len(), 64);
    assert!(others.warnings.is_empty(), "{:?}", others.warnings);
}

#[test]
fn surfaces_are_usemtl_groups_in_order_of_appearance() {
    let faces = "f 1 2 3\no chair\nusemtl wood\nf 1 2 3\no table\nf 2 3 4\nusemtl steel plate\n\
                 f 1 3 4\no lamp\nusemtl wood\nf 1 2 4\n";
    let geometry = load(format!("{SQUARE}{faces}")).unwrap();
    let names: Vec<&str> = geometry.surfaces.iter().map(|surface| surface.name.as_str()).collect();
    assert_eq!(names, ["default", "wood", "steel plate"]);
    assert_eq!(geometry.mesh.surface, [0, 1, 1, 2, 1]);
    let named = load(format!("{SQUARE}o rug\nf 1 2 3\n")).unwrap();
    assert_eq!(named.surfaces[0].name, "rug");
}

#[test]
fn texture_coordinates_count_for_wholly_unwrapped_surfaces_only() {
    let faces =
        "vt 0 0\nvt 1 0\nvt 1 1\nusemtl a\nf 1/1 2/2 3/3\nusemtl b\nf 1/1 2/2 3/3\nf 1 3 4\n";
    let geometry = load(format!("{SQUARE}{faces}")).unwrap();
    assert!(geometry.surfaces[0].has_texcoords && !geometry.surfaces[1].has_texcoords);
    assert_eq!(geometry.mesh.texcoords.len(), 3);
    assert_eq!(geometry.mesh.texcoords[0][2], glam::Vec2::ONE);
    assert_eq!(geometry.mesh.texcoords[1], [glam::Vec2::ZERO; 3]);
    let without = load(format!("{SQUARE}f 1 2 3\n")).unwrap();
    assert!(without.mesh.texcoords.is_empty());
}

#[test]
fn what_real_exporters_write_is_read() {
    let mut text = b"# caf\xE9 on disk C:\\\r\n".to_vec();
    text.extend(SQUARE.replace('\n', "\r\n").bytes());
    text.extend(b"vn 0 0 1\r\nf 1//1 2//1 \\\r\n 3//1 4//1 # quad\r\nf -4 -3 -2\r\nl 1 2\r\np 1\r\ns off\r\n");
    let geometry = load(text).unwrap();
    assert_eq!(geometry.mesh.triangles.len(), 3);
    assert_eq!(geometry.mesh.polygon, [0, 0, 1]);
    assert!(geometry.warnings.is_empty(), "{:?}", geometry.warnings);
}

#[test]
fn a_bent_quad_is_two_polygons() {
    let geometry = load("v 0 0 0\nv 1 0 0\nv 1 1 0.5\nv 0 1 0\nf 1 2 3 4\n").unwrap();
    assert_eq!(geometry.mesh.polygon, [0, 1]);
}

#[test]
fn broken_faces_are_dropped_and_counted() {
    let faces = "v nan 0 0\nv 1,5 0 0\nf 1 2 3\nf 1 2 5\nf 2 3 6\nf 1 1 1\nf 1 2\n";
    let geometry = load(format!("{SQUARE}{faces}")).unwrap();
    assert_eq!(geometry.mesh.triangles.len(), 1);
    assert!(geometry.mesh.positions.iter().all(|position| position.is_finite()));
    let warnings = geometry.warnings.join("\n");
    for part in ["line 8", "vertex of line 5", "2 faces", "without area", "fewer than three"] {
        assert!(warnings.contains(part), "\"{part}\" is missing in {warnings}");
    }
    // An unused vertex does not matter.
    assert!(load(format!("{SQUARE}v nan nan inf\nf 1 2 3\n")).unwrap().warnings.is_empty());
}

#[test]
fn hopeless_files_name_the_line() {
    message(load("v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), &["scene.obj, line 1", "nan"]);
    message(load("v 1,5 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), &["line 1", "point, not a comma"]);
    message(load("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"), &["line 4", "area"]);
    message(load(format!("{SQUARE}f 1 2 9\n")), &["line 5", "vertex 9", "has 4"]);
    message(load(format!("{SQUARE}f 0 1 2\n")), &["line 5", "vertex 0"]);
    message(load(format!("{SQUARE}f -9 1 2\n")), &["line 5", "vertex -9"]);
    message(load(format!("{SQUARE}vt 0 0\nf 1/1 2/1 3/7\n")), &["line 6", "texture coordinate 7"]);
    message(load(format!("{SQUARE}f 1 2 99999999999999999999\n")), &["line 5", "no corner"]);
    message(load(format!("{SQUARE}f 1 2 x\n")), &["line 5", "no corner"]);
    // Twice that number is 0 in 64 bits, which has a texture coordinate.
    let texcoords = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
    message(
        load(format!("{SQUARE}{texcoords}f 1/1 2/2 3/-9223372036854775808\n")),
        &["line 9", "texture coordinate -9223372036854775808"],
    );
    assert!(load(format!("{SQUARE}f 1/-7 2/-7 3/-7\n")).is_ok(), "there are none to name");
    // What is left out may name what it likes.
    let kept = load(format!("{SQUARE}f 1 2 3\nf -9 1\n")).unwrap();
    assert!(kept.warnings[0].contains("fewer than three"), "{:?}", kept.warnings);
    message(load(""), &["no geometry"]);
    message(load(SQUARE), &["4 vertices but no faces"]);
    message(
        load("\u{feff}v".encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<_>>()),
        &["UTF-16"],
    );
}

#[test]
fn shiny_materials_are_those_that_the_library_says() {
    let folder = folder();
    put(
        folder.path(),
        "my lib.mtl",
        "newmtl gloss\nillum 2\nKs 0.1 0.1 0.1\nNs 20\nnewmtl mat\nKs\n",
    );
    let text = format!("mtllib my lib.mtl\n{SQUARE}usemtl mat\nf 1 2 3\nusemtl gloss\nf 1 3 4\n");
    let geometry = obj::load(&put(folder.path(), "a.obj", text)).unwrap();
    assert_eq!(geometry.specular, [false, true]);
    assert!(geometry.library_warnings.is_empty());
}

#[test]
fn a_polygon_of_many_corners_does_not_hang() {
    // A comb of 20,000 corners: the worst for ear clipping.
    let mut text = String::new();
    for tooth in 0..10_000 {
        text += &format!("v {tooth} 0 0\nv {tooth}.5 5 0\n");
    }
    text += "f";
    (1..=20_000).for_each(|corner| text += &format!(" {corner}"));
    // What takes hours here stops whoever runs the tests; a time would depend on the machine.
    let _ = load(text);
}

#[test]
fn two_hundred_thousand_triangles_are_all_there() {
    let mut text = String::new();
    for y in 0..320 {
        for x in 0..320 {
            text += &format!(
                "v {x}.25 {y}.5 {:.4}\nvt {:.6} {:.6}\n",
                (x * y % 7) as f64 * 0.1,
                x as f64 / 319.0,
                y as f64 / 319.0
            );
        }
    }
    for y in 0..319 {
        for x in 1..320 {
            let (a, b) = (y * 320 + x, y * 320 + x + 320);
            text += &format!(
                "f {a}/{a} {}/{} {}/{}\nf {a}/{a} {}/{} {b}/{b}\n",
                a + 1,
                a + 1,
                b + 1,
                b + 1,
                b + 1,
                b + 1
            );
        }
    }
    let geometry = load(text).unwrap();
    assert_eq!(geometry.mesh.triangles.len(), 203_522);
}
