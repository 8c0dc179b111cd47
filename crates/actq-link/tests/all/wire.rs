//! The bytes on the wire: the example in docs/LINK.md, damaged frames, and frames with invalid content.

use actq_link::code::{Parameter, Refusal, Report, State};
use actq_link::report::Counters;
use actq_link::{Floats, Message, Receiver, Sender, frame};
use actq_testkit::Random;

use super::messages::{Content, LONGEST, all};

/// Returns the messages that a receiver finds, as text.
pub(super) fn found<const N: usize>(receiver: &mut Receiver<N>, bytes: &[u8]) -> Vec<String> {
    bytes.iter().filter_map(|byte| receiver.push(*byte).map(|received| format!("{received:?}"))).collect()
}

/// Returns a frame of these bytes, which need not be a message.
fn frame_of(content: &[u8]) -> Vec<u8> {
    frame_with(content, &[])
}

/// Returns such a frame with more bytes after its checksum.
fn frame_with(content: &[u8], more: &[u8]) -> Vec<u8> {
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(content);
    let frame = [content, &crc.to_le_bytes(), more].concat();
    let mut wire = vec![0; cobs::max_encoding_length(frame.len())];
    let len = cobs::encode(&frame, &mut wire);
    wire.truncate(len);
    wire.push(0);
    wire
}

fn content(version: u8, kind: u8, sequence: u32, payload: &[u8]) -> Vec<u8> {
    [&[version, kind][..], &sequence.to_le_bytes(), &7u32.to_le_bytes(), payload].concat()
}

/// The numbers at both ends of a window. A bounded receiver takes a disarm from far ahead, and nothing else.
#[test]
fn numbers_outside_the_window_are_not_new() {
    type R = Receiver<LONGEST>;
    let is_taken = |receiver: &mut R, message: Message<'_>, sequence| {
        !found(receiver, &frame_of(&content(frame::VERSION, message.kind(), sequence, &[]))).is_empty()
    };
    for (is_bounded, reach) in [(false, u32::MAX / 2), (true, R::REACH)] {
        let mut receiver = R::new();
        receiver.bound(is_bounded);
        assert!(!receiver.reopen(), "open at first");
        assert!(is_taken(&mut receiver, Message::Abort, 7));
        for (ahead, expected) in [(0, false), (reach + 1, false), (reach, true)] {
            let taken = is_taken(&mut receiver, Message::Abort, 7u32.wrapping_add(ahead));
            assert_eq!(taken, expected, "{ahead} ahead of 7, bounded: {is_bounded}");
        }
        assert_eq!(receiver.counters().lost, reach - 1);
        let far = 8u32.wrapping_add(2 * reach);
        assert_eq!(is_taken(&mut receiver, Message::Disarm, far), is_bounded);
        assert!(receiver.reopen() && is_taken(&mut receiver, Message::Abort, far.wrapping_sub(1)));
    }
}

/// Its beginning alone, which fills the receiver's memory, is a frame.
#[test]
fn a_frame_that_goes_on_after_its_checksum_is_damaged() {
    let disarm = content(frame::VERSION, Message::Disarm.kind(), 1, &[]);
    let mut receiver = Receiver::<{ frame::bytes(0) }>::new();
    for more in [1, 2, 300] {
        assert!(found(&mut receiver, &frame_with(&disarm, &vec![7; more])).is_empty(), "{more} more bytes");
    }
    assert_eq!(receiver.counters().damaged, 3);
    assert_eq!(found(&mut receiver, &frame_of(&disarm)).len(), 1);
}

const DOCUMENTATION: &str = include_str!("../../../../docs/LINK.md");

/// Reads the hexadecimal bytes after `label` in the documentation's example.
fn example(label: &str) -> Vec<u8> {
    let line =
        DOCUMENTATION.lines().find_map(|line| line.trim().strip_prefix(label)).expect("docs/LINK.md has the label");
    line.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).expect("a byte in hexadecimal")).collect()
}

