//! `merge`: files in, radiance out.

use std::fs;
use std::path::{Path, PathBuf};

use image::{ExtendedColorType, ImageEncoder, ImageFormat, RgbImage};
use lobelia::io::exr;

use super::{Run, lobelia};

const SIDE: u32 = 40;

/// Radiance of a test scene: three decades from left to right.
fn radiance(x: u32, y: u32) -> f64 {
    let (u, v) = (f64::from(x) / f64::from(SIDE), f64::from(y) / f64::from(SIDE));
    (-3.5 + 6.0 * u + 0.8 * v).exp()
}

/// A photograph with gamma 2.2.
fn picture(time: f64, gain: f64) -> RgbImage {
    RgbImage::from_fn(SIDE, SIDE, |x, y| {
        let code = 255.0 * (gain * radiance(x, y) * time).powf(1.0 / 2.2);
        let code = code.round().clamp(0.0, 255.0) as u8;
        image::Rgb([code, code, code])
    })
}

/// A JPEG whose EXIF states exposure time and, as text, when it was taken.
fn jpeg(file: &Path, picture: &RgbImage, time: (u32, u32), taken: &str) {
    let mut bytes = Vec::new();
    let mut encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 100);
    encoder.set_exif_metadata(exif(time, taken)).unwrap();
    encoder.write_image(picture, SIDE, SIDE, ExtendedColorType::Rgb8).unwrap();
    fs::write(file, bytes).unwrap();
}

/// TIFF structure, little-endian: one directory that points to one with two fields.
fn exif((above, below): (u32, u32), taken: &str) -> Vec<u8> {
    assert_eq!(taken.len(), 19);
    let mut bytes = b"II\x2a\0\x08\0\0\0\x01\0".to_vec();
    let entry = |tag: u16, kind: u16, count: u32, value: u32| {
        [&tag.to_le_bytes()[..], &kind.to_le_bytes(), &count.to_le_bytes(), &value.to_le_bytes()]
            .concat()
    };
    bytes.extend(entry(0x8769, 4, 1, 26));
    bytes.extend([0; 4]);
    bytes.extend(2_u16.to_le_bytes());
    bytes.extend(entry(0x829A, 5, 1, 56));
    bytes.extend(entry(0x9003, 2, 20, 64));
    bytes.extend([0; 4]);
    bytes.extend([above.to_le_bytes(), below.to_le_bytes()].concat());
    bytes.extend(taken.as_bytes());
    bytes.push(0);
    bytes
}

/// Three exposures two stops apart, `IMG_<first>.jpg` and so on.
pub fn series(folder: &Path, first: usize, minute: usize, gain: f64) -> Vec<PathBuf> {
    [(1, 16), (1, 4), (1, 1)]
        .into_iter()
        .enumerate()
        .map(|(index, (above, below))| {
            let file = folder.join(format!("IMG_{}.jpg", first + index));
            let time = f64::from(above) / f64::from(below);
            let taken = format!("2024:05:01 12:{minute:02}:{:02}", 2 * index);
            jpeg(&file, &picture(time, gain), (above, below), &taken);
            file
        })
        .collect()
}

fn merge(files: &[PathBuf], out: &Path) -> std::process::Command {
    let mut command = lobelia();
    command.arg("merge").args(files).arg("--out").arg(out);
    command
}

