//! Every reader of files from elsewhere, as a function of bytes: for the fuzz targets here and for
//! the bounded run of `tests/formats/mutations.rs`, which includes this file.

use std::path::Path;

use lobelia::io::import::{alicevision, bundler, colmap, metashape, opensfm, reality_capture};
use lobelia::io::mesh::{gltf, ply, stl};
use lobelia::io::{
    chart_table, exr, hdr, mtl, obj, photograph, picture, project, raw, response, tags, transforms,
};
use lobelia::scene::{Role, Surface};

/// A reader's name, where its stored corpus lies below tests/data, and the reader.
pub type Reader = (&'static str, &'static [&'static str], fn(&[u8]));

pub const READERS: [Reader; 26] = [
    ("colmap_cameras_bin", &["import/colmap_binary/cameras.bin"], |bytes| {
        let _ = colmap::binary_cameras(file(), bytes);
    }),
    ("colmap_images_bin", &["import/colmap_binary/images.bin"], |bytes| {
        let _ = colmap::binary_images(file(), bytes).map(with_camera);
    }),
    ("colmap_points_bin", &["import/colmap_binary/points3D.bin"], |bytes| {
        let _ = colmap::binary_points(file(), bytes);
    }),
    ("colmap_cameras_txt", &["import/colmap_text/cameras.txt"], |bytes| {
        let _ = colmap::text_cameras(file(), bytes);
    }),
    ("colmap_images_txt", &["import/colmap_text/images.txt"], |bytes| {
        let _ = colmap::text_images(file(), bytes).map(with_camera);
    }),
    ("colmap_points_txt", &["import/colmap_text/points3D.txt"], |bytes| {
        let _ = colmap::text_points(file(), bytes);
    }),
    (
        "alicevision",
        &["import/meshroom_1.2.6.sfm", "import/meshroom_1.2.8.json", "import/meshroom_1.0.sfm"],
        |bytes| {
            let _ = alicevision::parse(file(), bytes);
        },
    ),
    ("reality_capture", &["import/realitycapture.csv"], |bytes| {
        let _ = reality_capture::parse(file(), bytes);
    }),
    ("metashape", &["import/metashape.xml"], |bytes| {
        let _ = metashape::parse(file(), bytes);
    }),
    ("bundler", &["import/bundle.out"], |bytes| {
        let names = bundler::names(&String::from_utf8_lossy(bytes));
        let _ = bundler::parse(file(), bytes, &names);
    }),
    ("opensfm", &["import/opensfm.json"], |bytes| {
        let _ = opensfm::parse(file(), bytes);
    }),
    ("transforms", &["import/rational.json", "bad/transforms/issue_ingp434_nan.json"], |bytes| {
        let _ = transforms::parse(file(), bytes);
    }),
    (
        "gltf",
        &["import/boxes_scene.glb", "import/boxes_materials.glb", "import/cameras.gltf"],
        |bytes| {
            let refuse = |_: &str| Ok(vec![0; 600]);
            if let Ok(contents) = gltf::parse(file(), bytes, &refuse) {
                let _ = contents.geometry(file(), Default::default());
                let _ = contents.cameras(file());
            }
        },
    ),
    (
        "ply",
        &["import/boxes_ascii.ply", "import/boxes_little.ply", "import/boxes_big.ply"],
        |bytes| {
            let _ = ply::parse(file(), bytes);
        },
    ),
    ("stl", &["import/boxes_text.stl", "import/boxes_binary.stl"], |bytes| {
        let _ = stl::parse(file(), bytes);
    }),
    (
        "obj",
        &["formats/obj/tobj_cornell_box.obj", "formats/obj/assimp/concave_polygon.obj"],
        |bytes| {
            let _ = obj::parse(file(), bytes);
        },
    ),
    ("mtl", &["formats/obj/assimp/concave_polygon.mtl"], |bytes| {
        from_disk("a.mtl", bytes, |file| drop(mtl::read(file)));
    }),
    (
        "exr",
        &["formats/exr/exrs_f32_dwab.exr", "formats/exr/exrs_f16_pxr24.exr", "formats/exr/t05.exr"],
        |bytes| from_disk("a.exr", bytes, |file| drop(exr::read(file))),
    ),
    ("hdr", &["formats/hdr/rgbr4x4.hdr", "formats/hdr/scale.hdr"], |bytes| {
        from_disk("a.hdr", bytes, |file| drop(hdr::read(file)));
    }),
    ("picture_size", &["import/grey_160x120.png", "bad/jpeg/corrupt-iptc-8011.jpg"], |bytes| {
        from_disk("a.png", bytes, |file| drop(picture::dimensions(file)));
    }),
    (
        "photograph",
        &[
            "photographs/exif.jpg",
            "photographs/deep.tif",
            "import/grey_160x120.png",
            "bad/jpeg/corrupt-exif-recursive-ifd.jpg",
            "bad/tiff/test_ifd_loop_to_self.tif",
        ],
        |bytes| {
            from_disk("a.jpg", bytes, |file| {
                let _ = photograph::shot(file);
                let _ = photograph::read(file);
            });
        },
    ),
    ("raw", &["photographs/lossless.dng"], |bytes| {
        from_disk("a.dng", bytes, |file| {
            let _ = photograph::shot(file);
            let _ = raw::srgb_from_camera(file);
            let _ = photograph::read(file);
        });
    }),
    ("tags", &["../../assets/examples/corner/tags.json"], |bytes| {
        from_disk("tags.json", bytes, |file| {
            let surface = |name: &str| Surface {
                name: name.to_owned(),
                role: Role::Untagged,
                has_texcoords: true,
            };
            let _ = tags::read(file, &mut ["floor", "wall1", "wall2"].map(surface));
        });
    }),
    ("response", &["photographs/response.csv"], |bytes| {
        from_disk("a.csv", bytes, |file| drop(response::read(file)));
    }),
    ("chart_table", &["photographs/chart.csv"], |bytes| {
        from_disk("a.csv", bytes, |file| drop(chart_table::read(file)));
    }),
    ("project", &["formats/project.lobelia"], |bytes| {
        from_disk("a.lobelia", bytes, |file| drop(project::read(file)));
    }),
];

fn file() -> &'static Path {
    Path::new("changed")
}

/// Images go on to become cameras.
fn with_camera(images: Vec<colmap::Image>) {
    let cameras = colmap::text_cameras(file(), b"1 OPENCV 160 120 99 98 80 60 .1 .1 .1 .1\n");
    let cameras = cameras.unwrap_or_default();
    let model = colmap::Reconstruction { cameras, images, ..Default::default() };
    let _ = colmap::views(file(), &model);
}

/// For readers that open the file themselves.
fn from_disk(name: &str, bytes: &[u8], read: impl FnOnce(&Path)) {
    thread_local! {
        static FOLDER: tempfile::TempDir = tempfile::tempdir().expect("a temporary folder");
    }
    FOLDER.with(|folder| {
        let path = folder.path().join(name);
        if std::fs::write(&path, bytes).is_ok() {
            read(&path);
        }
    });
}
