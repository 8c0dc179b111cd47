//! The C interface on a Cortex-M4F: the commands of docs/C.md, in an empty folder, with the package alone.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use crate::docs::listings;
use actq::graph::ops::{Linear, Normalize, Pointwise};
use actq::measure::eval;
use actq::methods::Activations;
use actq::runtime::ImageBuffer;
use actq_bench::capi::Core;
use actq_bench::command::{actq, run, succeeded};
use actq_bench::controller::{Controller, HANG_TIMEOUT};
use actq_bench::networks::Builder;
use actq_bench::qemu::Counter;
use actq_bench::stack::deepest_path;
use actq_bench::{Target, evaluation, firmware, root, skipped, ur3};
use actq_boards::Clock;
use actq_c::ACTQ_STACK_BYTES;
use actq_client::port::Address;
use actq_kernels::Width;
use actq_kernels::math::Function;
use actq_link::code::{Fault, Refusal, State};
use actq_ur3::{ACT_DIM, OBS_DIM};
use anyhow::{Context as _, Result, bail, ensure};
use object::{Object as _, ObjectSymbol as _};
use tempfile::TempDir;

/// Bytes that opening, checking and running an image with any operation may take, at -Os.
const CODE_LIMIT: u64 = 38 << 10;

pub(super) fn is_installed(program: &str) -> bool {
    Command::new(program).arg("--version").output().is_ok_and(|output| output.status.success())
}

/// The images that the library in the package runs.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Runs {
    AnyImage,
    /// Those that need no more than the image in the folder.
    ThisImage,
    /// The same, with short loops.
    ThisImageCompact,
}

/// A folder with the package, the examples and the built-in image as C source; `None`, with a note, without a compiler.
pub(super) fn folder(runs: Runs) -> Result<Option<TempDir>> {
    folder_of(firmware::built_in()?, Some(&ur3().join("heldout.npz")), runs)
}

/// The same with another image; with a golden run only if there is a `recording`.
fn folder_of(file: &Path, recording: Option<&Path>, runs: Runs) -> Result<Option<TempDir>> {
    if !is_installed("arm-none-eabi-gcc") {
        skipped("arm-none-eabi-gcc is not installed");
        return Ok(None);
    }
    let dir = TempDir::new()?;
    let at = |name: &str| dir.path().join(name);
    let buffer = ImageBuffer::read(file)?;
    let image = buffer.image(file)?;
    let only = Some(&image).filter(|_| runs != Runs::AnyImage);
    let core = Core::of("cortex-m4f").context("a core")?;
    core.package(&at("actq-cortex-m4f"), only, runs == Runs::ThisImageCompact)?;
    fs::create_dir(at("c"))?;
    for entry in fs::read_dir(root().join("examples/c"))? {
        let entry = entry?;
        if !entry.file_type()?.is_file() {
            continue;
        }
        fs::copy(entry.path(), at("c").join(entry.file_name()))?;
    }
    let [image, out] = [file, &at("policy")].map(text);
    let golden = recording.map(|recording| ["--golden".to_owned(), text(recording)]);
    let mut arguments = vec!["export-c", &image, "--out", &out];
    arguments.extend(golden.iter().flatten().map(String::as_str));
    succeeded(&run(actq(&arguments), b"")?)?;
    Ok(Some(dir))
}

/// Runs shell commands in a folder, and returns what they print.
pub(super) fn shell(dir: &TempDir, commands: &str) -> Result<String> {
    let output = Command::new("sh").arg("-c").arg(commands).current_dir(dir.path()).output()?;
    let printed = String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned();
    ensure!(output.status.success(), "{printed}");
    Ok(printed)
}

