//! `run.bin`: samples, lights, transport and solution of a run, bit for bit.

use std::path::Path;
use std::sync::Arc;

use faer::Mat;

use crate::io::binary::{Binary, by_fields, checksum};
use crate::io::{Error, Fault};
use crate::reconstruct::equations::Equations;
use crate::reconstruct::gain::Gain;
use crate::reconstruct::hemisphere::Record;
use crate::reconstruct::lights::{LightKind, VirtualLight, VirtualLights};
use crate::reconstruct::lobes::{Lobe, Lobes};
use crate::reconstruct::samples::{Sample, SampleCloud, View};
use crate::reconstruct::solution::{
    Certainty, Iteration, MaterialCertainty, Rms, ScaleCertainty, Selection, Solution, Stopped,
    Trial, TrialPart,
};
use crate::reconstruct::transport::{PatchRadiosity, Transport};
use crate::reconstruct::{Options, Reconstruction};
use crate::scene::{Brdf, Capture, MaterialKind, Optics};

/// Changes with every field that is added below.
const HEAD: &[u8; 16] = b"lobelia run 0003";

by_fields! {
    SampleCloud { spacing_m, samples, views, relative_area, warnings }
    Sample { position, normal, material, surface, views, radiance }
    View { photograph, pixel, direction, radiance }
    VirtualLights { lights, spacing_m, sphere_center, sphere_radius_m }
    VirtualLight { kind, position, normal, radius_m, half_angle }
    Lobes { lobes, first }
    Lobe { light, direction, exponent }
    Record { direction, irradiance }
    Brdf { diffuse, specular, exponent, coat }
    Solution {
        reflectances, optics, emission, iterations, stopped, computed, certainty, notes, warnings,
    }
    Iteration { index, rms, objective, change, elapsed_secs }
    Rms { absolute, relative }
    Certainty { materials, scale, held_out, light_sets, selection }
    MaterialCertainty { diffuse, specular, exponent, roughness, identified }
    ScaleCertainty { singular_value, log_rms, log_sd }
    Selection { candidates, kept, trials }
    Trial { part, before, after, change, standard_error, supported }
    Gain { photograph, gain, log_sd, samples }
}

impl Binary for LightKind {
    fn put(&self, out: &mut Vec<u8>) {
        let (kind, index) = match *self {
            Self::Sphere => (0u8, 0),
            Self::Surface => (1, 0),
            Self::Lamp => (2, 0),
            Self::Sky => (3, 0),
            Self::Sun => (4, 0),
            Self::Known(index) => (5, index),
        };
        kind.put(out);
        index.put(out);
    }

    fn take(from: &mut &[u8]) -> Option<Self> {
        Some(match (u8::take(from)?, usize::take(from)?) {
            (0, _) => Self::Sphere,
            (1, _) => Self::Surface,
            (2, _) => Self::Lamp,
            (3, _) => Self::Sky,
            (4, _) => Self::Sun,
            (5, index) => Self::Known(index),
            _ => return None,
        })
    }
}

const STOPPED: [Stopped; 5] = [
    Stopped::RmsConverged,
    Stopped::RmsRose,
    Stopped::IterationLimit,
    Stopped::GradientConverged,
    Stopped::NothingToSolve,
];

impl Binary for Stopped {
    fn put(&self, out: &mut Vec<u8>) {
        STOPPED.iter().position(|own| own == self).unwrap_or_default().put(out);
    }

    fn take(from: &mut &[u8]) -> Option<Self> {
        STOPPED.get(usize::take(from)?).copied()
    }
}

impl Binary for Optics {
    fn put(&self, out: &mut Vec<u8>) {
        let (optics, reflected) = match *self {
            Self::Opaque => (0u8, [0.0; 3]),
            Self::Mirror(reflected) => (1, reflected),
            Self::Glass => (2, [0.0; 3]),
        };
        optics.put(out);
        reflected.put(out);
    }

