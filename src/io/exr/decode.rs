//! The blocks of a layer, decoded one by one into the picture.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use exr::block::UncompressedBlock;
use exr::block::chunk::CompressedBlock;
use exr::block::reader::ChunksReader;
use exr::meta::BlockDescription;
use exr::meta::header::Header;
use exr::prelude::{Compression, SampleType, Vec2, f16};

use super::{Channels, Choice, failed};
use crate::io::Error;
use crate::io::picture::Picture;

/// The channels that were chosen of a layer, in the display window.
pub(super) fn decode<V: Value>(
    file: &Path,
    header: &Header,
    choice: &Choice,
    note: Option<String>,
) -> Result<Picture<Vec<[V; 3]>>, Error> {
    let display = header.shared_attributes.display_window;
    let Vec2(width, height) = display.size;
    let origin = header.own_attributes.layer_position;
    let shift = [
        i64::from(origin.0) - i64::from(display.position.0),
        i64::from(origin.1) - i64::from(display.position.1),
    ];
    let mut pixels = vec![[V::NOTHING; 3]; width * height];
    let open = File::open(file).map_err(|source| Error::Read { file: file.to_owned(), source })?;
    let place = |block: UncompressedBlock| {
        for line in block.lines(&header.channels) {
            let Some(slots) = slots_of(choice.channels, line.location.channel) else { continue };
            let y = line.location.position.1 as i64 + shift[1];
            if y < 0 || y >= height as i64 {
                continue;
            }
            let row = &mut pixels[y as usize * width..][..width];
            let first = line.location.position.0 as i64 + shift[0];
            let kind = header.channels.list[line.location.channel].sample_type;
            fill(row, slots, first, kind, line.value);
        }
    };
    decompress(open, choice.layer, place).map_err(|failure| failed(file, failure))?;
    Ok(Picture { width, height, pixels, notes: note.into_iter().collect() })
}

/// Decodes the blocks of a layer at full resolution.
fn decompress(
    file: File,
    layer: usize,
    mut place: impl FnMut(UncompressedBlock),
) -> Result<(), exr::error::Error> {
    let reader = exr::block::read(BufReader::new(file), false)?;
    let chunks = reader.filter_chunks(false, |_, tile, block| {
        block.layer == layer && tile.level_index == Vec2(0, 0)
    })?;
    let meta = chunks.meta_data().clone();
    for chunk in chunks {
        let chunk = chunk?;
        // A damaged table may lead to a chunk of another layer or level.
        let Some(header) =
            meta.headers.get(chunk.layer_index).filter(|_| chunk.layer_index == layer)
        else {
            return Err(exr::error::Error::Invalid("table of pixel blocks".into()));
        };
        check_cosine_sizes(header, &chunk.compressed_block)?;
        let block = UncompressedBlock::decompress_chunk(chunk, &meta, false)?;
        if block.index.level == Vec2(0, 0) {
            place(block);
        }
    }
    Ok(())
}

/// DWAA and DWAB blocks begin with the sizes of their decompressed parts, which the decoder
/// allocates as they stand; one changed byte can make that exabytes.
fn check_cosine_sizes(header: &Header, block: &CompressedBlock) -> Result<(), exr::error::Error> {
    let bytes = match block {
        CompressedBlock::ScanLine(block) => &block.compressed_pixels_le,
        CompressedBlock::Tile(block) => &block.compressed_pixels_le,
        _ => return Ok(()),
    };
    if !matches!(header.compression, Compression::DWAA(_) | Compression::DWAB(_)) {
        return Ok(());
    }
    // Parts are padded to 8 × 8 pixels, and run lengths may grow what they cannot shrink.
    let Vec2(width, height) = block_size(header);
    let padded = width.next_multiple_of(8) as u128 * height.next_multiple_of(8) as u128;
    let most = 2 * padded * header.channels.bytes_per_pixel as u128 + 4096;
    // Counters 1, 6 and 7 are in bytes, 8 and 9 in values of two bytes.
    let counters = bytes.as_chunks::<8>().0.iter().take(10).enumerate();
    for (index, counter) in counters {
        let unit = match index {
            1 | 6 | 7 => 1,
            8 | 9 => 2,
            _ => continue,
        };
        if unit * u128::from(u64::from_le_bytes(*counter)) > most {
            return Err(exr::error::Error::Invalid("sizes of a DWA block".into()));
        }
    }
    Ok(())
}

/// Width and height of the largest block of pixels.
pub(super) fn block_size(header: &Header) -> Vec2<usize> {
    match header.blocks {
        BlockDescription::ScanLines => {
            let Vec2(width, height) = header.layer_size;
            Vec2(width, header.compression.scan_lines_per_block().min(height))
        }
        BlockDescription::Tiles(tiles) => tiles.tile_size,
    }
}

/// Which of the three values of a pixel a channel fills.
fn slots_of(channels: Channels, channel: usize) -> Option<&'static [usize]> {
    match channels {
        Channels::Grey(grey) => (grey == channel).then_some(&[0, 1, 2]),
        Channels::Colour(three) | Channels::LuminanceChroma(three) => {
            const SLOTS: [&[usize]; 3] = [&[0], &[1], &[2]];
            three.iter().position(|&index| index == channel).map(|slot| SLOTS[slot])
        }
    }
}

/// What a channel's samples become.
pub(super) trait Value: Copy {
    /// What no block covers is NaN, so that it counts as no measurement.
    const NOTHING: Self;

    fn of_half(sample: f16) -> Self;

    fn of_single(sample: f32) -> Self;
}

impl Value for f32 {
    const NOTHING: Self = Self::NAN;

    fn of_half(sample: f16) -> Self {
        sample.to_f32()
    }

    fn of_single(sample: f32) -> Self {
        sample
    }
}

impl Value for f16 {
    const NOTHING: Self = Self::NAN;

    fn of_half(sample: f16) -> Self {
        sample
    }

    fn of_single(sample: f32) -> Self {
        Self::from_f32(sample)
    }
}

/// Fills some values of the pixels of a row from the samples of a line that begins at its pixel
/// `first`, which may lie before the row.
fn fill<V: Value>(row: &mut [[V; 3]], slots: &[usize], first: i64, kind: SampleType, line: &[u8]) {
    let before = usize::try_from(-first).unwrap_or(0);
    let row = row.get_mut(usize::try_from(first).unwrap_or(0)..).unwrap_or_default();
    match kind {
        SampleType::F16 => {
            let value = |sample| V::of_half(f16::from_ne_bytes(sample));
            put(row, slots, before, line.as_chunks().0, value);
        }
        SampleType::F32 => {
            let value = |sample| V::of_single(f32::from_ne_bytes(sample));
            put(row, slots, before, line.as_chunks().0, value);
        }
        SampleType::U32 => {
            let value = |sample| V::of_single(u32::from_ne_bytes(sample) as f32);
            put(row, slots, before, line.as_chunks().0, value);
        }
    }
}

fn put<V: Value, const N: usize>(
    row: &mut [[V; 3]],
    slots: &[usize],
    before: usize,
    samples: &[[u8; N]],
    value: impl Fn([u8; N]) -> V,
) {
    let samples = samples.get(before..).unwrap_or_default();
    for &slot in slots {
        for (pixel, sample) in std::iter::zip(&mut *row, samples) {
            pixel[slot] = value(*sample);
        }
    }
}
