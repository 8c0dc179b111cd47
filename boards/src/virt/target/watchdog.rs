//! An Intel 6300ESB as watchdog (its data sheet, chapter 16), the only one that QEMU has for this machine: device 1 of the
//! PCI bus.

use super::register;
use crate::hal::{self, Cause};

/// Configuration space of the device, and its registers: identity, command, base address, configuration and lock.
const CONFIGURATION: usize = 0x3000_0000 + (1 << 15);
const IDENTITY: usize = CONFIGURATION;
const COMMAND: usize = CONFIGURATION + 0x04;
const ADDRESS: usize = CONFIGURATION + 0x10;
const MODE: usize = CONFIGURATION + 0x60;
const LOCK: usize = CONFIGURATION + 0x68;

const I6300ESB: u32 = 0x25ab_8086;
const MEMORY_ACCESS: u16 = 1 << 1;
/// A reset at the end, no interrupt before it, and a clock of 33 MHz / 2^15.
const RESETS: u16 = 0b11;
const ENABLED: u8 = 1 << 1;

/// Begin of the PCI bus's memory: times of both stages, and the reload register.
const BASE: usize = 0x4000_0000;
const STAGES: [usize; 2] = [BASE, BASE + 4];
const RELOAD: usize = BASE + 0xc;
/// Both unlock one write.
const KEYS: [u16; 2] = [0x80, 0x86];
const RESTART: u16 = 1 << 8;
/// The watchdog has reset the machine; writing clears it.
const HAS_RESET: u16 = 1 << 9;

/// Nanoseconds of a cycle of both stages.
const CYCLE: u32 = (2 * 30) << 15;

/// The watchdog.
#[derive(Debug)]
pub struct I6300esb {
    is_present: bool,
}

/// Writes to the reload register.
fn reload(value: u16) {
    unlock();
    // SAFETY: restarts the time or clears the flag.
    unsafe { register::<u16>(RELOAD).write(value) };
}

fn unlock() {
    // SAFETY: the keys have no other effect.
    KEYS.into_iter().for_each(|key| unsafe { register::<u16>(RELOAD).write(key) });
}

impl I6300esb {
    /// Returns the watchdog, off, and the cause of the last reset.
    pub(super) fn new() -> (Self, Cause) {
        if register::<u32>(IDENTITY).read() != I6300ESB {
            return (Self { is_present: false }, Cause::Unknown);
        }
        // SAFETY: nothing else is on the bus; a reset has switched the watchdog off.
        unsafe {
            register::<u32>(ADDRESS).write(BASE as u32);
            register::<u16>(COMMAND).write(MEMORY_ACCESS);
            register::<u16>(MODE).write(RESETS);
        }
        let has_reset = register::<u16>(RELOAD).read() & HAS_RESET != 0;
        reload(HAS_RESET);
        (Self { is_present: true }, if has_reset { Cause::Watchdog } else { Cause::Unknown })
    }
}

impl hal::Watchdog for I6300esb {
    fn start(&mut self, milliseconds: u16) -> bool {
        let cycles = u32::from(milliseconds) * 1000 / (CYCLE / 1000);
        if !self.is_present || cycles == 0 {
            return false;
        }
        for stage in STAGES {
            unlock();
            // SAFETY: any time except 0 is allowed.
            unsafe { register::<u32>(stage).write(cycles) };
        }
        // SAFETY: enables the watchdog.
        unsafe { register::<u8>(LOCK).write(ENABLED) };
        self.feed();
        true
    }

    fn feed(&mut self) {
        if self.is_present {
            reload(RESTART);
        }
    }
}
