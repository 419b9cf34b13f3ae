//! RAW photographs against a scene of known radiance: DNG files written here, tag by tag, by what
//! the TIFF 6 and DNG 1.4 specifications say, and one that another program compressed.

use std::path::{Path, PathBuf};

use lobelia::exposures::options::RawColor;
use lobelia::exposures::{Codes, MergeOptions, Merged};
use lobelia::io::brackets::{self, Found};
use lobelia::io::{grouping, photograph, raw};
use lobelia::watch::Watch;

/// The sensor, with a masked edge of 4 columns and 2 rows, of which the camera shows less.
const SENSOR: [usize; 2] = [44, 34];
const ACTIVE: [usize; 4] = [2, 4, 34, 44];
const CROP: [usize; 4] = [6, 4, 32, 24];
/// At each place of the pattern, red first.
const BLACK: [f64; 4] = [500.0, 510.0, 520.0, 530.0];
const WHITE: f64 = 15000.0;
/// XYZ to camera under D65, of no camera that exists, in ten thousandths.
const MATRIX: [i32; 9] = [8000, -2500, -800, -4200, 12100, 2300, -700, 1900, 6100];

/// Camera radiance at a pixel of the crop, the same in each 2 x 2 block, so that interpolation of
/// the block's own sites is exact for green's mean only; patches are 8 pixels wide.
fn patch(x: usize, y: usize) -> [f64; 3] {
    let step = (x / 8 + 2 * (y / 8)) as f64;
    [0.05 * 1.5_f64.powf(step), 0.06 * 1.45_f64.powf(step), 0.04 * 1.6_f64.powf(step)]
}

#[derive(Clone)]
struct Entry {
    tag: u16,
    kind: u16,
    count: u32,
    bytes: Vec<u8>,
}

fn ascii(tag: u16, text: &str) -> Entry {
    let bytes: Vec<u8> = text.bytes().chain([0]).collect();
    Entry { tag, kind: 2, count: bytes.len() as u32, bytes }
}

fn bytes(tag: u16, bytes: &[u8]) -> Entry {
    Entry { tag, kind: 1, count: bytes.len() as u32, bytes: bytes.to_vec() }
}

fn shorts(tag: u16, values: &[u16]) -> Entry {
    let bytes = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    Entry { tag, kind: 3, count: values.len() as u32, bytes }
}

fn longs(tag: u16, values: &[u32]) -> Entry {
    let bytes = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    Entry { tag, kind: 4, count: values.len() as u32, bytes }
}

fn rationals(tag: u16, values: &[[u32; 2]]) -> Entry {
    let bytes = values.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
    Entry { tag, kind: 5, count: values.len() as u32, bytes }
}

/// Ten thousandths.
fn signed(tag: u16, values: &[i32]) -> Entry {
    let bytes = values.iter().flat_map(|&value| [value, 10_000]).flat_map(i32::to_le_bytes);
    Entry { tag, kind: 10, count: values.len() as u32, bytes: bytes.collect() }
}

/// A directory as it stands at `offset`, its larger values behind it.
fn directory(offset: usize, mut entries: Vec<Entry>) -> Vec<u8> {
    entries.sort_by_key(|entry| entry.tag);
    let mut table = (entries.len() as u16).to_le_bytes().to_vec();
    let mut values = Vec::new();
    let end = offset + 2 + 12 * entries.len() + 4;
    for entry in entries {
        table.extend(entry.tag.to_le_bytes());
        table.extend(entry.kind.to_le_bytes());
        table.extend(entry.count.to_le_bytes());
        if entry.bytes.len() <= 4 {
            table.extend(entry.bytes.iter().copied().chain([0; 4]).take(4));
        } else {
            table.extend(((end + values.len()) as u32).to_le_bytes());
            values.extend(entry.bytes);
            values.resize(values.len().next_multiple_of(2), 0);
        }
    }
    table.extend([0; 4]);
    table.extend(values);
    table
}

