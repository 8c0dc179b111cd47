//! The tasks as the interrupts of a RISC-V core, none of which interrupts another: the tick waits for the serial port's
//! handler, at most as long as its queues have bytes.

use core::ptr;
use core::sync::atomic::{AtomicPtr, Ordering};

use actq_boards::device::{self, SCRATCH};
use actq_boards::port::Buffers;
use actq_controller::Safety;
use actq_firmware_demo::timing::Timing;
use actq_firmware_support::machine::singleton;
use riscv::interrupt::Interrupt;
use rtic_core::{Exclusive, Mutex};

use crate::tasks::{AXES, QUEUE, SEND_BYTES, Serial, Tick, start};

/// The handlers' state. The loop shares `safety` and `timing`.
struct Interrupts {
    serial: Serial,
    tick: Tick,
    safety: Safety<AXES>,
    timing: Timing,
}

static INTERRUPTS: AtomicPtr<Interrupts> = AtomicPtr::new(ptr::null_mut());

/// Runs a handler with its state.
fn handle(handler: impl FnOnce(&mut Interrupts)) {
    // SAFETY: `main` never ends, so the state remains. No interrupt comes within another, or while the loop uses a part of
    // the state.
    if let Some(interrupts) = unsafe { INTERRUPTS.load(Ordering::Relaxed).as_mut() } {
        handler(interrupts);
    }
}

#[riscv_rt::core_interrupt(Interrupt::MachineTimer)]
fn on_timer() {
    handle(|Interrupts { tick, safety, timing, .. }| tick.run(Exclusive(safety), Exclusive(timing)));
}

#[riscv_rt::core_interrupt(Interrupt::MachineExternal)]
fn on_external() {
    device::on_external_interrupt(|| handle(|interrupts| interrupts.serial.on_interrupt()));
}

#[riscv_rt::core_interrupt(Interrupt::MachineSoft)]
fn on_software() {
    device::on_software_interrupt(|| handle(|interrupts| interrupts.serial.on_interrupt()));
}

/// A part of the handlers' state, which the loop uses without interrupts.
struct Resource<T>(*mut T);

impl<T> Mutex for Resource<T> {
    type T = T;

    fn lock<R>(&mut self, work: impl FnOnce(&mut T) -> R) -> R {
        // SAFETY: `main` makes one resource of each part, and without interrupts nothing else uses it.
        critical_section::with(|_| work(unsafe { &mut *self.0 }))
    }
}

#[riscv_rt::entry]
fn main() -> ! {
    let (Some(buffers), Some(scratch), Some(out)) = (
        singleton!(: Buffers<QUEUE> = Buffers::new()),
        singleton!(: [u32; SCRATCH] = [0; SCRATCH]),
        singleton!(: [u8; SEND_BYTES] = [0; SEND_BYTES]),
    ) else {
        device::reset()
    };
    // SAFETY: this function runs once.
    let (safety, serial, tick, mut below) = unsafe { start(buffers, device::pend) };
    let mut interrupts = Interrupts { serial, tick, safety, timing: Timing::default() };
    let interrupts = &raw mut interrupts;
    INTERRUPTS.store(interrupts, Ordering::Relaxed);
    // SAFETY: all interrupts have handlers, which have their state now. This function runs once.
    unsafe {
        riscv::interrupt::enable();
        let (safety, timing) = (&raw mut (*interrupts).safety, &raw mut (*interrupts).timing);
        below.run(Resource(safety), Resource(timing), scratch, out)
    }
}
