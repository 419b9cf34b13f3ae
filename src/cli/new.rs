//! `lobelia new DIR --images FILES…`.

use std::path::PathBuf;

use clap::ArgMatches;

use crate::cli::print::{say, say_line};
use crate::cli::{Ending, arguments};
use crate::io::model;
use crate::watch::Watch;

pub(super) fn run(matches: &ArgMatches) -> Result<(), Ending> {
    let folder = arguments::required_path(matches, "folder");
    let images: Vec<PathBuf> = matches.get_many("images").unwrap_or_default().cloned().collect();
    let photographs = model::new_capture(&folder, &images, &Watch::new())?;
    for own in &photographs {
        say!("{}  {}×{}", own.name, own.size.0, own.size.1);
        match own.lens.focal_px {
            Some(focal) => say!("  focal length {focal:.0} px (EXIF)"),
            None => say!("  focal length unknown"),
        }
        if !own.lens.orientation.is_upright() {
            say!("  turned upright (EXIF {})", own.lens.orientation.exif());
        }
        say_line!("{}", if own.is_radiance { "" } else { "  no radiance: geometry only" });
    }
    say_line!("written to {}", folder.display());
    say_line!("next: {}, then lobelia model {}", model::NAME, folder.display());
    Ok(())
}
