//! `lobelia chart CAPTURE --image NAME --corners x,y x,y x,y x,y`.

use std::path::{Path, PathBuf};

use anyhow::anyhow;
use clap::builder::ArgAction;
use clap::{Arg, ArgMatches, Command, value_parser};
use glam::{DVec2, DVec3};
use serde_json::{Value, json};

use crate::cli::print::{note_line, say_line};
use crate::cli::progress::Display;
use crate::cli::{Ending, arguments, job, photographs};
use crate::io::capture::TAGS;
use crate::io::chart_table;
use crate::io::tags::charts::GREY;
use crate::io::tags::pin::{Changed, Pin, of_table};
use crate::math::rgb::Rgb;
use crate::scene::Capture;
use crate::scene::charts::{self, Chart, ColorFit, PatchReading, Table};
use crate::worker::{Command as Job, JobEvent, Worker};

pub(super) fn command(capture: Arg) -> Command {
    let value = |name: &'static str, value: &'static str, help: &'static str| {
        Arg::new(name).long(name).value_name(value).help(help)
    };
    let switch = |name: &'static str, help: &'static str| {
        Arg::new(name).long(name).help(help).action(ArgAction::SetTrue)
    };
    Command::new("chart")
        .about("Read a grey card or a colour chart in a photograph, and pin the scale by it")
        .long_about(
            "Read a grey card, a white tile, a ColorChecker or a chart of one's own between its four \
             corners in a photograph: mean radiance, spread and what is clipped of each patch, and for \
             a chart the colour matrix to linear Rec. 709, CIEDE2000 of every patch before and after, \
             and whether the photograph is linear. With --pin it is written into tags.json, where its \
             grey patches are surfaces of known reflectance.",
        )
        .arg(capture)
        .arg(
            value("image", "NAME", "A photograph of it, as file_path names it")
                .visible_alias("photograph")
                .action(ArgAction::Append)
                .required(true),
        )
        .arg(
            value("corners", "X,Y", "The four corners in turn, in pixels from the top left corner")
                .long_help(
                    "The four corners in turn, in pixels from the photograph's top left corner: of a \
                     card its own, any first; of a chart the outer ones of the patches in its corners, \
                     clockwise from that of the first patch (dark skin of a ColorChecker). Give --image \
                     and --corners once for each photograph",
                )
                .action(ArgAction::Append)
                .required(true)
                .num_args(1..=4),
        )
        .arg(
            value("kind", "KIND", "grey, white, colorchecker or a table [default: colorchecker]")
                .long_help(
                    "grey, white, colorchecker (also classic24: ColorChecker Classic, 24 patches), or a \
                     CSV file with a row a patch: row, column, name, and red, green, blue (linear) or \
                     wavelengths in nanometres [default: colorchecker]",
                ),
        )
        .arg(
            value("reflectance", "R,G,B", "Of a grey card or a white tile, linear, 0 to 1")
                .value_parser(parse_rgb),
        )
        .arg(
            value("sd", "NUMBER", "Standard deviation of that reflectance")
                .value_parser(value_parser!(f64)),
        )
        .arg(
            value("size", "W,H", "Its size in metres, if it stands free in space")
                .long_help(
                    "Its size in metres, if it stands free in space instead of lying on a known surface: \
                     the length of the side from the first corner to the second, and of the next one",
                )
                .value_parser(parse_size),
        )
        .arg(value("name", "NAME", "Its name [default: card or chart]"))
        .arg(switch("pin", "Write it into tags.json, with its reflectance as known"))
        .arg(switch("matrix", "Write the colour matrix into tags.json: photographs are read by it"))
        .arg(switch("json", "Print as JSON"))
        .arg(switch("quiet", "Show no progress").short('q'))
}

fn parse_size(text: &str) -> Result<DVec2, String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|own| own.trim().parse().ok()).collect();
    let size = match numbers.as_deref() {
        Some(&[x, y]) => DVec2::new(x, y),
        _ => DVec2::ZERO,
    };
    let is_size = size.is_finite() && size.min_element() > 0.0;
    is_size
        .then_some(size)
        .ok_or_else(|| "write two lengths in metres above 0, for example 0.29,0.20".to_owned())
}

