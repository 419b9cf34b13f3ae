use crate::io::Error;
use crate::reconstruct::{Options, Reconstruction};
use crate::scene::Capture;
use crate::watch::Watch;
use std::path::Path;
pub fn write(
    _folder: &Path,
    _capture: &Capture,
    _options: &Options,
    _r: &Reconstruction,
    _load_secs: f64,
    _watch: &Watch,
) -> Result<(), Error> {
    Ok(())
}
