//! `solution.json` and `lights.json`: what a reconstruction gives back.
//!
//! A field that the method cannot give is `null`, never a made-up number. Unknown fields are
//! ignored; another format or version is refused by name.

use std::path::Path;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::{Error, Fault, atomic, json};
use crate::math::rgb::{CHANNELS, Rgb};

/// Lower and upper end of a 95 % interval, for each channel that has one.
pub type Intervals = [Option<[f64; 2]>; CHANNELS];

const SOLUTION: &str = "lobelia-solution";
const LIGHTS: &str = "lobelia-lights";
const VERSION: u64 = 1;

/// `solution.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Solution {
    pub format: String,
    pub version: u64,
    pub method: String,
    pub materials: Vec<Material>,
    pub scene: Scene,
    pub rms: Rms,
    /// What was assumed of the light and found of it; `null` in files of older versions.
    #[serde(default)]
    pub light_model: Option<LightModel>,
    /// `null` where the method does not say.
    #[serde(default)]
    pub scale: Option<Scale>,
    /// Which parts of a light model were tried; left out where the method tries none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub selection: Option<Selection>,
    /// Exposures of the photographs that share diffuse samples; empty where they were not looked
    /// for, and in files of older versions.
    #[serde(default)]
    pub photographs: Vec<Photograph>,
    pub iterations: usize,
    /// Why the refinement stopped.
    pub stopped: String,
    pub seconds: Seconds,
    /// The stages that were taken over from an earlier run of the studio, so that this one spent
    /// no seconds in them; left out where there are none, and always by the terminal.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub kept_stages: Vec<String>,
    #[serde(default)]
    pub warnings: Vec<String>,
}

/// An estimated reflectance.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Material {
    pub name: String,
    /// `diffuse` or `specular`.
    pub kind: String,
    pub surfaces: Vec<String>,
    pub diffuse: Option<Rgb>,
    pub diffuse_interval: Option<Intervals>,
    pub specular: Option<Rgb>,
    pub specular_interval: Option<Intervals>,
    pub exponent: Option<f64>,
    pub exponent_interval: Option<[f64; 2]>,
    /// How a specular material was found to shine: `phong` by a lobe of its own strength, `coated` by
    /// a dielectric coat, as a `mirror` that reflects the part `specular`, or it is clear `glass`;
    /// `None` of a diffuse one.
    #[serde(default)]
    pub model: Option<String>,
    /// GGX roughness α of a coat.
    #[serde(default)]
    pub roughness: Option<f64>,
    #[serde(default)]
    pub roughness_interval: Option<[f64; 2]>,
    /// For each channel, whether the photographs determine the value.
    pub identified: Option<[bool; CHANNELS]>,
    /// 0 where no photograph sees the material.
    pub samples: usize,
}

/// The exposure of a photograph relative to the median one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Photograph {
    pub name: String,
    /// Its pixels are this many times as bright as they should be.
    pub gain: f64,
    /// Standard deviation of the gain's logarithm.
    pub gain_log_sd: f64,
    /// Whether the gain was divided out.
    pub applied: bool,
    /// Diffuse samples that it shares with other photographs.
    pub samples: usize,
}

/// How large the problem was.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Scene {
    pub triangles: usize,
    pub surfaces: usize,
    pub images: usize,
    pub samples: usize,
    pub virtual_lights: usize,
    pub candidate_lobes: usize,
    pub active_lobes: usize,
}

/// Root mean square differences of observed and computed radiance, for each channel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Rms {
    pub initial: Option<Rgb>,
    #[serde(rename = "final")]
    pub final_: Option<Rgb>,
    pub relative_final: Option<Rgb>,
    /// Of the logarithms, in samples that were held out.
    pub held_out: Option<Rgb>,
}

/// How the light was described.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct LightModel {
    /// `room` or `open`; `null` without any virtual light.
    pub world: Option<String>,
    /// Sets of lights over which the result was averaged.
    pub light_sets: usize,
    /// Lamps and a sun that were found to shine.
    pub lamps: usize,
    pub sun: bool,
    /// What was decided on the way, a sentence each.
    pub notes: Vec<String>,
}

