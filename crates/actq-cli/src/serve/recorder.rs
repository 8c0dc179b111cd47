//! Records the observations of a served policy in its own thread, so that replies do not wait for labels or the disk.

use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, sync_channel};
use std::thread;

use actq::graph::Evaluator;
use actq::policy::Policy;
use actq::runtime::prefix_len;
use actq_kernels::Image;
use anyhow::{Context as _, Result, anyhow};

use super::episodes::Episodes;
use super::protocol::{Seen, serve};
use super::recorders;
use crate::outputs::files;

/// The fewest new frames at which the file is written again.
const MIN_NEW: usize = 256;
/// Divisor of the saved frames that gives the fewest new frames of a long recording. It bounds both the loss when the
/// process is killed and the number of times that a frame is written.
const NEW_SHARE: usize = 20;
/// The most requests in the queue of the recorder. If labels take longer than replies, replies wait when it is full, so
/// that a killed process loses little.
const QUEUE: usize = 256;
/// The most bytes of a recording's arrays. The quantizer keeps [`actq::data::MAX_FRAMES`] frames, and reads no
/// archive of 4 GiB.
const MAX_BYTES: usize = 1 << 30;

/// File of a recording, and the policy that labels it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RecordPlan<'a> {
    /// The file; if it exists, the recording's name gets a number after the stem.
    pub(crate) path: &'a Path,
    /// The policy that the image was made from, whose output becomes the array "action"; `None` for no such array.
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

/// Serves as [`serve`] does, and records all observations. The recording is replaced as a whole, again and again, so
/// that it is readable whenever the process ends. Calls `note` with messages for the user. If recording fails, serving
/// goes on, and the error is returned at the end.
pub(crate) fn serve_recorded(
    image: Image<'_>,
    plan: RecordPlan<'_>,
    input: impl Read,
    output: impl Write,
    note: impl Fn(String) + Sync,
) -> Result<()> {
    files::check_new(plan.path)?;
    // The lock is taken before the first reply, so that a process with a reply can wait for the recording.
    let _recording = recorders::share(plan.folder());
    let recorder = Recorder::new(&image, plan, &note)?;
    let (sender, receiver) = sync_channel(QUEUE);
    thread::scope(|scope| {
        let recorder = scope.spawn(|| recorder.run(receiver));
        let served = serve(image, 0, input, output, |seen| {
            let event = match seen {
                Seen::Reset | Seen::NoAction => Event::Begin,
                Seen::Observation(observation) => Event::Observation(observation.to_vec()),
            };
            // A recorder that has ended has reported its error.
            drop(sender.send(event));
        });
        drop(sender);
        let recorded = recorder.join().map_err(|_| anyhow!("the recorder thread panicked"))?;
        served.and(recorded)
    })
}

/// The recorder, with the recording so far.
struct Recorder<'a, F> {
    plan: RecordPlan<'a>,
    crc: u32,
    /// The f32 policy, with its recurrent state.
    labels: Option<Evaluator<'a>>,
    episodes: Episodes,
    /// Steps since the last reset.
    step: usize,
    /// Steps from one evaluation of a recurrent network to the next. The steps between them play the rest of a chunk
    /// and are not recorded.
    every: usize,
    /// Frames in the file.
    saved: usize,
    /// Name of the file, after the first save.
    file: Option<PathBuf>,
    note: &'a F,
}

impl<'a, F: Fn(String)> Recorder<'a, F> {
    fn new(image: &Image<'_>, plan: RecordPlan<'a>, note: &'a F) -> Result<Self> {
        let recurrent = image.state().len > 0;
        let action = if plan.source.is_some() { image.output().len } else { 0 };
        let episodes = Episodes::new(plan.folder(), image.obs_len() + prefix_len(image), action, recurrent)
            .with_context(|| format!("{}: cannot create a temporary file", plan.folder().display()))?;
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

    /// Records until the sender of events is dropped.
    fn run(mut self, events: Receiver<Event>) -> Result<()> {
        let name = self.plan.path.display();
        self.record(events).with_context(|| format!("{name}: recording stopped early")).inspect_err(|error| {
            (self.note)(format!("{error:#}; serving continues"));
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
                    if self.episodes.bytes_with_next() > MAX_BYTES {
                        self.save()?;
                        let mib = MAX_BYTES >> 20;
                        let name = self.plan.path.display();
                        (self.note)(format!("{name}: recording stops at its limit of {mib} MiB; serving continues"));
                        return Ok(());
                    }
                    self.observe(&observation)?;
                }
            }
            if self.episodes.frames() >= self.saved + MIN_NEW.max(self.saved / NEW_SHARE) {
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
        let is_evaluated = self.step.is_multiple_of(self.every);
        self.step += 1;
        if !is_evaluated {
            return Ok(());
        }
        let action = self.labels.as_mut().map_or(Vec::new(), |labels| labels.step(observation, &mut |_, _| {}));
        // If the f32 policy overflows, the frame has no label.
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
                    (self.note)(format!("{taken} exists; recording to {file}"));
                }
                self.file = Some(file);
            }
        }
        self.saved = self.episodes.frames();
        Ok(())
    }
}
