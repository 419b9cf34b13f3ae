//! The text files of a COLMAP model.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::Path;
use std::str::FromStr;

use glam::{DVec2, DVec3};

use super::{Image, Model, Point, Record};
use crate::io::{Error, Fault};

/// A line with what is needed to complain about it.
struct Line<'a> {
    file: &'a Path,
    number: usize,
    text: &'a str,
}

impl<'a> Line<'a> {
    fn words(&self) -> impl Iterator<Item = &'a str> + use<'a> {
        self.text.split_whitespace()
    }

    fn value<T: FromStr>(&self, word: Option<&str>) -> Result<T, Error> {
        let Some(word) = word else { return Err(self.wrong("values are missing")) };
        word.parse().map_err(|_| {
            let hint =
                if word.contains(',') { " (decimals need a point, not a comma)" } else { "" };
            let word: String = word.chars().take(40).collect();
            self.wrong(&format!("\"{word}\" is not the number that is due here{hint}"))
        })
    }

    fn wrong(&self, problem: &str) -> Error {
        let remedy = "Correct that line, or export the model again (colmap model_converter)";
        Error::Invalid(Fault::new(self.file, format!("line {}", self.number), problem, remedy))
    }
}

fn lines<'a>(file: &'a Path, text: &'a Cow<'a, str>) -> impl Iterator<Item = Line<'a>> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let line = move |(index, text): (usize, &'a str)| Line { file, number: index + 1, text };
    text.lines().enumerate().map(line).filter(|line| !line.text.trim_start().starts_with('#'))
}

/// `cameras.txt`: number, model, width, height, parameters.
pub fn cameras(file: &Path, bytes: &[u8]) -> Result<BTreeMap<i64, Record>, Error> {
    let text = String::from_utf8_lossy(bytes);
    let mut cameras = BTreeMap::new();
    for line in lines(file, &text).filter(|line| !line.text.trim().is_empty()) {
        let mut words = line.words();
        let id = line.value(words.next())?;
        let name = words.next().unwrap_or_default();
        let Some(model) = Model::of_name(name) else {
            let name: String = name.chars().take(40).collect();
            return Err(line.wrong(&format!("there is no camera model \"{name}\" in COLMAP")));
        };
        let size = (line.value(words.next())?, line.value(words.next())?);
        let parameters: Vec<f64> =
            words.map(|word| line.value(Some(word))).collect::<Result<_, _>>()?;
        if parameters.len() != model.count() {
            return Err(line.wrong(&format!(
                "{} has {} parameters, and {} are given",
                model.name(),
                model.count(),
                parameters.len()
            )));
        }
        let place = format!("line {}", line.number);
        cameras.insert(id, Record { model, size, parameters, place });
    }
    Ok(cameras)
}

/// `images.txt`: a line of pose, camera and name, and a line of observations, which may be empty.
pub fn images(file: &Path, bytes: &[u8]) -> Result<Vec<Image>, Error> {
    let text = String::from_utf8_lossy(bytes);
    let mut images: Vec<Image> = Vec::new();
    let mut is_pose = true;
    for line in lines(file, &text) {
        if is_pose {
            if line.text.trim().is_empty() {
                continue;
            }
            images.push(pose(&line)?);
            is_pose = false;
            continue;
        }
        is_pose = true;
        let Some(image) = images.last_mut() else { continue };
        let mut words = line.words();
        while let Some(x) = words.next() {
            let (x, y) = (line.value(Some(x))?, line.value(words.next())?);
            let _point: i64 = line.value(words.next())?;
            image.observations.push(DVec2::new(x, y));
        }
    }
    Ok(images)
}

fn pose(line: &Line) -> Result<Image, Error> {
    let mut words = line.words();
    let id = line.value(words.next())?;
    let mut numbers = [0.0; 7];
    for number in &mut numbers {
        *number = line.value(words.next())?;
    }
    let camera = line.value(words.next())?;
    // The name is the rest of the line, spaces and all.
    let mut rest = line.text.trim();
    for _ in 0..9 {
        let end = rest.find(char::is_whitespace).unwrap_or(rest.len());
        rest = rest[end..].trim_start();
    }
    if rest.is_empty() {
        return Err(line.wrong("the name of the image is missing"));
    }
    let [w, x, y, z, tx, ty, tz] = numbers;
    Ok(Image {
        id,
        rotation: [w, x, y, z],
        translation: DVec3::new(tx, ty, tz),
        camera,
        name: rest.to_owned(),
        observations: Vec::new(),
        place: format!("line {}", line.number),
    })
}

/// `points3D.txt`: number, position, colour, error, track.
pub fn points(file: &Path, bytes: &[u8]) -> Result<Vec<Point>, Error> {
    let text = String::from_utf8_lossy(bytes);
    let mut points = Vec::new();
    for line in lines(file, &text).filter(|line| !line.text.trim().is_empty()) {
        let mut words = line.words();
        let _id: i64 = line.value(words.next())?;
        let mut numbers = [0.0; 7];
        for number in &mut numbers {
            *number = line.value(words.next())?;
        }
        let mut track = Vec::new();
        while let Some(image) = words.next() {
            track.push((line.value(Some(image))?, line.value(words.next())?));
        }
        let position = DVec3::new(numbers[0], numbers[1], numbers[2]);
        points.push(Point { position, error_px: numbers[6], track });
    }
    Ok(points)
}
