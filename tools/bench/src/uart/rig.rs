//! The arm, the controller and the host.

use std::path::Path;
use std::time::Instant;

use actq_boards::{Clock, Target};
use actq_client::client::Client;
use actq_client::connection::Connection;
use actq_client::event::Event;
use actq_client::push::Push;
use actq_controller::Axis;
use actq_kernels::Image;
use actq_link::code::{Fault, Parameter, State};
use actq_link::report::Status;
use actq_ur3::ACT_DIM;
use actq_ur3::task::{EPISODE_STEPS, Outcome};
use anyhow::{Context as _, Result, ensure};

use super::arm::{Arm, TICKS};
use super::bits::{Log, Sent};
use super::line::{Heard, Line};
use crate::bits;
use crate::controller::{Controller, HANG_TIMEOUT};

/// Ticks per second of the application.
const TICK_HZ: f32 = 1000.0;

/// Age above which the guard refuses an observation, µs. The build's 500 ms equal the deadline, which would hide it.
const MAX_AGE: f32 = 200_000.0;

/// Ticks between two reports: the resolution of the controller's time.
const REPORT_PERIOD: f32 = 5.0;

/// Ticks to wait for an observation's action. A control step takes 20; but on a busy machine QEMU's serial port is
/// slower than a real one, and the arm's time then waits for it.
const ANSWER_TIMEOUT: u64 = 60;

/// Ticks from one observation to the next above which the host was delayed: five control steps, a fifth of the
/// deadline.
const DELAYED_HOST: u64 = 100;

/// Settings that a reset clears.
fn set_up(client: &mut Client) -> Result<()> {
    client.set(Parameter::StatusPeriod, 0, REPORT_PERIOD)?;
    client.set(Parameter::MaxAge, 0, MAX_AGE)
}

/// Time from the last good frame to the safe action when the controller stops automatically, in ms of its own clock.
/// The true time lies within: each of the two moments is known only to lie between two reports.
#[derive(Clone, Copy, Debug)]
pub struct Reaction {
    /// Cause.
    pub fault: Fault,
    /// Lower bound, ms.
    pub least: u32,
    /// Upper bound, ms.
    pub most: u32,
}

/// Progress of an episode.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Control steps done.
    pub steps: usize,
    /// State of the outputs.
    pub state: State,
    /// Distance of the tool to its goal, m.
    pub distance: f64,
    /// Command of the fastest joint, rad/s.
    pub fastest: f32,
}

/// The arm at the outputs of the application in QEMU, and the host at the other end of its serial port.
pub struct Rig {
    pub(crate) controller: Controller,
    pub(crate) line: Line,
    pub(crate) client: Client,
    pub(crate) arm: Arm,
    /// Ticks of the controller since the rig began, summed over its resets.
    pub(crate) time: u64,
    /// The controller's last status, as sent by the board.
    pub(crate) status: Status,
    /// The last good frame: ticks of the reports before and after it.
    good: (u32, u32),
    /// The last automatic stop of the controller.
    pub(crate) reaction: Option<Reaction>,
    /// Resets of the board.
    pub(crate) resets: u32,
    /// Actions that set a target of the outputs.
    pub(crate) applied: u32,
    /// The host's last reading if it changed, and the ticks of the previous one.
    read: Option<Status>,
    read_ticks: u32,
    log: Log,
    /// Number of the observation that the last action answers.
    answered: Option<u32>,
    /// The time at which the last observation was sent.
    sent: u64,
    /// `true` if this machine has delayed the host since the episode began: a missed deadline then tells nothing about
    /// the controller.
    pub(crate) disturbed: bool,
}

impl Rig {
    /// Starts the application `elf` in QEMU, with `image` built in. The seed draws the line's faults.
    pub fn start(target: Target, elf: &Path, image: &Image<'_>, seed: u64) -> Result<Self> {
        let controller = Controller::start_by(target, elf, None, Clock::Host)?;
        let line = Line::new(controller.address().open().context("the board's serial port")?, seed);
        let end = line.clone();
        let open = Box::new(move || Ok(end.host_end()));
        let mut connection = Connection::open_with("the line".to_owned(), open, HANG_TIMEOUT)?;
        let clock = line.clone();
        connection.set_clock(Box::new(move || clock.now() as u32));
        let mut client = Client::new(connection, HANG_TIMEOUT);
        client.status()?;
        set_up(&mut client)?;
        let heard = line.heard();
        let status = heard.iter().find_map(|heard| match heard.event {
            Event::Status(status) => Some(status),
            _ => None,
        });
        let status = status.context("the board has sent no status")?;
        let axes: [Axis; ACT_DIM] = actq_firmware_demo::image::axes(Some(image), &[], TICK_HZ);
        let mut rig = Self {
            controller,
            line,
            client,
            arm: Arm::new(axes, 0),
            time: 0,
            status,
            good: (status.ticks, status.ticks),
            reaction: None,
            resets: 0,
            applied: 0,
            read: None,
            read_ticks: 0,
            log: Log::default(),
            answered: None,
            sent: 0,
            disturbed: false,
        };
        heard.into_iter().for_each(|heard| rig.hear(heard));
        Ok(rig)
    }

    /// Returns the line, to inject faults.
    pub const fn line(&self) -> &Line {
        &self.line
    }

    /// Returns what the board sent and was sent since the start.
    pub const fn log(&self) -> &Log {
        &self.log
    }

