//! What is too heavy for a frame: edges and ray tree of the mesh, photographs as textures.
//!
//! A thread works through the list and sends each result when it is ready; whoever no longer
//! wants them raises the flag by dropping the handle.

use eframe::egui;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::mpsc::{Receiver, channel};

use crate::app::viewport::gpu::{Corner, SURFACE_BITS};
use crate::app::viewport::projection::window;
use crate::app::viewport::texels;
use crate::geometry::bvh::RayCaster;
use crate::geometry::mesh::Mesh;
use crate::scene::Capture;

/// Something is ready.
pub enum Done {
    Corners(Vec<Corner>),
    Caster(Arc<RayCaster>),
    /// The radiance that nine tenths of the photographs' pixels stay below.
    Bright(f32),
    /// A photograph for the mesh, in the size asked for.
    Layer {
        photograph: usize,
        texels: Vec<u16>,
    },
    /// A photograph in full.
    Picture {
        photograph: usize,
        size: [usize; 2],
        texels: Vec<u16>,
    },
}

/// Passes a result on; `None` once the receiver is gone.
type Deliver<'a, T> = dyn Fn(T) -> Option<()> + 'a;
/// Whether anybody still wants the results.
type IsWanted<'a> = dyn Fn() -> bool + Sync + 'a;

/// A running thread and its results, [`Done`] or others.
pub struct Background<T = Done> {
    results: Receiver<T>,
    stop: Arc<AtomicBool>,
}

impl<T> Drop for Background<T> {
    fn drop(&mut self) {
        self.stop.store(true, Relaxed);
    }
}

impl Background {
    /// Prepares a capture whose photographs are wanted in one size.
    pub fn prepare(
        capture: Arc<Capture>,
        layers: Vec<usize>,
        size: [usize; 2],
        ctx: egui::Context,
    ) -> Self {
        Self::run(ctx, move |send, is_wanted| {
            send(Done::Corners(corners(&capture.mesh)))?;
            let bright = texels::bright(&capture);
            send(Done::Bright(bright))?;
            let mesh = &capture.mesh;
            send(Done::Caster(Arc::new(RayCaster::build(&mesh.positions, &mesh.triangles))))?;
            for photograph in layers {
                let texels = texels::of(&capture.photographs[photograph], size, bright, is_wanted)?;
                send(Done::Layer { photograph, texels })?;
            }
            Some(())
        })
    }

    /// Prepares one photograph in full, or as large as a texture may be.
    pub fn picture(
        capture: Arc<Capture>,
        photograph: usize,
        bright: f32,
        limit: usize,
        ctx: egui::Context,
    ) -> Self {
        Self::run(ctx, move |send, is_wanted| {
            let camera = &capture.photographs[photograph].camera;
            let (low, high) = window(camera);
            let size = texels::within((high - low).to_array().map(|side| side as usize), limit);
            let texels = texels::of(&capture.photographs[photograph], size, bright, is_wanted)?;
            send(Done::Picture { photograph, size, texels })
        })
    }
}

impl<T: Send + 'static> Background<T> {
    /// Does some work on a thread of its own; each result asks for a new frame.
    pub fn run(
        ctx: egui::Context,
        work: impl FnOnce(&Deliver<T>, &IsWanted) -> Option<()> + Send + 'static,
    ) -> Self {
        let (sender, results) = channel();
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = stop.clone();
        let job = move || {
            let is_wanted = || !stopped.load(Relaxed);
            let send = |done| {
                sender.send(done).ok().filter(|_| is_wanted())?;
                ctx.request_repaint();
                Some(())
            };
            work(&send, &is_wanted);
        };
        // Without a thread the mesh does not appear; the machine has worse troubles then.
        let _ = std::thread::Builder::new().name("viewport".to_owned()).spawn(job);
        Self { results, stop }
    }

    /// What has become ready since the last call.
    pub fn ready(&self) -> impl Iterator<Item = T> + '_ {
        self.results.try_iter()
    }
}

/// Faces that meet at more than this (25°) make an edge worth an outline.
const CREASE_COSINE: f32 = 0.906;

/// The corners of all triangles, with what their edges are.
pub fn corners(mesh: &Mesh) -> Vec<Corner> {
    let mut flags = vec![0u8; mesh.triangles.len()];
    // Every side of a triangle, sorted so that those between the same vertices are neighbours.
    let mut sides: Vec<[u32; 4]> = Vec::with_capacity(3 * mesh.triangles.len());
    for (index, triangle) in mesh.triangles.iter().enumerate() {
        for side in 0..3 {
            let (a, b) = (triangle[side], triangle[(side + 1) % 3]);
            sides.push([a.min(b), a.max(b), index as u32, side as u32]);
        }
    }
    sides.sort_unstable();
    for shared in sides.chunk_by(|a, b| a[..2] == b[..2]) {
        for &[_, _, triangle, side] in shared {
            let own = triangle as usize;
            let mut others = shared.iter().map(|s| s[2] as usize).filter(|other| *other != own);
            let (mut polygon, mut crease) = (true, true);
            for other in others.by_ref() {
                polygon &= mesh.polygon.get(own) != mesh.polygon.get(other);
                let flat = mesh.normal(own).dot(mesh.normal(other)) > CREASE_COSINE;
                crease &= mesh.surface[own] != mesh.surface[other] || !flat;
            }
            flags[own] |= u8::from(polygon) << side | u8::from(crease) << (3 + side);
        }
    }
    let mut corners = Vec::with_capacity(3 * mesh.triangles.len());
    for (index, flags) in flags.iter().enumerate() {
        let surface = mesh.surface[index] & ((1 << SURFACE_BITS) - 1);
        let tagged = surface | u32::from(*flags) << SURFACE_BITS;
        corners.extend(
            mesh.corners(index).map(|position| Corner { position: position.to_array(), tagged }),
        );
    }
    corners
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn diagonals_of_a_polygon_are_no_edges_and_folds_are_creases() {
        // Two triangles of a square on the floor, and one that stands on its side 1–2.
        let mesh = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y, Vec3::ONE],
            triangles: vec![[0, 1, 2], [0, 2, 3], [1, 4, 2]],
            surface: vec![5; 3],
            polygon: vec![0, 0, 1],
            texcoords: Vec::new(),
        };
        let flags: Vec<u32> =
            corners(&mesh).iter().step_by(3).map(|corner| corner.tagged >> SURFACE_BITS).collect();
        // Sides 0–1 and 1–2 are edges of the square, 2–0 is its diagonal.
        assert_eq!(flags, [0b011_011, 0b110_110, 0b111_111]);
        assert!(corners(&mesh).iter().all(|corner| corner.tagged << 6 == 5 << 6));
        assert!(corners(&Mesh::default()).is_empty());
    }
}
