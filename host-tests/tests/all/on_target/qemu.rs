//! The firmware under QEMU: the assembler on the golden cases, and whole policies, bit for bit as on the host.

use std::fs;
use std::path::Path;
use std::process::Output;

use actq::data::{Recording, Sizes};
use actq::methods::Activations;
use actq::policy::Policy;
use actq::runtime::ImageBuffer;
use actq_bench::cycles::Code;
use actq_bench::firmware::{self, built_in, built_in_of};
use actq_bench::qemu;
pub(crate) use actq_bench::qemu::same_bits;
use actq_bench::{Target, golden, rtn, shared_policies, ur3};
use actq_kernels::Width;
use actq_kernels::image::{op, worst_case};
use actq_kernels::layout::Lanes;
use anyhow::{Context, Result, ensure};

use crate::draft::Draft;

/// Steps of each image on the host and in QEMU.
const STEPS: usize = 208;

#[test]
fn kernels_give_the_golden_sums_on_the_target() -> Result<()> {
    Target::ALL
        .into_iter()
        .filter(|target| target.has_assembler() && *target != Target::M55)
        .try_for_each(kernels_give_the_golden_sums)
}

/// Those for Helium and those of the DSP extension.
#[test]
fn kernels_give_the_golden_sums_on_the_m55() -> Result<()> {
    let cases = golden::cases(1).into_iter().filter(|case| case.shape.lanes != Lanes::Scalar);
    gives_the_sums(Target::M55, &cases.collect::<Vec<_>>(), "Helium")
}

/// An image of another core's layouts has the same sums, slowly.
#[test]
fn scalar_layouts_give_the_golden_sums_beside_the_assembler() -> Result<()> {
    let is_scalar = |case: &golden::Case| case.shape.lanes == Lanes::Scalar;
    let (scalar, _): (Vec<_>, Vec<_>) = golden::cases(1).into_iter().partition(is_scalar);
    gives_the_sums_in(&firmware::scalar_binary("golden")?, Target::Fpu, &scalar, "Armv7em")
}

/// Requires that the kernels in assembler give the host's sums on a target that has them.
pub(crate) fn kernels_give_the_golden_sums(target: Target) -> Result<()> {
    gives_the_sums(target, &golden::dsp_cases(1), "Armv7em")
}

fn gives_the_sums(target: Target, cases: &[golden::Case], backend: &str) -> Result<()> {
    gives_the_sums_in(&firmware::binary("golden", target)?, target, cases, backend)
}

pub(super) fn gives_the_sums_in(elf: &Path, target: Target, cases: &[golden::Case], backend: &str) -> Result<()> {
    let output = golden_run(elf, target, &golden::stream(cases))?;
    let text = String::from_utf8_lossy(&output.stdout);
    ensure!(output.status.success(), "{target:?}: {text}");
    assert_eq!(text.trim(), format!("{backend}: {} cases", cases.len()));
    Ok(())
}

fn golden_run(elf: &Path, target: Target, stream: &[u8]) -> Result<Output> {
    qemu::run(qemu::command_on(target, elf, None, "")?, stream)
}

#[test]
fn portable_kernels_give_the_golden_sums_without_assembler() -> Result<()> {
    // These builds have no layouts for Helium.
    let is_built = |case: &golden::Case| case.shape.lanes != Lanes::Helium;
    let cases: Vec<_> = golden::cases(1).into_iter().filter(is_built).collect();
    // The cases that fit the memory of the small target.
    let fits = |c: &&golden::Case| c.shape.cols <= 256 && c.words().len() + c.prepared().len() < 1500;
    let (all, short) =
        (golden::dsp_cases(1), golden::dsp_cases(1).into_iter().filter(|c| fits(&c)).collect::<Vec<_>>());
    ensure!(short.len() > all.len() / 2, "too few cases are short");
    // Zba changes the loops of bit planes.
    let is_planes =
        |case: &&golden::Case| case.shape.lanes == Lanes::Scalar && matches!(case.shape.width, Width::W2 | Width::W3);
    let planes: Vec<_> = golden::cases(1).into_iter().filter(|case| is_planes(&case)).collect();
    [
        (Target::NoDsp, &cases),
        (Target::Small, &short),
        (Target::V6m, &cases),
        (Target::Riscv, &cases),
        (Target::RiscvZb, &planes),
    ]
    .into_iter()
    .try_for_each(|(target, cases)| gives_the_sums(target, cases, "Portable"))
}

#[test]
fn a_wrong_sum_fails_the_golden_run() -> Result<()> {
    let mut stream = golden::stream(&golden::cases(1)[..3]);
    let last_sum = stream.len() - 8;
    // The last case may end in padding rows, whose sums are not compared: change all four of its last quad.
    stream[last_sum - 12..last_sum + 4].iter_mut().for_each(|byte| *byte ^= 1);
    for target in [Target::Fpu, Target::Riscv] {
        let output = golden_run(&firmware::binary("golden", target)?, target, &stream)?;
        let text = String::from_utf8_lossy(&output.stdout);
        assert!(!output.status.success() && text.contains("case 2: sums"), "{target:?}: {text}");
    }
    Ok(())
}

#[test]
fn the_built_in_image_replays_its_self_test() -> Result<()> {
    for target in Target::ALL {
        let path = built_in_of(target)?;
        let buffer = ImageBuffer::read(path)?;
        let image = buffer.image(path)?;
        let mut expected = format!("{}: crc32 {:08x}, self-test passed\n", image.name(), image.crc());
        for step in 0..image.self_test_steps() {
            let (_, action) = image.self_test(step).context("a self-test step is missing")?;
            let bits: String = action.iter().map(|w| format!(" {:08x}", u32::from_le(*w))).collect();
            expected += &format!("step {step}:{bits}\n");
        }
        let elf = firmware::harness(target)?;
        let output = qemu::run(qemu::command_on(target, &elf, None, "")?, &[])?;
        assert_eq!(String::from_utf8_lossy(&output.stdout), expected, "{target:?}");
        assert!(output.status.success());
    }
    Ok(())
}

