//! UART 0, an NS16550A (National Semiconductor, PC16550D, section 8).

use super::register;
use crate::hal::{self, UartError};

const BASE: usize = 0x1000_0000;
/// Data; while DIVISOR is set, the divisor's lower half.
const DATA: usize = BASE;
/// Enabled interrupts; while DIVISOR is set, the divisor's upper half.
const INTERRUPTS: usize = BASE + 1;
const QUEUES: usize = BASE + 2;
const LINE: usize = BASE + 3;
const STATUS: usize = BASE + 5;

/// Clock of the divisor, and the divisor's factor.
const HZ: u32 = 3_686_400;
const OVERSAMPLING: u32 = 16;
/// 8 bits, no parity; and the divisor in place of data and interrupts.
const EIGHT_BITS: u8 = 0b11;
const DIVISOR: u8 = 1 << 7;
/// Queues on and empty, with an interrupt for each received byte.
const QUEUES_ON: u8 = 0b111;
const ON_RECEIVED: u8 = 1 << 0;
const ON_EMPTY: u8 = 1 << 1;
const RECEIVED: u8 = 1 << 0;
/// Overrun, parity, frame, break.
const ERRORS: u8 = 0b1_1110;
const EMPTY: u8 = 1 << 5;
/// Bytes of the transmitter's queue.
const ROOM: u8 = 16;

/// The UART.
#[derive(Debug)]
pub struct Uart {
    /// Bytes that the transmitter's queue has room for.
    room: u8,
}

impl Uart {
    pub(super) fn new(baud: u32) -> Self {
        let divisor = (HZ / (OVERSAMPLING * baud.max(1))).max(1);
        let [low, high, ..] = divisor.to_le_bytes();
        // SAFETY: sets the UART up, as its data sheet says; the interrupt has a handler.
        unsafe {
            register::<u8>(LINE).write(EIGHT_BITS | DIVISOR);
            register::<u8>(DATA).write(low);
            register::<u8>(INTERRUPTS).write(high);
            register::<u8>(LINE).write(EIGHT_BITS);
            register::<u8>(QUEUES).write(QUEUES_ON);
            register::<u8>(INTERRUPTS).write(ON_RECEIVED);
        }
        Self { room: 0 }
    }
}

impl hal::Uart for Uart {
    fn receive(&mut self) -> Option<Result<u8, UartError>> {
        // Reading the status clears its errors.
        let status = register::<u8>(STATUS).read();
        if status & EMPTY != 0 {
            self.room = ROOM;
        }
        let byte = (status & RECEIVED != 0).then(|| register::<u8>(DATA).read());
        if status & ERRORS != 0 { Some(Err(UartError)) } else { byte.map(Ok) }
    }

    fn transmit(&mut self, byte: u8) -> bool {
        let Some(room) = self.room.checked_sub(1) else { return false };
        self.room = room;
        // SAFETY: the queue has room.
        unsafe { register::<u8>(DATA).write(byte) };
        true
    }

    fn set_transmit_interrupt(&mut self, on: bool) {
        // SAFETY: the interrupt has a handler.
        unsafe { register::<u8>(INTERRUPTS).write(if on { ON_RECEIVED | ON_EMPTY } else { ON_RECEIVED }) };
    }
}
