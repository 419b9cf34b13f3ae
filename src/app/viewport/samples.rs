//! The sample cloud as coloured points, and the scale behind the colours.

use crate::app::derived::Derived;
use crate::app::viewport::content::SampleColor;
use crate::app::viewport::gpu::Point;
use crate::app::viewport::palette::{self, MaterialColors};
use crate::math::rgb::CHANNELS;
use crate::reconstruct::samples::SampleCloud;
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
    cloud: &SampleCloud,
    materials: &MaterialColors,
    derived: Option<&Derived>,
    color: SampleColor,
) -> (Vec<Point>, Option<Scale>) {
    let values = match color {
        SampleColor::Radiance | SampleColor::Material => None,
        // Of other samples they would colour the wrong ones.
        SampleColor::Error => {
            match derived.filter(|derived| derived.samples.len() == cloud.samples.len()) {
                Some(derived) => {
                    Some(derived.samples.iter().map(|sample| sample.log_error as f32).collect())
                }
                None => Some(vec![f32::NAN; cloud.samples.len()]),
            }
        }
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
            _ if color == SampleColor::Material => tint(materials.of(sample.material)),
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
            ("Error: ln (computed / measured)", -end, end)
        }
        SampleColor::Weight => ("Weight (mean radiance / own)", 0.0, at(0.98)),
        _ => ("Photographs that show a sample", at(0.0).min(1.0), at(1.0).max(2.0)),
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
    use crate::app::derived::SampleNumbers;
    use crate::reconstruct::samples::Sample;

    #[test]
    fn errors_are_those_of_the_tables_and_grey_where_they_belong_to_other_samples() {
        let sample = Sample {
            position: Vec3::ZERO,
            normal: Vec3::Z,
            material: 0,
            surface: 0,
            views: 0..0,
            radiance: [1.0; 3],
        };
        let cloud = SampleCloud { samples: vec![sample; 3], ..SampleCloud::default() };
        let numbers = |log_error| SampleNumbers { log_error, ..SampleNumbers::default() };
        let mut derived =
            Derived { samples: [-0.5, 0.0, 0.5].map(numbers).to_vec(), ..Derived::default() };
        let (drawn, scale) =
            points(&cloud, &MaterialColors::default(), Some(&derived), SampleColor::Error);
        let scale = scale.unwrap();
        assert_eq!((scale.low, scale.high), (-0.5, 0.5));
        let blue = |point: &Point| point.color[2] - point.color[0];
        assert!(blue(&drawn[0]) > 0.3 && blue(&drawn[1]) == 0.0 && blue(&drawn[2]) < -0.3);
        derived.samples.pop();
        assert_eq!(
            points(&cloud, &MaterialColors::default(), Some(&derived), SampleColor::Error).1,
            None
        );
    }
}
