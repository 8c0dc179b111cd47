//! `actq-bench flips`: injects bit flips into the running application, and shows the outcomes by region.

use std::collections::BTreeMap;

use actq::measure::eval;
use actq::runtime::ImageBuffer;
use actq_bench::flips::{Board, Detection, Flip, Outcome, Region};
use actq_bench::{Target, firmware, ur3};
use actq_cli::report::table::table;
use anyhow::{Context as _, Result, ensure};

/// A silent error is large if an output differs by more than this part of its range.
const LARGE: f32 = 0.01;

/// Injects `count` flips into each region.
pub(crate) fn run(seed: u64, count: u64, regions: &[Region], list: bool) -> Result<()> {
    let path = firmware::built_in()?;
    let buffer = ImageBuffer::read(path)?;
    let image = buffer.image(path)?;
    let observations: Vec<_> = eval::heldout(&ur3(), &image)?.episode(0).collect();
    let elf = firmware::controller(Target::Fpu, "")?;
    let start = || Board::start(&elf, &image, &observations);
    let mut board = start()?;
    let mut rows =
        table(&["region", "bytes", "flips", "masked", "detected", "of these late", "silent", "large", "outside"]);
    let (mut causes, mut outside) = (BTreeMap::<(Region, Detection), Vec<u32>>::new(), 0);
    for &region in regions {
        let mut outcomes = Vec::new();
        for number in 0..count {
            let flip = Flip::draw(seed, region, number);
            let outcome = board.run(&flip).with_context(|| format!("{flip:?}"))?;
            if list {
                println!("{flip:?} {outcome:?}");
            } else if (number + 1).is_multiple_of(100) {
                println!("{region}: {} of {count} flips", number + 1);
            }
            if let Outcome::Detected { by, ticks, .. } = outcome {
                causes.entry((region, by)).or_default().push(ticks);
            }
            if board.has_ended()? {
                board = start()?;
            }
            outcomes.push(outcome);
        }
        let of = |is: fn(&Outcome) -> bool| outcomes.iter().filter(|outcome| is(outcome)).count().to_string();
        outside += outcomes.iter().filter(|outcome| matches!(outcome, Outcome::Outside)).count();
        rows.add_row([
            region.to_string(),
            board.bytes(region)?.to_string(),
            count.to_string(),
            of(|outcome| matches!(outcome, Outcome::Masked)),
            of(|outcome| matches!(outcome, Outcome::Detected { .. })),
            of(|outcome| matches!(outcome, Outcome::Detected { wrong: true, .. })),
            of(|outcome| matches!(outcome, Outcome::Wrong { .. })),
            of(|outcome| matches!(outcome, Outcome::Wrong { share, .. } if *share > LARGE)),
            of(|outcome| matches!(outcome, Outcome::Outside)),
        ]);
    }
    println!("\n{rows}\n");
    let mut rows = table(&["region", "detected by", "flips", "ticks, median", "ticks, most"]);
    for ((region, by), mut ticks) in causes {
        ticks.sort_unstable();
        let [median, most] = [ticks[ticks.len() / 2], ticks[ticks.len() - 1]];
        rows.add_row([
            region.to_string(),
            by.to_string(),
            ticks.len().to_string(),
            median.to_string(),
            most.to_string(),
        ]);
    }
    println!("{rows}");
    ensure!(outside == 0, "{outside} flips led to an output outside its limits");
    Ok(())
}