/// An uncompressed Bayer DNG of `light`, in fractions of white, for a time of 1/`inverse` s.
fn dng(inverse: u32, light: impl Fn(usize, usize) -> [f64; 3], has_matrix: bool) -> Vec<u8> {
    let [width, height] = SENSOR;
    let [top, left, ..] = ACTIVE;
    let mut samples = Vec::with_capacity(2 * width * height);
    for y in 0..height {
        for x in 0..width {
            let code = if y < top || x < left {
                // What is masked must not be seen.
                12_345.0
            } else {
                // The pattern begins at the active area.
                let (v, u) = (y - top, x - left);
                let place = 2 * (v % 2) + u % 2;
                let channel = [0, 1, 1, 2][place];
                let (shown_x, shown_y) = (u.saturating_sub(CROP[0]), v.saturating_sub(CROP[1]));
                let value = light(shown_x, shown_y)[channel].min(1.0);
                (BLACK[place] + value * (WHITE - BLACK[place])).round()
            };
            samples.extend((code as u16).to_le_bytes());
        }
    }
    let exif_at = 8 + samples.len();
    let exif = directory(
        exif_at,
        vec![
            rationals(33434, &[[1, inverse]]),
            rationals(33437, &[[8, 1]]),
            shorts(34855, &[100]),
            ascii(36867, "2026:11:22 05:06:07"),
        ],
    );
    let main_at = (exif_at + exif.len()).next_multiple_of(2);
    let quads = |values: [usize; 4]| values.map(|value| value as u32);
    let [crop_x, crop_y, crop_width, crop_height] = quads(CROP);
    let mut entries = vec![
        longs(254, &[0]),
        longs(256, &[width as u32]),
        longs(257, &[height as u32]),
        shorts(258, &[16]),
        shorts(259, &[1]),
        shorts(262, &[32803]),
        ascii(271, "Nobody"),
        ascii(272, "Sensor of a test"),
        longs(273, &[8]),
        shorts(274, &[6]),
        shorts(277, &[1]),
        longs(278, &[height as u32]),
        longs(279, &[samples.len() as u32]),
        shorts(33421, &[2, 2]),
        bytes(33422, &[0, 1, 1, 2]),
        longs(34665, &[exif_at as u32]),
        bytes(50706, &[1, 4, 0, 0]),
        ascii(50708, "Nobody Sensor of a test"),
        shorts(50713, &[2, 2]),
        rationals(50714, &BLACK.map(|black| [black as u32, 1])),
        longs(50717, &[WHITE as u32]),
        longs(50719, &[crop_x, crop_y]),
        longs(50720, &[crop_width, crop_height]),
        rationals(50728, &[[3, 10], [1, 1], [6, 10]]),
        longs(50829, &quads(ACTIVE)),
    ];
    if has_matrix {
        entries.push(signed(50721, &MATRIX));
        entries.push(shorts(50778, &[21]));
    }
    let main = directory(main_at, entries);
    let mut file = b"II\x2A\0".to_vec();
    file.extend((main_at as u32).to_le_bytes());
    file.extend(samples);
    file.extend(exif);
    file.resize(main_at, 0);
    file.extend(main);
    file
}

fn put(folder: &Path, name: &str, bytes: &[u8]) -> PathBuf {
    let file = folder.join(name);
    std::fs::write(&file, bytes).unwrap();
    file
}

/// Whether all pixels that are mixed to make a pixel lie in its patch.
fn is_inside(x: usize, y: usize) -> bool {
    (1..7).contains(&(x % 8)) && (1..7).contains(&(y % 8))
}

