//! Updates over a line that loses and repeats requests, and refused updates.

use actq_controller::slots::{Anyone, Layout, LayoutError, Slot, Slots, TRIALS, Updater, Work};
use actq_controller::update::{Plan, Update};
use actq_link::code::Refusal;
use actq_testkit::{Nor, Random};
use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError as _, NorFlashErrorKind, ReadNorFlash};

use super::device::{BUILD, Device, Image};

type Flash = Nor<4, 1024>;

fn flash() -> (Flash, Layout) {
    let flash = Flash::new(4, 5);
    let layout = Layout::new(&flash, 0..2048, 2048..4096).expect("the slots are valid");
    (flash, layout)
}

#[test]
fn lost_and_repeated_chunks_give_the_image() {
    let mut random = Random::new(6);
    for round in 0..200 {
        let (mut flash, layout) = flash();
        let mut device = Device::start(&mut flash, &layout, Anyone);
        let image = Image::new(1 + random.below(400), 1, true);
        device.wait(|updater| updater.begin(image.plan())).expect("the image fits");
        let mut known = 0;
        while known < image.bytes.len() {
            // A host that missed acknowledgements, or is ahead.
            let offset = match random.below(4) {
                0 => random.below(known + 1),
                1 => (known + random.below(9)).min(image.bytes.len() - 1),
                _ => known,
            };
            let end = (offset + 1 + random.below(70)).min(image.bytes.len());
            let outcome = device.updater.chunk(offset as u32, &image.bytes[offset..end]);
            let taken = device.updater.written() as usize;
            match outcome {
                Ok(()) => assert!(taken >= end),
                Err(refusal) => assert_eq!((refusal, taken), (Refusal::Offset, known)),
            }
            known = taken;
        }
        assert_eq!(device.wait(|updater| updater.commit(None)), Ok(()), "round {round}");
        // The acknowledgement was lost, and the host repeats the request.
        assert_eq!(device.updater.commit(None), Ok(()));
        assert_eq!(device.runs.as_ref(), Some(&image.bytes));
    }
}

/// Flash that fails one write, and works again.
struct Failing<'f> {
    flash: &'f mut Flash,
    /// Writes until the one that fails.
    left: Option<usize>,
}

impl ErrorType for Failing<'_> {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Failing<'_> {
    const READ_SIZE: usize = Flash::READ_SIZE;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        self.flash.read(offset, bytes).map_err(|error| error.kind())
    }

    fn capacity(&self) -> usize {
        self.flash.capacity()
    }
}

impl NorFlash for Failing<'_> {
    const WRITE_SIZE: usize = Flash::WRITE_SIZE;
    const ERASE_SIZE: usize = Flash::ERASE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        self.flash.erase(from, to).map_err(|error| error.kind())
    }

    /// The write that fails has written its bytes, as one that a sinking supply interrupts may have.
    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        self.flash.write(offset, bytes).map_err(|error| error.kind())?;
        let fails = self.left == Some(0);
        self.left = self.left.and_then(|left| left.checked_sub(1));
        if fails { Err(NorFlashErrorKind::Other) } else { Ok(()) }
    }
}

/// An update that was refused because one write failed does not run after the next start.
#[test]
fn failed_updates_are_not_tried_at_start() {
    let (old, new) = (Image::new(40, 1, true), Image::new(40, 2, true));
    let mut refused = 0;
    for write in 0.. {
        let (mut flash, layout) = flash();
        assert_eq!(Device::start(&mut flash, &layout, Anyone).update(&old, 64, None), Ok(()));
        let mut device = Device::start(Failing { flash: &mut flash, left: Some(write) }, &layout, Anyone);
        let outcome = device.update(&new, 64, None);
        if outcome.is_ok() {
            break;
        }
        assert_eq!(outcome, Err(Refusal::Flash), "write {write}");
        refused += 1;
        assert_eq!(device.updater.commit(None), Err(Refusal::Flash), "asked again");
        drop(device);
        let mut device = Device::start(&mut flash, &layout, Anyone);
        let confirmed = device.updater.slots().least_version() == 2;
        // But for the last write, the confirmation, which nothing takes back.
        assert_eq!(device.runs.as_ref() == Some(&new.bytes), confirmed, "write {write}");
        if !confirmed {
            assert_eq!(device.update(&new, 64, None), Ok(()), "write {write}");
        }
    }
    assert!(refused > 3, "{refused} writes");
}

