//! ADC 1 (RM0090, section 13): two phase currents on PC0 and PC1, measured at TIM 1's channel 4. It is not tested in
//! QEMU, which emulates neither the timer nor voltages.

use stm32f4::stm32f405 as pac;

/// Channels of PC0 and PC1.
const CHANNELS: [u8; 2] = [10, 11];
/// The trigger TIM1_CC4, and its rising edge.
const TRIGGER: u8 = 0b0000;
const RISING: u8 = 0b01;

/// The phase currents.
#[derive(Debug)]
pub struct Currents(pac::ADC1);

impl Currents {
    pub(super) fn new(adc: pac::ADC1, rcc: &pac::RCC, pins: &pac::GPIOC) -> Self {
        rcc.ahb1enr().modify(|_, w| w.gpiocen().set_bit());
        rcc.apb2enr().modify(|_, w| w.adc1en().set_bit());
        // SAFETY: every value is in its field's range. A sequence of two uses the third and the fourth place. The ADC's
        // default clock, half of the bus, is too fast at 84 MHz; a quarter is not.
        unsafe {
            pins.moder().modify(|_, w| w.moder0().bits(0b11).moder1().bits(0b11));
            (*pac::ADC_COMMON::ptr()).ccr().modify(|_, w| w.adcpre().bits(0b01));
            adc.cr1().write(|w| w.scan().set_bit());
            adc.jsqr().write(|w| w.jl().bits(1).jsq3().bits(CHANNELS[0]).jsq4().bits(CHANNELS[1]));
            adc.cr2().write(|w| w.jextsel().bits(TRIGGER).jexten().bits(RISING).adon().set_bit());
        }
        Self(adc)
    }

    /// Returns both, from 0 to 4095, if they were measured since the last call.
    pub(super) fn take(&mut self) -> Option<[u16; 2]> {
        if !self.0.sr().read().jeoc().bit() {
            return None;
        }
        self.0.sr().modify(|_, w| w.jeoc().clear_bit());
        Some([self.0.jdr1().read().jdata().bits(), self.0.jdr2().read().jdata().bits()])
    }
}
