//! A tree as words, for ray casting elsewhere than on this processor.

use super::RayCaster;
use super::wide::{LANES, Leaf, Node};

/// The nodes and leaves of a tree, 32 bits a word.
pub struct TreeWords {
    /// 64 words a node: six rows of eight bounds as in memory (smallest and largest x, then y, then
    /// z), eight children, and room. A child with the highest bit is a leaf. Node 0 is the root.
    pub nodes: Vec<u32>,
    /// 80 words a leaf: by corner, then by axis, eight coordinates; then the indices of the eight
    /// triangles, [`NO_TRIANGLE`] where there is none.
    pub leaves: Vec<u32>,
}

/// Of a place in a leaf that holds no triangle.
pub const NO_TRIANGLE: u32 = u32::MAX;

/// Of boxes that no ray meets, in place of infinities.
const FAR: f32 = 1e30;
const NODE_WORDS: usize = 64;
const LEAF_WORDS: usize = 80;

impl RayCaster {
    /// The corners of the box around everything.
    pub fn bounds(&self) -> [[f32; 3]; 2] {
        [self.tree.low.to_array(), self.tree.high.to_array()]
    }

    /// Children that a traversal can have put aside at most.
    pub fn stack_size(&self) -> usize {
        self.tree.stack_size
    }

    /// Copies the tree.
    pub fn words(&self) -> TreeWords {
        let mut nodes = Vec::with_capacity(NODE_WORDS * self.tree.nodes.len());
        for Node { bounds, children } in self.tree.nodes.iter() {
            for value in bounds.iter().flat_map(|lanes| lanes.0) {
                nodes.push(value.clamp(-FAR, FAR).to_bits());
            }
            nodes.extend(children.map(|child| child.0));
            nodes.extend([0; LANES]);
        }
        let mut leaves = Vec::with_capacity(LEAF_WORDS * self.tree.leaves.len());
        for Leaf { corners, triangles } in self.tree.leaves.iter() {
            let lanes = corners.iter().flatten();
            // Absent triangles have corners that are no numbers.
            let is_absent: [bool; LANES] = std::array::from_fn(|k| corners[0][0].0[k].is_nan());
            let values = lanes.flat_map(|lanes| lanes.0);
            leaves.extend(values.map(|value| if value.is_nan() { 0 } else { value.to_bits() }));
            leaves
                .extend((0..LANES).map(|k| if is_absent[k] { NO_TRIANGLE } else { triangles[k] }));
        }
        TreeWords { nodes, leaves }
    }
}
