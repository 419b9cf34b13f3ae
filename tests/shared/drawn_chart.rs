//! A photograph of a ColorChecker by a camera of other primaries, in a capture of its own.

use std::path::Path;

use glam::{DMat3, DVec2, DVec3};
use lobelia::io::exr;
use lobelia::scene::charts::Table;
use serde_json::json;

pub const SIZE: (usize, usize) = (160, 120);
/// A camera of other primaries.
pub const CAMERA: DMat3 = DMat3::from_cols_array(&[0.7, 0.2, 0.05, 0.25, 0.8, 0.3, 0.1, 0.15, 0.9]);

/// The radiance of a picture in which a ColorChecker fills the rectangle of the corners, on a grey
/// floor, in light that falls off to the right.
pub fn chart(change: impl Fn(usize, usize, DVec3) -> DVec3) -> Vec<[f32; 3]> {
    let table = Table::color_checker();
    let (low, high) = (DVec2::new(20.0, 24.0), DVec2::new(128.0, 96.0));
    let reflectance = |x: usize, y: usize| {
        let place = (DVec2::new(x as f64 + 0.5, y as f64 + 0.5) - low) / (high - low);
        if !(place.cmpge(DVec2::ZERO).all() && place.cmple(DVec2::ONE).all()) {
            return DVec3::splat(0.4);
        }
        let on = (0..24).find(|&k| {
            let [low, high] = table.place(k);
            place.cmpge(low).all() && place.cmple(high).all()
        });
        on.map_or(DVec3::splat(0.04), |k| DVec3::from_array(table.patches[k].reflectance))
    };
    (0..SIZE.0 * SIZE.1)
        .map(|pixel| {
            let (x, y) = (pixel % SIZE.0, pixel / SIZE.0);
            let light = 3.0 * (1.0 - 0.002 * x as f64);
            change(x, y, light * (CAMERA * reflectance(x, y))).to_array().map(|v| v.max(0.0) as f32)
        })
        .collect()
}

/// A camera 2 m above the middle of a floor, whose photograph is `pixels`.
pub fn capture(folder: &Path, pixels: &[[f32; 3]]) {
    let obj = "v -9 -9 0\nv 9 -9 0\nv 9 9 0\nv -9 9 0\nusemtl floor\nf 1 2 3 4\n";
    std::fs::write(folder.join("scene.obj"), obj).unwrap();
    let frame = json!({"file_path": "images/a.exr",
        "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,2],[0,0,0,1]]});
    let cameras = json!({"fl_x": 160, "w": SIZE.0, "h": SIZE.1, "frames": [frame]});
    std::fs::write(folder.join("transforms.json"), cameras.to_string()).unwrap();
    std::fs::create_dir_all(folder.join("images")).unwrap();
    exr::write_rgb(&folder.join("images/a.exr"), SIZE.0, SIZE.1, pixels).unwrap();
}
