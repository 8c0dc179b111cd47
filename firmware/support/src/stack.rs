//! The stack's high-water mark: paints the memory below the stack pointer and reads it later.

use crate::machine::stack_pointer;

const PAINT: u32 = 0x5a5a_a5a5;

/// Words of memory below an address, into which a stack grows.
#[derive(Clone, Copy, Debug)]
pub struct Room {
    /// The address in words.
    top: usize,
    words: usize,
}

impl Room {
    /// Covers the memory below the caller's stack pointer.
    ///
    /// # Safety
    ///
    /// The stack has room for `words` words.
    #[inline(always)]
    pub unsafe fn below_here(words: usize) -> Self {
        Self { top: stack_pointer() / 4, words }
    }

    /// Covers the memory below the stack's start.
    ///
    /// # Safety
    ///
    /// The stack has room for `words` words.
    pub unsafe fn of_stack(words: usize) -> Self {
        unsafe extern "C" {
            static _stack_start: u32;
        }
        Self { top: (&raw const _stack_start) as usize / 4, words }
    }

    fn address(self, below: usize) -> *mut u32 {
        ((self.top - below) * 4) as *mut u32
    }

    /// Paints the words that no frame uses.
    ///
    /// # Safety
    ///
    /// No interrupt occurs meanwhile.
    #[inline(always)]
    pub unsafe fn paint(self) {
        let in_use = self.top - stack_pointer() / 4;
        for below in in_use + 1..=self.words {
            // SAFETY: unused memory of the stack below its pointer, as the creator of this value promised.
            unsafe { self.address(below).write_volatile(PAINT) };
        }
    }

    /// Returns the bytes down to the deepest word written.
    pub fn used(self) -> usize {
        // SAFETY: memory of the stack, as the creator of this value promised; volatile, because other functions wrote
        // it.
        let painted = |below: &usize| unsafe { self.address(*below).read_volatile() } == PAINT;
        4 * (1..=self.words).rev().find(|below| !painted(below)).unwrap_or(0)
    }
}
