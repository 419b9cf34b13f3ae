//! Paths inside files. They must not lead out of the folder of the file that names them, unless the
//! user allows it, so that a capture from elsewhere cannot make the program read other files.

use std::path::{Path, PathBuf};

/// Where `name` lies below `folder`; `None` where it is absolute, names a drive, or climbs out.
/// Both kinds of slashes separate. Links are followed wherever they lead: whoever made the folder
/// put them there.
pub(crate) fn join(folder: &Path, name: &str) -> Option<PathBuf> {
    let parts = parts(name)?;
    (!parts.is_empty()).then(|| folder.join(parts.iter().collect::<PathBuf>()))
}

/// Whether `name` leaves the folder that it is relative to.
pub(crate) fn leaves(name: &str) -> bool {
    parts(name).is_none()
}

fn parts(name: &str) -> Option<Vec<&str>> {
    let bytes = name.as_bytes();
    let has_drive = bytes.len() > 1 && bytes[0].is_ascii_alphabetic() && bytes[1] == b':';
    if has_drive || name.starts_with(['/', '\\']) || name.contains('\0') {
        return None;
    }
    let mut parts = Vec::new();
    for part in name.split(['/', '\\']) {
        match part {
            "" | "." => {}
            ".." => {
                parts.pop()?;
            }
            part => parts.push(part),
        }
    }
    Some(parts)
}

/// The part of any path that can be used below a folder: without drive, root and climbing.
pub(crate) fn tail(name: &str) -> String {
    let bytes = name.as_bytes();
    let has_drive = bytes.len() > 1 && bytes[0].is_ascii_alphabetic() && bytes[1] == b':';
    let parts: Vec<&str> = name[if has_drive { 2 } else { 0 }..]
        .split(['/', '\\'])
        .filter(|part| !matches!(*part, "" | "." | ".."))
        .collect();
    parts.join("/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_climbs_out() {
        let folder = Path::new("/capture");
        assert_eq!(join(folder, "./images\\a b.exr"), Some("/capture/images/a b.exr".into()));
        assert_eq!(join(folder, "x/../y.exr"), Some("/capture/y.exr".into()));
        for name in
            ["../a", "x/../../a", "/etc/passwd", "\\\\server\\a", "C:\\a", "c:a", "a\0b", ""]
        {
            assert_eq!(join(folder, name), None, "{name:?}");
        }
        assert!(leaves("../a") && !leaves("a/../b"));
        assert_eq!(tail("D:\\photos\\..\\é a.jpg"), "photos/é a.jpg");
    }
}
