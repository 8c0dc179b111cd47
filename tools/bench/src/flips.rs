//! Single bit flips in the running application: each is injected into the board under QEMU at a random instruction, and
//! its outcome is classed by the outputs that the control tick passes to the power stage.
//!
//! The ELF file is the released one. The board is stopped by QEMU's GDB stub, and starts each trial from a snapshot of a
//! period. A timer that the application does not use interrupts it at the drawn cycle; the flip is made after the return
//! from that interrupt, so that registers and stack are those of the program. Then the outputs of the next tick are
//! read, and targets and outputs at the end of every period, when an observation is placed in the serial port's queue.

mod board;
mod gdb;

use std::fmt;

use actq::random::Random;
use actq_controller::{Axis, Output};
use actq_link::code::Fault;

pub use self::board::Board;

/// Ticks of a period, between two observations. A period lasts half a tick longer.
pub const PERIOD: u32 = 20;
/// Periods in which flips are injected: two evaluations of the network, whose chunk of actions is played for four.
pub const PERIODS: usize = 8;
/// Cycles of a tick.
pub const CYCLES: u32 = 25_000;
/// Periods from a flip to the end of its trial, if nothing was wrong in the last of them: more than a chunk.
pub const WINDOW: usize = 6;
/// Periods from a flip to the end of every trial: above the deadline, the watchdog's timeout and a scrub of the image.
pub const LONGEST: usize = 30;

/// Allowance for the rounding of a tick's change.
const ROUNDING: f32 = 1.001;

/// The memory of a flip.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Region {
    /// The image in flash.
    Image,
    /// The words of scratch memory that the image uses.
    Scratch,
    /// The variables: states, limits and queues; without the scratch memory.
    Variables,
    /// The stack in use, from the stack pointer on.
    Stack,
    /// The core's registers: r0 to r15, flags, s0 to s31, FPSCR.
    Registers,
}

impl Region {
    /// All regions.
    pub const ALL: [Self; 5] = [Self::Image, Self::Scratch, Self::Variables, Self::Stack, Self::Registers];
}

impl fmt::Display for Region {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Image => "image",
            Self::Scratch => "scratch",
            Self::Variables => "variables",
            Self::Stack => "stack",
            Self::Registers => "registers",
        })
    }
}

/// A bit flip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flip {
    /// Its memory.
    pub region: Region,
    /// Its period, below [`PERIODS`].
    pub period: usize,
    /// Cycles after the period's start.
    pub cycle: u32,
    /// Its byte, in 2^-32 of the region.
    place: u32,
    /// Its bit, 0 to 7.
    bit: u32,
}

impl Flip {
    /// Draws flip `number` of a region, uniform over time, bytes and bits.
    pub fn draw(seed: u64, region: Region, number: u64) -> Self {
        let mut random = Random::new(seed ^ (number << 8) ^ ((region as u64) << 40));
        Self {
            region,
            period: random.below(PERIODS),
            cycle: 1 + random.below((PERIOD * CYCLES) as usize) as u32,
            place: random.bits() as u32,
            bit: random.below(8) as u32,
        }
    }

    /// Returns the index of the byte in a region of `len` bytes.
    fn byte(&self, len: usize) -> usize {
        ((u64::from(self.place) * len as u64) >> 32) as usize
    }
}

/// The part that detected a flip.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Detection {
    /// The controller latched.
    Latch(Fault),
    /// The link or the guard refused a frame.
    Frame,
    /// An exception of the core: the handler leaves a record and resets.
    Exception,
    /// The watchdog reset a program that hung.
    Watchdog,
}

impl fmt::Display for Detection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Latch(fault) => write!(f, "latch: {fault}"),
            Self::Frame => f.write_str("refused frame"),
            Self::Exception => f.write_str("exception, reset"),
            Self::Watchdog => f.write_str("watchdog, reset"),
        }
    }
}

/// The consequence of a flip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outcome {
    /// No action differs in a bit, no output by more than the change of two ticks, and nothing was detected.
    Masked,
    /// Something detected it after `ticks`; `wrong` if an output was wrong before.
    Detected {
        /// The part that detected it.
        by: Detection,
        /// Ticks from the flip to the detection.
        ticks: u32,
        /// `true` if an output was wrong before.
        wrong: bool,
    },
    /// An output within its limits was wrong, and nothing was detected: a silent error.
    Wrong {
        /// The largest difference of an output, in parts of its range.
        share: f32,
        /// Periods with a wrong action or output at their end.
        periods: usize,
    },
    /// An output was outside its limits.
    Outside,
}

/// The axes at the end of a period.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// Bits of the last applied action, after the limits.
    targets: Vec<u32>,
    /// Outputs of the last tick; `None` for an axis that is not driven.
    outputs: Vec<Option<f32>>,
}

/// Compares a trial with the periods without a flip.
struct Judge<'a> {
    reference: &'a [Sample],
    axes: &'a [Axis],
    is_outside: bool,
    share: f32,
    wrong: usize,
    /// The last wrong period.
    last: Option<usize>,
}

