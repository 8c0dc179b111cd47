//! The controller on a board, selected by a feature: a control tick at high priority, the head in slices below it, the
//! link over a serial port, a watchdog. `cargo xtask firmware` builds it.
//!
//! RTIC runs it: tick and loop share values whose locks are hardware priorities, and all possible delays of the tick
//! are known at compile time. An async executor such as Embassy's suits programs that wait for many events; this one
//! waits for none.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("this is firmware: `cargo xtask firmware` builds it");
    std::process::exit(1);
}

#[cfg(target_os = "none")]
mod faults;
#[cfg(target_os = "none")]
mod locked;
#[cfg(target_os = "none")]
mod log;
#[cfg(target_os = "none")]
mod start;

#[cfg(all(target_os = "none", feature = "defmt-rtt"))]
use defmt_rtt as _;
#[cfg(all(target_os = "none", feature = "defmt-semihosting"))]
use defmt_semihosting as _;

/// The build's limits, which a host may only make stricter.
#[cfg(target_os = "none")]
mod limits {
    use core::ops::RangeInclusive;

    use actq_firmware_demo::deadline;

    /// Ticks per second.
    pub(crate) const TICK_HZ: u32 = deadline::tick_hz(cfg!(feature = "tick-8khz"));
    /// Allowed ticks without an observation, or without an action, before the safe action.
    pub(crate) const DEADLINE: RangeInclusive<u32> = deadline::allowed(TICK_HZ);
    /// Largest age of an observation, relative to the fastest one, in µs.
    pub(crate) const MAX_AGE: u32 = 500_000;
    /// Ticks between two status reports.
    pub(crate) const STATUS_PERIOD: u32 = TICK_HZ / 10;
}

#[cfg(target_os = "none")]
#[rtic::app(device = actq_boards::device, peripherals = false)]
mod app {
    use core::sync::atomic::Ordering;

    use actq_boards::device::{self, FLASH_WHILE_ARMED, Interrupt, Parts, SCRATCH, Stage, Uart, Watchdog};
    use actq_boards::hal::{Source, Watchdog as _};
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
    use cortex_m::peripheral::SYST;
    use cortex_m::peripheral::syst::SystClkSource;

    use crate::limits::{DEADLINE, MAX_AGE, STATUS_PERIOD, TICK_HZ};
    use crate::locked::Locked;
    use crate::log::info;
    use crate::{faults, start};

    /// Length of an observation in values.
    const OBS: usize = start::LENGTHS[0];
    const AXES: usize = start::LENGTHS[1];
    /// Longest received frame: an observation or a piece of an image.
    const RECEIVE_BYTES: usize = frame::bytes(if 4 * OBS > 516 { 4 * OBS } else { 516 });
    /// Longest sent frame: a status or an action.
    const SEND_BYTES: usize = frame::wire_bytes(if 4 * AXES + 5 > 46 { 4 * AXES + 5 } else { 46 });

    /// Bytes of the port's queues: received bytes of a few ms, and several statuses or the longest frame.
    const QUEUE: usize = if SEND_BYTES < 512 { 512 } else { (SEND_BYTES + 1).next_power_of_two() };

    #[shared]
    struct Shared {
        safety: Safety<AXES>,
        timing: Timing,
    }

    #[local]
    struct Local {
        wire: Wire<'static, Uart, QUEUE>,
        port: Port<'static, QUEUE>,
        watchdog: Watchdog,
        actuator: Actuator<Stage>,
        timer: SYST,
        period: u32,
        rates: Rates,
        breadcrumb: Breadcrumb,
        build: u32,
    }

    #[init(local = [buffers: Buffers<QUEUE> = Buffers::new()])]
    fn init(cx: init::Context) -> (Shared, Local) {
        start::paint_stack();
        let mut core = cx.core;
        faults::guard_stack(&mut core.SCB);
        let (record, starts) = (faults::take_record(), faults::count_start());
        // SAFETY: RTIC runs this once, and nothing else has the board's peripherals.
        let Parts { clock, cause, uart, mut watchdog, stage } = unsafe { device::start(BAUD) };
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
        let (wire, port) = cx.local.buffers.split(uart, || rtic::pend(Interrupt::SERIAL));
        let mut timer = core.SYST;
        let period = clock.hz / TICK_HZ;
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(period - 1);
        timer.clear_current();
        timer.enable_counter();
        timer.enable_interrupt();
        let rates = Rates::new(clock.hz, TICK_HZ);
        #[cfg(feature = "foc")]
        let mut actuator = Actuator::new(stage, TICK_HZ);
        #[cfg(not(feature = "foc"))]
        let mut actuator = Actuator::new(stage);
        // A request may come before the first tick, which must not count as a fault of the hardware.
        let applied = actuator.apply(&[Output::Coast; AXES], safety.built_axes());
        safety.check(Check::Hardware, applied);
        let local = Local { wire, port, watchdog, actuator, timer, period, rates, breadcrumb, build };
        (Shared { safety, timing: Timing::default() }, local)
    }

    /// The control tick.
    #[task(binds = SysTick, priority = 3, shared = [safety, timing], local = [actuator, timer, period])]
    fn tick(cx: tick::Context) {
        let began = SYST::get_current();
        // Clears the end that triggered this tick.
        let _ = cx.local.timer.has_wrapped();
        let (mut safety, mut timing) = (cx.shared.safety, cx.shared.timing);
        let ticks = safety.lock(|safety| {
            let outputs = safety.tick();
            let applied = cx.local.actuator.apply(&outputs, safety.built_axes());
            safety.check(Check::Hardware, applied);
            safety.ticks()
        });
        faults::TICKS.store(ticks, Ordering::Relaxed);
        let (ended, overrun) = (SYST::get_current(), cx.local.timer.has_wrapped());
        if overrun {
            safety.lock(|safety| safety.trip(Fault::Overrun));
        }
        timing.lock(|timing| timing.record(*cx.local.period, began, ended, overrun));
    }

    /// The serial port.
    #[task(binds = SERIAL, priority = 2, local = [wire])]
    fn serial(cx: serial::Context) {
        cx.local.wire.on_interrupt();
    }

    /// The loop below the tick.
    #[idle(shared = [safety, timing], local = [
        port, watchdog, rates, breadcrumb, build, scratch: [u32; SCRATCH] = [0; SCRATCH], out: [u8; SEND_BYTES] = [0; SEND_BYTES],
    ])]
    fn idle(cx: idle::Context) -> ! {
        let idle::LocalResources { port, watchdog, rates, breadcrumb, build, scratch, out, .. } = cx.local;
        let mut timing = cx.shared.timing;
        // SAFETY: RTIC runs this once.
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
        let (safety, state) = (Locked(cx.shared.safety), State::default());
        let mut work =
            Work { port, watchdog, safety, endpoint, updates, rates: *rates, stack: start::stack, out, state };
        loop {
            // It reads the whole image before the check does, while the longer timeout holds.
            work.watchdog.feed();
            let sum = scrub::checksum(bytes);
            let head = image::open(bytes, scratch, start::LENGTHS, work.watchdog);
            let refusal = head.as_ref().err().copied();
            let image = head.as_ref().map_or(0, |head| head.image().crc());
            let mut running = head.ok().map(|head| Running::new(head, bytes, sum));
            let watched = work.watchdog.start(TIMEOUTS.turn);
            work.safety.with(|safety| {
                safety.check(Check::Watchdog, watched);
                safety.check(Check::Image, matches!(refusal, None | Some(Refusal::SelfTest)));
                safety.check(Check::SelfTest, refusal.is_none());
            });
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
