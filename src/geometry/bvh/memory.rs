//! A read-only array on large pages.
//!
//! Rays visit a tree in no order, and with 4 kB pages most visits miss the processor's page
//! cache. Linux gives 2 MB pages to whoever asks; elsewhere this is an ordinary array.

use std::alloc::{Layout, alloc, dealloc, handle_alloc_error};
use std::ops::Deref;
use std::ptr::NonNull;

/// The size of a large page; smaller arrays have no use for one.
const LARGE_PAGE: usize = 2 << 20;

#[derive(Debug)]
pub struct Pages<T: Copy> {
    start: NonNull<T>,
    len: usize,
    layout: Layout,
}

// SAFETY: it owns its elements as a boxed slice does, and shares them only for reading.
unsafe impl<T: Copy + Send> Send for Pages<T> {}
// SAFETY: as above.
unsafe impl<T: Copy + Sync> Sync for Pages<T> {}

impl<T: Copy> Pages<T> {
    pub fn new(elements: &[T]) -> Self {
        let mut layout = Layout::for_value(elements);
        if layout.size() >= LARGE_PAGE / 2 {
            layout = layout.align_to(LARGE_PAGE).expect("a power of two").pad_to_align();
        }
        if layout.size() == 0 {
            return Self { start: NonNull::dangling(), len: 0, layout };
        }
        // SAFETY: the layout has a size and is that of the elements, or larger; the memory is
        // fresh, so that it does not overlap them.
        unsafe {
            let Some(start) = NonNull::new(alloc(layout).cast::<T>()) else {
                handle_alloc_error(layout)
            };
            // Before the first touch, which fixes the size of the pages.
            #[cfg(target_os = "linux")]
            if layout.align() == LARGE_PAGE {
                // A refusal costs speed only.
                let _ = libc::madvise(start.as_ptr().cast(), layout.size(), libc::MADV_HUGEPAGE);
            }
            start.as_ptr().copy_from_nonoverlapping(elements.as_ptr(), elements.len());
            Self { start, len: elements.len(), layout }
        }
    }
}

impl<T: Copy> Deref for Pages<T> {
    type Target = [T];

    #[inline(always)]
    fn deref(&self) -> &[T] {
        // SAFETY: `new` wrote so many elements there.
        unsafe { std::slice::from_raw_parts(self.start.as_ptr(), self.len) }
    }
}

impl<T: Copy> Drop for Pages<T> {
    fn drop(&mut self) {
        if self.layout.size() > 0 {
            // SAFETY: allocated by `new` with this layout; elements that are `Copy` need no drop.
            unsafe { dealloc(self.start.as_ptr().cast(), self.layout) };
        }
    }
}
