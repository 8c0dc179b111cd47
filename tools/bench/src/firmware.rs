//! Builds the firmware, and reads its ELF files.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{LazyLock, Mutex};

use actq::methods::Activations;
use actq::policy::Policy;
use actq::runtime::ImageBuffer;
use actq_boards::{Target, root, target_dir};
use actq_cli::outputs::files;
use actq_kernels::Width;
use anyhow::{Context, Result, anyhow, ensure};
use object::{Object as _, ObjectSection as _, ObjectSymbol as _, SymbolKind};

use crate::{rtn, ur3};

pub(crate) fn cargo_build(what: &str, arguments: &[&str], environment: &[(&str, &str)]) -> Result<()> {
    cargo(what, &[&["build", "--quiet"], arguments].concat(), environment).map(drop)
}

/// Runs cargo, to make something, and returns its output.
pub fn cargo(what: &str, arguments: &[&str], environment: &[(&str, &str)]) -> Result<String> {
    let output = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        .current_dir(root())
        .args(arguments)
        .envs(environment.iter().copied())
        .output()
        .context("cannot start cargo")?;
    ensure!(output.status.success(), "cannot build {what}:\n{}", String::from_utf8_lossy(&output.stderr));
    Ok(String::from_utf8(output.stdout)?)
}

const APPLICATION: &str = "actq-firmware-demo";
/// Its binary.
const CONTROLLER: &str = "controller";
const BENCH: &str = "actq-firmware-bench";
/// Its binary that runs an image.
const HARNESS: &str = "harness";
/// Its feature for images with attention, and that of the kernels.
const ATTENTION: &str = "attention";
const STYLES: &str = "actq-firmware-styles";
/// Its binaries: a head in a user's own firmware, each in another style.
pub const STYLE_NAMES: [&str; 3] = ["bare", "rtic", "embassy"];

/// Packages with their binaries, features and targets.
type Key = (&'static str, &'static str, &'static str, Target);

/// The folders of the ELF files that this process has built. Even with nothing to build, cargo takes a while to find out.
static BUILT: Mutex<BTreeMap<Key, PathBuf>> = Mutex::new(BTreeMap::new());

/// Builds a binary, or binaries that belong together, once.
fn build_once(key: Key, build: impl FnOnce() -> Result<PathBuf>) -> Result<PathBuf> {
    // A build that panicked has left nothing in the map.
    let mut built = BUILT.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    if let Some(folder) = built.get(&key) {
        return Ok(folder.clone());
    }
    let folder = build()?;
    built.insert(key, folder.clone());
    Ok(folder)
}

/// Builds the harness, which serves an image through semihosting, with the same built-in image in all runs
/// ([`built_in_of`]), and returns the path of the ELF file. Other images run from the slot.
pub fn harness(target: Target) -> Result<PathBuf> {
    let build = || harness_in_folder(target, "", built_in_of(target)?);
    Ok(build_once((BENCH, HARNESS, "", target), build)?.join(HARNESS))
}

/// Does the same as [`harness`] with a feature that the other harness does not have: so it takes no instruction there.
pub fn harness_of(target: Target, feature: &'static str) -> Result<PathBuf> {
    let build = || harness_in_folder(target, feature, built_in()?);
    Ok(build_once((BENCH, HARNESS, feature, target), build)?.join(HARNESS))
}

/// Builds the harness with `image` built in, and with attention if the image needs it.
pub fn harness_with(target: Target, image: &Path) -> Result<PathBuf> {
    Ok(harness_in_folder(target, attention_of(image)?, image)?.join(HARNESS))
}

/// Returns the feature of attention if the image needs it; else nothing.
fn attention_of(image: &Path) -> Result<&'static str> {
    let buffer = ImageBuffer::read(image)?;
    Ok(buffer.image(image)?.features().find(|feature| *feature == ATTENTION).unwrap_or_default())
}

fn harness_in_folder(target: Target, feature: &str, image: &Path) -> Result<PathBuf> {
    let image = fs::canonicalize(image).with_context(|| format!("cannot read {}", image.display()))?;
    let image = ("ACTQ_IMAGE", &*image.to_string_lossy());
    let features: Vec<_> =
        target.feature().into_iter().chain(Some(feature).filter(|feature| !feature.is_empty())).collect();
    build(BENCH, &[HARNESS], &features.join(","), target, target.profile(), &[image])
}

/// Builds the application for a target's board, with the image of [`harness`] and with more features, separated by
/// commas, and returns the path of the ELF file.
pub fn controller(target: Target, features: &'static str) -> Result<PathBuf> {
    controller_of_key(target, features, "")
}

/// Does the same as [`controller`] with the feature `signed` and a key's 64 hexadecimal digits, the same in every call.
pub fn controller_of_key(target: Target, features: &'static str, key: &str) -> Result<PathBuf> {
    let build = || controller_in_folder(target, features, key, built_in()?);
    Ok(build_once((APPLICATION, CONTROLLER, features, target), build)?.join(CONTROLLER))
}

