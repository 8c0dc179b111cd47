//! `cargo xtask descriptions`: random descriptions, each run in several ways.

use std::collections::BTreeMap;

use actq_bench::Target;
use actq_bench::descriptions::{Compared, compare};
use actq_bench::qemu::same_bits;
use anyhow::{Context as _, Result, ensure};

/// Compares `count` descriptions; the images of the first `in_qemu` of them run in QEMU, too.
pub(crate) fn run(first: u64, count: u64, in_qemu: u64) -> Result<()> {
    let (mut counts, mut wrong, mut served) = (BTreeMap::<&str, u64>::new(), 0, 0);
    for seed in first..first + count {
        let compared = compare(seed).and_then(|compared| {
            if let Compared::Same(image, raw) = &compared
                && served < in_qemu
            {
                same_bits(Target::Fpu, image, raw).with_context(|| format!("seed {seed}"))?;
                served += 1;
            }
            Ok(compared)
        });
        match compared {
            Ok(Compared::Same(..)) => *counts.entry("agree").or_default() += 1,
            Ok(Compared::Refused(reason)) => *counts.entry(reason).or_default() += 1,
            Err(error) => {
                wrong += 1;
                println!("{error:#}");
            }
        }
    }
    println!("{count} descriptions from seed {first}, {served} of them in QEMU; {wrong} differ");
    for (what, count) in counts {
        println!("{count:>8} {what}");
    }
    ensure!(wrong == 0, "{wrong} descriptions differ");
    Ok(())
}
