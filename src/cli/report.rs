//! The report that `lobelia reconstruct` prints at its end, in 100 columns.

use crate::io::export::lights;
use crate::math::rgb::{CHANNELS, Rgb};
use crate::reconstruct::lights::LightKind;
use crate::reconstruct::materials::Materials;
use crate::reconstruct::solution::MaterialCertainty;
use crate::reconstruct::{Reconstruction, Stage};
use crate::scene::{Capture, MaterialKind, Optics};

const COLUMNS: usize = 100;
/// Stands after a reflectance that the photographs determine less than the weak prior does.
const UNIDENTIFIED: &str = "*";
/// Longer names of materials get a line of their own.
const LONGEST_NAME: usize = 20;

pub(super) fn report(
    capture: &Capture,
    reconstruction: &Reconstruction,
    load_secs: f64,
) -> Vec<String> {
    let solution = &reconstruction.solution;
    let mut lines = wrapped(&format!(
        "{} samples, {}, {} of {} lobes active",
        reconstruction.samples.samples.len(),
        light_counts(reconstruction),
        solution.active_lobes(),
        reconstruction.lobes.lobes.len(),
    ));
    lines.extend(wrapped(&solution.brief()));
    lines.extend(solution.notes.iter().flat_map(|note| wrapped(&format!("note: {note}"))));
    lines.extend(reflectances(capture, reconstruction));
    if let Some(certainty) = &solution.certainty {
        if let Some(held_out) = certainty.held_out {
            lines.push(format!(
                "error of samples held out: {} % (R / G / B, of the logarithm)",
                percent(held_out)
            ));
        }
        lines.push(format!(
            "standard deviation of a factor common to all reflectances: {} % (R / G / B)",
            percent(certainty.scale.log_sd)
        ));
    }
    let gains = || reconstruction.gains.iter().map(|own| own.gain);
    if let (Some(low), Some(high)) = (gains().reduce(f64::min), gains().reduce(f64::max)) {
        lines.push(format!(
            "exposure of the photographs by common samples: {low:.3} to {high:.3} of the median"
        ));
    }
    let stages: Vec<String> = Stage::ALL
        .iter()
        .zip(reconstruction.spent())
        .map(|(stage, seconds)| format!("{} {seconds:.2}", stage.name()))
        .collect();
    let total = load_secs + reconstruction.spent().iter().sum::<f64>();
    let stages = stages.join(", ");
    lines.extend(wrapped(&format!("seconds: load {load_secs:.2}, {stages}, total {total:.2}")));
    lines
}

/// `1 lamp`, `2 lamps`.
pub(super) fn plural(number: usize, name: &str) -> String {
    match number {
        1 => format!("1 {name}"),
        _ => format!("{number} {name}s"),
    }
}

/// How many lights of every kind there are in `lights.json`.
fn light_counts(reconstruction: &Reconstruction) -> String {
    let count = |of_kind: &dyn Fn(LightKind) -> bool| {
        lights::count(reconstruction, |light| of_kind(light.kind))
    };
    let discs = count(&|kind| matches!(kind, LightKind::Sphere | LightKind::Surface));
    let mut parts = vec![plural(discs, "virtual light")];
    for (number, name) in [
        (count(&|kind| kind == LightKind::Sky), "sky cell"),
        (count(&|kind| kind == LightKind::Lamp), "lamp"),
        (count(&|kind| kind == LightKind::Sun), "sun"),
        (count(&|kind| matches!(kind, LightKind::Known(_))), "known light"),
    ] {
        if number > 0 {
            parts.push(plural(number, name));
        }
    }
    parts.join(", ")
}

/// A line for every diffuse and specular reflectance and exponent, the channels in columns.
fn reflectances(capture: &Capture, reconstruction: &Reconstruction) -> Vec<String> {
    let solution = &reconstruction.solution;
    let Materials { reflectances, certainty } = reconstruction.materials(capture);
    let mut rows: Vec<(&str, &str, Vec<String>)> = Vec::new();
    let (mut has_intervals, mut all_identified) = (false, true);
    for (index, material) in capture.materials.iter().enumerate() {
        let name = material.name.as_str();
        let Some(reflectance) = reflectances.get(index).copied().flatten() else {
            let what = match solution.optics.get(index).copied().unwrap_or_default() {
                Optics::Opaque => "not measured",
                Optics::Mirror(_) => "mirror",
                Optics::Glass => "clear glass",
            };
            rows.push((name, what, Vec::new()));
            continue;
        };
        let certainty = certainty.get(index).copied().flatten();
        let MaterialCertainty { diffuse, specular, exponent, roughness, identified } = certainty
            .unwrap_or(MaterialCertainty {
                identified: [true; CHANNELS],
                ..MaterialCertainty::default()
            });
        all_identified &= identified == [true; CHANNELS];
        has_intervals |= diffuse.iter().chain(&specular).any(Option::is_some) || exponent.is_some();
        let cells = |values: Rgb, intervals: [Option<[f64; 2]>; CHANNELS]| {
            (0..CHANNELS).map(|c| cell(values[c], intervals[c], identified[c])).collect()
        };
        rows.push((name, "diffuse", cells(reflectance.diffuse, diffuse)));
        if material.kind == MaterialKind::Specular {
            if let Some(coat) = reflectance.coat {
                let interval =
                    roughness.map_or(String::new(), |[a, b]| format!(" [{a:.2}, {b:.2}]"));
                rows.push(("", "coat of roughness", vec![format!("{coat:.2}{interval}")]));
                continue;
            }
            rows.push(("", "specular", cells(reflectance.specular, specular)));
            let interval = exponent.map_or(String::new(), |[a, b]| format!(" [{a:.1}, {b:.1}]"));
            rows.push(("", "exponent", vec![format!("{:.1}{interval}", reflectance.exponent)]));
        }
    }
    let width = |name: &str| name.chars().count();
    let short = |name: &str| width(name) <= LONGEST_NAME;
    let name_width =
        rows.iter().map(|row| row.0).filter(|name| short(name)).map(width).max().unwrap_or(0);
    let triples = rows.iter().filter(|row| row.2.len() == CHANNELS);
    let cell_width = triples.flat_map(|row| &row.2).map(|cell| width(cell)).max().unwrap_or(0);
    let mut lines = Vec::new();
    if has_intervals {
        lines.push("reflectances in red, green and blue [95 % interval]".to_owned());
    }
    for (name, what, cells) in rows {
        let name = if short(name) {
            name
        } else {
            lines.push(format!("  {name}"));
            ""
        };
        let mut line = format!("  {name:name_width$}  {what:8}");
        for cell in cells {
            line.push_str(&format!("  {cell:cell_width$}"));
        }
        lines.push(line.trim_end().to_owned());
    }
    if !all_identified {
        lines.push(format!(
            "  {UNIDENTIFIED} not identified: the photographs say less of it than what surfaces usually \
             reflect"
        ));
    }
    lines
}

