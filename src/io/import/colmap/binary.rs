//! The binary files of a COLMAP model: little endian, counts of 64 bits.

use std::collections::BTreeMap;
use std::path::Path;

use glam::{DVec2, DVec3};

use super::{Image, Model, Point, Record};
use crate::io::{Error, Fault};

/// Bytes that are taken one after the other.
struct Bytes<'a> {
    file: &'a Path,
    bytes: &'a [u8],
    at: usize,
}

impl Bytes<'_> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], Error> {
        let own = self.bytes.get(self.at..).and_then(|rest| rest.first_chunk::<N>());
        let own = *own.ok_or_else(|| {
            self.wrong("the file ends inside a record: it is cut off, or a count is wrong")
        })?;
        self.at += N;
        Ok(own)
    }

    fn whole(&mut self) -> Result<u64, Error> {
        self.take().map(u64::from_le_bytes)
    }

    fn small(&mut self) -> Result<i64, Error> {
        self.take().map(|bytes| i32::from_le_bytes(bytes).into())
    }

    fn number(&mut self) -> Result<f64, Error> {
        self.take().map(f64::from_le_bytes)
    }

    fn numbers<const N: usize>(&mut self) -> Result<[f64; N], Error> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = self.number()?;
        }
        Ok(numbers)
    }

    /// Text up to a zero byte.
    fn name(&mut self) -> Result<String, Error> {
        let rest = &self.bytes[self.at..];
        let Some(length) = rest.iter().position(|&byte| byte == 0) else {
            return Err(self.wrong("a name does not end"));
        };
        self.at += length + 1;
        Ok(String::from_utf8_lossy(&rest[..length]).into_owned())
    }

    fn wrong(&self, problem: &str) -> Error {
        let remedy = "Copy the model again, or export it again (colmap model_converter)";
        Error::Invalid(Fault::new(self.file, format!("byte {}", self.at), problem, remedy))
    }
}

/// `cameras.bin`.
pub fn cameras(file: &Path, bytes: &[u8]) -> Result<BTreeMap<i64, Record>, Error> {
    let mut bytes = Bytes { file, bytes, at: 0 };
    let mut cameras = BTreeMap::new();
    for _ in 0..bytes.whole()? {
        let place = format!("byte {}", bytes.at);
        let id = bytes.small()?;
        let number = bytes.small()?;
        let Some(model) = Model::of_number(number) else {
            return Err(bytes.wrong(&format!("there is no camera model {number} in COLMAP")));
        };
        let size = (bytes.whole()?, bytes.whole()?);
        let mut parameters = Vec::with_capacity(model.count());
        for _ in 0..model.count() {
            parameters.push(bytes.number()?);
        }
        cameras.insert(id, Record { model, size, parameters, place });
    }
    Ok(cameras)
}

/// `images.bin`.
pub fn images(file: &Path, bytes: &[u8]) -> Result<Vec<Image>, Error> {
    let mut bytes = Bytes { file, bytes, at: 0 };
    let mut images = Vec::new();
    for _ in 0..bytes.whole()? {
        let place = format!("byte {}", bytes.at);
        let id = bytes.small()?;
        let rotation = bytes.numbers::<4>()?;
        let translation = DVec3::from(bytes.numbers::<3>()?);
        let camera = bytes.small()?;
        let name = bytes.name()?;
        let mut observations = Vec::new();
        for _ in 0..bytes.whole()? {
            observations.push(DVec2::from(bytes.numbers::<2>()?));
            bytes.take::<8>()?;
        }
        images.push(Image { id, rotation, translation, camera, name, observations, place });
    }
    Ok(images)
}

/// `points3D.bin`.
pub fn points(file: &Path, bytes: &[u8]) -> Result<Vec<Point>, Error> {
    let mut bytes = Bytes { file, bytes, at: 0 };
    let mut points = Vec::new();
    for _ in 0..bytes.whole()? {
        bytes.take::<8>()?;
        let position = DVec3::from(bytes.numbers::<3>()?);
        bytes.take::<3>()?;
        let error_px = bytes.number()?;
        let mut track = Vec::new();
        for _ in 0..bytes.whole()? {
            let image = bytes.small()?;
            track.push((image, bytes.small()? as u64));
        }
        points.push(Point { position, error_px, track });
    }
    Ok(points)
}