#[test]
fn the_documented_example_is_sent_and_received() {
    let (wire, plain) = (example("wire:"), example("frame:"));
    let message = Message::Observation(Floats::Values(&[1.0, -0.5, 0.0]));
    let mut buffer = [0; 64];
    let mut sender = Sender::new(258);
    assert_eq!(sender.next(), 258);
    assert_eq!(sender.frame(&message, 1_000_000, &mut buffer), Some(&wire[..]));
    assert_eq!(sender.next(), 259);
    assert_eq!(frame_of(&plain[..plain.len() - 4]), wire, "the frame before stuffing");
    let mut receiver = Receiver::<LONGEST>::new();
    let (last, first) = wire.split_last().expect("the example is not empty");
    assert!(found(&mut receiver, first).is_empty());
    let received = receiver.push(*last).expect("the frame ends");
    assert_eq!((received.sequence, received.micros, received.message), (258, 1_000_000, message));
    let Message::Observation(values) = received.message else { panic!("{received:?}") };
    assert_eq!((values.len(), values.is_empty(), Floats::Values(&[]).is_empty()), (3, false, true));
    assert_ne!(values, Floats::Values(&[1.0, -0.5, -0.0]));
    for len in 0..wire.len() {
        assert_eq!(Sender::new(258).frame(&message, 1_000_000, &mut vec![0; len]), None, "a buffer of {len} bytes");
    }
}

/// Each table of codes lists all codes.
#[test]
fn the_documentation_lists_every_code() {
    let rows = |code: u8, name: String| (format!("| {code} | `{name}`"), name);
    let names = State::ALL.iter().map(|c| rows(c.code(), format!("{c:?}")));
    let names = names.chain(Refusal::ALL.iter().map(|c| rows(c.code(), format!("{c:?}"))));
    let names = names.chain(Parameter::ALL.iter().map(|c| rows(c.code(), format!("{c:?}"))));
    let names = names.chain(actq_link::code::Fault::ALL.iter().map(|c| rows(c.code(), format!("{c:?}"))));
    let names = names.chain(actq_link::code::Crash::ALL.iter().map(|c| rows(c.code(), format!("{c:?}"))));
    let names = names.chain(actq_link::code::ResetCause::ALL.iter().map(|c| rows(c.code(), format!("{c:?}"))));
    for (row, name) in names.chain(Report::ALL.iter().map(|c| rows(c.code(), format!("{c:?}")))) {
        assert!(DOCUMENTATION.contains(&row), "docs/LINK.md has no row for {name}: {row}");
    }
}

#[test]
fn the_documentation_lists_every_message() {
    for message in all(&Content::default(), &[0; 6], 0) {
        let name = format!("{message:?}");
        let name = name.split(|c: char| !c.is_alphabetic()).next().expect("a message has a name");
        // Each word of it begins with a capital.
        let words = name.chars().flat_map(|c| c.is_uppercase().then_some(' ').into_iter().chain(c.to_lowercase()));
        let row = format!("| {} |{}", message.kind(), words.collect::<String>());
        assert!(DOCUMENTATION.contains(&row), "docs/LINK.md has no row {row}");
    }
}

#[test]
fn flipped_bits_and_truncated_frames_give_no_message() {
    let mut buffer = [0; 128];
    let values: Vec<f32> = (0..16u8).map(f32::from).collect();
    let message = Message::Observation(Floats::Values(&values));
    let wire = Sender::default().frame(&message, 5, &mut buffer).expect("the buffer is large enough").to_vec();
    for bit in 0..8 * wire.len() {
        let mut damaged = wire.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        let mut receiver = Receiver::<LONGEST>::new();
        let mut messages = found(&mut receiver, &damaged);
        messages.extend(found(&mut receiver, &[0]));
        assert_eq!(messages, Vec::<String>::new(), "bit {bit}");
    }
    for cut in 0..wire.len() - 1 {
        let mut receiver = Receiver::<LONGEST>::new();
        let mut messages = found(&mut receiver, &wire[..cut]);
        messages.extend(found(&mut receiver, &[0]));
        assert_eq!(messages, Vec::<String>::new(), "truncated after {cut} bytes");
        // The frame after a truncated one is found.
        assert_eq!(found(&mut receiver, &wire).len(), 1, "truncated after {cut} bytes");
    }
}

