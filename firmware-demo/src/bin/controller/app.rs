//! The tasks with RTIC, on Cortex-M.

#[rtic::app(device = actq_boards::device, peripherals = false)]
mod tasks {
    use actq_boards::device::{Interrupt, SCRATCH};
    use actq_boards::port::Buffers;
    use actq_controller::Safety;
    use actq_firmware_demo::timing::Timing;

    use crate::tasks::{AXES, Loop, QUEUE, SEND_BYTES, Serial, Tick, start};

    #[shared]
    struct Shared {
        safety: Safety<AXES>,
        timing: Timing,
    }

    #[local]
    struct Local {
        serial: Serial,
        tick: Tick,
        below: Loop,
    }

    #[init(local = [buffers: Buffers<QUEUE> = Buffers::new()])]
    fn init(cx: init::Context) -> (Shared, Local) {
        // SAFETY: RTIC runs this once.
        let (safety, serial, tick, below) = unsafe { start(cx.local.buffers, || rtic::pend(Interrupt::SERIAL)) };
        (Shared { safety, timing: Timing::default() }, Local { serial, tick, below })
    }

    /// The control tick. It has the highest priority of Armv6-M: there RTIC's locks mask interrupts, which the tick's
    /// exception is not, or all exceptions if a resource has this priority.
    #[task(binds = SysTick, priority = 4, shared = [safety, timing], local = [tick])]
    fn tick(cx: tick::Context) {
        cx.local.tick.run(cx.shared.safety, cx.shared.timing);
    }

    /// The serial port.
    #[task(binds = SERIAL, priority = 2, local = [serial])]
    fn serial(cx: serial::Context) {
        cx.local.serial.on_interrupt();
    }

    /// The loop below the tick.
    #[idle(shared = [safety, timing], local = [
        below, scratch: [u32; SCRATCH] = [0; SCRATCH], out: [u8; SEND_BYTES] = [0; SEND_BYTES],
    ])]
    fn idle(cx: idle::Context) -> ! {
        let idle::LocalResources { below, scratch, out, .. } = cx.local;
        // SAFETY: RTIC runs this once.
        unsafe { below.run(cx.shared.safety, cx.shared.timing, scratch, out) }
    }
}
