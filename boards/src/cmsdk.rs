//! The peripherals of Arm's MPS2 boards: UART and watchdog of the Cortex-M System Design Kit (Arm DDI 0479C, sections
//! 4.3 and 4.5). No crate has their registers.

use volatile_register::{RW, WO};

use crate::seams::{self, Lost};

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
/// Transmitter and receiver on, an interrupt for each byte received.
const ON: u32 = 0b1011;
const TX_INTERRUPT: u32 = 1 << 2;
/// Those of transmitter and receiver, to be cleared.
const INTERRUPTS: u32 = 0b11;

/// A CMSDK UART.
#[derive(Debug)]
pub struct Uart(usize);

impl Uart {
    /// Switches the UART at `base` on, with 8 bits and no parity.
    ///
    /// # Safety
    ///
    /// There is a CMSDK UART at `base`, and nothing else uses it.
    pub(crate) unsafe fn new(base: usize, clock_hz: u32, baud: u32) -> Self {
        let uart = Self(base);
        // SAFETY: there is a CMSDK UART, as the caller promises; a divider of 16 is the smallest that it takes.
        unsafe {
            uart.registers().divider.write((clock_hz / baud.max(1)).max(16));
            uart.registers().control.write(ON);
        }
        uart
    }

    fn registers(&self) -> &UartRegisters {
        // SAFETY: `new` was promised that these registers are there, for nothing else; they are volatile cells.
        unsafe { &*(self.0 as *const UartRegisters) }
    }
}

impl seams::Uart for Uart {
    fn receive(&mut self) -> Option<Result<u8, Lost>> {
        let registers = self.registers();
        // SAFETY: clearing what has come before the state is read loses nothing: a byte that comes later sets it again.
        unsafe { registers.interrupt.write(INTERRUPTS) };
        let state = registers.state.read();
        if state & RX_OVERRUN != 0 {
            // SAFETY: writing the bit clears it, and it alone.
            unsafe { registers.state.write(RX_OVERRUN) };
            return Some(Err(Lost));
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

    fn ask_for_room(&mut self, on: bool) {
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

/// What opens the registers for writing.
const KEY: u32 = 0x1acc_e551;
/// An interrupt at the first end of the time, a reset at the second.
const INTERRUPT_AND_RESET: u32 = 0b11;

/// A CMSDK watchdog: at the end of the time an NMI, and at the end of another one the reset.
#[derive(Debug)]
pub struct Watchdog {
    base: usize,
    clock_hz: u32,
}

impl Watchdog {
    /// The watchdog at `base`, off.
    ///
    /// # Safety
    ///
    /// There is a CMSDK watchdog at `base`, and nothing else uses it.
    pub(crate) unsafe fn new(base: usize, clock_hz: u32) -> Self {
        Self { base, clock_hz }
    }

    fn write(&self, write: impl FnOnce(&WatchdogRegisters)) {
        // SAFETY: `new` was promised that these registers are there, for nothing else; they are volatile cells.
        let registers = unsafe { &*(self.base as *const WatchdogRegisters) };
        // SAFETY: opening and closing the registers changes nothing else.
        unsafe { registers.lock.write(KEY) };
        write(registers);
        // SAFETY: as above.
        unsafe { registers.lock.write(0) };
    }
}

impl seams::Watchdog for Watchdog {
    fn start(&mut self, milliseconds: u16) -> bool {
        let cycles = (self.clock_hz / 1000).checked_mul(milliseconds.into()).filter(|cycles| *cycles > 0);
        let Some(cycles) = cycles else { return false };
        // SAFETY: any time but 0 is allowed; the board's NMI has a handler.
        self.write(|registers| unsafe {
            registers.load.write(cycles);
            registers.control.write(INTERRUPT_AND_RESET);
        });
        true
    }

    fn feed(&mut self) {
        // SAFETY: any value clears the interrupt and loads the time anew.
        self.write(|registers| unsafe { registers.clear.write(1) });
    }
}
