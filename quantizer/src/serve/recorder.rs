//! Records what a served policy is shown, in a thread of its own: no answer waits for a label or for the disk.

use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, sync_channel};
use std::thread;

use actq::graph::Evaluator;
use actq::policy::Policy;
use actq_kernels::Image;
use anyhow::{Context as _, Result, anyhow};

use super::episodes::Episodes;
use super::protocol::{Seen, serve};
use super::recorders;
use crate::outputs::files;

/// New frames from which on the file is written again; and, of a long recording, their share of what it holds. So what
/// is lost when the process is killed, and how often a frame is written, are both in proportion.
const LEAST_NEW: usize = 256;
const NEW_SHARE: usize = 20;
/// Requests that may wait to be recorded. Where labels take longer than answers, answers wait from here on, so that
/// little is lost when the process is killed.
const QUEUE: usize = 256;
/// Bytes that the arrays of a recording may take. The quantizer keeps [`actq::data::MOST_FRAMES`] frames, and reads no
/// archive of 4 GiB.
const MOST_BYTES: usize = 1 << 30;

/// Where to record to, and who labels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RecordPlan<'a> {
    /// The file, which must not exist; where it does, a number is put behind its stem.
    pub(crate) path: &'a Path,
    /// The policy that the image was made from, whose output becomes the array "action"; without it there is none.
    pub(crate) source: Option<&'a Policy>,
}

impl<'a> RecordPlan<'a> {
    fn folder(&self) -> &'a Path {
        self.path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
    }
}

/// One request, for the recorder.
enum Event {
    /// A new episode begins: the policy was reset, or has reset itself.
    Begin,
    Observation(Vec<f32>),
}

/// As [`serve`], and everything that the image is shown goes into a recording. It is replaced as a whole, again and
/// again, so that it can be read whenever the process ends. `note` is told what the user should know at once. Where
/// nothing can be recorded any more, serving goes on, and the error is returned at the end.
pub(crate) fn serve_recorded(
    image: Image<'_>,
    plan: RecordPlan<'_>,
    input: impl Read,
    output: impl Write,
    note: impl Fn(String) + Sync,
) -> Result<()> {
    files::check_new(plan.path)?;
    // Before the first answer: who has got one can wait for the recording.
    let _recording = recorders::share(plan.folder());
    let recorder = Recorder::new(&image, plan, &note)?;
    let (sender, receiver) = sync_channel(QUEUE);
    thread::scope(|scope| {
        let recorder = scope.spawn(|| recorder.run(receiver));
        let served = serve(image, input, output, |seen| {
            let event = match seen {
                Seen::Reset | Seen::NoAction => Event::Begin,
                Seen::Observation(observation) => Event::Observation(observation.to_vec()),
            };
            // A recorder that has ended has said why.
            drop(sender.send(event));
        });
        drop(sender);
        let recorded = recorder.join().map_err(|_| anyhow!("the recorder has panicked"))?;
        served.and(recorded)
    })
}

/// What has been recorded so far.
struct Recorder<'a, F> {
    plan: RecordPlan<'a>,
    crc: u32,
    /// The f32 policy, its recurrent state run along.
    labels: Option<Evaluator<'a>>,
    episodes: Episodes,
    /// Steps since the policy was reset, and after how many of them an observation reaches a recurrent network: one
    /// that plays the rest of a chunk does not, so that its next step is the one after.
    step: usize,
    every: usize,
    /// Frames in the file, and its name once there is one.
    saved: usize,
    file: Option<PathBuf>,
    note: &'a F,
}

impl<'a, F: Fn(String)> Recorder<'a, F> {
    fn new(image: &Image<'_>, plan: RecordPlan<'a>, note: &'a F) -> Result<Self> {
        let recurrent = image.state().len > 0;
        let action = if plan.source.is_some() { image.output().len } else { 0 };
        let episodes = Episodes::new(plan.folder(), image.obs_len(), action, recurrent)
            .with_context(|| format!("{}: cannot make a temporary file", plan.folder().display()))?;
        Ok(Self {
            plan,
            crc: image.crc(),
            labels: plan.source.map(|source| Evaluator::new(&source.graph)),
            episodes,
            step: 0,
            every: if recurrent { image.execute().max(1) } else { 1 },
            saved: 0,
            file: None,
            note,
        })
    }

    /// Records until no more events can come.
    fn run(mut self, events: Receiver<Event>) -> Result<()> {
        let name = self.plan.path.display();
        self.record(events).with_context(|| format!("{name}: the recording is not complete")).inspect_err(|error| {
            (self.note)(format!("{error:#}; the policy is served further"));
        })
    }

    fn record(&mut self, events: Receiver<Event>) -> Result<()> {
        for event in events {
            match event {
                Event::Begin => {
                    self.step = 0;
                    self.begin();
                }
                Event::Observation(observation) => {
                    if self.episodes.bytes_with_next() > MOST_BYTES {
                        self.save()?;
                        let mib = MOST_BYTES >> 20;
                        let name = self.plan.path.display();
                        (self.note)(format!("{name}: {mib} MiB are recorded, and no more than that will be"));
                        return Ok(());
                    }
                    self.observe(&observation)?;
                }
            }
            if self.episodes.frames() >= self.saved + LEAST_NEW.max(self.saved / NEW_SHARE) {
                self.save()?;
            }
        }
        if self.episodes.frames() > self.saved { self.save() } else { Ok(()) }
    }

    fn begin(&mut self) {
        self.episodes.begin();
        if let Some(labels) = &mut self.labels {
            labels.reset();
        }
    }

    fn observe(&mut self, observation: &[f32]) -> Result<()> {
        let reaches = self.step.is_multiple_of(self.every);
        self.step += 1;
        if !reaches {
            return Ok(());
        }
        let action = self.labels.as_mut().map_or(Vec::new(), |labels| labels.step(observation, &mut |_, _| {}));
        // Where the f32 policy itself overflows, there is nothing to learn.
        if action.iter().all(|v| v.is_finite()) {
            self.episodes.push(observation, &action)?;
        } else {
            self.begin();
        }
        Ok(())
    }

    fn save(&mut self) -> Result<()> {
        let write = |file: &mut File| self.episodes.write_npz(self.crc, file);
        match &self.file {
            Some(file) => files::write_with(file, write)?,
            None => {
                let file = files::write_new(self.plan.path, write)?;
                if file != self.plan.path {
                    let (taken, file) = (self.plan.path.display(), file.display());
                    (self.note)(format!("{taken} is there already; recording into {file}"));
                }
                self.file = Some(file);
            }
        }
        self.saved = self.episodes.frames();
        Ok(())
    }
}
