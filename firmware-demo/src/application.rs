//! What the firmware is for. [`crate::work`] and the tick call it; the link and the safety of a controller stand behind these two
//! traits, and know neither boards nor tasks.

use actq_boards::seams::Stage;
use actq_kernels::StepError;
use embedded_io::Write;

use crate::timing::Timing;

/// What an application may want to tell.
#[derive(Clone, Copy, Debug)]
pub struct Status {
    /// The tick's times.
    pub timing: Timing,
    /// Bytes of the serial port that were lost, modulo 2^32.
    pub lost: u32,
    /// Measures the bytes of stack that were in use at most.
    pub stack: fn() -> u32,
    /// Whether a head runs: its image was checked, and its self-test passed.
    pub ready: bool,
}

/// What runs below the tick, in the loop, between the slices of the head.
pub trait Application {
    /// Bytes have come, in order. Answers go to `out`.
    fn on_bytes(&mut self, bytes: &[u8], status: &Status, out: &mut impl Write);

    /// The observation of a step that is to begin, once for each step; asked whenever no step runs.
    fn observation(&mut self) -> Option<&[f32]>;

    /// A step has ended: its action, or why there is none.
    fn on_action(&mut self, action: Result<&[f32], StepError>, out: &mut impl Write);

    /// Whether all that must make progress has made it since the last call: only then is the watchdog fed.
    fn is_well(&mut self) -> bool;
}

/// What runs in the tick.
pub trait Control<S: Stage> {
    /// A tick, with the last action, if there has been one; what it commands goes to the power stage.
    fn on_tick(&mut self, action: Option<&[f32]>, stage: &mut S);
}