#[test]
fn the_documents_commands_give_the_hosts_bits() -> Result<()> {
    let Some(dir) = folder(Runs::AnyImage)? else { return Ok(()) };
    let at = |name: &str| dir.path().join(name);
    let document = fs::read_to_string(root().join("docs/C.md"))?;
    let listings = listings(&document, "sh");
    ensure!(listings.len() == 4, "four listings in docs/C.md");
    let printed = shell(&dir, &listings.concat())?;
    let lines: Vec<&str> = printed.lines().collect();
    let replayed = "200 steps, half of them in slices; values that differ in bits from the host's: 0";
    ensure!(lines.len() == 4 && lines[..2] == [replayed; 2], "{printed}");
    let [start, end] =
        ["100 actions applied in ", " ticks; late ticks: 0; values that differ in bits from the host's: 0"];
    ensure!(lines[2].starts_with(start) && lines[2].ends_with(end), "{printed}");
    ensure!(
        lines[3].starts_with("100 actions in ") && lines[3].ends_with("none longer than a millisecond"),
        "{printed}"
    );
    ensure!(document.contains(&format!("    {replayed}\n")), "docs/C.md shows another line");

    let image_bytes = fs::metadata(firmware::built_in()?)?.len();
    let code = firmware::flash_bytes(&at("minimal.elf"))? - image_bytes;
    println!("{code} bytes of code beside the image");
    ensure!(code <= CODE_LIMIT, "{code} bytes of code, more than {CODE_LIMIT}");
    // Nothing panics, and nothing formats text.
    let bytes = fs::read(at("main-mps2-an386.elf"))?;
    let elf = object::File::parse(&*bytes)?;
    let names: Vec<&str> = elf.symbols().filter_map(|symbol| symbol.name().ok()).collect();
    ensure!(names.contains(&"actq_step") && !names.iter().any(|name| name.contains("panic")), "{names:?}");

    // Every function of the interface that the program calls stays within the stack that the header states.
    let functions = ["actq_image_open", "actq_head_init", "actq_step", "actq_begin", "actq_poll"];
    keeps_its_stack(&at("main-mps2-an386.elf"), &functions)?;
    keeps_its_stack(&at("cooperative.elf"), &["actq_least_budget"])
}

/// Requires that calls of these functions take no more stack than the header states.
fn keeps_its_stack(program: &Path, functions: &[&str]) -> Result<()> {
    for function in functions {
        let path = deepest_path(program, function)?;
        let bytes: u32 = path.iter().map(|call| call.frame).sum();
        println!("{function}: {bytes} bytes of stack");
        ensure!(bytes as usize <= ACTQ_STACK_BYTES, "{function}: {bytes} bytes of stack: {path:?}");
    }
    Ok(())
}

/// The same for a library that runs only what the built-in image needs.
const CODE_LIMIT_OF_ONE: u64 = 17 << 10;

#[test]
fn a_library_for_one_image_is_smaller() -> Result<()> {
    let Some(dir) = folder(Runs::ThisImage)? else { return Ok(()) };
    let document = fs::read_to_string(root().join("docs/C.md"))?;
    let printed = shell(&dir, &listings(&document, "sh")[..2].concat())?;
    ensure!(printed.lines().count() == 2 && printed.lines().all(|line| line.ends_with("host's: 0")), "{printed}");
    let code = firmware::flash_bytes(&dir.path().join("minimal.elf"))? - fs::metadata(firmware::built_in()?)?.len();
    let manifest = fs::read_to_string(dir.path().join("actq-cortex-m4f/manifest.json"))?;
    let manifest: serde_json::Value = serde_json::from_str(&manifest)?;
    println!("{code} bytes of code with the features {}", manifest["features"]);
    ensure!(code <= CODE_LIMIT_OF_ONE, "{code} bytes of code, more than {CODE_LIMIT_OF_ONE}");
    Ok(())
}

/// A program that plays an image's self-test, which compares bits.
const SELF_TEST: &str = r#"
#include "actq.h"
#include "policy.h"
static actq_image image;
static actq_head head;
static uint32_t scratch[POLICY_SCRATCH_WORDS];
int main(void) {
    actq_status status = OPEN(&image, (const uint8_t *)policy_image, POLICY_IMAGE_BYTES);
    if (status == ACTQ_OK) {
        status = actq_head_init(&head, &image, scratch, POLICY_SCRATCH_WORDS);
    }
    return status == ACTQ_OK ? actq_self_test(&head) : status;
}
"#;

/// Functions that open an image: with a check of its content, and of its checksum only.
const OPEN: [&str; 2] = ["actq_image_open", "actq_image_open_checksummed"];

/// Bytes of code beside the image, at most: of a program with each of these functions.
type Limits = [u64; OPEN.len()];

#[test]
fn a_library_of_2_bits_is_small() -> Result<()> {
    library_takes_at_most([14 << 10, 23 << 9], &[Width::W2], Function::Elu, "w2 paired elu")
}

#[test]
fn a_library_of_4_bits_is_small() -> Result<()> {
    library_takes_at_most([14_340, 23 << 9], &[Width::W4], Function::Elu, "w4 paired elu")
}

#[test]
fn a_library_of_3_4_8_bits_is_small() -> Result<()> {
    let widths = [Width::W3, Width::W4, Width::W8];
    library_takes_at_most([17 << 10, 14 << 10], &widths, Function::Silu, "w3 w4 w8 paired silu")
}

#[test]
fn a_library_of_all_widths_is_small() -> Result<()> {
    library_takes_at_most([18 << 10, 31 << 9], &Width::ALL, Function::Silu, "w2 w3 w4 w8 paired silu")
}

