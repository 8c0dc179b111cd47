//! `cargo verify`: the checks, one after the other, with all failures reported at the end.

mod steps;

use std::collections::VecDeque;
use std::process::{Command, Stdio};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};
use std::{fs, iter, thread};

use actq_boards::Target;
use anyhow::{Context as _, Error, Result, anyhow, bail};

use self::steps::{Installed, Step};
use crate::setup;

/// Expected minutes on two cores, from a fresh clone with an empty target directory: of the short run by
/// `docs/records/2026-11-26-verify.md`, of all by `docs/records/2026-11-30-verify.md`, beside other work. No check fails
/// when a run takes longer.
struct Expected {
    wall: f64,
    cpu: f64,
}

const SHORT: Expected = Expected { wall: 10.0, cpu: 17.0 };
const ALL: Expected = Expected { wall: 35.0, cpu: 65.0 };

/// Runs the checks: those of every change, or all.
pub(crate) fn run(all: bool) -> Result<()> {
    let (targets, expected) = if all { (&Target::ALL[..], ALL) } else { (&[Target::Fpu][..], SHORT) };
    println!("verify: about {} minutes from a fresh clone on two cores", expected.wall);
    setup::components()?;
    setup::ensure(targets)?;
    let steps = if all { steps::all(Installed::ensure()) } else { steps::short() };
    run_all(steps, &expected)?;
    println!("all checks passed{}", if all { "" } else { "; `cargo verify --all` runs the rest of what CI checks" });
    Ok(())
}

enum Outcome {
    Ok,
    Failed,
    Skipped(String),
}

/// A finished step.
struct Done {
    name: String,
    outcome: Outcome,
    seconds: f64,
}

/// Runs the steps; an error names the failed ones.
fn run_all(steps: Vec<Step>, expected: &Expected) -> Result<()> {
    let start = Instant::now();
    // Tests write the names of skipped tests to this file.
    let skipped = std::env::temp_dir().join(format!("actq-skipped-{}", std::process::id()));
    let count = steps.len();
    let numbered = |(i, mut step): (usize, Step)| {
        if let Ok(command) = &mut step.command {
            command.env("ACTQ_SKIPPED", &skipped);
        }
        (step, format!("{}/{count}", i + 1))
    };
    let first_beside = steps.iter().position(|step| step.is_beside).unwrap_or(count);
    let mut steps = steps.into_iter().enumerate().map(numbered);
    let run = |(step, number): (Step, String)| run_step(step, &number, start);
    let mut done = steps.by_ref().take(first_beside).map(run).collect::<Result<Vec<_>>>()?;
    let (beside, others): (Vec<_>, Vec<_>) = steps.partition(|(step, _)| step.is_beside);
    let beside = Mutex::new(VecDeque::from(beside));
    let run_beside = || {
        let next = || beside.lock().unwrap_or_else(PoisonError::into_inner).pop_front();
        iter::from_fn(next).map(run).collect::<Result<Vec<_>>>()
    };
    thread::scope(|scope| {
        let worker = scope.spawn(run_beside);
        for step in others {
            done.push(run(step)?);
        }
        // Whoever is done first takes the next one.
        done.extend(run_beside()?);
        done.extend(worker.join().map_err(|_| anyhow!("the thread of other steps panicked"))??);
        Ok::<_, Error>(())
    })?;
    done.sort_by(|a, b| b.seconds.total_cmp(&a.seconds));
    let tests = fs::read_to_string(&skipped).unwrap_or_default();
    let _ = fs::remove_file(&skipped);
    summary(&done, &tests, start, expected)
}

/// Time between lines about a running step.
const REPORT: Duration = Duration::from_secs(30);

