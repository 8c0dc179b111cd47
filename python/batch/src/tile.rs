//! A tile: heads that one thread runs together, few enough that their values stay in its caches.

use actq_kernels::{Head, StepError};
use fearless_simd::{Level, Simd, dispatch};

use crate::linear::{Linear, Operands};
use crate::product;
use crate::program::Operation;

/// A tile has a multiple of this number of heads, except the last one: a product computes as many together.
pub(crate) const LEAST: usize = product::HEADS;
/// Most heads of a tile.
pub(crate) const MOST: usize = 32;

/// Memory for the work on a tile, which any tile can use.
#[derive(Debug, Default)]
pub(crate) struct Work {
    operands: Operands,
    /// Errors of the heads in this step.
    errors: Vec<Option<StepError>>,
}

/// A tile in a step: row-major observations and actions, and for each head `true` to reset it before.
pub(crate) struct Tile<'t, 'o> {
    pub(crate) heads: &'t mut [Head<'o, 'o>],
    pub(crate) observations: &'t [f32],
    pub(crate) reset: Option<&'t [bool]>,
    pub(crate) actions: &'t mut [f32],
}

/// A head at an operation, and its error.
type AtOp<'t, 'o> = (&'t mut Head<'o, 'o>, &'t mut Option<StepError>);

impl Tile<'_, '_> {
    /// Runs a step of each head. A head without an action gets NaN; the first of them is returned.
    pub(crate) fn step(self, level: Level, program: &[Operation], work: &mut Work) -> Option<(usize, StepError)> {
        let Self { heads, observations, reset, actions } = self;
        let Work { operands, errors } = work;
        errors.clear();
        let rows = observations.chunks_exact(observations.len() / heads.len());
        for (i, (head, observation)) in heads.iter_mut().zip(rows).enumerate() {
            if reset.is_some_and(|reset| reset[i]) {
                head.reset();
            }
            errors.push(head.begin_ops(observation).err());
        }
        // All heads whose network runs are at the same operation, except those that have failed.
        while let Some(op) = heads.iter().find_map(Head::next_op) {
            let heads = heads.iter_mut().zip(errors.iter_mut()).filter(|(head, _)| head.next_op() == Some(op));
            match &program[op] {
                Operation::Linear(linear) => {
                    let mut heads: Vec<_> = heads.collect();
                    dispatch!(level, simd => multiply(simd, linear, operands, &mut heads));
                }
                Operation::Function(function, region) => heads.for_each(|(head, error)| {
                    *error = head
                        .replace_op(|arena| {
                            let x = bytemuck::must_cast_slice_mut(&mut arena[region.range()]);
                            dispatch!(level, _simd => function.apply_inlined(x));
                            Ok(())
                        })
                        .err();
                }),
                Operation::Other => heads.for_each(|(head, error)| *error = head.run_op().err()),
            }
        }
        let rows = actions.chunks_exact_mut(actions.len() / heads.len());
        for ((head, row), error) in heads.iter_mut().zip(rows).zip(errors.iter_mut()) {
            let action = match *error {
                None => head.finish_ops(),
                Some(error) => Err(error),
            };
            match action {
                Ok(action) => row.copy_from_slice(action),
                Err(failed) => {
                    row.fill(f32::NAN);
                    *error = Some(failed);
                }
            }
        }
        errors.iter().enumerate().find_map(|(i, error)| error.map(|error| (i, error)))
    }
}

/// Runs a linear operation for the heads that are at it.
#[inline(always)]
fn multiply<S: Simd>(simd: S, linear: &Linear, operands: &mut Operands, heads: &mut [AtOp<'_, '_>]) {
    linear.begin(operands, heads.len());
    for (head, error) in heads.iter_mut() {
        if let Err(failed) = linear.quantize(simd, operands, &head.arena()[linear.src.range()]) {
            **error = head.replace_op(|_| Err(failed)).err();
        }
    }
    linear.multiply(simd, operands);
    let mut vector = 0;
    for (head, error) in heads.iter_mut() {
        if error.is_none() {
            **error = head
                .replace_op(|arena| {
                    // The closure is not compiled for the level.
                    simd.vectorize(
                        #[inline(always)]
                        || linear.scale_back(simd, operands, vector, arena),
                    );
                    Ok(())
                })
                .err();
            vector += 1;
        }
    }
}
