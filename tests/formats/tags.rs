//! `tags.json`.

use lobelia::io::Error;
use lobelia::io::tags::{Tags, read};
use lobelia::scene::{Environment, KnownLight, MaterialKind, Role, Surface};

use crate::{folder, message, put};

fn load(text: &str) -> (Result<Tags, Error>, Vec<Surface>) {
    let folder = folder();
    let surface =
        |name: &str| Surface { name: name.into(), role: Role::Untagged, has_texcoords: false };
    let mut surfaces = ["floor", "wall", "shade", "box"].map(surface).to_vec();
    let tags = read(&put(folder.path(), "tags.json", text), &mut surfaces);
    (tags, surfaces)
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
            {"kind": "dome", "image": "sky.exr"}],
          "environment": "open", "saturation": 60000.0}"#,
    );
    let tags = tags.unwrap();
    assert!(tags.warnings.is_empty(), "{:?}", tags.warnings);
    assert_eq!((tags.environment, tags.saturation), (Environment::Open, Some(60000.0)));
    assert_eq!(tags.materials[0].kind, MaterialKind::Specular);
    assert_eq!(tags.materials[1].known_diffuse, Some([0.18, 0.0, 1.0]));
    assert!(tags.materials[2].textured && tags.materials[2].kind == MaterialKind::Diffuse);
    assert_eq!(tags.lights[1], KnownLight::Visible { name: "lamp".into(), surfaces: vec![2] });
    assert_eq!(
        tags.lights[2],
        KnownLight::Shape { name: "light 3".into(), kind: "rectangle".into() }
    );
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
