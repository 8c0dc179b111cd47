//! Breadcrumbs and the scrubbed image, against damage, and the feeding of the watchdog.

use actq_controller::breadcrumb::{Record, WORDS};
use actq_controller::progress::Progress;
use actq_controller::scrub::{Scrub, checksum};
use actq_link::code::{Crash, ResetCause};
use actq_testkit::Random;

const RECORD: Record = Record { crash: Crash::HardFault, pc: 0x0800_1234, detail: 0x0001_0000, ticks: 77, count: 2 };

#[test]
fn only_a_breadcrumb_is_found() {
    let words = RECORD.to_words();
    assert_eq!(Record::from_words(&words), Some(RECORD));
    for bit in 0..32 * WORDS {
        let mut damaged = words;
        damaged[bit / 32] ^= 1 << (bit % 32);
        assert_eq!(Record::from_words(&damaged), None, "bit {bit}");
    }
    for fill in [0, u32::MAX, 0xdead_beef, 0xcccc_cccc] {
        assert_eq!(Record::from_words(&[fill; WORDS]), None);
    }
    let mut random = Random::new(3);
    for _ in 0..1_000_000 {
        let mut words = [0; WORDS];
        words.iter_mut().for_each(|word| *word = random.bits() as u32);
        // Valid codes, so that only the checksum can detect the damage.
        words[0] %= 5;
        assert_eq!(Record::from_words(&words), None);
    }
}

#[test]
fn a_breadcrumb_is_reported_with_the_reset_cause() {
    let report = Record::report(ResetCause::Watchdog, Some(RECORD));
    assert_eq!((report.reset, report.crash, report.pc), (ResetCause::Watchdog, Some(Crash::HardFault), RECORD.pc));
    assert_eq!((report.detail, report.ticks, report.count), (RECORD.detail, RECORD.ticks, RECORD.count));
    let none = Record::report(ResetCause::Power, None);
    assert_eq!((none.crash, none.pc, none.count), (None, 0, 0));
}

#[test]
fn the_watchdog_needs_progress_of_all_three() {
    for made in 0..8u32 {
        let mut progress = Progress { link: made & 1 != 0, head: made & 2 != 0, output: made & 4 != 0 };
        assert_eq!(progress.missing(), 7 - made);
        let before = progress;
        assert_eq!(progress.feed(), made == 7);
        // Earlier progress counts until the others make theirs.
        assert_eq!(progress, if made == 7 { Progress::default() } else { before });
    }
}

#[test]
fn the_scrub_detects_every_flipped_bit() {
    let image: Vec<u8> = (0..300u32).map(|i| (i * i) as u8).collect();
    for piece in [1, 7, 64, 299, 300, 1000] {
        let mut scrub = Scrub::new(checksum(&image));
        let mut round =
            |image: &[u8]| (0..=image.len()).find_map(|_| scrub.advance(image, piece)).expect("the round ends");
        assert!(round(&image) && round(&image));
        for bit in (0..8 * image.len()).step_by(if piece == 64 { 1 } else { 37 }) {
            let mut decayed = image.clone();
            decayed[bit / 8] ^= 1 << (bit % 8);
            assert!(!round(&decayed), "bit {bit}");
            assert!(round(&image));
        }
    }
}
