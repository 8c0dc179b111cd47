//! How deep the stack has gone: memory below the stack pointer is painted, and looked at later.

use cortex_m::register::msp;

const PAINT: u32 = 0x5a5a_a5a5;

/// The words of memory below an address that a stack grows into.
#[derive(Clone, Copy, Debug)]
pub struct Room {
    /// The address, in words.
    top: usize,
    words: usize,
}

impl Room {
    /// Below the stack pointer of the caller.
    ///
    /// # Safety
    ///
    /// The stack has room for as many words.
    #[inline(always)]
    pub unsafe fn below_here(words: usize) -> Self {
        Self { top: msp::read() as usize / 4, words }
    }

    /// Below the stack's begin.
    ///
    /// # Safety
    ///
    /// The stack has room for as many words.
    pub unsafe fn of_stack(words: usize) -> Self {
        unsafe extern "C" {
            static _stack_start: u32;
        }
        Self { top: (&raw const _stack_start) as usize / 4, words }
    }

    fn address(self, below: usize) -> *mut u32 {
        ((self.top - below) * 4) as *mut u32
    }

    /// Paints what no frame uses.
    ///
    /// # Safety
    ///
    /// No interrupt comes meanwhile.
    #[inline(always)]
    pub unsafe fn paint(self) {
        let in_use = self.top - msp::read() as usize / 4;
        for below in in_use + 1..=self.words {
            // SAFETY: memory of the stack, as whoever made this has promised, below its pointer, where nothing lives.
            unsafe { self.address(below).write_volatile(PAINT) };
        }
    }

    /// Bytes that were written to, up to the deepest.
    pub fn used(self) -> usize {
        // SAFETY: memory of the stack, as whoever made this has promised; volatile, for what was written there is none
        // of this function's.
        let painted = |below: &usize| unsafe { self.address(*below).read_volatile() } == PAINT;
        4 * (1..=self.words).rev().find(|below| !painted(below)).unwrap_or(0)
    }
}
