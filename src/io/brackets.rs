//! Exposure series on disk: which files belong together, their exposure times, and merging them to
//! radiance.

use std::path::{Path, PathBuf};

use glam::{DMat3, Vec3};
use rayon::prelude::*;

use super::photograph::{self, Photo, Shot};
use super::{Error, Fault, exr, profile, raw};
use crate::exposures::options::{RawColor, ResponseKind};
use crate::exposures::response::Undetermined;
use crate::exposures::samples::{self, Readings};
use crate::exposures::times::{self, Checked};
use crate::exposures::{Codes, Exposure, MergeOptions, Merged, Response, align, merge};
use crate::watch::Watch;

/// The exposures of one series, decoded, are held in memory together; more is refused.
const LARGEST_SERIES: u64 = 4 << 30;
/// Series that fit into this together are decoded once, others twice.
const KEPT: u64 = 1 << 30;

/// The exposures of one view.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    pub files: Vec<PathBuf>,
    /// The light each of them let in, relative to one second; above 0.
    pub seconds: Vec<f64>,
    /// The file that others are aligned to.
    pub reference: usize,
}

impl Series {
    /// The reference's name without its extension.
    pub fn name(&self) -> String {
        let stem = self.files[self.reference].file_stem();
        stem.map_or_else(String::new, |stem| stem.to_string_lossy().into_owned())
    }
}

/// What was found out about all series before they were merged.
#[derive(Clone, Debug)]
pub struct Found {
    pub checked: Checked,
    /// Of each series and exposure, in pixels.
    pub shifts: Vec<Vec<[isize; 2]>>,
    /// Of each series, linear Rec. 709 from the channels of its files, where that is to be applied.
    pub colors: Vec<Option<DMat3>>,
    pub warnings: Vec<String>,
}

/// The number of steps that [`merge_all`] counts.
pub fn steps(series: &[Series]) -> u64 {
    series.iter().map(|series| series.files.len() as u64 + 1).sum()
}

/// Finds out about all series what they share, without merging: the response (`known`, or as
/// the options say), the shifts, and whether times and pixels agree. `watch` counts the exposures.
/// Memory as for [`merge_all`], but for the results.
pub fn investigate(
    series: &[Series],
    known: Option<Response>,
    options: &MergeOptions,
    watch: &Watch,
) -> Result<Found, Error> {
    examine(series, known, options, watch, false).map(|(found, _)| found)
}

/// Merges each series, in order, all with one response (`known`, or as the options say) and so
/// on one scale. `done` gets each with its index as soon as it is merged. `watch` is ticked
/// [`steps`] times.
///
/// Memory: the decoded exposures of one series (3 or 6 bytes a pixel and exposure; at most
/// 4 GiB), 12 bytes a pixel for the result, while aligning 2.7 bytes a pixel and exposure, and at
/// most 1 GiB of other series.
pub fn merge_all(
    series: &[Series],
    known: Option<Response>,
    options: &MergeOptions,
    watch: &Watch,
    mut done: impl FnMut(usize, Merged) -> Result<(), Error>,
) -> Result<Found, Error> {
    let (found, kept) = examine(series, known, options, watch, true)?;
    let mut kept = kept.into_iter();
    for (index, one) in series.iter().enumerate() {
        let exposures = match kept.next() {
            Some(exposures) => exposures,
            None => {
                let mut exposures = decode(one, watch, false)?;
                apply(&mut exposures, &found.shifts[index]);
                exposures
            }
        };
        let Checked { response, trusted, .. } = &found.checked;
        let mut merged =
            merge(&exposures, &trusted[index], one.reference, response, options, watch)?;
        drop(exposures);
        if let Some(matrix) = found.colors[index] {
            turn(&mut merged, matrix, raw::is_raw(&one.files[one.reference]));
        }
        watch.tick()?;
        done(index, merged)?;
    }
    Ok(found)
}

