//! RTIC 2: the control tick is a hardware task, the head runs in `idle` in slices, and they share a resource whose lock
//! is a hardware priority.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
use actq_firmware_styles::main;

#[cfg(target_os = "none")]
#[rtic::app(device = actq_boards::device, peripherals = false)]
mod app {
    use core::convert::Infallible;
    use core::task::Poll;

    use actq_firmware_styles::{Held, Motors, SCRATCH, SLICE, Sensors, open, start_tick};
    use actq_firmware_support::host;
    use cortex_m::peripheral::SYST;

    #[shared]
    struct Shared {
        /// The last action, from the loop to the tick.
        action: Option<Held>,
    }

    #[local]
    struct Local {
        motors: Motors,
        timer: Option<SYST>,
    }

    #[init]
    fn init(cx: init::Context) -> (Shared, Local) {
        (Shared { action: None }, Local { motors: Motors::new(), timer: Some(cx.core.SYST) })
    }

    /// The control tick, which interrupts the loop.
    #[task(binds = SysTick, priority = 2, shared = [action], local = [motors])]
    fn tick(mut cx: tick::Context) {
        let held = cx.shared.action.lock(|action| {
            *action = action.and_then(Held::tick);
            *action
        });
        cx.local.motors.tick(held);
    }

    #[idle(shared = [action], local = [timer, scratch: [u32; SCRATCH] = [0; SCRATCH]])]
    fn idle(mut cx: idle::Context) -> ! {
        let mut publish = |held| cx.shared.action.lock(|action| *action = held);
        let _ = control(cx.local.timer, cx.local.scratch, &mut publish);
        publish(None);
        host::exit(false)
    }

    /// The loop; it ends if the head cannot be opened or a step fails.
    fn control(
        timer: &mut Option<SYST>,
        scratch: &mut [u32],
        publish: &mut impl FnMut(Option<Held>),
    ) -> Option<Infallible> {
        let mut head = open(scratch)?;
        let mut sensors = Sensors::new(head.image());
        start_tick(timer.take()?);
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
