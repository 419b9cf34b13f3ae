//! From triangles to a tree. The only file that names `obvhs`: it builds a binary tree, which is
//! then folded into nodes of eight so that the expected cost of a ray is least.

use glam::{DVec3, Vec3};
use obvhs::BvhBuildParams;
use obvhs::bvh2::Bvh2;
use obvhs::triangle::Triangle;

use super::memory::Pages;
use super::wide::{Child, LANES, Leaf, Node, WideTree};

/// Coordinates beyond this overflow while the tree is built.
const FARTHEST: f32 = 1e30;

/// What testing a leaf costs, a node being 1.
const LEAF_COST: f64 = 1.0;

pub fn build(positions: &[Vec3], triangles: &[[u32; 3]]) -> WideTree {
    let mut indices = Vec::new();
    let mut corners = Vec::new();
    for (index, triangle) in triangles.iter().enumerate() {
        let triangle = triangle.map(|vertex| positions[vertex as usize]);
        if can_be_hit(&triangle) {
            indices.push(u32::try_from(index).expect("more triangles than u32 can number"));
            corners.push(triangle);
        }
    }
    let mut folding = Folding::default();
    let (mut low, mut high) = (Vec3::ZERO, Vec3::ZERO);
    if !corners.is_empty() {
        let binary = build_binary(&corners);
        (low, high) = bounds(&binary, 0);
        folding.fold(&Source {
            plans: &plan(&binary),
            binary: &binary,
            corners: &corners,
            indices: &indices,
        });
    }
    WideTree {
        nodes: Pages::new(&folding.nodes),
        leaves: Pages::new(&folding.leaves),
        low,
        high,
        stack_size: folding.stack_size,
    }
}

fn can_be_hit(&[a, b, c]: &[Vec3; 3]) -> bool {
    let near = |corner: Vec3| corner.abs().max_element() <= FARTHEST;
    let [a64, b64, c64] = [a, b, c].map(Vec3::as_dvec3);
    [a, b, c].iter().all(|corner| corner.is_finite() && near(*corner))
        && (b64 - a64).cross(c64 - a64) != DVec3::ZERO
}

fn build_binary(corners: &[[Vec3; 3]]) -> Bvh2 {
    let triangles: Vec<Triangle> = corners
        .iter()
        .map(|[a, b, c]| Triangle { v0: (*a).into(), v1: (*b).into(), v2: (*c).into() })
        .collect();
    // Twice the medium preset's time buys a twentieth of a ray's. One triangle a leaf, for `plan`
    // decides where leaves end; unsplit, so that every box holds all of its triangles.
    let parameters =
        BvhBuildParams { pre_split: false, max_prims_per_leaf: 1, ..BvhBuildParams::slow_build() };
    obvhs::bvh2::builder::build_bvh2_from_tris(&triangles, parameters, &mut Default::default())
}

/// Smallest and largest corner of a subtree's box.
fn bounds(binary: &Bvh2, node: usize) -> (Vec3, Vec3) {
    let aabb = binary.nodes[node].aabb();
    (aabb.min.into(), aabb.max.into())
}

/// How to put a binary subtree into a wide node with the least expected cost (Ylitie, Karras,
/// Laine: "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", 2017).
#[derive(Clone, Default)]
struct Plan {
    /// Least cost of the subtree in at most so many (plus one) slots of the node above.
    cost: [f64; LANES],
    /// How many slots then go to the left half; 0 means one slot fewer than given.
    left: [u8; LANES],
    area: f64,
    triangles: usize,
    is_leaf: bool,
}

fn plan(binary: &Bvh2) -> Vec<Plan> {
    let mut plans = vec![Plan::default(); binary.nodes.len()];
    for node in downwards(binary).into_iter().rev() {
        let (low, high) = bounds(binary, node);
        let size = high.as_dvec3() - low.as_dvec3();
        let area = size.x * size.y + size.y * size.z + size.z * size.x;
        let mut plan = Plan { area, ..Plan::default() };
        if binary.nodes[node].is_leaf() {
            plan.triangles = binary.nodes[node].prim_count as usize;
            plan.is_leaf = true;
            plan.cost = [area * LEAF_COST; LANES];
        } else {
            let left = binary.nodes[node].first_index as usize;
            let (left, right) = (&plans[left], &plans[left + 1]);
            for slots in 2..=LANES {
                let best = (1..slots)
                    .map(|given| (left.cost[given - 1] + right.cost[slots - given - 1], given))
                    .min_by(|a, b| a.0.total_cmp(&b.0))
                    .expect("at least one way");
                plan.cost[slots - 1] = best.0;
                plan.left[slots - 1] = best.1 as u8;
            }
            plan.triangles = left.triangles + right.triangles;
            let as_node = area + plan.cost[LANES - 1];
            let as_leaf = if plan.triangles <= LANES { area * LEAF_COST } else { f64::INFINITY };
            plan.is_leaf = as_leaf <= as_node;
            plan.cost[0] = as_leaf.min(as_node);
            for slots in 1..LANES - 1 {
                if plan.cost[slots - 1] <= plan.cost[slots] {
                    plan.cost[slots] = plan.cost[slots - 1];
                    plan.left[slots] = 0;
                }
            }
        }
        plans[node] = plan;
    }
    plans
}

