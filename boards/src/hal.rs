//! The application's interface to a board, beyond embedded-hal's PWM: parts that have no trait there.

use embedded_hal::pwm::SetDutyCycle;

/// Received bytes were lost, or had a wrong frame or parity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UartError;

/// Non-blocking access to single bytes of a serial port, for the handler of its interrupt, which comes with every
/// received byte.
pub trait Uart {
    /// Returns the received byte, if any.
    fn receive(&mut self) -> Option<Result<u8, UartError>>;

    /// Transmits a byte; returns `false` without any change if the transmitter is full.
    fn transmit(&mut self, byte: u8) -> bool;

    /// Enables or disables the interrupt for a transmitter with room. A port without such an interrupt does nothing.
    fn set_transmit_interrupt(&mut self, on: bool);
}

/// A watchdog, which cannot be stopped.
pub trait Watchdog {
    /// Starts the watchdog: without [`Watchdog::feed`] for this time it resets the board. Returns `false` if it does
    /// not support this time.
    fn start(&mut self, milliseconds: u16) -> bool;

    /// Restarts the time.
    fn feed(&mut self);
}

/// The timer of the control tick, which triggers the tick at the end of each period.
pub trait Ticker {
    /// Starts the timer and its interrupt. `period` is in cycles of the board's [`Clock`].
    fn start(&mut self, period: u32);

    /// Returns the rest of the period in cycles: `period` - 1 after its begin, 0 at its end.
    fn count(&self) -> u32;

    /// Returns `true` if a period has ended since the last call.
    fn has_ended(&mut self) -> bool;
}

/// Source of the core's clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// The intended source, a crystal.
    Crystal,
    /// The part's internal oscillator, because the crystal did not start: slower and inaccurate.
    Fallback,
}

/// The clock of the core and of [`Ticker`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Clock {
    /// Cycles per second.
    pub hz: u32,
    /// Source of the clock.
    pub source: Source,
}

/// Cause of the board's reset, according to its registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// The registers do not show the cause.
    Unknown,
    /// Power-on or brown-out.
    Power,
    /// The reset pin.
    Pin,
    /// The program.
    Software,
    /// A watchdog.
    Watchdog,
    /// A supply voltage that was too low.
    Brownout,
}

impl Cause {
    /// Returns one word for the cause.
    pub const fn text(self) -> &'static str {
        match self {
            Self::Unknown => "unknown",
            Self::Power => "power",
            Self::Pin => "pin",
            Self::Software => "software",
            Self::Watchdog => "watchdog",
            Self::Brownout => "brown-out",
        }
    }
}

/// A motor's power stage.
pub trait Stage {
    /// A phase with its duty cycle.
    type Phase: SetDutyCycle;

    /// Returns the three phases.
    fn phases(&mut self) -> &mut [Self::Phase; 3];

    /// Switches the outputs on; returns `false` if the break input or the hardware keeps them off.
    fn enable(&mut self) -> bool;

    /// Returns `true` while the outputs are enabled; a break input disables them.
    fn is_on(&mut self) -> bool;

    /// Returns `true` while the break input is active, whether or not the outputs are enabled.
    fn is_broken(&mut self) -> bool;

    /// Switches all six outputs off immediately.
    fn disable(&mut self);

    /// Returns two phase currents, measured in the middle of the last period, as ADC values from 0 to 4095; `None`
    /// without new ones.
    fn currents(&mut self) -> Option<[u16; 2]>;
}

/// A board that has been set up.
#[derive(Debug)]
pub struct Parts<U, W, S, T> {
    /// The core's clock.
    pub clock: Clock,
    /// Cause of its last reset.
    pub cause: Cause,
    /// Its serial port.
    pub uart: U,
    /// Its watchdog.
    pub watchdog: W,
    /// Its power stage, off.
    pub stage: S,
    /// The timer of the control tick, off.
    pub ticker: T,
}
