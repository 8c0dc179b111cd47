//! Scaling of sums to f32 in assembler, for ARMv6-M, ARMv7-M and RV32IM without an FPU.

use super::portable::scale_one;
use crate::math::soft::is_usual;

#[cfg(actq_armv6m)]
core::arch::global_asm!(include_str!("armv6m/scale.s"), options(raw));
#[cfg(actq_armv7m)]
core::arch::global_asm!(include_str!("armv7m/scale.s"), options(raw));
#[cfg(actq_rv32im)]
core::arch::global_asm!(include_str!("rv32im/scale.s"), options(raw));

unsafe extern "C" {
    /// Computes values of y from its begin on, and returns the address of the first one that it leaves to the caller, or
    /// the end. Needs an `x_scale` that [`is_usual`].
    fn actq_scale(
        sums: *const i32,
        start: *const u32,
        scales: *const u32,
        x_scale: u32,
        y: *mut f32,
        end: *const f32,
    ) -> *const f32;
}

/// Computes the same as the portable backend.
pub(crate) fn scale(sums: Option<&[i32]>, start: Option<&[u32]>, scales: &[u32], x_scale: f32, y: &mut [f32]) {
    let len = match (sums, start) {
        (None, None) => 0,
        _ => y.len().min(sums.map_or(usize::MAX, <[_]>::len)).min(start.map_or(usize::MAX, <[_]>::len)),
    };
    let len = len.min(2 * scales.len());
    let mut done = 0;
    while done < len {
        // The place of an odd row's scale is within a word: only even ones begin here.
        if done % 2 == 0 && is_usual(x_scale.to_bits()) {
            let begin = y.as_mut_ptr();
            let sums = sums.map_or(begin.cast_const().cast(), <[_]>::as_ptr);
            let start = start.map_or(begin.cast_const().cast(), <[_]>::as_ptr);
            // SAFETY: `done` is below `len`, and all slices have at least `len` values, two a word of `scales`. It reads
            // sums, start and scales from `done` up to `len`, and writes y there. Sums or start may be y itself: a value is
            // read before it is written.
            done = unsafe {
                let (sums, start) = (sums.add(done), start.add(done));
                let next = actq_scale(
                    sums,
                    start,
                    scales.as_ptr().add(done / 2),
                    x_scale.to_bits(),
                    begin.add(done),
                    begin.add(len),
                );
                next.offset_from(begin.cast_const()) as usize
            };
        }
        if done < len {
            scale_one(done, sums, start, scales, x_scale, y);
            done += 1;
        }
    }
}
