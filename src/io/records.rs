//! Results of studies: one JSON file for each run, and tables as CSV.

use std::io::Write;
use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::{Error, atomic, json, solution};

pub fn read<T: DeserializeOwned>(file: &Path) -> Result<T, Error> {
    let text = json::read_text(file)?;
    serde_json::from_str(&text).map_err(|failure| json::broken(file, &failure))
}

pub fn write(file: &Path, value: &impl Serialize) -> Result<(), Error> {
    solution::write_pretty(file, value)
}

/// A table with a line a row; cells with commas or quotation marks are quoted (RFC 4180).
pub fn write_csv(file: &Path, columns: &[&str], rows: &[Vec<String>]) -> Result<(), Error> {
    atomic::write(file, |out| {
        writeln!(out, "{}", columns.join(","))?;
        for row in rows {
            let cells: Vec<String> = row.iter().map(|cell| super::table::quoted(cell)).collect();
            writeln!(out, "{}", cells.join(","))?;
        }
        Ok(())
    })
}

/// A number in the shortest form that reads back as itself; nothing where it is none.
pub fn cell(value: Option<f64>) -> String {
    value.filter(|value| value.is_finite()).map_or_else(String::new, |value| value.to_string())
}
