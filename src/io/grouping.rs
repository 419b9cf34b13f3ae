//! Finds which photographs are exposures of one view.

use std::path::{Path, PathBuf};

use super::brackets::{Series, relative_exposure};
use super::photograph::{self, Shot};
use super::{Error, Fault, error, raw};
use crate::watch::Watch;

/// Photographs taken with more than this between them, in seconds, are of different views.
const LONGEST_PAUSE_SECS: f64 = 30.0;
/// Exposures within this fraction of each other are the same one again.
const SAME: f64 = 0.02;
const LARGEST_TABLE: u64 = 1 << 20;

/// A photograph that is to be put into a series.
struct Candidate {
    file: PathBuf,
    shot: Shot,
    seconds: f64,
}

/// Groups photographs to series.
///
/// Exposures come from `times` where they are given (see [`read_times`]), else from EXIF. With
/// `is_one` all files are one series. Else they are put in the order in which they were taken,
/// or of their names, and a new series begins where the folder changes, where an exposure comes
/// again, and, unless that would leave a photograph alone, where the name before its last number
/// changes or more than 30 seconds pass.
pub fn group(files: &[PathBuf], times: Option<&Times>, is_one: bool) -> Result<Vec<Series>, Error> {
    let shots: Vec<Shot> =
        files.iter().map(|file| photograph::shot(file)).collect::<Result<_, _>>()?;
    let first = shots.first().copied().unwrap_or_default();
    let mut candidates = Vec::with_capacity(files.len());
    for (index, (file, shot)) in std::iter::zip(files, shots).enumerate() {
        let seconds = match times {
            Some(times) => times.of(file, index)?,
            None => relative_exposure(&shot, &first).ok_or_else(|| no_time(file))?,
        };
        candidates.push(Candidate { file: file.clone(), shot, seconds });
    }
    Ok(if is_one { vec![series(candidates)] } else { grouped(candidates) })
}

/// Finds the series of two exposures or more among files of which many may be none: those that do
/// not say their time, and are not in `times`, are passed over. `watch` counts the files.
pub fn find(files: &[PathBuf], times: Option<&Times>, watch: &Watch) -> Result<Vec<Series>, Error> {
    watch.begin(files.len() as u64);
    let mut first = None;
    let mut candidates = Vec::new();
    for (index, file) in files.iter().enumerate() {
        watch.tick()?;
        // What cannot be read is no exposure.
        let Ok(shot) = photograph::shot(file) else { continue };
        let seconds = match times {
            Some(times) => times.of(file, index).ok(),
            None if shot.exposure_secs.is_some() => {
                relative_exposure(&shot, first.get_or_insert(shot))
            }
            None => None,
        };
        candidates.extend(seconds.map(|seconds| Candidate { file: file.clone(), shot, seconds }));
    }
    let mut series = grouped(candidates);
    series.retain(|series| series.files.len() > 1);
    Ok(series)
}

fn grouped(mut candidates: Vec<Candidate>) -> Vec<Series> {
    let is_timed = candidates.iter().all(|one| one.shot.taken_secs.is_some());
    candidates.sort_by(|a, b| {
        let place = shelf(&a.file).cmp(&shelf(&b.file));
        let time = match (a.shot.taken_secs, b.shot.taken_secs) {
            (Some(a), Some(b)) if is_timed => a.total_cmp(&b),
            _ => std::cmp::Ordering::Equal,
        };
        place.then(time).then_with(|| natural(&a.file).cmp(&natural(&b.file)))
    });
    let groups = split(candidates, |a, b| shelf(&a.file) != shelf(&b.file));
    let groups = split_unless_alone(groups, |a, b| stem_family(&a.file) != stem_family(&b.file));
    let groups = if is_timed {
        split_unless_alone(groups, |a, b| pause(a, b) > LONGEST_PAUSE_SECS)
    } else {
        groups
    };
    groups.into_iter().flat_map(split_where_repeated).map(series).collect()
}

/// What lies beside each other and may be of one series: cameras write RAW files and developed
/// ones of the same exposures into one folder.
fn shelf(file: &Path) -> (Option<&Path>, bool) {
    (file.parent(), raw::is_raw(file))
}