    /// Begins an episode: arms the controller anew. The arm stands still until then. With `exact`, its time is known to
    /// a tick.
    pub(crate) fn begin(&mut self, seed: u64, exact: bool) -> Result<()> {
        self.client.disarm()?;
        let mut begun = Instant::now();
        while self.status.state != State::Disarmed {
            self.listen()?;
            self.require_progress(begun, "did not report that it is disarmed")?;
        }
        // A report in each tick gives exact times, and keeps QEMU busy.
        self.client.set(Parameter::StatusPeriod, 0, if exact { 1.0 } else { REPORT_PERIOD })?;
        self.arm.begin(seed);
        begun = Instant::now();
        while self.status.state != State::Armed {
            self.exchange()?;
            self.supervise()?;
            self.require_progress(begun, "did not arm")?;
        }
        self.reaction = None;
        self.disturbed = false;
        self.arm.start();
        Ok(())
    }

    /// Runs a control step: sends an observation to the controller, and moves the arm by 20 ms.
    pub(crate) fn step(&mut self) -> Result<()> {
        self.exchange()?;
        self.arm.step();
        self.supervise()
    }

    /// Sends an observation, and listens until its action has come or is overdue.
    fn exchange(&mut self) -> Result<()> {
        let observation = self.arm.task.observe();
        let number = self.client.observe(&observation)?;
        self.log.observations.insert(number, observation.to_vec());
        let (begun, from) = (Instant::now(), self.time);
        self.disturbed |= from - self.sent > DELAYED_HOST;
        self.sent = from;
        loop {
            let passed = self.time - from;
            if passed >= TICKS.into() && (self.answered == Some(number) || passed >= ANSWER_TIMEOUT) {
                break;
            }
            self.listen()?;
            self.require_progress(begun, "was silent")?;
        }
        Ok(())
    }

    /// Fails if the controller has not done in time what it should have done since `begun`.
    fn require_progress(&self, begun: Instant, why: &str) -> Result<()> {
        ensure!(begun.elapsed() < HANG_TIMEOUT, "the controller {why} for {HANG_TIMEOUT:?}: {:?}", self.status);
        Ok(())
    }

    fn listen(&mut self) -> Result<()> {
        for event in self.client.events()? {
            if let Event::Status(status) = event {
                self.read = Some(status);
            }
        }
        self.line.heard().into_iter().for_each(|heard| self.hear(heard));
        Ok(())
    }

    /// Handles a message as sent by the board.
    fn hear(&mut self, Heard { event, dropped }: Heard) {
        if dropped > 0 {
            self.log.sent.push(Sent::Dropped);
        }
        match event {
            Event::Status(status) => self.reported(status),
            Event::Action { of, applied, values, .. } => {
                self.log.sent.push(Sent::Action { of, bits: bits(&values) });
                self.answered = Some(of);
                if applied && let Ok(values) = values.try_into() {
                    self.arm.target = values;
                    self.applied += 1;
                }
            }
            _ => {}
        }
    }

    /// Handles a status as sent by the board.
    fn reported(&mut self, status: Status) {
        let before = std::mem::replace(&mut self.status, status);
        let was_reset = status.ticks < before.ticks;
        self.log.sent.push(Sent::Status { token: status.token, was_reset, image: status.image });
        let passed = if was_reset { status.ticks } else { status.ticks - before.ticks };
        if was_reset {
            self.resets += 1;
            self.arm.state = State::Disarmed;
            self.good = (status.ticks, status.ticks);
        }
        self.time += u64::from(passed);
        (0..passed).for_each(|_| self.arm.tick());
        if status.counters.good != before.counters.good && !was_reset {
            self.good = (before.ticks, status.ticks);
        }
        if let (State::Latched, State::Armed, Some(fault)) = (status.state, self.arm.state, status.fault) {
            let (least, most) = ((before.ticks + 1).saturating_sub(self.good.1), status.ticks - self.good.0);
            self.reaction = Some(Reaction { fault, least, most });
            // Here QEMU's clock is the host's: this machine has delayed a tick. With a clock that counts instructions
            // no tick is too long; a test on targets asserts it.
            self.disturbed |= fault == Fault::Overrun;
        }
        self.arm.state = status.state;
    }

    /// Acts as the host: restores the settings that a reset cleared, and arms if the status says that the controller is
    /// ready and not armed.
    fn supervise(&mut self) -> Result<()> {
        let Some(status) = self.read.take() else { return Ok(()) };
        if status.ticks < self.read_ticks {
            set_up(&mut self.client)?;
        }
        self.read_ticks = status.ticks;
        if status.state == State::Latched && matches!(status.fault, Some(Fault::Overrun | Fault::Break)) {
            // Only this clears them.
            self.client.disarm()?;
        }
        if status.state != State::Armed && status.refusal.is_none() {
            // Refused if it has become stale meanwhile: the next status tells.
            let _ = self.client.arm();
            self.listen()?;
            self.read = None;
        }
        Ok(())
    }

    /// Waits until the board has counted all sent frames.
    pub(crate) fn settle(&mut self) -> Result<()> {
        while self.line.is_waiting() {
            self.listen()?;
        }
        // A status may be from before the last frames, unless the answer to a later request has come before it.
        self.client.get(Parameter::MaxAge, 0)?;
        self.client.status()?;
        self.listen()
    }

    /// Sends a piece of an image.
    pub(crate) fn push(&mut self, push: &mut Push<'_>) -> Result<()> {
        push.advance(&mut self.client)?;
        self.listen()
    }

    pub(crate) fn progress(&self, steps: usize) -> Progress {
        let distance = self.arm.outcome().final_error_m;
        Progress { steps, state: self.arm.state, distance, fastest: self.arm.fastest() }
    }

    /// Steps until the end of the episode, and passes each step and the controller's time to `seen`.
    pub(crate) fn finish(&mut self, from: usize, mut seen: impl FnMut(&Progress, u64)) -> Result<Outcome> {
        for step in from..EPISODE_STEPS {
            self.step()?;
            seen(&self.progress(step + 1), self.time);
        }
        Ok(self.arm.outcome())
    }
}
