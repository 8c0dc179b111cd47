//! The faults that end the program: each leaves a record, which the next start reports, and resets.

use core::arch::naked_asm;
use core::panic::PanicInfo;
use core::sync::atomic::{AtomicU32, Ordering};

use actq_boards::device::{self, WATCHDOG_NMI};
use actq_controller::breadcrumb::{Record, WORDS};
use actq_firmware_demo::trace::program_counter;
use actq_firmware_support::kept::Kept;
use actq_link::code::Crash;
use cortex_m::peripheral::SCB;
use cortex_m::peripheral::scb::Exception;
use cortex_m_rt::ExceptionFrame;

#[unsafe(link_section = ".uninit.record")]
static RECORD: Kept<WORDS> = Kept::new();
#[unsafe(link_section = ".uninit.starts")]
static STARTS: Kept<1> = Kept::new();

/// Address of the configurable fault status register.
const CFSR: u32 = 0xe000_ed28;
/// Its bits for a stack overflow. STACKING: the core could not stack. ACCESS: the program touched the guard, the only
/// memory that the memory protection unit forbids. LIMIT: the pointer would have passed its limit (Armv8-M).
const STACKING: u32 = 1 << 4;
const ACCESS: u32 = 1 << 1;
const LIMIT: u32 = 1 << 20;
/// Bit of EXC_RETURN that is 1 if the exception frame has no floating-point registers: 8 words instead of 26.
const BASIC_FRAME: u32 = 1 << 4;

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
pub(crate) fn guard_stack(scb: &mut SCB) {
    // SAFETY: the start uses little of the stack, and nothing else uses the memory protection unit.
    let stack = unsafe { device::guard_stack() };
    BOTTOM.store(stack.start, Ordering::Relaxed);
    TOP.store(stack.end, Ordering::Relaxed);
    scb.enable(Exception::MemoryManagement);
    scb.enable(Exception::UsageFault);
}

fn leave_record(crash: Crash, pc: u32, detail: u32) {
    let (ticks, count) = (TICKS.load(Ordering::Relaxed), CRASHES.load(Ordering::Relaxed).wrapping_add(1));
    RECORD.write(Record { crash, pc, detail, ticks, count }.to_words());
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    leave_record(Crash::Panic, 0, info.location().map_or(0, |location| location.line()));
    SCB::sys_reset()
}

/// Handles faults. After a stack overflow it first resets the stack pointer to the stack's start. It passes on the
/// exception frame, or its place if the core could not stack it.
///
/// # Safety
///
/// Only for the vector table.
#[unsafe(naked)]
#[unsafe(no_mangle)]
unsafe extern "C" fn HardFault() {
    naked_asm!(
        "mrs  r0, msp",
        "movw r1, #:lower16:{status}",
        "movt r1, #:upper16:{status}",
        "ldr  r1, [r1]",
        "movw r2, #:lower16:{overflown}",
        "movt r2, #:upper16:{overflown}",
        "tst  r1, r2",
        "beq  {other}",
        "movw r2, #:lower16:_stack_start",
        "movt r2, #:upper16:_stack_start",
        "msr  msp, r2",
        "mov  r2, lr",
        "b    {overflow}",
        status = const CFSR,
        overflown = const STACKING | ACCESS | LIMIT,
        other = sym other,
        overflow = sym overflow,
    )
}

/// Handles faults of the memory protection unit: [`HardFault`] distinguishes them.
///
/// # Safety
///
/// Only for the vector table.
#[unsafe(naked)]
#[unsafe(no_mangle)]
unsafe extern "C" fn MemoryManagement() {
    naked_asm!("b {fault}", fault = sym HardFault)
}

/// Handles usage faults, such as the stack limit's, as [`MemoryManagement`] does.
///
/// # Safety
///
/// Only for the vector table.
#[unsafe(naked)]
#[unsafe(no_mangle)]
unsafe extern "C" fn UsageFault() {
    naked_asm!("b {fault}", fault = sym HardFault)
}

extern "C" fn other(frame: &ExceptionFrame, status: u32) -> ! {
    leave_record(Crash::HardFault, frame.pc(), status);
    SCB::sys_reset()
}

/// Leaves the record of a stack overflow: `pointer` is the stack's at the entry of the fault, and `exc_return` the link
/// register.
extern "C" fn overflow(pointer: u32, status: u32, exc_return: u32) -> ! {
    unsafe extern "C" {
        static __stext: u16;
        static __etext: u16;
    }
    let code = (&raw const __stext) as u32..(&raw const __etext) as u32;
    let half = |address: u32| {
        // SAFETY: an even address within the code.
        code.contains(&address).then(|| unsafe { (address as *const u16).read() })
    };
    let [bottom, top] = [&BOTTOM, &TOP].map(|address| address.load(Ordering::Relaxed));
    // A frame that could not be stacked lowers the pointer all the same (Arm DDI 0403E, B1.5.6, PushStack). The words
    // below the pointer of before are what earlier calls left there, with return addresses of theirs.
    let frame = if exc_return & BASIC_FRAME == 0 { 26 * 4 } else { 8 * 4 };
    let lowered = if status & STACKING == 0 { 0 } else { frame };
    let words = (pointer.wrapping_add(lowered).max(bottom)..top).step_by(4);
    // SAFETY: readable words of the stack: its pointer and its ends are multiples of 4.
    let words = words.map(|address| unsafe { (address as *const u32).read_volatile() });
    // If the core could not stack, Armv7-M sets a bit, and Armv8-M leaves the pointer at the limit.
    let is_stacked = status & STACKING == 0 && pointer > bottom;
    leave_record(Crash::StackOverflow, program_counter(words, is_stacked, half).unwrap_or(0), status);
    SCB::sys_reset()
}

/// Handles the non-maskable interrupt, for boards that use it: passes the exception frame on.
///
/// # Safety
///
/// Only for the vector table.
#[unsafe(naked)]
#[unsafe(no_mangle)]
unsafe extern "C" fn NonMaskableInt() {
    naked_asm!("mrs r0, msp", "b {then}", then = sym non_maskable)
}

extern "C" fn non_maskable(frame: &ExceptionFrame) -> ! {
    if WATCHDOG_NMI {
        leave_record(Crash::Watchdog, frame.pc(), MISSING.load(Ordering::Relaxed));
        // Wait for the watchdog's reset.
        loop {
            cortex_m::asm::nop();
        }
    }
    leave_record(Crash::HardFault, frame.pc(), 0);
    SCB::sys_reset()
}
