//! Radiance `.hdr` photographs.
//!
//! The header is read here, before the `image` crate decodes the pixels, since that one believes
//! any size, takes XYZE for RGBE and drops exposures. `EXPOSURE` says by what the pixels have
//! been multiplied (Radiance's filefmts: "the original pixel values must be derived by taking
//! the values in the file and dividing by all the EXPOSURE settings multiplied together"), and
//! `COLORCORR` the same for each channel, so both are divided out: only then do the images of a
//! capture share one unit.

use std::fs::File;
use std::io::{BufRead, BufReader, Cursor, Read};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use ::image::ImageDecoder;
use ::image::codecs::hdr::HdrDecoder;

use super::picture::{LARGEST_BYTES, LARGEST_SIDE_PRODUCT, Picture, too_large};
use super::{Error, Fault};
use crate::math::rgb::Radiance;

const LARGEST_HEADER: u64 = 1 << 16;
/// Up to this size, in bytes, an image is decoded whatever its file's size: it does no harm.
const HARMLESS: u64 = 64 << 20;

/// What the header says.
struct Header {
    width: usize,
    height: usize,
    /// By what each channel of the file has been multiplied.
    multiplied: [f64; 3],
}

/// Width and height, from the header alone.
pub fn dimensions(file: &Path) -> Result<(usize, usize), Error> {
    let header = read_header(file)?;
    Ok((header.width, header.height))
}

/// The file's radiance, its exposure divided out.
pub fn read(file: &Path) -> Result<Picture, Error> {
    let header = read_header(file)?;
    let unreadable = |source| Error::Read { file: file.to_owned(), source };
    let bytes = std::fs::read(file).map_err(unreadable)?;
    let (width, height) = (header.width, header.height);
    let decode = || {
        let decoder = HdrDecoder::new_nonstrict(Cursor::new(&bytes))?;
        let mut buffer = vec![0; width * height * std::mem::size_of::<Radiance>()];
        if decoder.total_bytes() != buffer.len() as u64 {
            return Ok(None);
        }
        decoder.read_image(&mut buffer).map(|()| Some(buffer))
    };
    let decoded = catch_unwind(AssertUnwindSafe(decode))
        .map_err(|_| damaged(file, "pixels", "its contents contradict its header"))?
        .map_err(|failure: ::image::ImageError| damaged(file, "pixels", &failure.to_string()))?
        .ok_or_else(|| damaged(file, "header", "it states two sizes"))?;
    let scale = header.multiplied.map(|factor| 1.0 / factor);
    let channel =
        |bytes: [u8; 4], scale: f64| (f64::from(f32::from_ne_bytes(bytes)) * scale) as f32;
    let pixels = decoded
        .as_chunks::<12>()
        .0
        .iter()
        .map(|bytes| {
            let [r, g, b] =
                [0, 4, 8].map(|at| [bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]);
            [channel(r, scale[0]), channel(g, scale[1]), channel(b, scale[2])]
        })
        .collect();
    Ok(Picture { width, height, pixels, notes: Vec::new() })
}

fn damaged(file: &Path, place: &str, reason: &str) -> Error {
    Error::Invalid(Fault::new(
        file,
        place,
        format!("this Radiance file is damaged or cut off ({reason})"),
        "Export or copy it again, or remove its frame from the camera file",
    ))
}

