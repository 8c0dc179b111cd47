//! What the start finds: the cause of the reset, the image, the stack.

use core::cell::Cell;

use actq_boards::device::WATCHDOG_NMI;
use actq_boards::seams::Cause;
use actq_controller::Limits;
use actq_controller::breadcrumb::Record;
use actq_firmware_demo::image::lengths;
use actq_firmware_support::slot;
use actq_firmware_support::stack::Room;
use actq_link::code::{Crash, ResetCause};
use actq_link::report::Breadcrumb;

/// Includes a file at an address that is a multiple of 4.
#[repr(C, align(4))]
struct Aligned<T: ?Sized>(T);
static BUILT_IN: &Aligned<[u8]> = &Aligned(*include_bytes!(env!(
    "ACTQ_IMAGE",
    "set ACTQ_IMAGE to the absolute path of the image to build in; `cargo xtask firmware` does"
)));

/// Values of an observation and of an action: those of the image that is built in. Every image that runs has as many.
pub(crate) const LENGTHS: [usize; 2] = lengths(&BUILT_IN.0);

/// Limits of the axes by the build, from the variable ACTQ_LIMITS: one for each, one for all, or none.
pub(crate) const LIMITS: &[Limits] = &include!(concat!(env!("OUT_DIR"), "/limits.rs"));
const _: () = assert!(
    LIMITS.len() < 2 || LIMITS.len() == LENGTHS[1],
    "ACTQ_LIMITS has neither one entry nor one for each of the image's actions"
);

/// The image in the image slot, or the one that is built in. A build that asks for signatures does not look at the
/// slot, where none is.
pub(crate) fn built_in() -> &'static [u8] {
    let slot = if cfg!(feature = "signed") { None } else { slot::image() };
    slot.unwrap_or(&BUILT_IN.0)
}

/// The memory of the slots for updates; none where the image that a debugger has put into the same memory is the one
/// that runs.
///
/// # Safety
///
/// To be called once.
pub(crate) unsafe fn slots() -> &'static [Cell<u8>] {
    // SAFETY: as the caller promises.
    let memory = unsafe { slot::updates() };
    let is_taken = memory.as_ptr_range().contains(&built_in().as_ptr().cast());
    if is_taken { &[] } else { memory }
}

/// Whose images the link may bring: anyone's.
#[cfg(not(feature = "signed"))]
pub(crate) fn authority() -> Option<actq_controller::slots::Anyone> {
    Some(actq_controller::slots::Anyone)
}

/// Whose images the link may bring: those of the build's key. The build script has seen that it is one.
#[cfg(feature = "signed")]
pub(crate) fn authority() -> Option<actq_controller::slots::Key> {
    const KEY: [u8; 32] = match actq_controller::slots::Key::parse(env!(
        "ACTQ_PUBLIC_KEY",
        "set ACTQ_PUBLIC_KEY to the public key's 64 hexadecimal digits, which `actq keygen` prints; `cargo xtask firmware --key` does"
    )) {
        Some(key) => key,
        None => panic!("ACTQ_PUBLIC_KEY is not 64 hexadecimal digits; `actq keygen` prints them"),
    };
    actq_controller::slots::Key::new(&KEY).ok()
}

/// Why the processor started, and what the program before has left.
pub(crate) fn report(cause: Cause, found: Option<Record>) -> Breadcrumb {
    let reset = match (cause, found.map(|record| record.crash)) {
        (Cause::Power, _) => ResetCause::Power,
        (Cause::Pin, _) => ResetCause::Pin,
        (Cause::Software, _) => ResetCause::Software,
        (Cause::Watchdog, _) => ResetCause::Watchdog,
        // The board tells nothing itself.
        (Cause::Unknown, Some(Crash::Watchdog)) if WATCHDOG_NMI => ResetCause::Watchdog,
        (Cause::Unknown, Some(_)) => ResetCause::Software,
        (Cause::Unknown, None) => ResetCause::Unknown,
    };
    Record::report(reset, found)
}

/// Words of stack that are painted: more than the program takes, less than any board has.
const STACK: usize = 2048;

fn room() -> Room {
    // SAFETY: every board's memory leaves the stack as many words; the linker's script puts it behind all else.
    unsafe { Room::of_stack(STACK) }
}

/// Prepares [`stack`]. To be called before any interrupt comes.
pub(crate) fn paint_stack() {
    // SAFETY: no interrupt comes yet.
    unsafe { room().paint() }
}

/// Bytes of stack that were in use at most.
pub(crate) fn stack() -> u32 {
    room().used() as u32
}
