//! The action contract: what stands between the network's output and the robot.

use crate::error::Fault;
use crate::image::Image;
use crate::math::clamp;

/// Takes the network's output `next` through the contract in place, against the `last` action where there is one (`started`).
#[inline(always)]
pub(super) fn apply(image: &Image<'_>, next: &mut [u32], last: &[u32], started: bool) -> Result<(), Fault> {
    for (i, (next, last)) in next.iter_mut().zip(last).enumerate() {
        let [scale, offset, low, high, max_step] = image.contract_of(i);
        let a = f32::from_bits(*next) * scale + offset;
        if !a.is_finite() {
            return Err(Fault::NotFinite);
        }
        let mut a = clamp(a, low, high);
        if started {
            let last = f32::from_bits(*last);
            a = clamp(a, last - max_step, last + max_step);
        }
        *next = a.to_bits();
    }
    Ok(())
}
