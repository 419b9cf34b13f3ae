//! The tree in memory: nodes of eight children, leaves of up to eight triangles.

use glam::Vec3;

use super::memory::Pages;

/// Children of a node, and triangles of a leaf: as many as one AVX2 register has floats.
pub const LANES: usize = 8;

/// One value for each child or triangle.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub struct Lanes(pub [f32; LANES]);

/// The boxes of eight children. Absent children have boxes that no ray meets; should one that is
/// not finite seem to, it finds the empty leaf behind them.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Node {
    /// Smallest and largest coordinate along x, then y, then z.
    pub bounds: [Lanes; 6],
    pub children: [Child; LANES],
}

/// An inner node or a leaf, by its index.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(transparent)]
pub struct Child(pub u32);

/// The corners of up to eight triangles. Those that are absent have NaN corners, which no
/// comparison accepts.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub struct Leaf {
    /// By corner, then by axis.
    pub corners: [[Lanes; 3]; 3],
    /// Indices into the caller's triangles.
    pub triangles: [u32; LANES],
}

/// Node 0 is the root and leaf 0 is empty; without nodes there is nothing to hit.
#[derive(Debug)]
pub struct WideTree {
    pub nodes: Pages<Node>,
    pub leaves: Pages<Leaf>,
    /// The box around everything.
    pub low: Vec3,
    pub high: Vec3,
    /// Children that a traversal can have put aside at most.
    pub stack_size: usize,
}

impl Child {
    const LEAF: u32 = 1 << 31;

    pub fn node(index: usize) -> Self {
        assert!(index < Self::LEAF as usize, "more nodes than 31 bits can number");
        Self(index as u32)
    }

    pub fn leaf(index: usize) -> Self {
        assert!(index < Self::LEAF as usize, "more leaves than 31 bits can number");
        Self(index as u32 | Self::LEAF)
    }

    #[inline(always)]
    pub fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    #[inline(always)]
    pub fn index(self) -> usize {
        (self.0 & !Self::LEAF) as usize
    }
}

impl Node {
    pub fn empty() -> Self {
        let (low, high) = (Lanes([f32::INFINITY; LANES]), Lanes([f32::NEG_INFINITY; LANES]));
        Self { bounds: [low, high, low, high, low, high], children: [Child::leaf(0); LANES] }
    }

    pub fn set(&mut self, lane: usize, low: Vec3, high: Vec3, child: Child) {
        for axis in 0..3 {
            self.bounds[2 * axis].0[lane] = low[axis];
            self.bounds[2 * axis + 1].0[lane] = high[axis];
        }
        self.children[lane] = child;
    }
}

impl Leaf {
    pub fn empty() -> Self {
        Self { corners: [[Lanes([f32::NAN; LANES]); 3]; 3], triangles: [0; LANES] }
    }

    pub fn set(&mut self, lane: usize, corners: &[Vec3; 3], triangle: u32) {
        for (lanes, corner) in self.corners.iter_mut().zip(corners) {
            for axis in 0..3 {
                lanes[axis].0[lane] = corner[axis];
            }
        }
        self.triangles[lane] = triangle;
    }

    /// The box around its triangles.
    pub fn bounds(&self) -> [[f32; 3]; 2] {
        let mut bounds = [[f32::INFINITY; 3], [f32::NEG_INFINITY; 3]];
        for corner in &self.corners {
            for (axis, along) in corner.iter().enumerate() {
                for &value in &along.0 {
                    // Absent triangles' are no numbers, which these pass over.
                    bounds[0][axis] = bounds[0][axis].min(value);
                    bounds[1][axis] = bounds[1][axis].max(value);
                }
            }
        }
        bounds
    }
}
