//! TIM 1 as the power stage's PWM (RM0090, section 17): three phases and their complements with dead time,
//! center-aligned, and a break input that switches all six off in hardware. It triggers the ADC in the middle of a
//! period.
//!
//! QEMU does not emulate TIM 1, so this module has never run. `firmware-demo/README.md` lists the checks on hardware.

use core::convert::Infallible;

use embedded_hal::pwm::{ErrorType, SetDutyCycle};
use stm32f4::stm32f405 as pac;

use super::adc::Currents;
use super::wait::wait;
use crate::hal::Stage;

/// PWM frequency in Hz.
const PWM_HZ: u32 = 20_000;
/// Dead time of a phase's switches, in nanoseconds.
const DEAD_NS: u32 = 500;
/// Longest dead time, in cycles, whose field equals its number of cycles.
const MAX_DEAD: u32 = 127;

/// Reads of the outputs' enable bit until it shows that it was set.
const SET: u32 = 8;

const ALTERNATE: u8 = 1;
/// PWM mode 1: a channel is on below its compare value, which is updated at the end of a period.
const PWM_MODE: u8 = 0b110;

/// The power stage.
#[derive(Debug)]
pub struct Pwm {
    timer: pac::TIM1,
    phases: [Phase; 3],
    currents: Currents,
}

impl Pwm {
    pub(super) fn new(
        timer: pac::TIM1,
        rcc: &pac::RCC,
        a: &pac::GPIOA,
        b: &pac::GPIOB,
        timer_hz: u32,
        currents: Currents,
    ) -> Self {
        rcc.ahb1enr().modify(|_, w| w.gpioaen().set_bit().gpioben().set_bit());
        rcc.apb2enr().modify(|_, w| w.tim1en().set_bit());
        // A peripheral's clock starts some cycles after it is enabled (errata sheet ES0182).
        let _ = rcc.apb2enr().read();
        let top = (timer_hz / (2 * PWM_HZ)) as u16;
        let dead = (DEAD_NS * (timer_hz / 1_000_000)).div_ceil(1000).min(MAX_DEAD) as u8;
        // SAFETY: every value is in its field's range.
        unsafe {
            // Center-aligned; compare values are updated when the count reverses.
            timer.cr1().write(|w| w.cms().bits(0b01).arpe().set_bit());
            timer.arr().write(|w| w.bits(top.into()));
            timer
                .ccmr1_output()
                .write(|w| w.oc1m().bits(PWM_MODE).oc1pe().set_bit().oc2m().bits(PWM_MODE).oc2pe().set_bit());
            timer
                .ccmr2_output()
                .write(|w| w.oc3m().bits(PWM_MODE).oc3pe().set_bit().oc4m().bits(PWM_MODE).oc4pe().set_bit());
            // Channel 4 has no pin: it triggers the ADC at the top, where all lower switches are on.
            timer.ccr4().write(|w| w.bits(u32::from(top) - 1));
            // Off until `enable`, and never on again automatically after a break (AOE is 0). A low level or an open pin
            // breaks. Outputs are driven low when off. The lock protects dead time, break and idle levels until the
            // next reset.
            timer
                .bdtr()
                .write(|w| w.dtg().bits(dead).lock().bits(0b01).ossi().set_bit().ossr().set_bit().bke().set_bit());
            timer.egr().write(|w| w.ug().set_bit());
            timer.ccer().write(|w| {
                let w = w.cc1e().set_bit().cc1ne().set_bit().cc2e().set_bit().cc2ne().set_bit();
                w.cc3e().set_bit().cc3ne().set_bit().cc4e().set_bit()
            });
            timer.cr1().modify(|_, w| w.cen().set_bit());
            // The pins last, when their outputs are off.
            b.pupdr().modify(|_, w| w.pupdr12().bits(0b10));
            a.afrh().modify(|_, w| w.afrh8().bits(ALTERNATE).afrh9().bits(ALTERNATE).afrh10().bits(ALTERNATE));
            b.afrh().modify(|_, w| {
                let w = w.afrh12().bits(ALTERNATE).afrh13().bits(ALTERNATE);
                w.afrh14().bits(ALTERNATE).afrh15().bits(ALTERNATE)
            });
            a.moder().modify(|_, w| w.moder8().bits(0b10).moder9().bits(0b10).moder10().bits(0b10));
            b.moder()
                .modify(|_, w| w.moder12().bits(0b10).moder13().bits(0b10).moder14().bits(0b10).moder15().bits(0b10));
        }
        Self {
            timer,
            phases: [Channel::One, Channel::Two, Channel::Three].map(|channel| Phase { channel, top }),
            currents,
        }
    }
}

/// Returns `true` if the register says that the outputs are on, independently of the power stage's owner.
pub(super) fn is_driving() -> bool {
    // SAFETY: reading changes nothing.
    unsafe { &*pac::TIM1::ptr() }.bdtr().read().moe().bit()
}

impl Stage for Pwm {
    type Phase = Phase;

    fn phases(&mut self) -> &mut [Phase; 3] {
        &mut self.phases
    }

    fn enable(&mut self) -> bool {
        self.timer.sr().modify(|_, w| w.bif().clear_bit());
        // Loads the duty cycles, which would otherwise be those of before until the end of the period.
        self.timer.egr().write(|w| w.ug().set_bit());
        self.timer.bdtr().modify(|_, w| w.moe().set_bit());
        // The bit reads as 1 some cycles after it was set (RM0090, section 17.3.12). The break input keeps it at 0.
        wait(SET, || self.is_on())
    }

    fn is_on(&mut self) -> bool {
        self.timer.bdtr().read().moe().bit()
    }

    fn is_broken(&mut self) -> bool {
        // SAFETY: reading changes nothing. The input register shows the pin's level in its alternate function, too.
        unsafe { &*pac::GPIOB::ptr() }.idr().read().idr12().bit_is_clear()
    }

    fn disable(&mut self) {
        self.timer.bdtr().modify(|_, w| w.moe().clear_bit());
    }

    fn currents(&mut self) -> Option<[u16; 2]> {
        self.currents.take()
    }
}

#[derive(Clone, Copy, Debug)]
enum Channel {
    One,
    Two,
    Three,
}

/// A phase: its compare value.
#[derive(Debug)]
pub struct Phase {
    channel: Channel,
    top: u16,
}

impl ErrorType for Phase {
    type Error = Infallible;
}

impl SetDutyCycle for Phase {
    fn max_duty_cycle(&self) -> u16 {
        self.top
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        let duty = u32::from(duty.min(self.top));
        // SAFETY: the timer runs as long as the program does; each compare register is written as a whole, by one phase
        // only.
        let timer = unsafe { &*pac::TIM1::ptr() };
        // SAFETY: any value up to the top is allowed.
        unsafe {
            match self.channel {
                Channel::One => timer.ccr1().write(|w| w.bits(duty)),
                Channel::Two => timer.ccr2().write(|w| w.bits(duty)),
                Channel::Three => timer.ccr3().write(|w| w.bits(duty)),
            };
        }
        Ok(())
    }
}
