//! A queue of bytes with one writer and one reader, one of which may be an interrupt. Nothing in it can panic, which
//! heapless's queues cannot say of their views, and an application without the machinery of panics needs.

use core::sync::atomic::{AtomicU8, AtomicUsize, Ordering};

/// A queue of at most `LEN` bytes.
#[derive(Debug)]
pub(crate) struct Ring<const LEN: usize> {
    bytes: [AtomicU8; LEN],
    /// Bytes that were ever put in, and taken out, modulo 2^32. `LEN` is a power of two, so the remainder goes on over
    /// the end.
    put: AtomicUsize,
    taken: AtomicUsize,
}

impl<const LEN: usize> Ring<LEN> {
    pub(crate) const fn new() -> Self {
        const { assert!(LEN.is_power_of_two()) };
        Self { bytes: [const { AtomicU8::new(0) }; LEN], put: AtomicUsize::new(0), taken: AtomicUsize::new(0) }
    }

    /// Bytes that wait.
    pub(crate) fn len(&self) -> usize {
        self.put.load(Ordering::Acquire).wrapping_sub(self.taken.load(Ordering::Acquire))
    }

    /// Puts a byte in; false where there is no room. For the writer.
    pub(crate) fn put(&self, byte: u8) -> bool {
        let put = self.put.load(Ordering::Relaxed);
        let (true, Some(place)) = (self.len() < LEN, self.bytes.get(put % LEN)) else { return false };
        place.store(byte, Ordering::Relaxed);
        self.put.store(put.wrapping_add(1), Ordering::Release);
        true
    }

    /// The byte that comes next, which stays. For the reader.
    pub(crate) fn peek(&self) -> Option<u8> {
        let place = self.bytes.get(self.taken.load(Ordering::Relaxed) % LEN)?;
        (self.len() > 0).then(|| place.load(Ordering::Relaxed))
    }

    /// Takes the byte that comes next. For the reader.
    pub(crate) fn take(&self) -> Option<u8> {
        let byte = self.peek()?;
        self.taken.store(self.taken.load(Ordering::Relaxed).wrapping_add(1), Ordering::Release);
        Some(byte)
    }
}
