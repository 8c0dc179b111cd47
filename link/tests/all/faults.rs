//! A sender and a receiver with a faulty line between them.

use std::collections::HashSet;

use actq_link::{Floats, Message, Receiver, Sender, frame};

use super::random::Random;

/// Values of an observation. Their bits follow from the frame's number, so the receiver can check each.
const VALUES: usize = 12;

fn observation(number: u32) -> [f32; VALUES] {
    std::array::from_fn(|i| f32::from_bits(number.wrapping_mul(2_654_435_761).rotate_left(i as u32)))
}

/// Frames that the line has seen, which it can send again.
const REMEMBERED: usize = 1000;
/// Faulty frames in a hundred.
const FAULTS: usize = 30;

/// A fault of the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum LineFault {
    Loss,
    Duplicate,
    /// The frame arrives after the next one.
    Swap,
    Truncate,
    FlipBits,
    /// A run of damaged bits, as from a disturbance.
    Burst,
    Garbage,
    /// An old frame arrives again.
    Replay,
    /// The zero between two frames is lost.
    Join,
    /// Bytes of the frame are sent twice.
    Stutter,
}

const LINE_FAULTS: [LineFault; 10] = [
    LineFault::Loss,
    LineFault::Duplicate,
    LineFault::Swap,
    LineFault::Truncate,
    LineFault::FlipBits,
    LineFault::Burst,
    LineFault::Garbage,
    LineFault::Replay,
    LineFault::Join,
    LineFault::Stutter,
];

struct Line {
    random: Random,
    seen: Vec<Vec<u8>>,
    held: Option<Vec<u8>>,
    faults: HashSet<LineFault>,
}

impl Line {
    /// Appends to `out` what arrives when `frame` is sent. Returns `true` if the frame is whole in it.
    fn carry(&mut self, frame: &[u8], out: &mut Vec<u8>) -> bool {
        let held = self.held.take();
        let fault = (self.random.below(100) < FAULTS).then(|| LINE_FAULTS[self.random.below(LINE_FAULTS.len())]);
        self.faults.extend(fault);
        let at = self.random.below(frame.len());
        let mut whole = true;
        match fault {
            None => out.extend(frame),
            Some(LineFault::Loss) => whole = false,
            Some(LineFault::Duplicate) => out.extend([frame, frame].concat()),
            Some(LineFault::Swap) => {
                self.held = Some(frame.to_vec());
                whole = false;
            }
            Some(LineFault::Truncate) => {
                out.extend(&frame[..at]);
                whole = false;
            }
            Some(LineFault::FlipBits) => {
                let mut damaged = frame.to_vec();
                damaged[at] ^= 1 << self.random.below(8);
                for _ in 0..self.random.below(4) {
                    let at = self.random.below(frame.len());
                    damaged[at] ^= 1 << self.random.below(8);
                }
                whole = damaged == frame;
                out.extend(damaged);
            }
            Some(LineFault::Burst) => {
                let mut damaged = frame.to_vec();
                damaged.iter_mut().skip(at).take(1 + at % 9).for_each(|b| *b = self.random.bits() as u8);
                whole = damaged == frame;
                out.extend(damaged);
            }
            Some(LineFault::Garbage) => {
                out.extend((0..at).map(|_| self.random.bits() as u8));
                out.extend([0].iter().chain(frame));
            }
            Some(LineFault::Replay) => {
                let old = self.random.below(self.seen.len().max(1));
                out.extend(self.seen.get(old).into_iter().flatten());
                out.extend(frame);
            }
            Some(LineFault::Join) => {
                out.extend(&frame[..frame.len() - 1]);
                whole = false;
            }
            Some(LineFault::Stutter) => {
                let end = (at + 1 + self.random.below(8)).min(frame.len());
                out.extend([&frame[..end], &frame[at..]].concat());
                whole = false;
            }
        }
        out.extend(held.into_iter().flatten());
        match self.seen.len() < REMEMBERED {
            true => self.seen.push(frame.to_vec()),
            false => self.seen[at] = frame.to_vec(),
        }
        whole
    }
}

/// In a million frames, 30 in 100 of them faulty, each received message was sent, is whole, has its own number, and is
/// newer than the previous one.
#[test]
fn a_faulty_line_gives_no_wrong_message() {
    const FRAMES: u32 = 1_000_000;
    // The numbers wrap during the test.
    const FIRST: u32 = u32::MAX - FRAMES / 2;
    let mut sender = Sender::new(FIRST);
    let mut receiver = Receiver::<{ frame::bytes(4 * VALUES) }>::new();
    let mut line = Line { random: Random::new(1), seen: Vec::new(), held: None, faults: HashSet::new() };
    let (mut buffer, mut out) = ([0; frame::wire_bytes(4 * VALUES)], Vec::new());
    let (mut messages, mut whole, mut last) = (0u32, 0u32, None::<u32>);
    for number in 0..FRAMES {
        let message = observation(number);
        let message = Message::Observation(Floats::Values(&message));
        let frame = sender.frame(&message, number.wrapping_mul(1000), &mut buffer).expect("the buffer is large enough");
        out.clear();
        whole += u32::from(line.carry(frame, &mut out));
        for byte in &out {
            let Some(received) = receiver.push(*byte) else { continue };
            let number = received.sequence.wrapping_sub(FIRST);
            assert!(last.is_none_or(|last| number > last), "frame {number} after {last:?}");
            assert_eq!(received.message, Message::Observation(Floats::Values(&observation(number))));
            assert_eq!(received.micros, number.wrapping_mul(1000));
            (last, messages) = (Some(number), messages + 1);
        }
    }
    assert_eq!(line.faults.len(), LINE_FAULTS.len(), "each fault occurred");
    let counters = receiver.counters();
    assert_eq!(counters.good, messages);
    assert_eq!(counters.malformed, 0);
    assert!(counters.damaged > FRAMES / 10 && counters.repeated > FRAMES / 50);
    // A whole frame is lost only if the end of the damaged frame before it is missing, or if a held frame overtook it.
    assert!(messages > whole - FRAMES / 10, "{messages} of {whole} whole frames");
    // All missing frames are counted, except those lost after the last message.
    assert!(counters.good + counters.lost + 20 > FRAMES, "{counters:?}");
}
