//! The stack use of a call.

use actq_firmware_support::stack::Room;

/// Painted words, which is the most that can be measured.
const WORDS: usize = 4 * 1024;

/// Runs `work` and returns the number of bytes below this function's frame that it wrote to.
#[inline(never)]
pub(crate) fn depth<T>(work: impl FnOnce() -> T) -> (T, usize) {
    // SAFETY: the firmware's stack is at the end of RAM with more than WORDS free words, and no interrupt is enabled.
    let room = unsafe { Room::below_here(WORDS) };
    // SAFETY: as above.
    unsafe { room.paint() };
    let result = call(work);
    (result, room.used())
}

/// Keeps the frame of `work` below that of [`depth`].
#[inline(never)]
fn call<T>(work: impl FnOnce() -> T) -> T {
    work()
}