fn series(candidates: Vec<Candidate>) -> Series {
    let mut order: Vec<usize> = (0..candidates.len()).collect();
    order.sort_by(|a, b| candidates[*a].seconds.total_cmp(&candidates[*b].seconds));
    Series {
        reference: order.get(order.len() / 2).copied().unwrap_or(0),
        seconds: candidates.iter().map(|one| one.seconds).collect(),
        files: candidates.into_iter().map(|one| one.file).collect(),
    }
}

fn split(
    candidates: Vec<Candidate>,
    is_border: impl Fn(&Candidate, &Candidate) -> bool,
) -> Vec<Vec<Candidate>> {
    let mut groups: Vec<Vec<Candidate>> = Vec::new();
    for candidate in candidates {
        match groups.last_mut() {
            Some(group) if group.last().is_some_and(|last| !is_border(last, &candidate)) => {
                group.push(candidate);
            }
            _ => groups.push(vec![candidate]),
        }
    }
    groups
}

/// Splits every group at its borders, or leaves it whole if one photograph would be alone.
fn split_unless_alone(
    groups: Vec<Vec<Candidate>>,
    is_border: impl Fn(&Candidate, &Candidate) -> bool,
) -> Vec<Vec<Candidate>> {
    let mut result = Vec::new();
    for group in groups {
        let borders: Vec<usize> =
            (1..group.len()).filter(|&i| is_border(&group[i - 1], &group[i])).collect();
        let ends = borders.iter().copied().chain([group.len()]);
        let begins = std::iter::once(0).chain(borders.iter().copied());
        if std::iter::zip(begins, ends).all(|(begin, end)| end - begin > 1) {
            result.extend(split(group, &is_border));
        } else {
            result.push(group);
        }
    }
    result
}

fn split_where_repeated(group: Vec<Candidate>) -> Vec<Vec<Candidate>> {
    let mut groups: Vec<Vec<Candidate>> = Vec::new();
    for candidate in group {
        let is_again = |own: &Candidate| (own.seconds / candidate.seconds - 1.0).abs() < SAME;
        match groups.last_mut() {
            Some(group) if !group.iter().any(is_again) => group.push(candidate),
            _ => groups.push(vec![candidate]),
        }
    }
    groups
}

/// The seconds between the end of one exposure and the beginning of the next.
fn pause(before: &Candidate, after: &Candidate) -> f64 {
    match (before.shot.taken_secs, after.shot.taken_secs) {
        (Some(a), Some(b)) => b - a - before.shot.exposure_secs.unwrap_or(0.0),
        _ => 0.0,
    }
}

/// What stands before the last number of a name.
fn stem_family(file: &Path) -> String {
    let stem = file.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into());
    let Some(end) = stem.rfind(|letter: char| letter.is_ascii_digit()) else { return stem };
    let digits = |letter: char| letter.is_ascii_digit();
    stem[..=end].trim_end_matches(digits).to_owned()
}

/// A name with its numbers as numbers, so that 9 comes before 10.
fn natural(file: &Path) -> Vec<(u128, String)> {
    let name = file.file_name().map_or_else(String::new, |name| name.to_string_lossy().into());
    let mut parts = Vec::new();
    let mut rest = name.as_str();
    while !rest.is_empty() {
        let words = rest.find(|letter: char| letter.is_ascii_digit()).unwrap_or(rest.len());
        let (word, tail) = rest.split_at(words);
        let digits = tail.find(|letter: char| !letter.is_ascii_digit()).unwrap_or(tail.len());
        let (number, tail) = tail.split_at(digits);
        // The word stands before the number.
        parts.push((0, word.to_owned()));
        parts.push((number.parse().unwrap_or(0), number.to_owned()));
        rest = tail;
    }
    parts
}

fn no_time(file: &Path) -> Error {
    Error::Missing(Fault::new(
        file,
        "",
        "the file does not say its exposure time (EXIF)",
        "Give the times with --times: a list in the order of the files (1/8,1,8), or a table \
         file,seconds",
    ))
}

/// Exposure times that the user gives.
#[derive(Clone, Debug, PartialEq)]
pub enum Times {
    /// In the order of the files.
    List(Vec<f64>),
    /// By file name.
    Table { table: PathBuf, rows: Vec<(String, f64)> },
}

