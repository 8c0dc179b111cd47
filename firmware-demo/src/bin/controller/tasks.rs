//! The controller's tasks: start, control tick, and the loop below it. The core's module starts them (`app` with
//! RTIC, or `interrupts`).

use core::sync::atomic::Ordering;

use actq_boards::device::{self, FLASH_WHILE_ARMED, Parts, SCRATCH, Stage, Ticker, Uart, Watchdog};
use actq_boards::hal::{Source, Ticker as _, Watchdog as _};
use actq_boards::port::{Buffers, Port, Wire};
use actq_controller::endpoint::Facts;
use actq_controller::slots::Candidate;
use actq_controller::{Check, Endpoint, Guard, Output, Safety, Settings, Shared as _, scrub};
use actq_firmware_demo::deadline::BAUD;
use actq_firmware_demo::image;
#[cfg(feature = "foc")]
use actq_firmware_demo::motor::Motor as Actuator;
#[cfg(not(feature = "foc"))]
use actq_firmware_demo::output::Bridges as Actuator;
use actq_firmware_demo::running::Running;
use actq_firmware_demo::timeouts::TIMEOUTS;
use actq_firmware_demo::timing::{Rates, Timing};
use actq_firmware_demo::updates::Updates;
use actq_firmware_demo::work::{State, Work};
use actq_firmware_support::slot;
use actq_kernels::Image;
use actq_link::code::{Fault, Refusal};
use actq_link::frame;
use actq_link::report::{BUILT_IN, Breadcrumb};
use rtic_core::Mutex;

use crate::limits::{DEADLINE, MAX_AGE, STATUS_PERIOD, TICK_HZ};
use crate::locked::Locked;
use crate::log::info;
use crate::{faults, start};

/// Length of an observation in values.
const OBS: usize = start::LENGTHS[0];
pub(crate) const AXES: usize = start::LENGTHS[1];
/// Longest received frame: an observation or a piece of an image.
const RECEIVE_BYTES: usize = frame::bytes(if 4 * OBS > 516 { 4 * OBS } else { 516 });
/// Longest sent frame: a status or an action.
pub(crate) const SEND_BYTES: usize = frame::wire_bytes(if 4 * AXES + 5 > 46 { 4 * AXES + 5 } else { 46 });

/// Bytes of the port's queues: received bytes of a few ms, and several statuses or the longest frame.
pub(crate) const QUEUE: usize = if SEND_BYTES < 512 { 512 } else { (SEND_BYTES + 1).next_power_of_two() };

/// The serial port's interrupt.
pub(crate) type Serial = Wire<'static, Uart, QUEUE>;

/// The control tick.
pub(crate) struct Tick {
    actuator: Actuator<Stage>,
    ticker: Ticker,
    period: u32,
}

/// The loop below the tick.
pub(crate) struct Loop {
    port: Port<'static, QUEUE>,
    watchdog: Watchdog,
    rates: Rates,
    breadcrumb: Breadcrumb,
    build: u32,
}

/// Starts the board: interrupts are off. `kick` triggers the serial port's interrupt.
///
/// # Safety
///
/// Call it once.
pub(crate) unsafe fn start(buffers: &'static mut Buffers<QUEUE>, kick: fn()) -> (Safety<AXES>, Serial, Tick, Loop) {
    start::paint_stack();
    faults::guard_stack();
    let (record, starts) = (faults::take_record(), faults::count_start());
    // SAFETY: called once, as the caller promises, and nothing else has the board's peripherals.
    let Parts { clock, cause, uart, mut watchdog, stage, mut ticker } = unsafe { device::start(BAUD) };
    let breadcrumb = start::report(cause, record);
    info!("start {=u32}, reset cause {=u8}, {=u32} Hz", starts, breadcrumb.reset.code(), clock.hz);
    let image = Image::new_checked(start::built_in()).ok();
    let axes = image::axes(image.as_ref(), start::LIMITS, TICK_HZ as f32);
    // The axes are those of this image, whatever image runs.
    let build = image.as_ref().map_or(0, Image::crc);
    let mut safety = Safety::new(axes, DEADLINE, starts);
    safety.check(Check::Clock, clock.source == Source::Crystal);
    // The outcome counts later, with the final timeout.
    let _ = watchdog.start(TIMEOUTS.long);
    let (wire, port) = buffers.split(uart, kick);
    let period = clock.hz / TICK_HZ;
    ticker.start(period);
    let rates = Rates::new(clock.hz, TICK_HZ);
    #[cfg(feature = "foc")]
    let mut actuator = Actuator::new(stage, TICK_HZ);
    #[cfg(not(feature = "foc"))]
    let mut actuator = Actuator::new(stage);
    // A request may come before the first tick, which must not count as a fault of the hardware.
    let applied = actuator.apply(&[Output::Coast; AXES], safety.built_axes());
    safety.check(Check::Hardware, applied);
    let (tick, below) = (Tick { actuator, ticker, period }, Loop { port, watchdog, rates, breadcrumb, build });
    (safety, wire, tick, below)
}

