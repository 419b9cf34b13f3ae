//! Makes a photograph that was read an image of its camera: turned, masked, in the colours of the
//! capture, without vignetting, and in a file if there are many.

use std::path::Path;

use glam::{DMat3, DVec2};

use super::picture::Picture;
use super::transforms::{Cameras, Frame, Vignetting};
use super::{Error, Fault, exr, masks, scratch};
use crate::exposures::options::DARKEST_CORNER;
use crate::scene::{Camera, Image, Values};

/// What all images are read by.
pub(super) struct Sensor {
    /// Pixels at or above it are no measurements.
    pub saturation: Option<f32>,
    pub vignetting: Option<Vignetting>,
    /// Linear Rec. 709 from the channels of the images.
    pub color_matrix: Option<DMat3>,
    /// Pixels are kept in files while the program runs, since they are many.
    pub in_files: bool,
}

/// Bytes of the pixels of all measurements, as half floats.
pub(super) fn bytes(cameras: &Cameras) -> u64 {
    let measured = cameras.frames.iter().filter(|frame| frame.is_measurement);
    measured.map(|frame| 6 * frame.camera.width as u64 * frame.camera.height as u64).sum()
}

/// A frame's image, if it is a measurement, and what is to be said about it.
pub(super) type Loaded = (Option<Image>, Vec<String>);

/// Radiance as an image of the frame's camera.
pub(super) fn accept(
    picture: Picture<Values>,
    file: &Path,
    frame: &Frame,
    sensor: &Sensor,
) -> Result<Loaded, Error> {
    let Picture { width, height, pixels, mut notes } = picture;
    let (stored, orientation) = ((width, height), frame.orientation);
    let pixels = match pixels {
        Values::Half(pixels) => Values::Half(orientation.turn(stored, pixels)),
        Values::Single(pixels) => Values::Single(orientation.turn(stored, pixels)),
    };
    let (width, height) = orientation.size(stored);
    let camera = &frame.camera;
    if (width, height) != (camera.width, camera.height) {
        return Err(Error::Invalid(Fault::new(
            file,
            "",
            format!(
                "the image has {width} x {height} pixels, but its camera in {} has {} x {}",
                frame.place, camera.width, camera.height
            ),
            "Give w, h and the intrinsics of this image, or the image that the camera was \
             calibrated on",
        )));
    }
    let mut image = Image::of_values(width, height, pixels, sensor.saturation);
    notes.extend(masks::apply(&mut image, file, frame.mask.as_deref(), orientation)?);
    if !image.measures_anything() {
        notes.push(format!(
            "{}: no pixel is a measurement: all are saturated, negative, not finite or masked. \
             Check the image, its mask, and the saturation level in tags.json.",
            file.display()
        ));
    }
    if let Some(matrix) = &sensor.color_matrix {
        image.recolor(|pixel| exr::color::converted(pixel, matrix));
    }
    if let Some(vignetting) = sensor.vignetting {
        divide_out(&mut image, camera, vignetting, file, &frame.place)?;
    }
    if sensor.in_files
        && let Err(reason) = scratch::keep(&mut image)
    {
        notes.push(format!(
            "{}: kept in memory, since no file could be written to {} ({reason}). Make room there, \
             or set TMPDIR to a folder with more.",
            file.display(),
            scratch::folder().display()
        ));
    }
    Ok((Some(image), notes))
}

/// Undoes the vignetting. Validity has been decided before, on what the sensor gave.
fn divide_out(
    image: &mut Image,
    camera: &Camera,
    vignetting: Vignetting,
    file: &Path,
    place: &str,
) -> Result<(), Error> {
    let factor =
        |x: usize, y: usize| vignetting.factor(camera, DVec2::new(x as f64 + 0.5, y as f64 + 0.5));
    let darkest = (0..camera.height)
        .flat_map(|y| (0..camera.width).map(move |x| (x, y)))
        .map(|(x, y)| factor(x, y))
        .fold(f64::INFINITY, f64::min);
    if darkest < DARKEST_CORNER {
        return Err(Error::Invalid(Fault::new(
            file,
            "",
            format!(
                "the vignetting of the camera file leaves {:.1} % of the light at a pixel of {place}",
                100.0 * darkest
            ),
            "Correct vignetting.a and .b in transforms.json: r is in half diagonals",
        )));
    }
    image.scale(|x, y| (1.0 / factor(x, y)) as f32);
    Ok(())
}
