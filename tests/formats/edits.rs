//! `edits.json`.

use glam::Vec3;
use lobelia::io::Error;
use lobelia::io::edits::{self, read, write};
use lobelia::render::edits::{Edits, Shape, Surroundings};
use lobelia::scene::{Brdf, Capture, Emitter, Material, MaterialKind};
use serde_json::{Value, json};

use crate::{folder, message, put};

const MESH: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl ball\nf 1 2 3\nusemtl block\n\
                    f 1 2 4\nf 1 3 4\n";
const EMPTY: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

fn capture() -> Capture {
    let material = |name: &str| Material {
        name: name.into(),
        kind: MaterialKind::Diffuse,
        surfaces: Vec::new(),
        textured: false,
        known_diffuse: None,
        known_diffuse_sd: None,
    };
    Capture { materials: vec![material("floor"), material("wall")], ..Capture::default() }
}

fn load(text: &str) -> Result<(Edits, Vec<String>), Error> {
    let folder = folder();
    put(folder.path(), "object.obj", MESH);
    put(folder.path(), "empty.obj", EMPTY);
    let sky = folder.path().join("sky.exr");
    lobelia::io::exr::write_rgb(&sky, 4, 2, &[[0.5; 3]; 8]).unwrap();
    read(&put(folder.path(), "edits.json", text), &capture())
}

/// Refused with the file, the field and a remedy.
#[track_caller]
fn refused(edits: Value, parts: &[&str]) {
    refused_text(&edits.to_string(), parts);
}

#[track_caller]
fn refused_text(text: &str, parts: &[&str]) {
    let text = message(load(text), parts);
    assert!(text.contains("edits.json, "), "{text}");
    let remedies = ["Correct", "Give", "It has", "Lower", "Put", "choices", "Check", "Leave"];
    assert!(remedies.iter().any(|remedy| text.contains(remedy)), "no remedy: {text}");
}

fn light(mut change: Value) -> Value {
    let mut light = json!({"kind": "sphere", "center": [0, 0, 2], "radius_m": 0.1,
        "radiance": [1, 2, 3]});
    light.as_object_mut().unwrap().append(change.as_object_mut().unwrap());
    json!({ "lights": [light] })
}

fn object(mut change: Value) -> Value {
    let mut object = json!({"mesh": "object.obj"});
    object.as_object_mut().unwrap().append(change.as_object_mut().unwrap());
    json!({ "objects": [object] })
}

fn placed(rows: Value) -> Value {
    object(json!({ "world_from_object": rows }))
}

fn painted(material: Value) -> Value {
    object(json!({"materials": { "ball": material }}))
}