fn parse_rgb(text: &str) -> Result<Rgb, String> {
    let numbers: Vec<f64> = text.split(',').filter_map(|own| own.trim().parse().ok()).collect();
    let wrong = "write a reflectance as three numbers from 0 to 1, for example 0.18,0.18,0.18";
    let rgb = <Rgb>::try_from(numbers).ok().filter(|_| text.matches(',').count() == 2);
    rgb.filter(|rgb| rgb.iter().all(|own| (0.0..=1.0).contains(own)))
        .ok_or_else(|| wrong.to_owned())
}

/// What is known of a chart before it is read: its table, and what `tags.json` says of it.
struct Kind {
    table: Table,
    tag: Value,
    name: &'static str,
}

fn kind(matches: &ArgMatches, folder: &Path) -> Result<Kind, Ending> {
    let text = matches.get_one::<String>("kind").map_or("colorchecker", String::as_str);
    let given = matches.get_one::<Rgb>("reflectance").copied();
    let sd = matches.get_one::<f64>("sd").copied();
    let is_card = ["grey", "white"].contains(&text);
    if !is_card && (given.is_some() || sd.is_some()) {
        return Err(anyhow!(
            "--reflectance and --sd are of grey cards and white tiles; a chart has its table"
        )
        .into());
    }
    if sd.is_some_and(|sd| !(sd.is_finite() && sd >= 0.0)) {
        return Err(anyhow!("--sd: a standard deviation is 0 or more").into());
    }
    Ok(match text {
        "grey" | "white" => {
            let Some(reflectance) = given.or((text == "grey").then_some(GREY)) else {
                return Err(anyhow!(
                    "whites differ: give the reflectance from its data sheet with --reflectance"
                )
                .into());
            };
            let mut tag = json!({"kind": text});
            if let Some(given) = given {
                tag["known_diffuse"] = json!(given);
            }
            if let Some(sd) = sd {
                tag["known_diffuse_sd"] = json!(sd);
            }
            Kind { table: Table::card(reflectance, [0.0; 3]), tag, name: "card" }
        }
        "colorchecker" | "classic24" => Kind {
            table: Table::color_checker(),
            tag: json!({"kind": "colorchecker"}),
            name: "chart",
        },
        file => {
            let file = PathBuf::from(file);
            if !file.is_file() {
                return Err(anyhow!(
                    "--kind: there is no file \"{}\"; the other kinds are grey, white and colorchecker",
                    file.display()
                )
                .into());
            }
            let table = chart_table::read(&file)?;
            Kind { table, tag: of_table(folder, &file), name: "chart" }
        }
    })
}

/// The corners of one `--corners`.
fn corners(texts: &[&str]) -> Result<[DVec2; 4], Ending> {
    let text = texts.join(",");
    let numbers: Vec<f64> = text
        .split(',')
        .filter_map(|own| own.trim().parse().ok())
        .filter(|own: &f64| own.is_finite())
        .collect();
    match numbers.as_slice() {
        &[a, b, c, d, e, f, g, h] if text.matches(',').count() == 7 => {
            Ok([(a, b), (c, d), (e, f), (g, h)].map(|(x, y)| DVec2::new(x, y)))
        }
        _ => Err(anyhow!(
            "--corners: four positions x,y in pixels are due, for example 410,220 530,224 526,310 \
             406,305"
        )
        .into()),
    }
}

