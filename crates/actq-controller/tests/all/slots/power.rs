//! Power failures during each change that a sequence of updates makes to the flash, and again during the following
//! start.

use actq_boards::stm32f405::flash::Flash;
use actq_boards::stm32f405::flash::model::Model;
use actq_controller::slots::{Anyone, Layout, Slot};
use actq_link::code::Refusal;
use actq_testkit::Nor;

use super::device::{BUILD, Device, Image};
use super::flash::Fails;

/// Returns images in sequence; the third and the fifth fail their test.
fn images() -> Vec<Image> {
    let passes = [true, true, false, true, false, true];
    passes.iter().enumerate().map(|(i, passes)| Image::new(80 + 7 * i, 1 + i as u32, *passes)).collect()
}

/// The images that may run, as the host knows.
struct Known {
    /// The last acknowledged image.
    acknowledged: Option<Image>,
    /// The image of the interrupted update, which may also run.
    in_flight: Option<Image>,
}

impl Known {
    fn check(&self, runs: Option<&Vec<u8>>, what: &str) {
        let is = |image: &Option<Image>| image.as_ref().map(|image| &image.bytes) == runs;
        assert!(is(&self.acknowledged) || (runs.is_some() && is(&self.in_flight)), "{what}");
    }
}

/// Updates to each image in turn until power fails.
fn updates<F: Fails>(flash: &mut F, fails_at: Option<usize>, layout: &Layout, images: &[Image], known: &mut Known) {
    flash.restart(fails_at);
    let mut device = Device::start(&mut *flash, layout, Anyone);
    for image in images {
        known.in_flight = (image.bytes[0] == 1).then(|| image.clone());
        let outcome = device.update(image, 60, None);
        let died = device.updater.slots().flash().done() > fails_at.unwrap_or(usize::MAX);
        match outcome {
            Ok(()) => known.acknowledged = known.in_flight.take(),
            Err(Refusal::SelfTest) if image.bytes[0] == 0 => known.in_flight = None,
            Err(refusal) => assert!(died, "{refusal}"),
        }
        if died {
            return;
        }
        known.check(device.runs.as_ref(), "while running");
    }
}

/// Checks all power failures, with arbitrary flash content for each seed.
fn check_all_cuts<F: Fails>(seeds: u64) {
    let images = images();
    // Each slot has two sectors, with others before, between and after them.
    let s = F::ERASE_SIZE as u32;
    let layout = Layout::new(&F::new(7, 0), s..3 * s, 4 * s..6 * s).expect("the slots are valid");
    let mut whole = F::new(7, 0);
    updates(&mut whole, None, &layout, &images, &mut Known { acknowledged: None, in_flight: None });
    let changes = whole.done();
    assert!(changes > images.len() * (4 * 80 / F::WRITE_SIZE + 2 + 128 / F::WRITE_SIZE + 2), "{changes}");
    for seed in 0..seeds {
        let fresh = F::new(7, seed);
        let outside = |flash: &F| {
            let bytes = flash.bytes();
            [0..s, 3 * s..4 * s, 6 * s..7 * s].map(|part| bytes[part.start as usize..part.end as usize].to_vec())
        };
        let others = outside(&fresh);
        for fails_at in 0..changes {
            let mut flash = fresh.clone();
            let mut known = Known { acknowledged: None, in_flight: None };
            updates(&mut flash, Some(fails_at), &layout, &images, &mut known);
            let what = format!("power fails at change {fails_at}, {seed}");
            // Power also fails during each of the few changes of the following start.
            for again in 0.. {
                let mut once_more = flash.clone();
                once_more.restart(Some(again));
                drop(Device::start(&mut once_more, &layout, Anyone));
                let ended = once_more.done() <= again;
                once_more.restart(None);
                let device = Device::start(&mut once_more, &layout, Anyone);
                known.check(device.runs.as_ref(), &format!("{what}, then at {again} of the start"));
                if ended {
                    break;
                }
            }
            // The host continues with the last image, which was not acknowledged.
            flash.restart(None);
            let mut device = Device::start(&mut flash, &layout, Anyone);
            known.check(device.runs.as_ref(), &what);
            let last = images.last().expect("there are images");
            assert_eq!(device.update(last, 52, None), Ok(()), "{what}");
            assert_eq!(device.runs.as_ref(), Some(&last.bytes), "{what}");
            drop(device);
            assert!(outside(&flash) == others, "{what}: only the slots are written");
        }
    }
}

#[test]
fn power_failures_lose_no_acknowledged_update() {
    // Words. QSPI flash: bytes. STM32H5 and U5: 16 bytes.
    check_all_cuts::<Nor<4, 512>>(3);
    check_all_cuts::<Nor<1, 512>>(3);
    check_all_cuts::<Nor<16, 1024>>(3);
}

/// The same check for the registers and the 128 KB sectors of an STM32F405.
#[test]
fn power_failures_on_an_stm32f405_lose_no_update() {
    check_all_cuts::<Flash<Model>>(1);
}

/// The slots of the STM32F405's linker script: two sectors each, minus a header.
#[test]
fn an_stm32f405_image_has_at_most_261888_bytes() {
    let flash = <Flash<Model> as Fails>::new(4, 0);
    let middle = flash.bytes().len() as u32 / 2;
    let layout = Layout::new(&flash, 0..middle, middle..2 * middle).expect("the slots are valid");
    assert_eq!(Slot::BOTH.map(|slot| layout.room(slot)), [261_888; 2], "docs/BOARDS.md says so");
}

/// Power fails during the trial of a new image at every start: after three trials the image is given up, and the old
/// one runs.
#[test]
fn an_image_is_given_up_after_three_trials() {
    let mut flash = Nor::<4, 1024>::new(2, 1);
    let layout = Layout::new(&flash, 0..1024, 1024..2048).expect("the slots are valid");
    let (old, new) = (Image::new(50, 1, true), Image::new(60, 2, true));
    assert_eq!(Device::start(&mut flash, &layout, Anyone).update(&old, 64, None), Ok(()));
    // Up to the last change before the confirmation.
    let mut trial = flash.clone();
    assert_eq!(Device::start(&mut trial, &layout, Anyone).update(&new, 64, None), Ok(()));
    (flash.power.fails_at, trial) = (Some(trial.power.done - 1), flash.clone());
    drop(trial);
    assert_eq!(Device::start(&mut flash, &layout, Anyone).update(&new, 64, None), Err(Refusal::Flash));
    let mut slots = 0;
    for start in 0..4 {
        flash.power.fails_at = None;
        let mut chosen = actq_controller::slots::Slots::new(&mut flash, layout.clone(), Anyone, BUILD);
        let candidate = chosen.select(|| ()).expect("one of the images runs");
        slots += u32::from(candidate.trial);
        // The update itself was the first trial.
        assert_eq!((candidate.version, candidate.trial), if start < 2 { (2, true) } else { (1, false) }, "{start}");
    }
    assert_eq!(slots, 2);
}
