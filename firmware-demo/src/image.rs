//! What an image has to be for this controller, and what its contract says of the axes.

use actq_boards::seams::Watchdog;
use actq_controller::{Axis, SafeAction};
use actq_kernels::image::header::W_SIZES;
use actq_kernels::{Head, Image};
use actq_link::code::Refusal;

use crate::patience::LONGEST;
use crate::running::SLICE;

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

/// An axis for each value of an image's actions, with the limits of its contract, the whole way in `ticks`, and 0 as
/// its safe action. Without an image or without finite limits, an axis stays where it is.
pub fn axes<const AXES: usize>(image: Option<&Image<'_>>, ticks: f32) -> [Axis; AXES] {
    let [_, _, low, high, ..] = image.map(Image::contract_arrays).unwrap_or_default();
    let mut axes = [Axis::STILL; AXES];
    for ((axis, low), high) in axes.iter_mut().zip(low).zip(high) {
        let [low, high] = [low, high].map(|word| f32::from_bits(u32::from_le(*word)));
        let (rate, start) = ((high - low) / ticks, 0f32.max(low).min(high));
        let ramp = Axis::new(low, high, rate, start, SafeAction::Ramp { step: rate });
        // Where 0 is outside the limits, there is no way to it.
        let found = ramp.or_else(|_| Axis::new(low, high, rate, start, SafeAction::Coast));
        *axis = found.unwrap_or(Axis::STILL);
    }
    axes
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
    fn without_an_image_nothing_may_move() {
        assert_eq!(axes::<3>(None, 100.0), [Axis::STILL; 3]);
        assert_eq!(open(&[0; 8], &mut [], [1; 2], &mut Fed::default()).err(), Some(Refusal::Unfit));
    }
}
