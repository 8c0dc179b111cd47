//! `cargo xtask budgets`: compares the measured cost of the runtime with `budgets.json`.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use actq::emit::{Core, repack};
use actq::runtime::ImageBuffer;
use actq_bench::cycles::{CODE_LINES, Code};
use actq_bench::qemu::{self, Counter};
use actq_bench::{Target, capi, firmware, root, ur3};
use actq_cli::report::table::{group_name, table};
use actq_kernels::Width;
use anyhow::{Context, Result, bail, ensure};
use serde::{Deserialize, Serialize};

use crate::peers::cases::CASES;
use crate::{boards, heads, kernels};

/// Tolerance above a budget, in percent, for a compiler other than the recorded one (the compiler is not pinned) and,
/// for a head, another C library: a few choices follow from its logarithms.
const TOLERANCE_PERCENT: u64 = 2;

/// Limit for the bytes of code of the runtime without sliced steps: 24 KiB for step and chunk policies, and 8 for
/// products of values, five more functions, noise and the steps of flow and diffusion policies, the whole action
/// contract and playback, and 6 for operations around a network.
const RUNTIME_LIMIT: u64 = 38 * 1024;

/// Limits for the application: bytes of flash without its image, and bytes of RAM without its scratch memory.
const APPLICATION_FLASH_LIMIT: u64 = 64 * 1024;
const APPLICATION_RAM_LIMIT: u64 = 24 * 1024;
/// The flash on boards with more: cores without the DSP extension, whose kernels are compiled for speed, have the layouts
/// of two kinds of cores, and a Cortex-M55 the kernels of Helium beside those of the DSP extension.
const FLASH_LIMITS: [(Target, u64); 4] =
    [(Target::NoDsp, 120 * 1024), (Target::V6m, 120 * 1024), (Target::Riscv, 124 * 1024), (Target::M55, 72 * 1024)];

/// Functions to list if the runtime exceeds its budget.
const LISTED_FUNCTIONS: usize = 20;

const HEAD: &str = "instructions of a step, ";

const RUNTIME: &str = "bytes of code, whole runtime";
const RUNTIME_WITH_POLLS: &str = "bytes of code, whole runtime with begin and poll";
const LOOP: &str = "lines of inner loop, ";

type Figures = BTreeMap<String, u64>;

/// `budgets.json`.
#[derive(Debug, Serialize, Deserialize)]
struct Budgets {
    /// The compiler of the measured code.
    rustc: String,
    /// The allowed figures, by name.
    figures: Figures,
}

/// A figure above its budget.
#[derive(Debug, PartialEq, Eq)]
struct Excess {
    name: String,
    allowed: u64,
    measured: u64,
}

pub(crate) fn run(update: bool) -> Result<()> {
    let path = path();
    let measured = measure()?;
    let rustc = actq_boards::version("rustc").context("rustc is not installed")?;
    if update {
        let budgets = Budgets { rustc: rustc.clone(), figures: measured.clone() };
        fs::write(&path, serde_json::to_string_pretty(&budgets)? + "\n")
            .with_context(|| format!("cannot write {}", path.display()))?;
        println!("wrote {}; `git diff` shows the changes", path.display());
    }
    let text = fs::read_to_string(&path)
        .with_context(|| format!("cannot read {}; `cargo xtask budgets --update` writes it", path.display()))?;
    let budgets: Budgets = serde_json::from_str(&text).with_context(|| path.display().to_string())?;
    let stale = difference(&budgets.figures, &measured);
    ensure!(
        stale.is_empty(),
        "budgets.json and the measured figures differ in names; `cargo xtask budgets --update` renews it:\n  {}",
        stale.join("\n  ")
    );
    let excess = compare(&budgets, &measured, &rustc);
    if excess.is_empty() {
        let lower = measured.iter().filter(|(name, figure)| budgets.figures.get(*name).is_some_and(|b| b > figure));
        println!("{} figures are within their budgets, {} below", measured.len(), lower.count());
        return Ok(());
    }
    let mut rows = table(&["over budget", "allowed", "measured", "difference", "percent"]);
    for Excess { name, allowed, measured } in &excess {
        let difference = measured - allowed;
        let percent = format!("{:+.2}", 100.0 * difference as f64 / (*allowed).max(1) as f64);
        rows.add_row([name.clone(), allowed.to_string(), measured.to_string(), format!("+{difference}"), percent]);
    }
    println!("\n{rows}\n");
    if excess.iter().any(|excess| excess.name == RUNTIME) {
        println!("The runtime's largest functions\n\n{}\n", largest_functions(&runtime()?));
    }
    bail!("{} of {} figures are above their budgets", excess.len(), measured.len())
}