/// How well the common scale of all reflectances is known, for each channel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Scale {
    /// Smallest singular value of the reflectances' logarithms, the light projected out.
    pub singular_value: Rgb,
    /// Root mean square of log(computed/measured).
    pub log_rms: Rgb,
    /// Standard deviation of the logarithm of the scale.
    pub log_sd: Rgb,
}

/// How the light model was chosen.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Selection {
    /// Lobes that were tried.
    pub candidates: usize,
    /// Lobes that shine in the result.
    pub kept: usize,
    /// In the order in which they were made.
    pub trials: Vec<Trial>,
}

/// A part that could be added, and the error of held-out blocks of samples without it and with it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Trial {
    /// `lamp`, `sun`, `room` (rather than an open sky), `gloss`, `background` (twice its lights), `fine lobes` in place of the others,
    /// or `fine lobes beside` them.
    pub part: String,
    /// Of a lamp its number, from 1; of a background and of fine lobes beside others the lobes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub number: Option<usize>,
    /// Of gloss the material.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
    pub error_before: f64,
    pub error_after: f64,
    /// `error_after` / `error_before` − 1.
    pub change: f64,
    /// Of the change; `null` where there are too few blocks to tell.
    pub standard_error: Option<f64>,
    /// Whether the error fell by more than that, so that the part was kept.
    pub supported: bool,
}

/// Time that the run spent in each stage: 0 in those of `kept_stages`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Seconds {
    pub load: f64,
    pub samples: f64,
    pub lights: f64,
    pub transport: f64,
    pub solve: f64,
    pub textures: f64,
    pub total: f64,
}

/// `lights.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lights {
    pub format: String,
    pub version: u64,
    pub lights: Vec<Light>,
}

/// A virtual light.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Light {
    /// `sphere`, `surface`, `lamp`, `sky`, `sun` or `known`.
    pub kind: String,
    /// Of a known light: what the artist calls it.
    pub name: Option<String>,
    pub position: Option<[f64; 3]>,
    /// Of a light at infinity: the way its light travels.
    pub direction: Option<[f64; 3]>,
    pub normal: Option<[f64; 3]>,
    pub area_m2: Option<f64>,
    pub radius_m: Option<f64>,
    /// Of a part of the sky.
    pub solid_angle_sr: Option<f64>,
    pub lobes: Vec<Lobe>,
}

/// A part of a light's directional emission.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Lobe {
    pub direction: [f64; 3],
    /// 0 is isotropic.
    pub exponent: f64,
    /// Radiance; of a sun the irradiance of a surface that faces it, of a known light what its
    /// strength is called in `tags.json`.
    pub emission: Rgb,
}

impl Solution {
    /// An empty solution of this version, to be filled in.
    pub fn new(method: impl Into<String>) -> Self {
        Self {
            format: SOLUTION.into(),
            version: VERSION,
            method: method.into(),
            materials: Vec::new(),
            scene: Scene::default(),
            rms: Rms::default(),
            light_model: None,
            scale: None,
            selection: None,
            photographs: Vec::new(),
            iterations: 0,
            stopped: String::new(),
            seconds: Seconds::default(),
            kept_stages: Vec::new(),
            warnings: Vec::new(),
        }
    }

    pub fn read(file: &Path) -> Result<Self, Error> {
        read_version(file, SOLUTION)
    }

