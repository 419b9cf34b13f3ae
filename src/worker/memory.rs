//! Whether there is memory for a run.

use crate::io::process;
use crate::reconstruct::{Error, MemoryNeed, Options};
use crate::scene::Capture;

/// Compares what a run takes with what is free, where the system tells it.
pub(super) fn check(capture: &Capture, options: &Options) -> Result<(), Error> {
    match process::available_memory() {
        Some(available) => {
            MemoryNeed::of(capture, options).check(available, options.general.method)
        }
        None => Ok(()),
    }
}