/// The proof reads the weights with the kernels of its own machine.
#[test]
fn target_and_host_allow_the_same_int32_sums() -> Result<()> {
    for group in [32, 128] {
        let mut draft = Draft::of(&rtn(&Policy::load(&ur3())?, Width::W8, group, Activations::Int16)?);
        let image = draft.check()?;
        let matrices: Vec<_> = image.ops().filter_map(|op| op.matrix()).collect();
        // The shape alone does not prove the matrix with the most columns; the records tell which operation has it.
        let widest = (0..matrices.len()).max_by_key(|i| matrices[*i].cols).context("the image has no matrix")?;
        let blocks = matrices[widest].blocks().map(|rows| worst_case(&rows.block, 1));
        let largest = i64::from(i32::MAX) / blocks.max().context("the matrix has no block")?;
        ensure!(largest < i64::from(i16::MAX), "scales of {group}: the limit exceeds int16");
        for (x_max, refused) in [(largest, false), (largest + 1, true)] {
            draft.set_high(draft.data((op::LINEAR, widest)) + 1, u16::try_from(x_max)?.into());
            draft.seal();
            assert_eq!(draft.check().is_err(), refused, "scales of {group}, host");
            let slot = qemu::slot(draft.bytes())?;
            let elf = firmware::harness(Target::Fpu)?;
            let output = qemu::run(qemu::command(&elf, Some(slot.path()), "")?, &[])?;
            // An accepted image reaches its self-test, which may fail, because another x_max computed its actions.
            let text = String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned();
            let expected = if refused { "can overflow its int32" } else { "self-test" };
            assert!(text.contains(expected), "scales of {group}, target: {text}");
        }
    }
    Ok(())
}

#[test]
fn a_damaged_image_in_the_slot_is_refused() -> Result<()> {
    let mut bytes = fs::read(built_in()?)?;
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    let slot = qemu::slot(&bytes)?;
    let elf = firmware::harness(Target::Fpu)?;
    let output = qemu::run(qemu::command(&elf, Some(slot.path()), "")?, &[])?;
    assert!(!output.status.success());
    assert!(String::from_utf8_lossy(&output.stderr).contains("checksum"), "{output:?}");
    Ok(())
}

#[test]
fn an_unknown_argument_is_refused() -> Result<()> {
    for target in [Target::Fpu, Target::Riscv] {
        let elf = firmware::harness(target)?;
        let output = qemu::run(qemu::command_on(target, &elf, None, "fly")?, &[])?;
        assert!(!output.status.success());
        assert!(String::from_utf8_lossy(&output.stderr).contains("unknown argument: fly"), "{target:?}: {output:?}");
    }
    Ok(())
}

/// Returns the first recorded held-out observations of a policy.
pub(crate) fn recorded(dir: &Path, policy: &Policy) -> Result<Vec<Vec<f32>>> {
    let dataset = Recording::Heldout.require(Some(dir), None, Sizes::of(policy), "this test")?;
    let observations: Vec<Vec<f32>> = (0..dataset.length.len()).flat_map(|e| dataset.episode(e)).take(STEPS).collect();
    ensure!(observations.len() == STEPS, "too few recorded observations");
    Ok(observations)
}

/// All widths with int8 and int16 activations; the build without FPU, which is slower, and the other cores run one
/// image of each.
fn policy_has_the_same_bits(dir: &Path) -> Result<()> {
    let policy = Policy::load(dir)?;
    let observations = recorded(dir, &policy)?;
    for activations in [Activations::Int8, Activations::Int16] {
        for width in Width::ALL {
            for group in [0, 32] {
                let at = || format!("{}: {width:?}, group {group}, {activations:?}", policy.name);
                same_bits(Target::Fpu, &rtn(&policy, width, group, activations)?, &observations).with_context(at)?;
            }
        }
    }
    let image = rtn(&policy, Width::W3, 0, Activations::Int8)?;
    for target in [Target::NoFpu, Target::M33, Target::M7, Target::F405, Target::M55] {
        same_bits(target, &image, &observations).with_context(|| format!("{target:?}"))?;
    }
    Ok(())
}

#[test]
fn the_ur3_policy_has_the_same_bits() -> Result<()> {
    policy_has_the_same_bits(&ur3())
}

#[test]
fn shared_policies_have_the_same_bits() -> Result<()> {
    let Some(policies) = shared_policies() else { return Ok(()) };
    for name in ["go1_mlp", "g1_lstm256", "fetch_pickplace"] {
        policy_has_the_same_bits(&policies.join(name))?;
    }
    Ok(())
}

/// For any image and any observation, the runtime contains no panic and no panic message, even with the profile of an
/// application that has not set one for the kernels.
#[test]
fn the_runtime_has_no_panic() -> Result<()> {
    for profile in ["firmware", "firmware-portable"] {
        for binary in ["runtime", "runtime-poll"] {
            let code = Code::read(&firmware::binary_in(profile, binary, Target::Fpu)?)?;
            let names = || code.functions().iter().map(|function| function.name.as_str());
            let telling = ["panicking", "core::fmt", "unwind", "bytemuck::"];
            let found: Vec<&str> = names().filter(|name| telling.iter().any(|part| name.contains(part))).collect();
            assert!(found.is_empty(), "{binary}, {profile}: {found:?}");
            assert!(names().any(|name| name.contains("Head")), "{binary}, {profile}: nothing is in it");
        }
    }
    Ok(())
}
