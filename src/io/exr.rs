//! OpenEXR: photographs in, renders and textures out.
//!
//! Headers are checked before anything is decoded, because a file of 200 kB can claim gigabytes
//! and an allocation that fails ends the process. Blocks are then decoded one by one into the
//! result, so the memory is the image's own plus one block. Panics of the decoder become errors.

pub(super) mod color;
mod decode;
mod write;

use std::fs::File;
use std::io::BufReader;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use exr::meta::MetaData;
use exr::meta::attribute::Chromaticities;
use exr::meta::header::Header;
use exr::prelude::{Compression, SampleType, Vec2};

pub use self::color::ColorSpace;
use self::decode::{block_size, decode};
pub use self::write::{write_rgb, write_rgb_in, write_rgb_with};
use super::picture::{LARGEST_BYTES, LARGEST_SIDE_PRODUCT, Picture};
use super::{Error, Fault};
use crate::math::rgb::Radiance;
use crate::scene::Values;

/// No block of pixels (some scan lines or a tile) of a sound file is larger.
const LARGEST_BLOCK: u128 = 256 << 20;
/// Up to this size, in bytes, an image is decoded whatever its file's size: it does no harm.
const HARMLESS: u128 = 64 << 20;
/// Headers are a few kilobytes, with previews and manifests some megabytes.
const LARGEST_LAYERS: usize = 256;

/// The size of the display window, from the header alone.
pub fn dimensions(file: &Path) -> Result<(usize, usize), Error> {
    let header = guarded(file, || {
        let (meta, bytes) = read_headers(file)?;
        check_counts(file, &meta, bytes)?;
        meta.headers.into_iter().next().ok_or_else(|| damaged(file, "it has no layer"))
    })?;
    let size = header.shared_attributes.display_window.size;
    check_size(file, size)?;
    Ok((size.0, size.1))
}

/// The colour channels of the main layer in the display window; pixels outside of the data
/// window are NaN. Half-float infinities stay infinite: they are no measurement. Colours of other
/// chromaticities than those of Rec. 709 are converted to it.
pub fn read(file: &Path) -> Result<Picture, Error> {
    guarded(file, || Main::of(file)?.read(file))
}

/// As [`read`]. Values that the file has as half floats stay so, unless they are converted.
pub fn read_values(file: &Path) -> Result<Picture<Values>, Error> {
    guarded(file, || {
        let main = Main::of(file)?;
        if main.is_half() && main.other_colors().is_none() {
            return Ok(decode(file, &main.header, &main.choice, main.note)?.map(Values::Half));
        }
        Ok(main.read(file)?.map(Values::from))
    })
}

/// The main layer of a file, checked.
struct Main {
    header: Header,
    choice: Choice,
    note: Option<String>,
}

impl Main {
    fn of(file: &Path) -> Result<Self, Error> {
        let (mut meta, bytes) = read_headers(file)?;
        check_counts(file, &meta, bytes)?;
        let (choice, note) = choose(file, &meta)?;
        let header = meta.headers.swap_remove(choice.layer);
        check_layer(file, &header, bytes)?;
        Ok(Self { header, choice, note })
    }

    /// Whether what is read of it are half floats as they are.
    fn is_half(&self) -> bool {
        let is_half =
            |index: usize| self.header.channels.list[index].sample_type == SampleType::F16;
        match self.choice.channels {
            Channels::Colour(three) => three.into_iter().all(is_half),
            Channels::Grey(grey) => is_half(grey),
            Channels::LuminanceChroma(_) => false,
        }
    }

    /// The chromaticities from which colours are converted.
    fn other_colors(&self) -> Option<&Chromaticities> {
        let is_color = !matches!(self.choice.channels, Channels::Grey(_));
        let stated = self.header.shared_attributes.chromaticities.as_ref();
        stated.filter(|stated| is_color && !color::is_rec_709(stated))
    }

    fn read(self, file: &Path) -> Result<Picture, Error> {
        let stated = self.other_colors().copied();
        let mut picture = decode(file, &self.header, &self.choice, self.note)?;
        if matches!(self.choice.channels, Channels::LuminanceChroma(_)) {
            picture.pixels.iter_mut().for_each(|pixel| *pixel = color::of_luminance_chroma(*pixel));
        }
        if let Some(stated) = stated {
            match color::rec_709_from(&stated) {
                Some(matrix) => color::convert(&mut picture.pixels, &matrix),
                None => picture.notes.push(format!(
                    "{}: its chromaticities span no colours; it is taken to be Rec. 709.",
                    file.display()
                )),
            }
        }
        Ok(picture)
    }
}

