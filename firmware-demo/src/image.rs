//! The checks of an image for this controller, and the axes from its contract.

use actq_boards::hal::Watchdog;
use actq_controller::axis::AxisError;
use actq_controller::{Axis, Limits, SafeAction};
use actq_kernels::{Head, Image};
use actq_link::code::Refusal;

use crate::running::SLICE;
use crate::timeouts::{MAX_SLICE, MAX_TEST};

/// Default rate of an axis, in full ranges (low to high) per second, if the build has none.
const RANGES_PER_SECOND: f32 = 10.0;

/// Opens an image: checks it and its lengths, and runs its self-test, which must match bit for bit. It feeds the
/// watchdog before the check, whose time grows with the image, and before each slice of the self-test, which is at most
/// [`MAX_SLICE`]. A self-test of more than [`MAX_TEST`] slices ends there. Returns the head, and the memory for the next
/// prefix: as many words as the image's prefix has, none without the feature `attention`.
///
/// # Errors
///
/// Returns the reason why the image may not run.
pub fn open<'i, 's>(
    bytes: &'i [u8],
    scratch: &'s mut [u32],
    lengths: [usize; 2],
    watchdog: &mut impl Watchdog,
) -> Result<(Head<'i, 's>, &'s mut [u32]), Refusal> {
    watchdog.feed();
    let image = Image::new_checked(bytes).map_err(|_| Refusal::Unfit)?;
    if [image.obs_len(), image.act_len()] != lengths {
        return Err(Refusal::Unfit);
    }
    let (scratch, memory) = split(&image, scratch).ok_or(Refusal::Unfit)?;
    let mut head = Head::new(image, scratch).map_err(|_| Refusal::Unfit)?;
    if head.least_budget() > MAX_SLICE {
        return Err(Refusal::Unfit);
    }
    let mut slices = 0;
    let passed = head.self_test_in_slices(SLICE, || {
        watchdog.feed();
        slices += 1;
        slices <= MAX_TEST
    });
    passed.map_err(|_| if slices > MAX_TEST { Refusal::Unfit } else { Refusal::SelfTest })?;
    Ok((head, memory))
}

/// Splits scratch memory into that of the head and that of the next prefix.
#[cfg(feature = "attention")]
fn split<'s>(image: &Image<'_>, scratch: &'s mut [u32]) -> Option<(&'s mut [u32], &'s mut [u32])> {
    let (scratch, rest) = scratch.split_at_mut_checked(image.scratch_words())?;
    Some((scratch, rest.get_mut(..image.prefix_bytes() / 4)?))
}

#[cfg(not(feature = "attention"))]
fn split<'s>(_: &Image<'_>, scratch: &'s mut [u32]) -> Option<(&'s mut [u32], &'s mut [u32])> {
    Some((scratch, &mut []))
}

/// Returns an axis for each value of an image's actions, at `hz` ticks per second. It has the stricter of the
/// contract's and the build's limits; the build has limits for each axis, or one for all. Without finite limits or with
/// too small a rate, and all of them without an image, because a damaged one may have had limits, an axis is
/// [`Axis::STILL`].
pub fn axes<const AXES: usize>(image: Option<&Image<'_>>, built: &[Limits], hz: f32) -> [Axis; AXES] {
    image.map_or([Axis::STILL; AXES], |image| axes_within(|i| image.limits(i), built, hz))
}

fn axes_within<const AXES: usize>(
    contract: impl Fn(usize) -> Option<[f32; 2]>,
    built: &[Limits],
    hz: f32,
) -> [Axis; AXES] {
    let mut axes = [Axis::STILL; AXES];
    for (i, place) in axes.iter_mut().enumerate() {
        let limits = Limits::of_axis(i, contract(i), built);
        *place = limits.and_then(|limits| axis(limits, hz).ok()).unwrap_or(Axis::STILL);
    }
    axes
}

