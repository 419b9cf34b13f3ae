//! The sample cloud as coloured points, and the scale behind the colours.

use crate::app::viewport::content::SampleColor;
use crate::app::viewport::gpu::Point;
use crate::app::viewport::palette;
use crate::math::rgb::CHANNELS;
use crate::reconstruct::samples::{Sample, SampleCloud};
use crate::reconstruct::solution::Solution;
use crate::scene::{Capture, MaterialKind};
use eframe::egui;

/// A colour bar with its ends.
#[derive(Clone, Debug, PartialEq)]
pub struct Scale {
    pub title: String,
    pub low: f32,
    pub high: f32,
    pub is_signed: bool,
    /// Values between are whole numbers.
    pub is_count: bool,
}

impl Scale {
    fn color(&self, value: f32) -> egui::Color32 {
        let t = (value - self.low) / (self.high - self.low).max(f32::MIN_POSITIVE);
        if self.is_signed { palette::signed(2.0 * t - 1.0) } else { palette::magnitude(t) }
    }
}

/// The points to draw and, where their colours mean a number, its scale.
pub fn points(
    capture: &Capture,
    cloud: &SampleCloud,
    solution: Option<&Solution>,
    color: SampleColor,
) -> (Vec<Point>, Option<Scale>) {
    let values = match color {
        SampleColor::Radiance | SampleColor::Material => None,
        SampleColor::Error => Some(solution.map_or_else(
            || vec![f32::NAN; cloud.samples.len()],
            |solution| errors(capture, cloud, solution),
        )),
        SampleColor::Weight => Some(weights(cloud)),
        SampleColor::Views => {
            Some(cloud.samples.iter().map(|sample| sample.views.len() as f32).collect())
        }
    };
    let scale = values.as_ref().and_then(|values| scale(values, color));
    let points = cloud.samples.iter().enumerate().map(|(index, sample)| {
        let tint =
            |color: egui::Color32| [color.r(), color.g(), color.b()].map(|v| f32::from(v) / 255.0);
        let shown = match (&values, &scale) {
            (Some(values), Some(scale)) => tint(scale.color(values[index])),
            (Some(_), None) => tint(palette::UNKNOWN),
            _ if color == SampleColor::Material => tint(palette::material_color(sample.material)),
            _ => sample.radiance,
        };
        Point {
            position: sample.position.to_array(),
            color: shown,
            is_radiance: u32::from(color == SampleColor::Radiance),
        }
    });
    (points.collect(), scale)
}

/// log₂ of computed over measured radiance per sample, the mean over its equations and channels;
/// not a number where that is unknown, and everywhere if the solution belongs to other samples.
pub fn errors(capture: &Capture, cloud: &SampleCloud, solution: &Solution) -> Vec<f32> {
    let unknown = vec![f32::NAN; cloud.samples.len()];
    let is_glossy = |sample: &Sample| {
        capture
            .materials
            .get(sample.material)
            .is_some_and(|material| material.kind == MaterialKind::Specular)
    };
    let rows = |limit: usize| -> usize {
        let of = |sample| if is_glossy(sample) { sample.views.len().min(limit) } else { 1 };
        cloud.samples.iter().map(of).sum()
    };
    // The number of photographs that a glossy sample uses is an option of the solution's; it is
    // what makes the equations as many as they are.
    let most = cloud.samples.iter().map(|sample| sample.views.len()).max().unwrap_or(0);
    let Some(limit) = (0..=most).find(|limit| rows(*limit) == solution.computed.len()) else {
        return unknown;
    };
    let mut computed = solution.computed.iter();
    let mean_log = |measured: &[f32; CHANNELS], computed: &[f64; CHANNELS]| {
        let logs: Vec<f32> = measured
            .iter()
            .zip(computed)
            .filter(|(m, c)| **m > 0.0 && **c > 0.0)
            .map(|(m, c)| (*c / f64::from(*m)).log2() as f32)
            .collect();
        logs.iter().sum::<f32>() / logs.len() as f32
    };
    cloud
        .samples
        .iter()
        .map(|sample| {
            if !is_glossy(sample) {
                return computed.next().map_or(f32::NAN, |row| mean_log(&sample.radiance, row));
            }
            let (all, used) = (sample.views.len(), sample.views.len().min(limit));
            let mut sum = 0.0;
            for k in 0..used {
                let view = sample.views.start + if used < all { k * all / used } else { k };
                let row = computed.next();
                sum += row.map_or(f32::NAN, |row| mean_log(&cloud.views[view].radiance, row));
            }
            sum / used as f32
        })
        .collect()
}