#[test]
fn levels_crop_and_exposure_are_those_of_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let file = put(folder.path(), "a.DNG", &dng(50, patch, true));
    let photo = photograph::read(&file).unwrap();
    assert_eq!((photo.width, photo.height), (CROP[2], CROP[3]));
    assert_eq!(photograph::head(&file).unwrap(), (CROP[2], CROP[3], 2));
    let Codes::Sixteen(codes) = &photo.codes else { panic!("8 bits") };
    let mut seen = 0;
    for y in 0..CROP[3] {
        for x in (0..CROP[2]).filter(|&x| is_inside(x, y)) {
            for (channel, value) in patch(x, y).into_iter().enumerate() {
                let own = f64::from(codes[y * CROP[2] + x][channel]) / 65535.0;
                if value >= 1.0 {
                    assert_eq!(own, 1.0, "{x} {y} {channel}");
                } else if value < 0.98 {
                    // Half a step of the sensor.
                    assert!((own - value).abs() < 6e-5, "{x} {y} {channel}: {own} for {value}");
                    seen += 1;
                }
            }
        }
    }
    assert!(seen > 1000, "{seen}");
    let shot = photograph::shot(&file).unwrap();
    assert_eq!((shot.exposure_secs, shot.f_number, shot.iso), (Some(0.02), Some(8.0), Some(100.0)));
    let later = dng(50, patch, true);
    let place = later.windows(2).position(|two| two == b":7".as_slice());
    assert!(
        place.is_none() && shot.taken_secs.unwrap() % 86400.0 == 5.0 * 3600.0 + 6.0 * 60.0 + 7.0
    );
}

/// Exposures of `patch` at 1/400, 1/100 and 1/25 s, the middle one as [`patch`] says.
fn series(folder: &Path, has_matrix: bool) -> Vec<PathBuf> {
    [(400, 0.25), (100, 1.0), (25, 4.0)]
        .iter()
        .enumerate()
        .map(|(index, &(inverse, gain))| {
            let light = |x: usize, y: usize| patch(x, y).map(|value| gain * value);
            put(folder, &format!("IMG_{index}.dng"), &dng(inverse, light, has_matrix))
        })
        .collect()
}

fn merged(files: &[PathBuf], options: &MergeOptions) -> (Merged, Found) {
    let series = grouping::group(files, None, false).unwrap();
    assert_eq!(series.len(), 1);
    let mut result = None;
    let found = brackets::merge_all(&series, None, options, &Watch::new(), |_, merged| {
        result = Some(merged);
        Ok(())
    });
    (result.unwrap(), found.unwrap())
}

/// The largest relative error of the pixels inside patches, after the scale of `unit`.
fn worst(merged: &Merged, unit: f64, truth: impl Fn(usize, usize) -> [f64; 3]) -> f64 {
    let mut worst: f64 = 0.0;
    for y in 0..merged.height {
        for x in (0..merged.width).filter(|&x| is_inside(x, y)) {
            for (own, value) in merged.pixels[y * merged.width + x].into_iter().zip(truth(x, y)) {
                worst = worst.max((f64::from(own) * unit / value - 1.0).abs());
                assert!(own.is_finite(), "{x} {y}");
            }
        }
    }
    worst
}

/// Gaussian elimination without pivots; the test's matrix needs none.
fn solve(matrix: [[f64; 3]; 3], right: [f64; 3]) -> [f64; 3] {
    let (mut a, mut b) = (matrix, right);
    for i in 0..3 {
        for row in (0..3).filter(|&row| row != i) {
            let factor = a[row][i] / a[i][i];
            let pivots = a[i];
            a[row].iter_mut().zip(pivots).for_each(|(own, pivot)| *own -= factor * pivot);
            b[row] -= factor * b[i];
        }
    }
    std::array::from_fn(|i| b[i] / a[i][i])
}

/// XYZ of linear sRGB (IEC 61966-2-1).
const XYZ: [[f64; 3]; 3] =
    [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]];

