//! Merges exposure series and writes the images of radiance.

use std::collections::BTreeSet;
use std::path::PathBuf;

use crate::exposures::{MergeOptions, Response};
use crate::io;
use crate::io::brackets::{self, Found, Series};
use crate::watch::Watch;
use crate::worker::event::JobEvent;

/// Exposure series to be merged, all on one scale.
#[derive(Clone, Debug)]
pub struct Merging {
    /// Which files are merged into which image.
    pub series: Vec<Series>,
    /// A response that is known already.
    pub response: Option<Response>,
    /// How response, shifts and weights are found.
    pub options: MergeOptions,
    /// Where to.
    pub place: Place,
    /// Where the response goes as a table; a drawing of it goes beside.
    pub curve: Option<PathBuf>,
}

/// Where the merged images go.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// The image of the only series.
    File(PathBuf),
    /// A folder, where every image has the name of its series' reference.
    Folder(PathBuf),
}

/// One merged series.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    /// The image of radiance.
    pub file: PathBuf,
    /// In pixels.
    pub width: usize,
    /// In pixels.
    pub height: usize,
    /// Pixels that are burnt out in every exposure.
    pub too_bright: usize,
    /// Pixels that are black in every exposure.
    pub too_dark: usize,
}

/// What became of the series.
#[derive(Clone, Debug)]
pub struct MergeReport {
    /// The series that were merged.
    pub series: Vec<Series>,
    /// One for each series.
    pub written: Vec<Written>,
    /// The response and the times that were used.
    pub found: Found,
}

pub(super) fn perform(merging: &Merging, watch: &Watch) -> Result<JobEvent, io::Error> {
    let Merging { series, response, options, place, curve } = merging;
    watch.begin(brackets::steps(series));
    let mut taken = BTreeSet::new();
    let files: Vec<PathBuf> = series
        .iter()
        .map(|series| match place {
            Place::File(file) => file.clone(),
            Place::Folder(folder) => {
                let reference = series.files[series.reference].to_string_lossy();
                let name = io::export::pictures::name(&reference, &mut taken);
                folder.join(name).with_added_extension("exr")
            }
        })
        .collect();
    let mut written = Vec::with_capacity(series.len());
    let found = brackets::merge_all(series, response.clone(), options, watch, |index, merged| {
        let file = files[index].clone();
        io::exr::write_rgb(&file, merged.width, merged.height, &merged.pixels)?;
        written.push(Written {
            file,
            width: merged.width,
            height: merged.height,
            too_bright: merged.too_bright,
            too_dark: merged.too_dark,
        });
        Ok(())
    })?;
    if let Some(curve) = curve {
        io::response::write(curve, &found.checked.response)?;
        io::response::draw(&curve.with_extension("svg"), &found.checked.response)?;
    }
    let report = MergeReport { series: series.clone(), written, found };
    Ok(JobEvent::Merged(Box::new(report)))
}
