//! The model for Mitsuba 3: scenes, meshes, textures, and beside them in Python what it has no
//! plugin for (recovered lights, the modified Phong BRDF) and a script that renders all cameras.
//!
//! Added light is a scene of its own: the box that stands for the unmodelled room returns it
//! alone. Added rectangles and balls are shapes there and hide what is behind them, while our
//! path tracer lets other light through.

use std::fmt::Write as _;
use std::path::Path;

use glam::{DMat3, Vec3};
use serde_json::{Value, json};

use super::super::{Error, atomic, exr};
use super::{ply, points, wavefront};
use crate::math::rgb::Radiance;
use crate::reconstruct::lights::LightKind;
use crate::render::edits::{AddedLight, Shape};
use crate::render::lights::Light;
use crate::render::looks::BrdfF32;
use crate::render::model::{Model, PartLook, View};
use crate::scene::{Dome, Emitter};
use crate::watch::Watch;

const PLUGINS: &str = include_str!("mitsuba/lobelia_mitsuba.py");
const RENDER: &str = include_str!("mitsuba/render.py");

/// `reflections` of a path at most, as in our own pictures.
pub fn write(folder: &Path, model: &Model, reflections: usize, watch: &Watch) -> Result<(), Error> {
    let textures = wavefront::write_maps(folder, model, watch)?;
    let names = wavefront::file_names(model);
    for (part, name) in model.parts.iter().zip(names.values()) {
        watch.check()?;
        let file = folder.join(format!("meshes/{name}.ply"));
        ply::write_mesh(&file, &part.positions, &part.texcoords, &part.triangles)?;
    }
    let texts = |light: LitBy| -> String {
        (0..model.parts.len())
            .map(|index| shape(model, index, &names[&index], textures[index].as_deref(), light))
            .collect()
    };
    let mut rows: Vec<Value> =
        model.recovered.iter().filter_map(|light| recovered(light, model)).collect();
    let has_recovered = !rows.is_empty();
    let table = "  <emitter type=\"lobelia_lights\"><string name=\"set\" value=";
    let mut recovered = texts(LitBy::Recovered);
    if has_recovered {
        recovered += &format!("{table}\"recovered\"/></emitter>\n");
    }
    let integrator = format!(
        "  <integrator type=\"path\"><integer name=\"max_depth\" value=\"{}\"/></integrator>\n",
        reflections + 1
    );
    atomic::write_bytes(
        &folder.join("recovered.xml"),
        scene(model, &integrator, &recovered).as_bytes(),
    )?;

    let added_file = folder.join("added.xml");
    if model.added.is_empty() {
        // That of an earlier export would be added to the pictures.
        let _ = std::fs::remove_file(&added_file);
    } else {
        let mut text = texts(LitBy::Added);
        let before = rows.len();
        for (index, light) in model.added.iter().enumerate() {
            match &light.shape {
                Shape::Dome(dome) => {
                    write_dome(&folder.join(format!("textures/dome-{index}.exr")), dome)?;
                    text += &dome_text(index, light, dome);
                }
                Shape::Emitter(emitter) => match emitter_text(emitter, light) {
                    Some(shape) => text += &shape,
                    None => rows.push(added(emitter, light)),
                },
            }
        }
        if rows.len() > before {
            text += &format!("{table}\"added\"/></emitter>\n");
        }
        if let Some(shell) = &model.shell {
            text += &shell_text(shell.low, shell.high, shell.albedo);
        }
        let integrator = model.shell.map_or(integrator, |shell| {
            let ends = [("low", shell.low), ("high", shell.high)];
            let mut text = format!(
                "  <integrator type=\"lobelia_path\"><integer name=\"max_depth\" value=\"{}\"/>\n",
                reflections + 1
            );
            for (end, corner) in ends {
                for (axis, value) in ["x", "y", "z"].iter().zip(corner.to_array()) {
                    let _ = writeln!(text, "    <float name=\"{end}_{axis}\" value=\"{value}\"/>");
                }
            }
            text + "  </integrator>\n"
        });
        atomic::write_bytes(&added_file, scene(model, &integrator, &text).as_bytes())?;
    }
    let lights = json!({"far_m": 8.0 * model.radius_m.max(1e-3),
        "shell": model.shell.map(|shell| [shell.low.to_array(), shell.high.to_array()]), "middle": model.middle.to_array(),
        "lights": rows});
    atomic::write_bytes(&folder.join("lights.json"), format!("{lights:#}\n").as_bytes())?;
    atomic::write_bytes(&folder.join("lobelia_mitsuba.py"), PLUGINS.as_bytes())?;
    atomic::write_bytes(&folder.join("render.py"), RENDER.as_bytes())
}