/// Mean radiance over each sample's own.
fn weights(cloud: &SampleCloud) -> Vec<f32> {
    let own: Vec<f32> = cloud
        .samples
        .iter()
        .map(|sample| sample.radiance.iter().sum::<f32>() / CHANNELS as f32)
        .collect();
    let mean = own.iter().sum::<f32>() / own.len().max(1) as f32;
    own.iter().map(|value| mean / value.max(1e-3 * mean)).collect()
}

/// The ends of a scale over values; `None` where there is no finite one.
fn scale(values: &[f32], color: SampleColor) -> Option<Scale> {
    let mut sorted: Vec<f32> = values.iter().copied().filter(|v| v.is_finite()).collect();
    if sorted.is_empty() {
        return None;
    }
    sorted.sort_unstable_by(f32::total_cmp);
    let at = |part: f32| sorted[((sorted.len() - 1) as f32 * part).round() as usize];
    let (title, low, high) = match color {
        SampleColor::Error => {
            let end = at(0.02).abs().max(at(0.98).abs()).max(0.05);
            ("Computed / measured (stops)", -end, end)
        }
        SampleColor::Weight => ("Weight (mean radiance / own)", 0.0, at(0.98)),
        _ => ("Photographs that see a sample", at(0.0).min(1.0), at(1.0).max(2.0)),
    };
    Some(Scale {
        title: title.to_owned(),
        low,
        high,
        is_signed: color == SampleColor::Error,
        is_count: color == SampleColor::Views,
    })
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::reconstruct::samples::View;
    use crate::reconstruct::solution::Stopped;
    use crate::scene::Material;

    fn material(kind: MaterialKind) -> Material {
        Material {
            name: String::new(),
            kind,
            surfaces: Vec::new(),
            textured: false,
            known_diffuse: None,
            known_diffuse_sd: None,
        }
    }

    #[test]
    fn errors_are_matched_to_the_equations_of_each_sample() {
        let capture = Capture {
            materials: vec![material(MaterialKind::Diffuse), material(MaterialKind::Specular)],
            ..Capture::default()
        };
        let sample = |material, views: std::ops::Range<usize>| Sample {
            position: Vec3::ZERO,
            normal: Vec3::Z,
            material,
            surface: 0,
            views,
            radiance: [1.0; 3],
        };
        let view = |radiance| View {
            photograph: 0,
            pixel: [0, 0],
            direction: Vec3::Z,
            radiance: [radiance; 3],
        };
        let cloud = SampleCloud {
            samples: vec![sample(0, 0..1), sample(1, 1..5), sample(0, 5..6)],
            views: [1.0, 1.0, 2.0, 4.0, 8.0, 1.0].map(view).to_vec(),
            ..SampleCloud::default()
        };
        // Two of the four photographs of the glossy sample: the first and the third.
        let mut solution = Solution {
            reflectances: Vec::new(),
            emission: Vec::new(),
            iterations: Vec::new(),
            stopped: Stopped::NothingToSolve,
            computed: vec![[2.0; 3], [2.0; 3], [8.0; 3], [0.5; 3]],
            certainty: None,
            notes: Vec::new(),
            warnings: Vec::new(),
        };
        assert_eq!(errors(&capture, &cloud, &solution), [1.0, 1.0, -1.0]);
        solution.computed.extend([[1.0; 3]; 10]);
        assert!(errors(&capture, &cloud, &solution).iter().all(|error| error.is_nan()));
    }
}
