//! Reads image, mesh and camera files one by one and prints what came of each.
use lobelia::io::{obj, picture, transforms};
fn main() {
    for file in std::env::args().skip(1) {
        let path = std::path::Path::new(&file);
        let start = std::time::Instant::now();
        let extension =
            path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        let said = match extension.as_str() {
            "obj" => obj::load(path).map(|g| {
                format!(
                    "{} tri {:?} {:?} {:?} {:?}",
                    g.mesh.triangles.len(),
                    g.surfaces.iter().map(|s| (&s.name, s.has_texcoords)).collect::<Vec<_>>(),
                    g.specular,
                    g.warnings,
                    g.library_warnings
                )
            }),
            "json" => transforms::read(path, transforms::Images::Optional)
                .map(|c| format!("{} frames {:?}", c.frames.len(), c.warnings)),
            "png" | "jpg" | "jpeg" => picture::dimensions(path).map(|d| format!("{d:?}")),
            _ => picture::read(path).map(|p| {
                format!(
                    "{}x{} nan {} {:?}",
                    p.width,
                    p.height,
                    p.pixels.iter().filter(|p| p.iter().any(|v| !v.is_finite())).count(),
                    p.notes
                )
            }),
        };
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        match said {
            Ok(text) => println!("{:.2}s READ {name}: {text}", start.elapsed().as_secs_f64()),
            Err(error) => println!(
                "{:.2}s ERR {name}: {}",
                start.elapsed().as_secs_f64(),
                error.to_string().replace(&file, "F")
            ),
        }
    }
}
