//! The faults, one in each episode, and what became of it.

use std::fmt;

use actq_client::push::{Package, Push};
use actq_link::code::{Fault, State};
use actq_ur3::task::{Outcome, POSITION_TOLERANCE};
use anyhow::{Context as _, Result, bail, ensure};

use super::line::{Noise, Tally};
use super::rig::{Progress, Reaction, Rig};

/// Control step at which a single fault begins: on the way to the first goal.
const BEGIN: usize = 20;
/// How long a cut lasts, ms: longer than the controller's deadline of 500.
const CUT: u64 = 800;
/// How long the host's driver stalls, ms: shorter than the deadline, but what it then sends is in part older than an
/// observation may be; and longer than the deadline.
const STALLS: [u64; 2] = [280, 1200];
/// Bytes of an image that are sent while the arm moves, and of them in a frame: QEMU's serial port is slow. What comes
/// before them is sent before the arm moves.
const IN_FLIGHT: usize = 8 << 10;
const CHUNK: usize = 128;
/// The controller's deadline, ms.
const DEADLINE: u32 = 500;
/// What is not known of the time between two events, ms: each report comes in the tick behind the event, or behind a
/// slice of the head.
const RESOLUTION: u32 = 4;
/// Share of the frames that meet a fault of one kind: "1 in 10".
const SHARE: f64 = 0.1;

/// The name of all faults of frames.
const ALL: &str = "all four at once";

/// What happens in an episode.
#[derive(Clone, Copy, Debug)]
pub enum Trouble<'a> {
    /// Nothing.
    None,
    /// Frames meet these faults, in both directions, all the time.
    Noise(&'static str, Noise),
    /// The cable is cut, and mended later.
    Cut,
    /// What the host sends is stuck for so many ms, and then comes all at once.
    Stall(u64),
    /// The board is reset.
    Reset,
    /// A new image is sent while the arm moves; then the host disarms, lets it run, and arms again.
    Update(&'a [u8]),
}

impl<'a> Trouble<'a> {
    /// All of them; the last one sends `image`.
    pub fn all(image: &'a [u8]) -> Vec<Self> {
        let none = Noise::default();
        let all = Noise { drop: SHARE, delay: SHARE, duplicate: SHARE, corrupt: SHARE };
        vec![
            Self::None,
            Self::Noise("1 frame in 10 lost", Noise { drop: SHARE, ..none }),
            Self::Noise("1 frame in 10 late", Noise { delay: SHARE, ..none }),
            Self::Noise("1 frame in 10 twice", Noise { duplicate: SHARE, ..none }),
            Self::Noise("1 frame in 10 damaged", Noise { corrupt: SHARE, ..none }),
            Self::Noise(ALL, all),
            Self::Cut,
            Self::Stall(STALLS[0]),
            Self::Stall(STALLS[1]),
            Self::Reset,
            Self::Update(image),
        ]
    }

    /// Whether it shows much in little time: all faults of frames, and a cut.
    pub fn is_telling(&self) -> bool {
        matches!(self, Self::Noise(ALL, _) | Self::Cut)
    }

    /// Whether the controller goes on through it. Otherwise it stops, and is armed again.
    pub const fn goes_on(&self) -> bool {
        match self {
            Self::None | Self::Noise(..) => true,
            Self::Stall(ms) => *ms == STALLS[0],
            Self::Cut | Self::Reset | Self::Update(_) => false,
        }
    }
}

impl fmt::Display for Trouble<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&match self {
            Self::None => "none".to_owned(),
            Self::Noise(name, _) => (*name).to_owned(),
            Self::Cut => format!("cable cut for {CUT} ms"),
            Self::Stall(ms) => format!("host stalls for {ms} ms"),
            Self::Reset => "board reset".to_owned(),
            Self::Update(_) => "new image".to_owned(),
        })
    }
}

/// An episode with a fault.
#[derive(Clone, Copy, Debug)]
pub struct Run {
    /// How it ended.
    pub outcome: Outcome,
    /// Whether the arm did what it could: reached both goals, or, where something has held it up on the way to the
    /// first one, the second one.
    pub reached: bool,
    /// Whether the controller was armed at the end.
    pub armed: bool,
    /// How soon the controller has stopped by itself.
    pub reaction: Option<Reaction>,
    /// From the end of the fault to an armed controller, ms of its own clock.
    pub again: Option<u64>,
    /// What happened to the frames to the board.
    pub tally: Tally,
    /// Frames that the board has found damaged, and those that it had before.
    pub found: (u32, u32),
    /// Observations that the guard has refused.
    pub refused: u32,
    /// Actions that the outputs were led to, of 200.
    pub applied: u32,
    /// Resets of the board.
    pub resets: u32,
    /// `true` if this machine has held up the host, beyond the fault: a failed check then says nothing of the controller.
    pub disturbed: bool,
}

