//! A bare loop: the control tick is an exception handler, the head runs below it in slices, and they share data in a
//! critical section.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
use actq_firmware_styles::main;

#[cfg(target_os = "none")]
mod firmware {
    use core::cell::Cell;
    use core::convert::Infallible;
    use core::task::Poll;

    use actq_firmware_styles::{Held, Motors, SCRATCH, SLICE, Sensors, open, start_tick};
    use actq_firmware_support::host;
    use cortex_m::peripheral::SYST;
    use cortex_m::{Peripherals, singleton};
    use cortex_m_rt::{entry, exception};
    use critical_section::Mutex;

    /// The last action, from the loop to the tick.
    static ACTION: Mutex<Cell<Option<Held>>> = Mutex::new(Cell::new(None));

    #[entry]
    fn main() -> ! {
        let (peripherals, scratch) = (Peripherals::take(), singleton!(: [u32; SCRATCH] = [0; SCRATCH]));
        if let (Some(peripherals), Some(scratch)) = (peripherals, scratch) {
            let _ = control(peripherals.SYST, scratch);
            publish(None);
        }
        host::exit(false)
    }

    /// The control tick, which interrupts the loop.
    #[exception]
    fn SysTick() {
        static mut MOTORS: Motors = Motors::new();
        let held = critical_section::with(|cs| ACTION.borrow(cs).get()).and_then(Held::tick);
        publish(held);
        MOTORS.tick(held);
    }

    fn publish(held: Option<Held>) {
        critical_section::with(|cs| ACTION.borrow(cs).set(held));
    }

    /// The loop; it ends if the head cannot be opened or a step fails.
    fn control(timer: SYST, scratch: &mut [u32]) -> Option<Infallible> {
        let mut head = open(scratch)?;
        let mut sensors = Sensors::new(head.image());
        start_tick(timer);
        loop {
            let Some(observation) = sensors.read() else { continue };
            head.begin(&observation).ok()?;
            let action = loop {
                // Other work of the loop belongs here: it waits at most for one slice.
                if let Poll::Ready(action) = head.poll(SLICE).ok()? {
                    break action.try_into().ok()?;
                }
            };
            publish(Some(Held::new(action)));
        }
    }
}
