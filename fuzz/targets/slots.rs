//! A flash of any content gives an image to run or none, and accepts marks about it. The records have the right
//! checksums if the first byte is odd.
#![no_main]

use actq_boards::ram::Ram;
use actq_controller::slots::{Anyone, Authority, Key, Layout, Slots};
use actq_link::frame::CRC;
use libfuzzer_sys::fuzz_target;

const SECTOR: usize = 512;
const FLASH: usize = 4 * SECTOR;
/// Bytes of a slot's record, the last four of them its checksum.
const RECORD: usize = 128;
/// The public key of RFC 8032's first test.
const KEY: [u8; 32] = [
    0xd7, 0x5a, 0x98, 0x01, 0x82, 0xb1, 0x0a, 0xb7, 0xd5, 0x4b, 0xfe, 0xd3, 0xc9, 0x64, 0x07, 0x3a, 0x0e, 0xe1, 0x72, 0xf3,
    0xda, 0xa6, 0x23, 0x25, 0xaf, 0x02, 0x1a, 0x68, 0xf7, 0x07, 0x51, 0x1a,
];

fn run(mut memory: [u8; FLASH], authority: impl Authority) {
    let flash = Ram::<4, SECTOR>::new(&mut memory);
    let half = FLASH as u32 / 2;
    let layout = Layout::new(&flash, 0..half, half..FLASH as u32).expect("both slots are in the flash");
    let mut slots = Slots::new(flash, layout, authority, 0);
    let _ = slots.least_version();
    if let Some(first) = slots.select(|| ()) {
        slots.reject(first.slot);
        if let Some(second) = slots.select(|| ()) {
            assert_ne!(first.slot, second.slot, "a rejected image runs");
            let _ = slots.confirm(second.slot);
        }
    }
}

fuzz_target!(|bytes: &[u8]| {
    let Some((&first, content)) = bytes.split_first() else { return };
    let mut memory = [0xff; FLASH];
    memory.iter_mut().zip(content).for_each(|(place, byte)| *place = *byte);
    if first % 2 == 1 {
        for slot in memory.chunks_exact_mut(FLASH / 2) {
            let checksum = CRC.checksum(&slot[..RECORD - 4]);
            slot[RECORD - 4..RECORD].copy_from_slice(&checksum.to_le_bytes());
        }
    }
    run(memory, Anyone);
    run(memory, Key::new(&KEY).expect("a key"));
});