fn path() -> PathBuf {
    root().join("budgets.json")
}

/// Names that only one of the two has.
fn difference(budgets: &Figures, measured: &Figures) -> Vec<String> {
    let missing =
        measured.keys().filter(|name| !budgets.contains_key(*name)).map(|name| format!("no budget for {name}"));
    let gone = budgets.keys().filter(|name| !measured.contains_key(*name)).map(|name| format!("not measured: {name}"));
    missing.chain(gone).collect()
}

/// Returns the figures above their budgets, or above the limits of an inner loop, of the runtime and of the
/// application, which no budget raises.
fn compare(budgets: &Budgets, measured: &Figures, rustc: &str) -> Vec<Excess> {
    let allowed = |name: &str| {
        let tolerance = if budgets.rustc == rustc && !name.starts_with(HEAD) { 0 } else { TOLERANCE_PERCENT };
        let most = match name {
            RUNTIME => RUNTIME_LIMIT,
            _ if name.starts_with(boards::FLASH) => {
                let is_of =
                    |(target, _): &&(Target, u64)| name.strip_prefix(boards::FLASH) == Some(target.board().name);
                FLASH_LIMITS.iter().find(is_of).map_or(APPLICATION_FLASH_LIMIT, |(_, limit)| *limit)
            }
            _ if name.starts_with(boards::RAM) => APPLICATION_RAM_LIMIT,
            _ if name.starts_with(LOOP) => CODE_LINES,
            _ => u64::MAX,
        };
        let budget = budgets.figures.get(name).map_or(0, |budget| *budget.min(&most));
        let allowed = budget + budget * tolerance / 100;
        // Loops are in assembler: every compiler gives the same.
        if most == CODE_LINES { allowed.min(most) } else { allowed }
    };
    measured
        .iter()
        .map(|(name, &measured)| Excess { name: name.clone(), allowed: allowed(name), measured })
        .filter(|excess| excess.measured > excess.allowed)
        .collect()
}

fn measure() -> Result<Figures> {
    let counter = Counter::build()?;
    let mut figures = code()?;
    figures.extend(boards::measure(&counter)?);
    for record in kernels::measure(&counter, 0)?.into_iter().filter(kernels::Record::is_kernel) {
        let kernels::Record { name, bits, group, rows, cols, instructions, .. } = record;
        let scales = group_name(group);
        figures.insert(format!("instructions, {name} {bits} bits, scales {scales}, {rows}x{cols}"), instructions);
    }
    let stack = firmware::binary("stack", Target::Fpu)?;
    for head in heads::measure(&[ur3()], &counter, 0)? {
        let name = head.record.name();
        figures.insert(format!("{HEAD}{name}"), head.record.instructions);
        figures.insert(format!("bytes of scratch, {name}"), head.scratch_bytes as u64);
        let output = qemu::run(qemu::command(&stack, Some(&head.path), "")?, &[])?;
        let text = String::from_utf8_lossy(&output.stdout);
        let fields: Vec<&str> = text.split_whitespace().collect();
        let [check, self_test, step] = fields[..] else { bail!("the stack firmware failed on {name}: {output:?}") };
        for (what, bytes) in [("check", check), ("self-test", self_test), ("step", step)] {
            figures.insert(format!("bytes of stack, {what} of {name}"), bytes.parse()?);
        }
    }
    Ok(figures)
}

