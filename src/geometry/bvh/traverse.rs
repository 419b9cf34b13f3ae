//! The traversal of the tree, the same for every instruction set.

use std::mem::MaybeUninit;

use super::ray::Prepared;
use super::wide::{Child, Lanes, Leaf, Node, WideTree};
use super::{Blocker, Hit, Ray};

/// The box and triangle tests of one instruction set. All give the same bits: none fuses a
/// multiplication with an addition, and their minimum is `if a < b { a } else { b }`, their
/// maximum `if a > b { a } else { b }`.
pub trait Kernel {
    /// # Safety
    /// The processor has the kernel's instructions.
    unsafe fn new(prepared: &Prepared) -> Self;

    /// Which children's boxes the ray meets with `t_min <= t <= t_max`, and where it enters them.
    ///
    /// # Safety
    /// The processor has the kernel's instructions.
    unsafe fn boxes(&self, node: &Node, t_max: f32) -> (u32, Lanes);

    /// Which triangles the ray meets with `t_min <= t <= t_max`, and where.
    ///
    /// # Safety
    /// The processor has the kernel's instructions.
    unsafe fn triangles(&self, prepared: &Prepared, leaf: &Leaf, t_max: f32) -> (u32, LeafHits);
}

/// Distances, and weights of the second and third corner as parts of `sum`. Only the lanes of
/// triangles that are met mean anything.
pub struct LeafHits {
    pub t: Lanes,
    pub v: Lanes,
    pub w: Lanes,
    pub sum: Lanes,
}

/// Room for a child put aside.
pub type Slot = MaybeUninit<Entry>;

/// A child, and where the ray enters it.
pub type Entry = (f32, Child);

const NO_TRIANGLE: u32 = u32::MAX;

/// See `RayCaster::closest`. `stack` has room for `tree.stack_size` entries.
///
/// # Safety
/// The processor has the kernel's instructions.
#[inline(always)]
pub unsafe fn closest<K: Kernel>(tree: &WideTree, ray: &Ray, stack: &mut [Slot]) -> Option<Hit> {
    assert!(stack.len() >= tree.stack_size);
    if tree.nodes.is_empty() {
        return None;
    }
    let prepared = Prepared::new(ray, tree);
    // SAFETY: as promised by the caller.
    let kernel = unsafe { K::new(&prepared) };
    // Of the best hit's unscaled weights.
    let mut sum = 1.0;
    // The interval is half open; closing it lets equal distances reach the comparison of indices.
    let mut best = Hit { t: ray.t_max.next_down(), triangle: NO_TRIANGLE, u: 0.0, v: 0.0 };

    let mut stack = Stack::new(stack);
    let mut child = Child::node(0);
    loop {
        if child.is_leaf() {
            // SAFETY: the builder made this index, and the caller's promise.
            let (mut met, hits) = unsafe {
                kernel.triangles(&prepared, tree.leaves.get_unchecked(child.index()), best.t)
            };
            // SAFETY: as above.
            let triangles = unsafe { &tree.leaves.get_unchecked(child.index()).triangles };
            while met != 0 {
                let lane = met.trailing_zeros() as usize;
                met &= met - 1;
                // `& 7` changes nothing and spares the checks.
                let (t, triangle) = (hits.t.0[lane & 7], triangles[lane & 7]);
                if t < best.t || (t == best.t && triangle < best.triangle) {
                    best = Hit { t, triangle, u: hits.v.0[lane & 7], v: hits.w.0[lane & 7] };
                    sum = hits.sum.0[lane & 7];
                }
            }
        } else {
            // SAFETY: the builder made this index, and the caller's promise.
            let node = unsafe { tree.nodes.get_unchecked(child.index()) };
            let (met, near) = unsafe { kernel.boxes(node, best.t) };
            // SAFETY: the stack holds `tree.stack_size` entries.
            if let Some(nearest) = unsafe { stack.put_aside_all_but_nearest(node, met, &near) } {
                child = nearest;
                continue;
            }
        }
        match stack.pop_within(best.t) {
            Some(next) => child = next,
            None if best.triangle == NO_TRIANGLE => return None,
            None => return Some(Hit { u: best.u / sum, v: best.v / sum, ..best }),
        }
    }
}