fn scene(model: &Model, integrator: &str, rest: &str) -> String {
    let cameras: String = model.cameras.iter().map(sensor).collect();
    format!(
        "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<!-- metres, z up; render.py registers the \
         plugins lobelia_... -->\n<scene version=\"3.0.0\">\n{integrator}{cameras}{rest}</scene>\n"
    )
}

fn sensor(view: &View) -> String {
    let camera = &view.camera;
    // Mitsuba's cameras look along +z with x to the left.
    let turn = camera.world_from_camera * DMat3::from_diagonal((-1.0, 1.0, -1.0).into());
    let place = camera.position;
    let rows: Vec<String> = (0..3)
        .map(|row| {
            let [x, y, z] = [0, 1, 2].map(|column| turn.col(column)[row]);
            format!("{x} {y} {z} {}", place[row])
        })
        .collect();
    let (width, height) = (camera.width as f64, camera.height as f64);
    let fov = (2.0 * (0.5 * width / camera.focal_px.x).atan()).to_degrees();
    let (x, y) = (
        (camera.principal_px.x - 0.5 * width) / width,
        (camera.principal_px.y - 0.5 * height) / height,
    );
    format!(
        "  <sensor type=\"perspective\" id=\"camera {}\">\n    <string name=\"fov_axis\" value=\"x\"/>\n    \
         <float name=\"fov\" value=\"{fov}\"/>\n    <float name=\"near_clip\" value=\"0.0001\"/>\n    \
         <float name=\"far_clip\" value=\"1000000\"/>\n    \
         <float name=\"principal_point_offset_x\" value=\"{x}\"/>\n    \
         <float name=\"principal_point_offset_y\" value=\"{y}\"/>\n    \
         <transform name=\"to_world\"><matrix value=\"{} 0 0 0 1\"/></transform>\n    \
         <film type=\"hdrfilm\"><integer name=\"width\" value=\"{}\"/>\
         <integer name=\"height\" value=\"{}\"/><string name=\"pixel_format\" value=\"rgb\"/>\
         <string name=\"component_format\" value=\"float32\"/><rfilter type=\"box\"/></film>\n    \
         <sampler type=\"independent\"/>\n  </sensor>\n",
        escaped(&view.name),
        rows.join(" "),
        camera.width,
        camera.height
    )
}

/// Text of an attribute.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}

fn rgb(name: &str, [r, g, b]: Radiance) -> String {
    format!("<rgb name=\"{name}\" value=\"{r} {g} {b}\"/>")
}

fn bitmap(name: &str, path: &str) -> String {
    format!(
        "<texture type=\"bitmap\" name=\"{name}\"><string name=\"filename\" value=\"{}\"/>\
         <boolean name=\"raw\" value=\"true\"/><string name=\"wrap_mode\" value=\"clamp\"/></texture>",
        escaped(path)
    )
}

const BLACK: &str = "<bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"0 0 0\"/></bsdf>";

/// The light of a scene.
#[derive(Clone, Copy, PartialEq, Eq)]
enum LitBy {
    Recovered,
    Added,
}

