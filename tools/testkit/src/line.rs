//! A serial line that loses, damages, delays and repeats frames.

use std::collections::HashSet;

use crate::random::Random;

/// Frames that a line remembers and can send again.
const REMEMBERED: usize = 1000;

/// A fault of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Fault {
    /// The frame is lost.
    Loss,
    /// The frame comes twice.
    Duplicate,
    /// The frame comes after the next one.
    Swap,
    /// The end of the frame is lost.
    Truncate,
    /// One to four bits are wrong.
    FlipBits,
    /// Up to nine bytes in a row are wrong.
    Burst,
    /// Garbage comes before the frame.
    Garbage,
    /// An old frame comes before this one.
    Replay,
    /// The zero between two frames is lost.
    Join,
    /// Bytes of the frame are sent twice.
    Stutter,
}

impl Fault {
    /// Every fault.
    pub const ALL: [Self; 10] = [
        Self::Loss,
        Self::Duplicate,
        Self::Swap,
        Self::Truncate,
        Self::FlipBits,
        Self::Burst,
        Self::Garbage,
        Self::Replay,
        Self::Join,
        Self::Stutter,
    ];
}

/// One direction of a line. A zero ends each frame.
#[derive(Clone, Debug)]
pub struct Line {
    random: Random,
    /// Faults in a thousand frames.
    rate: usize,
    partial: Vec<u8>,
    seen: Vec<Vec<u8>>,
    delayed: Vec<u8>,
    /// Faults that have happened so far.
    pub faults: HashSet<Fault>,
    /// Frames that came out undamaged and in their turn.
    pub whole: u32,
}

impl Line {
    /// Creates a line with `rate` faults in a thousand frames.
    pub fn new(seed: u64, rate: usize) -> Self {
        let (random, faults) = (Random::new(seed), HashSet::new());
        Self { random, rate, partial: Vec::new(), seen: Vec::new(), delayed: Vec::new(), faults, whole: 0 }
    }

    /// Sends `bytes`, and returns the bytes that come out for the frames that they end.
    pub fn carry(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut out = Vec::new();
        for byte in bytes {
            self.partial.push(*byte);
            match (byte, self.partial.len()) {
                // A zero alone is no frame.
                (0, 1) => out.append(&mut self.partial),
                (0, _) => {
                    let frame = std::mem::take(&mut self.partial);
                    self.send(frame, &mut out);
                }
                _ => {}
            }
        }
        out
    }

    /// Returns a frame that went in before; nothing if the line has seen too few.
    pub fn replayed(&mut self) -> &[u8] {
        let at = self.random.below(REMEMBERED);
        self.seen.get(at).map_or(&[], Vec::as_slice)
    }

    fn send(&mut self, frame: Vec<u8>, out: &mut Vec<u8>) {
        let delayed = std::mem::take(&mut self.delayed);
        let fault = (self.random.below(1000) < self.rate).then(|| Fault::ALL[self.random.below(Fault::ALL.len())]);
        self.faults.extend(fault);
        let whole = match fault {
            None => {
                out.extend(&frame);
                true
            }
            Some(fault) => self.fail(fault, &frame, out),
        };
        self.whole += u32::from(whole);
        out.extend(delayed);
        match self.seen.len() < REMEMBERED {
            true => self.seen.push(frame),
            false => self.seen[self.random.below(REMEMBERED)] = frame,
        }
    }

    /// Sends a frame with a fault, and returns `true` if it still comes out whole.
    fn fail(&mut self, fault: Fault, frame: &[u8], out: &mut Vec<u8>) -> bool {
        let at = self.random.below(frame.len());
        let mut damaged = frame.to_vec();
        match fault {
            Fault::Loss => damaged.clear(),
            Fault::Duplicate => damaged.extend(frame),
            Fault::Swap => self.delayed = std::mem::take(&mut damaged),
            Fault::Truncate => damaged.truncate(at),
            Fault::FlipBits => {
                damaged[at] ^= 1 << self.random.below(8);
                for _ in 0..self.random.below(4) {
                    damaged[self.random.below(frame.len())] ^= 1 << self.random.below(8);
                }
            }
            Fault::Burst => damaged.iter_mut().skip(at).take(1 + at % 9).for_each(|byte| *byte = self.random.byte()),
            Fault::Garbage => damaged = [&self.random.bytes(at)[..], &[0], frame].concat(),
            Fault::Replay => damaged = [self.replayed(), frame].concat(),
            Fault::Join => damaged.truncate(frame.len() - 1),
            Fault::Stutter => {
                let end = (at + 1 + self.random.below(8)).min(frame.len());
                damaged = [&frame[..end], &frame[at..]].concat();
            }
        }
        out.extend(&damaged);
        matches!(fault, Fault::Duplicate | Fault::Garbage | Fault::Replay) || damaged == frame
    }
}
