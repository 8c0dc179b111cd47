//! `cargo xtask firmware`: the motor controller for a board, as one ELF file.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use actq_boards::{Application, Target, root, target_dir};
use actq_controller::Limits;
use actq_kernels::Image;
use anyhow::{Context as _, Result, bail, ensure};

use crate::limits;
use crate::setup::{self, cargo};

const USAGE: &str = "\
Usage: cargo xtask firmware --board NAME [--image FILE.actq] [--limits LIMITS] [--features LIST] [--key HEX]
                             --out FILE.elf
       cargo xtask firmware --list

  --board NAME       The board; --list shows them
  --image FILE.actq  The image to build in; without it, that of the UR3 policy at 3 bits
  --limits LIMITS    The range of every axis, LOW:HIGH or LOW:HIGH:RATE (change in a second), or a file with a line for
                     each axis. The stricter of these and the image's own limits hold; without either no axis may move
  --features LIST    Features of firmware-demo: tick-8khz, foc, defmt-rtt, defmt-semihosting
  --key HEX          The public key, as `actq keygen` prints it, whose images alone run (feature signed)
  --out FILE.elf     Where the ELF file goes, whole or not at all";

/// What is asked for.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Options {
    Help,
    List,
    Build {
        target: Target,
        image: Option<PathBuf>,
        limits: Option<String>,
        features: Option<String>,
        key: Option<String>,
        out: PathBuf,
    },
}

impl Options {
    /// The command's words, or what is wrong with them.
    pub(crate) fn parse(words: &[&str]) -> Result<Self, String> {
        match words {
            ["--help" | "-h"] => return Ok(Self::Help),
            ["--list"] => return Ok(Self::List),
            _ => {}
        }
        let wrong = |what: String| format!("error: {what}\n\n{USAGE}");
        let (mut board, mut image, mut limits, mut features, mut key, mut out) = (None, None, None, None, None, None);
        let mut words = words.iter();
        while let Some(option) = words.next() {
            let value = match *option {
                "--board" => &mut board,
                "--image" => &mut image,
                "--limits" => &mut limits,
                "--features" => &mut features,
                "--key" => &mut key,
                "--out" => &mut out,
                other => return Err(wrong(format!("{other:?} is no option"))),
            };
            let word = words.next().ok_or_else(|| wrong(format!("{option} needs a value")))?;
            if value.replace(*word).is_some() {
                return Err(wrong(format!("{option} is there twice")));
            }
        }
        let board = board.ok_or_else(|| wrong("--board is missing".to_owned()))?;
        let out = out.ok_or_else(|| wrong("--out is missing".to_owned()))?.into();
        let known = || boards().map(|(target, _)| target.board().name).collect::<Vec<_>>().join(", ");
        let target = boards().map(|(target, _)| target).find(|target| target.board().name == board);
        let target = target.ok_or_else(|| format!("error: there is no board {board:?}; there are {}", known()))?;
        let is_key = |key: &str| key.len() == 64 && key.bytes().all(|digit| digit.is_ascii_hexdigit());
        if key.is_some_and(|key| !is_key(key)) {
            return Err(wrong("--key takes the 64 hexadecimal digits that `actq keygen` prints".to_owned()));
        }
        let [limits, features, key] = [limits, features, key].map(|value| value.map(str::to_owned));
        Ok(Self::Build { target, image: image.map(PathBuf::from), limits, features, key, out })
    }

    pub(crate) fn run(self) -> Result<()> {
        match self {
            Self::Help => println!("{USAGE}"),
            Self::List => {
                for (target, application) in boards() {
                    println!("{:12} {:27} {}", target.board().name, target.triple(), application.about);
                }
            }
            Self::Build { target, image, limits, features, key, out } => {
                let application = target.board().application.context("the board has no application")?;
                check_out(&out, image.as_deref())?;
                let limits = limits.as_deref().map_or(Ok(Vec::new()), limits::read)?;
                let check = |image: &Path| check(image, &limits, application, target);
                let given = image.as_deref().map(check).transpose()?;
                setup::rust_target(target.triple())?;
                let image = given.map_or_else(|| check(&example()?), Ok)?;
                let elf = build(target, &image, &limits, features.as_deref(), key.as_deref())?;
                write(&out, &elf)?;
                println!("{}: {} with {}", out.display(), target.board().name, image.display());
            }
        }
        Ok(())
    }
}