impl Run {
    /// What is not as it should be.
    ///
    /// # Errors
    ///
    /// The first such thing.
    pub fn check(&self, trouble: &Trouble<'_>) -> Result<()> {
        ensure!(self.armed, "the controller is not armed at the end");
        ensure!(self.reached, "the arm has missed a goal; it ended {:.1} mm from it", 1e3 * self.outcome.final_error_m);
        let deadline = DEADLINE + 1;
        match (self.reaction, trouble) {
            (Some(Reaction { fault: Fault::Stale, least, most }), Trouble::Cut | Trouble::Stall(_))
                if !trouble.goes_on() =>
            {
                let in_time = least <= deadline && most <= deadline + RESOLUTION;
                ensure!(in_time, "safe after {least} to {most} ms, not after the deadline and a tick, {deadline} ms");
            }
            (None, Trouble::Cut | Trouble::Stall(_)) if !trouble.goes_on() => bail!("the controller has not stopped"),
            (Some(reaction), _) => bail!("the controller has stopped: {}", reaction.fault),
            (None, _) => {}
        }
        let resets = u32::from(matches!(trouble, Trouble::Reset));
        ensure!(self.resets == resets, "{} resets of the board, not {resets}", self.resets);
        let ((damaged, repeated), tally) = (self.found, self.tally);
        ensure!(damaged == tally.corrupted, "{damaged} of {} damaged frames were found", tally.corrupted);
        let repetitions = tally.duplicated..=tally.duplicated + tally.delayed;
        ensure!(repetitions.contains(&repeated), "{repeated} repetitions were found, not {repetitions:?}");
        let old = matches!(trouble, Trouble::Stall(_)) && trouble.goes_on();
        ensure!(!old || self.refused > 0, "observations that were held up were taken");
        Ok(())
    }
}

impl Rig {
    /// An episode with this fault. `seen` is told every control step.
    pub fn run(&mut self, seed: u64, trouble: Trouble<'_>, mut seen: impl FnMut(&Progress)) -> Result<Run> {
        let mut update = None;
        if let Trouble::Update(image) = trouble {
            let mut push = Push::new(&mut self.client, Package { image, version: 1, signature: None })?;
            while push.taken() + IN_FLIGHT < image.len() {
                push.advance(&mut self.client)?;
            }
            push.limit_chunks(CHUNK);
            update = Some(push);
        }
        self.begin(seed, !trouble.goes_on())?;
        let (tally, status, applied, resets) = (self.line.tally(), self.status, self.applied, self.resets);
        if let Trouble::Noise(_, noise) = trouble {
            self.line.set_noise(noise);
        }
        for step in 0..BEGIN {
            self.step()?;
            seen(&self.progress(step + 1));
        }
        let mut steps = BEGIN;
        // Control steps for so many ms of the controller's time, one at least.
        let mut meanwhile = |rig: &mut Self, ms: u64| -> Result<()> {
            let from = rig.time;
            loop {
                rig.step()?;
                steps += 1;
                seen(&rig.progress(steps));
                if rig.time - from >= ms {
                    return Ok(());
                }
            }
        };
        match trouble {
            Trouble::None | Trouble::Noise(..) => {}
            Trouble::Cut => {
                self.line.cut(true);
                meanwhile(self, CUT)?;
                self.line.cut(false);
            }
            Trouble::Stall(ms) => {
                self.line.hold(true);
                meanwhile(self, ms)?;
                self.line.hold(false);
            }
            Trouble::Reset => {
                self.controller.reset()?;
                while self.resets == resets {
                    meanwhile(self, 0)?;
                }
            }
            Trouble::Update(image) => {
                let mut push = update.context("it has begun")?;
                while push.taken() < image.len() {
                    self.push(&mut push)?;
                    meanwhile(self, 0)?;
                }
                self.client.disarm()?;
                ensure!(push.advance(&mut self.client)?, "the image does not run");
            }
        }
        let (ended, mut again) = (self.time, None);
        let outcome = self.finish(steps, |progress, time| {
            if again.is_none() && progress.state == State::Armed {
                again = Some(time - ended);
            }
            seen(progress);
        })?;
        self.line.set_noise(Noise::default());
        self.settle()?;
        let now = self.line.tally();
        let counted = self.status.counters;
        let since = |now: u32, then: u32| if self.resets == resets { now.wrapping_sub(then) } else { now };
        Ok(Run {
            outcome,
            reached: match trouble {
                Trouble::None | Trouble::Noise(..) => outcome.success,
                _ => outcome.final_error_m < POSITION_TOLERANCE,
            },
            armed: self.status.state == State::Armed,
            reaction: self.reaction,
            again: again.filter(|_| !trouble.goes_on()),
            tally: Tally {
                sent: now.sent - tally.sent,
                dropped: now.dropped - tally.dropped,
                delayed: now.delayed - tally.delayed,
                duplicated: now.duplicated - tally.duplicated,
                corrupted: now.corrupted - tally.corrupted,
            },
            found: (since(counted.damaged, status.counters.damaged), since(counted.repeated, status.counters.repeated)),
            refused: since(self.status.refused, status.refused),
            applied: self.applied - applied,
            resets: self.resets - resets,
            disturbed: self.disturbed,
        })
    }
}