    pub fn write(&self, file: &Path) -> Result<(), Error> {
        for material in &self.materials {
            let numbers = material.diffuse.iter().chain(&material.specular).flatten();
            let intervals = material.diffuse_interval.iter().chain(&material.specular_interval);
            let exponents =
                material.exponent.iter().chain(material.exponent_interval.iter().flatten());
            let roughnesses =
                material.roughness.iter().chain(material.roughness_interval.iter().flatten());
            let intervals = intervals.flatten().flatten().flatten();
            let numbers = numbers.chain(intervals).chain(exponents).chain(roughnesses);
            check_finite(file, || format!("material \"{}\"", material.name), numbers)?;
        }
        let rms = [self.rms.initial, self.rms.final_, self.rms.relative_final, self.rms.held_out];
        check_finite(file, || "rms".into(), rms.iter().flatten().flatten())?;
        let scale = self.scale.iter().flat_map(|scale| {
            let Scale { singular_value, log_rms, log_sd } = scale;
            singular_value.iter().chain(log_rms).chain(log_sd)
        });
        check_finite(file, || "scale".into(), scale)?;
        let trials = self.selection.iter().flat_map(|selection| &selection.trials);
        let trials = trials.flat_map(|trial| {
            let Trial { error_before, error_after, change, .. } = trial;
            [error_before, error_after, change].into_iter().chain(&trial.standard_error)
        });
        check_finite(file, || "selection".into(), trials)?;
        let Seconds { load, samples, lights, transport, solve, textures, total } = self.seconds;
        let seconds = [load, samples, lights, transport, solve, textures, total];
        check_finite(file, || "seconds".into(), seconds.iter())?;
        write_pretty(file, self)
    }
}

impl Lights {
    pub fn new(lights: Vec<Light>) -> Self {
        Self { format: LIGHTS.into(), version: VERSION, lights }
    }

    pub fn read(file: &Path) -> Result<Self, Error> {
        read_version(file, LIGHTS)
    }

    pub fn write(&self, file: &Path) -> Result<(), Error> {
        for (index, light) in self.lights.iter().enumerate() {
            let places = [light.position, light.direction, light.normal];
            let sizes = light.area_m2.iter().chain(&light.radius_m).chain(&light.solid_angle_sr);
            let lobes = light.lobes.iter().flat_map(|lobe| {
                lobe.direction.iter().chain(&lobe.emission).chain(std::iter::once(&lobe.exponent))
            });
            let numbers = places.iter().flatten().flatten().chain(sizes).chain(lobes);
            check_finite(file, || format!("lights[{index}]"), numbers)?;
        }
        write_pretty(file, self)
    }
}

/// serde_json would write NaN as `null`, which readers take for something else.
fn check_finite<'a>(
    file: &Path,
    place: impl FnOnce() -> String,
    mut numbers: impl Iterator<Item = &'a f64>,
) -> Result<(), Error> {
    if numbers.all(|number| number.is_finite()) {
        return Ok(());
    }
    Err(Error::Invalid(Fault::new(
        file,
        place(),
        "a result is not finite, so nothing is written",
        "This is a fault of the program: please report it with the capture",
    )))
}

/// Indented JSON with a final line break, for whatever wants to be written so.
pub fn write_pretty(file: &Path, value: &impl Serialize) -> Result<(), Error> {
    let mut bytes = serde_json::to_vec_pretty(value)
        .map_err(|failure| Error::Write { file: file.to_owned(), source: failure.into() })?;
    bytes.push(b'\n');
    atomic::write_bytes(file, &bytes)
}

fn read_version<T: DeserializeOwned>(file: &Path, wanted: &str) -> Result<T, Error> {
    #[derive(Deserialize)]
    struct Head {
        format: Option<String>,
        version: Option<serde_json::Value>,
    }
    let text = json::read_text(file)?;
    let head: Head = serde_json::from_str(&text).map_err(|failure| json::broken(file, &failure))?;
    if head.format.as_deref() != Some(wanted) {
        let found = head.format.map_or("no format".into(), |format| format!("\"{format}\""));
        return Err(Error::Unsupported(Fault::new(
            file,
            "format",
            format!("\"{wanted}\" is expected here, and the file says {found}"),
            "Choose the file that lobelia reconstruct wrote",
        )));
    }
    if head.version.as_ref().and_then(serde_json::Value::as_u64) != Some(VERSION) {
        let found = head.version.map_or("none".into(), |version| version.to_string());
        return Err(Error::Unsupported(Fault::new(
            file,
            "version",
            format!("version {found} is not known; this program reads version {VERSION}"),
            "Use a newer lobelia, or reconstruct again with this one",
        )));
    }
    serde_json::from_str(&text).map_err(|failure| json::broken(file, &failure))
}
