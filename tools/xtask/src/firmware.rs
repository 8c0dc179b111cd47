//! `cargo xtask firmware`: the motor controller for a board, as one ELF file.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use actq_boards::{Application, Target, root, target_dir};
use actq_controller::Limits;
use actq_firmware_demo::deadline::tick_hz;
use actq_kernels::Image;
use anyhow::{Context as _, Result, bail, ensure};
use clap::Args;

use crate::setup::{self, cargo};
use crate::{PROFILE, limits};

/// Features of the kernels that the application has only for an image that needs them.
const OPTIONAL: [&str; 2] = ["around", "attention"];

/// The request.
#[derive(Args, Debug, Default)]
pub(crate) struct Options {
    /// Show the boards; fails for a --board that is not among them
    #[arg(long, conflicts_with_all = ["image", "limits", "features", "key", "reproduce", "out"])]
    pub(crate) list: bool,
    /// The board; --list shows them
    #[arg(long, value_name = "NAME", value_parser = board, required_unless_present = "list")]
    pub(crate) board: Option<Target>,
    /// The image to build in; by default that of the UR3 policy at 3 bits
    #[arg(long, value_name = "FILE.actq")]
    pub(crate) image: Option<PathBuf>,
    /// The range of every axis, LOW:HIGH or LOW:HIGH:RATE (change in a second), or a file with a line for each axis
    ///
    /// The stricter of these and the image's own limits hold; without either no axis may move.
    #[arg(long, allow_hyphen_values = true)]
    pub(crate) limits: Option<String>,
    /// Features of firmware-demo: tick-8khz, foc, defmt-rtt, defmt-semihosting, faults (for tests)
    #[arg(long, value_name = "LIST")]
    pub(crate) features: Option<String>,
    /// The public key, as `actq keygen` prints it, that signs images; others are refused (feature signed)
    #[arg(long, value_name = "HEX", value_parser = key)]
    pub(crate) key: Option<String>,
    /// Build the last commit in two new folders, with two of cargo's; fails if the flashed bytes differ
    #[arg(long)]
    pub(crate) reproduce: bool,
    /// The ELF file, written whole or not at all
    #[arg(long, value_name = "FILE.elf", required_unless_present = "list")]
    pub(crate) out: Option<PathBuf>,
}

fn board(name: &str) -> Result<Target, String> {
    let known = || boards().map(|(target, _)| target.board().name).collect::<Vec<_>>().join(", ");
    let target = boards().map(|(target, _)| target).find(|target| target.board().name == name);
    target.ok_or_else(|| format!("unknown board; use one of {}", known()))
}

fn key(text: &str) -> Result<String, &'static str> {
    let is_key = text.len() == 64 && text.bytes().all(|digit| digit.is_ascii_hexdigit());
    is_key.then(|| text.to_owned()).ok_or("a key has the 64 hexadecimal digits that `actq keygen` prints")
}

impl Options {
    pub(crate) fn run(self) -> Result<()> {
        let Self { board: Some(target), image, limits, features, key, reproduce, out: Some(out), .. } = self else {
            for (target, application) in boards() {
                println!("{:12} {:27} {}", target.board().name, target.triple(), application.about);
            }
            return Ok(());
        };
        let application = target.board().application.context("the board has no application")?;
        check_out(&out, image.as_deref())?;
        let limits = limits.as_deref().map_or(Ok(Vec::new()), limits::read)?;
        let is_fast = features.as_deref().is_some_and(|list| list.split(',').any(|one| one.trim() == "tick-8khz"));
        let check = |image: &Path| check(image, &limits, tick_hz(is_fast), application, target);
        let given = image.as_deref().map(check).transpose()?;
        setup::rust_target(target.triple())?;
        let (image, needed) = given.map_or_else(|| check(&example()?), Ok)?;
        let features = [features.as_deref(), needed.as_deref()];
        let build = |checkout: &Checkout| build(checkout, target, &image, &limits, &features, key.as_deref());
        let elf = if reproduce { reproduced(build)? } else { build(&Checkout::here()?)? };
        write(&out, &elf)?;
        println!("{}: {} with {}", out.display(), target.board().name, image.display());
        Ok(())
    }
}

/// Returns the boards with a device for the application, each by its first target.
pub(crate) fn boards() -> impl Iterator<Item = (Target, Application)> {
    let first = |target: &Target| Target::on(target.board().name) == Some(*target);
    Target::ALL.into_iter().filter(first).filter_map(|target| Some((target, target.board().application?)))
}