fn shape(model: &Model, index: usize, name: &str, texture: Option<&str>, light: LitBy) -> String {
    let diffuse = |brdf: &BrdfF32, name: &str| match texture {
        Some(path) => bitmap(name, path),
        None => rgb(name, brdf.diffuse),
    };
    let part = &model.parts[index];
    let look = match &part.look {
        // Recovered lights on it are all that it sends.
        _ if part.is_counted && light == LitBy::Recovered => BLACK.to_owned(),
        PartLook::Plain(brdf) | PartLook::Textured(brdf, _) => {
            if let Some(coat) = brdf.coat {
                format!(
                    "<bsdf type=\"twosided\"><bsdf type=\"principled\">{}<float name=\"roughness\" \
                     value=\"{}\"/><float name=\"eta\" value=\"1.5\"/></bsdf></bsdf>",
                    diffuse(brdf, "base_color"),
                    coat.sqrt(),
                )
            } else if brdf.specular.iter().any(|&value| value > 0.0) {
                let mut text = format!("<bsdf type=\"lobelia_phong\">{}", diffuse(brdf, "diffuse"));
                for (c, value) in ["r", "g", "b"].iter().zip(brdf.specular) {
                    let _ = write!(text, "<float name=\"specular_{c}\" value=\"{value}\"/>");
                }
                text + &format!("<float name=\"exponent\" value=\"{}\"/></bsdf>", brdf.exponent)
            } else {
                format!(
                    "<bsdf type=\"twosided\"><bsdf type=\"diffuse\">{}</bsdf></bsdf>",
                    diffuse(brdf, "reflectance")
                )
            }
        }
        // What shines by itself is recovered light.
        PartLook::Shining(_) if light == LitBy::Added => BLACK.to_owned(),
        PartLook::Shining(_) => {
            format!("{BLACK}{EMITTER}{}</emitter>", bitmap("radiance", texture.unwrap_or_default()))
        }
    };
    format!(
        "  <shape type=\"ply\" id=\"surface {index}\">\n    \
         <string name=\"filename\" value=\"meshes/{}.ply\"/>\
         <boolean name=\"face_normals\" value=\"true\"/>\
         <boolean name=\"flip_tex_coords\" value=\"true\"/>\n    {look}\n  </shape>\n",
        escaped(name)
    )
}

const EMITTER: &str = "<emitter type=\"area\">";

/// A row of the table of lights.
fn row(set: &str, kind: &str) -> Value {
    json!({"set": set, "kind": kind, "name": "", "position": [0, 0, 0], "normal": [0, 0, -1],
        "radius_m": 0, "area": 1, "cos_half_angle": 1, "cone": [-2, -3],
        "corners": vec![0.0; 12], "lobes": []})
}

fn lobe(direction: Vec3, exponent: f32, emission: Radiance) -> Value {
    let values: Vec<f32> =
        direction.to_array().into_iter().chain([exponent]).chain(emission).collect();
    json!(values)
}

fn recovered(light: &Light, model: &Model) -> Option<Value> {
    if light.lobes.is_empty() {
        return None;
    }
    if let Some(emitter) = &light.emitter {
        return Some(of_emitter("recovered", emitter, light.lobes[0].1));
    }
    let shape = &light.shape;
    let kind = match shape.kind {
        LightKind::Lamp => "lamp",
        LightKind::Sky | LightKind::Sun => "distant",
        LightKind::Sphere | LightKind::Surface | LightKind::Known(_) => "disc",
    };
    let mut row = row("recovered", kind);
    let place = if shape.is_distant() { model.middle } else { shape.position };
    row["name"] = points::kind(shape.kind).into();
    row["position"] = json!(place.to_array());
    row["normal"] = json!(shape.normal.to_array());
    row["radius_m"] = shape.radius_m.into();
    row["area"] = match shape.kind {
        LightKind::Sun => json!(1.0),
        LightKind::Sky => json!(shape.solid_angle_sr()),
        _ => json!(shape.area_m2()),
    };
    row["cos_half_angle"] = json!(f64::from(shape.half_angle).cos());
    let lobes = light.lobes.iter().map(|(l, emission)| lobe(l.direction, l.exponent, *emission));
    row["lobes"] = lobes.collect();
    Some(row)
}

fn added(emitter: &Emitter, light: &AddedLight) -> Value {
    let mut row = of_emitter("added", emitter, light.emission.map(|value| value as f32));
    row["name"] = light.name.as_str().into();
    row
}

fn of_emitter(set: &str, emitter: &Emitter, emission: Radiance) -> Value {
    let kind = match emitter {
        Emitter::Rectangle { .. } => "panel",
        Emitter::Sphere { .. } => "ball",
        Emitter::Sun { .. } => "distant",
        Emitter::Point { .. } | Emitter::Spot { .. } => "lamp",
    };
    let mut row = row(set, kind);
    let (place, radius_m) = emitter.extent();
    row["position"] = json!(place.to_array());
    row["lobes"] = json!([lobe(Vec3::Z, 0.0, emission)]);
    match emitter {
        Emitter::Rectangle { corners, normal } => {
            row["normal"] = json!(normal.to_array());
            let corners: Vec<f32> = emitter_corners(corners);
            row["corners"] = json!(corners);
            row["area"] = json!(emitter.area_m2());
        }
        Emitter::Sphere { .. } => {
            row["radius_m"] = json!(radius_m);
            row["area"] = json!(emitter.area_m2());
        }
        Emitter::Point { .. } => {}
        Emitter::Spot { direction, inner_angle, outer_angle, .. } => {
            row["normal"] = json!(direction.to_array());
            row["cone"] = json!([inner_angle.cos(), outer_angle.cos()]);
        }
        Emitter::Sun { direction, angular_diameter } => {
            row["normal"] = json!(direction.to_array());
            row["cos_half_angle"] = json!(f64::from(0.5 * angular_diameter).cos());
        }
    }
    row
}