/// Builds the application with `image` built in, and with attention if the image needs it.
pub fn controller_with(target: Target, image: &Path) -> Result<PathBuf> {
    Ok(controller_in_folder(target, attention_of(image)?, "", image)?.join(CONTROLLER))
}

fn controller_in_folder(target: Target, features: &str, key: &str, image: &Path) -> Result<PathBuf> {
    let image = fs::canonicalize(image).with_context(|| format!("cannot read {}", image.display()))?;
    let environment = [("ACTQ_IMAGE", &*image.to_string_lossy()), ("ACTQ_PUBLIC_KEY", key), ("DEFMT_LOG", "info")];
    let more = if features.is_empty() { String::new() } else { format!(",{features}") };
    let all = target.board().name.to_owned() + &more;
    build(APPLICATION, &[CONTROLLER], &all, target, target.profile(), &environment)
}

/// Builds the programs of `firmware/styles` for their board, with the image of [`harness`], and returns the path of
/// one's ELF file.
pub fn style(name: &str) -> Result<PathBuf> {
    let target = Target::Fpu;
    let build = || {
        let image = built_in()?.to_string_lossy();
        build(STYLES, &STYLE_NAMES, "", target, target.profile(), &[("ACTQ_IMAGE", &image)])
    };
    Ok(build_once((STYLES, "", "", target), build)?.join(name))
}

/// Builds a binary of `firmware/bench` that runs on a target's board, and returns the path of its ELF file.
pub fn binary(name: &'static str, target: Target) -> Result<PathBuf> {
    let board = target.board();
    ensure!(board.binaries.contains(&name), "firmware {name} does not run on {}", board.name);
    let build = || build(BENCH, &[name], target.feature().unwrap_or_default(), target, target.profile(), &[]);
    Ok(build_once((BENCH, name, "", target), build)?.join(name))
}

/// Does the same as [`binary`] with a profile of `Cargo.toml` that is not the target's own.
pub fn binary_in(profile: &str, name: &str, target: Target) -> Result<PathBuf> {
    let features = target.feature().unwrap_or_default();
    Ok(build(BENCH, &[name], features, target, profile, &[])?.join(name))
}

/// Does the same as [`binary`] for a Cortex-M4 with the kernels' feature `compact` and the image of [`harness`].
pub fn compact_binary(name: &str) -> Result<PathBuf> {
    let target = Target::Fpu;
    let build = || {
        let image = built_in()?.to_string_lossy();
        let binaries = ["bench", "golden", HARNESS];
        build(BENCH, &binaries, "compact", target, target.profile(), &[("ACTQ_IMAGE", &image)])
    };
    Ok(build_once((BENCH, "", "compact", target), build)?.join(name))
}

/// Does the same as [`binary`] for a Cortex-M4 with the kernels' feature `scalar`.
pub fn scalar_binary(name: &'static str) -> Result<PathBuf> {
    let target = Target::Fpu;
    let build = || build(BENCH, &[name], "scalar", target, target.profile(), &[]);
    Ok(build_once((BENCH, name, "scalar", target), build)?.join(name))
}

/// Does the same as [`binary`] without the assembler (`ACTQ_BACKEND=portable`).
pub fn portable_binary(name: &'static str, target: Target) -> Result<PathBuf> {
    if !target.has_assembler() {
        return binary(name, target);
    }
    // A profile that this target's other builds do not use, so that builds of both kinds stay.
    let features = target.feature().unwrap_or_default();
    Ok(build(BENCH, &[name], features, target, "firmware-portable", &[("ACTQ_BACKEND", "portable")])?.join(name))
}

/// Waits until no thread or process has this lock, and takes it until the file is dropped: other builds have other files of
/// the same names.
pub(crate) fn lock(name: &str) -> Result<fs::File> {
    fs::create_dir_all(target_dir())?;
    let path = target_dir().join(name);
    let file = fs::File::create(&path).with_context(|| format!("cannot write {}", path.display()))?;
    file.lock().with_context(|| format!("cannot lock {}", path.display()))?;
    Ok(file)
}

/// Builds binaries of a package and returns the folder of their ELF files: a folder of the board and its features,
/// because cargo uses the same names for all boards of a triple.
fn build(
    package: &str,
    binaries: &[&str],
    features: &str,
    target: Target,
    profile: &str,
    environment: &[(&str, &str)],
) -> Result<PathBuf> {
    // Until the files are where no other build replaces them.
    let _building = lock("actq-firmware.lock")?;
    let mut arguments = vec!["--package", package, "--target", target.triple(), "--profile", profile];
    arguments.extend(["--features", features]);
    arguments.extend(binaries.iter().flat_map(|binary| ["--bin", binary]));
    let environment: Vec<_> = environment.iter().copied().chain(target.rustflags()).collect();
    cargo_build(&format!("{package} for {}", target.board().name), &arguments, &environment)?;
    let built = target_dir().join(target.triple()).join(profile);
    let own = built.join(if features.is_empty() { target.board().name } else { features });
    fs::create_dir_all(&own).with_context(|| format!("cannot create {}", own.display()))?;
    for binary in binaries {
        let elf = fs::read(built.join(binary)).with_context(|| format!("cannot read {binary}"))?;
        files::write(&own.join(binary), &elf)?;
    }
    Ok(own)
}

