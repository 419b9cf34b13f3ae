//! Renders and textures as OpenEXR.

use std::path::Path;

use exr::prelude::{
    AnyChannel, AnyChannels, Compression, Encoding, FlatSamples, Layer, LayerAttributes, LineOrder,
    WritableImage,
};

use super::color::ColorSpace;
use crate::io::{Error, atomic};
use crate::math::rgb::Radiance;

/// Writes R, G, B as 32-bit floats with the chromaticities of Rec. 709, ZIP compressed, whole or not
/// at all.
pub fn write_rgb(
    file: &Path,
    width: usize,
    height: usize,
    pixels: &[Radiance],
) -> Result<(), Error> {
    write_rgb_with(file, width, height, pixels, &[])
}

/// As [`write_rgb`], with further named channels (a texture's `seen`).
///
/// # Panics
/// If a channel does not have `width × height` values.
pub fn write_rgb_with(
    file: &Path,
    width: usize,
    height: usize,
    pixels: &[Radiance],
    further: &[(&str, &[f32])],
) -> Result<(), Error> {
    write_rgb_in(ColorSpace::Rec709, file, (width, height), pixels, further)
}

/// As [`write_rgb_with`], with pixels that are in a colour space, whose chromaticities the file states.
///
/// # Panics
/// As [`write_rgb_with`].
pub fn write_rgb_in(
    space: ColorSpace,
    file: &Path,
    (width, height): (usize, usize),
    pixels: &[Radiance],
    further: &[(&str, &[f32])],
) -> Result<(), Error> {
    assert_eq!(pixels.len(), width * height);
    let colour = ["R", "G", "B"].into_iter().enumerate().map(|(channel, name)| {
        let samples = pixels.iter().map(|pixel| pixel[channel]).collect();
        AnyChannel::new(name, FlatSamples::F32(samples))
    });
    let further = further.iter().map(|(name, samples)| {
        assert_eq!(samples.len(), width * height);
        AnyChannel::new(*name, FlatSamples::F32(samples.to_vec()))
    });
    let layer = Layer::new(
        (width, height),
        LayerAttributes::default(),
        Encoding {
            compression: Compression::ZIP16,
            blocks: exr::image::Blocks::ScanLines,
            line_order: LineOrder::Increasing,
        },
        AnyChannels::sort(colour.chain(further).collect()),
    );
    let mut image = exr::image::Image::from_layer(layer);
    image.attributes.chromaticities = Some(space.chromaticities());
    atomic::write(file, |out| {
        image.write().non_parallel().to_buffered(out).map_err(|failure| match failure {
            exr::error::Error::Io(source) => source,
            other => std::io::Error::other(other.to_string()),
        })
    })
}