pub(super) fn run(matches: &ArgMatches) -> Result<(), Ending> {
    let folder = arguments::required_path(matches, "capture");
    let views = photographs::named(matches, "corners", "the four corners", corners)?;
    if views.len() > 1 && matches.get_flag("matrix") {
        return Err(anyhow!("--matrix is of one photograph; give one --image").into());
    }
    let kind = kind(matches, &folder)?;
    let name = matches.get_one::<String>("name").map_or(kind.name, String::as_str);
    job::catch_interrupts()?;
    let mut worker = Worker::start(|| ())?;
    let mut display = Display::new(matches.get_flag("quiet"));
    let load = Job::Load { path: folder.clone() };
    let JobEvent::Loaded(capture) = job::wait(&mut worker, load, &mut display)? else {
        return Ok(());
    };
    display.clear();
    let mut read = Vec::new();
    for &(image, corners_px) in &views {
        let (photograph, radiance) = photographs::measured(&capture, image)?;
        let failed = |problem: String| anyhow!("{}: {problem}", photograph.name);
        let readings = charts::read(radiance, &kind.table, corners_px).map_err(failed)?;
        let fit = charts::fit(&kind.table, &readings);
        read.push((photograph.name.as_str(), readings, fit));
    }
    // All of it is found before anything is printed or written.
    let file = folder.join(TAGS);
    let mut changes = None;
    if matches.get_flag("pin") || matches.get_flag("matrix") {
        let mut changed = Changed::begin(&file, &capture)?;
        let mut done = Vec::new();
        if matches.get_flag("pin") {
            let mut tag = kind.tag;
            if let Some(size) = matches.get_one::<DVec2>("size") {
                tag["size"] = json!(size.to_array());
            }
            let pins = views.iter().map(|&(photograph, corners_px)| Pin {
                name,
                kind: tag.clone(),
                photograph,
                corners_px,
            });
            done.push(pin(&capture, &mut changed, pins)?);
        }
        if matches.get_flag("matrix") {
            let fit = read.iter().find_map(|(_, _, fit)| fit.as_ref());
            let fit = fit
                .ok_or_else(|| anyhow!("a colour matrix needs a chart of eight colours or more"))?;
            changed.set_color_matrix(&capture.corrected_by(&fit.correction()));
            done.push("photographs are read by the colour matrix from now on".to_owned());
        }
        changes = Some((changed, done));
    }
    if matches.get_flag("json") {
        let values: Vec<Value> = (read.iter())
            .map(|(photograph, readings, fit)| {
                as_json(photograph, &kind.table, readings, fit.as_ref())
            })
            .collect();
        match values.as_slice() {
            [value] => say_line!("{value:#}"),
            _ => say_line!("{:#}", Value::from(values)),
        }
    } else {
        for (photograph, readings, fit) in &read {
            print(name, photograph, &kind.table, readings, fit.as_ref());
        }
    }
    if let Some((changed, done)) = changes {
        changed.write()?;
        note_line!("{}: {}", file.display(), done.join("; "));
    }
    Ok(())
}

/// Writes a chart in its photographs into the tags; returns what was done.
fn pin<'a>(
    capture: &Capture,
    changed: &mut Changed,
    pins: impl Iterator<Item = Pin<'a>>,
) -> Result<String, Ending> {
    let tags = pins.map(|pin| changed.pin(&pin)).collect::<Result<Vec<_>, _>>()?;
    // Each has the photographs of those before.
    let tag = tags.last().ok_or_else(|| anyhow!("--image is missing"))?;
    let names: Vec<&str> = capture.photographs.iter().map(|own| own.name.as_str()).collect();
    let chart = tag.resolved(&names).map_err(|problem| anyhow!("{problem}"))?;
    // It may be there already, under its own name.
    let others = capture.charts.iter().map(|own| own.chart.clone());
    let mut all: Vec<Chart> = others.filter(|own| own.name != chart.name).collect();
    all.push(chart);
    let laid = charts::find(capture, all);
    let own = laid.last().ok_or_else(|| anyhow!("--image is missing"))?;
    let placed = own.placed.as_ref().map_err(|problem| anyhow!("{problem}; nothing is pinned"))?;
    if own.chart.size_m.is_some() {
        let middle = placed.corners.iter().sum::<DVec3>() / 4.0;
        note_line!(
            "{}: its middle is at {:.3}, {:.3}, {:.3} m, its tilt is known to ± {:.1}°",
            tag.name,
            middle.x,
            middle.y,
            middle.z,
            placed.tilt_sd.to_degrees()
        );
    }
    let pinned = own.surfaces().iter().filter(|own| own.known.is_some()).count();
    Ok(format!("\"{}\" is pinned, {pinned} known reflectances", tag.name))
}

