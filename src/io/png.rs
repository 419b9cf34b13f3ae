//! Writes PNG files that state their colour space.

use std::path::Path;

use super::{Error, atomic};

/// Writes codes of sRGB, three a pixel, row by row from the top.
pub(super) fn write(file: &Path, width: usize, height: usize, codes: &[u8]) -> Result<(), Error> {
    write_as(::png::ColorType::Rgb, file, width, height, codes)
}

/// The same with a fourth code, of opacity; colours are not multiplied by it.
pub(super) fn write_with_alpha(
    file: &Path,
    width: usize,
    height: usize,
    codes: &[u8],
) -> Result<(), Error> {
    write_as(::png::ColorType::Rgba, file, width, height, codes)
}

fn write_as(
    color: ::png::ColorType,
    file: &Path,
    width: usize,
    height: usize,
    codes: &[u8],
) -> Result<(), Error> {
    let encoded = encode_as(color, width, height, codes)
        .map_err(|source| Error::Write { file: file.to_owned(), source })?;
    atomic::write_bytes(file, &encoded)
}

/// The same as the bytes of a file. It states sRGB, with gamma and chromaticities for readers that
/// do not know the tag.
pub(super) fn encode(width: usize, height: usize, codes: &[u8]) -> std::io::Result<Vec<u8>> {
    encode_as(::png::ColorType::Rgb, width, height, codes)
}

fn encode_as(
    color: ::png::ColorType,
    width: usize,
    height: usize,
    codes: &[u8],
) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = ::png::Encoder::new(&mut bytes, width as u32, height as u32);
    encoder.set_color(color);
    encoder.set_depth(::png::BitDepth::Eight);
    encoder.set_compression(::png::Compression::Fast);
    encoder.set_source_srgb(::png::SrgbRenderingIntent::RelativeColorimetric);
    encoder.set_source_gamma(::png::ScaledFloat::from_scaled(45_455));
    encoder.set_source_chromaticities(::png::SourceChromaticities::new(
        (0.3127, 0.329),
        (0.64, 0.33),
        (0.3, 0.6),
        (0.15, 0.06),
    ));
    let mut writer = encoder.write_header()?;
    writer.write_image_data(codes)?;
    writer.finish()?;
    Ok(bytes)
}

/// A mask as the bytes of a file: white is kept, black is left out.
pub(super) fn encode_mask(
    width: usize,
    height: usize,
    is_left_out: &[bool],
) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = ::png::Encoder::new(&mut bytes, width as u32, height as u32);
    encoder.set_color(::png::ColorType::Grayscale);
    encoder.set_depth(::png::BitDepth::Eight);
    let mut writer = encoder.write_header()?;
    let codes: Vec<u8> = is_left_out.iter().map(|&own| if own { 0 } else { 255 }).collect();
    writer.write_image_data(&codes)?;
    writer.finish()?;
    Ok(bytes)
}