#[test]
fn everything_that_can_be_said_is_understood() {
    let corners = [[0, 0, 2], [1, 0, 2], [1, 1, 2], [0, 1, 2]];
    let (edits, warnings) = load(
        &json!({
            "original_light": 0.5,
            "lights": [
                {"name": "panel", "kind": "rectangle", "corners": corners, "normal": [0, 0, -2],
                 "radiance": [30, 28, 22]},
                {"kind": "sphere", "center": [1, 2, 3], "radius_m": 0.1, "radiance": [1, 2, 3]},
                {"kind": "point", "position": [1, 2, 3], "intensity": [4, 5, 6]},
                {"kind": "spot", "position": [1, 2, 3], "direction": [0, 0, -3],
                 "inner_angle": 0.3, "outer_angle": 0.5, "intensity": [7, 8, 9]},
                {"kind": "sun", "direction": [0, 0, -1], "irradiance": [1, 1, 1]},
                {"kind": "dome", "image": "sky.exr", "scale": 2.0}],
            "objects": [
                {"name": "thing", "mesh": "object.obj",
                 "world_from_object": [[0, -2, 0, 5], [2, 0, 0, 6], [0, 0, 2, 7], [0, 0, 0, 1]],
                 "materials": {"ball": {"diffuse": [0.6, 0.55, 0.2], "specular": [0.1, 0.2, 0.3],
                                        "exponent": 40},
                               "block": {"diffuse": [0.1, 0.2, 0.3]}}}],
            "materials": {"floor": {"diffuse": [0.2, 0.3, 0.4]}, "wall": {"exponent": 0}},
            "surroundings_albedo": 0.25
        })
        .to_string(),
    )
    .unwrap();
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!(edits.original_light, 0.5);
    let names: Vec<&str> = edits.lights.iter().map(|light| light.name.as_str()).collect();
    assert_eq!(names, ["panel", "light 2", "light 3", "light 4", "light 5", "light 6"]);
    let emissions: Vec<_> = edits.lights.iter().map(|light| light.emission[1]).collect();
    assert_eq!(emissions, [28.0, 2.0, 5.0, 8.0, 1.0, 1.0]);
    let emitters: Vec<Option<Emitter>> = edits
        .lights
        .iter()
        .map(|light| match &light.shape {
            Shape::Emitter(emitter) => Some(*emitter),
            Shape::Dome(dome) => {
                assert_eq!((dome.scale, dome.image.width()), (2.0, 4));
                None
            }
        })
        .collect();
    let at = Vec3::new(1.0, 2.0, 3.0);
    let down = -Vec3::Z;
    let corners = corners.map(|corner| Vec3::from(corner.map(|x| x as f32)));
    let expected = [
        Some(Emitter::Rectangle { corners, normal: down }),
        Some(Emitter::Sphere { center: at, radius_m: 0.1 }),
        Some(Emitter::Point { position: at }),
        Some(Emitter::Spot { position: at, direction: down, inner_angle: 0.3, outer_angle: 0.5 }),
        Some(Emitter::Sun { direction: down, angular_diameter: Emitter::SUN_DIAMETER }),
        None,
    ];
    assert_eq!(emitters, expected);

    let thing = &edits.objects[0];
    assert_eq!((thing.name.as_str(), thing.mesh.triangles.len()), ("thing", 3));
    let first = [[5.0, 6.0, 7.0], [5.0, 8.0, 7.0], [3.0, 6.0, 7.0]];
    let placed = thing.placed();
    assert_eq!(placed.corners(0), first.map(Vec3::from));
    assert_eq!(placed.corners(1)[2], Vec3::new(5.0, 6.0, 9.0));
    assert_eq!(placed.surface, [0, 1, 1]);
    let [(_, ball), (_, block)] = thing.surfaces.as_slice() else { panic!("two surfaces") };
    assert_eq!((ball.diffuse[1], ball.specular, ball.exponent), (0.55, [0.1, 0.2, 0.3], 40.0));
    assert_eq!((block.diffuse, block.specular), ([0.1, 0.2, 0.3], [0.0; 3]));

    assert_eq!(edits.materials["floor"].diffuse, Some([0.2, 0.3, 0.4]));
    assert_eq!((edits.materials["floor"].specular, edits.materials["wall"].diffuse), (None, None));
    assert_eq!(edits.materials["wall"].exponent, Some(0.0));
    assert_eq!(edits.surroundings, Surroundings::Albedo(0.25));
}

