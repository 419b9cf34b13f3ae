//! Options files: TOML with a section for each stage, and `[start]` for the reflectances from which
//! the search starts.

use std::path::Path;

use toml::de::{DeTable, DeValue};

use crate::io::{Error, Fault};
use crate::options::OptionError;
use crate::reconstruct::Options;

/// No options file is nearly this long.
const LIMIT_BYTES: u64 = 1 << 20;

/// Sets the options that a file names and leaves the others.
pub fn read(file: &Path, options: &mut Options) -> Result<(), Error> {
    let bytes = super::error::read_bounded(file, LIMIT_BYTES)?;
    let invalid = |place: String, problem: String| {
        Error::Invalid(Fault::new(
            file,
            place,
            problem,
            "`lobelia reconstruct --help` lists every option with its range",
        ))
    };
    let text = String::from_utf8(bytes)
        .map_err(|_| invalid(String::new(), "the file is not UTF-8 text".to_owned()))?;
    let table: toml::Table = text.parse().map_err(|error: toml::de::Error| {
        let line = line_at(&text, error.span().map_or(0, |span| span.start));
        invalid(format!("line {line}"), error.message().to_owned())
    })?;
    for (section, values) in &table {
        let Some(values) = values.as_table() else {
            let place = placed(&text, section, None, section);
            return Err(invalid(place, "this is no [section]".to_owned()));
        };
        for (name, value) in values {
            let set = if section == "start" {
                set_start(options, name, value)
            } else {
                options.set(section, name, &plain(value))
            };
            set.map_err(|error| {
                let option = format!("[{section}] {name}");
                invalid(placed(&text, section, Some(name), &option), error.problem)
            })?;
        }
    }
    Ok(())
}

/// The line of a byte, from 1.
fn line_at(text: &str, byte: usize) -> usize {
    1 + text.bytes().take(byte).filter(|&byte| byte == b'\n').count()
}

/// Where a key of a table begins, and its value.
fn find<'a, 't>(table: &'a DeTable<'t>, wanted: &str) -> Option<(usize, &'a DeValue<'t>)> {
    let (key, value) = table.iter().find(|(key, _)| key.get_ref() == wanted)?;
    Some((key.span().start, value.get_ref()))
}

/// The place of a key of the file, or of an option in its section, in front of `what`.
fn placed(text: &str, section: &str, name: Option<&str>, what: &str) -> String {
    let byte = || {
        let file = DeTable::parse(text).ok()?;
        let (key, value) = find(file.get_ref(), section)?;
        match (name, value) {
            (None, _) => Some(key),
            (Some(name), DeValue::Table(options)) => find(options, name).map(|(key, _)| key),
            _ => None,
        }
    };
    match byte() {
        Some(byte) => format!("line {}, {what}", line_at(text, byte)),
        None => what.to_owned(),
    }
}

fn set_start(
    options: &mut Options,
    material: &str,
    value: &toml::Value,
) -> Result<(), OptionError> {
    let number = |value: &toml::Value| {
        value.as_float().or_else(|| value.as_integer().map(|whole| whole as f64))
    };
    let numbers: Option<Vec<f64>> =
        value.as_array().and_then(|values| values.iter().map(number).collect());
    // What is no triple becomes one that is refused like any other wrong value.
    let diffuse = numbers.and_then(|numbers| numbers.try_into().ok()).unwrap_or([f64::NAN; 3]);
    options.set_start(material, diffuse)
}

/// A value as it would be written on the command line.
fn plain(value: &toml::Value) -> String {
    match value {
        toml::Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}
