//! A pool of worker processes on this machine.

use std::collections::BTreeMap;
use std::fs::OpenOptions;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Sender, channel};
use std::thread;
use std::time::Instant;

use actq::error::Error;
use actq::text::count;
use actq_jobs::error::{AGAIN, JobError};
use actq_jobs::job::Job;
use actq_jobs::schedule::{Counts, Ended, Schedule};
use actq_jobs::store::Store;
use anyhow::{Context as _, Result};
use serde_json::{Value, json};

use crate::group;
use crate::report::progress::duration;
use crate::terminal::{Progress, note};

/// Settings of the workers that run the jobs of a plan.
#[derive(Clone, Copy, Debug)]
pub struct Pool<'a> {
    /// The program that runs a job: it has the command `job` of `actq`.
    pub program: &'a Path,
    /// Cores for all workers together.
    pub cores: usize,
    /// Most tries of a job.
    pub tries: usize,
    /// File to which a line is appended for each job that has run.
    pub log: Option<&'a Path>,
    /// `true` to show no progress.
    pub quiet: bool,
    /// `true` if the store stays when this process ends.
    pub is_kept: bool,
}

/// Runs the jobs of a plan that have no result yet, or a damaged one, each in a process of its own.
///
/// # Errors
///
/// At the end, if a job has failed; the store then has the results of the others. [`JobError::again`] is `true` if each
/// of those that failed may succeed later.
pub fn complete(jobs: &[Job], store: &Store, pool: &Pool<'_>) -> Result<()> {
    let results = store.results(jobs);
    note(results.damaged.iter().map(|damage| format!("{damage:#}; it runs now")));
    let progress = Progress::new(pool.quiet, "starting")?;
    let schedule = Schedule::new(jobs, |job| results.has(&job.address), pool.tries);
    let mut work = Working { jobs, store, schedule, pool, shares: BTreeMap::new(), is_final: false };
    let ended = work.work(&progress);
    drop(progress);
    ended?;
    let Counts { failed, skipped, .. } = work.schedule.counts();
    let kept = match pool.is_kept {
        true => format!(
            "; the others have their results in {}. Run the same command again to retry",
            store.folder().display()
        ),
        false => String::new(),
    };
    let skipped = match skipped {
        0 => String::new(),
        _ => format!(", and {} after them did not run", count(skipped, "job")),
    };
    if failed == 0 {
        return Ok(());
    }
    let error = Error::input(format!("{} failed{skipped}{kept}", count(failed, "job")));
    Err(JobError { again: !work.is_final, error }.into())
}

/// Jobs, store and workers.
struct Working<'a> {
    jobs: &'a [Job],
    store: &'a Store,
    schedule: Schedule<'a>,
    pool: &'a Pool<'a>,
    /// Share done of each running job.
    shares: BTreeMap<usize, f64>,
    /// `true` after a failure that every try repeats.
    is_final: bool,
}

/// A message of a worker's thread.
enum Message {
    Share(usize, f64),
    Ended(usize, Try),
}

/// A try of a job.
struct Try {
    ended: Ended,
    /// Exit status, as a shell shows it.
    status: i32,
    seconds: f64,
    /// Standard error of the worker.
    said: String,
}

