//! Wavefront material libraries: reflectances of materials, and whether they are glossy. A line
//! that cannot be read is ignored, and the rest of the library is used.

use std::collections::HashMap;
use std::path::Path;

use super::Error;
use super::error::read_bounded;
use crate::math::rgb::Rgb;
use crate::scene::Brdf;

const LARGEST: u64 = 64 << 20;
/// The largest exponent that is taken from a library.
const SHARPEST: f64 = 1e6;

/// A material of a library.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LibraryMaterial {
    /// It reflects specularly: `illum` 2 or higher with a non-zero `Ks` and `Ns` above zero.
    pub is_specular: bool,
    /// `Kd`, with `Ks` and `Ns` where it is specular: linear, as programs for modelling write them.
    /// `None` without a `Kd` that is a colour.
    pub reflectance: Option<Brdf>,
    /// Its diffuse reflectance is an image (`map_Kd`), which is not read.
    pub has_image: bool,
}

/// The materials of a library by their names.
pub fn read(file: &Path) -> Result<HashMap<String, LibraryMaterial>, Error> {
    let bytes = read_bounded(file, LARGEST)?;
    Ok(materials(&String::from_utf8_lossy(&bytes)))
}

/// A material as its lines have it.
#[derive(Default)]
struct Lines {
    illum: i64,
    diffuse: Option<Rgb>,
    specular: Option<Rgb>,
    exponent: f64,
    has_image: bool,
}

impl Lines {
    fn material(&self) -> LibraryMaterial {
        let specular = self.specular.filter(|own| own.iter().any(|value| *value > 0.0));
        let gloss = specular.filter(|_| self.illum >= 2 && self.exponent > 0.0);
        let reflectance = self.diffuse.map(|diffuse| {
            let diffuse = diffuse.map(|value| value.clamp(0.0, 1.0));
            let Some(specular) = gloss else { return Brdf::diffuse(diffuse) };
            // No more is sent back than came.
            let left = |c: usize| specular[c].clamp(0.0, 1.0 - diffuse[c]);
            Brdf::phong(diffuse, [left(0), left(1), left(2)], self.exponent.min(SHARPEST))
        });
        let (is_specular, has_image) = (gloss.is_some(), self.has_image);
        LibraryMaterial { is_specular, reflectance, has_image }
    }
}

fn materials(text: &str) -> HashMap<String, LibraryMaterial> {
    let mut materials = HashMap::new();
    let mut current: Option<(String, Lines)> = None;
    for line in text.lines() {
        let (keyword, rest) = split_keyword(line);
        if keyword == "newmtl" {
            let former = current.replace((rest.to_owned(), Lines::default()));
            materials.extend(former.map(|(name, lines)| (name, lines.material())));
        }
        let Some((_, own)) = &mut current else { continue };
        let number = rest.split_whitespace().next().and_then(|word| word.parse::<f64>().ok());
        match keyword {
            "illum" => own.illum = number.map_or(0, |number| number as i64),
            "Kd" => own.diffuse = colour(rest),
            "Ks" => own.specular = colour(rest),
            "Ns" => own.exponent = number.filter(|number| number.is_finite()).unwrap_or(0.0),
            "map_Kd" => own.has_image = true,
            _ => {}
        }
    }
    materials.extend(current.map(|(name, lines)| (name, lines.material())));
    materials
}

/// Three numbers, or one for all channels.
fn colour(text: &str) -> Option<Rgb> {
    let numbers: Vec<f64> =
        text.split_whitespace().map_while(|word| word.parse().ok()).take(3).collect();
    let colour = match numbers[..] {
        [grey] => [grey; 3],
        [red, green, blue] => [red, green, blue],
        _ => return None,
    };
    colour.iter().all(|value| value.is_finite()).then_some(colour)
}

/// The first word of a line and the trimmed rest.
pub(super) fn split_keyword(line: &str) -> (&str, &str) {
    let line = line.trim();
    match line.find(char::is_whitespace) {
        Some(end) => (&line[..end], line[end..].trim_start()),
        None => (line, ""),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_complete_shine_is_specular() {
        let text = "Ks 1 1 1\nillum 2\nnewmtl dull\nKs 0 0 0\nNs 30\nillum 2\n\
                    newmtl shiny one\nillum 2\r\nNs 30\r\nKs 0 0.2 0\r\nnewmtl flat\nillum 1\n\
                    Ks 1 1 1\nNs 9\nnewmtl cut\nKs\nNs x\nillum";
        let read = materials(text);
        let mut shiny = read.iter().filter(|(_, own)| own.is_specular).map(|(name, _)| name);
        assert_eq!((shiny.next().unwrap().as_str(), shiny.next()), ("shiny one", None));
        assert_eq!(read.len(), 4);
    }

    #[test]
    fn colours_are_taken_where_they_are_colours() {
        let text = "newmtl red\nKd 0.6 0.1 0.05\nKs 0.3 0.3 0.3\nNs 1\nillum 1\n\
                    newmtl varnish\nKd 0.9 0.4 0.2\nKs 0.5 0.5 0.5\nNs 40\nillum 2\n\
                    newmtl grey\nKd 0.25\nnewmtl spectral\nKd spectral file.rfl\n\
                    newmtl wood\nKd 1 1 1\nmap_Kd wood.png\nnewmtl odd\nKd 2 -1 nan\n";
        let read = materials(text);
        let own = |name: &str| read[name].reflectance;
        assert_eq!(own("red"), Some(Brdf::diffuse([0.6, 0.1, 0.05])), "illum 1 has no highlight");
        let varnish = own("varnish").unwrap();
        assert_eq!((varnish.diffuse, varnish.exponent), ([0.9, 0.4, 0.2], 40.0));
        for (specular, expected) in varnish.specular.into_iter().zip([0.1, 0.5, 0.5]) {
            assert!((specular - expected).abs() < 1e-12, "no more is sent back than came");
        }
        assert_eq!(own("grey"), Some(Brdf::diffuse([0.25; 3])));
        assert_eq!((own("spectral"), own("odd")), (None, None));
        assert!(read["wood"].has_image && !read["red"].has_image);
    }
}