    fn take(from: &mut &[u8]) -> Option<Self> {
        Some(match (u8::take(from)?, Binary::take(from)?) {
            (0, _) => Self::Opaque,
            (1, reflected) => Self::Mirror(reflected),
            (2, _) => Self::Glass,
            _ => return None,
        })
    }
}

impl Binary for TrialPart {
    fn put(&self, out: &mut Vec<u8>) {
        let (part, number) = match *self {
            Self::Sun => (0u8, 0),
            Self::SeenSky(cells) => (1, cells),
            Self::Room => (2, 0),
            Self::Lamp(number) => (3, number),
            Self::Gloss(material) => (4, material),
            Self::Lobe(material) => (5, material),
            Self::Background(lobes) => (6, lobes),
            Self::FineLobes => (7, 0),
            Self::Beside(lobes) => (8, lobes),
        };
        part.put(out);
        number.put(out);
    }

    fn take(from: &mut &[u8]) -> Option<Self> {
        Some(match (u8::take(from)?, usize::take(from)?) {
            (0, _) => Self::Sun,
            (1, cells) => Self::SeenSky(cells),
            (2, _) => Self::Room,
            (3, number) => Self::Lamp(number),
            (4, material) => Self::Gloss(material),
            (5, material) => Self::Lobe(material),
            (6, lobes) => Self::Background(lobes),
            (7, _) => Self::FineLobes,
            (8, lobes) => Self::Beside(lobes),
            _ => return None,
        })
    }
}

impl Binary for Mat<f64> {
    fn put(&self, out: &mut Vec<u8>) {
        [self.nrows(), self.ncols()].put(out);
        for column in self.col_iter() {
            column.iter().for_each(|value| value.put(out));
        }
    }

    fn take(from: &mut &[u8]) -> Option<Self> {
        let [rows, columns]: [usize; 2] = Binary::take(from)?;
        let length = rows.checked_mul(columns)?.checked_mul(size_of::<f64>())?;
        let (bytes, rest) = from.split_at_checked(length)?;
        *from = rest;
        let value = |row: usize, column: usize| {
            let at = size_of::<f64>() * (column * rows + row);
            let number: [u8; 8] = bytes[at..at + 8].try_into().unwrap_or_default();
            f64::from_le_bytes(number)
        };
        Some(Self::from_fn(rows, columns, value))
    }
}

/// A number for what the indices of a run refer to.
fn fingerprint(capture: &Capture) -> u64 {
    let mut bytes = Vec::new();
    capture.mesh.positions.put(&mut bytes);
    capture.mesh.triangles.put(&mut bytes);
    capture.mesh.surface.put(&mut bytes);
    for surface in &capture.surfaces {
        surface.name.put(&mut bytes);
    }
    for material in &capture.materials {
        material.name.put(&mut bytes);
        (material.kind == MaterialKind::Specular).put(&mut bytes);
        material.surfaces.put(&mut bytes);
    }
    for photograph in &capture.photographs {
        photograph.name.put(&mut bytes);
        [photograph.camera.width, photograph.camera.height].put(&mut bytes);
    }
    for light in &capture.lights {
        light.name().to_owned().put(&mut bytes);
    }
    checksum(&bytes)
}

/// What the file holds: a head, a checksum of what follows, and the run.
pub fn bytes(capture: &Capture, run: &Reconstruction) -> Vec<u8> {
    let mut out = Vec::new();
    fingerprint(capture).put(&mut out);
    run.samples.put(&mut out);
    run.lights.put(&mut out);
    run.lobes.put(&mut out);
    let transport = &run.transport;
    transport.irradiance.put(&mut out);
    transport.records.put(&mut out);
    transport.first_record.put(&mut out);
    transport.coupling.put(&mut out);
    run.solution.put(&mut out);
    run.gains.put(&mut out);
    run.seconds.put(&mut out);
    run.kept.put(&mut out);
    run.warnings.put(&mut out);
    let mut whole = HEAD.to_vec();
    checksum(&out).put(&mut whole);
    whole.append(&mut out);
    whole
}

