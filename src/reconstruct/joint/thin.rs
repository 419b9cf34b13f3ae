//! A part of the samples, on which a model's structure is chosen: which lights, where, which
//! exponents. Neighbouring samples tell much the same about that, so a part of them tells nearly as
//! much in a fraction of the time; reflectances and emissions are found with all.

use faer::Mat;

use crate::reconstruct::equations::Equations;
use crate::reconstruct::joint::fit::Fitter;
use crate::reconstruct::joint::model::{Data, Model};
use crate::reconstruct::lights::VirtualLights;
use crate::reconstruct::samples::SampleCloud;
use crate::reconstruct::transport::{PatchRadiosity, Transport};

/// Samples that are kept, about; of each material as large a part, or at least
/// `samples.min_per_material`.
const KEPT: usize = 1200;

/// The products of the stages before, for some of the samples.
pub struct Thin {
    cloud: SampleCloud,
    transport: Transport,
    equations: Equations,
    /// Their places among all samples, ascending.
    samples: Vec<usize>,
    /// The places of their rows among all rows.
    rows: Vec<usize>,
}

impl Thin {
    pub fn of(fitter: &Fitter) -> Self {
        let data = &fitter.data;
        let samples = spread(
            &data.cloud.samples.iter().map(|sample| sample.material).collect::<Vec<_>>(),
            fitter.rows.materials,
            data.options.samples.min_per_material,
        );
        let mut is_kept = vec![false; data.cloud.samples.len()];
        for &sample in &samples {
            is_kept[sample] = true;
        }
        let rows =
            (0..fitter.rows.sample.len()).filter(|&r| is_kept[fitter.rows.sample[r]]).collect();
        let cloud = SampleCloud {
            samples: samples.iter().map(|&sample| data.cloud.samples[sample].clone()).collect(),
            ..data.cloud.clone()
        };
        let transport = transport_of(data.transport, &samples);
        let views_per_sample = data.options.gloss.views_per_sample;
        let no_lights = VirtualLights::default();
        let capture = data.views.capture;
        let equations = Equations {
            // What is taken to be dark stays the same.
            mean_radiance: data.equations.mean_radiance,
            ..Equations::new(capture, &cloud, &no_lights, &transport, views_per_sample)
        };
        Self { cloud, transport, equations, samples, rows }
    }

    /// What is known to the fitter of all samples, for these; `whole` is the one they are of.
    pub fn fitter<'a>(&'a self, whole: &Fitter<'a>) -> Fitter<'a> {
        let data = Data {
            cloud: &self.cloud,
            transport: &self.transport,
            equations: &self.equations,
            ..whole.data
        };
        let of_samples = |values: &[_]| self.samples.iter().map(|&sample| values[sample]).collect();
        Fitter {
            rows: data.rows(),
            irradiance: of_samples(&whole.irradiance),
            gathered: of_samples(&whole.gathered),
            weights: self.rows.iter().map(|&row| whole.weights[row]).collect(),
            data,
            ..whole.clone()
        }
    }

    /// A model of all samples, for these.
    pub fn model(&self, whole: &Fitter, model: &Model) -> Model {
        let glossy: Vec<usize> =
            self.rows.iter().filter_map(|&row| whole.rows.glossy[row]).collect();
        let columns = model.columns();
        let mut thin = model.clone();
        let design = &model.design;
        thin.design.diffuse =
            Mat::from_fn(self.rows.len(), columns, |i, j| design.diffuse[(self.rows[i], j)]);
        thin.design.specular =
            Mat::from_fn(glossy.len(), columns, |i, j| design.specular[(glossy[i], j)]);
        thin.design.base =
            design.base.each_ref().map(|base| self.rows.iter().map(|&row| base[row]).collect());
        thin.design.specular_base = design
            .specular_base
            .each_ref()
            .map(|base| glossy.iter().map(|&index| base[index]).collect());
        for fixed in &mut thin.fixed {
            fixed.coupling = self.rows.iter().map(|&row| fixed.coupling[row]).collect();
        }
        thin
    }
}

fn transport_of(all: &Transport, samples: &[usize]) -> Transport {
    let (mut records, mut unphotographed) = (Vec::new(), Vec::new());
    let (mut first_record, mut first_unphotographed) = (vec![0], vec![0]);
    for &sample in samples {
        records.extend_from_slice(all.records_of(sample));
        first_record.push(records.len());
        unphotographed.extend_from_slice(all.unphotographed_of(sample));
        first_unphotographed.push(unphotographed.len());
    }
    Transport {
        irradiance: samples.iter().map(|&sample| all.irradiance[sample]).collect(),
        records: records.into(),
        first_record,
        record_weight: all.record_weight,
        coupling: Mat::zeros(samples.len(), 0),
        unphotographed: unphotographed.into(),
        first_unphotographed,
        patch_radiosity: PatchRadiosity::default(),
    }
}

/// Every so-manieth sample of each material, so that about `KEPT` are kept, and of each material
/// at least `least` where it has as many.
fn spread(material: &[usize], materials: usize, least: usize) -> Vec<usize> {
    let mut counts = vec![0usize; materials];
    for &m in material {
        counts[m] += 1;
    }
    let all = material.len();
    let wanted = |count: usize| (count * KEPT).div_ceil(all.max(1)).max(least).min(count);
    let mut passed = vec![0usize; materials];
    (0..all)
        .filter(|&sample| {
            let m = material[sample];
            let (count, wanted) = (counts[m], wanted(counts[m]));
            let place = passed[m];
            passed[m] += 1;
            // A new one of `wanted` even parts begins here.
            (place + 1) * wanted / count > place * wanted / count
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_of_every_material_is_kept_and_all_of_small_ones() {
        let material: Vec<usize> = (0..6000).map(|k| if k % 100 == 7 { 1 } else { 0 }).collect();
        let kept = spread(&material, 3, 80);
        let of = |m: usize| kept.iter().filter(|&&sample| material[sample] == m).count();
        assert_eq!((of(0), of(1), of(2)), (5940 * KEPT / 6000, 60, 0));
        assert!(kept.windows(2).all(|pair| pair[0] < pair[1]));
        // Evenly: of the last tenth as much as of the first.
        let within = |low, high| kept.iter().filter(|&&s| (low..high).contains(&s)).count();
        assert!(within(0, 600).abs_diff(within(5400, 6000)) < 3);
        assert_eq!(spread(&material[..500], 3, 80).len(), 500);
    }
}
