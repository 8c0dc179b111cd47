#!/bin/sh
# crsf 2.0.1 (crates.io, parser for a CRSF receiver, the remote control of a robot): next_packet() throws away what comes after a packet. It takes 64
# bytes, the greatest length of a packet, from its buffer for each packet, however short that one is. A packet of channels has 26 bytes: of packets
# that wait together the first is given, the second is dropped, and the third is cut in the middle, so that the parser has to find a start again in
# its rest. At 500 Hz and a control step of 10 ms five packets wait: the documentation's own loop, "while let Some(Ok(...)) = next_packet()", gets the
# first and the fourth. The newest, with a switch that was just thrown, is lost, and channels after link statistics are too. A receiver whose two
# kinds of packet always come together gives no channels at all. Read byte by byte, all packets come. The dropped ones give no error.
# Seen on 2026-12-01:  2 packets together: the first   5 together: 1 and 4   byte by byte: all 5   link statistics, then channels: no channels
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "lost"
version = "0.0.0"
edition = "2021"

[dependencies]
crsf = "=2.0.1"
TOML
cat > src/main.rs <<'RS'
use crsf::{LinkStatistics, Packet, PacketAddress, PacketParser, RcChannels};

fn channels(value: u16) -> Vec<u8> {
    Packet::RcChannels(RcChannels([value; 16])).into_raw(PacketAddress::Controller).data().to_vec()
}

/// The first channels of the packets that the documentation's loop gets, -1 for one of link statistics.
fn got(parser: &mut PacketParser<1024>) -> Vec<i32> {
    let mut values = vec![];
    while let Some(Ok((_, packet))) = parser.next_packet() {
        values.push(match packet {
            Packet::RcChannels(channels) => channels[0].into(),
            _ => -1,
        });
    }
    values
}

fn together(packets: &[Vec<u8>]) -> Vec<i32> {
    let mut parser = PacketParser::new();
    packets.iter().for_each(|packet| parser.push_bytes(packet));
    got(&mut parser)
}

fn main() {
    let stream: Vec<Vec<u8>> = (1..=5).map(|packet| channels(1000 + packet)).collect();
    let (two, five) = (together(&stream[..2]), together(&stream));
    println!("SEEN packets 1001 and 1002 together: {two:?}   1001 to 1005 together: {five:?}");
    assert_eq!((two, five), (vec![1001], vec![1001, 1004]));

    let mut parser = PacketParser::new();
    let mut single = vec![];
    for byte in stream.concat() {
        parser.push_bytes(&[byte]);
        single.extend(got(&mut parser));
    }
    println!("SEEN byte by byte: {single:?}");
    assert_eq!(single, [1001, 1002, 1003, 1004, 1005]);

    let link = LinkStatistics {
        uplink_rssi_1: 50,
        uplink_rssi_2: 50,
        uplink_link_quality: 100,
        uplink_snr: 8,
        active_antenna: 0,
        rf_mode: 4,
        uplink_tx_power: 3,
        downlink_rssi: 50,
        downlink_link_quality: 100,
        downlink_snr: 8,
    };
    let link = Packet::LinkStatistics(link).into_raw(PacketAddress::Controller).data().to_vec();
    let mixed = together(&[link, channels(1500)]);
    println!("SEEN link statistics, then channels: {mixed:?}");
    assert_eq!(mixed, [-1]);
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
