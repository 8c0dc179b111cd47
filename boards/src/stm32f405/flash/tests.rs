//! Flash against a model of its controller.

use super::model::Model;
use super::*;

/// Returns the whole flash, filled with `byte`.
fn flash(byte: u8) -> Flash<Model> {
    let end = sector(SECTORS - 1).end;
    Flash::new(Model::new(vec![byte; end as usize], 0, 1), 0)
}

/// Returns `true` if the controller is locked and no cache is stale, as after each request.
fn is_at_rest(flash: &Flash<Model>) -> bool {
    flash.part.read(Register::Control) == LOCK && !flash.part.is_stale
}

#[test]
fn the_sectors_cover_a_megabyte() {
    let lengths: Vec<u32> = (0..SECTORS).map(|number| sector(number).len() as u32 >> 10).collect();
    assert_eq!(lengths, [16, 16, 16, 16, 64, 128, 128, 128, 128, 128, 128, 128]);
    for number in 1..SECTORS {
        assert_eq!(sector(number - 1).end, sector(number).start);
    }
    assert_eq!((sector(0).start, sector(SECTORS - 1).end), (0, 1 << 20));
}

#[test]
fn each_sector_is_erased_separately() {
    for number in 0..SECTORS {
        let mut flash = flash(0x5a);
        let Range { start, end } = sector(number);
        assert_eq!(flash.erase(start, end), Ok(()), "{number}");
        let mut expected = vec![0x5a; flash.capacity()];
        expected[start as usize..end as usize].fill(0xff);
        assert!(flash.part.bytes() == expected && is_at_rest(&flash), "{number}");
    }
    // Several sectors, relative to the writable memory.
    let mut flash = Flash::new(Model::new(vec![0; 4 * LARGE as usize], 4 * LARGE, 1), 4 * LARGE);
    assert_eq!(flash.erase(LARGE, 3 * LARGE), Ok(()));
    let erased: Vec<bool> = flash.part.bytes().chunks(LARGE as usize).map(|part| part[0] == 0xff).collect();
    assert_eq!(erased, [false, true, true, false]);
}

#[test]
fn a_word_is_programmed_once() {
    let mut flash = flash(0xff);
    assert_eq!(flash.write(8, b"flash___"), Ok(()));
    let mut bytes = [0; 10];
    assert_eq!(flash.read(7, &mut bytes), Ok(()));
    assert_eq!((&bytes, is_at_rest(&flash)), (b"\xffflash___\xff", true));
    let before = flash.part.power.done;
    assert_eq!(flash.write(12, &[0; 4]), Err(FlashError::Programmed));
    assert_eq!(flash.part.power.done, before, "nothing was told");
}

#[test]
fn misaligned_and_out_of_bounds_requests_are_refused() {
    use FlashError::{Alignment, Bounds};
    let mut flash = flash(0xff);
    let end = flash.capacity() as u32;
    assert_eq!([flash.write(2, &[0; 4]), flash.write(4, &[0; 3])], [Err(Alignment); 2]);
    assert_eq!([flash.write(end, &[0; 4]), flash.write(u32::MAX - 3, &[0; 8])], [Err(Bounds); 2]);
    assert_eq!([flash.erase(0, 4), flash.erase(4, LARGE), flash.erase(0, 3 * LARGE - 4)], [Err(Alignment); 3]);
    assert_eq!([flash.erase(LARGE, 0), flash.erase(0, end + LARGE)], [Err(Bounds); 2]);
    assert_eq!((flash.erase(LARGE, LARGE), flash.read(end, &mut [0])), (Ok(()), Err(Bounds)));
    assert_eq!(flash.part.power.done, 0);
}

/// A failed precondition refuses the request, with nothing written to the controller.
#[test]
fn unsafe_requests_do_not_start() {
    let refused = |change: fn(&mut Model)| {
        let mut flash = flash(0xff);
        change(&mut flash.part);
        let outcomes = [flash.erase(0, LARGE), flash.write(0, &[0; 4])];
        (outcomes, flash.part.power.done)
    };
    assert_eq!(refused(|part| part.is_driving = true), ([Err(FlashError::Driving); 2], 0));
    assert_eq!(refused(|part| part.is_supplied = false), ([Err(FlashError::Supply); 2], 0));
    // A word needs no other timeout.
    let (outcomes, _) = refused(|part| part.accepts_timeout = false);
    assert_eq!(outcomes, [Err(FlashError::Watchdog), Ok(())]);
}

