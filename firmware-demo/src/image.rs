//! What an image has to be for this controller, and what its contract says of the axes.

use actq_boards::seams::Watchdog;
use actq_controller::{Axis, Limits, SafeAction};
use actq_kernels::image::header::W_SIZES;
use actq_kernels::{Head, Image};
use actq_link::code::Refusal;

use crate::patience::LONGEST;
use crate::running::SLICE;

/// How often an axis may go from one limit to the other in a second, where the build has no rate.
const WAYS: f32 = 10.0;

/// Values of an observation and of an action, by an image's header: an array's length, so that it is known when the
/// firmware is compiled. One each where the bytes are no image.
pub const fn lengths(image: &[u8]) -> [usize; 2] {
    let ([b'A', b'C', b'T', b'Q', ..], Some((_, [a, b, c, d, ..]))) = (image, image.split_at_checked(4 * W_SIZES))
    else {
        return [1; 2];
    };
    [u16::from_le_bytes([*a, *b]) as usize, u16::from_le_bytes([*c, *d]) as usize]
}

/// The head of an image that was checked, has these lengths, and whose self-test comes out bit for bit. The watchdog is
/// fed before the check, which is as long as the image, and before each slice of the self-test, of which no image makes
/// a longer one than [`LONGEST`].
///
/// # Errors
///
/// Why it may not run.
pub fn open<'i, 's>(
    bytes: &'i [u8],
    scratch: &'s mut [u32],
    lengths: [usize; 2],
    watchdog: &mut impl Watchdog,
) -> Result<Head<'i, 's>, Refusal> {
    watchdog.feed();
    let image = Image::new_checked(bytes).map_err(|_| Refusal::Unfit)?;
    if [image.obs_len(), image.act_len()] != lengths {
        return Err(Refusal::Unfit);
    }
    let mut head = Head::new(image, scratch).map_err(|_| Refusal::Unfit)?;
    if head.least_budget() > LONGEST {
        return Err(Refusal::Unfit);
    }
    head.self_test_in_pieces(SLICE, || watchdog.feed()).map_err(|_| Refusal::SelfTest)?;
    Ok(head)
}

/// An axis for each value of an image's actions, at `hz` ticks a second, with the stricter limits of its contract and of
/// the build: each axis has its own there, or all have one. Without finite limits of either, an axis is still.
pub fn axes<const AXES: usize>(image: Option<&Image<'_>>, built: &[Limits], hz: f32) -> [Axis; AXES] {
    let mut axes = [Axis::STILL; AXES];
    for (i, axis) in axes.iter_mut().enumerate() {
        let limits = Limits::of_axis(i, image.and_then(|image| image.limits(i)), built);
        *axis = limits.and_then(|limits| limited(limits, hz)).unwrap_or(Axis::STILL);
    }
    axes
}

/// An axis with 0 as its safe action.
fn limited(limits: Limits, hz: f32) -> Option<Axis> {
    let Limits { low, high, rate } = limits;
    let step = match rate {
        Some(rate) => rate / hz,
        // An axis with one value only goes nowhere, at any rate.
        None if low == high => 1.0,
        None => (high - low) / (hz / WAYS),
    };
    let start = 0f32.max(low).min(high);
    let ramp = Axis::new(low, high, step, start, SafeAction::Ramp { step });
    // Where 0 is outside the limits, there is no way to it.
    ramp.or_else(|_| Axis::new(low, high, step, start, SafeAction::Coast)).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::work::tests::Fed;

    #[test]
    fn bytes_that_are_no_image_have_the_least_lengths() {
        assert_eq!(lengths(b""), [1; 2]);
        assert_eq!(lengths(&[7; 64]), [1; 2]);
        let mut header = [0; 64];
        header[..4].copy_from_slice(b"ACTQ");
        header[4 * W_SIZES..][..4].copy_from_slice(&[18, 0, 6, 1]);
        assert_eq!(lengths(&header), [18, 262]);
    }

    #[test]
    fn axes_have_the_limits_of_the_build() {
        let limits = |text: &str| text.parse::<Limits>().expect("limits");
        let all = axes::<2>(None, &[limits("-1:3")], 1000.0);
        assert_eq!(all.map(|axis| (axis.low(), axis.high(), axis.rate(), axis.start())), [(-1.0, 3.0, 0.04, 0.0); 2]);
        let [ramps, coasts, fixed] = axes(None, &["-1:1:20", "2:4:8", "3:3"].map(limits), 1000.0);
        assert_eq!((ramps.rate(), ramps.safe()), (0.02, SafeAction::Ramp { step: 0.02 }));
        assert_eq!((coasts.rate(), coasts.start(), coasts.safe()), (0.008, 2.0, SafeAction::Coast));
        assert_eq!((fixed.low(), fixed.high(), fixed.start(), fixed.is_still()), (3.0, 3.0, 3.0, false));
    }

    #[test]
    fn without_an_image_nothing_may_move() {
        assert_eq!(axes::<3>(None, &[], 1000.0), [Axis::STILL; 3]);
        assert_eq!(open(&[0; 8], &mut [], [1; 2], &mut Fed::default()).err(), Some(Refusal::Unfit));
    }
}