impl<'a> Judge<'a> {
    fn new(reference: &'a [Sample], axes: &'a [Axis]) -> Self {
        Self { reference, axes, is_outside: false, share: 0.0, wrong: 0, last: None }
    }

    /// Returns `true` if outputs are within their limits.
    fn is_within(&self, outputs: &[Option<f32>]) -> bool {
        outputs
            .iter()
            .zip(self.axes)
            .all(|(output, axis)| output.is_none_or(|value| Output::Drive(value).is_within(axis)))
    }

    /// Takes the end of a period.
    fn take(&mut self, period: usize, sample: &Sample) {
        self.is_outside |= !self.is_within(&sample.outputs);
        let Some(right) = self.reference.get(period) else { return };
        let mut share = None;
        for (i, axis) in self.axes.iter().enumerate() {
            let range = axis.high() - axis.low();
            if sample.targets[i] != right.targets[i] {
                let [is, should] = [sample.targets[i], right.targets[i]].map(f32::from_bits);
                share = Some(((is - should).abs() / range).max(share.unwrap_or(0.0)));
            }
            // An action may come two ticks earlier or later: a trial stops twice more than the periods without a flip, and
            // each stop ends a tick.
            let difference = match (sample.outputs[i], right.outputs[i]) {
                (Some(is), Some(should)) => (is - should).abs(),
                (is, should) => {
                    if is == should {
                        0.0
                    } else {
                        range
                    }
                }
            };
            if difference.is_nan() || difference > 2.0 * axis.rate() * ROUNDING {
                share = Some((difference / range).max(share.unwrap_or(0.0)));
            }
        }
        if let Some(share) = share {
            self.share = self.share.max(share);
            self.wrong += 1;
            self.last = Some(period);
        }
    }

    /// Returns `true` if this period was right.
    fn is_right(&self, period: usize) -> bool {
        self.last != Some(period)
    }

    fn outcome(&self, detected: Option<(Detection, u32)>) -> Outcome {
        match detected {
            _ if self.is_outside => Outcome::Outside,
            Some((by, ticks)) => Outcome::Detected { by, ticks, wrong: self.wrong > 0 },
            None if self.wrong > 0 => Outcome::Wrong { share: self.share, periods: self.wrong },
            None => Outcome::Masked,
        }
    }
}

#[cfg(test)]
mod tests {
    use actq_controller::SafeAction;

    use super::*;

    /// Judges samples of an axis from -1 to 1 at 0.25 a tick, whose targets and outputs should be 0.5.
    fn outcome(samples: &[(f32, Option<f32>)], detected: Option<(Detection, u32)>) -> Outcome {
        let axis = Axis::new(-1.0, 1.0, 0.25, 0.0, SafeAction::Coast).expect("the axis is valid");
        let sample =
            |&(target, output): &(f32, Option<f32>)| Sample { targets: vec![target.to_bits()], outputs: vec![output] };
        let reference = vec![sample(&(0.5, Some(0.5))); 4];
        let mut judge = Judge::new(&reference, std::slice::from_ref(&axis));
        samples.iter().enumerate().for_each(|(period, one)| judge.take(period, &sample(one)));
        judge.outcome(detected)
    }

    #[test]
    fn outcomes_follow_from_targets_and_outputs() {
        let right = (0.5, Some(0.5));
        assert_eq!(outcome(&[right, right], None), Outcome::Masked);
        assert_eq!(outcome(&[(0.5, Some(0.25))], None), Outcome::Masked, "a tick late");
        assert_eq!(outcome(&[right, (0.25, Some(0.5))], None), Outcome::Wrong { share: 0.125, periods: 1 });
        assert_eq!(outcome(&[(0.5, Some(-0.5)), (0.5, None)], None), Outcome::Wrong { share: 1.0, periods: 2 });
        assert_eq!(outcome(&[(0.5, Some(f32::NAN))], None), Outcome::Outside);
        assert_eq!(outcome(&[(0.5, Some(1.5))], Some((Detection::Watchdog, 1))), Outcome::Outside);
        let by = Detection::Latch(Fault::Image);
        assert_eq!(outcome(&[right], Some((by, 3))), Outcome::Detected { by, ticks: 3, wrong: false });
        assert_eq!(outcome(&[(1.0, Some(0.5))], Some((by, 3))), Outcome::Detected { by, ticks: 3, wrong: true });
    }

    #[test]
    fn flips_cover_a_region() {
        let flips: Vec<_> = (0..4000).map(|number| Flip::draw(1, Region::Stack, number)).collect();
        let bytes: std::collections::BTreeSet<_> = flips.iter().map(|flip| flip.byte(100)).collect();
        assert!(bytes.len() == 100 && bytes.last() == Some(&99));
        let ticks: std::collections::BTreeSet<_> =
            flips.iter().map(|flip| (flip.period, (flip.cycle - 1) / CYCLES)).collect();
        assert_eq!(ticks.len(), PERIODS * PERIOD as usize);
        assert_eq!(flips[7], Flip::draw(1, Region::Stack, 7));
        assert_ne!(flips[7].place, Flip::draw(2, Region::Stack, 7).place);
    }
}