/// Refuses an impossible or harmful place for the ELF file before a build of minutes.
fn check_out(out: &Path, image: Option<&Path>) -> Result<()> {
    let folder = match out.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    ensure!(folder.is_dir(), "{}: the folder {} does not exist", out.display(), folder.display());
    ensure!(!out.is_dir(), "{}: is a folder; pass the name of a file to --out", out.display());
    let whole = |path: &Path| fs::canonicalize(path).ok();
    let is_image = image.is_some_and(|image| whole(image).is_some() && whole(image) == whole(out));
    ensure!(!is_image, "{}: is the image itself; pass another name to --out", out.display());
    Ok(())
}

/// Returns the whole path of an image that the board's application runs with these limits and ticks, and the features that
/// the application needs for it; an error tells why the application does not run it.
fn check(
    path: &Path,
    limits: &[Limits],
    hz: u32,
    application: Application,
    target: Target,
) -> Result<(PathBuf, Option<String>)> {
    let bytes = fs::read(path).with_context(|| format!("cannot read the image {}", path.display()))?;
    // Words, because an image must be aligned to 4 bytes.
    let mut words = vec![0u32; bytes.len().div_ceil(4)];
    let aligned = &mut bytemuck::cast_slice_mut::<u32, u8>(&mut words)[..bytes.len()];
    aligned.copy_from_slice(&bytes);
    let image = Image::new_checked(aligned)
        .with_context(|| format!("{}: not a valid image; make one with `actq quantize`", path.display()))?;
    // A prefix arrives beside the one in use.
    let (needed, given) = (image.scratch_words() + image.prefix_bytes() / 4, application.scratch);
    let name = target.board().name;
    ensure!(
        needed <= given,
        "{}: needs {needed} words of scratch memory, but the application on {name} has {given} (SCRATCH of the board)",
        path.display()
    );
    let still = limits::without_limits(limits, &image, hz).with_context(|| path.display().to_string())?;
    if !still.is_empty() {
        eprintln!(
            "warning: {}: no finite limits for {}: the controller will refuse to arm; --limits LOW:HIGH sets them",
            path.display(),
            still.join(", ")
        );
    }
    let needed: Vec<_> = image.features().filter(|feature| OPTIONAL.contains(feature)).collect();
    let needed = (!needed.is_empty()).then(|| needed.join(","));
    Ok((fs::canonicalize(path).with_context(|| path.display().to_string())?, needed))
}

/// Makes the image of the UR3 policy: rounded, which takes a second.
fn example() -> Result<PathBuf> {
    let path = target_dir().join("firmware-example.actq");
    let new = path.with_extension(format!("{}.tmp", std::process::id()));
    println!("Quantizing the UR3 policy to 3 bits, rounded; --image uses another image");
    let mut build = cargo();
    // Building it with actq-bench selects the features of tests and measurements; otherwise cargo would build the
    // quantizer twice.
    build.current_dir(root()).args(["build", "--quiet", "--profile", PROFILE, "--bin", "actq"]);
    let built =
        build.args(["--package", "actq-cli", "--package", "actq-bench"]).status().context("cannot start cargo")?;
    ensure!(built.success(), "cannot build actq");
    let mut command =
        Command::new(target_dir().join(PROFILE).join("actq").with_extension(std::env::consts::EXE_EXTENSION));
    command.current_dir(root()).args(["quantize", "examples/ur3/policy", "--method", "rtn", "--bits", "3"]);
    let output = command.args(["--group", "32", "--activations", "8", "--out"]).arg(&new).output()?;
    ensure!(output.status.success(), "cannot quantize the UR3 policy: {}", String::from_utf8_lossy(&output.stderr));
    // Cargo rebuilds a crate that includes a newer file.
    let is_same = fs::read(&path).ok() == Some(fs::read(&new)?);
    if is_same { fs::remove_file(&new) } else { fs::rename(&new, &path) }
        .with_context(|| format!("cannot write {}", path.display()))?;
    Ok(path)
}

/// The folders of a build. None of their names is in the flashed bytes.
struct Checkout {
    root: PathBuf,
    target: PathBuf,
    /// Cargo's own folder, with the sources of dependencies.
    home: PathBuf,
}

