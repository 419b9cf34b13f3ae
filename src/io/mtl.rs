//! Wavefront material libraries, as far as they matter: whether a material is shiny.
//!
//! The three fields are read here and not by `tobj`, which gives up on the whole library for
//! one line it cannot parse.

use std::collections::HashSet;
use std::path::Path;

use super::Error;
use super::error::read_bounded;

const LARGEST: u64 = 64 << 20;

/// The names of the materials that reflect specularly: `illum` 2 or higher with a non-zero `Ks`
/// and `Ns` above zero.
pub fn read_specular(file: &Path) -> Result<HashSet<String>, Error> {
    let bytes = read_bounded(file, LARGEST)?;
    Ok(specular_names(&String::from_utf8_lossy(&bytes)))
}

fn specular_names(text: &str) -> HashSet<String> {
    #[derive(Default)]
    struct Shine {
        illum: i64,
        coloured: bool,
        exponent: f64,
    }
    let mut names = HashSet::new();
    let mut current = (String::new(), Shine::default());
    let mut finish = |(name, shine): (String, Shine)| {
        if shine.illum >= 2 && shine.coloured && shine.exponent > 0.0 {
            names.insert(name);
        }
    };
    for line in text.lines() {
        let (keyword, rest) = split_keyword(line);
        let mut numbers = rest.split_whitespace().filter_map(|word| word.parse::<f64>().ok());
        match keyword {
            "newmtl" => finish(std::mem::replace(&mut current, (rest.into(), Shine::default()))),
            "illum" => current.1.illum = numbers.next().map_or(0, |number| number as i64),
            "Ks" => current.1.coloured = numbers.take(3).any(|number| number > 0.0),
            "Ns" => current.1.exponent = numbers.next().unwrap_or(0.0),
            _ => {}
        }
    }
    finish(current);
    names
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
        assert_eq!(specular_names(text), HashSet::from(["shiny one".to_owned()]));
    }
}
