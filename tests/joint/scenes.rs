//! Two-metre corners of three planes, patches of materials on them, lobes of lights around, and
//! interreflected light that is strongest beside the other planes.

use faer::Mat;
use glam::DVec3;
use lobelia::math::sampling::Random;
use lobelia::reconstruct::joint::system::{
    Anchor, Channel, Design, Fit, Objective, Pair, Rows, State, Terms,
};
use lobelia::watch::Watch;

pub struct Recipe {
    pub seed: u64,
    pub rows: usize,
    pub lights: usize,
    pub lobes_per_light: usize,
    /// ρ per material; material m is a strip of plane m % 3.
    pub reflectance: Vec<f64>,
    /// The part of all light that is I_s.
    pub base: f64,
}

impl Default for Recipe {
    fn default() -> Self {
        Self {
            seed: 1,
            rows: 300,
            lights: 10,
            lobes_per_light: 3,
            reflectance: vec![0.7, 0.2, 0.5, 0.3, 0.6, 0.4],
            base: 0.25,
        }
    }
}

pub struct Scene {
    pub design: Design,
    pub material: Vec<usize>,
    /// Neighbouring rows of one material have the same block.
    pub block: Vec<usize>,
    pub reflectance: Vec<f64>,
    /// πL without noise.
    pub exact: Vec<f64>,
}

/// Cells along each side of a material's patch.
const CELLS: usize = 4;

impl Recipe {
    pub fn make(&self) -> Scene {
        let mut random = Random::new(self.seed, 1, 0);
        let materials = self.reflectance.len();
        let strips = materials.div_ceil(3);
        let material: Vec<usize> = (0..self.rows).map(|row| row % materials).collect();
        let mut block = Vec::new();
        let samples: Vec<(DVec3, DVec3)> = material
            .iter()
            .map(|&m| {
                let (u, v) = (uniform(&mut random), uniform(&mut random));
                let cell = |t: f64| (t * CELLS as f64) as usize;
                block.push((m * CELLS + cell(u)) * CELLS + cell(v));
                let (u, v) = (2.0 * (u + (m / 3) as f64) / strips as f64, 2.0 * v);
                match m % 3 {
                    0 => (DVec3::new(0.0, u, v), DVec3::X),
                    1 => (DVec3::new(u, 0.0, v), DVec3::Y),
                    _ => (DVec3::new(u, v, 0.0), DVec3::Z),
                }
            })
            .collect();
        let mut columns = Vec::new();
        for _ in 0..self.lights {
            let towards = DVec3::from_array(std::array::from_fn(|_| normal(&mut random).abs()));
            let light = DVec3::ONE + 2.5 * towards.normalize_or_zero();
            for _ in 0..self.lobes_per_light {
                let aim = 2.0 * DVec3::from_array(std::array::from_fn(|_| uniform(&mut random)));
                let axis = (aim - light).normalize_or_zero();
                let column: Vec<f64> = samples
                    .iter()
                    .map(|&(position, up)| {
                        let view = (position - light).normalize_or_zero();
                        let falloff = position.distance_squared(light).recip();
                        view.dot(axis).max(0.0).powi(12) * (-view.dot(up)).max(0.0) * falloff
                    })
                    .collect();
                columns.push(column);
            }
        }
        // In the precision of a design, so that the answer is exact.
        let diffuse = Mat::from_fn(self.rows, columns.len(), |i, j| columns[j][i] as f32);
        let mut base: Vec<f64> = samples
            .iter()
            .map(|&(position, up)| {
                let near = |axis: usize| (1.0 - up[axis]) * (-2.0 * position[axis]).exp();
                0.3 + (0..3).map(near).sum::<f64>()
            })
            .collect();
        let mut emission: Vec<f64> = columns
            .iter()
            .map(|_| {
                let strength = -(1.0 - uniform(&mut random)).ln();
                if uniform(&mut random) < 0.3 { strength } else { 0.0 }
            })
            .collect();
        let direct = product(&diffuse, &emission);
        let (mean_direct, mean_base) = (mean(&direct), mean(&base));
        emission.iter_mut().for_each(|e| *e *= (1.0 - self.base) / mean_direct);
        base.iter_mut().for_each(|b| *b *= self.base / mean_base);
        let light = product(&diffuse, &emission);
        let exact =
            (0..self.rows).map(|i| self.reflectance[material[i]] * (base[i] + light[i])).collect();
        let design = Design {
            diffuse: diffuse.into(),
            base: [base, Vec::new(), Vec::new()],
            specular: Mat::zeros(0, columns.len()).into(),
            specular_base: Default::default(),
            patches: Default::default(),
        };
        let reflectance = self.reflectance.clone();
        Scene { design, material, block, reflectance, exact }
    }
}

