//! A sender and a receiver with a faulty line between them.

use actq_link::{Floats, Message, Receiver, Sender, frame};
use actq_testkit::{Fault, Line};

/// Values of an observation. Their bits follow from the frame's number, so the receiver can check each.
const VALUES: usize = 12;

fn observation(number: u32) -> [f32; VALUES] {
    std::array::from_fn(|i| f32::from_bits(number.wrapping_mul(2_654_435_761).rotate_left(i as u32)))
}

/// A million frames, of which 30 in 100 meet a fault: every message is one that was sent, whole, with its own number,
/// and newer than the one before.
#[test]
fn a_faulty_line_gives_no_wrong_message() {
    const FRAMES: u32 = 1_000_000;
    // The numbers wrap during the test.
    const FIRST: u32 = u32::MAX - FRAMES / 2;
    let mut sender = Sender::new(FIRST);
    let mut receiver = Receiver::<{ frame::bytes(4 * VALUES) }>::new();
    let mut line = Line::new(1, 300);
    let mut buffer = [0; frame::wire_bytes(4 * VALUES)];
    let (mut messages, mut last) = (0u32, None::<u32>);
    for number in 0..FRAMES {
        let message = observation(number);
        let message = Message::Observation(Floats::Values(&message));
        let frame = sender.frame(&message, number.wrapping_mul(1000), &mut buffer).expect("there is room");
        for byte in line.carry(frame) {
            let Some(received) = receiver.push(byte) else { continue };
            let number = received.sequence.wrapping_sub(FIRST);
            assert!(last.is_none_or(|last| number > last), "frame {number} after {last:?}");
            assert_eq!(received.message, Message::Observation(Floats::Values(&observation(number))));
            assert_eq!(received.micros, number.wrapping_mul(1000));
            (last, messages) = (Some(number), messages + 1);
        }
    }
    assert_eq!(line.faults.len(), Fault::ALL.len(), "every fault has happened");
    let counters = receiver.counters();
    assert_eq!(counters.good, messages);
    assert_eq!(counters.malformed, 0);
    assert!(counters.damaged > FRAMES / 10 && counters.repeated > FRAMES / 50);
    // A frame that is whole is lost only where the end of a damaged one before it is missing, or a held one has passed
    // it.
    assert!(messages > line.whole - FRAMES / 10, "{messages} of {} whole frames", line.whole);
    // All that is missing is counted, but what was lost behind the last message.
    assert!(counters.good + counters.lost + 20 > FRAMES, "{counters:?}");
}
