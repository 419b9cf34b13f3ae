//! Ray casting: closest hit and occlusion.
//!
//! A crate builds a good binary tree (`build.rs` is the only file that names it) and this module
//! traverses it: eight children and eight triangles are tested at once, with AVX2 where the
//! processor has it. Two promises hold beyond speed:
//!
//! - No ray slips between two triangles that share an edge or a vertex (`portable.rs` says why).
//! - The answer is the nearest hit among *all* triangles, the lowest index among equally near
//!   ones, as if each had been tested in turn with the same arithmetic. The boxes are widened by
//!   more than that arithmetic can err (`ray.rs`), so neither the tree, nor the processor, nor the
//!   number of threads shows in a result.

#[cfg(target_arch = "x86_64")]
mod avx2;
mod beam;
mod build;
mod memory;
mod portable;
mod ray;
mod traverse;
mod wide;
mod words;

use glam::Vec3;
use rayon::prelude::*;

pub use beam::{Beam, MOST_RAYS, Met};
use ray::Sheared;
use traverse::Slot;
use wide::WideTree;
pub use words::{NO_TRIANGLE, TreeWords};

/// Rays in a batch that one task takes at a time.
const RAYS_PER_TASK: usize = 256;

/// Children that can be put aside without a heap; only a very unbalanced tree needs more.
const STACK: usize = 256;

/// A segment of a half-line: hits with `t_min <= t < t_max` count.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    pub origin: Vec3,
    /// Unit length, so that `t` is in metres.
    pub direction: Vec3,
    pub t_min: f32,
    pub t_max: f32,
}

/// Where a ray meets a triangle, at `(1 − u − v) a + u b + v c`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    pub t: f32,
    pub triangle: u32,
    pub u: f32,
    pub v: f32,
}

/// The triangles in a bounding volume hierarchy.
pub struct RayCaster {
    tree: WideTree,
    instructions: Instructions,
}

/// The distance at which [`RayCaster::closest`] found that a ray meets a triangle, to the bit.
pub fn distance_to(corners: &[Vec3; 3], ray: &Ray) -> f32 {
    let Sheared { axes, origin, shear } = Sheared::new(ray);
    let [a, b, c] = corners.map(|corner| {
        let [x, y, z] = [0, 1, 2].map(|axis| corner[axes[axis]] - origin[axis]);
        [x - shear[0] * z, y - shear[1] * z, z]
    });
    let edge = |p: [f32; 3], q: [f32; 3]| q[0] * p[1] - q[1] * p[0];
    let (u, v, w) = (edge(b, c), edge(c, a), edge(a, b));
    (u * a[2] + v * b[2] + w * c[2]) * shear[2] / (u + v + w)
}

/// The triangles that blocked a ray; at first none.
#[derive(Clone, Copy, Debug, Default)]
pub struct Blocker {
    leaf: usize,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Instructions {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2,
}

impl Instructions {
    fn best() -> Self {
        #[cfg(target_arch = "x86_64")]
        if avx2::is_available() {
            return Self::Avx2;
        }
        Self::Portable
    }
}

impl RayCaster {
    /// Triangles without area are never hit, nor are those with a corner that is not finite or
    /// farther than 1e30 from the origin. Beyond 1e18, and below 1e-18, products of coordinates
    /// leave the range of f32, and hits may be lost.
    pub fn build(positions: &[Vec3], triangles: &[[u32; 3]]) -> Self {
        Self { tree: build::build(positions, triangles), instructions: Instructions::best() }
    }

    /// The nearest hit from either side, and of equally near ones that of the lowest triangle.
    #[inline]
    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        if self.tree.stack_size > STACK {
            return self.closest_with(ray, &mut self.large_stack());
        }
        self.closest_with(ray, &mut [const { Slot::uninit() }; STACK])
    }

    /// Whether `closest` would find anything; cheaper, because any hit will do.
    #[inline]
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.occluded_after(ray, &mut Blocker::default())
    }

    /// The same, but the triangles that blocked an earlier ray, which `last` keeps, are tested first: they
    /// often block rays next to it, too.
    #[inline]
    pub fn occluded_after(&self, ray: &Ray, last: &mut Blocker) -> bool {
        if self.tree.stack_size > STACK {
            return self.occluded_with(ray, last, &mut self.large_stack());
        }
        self.occluded_with(ray, last, &mut [const { Slot::uninit() }; STACK])
    }

    /// The triangles of `closest` of rays that begin at the origin of a beam which holds their
    /// directions: as many as there are `hits`, up to [`MOST_RAYS`]. Of slivers, and of
    /// planes that rays run within, one may meet what the other misses.
    pub fn closest_of_beam(
        &self,
        beam: &Beam,
        rays: &dyn Fn(usize) -> Ray,
        hits: &mut [Option<u32>],
    ) -> Met {
        if self.tree.stack_size > STACK {
            return self.closest_of_beam_with(beam, rays, hits, &mut self.large_stack());
        }
        self.closest_of_beam_with(beam, rays, hits, &mut [const { Slot::uninit() }; STACK])
    }

    /// `closest` of each ray, in their order, on all threads.
    pub fn closest_batch(&self, rays: &[Ray]) -> Vec<Option<Hit>> {
        rays.par_iter().with_min_len(RAYS_PER_TASK).map(|ray| self.closest(ray)).collect()
    }

    /// `occluded` of each ray, in their order, on all threads.
    pub fn occluded_batch(&self, rays: &[Ray]) -> Vec<bool> {
        rays.par_iter().with_min_len(RAYS_PER_TASK).map(|ray| self.occluded(ray)).collect()
    }

    #[inline]
    fn closest_with(&self, ray: &Ray, stack: &mut [Slot]) -> Option<Hit> {
        match self.instructions {
            Instructions::Portable => portable::closest(&self.tree, ray, stack),
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `Instructions::best` found them on this processor.
            Instructions::Avx2 => unsafe { avx2::closest(&self.tree, ray, stack) },
        }
    }

    #[inline]
    fn occluded_with(&self, ray: &Ray, last: &mut Blocker, stack: &mut [Slot]) -> bool {
        match self.instructions {
            Instructions::Portable => portable::occluded(&self.tree, ray, last, stack),
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `Instructions::best` found them on this processor.
            Instructions::Avx2 => unsafe { avx2::occluded(&self.tree, ray, last, stack) },
        }
    }

    fn closest_of_beam_with(
        &self,
        beam: &Beam,
        rays: &dyn Fn(usize) -> Ray,
        hits: &mut [Option<u32>],
        stack: &mut [Slot],
    ) -> Met {
        match self.instructions {
            Instructions::Portable => {
                portable::closest_of_beam(&self.tree, beam, rays, hits, stack)
            }
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `Instructions::best` found them on this processor.
            Instructions::Avx2 => unsafe {
                avx2::closest_of_beam(&self.tree, beam, rays, hits, stack)
            },
        }
    }

    #[cold]
    fn large_stack(&self) -> Vec<Slot> {
        vec![Slot::uninit(); self.tree.stack_size]
    }
}

#[cfg(test)]
mod tests;
