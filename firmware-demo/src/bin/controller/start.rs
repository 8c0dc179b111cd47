//! The start: the cause of the reset, the image, the stack.

use core::cell::Cell;

use actq_boards::device::WATCHDOG_NMI;
use actq_boards::hal::Cause;
use actq_controller::Limits;
use actq_controller::breadcrumb::Record;
use actq_firmware_support::slot;
use actq_firmware_support::stack::Room;
use actq_kernels::{ImageInfo, include_image};
use actq_link::code::{Crash, ResetCause};
use actq_link::report::Breadcrumb;

static BUILT_IN: &[u8] = include_image!(env!(
    "ACTQ_IMAGE",
    "set ACTQ_IMAGE to the absolute path of the image to build in; `cargo xtask firmware` does"
));

/// Lengths of an observation and of an action, from the built-in image. Every image that runs has the same lengths.
pub(crate) const LENGTHS: [usize; 2] = match ImageInfo::read(BUILT_IN) {
    Ok(info) => [info.obs_len, info.act_len],
    Err(_) => panic!("`include_image!` has checked the image"),
};

/// The build's limits of the axes, from the variable ACTQ_LIMITS: one for each axis, one for all, or none.
pub(crate) const LIMITS: &[Limits] = &include!(concat!(env!("OUT_DIR"), "/limits.rs"));
const _: () = assert!(
    LIMITS.len() < 2 || LIMITS.len() == LENGTHS[1],
    "ACTQ_LIMITS needs one entry, or one for each value of the image's actions"
);

/// Returns the image in the image slot, or else the built-in one. A build that requires signatures ignores the slot,
/// which has no signature.
pub(crate) fn built_in() -> &'static [u8] {
    let slot = if cfg!(feature = "signed") { None } else { slot::image() };
    slot.unwrap_or(BUILT_IN)
}

/// Returns the memory of the update slots; empty if a debugger put the running image into the same memory.
///
/// # Safety
///
/// Call it once.
pub(crate) unsafe fn slots() -> &'static [Cell<u8>] {
    // SAFETY: as the caller promises.
    let memory = unsafe { slot::updates() };
    let is_taken = memory.as_ptr_range().contains(&built_in().as_ptr().cast());
    if is_taken { &[] } else { memory }
}

/// Returns the authority over images from the link: it accepts every image.
#[cfg(not(feature = "signed"))]
pub(crate) fn authority() -> Option<actq_controller::slots::Anyone> {
    Some(actq_controller::slots::Anyone)
}

/// Returns the authority over images from the link: the build's key, which the build script has checked.
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

/// Returns the report of the reset's cause and of the last program's record.
pub(crate) fn report(cause: Cause, found: Option<Record>) -> Breadcrumb {
    let reset = match (cause, found.map(|record| record.crash)) {
        (Cause::Power, _) => ResetCause::Power,
        (Cause::Pin, _) => ResetCause::Pin,
        (Cause::Software, _) => ResetCause::Software,
        (Cause::Watchdog, _) => ResetCause::Watchdog,
        // The board's registers do not show the cause.
        (Cause::Unknown, Some(Crash::Watchdog)) if WATCHDOG_NMI => ResetCause::Watchdog,
        (Cause::Unknown, Some(_)) => ResetCause::Software,
        (Cause::Brownout, _) => ResetCause::Brownout,
        (Cause::Unknown, None) => ResetCause::Unknown,
    };
    Record::report(reset, found)
}

/// Painted words of stack: more than the program uses, fewer than any board has.
const STACK: usize = 2048;

fn room() -> Room {
    // SAFETY: every board's memory has that many words for the stack, which the linker script puts after all else.
    unsafe { Room::of_stack(STACK) }
}

/// Prepares [`stack`]. Call it before any interrupt is enabled.
pub(crate) fn paint_stack() {
    // SAFETY: no interrupt is enabled yet.
    unsafe { room().paint() }
}

/// Returns the most bytes of stack in use since the start.
pub(crate) fn stack() -> u32 {
    room().used() as u32
}
