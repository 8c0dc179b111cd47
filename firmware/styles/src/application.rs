//! The parts that every firmware replaces by its own.

use core::fmt::Write as _;
use core::future::poll_fn;
use core::task::Poll;

// The board's vector table.
use actq_boards as _;
use actq_firmware_support::host;
use actq_kernels::{Head, Image, include_image};
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;

actq_firmware_support::panic_to_host!();

/// Length of an observation in values.
pub const OBS: usize = 18;
/// Length of an action in values.
pub const AXES: usize = 6;
/// Scratch memory in words; `actq inspect` shows how many an image needs.
pub const SCRATCH: usize = 2048;
/// Modelled instructions of a slice: about 0.17 ms of a Cortex-M4 at 168 MHz.
pub const SLICE: u32 = 20_000;

/// Cycles of a tick: 1 kHz of the board's 25 MHz.
const PERIOD: u32 = 25_000;

/// The image, in flash.
static IMAGE: &[u8] = include_image!(env!(
    "ACTQ_IMAGE",
    "set ACTQ_IMAGE to the absolute path of an image of the UR3 policy (`actq quantize examples/ur3/policy` makes one)"
));

/// An action.
pub type Action = [f32; AXES];

/// Ticks for which an action holds: long enough for the next one, and short enough to stop without it.
const HOLD: u32 = 100;

/// An action with the ticks for which it still holds.
#[derive(Clone, Copy, Debug)]
pub struct Held(Action, u32);

impl Held {
    /// Holds a new action.
    pub const fn new(action: Action) -> Self {
        Self(action, HOLD)
    }

    /// Counts a tick; without a newer action an old one ends.
    pub fn tick(self) -> Option<Self> {
        Some(Self(self.0, self.1.checked_sub(1)?))
    }
}

/// Returns a head that passed its self-test. Firmware that moves a robot should report which check failed.
pub fn open(scratch: &mut [u32]) -> Option<Head<'static, '_>> {
    let mut head = Head::new(Image::new_checked(IMAGE).ok()?, scratch).ok()?;
    head.self_test().ok()?;
    Some(head)
}

/// The sensors, which have one observation.
#[derive(Debug)]
pub struct Sensors(Option<[f32; OBS]>);

impl Sensors {
    /// Creates sensors with the first observation of an image's self-test.
    pub fn new(image: &Image<'_>) -> Self {
        let (words, _) = image.self_test(0).unwrap_or_default();
        let mut observation = [0.0; OBS];
        observation.iter_mut().zip(words).for_each(|(value, word)| *value = f32::from_bits(u32::from_le(*word)));
        Self(Some(observation))
    }

    /// Returns the new observation, if any.
    pub fn read(&mut self) -> Option<[f32; OBS]> {
        self.0.take()
    }

    /// Waits for an observation, as an async driver does. Only the first wait ends, because there is one observation.
    pub async fn wait(&mut self) -> [f32; OBS] {
        poll_fn(|_| self.read().map_or(Poll::Pending, Poll::Ready)).await
    }
}

/// Starts the control tick.
pub fn start_tick(mut timer: SYST) {
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(PERIOD - 1);
    timer.clear_current();
    timer.enable_counter();
    timer.enable_interrupt();
}

/// The motors, with the number of ticks so far.
#[derive(Debug, Default)]
pub struct Motors(u32);

impl Motors {
    /// Creates motors at rest.
    pub const fn new() -> Self {
        Self(0)
    }

    /// Applies the last action in a control tick; without one that holds, real motors get their safe action.
    pub fn tick(&mut self, held: Option<Held>) {
        self.0 += 1;
        let (Some(Held(action, _)), Some(mut out)) = (held, host::stdout()) else { return };
        let written = write!(out, "{}", self.0)
            .and_then(|()| action.iter().try_for_each(|value| write!(out, " {:08x}", value.to_bits())));
        host::exit(written.is_ok())
    }
}
