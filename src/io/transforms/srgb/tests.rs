use serde_json::json;

use super::*;
use crate::io::exr;
use crate::io::transforms::{Images, read};

#[test]
fn what_is_for_display_becomes_radiance_and_the_rest_stays() {
    let folder = tempfile::tempdir().unwrap();
    let png = |name: &str| {
        image::RgbImage::from_pixel(4, 3, image::Rgb([128; 3])).save(folder.path().join(name))
    };
    png("a.png").unwrap();
    png("b.png").unwrap();
    exr::write_rgb(&folder.path().join("c.exr"), 4, 3, &[[0.5; 3]; 12]).unwrap();
    let frame = |name: &str, more: serde_json::Value| {
        let pose = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]];
        let mut frame = json!({"file_path": name, "w": 4, "h": 3, "fl_x": 4, "note": 7,
                               "transform_matrix": pose});
        for (key, value) in more.as_object().unwrap() {
            frame[key] = value.clone();
        }
        frame
    };
    let file = folder.path().join("transforms.json");
    let write = |frames: Vec<serde_json::Value>| {
        std::fs::write(&file, json!({"frames": frames, "note": "kept"}).to_string()).unwrap();
    };
    write(vec![
        frame("a.png", json!({"hdr": false})),
        frame("b.png", json!({"use": "geometry", "hdr": false})),
        frame("c.exr", json!({"hdr": false})),
    ]);
    let before = std::fs::read(&file).unwrap();
    assert_eq!(take_as_srgb(&file).unwrap(), 1);
    let cameras = read(&file, Images::Needed).unwrap();
    assert!(cameras.response.is_some());
    let measured: Vec<bool> = cameras.frames.iter().map(|own| own.is_measurement).collect();
    assert_eq!(measured, [true, false, false]);
    let text = std::fs::read_to_string(&file).unwrap();
    assert!(text.contains("\"kept\"") && text.matches("\"note\": 7").count() == 3, "{text}");
    assert_eq!(std::fs::read(folder.path().join("transforms.json~")).unwrap(), before);
    write(vec![frame("b.png", json!({"use": "geometry"})), frame("c.exr", json!({}))]);
    let problem = take_as_srgb(&file).unwrap_err().to_string();
    assert!(problem.contains("none of the photographs is JPEG, PNG or TIFF"), "{problem}");
}
