//! Building the firmware, and what its ELF files say.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{LazyLock, Mutex};

use actq::budget::Budget;
use actq::data::Recordings;
use actq::emit::files;
use actq::methods::{Activations, Method, Options};
use actq::pipeline::quantize;
use actq::policy::Policy;
use actq_boards::{Target, root};
use actq_kernels::Width;
use anyhow::{Context, Result, anyhow, ensure};
use object::{Object as _, ObjectSection as _, ObjectSymbol as _};

use crate::ur3;

/// The folder that cargo builds into.
pub fn target_dir() -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), |dir| root().join(dir))
}

pub(crate) fn cargo_build(what: &str, arguments: &[&str], environment: &[(&str, &str)]) -> Result<()> {
    let output = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        .current_dir(root())
        .args(["build", "--quiet"])
        .args(arguments)
        .envs(environment.iter().copied())
        .output()
        .context("cargo cannot be started")?;
    ensure!(output.status.success(), "{what} does not build:\n{}", String::from_utf8_lossy(&output.stderr));
    Ok(())
}

/// What this process has built: the ELF file by package, binary and folder. Even where nothing is to be built, cargo takes a while
/// to find out, and runs one build at a time.
static BUILT: Mutex<BTreeMap<(&str, String, PathBuf), PathBuf>> = Mutex::new(BTreeMap::new());

const APPLICATION: &str = "actq-firmware-demo";
const BENCH: &str = "actq-firmware-bench";

/// Builds the application with an image built in that is the same in all runs, and gives the path of the ELF file. Other images
/// are run from the slot.
pub fn application(target: Target) -> Result<PathBuf> {
    once(APPLICATION, APPLICATION, target_dir(), target, target.profile(), &[])
}

/// Builds the application with `image` built in.
pub fn application_with(target: Target, image: &Path) -> Result<PathBuf> {
    build(APPLICATION, APPLICATION, &target_dir(), target, target.profile(), &[("ACTQ_IMAGE", &absolute(image)?)])
}

/// Builds a binary of `firmware-bench`.
pub fn bench(binary: &str, target: Target) -> Result<PathBuf> {
    let board = target.board();
    ensure!(board.shows.contains(&binary), "firmware {binary} does not run on {}", board.name);
    once(BENCH, binary, target_dir(), target, target.profile(), &[])
}

/// As [`bench`], without the assembler (`ACTQ_BACKEND=portable`).
pub fn bench_portable(binary: &str, target: Target) -> Result<PathBuf> {
    if !target.has_assembler() {
        return bench(binary, target);
    }
    // In a folder of its own, so that builds of both kinds stay.
    once(BENCH, binary, target_dir().join("portable"), target, "release", &[("ACTQ_BACKEND", "portable")])
}

fn once(
    package: &'static str,
    binary: &str,
    dir: PathBuf,
    target: Target,
    profile: &str,
    environment: &[(&str, &str)],
) -> Result<PathBuf> {
    let key = (package, format!("{binary} {}", target.triple()), dir.clone());
    // A build that panicked has left nothing in the map.
    let mut built = BUILT.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    if let Some(elf) = built.get(&key) {
        return Ok(elf.clone());
    }
    let image = if package == APPLICATION { Some(absolute(built_in()?)?) } else { None };
    let image = image.as_deref().map(|image| ("ACTQ_IMAGE", image));
    let environment: Vec<_> = environment.iter().copied().chain(image).collect();
    let elf = build(package, binary, &dir, target, profile, &environment)?;
    built.insert(key, elf.clone());
    Ok(elf)
}

fn build(
    package: &str,
    binary: &str,
    dir: &Path,
    target: Target,
    profile: &str,
    environment: &[(&str, &str)],
) -> Result<PathBuf> {
    let folder = dir.to_string_lossy();
    cargo_build(
        &format!("firmware {binary} for {}", target.triple()),
        &[
            &["--package", package, "--bin", binary, "--target", target.triple()][..],
            &["--profile", profile, "--target-dir", &folder],
        ]
        .concat(),
        environment,
    )?;
    Ok(dir.join(target.triple()).join(profile).join(binary))
}

fn absolute(image: &Path) -> Result<String> {
    let image = fs::canonicalize(image).with_context(|| format!("{}: cannot be read", image.display()))?;
    Ok(image.to_string_lossy().into_owned())
}

/// The image that [`application`] carries: the UR3 policy at 3 bits, rounded.
pub fn built_in() -> Result<&'static Path> {
    static FILE: LazyLock<Result<PathBuf, String>> = LazyLock::new(|| write_built_in().map_err(|e| format!("{e:#}")));
    FILE.as_deref().map_err(|error| anyhow!("the image to build in: {error}"))
}

fn write_built_in() -> Result<PathBuf> {
    let path = target_dir().join("built-in.actq");
    let policy = Policy::load(&ur3())?;
    let options =
        Options { group: 32, activations: Activations::Int8, ..Options::new(Method::Rtn, Budget::Width(Width::W3)) };
    let bytes = quantize(&policy, &Recordings::default(), &options, |_, _| {})?.image;
    // Cargo builds anew what includes a newer file.
    if fs::read(&path).ok().as_ref() != Some(&bytes) {
        files::write(&path, &bytes)?;
    }
    Ok(path)
}

/// Address (without the Thumb bit) and length of a symbol; `None` where the file has none of this name.
pub(crate) fn symbol(elf: &Path, name: &str) -> Result<Option<(u64, u64)>> {
    let data = fs::read(elf).with_context(|| format!("{}: cannot be read", elf.display()))?;
    let file = object::File::parse(&*data).with_context(|| format!("{}: not an ELF file", elf.display()))?;
    let symbol = file.symbols().find(|s| s.name() == Ok(name));
    Ok(symbol.map(|symbol| (symbol.address() & !1, symbol.size())))
}

/// Bytes of flash that an ELF file takes: code, constants (the built-in image among them) and initial values.
pub fn flash_bytes(elf: &Path) -> Result<u64> {
    let data = fs::read(elf).with_context(|| format!("{}: cannot be read", elf.display()))?;
    let file = object::File::parse(&*data).with_context(|| format!("{}: not an ELF file", elf.display()))?;
    let flash = [".vector_table", ".text", ".rodata", ".data"];
    Ok(file.sections().filter(|s| s.name().is_ok_and(|n| flash.contains(&n))).map(|s| s.size()).sum())
}