/// Everything that can be said, written and read again; the second time to the same bytes.
#[test]
fn what_is_written_is_read_back() {
    let folder = folder();
    put(folder.path(), "object.obj", MESH);
    std::fs::create_dir(folder.path().join("skies")).unwrap();
    let sky = folder.path().join("skies/sky.exr");
    lobelia::io::exr::write_rgb(&sky, 4, 2, &[[0.5; 3]; 8]).unwrap();
    let corners = [[0.1, 0.0, 2.0], [1.0, 0.0, 2.0], [1.0, 1.3, 2.0], [0.1, 1.3, 2.0]];
    let said = json!({
        "original_light": 0.25,
        "original_light_groups": {"lamp 1": 0.0, "background from above": 2.5},
        "lights": [
            {"name": "panel", "kind": "rectangle", "corners": corners, "normal": [0, 0, -1],
             "radiance": [30.5, 28, 22]},
            {"name": "ball", "kind": "sphere", "center": [1.1, 2, 3], "radius_m": 0.1,
             "radiance": [1, 2, 3], "on": false},
            {"name": "spot", "kind": "spot", "position": [1, 2, 3], "direction": [0, 0, -1],
             "inner_angle": 0.3, "outer_angle": 0.5, "intensity": [7, 8, 9]},
            {"name": "point", "kind": "point", "position": [1, 2, 3], "intensity": [4, 5, 6]},
            {"name": "sun", "kind": "sun", "direction": [0, 0, -1], "angular_diameter": 0.01,
             "irradiance": [1, 1, 1]},
            {"name": "sky", "kind": "dome", "image": "skies/sky.exr", "scale": 2.5, "on": false}],
        "objects": [
            {"name": "thing", "mesh": "object.obj",
             "world_from_object": [[0, -2, 0, 5.5], [2, 0, 0, 6], [0, 0, 2, 7], [0, 0, 0, 1]],
             "materials": {"ball": {"diffuse": [0.6, 0.55, 0.2], "specular": [0.1, 0.2, 0.3],
                                    "exponent": 40},
                           "block": {"diffuse": [0.1, 0.2, 0.3], "specular": [0, 0, 0],
                                     "exponent": 1}}}],
        "materials": {"floor": {"diffuse": [0.2, 0.3, 0.4], "exponent": 3}},
        "surroundings_albedo": 0.25
    });
    let first = put(folder.path(), "edits.json", said.to_string());
    let (edits, warnings) = read(&first, &capture()).unwrap();
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!(edits.groups["background from above"], 2.5);
    // Elsewhere: the files that it names are found from there, too.
    std::fs::create_dir(folder.path().join("work")).unwrap();
    let second = folder.path().join("work/edits.json");
    write(&second, &edits).unwrap();
    let text = std::fs::read_to_string(&second).unwrap();
    assert!(text.contains("\"../skies/sky.exr\"") && text.contains("0.1,"), "{text}");
    let (again, _) = read(&second, &capture()).unwrap();
    assert_eq!(again.lights.len(), 6);
    let off: Vec<bool> = again.lights.iter().map(|light| !light.is_on).collect();
    assert_eq!(off, [false, true, false, false, false, true]);
    assert_eq!(again, edits);
    write(&second, &again).unwrap();
    assert_eq!(std::fs::read_to_string(&second).unwrap(), text);
    // Nothing said, nothing written.
    write(&second, &Edits::default()).unwrap();
    assert_eq!(std::fs::read_to_string(&second).unwrap(), "{}\n");
    let open = Edits { surroundings: Surroundings::Open, ..Edits::default() };
    write(&second, &open).unwrap();
    assert_eq!(read(&second, &capture()).unwrap().0, open);
}