#[test]
fn controller_errors_are_named_and_lock_it() {
    for (flags, error) in [
        (WRPERR, FlashError::WriteProtected),
        (PGAERR, FlashError::Row),
        (PGPERR, FlashError::Parallelism),
        (PGSERR, FlashError::Sequence),
    ] {
        let mut flash = flash(0xff);
        flash.part.raises = flags;
        assert_eq!([flash.erase(0, LARGE), flash.write(0, &[0; 8])], [Err(error); 2]);
        assert!(is_at_rest(&flash), "{error}");
        // The flags of one request do not affect the next one.
        flash.part.raises = 0;
        assert_eq!([flash.write(0, &[0; 8]), flash.erase(0, LARGE)], [Ok(()); 2], "{error}");
    }
    let mut flash = flash(0xff);
    flash.part.protected = 1 << 3;
    let Range { start, end } = sector(3);
    assert_eq!([flash.erase(start, end), flash.write(start, &[0; 4])], [Err(FlashError::WriteProtected); 2]);
    assert_eq!(flash.write(end, &[0; 4]), Ok(()));
}

#[test]
fn a_hung_locked_or_missing_controller_is_detected() {
    let mut endless = flash(0xff);
    endless.part.takes = u32::MAX;
    assert_eq!(endless.write(0, &[0; 4]), Err(FlashError::Busy));
    // During an erase the watchdog detects it.
    assert_eq!((endless.erase(0, LARGE), endless.part.is_reset), (Err(FlashError::Watchdog), true));
    let mut locked = flash(0xff);
    locked.part.write(Register::Key, KEYS[1]);
    assert_eq!([locked.erase(0, LARGE), locked.write(0, &[0; 4])], [Err(FlashError::Locked); 2]);
    locked.part = locked.part.restarted();
    assert_eq!(locked.write(0, &[0; 4]), Ok(()));
    let mut none = flash(0xff);
    none.part.exists = false;
    assert_eq!([none.erase(0, LARGE), none.write(0, &[0; 4])], [Err(FlashError::Settings); 2]);
}

/// The watchdog waits for the data sheet's erase time, and is not fed after a longer erase.
#[test]
fn an_overlong_erase_ends_in_a_reset() {
    for number in 0..SECTORS {
        let Range { start, end } = sector(number);
        let erased_in = |milliseconds| {
            let mut flash = flash(0);
            flash.part.takes = milliseconds;
            (flash.erase(start, end), flash.part.is_reset)
        };
        let longest = longest_erase(number).into();
        assert_eq!(erased_in(longest), (Ok(()), false), "{number}");
        assert_eq!(erased_in(longest + 1), (Err(FlashError::Watchdog), true), "{number}");
    }
}

/// The model enforces the rules of the part that the sequences follow.
#[test]
fn the_model_refuses_what_the_part_refuses() {
    let outcome_of = |control: &[u32], at| {
        let mut part = Model::new(vec![0xff; 64], 0, 1);
        if !control.is_empty() {
            KEYS.into_iter().for_each(|key| part.write(Register::Key, key));
        }
        control.iter().for_each(|control| part.write(Register::Control, *control));
        part.program(at, 0);
        let written = part.bytes().contains(&0);
        (part.read(Register::Status) & !BSY, written)
    };
    assert_eq!(outcome_of(&[], 0), (PGSERR, false), "locked");
    assert_eq!(outcome_of(&[WORDS], 0), (PGSERR, false), "without PG");
    assert_eq!(outcome_of(&[PG | WORDS, LOCK], 0), (PGSERR, false), "locked again");
    assert_eq!(outcome_of(&[PG], 0), (PGPERR, false), "bytes");
    assert_eq!(outcome_of(&[PG | WORDS], 14), (PGAERR, false), "over two rows");
    assert_eq!(outcome_of(&[PG | WORDS], 12), (0, true));
}

/// If the supply fails during a request, nothing outside it changes, and it can be repeated.
#[test]
fn an_interrupted_request_can_be_repeated() {
    let (slot, other) = (8 * LARGE - LARGE, 6 * LARGE);
    let mut fresh = Flash::new(Model::new(vec![0x33; 2 * LARGE as usize], other, 5), other);
    fresh.part.takes = 1;
    let words: Vec<u8> = (0..40).collect();
    let request = |flash: &mut Flash<Model>| {
        flash.erase(slot - other, slot - other + LARGE).and_then(|()| flash.write(LARGE + 8, &words))
    };
    let mut whole = fresh.clone();
    assert_eq!(request(&mut whole), Ok(()));
    for fails_at in 0..whole.part.power.done {
        let mut flash = fresh.clone();
        flash.part.power.fails_at = Some(fails_at);
        // Only what closes the controller, and the four writes that empty the caches, may be missing.
        let outcome = request(&mut flash);
        assert_eq!(outcome.is_ok(), fails_at + 5 >= whole.part.power.done, "{fails_at}");
        assert!(flash.part.bytes()[..LARGE as usize].iter().all(|byte| *byte == 0x33), "{fails_at}");
        flash.part = flash.part.restarted();
        assert_eq!(request(&mut flash), Ok(()), "{fails_at}");
        assert!(flash.part.bytes() == whole.part.bytes() && is_at_rest(&flash), "{fails_at}");
    }
}
