//! The pixels that show one surface.

use glam::DVec2;
use rayon::prelude::*;

use crate::geometry::bvh::RayCaster;
use crate::geometry::mesh::Mesh;
use crate::scene::Camera;

/// The surface that a photograph shows at a place, in pixels from its top left corner; `None` where
/// it shows none.
pub fn surface_at(camera: &Camera, mesh: &Mesh, caster: &RayCaster, place: DVec2) -> Option<u32> {
    Some(mesh.surface[caster.closest(&camera.ray(place)?)?.triangle as usize])
}

/// For each pixel, row by row from the top, whether its middle shows a surface; `None` once the
/// result is not wanted any more.
pub fn showing(
    camera: &Camera,
    mesh: &Mesh,
    caster: &RayCaster,
    surface: u32,
    is_wanted: &(dyn Fn() -> bool + Sync),
) -> Option<Vec<bool>> {
    let rows: Vec<Vec<bool>> = (0..camera.height)
        .into_par_iter()
        .map(|y| {
            is_wanted().then(|| {
                let middle = |x: usize| DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                (0..camera.width)
                    .map(|x| surface_at(camera, mesh, caster, middle(x)) == Some(surface))
                    .collect()
            })
        })
        .collect::<Option<_>>()?;
    Some(rows.concat())
}
