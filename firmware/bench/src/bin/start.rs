//! The application's long work, in pieces between which the watchdog is fed: the check of an image from the link, the
//! start that reads two slots, an image's check, the slices of its self-test. Each is a counted region whose name is
//! printed.
//!
//! The image is the one in the slot; standard input provides a public key and the signature of the image with version
//! 1.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("this is firmware: build it with --target thumbv7em-none-eabihf");
    std::process::exit(1);
}

#[cfg(target_os = "none")]
mod firmware {
    actq_firmware_support::panic_to_host!();

    use core::cell::Cell;
    use core::fmt::Write as _;

    use actq_boards::hal::Watchdog;
    use actq_boards::ram::Ram;
    use actq_controller::slots::{Key, Layout, Slot, Slots, Updater, Work};
    use actq_controller::update::{Plan, Update as _};
    use actq_firmware_demo::image;
    use actq_firmware_support::{count, host, slot};
    use actq_kernels::Image;
    use actq_link::code::Refusal;
    use actq_link::frame::CRC;
    use cortex_m::singleton;

    const SECTOR: usize = 128 << 10;
    const SCRATCH: usize = 24 * 1024;

    type Flash = Ram<'static, 4, SECTOR>;

    #[cortex_m_rt::entry]
    fn main() -> ! {
        host::exit(run().is_some())
    }

    fn run() -> Option<()> {
        let (image, input, mut names) = (slot::image()?, host::File::open(c":tt", false)?, host::stdout()?);
        let (mut key, mut signature) = ([0; 32], [0; 64]);
        if !(input.read_exact(&mut key) && input.read_exact(&mut signature)) {
            return None;
        }
        writeln!(names, "key").ok()?;
        count::region(|| Key::new(&key).ok())?;
        let memory = singleton!(: [u8; 4 * SECTOR] = [0; 4 * SECTOR])?;
        let memory = Cell::from_mut(&mut memory[..]).as_slice_of_cells();
        let slots = || {
            let (flash, middle) = (Ram(memory), 2 * SECTOR as u32);
            let layout = Layout::new::<Flash>(&flash, 0..middle, middle..2 * middle).ok()?;
            Some(Slots::new(flash, layout, Key::new(&key).ok()?, 0))
        };
        for running in [None, Some(Slot::A)] {
            update(Updater::new(slots()?, running), image, &signature, &mut names)?;
        }
        let (mut slots, mut pieces) = (slots()?, 0);
        for _ in Slot::BOTH {
            count::actq_count_begin();
            let found = slots.select(|| {
                count::actq_count_end();
                pieces += 1;
                count::actq_count_begin();
            });
            count::actq_count_end();
            pieces += 1;
            slots.reject(found?.slot);
        }
        (0..pieces).try_for_each(|_| writeln!(names, "start")).ok()?;
        let scratch = singleton!(: [u32; SCRATCH] = [0; SCRATCH])?;
        let header = Image::new_checked(image).ok()?;
        let (lengths, mut feeds) = ([header.obs_len(), header.act_len()], Feeds(0));
        count::actq_count_begin();
        let opened = image::open(image, scratch, lengths, &mut feeds).is_ok();
        count::actq_count_end();
        // Before the first feeding there is no work; then follows the check.
        writeln!(names, "turn\nimage").ok()?;
        (1..feeds.0).try_for_each(|_| writeln!(names, "slice")).ok()?;
        opened.then_some(())
    }

    /// A watchdog that ends a region and begins one at each feeding.
    struct Feeds(usize);

    impl Watchdog for Feeds {
        fn start(&mut self, _: u16) -> bool {
            true
        }

        fn feed(&mut self) {
            count::actq_count_end();
            self.0 += 1;
            count::actq_count_begin();
        }
    }

    /// Makes an update until its acknowledgement.
    fn update(
        mut updater: Updater<Flash, Key>,
        image: &[u8],
        signature: &[u8; 64],
        names: &mut host::File,
    ) -> Option<()> {
        let plan = Plan { length: image.len() as u32, crc: CRC.checksum(image), version: 1 };
        while updater.begin(plan) == Err(Refusal::Busy) {
            updater.work();
        }
        updater.chunk(0, image).ok()?;
        while updater.commit(Some(signature)) == Err(Refusal::Busy) {
            writeln!(names, "{}", if updater.takes_long() { "long" } else { "turn" }).ok()?;
            if let Work::Test(_) = count::region(|| updater.work()) {
                updater.tested(Ok(()));
            }
        }
        updater.commit(Some(signature)).ok()
    }
}
