//! The registers of an STM32F405 by its peripheral access crate (RM0090): clocks, USART 1, TIM 1, ADC 1, the
//! independent watchdog, the flash.
//!
//! The crates that own whole parts, stm32f4xx-hal and embassy-stm32, wait without end for a crystal that does not
//! start. Here every wait has an end, and the part runs on from its own oscillator; so the registers are set below
//! them.

mod adc;
mod clock;
mod flash;
mod pwm;
mod usart;
mod wait;
mod watchdog;

use core::cell::Cell;

use stm32f4::stm32f405 as pac;

pub use adc::Currents;
pub use flash::Controller;
pub use pwm::{Phase, Pwm as Stage};
pub use usart::Usart as Uart;
pub use watchdog::Iwdg as Watchdog;

pub use crate::mpu::guard_stack;
use crate::seams::{self, Cause};
use crate::vectors::interrupts;

// USART 1.
interrupts!(37 of 82);

/// Bits of an interrupt's priority.
pub const NVIC_PRIO_BITS: u8 = 4;
/// Words of scratch memory for a head.
pub const SCRATCH: usize = super::SCRATCH;
/// Whether a non-maskable interrupt says that the watchdog's time has ended: nothing here asks for one.
pub const WATCHDOG_NMI: bool = false;
/// Whether the flash may be written while the outputs are driven: the tick stands still then, for up to 2 s.
pub const FLASH_WHILE_ARMED: bool = false;

/// The board.
pub type Parts = seams::Parts<Uart, Watchdog, Stage>;
/// Its flash, as far as it is for updates.
pub type Flash = super::flash::Flash<Controller>;

/// Where the flash begins.
const FLASH: usize = 0x0800_0000;

/// Sets the part up: 168 MHz where the crystal starts, else 16 MHz; its serial port at `baud`; the power stage off, at
/// 20 kHz.
///
/// Pins: PB6 transmits, PB7 receives; PA8 to PA10 and PB13 to PB15 are the phases and their complements, PB12 low
/// breaks; PC0 and PC1 are currents.
///
/// # Safety
///
/// To be called once: all of the part's peripherals are the caller's.
pub unsafe fn start(baud: u32) -> Parts {
    // SAFETY: nobody else has the peripherals, as the caller promises.
    let p = unsafe { pac::Peripherals::steal() };
    let cause = cause(&p.RCC);
    // A debugger that halts the program stops the watchdog, and the power stage's timer, whose outputs are then off
    // (section 17.3.21).
    p.DBGMCU.apb1_fz().modify(|_, w| w.dbg_iwdg_stop().set_bit());
    p.DBGMCU.apb2_fz().modify(|_, w| w.dbg_tim1_stop().set_bit());
    let clock = clock::start(&p.RCC, &p.FLASH, &p.PWR);
    let timer_hz = clock.hz;
    let bus_hz = clock::apb2(clock);
    let uart = Uart::new(p.USART1, &p.RCC, &p.GPIOB, bus_hz, baud);
    let stage = Stage::new(p.TIM1, &p.RCC, &p.GPIOA, &p.GPIOB, timer_hz, Currents::new(p.ADC1, &p.RCC, &p.GPIOC));
    let watchdog = Watchdog::new(p.IWDG);
    Parts { clock, cause, uart, watchdog, stage }
}

/// The part's own flash, of which `memory` is to be written.
///
/// # Safety
///
/// To be called once, behind [`start`], and from where the watchdog is fed. `memory` is the part's flash, and nothing
/// but the flash that is given here changes it.
pub unsafe fn flash(memory: &'static [Cell<u8>]) -> Flash {
    // SAFETY: `start` has set up what it wanted of these, and nobody else has them since.
    let p = unsafe { pac::Peripherals::steal() };
    // SAFETY: as above. The count of cycles is for the watchdog alone.
    let mut core = unsafe { cortex_m::Peripherals::steal() };
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();
    let begin = (memory.as_ptr() as usize).wrapping_sub(FLASH) as u32;
    Flash::new(Controller::new(p.FLASH, p.PWR, &p.RCC, memory), begin)
}

/// What the reset flags say, which are cleared for the next time.
fn cause(rcc: &pac::RCC) -> Cause {
    let flags = rcc.csr().read();
    rcc.csr().modify(|_, w| w.rmvf().set_bit());
    // The pin's flag is set by every reset, that of the power by the first one.
    if flags.wdgrstf().bit() || flags.wwdgrstf().bit() {
        Cause::Watchdog
    } else if flags.sftrstf().bit() {
        Cause::Software
    } else if flags.porrstf().bit() || flags.borrstf().bit() {
        Cause::Power
    } else if flags.padrstf().bit() {
        Cause::Pin
    } else {
        Cause::Unknown
    }
}
