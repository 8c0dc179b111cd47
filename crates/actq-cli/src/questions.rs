//! Questions that a bundle leaves open, asked in the terminal.

use std::io::{BufRead, Write};

use actq_deploy::{Answers, Bundle, Reading, read};
use anyhow::{Result, ensure};

use crate::report::deployment;

/// Reads a bundle and asks for what nothing states, one question after the other: an answer may raise or settle others.
/// Returns the bundle as it is read with all answers, and the answers.
///
/// # Errors
///
/// If the bundle cannot be read before the first answer, or the input ends.
pub(crate) fn ask(
    bundle: &Bundle,
    accepted: bool,
    mut answers: Answers,
    input: &mut impl BufRead,
    output: &mut impl Write,
) -> Result<(Reading, Answers)> {
    let mut reading = read(bundle, accepted, answers.clone())?;
    while let Some(question) = reading.questions.first() {
        let asked = deployment::questions(std::slice::from_ref(question));
        write!(output, "{asked}{} = ", question.key)?;
        output.flush()?;
        let mut line = String::new();
        ensure!(
            input.read_line(&mut line)? > 0,
            "the input ended before {} was answered; the answers so far, for --answers:\n{answers}",
            question.key
        );
        let mut more = answers.clone();
        // A wrong answer is asked for again.
        match more.set(question, &line).and_then(|()| read(bundle, accepted, more.clone())) {
            Ok(next) => (reading, answers) = (next, more),
            Err(error) => writeln!(output, "{error:#}")?,
        }
    }
    Ok((reading, answers))
}
