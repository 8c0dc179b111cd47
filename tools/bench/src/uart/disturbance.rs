//! The faults, one in each episode, and the results.

use std::fmt;

use actq_client::push::{Package, Push};
use actq_link::code::{Fault, State};
use actq_ur3::task::{Outcome, POSITION_TOLERANCE};
use anyhow::{Context as _, Result, bail, ensure};

use super::line::{Noise, Tally};
use super::rig::{Progress, Reaction, Rig};

/// Control step at which a single fault begins: on the way to the first goal.
const FAULT_STEP: usize = 20;
/// Duration of a cut, ms: longer than the controller's deadline of 500.
const CUT_MS: u64 = 800;
/// Durations of a stall of the host's driver, ms. One is shorter than the deadline, but some held observations then
/// exceed the allowed age; the other is longer than the deadline.
const STALLS_MS: [u64; 2] = [280, 1200];
/// Most control steps in which a reset board reports again.
const RESET_STEPS: usize = 500;
/// Bytes of an image to send while the arm moves, and bytes in a frame: QEMU's serial port is slow. The bytes before
/// them are sent before the arm moves.
const BYTES_IN_FLIGHT: usize = 8 << 10;
const CHUNK: usize = 128;
/// The latest reaction, ms: the controller's deadline of 500, and a tick.
const IN_TIME: u32 = 501;
/// Resolution of the time between two events, ms: each report comes in the tick after the event, or after a slice of
/// the head.
const RESOLUTION: u32 = 4;
/// Share of the frames with a fault of one kind: "1 in 10".
const SHARE: f64 = 0.1;

/// Name of the episode with all faults of frames.
const ALL: &str = "all four at once";

/// The fault of an episode.
#[derive(Clone, Copy, Debug)]
pub enum Disturbance<'a> {
    /// No fault.
    None,
    /// Frames have these faults, in both directions, all the time.
    Noise(&'static str, Noise),
    /// The cable is cut, and restored later.
    Cut,
    /// Frames from the host are held for this many ms, and then come all at once.
    Stall(u64),
    /// The board is reset.
    Reset,
    /// A new image is sent while the arm moves; then the host disarms, starts the image, and arms again.
    Update(&'a [u8]),
}

impl<'a> Disturbance<'a> {
    /// Returns all of them; the last one sends `image`.
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
            Self::Stall(STALLS_MS[0]),
            Self::Stall(STALLS_MS[1]),
            Self::Reset,
            Self::Update(image),
        ]
    }

    /// Returns `true` for the most telling ones in little time: all faults of frames, and a cut.
    pub fn is_for_demo(&self) -> bool {
        matches!(self, Self::Noise(ALL, _) | Self::Cut)
    }

    /// Returns `true` if the controller continues through it; otherwise it stops, and is armed again.
    pub const fn keeps_running(&self) -> bool {
        match self {
            Self::None | Self::Noise(..) => true,
            Self::Stall(ms) => *ms == STALLS_MS[0],
            Self::Cut | Self::Reset | Self::Update(_) => false,
        }
    }
}

impl fmt::Display for Disturbance<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(&match self {
            Self::None => "none".to_owned(),
            Self::Noise(name, _) => (*name).to_owned(),
            Self::Cut => format!("cable cut for {CUT_MS} ms"),
            Self::Stall(ms) => format!("host stalls for {ms} ms"),
            Self::Reset => "board reset".to_owned(),
            Self::Update(_) => "new image".to_owned(),
        })
    }
}

/// An episode with a fault.
#[derive(Clone, Copy, Debug)]
pub struct Run {
    /// Result.
    pub outcome: Outcome,
    /// `true` if the arm reached both goals, or only the second one when a fault delayed it on the way to the first.
    pub reached: bool,
    /// `true` if the controller was armed at the end.
    pub armed: bool,
    /// Reaction time of an automatic stop of the controller.
    pub reaction: Option<Reaction>,
    /// Time from the end of the fault to an armed controller, ms of its own clock.
    pub again: Option<u64>,
    /// Counts of the frames to the board.
    pub tally: Tally,
    /// Frames that the board counted as damaged and as repeated.
    pub found: (u32, u32),
    /// Observations that the guard refused.
    pub refused: u32,
    /// Actions that set a target of the outputs, of 200.
    pub applied: u32,
    /// Resets of the board.
    pub resets: u32,
    /// `true` if this machine has delayed the host beyond the fault, or if the host read too slowly to tell the
    /// reaction time: a failed check then tells nothing about the controller.
    pub disturbed: bool,
}