fn print(
    name: &str,
    photograph: &str,
    table: &Table,
    readings: &[PatchReading],
    fit: Option<&ColorFit>,
) {
    let pixels: usize = readings.iter().map(|own| own.pixels).sum();
    say_line!("{name} in {photograph}: {pixels} pixels");
    let widest = table.patches.iter().map(|own| own.name.chars().count()).max().unwrap_or(0).max(5);
    let differences = if fit.is_some() { "  ΔE00 as is   gains  matrix" } else { "" };
    let heads = ["patch", "radiance", "spread", "missing"];
    say_line!("{:widest$}  {:32}{:>8}{:>9}{differences}", heads[0], heads[1], heads[2], heads[3]);
    for (k, (patch, own)) in std::iter::zip(&table.patches, readings).enumerate() {
        let [r, g, b] = own.mean.map(|value| format!("{value:<10.4}"));
        let radiance = format!("{r} {g} {b}");
        let (spread, missing) = (100.0 * own.spread, 100.0 * own.missing);
        let apart = fit.map_or(String::new(), |fit| {
            let [one, gains, matrix] = fit.differences[k];
            format!("  {one:>10.2} {gains:>7.2} {matrix:>7.2}")
        });
        say_line!("{:widest$}  {radiance:32}{spread:>6.1} %{missing:>7.1} %{apart}", patch.name);
    }
    let Some(fit) = fit else { return };
    let [one, gains, matrix] = fit.mean_differences();
    say_line!(
        "mean ΔE00: {one:.2} with one scale, {gains:.2} with a gain a channel, {matrix:.2} by the \
         colour matrix"
    );
    let [across, down] = fit.shading.to_array().map(|value| 200.0 * value);
    say_line!(
        "light over the chart: {across:+.1} % along its first side, {down:+.1} % along the second"
    );
    say_line!("colour matrix for photographs (what is neutral stays as it is)");
    for row in 0..3 {
        let [r, g, b] = fit.correction().row(row).to_array();
        say_line!("  {r:9.4} {g:9.4} {b:9.4}");
    }
    let curve = &fit.curve;
    say_line!(
        "linearity: reflectance is off by {:.4} (RMS) as a straight line of radiance, {:.4} with \
         radiance to the power {:.3}",
        fit.rms,
        curve.rms,
        curve.power
    );
    if curve.is_better {
        note_line!(
            "warning: {photograph}: a curve explains the patches better than a straight line: reflectance \
             goes with radiance to the power {:.2}. The photograph is not linear: a display's curve was \
             not undone, the response is wrong, or black is not 0. Its colour matrix and its pin are \
             wrong as well.",
            curve.power
        );
    }
}

fn as_json(
    photograph: &str,
    table: &Table,
    readings: &[PatchReading],
    fit: Option<&ColorFit>,
) -> Value {
    let patches = std::iter::zip(&table.patches, readings).enumerate().map(|(k, (patch, own))| {
        let mut value = json!({
            "name": patch.name, "reflectance": patch.reflectance, "radiance": own.mean,
            "spread": own.spread, "missing": own.missing, "pixels": own.pixels,
        });
        if let Some([one, gains, matrix]) = fit.map(|fit| fit.differences[k]) {
            value["delta_e_2000"] = json!({"as_is": one, "gains": gains, "matrix": matrix});
        }
        value
    });
    let mut value = json!({"image": photograph, "patches": patches.collect::<Vec<_>>()});
    if let Some(fit) = fit {
        let rows = |matrix: glam::DMat3| [0, 1, 2].map(|row| matrix.row(row).to_array());
        value["color_matrix"] = json!(rows(fit.correction()));
        value["reflectance_from_radiance"] = json!(rows(fit.matrix));
        value["shading"] = json!(fit.shading.to_array());
        value["rms"] = json!(fit.rms);
        value["linearity"] = json!({
            "power": fit.curve.power, "rms": fit.curve.rms, "curve_is_better": fit.curve.is_better,
        });
    }
    value
}
