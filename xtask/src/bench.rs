//! `cargo xtask bench`: the kernels on the Cortex-M4, counted and modelled.

use std::path::{Path, PathBuf};

use actq::inspect::table;
use actq_host_tests::cycles::Code;
use actq_host_tests::qemu::{self, Counter, Target};
use anyhow::{Context, Result, bail, ensure};
use serde::Serialize;

/// A counted call: activations from f32, the product, and the results back in f32.
#[derive(Debug, Serialize)]
pub(crate) struct Record {
    name: String,
    /// Bits of a weight.
    bits: u32,
    /// Columns per u8 scale; 0 = one scale a row.
    group: usize,
    rows: usize,
    cols: usize,
    instructions: u64,
    /// Modelled: zero-wait memory.
    cycles: u64,
}

impl Record {
    fn macs(&self) -> f64 {
        (self.rows * self.cols) as f64
    }

    fn shape(&self) -> (usize, usize) {
        (self.rows, self.cols)
    }
}

pub(crate) fn run(json: Option<&Path>) -> Result<()> {
    // The bench firmware carries an image like every firmware, but does not run it.
    let image = placeholder()?;
    let records = measure(&image, &Counter::build()?)?;
    println!("\nWhole calls on the Cortex-M4: instructions counted, cycles modelled\n\n{}", report(&records, None));
    if let Some(path) = json {
        std::fs::write(path, serde_json::to_string_pretty(&records)? + "\n")
            .with_context(|| format!("{}: cannot be written", path.display()))?;
    }
    Ok(())
}

/// A file that stands in for the image where no image is run.
pub(crate) fn placeholder() -> Result<PathBuf> {
    let path = qemu::target_dir().join("placeholder-image");
    std::fs::create_dir_all(qemu::target_dir())?;
    std::fs::write(&path, [0u8; 4]).with_context(|| path.display().to_string())?;
    Ok(path)
}

/// Runs the bench firmware.
pub(crate) fn measure(image: &Path, counter: &Counter) -> Result<Vec<Record>> {
    let elf = qemu::build("bench", Target::Fpu, image)?;
    let mut command = qemu::command(&elf, None, "");
    counter.attach(&mut command, &elf)?;
    let output = qemu::run(command, &[])?;
    ensure!(output.status.success(), "the bench firmware failed: {}", String::from_utf8_lossy(&output.stderr));
    let code = Code::read(&elf)?;
    let regions = counter.regions()?;
    let lines = String::from_utf8(output.stdout)?;
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
            cycles: code.cycles(region)?,
        })
    };
    lines.lines().zip(&regions).map(record).collect()
}

/// The records as a table, all of them or those of one shape.
pub(crate) fn report(records: &[Record], shape: Option<(usize, usize)>) -> String {
    let mut rows =
        table(&["kernel", "bits", "scales", "shape", "instructions", "per MAC", "cycles", "per MAC", "against f32"]);
    for record in records.iter().filter(|r| shape.is_none_or(|shape| r.shape() == shape)) {
        let naive = records.iter().find(|r| r.name == "naive-f32" && r.shape() == record.shape());
        let scales = match (record.name.as_str(), record.group) {
            ("naive-f32", _) => "-".to_owned(),
            (_, 0) => "row".to_owned(),
            (_, group) => group.to_string(),
        };
        rows.add_row([
            record.name.clone(),
            record.bits.to_string(),
            scales,
            format!("{}x{}", record.rows, record.cols),
            record.instructions.to_string(),
            format!("{:.3}", record.instructions as f64 / record.macs()),
            record.cycles.to_string(),
            format!("{:.3}", record.cycles as f64 / record.macs()),
            naive.map_or("-".to_owned(), |n| format!("{:.1}x", n.cycles as f64 / record.cycles as f64)),
        ]);
    }
    rows.to_string()
}
