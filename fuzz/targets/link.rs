//! Bytes on the link, and payloads in frames with the right checksum: each gives a message or none, and a message can
//! be sent on.
#![no_main]

use actq_link::frame::{CRC, VERSION, wire_bytes};
use actq_link::{Receiver, Sender};
use libfuzzer_sys::fuzz_target;

const FRAME: usize = 512;

fn receive(bytes: &[u8]) -> usize {
    let mut receiver = Receiver::<FRAME>::new();
    let mut messages = 0;
    for &byte in bytes {
        let Some(received) = receiver.push(byte) else { continue };
        messages += 1;
        let mut again = [0; wire_bytes(FRAME)];
        let sent = Sender::new(received.sequence).frame(&received.message, received.micros, &mut again);
        let sent = sent.expect("a received message fits a frame");
        let mut other = Receiver::<FRAME>::new();
        assert!(sent.iter().filter_map(|&byte| other.push(byte).map(|_| ())).count() == 1, "{:?}", received.message);
    }
    messages
}

fuzz_target!(|bytes: &[u8]| {
    receive(bytes);
    let Some((&kind, payload)) = bytes.split_first() else { return };
    let mut frame = vec![VERSION, kind, 1, 0, 0, 0, 0, 0, 0, 0];
    frame.extend(payload);
    frame.extend(CRC.checksum(&frame).to_le_bytes());
    let mut wire = vec![0; cobs::max_encoding_length(frame.len()) + 1];
    let len = cobs::encode(&frame, &mut wire);
    receive(&wire[..=len]);
});
