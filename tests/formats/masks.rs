//! Masks by every name that other programs give them, opacity, and masks that cannot be used.

use std::path::Path;

use exr::prelude::WritableImage;
use image::{GrayImage, Luma, LumaA, Rgba};
use lobelia::io::{capture, import};
use lobelia::scene::{Capture, Image};
use lobelia::watch::Watch;
use serde_json::{Value, json};

use crate::{folder, message, put};

const SIZE: (usize, usize) = (4, 2);

/// A capture of one photograph below `images/set`.
fn sound(folder: &Path, more: &Value) {
    put(folder, "scene.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl floor\nf 1 2 3\n");
    let mut frame = json!({"file_path": "images/set/a.exr",
        "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,2],[0,0,0,1]]});
    frame.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
    put(
        folder,
        "transforms.json",
        json!({"fl_x": 5, "w": 4, "h": 2, "frames": [frame]}).to_string(),
    );
    std::fs::create_dir_all(folder.join("images/set")).unwrap();
    let file = folder.join("images/set/a.exr");
    lobelia::io::exr::write_rgb(&file, SIZE.0, SIZE.1, &[[1.0; 3]; 8]).unwrap();
}

/// Black in the first row but its last pixel, else `white`.
fn mask(file: &Path, white: u8) {
    std::fs::create_dir_all(file.parent().unwrap()).unwrap();
    let value = |x, y| Luma([if y == 0 && x < 3 { 0 } else { white }]);
    GrayImage::from_fn(4, 2, value).save(file).unwrap();
}

fn load(folder: &Path) -> Capture {
    capture::load(folder, &Watch::new()).unwrap()
}

fn image(capture: &Capture) -> &Image {
    capture.photographs[0].image.as_ref().unwrap()
}

/// Whether the first three pixels are left out, and they alone.
fn is_masked(image: &Image) -> bool {
    let measured = (0..8).map(|k| image.radiance(k % 4, k / 4).is_some());
    let masked = (0..8).map(|k| image.is_masked(k % 4, k / 4));
    measured.eq((0..8).map(|k| k >= 3))
        && masked.eq((0..8).map(|k| k < 3))
        && (image.masked_count(), image.invalid_count()) == (3, 0)
}

#[test]
fn masks_are_found_by_the_names_of_other_programs() {
    // COLMAP repeats the whole name, also that of the photograph which became an .exr; Metashape
    // writes {filename}_mask.png.
    for name in ["a.exr.png", "a.jpg.png", "a.JPG.png", "a.png", "a_mask.png"] {
        let folder = folder();
        sound(folder.path(), &json!({}));
        assert_eq!(image(&load(folder.path())).masked_count(), 0);
        mask(&folder.path().join("masks/set").join(name), 255);
        let capture = load(folder.path());
        assert!(is_masked(image(&capture)), "{name}");
        assert!(capture.warnings.is_empty(), "{:?}", capture.warnings);
    }
    let folder = folder();
    sound(folder.path(), &json!({"mask_path": "mine/m.png"}));
    mask(&folder.path().join("mine/m.png"), 255);
    assert!(is_masked(image(&load(folder.path()))));
}

#[test]
fn zero_and_one_are_black_and_white_too() {
    for white in [1, 200, 255] {
        let folder = folder();
        sound(folder.path(), &json!({}));
        mask(&folder.path().join("masks/set/a.png"), white);
        assert!(is_masked(image(&load(folder.path()))), "{white}");
    }
    // All of it black: nothing is measured, and that is said.
    let folder = folder();
    sound(folder.path(), &json!({}));
    mask(&folder.path().join("masks/set/a.png"), 0);
    let capture = load(folder.path());
    assert_eq!(image(&capture).masked_count(), 8);
    assert!(capture.warnings[0].contains("masked"), "{:?}", capture.warnings);
}

#[test]
fn transparent_parts_of_a_mask_are_left_out() {
    let folder = folder();
    sound(folder.path(), &json!({"mask_path": "m.png"}));
    let value = |x: u32, y| u8::from(y != 0 || x == 3) * 255;
    let rgba = image::RgbaImage::from_fn(4, 2, |x, y| Rgba([255, 255, 255, value(x, y)]));
    rgba.save(folder.path().join("m.png")).unwrap();
    assert!(is_masked(image(&load(folder.path()))));
    let deep =
        image::ImageBuffer::from_fn(4, 2, |x, y| LumaA([u16::from(value(x, y)) * 257, 65535]));
    deep.save(folder.path().join("m.png")).unwrap();
    assert!(is_masked(image(&load(folder.path()))));
}

#[test]
fn what_a_photograph_does_not_cover_is_left_out() {
    let write = |file: &Path, alpha: &(dyn Fn(usize) -> f32 + Sync)| {
        let pixel = |p: exr::math::Vec2<usize>| (1.0f32, 1.0f32, 1.0f32, alpha(p.y() * 4 + p.x()));
        exr::image::Image::from_channels((4, 2), exr::image::SpecificChannels::rgba(pixel))
            .write()
            .to_file(file)
            .unwrap();
    };
    let folder = folder();
    sound(folder.path(), &json!({}));
    let file = folder.path().join("images/set/a.exr");
    // Half covered pixels hold half of something else.
    write(&file, &|k| if k < 3 { 0.5 * (k % 2) as f32 } else { 0.9995 });
    assert!(is_masked(image(&load(folder.path()))));
    // An alpha channel that nobody filled.
    write(&file, &|_| 0.0);
    let capture = load(folder.path());
    assert_eq!(image(&capture).masked_count(), 0);
    assert!(capture.warnings[0].contains("covers no pixel"), "{:?}", capture.warnings);
}

#[test]
fn masks_that_cannot_be_used_are_named() {
    let folder = folder();
    let path = folder.path();
    let fails = |parts: &[&str]| message(capture::load(path, &Watch::new()), parts);
    sound(path, &json!({"mask_path": "masks/none.png"}));
    fails(&["frames[0]", "mask_path", "masks/none.png", "does not exist", "remove mask_path"]);
    sound(path, &json!({"mask_path": "../m.png"}));
    fails(&["outside of the folder"]);
    sound(path, &json!({"mask_path": 3}));
    fails(&["mask_path"]);
    sound(path, &json!({"mask_path": "m.png"}));
    GrayImage::new(3, 2).save(path.join("m.png")).unwrap();
    fails(&["m.png", "3 x 2", "4 x 2"]);
    mask(&path.join("m.png"), 255);
    let whole = std::fs::read(path.join("m.png")).unwrap();
    for length in 0..whole.len() {
        put(path, "m.png", &whole[..length]);
        let _ = capture::load(path, &Watch::new());
    }
    put(path, "m.png", &whole[..whole.len() / 2]);
    fails(&["m.png", "cannot be read", "PNG"]);
}

#[test]
fn masks_come_along_with_an_import() {
    let source = folder();
    sound(source.path(), &json!({}));
    mask(&source.path().join("masks/set/a.jpg.png"), 255);
    let options = import::Options::default();
    let file = source.path().join("transforms.json");
    let import = import::read(&file, &options, &Watch::new()).unwrap();
    assert!(import.summary().contains(&"masks: 1".to_owned()), "{:?}", import.summary());
    let (target, writing) = (folder(), import::Writing::default());
    let target = target.path().join("new");
    import::write(&import, &target, &writing, &Watch::new()).unwrap();
    put(&target, "scene.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl floor\nf 1 2 3\n");
    assert!(target.join("masks/set/a.exr.png").is_file());
    assert!(is_masked(image(&load(&target))));
}
