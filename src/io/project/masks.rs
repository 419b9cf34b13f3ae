//! Masks in a project file: lengths of runs, beginning with kept pixels.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::io::{Error, Fault};
use crate::scene::{Capture, Mask};

/// Masks by the names of their photographs; the others have those of the capture's own files.
pub type Masks = BTreeMap<String, Arc<Mask>>;

/// The mask of one photograph.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct StoredMask {
    width: usize,
    height: usize,
    /// Separated by spaces.
    runs: String,
}

impl StoredMask {
    fn of(mask: &Mask) -> Self {
        let (width, height) = mask.size();
        let runs: Vec<String> = mask.runs().iter().map(u32::to_string).collect();
        Self { width, height, runs: runs.join(" ") }
    }
}

pub(super) fn stored_masks(masks: &Masks) -> BTreeMap<String, StoredMask> {
    masks.iter().map(|(name, mask)| (name.clone(), StoredMask::of(mask))).collect()
}

pub(super) fn read(file: &Path, stored: BTreeMap<String, StoredMask>) -> Result<Masks, Error> {
    let one = |(name, own): (String, StoredMask)| {
        let runs: Option<Vec<u32>> =
            own.runs.split_whitespace().map(|run| run.parse().ok()).collect();
        let mask = runs.and_then(|runs| Mask::from_runs((own.width, own.height), runs));
        match mask {
            Some(mask) => Ok((name, Arc::new(mask))),
            None => Err(Error::Invalid(Fault::new(
                file,
                format!("masks, \"{name}\""),
                format!("the runs are not those of {} x {} pixels", own.width, own.height),
                "Remove this mask from the file, or restore the file from its copy (.lobelia~)",
            ))),
        }
    };
    stored.into_iter().map(one).collect()
}

/// Puts masks on a capture as it was loaded. What is on hand of an earlier state is taken from there,
/// so that a run finds the same photograph again.
pub fn put_masks(capture: &mut Capture, masks: &Masks, earlier: Option<(&Capture, &Masks)>) {
    for (index, own) in capture.photographs.iter_mut().enumerate() {
        let (Some(image), Some(mask)) = (&mut own.image, masks.get(&own.name)) else { continue };
        // Of a photograph that was replaced by another; the project keeps it.
        if mask.size() != (image.width(), image.height()) {
            continue;
        }
        let same = earlier.and_then(|(capture, masks)| {
            let before = masks.get(&own.name).filter(|before| *before == mask)?;
            (before.size() == mask.size()).then_some(())?;
            capture.photographs.get(index)?.image.as_ref()
        });
        match same.filter(|same| same.has_pixels_of(image)) {
            Some(same) => *image = same.clone(),
            None => Arc::make_mut(image).set_mask(&mask.pixels()),
        }
    }
}
