//! The parts that are any firmware's own.

use core::fmt::Write as _;
use core::future::poll_fn;
use core::task::Poll;

// The board's vector table.
use actq_boards as _;
use actq_firmware_support::host;
use actq_kernels::{Head, Image};
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;

actq_firmware_support::panic_to_host!();

/// Values of an observation.
pub const OBS: usize = 18;
/// Values of an action.
pub const AXES: usize = 6;
/// Words of scratch memory; `actq inspect` says how many an image needs.
pub const SCRATCH: usize = 2048;
/// Modelled instructions of a slice: 0.12 ms of a Cortex-M4 at 168 MHz.
pub const SLICE: u32 = 20_000;

/// Cycles of a tick: 1 kHz of the board's 25 MHz.
const PERIOD: u32 = 25_000;

/// Includes a file at an address that is a multiple of 4.
#[repr(C, align(4))]
struct Aligned<T: ?Sized>(T);
static IMAGE: &Aligned<[u8]> = &Aligned(*include_bytes!(env!(
    "ACTQ_IMAGE",
    "set ACTQ_IMAGE to the absolute path of an image of the UR3 policy (`actq quantize examples/ur3/policy` makes one)"
)));

/// An action.
pub type Action = [f32; AXES];

/// A head that has passed its self-test. Firmware that moves something says which of these went wrong.
pub fn open(scratch: &mut [u32]) -> Option<Head<'static, '_>> {
    let mut head = Head::new(Image::new_checked(&IMAGE.0).ok()?, scratch).ok()?;
    head.self_test().ok()?;
    Some(head)
}

/// The sensors, which have something new once.
#[derive(Debug)]
pub struct Sensors(Option<[f32; OBS]>);

impl Sensors {
    /// With the first observation of an image's self-test.
    pub fn new(image: &Image<'_>) -> Self {
        let (words, _) = image.self_test(0).unwrap_or_default();
        let mut observation = [0.0; OBS];
        observation.iter_mut().zip(words).for_each(|(value, word)| *value = f32::from_bits(u32::from_le(*word)));
        Self(Some(observation))
    }

    /// What has come since the last call.
    pub fn read(&mut self) -> Option<[f32; OBS]> {
        self.0.take()
    }

    /// Waits for what comes, as an async driver does. It comes once: nothing wakes who waits again.
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

/// The motors, and the ticks that they have had.
#[derive(Debug, Default)]
pub struct Motors(u32);

impl Motors {
    /// At a stand.
    pub const fn new() -> Self {
        Self(0)
    }

    /// What a control tick tells them: the last action, once there is one.
    pub fn tick(&mut self, action: Option<Action>) {
        self.0 += 1;
        let (Some(action), Some(mut out)) = (action, host::stdout()) else { return };
        let told = write!(out, "{}", self.0)
            .and_then(|()| action.iter().try_for_each(|value| write!(out, " {:08x}", value.to_bits())));
        host::exit(told.is_ok())
    }
}
