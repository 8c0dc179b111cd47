//! The link over CAN frames.

use actq_link::can::{Payload, bytes, segments};
use actq_link::{Floats, Message, Receiver, Sender, frame};
use embedded_can::{ExtendedId, Frame, Id, StandardId};
use proptest::prelude::*;

use super::messages::{LONGEST, all, contents, same};
use super::random::Random;

/// A CAN frame with up to `N` bytes.
#[derive(Clone, Debug)]
struct Mock<const N: usize> {
    id: Id,
    data: Vec<u8>,
    remote: bool,
}

impl<const N: usize> Frame for Mock<N> {
    fn new(id: impl Into<Id>, data: &[u8]) -> Option<Self> {
        // ISO 11898-1: the lengths that a CAN FD frame can have.
        let has_code = data.len() <= 8 || [12, 16, 20, 24, 32, 48, 64].contains(&data.len());
        (data.len() <= N && has_code).then(|| Self { id: id.into(), data: data.to_vec(), remote: false })
    }

    fn new_remote(id: impl Into<Id>, dlc: usize) -> Option<Self> {
        (dlc <= 8).then(|| Self { id: id.into(), data: vec![0; dlc], remote: true })
    }

    fn is_extended(&self) -> bool {
        matches!(self.id, Id::Extended(_))
    }

    fn is_remote_frame(&self) -> bool {
        self.remote
    }

    fn id(&self) -> Id {
        self.id
    }

    fn dlc(&self) -> usize {
        self.data.len()
    }

    fn data(&self) -> &[u8] {
        &self.data
    }
}

fn id(number: u16) -> Id {
    Id::Standard(StandardId::new(number).expect("it has 11 bits"))
}

fn check_all_messages<const N: usize>(payload: Payload, messages: &[Message<'_>]) {
    let (mut sender, mut receiver) = (Sender::default(), Receiver::<LONGEST>::new());
    let mut buffer = [0; frame::wire_bytes(frame::MAX_PAYLOAD)];
    let other = Mock::<N>::new(ExtendedId::ZERO, &[1, 2, 3]).expect("it fits");
    let remote = Mock::<N>::new_remote(id(5), 3).expect("it fits");
    for message in messages {
        let wire = sender.frame(message, 0, &mut buffer).expect("there is room");
        let mut arrived = false;
        for can in segments::<Mock<N>>(id(5), payload, wire) {
            // What is not the link's changes nothing.
            for stranger in [&other, &remote] {
                assert!(bytes(id(5), stranger).is_empty());
            }
            for byte in bytes(id(5), &can) {
                if let Some(received) = receiver.push(*byte) {
                    assert!(!arrived && same(&received.message, message));
                    arrived = true;
                }
            }
        }
        assert!(arrived, "{message:?}");
    }
}

proptest! {
    #[test]
    fn every_message_arrives_over_can(content in contents(), numbers: [u32; 6], pick: usize) {
        let messages = all(&content, &numbers, pick);
        check_all_messages::<8>(Payload::Classic, &messages);
        check_all_messages::<64>(Payload::Fd, &messages);
    }
}

fn check_bad_bus<const N: usize>(payload: Payload) {
    let (mut sender, mut receiver) = (Sender::default(), Receiver::<LONGEST>::new());
    let mut random = Random::new(2);
    let mut buffer = [0; 512];
    let (mut good, mut untouched) = (0, 0);
    for number in 0..50_000u16 {
        let values = [f32::from(number); 40];
        let message = Message::Observation(Floats::Values(&values));
        let wire = sender.frame(&message, 0, &mut buffer).expect("there is room");
        let mut frames: Vec<Mock<N>> = segments(id(5), payload, wire).collect();
        let at = random.below(frames.len());
        match random.below(10) {
            0 => drop(frames.remove(at)),
            1 => frames.insert(at, frames[at].clone()),
            2 => frames.swap(0, at),
            3 => frames[at].data[0] ^= 1,
            _ => untouched += 1,
        }
        for byte in frames.iter().flat_map(|frame| bytes(id(5), frame)) {
            if let Some(received) = receiver.push(*byte) {
                let number = f32::from(received.sequence as u16);
                assert_eq!(received.message, Message::Observation(Floats::Values(&[number; 40])));
                good += 1;
            }
        }
    }
    // A damaged frame whose end is lost takes the next one with it.
    assert!(good > untouched / 10 * 9, "{good} of {untouched}");
}

#[test]
fn lost_doubled_swapped_and_damaged_can_frames_give_no_message() {
    check_bad_bus::<8>(Payload::Classic);
    check_bad_bus::<64>(Payload::Fd);
}
