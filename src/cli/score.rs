use crate::cli::Ending;
use clap::ArgMatches;
pub(super) fn run(_m: &ArgMatches) -> Result<(), Ending> {
    Ok(())
}
