//! The choice of the next job, for a pool of workers.

use std::collections::{BTreeMap, BTreeSet};

use crate::job::Job;

/// State of a plan that is being worked on.
#[derive(Debug)]
pub struct Schedule<'a> {
    jobs: &'a [Job],
    state: Vec<State>,
    /// Most tries of a job.
    tries: usize,
    /// Indices of the jobs that need a job, by its index.
    dependents: Vec<Vec<usize>>,
}

/// State of a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// Waits for this many results; with the number of failed tries.
    Waiting {
        open: usize,
        failed: usize,
    },
    Running {
        failed: usize,
    },
    Done,
    Failed,
    /// A job that it needs has failed.
    Skipped,
}

/// End of a try.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// The result is in the store.
    Done,
    /// Another try may succeed.
    Again,
    /// No try can succeed.
    Never,
}

/// Numbers of jobs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Jobs with a result.
    pub done: usize,
    /// Running jobs.
    pub running: usize,
    /// Jobs without a result after the last try.
    pub failed: usize,
    /// Jobs whose dependency failed.
    pub skipped: usize,
    /// All jobs.
    pub all: usize,
}

impl<'a> Schedule<'a> {
    /// Begins with the jobs of a checked plan ([`crate::order::check`]). `is_done` returns `true` for those with
    /// results; it is called once for each, since another process may be writing some. A job is tried at most
    /// `tries` times.
    pub fn new(jobs: &'a [Job], is_done: impl Fn(&Job) -> bool, tries: usize) -> Self {
        let index: BTreeMap<&str, usize> = jobs.iter().enumerate().map(|(i, job)| (job.address.as_str(), i)).collect();
        let state: Vec<State> = jobs
            .iter()
            .map(|job| if is_done(job) { State::Done } else { State::Waiting { open: 0, failed: 0 } })
            .collect();
        let mut schedule = Self { jobs, state, tries: tries.max(1), dependents: vec![Vec::new(); jobs.len()] };
        for (i, job) in jobs.iter().enumerate() {
            for dep in job.deps.iter().filter_map(|dep| index.get(dep.as_str())) {
                schedule.dependents[*dep].push(i);
                let is_open = schedule.state[*dep] != State::Done;
                if let (State::Waiting { open, .. }, true) = (&mut schedule.state[i], is_open) {
                    *open += 1;
                }
            }
        }
        schedule
    }

    /// Starts a job that is ready and takes at most `cpus` cores. Of those, it takes the one with the longest estimate,
    /// since long jobs at the end leave workers idle. If no job runs, it may take more cores. Returns its index.
    pub fn start(&mut self, cpus: usize) -> Option<usize> {
        let alone = !self.state.iter().any(|state| matches!(state, State::Running { .. }));
        let ready = (0..self.jobs.len()).filter(|&i| matches!(self.state[i], State::Waiting { open: 0, .. }));
        let fits = ready.filter(|&i| alone || self.jobs[i].cpus <= cpus);
        // Of equal ones, the first of the plan.
        let longest = fits.min_by(|&a, &b| self.jobs[b].seconds.total_cmp(&self.jobs[a].seconds))?;
        if let State::Waiting { failed, .. } = self.state[longest] {
            self.state[longest] = State::Running { failed };
        }
        Some(longest)
    }

    /// Records the end of a try. Returns `true` if the job will be tried again.
    pub fn end(&mut self, job: usize, ended: Ended) -> bool {
        let State::Running { failed } = self.state[job] else { return false };
        match ended {
            Ended::Done => {
                self.state[job] = State::Done;
                for &dependent in &self.dependents[job] {
                    if let State::Waiting { open, .. } = &mut self.state[dependent] {
                        *open -= 1;
                    }
                }
            }
            Ended::Again if failed + 1 < self.tries => {
                self.state[job] = State::Waiting { open: 0, failed: failed + 1 };
                return true;
            }
            Ended::Again | Ended::Never => {
                self.state[job] = State::Failed;
                self.skip_dependents(job);
            }
        }
        false
    }

    fn skip_dependents(&mut self, job: usize) {
        let mut open: BTreeSet<usize> = self.dependents[job].iter().copied().collect();
        while let Some(next) = open.pop_first() {
            if matches!(self.state[next], State::Waiting { .. }) {
                self.state[next] = State::Skipped;
                open.extend(&self.dependents[next]);
            }
        }
    }

    /// Returns the numbers of jobs.
    pub fn counts(&self) -> Counts {
        let mut counts = Counts { all: self.jobs.len(), ..Counts::default() };
        for state in &self.state {
            match state {
                State::Waiting { .. } => (),
                State::Running { .. } => counts.running += 1,
                State::Done => counts.done += 1,
                State::Failed => counts.failed += 1,
                State::Skipped => counts.skipped += 1,
            }
        }
        counts
    }

    /// Returns the estimated core seconds of the jobs that have no result yet, and of all.
    pub fn work(&self) -> (f64, f64) {
        let of = |job: &Job| job.seconds * job.cpus as f64;
        let open = |(_, state): &(&Job, &State)| matches!(state, State::Waiting { .. } | State::Running { .. });
        let left = self.jobs.iter().zip(&self.state).filter(open).map(|(job, _)| of(job)).sum();
        (left, self.jobs.iter().map(of).sum())
    }
}
