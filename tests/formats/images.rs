//! OpenEXR and Radiance.

use ::exr::meta::attribute::Chromaticities;
use ::exr::prelude::{Vec2, WritableImage};
use half::f16;
use lobelia::io::picture::{self, Picture};
use lobelia::io::{Error, exr, photograph};
use lobelia::scene::Values;

use crate::{data, folder, message, put};

const ACES_CG: Chromaticities = Chromaticities {
    red: Vec2(0.713, 0.293),
    green: Vec2(0.165, 0.83),
    blue: Vec2(0.128, 0.044),
    white: Vec2(0.32168, 0.33767),
};

fn read(path: &str) -> Picture {
    picture::read(&data(path)).unwrap_or_else(|error| panic!("{error}"))
}

/// Largest difference in units of `1 + value`.
fn difference(a: &Picture, b: &Picture) -> f32 {
    assert_eq!((a.width, a.height), (b.width, b.height));
    let pairs = std::iter::zip(a.pixels.iter().flatten(), b.pixels.iter().flatten());
    pairs.map(|(a, b)| (a - b).abs() / (1.0 + b.abs())).fold(0.0, f32::max)
}

#[test]
fn every_compression_gives_the_same_picture() {
    let half = read("formats/exr/exrs_f16_uncompressed.exr");
    assert!(half.pixels.iter().flatten().any(|value| *value > 0.1));
    for lossless in ["zip", "zips", "pxr24"] {
        assert_eq!(read(&format!("formats/exr/exrs_f16_{lossless}.exr")).pixels, half.pixels);
    }
    let float = read("formats/exr/exrs_f32_zip.exr");
    assert_eq!(read("formats/exr/exrs_f32_zips.exr").pixels, float.pixels);
    assert!(difference(&half, &float) < 1e-3);
    // Lossy by design: B44 keeps six bits of the range of 4 x 4 pixels, so edges may be far off
    // and the mean may not; DWAB is quantised as JPEG is.
    for lossy in ["exrs_f16_b44", "exrs_f16_b44a", "exrs_f32_dwab"] {
        let picture = read(&format!("formats/exr/{lossy}.exr"));
        let pairs = std::iter::zip(picture.pixels.iter().flatten(), float.pixels.iter().flatten());
        let sum: f32 = pairs.map(|(a, b)| (a - b).abs() / (1.0 + b.abs())).sum();
        let mean = sum / (3 * float.pixels.len()) as f32;
        assert!(mean < 0.01, "{lossy}: {mean}");
    }
}

/// Photographs keep half floats, and their values are those that [`picture::read`] gives.
#[test]
fn half_floats_stay_half_floats() {
    let folder = folder();
    let converted = folder.path().join("acescg.exr");
    let half = |value| f16::from_f32(value);
    let colour = |_: Vec2<usize>| (half(0.5), half(0.25), half(0.75));
    let channels = ::exr::image::SpecificChannels::rgb(colour);
    let mut image = ::exr::image::Image::from_channels((4, 1), channels);
    image.attributes.chromaticities = Some(ACES_CG);
    image.write().to_file(&converted).unwrap();
    let file = |name: &str| data(&format!("formats/exr/{name}.exr"));
    let half = ["exrs_f16_zip", "exrs_f16_b44", "t05", "t15"].map(|name| (file(name), true));
    let single = [file("exrs_f32_zip"), file("exrs_y_ry_by_dwaa"), converted];
    for (file, is_half) in half.into_iter().chain(single.map(|file| (file, false))) {
        let (picture, values) =
            (picture::read(&file).unwrap(), picture::read_values(&file).unwrap());
        assert_eq!((values.width, values.height), (picture.width, picture.height));
        assert_eq!(values.notes, picture.notes);
        assert_eq!(matches!(values.pixels, Values::Half(_)), is_half, "{}", file.display());
        let pixels = match values.pixels {
            Values::Half(pixels) => pixels.into_iter().map(|own| own.map(f16::to_f32)).collect(),
            Values::Single(pixels) => pixels,
        };
        let is_same = |(a, b): (&f32, &f32)| a == b || a.is_nan() && b.is_nan();
        let pairs = std::iter::zip(pixels.as_flattened(), picture.pixels.as_flattened());
        assert!(pixels.len() == picture.pixels.len() && pairs.into_iter().all(is_same));
    }
}