#[test]
fn a_push_after_a_failed_write_begins_again() {
    let (mut flash, layout) = flash();
    let image = Image::new(40, 1, true);
    let mut device = Device::start(Failing { flash: &mut flash, left: Some(0) }, &layout, Anyone);
    assert_eq!(device.update(&image, 64, None), Err(Refusal::Flash));
    assert_eq!(device.update(&image, 64, None), Ok(()));
}

#[test]
fn an_abort_does_not_stop_a_test() {
    let (mut flash, layout) = flash();
    let image = Image::new(40, 1, true);
    let mut device = Device::start(&mut flash, &layout, Anyone);
    device.wait(|updater| updater.begin(image.plan())).expect("the image fits");
    assert_eq!(device.updater.chunk(0, &image.bytes), Ok(()));
    assert_eq!(device.updater.commit(None), Err(Refusal::Busy));
    while device.updater.work() == Work::More {}
    assert_eq!(device.updater.abort(), Err(Refusal::Busy));
    assert!(device.updater.tested(Ok(())));
    assert_eq!(device.updater.commit(None), Ok(()));
}

/// Works until the next request, or test; returns before each step, and at the end, whether the step takes long.
fn long_steps(updater: &mut Updater<&mut Flash, Anyone>) -> Vec<bool> {
    let mut long = vec![updater.takes_long()];
    while updater.work() == Work::More {
        long.push(updater.takes_long());
    }
    long
}

/// Each sector's erase, the last of the two blocks, with the check of the signature, and the test. Meanwhile, the
/// updater is busy.
#[test]
fn steps_that_take_long_are_known_before() {
    let (mut flash, layout) = flash();
    let image = Image::new(128, 1, true);
    let mut updater = Device::start(&mut flash, &layout, Anyone).updater;
    assert_eq!((updater.is_busy(), updater.begin(image.plan())), (false, Err(Refusal::Busy)));
    assert_eq!((updater.is_busy(), updater.chunk(0, &[0; 4]), updater.written()), (true, Err(Refusal::Busy), 0));
    assert_eq!(long_steps(&mut updater), [true, true, false]);
    assert_eq!((updater.is_busy(), updater.chunk(0, &image.bytes)), (false, Ok(())));
    assert_eq!(updater.commit(None), Err(Refusal::Busy));
    for phase in [&[false, true, true][..], &[true]] {
        assert_eq!(
            (updater.is_busy(), updater.begin(image.plan()), updater.written()),
            (true, Err(Refusal::Busy), 512)
        );
        assert_eq!(long_steps(&mut updater), phase);
    }
    assert!(updater.tested(Ok(())));
    assert_eq!((updater.is_busy(), updater.takes_long(), updater.written()), (false, false, 512));
}

/// A repeated one continues.
#[test]
fn another_announcement_begins_again() {
    let (mut flash, layout) = flash();
    let [first, second] = [1, 2].map(|version| Image::new(100, version, true).plan());
    let mut updater = Device::start(&mut flash, &layout, Anyone).updater;
    for plan in [first, second] {
        assert_eq!(updater.begin(plan), Err(Refusal::Busy));
        assert_eq!((updater.work(), updater.begin(plan)), (Work::More, Err(Refusal::Busy)));
        assert_eq!(long_steps(&mut updater).len(), 2, "one of two sectors is left");
    }
    assert_eq!((updater.begin(second), updater.begin(first)), (Ok(()), Err(Refusal::Busy)));
    assert_eq!((updater.begin(second), long_steps(&mut updater).len()), (Err(Refusal::Busy), 3));
    assert_eq!((updater.begin(second), updater.chunk(0, &[0; 4])), (Ok(()), Ok(())));
    assert_eq!(updater.begin(second), Err(Refusal::Busy), "its first bytes were taken");
}