/// Returns the built-in image: the UR3 policy at 3 bits, rounded. `cargo xtask firmware` makes the same file.
pub fn built_in() -> Result<&'static Path> {
    built_in_of(Target::Fpu)
}

/// Returns the image of [`harness`] on a target: at 2 bits where the flash has no room for 3.
pub fn built_in_of(target: Target) -> Result<&'static Path> {
    type File = LazyLock<Result<PathBuf, String>>;
    fn write(name: &str, width: Width) -> Result<PathBuf, String> {
        write_built_in(name, width).map_err(|error| format!("{error:#}"))
    }
    static EXAMPLE: File = LazyLock::new(|| write("firmware-example.actq", Width::W3));
    static SMALL: File = LazyLock::new(|| write("firmware-small.actq", Width::W2));
    let file = if target == Target::Small { &SMALL } else { &EXAMPLE };
    file.as_deref().map_err(|error| anyhow!("cannot make the built-in image: {error}"))
}

fn write_built_in(name: &str, width: Width) -> Result<PathBuf> {
    let path = target_dir().join(name);
    let bytes = rtn(&Policy::load(&ur3())?, width, 32, Activations::Int8)?;
    // Cargo rebuilds a crate that includes a newer file.
    if fs::read(&path).ok().as_ref() != Some(&bytes) {
        files::write(&path, &bytes)?;
    }
    Ok(path)
}

/// Returns the bytes of the kernels' functions in a program, those in assembler too.
///
/// # Errors
///
/// If the file cannot be read, or is not an ELF file.
pub fn kernel_bytes(elf: &Path) -> Result<u64> {
    let data = fs::read(elf).with_context(|| format!("cannot read {}", elf.display()))?;
    let file = object::File::parse(&*data).with_context(|| format!("{}: not an ELF file", elf.display()))?;
    let is_of_kernels =
        |name: &str| name.contains("actq_kernels") || name.starts_with("actq_") && !name.starts_with("actq_count");
    let sizes: BTreeMap<u64, u64> = file
        .symbols()
        .filter(|symbol| symbol.kind() == SymbolKind::Text && symbol.name().is_ok_and(is_of_kernels))
        .map(|symbol| (symbol.address(), symbol.size()))
        .collect();
    Ok(sizes.values().sum())
}

/// Returns the address (without the Thumb bit) and length of a symbol; `None` if the file lacks it.
pub(crate) fn symbol(elf: &Path, name: &str) -> Result<Option<(u64, u64)>> {
    let data = fs::read(elf).with_context(|| format!("cannot read {}", elf.display()))?;
    let file = object::File::parse(&*data).with_context(|| format!("{}: not an ELF file", elf.display()))?;
    let symbol = file.symbols().find(|s| s.name() == Ok(name));
    Ok(symbol.map(|symbol| (symbol.address() & !1, symbol.size())))
}

/// Returns the bytes of flash of an ELF file: code, constants (the built-in image among them) and initial values.
pub fn flash_bytes(elf: &Path) -> Result<u64> {
    section_bytes(elf, &[".vector_table", ".text", ".rodata", ".data"])
}

/// Returns the bytes of RAM of an ELF file's variables.
pub fn ram_bytes(elf: &Path) -> Result<u64> {
    section_bytes(elf, &[".data", ".bss", ".uninit"])
}

fn section_bytes(elf: &Path, names: &[&str]) -> Result<u64> {
    let data = fs::read(elf).with_context(|| format!("cannot read {}", elf.display()))?;
    let file = object::File::parse(&*data).with_context(|| format!("{}: not an ELF file", elf.display()))?;
    Ok(file.sections().filter(|s| s.name().is_ok_and(|n| names.contains(&n))).map(|s| s.size()).sum())
}

/// Returns the halfword at an address of the code of an ELF file.
pub fn halfword_at(elf: &Path, address: u32) -> Result<u16> {
    let data = fs::read(elf).with_context(|| format!("cannot read {}", elf.display()))?;
    let file = object::File::parse(&*data).with_context(|| format!("{}: not an ELF file", elf.display()))?;
    let text = file.section_by_name(".text").context("the ELF file has no section .text")?;
    let bytes = text
        .data_range(address.into(), 2)?
        .with_context(|| format!("the section .text lacks the address {address:#x}"))?;
    Ok(u16::from_le_bytes(bytes.try_into()?))
}