#[test]
fn decoded_oracles_of_others_agree() {
    for name in ["exrs_rgb_plus_y_dwaa", "exrs_y_ry_by_dwaa"] {
        let ours = read(&format!("formats/exr/{name}.exr"));
        let theirs = read(&format!("formats/exr/{name}_ground_truth.exr"));
        let error = difference(&ours, &theirs);
        assert!(error < 2e-3, "{name}: {error}");
    }
}

#[test]
fn the_data_window_is_placed_into_the_display_window() {
    // Windows as in the headers: data 400 x 300 at (0, 0) throughout.
    let inner = read("formats/exr/t05.exr");
    assert_eq!((inner.width, inner.height), (340, 260)); // display from (30, 20)
    let outer = read("formats/exr/t15.exr");
    assert_eq!((outer.width, outer.height), (481, 371)); // display from (-40, -40)
    let is_covered = |x: usize, y: usize| outer.pixels[y * 481 + x][0].is_finite();
    assert!(
        !is_covered(39, 40) && is_covered(40, 40) && is_covered(439, 339) && !is_covered(440, 339)
    );
    // The same picture in both.
    assert_eq!(inner.pixels[0], outer.pixels[(20 + 40) * 481 + 30 + 40]);
    let nan = outer.pixels.iter().filter(|pixel| pixel[0].is_nan()).count();
    assert_eq!(nan, 481 * 371 - 400 * 300);
}

#[test]
fn deep_and_colourless_files_are_refused_by_name() {
    message(picture::read(&data("formats/exr/11.deep.exr")), &["11.deep.exr", "deep data"]);
    let named = read("formats/exr/tinyexr_flaga.exr");
    assert!(named.notes[0].contains("Warstwa 1"), "{:?}", named.notes);
}

#[test]
fn nan_and_infinity_are_no_measurement() {
    let picture = read("bad/exr/oiio_nan_inf.exr");
    let image = lobelia::scene::Image::new(picture.width, picture.height, picture.pixels, None);
    assert_eq!(image.invalid_count(), 2);
}

/// A header as OpenEXR writes it, with windows of the given size.
fn header(width: i32, height: i32, compression: u8) -> Vec<u8> {
    let mut bytes = vec![0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0];
    let mut attribute = |name: &str, kind: &str, value: &[u8]| {
        bytes.extend(name.bytes().chain([0]).chain(kind.bytes()).chain([0]));
        bytes.extend((value.len() as i32).to_le_bytes());
        bytes.extend(value);
    };
    let mut channels = Vec::new();
    for name in *b"BGR" {
        channels.extend([name, 0, 2, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]);
    }
    channels.push(0);
    let window: Vec<u8> =
        [0, 0, width - 1, height - 1].iter().flat_map(|v: &i32| v.to_le_bytes()).collect();
    attribute("channels", "chlist", &channels);
    attribute("compression", "compression", &[compression]);
    attribute("dataWindow", "box2i", &window);
    attribute("displayWindow", "box2i", &window);
    attribute("lineOrder", "lineOrder", &[0]);
    attribute("pixelAspectRatio", "float", &1.0_f32.to_le_bytes());
    attribute("screenWindowCenter", "v2f", &[0; 8]);
    attribute("screenWindowWidth", "float", &1.0_f32.to_le_bytes());
    bytes.push(0);
    bytes
}

#[test]
fn images_that_claim_too_much_are_refused_before_memory_is_taken() {
    let folder = folder();
    // 2^31 pixels, and 30,000² with a table of chunks that fits.
    for (width, height, compression) in [(65536, 32768, 3), (30_000, 30_000, 3), (i32::MAX, 1, 0)] {
        let mut bytes = header(width, height, compression);
        bytes.resize(bytes.len() + 16 * height as usize, 0);
        let file = put(folder.path(), "huge.exr", bytes);
        let outcome = picture::read(&file);
        assert!(matches!(outcome, Err(Error::TooLarge(_) | Error::Invalid(_))), "{outcome:?}");
        message(outcome, &["huge.exr"]);
        assert!(exr::dimensions(&file).is_err());
    }
    // Within the limits, but the file is far too short for it.
    let mut bytes = header(8000, 8000, 3);
    bytes.resize(bytes.len() + 16 * 500, 0);
    let file = put(folder.path(), "thin.exr", bytes);
    message(picture::read(&file), &["thin.exr", "cannot hold 8000 x 8000 pixels"]);
    let text = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 65536 +X 32768\n";
    let file = put(folder.path(), "huge.hdr", text);
    message(picture::read(&file), &["huge.hdr", "32768 x 65536"]);
    let text = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8000 +X 8000\n";
    message(picture::read(&put(folder.path(), "thin.hdr", text)), &["thin.hdr", "too short"]);
}

