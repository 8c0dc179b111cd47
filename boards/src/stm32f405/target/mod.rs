//! The registers of an STM32F405 through its peripheral access crate (RM0090): clocks, USART 1, TIM 1, ADC 1, the
//! independent watchdog, the flash.
//!
//! stm32f4xx-hal and embassy-stm32 wait forever for a crystal that does not start. Here every wait has a limit, and the
//! part then runs from its internal oscillator. So this module sets the registers directly.

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

use crate::hal::{self, Cause};
pub use crate::target::mpu::guard_stack;
pub use crate::target::systick::SysTick as Ticker;
use crate::target::vectors::interrupts;

// USART 1.
interrupts!(37 of 82);

/// Number of bits of an interrupt's priority.
pub const NVIC_PRIO_BITS: u8 = 4;
/// Scratch memory for a head, in words.
pub const SCRATCH: usize = super::SCRATCH;
/// `true` if a non-maskable interrupt announces the watchdog's reset; this part has none.
pub const WATCHDOG_NMI: bool = false;
/// `true` if the flash may be written while the outputs are driven; here writing stalls the tick for up to 2 s.
pub const FLASH_WHILE_ARMED: bool = false;

/// The parts of the board.
pub type Parts = hal::Parts<Uart, Watchdog, Stage, Ticker>;
/// The board's flash for updates.
pub type Flash = super::flash::Flash<Controller>;

/// Address of the flash.
const FLASH: usize = 0x0800_0000;

/// Sets the part up: 168 MHz if the crystal starts, else 16 MHz; the serial port at `baud`; the power stage off, at 20
/// kHz.
///
/// Pins: PB6 transmits, PB7 receives; PA8 to PA10 and PB13 to PB15 are the phases and their complements, PB12 low
/// breaks; PC0 and PC1 are currents.
///
/// # Safety
///
/// Call it once: the caller owns all of the part's peripherals.
pub unsafe fn start(baud: u32) -> Parts {
    // SAFETY: nothing else uses the peripherals, as the caller promises.
    let p = unsafe { pac::Peripherals::steal() };
    let cause = cause(&p.RCC);
    // A debugger's halt stops the watchdog and the power stage's timer, whose outputs are then off (section 17.3.21).
    p.DBGMCU.apb1_fz().modify(|_, w| w.dbg_iwdg_stop().set_bit());
    p.DBGMCU.apb2_fz().modify(|_, w| w.dbg_tim1_stop().set_bit());
    let clock = clock::start(&p.RCC, &p.FLASH, &p.PWR);
    let timer_hz = clock.hz;
    let bus_hz = clock::apb2(clock);
    let uart = Uart::new(p.USART1, &p.RCC, &p.GPIOB, bus_hz, baud);
    let stage = Stage::new(p.TIM1, &p.RCC, &p.GPIOA, &p.GPIOB, timer_hz, Currents::new(p.ADC1, &p.RCC, &p.GPIOC));
    let watchdog = Watchdog::new(p.IWDG);
    // SAFETY: as above.
    let ticker = unsafe { Ticker::new() };
    Parts { clock, cause, uart, watchdog, stage, ticker }
}

/// Returns the part's flash, of which `memory` may be written.
///
/// # Safety
///
/// Call it once, after [`start`], from the loop that feeds the watchdog. `memory` is in the part's flash, and only the
/// returned value changes it.
pub unsafe fn flash(memory: &'static [Cell<u8>]) -> Flash {
    // SAFETY: `start` has finished with these peripherals, and nothing else uses them.
    let p = unsafe { pac::Peripherals::steal() };
    // SAFETY: as above. Only the watchdog uses the cycle counter.
    let mut core = unsafe { cortex_m::Peripherals::steal() };
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();
    let begin = (memory.as_ptr() as usize).wrapping_sub(FLASH) as u32;
    Flash::new(Controller::new(p.FLASH, p.PWR, &p.RCC, memory), begin)
}

/// Reads the reset flags and clears them for the next reset.
fn cause(rcc: &pac::RCC) -> Cause {
    let flags = rcc.csr().read();
    rcc.csr().modify(|_, w| w.rmvf().set_bit());
    // Every reset sets the pin's flag, and power-on sets that of the power.
    if flags.wdgrstf().bit() || flags.wwdgrstf().bit() {
        Cause::Watchdog
    } else if flags.sftrstf().bit() {
        Cause::Software
    } else if flags.porrstf().bit() {
        Cause::Power
    } else if flags.borrstf().bit() {
        // Power-on sets this one, too.
        Cause::Brownout
    } else if flags.padrstf().bit() {
        Cause::Pin
    } else {
        Cause::Unknown
    }
}
