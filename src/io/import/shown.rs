//! A photograph as it is displayed, whatever its format: reduced in size, and never used as a
//! measurement.

use std::path::Path;

use glam::{DMat3, Vec3};
use rayon::prelude::*;

use crate::io::orientation::Orientation;
use crate::io::picture::{self, Format, Picture};
use crate::io::{Error, photograph, raw};
use crate::math::rgb::srgb_code;

/// Of radiance that 95 % of the pixels stay below, what part of white it becomes.
const BRIGHT_PART: f32 = 0.8;

/// A picture for the screen.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Shown {
    /// Pixels of the photograph along a side of one of these.
    pub step: usize,
    pub width: usize,
    pub height: usize,
    /// sRGB, row by row from the top.
    pub pixels: Vec<[u8; 3]>,
}

/// Reads a photograph, its longer side made no longer than `longest` by averaging whole squares of
/// pixels, and turned. Radiance is exposed so that little of it is clipped.
pub fn read(file: &Path, orientation: Orientation, longest: usize) -> Result<Shown, Error> {
    let Shown { step, width, height, pixels } = stored(file, longest)?;
    let pixels = orientation.turn((width, height), pixels);
    let (width, height) = orientation.size((width, height));
    Ok(Shown { step, width, height, pixels })
}

fn stored(file: &Path, longest: usize) -> Result<Shown, Error> {
    let picture = if raw::is_raw(file) {
        developed(file)?
    } else if Format::of(file)?.is_radiance() {
        picture::read(file)?
    } else {
        let photo = photograph::read(file)?;
        let (step, width, height) = reduced(photo.width, photo.height, longest);
        let size = (photo.width, photo.height);
        let pixels = squares(size, (step, width, height), |index| photo.codes.at(index));
        let pixels = pixels.into_iter().map(|code| code.map(|value| value.round() as u8));
        return Ok(Shown { step, width, height, pixels: pixels.collect() });
    };
    let (step, width, height) = reduced(picture.width, picture.height, longest);
    let usable = |value: f32| if value.is_finite() { value.max(0.0) } else { 0.0 };
    let size = (picture.width, picture.height);
    let pixels = squares(size, (step, width, height), |index| picture.pixels[index].map(usable));
    let mut values: Vec<f32> = pixels.iter().map(|pixel| pixel.iter().sum::<f32>() / 3.0).collect();
    let place = (0.95 * values.len() as f64) as usize;
    let bright = match values.len() {
        0 => 1.0,
        count => *values.select_nth_unstable_by(place.min(count - 1), f32::total_cmp).1,
    };
    let scale = if bright > 0.0 { BRIGHT_PART / bright } else { 1.0 };
    let pixels = pixels.into_par_iter().map(|pixel| pixel.map(|value| srgb_code(scale * value)));
    Ok(Shown { step, width, height, pixels: pixels.collect() })
}

/// What a RAW photograph measured, in sRGB where that is known.
fn developed(file: &Path) -> Result<Picture, Error> {
    let photo = photograph::read(file)?;
    let matrix = raw::srgb_from_camera(file)?.unwrap_or(DMat3::IDENTITY).as_mat3();
    let pixels = (0..photo.codes.len())
        .into_par_iter()
        .map(|index| (matrix * Vec3::from_array(photo.codes.at(index))).to_array());
    let (width, height) = (photo.width, photo.height);
    Ok(Picture { width, height, pixels: pixels.collect(), notes: Vec::new() })
}

/// The side of the squares, and how many there are of them; those beyond the last whole one go.
fn reduced(width: usize, height: usize, longest: usize) -> (usize, usize, usize) {
    let step = width.max(height).div_ceil(longest.max(1)).max(1);
    (step, (width / step).max(1), (height / step).max(1))
}

fn squares(
    (own_width, own_height): (usize, usize),
    (step, width, height): (usize, usize, usize),
    at: impl Fn(usize) -> [f32; 3] + Sync,
) -> Vec<[f32; 3]> {
    let (step_x, step_y) = (step.min(own_width), step.min(own_height));
    (0..width * height)
        .into_par_iter()
        .map(|index| {
            let (x, y) = (index % width * step, index / width * step);
            let mut sum = [0.0; 3];
            for v in y..y + step_y {
                for u in x..x + step_x {
                    let pixel = at(v * own_width + u);
                    sum.iter_mut().zip(pixel).for_each(|(sum, value)| *sum += value);
                }
            }
            sum.map(|sum| sum / (step_x * step_y) as f32)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::exr;

    #[test]
    fn radiance_is_exposed_and_made_small() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.exr");
        let mut pixels: Vec<[f32; 3]> = (0..90 * 60)
            .map(|index| if index % 90 < 45 { [0.02; 3] } else { [5.0, 2.5, 0.0] })
            .collect();
        pixels[0] = [f32::NAN, -1.0, 0.02];
        exr::write_rgb(&file, 90, 60, &pixels).unwrap();
        let shown = read(&file, Orientation::default(), 30).unwrap();
        assert_eq!((shown.step, shown.width, shown.height), (3, 30, 20));
        assert_eq!(shown.pixels.len(), 600);
        let (dark, bright) = (shown.pixels[5], shown.pixels[29]);
        assert!(dark[0] < 40 && dark[0] == dark[2], "{dark:?}");
        // 5 / 2.5 of the exposure that makes their mean 0.8: red clips, green is 0.8.
        assert_eq!(bright, [255, 231, 0]);
        // Longer than the picture: as it is. A strip thinner than a square stays one.
        assert_eq!(stored(&file, 1000).unwrap().step, 1);
        exr::write_rgb(&file, 40, 2, &[[1.0; 3]; 80]).unwrap();
        assert_eq!(stored(&file, 4).unwrap().height, 1);
    }
}
