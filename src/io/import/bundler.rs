//! Bundler's `bundle.out`, which many programs write, with the list of its photographs.
//!
//! Bundler's manual, "Output format": cameras look along −z with +y up, x = R X + t, and image
//! positions are pixels from the middle of the image. Its middle is (w − 1)/2 counted from the
//! centre of the first pixel (`src/ImageData.cpp`), which is w/2 from the corner. `k1`, `k2`
//! multiply r² and r⁴. Image sizes are not in the file.

use std::path::Path;

use glam::{DMat3, DVec2, DVec3};

use super::format::{Format, Sign};
use super::{Lens, Parsed, View, gathered};
use crate::io::{Error, Fault};
use crate::scene::Distortion;

pub(super) const FORMAT: Format = Format {
    name: "Bundler",
    signs: &[Sign::End("out")],
    parse: |file, bytes, names| parse(file, bytes, &names()?),
};

/// Reads the bytes of a file and the names of its photographs, one a camera; `file` is for
/// messages.
pub fn parse(file: &Path, bytes: &[u8], names: &[String]) -> Result<Parsed, Error> {
    let text = String::from_utf8_lossy(bytes);
    let mut words = text
        .lines()
        .enumerate()
        .filter(|(_, line)| !line.trim_start().starts_with('#'))
        .flat_map(|(index, line)| line.split_whitespace().map(move |word| (index + 1, word)));
    let mut last = 1;
    let mut number = || -> Result<f64, Error> {
        let Some((line, word)) = words.next() else {
            return Err(invalid(file, last, "the file ends before all its cameras are there"));
        };
        last = line;
        match word.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok(value),
            _ => {
                let word: String = word.chars().take(40).collect();
                Err(invalid(file, line, &format!("\"{word}\" is not a finite number")))
            }
        }
    };
    let (count, _points) = (number()?, number()?);
    if count < 1.0 || count.fract() != 0.0 {
        return Err(invalid(file, 1, "there is no number of cameras at the beginning"));
    }
    let mut parsed = Parsed::default();
    let (mut unposed, mut nameless) = (Vec::new(), 0);
    for index in 0..count as u64 {
        let mut values = [0.0; 15];
        for value in &mut values {
            *value = number()?;
        }
        let [focal, k1, k2, rest @ ..] = values;
        let Some(name) = usize::try_from(index).ok().and_then(|index| names.get(index)) else {
            nameless += 1;
            continue;
        };
        let place = format!("camera {index} ({name})");
        // All zeros: the photograph was not registered.
        if focal == 0.0 {
            unposed.push(place);
            continue;
        }
        let (rows, translation) = rest.split_at(9);
        let world_from_camera = DMat3::from_cols_slice(rows);
        parsed.views.push(View {
            name: name.clone(),
            undistorted: None,
            place,
            size: None,
            lens: Lens::Centred { focal: DVec2::splat(focal) },
            distortion: Distortion { radial: [k1, k2, 0.0, 0.0], ..Default::default() },
            // The rows of R are the camera's axes.
            world_from_camera,
            position: -(world_from_camera * DVec3::from_slice(translation)),
        });
    }
    if nameless > 0 {
        return Err(Error::Missing(Fault::new(
            file,
            "",
            format!("the list of photographs names {} of {count} cameras", names.len()),
            "Put the list beside the file as list.txt, a photograph a line",
        )));
    }
    if parsed.views.is_empty() {
        return Err(invalid(file, 1, "no camera of the file was registered"));
    }
    parsed.warnings.extend(gathered(
        file,
        &unposed,
        "the photograph was not registered; left out.",
    ));
    Ok(parsed)
}

/// The names in a list: the first word of each line, or the whole line where it ends in one.
pub fn names(text: &str) -> Vec<String> {
    let lines = text.strip_prefix('\u{feff}').unwrap_or(text).lines();
    lines
        .map(str::trim)
        .filter(|line| !line.is_empty())
        .map(|line| {
            // "a b.jpg 0 1234.5": the numbers behind the name are of no use here.
            let mut name = line;
            for _ in 0..2 {
                match name.rsplit_once(char::is_whitespace) {
                    Some((rest, word)) if word.parse::<f64>().is_ok() => name = rest.trim_end(),
                    _ => break,
                }
            }
            name.to_owned()
        })
        .collect()
}

fn invalid(file: &Path, line: usize, problem: &str) -> Error {
    let remedy = "Copy the file again, or export it again as Bundler";
    Error::Invalid(Fault::new(file, format!("line {line}"), problem, remedy))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_may_hold_spaces() {
        let list = "./images/a b.jpg 0 1234.5\r\n\r\nc.jpg\r\n007.jpg 0 7\n";
        assert_eq!(names(list), ["./images/a b.jpg", "c.jpg", "007.jpg"]);
    }
}