/// A failed erase is told once, to the host that asked for it.
#[test]
fn a_failed_erase_is_told_once() {
    let (mut flash, layout) = flash();
    let [first, second] = [1, 2].map(|version| Image::new(100, version, true).plan());
    flash.power.fails_at = Some(0);
    let mut updater = Device::start(&mut flash, &layout, Anyone).updater;
    for (asked, told) in [(first, Refusal::Flash), (second, Refusal::Busy)] {
        assert_eq!((updater.begin(first), updater.work()), (Err(Refusal::Busy), Work::More));
        assert_eq!(updater.begin(asked), Err(told));
    }
}

#[test]
fn an_image_may_fill_its_slot() {
    let (mut flash, layout) = flash();
    let image = Image::new((2048 - 256) / 4, 1, true);
    assert_eq!(Device::start(&mut flash, &layout, Anyone).update(&image, 400, None), Ok(()));
    assert_eq!(Device::start(&mut flash, &layout, Anyone).runs, Some(image.bytes));
}

#[test]
fn a_refused_update_changes_nothing() {
    let (mut flash, layout) = flash();
    let mut device = Device::start(&mut flash, &layout, Anyone);
    let image = Image::new(100, 5, true);
    assert_eq!(device.updater.chunk(0, &[1; 4]), Err(Refusal::NoUpdate));
    assert_eq!(device.updater.commit(None), Err(Refusal::NoUpdate));
    assert_eq!(device.update(&image, 100, None), Ok(()));
    let plan = image.plan();
    let room = 2048 - 256;
    for length in [0, 2, 3, 401, room + 4, u32::MAX, u32::MAX - 3] {
        assert_eq!(device.updater.begin(Plan { length, ..plan }), Err(Refusal::Length), "{length}");
    }
    assert_eq!(device.updater.begin(Plan { version: 4, ..plan }), Err(Refusal::Rollback));
    device.wait(|updater| updater.begin(plan)).expect("the same version is allowed again");
    assert_eq!(device.updater.chunk(396, &[0; 5]), Err(Refusal::Length));
    assert_eq!(device.updater.chunk(u32::MAX, &[0; 5]), Err(Refusal::Length));
    assert_eq!(device.updater.chunk(4, &[0; 4]), Err(Refusal::Offset));
    assert_eq!(device.updater.commit(None), Err(Refusal::Length), "the image is incomplete");
    let mut other = image.bytes.clone();
    other[17] ^= 1;
    assert_eq!(device.updater.chunk(0, &other), Ok(()));
    assert_eq!(device.wait(|updater| updater.commit(None)), Err(Refusal::Checksum));
    assert_eq!(device.wait(|updater| updater.commit(None)), Err(Refusal::Checksum), "asked again");
    assert_eq!(device.updater.abort(), Ok(()));
    assert_eq!(device.updater.commit(None), Err(Refusal::NoUpdate));
    drop(device);
    assert_eq!(Device::start(&mut flash, &layout, Anyone).runs, Some(image.bytes));
}

