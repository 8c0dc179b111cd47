//! Whole calls of the kernels on the Cortex-M4, counted and modelled.

use actq_bench::cycles::Code;
use actq_bench::qemu::{self, Counter};
use actq_bench::{Target, firmware};
use actq_cli::report::table::{group_name, table};
use anyhow::{Result, bail, ensure};
use serde::Serialize;

/// A counted call: f32 activations to integers, the product, and the results back to f32.
#[derive(Debug, Serialize)]
pub(crate) struct Record {
    pub(crate) name: String,
    /// Bits per weight.
    pub(crate) bits: u32,
    /// Columns per u8 scale; 0 = one scale per row.
    pub(crate) group: usize,
    pub(crate) rows: usize,
    pub(crate) cols: usize,
    pub(crate) instructions: u64,
    #[serde(flatten)]
    cycles: Cycles,
}

/// Modelled cycles.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Cycles {
    /// With memory without wait states.
    pub(crate) cycles: u64,
    /// With the requested wait states.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) cycles_with_waits: Option<u64>,
}

impl Cycles {
    /// `wait_states` 0 requests none.
    pub(crate) fn new(code: &Code, region: &qemu::Region, wait_states: u64) -> Result<Self> {
        let with_waits = (wait_states > 0).then(|| code.cycles(region, wait_states)).transpose()?;
        Ok(Self { cycles: code.cycles(region, 0)?, cycles_with_waits: with_waits })
    }
}

impl Record {
    fn macs(&self) -> f64 {
        (self.rows * self.cols) as f64
    }

    fn shape(&self) -> (usize, usize) {
        (self.rows, self.cols)
    }

    /// Returns `true` for a kernel of the runtime, `false` for a yardstick.
    pub(crate) fn is_kernel(&self) -> bool {
        self.name.starts_with("gemv")
    }
}

/// Runs the bench firmware.
pub(crate) fn measure(counter: &Counter, wait_states: u64) -> Result<Vec<Record>> {
    let elf = firmware::binary("bench", Target::Fpu)?;
    let (lines, regions) = counter.run(Target::Fpu, &elf, None, &[])?;
    let code = Code::read(&elf)?;
    ensure!(lines.lines().count() == regions.len(), "the bench firmware and the counter disagree");
    let record = |(line, region): (&str, &qemu::Region)| {
        let fields: Vec<&str> = line.split_whitespace().collect();
        let [name, bits, group, rows, cols] = fields[..] else { bail!("the bench firmware printed {line:?}") };
        Ok(Record {
            name: name.to_owned(),
            bits: bits.parse()?,
            group: group.parse()?,
            rows: rows.parse()?,
            cols: cols.parse()?,
            instructions: region.instructions,
            cycles: Cycles::new(&code, region, wait_states)?,
        })
    };
    lines.lines().zip(&regions).map(record).collect()
}

/// Formats the records as a table, all of them or those of one shape.
pub(crate) fn report(records: &[Record], shape: Option<(usize, usize)>) -> String {
    let waits = records.iter().any(|r| r.cycles.cycles_with_waits.is_some());
    let mut header =
        vec!["kernel", "bits", "scales", "shape", "instructions", "per MAC", "cycles", "per MAC", "against f32"];
    header.push("against int8");
    if waits {
        header.extend(["with waits", "per MAC"]);
    }
    let mut rows = table(&header);
    for record in records.iter().filter(|r| shape.is_none_or(|shape| r.shape() == shape)) {
        let cycles = record.cycles.cycles;
        let against = |name| {
            let other = records.iter().find(|r| r.name == name && r.shape() == record.shape());
            other.map_or("-".to_owned(), |other| format!("{:.1}x", other.cycles.cycles as f64 / cycles as f64))
        };
        let per_mac = |count: u64| format!("{:.3}", count as f64 / record.macs());
        let mut row = vec![
            record.name.clone(),
            record.bits.to_string(),
            if record.name == "naive-f32" { "-".to_owned() } else { group_name(record.group) },
            format!("{}x{}", record.rows, record.cols),
            record.instructions.to_string(),
            per_mac(record.instructions),
            cycles.to_string(),
            per_mac(cycles),
            against("naive-f32"),
            against("int8-smlad"),
        ];
        if let Some(cycles) = record.cycles.cycles_with_waits {
            row.extend([cycles.to_string(), per_mac(cycles)]);
        }
        rows.add_row(row);
    }
    rows.to_string()
}
