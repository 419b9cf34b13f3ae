//! The settings of the 3D view in a project file. Settings that are missing or unknown there stay
//! as they are.

use serde_json::{Value, json};

use super::viewport::{SampleColor, Shading, ToneMapping, ViewCamera, ViewSettings};

const SHADINGS: [(Shading, &str); 5] = [
    (Shading::Photograph, "photograph"),
    (Shading::Material, "material"),
    (Shading::Reflectance, "reflectance"),
    (Shading::Plain, "plain"),
    (Shading::Relit, "relit"),
];
const COLORS: [(SampleColor, &str); 5] = [
    (SampleColor::Radiance, "radiance"),
    (SampleColor::Material, "material"),
    (SampleColor::Error, "error"),
    (SampleColor::Weight, "weight"),
    (SampleColor::Views, "views"),
];
const TONES: [(ToneMapping, &str); 3] = [
    (ToneMapping::Linear, "linear"),
    (ToneMapping::Neutral, "pbr-neutral"),
    (ToneMapping::FalseColor, "false-color"),
];

pub fn value(settings: &ViewSettings, camera: &ViewCamera) -> Value {
    json!({
        "shading": word(&SHADINGS, settings.shading),
        "wireframe": settings.wireframe,
        "cameras": settings.cameras,
        "thumbnails": settings.thumbnails,
        "samples": settings.samples,
        "sample_color": word(&COLORS, settings.sample_color),
        "lights": settings.lights,
        "lobes": settings.lobes,
        "grid": settings.grid,
        "exposure_ev": settings.exposure_ev,
        "tone_mapping": word(&TONES, settings.tone_mapping),
        "look_through_opacity": settings.look_through_opacity,
        "camera": {
            "target": camera.target.to_array(),
            "distance": camera.distance,
            "azimuth": camera.azimuth,
            "elevation": camera.elevation,
            "orthographic": camera.orthographic,
        },
    })
}

pub fn apply(value: &Value, settings: &mut ViewSettings) {
    let set = |key: &str, target: &mut bool| {
        if let Some(stored) = value.get(key).and_then(Value::as_bool) {
            *target = stored;
        }
    };
    set("wireframe", &mut settings.wireframe);
    set("cameras", &mut settings.cameras);
    set("thumbnails", &mut settings.thumbnails);
    set("samples", &mut settings.samples);
    set("lights", &mut settings.lights);
    set("lobes", &mut settings.lobes);
    set("grid", &mut settings.grid);
    let number = |key: &str, target: &mut f32, low: f32, high: f32| {
        if let Some(stored) = value.get(key).and_then(Value::as_f64) {
            *target = (stored as f32).clamp(low, high);
        }
    };
    number("exposure_ev", &mut settings.exposure_ev, -20.0, 20.0);
    number("look_through_opacity", &mut settings.look_through_opacity, 0.0, 1.0);
    choose(value, "shading", &SHADINGS, &mut settings.shading);
    choose(value, "sample_color", &COLORS, &mut settings.sample_color);
    choose(value, "tone_mapping", &TONES, &mut settings.tone_mapping);
    // Projects saved before say the name of the curve that this one has replaced.
    let former = [(ToneMapping::Neutral, "filmic")];
    choose(value, "tone_mapping", &former, &mut settings.tone_mapping);
}

/// The free view, where a whole one was kept.
pub fn camera(value: &Value) -> Option<ViewCamera> {
    let stored = value.get("camera")?;
    let number = |value: &Value| value.as_f64().map(|v| v as f32).filter(|v| v.is_finite());
    let target: Vec<f32> = stored.get("target")?.as_array()?.iter().filter_map(number).collect();
    Some(ViewCamera {
        target: <[f32; 3]>::try_from(target).ok()?.into(),
        distance: number(stored.get("distance")?).filter(|distance| *distance > 0.0)?,
        azimuth: number(stored.get("azimuth")?)?,
        elevation: number(stored.get("elevation")?)?,
        orthographic: stored.get("orthographic")?.as_bool()?,
    })
}

fn word<T: PartialEq>(words: &[(T, &'static str)], value: T) -> &'static str {
    words.iter().find(|(known, _)| *known == value).map_or("", |(_, word)| word)
}

fn choose<T: Copy>(value: &Value, key: &str, words: &[(T, &str)], target: &mut T) {
    let stored = value.get(key).and_then(Value::as_str);
    if let Some((known, _)) = words.iter().find(|(_, word)| Some(*word) == stored) {
        *target = *known;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_come_back_and_nonsense_is_passed_over() {
        let settings = ViewSettings {
            shading: Shading::Plain,
            sample_color: SampleColor::Views,
            grid: false,
            thumbnails: false,
            exposure_ev: -1.5,
            ..Default::default()
        };
        let camera = ViewCamera { distance: 2.5, orthographic: true, ..Default::default() };
        let kept = value(&settings, &camera);
        let mut other = ViewSettings::default();
        apply(&kept, &mut other);
        assert!(other == settings && super::camera(&kept) == Some(camera));
        let mut former = kept.clone();
        former["tone_mapping"] = json!("filmic");
        apply(&former, &mut other);
        assert_eq!(other.tone_mapping, ToneMapping::Neutral);
        apply(&kept, &mut other);
        let nonsense = json!({
            "grid": 3, "shading": "chrome", "exposure_ev": null,
            "camera": {"target": [0.0, 1.0], "distance": 1.0, "azimuth": 0.0, "elevation": 0.0},
        });
        apply(&nonsense, &mut other);
        assert!(other == settings && super::camera(&nonsense).is_none());
    }
}
