//! Loads capture folders and prints what was read and every warning.
fn main() {
    for folder in std::env::args().skip(1) {
        let start = std::time::Instant::now();
        match lobelia::io::capture::load(folder.as_ref(), &Default::default()) {
            Ok(capture) => {
                println!(
                    "{}: {:.3} s, {} triangles, {} polygons, {} surfaces ({} uv), {} photographs ({} measured, {} invalid px), {} materials ({} specular, {} textured), {} lights, {:?}",
                    capture.name,
                    start.elapsed().as_secs_f64(),
                    capture.mesh.triangles.len(),
                    capture.mesh.polygon.last().map_or(0, |p| p + 1),
                    capture.surfaces.len(),
                    capture.surfaces.iter().filter(|s| s.has_texcoords).count(),
                    capture.photographs.len(),
                    capture.measurements().count(),
                    capture.measurements().map(|(_, _, i)| i.invalid_count()).sum::<usize>(),
                    capture.materials.len(),
                    capture
                        .materials
                        .iter()
                        .filter(|m| m.kind == lobelia::scene::MaterialKind::Specular)
                        .count(),
                    capture.materials.iter().filter(|m| m.textured).count(),
                    capture.lights.len(),
                    capture.environment,
                );
                for warning in &capture.warnings {
                    println!("  warning: {warning}");
                }
            }
            Err(error) => println!("{folder}: ERROR {error}"),
        }
    }
}