fn run_step(Step { name, command, is_beside }: Step, number: &str, start: Instant) -> Result<Done> {
    let begun = Instant::now();
    let outcome = match command {
        Ok(mut command) => {
            println!("\n== {number} {name}: {}", text(&command));
            // The output of a step beside others comes as a whole, at its end.
            let file = format!("actq-output-{}-{}", std::process::id(), number.replace('/', "-"));
            let path = std::env::temp_dir().join(file);
            if is_beside {
                let file = fs::File::create(&path)?;
                command.stdout(file.try_clone()?).stderr(file);
            }
            let mut child = command.stdin(Stdio::null()).spawn().context("cannot start the step's program")?;
            let mut reported = begun;
            let status = loop {
                if let Some(status) = child.try_wait()? {
                    break status;
                }
                if !is_beside && reported.elapsed() > REPORT {
                    println!("   {name}: still running after {} s", begun.elapsed().as_secs());
                    reported = Instant::now();
                }
                thread::sleep(Duration::from_millis(100));
            };
            if is_beside {
                println!("\n== {number} {name}:\n{}", String::from_utf8_lossy(&fs::read(&path)?));
                fs::remove_file(&path)?;
            }
            if status.success() { Outcome::Ok } else { Outcome::Failed }
        }
        Err(why) => Outcome::Skipped(why),
    };
    let (seconds, so_far) = (begun.elapsed().as_secs_f64(), start.elapsed().as_secs_f64() / 60.0);
    match &outcome {
        Outcome::Ok => println!("== {name}: ok in {seconds:.0} s, {so_far:.1} min so far"),
        Outcome::Failed => println!("== {name}: FAILED in {seconds:.0} s, {so_far:.1} min so far"),
        Outcome::Skipped(why) => println!("\n== {number} {name}: SKIPPED: {why}"),
    }
    Ok(Done { name, outcome, seconds })
}

/// Formats the command as a user would type it.
fn text(command: &Command) -> String {
    let arguments: Vec<_> = command.get_args().map(|argument| argument.to_string_lossy()).collect();
    let program = command.get_program().to_string_lossy();
    let name = if program.ends_with("rustup") { "rustup" } else { "cargo" };
    format!("{name} {}", arguments.join(" "))
}

/// Returns the CPU minutes of all ended child processes and of their children, from fields 16 and 17 of
/// `/proc/self/stat` in hundredths of a second (proc(5): cutime, cstime); `None` without a /proc.
fn cpu_minutes() -> Option<f64> {
    let stat = fs::read_to_string("/proc/self/stat").ok()?;
    // The second field is a name in parentheses, with any content.
    let fields = stat.rsplit_once(')')?.1.split_whitespace().skip(13).take(2);
    Some(fields.flat_map(str::parse::<f64>).sum::<f64>() / 6000.0)
}

/// Prints the results, the longest step first; an error if a step failed.
fn summary(all: &[Done], tests: &str, start: Instant, expected: &Expected) -> Result<()> {
    let name_width = all.iter().map(|done| done.name.len()).max().unwrap_or(0);
    println!("\n{:name_width$}  result   seconds", "step");
    for Done { name, outcome, seconds } in all {
        let (result, why) = match outcome {
            Outcome::Ok => ("ok", ""),
            Outcome::Failed => ("FAILED", ""),
            Outcome::Skipped(why) => ("SKIPPED", why.as_str()),
        };
        println!("{name:name_width$}  {result:7} {seconds:8.1} {why}");
    }

    let mut tests: Vec<&str> = tests.lines().collect();
    tests.sort_unstable();
    tests.dedup();
    let steps_skipped = all.iter().filter(|done| matches!(done.outcome, Outcome::Skipped(_))).count();
    if !tests.is_empty() {
        println!("\n{}", tests.join("\n"));
    }
    println!("\nskipped: {steps_skipped} steps, {} tests or parts of tests", tests.len());
    let Expected { wall, cpu } = expected;
    let minutes = start.elapsed().as_secs_f64() / 60.0;
    let cpu_minutes = cpu_minutes().map_or_else(|| "-".to_owned(), |minutes| format!("{minutes:.1}"));
    println!("took {minutes:.1} minutes and {cpu_minutes} of CPU; expected from a fresh clone: {wall} and {cpu}");
    let failed: Vec<&str> =
        all.iter().filter(|d| matches!(d.outcome, Outcome::Failed)).map(|d| d.name.as_str()).collect();
    if !failed.is_empty() {
        bail!("failed: {}", failed.join(", "));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_short_run_is_part_of_all() {
        let names = |steps: Vec<Step>| steps.into_iter().map(|step| step.name).collect::<Vec<_>>();
        let short = names(steps::short());
        let narrow = Err("not here".to_owned());
        let all = names(steps::all(Installed { oldest: Ok(()), narrow, python: Ok(()), wasm: Ok(()) }));
        assert!(short.iter().all(|name| all.contains(name)), "{short:?}");
        assert!(all.len() > short.len());
    }
}
