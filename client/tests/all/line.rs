//! A line that damages, loses and repeats frames.

use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng as _, SeedableRng as _};

/// One direction of a line.
pub(super) struct Line {
    random: Pcg64Mcg,
    /// Faults in a thousand frames.
    faults: u64,
    frame: Vec<u8>,
}

impl Line {
    pub(super) fn new(seed: u64, faults: u64) -> Self {
        Self { random: Pcg64Mcg::seed_from_u64(seed), faults, frame: Vec::new() }
    }

    /// Returns the bytes that arrive when `bytes` are sent.
    pub(super) fn carry(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut out = Vec::new();
        for byte in bytes {
            self.frame.push(*byte);
            if *byte == 0 {
                let frame = std::mem::take(&mut self.frame);
                out.extend(self.damage(frame));
            }
        }
        out
    }

    fn damage(&mut self, mut frame: Vec<u8>) -> Vec<u8> {
        if self.random.next_u64() % 1000 >= self.faults {
            return frame;
        }
        let at = (self.random.next_u64() % frame.len() as u64) as usize;
        match self.random.next_u64() % 5 {
            0 => frame.clear(),
            1 => frame.truncate(at),
            2 => frame[at] ^= 1 << (at % 8),
            3 => frame.extend(frame.clone()),
            _ => frame.insert(at, 0x55),
        }
        frame
    }
}
