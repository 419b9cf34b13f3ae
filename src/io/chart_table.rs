//! Charts of one's own as tables: CSV, a row a patch.
//!
//! Columns: `row` and `column` from 1 on, the chart's first corner being that of 1, 1; `name` as one
//! likes, and may be left out, as may `sd`, the standard deviation of the reflectance; and either `red`, `green` and `blue`
//! (linear sRGB) or wavelengths in nanometres (`380`, `390`, …) with the reflectance at each, 0 to 1.

use std::path::Path;

use super::error::read_bounded;
use super::{Error, Fault};
use crate::math::rgb::{CHANNELS, Rgb};
use crate::math::spectrum;
use crate::scene::charts::{Patch, Table};

const LARGEST: u64 = 4 << 20;
/// Most rows, and most columns, of a chart.
const MOST: usize = 60;
/// Wavelengths that are light, in nanometres.
const LIGHT: std::ops::RangeInclusive<f64> = 300.0..=1100.0;
/// What the wavelengths of a table must reach at both ends: beyond it the eye sees little.
const REACHED: [f64; 2] = [430.0, 650.0];

/// Which cells of a row hold what.
struct Columns {
    row: usize,
    column: usize,
    name: Option<usize>,
    sd: Option<usize>,
    colors: Colors,
}

enum Colors {
    Linear([usize; CHANNELS]),
    /// Cells and wavelengths, which increase.
    Spectrum(Vec<usize>, Vec<f64>),
}

/// Reads a table.
pub fn read(file: &Path) -> Result<Table, Error> {
    let bytes = read_bounded(file, LARGEST)?;
    let text = String::from_utf8_lossy(bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(&bytes));
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let wrong = |line: u64, problem: String| {
        let place = if line == 0 { String::new() } else { format!("line {line}") };
        Error::Invalid(Fault::new(
            file,
            place,
            problem,
            "Give a row a patch, with the columns row, column, name and red, green, blue (linear) or \
             wavelengths (380, 390, …)",
        ))
    };
    let malformed = |failure: csv::Error| {
        let line = failure.position().map_or(0, csv::Position::line);
        wrong(line, format!("this is not valid CSV ({failure})"))
    };
    let head = reader.headers().map_err(malformed)?.clone();
    let columns = columns(&head).map_err(|problem| wrong(1, problem))?;
    let mut patches: Vec<(usize, usize, Patch)> = Vec::new();
    for record in reader.records() {
        let record = record.map_err(malformed)?;
        let line = record.position().map_or(0, csv::Position::line);
        let patch = patch(&record, &head, &columns).map_err(|problem| wrong(line, problem))?;
        if patches.iter().any(|own| (own.0, own.1) == (patch.0, patch.1)) {
            let (row, column) = (patch.0 + 1, patch.1 + 1);
            return Err(wrong(line, format!("row {row}, column {column} is there already")));
        }
        patches.push(patch);
    }
    let rows = patches.iter().map(|own| own.0 + 1).max().unwrap_or(0);
    let columns = patches.iter().map(|own| own.1 + 1).max().unwrap_or(0);
    if patches.is_empty() || rows * columns != patches.len() {
        let count = patches.len();
        return Err(wrong(
            0,
            format!("there are {count} patches, not {rows} rows of {columns}: some are missing"),
        ));
    }
    patches.sort_by_key(|own| (own.0, own.1));
    let patches: Vec<Patch> = patches.into_iter().map(|own| own.2).collect();
    Ok(Table { rows, columns, gap: 0.0, patches })
}