/// What the series share, and their exposures where these fit into memory and are wanted.
fn examine(
    series: &[Series],
    known: Option<Response>,
    options: &MergeOptions,
    watch: &Watch,
    keep: bool,
) -> Result<(Found, Vec<Vec<Exposure>>), Error> {
    let sizes: Vec<u64> = series.iter().map(check_files).collect::<Result<_, _>>()?;
    let is_kept = keep && sizes.iter().sum::<u64>() <= KEPT;
    let count = (options.pixels / series.len().max(1)).max(options.pixels.min(400));
    let mut kept = Vec::new();
    let mut shifts = Vec::with_capacity(series.len());
    let mut readings: Vec<Readings> = Vec::with_capacity(series.len());
    let mut all_deep = true;
    for (index, one) in series.iter().enumerate() {
        let mut exposures = decode(one, watch, true)?;
        let found = if options.align {
            align::shifts(&exposures, one.reference, watch)?
        } else {
            vec![[0, 0]; exposures.len()]
        };
        apply(&mut exposures, &found);
        shifts.push(found);
        readings.push(samples::read(&exposures, one.reference, count, index as u64));
        all_deep &= exposures.iter().all(|e| matches!(e.codes, Codes::Sixteen(_)));
        if is_kept {
            kept.push(exposures);
        }
    }
    let is_linear = match options.response {
        ResponseKind::Auto => all_deep,
        ResponseKind::Recover => false,
        ResponseKind::Linear => true,
    };
    // What is said to be of sRGB's curve has that of its own profile.
    let known = match known {
        Some(response) if response == Response::srgb() => {
            let files = series.iter().flat_map(|series| &series.files);
            Some(profile::response(files.map(PathBuf::as_path))?)
        }
        known => known,
    };
    let checked = match known {
        Some(response) => times::check(&readings, response),
        None if is_linear => {
            let black = options.black * f64::from(crate::exposures::FULL_SCALE);
            times::check(&readings, Response::Linear { black })
        }
        None => times::recover_checked(&readings, options.smoothness)
            .map_err(|Undetermined| undetermined(series))?,
    };
    let mut warnings: Vec<String> =
        std::iter::zip(series, std::iter::zip(&checked.links, &checked.trusted))
            .flat_map(|(series, (links, trusted))| contradictions(series, links, trusted))
            .collect();
    let colors = colors(series, options, &mut warnings)?;
    Ok((Found { checked, shifts, colors, warnings }, kept))
}

/// What the channels of each series are multiplied by once it is merged: a channel that is
/// saturated in one exposure must not spoil the others.
fn colors(
    series: &[Series],
    options: &MergeOptions,
    warnings: &mut Vec<String>,
) -> Result<Vec<Option<DMat3>>, Error> {
    let mut unknown = None;
    let mut unusable = None;
    let mut colors = Vec::with_capacity(series.len());
    for one in series {
        let file = &one.files[one.reference];
        let is_raw = one.files.iter().any(|file| raw::is_raw(file));
        if is_raw != one.files.iter().all(|file| raw::is_raw(file)) {
            return Err(Error::Invalid(Fault::new(
                file,
                "",
                "RAW photographs and others are in one series",
                "Give the RAW files alone, or the others alone",
            )));
        }
        let matrix = match options.raw_color {
            RawColor::Srgb if is_raw => {
                let matrix = raw::srgb_from_camera(file)?;
                if matrix.is_none() {
                    unknown.get_or_insert(file);
                }
                matrix
            }
            _ if is_raw => None,
            _ => match profile::read(file)? {
                Some(Ok(profile)) => profile.rec_709,
                Some(Err(reason)) => {
                    unusable.get_or_insert((file, reason));
                    None
                }
                None => None,
            },
        };
        colors.push(matrix);
    }
    if let Some((file, reason)) = unusable {
        warnings.push(format!(
            "{}: its ICC profile is not used: {reason}. The colours are taken to be those of sRGB; \
             convert the photographs to sRGB or Display P3 if they are not.",
            file.display()
        ));
    }
    if let Some(file) = unknown {
        warnings.push(format!(
            "{}: neither the file nor what is known of its camera says what its channels are in \
             sRGB. They are left as the camera measured them (as with --merge.raw_color camera).",
            file.display()
        ));
    }
    Ok(colors)
}

/// Makes linear Rec. 709 of a file's own channels. What it cannot make of a camera's is no
/// measurement; of the colours that a profile states it is kept, with 0 for a channel below.
fn turn(merged: &mut Merged, rec_709: DMat3, of_camera: bool) {
    let matrix = rec_709.as_mat3();
    merged.pixels.par_iter_mut().for_each(|pixel| {
        *pixel = if of_camera {
            (matrix * Vec3::from_array(*pixel)).to_array()
        } else {
            exr::color::converted(*pixel, &rec_709)
        };
    });
}

fn apply(exposures: &mut [Exposure], shifts: &[[isize; 2]]) {
    for (exposure, shift) in exposures.iter_mut().zip(shifts) {
        exposure.shift = *shift;
    }
}