#[test]
fn a_compact_library_of_all_widths_is_smaller() -> Result<()> {
    library_takes_at_most([33 << 9, 14 << 10], &Width::ALL, Function::Silu, "w2 w3 w4 w8 paired silu compact")
}

/// Makes an MLP of these widths and the library for it: it must have these features, keep the limits, and pass the
/// image's self-test.
fn library_takes_at_most(limits: Limits, widths: &[Width], function: Function, features: &str) -> Result<()> {
    let mut network = Builder::new(48);
    let [mean, scale] = [network.values(48), network.values(48)];
    let mut value = network.node(Normalize { mean, scale, pre_clip: 4.0, clip: 2.0 }, &[0])?;
    for (rows, cols, is_last) in [(84, 48, false), (64, 84, false), (12, 64, true)] {
        let widths_of_rows: Vec<_> = (0..rows).map(|row| Some(widths[row * widths.len() / rows])).collect();
        let matrix = network.matrix(rows, cols, Activations::Int8, &widths_of_rows, 0)?;
        let bias = network.values(rows);
        value = network.node(Linear { matrix, bias }, &[value])?;
        if !is_last {
            value = network.node(Pointwise(function), &[value])?;
        }
    }
    let images = TempDir::new()?;
    let file = images.path().join("mlp.actq");
    fs::write(&file, network.image("mlp")?)?;
    let image_bytes = fs::metadata(&file)?.len();

    let runs = if features.ends_with("compact") { Runs::ThisImageCompact } else { Runs::ThisImage };
    let Some(dir) = folder_of(&file, None, runs)? else { return Ok(()) };
    fs::write(dir.path().join("c/self_test.c"), SELF_TEST)?;
    let document = fs::read_to_string(root().join("docs/C.md"))?;
    let settings =
        listings(&document, "sh")[0].lines().filter(|line| line.contains("=\"")).collect::<Vec<_>>().join("\n");
    let build = "set -e
        for open in $OPEN; do
          for file in c/minimal.c c/self_test.c c/startup.c policy/policy.c; do
            arm-none-eabi-gcc $CORE $STRICT -std=c99 $INCLUDE -DOPEN=$open -c $file -o $(basename $file .c).o
          done
          for program in minimal self_test; do
            arm-none-eabi-gcc $CORE $LINK -T mps2-an386.ld $program.o startup.o policy.o $LIBRARY -o $program-$open.elf
            qemu-system-arm -M mps2-an386 -display none -semihosting -kernel $program-$open.elf
          done
        done";
    shell(&dir, &format!("OPEN='{}'\n{settings}\n{build}", OPEN.join(" ")))?;
    let manifest = fs::read_to_string(dir.path().join("actq-cortex-m4f/manifest.json"))?;
    let manifest: serde_json::Value = serde_json::from_str(&manifest)?;
    ensure!(manifest["features"] == features, "{}", manifest["features"]);
    for (open, limit) in OPEN.into_iter().zip(limits) {
        let code = firmware::flash_bytes(&dir.path().join(format!("minimal-{open}.elf")))? - image_bytes;
        println!("{open}: {code} bytes of code with the features {features}");
        keeps_its_stack(&dir.path().join(format!("self_test-{open}.elf")), &[open, "actq_self_test"])?;
        ensure!(code <= limit, "{open}: {code} bytes of code, more than {limit}");
    }
    Ok(())
}

/// A step in a counted region, as the harness has it.
const COUNTED: &str = r#"
#include "actq.h"
#include "policy.h"
static actq_image image;
static actq_head head;
static uint32_t scratch[POLICY_SCRATCH_WORDS];
void actq_count_begin(void);
void actq_count_end(void);
/* Different, because equal functions may become one. */
__attribute__((noinline)) void actq_count_begin(void) { __asm__ volatile("nop"); }
__attribute__((noinline)) void actq_count_end(void) { __asm__ volatile("nop\n nop"); }
int main(void) {
    float action[POLICY_ACTION_LEN];
    actq_status status = actq_image_open(&image, (const uint8_t *)policy_image, POLICY_IMAGE_BYTES);
    status |= actq_head_init(&head, &image, scratch, POLICY_SCRATCH_WORDS);
    for (unsigned step = 0; step < STEPS; step++) {
        actq_count_begin();
        status |= actq_step(&head, &policy_golden_observations[step * POLICY_OBSERVATION_LEN], POLICY_OBSERVATION_LEN,
                            action, POLICY_ACTION_LEN);
        actq_count_end();
    }
    return status;
}
"#;

/// Instructions that a step takes more when it is called from C, at most: the check of pointers.
const CALL_LIMIT: u64 = 200;

