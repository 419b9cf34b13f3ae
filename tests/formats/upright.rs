//! Photographs whose EXIF says that they are stored turned: shown and used upright, as the `image`
//! crate turns them, and cameras of other programs turned with them.

use std::path::Path;

use glam::{DVec2, DVec3};
use image::metadata::Orientation as Theirs;
use image::{DynamicImage, Rgb, RgbImage};
use lobelia::io::capture::load;
use lobelia::io::import::{Options, Shot, check_shot, read, show, survey};
use lobelia::io::model;
use lobelia::io::orientation::Orientation;
use lobelia::watch::Watch;
use serde_json::{Value, json};

use crate::{data, folder, message, put};

/// A picture in which no two turns look alike, as it is stored.
fn picture(width: u32, height: u32) -> RgbImage {
    RgbImage::from_fn(width, height, |x, y| {
        Rgb([(40 + 180 * x / width) as u8, (40 + 180 * y / height) as u8, 90])
    })
}

/// Writes it as JPEG whose EXIF has an orientation (CIPA DC-008, tag 0x0112), and the focal length
/// of film where that is not 0 (0xA405).
fn jpeg(file: &Path, (width, height): (u32, u32), orientation: u8, film_mm: u16) {
    let mut bytes = Vec::new();
    let mut encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 98);
    encoder.encode_image(&picture(width, height)).unwrap();
    let entry = |tag: u16, kind: u16, value: u32| {
        let mut own = [tag.to_le_bytes(), kind.to_le_bytes()].concat();
        own.extend(1_u32.to_le_bytes());
        own.extend(value.to_le_bytes());
        own
    };
    let mut tiff = [&b"II*\0"[..], &8_u32.to_le_bytes(), &2_u16.to_le_bytes()].concat();
    tiff.extend(entry(0x0112, 3, orientation.into()));
    tiff.extend(entry(0x8769, 4, 38));
    tiff.extend(0_u32.to_le_bytes());
    tiff.extend(1_u16.to_le_bytes());
    tiff.extend(entry(0xA405, 3, film_mm.into()));
    tiff.extend(0_u32.to_le_bytes());
    let body = [&b"Exif\0\0"[..], &tiff].concat();
    let length = (body.len() as u16 + 2).to_be_bytes();
    let segment = [&[0xFF, 0xE1][..], &length, &body].concat();
    bytes.splice(2..2, segment);
    std::fs::create_dir_all(file.parent().unwrap()).unwrap();
    std::fs::write(file, bytes).unwrap();
}

/// How far a shown picture is from the file as the `image` crate turns it, in codes at worst.
fn difference(file: &Path, orientation: u8, shown: &lobelia::io::import::Shown) -> u8 {
    let mut theirs: DynamicImage = image::open(file).unwrap();
    theirs.apply_orientation(Theirs::from_exif(orientation).unwrap());
    let theirs = theirs.to_rgb8();
    assert_eq!((shown.width, shown.height), (theirs.width() as usize, theirs.height() as usize));
    let codes = theirs.as_raw().iter().zip(shown.pixels.as_flattened());
    codes.map(|(theirs, ours)| theirs.abs_diff(*ours)).max().unwrap()
}

#[test]
fn a_new_capture_shows_its_photographs_upright() {
    let folder = folder();
    for exif in 1..=8_u8 {
        let file = folder.path().join(format!("{exif}.jpg"));
        jpeg(&file, (48, 32), exif, 28);
        let capture = folder.path().join(format!("capture{exif}"));
        let new = model::new_capture(&capture, &[file], &Watch::new()).unwrap();
        let size = if exif >= 5 { (32, 48) } else { (48, 32) };
        assert_eq!(new[0].size, size);
        // 28 mm where film has a diagonal of 43.2666 mm.
        let focal = 28.0 / 43.266_615_3 * 48_f64.hypot(32.0);
        assert!((new[0].lens.focal_px.unwrap() - focal).abs() < 1e-9);
        let name = new[0].name.clone();
        assert_eq!(model::open(&capture).unwrap().model.photographs[0].size, size);
        let orientation = model::orientation(&capture, &name).unwrap();
        let image = capture.join(&name);
        let shown = show(&image, orientation, 100).unwrap();
        assert_eq!(difference(&image, exif, &shown), 0, "orientation {exif}");
        // As it is stored it looks otherwise: the pictures can be told apart.
        let stored = show(&image, Orientation::default(), 100).unwrap();
        assert_eq!(stored == shown, exif == 1);
    }
}

