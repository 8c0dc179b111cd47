//! Images within a number of bytes, and the refusal of budgets that no image can meet.

use super::quantizer::{QuantizedPolicy, Quantizer};
use crate::budget::{Budget, BudgetTooSmall, Rate};
use crate::emit;
use crate::error::{Error, Result, ensure};
use crate::methods::distill::balance::balance_bytes;
use crate::methods::{Method, Options, Progress, least_bytes};
use crate::policy::Policy;

/// Refuses a budget of bits or bytes that no image of the policy can meet, from the shapes alone, before any work.
///
/// # Errors
///
/// [`BudgetTooSmall`] with the size of the smallest image. A balance does not count, since only the recording can
/// require it; with one, [`Quantizer::quantize`] may need some more bytes.
pub fn check_budget(policy: &Policy, options: &Options) -> Result<()> {
    let weights = policy.graph.weights();
    let check =
        |rate: Rate| BudgetTooSmall::check(least_bytes(&policy.graph, rate, options), rate.bytes(weights), weights);
    match options.budget {
        Budget::BitsPerWeight(bits) => check(Rate::BitsPerWeight(bits))?,
        Budget::ImageBytes(bytes) => {
            let fixed = fixed_bytes(policy.clone(), options)?;
            check(Rate::Bytes(bytes.saturating_sub(fixed))).map_err(|small| small.in_image(fixed, bytes))?;
        }
        Budget::Width(_) | Budget::MaxNmse(_) | Budget::Time(_) => (),
    }
    Ok(())
}

/// Makes the image of at most `bytes` bytes; `options.budget` is ignored.
pub(super) fn within(
    quantizer: &Quantizer<'_>,
    options: &Options,
    bytes: usize,
    progress: &mut dyn FnMut(Progress),
) -> Result<QuantizedPolicy> {
    let fixed = fixed_with_balance(quantizer, options)?;
    let in_image = |error: Error| match error.budget() {
        Some(small) => small.in_image(fixed, bytes).into(),
        None => error,
    };
    let found = quantizer.at(Rate::Bytes(bytes.saturating_sub(fixed)), options, progress).map_err(in_image)?;
    let len = found.whole_image()?.len();
    // Equal constants share storage, and learned ones may be equal or different by chance.
    ensure!(len <= bytes, "the image takes {len} bytes, but {bytes} are allowed; allow {len} bytes or more");
    Ok(found)
}

/// Returns the bytes that a rate may count for an image of at most `bytes` bytes.
pub(super) fn room(quantizer: &Quantizer<'_>, options: &Options, bytes: usize) -> Result<usize> {
    Ok(bytes.saturating_sub(fixed_with_balance(quantizer, options)?))
}

/// As [`fixed_bytes`], of a graph that balances columns and so may have more operations than the policy's.
fn fixed_with_balance(quantizer: &Quantizer<'_>, options: &Options) -> Result<usize> {
    let policy = Policy { graph: quantizer.method.graph().clone(), ..quantizer.policy.clone() };
    fixed_bytes(policy, options)
}

/// Returns the bytes of an image beside those that a rate in bytes counts.
fn fixed_bytes(mut policy: Policy, options: &Options) -> Result<usize> {
    let mut values = 0;
    if options.method == Method::Distill {
        // Use numbers that occur nowhere else, so that no constant is shared with a changed vector.
        for value in policy.graph.changed_vectors(options.learns()).flatten() {
            values += 1;
            *value = f32::from_bits(values);
        }
    }
    Ok(emit::bytes_beside_blocks(&policy)? - 4 * values as usize - balance_bytes(&policy.graph))
}
