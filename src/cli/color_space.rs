//! The colour space of the OpenEXR files that a command writes.

use clap::{Arg, ArgMatches};

use crate::io::exr::ColorSpace;
use crate::options::OptionValue;

const NAME: &str = "color-space";

pub(super) fn flag() -> Arg {
    Arg::new(NAME)
        .long(NAME)
        .value_name("NAME")
        .help("Linear colour space of the EXR files, which state it [default: rec709]")
        .value_parser(ColorSpace::ALL.map(|space| space.text()))
}

pub(super) fn chosen(matches: &ArgMatches) -> ColorSpace {
    let named = matches.get_one::<String>(NAME);
    named.and_then(|name| ColorSpace::parse(name).ok()).unwrap_or(ColorSpace::Rec709)
}