#[test]
fn photographs_that_claim_more_than_they_can_hold_are_refused() {
    let folder = folder();
    // The densest that there are: nothing but black.
    let black = image::RgbImage::new(2048, 1024);
    for name in ["a.jpg", "a.png"] {
        let file = folder.path().join(name);
        black.save(&file).unwrap();
        let photo = photograph::read(&file).unwrap();
        assert_eq!((photo.width, photo.height), (2048, 1024));
    }
    // One block of pixels, whose frame header says 60000 x 4000.
    let file = folder.path().join("b.jpg");
    image::RgbImage::new(8, 8).save(&file).unwrap();
    let mut bytes = std::fs::read(&file).unwrap();
    let frame = bytes.windows(2).position(|pair| pair == [0xff, 0xc0]).unwrap();
    bytes[frame + 5..frame + 9].copy_from_slice(&[0x0f, 0xa0, 0xea, 0x60]);
    let file = put(folder.path(), "b.jpg", &bytes);
    message(photograph::read(&file), &["b.jpg", "cannot hold", "60000 x 4000"]);
}

/// A Radiance file of one pixel, with further header lines.
fn one_pixel(lines: &str, size: &str) -> Vec<u8> {
    let mut bytes = format!("#?RADIANCE\n{lines}FORMAT=32-bit_rle_rgbe\n\n{size}\n").into_bytes();
    bytes.extend([128, 64, 32, 129]); // 1, 0.5, 0.25
    bytes
}

#[test]
fn radiance_headers_are_honoured() {
    let folder = folder();
    let read = |lines: &str, size: &str| {
        picture::read(&put(folder.path(), "a.hdr", one_pixel(lines, size)))
    };
    assert_eq!(read("", "-Y 1 +X 1").unwrap().pixels, [[1.0, 0.5, 0.25]]);
    // Both have been multiplied in, and cumulate, so they are divided out.
    let scaled = read("EXPOSURE=2\nEXPOSURE= 0.25\nCOLORCORR=1 2 4\n", "-Y 1 +X 1").unwrap();
    assert_eq!(scaled.pixels, [[2.0, 0.5, 0.125]]);
    message(read("EXPOSURE=nan\n", "-Y 1 +X 1"), &["a.hdr, line 2", "EXPOSURE"]);
    message(read("EXPOSURE=0\n", "-Y 1 +X 1"), &["EXPOSURE"]);
    message(read("FORMAT=32-bit_rle_xyze\n", "-Y 1 +X 1"), &["32-bit_rle_xyze", "RGBE"]);
    message(read("", "+Y 1 +X 1"), &["turned or mirrored"]);
    message(read("", "-Y 0 +X 0"), &["zero"]);
    message(read("", "-Y -7 +X -9"), &["no whole number"]);
    message(read("", "-Y 1"), &["-Y 480 +X 640"]);
}

#[test]
fn radiance_samples_have_the_values_of_their_bytes() {
    let picture = read("formats/hdr/rgbr4x4.hdr");
    // Red, green, blue, red rows, as its name says and other readers show.
    let strongest = |row: usize| {
        let pixel = picture.pixels[4 * row];
        (0..3).max_by(|a, b| pixel[*a].total_cmp(&pixel[*b])).unwrap()
    };
    let rows: Vec<usize> = (0..4).map(strongest).collect();
    let columns: Vec<usize> = (0..4)
        .map(|x| {
            (0..3).max_by(|a, b| picture.pixels[x][*a].total_cmp(&picture.pixels[x][*b])).unwrap()
        })
        .collect();
    assert!(rows == [0, 1, 2, 0] || columns == [0, 1, 2, 0], "{rows:?} {columns:?}");
    assert_eq!(
        (read("formats/hdr/image1.hdr").width, read("formats/hdr/scale.hdr").width),
        (128, 256)
    );
}

