//! Photographs that a command names by `--image`, each with what another argument says of it.

use anyhow::anyhow;
use clap::ArgMatches;

use crate::cli::Ending;
use crate::io::tags::charts;
use crate::scene::{Capture, Image, Photograph};

/// The names of the photographs, each with what `of` makes of the argument `name` given for it. `what` says
/// what each photograph needs.
pub(super) fn named<'a, T>(
    matches: &'a ArgMatches,
    name: &str,
    what: &str,
    of: impl Fn(&[&str]) -> Result<T, Ending>,
) -> Result<Vec<(&'a str, T)>, Ending> {
    let images: Vec<&str> =
        matches.get_many::<String>("image").unwrap_or_default().map(String::as_str).collect();
    let given = matches.get_occurrences::<String>(name).unwrap_or_default();
    let given: Vec<T> = given
        .map(|texts| of(&texts.map(String::as_str).collect::<Vec<_>>()))
        .collect::<Result<_, _>>()?;
    if images.len() != given.len() {
        return Err(anyhow!(
            "{} --image and {} --{name} are given; each photograph needs {what}",
            images.len(),
            given.len()
        )
        .into());
    }
    Ok(std::iter::zip(images, given).collect())
}

/// The photograph of a name, with its radiance.
pub(super) fn measured<'a>(
    capture: &'a Capture,
    name: &str,
) -> Result<(&'a Photograph, &'a Image), Ending> {
    let names: Vec<&str> = capture.photographs.iter().map(|own| own.name.as_str()).collect();
    let index = charts::photograph(name, &names).map_err(|problem| anyhow!("{problem}"))?;
    let photograph = &capture.photographs[index];
    let image = photograph.image.as_deref();
    let image =
        image.ok_or_else(|| anyhow!("{}: it is no measurement of radiance", photograph.name))?;
    Ok((photograph, image))
}
