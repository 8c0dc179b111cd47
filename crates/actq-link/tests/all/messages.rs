//! Every message, drawn at random.

use actq_link::code::{Crash, Fault, Parameter, Refusal, Report, ResetCause, State};
use actq_link::report::{Breadcrumb, Counters, Status, Timing};
use actq_link::{Floats, Message, Receiver, Sender, frame};
use proptest::prelude::*;

/// Memory for the longest payload.
pub(super) const LONGEST: usize = frame::bytes(frame::MAX_PAYLOAD);

/// The data that a message borrows.
#[derive(Clone, Debug, Default)]
pub(super) struct Content {
    values: Vec<f32>,
    bytes: Vec<u8>,
    signature: Option<[u8; 64]>,
}

pub(super) fn contents() -> impl Strategy<Value = Content> {
    let values = prop::collection::vec(any::<u32>().prop_map(f32::from_bits), 0..300);
    let bytes = prop_oneof![
        prop::collection::vec(any::<u8>(), 0..1000),
        // Stuffing splits runs without a zero every 254 bytes.
        prop::collection::vec(1..=255u8, 230..530),
    ];
    let signature = prop::option::of(any::<[u8; 64]>());
    (values, bytes, signature).prop_map(|(values, bytes, signature)| Content { values, bytes, signature })
}

/// Returns a message of each kind with this content and these numbers.
pub(super) fn all<'a>(content: &'a Content, n: &[u32; 6], pick: usize) -> Vec<Message<'a>> {
    let [token, a, b, c, d, e] = *n;
    let parameter = Parameter::ALL[pick % Parameter::ALL.len()];
    let reset = ResetCause::ALL[pick % ResetCause::ALL.len()];
    let refusal = Refusal::ALL.get(pick % (Refusal::ALL.len() + 1)).copied();
    let axis = pick as u8;
    let value = f32::from_bits(a);
    let values = Floats::Values(&content.values);
    let status = Status {
        state: State::ALL[pick % State::ALL.len()],
        fault: Fault::ALL.get(pick % (Fault::ALL.len() + 1)).copied(),
        refusal,
        reset,
        token,
        ticks: a,
        image: b,
        slot: axis,
        axes: b as u8,
        observation: c as u16,
        payload: d as u16,
        refused: e,
        counters: Counters { good: a, damaged: b, malformed: c, repeated: d, lost: e },
    };
    let crash = Crash::ALL.get(pick % (Crash::ALL.len() + 1)).copied();
    let mut messages = vec![
        Message::Observation(values),
        Message::Arm { token },
        Message::Disarm,
        Message::Get { parameter, axis },
        Message::Set { token, parameter, axis, value },
        Message::Ask(Report::ALL[pick % Report::ALL.len()]),
        Message::Begin { token, length: a, crc: b, version: c },
        Message::Chunk { offset: a, bytes: &content.bytes },
        Message::Commit { signature: content.signature.as_ref() },
        Message::Abort,
        Message::Action { of: a, applied: pick.is_multiple_of(2), values },
        Message::Status(status),
        Message::Timing(Timing { period: a, worst_tick: b, worst_jitter: c, worst_head: d, overruns: e, stack: a }),
        Message::Breadcrumb(Breadcrumb { reset, crash, pc: a, detail: b, ticks: c, count: d }),
        Message::Value { parameter, axis, value },
        Message::Ack { of: a, refusal, written: b },
    ];
    #[cfg(feature = "prefix")]
    messages.extend([
        Message::BeginPrefix { token, image: a, length: b, crc: c, lifetime: d },
        Message::PrefixChunk { offset: a, bytes: &content.bytes },
        Message::CommitPrefix,
    ]);
    messages
}

/// Compares bit for bit, because a NaN differs from itself.
pub(super) fn same(a: &Message<'_>, b: &Message<'_>) -> bool {
    let text = |message: &Message<'_>| match message {
        Message::Set { value, .. } | Message::Value { value, .. } => {
            format!("{message:?} {}", value.to_bits())
        }
        Message::Observation(values) => format!("{:?}", values.iter().map(f32::to_bits).collect::<Vec<_>>()),
        Message::Action { of, applied, values } => {
            format!("{of} {applied} {:?}", values.iter().map(f32::to_bits).collect::<Vec<_>>())
        }
        other => format!("{other:?}"),
    };
    a.kind() == b.kind() && text(a) == text(b)
}

proptest! {
    #[test]
    fn every_message_arrives_as_it_was_sent(
        content in contents(), numbers: [u32; 6], pick: usize, first: u32, micros: u32,
    ) {
        let (mut sender, mut receiver) = (Sender::new(first), Receiver::<LONGEST>::new());
        let mut buffer = [0; frame::wire_bytes(frame::MAX_PAYLOAD)];
        let messages = all(&content, &numbers, pick);
        for (i, message) in messages.iter().enumerate() {
            let wire = sender.frame(message, micros, &mut buffer).expect("the buffer takes the longest");
            let (end, stuffed) = wire.split_last().expect("a frame is not empty");
            prop_assert!(*end == 0 && !stuffed.contains(&0));
            let mut arrived = 0;
            for (at, byte) in wire.iter().enumerate() {
                if let Some(received) = receiver.push(*byte) {
                    prop_assert_eq!(at + 1, wire.len());
                    prop_assert_eq!(received.sequence, first.wrapping_add(i as u32));
                    prop_assert_eq!(received.micros, micros);
                    prop_assert!(same(&received.message, message), "{:?} became {:?}", message, received.message);
                    arrived += 1;
                }
            }
            prop_assert_eq!(arrived, 1);
        }
        let counters = Counters { good: messages.len() as u32, ..Counters::default() };
        prop_assert_eq!(receiver.counters(), counters);
    }

    #[test]
    fn wire_bytes_is_the_memory_of_a_frame(content in contents()) {
        let message = Message::Chunk { offset: 0, bytes: &content.bytes };
        let room = frame::wire_bytes(4 + content.bytes.len());
        let mut buffer = vec![0; room];
        let mut sender = Sender::default();
        let len = sender.frame(&message, 0, &mut buffer).map(<[u8]>::len);
        prop_assert!(len.is_some_and(|len| len <= room));
        let mut small = vec![0; len.unwrap_or(0) - 1];
        // The same frame again: with another number, its checksum and so its length may differ.
        let mut sender = Sender::default();
        prop_assert_eq!(sender.frame(&message, 0, &mut small), None);
        prop_assert_eq!(sender.next(), 0, "a frame that does not fit uses no number");
    }
}

#[test]
fn only_frames_that_fit_the_receiver_give_messages() {
    const SMALL: usize = frame::bytes(8);
    let (mut sender, mut receiver) = (Sender::default(), Receiver::<SMALL>::new());
    let mut buffer = [0; 4096];
    let mut good = Vec::new();
    for values in [&[0.0; 2][..], &[0.0; 3], &[0.0; 900], &[1.0; 2]] {
        let message = Message::Observation(Floats::Values(values));
        let wire = sender.frame(&message, 0, &mut buffer).expect("the buffer is large enough");
        good.extend(wire.iter().filter_map(|byte| receiver.push(*byte).map(|r| r.sequence)));
    }
    assert_eq!(good, [0, 3]);
    assert_eq!(receiver.counters(), Counters { good: 2, damaged: 2, lost: 2, ..Counters::default() });
}
