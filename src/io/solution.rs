//! `solution.json` and `lights.json`: the results of a reconstruction.
//!
//! A field whose value the method does not compute is `null`. Unknown fields are
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
    /// `lobelia-solution`.
    pub format: String,
    /// Version of the format.
    pub version: u64,
    /// Method of the solve: `joint` or `paper`.
    pub method: String,
    /// The reflectances, one object for each material.
    pub materials: Vec<Material>,
    /// Size of the problem.
    pub scene: Scene,
    /// Errors of the fit.
    pub rms: Rms,
    /// Model of the light; `null` in files of older versions.
    #[serde(default)]
    pub light_model: Option<LightModel>,
    /// Certainty of the common scale of all reflectances; `null` for the method `paper`.
    #[serde(default)]
    pub scale: Option<Scale>,
    /// Which parts of a light model were tried; left out by the method `paper`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub selection: Option<Selection>,
    /// Exposures of the photographs that share diffuse samples; empty where they were not looked
    /// for, and in files of older versions.
    #[serde(default)]
    pub photographs: Vec<Photograph>,
    /// Iterations of the solve.
    pub iterations: usize,
    /// Why the solve stopped.
    pub stopped: String,
    /// Elapsed time of each stage.
    pub seconds: Seconds,
    /// Stages whose results were reused from an earlier run of the studio, so that this run spent
    /// no time in them; left out if there are none, and always by the terminal.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub kept_stages: Vec<String>,
    /// Warnings of the run.
    #[serde(default)]
    pub warnings: Vec<String>,
}

/// A material and its estimated reflectance.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// Name of the tag.
    pub name: String,
    /// Tag: `diffuse` or `specular`.
    pub kind: String,
    /// Names of its surfaces.
    pub surfaces: Vec<String>,
    /// Diffuse reflectance, 0 to 1; for a textured material the mean of its texture.
    pub diffuse: Option<Rgb>,
    /// 95 % interval of `diffuse`, lower and upper end.
    pub diffuse_interval: Option<Intervals>,
    /// Specular reflectance ρ_s of the modified Phong model, or the reflectance of a mirror.
    pub specular: Option<Rgb>,
    /// 95 % interval of `specular`.
    pub specular_interval: Option<Intervals>,
    /// Exponent n of the modified Phong model.
    pub exponent: Option<f64>,
    /// Smallest and largest exponent that fit about as well.
    pub exponent_interval: Option<[f64; 2]>,
    /// Model of the specular reflection: `phong` (modified Phong model), `coated` (dielectric
    /// coat), `mirror`, or `glass` (clear glass); `null` if no gloss was found.
    #[serde(default)]
    pub model: Option<String>,
    /// GGX roughness α of a coat.
    #[serde(default)]
    pub roughness: Option<f64>,
    /// Smallest and largest roughness that fit about as well.
    #[serde(default)]
    pub roughness_interval: Option<[f64; 2]>,
    /// For each channel, whether the photographs determine `diffuse`.
    pub identified: Option<[bool; CHANNELS]>,
    /// Number of samples; 0 if no photograph shows the material, or too few pixels of it: its
    /// reflectance is then found after the solve, and is not identified.
    pub samples: usize,
}

/// The exposure of a photograph relative to the median one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Photograph {
    /// Its `file_path`.
    pub name: String,
    /// Factor by which its pixels are too bright.
    pub gain: f64,
    /// Standard deviation of the gain's logarithm.
    pub gain_log_sd: f64,
    /// Whether the gain was divided out.
    pub applied: bool,
    /// Diffuse samples that it shares with other photographs.
    pub samples: usize,
}

/// Size of the problem.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Scene {
    /// Triangles of the mesh.
    pub triangles: usize,
    /// Surfaces of the mesh.
    pub surfaces: usize,
    /// Photographs that measure radiance.
    pub images: usize,
    /// Samples on the surfaces.
    pub samples: usize,
    /// Virtual lights of the result.
    pub virtual_lights: usize,
    /// Lobes of these lights.
    pub candidate_lobes: usize,
    /// Lobes with an emission above 0 in some channel.
    pub active_lobes: usize,
}

/// Root mean square differences between measured and computed radiance, for each channel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Rms {
    /// At the first iteration, in the photographs' unit.
    pub initial: Option<Rgb>,
    /// At the last iteration, in the photographs' unit.
    #[serde(rename = "final")]
    pub final_: Option<Rgb>,
    /// At the last iteration, relative to the measured radiance.
    pub relative_final: Option<Rgb>,
    /// Root mean square of log(computed/measured) at held-out samples.
    pub held_out: Option<Rgb>,
}

