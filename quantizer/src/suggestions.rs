//! The command line, read; a misspelt option is answered with the one that was meant.

use std::env;

use clap::error::{ContextKind, ContextValue};
use clap::{CommandFactory as _, Error, Parser as _};

use crate::args::Cli;

/// The most letters that may be missing, wrong, too many, or exchanged with their neighbour.
const MOST_ERRORS: usize = 1;

/// Reads the command line, or ends the process with what is wrong in it.
pub(crate) fn parse() -> Cli {
    Cli::try_parse().unwrap_or_else(|mut error| {
        suggest(&mut error);
        error.exit()
    })
}

/// Adds what clap misses: its measure of likeness finds exchanged letters only in long names.
fn suggest(error: &mut Error) {
    if error.get(ContextKind::SuggestedArg).is_some() {
        return;
    }
    let Some(ContextValue::String(given)) = error.get(ContextKind::InvalidArg) else { return };
    let Some(meant) = given.strip_prefix("--").and_then(nearest) else { return };
    error.remove(ContextKind::Suggested);
    error.insert(ContextKind::SuggestedArg, ContextValue::String(format!("--{meant}")));
}

/// The option of the command that is named in the command line, whose name is nearest.
fn nearest(given: &str) -> Option<String> {
    let mut command = Cli::command();
    for word in env::args().skip(1) {
        command = command.find_subcommand(&word).cloned().unwrap_or(command);
    }
    let longs = command.get_arguments().filter_map(|arg| arg.get_long());
    let distances = longs.map(|long| (strsim::osa_distance(given, long), long));
    distances.min().filter(|(distance, _)| *distance <= MOST_ERRORS).map(|(_, long)| long.to_owned())
}
