//! The flash memories of the tests of slots: NOR flash of any geometry, and an STM32F405's by its driver.

use actq_boards::stm32f405::flash::model::Model;
use actq_boards::stm32f405::flash::{Flash, LARGE};
use actq_testkit::{Nor, Random};
use embedded_storage::nor_flash::NorFlash;

/// Flash whose power fails, of as many sectors as a test asks for.
pub(super) trait Fails: NorFlash + Clone {
    /// Creates a flash with arbitrary content, as after another use.
    fn new(sectors: usize, seed: u64) -> Self;

    fn bytes(&self) -> Vec<u8>;

    /// Changes so far.
    fn done(&self) -> usize;

    /// Restores the power; it fails again during the change after `fails_at` changes, if given.
    fn restart(&mut self, fails_at: Option<usize>);
}

impl<const UNIT: usize, const SECTOR: usize> Fails for Nor<UNIT, SECTOR> {
    fn new(sectors: usize, seed: u64) -> Self {
        Self::new(sectors, seed)
    }

    fn bytes(&self) -> Vec<u8> {
        self.bytes.clone()
    }

    fn done(&self) -> usize {
        self.power.done
    }

    fn restart(&mut self, fails_at: Option<usize>) {
        self.power.restart(fails_at);
    }
}

/// The upper sectors of an STM32F405, by its driver: what fails is a write to a register or to the memory.
impl Fails for Flash<Model> {
    fn new(sectors: usize, seed: u64) -> Self {
        let begin = (1 << 20) - sectors as u32 * LARGE;
        let memory = Random::new(seed).bytes(sectors * LARGE as usize);
        Self::new(Model::new(memory, begin, seed), begin)
    }

    fn bytes(&self) -> Vec<u8> {
        self.part.bytes()
    }

    fn done(&self) -> usize {
        self.part.power.done
    }

    fn restart(&mut self, fails_at: Option<usize>) {
        self.part = self.part.clone().restarted();
        self.part.power.fails_at = fails_at;
    }
}
