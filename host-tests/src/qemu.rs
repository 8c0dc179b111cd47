//! Building the firmware and running it under QEMU.

use std::fs;
use std::io::{Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Output, Stdio};

use anyhow::{Context, Result, bail, ensure};
use object::{Object as _, ObjectSection as _, ObjectSymbol as _};

/// A target of the firmware.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// thumbv7em-none-eabihf: with FPU
    Fpu,
    /// thumbv7em-none-eabi: floats in software
    NoFpu,
    /// thumbv7m-none-eabi, Cortex-M3: the portable kernels
    NoDsp,
    /// thumbv6m-none-eabi, Cortex-M0: the portable kernels in little memory
    Small,
    /// riscv32imac-unknown-none-elf: the portable kernels
    Riscv,
}

impl Target {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Fpu, Self::NoFpu, Self::NoDsp, Self::Small, Self::Riscv];

    /// rustc's name.
    pub fn triple(self) -> &'static str {
        match self {
            Self::Fpu => "thumbv7em-none-eabihf",
            Self::NoFpu => "thumbv7em-none-eabi",
            Self::NoDsp => "thumbv7m-none-eabi",
            Self::Small => "thumbv6m-none-eabi",
            Self::Riscv => "riscv32imac-unknown-none-elf",
        }
    }

    /// The profile of a build that chooses its backend by the target (`Cargo.toml`).
    fn profile(self) -> &'static str {
        match self {
            Self::Fpu | Self::NoFpu => "firmware",
            Self::NoDsp | Self::Small | Self::Riscv => "release",
        }
    }

    /// QEMU's program.
    pub fn emulator(self) -> &'static str {
        match self {
            Self::Fpu | Self::NoFpu | Self::NoDsp | Self::Small => "qemu-system-arm",
            Self::Riscv => "qemu-system-riscv32",
        }
    }

    /// QEMU's machine, as arguments. A SiFive E31 has RV32IMAC and nothing else: what it lacks is an illegal instruction.
    fn machine(self) -> &'static [&'static str] {
        match self {
            Self::Fpu | Self::NoFpu => &["-M", "mps2-an386"],
            Self::NoDsp => &["-M", "mps2-an385"],
            Self::Small => &["-M", "microbit"],
            Self::Riscv => &["-M", "virt", "-cpu", "sifive-e31", "-bios", "none"],
        }
    }
}

/// The folder that cargo builds into.
pub fn target_dir() -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| crate::root().join("target"), |dir| crate::root().join(dir))
}

fn cargo_build(what: &str, arguments: &[&str], environment: &[(&str, &str)]) -> Result<()> {
    let output = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
        .current_dir(crate::root())
        .args(["build", "--quiet"])
        .args(arguments)
        .envs(environment.iter().copied())
        .output()
        .context("cargo cannot be started")?;
    ensure!(output.status.success(), "{what} does not build:\n{}", String::from_utf8_lossy(&output.stderr));
    Ok(())
}

/// Builds a firmware binary with `image` built in and gives the path of its ELF file.
pub fn build(binary: &str, target: Target, image: &Path) -> Result<PathBuf> {
    build_in(&target_dir(), binary, target, image, target.profile(), &[])
}

/// As [`build`], without the assembler (`ACTQ_BACKEND=portable`); in a folder of its own, so that builds of both kinds stay.
pub fn build_portable(binary: &str, target: Target, image: &Path) -> Result<PathBuf> {
    build_in(&target_dir().join("portable"), binary, target, image, "release", &[("ACTQ_BACKEND", "portable")])
}

fn build_in(
    dir: &Path,
    binary: &str,
    target: Target,
    image: &Path,
    profile: &str,
    environment: &[(&str, &str)],
) -> Result<PathBuf> {
    let image = fs::canonicalize(image).with_context(|| format!("{}: cannot be read", image.display()))?;
    let folder = dir.to_string_lossy();
    let package = ["--package", "actq-firmware-demo", "--bin", binary, "--target", target.triple()];
    cargo_build(
        &format!("firmware {binary} for {}", target.triple()),
        &[&package[..], &["--profile", profile, "--target-dir", &folder]].concat(),
        &[environment, &[("ACTQ_IMAGE", &image.to_string_lossy())]].concat(),
    )?;
    Ok(dir.join(target.triple()).join(profile).join(binary))
}

