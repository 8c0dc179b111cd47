//! How much stack a call takes.

use actq_firmware_support::stack::Room;

/// Words that are painted, and so the most that can be measured.
const WORDS: usize = 4 * 1024;

/// Runs `work` and gives how many bytes below this function's frame it wrote to.
#[inline(never)]
pub(crate) fn depth<T>(work: impl FnOnce() -> T) -> (T, usize) {
    // SAFETY: the firmware's stack is the end of RAM and has more than WORDS words left, and no interrupt is enabled.
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
