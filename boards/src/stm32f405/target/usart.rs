//! USART 1 on PB6 and PB7 (RM0090, section 30), byte by byte in its interrupt.

use stm32f4::stm32f405 as pac;

use crate::hal::{Uart, UartError};

/// The alternate function of a USART 1 to 3.
const ALTERNATE: u8 = 7;

/// USART 1.
#[derive(Debug)]
pub struct Usart(pac::USART1);

impl Usart {
    pub(super) fn new(usart: pac::USART1, rcc: &pac::RCC, pins: &pac::GPIOB, bus_hz: u32, baud: u32) -> Self {
        rcc.ahb1enr().modify(|_, w| w.gpioben().set_bit());
        rcc.apb2enr().modify(|_, w| w.usart1en().set_bit());
        // SAFETY: values in the fields' ranges, for pins that only this port uses. The receiver has a pull-up, so a
        // broken cable is an idle line.
        unsafe {
            pins.afrl().modify(|_, w| w.afrl6().bits(ALTERNATE).afrl7().bits(ALTERNATE));
            pins.pupdr().modify(|_, w| w.pupdr7().bits(0b01));
            pins.moder().modify(|_, w| w.moder6().bits(0b10).moder7().bits(0b10));
        }
        // A sixteenth of a bit is a cycle: BRR is the bit's length in cycles.
        let length = (bus_hz + baud / 2) / baud.max(1);
        // SAFETY: BRR holds 16 bits; the others are reserved.
        usart.brr().write(|w| unsafe { w.bits(length.clamp(16, 0xffff) as u16) });
        usart.cr1().write(|w| w.ue().set_bit().te().set_bit().re().set_bit().rxneie().set_bit());
        Self(usart)
    }
}

impl Uart for Usart {
    fn receive(&mut self) -> Option<Result<u8, UartError>> {
        let state = self.0.sr().read();
        let wrong = state.ore().bit() || state.fe().bit() || state.nf().bit();
        if !state.rxne().bit() && !wrong {
            return None;
        }
        // Reading the state and then the byte clears the flags. An overrun lost the byte after this one, which is
        // dropped, too.
        let byte = self.0.dr().read().dr().bits() as u8;
        Some(if wrong { Err(UartError) } else { Ok(byte) })
    }

    fn transmit(&mut self, byte: u8) -> bool {
        let room = self.0.sr().read().txe().bit();
        if room {
            // SAFETY: the transmitter has room for any byte.
            self.0.dr().write(|w| unsafe { w.dr().bits(byte.into()) });
        }
        room
    }

    fn set_transmit_interrupt(&mut self, on: bool) {
        self.0.cr1().modify(|_, w| w.txeie().bit(on));
    }
}