impl Run {
    /// Checks the run.
    ///
    /// # Errors
    ///
    /// The first failed check.
    pub fn check(&self, disturbance: &Disturbance<'_>) -> Result<()> {
        ensure!(self.armed, "the controller is not armed at the end");
        ensure!(self.reached, "the arm missed a goal; it ended {:.1} mm from it", 1e3 * self.outcome.final_error_m);
        match (self.reaction, disturbance) {
            (Some(Reaction { fault: Fault::Stale, least, most }), Disturbance::Cut | Disturbance::Stall(_))
                if !disturbance.keeps_running() =>
            {
                let in_time = least <= IN_TIME && most <= IN_TIME + RESOLUTION;
                ensure!(in_time, "safe after {least} to {most} ms, expected the deadline and a tick, {IN_TIME} ms");
            }
            (None, Disturbance::Cut | Disturbance::Stall(_)) if !disturbance.keeps_running() => {
                bail!("the controller did not stop")
            }
            (Some(reaction), _) => bail!("the controller stopped: {}", reaction.fault),
            (None, _) => {}
        }
        let resets = u32::from(matches!(disturbance, Disturbance::Reset));
        ensure!(self.resets == resets, "the board reset {} times; expected {resets}", self.resets);
        let ((damaged, repeated), tally) = (self.found, self.tally);
        ensure!(damaged == tally.corrupted, "the board counted {damaged} of {} damaged frames", tally.corrupted);
        let repetitions = tally.duplicated..=tally.duplicated + tally.delayed;
        ensure!(repetitions.contains(&repeated), "the board counted {repeated} repetitions; expected {repetitions:?}");
        let old = matches!(disturbance, Disturbance::Stall(_)) && disturbance.keeps_running();
        ensure!(!old || self.refused > 0, "the guard accepted held observations");
        Ok(())
    }
}

impl Rig {
    /// Runs an episode with this fault, and passes every control step to `seen`.
    pub fn run(&mut self, seed: u64, disturbance: Disturbance<'_>, mut seen: impl FnMut(&Progress)) -> Result<Run> {
        let mut update = None;
        if let Disturbance::Update(image) = disturbance {
            let mut push = Push::new(&mut self.client, Package { image, version: 1, signature: None })?;
            while push.taken() + BYTES_IN_FLIGHT < image.len() {
                push.advance(&mut self.client)?;
            }
            push.limit_chunks(CHUNK);
            update = Some(push);
        }
        self.begin(seed, !disturbance.keeps_running())?;
        let (tally, status, applied, resets) = (self.line.tally(), self.status, self.applied, self.resets);
        if let Disturbance::Noise(_, noise) = disturbance {
            self.line.set_noise(noise);
        }
        for step in 0..FAULT_STEP {
            self.step()?;
            seen(&self.progress(step + 1));
        }
        let mut steps = FAULT_STEP;
        // Runs control steps for this many ms of the controller's time, one at least.
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
        match disturbance {
            Disturbance::None | Disturbance::Noise(..) => {}
            Disturbance::Cut => {
                self.line.cut(true);
                meanwhile(self, CUT_MS)?;
                self.line.cut(false);
            }
            Disturbance::Stall(ms) => {
                self.line.hold(true);
                meanwhile(self, ms)?;
                self.line.hold(false);
            }
            Disturbance::Reset => {
                self.controller.reset()?;
                // A board that does not come back fails the check of resets.
                for _ in 0..RESET_STEPS {
                    if self.resets != resets {
                        break;
                    }
                    meanwhile(self, 0)?;
                }
            }
            Disturbance::Update(image) => {
                let mut push = update.context("the push has not begun")?;
                while push.taken() < image.len() {
                    self.push(&mut push)?;
                    meanwhile(self, 0)?;
                }
                self.client.disarm()?;
                ensure!(push.advance(&mut self.client)?, "the new image does not run");
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
            reached: match disturbance {
                Disturbance::None | Disturbance::Noise(..) => outcome.success,
                _ => outcome.final_error_m < POSITION_TOLERANCE,
            },
            armed: self.status.state == State::Armed,
            reaction: self.reaction,
            again: again.filter(|_| !disturbance.keeps_running()),
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
            // Reports were dropped, and the reaction may have been in time.
            disturbed: self.disturbed
                || self.reaction.is_some_and(|r| r.least <= IN_TIME && r.most > IN_TIME + RESOLUTION),
        })
    }
}