#[test]
fn frames_with_invalid_content_are_only_counted() {
    let wrong: [(&str, Vec<u8>); 18] = [
        ("version 0", content(0, 3, 1, &[])),
        ("version 2", content(2, 3, 1, &[])),
        ("kind 0", content(1, 0, 1, &[])),
        ("kind 11", content(1, 11, 1, &[])),
        ("kind 127", content(1, 127, 1, &[])),
        ("kind 255", content(1, 255, 1, &[])),
        ("an observation of 3 bytes", content(1, 1, 1, &[0; 3])),
        ("arm without a token", content(1, 2, 1, &[])),
        ("arm with 5 bytes", content(1, 2, 1, &[0; 5])),
        ("disarm with a byte", content(1, 3, 1, &[0])),
        ("get of parameter 0", content(1, 4, 1, &[0, 0])),
        ("get of parameter 200", content(1, 4, 1, &[200, 0])),
        ("ask for report 9", content(1, 6, 1, &[9])),
        ("chunk without an offset", content(1, 8, 1, &[0; 3])),
        ("commit with half a signature", content(1, 9, 1, &[0; 32])),
        ("commit with more than a signature", content(1, 9, 1, &[0; 65])),
        ("an action that is applied twice", content(1, 128, 1, &[0, 0, 0, 0, 2])),
        ("a status of state 77", content(1, 129, 1, &[77; 46])),
    ];
    let mut receiver = Receiver::<LONGEST>::new();
    for (name, content) in &wrong {
        assert_eq!(found(&mut receiver, &frame_of(content)), Vec::<String>::new(), "{name}");
    }
    let too_short = [&[][..], &[1], &[1; 9]];
    for content in too_short {
        assert_eq!(found(&mut receiver, &frame_of(content)), Vec::<String>::new());
    }
    let expected = Counters { malformed: wrong.len() as u32, damaged: too_short.len() as u32, ..Counters::default() };
    assert_eq!(receiver.counters(), expected);
    // They have not moved the window.
    assert_eq!(found(&mut receiver, &frame_of(&content(1, 3, 1, &[]))).len(), 1);
}

#[test]
fn noise_gives_no_message() {
    let mut random = Random::new(14);
    let mut receiver = Receiver::<{ frame::bytes(64) }>::new();
    for _ in 0..4_000_000 / 8 {
        let mut bytes = random.bits().to_le_bytes();
        // Many frame ends, and so many short frames.
        bytes[0] &= 0x0f;
        for byte in bytes {
            assert_eq!(receiver.push(byte), None);
        }
    }
    assert!(receiver.counters().damaged > 10_000);
}

/// Returns the frame of a chunk with these bytes.
fn chunk(number: u32, bytes: &[u8]) -> Vec<u8> {
    let mut buffer = [0; 1024];
    let message = Message::Chunk { offset: 0, bytes };
    Sender::new(number).frame(&message, 0, &mut buffer).expect("the buffer is large enough").to_vec()
}

/// All payloads of up to five bytes from four, which have the zero and the shortest and longest runs: from their frames every
/// piece is cut out, and only frames that are whole arrive.
#[test]
fn no_piece_of_a_short_frame_is_missed_unseen() {
    let (next, third) = (chunk(2, &[]), chunk(3, &[]));
    for case in 0..4 * 4usize.pow(5) {
        let (length, case) = (2 + case % 4, case / 4);
        let bytes: Vec<u8> = (0..length as u32).map(|i| [0, 1, 2, 255][case / 4usize.pow(i) % 4]).collect();
        if case >= 4usize.pow(length as u32) {
            continue;
        }
        let wire = chunk(1, &bytes);
        for (start, end) in (0..wire.len()).flat_map(|start| (start..=wire.len()).map(move |end| (start, end))) {
            let line = [&wire[..start], &wire[end..], &next, &third].concat();
            let mut receiver = Receiver::<LONGEST>::new();
            let arrived = line.iter().filter_map(|byte| receiver.push(*byte).map(|received| received.sequence));
            // Without its end, a frame runs into the next.
            let expected: &[u32] = match (start, end) {
                _ if start == end => &[1, 2, 3],
                (1.., end) if end == wire.len() => &[3],
                _ => &[2, 3],
            };
            assert!(arrived.eq(expected.iter().copied()), "{bytes:?} without {start}..{end}");
        }
    }
}

/// Stuffing begins a new run after 254 bytes: all lengths around one and two of them, with a zero at every place.
#[test]
fn long_runs_arrive_with_a_zero_anywhere() {
    for length in 225..525 {
        for zero in 0..=length {
            let mut bytes = vec![7; length];
            if let Some(byte) = bytes.get_mut(zero) {
                *byte = 0;
            }
            let (wire, mut receiver) = (chunk(1, &bytes), Receiver::<LONGEST>::new());
            let (end, start) = wire.split_last().expect("a frame is not empty");
            assert!(start.iter().all(|byte| *byte != 0 && receiver.push(*byte).is_none()));
            let received = receiver.push(*end).map(|received| received.message);
            assert_eq!(received, Some(Message::Chunk { offset: 0, bytes: &bytes }));
        }
    }
}
