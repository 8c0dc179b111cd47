//! The timer of every Cortex-M as the control tick's.

use cortex_m::Peripherals;
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;

use crate::hal::Ticker;

/// SysTick.
pub struct SysTick(SYST);

impl SysTick {
    /// Returns the timer.
    ///
    /// # Safety
    ///
    /// Nothing else uses it.
    pub(crate) unsafe fn new() -> Self {
        // SAFETY: as the caller promises.
        Self(unsafe { Peripherals::steal() }.SYST)
    }
}

impl Ticker for SysTick {
    fn start(&mut self, period: u32) {
        self.0.set_clock_source(SystClkSource::Core);
        self.0.set_reload(period - 1);
        self.0.clear_current();
        self.0.enable_counter();
        self.0.enable_interrupt();
    }

    fn count(&self) -> u32 {
        SYST::get_current()
    }

    fn has_ended(&mut self) -> bool {
        self.0.has_wrapped()
    }
}
