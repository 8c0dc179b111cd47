//! `cargo xtask bench`: kernels and whole heads on the Cortex-M4, counted and modelled.

use std::path::Path;

use actq_bench::qemu::Counter;
use anyhow::{Context, Result};
use serde::Serialize;

use crate::{heads, kernels};

/// The content of the JSON file.
#[derive(Serialize)]
#[serde(untagged)]
enum Entry<'a> {
    Kernel(&'a kernels::Record),
    Head(&'a heads::Record),
}

pub(crate) fn run(json: Option<&Path>, wait_states: u64, by_function: bool) -> Result<()> {
    let counter = Counter::build()?;
    let kernels = kernels::measure(&counter, wait_states)?;
    println!(
        "\nWhole calls on the Cortex-M4: QEMU counts instructions, cycles are modelled\n\n{}",
        kernels::report(&kernels, None)
    );
    let heads = heads::measure(&heads::policies(), &counter, wait_states)?;
    println!("\nWhole heads: a step that evaluates the network\n\n{}", heads::report(&heads));
    println!("\nTheir instructions per MAC, by kind\n\n{}", heads::report_kinds(&heads));
    if by_function {
        println!("\nTheir instructions, by function\n\n{}", heads::report_functions(&heads));
    }
    if wait_states > 0 {
        println!(
            "\nwith waits: a model of flash with {wait_states} wait states behind the caches of an STM32F4 (docs/KERNELS.md)"
        );
    }
    if let Some(path) = json {
        let kernels = kernels.iter().map(Entry::Kernel);
        let all: Vec<Entry<'_>> = kernels.chain(heads.iter().map(|head| Entry::Head(&head.record))).collect();
        std::fs::write(path, serde_json::to_string_pretty(&all)? + "\n")
            .with_context(|| format!("cannot write {}", path.display()))?;
    }
    Ok(())
}
