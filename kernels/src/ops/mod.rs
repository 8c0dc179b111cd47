//! The operations of an image: each in its file, and here their list and the executor, which runs one of them.

mod around;
#[cfg(feature = "attention")]
pub mod attention;
pub mod cells;
pub mod denoise;
pub mod elementwise;
pub mod linear;
pub mod noise;
pub mod norm;

use self::denoise::{Coefficients, denoise};
use self::elementwise::{copy, copy_le};
use self::noise::normal;
use crate::arch;
use crate::arena::{part, regions};
use crate::cursor::Cursor;
use crate::error::Fault;
use crate::error::StepError;
use crate::image::{Op, OpKind, Region};
use crate::meter::Unlimited;
use crate::meter::{Meter, Work};

/// Runs a whole operation over an arena, as a head does in denoising step `step`. It is for callers that run a
/// network's operations one by one. Noise is read from the arena.
///
/// # Errors
///
/// As [`Head::step`](crate::Head::step).
pub fn run_whole(op: &Op<'_>, step: usize, arena: &mut [u32]) -> Result<(), StepError> {
    run(op, arena, &mut Cursor { step, ..Cursor::default() }, &mut Unlimited)?;
    Ok(())
}

/// Runs an operation from the cursor on; returns `true` at its end.
///
/// # Errors
///
/// [`Fault::Damaged`] if the operation names data that the image does not have, which a checked image excludes.
#[inline(always)]
pub(crate) fn run(op: &Op<'_>, arena: &mut [u32], cursor: &mut Cursor, budget: &mut impl Meter) -> Result<bool, Fault> {
    if matches!(op.kind, OpKind::Linear { .. }) {
        return op.multiply(arena, &mut cursor.linear, budget);
    }
    run_units(op, arena, cursor, budget)
}

/// Runs an operation that slices cut between its elements, or units of a norm, as [`run`] does. (Its stack frame is not that of
/// a product.)
#[inline(never)]
fn run_units(op: &Op<'_>, arena: &mut [u32], cursor: &mut Cursor, budget: &mut impl Meter) -> Result<bool, Fault> {
    let f = bytemuck::must_cast_slice_mut::<u32, f32>;
    let (dst, len) = (op.dst(), op.units());
    let units = budget.take(len - cursor.done, Work::Elements(op));
    if units == 0 {
        return Ok(false);
    }
    let units = cursor.done..cursor.done + units;
    cursor.done = units.end;
    if cfg!(feature = "flow") && op.kind == OpKind::Denoise {
        let (by, noise) = op.coefficients(cursor.step);
        let by = Coefficients::from_array(by);
        let noise = if by.sigma == 0.0 { Region::default() } else { Region { offset: noise, len: dst.len } };
        let [x, v, y, z] = regions(arena, &op.regions, noise).map(|all| f(part(all, &units)));
        if x.is_empty() {
            return Err(Fault::Damaged);
        }
        denoise(&by, op.constant(0), v, z, x, y);
        return Ok(units.end == len);
    }
    #[cfg(feature = "attention")]
    if op.kind.is_attention() {
        attention::run(op, arena, &units)?;
        return Ok(units.end == len);
    }
    if let Some(kind) = op.kind.around() {
        around::run(kind, op, arena, &units)?;
        return Ok(units.end == len);
    }
    let is_norm = cfg!(feature = "norm") && matches!(op.kind, OpKind::LayerNorm | OpKind::RmsNorm);
    let range = if is_norm { 0..dst.len } else { units.clone() };
    let [mut dst, mut src, third, _] = match op.src().len {
        0 => [part(arena, &(dst.offset + range.start..dst.offset + range.end)), &mut [], &mut [], &mut []],
        _ => regions(arena, &op.regions, Region::default()),
    };
    if matches!(op.kind, OpKind::Normalize { .. } | OpKind::Add | OpKind::Mul | OpKind::Copy) {
        (dst, src) = (part(dst, &range), part(src, &range));
    }
    if dst.is_empty() {
        return Err(Fault::Damaged);
    }
    match op.kind {
        OpKind::Function(function) => function.apply(f(dst)),
        OpKind::Add => elementwise::add(f(src), f(dst)),
        OpKind::Mul => elementwise::mul(f(src), f(dst)),
        OpKind::Copy => copy(src, dst),
        OpKind::Noise => {
            if let Some([seed, draw]) = cursor.draw.filter(|_| cfg!(feature = "flow")) {
                f(dst).iter_mut().zip(range.start as u32..).for_each(|(x, index)| *x = normal(seed, draw, index));
            }
        }
        OpKind::Table => copy_le(op.part(cursor.step, &range), dst),
        OpKind::LayerNorm | OpKind::RmsNorm if cfg!(not(feature = "norm")) => return Err(Fault::Damaged),
        OpKind::LstmCell if cfg!(feature = "recurrent") => {
            arch::lstm_elements(range.clone(), f(src), f(third), f(dst));
        }
        OpKind::GruCell if cfg!(feature = "recurrent") => {
            arch::gru_elements(range.clone(), f(src), f(third), f(dst));
        }
        kind @ (OpKind::Normalize { .. } | OpKind::LayerNorm | OpKind::RmsNorm) => {
            let (first, second) = (op.part(0, &range), op.part(1, &range));
            if (if kind == OpKind::RmsNorm { first } else { second }).is_empty() {
                return Err(Fault::Damaged);
            }
            let constant = op.constant(0);
            let (moments, done) = (&mut cursor.moments, units.clone());
            if !is_norm {
                elementwise::normalize(f(src), first, second, constant, op.constant(1), f(dst));
            } else if kind == OpKind::RmsNorm {
                norm::rms_norm_units(done, moments, f(dst), first, constant);
            } else {
                norm::layer_norm_units(done, moments, f(dst), first, second, constant);
            }
        }
        // The match has no wildcard: it does not compile without an arm for every operation. `Linear`, `Denoise`,
        // attention and the operations around a network have returned above, and a checked image has none that the
        // build leaves out.
        OpKind::Linear { .. }
        | OpKind::Denoise
        | OpKind::LstmCell
        | OpKind::GruCell
        | OpKind::Select
        | OpKind::Clip
        | OpKind::Constant
        | OpKind::Initial
        | OpKind::TableRow
        | OpKind::Standstill
        | OpKind::History => return Err(Fault::Damaged),
        #[cfg(feature = "attention")]
        OpKind::Keep | OpKind::Attend | OpKind::Rotary => return Err(Fault::Damaged),
    }
    Ok(units.end == len)
}
