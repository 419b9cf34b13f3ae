//! The numbers of a ray that a traversal needs, computed once.

use glam::Vec3;

use super::Ray;
use super::wide::WideTree;

/// A ray prepared for the box test and for the watertight triangle test of Woop, Benthin, Wald:
/// "Watertight Ray/Triangle Intersection" (JCGT 2013).
#[derive(Clone, Copy, Debug)]
pub struct Prepared {
    /// Which row of `Node::bounds` a ray enters along each axis; it leaves by the other one.
    pub near_row: [usize; 3],
    /// The origin, moved so that the boxes seem larger.
    pub near_origin: [f32; 3],
    pub far_origin: [f32; 3],
    pub inverse: [f32; 3],
    /// x, y, z of the sheared space as axes of the world; the ray runs along its z.
    pub axes: [usize; 3],
    /// The origin along `axes`.
    pub origin: [f32; 3],
    pub shear: [f32; 3],
    pub t_min: f32,
}

/// How much larger the boxes are made for a ray, in units of the largest coordinate difference
/// between its origin and anything in the scene.
///
/// With ε = 2⁻²⁴, the triangle test moves a corner by at most 7 ε of that difference (one for the
/// difference itself, four for the slope and its product with another difference, two for the
/// last difference, which may be twice as large), and the box test errs by 3 ε of it. Three times
/// their sum is about 32 ε, and that is 2⁻¹⁹.
pub const WIDENING: f32 = 1.0 / (1 << 19) as f32;

/// Directions are kept this far from zero in the box test, so that 0 · ∞ never arises. The error
/// is far below the widening.
const LEAST_DIRECTION: f32 = 1e-18;

impl Prepared {
    #[inline(always)]
    pub fn new(ray: &Ray, tree: &WideTree) -> Self {
        let (origin, direction) = (ray.origin, ray.direction.to_array());
        let farthest = (origin - tree.low).abs().max((tree.high - origin).abs());
        // The second term keeps the first from vanishing in a sum with a large coordinate.
        let widening = Vec3::splat(farthest.max_element() * WIDENING) + origin.abs() * f32::EPSILON;

        let backward = direction.map(|d| d < 0.0);
        let size = direction.map(f32::abs);
        let mut inverse = size.map(|d| 1.0 / if d > LEAST_DIRECTION { d } else { LEAST_DIRECTION });
        let mut near_origin = (origin + widening).to_array();
        let mut far_origin = (origin - widening).to_array();
        for axis in 0..3 {
            if backward[axis] {
                inverse[axis] = -inverse[axis];
                std::mem::swap(&mut near_origin[axis], &mut far_origin[axis]);
            }
        }

        let Sheared { axes, origin, shear } = Sheared::new(ray);
        Self {
            near_row: [0, 1, 2].map(|axis| 2 * axis + usize::from(backward[axis])),
            near_origin,
            far_origin,
            inverse,
            axes,
            origin,
            shear,
            t_min: ray.t_min,
        }
    }

    /// Whether the ray meets a box up to a distance, as a kernel tells it of a node's children.
    pub fn enters(&self, bounds: [[f32; 3]; 2], t_max: f32) -> bool {
        let (mut near, mut far) = (self.t_min, t_max);
        let [low, high] = bounds;
        for (axis, (low, high)) in std::iter::zip(low, high).enumerate() {
            let is_forward = self.near_row[axis].is_multiple_of(2);
            let (first, last) = if is_forward { (low, high) } else { (high, low) };
            let enters = (first - self.near_origin[axis]) * self.inverse[axis];
            let leaves = (last - self.far_origin[axis]) * self.inverse[axis];
            near = near.max(enters);
            far = far.min(leaves);
        }
        near <= far
    }
}

/// The space in which a ray runs along z: see `Prepared`.
pub struct Sheared {
    pub axes: [usize; 3],
    pub origin: [f32; 3],
    pub shear: [f32; 3],
}

impl Sheared {
    #[inline(always)]
    pub fn new(ray: &Ray) -> Self {
        let direction = ray.direction.to_array();
        let size = direction.map(f32::abs);
        let z = if size[0] >= size[1] && size[0] >= size[2] {
            0
        } else if size[1] >= size[2] {
            1
        } else {
            2
        };
        let axes = [[1, 2, 0], [2, 0, 1], [0, 1, 2]][z];
        let scale = 1.0 / direction[z];
        Self {
            axes,
            origin: axes.map(|axis| ray.origin[axis]),
            shear: [direction[axes[0]] * scale, direction[axes[1]] * scale, scale],
        }
    }
}
