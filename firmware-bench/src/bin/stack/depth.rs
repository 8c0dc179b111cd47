//! How much stack a call takes: the memory below the stack pointer is painted before it and looked at after it.

/// Words that are painted, and so the most that can be measured.
const WORDS: usize = 4 * 1024;
const PAINT: u32 = 0x5a5a_a5a5;

/// Runs `work` and gives how many bytes below this function's frame it wrote to.
#[inline(never)]
pub(crate) fn depth<T>(work: impl FnOnce() -> T) -> (T, usize) {
    let top = cortex_m::register::msp::read() as usize / 4;
    let address = |below: usize| ((top - below) * 4) as *mut u32;
    for below in 1..=WORDS {
        // SAFETY: the firmware's stack is the end of RAM and has more than WORDS words left; nothing lives below the stack
        // pointer, and no interrupt is enabled.
        unsafe { address(below).write_volatile(PAINT) };
    }
    let result = call(work);
    // SAFETY: as above.
    let painted = |below: &usize| unsafe { address(*below).read_volatile() } == PAINT;
    let words = (1..=WORDS).rev().find(|below| !painted(below)).unwrap_or(0);
    (result, 4 * words)
}

/// Keeps the frame of `work` below that of [`depth`].
#[inline(never)]
fn call<T>(work: impl FnOnce() -> T) -> T {
    work()
}