/// In such an order that both triangles beside the first diagonal lie inside.
fn emitter_corners(&[a, b, c, d]: &[Vec3; 4]) -> Vec<f32> {
    let across = |a: Vec3, b: Vec3, c: Vec3| (b - a).cross(c - a);
    let turned = across(a, b, c).dot(across(a, c, d)) < 0.0;
    let corners = if turned { [b, c, d, a] } else { [a, b, c, d] };
    corners.iter().flat_map(|corner| corner.to_array()).collect()
}

/// A shape that shines, for what Mitsuba has one for.
fn emitter_text(emitter: &Emitter, light: &AddedLight) -> Option<String> {
    let radiance = rgb("radiance", light.emission.map(|value| value as f32));
    match emitter {
        Emitter::Sphere { center, radius_m } => Some(format!(
            "  <shape type=\"sphere\"><point name=\"center\" value=\"{} {} {}\"/>\
             <float name=\"radius\" value=\"{radius_m}\"/>{BLACK}{EMITTER}{radiance}</emitter></shape>\n",
            center.x, center.y, center.z
        )),
        Emitter::Rectangle { corners: [a, b, c, d], normal } => {
            // Only parallelograms are images of Mitsuba's square.
            let (x, y) = (0.5 * (*b - *a), 0.5 * (*d - *a));
            let middle = 0.5 * (*a + *c);
            if (*a + *c - *b - *d).length() > 1e-4 * (*c - *a).length() {
                return None;
            }
            // Its normal is x cross y.
            let (x, y) = if x.cross(y).dot(*normal) > 0.0 { (x, y) } else { (y, x) };
            let rows: Vec<String> =
                (0..3).map(|k| format!("{} {} {} {}", x[k], y[k], normal[k], middle[k])).collect();
            Some(format!(
                "  <shape type=\"rectangle\"><transform name=\"to_world\"><matrix value=\"{} 0 0 0 1\"/>\
                 </transform>{BLACK}{EMITTER}{radiance}</emitter></shape>\n",
                rows.join(" ")
            ))
        }
        Emitter::Point { .. } | Emitter::Spot { .. } | Emitter::Sun { .. } => None,
    }
}

fn write_dome(file: &Path, dome: &Dome) -> Result<(), Error> {
    let image = &dome.image;
    let pixel = |index: usize| {
        let (x, y) = (index % image.width(), index / image.width());
        image.radiance(x, y).unwrap_or_default().map(|value| value * dome.scale)
    };
    let pixels: Vec<Radiance> = (0..image.width() * image.height()).map(pixel).collect();
    exr::write_rgb(file, image.width(), image.height(), &pixels)
}

/// Of the same axes, with y up instead of z.
fn dome_text(index: usize, light: &AddedLight, dome: &Dome) -> String {
    let turn = match dome.turn {
        0.0 => String::new(),
        turn => format!("<rotate z=\"1\" angle=\"{}\"/>", turn.to_degrees()),
    };
    format!(
        "  <emitter type=\"envmap\"><string name=\"filename\" value=\"textures/dome-{index}.exr\"/>\
         <float name=\"scale\" value=\"{}\"/>\
         <transform name=\"to_world\"><rotate x=\"1\" angle=\"90\"/>{turn}</transform></emitter>\n",
        light.emission[0]
    )
}

fn shell_text(low: Vec3, high: Vec3, albedo: f32) -> String {
    let (half, middle) = (0.5 * (high - low), 0.5 * (high + low));
    format!(
        "  <shape type=\"cube\"><boolean name=\"flip_normals\" value=\"true\"/>\
         <transform name=\"to_world\"><scale x=\"{}\" y=\"{}\" z=\"{}\"/>\
         <translate x=\"{}\" y=\"{}\" z=\"{}\"/></transform>\
         <bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"{albedo} {albedo} {albedo}\"/></bsdf></shape>\n",
        half.x, half.y, half.z, middle.x, middle.y, middle.z
    )
}