impl Times {
    fn of(&self, file: &Path, index: usize) -> Result<f64, Error> {
        match self {
            Self::List(times) => times.get(index).copied().ok_or_else(|| {
                Error::Missing(Fault::new(
                    file,
                    "",
                    format!("--times names {} times only, and this is one more file", times.len()),
                    "Give a time for every file, in their order",
                ))
            }),
            Self::Table { table, rows } => {
                let name = file.file_name().map(|name| name.to_string_lossy().into_owned());
                let row = rows.iter().find(|(own, _)| Some(own) == name.as_ref());
                row.map(|(_, seconds)| *seconds).ok_or_else(|| {
                    Error::Missing(Fault::new(
                        table,
                        "",
                        format!("there is no row for {}", file.display()),
                        "Give every file its time: file,seconds",
                    ))
                })
            }
        }
    }
}

/// Reads `text` as times in seconds (`1/8,1,8`), or as the name of a table with a row
/// `file,seconds` each.
pub fn read_times(text: &str) -> Result<Times, Error> {
    let list: Option<Vec<f64>> = text.split(',').map(seconds).collect();
    if let Some(times) = list {
        return Ok(Times::List(times));
    }
    let table = Path::new(text);
    let bytes = error::read_bounded(table, LARGEST_TABLE)?;
    let contents = String::from_utf8_lossy(&bytes);
    let mut rows = Vec::new();
    for (index, line) in contents.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let row = line.split([',', ';', '\t']).map(str::trim).collect::<Vec<_>>();
        match row.as_slice() {
            [file, time, ..] if seconds(time).is_some() => {
                rows.push(((*file).to_owned(), seconds(time).unwrap_or(1.0)));
            }
            // The names of the columns.
            [_, _, ..] if rows.is_empty() => {}
            _ => {
                return Err(Error::Invalid(Fault::new(
                    table,
                    format!("line {}", index + 1),
                    "this is no row of file,seconds with a positive time",
                    "Write for example IMG_1.jpg,1/8",
                )));
            }
        }
    }
    Ok(Times::Table { table: table.to_owned(), rows })
}

/// A positive number or fraction.
fn seconds(text: &str) -> Option<f64> {
    let number = |text: &str| text.trim().parse::<f64>().ok();
    let value = match text.split_once('/') {
        Some((above, below)) => number(above)? / number(below)?,
        None => number(text)?,
    };
    (value.is_finite() && value > 0.0).then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn candidate(file: &str, seconds: f64) -> Candidate {
        Candidate { file: file.into(), shot: Shot::default(), seconds }
    }

    #[test]
    fn families_and_order_of_names() {
        for (name, family) in
            [("a/000_e0.jpg", "000_e"), ("IMG_2600.JPG", "IMG_"), ("x.png", "x"), ("a1b.png", "a")]
        {
            assert_eq!(stem_family(Path::new(name)), family);
        }
        assert!(natural(Path::new("e9.png")) < natural(Path::new("e10.png")));
        assert!(natural(Path::new("a10.png")) < natural(Path::new("b9.png")));
    }

    #[test]
    fn a_repeated_exposure_begins_a_series() {
        let files = [("a", 0.1), ("b", 1.0), ("c", 10.0), ("d", 0.1001), ("e", 1.0), ("f", 10.0)];
        let groups =
            split_where_repeated(files.map(|(name, seconds)| candidate(name, seconds)).into());
        assert_eq!(groups.iter().map(Vec::len).collect::<Vec<_>>(), [3, 3]);
    }

    #[test]
    fn names_that_would_leave_one_alone_do_not_split() {
        let family = |a: &Candidate, b: &Candidate| stem_family(&a.file) != stem_family(&b.file);
        let make = |names: [&str; 4]| vec![names.map(|name| candidate(name, 1.0)).into()];
        let sizes = |names| {
            split_unless_alone(make(names), family).iter().map(Vec::len).collect::<Vec<_>>()
        };
        assert_eq!(sizes(["0_e0", "0_e1", "1_e0", "1_e1"]), [2, 2]);
        assert_eq!(sizes(["t0.5", "t1", "t2", "t4"]), [4]);
    }

    #[test]
    fn times_are_numbers_and_fractions() {
        assert_eq!(read_times("1/8, 1,8").unwrap(), Times::List(vec![0.125, 1.0, 8.0]));
        for wrong in ["1/0,1", "-1,2", "0"] {
            assert!(read_times(wrong).is_err(), "{wrong}");
        }
    }
}