/// QEMU with `elf`, an image in the slot if one is given, and arguments for the firmware.
pub fn command(elf: &Path, slot: Option<&Path>, arguments: &str) -> Command {
    command_on(Target::Fpu, elf, slot, arguments)
}

/// As [`command`], on the machine of a target; only those of a Cortex-M4 or M3 have a slot.
pub fn command_on(target: Target, elf: &Path, slot: Option<&Path>, arguments: &str) -> Command {
    let mut command = Command::new(target.emulator());
    command
        .args(target.machine())
        .args(["-display", "none", "-monitor", "none", "-serial", "none"])
        .args(["-semihosting-config", "enable=on,target=native"])
        .arg("-kernel")
        .arg(elf);
    if !arguments.is_empty() {
        command.arg("-append").arg(arguments);
    }
    if let Some(image) = slot {
        command.arg("-device").arg(format!("loader,file={},addr=0x00200000,force-raw=on", image.display()));
    }
    command
}

fn spawn(command: &mut Command) -> Result<Child> {
    let emulator = command.get_program().to_string_lossy().into_owned();
    command
        .spawn()
        .with_context(|| format!("{emulator} cannot be started; `cargo xtask doctor` says how to install it"))
}

/// Runs a firmware that ends by itself; `input` is its standard input.
pub fn run(mut command: Command, input: &[u8]) -> Result<Output> {
    let mut child = spawn(command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()))?;
    let mut stdin = child.stdin.take().context("no standard input")?;
    std::thread::scope(|scope| {
        // A firmware that stops early closes the pipe; its exit status tells why.
        scope.spawn(move || drop(stdin.write_all(input)));
        child.wait_with_output().context("QEMU does not end")
    })
}

/// A firmware under QEMU that serves as a policy.
#[derive(Debug)]
pub struct Server {
    child: Child,
    stdin: Option<ChildStdin>,
    stdout: ChildStdout,
    act_len: usize,
}

impl Server {
    /// Starts `command` (made by [`command`] with the argument `serve`) for actions of `act_len` values.
    pub fn start(mut command: Command, act_len: usize) -> Result<Self> {
        let mut child = spawn(command.stdin(Stdio::piped()).stdout(Stdio::piped()))?;
        let stdin = child.stdin.take();
        let stdout = child.stdout.take().context("no standard output")?;
        Ok(Self { child, stdin, stdout, act_len })
    }

    fn send(&mut self, bytes: &[u8]) -> Result<()> {
        self.stdin.as_mut().context("the firmware has ended")?.write_all(bytes).context("the firmware has ended")
    }

    /// Resets the policy.
    pub fn reset(&mut self) -> Result<()> {
        self.send(b"R")
    }

    /// The action for an observation.
    pub fn step(&mut self, observation: &[f32]) -> Result<Vec<f32>> {
        let mut frame = vec![b'S'];
        frame.extend(observation.iter().flat_map(|v| v.to_le_bytes()));
        self.send(&frame)?;
        let mut bytes = vec![0; 4 * self.act_len];
        self.stdout.read_exact(&mut bytes).context("the firmware ended without an action")?;
        Ok(bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect())
    }

    /// Ends the firmware, which must do so with success.
    pub fn finish(mut self) -> Result<()> {
        self.stdin = None;
        let status = self.child.wait().context("QEMU does not end")?;
        ensure!(status.success(), "the firmware ended with a failure");
        Ok(())
    }
}

/// Counts instructions in the regions that a firmware marks.
#[derive(Debug)]
pub struct Counter {
    plugin: PathBuf,
    out: tempfile::NamedTempFile,
}

