//! `lobelia model CAPTURE`.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::anyhow;
use clap::ArgMatches;

use crate::cli::print::{note_line, say, say_line};
use crate::cli::{Ending, arguments};
use crate::io::model as files;
use crate::io::{Error, Fault};
use crate::model::to_edges;
use crate::model::{AdjustOptions, Estimate, Model, ModelError, Solution, Stroke, Unsolved, solve};
use crate::watch::Watch;

/// What is written beside the model where that is changed.
const BEFORE: &str = "model.before.json";

pub(super) fn run(matches: &ArgMatches) -> Result<(), Ending> {
    let capture = arguments::required_path(matches, "capture");
    let out = matches.get_one::<PathBuf>("out").cloned();
    let is_named = out.is_some();
    let mesh = out.unwrap_or_else(|| capture.join("scene.obj"));
    let is_glb = match mesh.extension().map(|own| own.to_ascii_lowercase()) {
        Some(own) if own == "obj" => false,
        Some(own) if own == "glb" => true,
        _ => {
            let problem = format!("{}: --out must end in .obj or .glb", mesh.display());
            return Err(anyhow!(problem).into());
        }
    };
    let file = capture.join(files::NAME);
    if !file.exists() {
        return Err(Error::Missing(Fault::new(
            &file,
            "",
            "there is nothing to place cameras by",
            "Write what is drawn on the photographs into this file, as assets/guide/modelling.md describes",
        ))
        .into());
    }
    let model = files::read(&file)?;
    let things: Vec<&String> = matches.get_many("fit-to-edges").into_iter().flatten().collect();
    let all = matches.get_flag("fit-all-to-edges");
    let model = match things.is_empty() && !all {
        true => model,
        false => fitted(&capture, &file, model, &things, all)?,
    };
    let solution =
        solve(&model, &AdjustOptions::default()).map_err(|error| fault(&file, &error))?;
    print(&model, &solution);
    for problem in &solution.unplaced {
        note_line!("warning: {}", fault(&file, problem));
    }
    if let Some(first) = solution.problems.first() {
        for other in &solution.problems[1..] {
            note_line!("error: {}", fault(&file, other));
        }
        note_line!("nothing is written");
        return Err(fault(&file, first).into());
    }
    if !solution.faces.is_empty() {
        if !is_named {
            files::check_own(&mesh)?;
        }
        if is_glb {
            files::write_glb(&mesh, &crate::io::capture::name(&capture), &solution.faces)?;
        } else {
            files::write_obj(&mesh, &solution.faces)?;
        }
        say_line!("written: {}", mesh.display());
    }
    let cameras = capture.join("transforms.json");
    files::write_cameras(&cameras, &model, &solution.cameras)?;
    say_line!("written: {}", cameras.display());
    Ok(())
}

/// Fits things to the lines of the photographs, one after the other, and then all together, and
/// writes the model.
fn fitted(
    capture: &Path,
    file: &Path,
    mut model: Model,
    things: &[&String],
    all: bool,
) -> Result<Model, Ending> {
    let before = model.clone();
    let watch = Watch::new();
    let unsolved = |error| match error {
        Unsolved::Model(error) => fault(file, &error),
        Unsolved::Cancelled(cancelled) => cancelled.into(),
    };
    let lines =
        model.photographs.iter().map(|own| files::lines_of(capture, &own.name).map(Arc::new));
    let lines: Vec<_> = lines.collect::<Result<_, Error>>()?;
    for &id in things {
        let Some(thing) = model.things.iter().position(|own| own.id == *id) else {
            let names: Vec<&str> = model.things.iter().map(|own| own.id.as_str()).collect();
            let problem = format!(
                "{}: --fit-to-edges names {id}, which is no thing there. Name one of: {}",
                file.display(),
                names.join(", ")
            );
            return Err(anyhow!(problem).into());
        };
        let solution =
            solve(&model, &AdjustOptions::default()).map_err(|error| fault(file, &error))?;
        let fitted = to_edges::fit(&model, &solution, thing, &lines, files::caster, &watch)
            .map_err(unsolved)?;
        say_line!("{}", fitted.words(id));
        model = fitted.model;
    }
    if all {
        let solution =
            solve(&model, &AdjustOptions::default()).map_err(|error| fault(file, &error))?;
        let found =
            to_edges::find(&model, &solution, &lines, files::caster, &watch).map_err(unsolved)?;
        say_line!("{}", found.words());
        model = found.model;
    }
    files::write(&capture.join(BEFORE), &before)?;
    files::save(capture, &model)?;
    say_line!("written: {}", file.display());
    Ok(model)
}

fn fault(file: &Path, error: &ModelError) -> Error {
    Error::Invalid(Fault::new(file, &*error.place, &*error.problem, &*error.remedy))
}

fn print(model: &Model, solution: &Solution) {
    for own in &solution.photographs {
        let name = &model.photographs[own.photograph].name;
        say!("{name}  {} strokes, {:.2} px", own.strokes, own.rms_px);
        if let (Some(direction), Some(position)) = (own.direction_sd, own.position_sd_m) {
            say!(", direction ± {:.2}°, position ± {position:.3} m", direction.to_degrees());
        }
        say_line!();
        for stroke in &solution.strokes {
            if model.strokes[stroke.stroke].photograph() == Some(own.photograph) {
                say_line!("  {:7.2} px  {}", stroke.residual, model.stroke_name(stroke.stroke));
            }
        }
    }
    for stroke in &solution.strokes {
        if let Stroke::Position { sd_m, .. } | Stroke::Length { sd_m, .. } =
            model.strokes[stroke.stroke]
        {
            let off = stroke.residual * sd_m;
            say_line!("  {off:7.4} m   {}", model.stroke_name(stroke.stroke));
        }
    }
    for own in &solution.lenses {
        say_line!("lens {}: {}", model.lenses[own.lens].id, numbers(&own.numbers, 2));
    }
    for own in &solution.things {
        let thing = &model.things[own.thing];
        say_line!("{} {}: {}", thing.shape.name(), thing.id, numbers(&own.numbers, 4));
    }
    if let Some(worst) = solution.worst() {
        say_line!("off by most: {}", model.stroke_name(worst.stroke));
    }
    for note in &solution.notes {
        note_line!("warning: {note}");
    }
}

fn numbers(list: &[Estimate], digits: usize) -> String {
    let number = |own: &Estimate| match own.sd {
        Some(sd) => format!("{} {:.digits$} ± {sd:.digits$}", own.name, own.value),
        None => format!("{} {:.digits$}", own.name, own.value),
    };
    list.iter().map(number).collect::<Vec<_>>().join(", ")
}
