//! Photographs that are too many for memory, kept in files while the program runs.
//!
//! Their pixels are written to a file without a name and mapped from there, so that the system
//! holds in memory what is being read, and gives it away where memory is short. Such files are gone
//! with the program, however it ends.

use std::fs::File;
use std::io::Write;
use std::path::PathBuf;

use memmap2::Mmap;

use crate::scene::{Image, Stored};

/// Up to so many bytes of all photographs stay in memory.
pub const MOST_IN_MEMORY: u64 = 256 << 20;

/// Moves an image's pixels to a file.
///
/// # Errors
/// Where the file cannot be written; the image is then left as it is.
pub fn keep(image: &mut Image) -> std::io::Result<()> {
    let mut file = tempfile::tempfile_in(folder())?;
    file.write_all(image.bytes())?;
    // SAFETY: the file has no name, and this process does not write to it any more.
    let map = unsafe { Mmap::map(&file)? };
    let kept = image.keep(Box::new(Mapped { map, _file: file }));
    if kept { Ok(()) } else { Err(std::io::ErrorKind::WriteZero.into()) }
}

/// Where such files are made: `TMPDIR`, else a folder that is on a disk. `/tmp` often is not.
pub fn folder() -> PathBuf {
    let on_disk = PathBuf::from("/var/tmp");
    if cfg!(unix) && std::env::var_os("TMPDIR").is_none() && on_disk.is_dir() {
        return on_disk;
    }
    std::env::temp_dir()
}

#[derive(Debug)]
struct Mapped {
    map: Mmap,
    _file: File,
}

impl Stored for Mapped {
    fn bytes(&self) -> &[u8] {
        &self.map
    }

    fn release(&self) {
        // SAFETY: the pages are those of a file that nobody writes to: they come back as they were.
        #[cfg(unix)]
        let _ = unsafe { self.map.unchecked_advise(memmap2::UncheckedAdvice::DontNeed) };
    }
}

#[cfg(test)]
mod tests;