/// The opacity of the main layer's pixels, 0 outside of the data window; `None` where it has none.
pub fn read_alpha(file: &Path) -> Result<Option<Vec<f32>>, Error> {
    guarded(file, || {
        let (meta, bytes) = read_headers(file)?;
        check_counts(file, &meta, bytes)?;
        let (choice, _) = choose(file, &meta)?;
        let header = &meta.headers[choice.layer];
        let first = match choice.channels {
            Channels::Colour([first, ..]) | Channels::LuminanceChroma([first, ..]) => first,
            Channels::Grey(first) => first,
        };
        let names: Vec<String> =
            header.channels.list.iter().map(|channel| channel.name.to_string()).collect();
        let layer = split_name(&names[first]).0;
        let is_alpha = |name: &String| {
            let (own, channel) = split_name(name);
            own == layer && channel.eq_ignore_ascii_case("A")
        };
        let Some(index) = names.iter().position(is_alpha) else { return Ok(None) };
        check_layer(file, header, bytes)?;
        let choice = Choice { layer: choice.layer, channels: Channels::Grey(index) };
        Ok(Some(single(decode(file, header, &choice, None)?)))
    })
}

/// One channel of the display window by its full name, 0 outside of the data window; `None` where
/// no layer at full resolution has it.
pub fn read_channel(file: &Path, name: &str) -> Result<Option<Vec<f32>>, Error> {
    guarded(file, || {
        let (meta, bytes) = read_headers(file)?;
        check_counts(file, &meta, bytes)?;
        let found = meta.headers.iter().enumerate().find_map(|(layer, header)| {
            let is_it = |channel: &exr::prelude::ChannelDescription| {
                channel.sampling == Vec2(1, 1) && channel.name.to_string() == name
            };
            let index = header.channels.list.iter().position(is_it).filter(|_| !header.deep)?;
            Some(Choice { layer, channels: Channels::Grey(index) })
        });
        let Some(choice) = found else { return Ok(None) };
        let header = &meta.headers[choice.layer];
        check_layer(file, header, bytes)?;
        Ok(Some(single(decode(file, header, &choice, None)?)))
    })
}

/// The values of a channel that was decoded as grey, 0 where there are none.
fn single(picture: Picture) -> Vec<f32> {
    let value = |[value, ..]: Radiance| if value.is_nan() { 0.0 } else { value };
    picture.pixels.into_iter().map(value).collect()
}

/// Runs a decoder, which may panic on a damaged file.
fn guarded<T>(file: &Path, work: impl FnOnce() -> Result<T, Error>) -> Result<T, Error> {
    catch_unwind(AssertUnwindSafe(work))
        .unwrap_or_else(|_| Err(damaged(file, "its contents contradict its header")))
}

fn damaged(file: &Path, reason: &str) -> Error {
    Error::Invalid(Fault::new(
        file,
        "",
        format!("this OpenEXR file is damaged or cut off ({reason})"),
        "Export or copy it again, or remove its frame from the camera file",
    ))
}

fn failed(file: &Path, failure: exr::error::Error) -> Error {
    match failure {
        exr::error::Error::NotSupported(what) => unsupported(file, &what),
        exr::error::Error::Io(source) if source.kind() != std::io::ErrorKind::UnexpectedEof => {
            Error::Read { file: file.to_owned(), source }
        }
        exr::error::Error::Io(_) => damaged(file, "it ends too early"),
        exr::error::Error::Invalid(what) => damaged(file, &what),
        exr::error::Error::Aborted => damaged(file, "reading was given up"),
    }
}

fn unsupported(file: &Path, what: &str) -> Error {
    Error::Unsupported(Fault::new(
        file,
        "",
        format!("this variety of OpenEXR is not read ({what})"),
        "Save it as a flat OpenEXR with channels R, G and B",
    ))
}

fn read_headers(file: &Path) -> Result<(MetaData, u64), Error> {
    let unreadable = |source| Error::Read { file: file.to_owned(), source };
    let open = File::open(file).map_err(unreadable)?;
    let bytes = open.metadata().map_err(unreadable)?.len();
    let meta = MetaData::read_from_buffered(BufReader::new(open), false)
        .map_err(|failure| failed(file, failure))?;
    Ok((meta, bytes))
}

/// Every layer's table of chunks, and the chunks' own heads, must fit into the file.
fn check_counts(file: &Path, meta: &MetaData, bytes: u64) -> Result<(), Error> {
    if meta.headers.len() > LARGEST_LAYERS {
        return Err(unsupported(file, &format!("{} layers", meta.headers.len())));
    }
    // Eight bytes of table and at least eight of head for each chunk.
    let chunks: u128 = meta.headers.iter().map(|header| header.chunk_count as u128).sum();
    if 16 * chunks > u128::from(bytes) {
        return Err(damaged(file, "its table of pixel blocks is larger than the file"));
    }
    Ok(())
}

fn check_size(file: &Path, size: Vec2<usize>) -> Result<(), Error> {
    let pixels = size.0 as u128 * size.1 as u128;
    if pixels == 0 {
        return Err(damaged(file, "it has no pixels"));
    }
    if pixels > LARGEST_SIDE_PRODUCT as u128
        || pixels * std::mem::size_of::<Radiance>() as u128 > LARGEST_BYTES as u128
    {
        return Err(super::picture::too_large(file, size.0 as u64, size.1 as u64));
    }
    Ok(())
}