impl Working<'_> {
    fn work(&mut self, progress: &Progress) -> Result<()> {
        let (sender, receiver) = channel();
        let (begun, left_at_begin) = (Instant::now(), self.schedule.work().0);
        let mut free = self.pool.cores;
        // After an error of this process, no job starts, and those that run end.
        let mut so_far = Ok(());
        loop {
            while so_far.is_ok()
                && let Some(job) = self.schedule.start(free)
            {
                so_far = self.start(job, sender.clone());
                if so_far.is_ok() {
                    free = free.saturating_sub(self.jobs[job].cpus);
                    self.shares.insert(job, 0.0);
                }
            }
            if self.shares.is_empty() {
                return so_far;
            }
            let (left, all) = self.left();
            let Counts { done, running, all: jobs, .. } = self.schedule.counts();
            // Before the first progress, nothing is known but the estimates of the plan.
            let made = left_at_begin - left;
            let seconds =
                if made > 0.0 { begun.elapsed().as_secs_f64() * left / made } else { left / self.pool.cores as f64 };
            let work = format!("{done} of {}, {running} running, {} left", count(jobs, "job"), duration(seconds));
            progress.set(&work, if all > 0.0 { 1.0 - left / all } else { 0.0 });
            match receiver.recv().context("the workers' threads have ended")? {
                Message::Share(job, share) => drop(self.shares.insert(job, share)),
                Message::Ended(job, of) => {
                    self.shares.remove(&job);
                    free = (free + self.jobs[job].cpus).min(self.pool.cores);
                    let ended = self.end(job, &of);
                    so_far = so_far.and(ended);
                }
            }
        }
    }

    /// Returns the estimated core seconds that remain, and those of all jobs.
    fn left(&self) -> (f64, f64) {
        let (left, all) = self.schedule.work();
        let part = |(job, share): (&usize, &f64)| self.jobs[*job].seconds * self.jobs[*job].cpus as f64 * share;
        ((left - self.shares.iter().map(part).sum::<f64>()).max(0.0), all)
    }

    /// Starts a worker, and a thread that reads its output.
    fn start(&self, job: usize, sender: Sender<Message>) -> Result<()> {
        let line = serde_json::to_string(&self.jobs[job])?;
        let mut command = Command::new(self.pool.program);
        command.args(["job", "-", "--progress", "--store"]).arg(self.store.folder());
        command.args(["--threads", &self.jobs[job].cpus.min(self.pool.cores).min(256).to_string()]);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let begun = Instant::now();
        let mut child = group::spawn(&mut command).context("cannot start a worker")?;
        // A worker that has ended reports it by its status.
        child.stdin.take().iter_mut().for_each(|stdin| drop(stdin.write_all(line.as_bytes())));
        thread::spawn(move || {
            let (status, said) = watch(child, |share| drop(sender.send(Message::Share(job, share))));
            let ended = match status {
                0 => Ended::Done,
                again if again == i32::from(AGAIN) || again > 127 => Ended::Again,
                _ => Ended::Never,
            };
            let seconds = begun.elapsed().as_secs_f64();
            drop(sender.send(Message::Ended(job, Try { ended, status, seconds, said })));
        });
        Ok(())
    }

    fn end(&mut self, job: usize, Try { ended, status, seconds, said }: &Try) -> Result<()> {
        self.is_final |= *ended == Ended::Never;
        let again = self.schedule.end(job, *ended);
        let job = &self.jobs[job];
        if *ended != Ended::Done {
            let next = if again { "it is tried again" } else { "no further try" };
            let (before, reason) = reason(said, &job.title);
            let before = before.iter().map(|line| format!("{}: {line}", job.title));
            note(before.chain([format!("{}: failed with status {status}; {next}: {reason}", job.title)]));
        }
        let Some(log) = self.pool.log else { return Ok(()) };
        let entry = json!({
            "address": job.address,
            "title": job.title,
            "kind": job.work.kind(),
            "estimated": job.seconds,
            "seconds": seconds,
            "status": status,
        });
        append(log, &format!("{entry}\n"))
    }
}

/// Splits a worker's errors into the lines of its commands and its own reason, the last line, which begins with the
/// program's name and the job's title.
fn reason<'a>(said: &'a str, title: &str) -> (Vec<&'a str>, &'a str) {
    let mut lines: Vec<&str> = said.lines().collect();
    let last = lines.pop().unwrap_or_default();
    let own = last.split_once(": ").and_then(|(_program, rest)| rest.strip_prefix(title)?.strip_prefix(": "));
    (lines, own.unwrap_or(last))
}

/// Reads a worker's output until it ends. Returns its exit status, as a shell shows it, and its errors.
fn watch(mut child: Child, mut report: impl FnMut(f64)) -> (i32, String) {
    let errors = child.stderr.take();
    let reader = thread::spawn(move || {
        let mut text = Vec::new();
        errors.map(|mut errors| errors.read_to_end(&mut text));
        String::from_utf8_lossy(&text).into_owned()
    });
    for line in child.stdout.take().map(BufReader::new).into_iter().flat_map(BufReader::lines).map_while(Result::ok) {
        let share = serde_json::from_str(&line).ok().and_then(|line: Value| line.get("share")?.as_f64());
        share.into_iter().for_each(&mut report);
    }
    let status = group::wait(child).ok();
    let said = reader.join().unwrap_or_default();
    (status.map_or(i32::from(AGAIN), shell_status), said)
}

fn shell_status(status: std::process::ExitStatus) -> i32 {
    #[cfg(unix)]
    if let Some(signal) = std::os::unix::process::ExitStatusExt::signal(&status) {
        return 128 + signal;
    }
    status.code().unwrap_or(1)
}

/// Appends to a file, which is made if it does not exist.
pub(crate) fn append(path: &Path, line: &str) -> Result<()> {
    let write = || OpenOptions::new().create(true).append(true).open(path)?.write_all(line.as_bytes());
    write().with_context(|| format!("{}: cannot write the file", path.display()))
}

#[cfg(test)]
mod tests {
    use super::reason;

    #[test]
    fn reasons_do_not_repeat_the_title() {
        let said = "loading\nno display\nactq: arm, rtn: drive: the command failed (exit status: 3): sh run.sh\n";
        assert_eq!(
            reason(said, "arm, rtn: drive"),
            (vec!["loading", "no display"], "the command failed (exit status: 3): sh run.sh")
        );
        assert_eq!(reason("killed: no memory\n", "arm"), (vec![], "killed: no memory"));
        assert_eq!(reason("", "arm"), (vec![], ""));
    }
}
