//! What the application asks of a board, beyond embedded-hal's PWM: the few things that have no trait there.

use embedded_hal::pwm::SetDutyCycle;

/// Bytes were received and lost, or came with a wrong frame or parity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lost;

/// Single bytes of a serial port, without waiting: for the handler of its interrupt, which comes with every byte that
/// is received.
pub trait Uart {
    /// The byte that was received, if one was.
    fn receive(&mut self) -> Option<Result<u8, Lost>>;

    /// Transmits a byte; false, with nothing done, where the transmitter is full.
    fn transmit(&mut self, byte: u8) -> bool;

    /// Whether the interrupt also comes when the transmitter has room. A port without such an interrupt does nothing
    /// here.
    fn ask_for_room(&mut self, on: bool);
}

/// A watchdog, which nothing can stop.
pub trait Watchdog {
    /// Starts it: without [`Watchdog::feed`] for this time it resets the board. False where it cannot be that long.
    fn start(&mut self, milliseconds: u16) -> bool;

    /// Starts the time anew.
    fn feed(&mut self);
}

/// What the core's clock runs from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// What it is meant to run from: a crystal.
    Crystal,
    /// The oscillator inside of the part, because the crystal's did not start: slower, and not exact.
    Fallback,
}

/// The core's clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Clock {
    /// Cycles a second.
    pub hz: u32,
    /// Its source.
    pub source: Source,
}

/// Why the board was reset, as far as its registers tell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// Its registers do not tell.
    Unknown,
    /// Power came on, or sagged.
    Power,
    /// The reset pin.
    Pin,
    /// The program.
    Software,
    /// A watchdog.
    Watchdog,
}

impl Cause {
    /// One word for it.
    pub const fn text(self) -> &'static str {
        match self {
            Self::Unknown => "unknown",
            Self::Power => "power",
            Self::Pin => "pin",
            Self::Software => "software",
            Self::Watchdog => "watchdog",
        }
    }
}

/// A motor's power stage.
pub trait Stage {
    /// Duty cycle of a phase.
    type Phase: SetDutyCycle;

    /// The three phases.
    fn phases(&mut self) -> &mut [Self::Phase; 3];

    /// Switches the outputs on; false where the break input or the hardware keeps them off.
    fn enable(&mut self) -> bool;

    /// Whether the outputs are on: not after a break, either.
    fn is_on(&mut self) -> bool;

    /// Switches all six outputs off, now.
    fn disable(&mut self);

    /// Two phase currents that were measured in the middle of the last period, as the ADC gives them (0 to 4095);
    /// `None` where there are no new ones.
    fn currents(&mut self) -> Option<[u16; 2]>;
}

/// A board that has been set up.
#[derive(Debug)]
pub struct Parts<U, W, S> {
    /// The core's clock.
    pub clock: Clock,
    /// Why it was reset.
    pub cause: Cause,
    /// Its serial port.
    pub uart: U,
    /// Its watchdog.
    pub watchdog: W,
    /// Its power stage, off.
    pub stage: S,
}