fn check_layer(file: &Path, header: &Header, bytes: u64) -> Result<(), Error> {
    check_size(file, header.shared_attributes.display_window.size)?;
    check_size(file, header.layer_size)?;
    let pixel_bytes = header.channels.bytes_per_pixel as u128;
    let Vec2(width, height) = header.layer_size;
    let Vec2(block_width, block_height) = block_size(header);
    let block = block_width as u128 * block_height as u128;
    if block * pixel_bytes > LARGEST_BLOCK {
        return Err(unsupported(file, "blocks of pixels of more than 256 MB"));
    }
    // What the compression can do at most: none; runs of 128 bytes in two; deflate's 1032; for
    // the wavelet and cosine ones there is no such bound, but a photograph that shrinks a
    // thousandfold holds nothing to measure, so be generous and stop there.
    let ratio = match header.compression {
        Compression::Uncompressed => 1,
        Compression::RLE => 70,
        Compression::B44 | Compression::B44A => 20,
        Compression::ZIP1 | Compression::ZIP16 | Compression::PXR24 => 1100,
        _ => 20_000,
    };
    let claimed = width as u128 * height as u128 * pixel_bytes;
    if claimed > HARMLESS && claimed > ratio * u128::from(bytes) {
        return Err(damaged(file, &format!("{bytes} bytes cannot hold {width} x {height} pixels")));
    }
    Ok(())
}

/// Which channels make up the picture.
struct Choice {
    layer: usize,
    /// Indices into the layer's channels: R, G, B, or Y alone, or Y, RY, BY.
    channels: Channels,
}

#[derive(Clone, Copy)]
enum Channels {
    Colour([usize; 3]),
    Grey(usize),
    LuminanceChroma([usize; 3]),
}

/// Words by which renderers call the layer that is the picture.
const MAIN_LAYERS: [&str; 5] = ["combined", "beauty", "rgba", "main", "left"];

/// The main layer's channels: unnamed ones first, then layers of a telling name, then any.
fn choose(file: &Path, meta: &MetaData) -> Result<(Choice, Option<String>), Error> {
    let mut candidates = Vec::new();
    for (layer, header) in meta.headers.iter().enumerate().filter(|(_, header)| !header.deep) {
        let part = header.own_attributes.layer_name.as_ref().map(ToString::to_string);
        let names: Vec<String> =
            header.channels.list.iter().map(|channel| channel.name.to_string()).collect();
        let mut prefixes: Vec<&str> = names.iter().map(|name| split_name(name).0).collect();
        prefixes.dedup();
        for prefix in prefixes {
            let find = |wanted: &str| {
                names.iter().position(|name| {
                    let (own, channel) = split_name(name);
                    own == prefix && channel.eq_ignore_ascii_case(wanted)
                })
            };
            let (penalty, channels) = match (find("R"), find("G"), find("B"), find("Y")) {
                (Some(r), Some(g), Some(b), _) => (0, Channels::Colour([r, g, b])),
                (_, _, _, Some(y)) => match (find("RY"), find("BY")) {
                    (Some(ry), Some(by)) => (10, Channels::LuminanceChroma([y, ry, by])),
                    _ => (20, Channels::Grey(y)),
                },
                _ => continue,
            };
            let full = format!("{}.{prefix}", part.as_deref().unwrap_or(""));
            let telling = full.to_lowercase();
            let rank = MAIN_LAYERS.iter().position(|word| telling.contains(word));
            let rank = rank.map_or(8, |rank| rank + 1);
            let is_plain = prefix.is_empty() && (part.is_none() || meta.headers.len() == 1);
            let rank = if is_plain { 0 } else { rank };
            candidates.push((penalty + rank, layer, full, channels));
        }
    }
    let Some((rank, layer, name, channels)) =
        candidates.iter().min_by_key(|(rank, layer, ..)| (*rank, *layer)).cloned()
    else {
        return Err(no_colour(file, meta));
    };
    let list = &meta.headers[layer].channels.list;
    if list.iter().any(|channel| channel.sampling != Vec2(1, 1)) {
        return Err(unsupported(file, "channels of reduced resolution, as of luminance-chroma"));
    }
    let is_guess = rank % 10 == 8 && candidates.len() > 1;
    let note = is_guess.then(|| {
        let name = name.trim_matches('.');
        format!(
            "{}: none of its {} layers is named as the main one; \"{name}\" is used.",
            file.display(),
            candidates.len()
        )
    });
    Ok((Choice { layer, channels }, note))
}

/// A channel's layer and its own name.
fn split_name(name: &str) -> (&str, &str) {
    name.rsplit_once('.').unwrap_or(("", name))
}

fn no_colour(file: &Path, meta: &MetaData) -> Error {
    if meta.headers.iter().all(|header| header.deep) {
        return unsupported(file, "deep data");
    }
    let names: Vec<String> = meta
        .headers
        .iter()
        .flat_map(|header| header.channels.list.iter().map(|channel| channel.name.to_string()))
        .collect();
    Error::Unsupported(Fault::new(
        file,
        "",
        format!(
            "it has no channels R, G and B, but {}",
            super::error::listed(names.iter().map(String::as_str))
        ),
        "Save it with channels named R, G and B",
    ))
}
