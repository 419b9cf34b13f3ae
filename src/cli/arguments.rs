//! The command line, with a flag for every declared option.

use std::path::PathBuf;

use clap::builder::PossibleValuesParser;
#[cfg(feature = "studio")]
use clap::builder::{OsStringValueParser, TypedValueParser};
use clap::{Arg, ArgAction, ArgMatches, Command, value_parser};
use glam::Vec3;

use crate::exposures::MergeOptions;
use crate::io::export::elsewhere::Format;
use crate::io::import::{Axis, Surfaces, Unit};
use crate::math::rgb::Rgb;
use crate::options::{Declaration, Kind, OptionError, OptionGroup, OptionValue};
use crate::reconstruct::Options;
use crate::render::RenderOptions;

pub(super) fn command() -> Command {
    bare()
        .version(env!("CARGO_PKG_VERSION"))
        .about(env!("CARGO_PKG_DESCRIPTION"))
        .arg(switch("verbose", "Show the log on stderr, in detail").short('v').global(true))
        .subcommand(reconstruct())
        .subcommands([render(), super::probe::command(capture()), super::masks::command(capture())])
        .subcommands([super::modelling::new(), super::modelling::model(capture())])
        .subcommands([merge(), export(), super::chart::command(capture())])
        .subcommand(
            Command::new("info")
                .about("Show the contents of a capture, and warnings about them")
                .arg(capture()),
        )
        .subcommands([import(), score(), study(), super::reference::command()])
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

pub(super) fn folder(name: &'static str, help: &'static str) -> Arg {
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
        .args([super::color_space::flag(), quiet()]);
    with_flags(command, &RenderOptions::default().declarations())
}

fn merge() -> Command {
    let command = Command::new("merge")
        .about("Merge exposures of one view, or of several, to linear images of radiance")
        .long_about(
            "Merge exposures (JPEG, PNG or TIFF, 8 or 16 bits) to linear OpenEXR. The camera's \
             response is recovered from all of them (Debevec and Malik 1997), so that all images \
             of one call are on one scale. Times come from EXIF. A new series begins where the \
             folder changes, where the same exposure comes again, where the name before its last \
             number changes, or after a pause of 30 seconds. Pixels that no exposure measures \
             are NaN.",
        )
        .arg(
            Arg::new("files")
                .value_name("FILES")
                .help("The exposures")
                .required(true)
                .num_args(1..)
                .value_parser(value_parser!(PathBuf)),
        )
        .arg(
            path("out", "Image to write (.exr); with several series, a folder for the images")
                .required(true),
        )
        .arg(times("Exposure times in the order of the files (1/8,1,8), or a table file,seconds"))
        .arg(switch("one", "All files are exposures of one view"))
        .arg(path("curve", "Also write the response as a table, and a drawing (.svg) beside it"))
        .arg(
            path(
                "response",
                "Response to use: a table that --curve has written, or srgb, the curve of images \
                 made for screens or that of their ICC profile; then one exposure of a view is enough",
            )
            .value_name("FILE|srgb"),
        )
        .arg(quiet());
    with_flags(command, &MergeOptions::default().declarations())
}

fn times(help: &'static str) -> Arg {
    Arg::new("times").long("times").value_name("LIST|FILE").help(help).long_help(
        "Exposure times in seconds: a list in the order of the files (1/8,1,8), or a table with a \
         row file,seconds for each [default: from EXIF, times what aperture and sensitivity change]",
    )
}

fn export() -> Command {
    let whole = |name: &'static str, value: &'static str, help: &'static str, most: u64| {
        let parser = value_parser!(u64).range(1..=most);
        Arg::new(name).long(name).value_name(value).help(help).value_parser(parser)
    };
    Command::new("export")
        .about("Write a recovered scene for other programs")
        .long_about(
            "Write a recovered scene, as it is or edited, for other programs: binary glTF, OBJ, \
             scenes for Mitsuba 3, a light probe, a package for Blender, and samples and lights \
             as PLY and CSV.",
        )
        .arg(capture())
        .arg(folder("solution", "Folder written by reconstruct").required(true))
        .arg(folder("out", "Folder for the files; made when missing").required(true))
        .arg(path("edits", "Added lights and objects, other materials (edits.json)"))
        .arg(
            Arg::new("format")
                .long("format")
                .value_name("NAMES")
                .help("What to write, with commas between [default: all]")
                .value_delimiter(',')
                .value_parser(PossibleValuesParser::new(Format::ALL.map(|format| format.text()))),
        )
        .arg(
            Arg::new("probe-at")
                .long("probe-at")
                .value_name("X,Y,Z")
                .help("Where the light probe is, in metres [default: before the first camera]")
                .allow_hyphen_values(true)
                .value_parser(parse_place),
        )
        .arg(whole("probe-width", "N", "Width of light probes in pixels [default: 512]", 16384))
        .arg(whole("probe-spp", "N", "Paths per pixel of light probes [default: 64]", 1_000_000))
        .arg(quiet())
}

