//! Response curves: as a table to be kept and read back, and drawn.
//!
//! The table has a row a code of an 8-bit file, `value,red,green,blue`: the exposure that it
//! stands for, relative to that of the middle code.

use std::io::Write;
use std::path::Path;

use super::error::read_bounded;
use super::{Error, Fault, atomic};
use crate::exposures::{KNOTS, Response};
use crate::math::rgb::CHANNELS;

const COLUMNS: &str = "value,red,green,blue";
const LARGEST: u64 = 1 << 20;
/// The drawing: size and margin in pixels.
const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 400.0;
const MARGIN: f64 = 50.0;

/// Writes the table.
pub fn write(file: &Path, response: &Response) -> Result<(), Error> {
    atomic::write(file, |out| {
        writeln!(out, "{COLUMNS}")?;
        for code in 0..KNOTS {
            let [r, g, b] = exposures(response, code).map(f64::exp);
            writeln!(out, "{code},{r},{g},{b}")?;
        }
        Ok(())
    })
}

/// ln exposure of a code in each channel.
fn exposures(response: &Response, code: usize) -> [f64; CHANNELS] {
    std::array::from_fn(|channel| response.ln_exposure(channel, code as f32))
}

/// Reads a table that [`write()`] has written.
pub fn read(file: &Path) -> Result<Response, Error> {
    let bytes = read_bounded(file, LARGEST)?;
    let text = String::from_utf8_lossy(&bytes);
    let wrong = |line: usize, problem: &str| {
        Error::Invalid(Fault::new(
            file,
            format!("line {line}"),
            problem,
            "Give a table that merge --curve has written: value,red,green,blue and 256 rows of \
             positive numbers that do not decrease",
        ))
    };
    let mut lines = text.lines();
    if lines.next().map(str::trim) != Some(COLUMNS) {
        return Err(wrong(1, "this is no response curve"));
    }
    let mut knots = Box::new([[0.0; KNOTS]; CHANNELS]);
    let mut rows = 0;
    for (index, line) in lines.filter(|line| !line.trim().is_empty()).enumerate() {
        let place = index + 2;
        let cells: Vec<f64> =
            line.split(',').map(|cell| cell.trim().parse().unwrap_or(f64::NAN)).collect();
        if index >= KNOTS || cells.len() != 1 + CHANNELS || cells[0] != index as f64 {
            return Err(wrong(place, "this is not the row of the next value"));
        }
        for (channel, &exposure) in cells[1..].iter().enumerate() {
            // A linear response has no light at 0.
            let is_dark = index == 0 && exposure == 0.0;
            if !(exposure.is_finite() && exposure > 0.0 || is_dark) {
                return Err(wrong(place, "an exposure is no positive number"));
            }
            let ln = if is_dark { f64::MIN } else { exposure.ln() };
            if index > 0 && ln < knots[channel][index - 1] {
                return Err(wrong(place, "the exposure decreases"));
            }
            knots[channel][index] = ln;
        }
        rows = index + 1;
    }
    if rows < KNOTS {
        return Err(wrong(rows + 2, "rows are missing"));
    }
    for knots in knots.iter_mut().filter(|knots| knots[0] == f64::MIN) {
        // Finite, so that 16-bit codes below the second row have a value.
        knots[0] = 2.0 * knots[1] - knots[2];
    }
    Ok(Response::Curve(knots))
}

/// Draws ln exposure over codes as SVG.
pub fn draw(file: &Path, response: &Response) -> Result<(), Error> {
    let values: Vec<[f64; CHANNELS]> = (0..KNOTS).map(|code| exposures(response, code)).collect();
    let finite = || values.iter().flatten().copied().filter(|value| value.is_finite());
    let low = finite().fold(0.0, f64::min).floor();
    let high = finite().fold(0.0, f64::max).ceil().max(low + 1.0);
    let x = |code: f64| MARGIN + code / 255.0 * (WIDTH - 2.0 * MARGIN);
    let y = |value: f64| HEIGHT - MARGIN - (value - low) / (high - low) * (HEIGHT - 2.0 * MARGIN);
    atomic::write(file, |out| {
        writeln!(
            out,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" \
             font-family=\"sans-serif\" font-size=\"12\">\n\
             <rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"white\"/>"
        )?;
        let (left, right, bottom) = (x(0.0), x(255.0), y(low));
        let step = ((high - low) / 8.0).ceil().max(1.0);
        let mut tick = low;
        while tick <= high {
            let at = y(tick);
            writeln!(
                out,
                "<line x1=\"{left}\" x2=\"{right}\" y1=\"{at:.1}\" y2=\"{at:.1}\" \
                 stroke=\"#ddd\"/>\n<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{tick}</text>",
                left - 6.0,
                at + 4.0
            )?;
            tick += step;
        }
        for code in [0.0, 64.0, 128.0, 192.0, 255.0] {
            let (at, below) = (x(code), bottom + 16.0);
            writeln!(
                out,
                "<text x=\"{at:.1}\" y=\"{below:.1}\" text-anchor=\"middle\">{code}</text>"
            )?;
        }
        writeln!(
            out,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">code</text>\n\
             <text x=\"{left}\" y=\"{:.1}\">ln exposure</text>",
            0.5 * WIDTH,
            HEIGHT - 12.0,
            MARGIN - 16.0
        )?;
        for (channel, color) in ["#d62728", "#2ca02c", "#1f77b4"].into_iter().enumerate() {
            let points: Vec<String> = values
                .iter()
                .enumerate()
                .filter(|(_, value)| value[channel].is_finite())
                .map(|(code, value)| format!("{:.1},{:.1}", x(code as f64), y(value[channel])))
                .collect();
            writeln!(
                out,
                "<polyline points=\"{}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"1.5\"/>",
                points.join(" ")
            )?;
        }
        writeln!(out, "</svg>")
    })
}
