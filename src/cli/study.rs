//! `lobelia study speed CAPTURE… --out DIR` and `lobelia study stability CAPTURE --out DIR`.

use std::path::PathBuf;

use anyhow::{Context, anyhow};
use clap::ArgMatches;

use crate::cli::print::say_line;
use crate::cli::progress::Display;
use crate::cli::{Ending, arguments, job};
use crate::io;
use crate::reconstruct::Options;
use crate::study::settings::Scope;
use crate::study::{Source, Study, Subject, speed, stability};
use crate::worker::{Command, JobEvent, Worker};

pub(super) fn run(matches: &ArgMatches) -> Result<(), Ending> {
    let Some((subject, matches)) = matches.subcommand() else { return Ok(()) };
    let quick = matches.get_flag("quick");
    let repeats = |full: u64, few: u64| -> usize {
        let given = matches.get_one::<u64>("repeats").copied();
        given.unwrap_or(if quick { few } else { full }) as usize
    };
    let captures: Vec<PathBuf> =
        matches.get_many::<PathBuf>("capture").unwrap_or_default().cloned().collect();
    let mut sources = captures.into_iter().map(Source::Folder);
    let subject = match subject {
        "speed" => Subject::Speed(speed::Design {
            sources: sources.collect(),
            base: Options::default(),
            own: false,
            scope: if quick { Scope::Quick } else { Scope::Whole },
            repeats: repeats(3, 1),
        }),
        _ => {
            let source = sources.next().unwrap_or_else(|| Source::Folder(PathBuf::new()));
            Subject::Stability(stability::Design::of_all(source, quick, repeats(3, 2)))
        }
    };
    let folder = arguments::required_path(matches, "out");
    let mut study = Study {
        subject,
        folder: Some(folder.clone()),
        only: Vec::new(),
        collect: matches.get_flag("collect"),
    };
    let names = study.names()?;
    if matches.get_flag("list") {
        for (index, name) in names.iter().enumerate() {
            say_line!("{index}\t{name}");
        }
        return Ok(());
    }
    for text in matches.get_many::<String>("only").unwrap_or_default() {
        study.only.extend(chosen(text, names.len())?);
    }
    io::export::check_folder(&folder)?;
    job::use_threads(matches)?;
    job::catch_interrupts()?;
    let mut display = Display::new(matches.get_flag("quiet"));
    let mut worker = Worker::start(|| ()).context("the worker thread cannot be started")?;
    display.stage("runs");
    let event = job::wait(&mut worker, Command::Study(Box::new(study)), &mut display)?;
    display.clear();
    if let JobEvent::Studied(lines) = event {
        for line in lines {
            say_line!("{line}");
        }
    }
    say_line!("written to {}", folder.display());
    Ok(())
}

/// Numbers of runs from `3` or `0-9`.
fn chosen(text: &str, count: usize) -> Result<Vec<usize>, Ending> {
    let wrong = || {
        anyhow!(
            "--only {text}: give the number of a run, or two with a dash between them; --list \
             shows them, 0 to {}",
            count.saturating_sub(1)
        )
    };
    let (first, last) = text.split_once('-').unwrap_or((text, text));
    let number = |text: &str| text.trim().parse::<usize>().ok().filter(|&k| k < count);
    match (number(first), number(last)) {
        (Some(first), Some(last)) if first <= last => Ok((first..=last).collect()),
        _ => Err(Ending::Failed(wrong())),
    }
}
