//! The transfer of a prefix, and its lifetime.

use actq_controller::prefix::{Plan, Transfer};
use actq_link::code::Refusal;
use actq_link::frame::CRC;

const IMAGE: u32 = 0xabcd;
const MOST: u32 = 100;

fn bytes(seed: u8) -> [u8; 24] {
    std::array::from_fn(|i| seed.wrapping_add(7 * i as u8))
}

fn plan(bytes: &[u8]) -> Plan {
    Plan { image: IMAGE, length: bytes.len() as u32, crc: CRC.checksum(bytes), lifetime: 50 }
}

/// Sends all bytes, up to the commit that finds them right.
fn send(transfer: &mut Transfer<'_>, bytes: &[u8], now: u32) {
    assert_eq!(transfer.begin(plan(bytes), now), Ok(()));
    for (i, chunk) in bytes.chunks(7).enumerate() {
        assert_eq!(transfer.chunk(7 * i as u32, chunk), Ok(()));
    }
    assert_eq!(transfer.commit(), Err(Refusal::Busy));
}

#[test]
fn a_prefix_is_used_once_it_is_whole() {
    let (mut memory, sent) = ([0; 24], bytes(1));
    let mut transfer = Transfer::new(&mut memory, IMAGE, MOST);
    assert!(!transfer.is_fresh(0));
    assert_eq!((transfer.chunk(0, &sent), transfer.commit()), (Err(Refusal::NoUpdate), Err(Refusal::NoUpdate)));
    assert_eq!(transfer.begin(plan(&sent), 10), Ok(()));
    assert_eq!(transfer.chunk(0, &sent[..10]), Ok(()));
    // A repetition, one with a gap, one that overlaps, one after the end.
    assert_eq!((transfer.chunk(0, &sent[..10]), transfer.written()), (Ok(()), 10));
    assert_eq!(transfer.chunk(11, &sent[11..12]), Err(Refusal::Offset));
    assert_eq!(transfer.chunk(9, &sent[9..12]), Err(Refusal::Offset));
    assert_eq!(transfer.chunk(20, &sent[..5]), Err(Refusal::Length));
    assert_eq!(transfer.chunk(u32::MAX, &sent[..5]), Err(Refusal::Length));
    assert_eq!((transfer.commit(), transfer.whole()), (Err(Refusal::Length), None));
    assert_eq!(transfer.chunk(10, &sent[10..]), Ok(()));
    assert_eq!(transfer.whole(), None, "not before the commit");
    assert_eq!(transfer.commit(), Err(Refusal::Busy));
    assert_eq!(transfer.whole(), Some(&sent[..]));
    assert!(!transfer.is_fresh(20), "the head does not have it");
    transfer.installed(Ok(()));
    assert_eq!((transfer.commit(), transfer.whole(), transfer.written()), (Ok(()), None, 24));
    assert_eq!(transfer.chunk(10, &sent[10..]), Ok(()), "a repetition of the last chunk");
    // Its lifetime begins when the announcement came.
    assert!(transfer.is_fresh(20) && transfer.is_fresh(60));
    assert!(!transfer.is_fresh(61));
    assert!(!transfer.is_fresh(20), "once over, it stays over");
}

#[test]
fn the_prefix_before_is_used_until_the_next_is_whole() {
    let mut memory = [0; 24];
    let mut transfer = Transfer::new(&mut memory, IMAGE, MOST);
    send(&mut transfer, &bytes(1), u32::MAX - 5);
    transfer.installed(Ok(()));
    assert!(transfer.is_fresh(u32::MAX) && transfer.is_fresh(44), "over the wrap of the ticks");
    // A damaged one.
    let sent = bytes(2);
    assert_eq!(transfer.begin(Plan { crc: 0, ..plan(&sent) }, 20), Ok(()));
    assert_eq!((transfer.chunk(0, &sent), transfer.commit()), (Ok(()), Err(Refusal::Checksum)));
    assert_eq!((transfer.commit(), transfer.whole()), (Err(Refusal::Checksum), None));
    // One that the head refuses.
    send(&mut transfer, &sent, 30);
    transfer.installed(Err(Refusal::Range));
    assert_eq!(transfer.commit(), Err(Refusal::Range));
    assert!(transfer.is_fresh(44) && !transfer.is_fresh(45));
    // A repeated announcement does not make it younger; another one begins again.
    assert_eq!((transfer.begin(plan(&sent), 50), transfer.begin(plan(&sent), 90)), (Ok(()), Ok(())));
    assert_eq!((transfer.chunk(0, &sent), transfer.commit()), (Ok(()), Err(Refusal::Busy)));
    transfer.installed(Ok(()));
    assert!(transfer.is_fresh(100) && !transfer.is_fresh(101));
    assert_eq!((transfer.begin(plan(&sent), 110), transfer.written()), (Ok(()), 0));
}

#[test]
fn impossible_announcements_are_refused() {
    let (mut memory, sent) = ([0; 24], bytes(1));
    let mut transfer = Transfer::new(&mut memory, IMAGE, MOST);
    let whole = plan(&sent);
    let cases = [
        (Plan { image: IMAGE + 1, ..whole }, Refusal::Unfit),
        (Plan { length: 20, ..whole }, Refusal::Length),
        (Plan { length: 28, ..whole }, Refusal::Length),
        (Plan { lifetime: 0, ..whole }, Refusal::Range),
        (Plan { lifetime: MOST + 1, ..whole }, Refusal::Range),
    ];
    for (plan, refusal) in cases {
        assert_eq!(transfer.begin(plan, 0), Err(refusal), "{plan:?}");
    }
    assert_eq!(transfer.begin(Plan { lifetime: MOST, ..whole }, 0), Ok(()));
    // An image without a prefix needs none.
    let mut none = Transfer::new(&mut [], IMAGE, MOST);
    assert_eq!(none.begin(plan(&[]), 0), Err(Refusal::Unsupported));
    assert!(none.is_fresh(u32::MAX));
}
