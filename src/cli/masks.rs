//! `lobelia masks CAPTURE`.

use std::path::PathBuf;

use anyhow::anyhow;
use clap::builder::ArgAction;
use clap::{Arg, ArgMatches, Command, value_parser};

use crate::cli::print::{note_line, say_line};
use crate::cli::progress::Display;
use crate::cli::{Ending, arguments, job};
use crate::io::masks;
use crate::scene::clutter;
use crate::worker::{Command as Job, JobEvent, Worker};

pub(super) fn command(capture: Arg) -> Command {
    let switch = |name: &'static str, help: &'static str| {
        Arg::new(name).long(name).help(help).action(ArgAction::SetTrue)
    };
    Command::new("masks")
        .about("Suggest masks for unmodelled things in front of the known surfaces")
        .long_about(
            "Suggest masks: find unmodelled things in front of the known surfaces, where \
             photographs \
             of one point differ by more than is usual for its surface and a highlight is not the \
             cause. Writes a PNG for each photograph that measures radiance, black where it is \
             left out, as masks/NAME.png in the capture's folder, where the other commands find it. \
             Look at the masks before you trust them. Needs three photographs of most surfaces.",
        )
        .arg(capture)
        .arg(
            Arg::new("out")
                .long("out")
                .value_name("DIR")
                .help("Write the masks here, and change nothing in the capture")
                .value_parser(value_parser!(PathBuf)),
        )
        .arg(
            Arg::new("threshold")
                .long("threshold")
                .value_name("N")
                .help("Evidence from which on a pixel is masked, -1 to 3: less masks more [default: 0.5]")
                .allow_negative_numbers(true)
                .value_parser(value_parser!(f64)),
        )
        .arg(switch("replace", "Write over masks that are there"))
        .arg(arguments::threads())
        .arg(switch("quiet", "Show no progress").short('q'))
}

pub(super) fn run(matches: &ArgMatches) -> Result<(), Ending> {
    let folder = arguments::required_path(matches, "capture");
    let out = matches.get_one::<PathBuf>("out");
    let threshold = matches.get_one::<f64>("threshold").copied().unwrap_or(clutter::SUGGESTED);
    if !(-1.0..=3.0).contains(&threshold) {
        return Err(anyhow!("--threshold: from -1 to 3").into());
    }
    job::use_threads(matches)?;
    job::catch_interrupts()?;
    let mut worker = Worker::start(|| ())?;
    let mut display = Display::new(matches.get_flag("quiet"));
    display.stage("reading");
    let load = Job::Load { path: folder.clone() };
    let JobEvent::Loaded(capture) = job::wait(&mut worker, load, &mut display)? else {
        return Ok(());
    };
    display.stage("comparing");
    let suggest = Job::SuggestMasks { capture: capture.clone(), threshold };
    let JobEvent::MasksSuggested(suggestions) = job::wait(&mut worker, suggest, &mut display)?
    else {
        return Ok(());
    };
    display.clear();
    let pixels: Vec<(usize, &[bool])> =
        suggestions.iter().map(|own| (own.photograph, own.is_masked.as_slice())).collect();
    let written =
        masks::write(&folder, out.map(PathBuf::as_path), &pixels, matches.get_flag("replace"))?;
    for (own, suggestion) in written.iter().zip(suggestions.iter()) {
        let name = &capture.photographs[own.photograph].name;
        let file = own.file.display();
        if own.is_kept {
            say_line!("{name}: has a mask already, which is kept ({file}; --replace replaces it)");
        } else {
            say_line!("{name}: {:.1} % masked ({file})", 100.0 * suggestion.share());
        }
    }
    if suggestions.len() < 3 {
        note_line!(
            "warning: {} photographs measure radiance: of fewer than three that disagree nobody knows \
             which is right, so nothing is masked.",
            suggestions.len()
        );
    }
    Ok(())
}
