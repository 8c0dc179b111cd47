//! Whole heads on the Cortex-M4: a step that evaluates the network, counted and modelled.

use std::fs;
use std::path::{Path, PathBuf};

use actq::budget::Budget;
use actq::data::Recordings;
use actq::measure::eval;
use actq::measure::time::CLOCK;
use actq::methods::{Method, Options};
use actq::pipeline::Quantizer;
use actq::policy::Policy;
use actq::runtime::ImageBuffer;
use actq_bench::cycles::Code;
use actq_bench::instruction::Kind;
use actq_bench::qemu::Counter;
use actq_bench::{Target, evaluation, firmware, shared_policies, target_dir, ur3};
use actq_cli::outputs::files;
use actq_cli::report::table::table;
use actq_kernels::Width;
use actq_kernels::cost::Cost;
use anyhow::{Context, Result};
use serde::Serialize;

use crate::kernels::Cycles;

/// Steps of distillation: too few for accuracy, but the row widths, which matter here, are chosen before it. (The
/// matrices with int16 activations are chosen after it, and may differ a little.)
const STEPS: usize = 50;

/// Number of functions in the report by function of each head.
const FUNCTIONS: usize = 8;

/// A counted step.
#[derive(Debug, Serialize)]
pub(crate) struct Record {
    pub(crate) policy: String,
    /// Requested bits per weight.
    pub(crate) bits: f64,
    /// Multiplications of the f32 policy: its weights.
    macs: usize,
    pub(crate) instructions: u64,
    #[serde(flatten)]
    cycles: Cycles,
}

/// A measured head.
#[derive(Debug)]
pub(crate) struct Head {
    pub(crate) record: Record,
    /// The image's file.
    pub(crate) path: PathBuf,
    pub(crate) scratch_bytes: usize,
    /// Instructions by [`Kind`].
    kinds: [u64; Kind::ALL.len()],
    functions: Vec<(String, Cost)>,
}

impl Record {
    fn per_mac(&self, count: u64) -> String {
        format!("{:.3}", count as f64 / self.macs as f64)
    }

    fn bits(&self) -> String {
        if self.bits == 8.0 { "8".to_owned() } else { format!("{:.1}", self.bits) }
    }

    /// Formats the head by policy and bits.
    pub(crate) fn name(&self) -> String {
        format!("{} at {} bits", self.policy, self.bits())
    }
}

/// Returns the project's own policy, and the shared ones if present.
pub(crate) fn policies() -> Vec<PathBuf> {
    let names = ["go1_mlp", "g1_lstm256", "fetch_pickplace"];
    let shared = shared_policies().into_iter().flat_map(|folder| names.map(|name| folder.join(name)));
    std::iter::once(ur3()).chain(shared).collect()
}

/// Quantizes to an image file, and returns its bytes.
pub(crate) fn write_image(quantizer: &Quantizer<'_>, options: &Options, path: &Path) -> Result<Vec<u8>> {
    let bytes = quantizer.quantize(options, ())?.image;
    files::write(path, &bytes)?;
    Ok(bytes)
}

/// Quantizes each policy to 8, 3 and 2 bits per weight, and counts a step that evaluates the network.
pub(crate) fn measure(policies: &[PathBuf], counter: &Counter, wait_states: u64) -> Result<Vec<Head>> {
    let folder = target_dir().join("heads");
    fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    let elf = firmware::harness(Target::Fpu)?;
    let code = Code::read(&elf)?;
    let distill = |bits| Options { steps: Some(STEPS), ..Options::new(Method::Distill, Budget::BitsPerWeight(bits)) };
    let mut heads = Vec::new();
    for dir in policies {
        let policy = Policy::load(dir)?;
        let recordings = Recordings::load(&policy)?;
        let rounded = Quantizer::new(&policy, &recordings, Method::Rtn, None, |_| {})?;
        let learned = Quantizer::new(&policy, &recordings, Method::Distill, None, |_| {})?;
        for (quantizer, bits, options) in [
            (&rounded, 8.0, Options::new(Method::Rtn, Budget::Width(Width::W8))),
            (&learned, 3.0, distill(3.0)),
            (&learned, 2.0, distill(2.0)),
        ] {
            let path = folder.join(format!("{}-{bits}.actq", policy.name));
            let buffer = ImageBuffer::new(&write_image(quantizer, &options, &path)?);
            let image = buffer.image(&path)?;
            let recorded = eval::heldout(dir, &image)?;
            let region = evaluation::count(counter, Target::Fpu, &elf, Some(&path), &image, recorded.episode(0))?;
            heads.push(Head {
                record: Record {
                    policy: policy.name.clone(),
                    bits,
                    macs: policy.graph.weights(),
                    instructions: region.instructions,
                    cycles: Cycles::new(&code, &region, wait_states)?,
                },
                scratch_bytes: 4 * image.scratch_words(),
                path,
                kinds: code.by_kind(&region)?,
                functions: code.by_function(&region)?,
            });
        }
    }
    Ok(heads)
}

/// Formats the heads as a table.
pub(crate) fn report(heads: &[Head]) -> String {
    let waits = heads.iter().any(|h| h.record.cycles.cycles_with_waits.is_some());
    let mut header = vec!["policy", "bits", "MACs", "instructions", "per MAC", "cycles", "per MAC", "ms at 168 MHz"];
    if waits {
        header.extend(["with waits", "per MAC", "ms at 168 MHz"]);
    }
    let mut rows = table(&header);
    for Head { record, .. } in heads {
        let modelled =
            |cycles: u64| [cycles.to_string(), record.per_mac(cycles), format!("{:.2}", 1e3 * cycles as f64 / CLOCK)];
        let mut row = vec![record.policy.clone(), record.bits(), record.macs.to_string()];
        row.extend([record.instructions.to_string(), record.per_mac(record.instructions)]);
        row.extend(modelled(record.cycles.cycles));
        row.extend(record.cycles.cycles_with_waits.into_iter().flat_map(modelled));
        rows.add_row(row);
    }
    rows.to_string()
}

/// Formats the instructions per MAC by kind.
pub(crate) fn report_kinds(heads: &[Head]) -> String {
    let kinds = Kind::ALL.map(|kind| format!("{kind:?}").to_lowercase());
    let header: Vec<&str> = ["policy", "bits"].into_iter().chain(kinds.iter().map(String::as_str)).collect();
    let mut rows = table(&header);
    for Head { record, kinds, .. } in heads {
        let name = [record.policy.clone(), record.bits()];
        rows.add_row(name.into_iter().chain(kinds.iter().map(|count| record.per_mac(*count))));
    }
    rows.to_string()
}

/// Formats the functions with the most instructions.
pub(crate) fn report_functions(heads: &[Head]) -> String {
    let mut rows = table(&["policy", "bits", "instructions", "per MAC", "cycles", "function"]);
    for Head { record, functions, .. } in heads {
        for (name, cost) in functions.iter().take(FUNCTIONS) {
            rows.add_row([
                record.policy.clone(),
                record.bits(),
                cost.instructions.to_string(),
                record.per_mac(cost.instructions),
                cost.cycles.to_string(),
                name.clone(),
            ]);
        }
    }
    rows.to_string()
}