/// The median ratio of merged radiance to the truth, and the median deviation from it.
fn compare(file: &Path, gain: f64) -> (f64, f64) {
    let merged = exr::read(file).unwrap();
    let mut ratios: Vec<f64> = merged
        .pixels
        .iter()
        .enumerate()
        .filter(|(_, pixel)| pixel[1].is_finite())
        .map(|(index, pixel)| {
            let (x, y) = (index as u32 % SIDE, index as u32 / SIDE);
            f64::from(pixel[1]) / (gain * radiance(x, y))
        })
        .collect();
    let median = |values: &mut Vec<f64>| {
        let middle = values.len() / 2;
        *values.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    let scale = median(&mut ratios);
    let mut errors: Vec<f64> = ratios.iter().map(|ratio| (ratio / scale - 1.0).abs()).collect();
    (scale, median(&mut errors))
}

#[test]
fn times_come_from_exif_and_series_share_a_scale() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("merged");
    let mut files = series(folder.path(), 2600, 0, 1.0);
    files.extend(series(folder.path(), 2603, 1, 0.5));
    // The order on the command line does not matter.
    files.reverse();
    let curve = folder.path().join("curve.csv");
    let run = Run::of(merge(&files, &out).arg("--curve").arg(&curve)).succeeds();
    assert!(run.out.contains("1/16 s") && run.out.contains("2.00 stops more"), "{}", run.out);
    assert_eq!(fs::read_dir(&out).unwrap().count(), 2);
    let (first, error) = compare(&out.join("IMG_2601.exr"), 1.0);
    assert!(error < 0.02, "{error}");
    let (second, error) = compare(&out.join("IMG_2604.exr"), 0.5);
    assert!(error < 0.02, "{error}");
    assert!((second / first - 1.0).abs() < 0.02, "{first} {second}");
    assert!(curve.exists() && curve.with_extension("svg").exists());

    // Several images do not fit into one file; nor is one file a series.
    let single = folder.path().join("x.exr");
    Run::of(&mut merge(&files, &single)).fails(1, &["2 series", "--one", "folder"]);
    Run::of(&mut merge(&files[..1], &single)).fails(1, &["alone", "IMG_2605.jpg"]);
    // One series, with the response of before, is on the same scale.
    files.retain(|file| !file.to_string_lossy().contains("IMG_2600"));
    let files: Vec<PathBuf> = series(folder.path(), 2600, 0, 1.0);
    Run::of(merge(&files, &single).arg("--response").arg(&curve)).succeeds();
    assert!((compare(&single, 1.0).0 / first - 1.0).abs() < 1e-3);
}

/// Exposures without EXIF, `0.png` and so on.
fn numbered(folder: &Path, times: &[f64]) -> Vec<PathBuf> {
    let one = |(index, &time): (usize, &f64)| {
        let file = folder.join(format!("{index}.png"));
        picture(time, 1.0).save_with_format(&file, ImageFormat::Png).unwrap();
        file
    };
    times.iter().enumerate().map(one).collect()
}

#[test]
fn times_may_be_given_and_are_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("x.exr");
    let files = numbered(folder.path(), &[0.0625, 0.25, 1.0]);
    Run::of(&mut merge(&files, &out)).fails(1, &["0.png", "exposure time", "--times"]);
    Run::of(merge(&files, &out).args(["--times", "1/16,1/4,1"])).succeeds();
    let (_, error) = compare(&out, 1.0);
    assert!(error < 0.02, "{error}");
    let table = folder.path().join("times.csv");
    fs::write(&table, "file,exposure_s\n0.png,1/16\n1.png,0.25\n2.png,1\n").unwrap();
    let before = fs::read(&out).unwrap();
    Run::of(merge(&files, &out).arg("--times").arg(&table)).succeeds();
    assert_eq!(fs::read(&out).unwrap(), before);
    Run::of(merge(&files, &out).args(["--times", "1/16,1/4"])).fails(1, &["2.png", "2 times"]);
    fs::write(&table, "file,exposure_s\n0.png,1/16\n1.png,fast\n").unwrap();
    Run::of(merge(&files, &out).arg("--times").arg(&table)).fails(1, &["times.csv", "line 3"]);
}

#[test]
fn wrong_times_are_warned_of() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("x.exr");
    let files = numbered(folder.path(), &[0.0625, 0.125, 0.25, 0.5, 0.5, 0.5]);
    let run = Run::of(merge(&files, &out).args(["--times", "1/16,1/8,1/4,1/2,1,2"])).succeeds();
    let run = run.says(&["contradict", "3.png", "4.png", "5.png", "left out"]);
    assert!(!run.err.contains("0.png"), "{}", run.err);
    let (_, error) = compare(&out, 1.0);
    assert!(error < 0.02, "{error}");
}

#[test]
fn other_files_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("x.exr");
    let put = |name: &str, bytes: &[u8]| {
        let file = folder.path().join(name);
        fs::write(&file, bytes).unwrap();
        file
    };
    let sound = series(folder.path(), 1, 0, 1.0);
    let cases: [(PathBuf, &[&str]); 4] = [
        (put("a.CR2", b"II\x2a\0"), &["a.CR2", "RAW", "damaged", "Copy it"]),
        (put("b.jpg", &[0xFF, 0xD8, 0xFF, 0xE0, 0, 1]), &["b.jpg", "damaged"]),
        (put("c.jpg", b"text"), &["c.jpg", "no JPEG, PNG, TIFF or RAW photograph"]),
        (folder.path().join("none.jpg"), &["none.jpg", "cannot be read"]),
    ];
    for (file, parts) in cases {
        let files = [sound[0].clone(), sound[1].clone(), file];
        let mut command = merge(&files, &out);
        Run::of(command.args(["--one", "--times", "1,2,4"])).fails(1, parts);
        assert!(!out.exists());
    }
    let large = folder.path().join("large.png");
    image::imageops::resize(&picture(1.0, 1.0), 50, 40, image::imageops::FilterType::Nearest)
        .save(&large)
        .unwrap();
    let files = [sound[0].clone(), large];
    Run::of(merge(&files, &out).args(["--one", "--times", "1,2"]))
        .fails(1, &["large.png", "50 x 40", "40 x 40"]);
    Run::of(merge(&sound, &out).args([
        "--merge.vignetting_a",
        "-0.95",
        "--merge.vignetting_b",
        "-0.5",
    ]))
    .fails(1, &["vignetting"]);
    Run::of(merge(&sound, &out).args(["--merge.weights", "none"])).fails(2, &["noise", "hat"]);
}