/// Measures the bytes of code of the whole runtime and of every function in assembler, and the lines of its longest
/// inner loop, which the instruction cache must hold.
fn code() -> Result<Figures> {
    let code = runtime()?;
    let with_polls = Code::read(&firmware::binary("runtime-poll", Target::Fpu)?)?;
    let mut figures =
        Figures::from([(RUNTIME.to_owned(), code.bytes()), (RUNTIME_WITH_POLLS.to_owned(), with_polls.bytes())]);
    for (name, target) in [("m3", Target::NoDsp), ("m0", Target::V6m)] {
        figures
            .insert(format!("{RUNTIME} on {name}"), Code::of(target, &firmware::binary("runtime", target)?)?.bytes());
    }
    // The program has no start code for RISC-V: the kernels' functions in the harness, with slices.
    let riscv = firmware::kernel_bytes(&firmware::harness(Target::Riscv)?)?;
    figures.insert(format!("{RUNTIME} on rv32imac"), riscv);
    for (name, core) in [("cortex-m3", Core::M3), ("cortex-m0plus", Core::M0), ("rv32imac", Core::Rv32imac)] {
        let bytes = repack(&CASES[0].quantized(Width::W2)?.0.image, core)?;
        let buffer = ImageBuffer::new(&bytes);
        let image = buffer.image(Path::new(name))?;
        let library = capi::Core::of(name).with_context(|| format!("no package for {name}"))?;
        figures.insert(format!("bytes of code, library for an MLP of 2 bits on {name}"), library.linked_bytes(&image)?);
    }
    for function in code.functions().iter().filter(|f| f.name.starts_with("actq_") && !f.name.contains("::")) {
        figures.insert(format!("bytes of code, {}", function.name), function.size);
        figures.insert(format!("{LOOP}{}", function.name), code.longest_inner_loop(function)?);
    }
    Ok(figures)
}

/// Measures the code of an application that does not slice its steps.
fn runtime() -> Result<Code> {
    Code::read(&firmware::binary("runtime", Target::Fpu)?)
}

fn largest_functions(code: &Code) -> String {
    let mut functions: Vec<_> = code.functions().iter().collect();
    functions.sort_by_key(|function| std::cmp::Reverse(function.size));
    let mut rows = table(&["bytes", "function"]);
    for function in functions.iter().take(LISTED_FUNCTIONS) {
        rows.add_row([function.size.to_string(), function.name.clone()]);
    }
    rows.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figures(entries: &[(&str, u64)]) -> Figures {
        entries.iter().map(|(name, figure)| ((*name).to_owned(), *figure)).collect()
    }

    fn excess(budget: (&str, u64), measured: u64, rustc: &str) -> Option<(u64, u64)> {
        let budgets = Budgets { rustc: "rustc 1".into(), figures: figures(&[budget]) };
        let excess = compare(&budgets, &figures(&[(budget.0, measured)]), rustc);
        excess.first().map(|excess| (excess.allowed, excess.measured))
    }

    #[test]
    fn a_figure_above_its_budget_fails() {
        assert_eq!(excess(("x", 1000), 1000, "rustc 1"), None);
        assert_eq!(excess(("x", 1000), 1001, "rustc 1"), Some((1000, 1001)));
    }

    #[test]
    fn another_compiler_and_heads_have_some_tolerance() {
        assert_eq!(excess(("x", 1000), 1020, "rustc 2"), None);
        assert_eq!(excess(("x", 1000), 1021, "rustc 2"), Some((1020, 1021)));
        let head = format!("{HEAD}x");
        assert_eq!(excess((&head, 1000), 1020, "rustc 1"), None);
        assert_eq!(excess((&head, 1000), 1021, "rustc 1"), Some((1020, 1021)));
    }

    #[test]
    fn no_budget_raises_a_limit() {
        assert_eq!(excess((&format!("{LOOP}f"), 70), 65, "rustc 2"), Some((64, 65)));
        assert_eq!(excess((RUNTIME, 40_000), 38_913, "rustc 1"), Some((38_912, 38_913)));
        let flash = format!("{}x", boards::FLASH);
        assert_eq!(excess((&flash, 70_000), 65_537, "rustc 1"), Some((65_536, 65_537)));
    }

    #[test]
    fn names_of_budgets_and_figures_must_agree() {
        let differing = difference(&figures(&[("a", 1), ("b", 1)]), &figures(&[("b", 1), ("c", 1)]));
        assert_eq!(differing, ["no budget for c", "not measured: a"]);
    }
}
