//! Words in memory that a reset leaves as they are: for what a program leaves to the start after its end.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;

/// Words for a static in a section `.uninit`. After power-on they are anything.
pub struct Kept<const WORDS: usize>(UnsafeCell<MaybeUninit<[u32; WORDS]>>);

// SAFETY: words are read and written one by one, volatile, on a processor with one core; whoever is interrupted in
// between by one who writes, too, may see words of both, which is all that is promised.
unsafe impl<const WORDS: usize> Sync for Kept<WORDS> {}

impl<const WORDS: usize> Kept<WORDS> {
    /// Words that are anything.
    #[expect(clippy::new_without_default, reason = "for statics, which Default cannot make")]
    pub const fn new() -> Self {
        Self(UnsafeCell::new(MaybeUninit::uninit()))
    }

    /// The words.
    pub fn read(&self) -> [u32; WORDS] {
        // SAFETY: words of this program's memory, whose bits are words, whatever they are; volatile, because the
        // program has not written them.
        core::array::from_fn(|i| unsafe { self.0.get().cast::<u32>().wrapping_add(i).read_volatile() })
    }

    /// Sets the words.
    pub fn write(&self, words: [u32; WORDS]) {
        for (i, word) in words.into_iter().enumerate() {
            // SAFETY: as many words as there are; volatile, because nothing here reads them again.
            unsafe { self.0.get().cast::<u32>().wrapping_add(i).write_volatile(word) }
        }
    }
}
