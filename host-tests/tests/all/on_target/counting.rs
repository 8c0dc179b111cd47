//! The instruction counter and the model of cycles on a whole head.

use std::collections::BTreeSet;

use actq::measure::eval;
use actq::methods::Activations;
use actq::policy::Policy;
use actq::runtime::ImageBuffer;
use actq_bench::cycles::Code;
use actq_bench::qemu::{self, Counter};
use actq_bench::{Target, evaluation, firmware, rtn, ur3};
use actq_kernels::Width;
use anyhow::Result;

#[test]
fn a_step_reads_each_weight_once() -> Result<()> {
    let dir = ur3();
    let policy = Policy::load(&dir)?;
    let bytes = rtn(&policy, Width::W8, 0, Activations::Auto)?;
    let slot = qemu::slot(&bytes)?;
    let path = slot.path();
    let buffer = ImageBuffer::new(&bytes);
    let image = buffer.image(path)?;
    let recorded = eval::heldout(&dir, &image)?;
    let elf = firmware::harness(Target::Fpu)?;
    let (code, counter) = (Code::read(&elf)?, Counter::build()?);
    let count = || evaluation::count(&counter, Target::Fpu, &elf, Some(path), &image, recorded.episode(0));
    let region = count()?;

    // The network has run: no instruction makes more than four MACs. A line holds 16 weights of 8 bits; biases, scales
    // and the other reads are a tenth at most.
    let weights = policy.graph.weights() as u64;
    assert!(region.instructions > weights / 4, "{}", region.instructions);
    assert!((weights / 16..weights / 16 * 11 / 10).contains(&region.data_lines), "{} of {weights}", region.data_lines);

    let by_function = code.by_function(&region)?;
    assert_eq!(code.by_kind(&region)?.iter().sum::<u64>(), region.instructions);
    assert_eq!(by_function.iter().map(|(_, cost)| cost.instructions).sum::<u64>(), region.instructions);
    assert_eq!(by_function.iter().map(|(_, cost)| cost.cycles).sum::<u64>(), code.cycles(&region, 0)?);
    assert!(by_function.iter().all(|(name, _)| name != "?"), "{by_function:?}");
    let code_lines = region.code_lines + region.next_lines.iter().sum::<u64>();
    let executed: BTreeSet<u64> = region.executed.iter().map(|executed| executed.address / 16).collect();
    assert!(code_lines >= executed.len() as u64, "{code_lines} lines fetched, {} executed", executed.len());
    let lines = region.data_lines + code_lines;
    let waits = code.cycles(&region, 5)? - code.cycles(&region, 0)?;
    assert!((5 * region.data_lines..=5 * lines).contains(&waits), "{waits}");

    let again = count()?;
    assert_eq!((again.instructions, again.data_lines), (region.instructions, region.data_lines));
    Ok(())
}
