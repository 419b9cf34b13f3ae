//! The command line, with a flag for every declared option.

use std::path::PathBuf;

use clap::builder::PossibleValuesParser;
#[cfg(feature = "studio")]
use clap::builder::{OsStringValueParser, TypedValueParser};
use clap::{Arg, ArgAction, ArgMatches, Command, value_parser};

use crate::math::rgb::Rgb;
use crate::options::{Declaration, Kind, OptionError, OptionGroup};
use crate::reconstruct::Options;
use crate::render::RenderOptions;

pub(super) fn command() -> Command {
    bare()
        .version(env!("CARGO_PKG_VERSION"))
        .about(env!("CARGO_PKG_DESCRIPTION"))
        .subcommand(reconstruct())
        .subcommand(render())
        .subcommand(
            Command::new("info")
                .about("Show what a capture holds and what is odd about it")
                .arg(capture()),
        )
        .subcommand(score())
        .subcommand(study())
}

/// Without a subcommand the window opens.
#[cfg(feature = "studio")]
fn bare() -> Command {
    Command::new("lobelia").args_conflicts_with_subcommands(true).arg(
        Arg::new("open")
            .value_name("CAPTURE")
            .help("Folder of a capture, or a .lobelia project, to open in the window")
            .value_parser(OsStringValueParser::new().try_map(|text| {
                let path = PathBuf::from(text);
                // A command that was mistyped must not open a window.
                if path.exists() {
                    Ok(path)
                } else {
                    Err("there is no such command, folder or file")
                }
            })),
    )
}

#[cfg(not(feature = "studio"))]
fn bare() -> Command {
    Command::new("lobelia").subcommand_required(true).arg_required_else_help(true)
}

/// The path given for an argument that the command requires.
pub(super) fn required_path(matches: &ArgMatches, name: &str) -> PathBuf {
    matches.get_one::<PathBuf>(name).cloned().unwrap_or_default()
}

fn capture() -> Arg {
    Arg::new("capture")
        .value_name("CAPTURE")
        .help("Folder with scene.obj, transforms.json and the photographs")
        .required(true)
        .value_parser(value_parser!(PathBuf))
}

fn path(name: &'static str, help: &'static str) -> Arg {
    Arg::new(name).long(name).value_name("FILE").help(help).value_parser(value_parser!(PathBuf))
}

fn reconstruct() -> Command {
    let command = Command::new("reconstruct")
        .about("Recover reflectances and light from a capture")
        .long_about(
            "Recover reflectances and light from a capture, and write solution.json, lights.json, \
             samples.csv, convergence.csv and textures into a folder. An options file is TOML \
             with the sections and names of the flags below ([samples] count = 3500); flags win \
             over the file.",
        )
        .arg(capture())
        .arg(folder("out", "Folder for the solution; made when missing").required(true))
        .arg(path("options", "Options file (TOML)"))
        .arg(threads())
        .arg(
            Arg::new("start")
                .long("start")
                .value_name("MATERIAL=R,G,B")
                .help("Diffuse reflectance that a material starts from; may be repeated")
                .action(ArgAction::Append),
        )
        .arg(quiet());
    with_flags(command, &Options::default().declarations())
}

fn with_flags(command: Command, declarations: &[Declaration]) -> Command {
    declarations.iter().fold(command, |command, declaration| command.arg(flag(declaration)))
}

fn switch(name: &'static str, help: &'static str) -> Arg {
    Arg::new(name).long(name).help(help).action(ArgAction::SetTrue)
}

fn quiet() -> Arg {
    switch("quiet", "Show no progress").short('q')
}

fn folder(name: &'static str, help: &'static str) -> Arg {
    Arg::new(name).long(name).value_name("DIR").help(help).value_parser(value_parser!(PathBuf))
}

fn render() -> Command {
    let command = Command::new("render")
        .about("Make pictures of a recovered scene, as it is or with other light and objects")
        .arg(capture())
        .arg(folder("solution", "Folder written by reconstruct").required(true))
        .arg(folder("out", "Folder for the pictures; made when missing").required(true))
        .arg(path("edits", "Added lights and objects, other materials (edits.json)"))
        .arg(path("cameras", "Cameras (transforms.json) [default: the capture's own]"))
        .arg(switch("png", "Also write sRGB pictures, the 99th percentile white"))
        .arg(switch("composite", "Also set the edits into the capture's photographs"))
        .arg(quiet());
    with_flags(command, &RenderOptions::default().declarations())
}

fn score() -> Command {
    Command::new("score")
        .about("Compare a solution with the truth.json of a test capture")
        .arg(capture())
        .arg(
            Arg::new("solution")
                .value_name("SOLUTION")
                .help("Folder written by reconstruct, or its solution.json")
                .required(true)
                .value_parser(value_parser!(PathBuf)),
        )
        .arg(path("json", "Also write the scores as JSON"))
        .arg(
            folder("renders", "Also compare these pictures, which render has written")
                .requires("truth_images"),
        )
        .arg(
            folder("truth-images", "With true ones of the same names")
                .id("truth_images")
                .requires("renders"),
        )
}

