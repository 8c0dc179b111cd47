//! The C interface on a Cortex-M4F: the commands of docs/C.md, in an empty folder, with the package alone.

use std::fs;
use std::path::Path;
use std::process::Command;

use actq_bench::capi::Core;
use actq_bench::command::{actq, run, succeeded};
use actq_bench::firmware;
use actq_bench::{root, skipped, ur3};
use anyhow::{Context as _, Result, ensure};
use object::{Object as _, ObjectSection as _, ObjectSymbol as _};
use tempfile::TempDir;

/// Bytes that opening, checking and running an image with any operation may take, at -Os.
const CODE_LIMIT: u64 = 40 << 10;

fn is_installed(program: &str) -> bool {
    Command::new(program).arg("--version").output().is_ok_and(|output| output.status.success())
}

/// The shell commands of a document: its listings marked `sh`.
fn listings(document: &str) -> Vec<&str> {
    document.split("```sh\n").skip(1).filter_map(|rest| rest.split("```").next()).collect()
}

#[test]
fn the_commands_of_the_document_give_the_hosts_bits() -> Result<()> {
    if !is_installed("arm-none-eabi-gcc") {
        skipped("arm-none-eabi-gcc is not installed");
        return Ok(());
    }
    let dir = TempDir::new()?;
    let at = |name: &str| dir.path().join(name);
    Core::of("cortex-m4f").context("a core")?.package(&at("actq-cortex-m4f"))?;
    fs::create_dir(at("c"))?;
    for entry in fs::read_dir(root().join("examples/c"))? {
        let entry = entry?;
        fs::copy(entry.path(), at("c").join(entry.file_name()))?;
    }
    let image = firmware::built_in()?;
    let [image_text, recording, out] = [image, &ur3().join("heldout.npz"), &at("policy")].map(|path| text(path));
    succeeded(&run(actq(&["export-c", &image_text, "--golden", &recording, "--out", &out]), b"")?)?;

    let document = fs::read_to_string(root().join("docs/C.md"))?;
    let listings = listings(&document);
    ensure!(listings.len() == 3, "three listings in docs/C.md");
    let output = Command::new("sh").arg("-c").arg(listings.concat()).current_dir(dir.path()).output()?;
    let printed = String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned();
    ensure!(output.status.success(), "{printed}");
    let lines: Vec<&str> = printed.lines().collect();
    let replayed = "200 steps, half of them in slices; values that differ in bits from the host's: 0";
    ensure!(lines.len() == 3 && lines[..2] == [replayed; 2], "{printed}");
    let [start, end] =
        ["100 actions applied in ", " ticks; late ticks: 0; values that differ in bits from the host's: 0"];
    ensure!(lines[2].starts_with(start) && lines[2].ends_with(end), "{printed}");
    ensure!(document.contains(&format!("    {replayed}\n")), "docs/C.md shows another line");

    let image_bytes = fs::metadata(image)?.len();
    let code = code_bytes(&at("minimal.elf"))? - image_bytes;
    println!("{code} bytes of code beside the image");
    ensure!(code <= CODE_LIMIT, "{code} bytes of code, more than {CODE_LIMIT}");
    // Nothing panics, and nothing formats text.
    let bytes = fs::read(at("main-mps2-an386.elf"))?;
    let elf = object::File::parse(&*bytes)?;
    let names: Vec<&str> = elf.symbols().filter_map(|symbol| symbol.name().ok()).collect();
    ensure!(names.contains(&"actq_step") && !names.iter().any(|name| name.contains("panic")), "{names:?}");
    Ok(())
}

/// Returns the bytes of flash of a program.
fn code_bytes(elf: &Path) -> Result<u64> {
    let bytes = fs::read(elf)?;
    let elf = object::File::parse(&*bytes)?;
    Ok([".text", ".data"].iter().filter_map(|name| elf.section_by_name(name)).map(|section| section.size()).sum())
}

fn text(path: &Path) -> String {
    path.display().to_string()
}
