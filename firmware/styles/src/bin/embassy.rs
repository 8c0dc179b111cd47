//! Embassy: the control tick is a task of an interrupt executor, the head a task of the thread executor, which runs
//! other tasks between slices. Embassy has no timer for this board; where it has one, use an `embassy_time::Ticker`
//! instead of the timer's signal.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
use actq_firmware_styles::main;

#[cfg(target_os = "none")]
mod firmware {
    use core::convert::Infallible;
    use core::task::Poll;

    use actq_boards::device::{Interrupt, interrupt};
    use actq_firmware_styles::{Held, Motors, SCRATCH, SLICE, Sensors, open, start_tick};
    use actq_firmware_support::host;
    use cortex_m::{Peripherals, singleton};
    use embassy_executor::{InterruptExecutor, Spawner};
    use embassy_futures::yield_now;
    use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
    use embassy_sync::signal::Signal;

    static CONTROL: InterruptExecutor = InterruptExecutor::new();
    static TICK: Signal<CriticalSectionRawMutex, ()> = Signal::new();
    /// The newest action, or none after an error, from the head to the tick.
    static ACTION: Signal<CriticalSectionRawMutex, Option<Held>> = Signal::new();

    #[embassy_executor::main(entry = "cortex_m_rt::entry")]
    async fn main(_below: Spawner) {
        // An otherwise unused interrupt, with a higher priority than the thread.
        CONTROL.start(Interrupt::SERIAL).spawn(tick().expect("the first task"));
        let _ = control().await;
        ACTION.signal(None);
        host::exit(false)
    }

    #[cortex_m_rt::exception]
    fn SysTick() {
        TICK.signal(());
    }

    #[cortex_m_rt::interrupt]
    fn SERIAL() {
        // SAFETY: this is the executor's interrupt, which its start enabled.
        unsafe { CONTROL.on_interrupt() }
    }

    /// The control tick, which interrupts the tasks of the thread.
    #[embassy_executor::task]
    async fn tick() {
        let (mut motors, mut held) = (Motors::new(), None::<Held>);
        loop {
            TICK.wait().await;
            held = ACTION.try_take().unwrap_or(held).and_then(Held::tick);
            motors.tick(held);
        }
    }

    /// The head's task; it ends if the head cannot be opened or a step fails.
    async fn control() -> Option<Infallible> {
        let mut head = open(singleton!(: [u32; SCRATCH] = [0; SCRATCH])?)?;
        let mut sensors = Sensors::new(head.image());
        start_tick(Peripherals::take()?.SYST);
        loop {
            head.begin(&sensors.wait().await).ok()?;
            let action = loop {
                if let Poll::Ready(action) = head.poll(SLICE).ok()? {
                    break action.try_into().ok()?;
                }
                // Other tasks wait at most for one slice.
                yield_now().await;
            };
            ACTION.signal(Some(Held::new(action)));
        }
    }
}
