//! Single exposures as radiance: JPEG, PNG and TIFF files whose response is known, either the curve
//! of sRGB or one that `lobelia merge --curve` has written.

use std::path::Path;

use super::brackets::{Series, relative_exposure};
use super::photograph::{self, Shot};
use super::{Error, inside, response};
use crate::exposures::Response;
use crate::io::json::Field;

/// What `response` in a camera file says: `srgb`, or a table below the folder of the file.
pub fn read_response(field: &Field) -> Result<Response, Error> {
    let name = field.text()?;
    if name == "srgb" {
        return Ok(Response::srgb());
    }
    let folder = field.file.parent().unwrap_or(Path::new(""));
    let file = inside::join(folder, name).filter(|file| file.is_file());
    let file = file.ok_or_else(|| {
        field.wrong_with(
            &format!("there is no response \"{name}\""),
            "Give \"srgb\", or a table that lobelia merge --curve has written, in the folder of this \
             file",
        )
    })?;
    response::read(&file)
}

/// Each file as a series of its own, all on one scale: by the exposures of their EXIF, or alike if
/// one of them says none; with what is to be said of it.
pub fn series(files: &[&Path]) -> Result<(Vec<Series>, Option<String>), Error> {
    let shots: Vec<Shot> =
        files.iter().map(|file| photograph::shot(file)).collect::<Result<_, _>>()?;
    let first = shots.first().copied().unwrap_or_default();
    let stated: Option<Vec<f64>> =
        shots.iter().map(|shot| relative_exposure(shot, &first)).collect();
    let note = files.first().map(|file| {
        let scale = match &stated {
            Some(_) => "their EXIF says how much light each let in",
            None => {
                "they are taken to be of one exposure time, since EXIF does not give it for all"
            }
        };
        format!(
            "{}{}: single exposures, taken for radiance by a stated response; {scale}. Clipped \
             pixels are left out. What a camera or a program does to tones beyond that curve is not \
             undone: prefer exposure series, and check with lobelia chart.",
            file.display(),
            match files.len() {
                1 => String::new(),
                count => format!(" and {} more", count - 1),
            }
        )
    });
    let seconds = stated.unwrap_or_else(|| vec![1.0; files.len()]);
    let one = |(file, seconds): (&&Path, f64)| Series {
        files: vec![file.to_path_buf()],
        seconds: vec![seconds],
        reference: 0,
    };
    Ok((std::iter::zip(files, seconds).map(one).collect(), note))
}
