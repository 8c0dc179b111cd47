//! The price of the kernels' feature `checksums`, with the bits of a build without it.

use actq::policy::Policy;
use actq_bench::profile::Harness;
use actq_bench::{Target, bits, ur3};
use actq_kernels::cost::Cost;
use anyhow::{Result, ensure};

use super::cost::{distill, image, observations};

/// Most of the time of a step that evaluates the network.
const PRICE: f64 = 0.03;

#[test]
fn checksums_take_at_most_three_percent_of_a_step() -> Result<()> {
    let plain = Harness::build(Target::Fpu)?;
    let checked = Harness::build_with(Target::Fpu, "checksums")?;
    let policy = Policy::load(&ur3())?;
    let observations = &observations(&ur3(), &policy)?[..5];
    for width in [2.0, 3.0] {
        let image = image(&policy, &distill(width))?;
        let [plain, checked] = [&plain, &checked].map(|harness| harness.regions(&image, "serve", observations));
        let ((plain, actions), (checked, same)) = (plain?, checked?);
        ensure!(bits(&actions.concat()) == bits(&same.concat()), "the actions differ");
        for (plain, checked) in plain.iter().zip(&checked) {
            let share = |of: fn(&Cost) -> u64| of(checked) as f64 / of(plain) as f64 - 1.0;
            let shares = [share(|cost| cost.instructions), share(|cost| cost.cycles)];
            let percent = shares.map(|share| 1e2 * share);
            println!("{width} bits: {plain:?}, in percent more {percent:.2?}");
            // A step that continues a chunk is so short that a percentage means little.
            let few = checked.cycles - plain.cycles < 1000;
            ensure!(few || shares.iter().all(|share| (0.0..PRICE).contains(share)), "{shares:?}");
        }
    }
    Ok(())
}
