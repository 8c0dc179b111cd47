//! What ends the program: each leaves a record, which the next start tells, and resets.

use core::arch::naked_asm;
use core::panic::PanicInfo;
use core::sync::atomic::{AtomicU32, Ordering};

use actq_boards::device::WATCHDOG_NMI;
use actq_controller::breadcrumb::{Record, WORDS};
use actq_firmware_support::kept::Kept;
use actq_link::code::Crash;
use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, exception};

#[unsafe(link_section = ".uninit.record")]
static RECORD: Kept<WORDS> = Kept::new();
#[unsafe(link_section = ".uninit.starts")]
static STARTS: Kept<1> = Kept::new();

/// What a record tells besides the crash.
pub(crate) static TICKS: AtomicU32 = AtomicU32::new(0);
pub(crate) static MISSING: AtomicU32 = AtomicU32::new(0);
static CRASHES: AtomicU32 = AtomicU32::new(0);

/// What the program before the reset has left, once; the crashes since power-on are counted on.
pub(crate) fn found() -> Option<Record> {
    let mut words = RECORD.read();
    let found = Record::from_words(&words);
    // One that was told has its checksum inverted.
    if let Some(sum) = words.last_mut() {
        *sum = !*sum;
    }
    let told = Record::from_words(&words);
    CRASHES.store(found.or(told).map_or(0, |record| record.count), Ordering::Relaxed);
    if found.is_some() {
        RECORD.write(words);
    }
    found
}

/// Starts since power-on, plus any number.
pub(crate) fn starts() -> u32 {
    let [starts] = STARTS.read().map(|starts| starts.wrapping_add(1));
    STARTS.write([starts]);
    starts
}

fn leave(crash: Crash, pc: u32, detail: u32) {
    let (ticks, count) = (TICKS.load(Ordering::Relaxed), CRASHES.load(Ordering::Relaxed).wrapping_add(1));
    RECORD.write(Record { crash, pc, detail, ticks, count }.to_words());
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    leave(Crash::Panic, 0, info.location().map_or(0, |location| location.line()));
    SCB::sys_reset()
}

#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    // SAFETY: reading it changes nothing.
    let status = unsafe { (*SCB::PTR).cfsr.read() };
    leave(Crash::HardFault, frame.pc(), status);
    SCB::sys_reset()
}

/// The non-maskable interrupt, where a board has a reason for it: it passes what the core has stacked on.
///
/// # Safety
///
/// For the vector table alone.
#[unsafe(naked)]
#[unsafe(no_mangle)]
unsafe extern "C" fn NonMaskableInt() {
    naked_asm!("mrs r0, msp", "b {then}", then = sym non_maskable)
}

extern "C" fn non_maskable(frame: &ExceptionFrame) -> ! {
    if WATCHDOG_NMI {
        leave(Crash::Watchdog, frame.pc(), MISSING.load(Ordering::Relaxed));
        // For the reset that the watchdog makes.
        loop {
            cortex_m::asm::nop();
        }
    }
    leave(Crash::HardFault, frame.pc(), 0);
    SCB::sys_reset()
}
