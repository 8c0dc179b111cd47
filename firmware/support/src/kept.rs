//! Words in memory that a reset preserves, for messages from a program to the next start.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;

/// Words for a static in a section `.uninit`. They are arbitrary after power-on.
pub struct Kept<const WORDS: usize>(UnsafeCell<MaybeUninit<[u32; WORDS]>>);

// SAFETY: words are read and written one by one, volatile, on a processor with one core. A reader or writer that
// another writer interrupts may see words of both, which is all that this type promises.
unsafe impl<const WORDS: usize> Sync for Kept<WORDS> {}

impl<const WORDS: usize> Kept<WORDS> {
    /// Creates words with arbitrary content.
    #[expect(clippy::new_without_default, reason = "for statics, which Default cannot create")]
    pub const fn new() -> Self {
        Self(UnsafeCell::new(MaybeUninit::uninit()))
    }

    /// Returns the words.
    pub fn read(&self) -> [u32; WORDS] {
        // SAFETY: words of this program's memory, valid with any bits; volatile, because the program has not written
        // them.
        core::array::from_fn(|i| unsafe { self.0.get().cast::<u32>().wrapping_add(i).read_volatile() })
    }

    /// Sets the words.
    pub fn write(&self, words: [u32; WORDS]) {
        for (i, word) in words.into_iter().enumerate() {
            // SAFETY: within the words; volatile, because this program does not read them again.
            unsafe { self.0.get().cast::<u32>().wrapping_add(i).write_volatile(word) }
        }
    }
}
