//! Rendered pictures as files: OpenEXR with its layers, sRGB to look at, and the composite with
//! the photograph.

use std::collections::BTreeSet;
use std::fmt;
use std::path::Path;
use std::sync::Arc;

use super::super::exr::ColorSpace;
use super::super::{Error, exr, png};
use super::file_name;
use crate::math::rgb::{CHANNELS, Radiance, srgb_code};
use crate::render::composite::{compose, covered_radiance};
use crate::render::film::Film;
use crate::scene::Image;

/// How radiance becomes a picture to look at.
#[derive(Clone)]
pub enum Development {
    /// By sRGB's curve; the 99th percentile becomes white.
    Automatic,
    /// By a function that gives sRGB codes.
    By(Arc<dyn Fn(Radiance) -> [u8; CHANNELS] + Send + Sync>),
}

impl fmt::Debug for Development {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(match self {
            Self::Automatic => "Automatic",
            Self::By(_) => "By(…)",
        })
    }
}

/// One picture to be written.
pub struct Written<'a> {
    pub folder: &'a Path,
    /// Of the files, without extension.
    pub name: &'a str,
    pub film: &'a Film,
    /// Names of the added lights.
    pub lights: &'a [&'a str],
    /// A recovered sky is seen beyond the surfaces, so that no place of the picture is empty.
    pub shows_sky: bool,
    /// Of the OpenEXR files.
    pub color_space: ColorSpace,
    /// All layers of the radiance's file, not the coverage alone.
    pub has_layers: bool,
    /// Also a picture to look at.
    pub png: Option<&'a Development>,
    /// The same view without edits, the photograph that was taken from there, and the factor on
    /// all of the recovered light.
    pub composite: Option<(&'a Film, &'a Image, f32)>,
}

/// The name of a picture's files: that of its frame's `file_path` without folder and extension;
/// numbered where an earlier one has it.
pub fn name(file_path: &str, taken: &mut BTreeSet<String>) -> String {
    let path = file_path.replace('\\', "/");
    let stem = Path::new(&path).file_stem().and_then(|stem| stem.to_str()).unwrap_or("picture");
    file_name(stem, taken)
}

/// Writes `NAME.exr` with the layers direct, indirect, albedo, normal, Z (metres) and one per
/// light, as far as they are wanted, and where asked for `NAME.png` and `NAME-composite.exr`.
pub fn write(written: &Written) -> Result<(), Error> {
    let Written { folder, name, film, lights, shows_sky, has_layers, png, composite, color_space } =
        written;
    let (width, height) = (film.width, film.height);
    let beauty = film.beauty();
    let direct = film.direct();
    let indirect: Vec<Radiance> =
        beauty.iter().zip(&direct).map(|(b, d)| std::array::from_fn(|c| b[c] - d[c])).collect();
    let mut layers: Vec<(String, Vec<f32>)> = vec![
        ("A".into(), film.coverage()),
        ("Z".into(), film.distance_m()),
        ("object.A".into(), film.object_coverage()),
    ];
    let mut split = |layer: &str, channels: [&str; CHANNELS], pixels: &[Radiance]| {
        for (c, channel) in channels.into_iter().enumerate() {
            let values = pixels.iter().map(|pixel| pixel[c]).collect();
            layers.push((format!("{layer}.{channel}"), values));
        }
    };
    split("normal", ["X", "Y", "Z"], &film.normal());
    let mut split = |layer: &str, colors: &[Radiance]| {
        split(layer, ["R", "G", "B"], &color_space.of_rec_709(colors));
    };
    split("direct", &direct);
    split("indirect", &indirect);
    split("albedo", &film.albedo());
    split("light recovered", &film.layer(0));
    let mut taken = BTreeSet::from(["recovered".to_owned()]);
    for (index, light) in lights.iter().enumerate() {
        // A point in a layer's name would make a layer within a layer of it.
        let name = file_name(&light.replace('.', "_"), &mut taken);
        split(&format!("light {name}"), &film.layer(1 + index));
    }
    if !has_layers {
        layers.truncate(1);
    }
    let layers: Vec<(&str, &[f32])> =
        layers.iter().map(|(name, values)| (name.as_str(), values.as_slice())).collect();
    let (file, colors) = (folder.join(format!("{name}.exr")), color_space.of_rec_709(&beauty));
    exr::write_rgb_in(*color_space, &file, (width, height), &colors, &layers)?;
    if let Some(development) = png {
        let file = folder.join(format!("{name}.png"));
        // Where the 3D view shows its background, the picture is transparent.
        let coverage = (!shows_sky).then(|| film.coverage());
        write_png(&file, width, height, &beauty, coverage.as_deref(), development)?;
    }
    if let Some((without, photograph, light)) = composite {
        let composed = compose(film, &without.beauty(), photograph, *light);
        let file = folder.join(format!("{name}-composite.exr"));
        let object = film.object_coverage();
        let mut further = vec![("object.A".to_owned(), object)];
        let change = color_space.of_rec_709(&composed.change);
        for (c, channel) in ["R", "G", "B"].into_iter().enumerate() {
            let change = change.iter().map(|pixel| pixel[c]).collect();
            further.push((format!("change.{channel}"), change));
        }
        let further: Vec<(&str, &[f32])> =
            further.iter().map(|(name, values)| (name.as_str(), values.as_slice())).collect();
        let colors = color_space.of_rec_709(&composed.picture);
        exr::write_rgb_in(*color_space, &file, (width, height), &colors, &further)?;
        if let Some(development) = png {
            let file = folder.join(format!("{name}-composite.png"));
            write_png(&file, width, height, &composed.picture, None, development)?;
        }
    }
    Ok(())
}

/// Radiance as a picture to look at; transparent as far as the scene does not cover its pixels.
pub fn write_png(
    file: &Path,
    width: usize,
    height: usize,
    pixels: &[Radiance],
    coverage: Option<&[f32]>,
    development: &Development,
) -> Result<(), Error> {
    let code: Box<dyn Fn(Radiance) -> [u8; CHANNELS]> = match development {
        Development::Automatic => {
            let white = percentile(pixels, 0.99).max(f32::MIN_POSITIVE);
            Box::new(move |pixel| pixel.map(|value| srgb_code(value / white)))
        }
        Development::By(codes) => Box::new(move |pixel| codes(pixel)),
    };
    let Some(coverage) = coverage.filter(|own| own.iter().any(|&part| part < FULL)) else {
        let bytes: Vec<u8> = pixels.iter().flat_map(|&pixel| code(pixel)).collect();
        return png::write(file, width, height, &bytes);
    };
    let transparent = |(&pixel, &part): (&Radiance, &f32)| {
        let part = part.clamp(0.0, 1.0);
        let [r, g, b] = covered_radiance(pixel, part).map_or([0; CHANNELS], &code);
        [r, g, b, (255.0 * part).round() as u8]
    };
    let bytes: Vec<u8> = pixels.iter().zip(coverage).flat_map(transparent).collect();
    png::write_with_alpha(file, width, height, &bytes)
}

/// Pixels that are covered as far as this count as covered: sums of paths are rounded.
const FULL: f32 = 0.999;

/// The value below which a part of all channels of all pixels lies.
pub fn percentile(pixels: &[Radiance], part: f64) -> f32 {
    let mut values: Vec<f32> = pixels.iter().flatten().copied().filter(|v| v.is_finite()).collect();
    if values.is_empty() {
        return 0.0;
    }
    let index = ((values.len() - 1) as f64 * part) as usize;
    *values.select_nth_unstable_by(index, f32::total_cmp).1
}
