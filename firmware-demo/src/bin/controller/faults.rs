//! The faults that end the program: each leaves a record, which the next start reports, and resets.

#[cfg(target_arch = "arm")]
mod arm;
#[cfg(actq_armv6m)]
mod armv6m;
#[cfg(all(target_arch = "arm", not(actq_armv6m)))]
mod armv7m;
#[cfg(target_arch = "riscv32")]
mod riscv;

use core::panic::PanicInfo;
use core::sync::atomic::{AtomicU32, Ordering};

use actq_boards::device;
use actq_controller::breadcrumb::{Record, WORDS};
use actq_firmware_support::kept::Kept;
use actq_link::code::Crash;

#[cfg(target_arch = "arm")]
use self::arm::reset;
#[cfg(actq_armv6m)]
use self::armv6m::enable;
#[cfg(all(target_arch = "arm", not(actq_armv6m)))]
use self::armv7m::enable;
#[cfg(target_arch = "riscv32")]
use self::riscv::{enable, reset};

#[unsafe(link_section = ".uninit.record")]
static RECORD: Kept<WORDS> = Kept::new();
#[unsafe(link_section = ".uninit.starts")]
static STARTS: Kept<1> = Kept::new();

/// Addresses of the stack's ends.
static BOTTOM: AtomicU32 = AtomicU32::new(0);
static TOP: AtomicU32 = AtomicU32::new(0);

/// Data for a record, besides the crash.
pub(crate) static TICKS: AtomicU32 = AtomicU32::new(0);
pub(crate) static MISSING: AtomicU32 = AtomicU32::new(0);
static CRASHES: AtomicU32 = AtomicU32::new(0);

/// Returns the record from before the reset, once; the count of crashes since power-on continues.
pub(crate) fn take_record() -> Option<Record> {
    let mut words = RECORD.read();
    let found = Record::from_words(&words);
    // A reported record has its checksum inverted.
    if let Some(sum) = words.last_mut() {
        *sum = !*sum;
    }
    let reported = Record::from_words(&words);
    CRASHES.store(found.or(reported).map_or(0, |record| record.count), Ordering::Relaxed);
    if found.is_some() {
        RECORD.write(words);
    }
    found
}

/// Counts a start; returns the number of starts since power-on, plus an arbitrary number.
pub(crate) fn count_start() -> u32 {
    let [starts] = STARTS.read().map(|starts| starts.wrapping_add(1));
    STARTS.write([starts]);
    starts
}

/// Makes a stack overflow a fault, so that it does not overwrite variables.
pub(crate) fn guard_stack() {
    // SAFETY: the start uses little of the stack, and nothing else uses the memory protection.
    let stack = unsafe { device::guard_stack() };
    BOTTOM.store(stack.start, Ordering::Relaxed);
    TOP.store(stack.end, Ordering::Relaxed);
    enable();
}

fn leave_record(crash: Crash, pc: u32, detail: u32) {
    let (ticks, count) = (TICKS.load(Ordering::Relaxed), CRASHES.load(Ordering::Relaxed).wrapping_add(1));
    RECORD.write(Record { crash, pc, detail, ticks, count }.to_words());
}

/// Ends the program with a record.
fn end(crash: Crash, pc: u32, detail: u32) -> ! {
    leave_record(crash, pc, detail);
    reset()
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    end(Crash::Panic, 0, info.location().map_or(0, |location| location.line()))
}
