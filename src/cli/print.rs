//! Printing to readers who may leave: `lobelia info … | head -1` is no fault, and what is printed
//! on stderr must not stop a reconstruction. The standard macros would panic there.

use std::fmt::Arguments;
use std::io::{ErrorKind, Write, stderr, stdout};

/// Prints results on stdout.
macro_rules! say {
    ($($argument:tt)*) => { $crate::cli::print::result(format_args!($($argument)*)) };
}

/// Prints a line of results on stdout.
macro_rules! say_line {
    () => { $crate::cli::print::result(format_args!("\n")) };
    ($($argument:tt)*) => {
        $crate::cli::print::result(format_args!("{}\n", format_args!($($argument)*)))
    };
}

/// Prints a line of progress, a warning or an error on stderr.
macro_rules! note_line {
    ($($argument:tt)*) => {
        $crate::cli::print::note(format_args!("{}\n", format_args!($($argument)*)))
    };
}

pub(super) use {note_line, say, say_line};

pub(super) fn result(text: Arguments) {
    match stdout().write_fmt(text) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            note_line!("error: the results cannot be printed: {error}");
            std::process::exit(1);
        }
        _ => {}
    }
}

pub(super) fn note(text: Arguments) {
    // Nobody is left to be told.
    let _ = stderr().write_fmt(text);
}
