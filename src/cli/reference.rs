//! `lobelia reference DIR`, which `--help` does not list: writes the reference pages of the guide
//! and the files for packages from the program's own declarations.

use std::fmt::Write;

use clap::{ArgMatches, Command};

use crate::cli::{Ending, arguments};
use crate::exposures::MergeOptions;
use crate::io;
use crate::options::{Declaration, Kind, OptionGroup};
use crate::reconstruct::Options;
use crate::render::RenderOptions;

pub(super) fn command() -> Command {
    Command::new("reference")
        .about("Write the reference pages of the guide, man pages and shell completions")
        .hide(true)
        .arg(arguments::folder("dir", "Folder for the files").index(1).required(true))
}

pub(super) fn run(matches: &ArgMatches) -> Result<(), Ending> {
    let folder = arguments::required_path(matches, "dir");
    let write = |name: &str, text: &[u8]| -> Result<(), Ending> {
        let file = folder.join(name);
        std::fs::create_dir_all(file.parent().unwrap_or(&folder))?;
        Ok(io::atomic::write_bytes(&file, text)?)
    };
    write("commands.md", commands().as_bytes())?;
    write("options.md", options().as_bytes())?;
    #[cfg(feature = "studio")]
    write("keys.md", keys().as_bytes())?;
    let program = arguments::command().disable_help_subcommand(true);
    for (name, text) in man_pages(program)? {
        write(&format!("man/{name}"), &text)?;
    }
    for (shell, name) in [
        (clap_complete::Shell::Bash, "bash/lobelia"),
        (clap_complete::Shell::Zsh, "zsh/_lobelia"),
        (clap_complete::Shell::Fish, "fish/lobelia.fish"),
    ] {
        let mut text = Vec::new();
        clap_complete::generate(shell, &mut arguments::command(), "lobelia", &mut text);
        write(name, &text)?;
    }
    Ok(())
}

/// A man page for the program and for each command that is listed, as name and contents.
fn man_pages(program: Command) -> std::io::Result<Vec<(String, Vec<u8>)>> {
    let mut pages = Vec::new();
    let mut parts = vec![("lobelia".to_owned(), program)];
    while let Some((name, command)) = parts.pop() {
        for part in command.get_subcommands().filter(|part| !part.is_hide_set()) {
            parts.push((format!("{name}-{}", part.get_name()), part.clone()));
        }
        let mut text = Vec::new();
        let shown = command.clone().name(name.clone()).display_name(name.clone());
        clap_mangen::Man::new(shown).render(&mut text)?;
        pages.push((format!("{name}.1"), text));
    }
    pages.sort();
    Ok(pages)
}

const WRITTEN: &str = "<!-- Written by `lobelia reference`; change the code instead. -->\n\n";

/// What each command is for, with its arguments and flags, but for the options of stages.
fn commands() -> String {
    let mut text = format!(
        "# Commands\n\n{WRITTEN}`lobelia COMMAND --help` shows the same. [Options](options.md) of \
         stages are flags, too. The exit code is 0 where all is done, 1 for an input or option at \
         fault, 2 for wrong usage, 130 after Ctrl-C.\n"
    );
    let program = arguments::command();
    describe(&mut text, "lobelia", &program);
    text
}

fn describe(text: &mut String, name: &str, command: &Command) {
    let about = command.get_long_about().or(command.get_about());
    let about = about.map(ToString::to_string).unwrap_or_default();
    let mut shown = command.clone().bin_name(name);
    let usage = shown.render_usage().to_string();
    let usage: Vec<&str> = usage.trim_start_matches("Usage:").lines().map(str::trim).collect();
    let _ = write!(text, "\n## {name}\n\n{about}.\n\n", about = about.trim_end_matches('.'));
    let _ = writeln!(text, "```text\n{}\n```", usage.join("\n"));
    let is_listed = |argument: &&clap::Arg| {
        argument.get_help_heading().is_none() && argument.get_id() != "help"
    };
    let mut rows = String::new();
    for argument in command.get_arguments().filter(is_listed) {
        let values: Vec<String> = argument
            .get_value_names()
            .filter(|_| argument.get_action().takes_values())
            .map_or(Vec::new(), |names| names.iter().map(ToString::to_string).collect());
        let values = values.join(" ");
        let shown = match (argument.get_long(), argument.get_short()) {
            (Some(long), Some(short)) => format!("-{short}, --{long} {values}"),
            (Some(long), None) => format!("--{long} {values}"),
            _ => values,
        };
        let help = argument.get_long_help().or(argument.get_help());
        let help = help.map(ToString::to_string).unwrap_or_default();
        let _ = writeln!(rows, "| `{}` | {} |", escaped(shown.trim()), escaped(&help));
    }
    if !rows.is_empty() {
        let _ = write!(text, "\n| argument | what |\n|---|---|\n{rows}");
    }
    for part in command.get_subcommands().filter(|part| !part.is_hide_set()) {
        if part.get_name() != "help" {
            describe(text, &format!("{name} {}", part.get_name()), part);
        }
    }
}

/// All options, a table for each section.
fn options() -> String {
    let mut text = format!(
        "# Options\n\n{WRITTEN}Each option is a flag of its commands (`--samples.count 6000`), a key in \
         an options file (`[samples]` `count = 6000`, for `lobelia reconstruct --options FILE`), and \
         a control in the studio.\n"
    );
    let groups = [
        ("`lobelia reconstruct`", Options::default().declarations()),
        ("`lobelia merge` and `lobelia import --series`", MergeOptions::default().declarations()),
        ("`lobelia render`", RenderOptions::default().declarations()),
    ];
    for (used_by, declarations) in &groups {
        let mut section = "";
        for declaration in declarations {
            if declaration.section != section {
                section = declaration.section;
                let _ = write!(
                    text,
                    "\n## {section}\n\nOf {used_by}.\n\n| flag | what | values | default |\n\
                     |---|---|---|---|\n"
                );
            }
            let _ = writeln!(
                text,
                "| `--{}` | {} | {} | {} |",
                declaration.flag(),
                escaped(&declaration.help),
                values(declaration),
                declaration.default
            );
        }
    }
    text
}

fn values(declaration: &Declaration) -> String {
    let unit = match declaration.unit {
        "" => String::new(),
        unit => format!(" {unit}"),
    };
    let range = declaration.range.map(|(low, high)| format!("{low} to {high}{unit}"));
    match declaration.kind {
        Kind::Switch => "true, false".to_owned(),
        Kind::Choice(names) => names.join(", "),
        Kind::NumberOrAuto => format!("auto, {}", range.unwrap_or_default()),
        Kind::Number => range.unwrap_or_default(),
        Kind::Integer => format!("whole, {}", range.unwrap_or_default()),
    }
}

#[cfg(feature = "studio")]
fn keys() -> String {
    let mut text = format!(
        "# Keys\n\n{WRITTEN}Everything that can be done stands in the menus, and in the command palette \
         (Ctrl+P). On macOS, press Command in place of Control.\n"
    );
    let mut menu = "";
    for entry in crate::app::entries() {
        if entry.menu != menu {
            menu = entry.menu;
            let _ = write!(text, "\n## {menu}\n\n| key | name | what |\n|---|---|---|\n");
        }
        let _ =
            writeln!(text, "| {} | {} | {} |", entry.key, escaped(entry.name), escaped(entry.help));
    }
    text
}

/// Text for a cell of a table.
fn escaped(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ").replace('|', "\\|")
}
