#!/bin/sh
# tmc2209 0.3.0, embedded-io 0.7.1 (crates.io, stepper driver over UART): await_read() and await_read_response() take bytes for the chip's answer that
# were never received. They ask the UART for up to 128 bytes, do not look at how many it gave, and parse the whole buffer. A UART gives what it has,
# often one to a few bytes: after the first three of an answer (sync, master, register), the four bytes of data and the checksum are the buffer's
# zeros. It is a complete answer with the right register, and the checksum is not looked at, as is documented. The position of the microstep table,
# the velocity, the load or the error flags read 0: a stalled or overheated motor looks fine. What comes later is parsed as the start of the next
# answer. Where the UART gives all 8 bytes at once, all is right. Reader::read_response() with the received part is right too.
# Seen on 2026-12-01:  answer of 0x80000107 in one piece: 80000107   in pieces of 4: 80000000   of 3: 00000000   Reader with pieces of 3: 80000107
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "pieces"
version = "0.0.0"
edition = "2021"

[dependencies]
embedded-io = "=0.7.1"
tmc2209 = "=0.3.0"
TOML
cat > src/main.rs <<'RS'
use embedded_io::{ErrorType, Read};
use std::convert::Infallible;
use tmc2209::{await_read, await_read_response, crc, reg, Reader, Register};

/// A UART that has received all of an answer, and gives at most so many bytes in one call, as Read allows.
struct Uart {
    received: Vec<u8>,
    most: usize,
}

impl ErrorType for Uart {
    type Error = Infallible;
}

impl Read for Uart {
    fn read(&mut self, to: &mut [u8]) -> Result<usize, Infallible> {
        let count = self.most.min(self.received.len()).min(to.len());
        to[..count].copy_from_slice(&self.received[..count]);
        self.received.drain(..count);
        Ok(count)
    }
}

fn answer() -> Vec<u8> {
    let mut bytes = vec![0x05, 0xFF, reg::DRV_STATUS::ADDRESS as u8, 0x80, 0x00, 0x01, 0x07];
    bytes.push(crc(&bytes));
    bytes
}

fn main() {
    let pieces = [8, 4, 3];
    let seen = pieces.map(|most| await_read_response(Uart { received: answer(), most }).data_u32());
    println!("SEEN answer of 80000107 in pieces of 8, 4, 3: {:08x?}", seen);
    assert_eq!(seen, [0x8000_0107, 0x8000_0000, 0]);

    // Overtemperature warning, overtemperature and a short to ground are the lowest bits.
    let flags = |most| {
        let status: reg::DRV_STATUS = await_read(Uart { received: answer(), most }).unwrap();
        (status.otpw(), status.ot(), status.s2ga())
    };
    println!("SEEN warning, overheated, short in pieces of 8: {:?}, of 4: {:?}", flags(8), flags(4));
    assert_eq!((flags(8), flags(4)), ((true, true, true), (false, false, false)));

    let mut reader = Reader::default();
    let found = answer().chunks(3).find_map(|piece| reader.read_response(piece).1).unwrap();
    println!("SEEN Reader with pieces of 3: {:08x}", found.data_u32());
    assert_eq!(found.data_u32(), 0x8000_0107);
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