#[test]
fn what_is_not_said_is_as_it_was() {
    assert_eq!(load("{}").unwrap(), (Edits::default(), Vec::new()));
    let open = load(r#"{"surroundings_albedo": null}"#).unwrap().0;
    assert_eq!(open, Edits { surroundings: Surroundings::Open, ..Edits::default() });
    let (edits, warnings) = load(&object(json!({})).to_string()).unwrap();
    assert_eq!(edits.objects[0].name, "object 1");
    assert_eq!(edits.objects[0].surfaces[1].1.diffuse, [0.5; 3]);
    assert!(warnings.len() == 2 && warnings[1].contains("\"block\""), "{warnings:?}");
}

#[test]
fn a_mirrored_object_keeps_its_outer_side() {
    let mirror = json!([[-1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]);
    let object = load(&placed(mirror).to_string()).unwrap().0.objects.remove(0);
    // Its first face turned up, and still does.
    assert_eq!(object.placed().normal(0), Vec3::Z);
}

#[test]
fn light_that_cannot_be_is_refused() {
    refused(light(json!({"radiance": [1, -1, 1]})), &["lights[0].radiance", "negative"]);
    refused(light(json!({"radiance": [1, 1]})), &["lights[0].radiance", "3 numbers"]);
    refused(light(json!({"radiance": [1, 1, 1e300]})), &["lights[0].radiance", "brighter"]);
    refused(light(json!({ "radiance": null })), &["lights[0]", "\"radiance\" is missing"]);
    refused(light(json!({"on": "no"})), &["lights[0].on", "true or false"]);
    refused(light(json!({"radius_m": 0})), &["lights[0].radius_m", "positive"]);
    let kinds = ["lights[0].kind", "\"lamp\" is no kind", "\"rectangle\"", "\"sun\"", "\"dome\""];
    refused(light(json!({"kind": "lamp"})), &kinds);
    refused(light(json!({"kind": "point"})), &["lights[0]", "\"position\" is missing"]);
    refused(light(json!({"kind": "dome"})), &["lights[0]", "\"image\" is missing"]);
    let dome = light(json!({"kind": "dome", "image": "no.exr"}));
    refused(dome, &["lights[0].image", "no image \"no.exr\""]);
    refused_text(
        r#"{"lights": [{"kind": "sphere", "center": [0, NaN, 0], "radius_m": 1,
            "radiance": [1, 1, 1]}]}"#,
        &["lights[0].center[1]", "not a number"],
    );
    refused(json!({"original_light": -0.5}), &["original_light", "negative"]);
    let groups = json!({"original_light_groups": {"lamp 1": -1}});
    refused(groups, &["original_light_groups.lamp 1", "negative"]);
    refused(json!({"original_light_groups": [1]}), &["original_light_groups", "one factor"]);
    refused(json!({"original_light": 1e40}), &["original_light", "brighter"]);
    refused(json!({ "lights": {} }), &["lights", "list"]);
}

#[test]
fn objects_that_cannot_be_are_refused() {
    refused(json!({"objects": [{}]}), &["objects[0]", "\"mesh\" is missing"]);
    refused(object(json!({"mesh": "no.obj"})), &["objects[0].mesh", "there is no mesh", "no.obj"]);
    message(load(&object(json!({"mesh": "empty.obj"})).to_string()), &["empty.obj", "face"]);
    let singular = json!([[1, 0, 0, 0], [0, 1, 0, 0], [1, 1, 0, 0], [0, 0, 0, 1]]);
    refused(placed(singular), &["objects[0].world_from_object", "singular", "rotation"]);
    refused(placed(json!([[1, 0, 0, 0]])), &["objects[0].world_from_object", "four rows"]);
    let perspective = json!([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 1, 1]]);
    refused(placed(perspective), &["objects[0].world_from_object", "last row"]);
    let far = json!([[1, 0, 0, 1e300], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]);
    refused(placed(far), &["objects[0].world_from_object", "out of all range"]);
    let other = object(json!({"materials": {"blal": {}}}));
    refused(other, &["objects[0].materials", "\"blal\"", "It has \"ball\", \"block\""]);
    let list = object(json!({ "materials": [] }));
    refused(list, &["objects[0].materials", "one object {…} per material"]);
}

#[test]
fn reflectances_that_cannot_be_are_refused() {
    let at = "objects[0].materials.ball";
    refused(painted(json!({"diffuse": [0.5, 1.5, 0.5]})), &[at, "diffuse", "between 0 and 1"]);
    refused(painted(json!({"specular": [-0.1, 0, 0]})), &[at, "specular", "between 0 and 1"]);
    let much = json!({"diffuse": [0.5, 0.6, 0.5], "specular": [0.4, 0.5, 0.4]});
    refused(painted(much), &[at, "together are more than 1", "Lower one"]);
    refused(painted(json!({"exponent": -1})), &[at, "exponent", "between 0 and 1000000"]);
    let other = json!({"materials": {"flour": {"diffuse": [0.1, 0.1, 0.1]}}});
    refused(other, &["materials", "\"flour\"", "It has \"floor\", \"wall\""]);
    refused(json!({ "materials": [] }), &["materials", "one object {…} per material"]);
    let albedo = |value: f64| json!({ "surroundings_albedo": value });
    refused(albedo(1.1), &["surroundings_albedo", "between 0 and 1"]);
    refused(albedo(-0.1), &["surroundings_albedo", "between 0 and 1"]);
}

