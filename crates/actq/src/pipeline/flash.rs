//! Images within a number of bytes, and the refusal of budgets that no image can meet.

use super::quantizer::{QuantizedPolicy, Quantizer};
use crate::budget::{Budget, BudgetTooSmall, Rate};
use crate::emit;
use crate::error::{Error, Result, ensure};
use crate::graph::tied::Tied;
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
    let (graph, mut values) = (&mut policy.graph, 0);
    if options.method == Method::Distill {
        values = graph.changed_values(options.learns());
        let tied = Tied::of(graph);
        // Use numbers that occur nowhere else, so that no constant is shared with a changed vector.
        graph.changed_vectors(options.learns()).flatten().zip(1..).for_each(|(value, n)| *value = f32::from_bits(n));
        let mut all: Vec<Vec<f32>> = graph.nodes.iter().flat_map(|node| node.kind.vectors()).cloned().collect();
        tied.take_first(&mut all);
        graph.nodes.iter_mut().flat_map(|node| node.kind.vectors_mut()).zip(all).for_each(|(vector, of)| *vector = of);
    }
    Ok(emit::bytes_beside_blocks(&policy)? - 4 * values - balance_bytes(&policy.graph))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::Recordings;
    use crate::testing::{dataset, transformer_of_modules};

    #[test]
    fn vectors_of_several_tokens_count_once() -> Result<()> {
        let policy = Policy::of("transformer", transformer_of_modules());
        let recordings = Recordings { calib: Some(dataset(&policy.graph, 10, 20)), heldout: None };
        let quantizer = Quantizer::new(&policy, &recordings, Method::Distill, None, |_| {})?;
        let options = |bytes| Options { steps: Some(5), ..Options::new(Method::Distill, Budget::ImageBytes(bytes)) };
        let refusal = check_budget(&policy, &options(0)).expect_err("no image has 0 bytes");
        let least = refusal.budget().expect("a budget").bytes;
        for bytes in [least, least + 1000, least + 2000] {
            let len = quantizer.quantize(&options(bytes), ())?.image.len();
            assert!(len <= bytes && 100 * len >= 97 * bytes, "{len} bytes for a budget of {bytes}");
        }
        Ok(())
    }
}
