//! A tile: heads that one thread runs together, few enough that their values stay in its caches.

use actq_kernels::{Head, Image, Parked, StepError};
use fearless_simd::{Level, Simd, dispatch};

use crate::linear::{Linear, Operands};
use crate::product;
use crate::program::Operation;

/// A tile has a multiple of this number of heads, except the last one: a product computes as many together.
pub(crate) const LEAST: usize = product::HEADS;
/// Most heads of a tile.
pub(crate) const MOST: usize = 16;

/// Memory for the work on a tile, which any tile can use.
#[derive(Debug, Default)]
pub(crate) struct Work {
    /// Scratch memory of heads.
    scratch: Vec<u32>,
    operands: Operands,
    /// Errors of the heads in this step.
    errors: Vec<Option<StepError>>,
}

/// A tile in a step: its heads with their words, row-major observations and actions, and for each head `true` to reset
/// it before.
pub(crate) struct Tile<'t> {
    pub(crate) image: Image<'t>,
    pub(crate) heads: &'t mut [Parked],
    pub(crate) words: &'t mut [u32],
    pub(crate) observations: &'t [f32],
    pub(crate) reset: Option<&'t [bool]>,
    pub(crate) actions: &'t mut [f32],
}

/// A head at an operation, and its error.
type AtOp<'t, 'o> = (&'t mut Head<'o, 'o>, &'t mut Option<StepError>);

impl Tile<'_> {
    /// Runs a step of each head. A head without an action gets NaN; the first of them is returned.
    pub(crate) fn step(self, level: Level, program: &[Operation], work: &mut Work) -> Option<(usize, StepError)> {
        let Self { image, heads: parked, words, observations, reset, actions } = self;
        let Work { scratch, operands, errors } = work;
        let (per_head, len) = (image.scratch_words(), words.len() / parked.len());
        scratch.resize(parked.len() * per_head, 0);
        let memory = scratch.chunks_exact_mut(per_head).zip(words.chunks_exact(len)).zip(parked.iter());
        // Each has the memory that a head needs.
        let heads = memory.filter_map(|((scratch, words), parked)| parked.resume(image, words, scratch).ok());
        let mut heads: Vec<_> = heads.collect();
        errors.clear();
        let rows = observations.chunks_exact(observations.len() / heads.len());
        for (i, (head, observation)) in heads.iter_mut().zip(rows).enumerate() {
            if reset.is_some_and(|reset| reset[i]) {
                head.reset();
            }
            errors.push(head.begin_ops(observation).err());
        }
        for (head, error) in heads.iter_mut().zip(errors.iter_mut()) {
            run_to_product(level, program, head, error);
        }
        // All heads whose network runs are at the same product, except those that have failed.
        while let Some(op) = heads.iter().find_map(Head::next_op) {
            let Operation::Linear(linear) = &program[op] else { break };
            let at_op = heads.iter_mut().zip(errors.iter_mut()).filter(|(head, _)| head.next_op() == Some(op));
            let mut at_op: Vec<_> = at_op.collect();
            let next = |(head, error): &mut AtOp<'_, '_>| run_to_product(level, program, head, error);
            dispatch!(level, simd => multiply(simd, linear, operands, &mut at_op, next));
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
        for ((head, parked), words) in heads.into_iter().zip(parked).zip(words.chunks_exact_mut(len)) {
            *parked = head.park(words);
        }
        errors.iter().enumerate().find_map(|(i, error)| error.map(|error| (i, error)))
    }
}

/// Runs a head's operations up to its next product.
fn run_to_product(level: Level, program: &[Operation], head: &mut Head<'_, '_>, error: &mut Option<StepError>) {
    while let Some(op) = head.next_op() {
        let result = match &program[op] {
            Operation::Linear(_) => return,
            Operation::Function(function, region) => head.replace_op(|arena| {
                let x = bytemuck::must_cast_slice_mut(&mut arena[region.range()]);
                dispatch!(level, _simd => function.apply_inlined(x));
                Ok(())
            }),
            Operation::Other => head.run_op(),
        };
        *error = result.err();
    }
}

/// Runs a linear operation for the heads that are at it, and `then` for each of them, while its outputs are in the
/// nearest cache.
#[inline(always)]
fn multiply<S: Simd>(
    simd: S,
    linear: &Linear,
    operands: &mut Operands,
    heads: &mut [AtOp<'_, '_>],
    then: impl Fn(&mut AtOp<'_, '_>),
) {
    linear.begin(operands, heads.len());
    for (head, error) in heads.iter_mut() {
        if let Err(failed) = linear.quantize(simd, operands, &head.arena()[linear.src.range()]) {
            **error = head.replace_op(|_| Err(failed)).err();
        }
    }
    linear.multiply(simd, operands);
    let mut vector = 0;
    for at_op in heads {
        let (head, error) = at_op;
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
            then(at_op);
        }
    }
}