fn parse_place(text: &str) -> Result<Vec3, String> {
    let numbers: Vec<f32> =
        text.split(',').filter_map(|number| number.trim().parse().ok()).collect();
    match numbers[..] {
        [x, y, z]
            if [x, y, z].iter().all(|value| value.abs() < 1e9)
                && text.matches(',').count() == 2 =>
        {
            Ok(Vec3::new(x, y, z))
        }
        _ => Err("write a place as three numbers in metres, for example 1.5,2,0.8".to_owned()),
    }
}

fn import() -> Command {
    let units = || PossibleValuesParser::new(Unit::NAMES.map(|(name, _)| name));
    let axes = || PossibleValuesParser::new(Axis::NAMES.map(|(name, _)| name));
    let axis = |name: &'static str, help: &'static str| {
        Arg::new(name)
            .long(name)
            .value_name("AXIS")
            .help(help)
            .value_parser(axes())
            .allow_hyphen_values(true)
    };
    let number = |name: &'static str, value: &'static str, help: &'static str| {
        Arg::new(name).long(name).value_name(value).help(help).value_parser(value_parser!(f64))
    };
    let unit = |name: &'static str, help: &'static str| {
        Arg::new(name).long(name).value_name("UNIT").help(help).value_parser(units())
    };
    let command = Command::new("import")
        .about("Make a capture of cameras, a mesh and photographs of other programs")
        .long_about(
            "Make a capture of cameras, a mesh and photographs of other programs: COLMAP models, \
             Meshroom's cameras.sfm, RealityCapture's CSV, Metashape's XML, Bundler's bundle.out, \
             OpenSfM's reconstruction.json, transforms.json of NeRF programs, glTF; meshes as OBJ, \
             glTF, PLY and STL. Distortion is kept and never applied to the photographs.",
        )
        .arg(
            Arg::new("source")
                .value_name("SOURCE")
                .help("File or folder with the cameras, or a mesh alone")
                .required(true)
                .value_parser(value_parser!(PathBuf)),
        )
        .arg(folder("out", "Folder for the capture; must be new or empty").required(true))
        .arg(
            folder("images", "Folder of the photographs; may be repeated [default: near SOURCE]")
                .action(ArgAction::Append),
        )
        .arg(path("mesh", "The geometry, where SOURCE has none"))
        .arg(unit("units", "Unit of the source's coordinates [default: m]"))
        .arg(unit("mesh-units", "Unit of the mesh's [default: that of the source]"))
        .arg(number("scale", "NUMBER", "Factor on cameras and mesh, for sources without a unit"))
        .arg(axis("up", "Axis that points up in the source; it becomes z [default: z]"))
        .arg(axis("mesh-up", "Axis that points up in the mesh [default: as in the source]"))
        .arg(number("weld", "METRES", "Join vertices no farther apart than this [default: 0]"))
        .arg(
            Arg::new("surfaces")
                .long("surfaces")
                .value_name("BY")
                .help("What surfaces are made of [default: auto]")
                .long_help(
                    "What surfaces are made of: materials, groups, objects, or connected planar \
                     regions; auto takes the first of these that the mesh has",
                )
                .value_parser(PossibleValuesParser::new(Surfaces::NAMES.map(|(name, _)| name))),
        )
        .arg(switch("regions", "The same as --surfaces regions").conflicts_with("surfaces"))
        .arg(number("planar-angle", "DEGREES", "Largest angle within a region [default: 15]"))
        .arg(switch("undistorted", "The photographs are undistorted already: drop the lens terms"))
        .arg(switch("undo-applied-transform", "Take back nerfstudio's applied_transform"))
        .arg(switch("link", "Link the photographs instead of copying them"))
        .arg(switch("series", "Merge photographs that are exposures of one view to radiance"))
        .arg(switch("srgb", "Take single JPEG, PNG and TIFF for radiance by the sRGB curve"))
        .arg(times("Exposure times of series without EXIF: a list (1/8,1,8), or a table"))
        .arg(quiet());
    with_flags(command, &MergeOptions::default().declarations())
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
            folder("truth-images", "The true pictures, which have the same names")
                .id("truth_images")
                .requires("renders"),
        )
}

pub(super) fn threads() -> Arg {
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
        .about("Chart the error against computing time, over a designed set of settings")
        .arg(capture().num_args(1..));
    let stability = Command::new("stability")
        .about("Measure how large errors of a capture may be, by degrading it in controlled steps")
        .arg(capture());
    Command::new("study")
        .about("Measure error against computing time, and the effect of errors in a capture")
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

/// The same for the options of merging.
pub(super) fn apply_merge(
    matches: &ArgMatches,
    options: &mut MergeOptions,
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