/// The boards that the application has a device for, each by its first target.
pub(crate) fn boards() -> impl Iterator<Item = (Target, Application)> {
    let first = |target: &Target| Target::on(target.board().name) == Some(*target);
    Target::ALL.into_iter().filter(first).filter_map(|target| Some((target, target.board().application?)))
}

/// Refuses a place that the ELF file cannot take or should not, before minutes are spent on it.
fn check_out(out: &Path, image: Option<&Path>) -> Result<()> {
    let folder = match out.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    ensure!(folder.is_dir(), "{}: there is no folder {}", out.display(), folder.display());
    ensure!(!out.is_dir(), "{}: is a folder; --out takes the name of a file", out.display());
    let whole = |path: &Path| fs::canonicalize(path).ok();
    let is_image = image.is_some_and(|image| whole(image).is_some() && whole(image) == whole(out));
    ensure!(!is_image, "{}: is the image itself; --out takes another name", out.display());
    Ok(())
}

/// The whole path of an image that the board's application runs with these limits; an error says why it does not.
fn check(path: &Path, limits: &[Limits], application: Application, target: Target) -> Result<PathBuf> {
    let bytes = fs::read(path).with_context(|| format!("{}: the image cannot be read", path.display()))?;
    // Words, because an image begins at a multiple of 4.
    let mut words = vec![0u32; bytes.len().div_ceil(4)];
    let aligned = &mut bytemuck::cast_slice_mut::<u32, u8>(&mut words)[..bytes.len()];
    aligned.copy_from_slice(&bytes);
    let image = Image::new_checked(aligned)
        .with_context(|| format!("{}: refused as an image, which `actq quantize` makes", path.display()))?;
    let (needed, given) = (image.scratch_words(), application.scratch);
    let name = target.board().name;
    ensure!(
        needed <= given,
        "{}: needs {needed} words of scratch memory, the application on {name} has {given} (SCRATCH of the board)",
        path.display()
    );
    let still = limits::without_limits(limits, &image)?;
    if !still.is_empty() {
        eprintln!(
            "warning: {}: no finite limits for {}: the controller will refuse to arm; --limits LOW:HIGH sets them",
            path.display(),
            still.join(", ")
        );
    }
    fs::canonicalize(path).with_context(|| path.display().to_string())
}

/// The image of the UR3 policy: rounded, which takes a second.
fn example() -> Result<PathBuf> {
    let path = target_dir().join("firmware-example.actq");
    let new = path.with_extension(format!("{}.tmp", std::process::id()));
    println!("Quantizing the UR3 policy to 3 bits, rounded; --image takes another image");
    let mut build = cargo();
    // With actq-bench, for the features that tests and measurements are built with: else the quantizer would be built
    // once more.
    build.current_dir(root()).args(["build", "--quiet", "--release", "--bin", "actq"]);
    let built =
        build.args(["--package", "actq-cli", "--package", "actq-bench"]).status().context("cargo cannot be started")?;
    ensure!(built.success(), "actq does not build");
    let mut command =
        Command::new(target_dir().join("release").join("actq").with_extension(std::env::consts::EXE_EXTENSION));
    command.current_dir(root()).args(["quantize", "examples/ur3/policy", "--method", "rtn", "--bits", "3"]);
    let output = command.args(["--group", "32", "--activations", "8", "--out"]).arg(&new).output()?;
    ensure!(output.status.success(), "the UR3 policy: {}", String::from_utf8_lossy(&output.stderr));
    // Cargo builds anew what includes a newer file.
    let is_same = fs::read(&path).ok() == Some(fs::read(&new)?);
    if is_same { fs::remove_file(&new) } else { fs::rename(&new, &path) }
        .with_context(|| format!("{}: cannot be written", path.display()))?;
    Ok(path)
}