fn cell(value: f64, interval: Option<[f64; 2]>, identified: bool) -> String {
    let mark = if identified { "" } else { UNIDENTIFIED };
    match interval {
        Some([low, high]) => format!("{value:.3}{mark} [{low:.3}, {high:.3}]"),
        None => format!("{value:.3}{mark}"),
    }
}

fn percent(values: Rgb) -> String {
    values.map(|value| format!("{:.1}", 100.0 * value)).join(" / ")
}

/// The words of a text in lines that are not too long, all but the first indented. Values of the
/// three channels stay together.
fn wrapped(text: &str) -> Vec<String> {
    let mut lines = Vec::new();
    let mut line = String::new();
    let joined = text.replace(" / ", "\u{a0}/\u{a0}").replace(" %", "\u{a0}%");
    for word in joined.split([' ', '\n']).filter(|word| !word.is_empty()) {
        if !line.is_empty() && line.chars().count() + 1 + word.chars().count() > COLUMNS {
            lines.push(std::mem::replace(&mut line, "  ".to_owned()));
        } else if !line.is_empty() {
            line.push(' ');
        }
        line.push_str(&word.replace('\u{a0}', " "));
    }
    lines.push(line);
    lines
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::io::export::fixture;

    fn text(reconstruction: &Reconstruction) -> String {
        report(&fixture::capture(), reconstruction, 0.25).join("\n")
    }

    #[test]
    fn intervals_and_lights_are_told() {
        assert_eq!(
            text(&fixture::reconstruction()),
            "\
2 samples, 2 virtual lights, 1 sky cell, 1 lamp, 1 sun, 1 known light, 5 of 10 lobes active
2 iterations (the objective's gradient vanishes): relative RMS from 20.0 / 20.0 / 20.0 % to
  10.0 / 10.0 / 10.0 % (R / G / B)
note: the world is open: a sky explains the photographs better
reflectances in red, green and blue [95 % interval]
  floor   diffuse   0.500 [0.450, 0.560]  0.400 [0.350, 0.460]  0.300*
          specular  0.050 [0.040, 0.060]  0.060 [0.050, 0.070]  0.070*
          exponent  40.0 [30.0, 52.0]
  wall    diffuse   0.200                 0.200                 0.200
  unseen  not measured
  * not identified: the photographs say less of it than what surfaces usually reflect
error of samples held out: 4.0 / 5.0 / 6.0 % (R / G / B, of the logarithm)
standard deviation of a factor common to all reflectances: 10.0 / 11.0 / 12.0 % (R / G / B)
seconds: load 0.25, samples 0.00, lights 0.00, transport 0.00, solve 0.00, textures 0.00, total 0.25"
        );
    }

    #[test]
    fn without_certainty_there_are_only_values() {
        let mut reconstruction = fixture::reconstruction();
        let mut solution = (*reconstruction.solution).clone();
        solution.certainty = None;
        reconstruction.solution = Arc::new(solution);
        let text = text(&reconstruction);
        assert!(text.contains("\n  floor   diffuse   0.500  0.400  0.300\n"), "{text}");
        assert!(text.contains("\n          exponent  40.0\n"), "{text}");
        for word in ["not identified", "interval", "held out", "standard deviation"] {
            assert!(!text.contains(word), "{word}: {text}");
        }
    }

    #[test]
    fn long_names_and_notes_stay_within_the_columns() {
        let mut capture = fixture::capture();
        capture.materials[0].name = "a".repeat(30);
        capture.materials[1].name = "b".repeat(LONGEST_NAME);
        let mut reconstruction = fixture::reconstruction();
        let mut solution = (*reconstruction.solution).clone();
        solution.notes = vec!["word ".repeat(60)];
        reconstruction.solution = Arc::new(solution);
        let lines = report(&capture, &reconstruction, 0.0);
        let notes: Vec<&String> = lines.iter().filter(|line| line.contains("word word")).collect();
        assert_eq!(notes.len(), 4);
        assert!(notes[1].starts_with("  word"));
        let words = notes.iter().flat_map(|line| line.split_whitespace());
        assert_eq!(words.filter(|word| *word == "word").count(), 60);
        let place = lines.iter().position(|line| line.trim() == "a".repeat(30)).unwrap();
        assert!(lines[place + 1].trim_start().starts_with("diffuse   0.500 ["));
        for line in &lines {
            assert!(line.chars().count() <= COLUMNS, "{line}");
        }
    }
}
