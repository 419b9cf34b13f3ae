//! The arguments of `new` and `model`.

use std::path::PathBuf;

use clap::{Arg, ArgAction, Command, value_parser};

pub(super) fn new() -> Command {
    Command::new("new")
        .about("Make a capture of photographs alone, without cameras or a mesh")
        .arg(
            Arg::new("folder")
                .value_name("DIR")
                .help("Folder for the capture; must be new or empty")
                .required(true)
                .value_parser(value_parser!(PathBuf)),
        )
        .arg(
            Arg::new("images")
                .long("images")
                .value_name("FILES")
                .help("The photographs: OpenEXR, Radiance, JPEG, PNG, TIFF or RAW")
                .required(true)
                .num_args(1..)
                .value_parser(value_parser!(PathBuf)),
        )
        .arg(
            Arg::new("cameras")
                .long("cameras")
                .value_name("ENGINE")
                .help(
                    "Find the cameras by an engine that is installed: openmvg-rs, pycolmap, colmap, \
                     or the first of them that is there",
                )
                .value_parser(["auto", "openmvg-rs", "pycolmap", "colmap"]),
        )
        .arg(
            Arg::new("lenses")
                .long("lenses")
                .value_name("WHICH")
                .help("Whether photographs of one size share a lens, or each has one of its own")
                .requires("cameras")
                .default_value("shared")
                .value_parser(["shared", "each"]),
        )
}

pub(super) fn model(capture: Arg) -> Command {
    Command::new("model")
        .about("Place cameras and things by what is drawn on the photographs (model.json)")
        .long_about(
            "Place cameras and things by what is drawn on the photographs, which CAPTURE/model.json \
             holds: lines along the axes, corners of boxes and rooms, points, known lengths. Prints \
             how far each stroke is off and how well each number is known, and writes \
             transforms.json and the mesh where the strokes determine them.",
        )
        .arg(capture.help("Folder with model.json and the photographs"))
        .arg(
            Arg::new("out")
                .long("out")
                .value_name("FILE")
                .help("Mesh to write, .obj or .glb [default: CAPTURE/scene.obj]")
                .value_parser(value_parser!(PathBuf)),
        )
        .arg(
            Arg::new("fit-to-edges")
                .long("fit-to-edges")
                .value_name("THING")
                .help(
                    "Move a thing until its outline lies on the lines of the photographs, and the \
                     strokes about it in model.json with it; the former file stays as \
                     model.before.json; may be repeated",
                )
                .action(ArgAction::Append),
        )
        .arg(
            Arg::new("fit-all-to-edges")
                .long("fit-all-to-edges")
                .help(
                    "Find the lines of the photographs that are edges of things, and solve cameras \
                     and things with them; they are added to model.json, and the former file stays \
                     as model.before.json",
                )
                .action(ArgAction::SetTrue),
        )
}
