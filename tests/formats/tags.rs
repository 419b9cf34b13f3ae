//! `tags.json`.

use glam::Vec3;
use lobelia::io::Error;
use lobelia::io::tags::{Tags, read};
use lobelia::math::rgb::Rgb;
use lobelia::scene::{Emitter, Environment, KnownLight, MaterialKind, Role, Surface};

use crate::{folder, message, put};

fn load(text: &str) -> (Result<Tags, Error>, Vec<Surface>) {
    let folder = folder();
    put(folder.path(), "sky.hdr", sky(4, 2));
    put(folder.path(), "tall.hdr", sky(2, 4));
    put(folder.path(), "sky.exr", "no image at all");
    let surface =
        |name: &str| Surface { name: name.into(), role: Role::Untagged, has_texcoords: false };
    let mut surfaces = ["floor", "wall", "shade", "box"].map(surface).to_vec();
    let tags = read(&put(folder.path(), "tags.json", text), &mut surfaces);
    (tags, surfaces)
}

/// A Radiance picture, made by hand: the pixel in column x and row y is (1 + x, 1 + y, 1).
fn sky(width: u8, height: u8) -> Vec<u8> {
    let mut bytes =
        format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n").into_bytes();
    for y in 0..height {
        // In quarters, that is 256ths of 2⁶: a first pixel of 1s or 2s would mark a run.
        bytes.extend((0..width).flat_map(|x| [4 + 4 * x, 4 + 4 * y, 4, 128 + 6]));
    }
    bytes
}

