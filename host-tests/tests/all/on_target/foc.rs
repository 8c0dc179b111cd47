//! The current loop of a motor on the Cortex-M4: the host's bits with and without an FPU, and its cost with one.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use actq_bench::cycles::Code;
use actq_bench::qemu::{self, Counter, Region};
use actq_bench::{Target, firmware};
use actq_firmware_bench::functions::hash;
use actq_firmware_bench::trigonometry::{CASES, Case, LEN, results};
use actq_kernels::cost::Cost;
use anyhow::{Context as _, Result, ensure};

/// The firmware's output, and the cost of its counted regions.
fn counted(name: &'static str) -> Result<(String, Vec<Cost>)> {
    let elf = firmware::binary(name, Target::Fpu)?;
    let (text, regions) = Counter::build()?.run(Target::Fpu, &elf, None, &[])?;
    let code = Code::read(&elf)?;
    let cost = |region: Region| Ok(Cost { instructions: region.instructions, cycles: code.cycles(&region, 0)? });
    Ok((text, regions.into_iter().map(cost).collect::<Result<_>>()?))
}

fn without_fpu(name: &'static str) -> Result<String> {
    let elf = firmware::binary(name, Target::NoFpu)?;
    Ok(String::from_utf8(qemu::run(qemu::command_on(Target::NoFpu, &elf, None, "")?, &[])?.stdout)?)
}

/// The expected bits are those of `crates/actq-controller/tests/all/foc/motor.rs`.
#[test]
fn a_tick_keeps_its_bits_and_instruction_limit() -> Result<()> {
    let (text, mut costs) = counted("foc")?;
    assert_eq!(text, "fc3d4550\n");
    assert_eq!(without_fpu("foc")?, text);
    costs.sort_by_key(|cost| cost.instructions);
    ensure!(costs.len() == 100, "counted {} ticks", costs.len());
    let (median, most) = (costs[50], costs[99]);
    println!("observer and current loop: {median:?} in the median, {most:?} at most");
    assert!((300..=600).contains(&median.instructions) && most.instructions <= 630, "{median:?}, {most:?}");
    Ok(())
}

/// Tolerances of a current loop: degrees of an angle, the share of a current (a step of an ADC of 12 bits), the share
/// of a voltage's limit.
const DEGREES: f64 = 0.25;
const CURRENT: f64 = 1.0 / 4096.0;
const VOLTAGE: f64 = 0.005;

/// The worst error of a case as a share of its tolerance.
fn worst(kind: &str, case: &Case) -> f64 {
    const STEPS: i32 = 200_000;
    let of = |x: f32, y: f32| (case.function)(x, y).map(f64::from);
    let degrees = |[x, y]: [f64; 2], [u, v]: [f64; 2]| (x * v - y * u).atan2(x * u + y * v).abs().to_degrees();
    let error = |i: i32| {
        let share = (f64::from(i) + 0.5) / f64::from(STEPS);
        let (radians, square) = (((2.0 * share - 1.0) * PI) as f32, (4.0 * share) as f32);
        let (y, x) = f64::from(radians).sin_cos();
        match kind {
            "sine and cosine" => {
                let [sin, cos] = of(radians, 0.0);
                (degrees([cos, sin], [x, y]) / DEGREES).max((sin.hypot(cos) - 1.0).abs() / CURRENT)
            }
            "arctangent" => {
                let (sin, cos) = of(y as f32, x as f32)[0].sin_cos();
                degrees([cos, sin], [x, y]) / DEGREES
            }
            "inverse root" => (of(square, 0.0)[0] * f64::from(square).sqrt() - 1.0).abs() / VOLTAGE,
            "root" => (of(square, 0.0)[0] / f64::from(square).sqrt() - 1.0).abs() / VOLTAGE,
            _ => f64::INFINITY,
        }
    };
    (0..STEPS).map(error).fold(0.0, f64::max)
}

/// The chosen case takes the fewest cycles of those that are accurate enough.
#[test]
fn trigonometry_keeps_its_bits_and_the_cheapest_wins() -> Result<()> {
    let (text, costs) = counted("trigonometry")?;
    let of_host =
        |case: &Case| format!("{}: {:08x}\n", case.name, hash(&[results(case, &(case.inputs)()).as_flattened()]));
    assert_eq!(text, CASES.iter().map(of_host).collect::<String>());
    assert_eq!(without_fpu("trigonometry")?, text);
    ensure!(costs.len() == CASES.len(), "counted {} cases", costs.len());
    let mut good: BTreeMap<&str, Vec<(f64, &str)>> = BTreeMap::new();
    for (case, cost) in CASES.iter().zip(&costs).skip(1) {
        let each = |of: fn(&Cost) -> u64| (of(cost) as f64 - of(&costs[0]) as f64) / LEN as f64;
        let (kind, by) = case.name.split_once(": ").context("a case's name is KIND: SOURCE")?;
        let (instructions, cycles, worst) = (each(|c| c.instructions), each(|c| c.cycles), worst(kind, case));
        println!(
            "{:27} {instructions:7.1} instructions {cycles:7.1} cycles, {worst:9.6} of the allowed error",
            case.name
        );
        if worst <= 1.0 {
            good.entry(kind).or_default().push((cycles, by));
        }
    }
    for (kind, mut good) in good {
        good.sort_by(|a, b| a.0.total_cmp(&b.0));
        assert_eq!(good[0].1, "chosen", "{kind}: {good:?}");
        assert!(good[0].0 < 100.0 && good.len() > 1, "{kind}: {good:?}");
    }
    Ok(())
}