#[test]
fn what_is_no_json_is_refused() {
    message(load("{\"lights\": ["), &["edits.json, line 1", "cut off"]);
    message(load("[]"), &["edits.json", "one object"]);
}

/// A tetrahedron in the material "red" as glTF with its buffer inside.
fn gltf(material: &Value) -> String {
    use base64::Engine as _;
    let corners: [[f32; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mut bytes: Vec<u8> =
        corners.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
    let faces: [u16; 12] = [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3];
    bytes.extend(faces.iter().flat_map(|index| index.to_le_bytes()));
    let data = base64::engine::general_purpose::STANDARD.encode(&bytes);
    json!({
        "asset": {"version": "2.0"},
        "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "materials": [material],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3",
             "min": [0, 0, 0], "max": [1, 1, 1]},
            {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 24},
        ],
        "buffers": [{
            "byteLength": bytes.len(),
            "uri": format!("data:application/octet-stream;base64,{data}"),
        }],
    })
    .to_string()
}

#[test]
fn objects_have_the_colours_of_their_files() {
    let folder = folder();
    let obj = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl red\nf 1 2 3\n\
               usemtl varnish\nf 1 2 4\nusemtl none\nf 1 3 4\n";
    put(folder.path(), "a.obj", obj);
    let mtl = "newmtl red\nKd 0.6 0.1 0.05\nillum 1\n\
               newmtl varnish\nKd 0.4 0.3 0.2\nKs 0.25 0.25 0.25\nNs 90\nillum 2\n";
    put(folder.path(), "a.mtl", mtl);
    let brass = json!({"name": "brass", "pbrMetallicRoughness": {
        "baseColorFactor": [0.8, 0.6, 0.2, 1.0], "metallicFactor": 1.0, "roughnessFactor": 0.5,
    }});
    put(folder.path(), "b.gltf", gltf(&brass));
    let clay = json!({"pbrMetallicRoughness": {
        "baseColorFactor": [0.5, 0.25, 0.125, 1.0], "metallicFactor": 0.0,
    }});
    put(folder.path(), "c.gltf", gltf(&clay));
    let own = json!({"red": {"diffuse": [0.1, 0.2, 0.3]}});
    let value = json!({"objects": [
        {"mesh": "a.obj"}, {"mesh": "b.gltf"}, {"mesh": "c.gltf"},
        {"mesh": "a.obj", "materials": own},
    ]});
    let file = folder.path().join("edits.json");
    let (edits, warnings) = edits::of_value(&file, &value, &Capture::default()).unwrap();
    let brdf = |object: usize, name: &str| {
        let mut surfaces = edits.objects[object].surfaces.iter();
        surfaces.find(|(own, _)| own == name).unwrap_or_else(|| panic!("no {name}")).1
    };
    assert_eq!(brdf(0, "red"), Brdf::diffuse([0.6, 0.1, 0.05]));
    assert_eq!(brdf(0, "varnish"), Brdf::phong([0.4, 0.3, 0.2], [0.25; 3], 90.0));
    assert_eq!(brdf(0, "none"), Brdf::diffuse([0.5; 3]));
    assert_eq!(brdf(3, "red").diffuse, [0.1, 0.2, 0.3], "what is said wins over the file");
    assert!(warnings.iter().all(|text| text.contains("\"none\"")), "{warnings:?}");
    let brass = brdf(1, "brass");
    let base = [0.8f32, 0.6, 0.2].map(f64::from);
    assert_eq!((brass.diffuse, brass.specular), ([0.0; 3], base));
    // α = 0.25: 2/α² − 2 = 30 about the half vector.
    assert!((brass.exponent - 7.5).abs() < 1e-6, "{}", brass.exponent);
    assert_eq!(brdf(2, "material_0"), Brdf::diffuse([0.5, 0.25, 0.125]));
}