/// The light of a list that has nothing else.
fn light(text: &str) -> KnownLight {
    let text =
        format!(r#"{{"materials": [{{"name": "a", "surfaces": ["wall"]}}], "lights": [{text}]}}"#);
    load(&text).0.unwrap().lights.remove(0)
}

/// The emitter of the only light, its emission and its color.
fn shape(text: &str) -> (Emitter, Option<Rgb>, Option<Rgb>) {
    match light(text) {
        KnownLight::Shape { emitter, emission, color, .. } => (emitter, emission, color),
        other => panic!("{other:?} has no shape"),
    }
}

/// A light with a fault in the field at that path below it.
fn light_refused(text: &str, parts: &[&str]) {
    refused(&format!(r#"{{"lights": [{text}]}}"#), parts);
}

fn refused(text: &str, parts: &[&str]) {
    message(load(text).0, parts);
}

#[test]
fn everything_that_can_be_said_is_understood() {
    let (tags, surfaces) = load(
        r#"{"materials": [
            {"name": "ground", "kind": "specular", "surfaces": ["floor"]},
            {"name": "card", "kind": "diffuse", "surfaces": ["box"], "known_diffuse": [0.18, 0, 1]},
            {"name": "paint", "surfaces": ["wall"], "textured": true, "note": "unknown"}],
          "lights": [
            {"name": "sun", "kind": "sun", "direction": [0, 0, -1], "irradiance": null},
            {"name": "lamp", "kind": "visible", "surfaces": ["shade"]},
            {"kind": "rectangle", "corners": [[0,0,0],[1,0,0],[1,1,0],[0,1,0]], "normal": [0,0,1], "radiance": [1,2,3]},
            {"kind": "sphere", "center": [0,0,0], "radius_m": 0.1},
            {"kind": "point", "position": [0,0,0], "intensity": [1,1,1]},
            {"kind": "spot", "position": [0,0,0], "direction": [0,0,1], "inner_angle": 0, "outer_angle": 1},
            {"kind": "dome", "image": "sky.hdr"}],
          "environment": "open", "saturation": 60000.0}"#,
    );
    let tags = tags.unwrap();
    assert!(tags.warnings.is_empty(), "{:?}", tags.warnings);
    assert_eq!((tags.environment, tags.saturation), (Environment::Open, Some(60000.0)));
    assert_eq!(tags.materials[0].kind, MaterialKind::Specular);
    assert_eq!(tags.materials[1].known_diffuse, Some([0.18, 0.0, 1.0]));
    assert!(tags.materials[2].textured && tags.materials[2].kind == MaterialKind::Diffuse);
    assert_eq!(tags.lights[1], KnownLight::Visible { name: "lamp".into(), surfaces: vec![2] });
    let (names, kinds): (Vec<&str>, Vec<&str>) =
        tags.lights.iter().map(|light| (light.name(), light.kind())).unzip();
    assert_eq!(names[..4], ["sun", "lamp", "light 3", "light 4"]);
    assert_eq!(kinds, ["sun", "visible", "rectangle", "sphere", "point", "spot", "dome"]);
    let roles: Vec<Role> = surfaces.iter().map(|surface| surface.role).collect();
    assert_eq!(
        roles,
        [Role::Material(0), Role::Material(2), Role::Luminaire(1), Role::Material(1)]
    );
}

#[test]
fn absent_surfaces_cost_a_warning_until_nothing_is_left() {
    let (tags, surfaces) = load(
        r#"{"materials": [{"name": "a", "surfaces": ["flor"]}, {"name": "b", "surfaces": ["wall", "roof"]}]}"#,
    );
    let tags = tags.unwrap();
    assert_eq!((tags.materials.len(), tags.materials[0].name.as_str()), (1, "b"));
    assert_eq!(surfaces[1].role, Role::Material(0));
    let warnings = tags.warnings.join("\n");
    for part in
        ["materials[0].surfaces[0]", "\"flor\"", "did you mean \"floor\"", "surfaces[1]", "\"box\""]
    {
        assert!(warnings.contains(part), "\"{part}\" is missing in {warnings}");
    }
    refused(
        r#"{"materials": [{"name": "a", "surfaces": ["flor"]}]}"#,
        &["materials[0].surfaces[0]", "did you mean"],
    );
}

#[test]
fn contradictions_name_their_place() {
    refused(
        r#"{"materials": [{"name": "a", "surfaces": ["wall"]}, {"name": "b", "surfaces": ["wall"]}]}"#,
        &["materials[1].surfaces[0]", "already taken by materials[0].surfaces[0]"],
    );
    refused(
        r#"{"materials": [{"name": "a", "surfaces": ["wall"]}, {"name": "a", "surfaces": ["box"]}]}"#,
        &["materials[1].name", "taken"],
    );
    refused(
        r#"{"materials": [{"name": "a", "kind": "shiny", "surfaces": ["wall"]}]}"#,
        &["materials[0].kind", "\"diffuse\" and \"specular\""],
    );
    refused(
        r#"{"materials": [{"name": "a", "surfaces": ["wall"], "known_diffuse": [1, 2, 0]}]}"#,
        &["materials[0].known_diffuse", "between 0 and 1"],
    );
    refused(
        r#"{"materials": [{"name": "a", "surfaces": ["wall"], "known_diffuse": [NaN, 0, 0]}]}"#,
        &["known_diffuse[0]"],
    );
    refused(r#"{"materials": [{"surfaces": ["wall"]}]}"#, &["materials[0]", "\"name\""]);
    refused(r#"{"materials": [{"name": "a"}]}"#, &["\"surfaces\""]);
    refused(r#"{"materials": [], "saturation": 0}"#, &["saturation", "positive"]);
    refused(r#"{"environment": "cave"}"#, &["environment", "\"room\""]);
    refused(r#"{}"#, &["no material"]);
    refused(r#"{"lights": [{"kind": "laser"}]}"#, &["lights[0].kind", "\"visible\""]);
    refused(
        r#"{"lights": [{"kind": "sphere", "center": [0,0,0], "radius_m": -1}]}"#,
        &["radius_m"],
    );
    refused(
        r#"{"lights": [{"kind": "rectangle", "corners": [[0,0,0]], "normal": [0,0,1]}]}"#,
        &["four corners"],
    );
    refused(r#"{"lights": [{"kind": "sun", "direction": [0,0,0]}]}"#, &["lights[0].direction"]);
    refused(
        r#"{"lights": [{"kind": "visible", "surfaces": ["lamp"]}]}"#,
        &["lights[0].surfaces", "none"],
    );
    refused("{\"materials\": [\n", &["tags.json, line 2"]);
}

#[test]
fn lights_have_their_shape_and_strength() {
    let (panel, emission, color) = shape(
        r#"{"kind": "rectangle", "corners": [[0,0,2],[1,0,2],[1,1,2],[0,1,2]], "normal": [0,0.1,-4], "radiance": [1,2,3]}"#,
    );
    let corners = [Vec3::Z, Vec3::X + Vec3::Z, Vec3::ONE, Vec3::Y + Vec3::Z];
    let corners = corners.map(|corner| corner + Vec3::Z);
    // The corners have the last word, the given normal tells the side.
    assert_eq!(panel, Emitter::Rectangle { corners, normal: -Vec3::Z });
    assert_eq!((emission, color), (Some([1.0, 2.0, 3.0]), None));
    let (sphere, emission, color) = shape(
        r#"{"kind": "sphere", "center": [1,2,3], "radius_m": 0.5, "radiance": null, "color": [2,1,0]}"#,
    );
    assert_eq!(sphere, Emitter::Sphere { center: Vec3::new(1.0, 2.0, 3.0), radius_m: 0.5 });
    assert_eq!((emission, color), (None, Some([2.0, 1.0, 0.0])));
    let (point, emission, _) =
        shape(r#"{"kind": "point", "position": [1,2,3], "intensity": [0,0,0]}"#);
    assert_eq!(point, Emitter::Point { position: Vec3::new(1.0, 2.0, 3.0) });
    assert_eq!(emission, Some([0.0; 3]));
    let (spot, emission, color) = shape(
        r#"{"kind": "spot", "position": [1,2,3], "direction": [0,0,-1e200], "inner_angle": 0.3, "outer_angle": 0.5}"#,
    );
    let position = Vec3::new(1.0, 2.0, 3.0);
    assert_eq!(
        spot,
        Emitter::Spot { position, direction: -Vec3::Z, inner_angle: 0.3, outer_angle: 0.5 }
    );
    assert_eq!((emission, color), (None, None));
    let (sun, emission, _) =
        shape(r#"{"kind": "sun", "direction": [0,-3,0], "irradiance": [9,8,7]}"#);
    assert_eq!(sun, Emitter::Sun { direction: -Vec3::Y, angular_diameter: 0.0093 });
    assert_eq!(emission, Some([9.0, 8.0, 7.0]));
}

#[test]
fn a_sun_may_be_told_by_a_shadow() {
    // 3 m up, its shadow 4 m along x: five metres of light.
    let (sun, _, color) = shape(
        r#"{"kind": "sun", "point": [1,1,3], "shadow": [5,1,0], "angular_diameter": 0.02, "color": [1,1,0.9]}"#,
    );
    let Emitter::Sun { direction, angular_diameter } = sun else { panic!("{sun:?}") };
    assert!((direction - Vec3::new(0.8, 0.0, -0.6)).length() < 1e-6, "{direction}");
    assert_eq!((angular_diameter, color), (0.02, Some([1.0, 1.0, 0.9])));
    light_refused(
        r#"{"kind": "sun", "point": [0,0,1], "shadow": [0,1,0], "direction": [0,0,-1]}"#,
        &["lights[0].point", "direction of this sun is given already", "Leave out"],
    );
    light_refused(r#"{"kind": "sun", "point": [0,0,1]}"#, &["lights[0]", "\"shadow\" is missing"]);
    light_refused(r#"{"kind": "sun", "shadow": [0,0,1]}"#, &["lights[0]", "\"point\" is missing"]);
    light_refused(
        r#"{"kind": "sun", "point": [0,0,1], "shadow": [0,0,1]}"#,
        &["lights[0].shadow", "the point that casts it"],
    );
    light_refused(r#"{"kind": "sun"}"#, &["lights[0]", "\"direction\" is missing"]);
}

#[test]
fn corners_must_make_a_plane_figure() {
    let panel = |corners: &str, normal: &str| {
        format!(r#"{{"kind": "rectangle", "corners": {corners}, "normal": {normal}}}"#)
    };
    // Corners measured to the centimetre, and either way round.
    for corners in ["[[0,0,0],[2,0,0.01],[2,1,0],[0,1,0.01]]", "[[0,1,0],[2,1,0],[2,0,0],[0,0,0]]"]
    {
        shape(&panel(corners, "[0,0,1]"));
    }
    let refused = |corners: &str, normal: &str, parts: &[&str]| {
        light_refused(&panel(corners, normal), parts);
    };
    let place = "lights[0].corners";
    refused("[[0,0,0],[1,0,0],[1,1,0.4],[0,1,0]]", "[0,0,1]", &[place, "in one plane", "0.096 m"]);
    refused("[[0,0,0],[1,0,0],[2,0,0],[3,0,0]]", "[0,0,1]", &[place, "no area"]);
    refused("[[1,1,1],[1,1,1],[1,1,1],[1,1,1]]", "[0,0,1]", &[place, "no area"]);
    refused("[[0,0,0],[1,0,0],[0,1,0],[1,1,0]]", "[0,0,1]", &[place, "in order around"]);
    refused("[[0,0,0],[1,0,0],[0,1,0],[2,3,0]]", "[0,0,1]", &[place, "cross", "in order around"]);
    refused("[[0,0,0],[1,0,0],[1,1,0],[0,1]]", "[0,0,1]", &["lights[0].corners[3]", "3 numbers"]);
    refused("[[0,0,0],[1,0,0],[1,1,0],[0,1e12,0]]", "[0,0,1]", &["corners[3]", "away"]);
    refused(
        "[[0,0,0],[1,0,0],[1,1,0],[0,1,0]]",
        "[1,0,1]",
        &["lights[0].normal", "45 degrees off that of the corners"],
    );
    refused("[[0,0,0],[1,0,0],[1,1,0],[0,1,0]]", "[0,0,0]", &["lights[0].normal", "zero"]);
}

#[test]
fn a_strength_is_told_by_its_own_name_and_once() {
    let point = r#""kind": "point", "position": [0,0,0]"#;
    light_refused(
        &format!(r#"{{{point}, "radiance": [1,1,1]}}"#),
        &["lights[0].radiance", "the strength of a point is its intensity"],
    );
    light_refused(
        &format!(r#"{{{point}, "intensity": [1,1,-1]}}"#),
        &["lights[0].intensity", "cannot be negative"],
    );
    light_refused(
        &format!(r#"{{{point}, "intensity": [1,1,1], "color": [1,1,1]}}"#),
        &["lights[0].color", "intensity of this light is known"],
    );
    light_refused(&format!(r#"{{{point}, "color": [0,0,0]}}"#), &["lights[0].color", "black"]);
    light_refused(&format!(r#"{{{point}, "color": [1,-1,0]}}"#), &["lights[0].color", "negative"]);
    light_refused(&format!(r#"{{{point}, "color": 1}}"#), &["lights[0].color", "a list"]);
    light_refused(
        r#"{"kind": "visible", "surfaces": ["shade"], "color": [1,1,1]}"#,
        &["lights[0].color", "visible"],
    );
    light_refused(
        r#"{"kind": "dome", "image": "sky.hdr", "color": [1,1,1]}"#,
        &["lights[0].color", "dome"],
    );
    let spot = r#""kind": "spot", "position": [0,0,0], "direction": [0,0,1]"#;
    light_refused(
        &format!(r#"{{{spot}, "inner_angle": 0.6, "outer_angle": 0.5}}"#),
        &["lights[0].inner_angle", "between 0 and the outer one"],
    );
    light_refused(
        &format!(r#"{{{spot}, "inner_angle": 20, "outer_angle": 30}}"#),
        &["lights[0].outer_angle", "radians"],
    );
    light_refused(
        r#"{"kind": "sun", "direction": [0,0,1], "angular_diameter": 0}"#,
        &["lights[0].angular_diameter", "positive"],
    );
}

#[test]
fn a_sky_is_read_from_the_folder() {
    let KnownLight::Dome { name, dome } =
        light(r#"{"kind": "dome", "image": "./sky.hdr", "scale": 3}"#)
    else {
        panic!("this is no dome")
    };
    assert_eq!((name.as_str(), dome.scale), ("light 1", 3.0));
    assert_eq!((dome.image.width(), dome.image.height()), (4, 2));
    // The centre of column 2 and row 0: three eighths more than half round, from +y over +x.
    let direction = Vec3::new(-0.5, -0.5, 0.5f32.sqrt());
    let found = dome.radiance(direction);
    let close =
        std::iter::zip(found, [9.0, 3.0, 3.0]).all(|(a, b): (f32, f32)| (a - b).abs() < 1e-4);
    assert!(close, "{found:?}");
    let tall = r#"{"materials": [{"name": "a", "surfaces": ["wall"]}], "lights": [{"kind": "dome", "image": "tall.hdr"}]}"#;
    let warnings = load(tall).0.unwrap().warnings.join("\n");
    for part in ["lights[0].image", "2 x 4 pixels", "twice as wide as high"] {
        assert!(warnings.contains(part), "\"{part}\" is missing in {warnings}");
    }
}

#[test]
fn a_sky_that_cannot_be_read_names_file_and_field() {
    let dome = |image: &str| format!(r#"{{"kind": "dome", "image": "{image}"}}"#);
    light_refused(&dome("lost.exr"), &["tags.json, lights[0].image", "no image \"lost.exr\""]);
    light_refused(&dome(""), &["tags.json, lights[0].image", "no image"]);
    light_refused(&dome("sky.exr"), &["tags.json, lights[0].image", "cannot be used", "sky.exr"]);
    light_refused(&dome("tags.json"), &["lights[0].image", "neither OpenEXR nor Radiance"]);
    for elsewhere in ["../sky.hdr", "a/../../sky.hdr", "/etc/sky.hdr", "..\\\\sky.hdr"] {
        light_refused(
            &dome(elsewhere),
            &["lights[0].image", "does not lie in the folder of this file"],
        );
    }
    light_refused(
        r#"{"kind": "dome", "image": "sky.hdr", "scale": 0}"#,
        &["lights[0].scale", "positive"],
    );
}

#[test]
fn a_known_reflectance_may_have_a_deviation() {
    let material = |fields: &str| {
        format!(r#"{{"materials": [{{"name": "a", "surfaces": ["wall"], {fields}}}]}}"#)
    };
    let deviation = |fields: &str| load(&material(fields)).0.unwrap().materials[0].known_diffuse_sd;
    assert_eq!(deviation(r#""known_diffuse": [0.1, 0.2, 0.3]"#), None);
    assert_eq!(
        deviation(r#""known_diffuse": [0.1, 0.2, 0.3], "known_diffuse_sd": 0.02"#),
        Some([0.02; 3])
    );
    assert_eq!(
        deviation(r#""known_diffuse": [0.1, 0.2, 0.3], "known_diffuse_sd": [0, 0.01, 0.02]"#),
        Some([0.0, 0.01, 0.02])
    );
    refused(
        &material(r#""known_diffuse_sd": 0.02"#),
        &["materials[0].known_diffuse_sd", "no known_diffuse"],
    );
    for wrong in ["-0.1", "[0.1, -0.1, 0.1]", "[0.1, 0.1]", "\"small\""] {
        refused(
            &material(&format!(r#""known_diffuse": [0.1, 0.2, 0.3], "known_diffuse_sd": {wrong}"#)),
            &["materials[0].known_diffuse_sd"],
        );
    }
}

#[test]
fn a_colour_matrix_is_three_rows_that_can_be_undone() {
    let tags = |matrix: &str| {
        let materials = r#""materials": [{"name": "a", "surfaces": ["wall"]}]"#;
        format!(r#"{{{materials}, "color_matrix": {matrix}}}"#)
    };
    let matrix = load(&tags("[[1, 2, 3], [0, 1, 4], [0, 0, 1]]")).0.unwrap().color_matrix.unwrap();
    assert_eq!(matrix * glam::DVec3::Z, glam::DVec3::new(3.0, 4.0, 1.0));
    refused(&tags("[[1, 2, 3], [0, 1, 4]]"), &["color_matrix", "three rows"]);
    refused(&tags("[[1, 2, 3], [0, 1, 4], [0, 0]]"), &["color_matrix[2]"]);
    refused(&tags("[[1, 2, 3], [2, 4, 6], [0, 0, 1]]"), &["color_matrix", "lobelia chart"]);
}