/// Reads it back, without textures.
pub fn parse(
    file: &Path,
    bytes: &[u8],
    capture: &Capture,
    options: &Options,
) -> Result<Reconstruction, Error> {
    let again = "Run again, and save the project";
    let wrong = |what: &str| Err(Error::Invalid(Fault::new(file, "", what, again)));
    let Some(mut from) = bytes.strip_prefix(HEAD) else {
        let what = "this is no run, or one of another version of lobelia";
        return Err(Error::Unsupported(Fault::new(file, "", what, again)));
    };
    let sum = u64::take(&mut from);
    if sum != Some(checksum(from)) {
        return wrong("the file is cut off or damaged");
    }
    if u64::take(&mut from) != Some(fingerprint(capture)) {
        return wrong(
            "these results are of another state of the capture's geometry or photographs",
        );
    }
    match take(&mut from, capture, options) {
        Some(run) if from.is_empty() => Ok(run),
        _ => wrong("the file says what cannot be"),
    }
}

fn take(from: &mut &[u8], capture: &Capture, options: &Options) -> Option<Reconstruction> {
    let samples: Arc<SampleCloud> = Binary::take(from)?;
    let lights: Arc<VirtualLights> = Binary::take(from)?;
    let lobes: Arc<Lobes> = Binary::take(from)?;
    let transport = Transport {
        irradiance: Binary::take(from)?,
        records: Binary::take(from)?,
        first_record: Binary::take(from)?,
        coupling: Binary::take(from)?,
        // What only the solve needs.
        unphotographed: Arc::default(),
        first_unphotographed: vec![0; samples.samples.len() + 1],
        patch_radiosity: PatchRadiosity::default(),
        bright: Arc::default(),
    };
    let solution: Arc<Solution> = Binary::take(from)?;
    is_sound(capture, &samples, &lights, &lobes, &transport, &solution).then_some(())?;
    let most = options.gloss.views_per_sample;
    let equations = Equations::new(capture, &samples, &lights, &transport, most);
    let run = Reconstruction {
        samples,
        lights,
        lobes,
        transport: Arc::new(transport),
        solution,
        textures: Arc::default(),
        gains: Binary::take(from)?,
        seconds: Binary::take(from)?,
        kept: Binary::take(from)?,
        warnings: Binary::take(from)?,
        equations: Arc::new(equations),
    };
    let is_known = |gain: &Gain| gain.photograph < capture.photographs.len();
    let is_whole = run.equations.rows.len() == run.solution.computed.len();
    (is_whole && run.gains.iter().all(is_known)).then_some(run)
}

/// Whether every index refers to something.
fn is_sound(
    capture: &Capture,
    cloud: &SampleCloud,
    lights: &VirtualLights,
    lobes: &Lobes,
    transport: &Transport,
    solution: &Solution,
) -> bool {
    let is_rising = |first: &[usize], count: usize, end: usize| {
        first.len() == count + 1 && first.is_sorted() && first.last() == Some(&end)
    };
    let samples = cloud.samples.len();
    cloud.samples.iter().all(|sample| {
        sample.material < capture.materials.len()
            && sample.surface < capture.surfaces.len()
            && sample.views.start <= sample.views.end
            && sample.views.end <= cloud.views.len()
    }) && cloud.views.iter().all(|view| view.photograph < capture.photographs.len())
        && lights.lights.iter().all(
            |light| !matches!(light.kind, LightKind::Known(own) if own >= capture.lights.len()),
        )
        && is_rising(&lobes.first, lights.lights.len(), lobes.lobes.len())
        && lobes.lobes.iter().all(|lobe| lobe.light < lights.lights.len())
        && transport.irradiance.len() == samples
        && is_rising(&transport.first_record, samples, transport.records.len())
        && transport.coupling.nrows() == samples
        && transport.coupling.ncols() == lobes.lobes.len()
        && solution.reflectances.len() == capture.materials.len()
        && solution.emission.len() == lobes.lobes.len()
}
