//! The peripherals of Arm's MPS2 boards: UART and watchdog of the Cortex-M System Design Kit (Arm DDI 0479C, sections
//! 4.3 and 4.5). No public crate has their registers.

use volatile_register::{RW, WO};

use crate::hal::{self, UartError};

#[repr(C)]
struct UartRegisters {
    data: RW<u32>,
    state: RW<u32>,
    control: RW<u32>,
    interrupt: RW<u32>,
    divider: RW<u32>,
}

const TX_FULL: u32 = 1 << 0;
const RX_FULL: u32 = 1 << 1;
const RX_OVERRUN: u32 = 1 << 3;
/// Transmitter and receiver on, with an interrupt for each received byte.
const ON: u32 = 0b1011;
const TX_INTERRUPT: u32 = 1 << 2;
/// Interrupts of transmitter and receiver, to clear.
const INTERRUPTS: u32 = 0b11;

/// A CMSDK UART.
#[derive(Debug)]
pub struct Uart(usize);

impl Uart {
    /// Enables the UART at `base`, with 8 bits and no parity.
    ///
    /// # Safety
    ///
    /// A CMSDK UART is at `base`, and nothing else uses it.
    pub(crate) unsafe fn new(base: usize, clock_hz: u32, baud: u32) -> Self {
        let uart = Self(base);
        // SAFETY: a CMSDK UART is at `base`, as the caller promises; 16 is its smallest divider.
        unsafe {
            uart.registers().divider.write((clock_hz / baud.max(1)).max(16));
            uart.registers().control.write(ON);
        }
        uart
    }

    fn registers(&self) -> &UartRegisters {
        // SAFETY: the caller of `new` promised that these registers exist and nothing else uses them; they are volatile
        // cells.
        unsafe { &*(self.0 as *const UartRegisters) }
    }
}

impl hal::Uart for Uart {
    fn receive(&mut self) -> Option<Result<u8, UartError>> {
        let registers = self.registers();
        // SAFETY: clearing the interrupts before reading the state loses nothing: a later byte sets them again.
        unsafe { registers.interrupt.write(INTERRUPTS) };
        let state = registers.state.read();
        if state & RX_OVERRUN != 0 {
            // SAFETY: writing the bit clears only this bit.
            unsafe { registers.state.write(RX_OVERRUN) };
            return Some(Err(UartError));
        }
        (state & RX_FULL != 0).then(|| Ok(registers.data.read() as u8))
    }

    fn transmit(&mut self, byte: u8) -> bool {
        let room = self.registers().state.read() & TX_FULL == 0;
        if room {
            // SAFETY: the transmitter has room.
            unsafe { self.registers().data.write(byte.into()) };
        }
        room
    }

    fn set_transmit_interrupt(&mut self, on: bool) {
        // SAFETY: interrupts that the board's vector table has a handler for.
        unsafe { self.registers().control.write(if on { ON | TX_INTERRUPT } else { ON }) };
    }
}

#[repr(C)]
struct WatchdogRegisters {
    load: RW<u32>,
    value: RW<u32>,
    control: RW<u32>,
    clear: WO<u32>,
    _status: [RW<u32>; 2],
    _unused: [u32; 0x2fa],
    lock: RW<u32>,
}

const _: () = assert!(core::mem::offset_of!(WatchdogRegisters, lock) == 0xc00);

/// Key that unlocks the registers.
const KEY: u32 = 0x1acc_e551;
/// Interrupt at the first timeout, reset at the second.
const INTERRUPT_AND_RESET: u32 = 0b11;

/// A CMSDK watchdog: an NMI at the first timeout, and the reset at the second.
#[derive(Debug)]
pub struct Watchdog {
    base: usize,
    clock_hz: u32,
}

impl Watchdog {
    /// Creates the watchdog at `base`, off.
    ///
    /// # Safety
    ///
    /// A CMSDK watchdog is at `base`, and nothing else uses it.
    pub(crate) unsafe fn new(base: usize, clock_hz: u32) -> Self {
        Self { base, clock_hz }
    }

    fn write(&self, write: impl FnOnce(&WatchdogRegisters)) {
        // SAFETY: the caller of `new` promised that these registers exist and nothing else uses them; they are volatile
        // cells.
        let registers = unsafe { &*(self.base as *const WatchdogRegisters) };
        // SAFETY: unlocking and locking the registers changes nothing else.
        unsafe { registers.lock.write(KEY) };
        write(registers);
        // SAFETY: as above.
        unsafe { registers.lock.write(0) };
    }
}

impl hal::Watchdog for Watchdog {
    fn start(&mut self, milliseconds: u16) -> bool {
        let cycles = (self.clock_hz / 1000).checked_mul(milliseconds.into()).filter(|cycles| *cycles > 0);
        let Some(cycles) = cycles else { return false };
        // SAFETY: any time except 0 is allowed; the board's NMI has a handler.
        self.write(|registers| unsafe {
            registers.load.write(cycles);
            registers.control.write(INTERRUPT_AND_RESET);
        });
        true
    }

    fn feed(&mut self) {
        // SAFETY: any value clears the interrupt and reloads the time.
        self.write(|registers| unsafe { registers.clear.write(1) });
    }
}