/// The newest image does not run, so that an update erases it, and with it the record of the highest version.
#[test]
fn an_erased_version_counts_until_the_next_start() {
    let (mut flash, layout) = flash();
    let [old, newest] = [1, 5].map(|version| Image::new(100, version, true));
    let mut device = Device::start(&mut flash, &layout, Anyone);
    for image in [&old, &newest] {
        assert_eq!(device.update(image, 100, None), Ok(()));
    }
    // The second image is in slot B, after its record.
    flash.bytes[2048 + 256] ^= 1;
    let mut device = Device::start(&mut flash, &layout, Anyone);
    assert_eq!(device.runs.as_ref(), Some(&old.bytes));
    device.wait(|updater| updater.begin(newest.plan())).expect("the same version is allowed");
    assert_eq!(device.updater.abort(), Ok(()));
    let older = Image::new(100, 4, true);
    assert_eq!(device.update(&older, 100, None), Err(Refusal::Rollback));
    assert_eq!(device.update(&newest, 100, None), Ok(()));
}

#[test]
fn an_image_that_fails_its_test_never_runs() {
    let (mut flash, layout) = flash();
    let (good, bad) = (Image::new(100, 1, true), Image::new(90, 2, false));
    let mut device = Device::start(&mut flash, &layout, Anyone);
    assert_eq!(device.update(&good, 64, None), Ok(()));
    assert_eq!(device.update(&bad, 64, None), Err(Refusal::SelfTest));
    assert_eq!(device.runs.as_ref(), Some(&good.bytes));
    // Its version does not count, because it never ran.
    assert_eq!(device.updater.slots().least_version(), 1);
    drop(device);
    let before = flash.bytes.clone();
    assert_eq!(Device::start(&mut flash, &layout, Anyone).runs, Some(good.bytes));
    assert_eq!(flash.bytes, before, "not tried again");
}

#[test]
fn the_other_image_replaces_a_decayed_one() {
    let (mut flash, layout) = flash();
    let images = [Image::new(100, 1, true), Image::new(100, 2, true)];
    for image in &images {
        assert_eq!(Device::start(&mut flash, &layout, Anyone).update(image, 64, None), Ok(()));
    }
    for bit in 0..8 * (256 + 400) {
        let mut decayed = flash.clone();
        decayed.bytes[2048 + bit / 8] ^= 1 << (bit % 8);
        let runs = Device::start(&mut decayed, &layout, Anyone).runs;
        let image = bit / 8 >= 256;
        assert!(runs.as_ref() == Some(&images[0].bytes) || (!image && runs.as_ref() == Some(&images[1].bytes)));
        assert!(!image || runs.as_ref() == Some(&images[0].bytes), "bit {bit} of the image");
    }
}

/// An image of another build has the limits of another built-in image in mind. A record of older firmware has build 0.
#[test]
fn an_image_of_another_build_does_not_run() {
    for other in [0, BUILD + 1] {
        let (mut flash, layout) = flash();
        let [old, new] = [5, 6].map(|version| Image::new(100, version, true));
        let mut device = Device::start_build(&mut flash, &layout, Anyone, other);
        assert_eq!(device.update(&old, 64, None), Ok(()));
        let before = flash.bytes.clone();
        let mut device = Device::start(&mut flash, &layout, Anyone);
        assert_eq!((device.runs.as_ref(), device.updater.running()), (None, None));
        assert_eq!(device.update(&Image::new(100, 4, true), 64, None), Err(Refusal::Rollback), "its version counts");
        drop(device);
        assert_eq!(flash.bytes, before, "nothing is written");
        assert_eq!(Device::start(&mut flash, &layout, Anyone).update(&new, 64, None), Ok(()));
        assert_eq!(Device::start(&mut flash, &layout, Anyone).runs, Some(new.bytes));
        assert_eq!(Device::start_build(&mut flash, &layout, Anyone, other).runs, Some(old.bytes), "flashed back");
    }
}

/// The firmware feeds its watchdog at these calls.
#[test]
fn a_start_reports_progress_before_each_block() {
    let (mut flash, layout) = flash();
    for version in [1, 2] {
        let image = Image::new(100, version, true);
        assert_eq!(Device::start(&mut flash, &layout, Anyone).update(&image, 64, None), Ok(()));
    }
    let (mut slots, mut told) = (Slots::new(&mut flash, layout, Anyone, BUILD), Vec::new());
    for _ in 0..3 {
        let mut blocks = 0;
        let found = slots.select(|| blocks += 1).map(|candidate| candidate.slot);
        told.push((found, blocks));
        found.into_iter().for_each(|slot| slots.reject(slot));
    }
    // 400 bytes are two blocks.
    assert_eq!(told, [(Some(Slot::B), 2), (Some(Slot::A), 2), (None, 0)]);
}