fn read_header(file: &Path) -> Result<Header, Error> {
    let unreadable = |source| Error::Read { file: file.to_owned(), source };
    let open = File::open(file).map_err(unreadable)?;
    let bytes = open.metadata().map_err(unreadable)?.len();
    let mut lines = BufReader::new(open.take(LARGEST_HEADER)).split(b'\n');
    let mut number = 0;
    let mut next = || -> Result<(String, String), Error> {
        number += 1;
        match lines.next() {
            Some(Ok(line)) => Ok((
                String::from_utf8_lossy(&line).trim_end_matches('\r').to_owned(),
                format!("line {number}"),
            )),
            Some(Err(source)) => Err(unreadable(source)),
            None => Err(damaged(file, &format!("line {number}"), "the header does not end")),
        }
    };
    let (signature, place) = next()?;
    if !["#?RADIANCE", "#?RGBE"].contains(&signature.trim()) {
        return Err(damaged(file, &place, "it does not begin with #?RADIANCE"));
    }
    let mut multiplied = [1.0; 3];
    loop {
        let (line, place) = next()?;
        if line.is_empty() {
            break;
        }
        read_attribute(file, &line, &place, &mut multiplied)?;
    }
    let (line, place) = next()?;
    let (width, height) = read_resolution(file, &line, &place)?;
    if width * height > LARGEST_SIDE_PRODUCT
        || width * height * std::mem::size_of::<Radiance>() as u64 > LARGEST_BYTES
    {
        return Err(too_large(file, width, height));
    }
    // Runs hold at most 127 pixels of 12 bytes in 8; the older scheme can do better, but a
    // photograph that shrinks two thousandfold holds nothing to measure.
    let claimed = width * height * std::mem::size_of::<Radiance>() as u64;
    if claimed > HARMLESS && claimed > 2000 * bytes {
        return Err(damaged(file, &place, "the file is too short for its size in pixels"));
    }
    Ok(Header { width: width as usize, height: height as usize, multiplied })
}

fn read_attribute(
    file: &Path,
    line: &str,
    place: &str,
    multiplied: &mut [f64; 3],
) -> Result<(), Error> {
    let Some((key, value)) = line.split_once('=') else { return Ok(()) };
    let factors = || {
        let factors: Vec<f64> =
            value.split_whitespace().map(|word| word.parse().unwrap_or(f64::NAN)).collect();
        let sound = factors.iter().all(|factor| factor.is_finite() && *factor > 0.0);
        if sound && !factors.is_empty() {
            return Ok(factors);
        }
        Err(Error::Invalid(Fault::new(
            file,
            place,
            format!("{key} must be a positive number, not \"{}\"", value.trim()),
            "Correct the header, or export the file again",
        )))
    };
    match key.trim() {
        "FORMAT" if value.trim() == "32-bit_rle_rgbe" => {}
        "FORMAT" => {
            return Err(Error::Unsupported(Fault::new(
                file,
                place,
                format!("pixels of format \"{}\" are not read", value.trim()),
                "Save it as RGBE, or better as OpenEXR",
            )));
        }
        "EXPOSURE" => {
            let factor = factors()?[0];
            multiplied.iter_mut().for_each(|product| *product *= factor);
        }
        "COLORCORR" => {
            let factors = factors()?;
            for (product, factor) in multiplied.iter_mut().zip(factors.iter().cycle()) {
                *product *= factor;
            }
        }
        _ => {}
    }
    Ok(())
}

/// The line `-Y height +X width`; the seven other orders are turned or mirrored images.
fn read_resolution(file: &Path, line: &str, place: &str) -> Result<(u64, u64), Error> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let (rows, height, columns, width) = match words.as_slice() {
        [rows, height, columns, width] => (*rows, height.parse(), *columns, width.parse()),
        _ => return Err(damaged(file, place, "there is no size of the form -Y 480 +X 640")),
    };
    let (Ok(width), Ok(height)) = (width, height) else {
        return Err(damaged(file, place, "the size is no whole number"));
    };
    // Bounded, so that products below do not overflow.
    if !(1..=1 << 31).contains(&width) || !(1..=1_u64 << 31).contains(&height) {
        return Err(damaged(file, place, "the size is zero or absurd"));
    }
    match (rows, columns) {
        ("-Y", "+X") => Ok((width, height)),
        ("-Y" | "+Y" | "-X" | "+X", "-Y" | "+Y" | "-X" | "+X") => {
            Err(Error::Unsupported(Fault::new(
                file,
                place,
                format!("turned or mirrored images ({rows} {columns}) are not read"),
                "Save it upright (-Y +X), or as OpenEXR",
            )))
        }
        _ => Err(damaged(file, place, "there is no size of the form -Y 480 +X 640")),
    }
}