/// Model of the light.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct LightModel {
    /// `room` or `open`; `null` without any virtual light.
    pub world: Option<String>,
    /// Light sets over which the result was averaged; with 1 there are no intervals.
    pub light_sets: usize,
    /// Lamps that were found.
    pub lamps: usize,
    /// Whether a sun was found.
    pub sun: bool,
    /// Decisions of the run, one sentence each.
    pub notes: Vec<String>,
}

/// How well the common scale of all reflectances is known, for each channel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Scale {
    /// Smallest singular value of the Jacobian by the logarithms of the reflectances, with the
    /// light projected out; 0 if the photographs do not determine the scale.
    pub singular_value: Rgb,
    /// Root mean square of log(computed/measured) of the fit.
    pub log_rms: Rgb,
    /// Standard deviation of the logarithm of the scale.
    pub log_sd: Rgb,
}

/// Parts of the light model that were tried.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Selection {
    /// Lobes that were tried.
    pub candidates: usize,
    /// Lobes with an emission above 0 in the result.
    pub kept: usize,
    /// Comparisons, in the order in which they were made.
    pub trials: Vec<Trial>,
}

/// A part of the light model, and the error at held-out blocks of samples without it and with it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Trial {
    /// `lamp`, `sun`, `photographed sky`, `room` (rather than an open sky), `lobe` (a Phong lobe
    /// rather than a coat), `gloss`, `background` (with all of its lights rather than fewer),
    /// `fine lobes` in place of lamps, or `fine lobes beside` the other lights.
    pub part: String,
    /// Number of the lamp, from 1; for a background and for fine lobes beside others the number of
    /// lobes; for a photographed sky the number of cells.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub number: Option<usize>,
    /// Material of a `lobe` or `gloss`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
    /// Error without the part: root of the mean loss, about the RMS of log(computed/measured).
    pub error_before: f64,
    /// Error with the part.
    pub error_after: f64,
    /// `error_after` / `error_before` − 1.
    pub change: f64,
    /// Standard error of `change`; `null` if there are fewer than two blocks.
    pub standard_error: Option<f64>,
    /// Whether the error fell by more than its standard error.
    pub supported: bool,
}

/// Elapsed time of each stage in seconds; 0 for those in `kept_stages`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Seconds {
    /// Reading the capture.
    pub load: f64,
    /// Placing samples.
    pub samples: f64,
    /// Placing virtual lights.
    pub lights: f64,
    /// Light transport to the samples.
    pub transport: f64,
    /// Solving for reflectances and light.
    pub solve: f64,
    /// Reconstructing textures.
    pub textures: f64,
    /// All stages together.
    pub total: f64,
}

/// `lights.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lights {
    /// `lobelia-lights`.
    pub format: String,
    /// Version of the format.
    pub version: u64,
    /// The virtual lights.
    pub lights: Vec<Light>,
}

/// A virtual light.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Light {
    /// `sphere`, `surface`, `lamp`, `sky`, `sun` or `known`.
    pub kind: String,
    /// Name of a known light in `tags.json`.
    pub name: Option<String>,
    /// Centre of a disc or a lamp, in metres.
    pub position: Option<[f64; 3]>,
    /// Unit direction in which the light of a sky cell or a sun travels.
    pub direction: Option<[f64; 3]>,
    /// Unit normal of a disc.
    pub normal: Option<[f64; 3]>,
    /// Area of a disc.
    pub area_m2: Option<f64>,
    /// Radius of a disc or a lamp.
    pub radius_m: Option<f64>,
    /// Solid angle of a sky cell.
    pub solid_angle_sr: Option<f64>,
    /// Directional distribution of its emission.
    pub lobes: Vec<Lobe>,
}

/// A lobe of a light: `emission` × (ω · `direction`)^`exponent` in direction ω.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Lobe {
    /// Unit axis of the lobe.
    pub direction: [f64; 3],
    /// Exponent of the cosine; 0 emits equally in all directions.
    pub exponent: f64,
    /// Radiance in the photographs' unit; for a sun the irradiance of a surface that faces it, for
    /// a known light its radiance, intensity or irradiance as in `tags.json`.
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