/// The same colours in Rec. 709 and in ACEScg: 0.18 grey, and the red that ACEScg's matrix to Rec. 709
/// (colour-science, tests/golden/color) makes of its first primary.
#[test]
fn stated_colours_are_converted_to_rec_709() {
    let folder = crate::folder();
    let file = folder.path().join("a.exr");
    let write = |chromaticities| {
        let pixels = [[0.18f32; 3], [1.0, 0.0, 0.0], [-1.0, 0.5, 0.5], [f32::INFINITY, 0.0, 0.0]];
        let pixel = move |place: Vec2<usize>| {
            let [r, g, b] = pixels[place.x()];
            (r, g, b)
        };
        let channels = ::exr::image::SpecificChannels::rgb(pixel);
        let mut image = ::exr::image::Image::from_channels((4, 1), channels);
        image.attributes.chromaticities = chromaticities;
        image.write().to_file(&file).unwrap();
        lobelia::io::exr::read(&file).unwrap()
    };
    let read = write(Some(ACES_CG));
    assert!(read.notes.is_empty());
    assert!(read.pixels[0].iter().all(|v| (v - 0.18).abs() < 1e-6), "{:?}", read.pixels[0]);
    let golden = include_str!("../golden/color/matrices.json");
    let golden: serde_json::Value = serde_json::from_str(golden).unwrap();
    for (row, value) in read.pixels[1].iter().enumerate() {
        let expected = golden["spaces"]["ACEScg"]["rec709_from"][row][0].as_f64().unwrap().max(0.0);
        assert!((f64::from(*value) - expected).abs() < 1e-5, "{value} for {expected}");
    }
    // What was no measurement stays none.
    assert_eq!(read.pixels[2], [-1.0, 0.5, 0.5]);
    assert!(read.pixels[3][0].is_infinite());
    // Nothing stated, and nonsense stated.
    assert_eq!(write(None).pixels[1], [1.0, 0.0, 0.0]);
    let nonsense = write(Some(Chromaticities { green: ACES_CG.red, ..ACES_CG }));
    assert_eq!(nonsense.pixels[1], [1.0, 0.0, 0.0]);
    assert!(nonsense.notes[0].contains("chromaticities"), "{:?}", nonsense.notes);
}

#[test]
fn written_files_state_rec_709() {
    let folder = crate::folder();
    let file = folder.path().join("a.exr");
    lobelia::io::exr::write_rgb(&file, 1, 1, &[[1.0, 2.0, 3.0]]).unwrap();
    let meta = ::exr::meta::MetaData::read_from_file(&file, false).unwrap();
    let stated = meta.headers[0].shared_attributes.chromaticities.unwrap();
    let places = [stated.red, stated.green, stated.blue, stated.white].map(|v| [v.x(), v.y()]);
    assert_eq!(places, [[0.64, 0.33], [0.3, 0.6], [0.15, 0.06], [0.3127, 0.329]]);
    assert_eq!(lobelia::io::exr::read(&file).unwrap().pixels, [[1.0, 2.0, 3.0]]);
}

/// `image` reads the tags that were written: sRGB, and what stands for it where it is not known.
#[test]
fn written_pictures_state_srgb() {
    use lobelia::io::export::pictures::{Development, write_png};
    let folder = crate::folder();
    let file = folder.path().join("a.png");
    let pixels = [[0.0, 0.5, 1.0], [0.2; 3]];
    let codes = |pixel: [f32; 3]| pixel.map(|v| (255.0 * v).round() as u8);
    let development = Development::By(std::sync::Arc::new(codes));
    write_png(&file, 2, 1, &pixels, None, &development).unwrap();
    let bytes = std::fs::read(&file).unwrap();
    // Chunks before the pixels: relative colorimetric (1), 1/2.2 and the chromaticities of Rec. 709.
    let chunk = |name: &[u8]| {
        let at = bytes.windows(4).position(|own| own == name).expect("the chunk is there");
        assert!(at < bytes.windows(4).position(|own| own == b"IDAT").unwrap());
        let length = u32::from_be_bytes(bytes[at - 4..at].try_into().unwrap()) as usize;
        bytes[at + 4..at + 4 + length].to_vec()
    };
    assert_eq!(chunk(b"sRGB"), [1]);
    assert_eq!(chunk(b"gAMA"), 45455_u32.to_be_bytes());
    let places: Vec<u8> = [31270_u32, 32900, 64000, 33000, 30000, 60000, 15000, 6000]
        .into_iter()
        .flat_map(u32::to_be_bytes)
        .collect();
    assert_eq!(chunk(b"cHRM"), places);
    let read = image::open(&file).unwrap().into_rgb8();
    assert_eq!(read.into_raw(), [0, 128, 255, 51, 51, 51]);
}