#[test]
fn single_exposures_are_measured_upright() {
    let folder = folder();
    put(folder.path(), "scene.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl floor\nf 1 2 3\n");
    // The stored picture as the mask: what of it is dark is left out.
    let mut mask = RgbImage::new(48, 32);
    for (x, _, pixel) in mask.enumerate_pixels_mut() {
        *pixel = Rgb([if x < 12 { 0 } else { 255 }; 3]);
    }
    let capture = |orientation: Option<Value>, mask: &RgbImage| {
        jpeg(&folder.path().join("images/a.jpg"), (48, 32), 6, 28);
        std::fs::create_dir_all(folder.path().join("masks")).unwrap();
        mask.save(folder.path().join("masks/a.jpg.png")).unwrap();
        let (w, h) = if orientation.is_some() { (32, 48) } else { (48, 32) };
        let mut frame = json!({
            "file_path": "images/a.jpg", "fl_x": 40, "w": w, "h": h,
            "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,2],[0,0,0,1]]
        });
        if let Some(orientation) = orientation {
            frame["orientation"] = orientation;
        }
        let cameras = json!({"response": "srgb", "frames": [frame]});
        put(folder.path(), "transforms.json", cameras.to_string());
        load(folder.path(), &Watch::new())
    };
    let image = |own: lobelia::scene::Capture| own.photographs[0].image.as_ref().unwrap().clone();
    let stored = image(capture(None, &mask).unwrap());
    let upright = image(capture(Some(json!(6)), &mask).unwrap());
    assert_eq!((upright.width(), upright.height()), (32, 48));
    let mut masked = 0;
    for (x, y) in (0..48).flat_map(|x| (0..32).map(move |y| (x, y))) {
        // Orientation 6: the stored left side is on top, the stored bottom is at the left.
        assert_eq!(upright.radiance(31 - y, x), stored.radiance(x, y), "{x} {y}");
        masked += usize::from(stored.radiance(x, y).is_none());
    }
    assert_eq!(masked, 12 * 32);
    // A mask of the upright size is upright already.
    let rows = RgbImage::from_fn(32, 48, |_, y| Rgb([if y < 12 { 0 } else { 255 }; 3]));
    let again = image(capture(Some(json!(6)), &rows).unwrap());
    for (x, y) in (0..32).flat_map(|x| (0..48).map(move |y| (x, y))) {
        assert_eq!(again.radiance(x, y), upright.radiance(x, y));
    }
    for wrong in [json!(0), json!(9), json!(1.5), json!("left")] {
        message(capture(Some(wrong), &mask), &["transforms.json", "frames[0]", "orientation"]);
    }
}

/// What a COLMAP model's cameras, taken as they stand, make of the golden points.
fn golden() -> (Vec<DVec3>, Vec<Value>) {
    let golden: Value =
        serde_json::from_str(include_str!("../golden/import/projections.json")).unwrap();
    let points: Vec<[f64; 3]> = serde_json::from_value(golden["points"].clone()).unwrap();
    let case = golden["cases"].as_array().unwrap().iter();
    let case = case.clone().find(|case| case["source"] == "colmap_text").unwrap().clone();
    (points.into_iter().map(DVec3::from).collect(), case["images"].as_array().unwrap().clone())
}