#[test]
fn flash_with_arbitrary_content_has_no_image() {
    for seed in 0..500 {
        let mut flash = Flash::new(4, seed);
        let layout = Layout::new(&flash, 0..2048, 2048..4096).expect("the slots are valid");
        if seed == 0 {
            flash.bytes.fill(0xff);
        }
        assert_eq!(Device::start(&mut flash, &layout, Anyone).runs, None);
        assert_eq!(flash.power.done, 0, "nothing is written");
    }
}

#[test]
fn the_running_slot_is_never_erased() {
    let (mut flash, layout) = flash();
    for version in 1..6 {
        let mut device = Device::start(&mut flash, &layout, Anyone);
        let running = device.updater.running();
        let before = running.map(|slot| {
            let range = layout.range(slot);
            let mut bytes = vec![0; (range.end - range.start) as usize];
            embedded_storage::nor_flash::ReadNorFlash::read(device.updater.slots().flash(), range.start, &mut bytes)
                .expect("the image is within the flash");
            (range.clone(), bytes)
        });
        assert_eq!(device.update(&Image::new(50, version, true), 64, None), Ok(()));
        assert_eq!(device.updater.running(), Some(running.map_or(Slot::A, Slot::other)));
        drop(device);
        if let Some((range, bytes)) = before {
            assert_eq!(flash.bytes[range.start as usize..range.end as usize], bytes);
        }
    }
    assert_eq!(TRIALS, 3, "docs/SAFETY.md says so");
}

#[test]
fn invalid_slots_are_refused() {
    fn case<F: NorFlash>(flash: &F, a: (u32, u32), b: (u32, u32)) -> Option<LayoutError> {
        Layout::new(flash, a.0..a.1, b.0..b.1).err()
    }
    let flash = Flash::new(4, 0);
    assert_eq!(case(&flash, (0, 1024), (1024, 4096)), None);
    assert_eq!(case(&flash, (0, 1000), (1024, 2048)), Some(LayoutError::Sector));
    assert_eq!(case(&flash, (4, 1024), (1024, 2048)), Some(LayoutError::Sector));
    assert_eq!(case(&flash, (0, 2048), (1024, 3072)), Some(LayoutError::Overlap));
    assert_eq!(case(&flash, (0, 1024), (0, 1024)), Some(LayoutError::Overlap));
    assert_eq!(case(&flash, (0, 0), (1024, 2048)), Some(LayoutError::Size));
    assert_eq!(case(&flash, (2048, 1024), (2048, 3072)), Some(LayoutError::Size));
    assert_eq!(case(&flash, (0, 1024), (3072, 5120)), Some(LayoutError::Size));
    assert_eq!(case(&Nor::<64, 1024>::new(4, 0), (0, 1024), (1024, 2048)), Some(LayoutError::Granularity));
    // The 128 KiB sectors of an STM32F405, with two slots of two sectors each.
    const SECTOR: u32 = 128 << 10;
    let f405 = Nor::<4, { SECTOR as usize }>::new(5, 0);
    assert_eq!(case(&f405, (SECTOR, 3 * SECTOR), (3 * SECTOR, 5 * SECTOR)), None);
    assert_eq!(case(&f405, (16 << 10, 3 * SECTOR), (3 * SECTOR, 5 * SECTOR)), Some(LayoutError::Sector));
    let layout = Layout::new(&Flash::new(4, 0), 0..1024, 1024..2048).expect("the slots are valid");
    drop(Slots::new(flash, layout, Anyone, BUILD));
}