impl Checkout {
    fn here() -> Result<Self> {
        let home = std::env::var_os("CARGO_HOME").map(PathBuf::from);
        let home =
            home.or_else(|| Some(std::env::home_dir()?.join(".cargo"))).context("cargo's folder is not known")?;
        // rustc sees the real name of a folder.
        let home = fs::canonicalize(&home).with_context(|| home.display().to_string())?;
        Ok(Self { root: root().to_owned(), target: target_dir(), home })
    }

    /// Returns flags of rustc that replace the folders in paths of debug information and panics.
    fn remapped(&self) -> Vec<String> {
        // Of two that match, rustc takes the last.
        let map = [(&self.home, "/cargo"), (&self.root, "."), (&self.target, "./target")];
        map.iter().map(|(from, to)| format!("--remap-path-prefix={}={to}", from.display())).collect()
    }
}

/// Builds the last commit twice, and returns the bytes of an ELF file if the flashed bytes of both are equal.
fn reproduced(build: impl Fn(&Checkout) -> Result<Vec<u8>>) -> Result<Vec<u8>> {
    let here = Checkout::here()?;
    let git = |arguments: &[&str]| -> Result<String> {
        let output =
            Command::new("git").current_dir(&here.root).args(arguments).output().context("cannot start git")?;
        ensure!(output.status.success(), "git {}: {}", arguments.join(" "), String::from_utf8_lossy(&output.stderr));
        Ok(String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    let commit = git(&["rev-parse", "HEAD"])?;
    let changed = git(&["status", "--porcelain", "--untracked-files=no"])?;
    ensure!(changed.is_empty(), "only a commit can be reproduced; commit these changes first:\n{changed}");
    let folder = std::env::temp_dir().join(format!("actq-reproduce-{}", std::process::id()));
    let checkouts = ["a", "another/with a longer name"].map(|name| {
        let root = folder.join(name);
        Checkout { root: root.join("actq"), target: root.join("target"), home: root.join("cargo") }
    });
    for Checkout { root, home, .. } in &checkouts {
        fs::create_dir_all(home).with_context(|| home.display().to_string())?;
        link(&here.home.join("registry"), &home.join("registry"))?;
        git(&["clone", "--quiet", &here.root.to_string_lossy(), &root.to_string_lossy()])?;
    }
    let [elf, other] = [build(&checkouts[0])?, build(&checkouts[1])?];
    let [bytes, others] = [&elf, &other].map(|elf| flashed(elf).context("not a whole ELF file"));
    let bytes = bytes?;
    ensure!(bytes == others?, "the flashed bytes differ; both builds are in {}", folder.display());
    fs::remove_dir_all(&folder).with_context(|| folder.display().to_string())?;
    let whole = if elf == other { "the ELF files too" } else { "the ELF files differ in symbols or debug information" };
    let count: usize = bytes.iter().map(|part| part.len()).sum();
    println!("commit {commit}: two builds have the same {count} flashed bytes; {whole}");
    Ok(elf)
}

/// Returns the segments of an ELF file of 32 bits that are loaded into memory; `None` if it is truncated. By hand: xtask has
/// few dependencies, to start soon.
fn flashed(elf: &[u8]) -> Option<Vec<&[u8]>> {
    let word = |at: usize| Some(u32::from_le_bytes(elf.get(at..)?.first_chunk().copied()?) as usize);
    let (first, sizes) = (word(28)?, word(42)?);
    let (size, count) = (sizes & 0xffff, sizes >> 16);
    let segments = (0..count).map(|i| {
        let at = first + i * size;
        let (kind, offset, length) = (word(at)?, word(at + 4)?, word(at + 16)?);
        Some((kind == 1).then_some(elf.get(offset..offset + length)?))
    });
    Some(segments.collect::<Option<Vec<_>>>()?.into_iter().flatten().collect())
}

/// Gives a folder a second name.
fn link(folder: &Path, name: &Path) -> Result<()> {
    #[cfg(unix)]
    let linked = std::os::unix::fs::symlink(folder, name);
    #[cfg(windows)]
    let linked = std::os::windows::fs::symlink_dir(folder, name);
    linked.with_context(|| format!("cannot link {} to {}", name.display(), folder.display()))
}

/// Builds the application, and returns the bytes of the ELF file.
fn build(
    checkout: &Checkout,
    target: Target,
    image: &Path,
    limits: &[Limits],
    features: &[Option<&str>],
    key: Option<&str>,
) -> Result<Vec<u8>> {
    let name = target.board().name;
    // A folder of its own: cargo uses the same names for all boards of a triple, and two builds may run at a time. A
    // cargo that knows the variable (1.91) shares the intermediate files.
    let folder = checkout.target.join("boards").join(name);
    let features = [Some(name), key.map(|_| "signed")].iter().chain(features).flatten().copied().collect::<Vec<_>>();
    let features = features.join(",");
    let mut command = cargo();
    if let Some(key) = key {
        command.env("ACTQ_PUBLIC_KEY", key);
    }
    command.current_dir(&checkout.root).args(["build", "--package", "actq-firmware-demo", "--bin", "controller"]);
    command.args(["--profile", target.profile(), "--target", target.triple(), "--features", &features]);
    // Only a build with signatures has panics, with paths in their messages. Others share their files with the tests'.
    let mut flags = if key.is_some() { checkout.remapped() } else { Vec::new() };
    match target.rustflags() {
        // The variable replaces the flags of all configurations.
        Some((variable, given)) => {
            flags.extend(given.split(' ').map(str::to_owned));
            command.env(format!("CARGO_ENCODED_{variable}"), flags.join("\x1f"));
        }
        None if flags.is_empty() => {}
        None => _ = command.args(["--config", &format!("target.{}.rustflags={flags:?}", target.triple())]),
    }
    // defmt's own default logs only errors.
    if std::env::var_os("DEFMT_LOG").is_none() {
        command.env("DEFMT_LOG", "info");
    }
    command.arg("--target-dir").arg(&folder).env("CARGO_HOME", &checkout.home).env("ACTQ_IMAGE", image);
    match limits {
        [] => command.env_remove("ACTQ_LIMITS"),
        _ => command.env("ACTQ_LIMITS", limits.iter().map(Limits::to_string).collect::<Vec<_>>().join(",")),
    };
    let status = command.env("CARGO_BUILD_BUILD_DIR", &checkout.target).status();
    if !status.context("cannot start cargo")?.success() {
        let memory = target.board().memory;
        bail!(
            "cannot build the application for {name}; if the linker reports that FLASH overflows, it has no room for \
             {} ({} bytes): `actq quantize --flash` makes a smaller image, and {memory} has the room",
            image.display(),
            fs::metadata(image).map_or(0, |file| file.len())
        );
    }
    let elf = folder.join(target.triple()).join(target.profile()).join("controller");
    fs::read(&elf).with_context(|| elf.display().to_string())
}

/// Writes a file whole or not at all.
fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut name = path.file_name().with_context(|| format!("{}: not a file name", path.display()))?.to_owned();
    name.push(format!(".{}.tmp", std::process::id()));
    let temporary = path.with_file_name(name);
    let written = fs::write(&temporary, bytes).and_then(|()| fs::rename(&temporary, path));
    if written.is_err() {
        // A partial file is of no use.
        let _ = fs::remove_file(&temporary);
    }
    written.with_context(|| format!("cannot write {}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invalid_images_are_refused_by_name() {
        let application = Target::F405.board().application.expect("an application");
        let refused =
            |path: &Path| format!("{:#}", check(path, &[], 1000, application, Target::F405).expect_err("refused"));
        let file = std::env::temp_dir().join(format!("actq-no-image-{}", std::process::id()));
        for (bytes, why) in [
            (&[0; 4096][..], "not an actq image (magic differs)"),
            (&[0; 16], "image is shorter than its header"),
            (&[0; 4097], "image length differs from its header"),
        ] {
            fs::write(&file, bytes).expect("written");
            assert_eq!(
                refused(&file),
                format!("{}: not a valid image; make one with `actq quantize`: {why}", file.display())
            );
        }
        fs::remove_file(&file).expect("removed");
        assert!(refused(Path::new("none.actq")).starts_with("cannot read the image none.actq: "));
    }

    #[test]
    fn files_are_written_whole_or_not() {
        let folder = std::env::temp_dir().join(format!("actq-firmware-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("a folder");
        let file = folder.join("f.elf");
        write(&file, b"old").expect("written");
        write(&file, b"new").expect("written");
        assert_eq!(fs::read(&file).expect("there"), b"new");
        assert!(write(&folder.join("none/f.elf"), b"x").is_err());
        assert!(write(&folder, b"x").is_err());
        assert_eq!(fs::read_dir(&folder).expect("there").count(), 1);
        fs::remove_dir_all(&folder).expect("removed");
    }
}
