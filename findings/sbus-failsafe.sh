#!/bin/sh
# sbus-parser 0.1.0 and sbus 0.2.2, against sbus-rs 0.1.3 (crates.io, frames of a remote control): two of the three never report a lost frame or the
# failsafe of the receiver. The flags are the low four bits of the byte before the last: channels 17 and 18, lost frame, failsafe. sbus-parser looks
# at the upper four, in the opposite order, which are always zero. sbus compares the masked bit with 1, which only the lowest can be; its flags are
# private, so that only the debug text shows them. A robot whose transmitter is off goes on with what the receiver sends in failsafe. From the fifth
# channel on, sbus-parser mixes the bits of neighbours: with all sticks in the middle, 992, it has 2016 for channel 5, near its end, and 1007 to 2030
# for seven others. And TaranisX7SBusPacket of sbus subtracts 172 from a channel without a check: a stick at 171 is 39.98 in a release build (0 to 1
# otherwise). There is no error.
# Seen on 2026-11-30:  flags 0x0c: sbus-rs lost, failsafe; the others neither   sticks in the middle, sbus-parser: 992 four times, 2016, 1007, 992,
# 2024, 1007, 992, 2028, 1007, 992, 2030, 1007, 992   at 171: 39.985
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "failsafe"
version = "0.0.0"
edition = "2021"

[dependencies]
sbus = "=0.2.2"
sbus-parser = "=0.1.0"
sbus-rs = { version = "=0.1.3", default-features = false, features = ["blocking"] }
TOML
cat > src/main.rs <<'RS'
use sbus::{SBusPacketParser, TaranisX7SBusPacket};
use sbus_parser::receiver::Receiver;
use sbus_rs::SbusPacket;

/// A frame with all channels at one value.
fn frame(channel: u16, flags: u8) -> [u8; 25] {
    let mut bytes = [0; 25];
    bytes[0] = 0x0F;
    for bit in 0..16 * 11 {
        bytes[1 + bit / 8] |= ((channel >> (bit % 11) & 1) as u8) << (bit % 8);
    }
    bytes[23] = flags;
    bytes
}

fn main() {
    for flags in [0x00, 0x01, 0x02, 0x04, 0x08, 0x0C] {
        let bytes = frame(992, flags);
        let right = SbusPacket::from_array(&bytes).unwrap();
        let parser = Receiver::new().receive(&bytes).unwrap();
        let mut other = SBusPacketParser::new();
        other.push_bytes(&bytes);
        let text = format!("{:?}", other.try_parse().unwrap());
        let (lost, failsafe) = (text.contains("frame_lost: true"), text.contains("failsafe: true"));
        println!(
            "SEEN flags 0x{flags:02x}, lost frame and failsafe: sbus-rs {} {}, sbus-parser {} {}, sbus {lost} {failsafe}",
            right.flags.frame_lost, right.flags.failsafe, parser.frame_lost, parser.failsafe
        );
        assert_eq!(right.channels, [992; 16]);
        assert_eq!(parser.channels, [992, 992, 992, 992, 2016, 1007, 992, 2024, 1007, 992, 2028, 1007, 992, 2030, 1007, 992]);
        assert_eq!((right.flags.frame_lost, right.flags.failsafe), (flags & 4 != 0, flags & 8 != 0));
        assert!(!(parser.frame_lost || parser.failsafe || parser.channel17 || parser.channel18 || lost || failsafe || text.contains("d2: true")));
        assert_eq!(text.contains("d1: true"), flags & 1 != 0);
    }
    println!("SEEN all sticks at 992, sbus-parser: {:?}", Receiver::new().receive(&frame(992, 0)).unwrap().channels);
    let stick = |channel| {
        let mut parser = SBusPacketParser::new();
        parser.push_bytes(&frame(channel, 0));
        TaranisX7SBusPacket::new(parser.try_parse().unwrap()).channels[0]
    };
    println!("SEEN a stick at 172, 1811 and 171: {:.3}, {:.3}, {:.3}", stick(172), stick(1811), stick(171));
    assert!(stick(172) == 0.0 && stick(1811) == 1.0 && stick(171) > 39.9);
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
