//! The kernels with short loops (feature `compact`): the same bits, in little more time.

use std::path::PathBuf;

use actq_bench::cycles::Code;
use actq_bench::profile::Harness;
use actq_bench::qemu::Counter;
use actq_bench::{Target, firmware, ur3};
use anyhow::{Result, ensure};

use super::cost::{distill, polls_keep_their_budget};
use super::qemu::gives_the_sums_in;

#[test]
fn short_loops_give_the_golden_sums() -> Result<()> {
    gives_the_sums_in(&firmware::compact_binary("golden")?, Target::Fpu, &actq_bench::golden::dsp_cases(1), "Armv7em")
}

/// Upper limits of the ratio of short loops to the usual ones, of a whole call's instructions and modelled cycles, by
/// bits.
const LIMITS: [(&str, f64); 3] = [("3", 1.06), ("4", 1.10), ("8", 1.14)];

#[test]
fn short_loops_take_little_more_time() -> Result<()> {
    let counter = Counter::build()?;
    let calls = |elf: PathBuf| -> Result<(String, Vec<[u64; 2]>)> {
        let (lines, regions) = counter.run(Target::Fpu, &elf, None, &[])?;
        let code = Code::read(&elf)?;
        let costs =
            regions.iter().map(|region| Ok([region.instructions, code.cycles(region, 0)?])).collect::<Result<_>>()?;
        Ok((lines, costs))
    };
    let (lines, usual) = calls(firmware::binary("bench", Target::Fpu)?)?;
    let (same_lines, compact) = calls(firmware::compact_binary("bench")?)?;
    ensure!(lines == same_lines && lines.lines().count() == usual.len() && usual.len() == compact.len(), "{lines}");
    let mut measured = 0;
    for (line, (usual, compact)) in lines.lines().zip(usual.into_iter().zip(compact)) {
        let fields: Vec<&str> = line.split_whitespace().collect();
        // Only loops for row scales and int8 activations are short.
        let limit = LIMITS.into_iter().find(|(bits, _)| fields[..3] == ["gemv-a8", bits, "0"]);
        let Some((_, limit)) = limit else {
            // Cycles depend on where code lies.
            ensure!(usual[0] == compact[0], "{line}: {usual:?} usual, {compact:?} compact");
            continue;
        };
        let [instructions, cycles] = [0, 1].map(|i| compact[i] as f64 / usual[i] as f64);
        println!("{line}: {instructions:.3} times the instructions, {cycles:.3} times the cycles");
        ensure!(instructions > 1.0 && instructions < limit && cycles < limit, "{line}: {usual:?}, {compact:?}");
        measured += 1;
    }
    ensure!(measured >= 5 * LIMITS.len(), "{measured} calls");
    Ok(())
}

/// The target computes its costs with the passes of short loops; the host's least budget is that of the usual ones.
#[test]
fn polls_of_short_loops_stay_within_their_budget() -> Result<()> {
    let images = [distill(2.0), distill(3.0)];
    let harness = Harness::of(Target::Fpu, firmware::compact_binary("harness")?)?;
    let tried = polls_keep_their_budget(&harness, &ur3(), &images, |least| vec![least + least / 4, 40_000])?;
    ensure!(tried == 4, "{tried} budgets");
    Ok(())
}