/// What the sensor measured needs no series to be linear, and no response.
#[test]
fn one_raw_photograph_is_enough() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("x.exr");
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/photographs/lossless.dng");
    let mut command = merge(&[file], &out);
    let run = Run::of(command.args(["--merge.raw_color", "camera"])).succeeds();
    assert!(run.out.contains("linear") && run.out.contains("48×32"), "{}", run.out);
    let read = exr::read(&out).unwrap();
    // The first site is blue, and holds 300 of 256 to 4095, in 1/60 s.
    let blue = (300.0 - 256.0) / (4095.0 - 256.0) * (255.0 / 128.0) * 60.0;
    assert!((read.pixels[0][2] / blue - 1.0).abs() < 2e-3, "{:?} for {blue}", read.pixels[0]);
}

#[test]
fn sixteen_bits_are_linear() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("x.exr");
    let files: Vec<PathBuf> = [0.01, 0.1, 1.0]
        .into_iter()
        .enumerate()
        .map(|(index, time)| {
            let file = folder.path().join(format!("{index}.tif"));
            let picture: image::ImageBuffer<image::Rgb<u16>, Vec<u16>> =
                image::ImageBuffer::from_fn(SIDE, SIDE, |x, y| {
                    let code = (20_000.0 * radiance(x, y) * time).round().clamp(0.0, 65_535.0);
                    image::Rgb([code as u16; 3])
                });
            picture.save_with_format(&file, ImageFormat::Tiff).unwrap();
            file
        })
        .collect();
    let run = Run::of(merge(&files, &out).args(["--times", "0.01,0.1,1"])).succeeds();
    assert!(run.out.contains("response: linear"), "{}", run.out);
    let (scale, error) = compare(&out, 1.0);
    assert!(error < 1e-3, "{error}");
    assert!((scale / (20_000.0 / 257.0 / 128.0) - 1.0).abs() < 1e-3, "{scale}");
}

#[test]
fn one_exposure_is_enough_where_the_response_is_known() {
    let folder = tempfile::tempdir().unwrap();
    // A file for screens: IEC 61966-2-1 written out, so that radiance x / SIDE comes back.
    let picture = RgbImage::from_fn(SIDE, SIDE, |x, _| {
        let linear = f64::from(x) / f64::from(SIDE);
        let value = if linear <= 0.0031308 {
            12.92 * linear
        } else {
            1.055 * linear.powf(1.0 / 2.4) - 0.055
        };
        image::Rgb([(255.0 * value).round() as u8; 3])
    });
    let file = folder.path().join("a.png");
    picture.save_with_format(&file, ImageFormat::Png).unwrap();
    let out = folder.path().join("a.exr");
    let merge = |response: &[&str]| {
        let mut command = lobelia();
        command.arg("merge").arg(&file).args(["--times", "2"]).arg("--out").arg(&out);
        Run::of(command.args(response))
    };
    merge(&[]).fails(1, &["alone", "--response"]);
    merge(&["--response", "srgb"]).succeeds();
    let image = exr::read(&out).unwrap();
    let at = |x: u32| f64::from(image.pixels[(SIDE * 7 + x) as usize][1]);
    // Against the pixel in the middle, a code being 1 part in 100 of it or less.
    for x in [8, 15, 30, 38] {
        let expected = f64::from(x) / 20.0;
        assert!((at(x) / at(20) - expected).abs() < 0.02 * expected, "{x}: {}", at(x) / at(20));
    }
    // Code 128 in one second is 1; this was two.
    let middle = ((128.0 / 255.0 + 0.055) / 1.055f64).powf(2.4);
    assert!((at(20) / (0.5 / middle / 2.0) - 1.0).abs() < 0.02, "{}", at(20));
}