/// Whether the files of a series are of one size and fit into memory: their decoded size in
/// bytes.
fn check_files(series: &Series) -> Result<u64, Error> {
    let mut first = None;
    let mut total = 0;
    for file in &series.files {
        let (width, height, bytes) = photograph::head(file)?;
        total += (width * height * 3 * bytes) as u64;
        let (first_width, first_height) = *first.get_or_insert((width, height));
        if (width, height) != (first_width, first_height) {
            return Err(Error::Invalid(Fault::new(
                file,
                "",
                format!(
                    "the image has {width} x {height} pixels, but {} of the same series has \
                     {first_width} x {first_height}",
                    series.files[0].display()
                ),
                "Give the exposures of a series at one size, turned alike",
            )));
        }
    }
    if total > LARGEST_SERIES {
        return Err(Error::TooLarge(Fault::new(
            &series.files[0],
            "",
            format!("the {} exposures of this series need {} MB", series.files.len(), total >> 20),
            "Merge fewer exposures, or scale them down",
        )));
    }
    Ok(total)
}

/// The exposures of a series, not yet aligned.
fn decode(series: &Series, watch: &Watch, counts: bool) -> Result<Vec<Exposure>, Error> {
    let decoded: Vec<Result<Exposure, Error>> = std::iter::zip(&series.files, &series.seconds)
        .collect::<Vec<_>>()
        .into_par_iter()
        .map(|(file, &seconds)| {
            watch.check()?;
            let Photo { width, height, codes } = photograph::read(file)?;
            if counts {
                watch.tick()?;
            }
            Ok(Exposure { width, height, codes, seconds, shift: [0, 0] })
        })
        .collect();
    watch.check()?;
    // The first complaint in the order of the files, whichever thread came first.
    decoded.into_iter().collect()
}

fn undetermined(series: &[Series]) -> Error {
    let file = series.first().and_then(|series| series.files.first());
    Error::Invalid(Fault::new(
        file.map_or(Path::new(""), PathBuf::as_path),
        "",
        "the camera's response cannot be recovered from the exposures: too few pixels are well \
         exposed in two of them",
        "Give exposures one to three stops apart; or, if the files are linear, say so with \
         --merge.response linear",
    ))
}

/// An exposure time as photographers write it.
pub fn time(seconds: f64) -> String {
    let inverse = 1.0 / seconds;
    match inverse.round() {
        whole if seconds < 0.3 && (inverse / whole - 1.0).abs() < 0.01 => format!("1/{whole} s"),
        _ if seconds < 0.3 => format!("1/{inverse:.1} s"),
        _ => format!("{} s", (1000.0 * seconds).round() / 1000.0),
    }
}

/// A warning for every two neighbouring exposures whose pixels contradict their times, and one
/// for what is left out for that.
fn contradictions(series: &Series, links: &[times::Link], trusted: &[bool]) -> Vec<String> {
    let name = |exposure: usize| series.files[exposure].display();
    let mut warnings: Vec<String> = links
        .iter()
        .filter(|link| link.is_contradicted())
        .filter_map(|link| {
            let [short, long] = link.exposures;
            let measured = link.measured_stops?;
            Some(format!(
                "{} and {}: by their exposure times ({} and {}) the second is brighter by \
                 {:.2} stops, by their pixels by {measured:.2}. The times contradict the pixels.",
                name(short),
                name(long),
                time(series.seconds[short]),
                time(series.seconds[long]),
                link.stated_stops,
            ))
        })
        .collect();
    let left_out: Vec<String> = std::iter::zip(&series.files, trusted)
        .filter(|(_, trusted)| !**trusted)
        .map(|(file, _)| file.display().to_string())
        .collect();
    if !left_out.is_empty() {
        warnings.push(format!(
            "left out, since their times contradict the pixels: {}. Correct the times, and they \
             can be used.",
            left_out.join(", ")
        ));
    }
    warnings
}

/// The light that a photograph let in, relative to one second at the aperture and sensitivity of
/// `first`.
pub(super) fn relative_exposure(shot: &Shot, first: &Shot) -> Option<f64> {
    let ratio = |own: Option<f64>, other: Option<f64>| match (own, other) {
        (Some(own), Some(other)) => own / other,
        _ => 1.0,
    };
    let aperture = ratio(first.f_number, shot.f_number).powi(2);
    Some(shot.exposure_secs? * aperture * ratio(shot.iso, first.iso))
}