fn columns(head: &csv::StringRecord) -> Result<Columns, String> {
    let find = |name: &str| head.iter().position(|own| own.eq_ignore_ascii_case(name));
    let need = |name: &str| find(name).ok_or_else(|| format!("the column \"{name}\" is missing"));
    let mut waves: Vec<(f64, usize)> = head
        .iter()
        .enumerate()
        .filter_map(|(cell, name)| {
            let name = name.trim_end_matches("nm").trim();
            Some((name.parse::<f64>().ok().filter(|wave| wave.is_finite())?, cell))
        })
        .collect();
    waves.sort_by(|a, b| a.0.total_cmp(&b.0));
    let colors = match ["red", "green", "blue"].map(find) {
        [Some(r), Some(g), Some(b)] if waves.is_empty() => Colors::Linear([r, g, b]),
        [None, None, None] if !waves.is_empty() => {
            if let Some((wave, _)) = waves.iter().find(|own| !LIGHT.contains(&own.0)) {
                return Err(format!("{wave} nm is no wavelength of light"));
            }
            if let Some(pair) = waves.windows(2).find(|pair| pair[0].0 == pair[1].0) {
                return Err(format!("the wavelength {} is there twice", pair[0].0));
            }
            let (first, last) = (waves[0].0, waves[waves.len() - 1].0);
            if first > REACHED[0] || last < REACHED[1] {
                return Err(format!(
                    "the wavelengths reach from {first} to {last} nm, and are needed from {} to {}",
                    REACHED[0], REACHED[1]
                ));
            }
            let (waves, cells) = waves.into_iter().unzip();
            Colors::Spectrum(cells, waves)
        }
        _ => return Err("there must be either red, green and blue, or wavelengths".into()),
    };
    Ok(Columns {
        row: need("row")?,
        column: need("column")?,
        name: find("name"),
        sd: find("sd"),
        colors,
    })
}

/// Row and column from 0 on, and the patch.
fn patch(
    record: &csv::StringRecord,
    head: &csv::StringRecord,
    columns: &Columns,
) -> Result<(usize, usize, Patch), String> {
    let text = |cell: usize| record.get(cell).unwrap_or("");
    let named = |cell: usize| head.get(cell).unwrap_or("");
    let number = |cell: usize| -> Result<f64, String> {
        let value = text(cell).parse::<f64>().ok().filter(|value| value.is_finite());
        value.ok_or_else(|| format!("{} is \"{}\" and no number", named(cell), text(cell)))
    };
    let place = |cell: usize| -> Result<usize, String> {
        let value = text(cell).parse::<usize>().ok().filter(|own| (1..=MOST).contains(own));
        let value = value
            .ok_or_else(|| format!("{} is \"{}\", not 1 to {MOST}", named(cell), text(cell)))?;
        Ok(value - 1)
    };
    let part = |cell: usize| -> Result<f64, String> {
        let value = number(cell)?;
        match value {
            0.0..=1.2 => Ok(value),
            _ => Err(format!("{} is {value}, and a reflectance lies between 0 and 1", named(cell))),
        }
    };
    let (row, column) = (place(columns.row)?, place(columns.column)?);
    let reflectance: Rgb = match &columns.colors {
        // Colours beyond Rec. 709 have a channel below 0.
        Colors::Linear(cells) => {
            let [r, g, b] = cells.map(number);
            let values = [r?, g?, b?];
            if let Some(value) = values.iter().find(|value| !(-0.2..=1.2).contains(*value)) {
                return Err(format!("{value} is no linear value of a reflectance, 0 to 1"));
            }
            values
        }
        Colors::Spectrum(cells, waves) => {
            let values: Vec<f64> =
                cells.iter().map(|&cell| part(cell)).collect::<Result<_, _>>()?;
            spectrum::rec_709(waves, &values)
        }
    };
    let sd = match columns.sd.filter(|&cell| !text(cell).is_empty()) {
        Some(cell) => [part(cell)?; CHANNELS],
        None => Table::usual_sd(reflectance),
    };
    let name = columns.name.map(text).filter(|name| !name.is_empty());
    let name = name.map_or_else(|| format!("{}.{}", row + 1, column + 1), str::to_owned);
    Ok((row, column, Patch { name, reflectance, sd }))
}