impl Tick {
    /// Runs a tick.
    pub(crate) fn run(&mut self, mut safety: impl Mutex<T = Safety<AXES>>, mut timing: impl Mutex<T = Timing>) {
        let began = self.ticker.count();
        // Clears the end that triggered this tick.
        let _ = self.ticker.has_ended();
        let ticks = safety.lock(|safety| {
            let outputs = safety.tick();
            let applied = self.actuator.apply(&outputs, safety.built_axes());
            safety.check(Check::Hardware, applied);
            safety.ticks()
        });
        faults::TICKS.store(ticks, Ordering::Relaxed);
        let (ended, overrun) = (self.ticker.count(), self.ticker.has_ended());
        if overrun {
            safety.lock(|safety| safety.trip(Fault::Overrun));
        }
        timing.lock(|timing| timing.record(self.period, began, ended, overrun));
    }
}

impl Loop {
    /// Runs the loop.
    ///
    /// # Safety
    ///
    /// Call it once.
    pub(crate) unsafe fn run(
        &mut self,
        safety: impl Mutex<T = Safety<AXES>>,
        mut timing: impl Mutex<T = Timing>,
        scratch: &mut [u32; SCRATCH],
        out: &mut [u8; SEND_BYTES],
    ) -> ! {
        let Self { port, watchdog, rates, breadcrumb, build } = self;
        // SAFETY: called once, as the caller promises.
        let memory = unsafe { start::slots() };
        // SAFETY: called once, by the loop that feeds the watchdog.
        let flash = unsafe { device::flash(memory) };
        let bytes_of = |candidate: &Candidate| {
            // SAFETY: an update only writes to the slot that is not running, and to none while an image waits for its
            // test.
            unsafe { slot::mapped(memory, candidate.address, candidate.length) }.unwrap_or_default()
        };
        let (updates, running) = Updates::new(flash, start::authority(), *build, watchdog, |candidate, watchdog| {
            image::open(bytes_of(candidate), scratch, start::LENGTHS, watchdog).is_ok()
        });
        let mut bytes = running.as_ref().map_or_else(start::built_in, bytes_of);
        let facts = Facts { image: 0, slot: BUILT_IN, timing: Default::default(), breadcrumb: *breadcrumb };
        let settings = Settings { status_period: STATUS_PERIOD, flash_while_armed: FLASH_WHILE_ARMED, quiet: TICK_HZ };
        let endpoint = Endpoint::<OBS, RECEIVE_BYTES>::new(Guard::full(&[], MAX_AGE), facts, settings);
        let (safety, state) = (Locked(safety), State::default());
        let mut work =
            Work { port, watchdog, safety, endpoint, updates, rates: *rates, stack: start::stack, out, state };
        loop {
            // It reads the whole image before the check does, while the longer timeout holds.
            work.watchdog.feed();
            let sum = scrub::checksum(bytes);
            let head = image::open(bytes, scratch, start::LENGTHS, work.watchdog);
            let refusal = head.as_ref().err().copied();
            let image = head.as_ref().map_or(0, |(head, _)| head.image().crc());
            let mut running = head.ok().map(|head| Running::new(head, bytes, sum));
            let watched = work.watchdog.start(TIMEOUTS.turn);
            work.safety.with(|safety| {
                safety.check(Check::Watchdog, watched);
                safety.check(Check::Image, matches!(refusal, None | Some(Refusal::SelfTest)));
                safety.check(Check::SelfTest, refusal.is_none());
            });
            #[cfg(feature = "attention")]
            if let Some(running) = &mut running {
                running.refresh(&mut work.safety);
            }
            work.endpoint.facts.image = image;
            work.endpoint.facts.slot = work.updates.running().map_or(BUILT_IN, |slot| slot as u8);
            info!(
                "image {=u32:08x} of slot {=u8}, refusal {=u8}",
                work.endpoint.facts.image,
                work.endpoint.facts.slot,
                refusal.map_or(0, Refusal::code),
            );
            let candidate = loop {
                let times = timing.lock(|timing| *timing);
                if let Some(candidate) = work.turn(&mut running, &times) {
                    break candidate;
                }
                faults::MISSING.store(work.state.missing(), Ordering::Relaxed);
            };
            let _ = work.watchdog.start(TIMEOUTS.long);
            let new = bytes_of(&candidate);
            let outcome = image::open(new, scratch, start::LENGTHS, work.watchdog).map(drop);
            if work.updates.tested(outcome) {
                bytes = new;
            }
            // The head starts over.
            work.safety.with(Safety::renew);
        }
    }
}
