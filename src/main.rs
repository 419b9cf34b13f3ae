//! The binary: parse, hand over, turn the ending into an exit code.

use std::process::ExitCode;

fn main() -> ExitCode {
    lobelia::cli::main()
}