impl Counter {
    /// Builds the plugin for the QEMU that is installed.
    pub fn build() -> Result<Self> {
        let api = plugin_api()?;
        cargo_build(
            "the counting plugin",
            &["--release", "--package", "insn-count"],
            &[("ACTQ_QEMU_API", &api.to_string())],
        )?;
        let name = format!("{}insn_count{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
        Ok(Self { plugin: target_dir().join("release").join(name), out: tempfile::NamedTempFile::new()? })
    }

    /// Adds the plugin to a command that runs `elf`.
    pub fn attach(&self, command: &mut Command, elf: &Path) -> Result<()> {
        let (begin, begin_len) = symbol(elf, "actq_count_begin")?;
        let (end, _) = symbol(elf, "actq_count_end")?;
        command.arg("-plugin").arg(format!(
            "{},out={},begin={begin:x},begin_end={:x},end={end:x}",
            self.plugin.display(),
            self.out.path().display(),
            begin + begin_len,
        ));
        Ok(())
    }

    /// The regions of the run that has ended, in order.
    pub fn regions(&self) -> Result<Vec<Region>> {
        let text = fs::read_to_string(self.out.path())?;
        let mut regions: Vec<Region> = Vec::new();
        for line in text.lines() {
            let fields: Vec<&str> = line.split(' ').collect();
            match (&fields[..], regions.last_mut()) {
                (["region", instructions, data_lines, code_lines, next @ ..], _) => regions.push(Region {
                    instructions: instructions.parse()?,
                    data_lines: data_lines.parse()?,
                    code_lines: code_lines.parse()?,
                    next_lines: next.iter().map(|count| Ok(count.parse()?)).collect::<Result<_>>()?,
                    executed: Vec::new(),
                }),
                ([address, count, jumps], Some(region)) => region.executed.push(Executed {
                    address: u64::from_str_radix(address, 16)?,
                    count: count.parse()?,
                    jumps: jumps.parse()?,
                }),
                _ => bail!("the counter wrote {line:?}"),
            }
        }
        Ok(regions)
    }
}

/// What was executed between two marks.
#[derive(Clone, Debug)]
pub struct Region {
    /// Instructions.
    pub instructions: u64,
    /// Lines of data fetched from flash into a cache of 8 lines of 16 bytes, empty at first.
    pub data_lines: u64,
    /// Lines of code fetched from flash after a jump into a cache of 64 lines of 16 bytes, empty at first.
    pub code_lines: u64,
    /// Lines of code fetched into it behind the line before, by how many instructions, from one on, were executed there.
    pub next_lines: Vec<u64>,
    /// Each instruction that was executed, by address.
    pub executed: Vec<Executed>,
}

/// How often an instruction was executed.
#[derive(Clone, Copy, Debug)]
pub struct Executed {
    /// Address.
    pub address: u64,
    /// Executions.
    pub count: u64,
    /// How many of them did not go on at the next instruction.
    pub jumps: u64,
}

/// The plugin API of the installed QEMU: 1 up to 9.0, 2 from 9.1 on (QEMU's docs/devel/tcg-plugins). The emulators of all targets
/// are taken to be of one release; QEMU refuses a plugin of another API.
fn plugin_api() -> Result<u32> {
    let version = version(Target::Fpu.emulator())?;
    let number = version.split_whitespace().find(|w| w.starts_with(|c: char| c.is_ascii_digit()));
    let mut parts = number.unwrap_or("").split('.').map(|p| p.parse::<u32>().unwrap_or(0));
    let (major, minor) = (parts.next().unwrap_or(0), parts.next().unwrap_or(0));
    match (major, minor) {
        (..7, _) => bail!("{version} is too old, 7.0 is needed"),
        (7 | 8, _) | (9, 0) => Ok(1),
        _ => Ok(2),
    }
}

/// First line of an emulator's own version text.
pub fn version(emulator: &str) -> Result<String> {
    let output = Command::new(emulator).arg("--version").output();
    let output = output.with_context(|| format!("{emulator} is not installed"))?;
    Ok(String::from_utf8_lossy(&output.stdout).lines().next().unwrap_or_default().to_owned())
}

/// Address (without the Thumb bit) and length of a function.
fn symbol(elf: &Path, name: &str) -> Result<(u64, u64)> {
    let data = fs::read(elf).with_context(|| format!("{}: cannot be read", elf.display()))?;
    let file = object::File::parse(&*data).with_context(|| format!("{}: not an ELF file", elf.display()))?;
    let symbol = file.symbols().find(|s| s.name() == Ok(name));
    let symbol = symbol.with_context(|| format!("{}: symbol {name} is missing", elf.display()))?;
    Ok((symbol.address() & !1, symbol.size()))
}

/// Bytes of flash that an ELF file takes: code, constants (the built-in image among them) and initial values.
pub fn flash_bytes(elf: &Path) -> Result<u64> {
    let data = fs::read(elf).with_context(|| format!("{}: cannot be read", elf.display()))?;
    let file = object::File::parse(&*data).with_context(|| format!("{}: not an ELF file", elf.display()))?;
    let flash = [".vector_table", ".text", ".rodata", ".data"];
    Ok(file.sections().filter(|s| s.name().is_ok_and(|n| flash.contains(&n))).map(|s| s.size()).sum())
}