#[test]
fn steps_cost_the_same_from_c() -> Result<()> {
    let Some(dir) = folder(Runs::AnyImage)? else { return Ok(()) };
    let buffer = ImageBuffer::read(firmware::built_in()?)?;
    let image = buffer.image(firmware::built_in()?)?;
    let heldout = eval::heldout(&ur3(), &image)?;
    let counter = Counter::build()?;
    let harness = firmware::harness(Target::Fpu)?;
    let rust = evaluation::count(&counter, Target::Fpu, &harness, None, &image, heldout.episode(0))?.instructions;

    fs::write(dir.path().join("c/counted.c"), COUNTED)?;
    let steps = evaluation::WARM_UP * image.execute() + 1;
    let document = fs::read_to_string(root().join("docs/C.md"))?;
    let build = format!(
        "{}\narm-none-eabi-gcc $CORE $STRICT -std=c99 -DSTEPS={steps} $INCLUDE -c c/counted.c -o counted.o\n\
         arm-none-eabi-gcc $CORE $LINK -T mps2-an386.ld counted.o $OBJECTS $LIBRARY -o counted.elf\n",
        listings(&document, "sh").first().context("a listing")?
    );
    shell(&dir, &build)?;
    let elf = dir.path().join("counted.elf");
    let mut command = Target::Fpu.run(&elf);
    counter.attach(&mut command, &elf)?;
    let output = command.output()?;
    ensure!(output.status.success(), "{output:?}");
    let regions = counter.regions()?;
    ensure!(regions.len() == steps, "{} regions", regions.len());
    let c = regions.last().context("a region")?.instructions;
    println!("a step that evaluates the network: {rust} instructions from Rust, {c} from C");
    ensure!(c <= rust + CALL_LIMIT, "{c} instructions from C, {rust} from Rust");
    Ok(())
}

fn text(path: &Path) -> String {
    path.display().to_string()
}

#[test]
fn the_c_client_arms_and_reads_actions() -> Result<()> {
    const ACTIONS: usize = 20;
    if !is_installed("cc") {
        skipped("cc is not installed");
        return Ok(());
    }
    let dir = TempDir::new()?;
    let program = dir.path().join("link-client");
    let sources = ["actq_link.c", "main.c"].map(|name| root().join("examples/c/link").join(name));
    let strict = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Werror"];
    let built = Command::new("cc").args(strict).args(sources).arg("-o").arg(&program).output()?;
    ensure!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));

    let image = ImageBuffer::read(firmware::built_in()?)?;
    let crc = image.image(firmware::built_in()?)?.crc();
    let elf = firmware::controller(Target::Fpu, "")?;
    let begun = Instant::now();
    let (controller, output) = loop {
        let controller = Controller::start_by(Target::Fpu, &elf, None, Clock::Host)?;
        let Address::Unix(socket) = controller.address() else { bail!("the port is no socket") };
        let output = Command::new(&program).arg(&socket).arg(ACTIONS.to_string()).output()?;
        if output.status.success() {
            break (controller, output);
        }
        // On a machine so busy that no observation or action came within the deadline, armed or before, that a tick took
        // too long, or no answer came in 10 s.
        let (latched, stale) = (State::Latched.code(), Refusal::Stale.code());
        let latched = |fault: Fault| format!("the controller is not armed: state {latched}, fault {}\n", fault.code());
        let late = [Fault::Stale, Fault::Late, Fault::Overrun].map(latched).into_iter().chain([
            format!("the controller refuses to arm: refusal {stale}\n"),
            "no answer to the request to arm\n".to_owned(),
        ]);
        ensure!(late.into_iter().any(|line| output.stderr == line.as_bytes()), "{output:?}");
        ensure!(begun.elapsed() < HANG_TIMEOUT, "the client was never in time: {output:?}");
    };
    let printed = String::from_utf8(output.stdout)?;
    let start = format!("image {crc:08x}, {OBS_DIM} values, {ACT_DIM} axes: ");
    // It may have connected in the middle of a frame.
    let ends = ["0", "1"].map(|here| format!("damaged frames: {here} here, 0 at the controller\n"));
    ensure!(printed.starts_with(&start) && ends.iter().any(|end| printed.ends_with(end)), "{printed}");
    let applied = printed[start.len()..].split(' ').next().context("a number")?;
    ensure!(applied.parse::<usize>()? >= ACTIONS, "{printed}");
    let status = controller.client()?.status()?;
    // It may have counted a frame as damaged since: one that was cut when the client closed its socket.
    ensure!(status.state == State::Disarmed, "{status:?}");
    let usage = Command::new(&program).output()?;
    ensure!(usage.status.code() == Some(2), "{usage:?}");
    Ok(())
}