/// Returns an axis at `hz` ticks per second, whose safe action is a ramp to 0, or coasting.
///
/// # Errors
///
/// [`AxisError::Rate`] if the change in a tick is too small beside the limits.
pub fn axis(limits: Limits, hz: f32) -> Result<Axis, AxisError> {
    let Limits { low, high, rate } = limits;
    let step = match rate {
        Some(rate) => rate / hz,
        // An axis with a single value does not move at any rate.
        None if low == high => 1.0 + high.abs(),
        // Of halves, because the range itself may be too large for f32.
        None => (high / 2.0 - low / 2.0) / (hz / 2.0 / RANGES_PER_SECOND),
    };
    let start = 0f32.max(low).min(high);
    let ramp = Axis::new(low, high, step, start, SafeAction::Ramp { step });
    // It coasts if 0 is outside the limits.
    ramp.or_else(|_| Axis::new(low, high, step, start, SafeAction::Coast))
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::vec::Vec;

    use actq_link::frame::CRC;

    use super::*;
    use crate::work::tests::WatchdogMock;

    /// Returns the example of `docs/FORMAT.md`, whose last five words are a step of its self-test, with `steps` of
    /// them.
    fn example(steps: u16) -> Vec<u32> {
        let lines = include_str!("../../docs/FORMAT.md").lines().skip_while(|line| *line != "```hex").skip(1);
        let hex = lines.take_while(|line| *line != "```").flat_map(|line| line[6..].split('#').next());
        let hex = hex.flat_map(str::split_whitespace).map(|byte| u8::from_str_radix(byte, 16).expect("a byte"));
        let bytes: Vec<u8> = hex.collect();
        let mut words: Vec<u32> = bytes.as_chunks().0.iter().map(|word| u32::from_le_bytes(*word)).collect();
        let step = words[58..].to_vec();
        (1..steps).for_each(|_| words.extend(&step));
        (words[2], words[17]) = (4 * words.len() as u32, words[17] & 0xffff_0000 | u32::from(steps));
        let rest: Vec<u8> = words[4..].iter().flat_map(|word| word.to_le_bytes()).collect();
        words[3] = CRC.checksum(&rest);
        words.iter().map(|word| word.to_le()).collect()
    }

    /// Each step is one slice.
    #[test]
    fn too_long_self_tests_are_refused() {
        for (steps, refusal) in [(1, None), (MAX_TEST as u16, None), (MAX_TEST as u16 + 1, Some(Refusal::Unfit))] {
            let (words, mut watchdog) = (example(steps), WatchdogMock::default());
            let bytes = bytemuck::cast_slice(&words);
            assert_eq!(open(bytes, &mut [0; 64], [2, 3], &mut watchdog).err(), refusal, "{steps} steps");
            assert_eq!(watchdog.feeds(), 1 + u32::from(steps));
        }
    }

    #[test]
    fn axes_have_the_limits_of_the_build() {
        let limits = |text: &str| text.parse::<Limits>().expect("valid limits");
        let all = axes_within::<2>(|_| None, &[limits("-1:3")], 1000.0);
        assert_eq!(all.map(|axis| (axis.low(), axis.high(), axis.rate(), axis.start())), [(-1.0, 3.0, 0.04, 0.0); 2]);
        let [wide] = axes_within(|_| None, &[limits("-2e38:2e38")], 1000.0);
        assert_eq!((wide.rate(), wide.safe()), (4e36, SafeAction::Ramp { step: 4e36 }));
        let [ramps, coasts, fixed] = axes_within(|_| None, &["-1:1:20", "2:4:8", "3:3"].map(limits), 1000.0);
        assert_eq!((ramps.rate(), ramps.safe()), (0.02, SafeAction::Ramp { step: 0.02 }));
        assert_eq!((coasts.rate(), coasts.start(), coasts.safe()), (0.008, 2.0, SafeAction::Coast));
        assert_eq!((fixed.low(), fixed.high(), fixed.start(), fixed.is_still()), (3.0, 3.0, 3.0, false));
    }

    #[test]
    fn one_contract_limit_tightens_the_builds() {
        let contract = |i: usize| [None, Some([f32::NEG_INFINITY, 0.5]), Some([0.25, f32::INFINITY])][i];
        let built = "-1:1".parse::<Limits>().expect("valid limits");
        let of = |built: &[Limits]| axes_within::<3>(contract, built, 1000.0).map(|axis| (axis.low(), axis.high()));
        assert_eq!(of(&[built]), [(-1.0, 1.0), (-1.0, 0.5), (0.25, 1.0)]);
        assert_eq!(axes_within::<3>(contract, &[], 1000.0), [Axis::STILL; 3]);
    }

    #[test]
    fn without_an_image_nothing_may_move() {
        let built = "-1:1".parse().expect("valid limits");
        assert_eq!(axes::<3>(None, &[built], 1000.0), [Axis::STILL; 3]);
        assert_eq!(open(&[0; 8], &mut [], [1; 2], &mut WatchdogMock::default()).err(), Some(Refusal::Unfit));
    }
}