/// The COLMAP model with photographs that EXIF turns.
fn turned(folder: &Path, exif: u8, is_upright: bool) -> lobelia::io::import::Import {
    for image in &golden().1 {
        let [width, height]: [u32; 2] = serde_json::from_value(image["size"].clone()).unwrap();
        let size = if is_upright && exif >= 5 { (height, width) } else { (width, height) };
        let name = image["name"].as_str().unwrap().rsplit_once('.').unwrap().0.to_owned() + ".jpg";
        jpeg(&folder.join(name), size, exif, 28);
    }
    let options = Options { images: vec![folder.to_owned()], ..Options::default() };
    read(&data("import/colmap_text"), &options, &Watch::new()).unwrap()
}

/// The farthest that a camera puts a point from where COLMAP's does, once that pixel is turned.
fn farthest(shot: &Shot, by: impl Fn(DVec2, DVec2) -> DVec2) -> f64 {
    let (points, images) = golden();
    let stem = |name: &str| name.rsplit('/').next().unwrap().split('.').next().unwrap().to_owned();
    let own = |image: &&Value| stem(image["name"].as_str().unwrap()) == stem(&shot.name);
    let image = images.iter().find(own).unwrap();
    let size: [f64; 2] = serde_json::from_value(image["size"].clone()).unwrap();
    let pixels: Vec<[f64; 2]> = serde_json::from_value(image["pixels"].clone()).unwrap();
    let mut compared = 0;
    let distances = points.iter().zip(pixels).filter_map(|(point, pixel)| {
        let (ours, _) = shot.camera.project(*point)?;
        compared += 1;
        Some(ours.distance(by(size.into(), pixel.into())))
    });
    let farthest = distances.fold(0.0, f64::max);
    assert!(2 * compared > points.len());
    farthest
}

#[test]
fn cameras_of_stored_pixels_are_turned_with_their_photographs() {
    type Turned = fn(DVec2, DVec2) -> DVec2;
    let by: [(u8, Turned); 3] = [
        (3, |size, own| size - own),
        (6, |size, own| DVec2::new(size.y - own.y, own.x)),
        (8, |size, own| DVec2::new(own.y, size.x - own.x)),
    ];
    for (exif, by) in by {
        let folder = folder();
        let import = turned(folder.path(), exif, false);
        for shot in &import.shots {
            assert_eq!(shot.orientation.exif(), u32::from(exif));
            assert!(farthest(shot, by) < 1e-7, "orientation {exif}, {}", shot.name);
        }
        // The photograph, and COLMAP's own observations in it, are turned as well.
        let import = std::sync::Arc::new(import);
        let survey = survey(import.clone(), &Watch::new()).unwrap();
        for (index, shot) in import.shots.iter().enumerate() {
            let check = check_shot(&survey, index, &Watch::new()).unwrap();
            let shown = check.picture.as_ref().unwrap().as_ref().unwrap();
            assert_eq!(difference(shot.image.as_ref().unwrap(), exif, shown), 0);
            assert!(check.median_px < 1.0, "{}", check.median_px);
        }
        // The capture says so, and an import of it again keeps it.
        let capture = folder.path().join("capture");
        lobelia::io::import::write(&import, &capture, &Default::default(), &Watch::new()).unwrap();
        let again = read(&capture.join("transforms.json"), &Options::default(), &Watch::new());
        for (shot, before) in again.unwrap().shots.iter().zip(&import.shots) {
            assert_eq!(shot.orientation, before.orientation);
            assert!((shot.camera.principal_px - before.camera.principal_px).length() < 1e-9);
        }
    }
}

#[test]
fn cameras_of_turned_pixels_and_mirrored_photographs_stay() {
    // The program has turned the photograph itself: its camera has the upright size.
    let folder = folder();
    let import = turned(folder.path(), 8, true);
    assert!(!import.shots.is_empty());
    for shot in &import.shots {
        assert_eq!(shot.orientation.exif(), 8);
        assert!(farthest(shot, |_, own| own) < 1e-7);
    }
    // No camera mirrors: pixels stay as they are stored.
    let mirrored = tempfile::tempdir().unwrap();
    for shot in &turned(mirrored.path(), 2, false).shots {
        assert!(shot.orientation.is_upright());
        assert!(farthest(shot, |_, own| own) < 1e-7);
    }
}