fn threads() -> Arg {
    Arg::new("threads")
        .long("threads")
        .value_name("N")
        .help("Threads to use; the result does not depend on it [default: all]")
        .value_parser(value_parser!(u64).range(1..=4096))
}

fn study() -> Command {
    let common = |command: Command, repeats: &'static str| {
        command
            .arg(folder("out", "Folder for the runs, tables and charts").required(true))
            .arg(switch("quick", "Fewer settings or steps, in minutes"))
            .arg(
                Arg::new("repeats")
                    .long("repeats")
                    .value_name("N")
                    .help(repeats)
                    .value_parser(value_parser!(u64).range(1..=100)),
            )
            .arg(switch("list", "Only list the runs with their numbers"))
            .arg(
                Arg::new("only")
                    .long("only")
                    .value_name("K|K-L")
                    .help("Only carry out these runs, and make no charts; may be repeated")
                    .action(ArgAction::Append),
            )
            .arg(
                switch("collect", "Only make tables and charts of the runs that are there")
                    .conflicts_with("only"),
            )
            .arg(threads())
            .arg(quiet())
    };
    let speed = Command::new("speed")
        .about("Chart what seconds buy in accuracy, over a designed set of settings")
        .arg(capture().num_args(1..));
    let stability = Command::new("stability")
        .about("Find out what a capture can bear, by making it worse in controlled steps")
        .arg(capture());
    Command::new("study")
        .about("Study speed against accuracy, and what harms a result")
        .subcommand_required(true)
        .arg_required_else_help(true)
        .subcommand(common(speed, "Runs of each setting, with other seeds [default: 3; quick: 1]"))
        .subcommand(common(stability, "Seeds of each step [default: 3; quick: 2]"))
}

fn flag(declaration: &Declaration) -> Arg {
    let name = declaration.flag();
    let unit = match declaration.unit {
        "" => String::new(),
        unit => format!(" [{unit}]"),
    };
    let help = format!("{}{unit} [default: {}]", declaration.help, declaration.default);
    let argument = Arg::new(name.clone()).long(name).help(help);
    let argument = match declaration.section {
        "general" | "render" => argument,
        section => argument.help_heading(format!("Options of {section}")).hide_short_help(true),
    };
    match declaration.kind {
        Kind::Choice(names) => {
            argument.value_name("NAME").value_parser(PossibleValuesParser::new(names))
        }
        Kind::Switch => argument.value_name("true|false"),
        Kind::NumberOrAuto => argument.value_name("NUMBER|auto").allow_negative_numbers(true),
        Kind::Number | Kind::Integer => argument.value_name("NUMBER").allow_negative_numbers(true),
    }
}

/// Sets every option that was given as a flag.
pub(super) fn apply(matches: &ArgMatches, options: &mut Options) -> Result<(), OptionError> {
    for declaration in options.declarations() {
        if let Some(text) = matches.get_one::<String>(&declaration.flag()) {
            options.set(declaration.section, declaration.name, text)?;
        }
    }
    for start in matches.get_many::<String>("start").unwrap_or_default() {
        let (material, diffuse) = parse_start(start)?;
        options.set_start(&material, diffuse)?;
    }
    Ok(())
}

/// The same for the options of pictures.
pub(super) fn apply_render(
    matches: &ArgMatches,
    options: &mut RenderOptions,
) -> Result<(), OptionError> {
    for declaration in options.declarations() {
        if let Some(text) = matches.get_one::<String>(&declaration.flag()) {
            options.set(declaration.name, text)?;
        }
    }
    options.check()
}

fn parse_start(text: &str) -> Result<(String, Rgb), OptionError> {
    let error = || OptionError {
        section: "start".to_owned(),
        name: text.to_owned(),
        problem: "write it as MATERIAL=R,G,B, for example floor=0.7,0.6,0.5".to_owned(),
    };
    let (material, numbers) = text.rsplit_once('=').ok_or_else(error)?;
    let numbers: Vec<f64> = numbers
        .split(',')
        .map(|number| number.trim().parse().map_err(|_| error()))
        .collect::<Result<_, _>>()?;
    let diffuse = numbers.try_into().map_err(|_| error())?;
    Ok((material.to_owned(), diffuse))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        command().debug_assert();
    }

    #[test]
    fn every_option_is_a_flag() {
        for declaration in Options::default().declarations() {
            let name = declaration.flag();
            let arguments = [
                "lobelia",
                "reconstruct",
                "x",
                "--out",
                "y",
                &format!("--{name}"),
                &declaration.default,
            ];
            let matches = command().try_get_matches_from(arguments).unwrap();
            let (_, matches) = matches.subcommand().unwrap();
            let mut options = Options::default();
            apply(matches, &mut options).unwrap();
            assert_eq!(options, Options::default(), "{name}");
        }
    }

    #[test]
    fn a_start_is_a_name_and_three_numbers() {
        assert_eq!(parse_start("a=b=0.1,0.2,0.3").unwrap(), ("a=b".to_owned(), [0.1, 0.2, 0.3]));
        for wrong in ["floor", "floor=1", "floor=1,2,x", "floor=1,2,3,4"] {
            assert!(parse_start(wrong).is_err(), "{wrong}");
        }
    }
}
