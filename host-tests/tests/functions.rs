//! What the functions cost on the Cortex-M4's FPU.

use actq::policy::Policy;
use actq::quantize::{Budget, Method, Options, quantize};
use actq::runtime::ImageBuffer;
use actq::writer;
use actq_host_tests::qemu::{self, Counter, Target};
use actq_host_tests::{root, shared_policies};
use actq_kernels::Width;
use actq_kernels::image::Op;
use anyhow::{Context, Result, ensure};

/// Instructions per element of one function.
const LIMIT: u64 = 30;

/// Functions of an element: an LSTM cell has three gates by sigmoid and two hyperbolic tangents, a GRU cell two gates and one.
fn functions(name: &str) -> u64 {
    match name {
        "lstm" => 5,
        "gru" => 3,
        _ => 1,
    }
}

#[test]
fn every_function_stays_within_its_instructions() -> Result<()> {
    // This firmware includes no image: any file will do.
    let elf = qemu::build("functions", Target::Fpu, &root().join("Cargo.toml"))?;
    let counter = Counter::build()?;
    let mut command = qemu::command(&elf, None, "");
    counter.attach(&mut command, &elf)?;
    let output = qemu::run(command, &[])?;
    ensure!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let (text, counts) = (String::from_utf8(output.stdout)?, counter.counts()?);
    ensure!(text.lines().count() == counts.len() && !counts.is_empty(), "the firmware and the counter disagree");
    for (line, count) in text.lines().zip(counts) {
        let (name, elements) = line.split_once(' ').context("a name and a number of elements")?;
        let elements: u64 = elements.parse()?;
        let limit = LIMIT * functions(name) * elements;
        assert!(count > elements && count <= limit, "{name}: {count} instructions for {elements} elements");
    }
    Ok(())
}

/// The gates of an LSTM are a small part of its head.
#[test]
fn a_head_with_an_lstm_stays_within_its_instructions() -> Result<()> {
    let Some(policies) = shared_policies() else { return Ok(()) };
    let policy = Policy::load(&policies.join("g1_lstm256"))?;
    let options = Options::new(Method::Rtn, Budget::Width(Width::W3));
    let bytes = writer::image(&policy, &quantize(&policy.graph, &[], &options)?)?;
    let file = tempfile::NamedTempFile::new()?;
    writer::write(file.path(), &bytes)?;
    let buffer = ImageBuffer::new(&bytes);
    let macs = |op: Op<'_>| if let Op::Linear { matrix, .. } = op { matrix.rows * matrix.cols } else { 0 };
    let macs = buffer.image(file.path())?.ops().map(macs).sum::<usize>() as f64;
    let elf = qemu::build("actq-firmware-demo", Target::Fpu, file.path())?;
    let counter = Counter::build()?;
    let mut command = qemu::command(&elf, None, "");
    counter.attach(&mut command, &elf)?;
    ensure!(qemu::run(command, &[])?.status.success(), "the firmware failed");
    let counts = counter.counts()?;
    ensure!(!counts.is_empty(), "no step was counted");
    for count in counts {
        assert!(count as f64 <= 1.30 * macs, "{count} instructions for {macs} MACs");
    }
    Ok(())
}