/// Builds, and gives the ELF file's bytes.
fn build(
    target: Target,
    image: &Path,
    limits: &[Limits],
    features: Option<&str>,
    key: Option<&str>,
) -> Result<Vec<u8>> {
    let name = target.board().name;
    // A folder of its own: cargo gives the files of all boards with one triple the same name, and two may be built at a
    // time. What is built on the way there is shared, by a cargo that knows the variable (1.91).
    let folder = target_dir().join("boards").join(name);
    let features = [Some(name), features, key.map(|_| "signed")];
    let features = features.into_iter().flatten().collect::<Vec<_>>().join(",");
    let mut command = cargo();
    if let Some(key) = key {
        command.env("ACTQ_PUBLIC_KEY", key);
    }
    command.current_dir(root()).args(["build", "--package", "actq-firmware-demo", "--bin", "controller"]);
    command.args(["--profile", target.profile(), "--target", target.triple(), "--features", &features]);
    // defmt's own default leaves out all but errors.
    if std::env::var_os("DEFMT_LOG").is_none() {
        command.env("DEFMT_LOG", "info");
    }
    command.arg("--target-dir").arg(&folder).env("ACTQ_IMAGE", image);
    match limits {
        [] => command.env_remove("ACTQ_LIMITS"),
        _ => command.env("ACTQ_LIMITS", limits.iter().map(Limits::to_string).collect::<Vec<_>>().join(",")),
    };
    let status = command.env("CARGO_BUILD_BUILD_DIR", target_dir()).status();
    if !status.context("cargo cannot be started")?.success() {
        let memory = target.board().memory;
        bail!(
            "the application does not build for {name}; where the linker says that FLASH overflows, it has no room for \
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
    let mut name = path.file_name().with_context(|| format!("{}: is no file's name", path.display()))?.to_owned();
    name.push(format!(".{}.tmp", std::process::id()));
    let temporary = path.with_file_name(name);
    let written = fs::write(&temporary, bytes).and_then(|()| fs::rename(&temporary, path));
    if written.is_err() {
        // What is left of it is of no use to anybody.
        let _ = fs::remove_file(&temporary);
    }
    written.with_context(|| format!("{}: cannot be written", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_read_or_refused() {
        let out = PathBuf::from("f.elf");
        let build = |target, image: Option<&str>| {
            let image = image.map(PathBuf::from);
            Ok(Options::Build { target, image, limits: None, features: None, key: None, out: out.clone() })
        };
        assert_eq!(Options::parse(&["--list"]), Ok(Options::List));
        assert_eq!(Options::parse(&["--board", "stm32f405", "--out", "f.elf"]), build(Target::F405, None));
        let words = ["--out", "f.elf", "--image", "i.actq", "--board", "mps2-an386"];
        assert_eq!(Options::parse(&words), build(Target::Fpu, Some("i.actq")));
        for (words, expected) in [
            (&["--board", "stm32f4", "--out", "f.elf"][..], "there are mps2-an386, mps2-an505, mps2-an500, stm32f405"),
            (&["--board", "microbit", "--out", "f.elf"], "there is no board \"microbit\""),
            (&["--board", "stm32f405"], "--out is missing"),
            (&["--out", "f.elf"], "--board is missing"),
            (&["--board", "stm32f405", "--out", "f.elf", "--key", "12"], "--key takes the 64 hexadecimal digits"),
            (&["--board"], "--board needs a value"),
            (&["--limits", "-1:1", "--limits", "-1:1"], "--limits is there twice"),
            (&["--board", "a", "--board", "b"], "--board is there twice"),
            (&["--bord", "a"], "\"--bord\" is no option"),
        ] {
            let wrong = Options::parse(words).expect_err("refused");
            assert!(wrong.contains(expected), "{words:?}: {wrong}");
        }
    }

    #[test]
    fn what_is_no_image_is_refused_by_name() {
        let application = Target::F405.board().application.expect("an application");
        let refused = |path: &Path| format!("{:#}", check(path, &[], application, Target::F405).expect_err("refused"));
        let file = std::env::temp_dir().join(format!("actq-no-image-{}", std::process::id()));
        for (bytes, why) in [
            (&[0; 4096][..], "not an actq image (magic differs)"),
            (&[0; 16], "image is shorter than its header"),
            (&[0; 4097], "image length differs from its header"),
        ] {
            fs::write(&file, bytes).expect("written");
            assert_eq!(
                refused(&file),
                format!("{}: refused as an image, which `actq quantize` makes: {why}", file.display())
            );
        }
        fs::remove_file(&file).expect("removed");
        assert!(refused(Path::new("none.actq")).starts_with("none.actq: the image cannot be read: "));
    }

    #[test]
    fn a_file_is_written_whole_or_not_at_all() {
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
