//! Writes files that get their final name only when they are complete.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::Path;

use super::Error;

/// Writes a file by `fill` into a temporary file of the same folder, forces it to the disk and
/// renames it. A failure or a crash leaves the old file, or none. Missing folders are made.
pub fn write(
    file: &Path,
    fill: impl FnOnce(&mut BufWriter<&File>) -> std::io::Result<()>,
) -> Result<(), Error> {
    write_whole(file, fill).map_err(|source| Error::Write { file: file.to_owned(), source })
}

/// As [`write()`], with the contents at hand.
pub fn write_bytes(file: &Path, contents: &[u8]) -> Result<(), Error> {
    write(file, |out| out.write_all(contents))
}

fn write_whole(
    file: &Path,
    fill: impl FnOnce(&mut BufWriter<&File>) -> std::io::Result<()>,
) -> std::io::Result<()> {
    let folder = match file.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    fs::create_dir_all(folder)?;
    let mut builder = tempfile::Builder::new();
    builder.prefix(".lobelia-").suffix(".part");
    #[cfg(unix)]
    {
        // Temporary files are private by default; results are as readable as any other file
        // (the process's mask still applies).
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    let temporary = builder.tempfile_in(folder)?;
    let mut out = BufWriter::new(temporary.as_file());
    fill(&mut out)?;
    out.flush()?;
    drop(out);
    temporary.as_file().sync_all()?;
    temporary.persist(file).map_err(|failure| failure.error)?;
    Ok(())
}