#[test]
fn a_series_merges_to_the_scene_in_either_color() {
    let folder = tempfile::tempdir().unwrap();
    let files = series(folder.path(), true);
    // 1 is what code 128 of 255 means in a second: 1/100 s to white are 100 * 255 / 128.
    let unit = 128.0 / 255.0 / 100.0;
    let options = MergeOptions { raw_color: RawColor::Camera, ..MergeOptions::default() };
    let (camera, _) = merged(&files, &options);
    let error = worst(&camera, unit, patch);
    assert!(error < 2e-3, "{error}");

    let (srgb, found) = merged(&files, &MergeOptions::default());
    assert!(found.warnings.is_empty(), "{:?}", found.warnings);
    let camera_from_srgb: [[f64; 3]; 3] = std::array::from_fn(|row| {
        std::array::from_fn(|column| {
            (0..3).map(|k| f64::from(MATRIX[3 * row + k]) * 1e-4 * XYZ[k][column]).sum()
        })
    });
    // Daylight on white keeps its green.
    let white: f64 = camera_from_srgb[1].iter().sum();
    let truth = |x: usize, y: usize| solve(camera_from_srgb, patch(x, y)).map(|own| own * white);
    let error = worst(&srgb, unit, truth);
    assert!(error < 5e-3, "{error}");
}

#[test]
fn without_a_matrix_colors_stay_and_it_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let files = series(folder.path(), false);
    assert_eq!(raw::srgb_from_camera(&files[0]).unwrap(), None);
    let (camera, found) = merged(&files, &MergeOptions::default());
    assert!(worst(&camera, 128.0 / 255.0 / 100.0, patch) < 2e-3);
    assert!(found.warnings.iter().any(|warning| warning.contains("IMG_1.dng")));
    let (one, _) = merged(&files[1..2], &MergeOptions::default());
    assert_eq!((one.width, one.height), (camera.width, camera.height));
}

/// Lossless JPEG, by liblj92, of the numbers that `make.py` beside it says.
#[test]
fn compressed_files_of_another_program_are_read() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/photographs/lossless.dng");
    let photo = photograph::read(&file).unwrap();
    let Codes::Sixteen(codes) = &photo.codes else { panic!("8 bits") };
    assert_eq!((photo.width, photo.height), (48, 32));
    for (y, x) in (0..32).flat_map(|y| (0..48).map(move |x| (y, x))) {
        // BGGR, 12 bits, black at 256.
        let channel = [[2, 1], [1, 0]][y % 2][x % 2];
        let sample = 300 + (37 * x + 61 * y + 5 * x * y) % 3500;
        let expected = (sample as f64 - 256.0) / (4095.0 - 256.0) * 65535.0;
        let own = f64::from(codes[y * 48 + x][channel]);
        assert!((own - expected).abs() <= 1.0, "{x} {y}: {own} for {expected}");
    }
}

#[test]
fn damaged_files_end_in_a_message() {
    let folder = tempfile::tempdir().unwrap();
    let sound = dng(50, patch, true);
    let refused = |bytes: &[u8], what: &str| {
        let file = put(folder.path(), "damaged.dng", bytes);
        let Err(failure) = photograph::read(&file) else {
            panic!("{} bytes are read: {what}", bytes.len());
        };
        let failure = failure.to_string();
        assert!(failure.contains("damaged.dng") && failure.ends_with('.'), "{what}: {failure}");
        failure
    };
    for length in (0..sound.len()).step_by(97) {
        refused(&sound[..length], "cut off");
    }
    // 60000 x 60000 pixels in 3 KB.
    let mut large = sound.clone();
    for tag in [256_u16, 257] {
        let entry: Vec<u8> = tag.to_le_bytes().into_iter().chain([4, 0, 1, 0, 0, 0]).collect();
        let at = large.windows(8).rposition(|own| own == entry).unwrap();
        large[at + 8..at + 12].copy_from_slice(&60_000_u32.to_le_bytes());
    }
    let failure = refused(&large, "too large");
    assert!(failure.contains("60000") || failure.contains("more pixels"), "{failure}");
    refused(b"no photograph at all, whatever its name says", "text");
    refused(b"", "empty");
    assert!(photograph::read(&folder.path().join("none.nef")).is_err());
}