impl Scene {
    /// What a camera sees whose log radiances are off by `errors`.
    pub fn seen(&self, errors: &[f64]) -> Rows {
        let count = self.exact.len();
        let log = self.exact.iter().zip(errors).map(|(exact, error)| exact.ln() + error).collect();
        Rows {
            sample: (0..count).collect(),
            material: self.material.clone(),
            glossy: vec![None; count],
            log_radiance: [log, Vec::new(), Vec::new()],
            materials: self.reflectance.len(),
        }
    }

    /// Normal errors of one standard deviation.
    pub fn noise(&self, seed: u64, sd: f64) -> Vec<f64> {
        let mut random = Random::new(seed, 2, 0);
        self.exact.iter().map(|_| sd * normal(&mut random)).collect()
    }

    /// Grey everywhere, every lobe dark.
    pub fn start(&self, reflectance: f64) -> State {
        let materials = self.reflectance.len();
        State {
            emission: vec![0.0; self.design.columns()],
            log_diffuse: vec![reflectance.ln(); materials],
            specular: vec![0.0; materials],
        }
    }

    pub fn held(&self, objective: Objective) -> Held {
        let (columns, materials) = (self.design.columns(), self.reflectance.len());
        Held {
            objective,
            weights: vec![1.0; self.exact.len()],
            ridge: vec![0.0; columns],
            centre: vec![0.0; columns],
            relative_ridge: false,
            reference: vec![0.5f64.ln(); materials],
            known: vec![None; materials],
            known_specular: vec![None; materials],
            upper: vec![0.0; materials],
            anchors: Vec::new(),
            pairs: Vec::new(),
            robust: vec![f64::INFINITY; materials],
        }
    }

    pub fn channel<'a>(&'a self, rows: &'a Rows) -> Channel<'a> {
        Channel { rows, design: &self.design, channel: 0 }
    }

    pub fn fit(&self, rows: &Rows, held: &Held, start: &State) -> Fit {
        self.channel(rows).fit(&held.terms(), start, &Watch::new()).expect("all is finite")
    }
}

/// [`Terms`] that owns its parts.
#[derive(Clone, Debug)]
pub struct Held {
    pub objective: Objective,
    pub weights: Vec<f64>,
    pub ridge: Vec<f64>,
    pub centre: Vec<f64>,
    pub relative_ridge: bool,
    pub reference: Vec<f64>,
    pub known: Vec<Option<f64>>,
    pub known_specular: Vec<Option<f64>>,
    pub upper: Vec<f64>,
    pub anchors: Vec<Anchor>,
    pub pairs: Vec<Pair>,
    pub robust: Vec<f64>,
}

impl Held {
    pub fn terms(&self) -> Terms<'_> {
        Terms {
            objective: self.objective,
            weights: &self.weights,
            ridge: &self.ridge,
            centre: &self.centre,
            relative_ridge: self.relative_ridge,
            pairs: &self.pairs,
            reference: &self.reference,
            known: &self.known,
            known_specular: &self.known_specular,
            upper: &self.upper,
            anchors: &self.anchors,
            robust: &self.robust,
            fall: 1e-12,
            ..Terms::default()
        }
    }
}

pub fn reflectances(state: &State) -> Vec<f64> {
    state.log_diffuse.iter().map(|u| u.exp()).collect()
}

pub fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

pub fn mean_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f64>() / a.len() as f64
}

pub fn product(matrix: &Mat<f32>, x: &[f64]) -> Vec<f64> {
    let row = |i: usize| x.iter().enumerate().map(|(j, x)| f64::from(matrix[(i, j)]) * x).sum();
    (0..matrix.nrows()).map(row).collect()
}

pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The mean of independent values in units of its own standard error: beyond ±3 it is not 0.
pub fn z_score(values: &[f64]) -> f64 {
    let (mean, count) = (mean(values), values.len() as f64);
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (count - 1.0);
    mean / (variance / count).sqrt()
}

pub fn uniform(random: &mut Random) -> f64 {
    f64::from(random.uniform())
}

/// A standard normal number (Box and Muller 1958).
pub fn normal(random: &mut Random) -> f64 {
    let (u, v) = (uniform(random), uniform(random));
    (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}
