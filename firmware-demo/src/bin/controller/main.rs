//! The controller on a board, which a feature names: a control tick at high priority, the head in slices below it, a serial port, a
//! watchdog. `cargo xtask firmware` builds it.
//!
//! RTIC runs it: tick and loop share one value, whose lock is a priority that the hardware has, and what may delay the tick is known
//! when it is compiled. An executor of async tasks, as Embassy's, has its place where much is waited for; here nothing is.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("this is firmware: `cargo xtask firmware` builds it");
    std::process::exit(1);
}

#[cfg(target_os = "none")]
mod faults;
#[cfg(target_os = "none")]
mod log;
#[cfg(target_os = "none")]
mod start;

#[cfg(all(target_os = "none", feature = "defmt-rtt"))]
use defmt_rtt as _;
#[cfg(all(target_os = "none", feature = "defmt-semihosting"))]
use defmt_semihosting as _;

#[cfg(target_os = "none")]
#[rtic::app(device = actq_boards::device, peripherals = false)]
mod app {
    use actq_boards::device::{self, Interrupt, Parts, SCRATCH, Stage, Uart, Watchdog};
    use actq_boards::port::{Buffers, Port, Wire};
    use actq_boards::seams::{Cause, Clock, Watchdog as _};
    use actq_firmware_demo::application::Control as _;
    use actq_firmware_demo::console::Console;
    use actq_firmware_demo::off::Off;
    use actq_firmware_demo::output::Output;
    use actq_firmware_demo::timing::Timing;
    use actq_firmware_demo::work::Work;
    use actq_firmware_support::crumb;
    use cortex_m::peripheral::SYST;
    use cortex_m::peripheral::syst::SystClkSource;

    use crate::start;

    /// Ticks a second.
    const TICK_HZ: u32 = if cfg!(feature = "tick-8khz") { 8000 } else { 1000 };
    const BAUD: u32 = 115_200;
    /// Milliseconds without progress until the watchdog resets the board.
    const PATIENCE: u16 = 500;

    /// What the start found, for its report.
    pub(crate) struct Found {
        pub(crate) cause: Cause,
        pub(crate) crumb: Option<crumb::Crumb>,
        pub(crate) clock: Clock,
        pub(crate) watchdog: bool,
    }

    #[shared]
    struct Shared {
        output: Output,
        timing: Timing,
    }

    #[local]
    struct Local {
        wire: Wire<'static, Uart>,
        port: Port<'static>,
        watchdog: Watchdog,
        stage: Stage,
        control: Off,
        timer: SYST,
        period: u32,
        found: Found,
    }

    #[init(local = [buffers: Buffers = Buffers::new()])]
    fn init(cx: init::Context) -> (Shared, Local) {
        start::paint_stack();
        let crumb = crumb::take();
        // SAFETY: RTIC runs this once, and nothing else has the board's peripherals.
        let Parts { clock, cause, uart, mut watchdog, stage } = unsafe { device::start(BAUD) };
        let watchdog_runs = watchdog.start(PATIENCE);
        let (wire, port) = cx.local.buffers.split(uart, || rtic::pend(Interrupt::SERIAL));
        let mut timer = cx.core.SYST;
        let period = clock.hz / TICK_HZ;
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(period - 1);
        timer.clear_current();
        timer.enable_counter();
        timer.enable_interrupt();
        let found = Found { cause, crumb, clock, watchdog: watchdog_runs };
        let local = Local { wire, port, watchdog, stage, control: Off, timer, period, found };
        (Shared { output: Output::NONE, timing: Timing::default() }, local)
    }

    /// The control tick.
    #[task(binds = SysTick, priority = 3, shared = [output, timing], local = [control, stage, timer, period])]
    fn tick(cx: tick::Context) {
        let began = SYST::get_current();
        // What it says until here is the end that made this tick.
        let _ = cx.local.timer.has_wrapped();
        let (control, stage) = (cx.local.control, cx.local.stage);
        let (mut output, mut timing) = (cx.shared.output, cx.shared.timing);
        output.lock(|output| control.on_tick(output.get(), stage));
        let (ended, overrun) = (SYST::get_current(), cx.local.timer.has_wrapped());
        timing.lock(|timing| timing.note(*cx.local.period, began, ended, overrun));
    }

    /// The serial port.
    #[task(binds = SERIAL, priority = 2, local = [wire])]
    fn serial(cx: serial::Context) {
        cx.local.wire.on_interrupt();
    }

    /// The loop below.
    #[idle(shared = [output, timing], local = [port, watchdog, found, scratch: [u32; SCRATCH] = [0; SCRATCH]])]
    fn idle(cx: idle::Context) -> ! {
        let idle::LocalResources { port, watchdog, found, scratch, .. } = cx.local;
        let (mut output, mut timing) = (cx.shared.output, cx.shared.timing);
        let head = start::head(port, found, scratch);
        let application = Console::new(head.as_ref().map(|head| *head.image()));
        let mut work = Work::new(application, port, watchdog, head, start::stack);
        loop {
            let times = timing.lock(|timing| *timing);
            work.turn(times, |take| output.lock(take));
        }
    }
}