/// See `RayCaster::occluded_after`. `stack` has room for `tree.stack_size` entries.
///
/// # Safety
/// The processor has the kernel's instructions.
#[inline(always)]
pub unsafe fn occluded<K: Kernel>(
    tree: &WideTree,
    ray: &Ray,
    last: &mut Blocker,
    stack: &mut [Slot],
) -> bool {
    assert!(stack.len() >= tree.stack_size);
    if tree.nodes.is_empty() {
        return false;
    }
    let prepared = Prepared::new(ray, tree);
    // SAFETY: as promised by the caller.
    let kernel = unsafe { K::new(&prepared) };
    let t_max = ray.t_max.next_down();
    // Leaf 0 is empty.
    if last.leaf != 0
        && let Some(leaf) = tree.leaves.get(last.leaf)
    {
        // SAFETY: the caller's promise.
        let (hit, _) = unsafe { kernel.triangles(&prepared, leaf, t_max) };
        if hit != 0 {
            return true;
        }
    }

    let mut stack = Stack::new(stack);
    let mut node = Child::node(0);
    loop {
        // SAFETY: only nodes are put aside, the builder made their indices; the caller's promise.
        let children = unsafe { tree.nodes.get_unchecked(node.index()) };
        let (mut met, near) = unsafe { kernel.boxes(children, t_max) };
        // The builder sorts leaves to the front and the largest node to the back. Leaves first,
        // then the largest node: where anything will do, the place to look is where most is.
        while met != 0 {
            let lane = met.trailing_zeros() as usize & 7;
            met &= met - 1;
            let child = children.children[lane];
            if child.is_leaf() {
                // SAFETY: the builder made this index, and the caller's promise.
                let (hit, _) = unsafe {
                    kernel.triangles(&prepared, tree.leaves.get_unchecked(child.index()), t_max)
                };
                if hit != 0 {
                    last.leaf = child.index();
                    return true;
                }
            } else {
                // SAFETY: the stack holds `tree.stack_size` entries.
                unsafe { stack.push((near.0[lane], child)) };
            }
        }
        match stack.pop() {
            None => return false,
            Some((_, next)) => node = next,
        }
    }
}

/// Children put aside.
pub struct Stack<'a> {
    entries: &'a mut [Slot],
    len: usize,
}

impl<'a> Stack<'a> {
    #[inline(always)]
    pub fn new(entries: &'a mut [Slot]) -> Self {
        Self { entries, len: 0 }
    }

    /// # Safety
    /// The stack is not full.
    #[inline(always)]
    unsafe fn push(&mut self, entry: Entry) {
        // SAFETY: not full, says the caller.
        unsafe { self.entries.get_unchecked_mut(self.len).write(entry) };
        self.len += 1;
    }

    /// Returns the nearest of a node's children that the ray meets, and pushes the other ones that it
    /// meets, the nearest of them on top. `None` if it meets none.
    ///
    /// # Safety
    /// The stack has room for all children but one.
    #[inline(always)]
    pub unsafe fn put_aside_all_but_nearest(
        &mut self,
        node: &Node,
        mut met: u32,
        near: &Lanes,
    ) -> Option<Child> {
        if met == 0 {
            return None;
        }
        // `& 7` changes nothing and spares the checks.
        let lane = met.trailing_zeros() as usize & 7;
        met &= met - 1;
        let mut nearest = (near.0[lane], node.children[lane]);
        let bottom = self.len;
        while met != 0 {
            let lane = met.trailing_zeros() as usize & 7;
            met &= met - 1;
            let mut other = (near.0[lane], node.children[lane]);
            if other.0 < nearest.0 {
                std::mem::swap(&mut other, &mut nearest);
            }
            // SAFETY: as promised by the caller.
            unsafe { self.push_sorted(other, bottom) };
        }
        Some(nearest.1)
    }

    /// Pops children until one begins within the distance `most`, and returns that one.
    #[inline(always)]
    pub fn pop_within(&mut self, most: f32) -> Option<Child> {
        while let Some((near, child)) = self.pop() {
            if near <= most {
                return Some(child);
            }
        }
        None
    }

    /// Pushes, and keeps the entries from `bottom` on in order, the nearest on top.
    ///
    /// # Safety
    /// The stack is not full, and holds at least `bottom` entries.
    #[inline(always)]
    unsafe fn push_sorted(&mut self, entry: Entry, bottom: usize) {
        let mut place = self.len;
        // SAFETY: `place <= len`, not full says the caller, and all below `len` are written.
        unsafe {
            while place > bottom {
                let below = self.entries.get_unchecked(place - 1).assume_init();
                if below.0 >= entry.0 {
                    break;
                }
                self.entries.get_unchecked_mut(place).write(below);
                place -= 1;
            }
            self.entries.get_unchecked_mut(place).write(entry);
        }
        self.len += 1;
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<Entry> {
        if self.len == 0 {
            return None;
        }
        self.len -= 1;
        // SAFETY: everything below the old `len` was written.
        Some(unsafe { self.entries.get_unchecked(self.len).assume_init() })
    }
}
