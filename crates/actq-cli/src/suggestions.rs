//! Parsing of the command line, with a suggestion for a misspelt option.

use std::env;
use std::io::{self, Write as _};
use std::process::ExitCode;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Arg, Command, CommandFactory as _, Error, FromArgMatches as _};

use crate::args::Cli;

/// The most letters of an option that may be missing, wrong, extra, or swapped with their neighbour.
const MAX_TYPOS: usize = 1;

/// Parses the command line. Prints an error, or the requested help or version, and returns the exit status.
pub(crate) fn parse() -> Result<Cli, ExitCode> {
    let parsed = command().try_get_matches().and_then(|matches| Cli::from_arg_matches(&matches));
    parsed.map_err(|mut error| {
        suggest(&mut error);
        let is_requested = !error.use_stderr();
        match error.print().and_then(|()| io::stdout().flush()) {
            // A reader that has closed its end is not an error.
            Err(failure) if is_requested && failure.kind() != io::ErrorKind::BrokenPipe => {
                eprintln!("actq: cannot write to standard output: {failure}");
                ExitCode::FAILURE
            }
            _ => u8::try_from(error.exit_code()).map_or(ExitCode::FAILURE, ExitCode::from),
        }
    })
}

/// Returns the command line's definition. Negative numbers count as option values.
fn command() -> Command {
    fn with_numbers(command: Command) -> Command {
        let takes_numbers = |arg: &Arg| arg.get_action().takes_values() && !arg.is_positional();
        let command = command.mut_args(|arg| if takes_numbers(&arg) { arg.allow_negative_numbers(true) } else { arg });
        command.mut_subcommands(with_numbers)
    }
    with_numbers(Cli::command())
}

/// Adds a suggestion that clap misses: its similarity measure finds swapped letters in long names only.
fn suggest(error: &mut Error) {
    // Errors of other kinds, as a conflict, name options that exist.
    if error.kind() != ErrorKind::UnknownArgument || error.get(ContextKind::SuggestedArg).is_some() {
        return;
    }
    let Some(ContextValue::String(given)) = error.get(ContextKind::InvalidArg) else { return };
    let Some(meant) = given.strip_prefix("--").and_then(nearest) else { return };
    error.remove(ContextKind::Suggested);
    error.insert(ContextKind::SuggestedArg, ContextValue::String(format!("--{meant}")));
}

/// Returns the nearest option of the subcommand, if it differs by at most [`MAX_TYPOS`] letters.
fn nearest(given: &str) -> Option<String> {
    let mut command = command();
    for word in env::args_os().skip(1) {
        command = command.find_subcommand(&word).cloned().unwrap_or(command);
    }
    let longs = command.get_arguments().filter_map(|arg| arg.get_long());
    let distances = longs.map(|long| (strsim::osa_distance(given, long), long));
    distances.min().filter(|(distance, _)| *distance <= MAX_TYPOS).map(|(_, long)| long.to_owned())
}