/// All nodes, parents before children.
fn downwards(binary: &Bvh2) -> Vec<usize> {
    let mut order = vec![0];
    let mut next = 0;
    while next < order.len() {
        let node = &binary.nodes[order[next]];
        if !node.is_leaf() {
            let left = node.first_index as usize;
            order.extend([left, left + 1]);
        }
        next += 1;
    }
    order
}

/// What is folded.
struct Source<'a> {
    binary: &'a Bvh2,
    plans: &'a [Plan],
    corners: &'a [[Vec3; 3]],
    /// The caller's index of each triangle.
    indices: &'a [u32],
}

/// The wide tree as it grows.
#[derive(Default)]
struct Folding {
    nodes: Vec<Node>,
    leaves: Vec<Leaf>,
    stack_size: usize,
}

/// A wide node to be filled from a binary subtree.
struct Task {
    wide: usize,
    binary: usize,
    depth: usize,
}

impl Folding {
    fn fold(&mut self, source: &Source) {
        self.leaves.push(Leaf::empty());
        self.nodes.push(Node::empty());
        let mut tasks = vec![Task { wide: 0, binary: 0, depth: 1 }];
        let mut deepest = 1;
        while let Some(task) = tasks.pop() {
            deepest = deepest.max(task.depth);
            let mut children = source.children(task.binary);
            // Leaves first and the largest node last, for `traverse::occluded`.
            children.sort_by(|&a, &b| source.rank(a).total_cmp(&source.rank(b)));
            for (lane, child) in children.into_iter().enumerate() {
                let (low, high) = bounds(source.binary, child);
                let reference = if source.plans[child].is_leaf {
                    self.leaves.push(source.leaf(child));
                    Child::leaf(self.leaves.len() - 1)
                } else {
                    let wide = self.nodes.len();
                    self.nodes.push(Node::empty());
                    tasks.push(Task { wide, binary: child, depth: task.depth + 1 });
                    Child::node(wide)
                };
                self.nodes[task.wide].set(lane, low, high, reference);
            }
        }
        // On each level all children but one may wait. `occluded` puts the one aside, too, but no
        // leaves, and so nothing on the last level.
        self.stack_size = deepest * (LANES - 1);
    }
}

impl Source<'_> {
    /// The binary nodes that become the children of a wide node.
    fn children(&self, node: usize) -> Vec<usize> {
        if self.plans[node].is_leaf {
            return vec![node]; // Only where the root is one.
        }
        let mut children = Vec::with_capacity(LANES);
        let first = self.binary.nodes[node].first_index as usize;
        let given = usize::from(self.plans[node].left[LANES - 1]);
        let mut open = vec![(first + 1, LANES - given), (first, given)];
        while let Some((node, mut slots)) = open.pop() {
            let plan = &self.plans[node];
            while slots > 1 && plan.left[slots - 1] == 0 {
                slots -= 1;
            }
            if slots == 1 {
                children.push(node);
            } else {
                let first = self.binary.nodes[node].first_index as usize;
                let given = usize::from(plan.left[slots - 1]);
                open.extend([(first + 1, slots - given), (first, given)]);
            }
        }
        children
    }

    fn rank(&self, node: usize) -> f64 {
        if self.plans[node].is_leaf { -1.0 } else { self.plans[node].area }
    }

    fn leaf(&self, node: usize) -> Leaf {
        let mut leaf = Leaf::empty();
        let mut lane = 0;
        let mut open = vec![node];
        while let Some(node) = open.pop() {
            let node = &self.binary.nodes[node];
            let first = node.first_index as usize;
            if node.is_leaf() {
                for &kept in &self.binary.primitive_indices[first..][..node.prim_count as usize] {
                    leaf.set(lane, &self.corners[kept as usize], self.indices[kept as usize]);
                    lane += 1;
                }
            } else {
                open.extend([first + 1, first]);
            }
        }
        leaf
    }
}
