//! The action contract: the steps from the network's output to the robot's action.

use crate::error::Fault;
use crate::image::Image;
use crate::math::clamp;
use crate::ops::elementwise::copy;

/// Applies the contract to the network's output `next` and writes the result to `last`. If `started`, `last` holds the
/// previous action, which limits the step. `switches` keeps the state of binarized values.
#[inline(always)]
pub(super) fn apply(
    image: &Image<'_>,
    next: &mut [u32],
    last: &mut [u32],
    switches: &mut [u32],
    started: bool,
) -> Result<(), Fault> {
    // Results replace the output, and new states go to a second bit of the switches: an error must not change the last
    // action, not even in part.
    for (i, (next, last)) in next.iter_mut().zip(&*last).enumerate() {
        let [scale, offset, low, high, max_step, smoothing, on, off, on_value, off_value] = image.contract_of(i);
        let mut a = f32::from_bits(*next) * scale + offset;
        if !a.is_finite() {
            return Err(Fault::NotFinite);
        }
        if let Some(switch) = switches.get_mut(i)
            && on_value != off_value
        {
            let was = *switch & 1;
            let is = a >= on || a > off && was == 1;
            *switch = was | u32::from(is) << 1;
            a = if is { on_value } else { off_value };
        }
        a = clamp(a, low, high);
        if started {
            let last = f32::from_bits(*last);
            a = clamp(a, last - max_step, last + max_step);
            if smoothing < 1.0 {
                // Between both values, however it is rounded, so that all limits hold.
                let (low, high) = if last < a { (last, a) } else { (a, last) };
                a = clamp(last + smoothing * (a - last), low, high);
            }
        }
        *next = a.to_bits();
    }
    switches.iter_mut().for_each(|switch| *switch >>= 1);
    copy(next, last);
    Ok(())
}
