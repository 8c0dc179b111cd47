//! A device with two slots: its firmware's start and updates.

use actq_controller::slots::{Authority, Candidate, Layout, Slots, Updater, Work};
use actq_controller::update::{Plan, Update};
use actq_link::code::Refusal;
use embedded_storage::nor_flash::NorFlash;

/// The firmware's build.
pub(super) const BUILD: u32 = 7;

/// Bytes in place of an image. The first one decides the outcome of its self-test.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Image {
    pub(super) bytes: Vec<u8>,
    pub(super) version: u32,
}

impl Image {
    pub(super) fn new(words: usize, version: u32, passes: bool) -> Self {
        let mut bytes: Vec<u8> = (0..4 * words).map(|i| (i as u32 * 31 + version * 7) as u8).collect();
        bytes[0] = passes.into();
        bytes[1..4].copy_from_slice(b"img");
        Self { bytes, version }
    }

    pub(super) fn plan(&self) -> Plan {
        let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&self.bytes);
        Plan { length: self.bytes.len() as u32, crc, version: self.version }
    }
}

fn read<F: NorFlash, A: Authority>(slots: &mut Slots<F, A>, image: &Candidate) -> Vec<u8> {
    let mut bytes = vec![0; image.length as usize];
    slots.flash().read(image.address, &mut bytes).expect("the image is inside the flash");
    bytes
}

fn self_test(image: &[u8]) -> Result<(), Refusal> {
    if image.starts_with(b"\x01img") { Ok(()) } else { Err(Refusal::SelfTest) }
}

/// A device after its start.
pub(super) struct Device<F, A: Authority> {
    pub(super) updater: Updater<F, A>,
    /// The running image, if any.
    pub(super) runs: Option<Vec<u8>>,
}

impl<F: NorFlash, A: Authority> Device<F, A> {
    /// Switches power on.
    pub(super) fn start(flash: F, layout: &Layout, authority: A) -> Self {
        Self::start_build(flash, layout, authority, BUILD)
    }

    /// Switches power on, with a firmware of this build.
    pub(super) fn start_build(flash: F, layout: &Layout, authority: A, build: u32) -> Self {
        let mut slots = Slots::new(flash, layout.clone(), authority, build);
        while let Some(candidate) = slots.select(|| ()) {
            let image = read(&mut slots, &candidate);
            if self_test(&image).is_ok() {
                // If power fails here, the device stops.
                let _ = !candidate.trial || slots.confirm(candidate.slot);
                return Self { updater: Updater::new(slots, Some(candidate.slot)), runs: Some(image) };
            }
            slots.reject(candidate.slot);
        }
        Self { updater: Updater::new(slots, None), runs: None }
    }

    /// Does the work of a request and repeats the request until it is done.
    pub(super) fn wait(
        &mut self,
        mut request: impl FnMut(&mut Updater<F, A>) -> Result<(), Refusal>,
    ) -> Result<(), Refusal> {
        loop {
            match request(&mut self.updater) {
                Err(Refusal::Busy) => {}
                outcome => return outcome,
            }
            while let work @ (Work::More | Work::Test(_)) = self.updater.work() {
                let Work::Test(candidate) = work else { continue };
                let image = read(self.updater.slots(), &candidate);
                if self.updater.tested(self_test(&image)) {
                    self.runs = Some(image);
                }
            }
        }
    }

    /// Makes a whole update, in chunks of `chunk` bytes.
    pub(super) fn update(&mut self, image: &Image, chunk: usize, signature: Option<&[u8; 64]>) -> Result<(), Refusal> {
        self.wait(|updater| updater.begin(image.plan()))?;
        for (i, bytes) in image.bytes.chunks(chunk).enumerate() {
            self.updater.chunk((i * chunk) as u32, bytes)?;
        }
        self.wait(|updater| updater.commit(signature))
    }
}
