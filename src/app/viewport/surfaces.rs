//! A small texture with the state of each surface: after a change of tags only this is uploaded.

use std::collections::BTreeSet;

use eframe::{egui, wgpu};

use crate::app::viewport::gpu::note_upload;
use crate::app::viewport::palette::{self, MaterialColors};
use crate::math::rgb::srgb_code;
use crate::render::scene::Solved;
use crate::scene::{Capture, Role};

/// Surfaces in a row of the texture.
pub const WIDTH: usize = 1024;

pub const SELECTED: u32 = 1;
pub const HIDDEN: u32 = 2;
pub const UNASSIGNED: u32 = 4;
pub const UNKNOWN_REFLECTANCE: u32 = 8;

/// One texel per surface: material colour, reflectance, flags.
/// `found` numbers materials as the capture beside it does, which may not be `capture`: tags may
/// have been edited since.
pub fn rows(
    capture: &Capture,
    colors: &MaterialColors,
    found: Option<(&Capture, &Solved)>,
    selected: &BTreeSet<usize>,
    hidden: &BTreeSet<usize>,
) -> Vec<[u32; 4]> {
    let mut rows: Vec<[u32; 4]> = capture
        .surfaces
        .iter()
        .enumerate()
        .map(|(index, surface)| {
            let mut flags = if selected.contains(&index) { SELECTED } else { 0 };
            flags |= if hidden.contains(&index) { HIDDEN } else { 0 };
            let color = match surface.role {
                Role::Material(material) => colors.of(material),
                Role::Luminaire(_) => palette::LUMINAIRE,
                Role::Untagged => {
                    flags |= UNASSIGNED;
                    palette::UNKNOWN
                }
            };
            let role = found.and_then(|(of, _)| of.surfaces.get(index)).unwrap_or(surface).role;
            let reflectance = match (role, found) {
                (Role::Luminaire(_), _) => Some(palette::LUMINAIRE),
                (Role::Material(material), Some((_, solved))) => {
                    let found = solved.reflectances.get(material).and_then(Option::as_ref);
                    found.map(|found| {
                        let [r, g, b] = found.diffuse.map(|value| srgb_code(value as f32));
                        egui::Color32::from_rgb(r, g, b)
                    })
                }
                _ => None,
            };
            if reflectance.is_none() {
                flags |= UNKNOWN_REFLECTANCE;
            }
            let pack = |c: egui::Color32| u32::from_le_bytes(c.to_array());
            [pack(color), pack(reflectance.unwrap_or(palette::UNKNOWN)), flags, 0]
        })
        .collect();
    rows.resize(rows.len().max(1).next_multiple_of(WIDTH), [0; 4]);
    rows
}

/// A texture for as many rows as there are.
pub fn texture(device: &wgpu::Device, rows: &[[u32; 4]]) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some("surfaces"),
        size: extent(rows),
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba32Uint,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    })
}

pub fn write(queue: &wgpu::Queue, texture: &wgpu::Texture, rows: &[[u32; 4]]) {
    let layout = wgpu::TexelCopyBufferLayout {
        offset: 0,
        bytes_per_row: Some(16 * WIDTH as u32),
        rows_per_image: None,
    };
    note_upload(size_of_val(rows));
    queue.write_texture(texture.as_image_copy(), bytemuck::cast_slice(rows), layout, extent(rows));
}

fn extent(rows: &[[u32; 4]]) -> wgpu::Extent3d {
    let height = (rows.len() / WIDTH) as u32;
    wgpu::Extent3d { width: WIDTH as u32, height, depth_or_array_layers: 1 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Brdf;
    use crate::scene::Surface;

    #[test]
    fn a_surface_keeps_the_reflectance_that_was_found_for_it() {
        let capture = |roles: [Role; 2]| Capture {
            surfaces: roles
                .map(|role| Surface { name: String::new(), role, has_texcoords: false })
                .to_vec(),
            ..Capture::default()
        };
        let solved = Solved {
            reflectances: [0.2, 0.6].map(|d| Some(Brdf::diffuse([d; 3]))).to_vec(),
            ..Solved::default()
        };
        let none = BTreeSet::new();
        let run = capture([Role::Material(0), Role::Material(1)]);
        // The first material has lost its surface, so that the second is now the first.
        let edited = capture([Role::Untagged, Role::Material(0)]);
        let (both, second) = (MaterialColors::default(), MaterialColors { listed: vec![1] });
        let before = rows(&run, &both, Some((&run, &solved)), &none, &none);
        let after = rows(&edited, &second, Some((&run, &solved)), &none, &none);
        assert_eq!(after[1][0], before[1][0], "it keeps its colour, too");
        assert_ne!(before[0][1], before[1][1]);
        assert_eq!([after[0][1], after[1][1]], [before[0][1], before[1][1]]);
        assert_eq!([after[0][2], after[1][2]], [UNASSIGNED, 0]);
        assert_eq!(rows(&edited, &second, None, &none, &none)[1][2], UNKNOWN_REFLECTANCE);
    }
}
