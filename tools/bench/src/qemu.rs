//! Runs the firmware under QEMU, and counts the executed instructions.

use std::fs;
use std::io::{Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Output, Stdio};

use actq::runtime::{ImageBuffer, with_head};
use actq_boards::{Target, target_dir, version};
use actq_link::{RESET, STEP};
use anyhow::{Context, Result, bail, ensure};
use tempfile::NamedTempFile;

use crate::bits;
use crate::firmware::{cargo_build, harness, symbol};

/// Returns QEMU's command for `elf`, an image in the slot if one is given, and arguments of the firmware.
pub fn command(elf: &Path, slot: Option<&Path>, arguments: &str) -> Result<Command> {
    command_on(Target::Fpu, elf, slot, arguments)
}

/// Does the same as [`command`] on the board of a target.
pub fn command_on(target: Target, elf: &Path, slot: Option<&Path>, arguments: &str) -> Result<Command> {
    let mut command = target.run(elf);
    if !arguments.is_empty() {
        command.arg("-append").arg(arguments);
    }
    in_slot(&mut command, elf, slot)?;
    Ok(command)
}

/// Puts an image into the slot, if one is given.
pub(crate) fn in_slot(command: &mut Command, elf: &Path, slot: Option<&Path>) -> Result<()> {
    if let Some(image) = slot {
        let address = slot_address(elf)?;
        command.arg("-device").arg(format!("loader,file={},addr={address:#x},force-raw=on", image.display()));
    }
    Ok(())
}

/// Writes an image to a temporary file, to put it into the slot.
pub fn slot(image: &[u8]) -> Result<NamedTempFile> {
    let file = NamedTempFile::new()?;
    fs::write(file.path(), image)?;
    Ok(file)
}

/// Returns the address of the firmware's image slot.
fn slot_address(elf: &Path) -> Result<u64> {
    match (symbol(elf, "_image_slot_start")?, symbol(elf, "_image_slot_end")?) {
        (Some((start, _)), Some((end, _))) if start < end => Ok(start),
        _ => bail!("{} has no image slot", elf.display()),
    }
}

pub(crate) fn spawn(command: &mut Command) -> Result<Child> {
    let emulator = command.get_program().to_string_lossy().into_owned();
    command.spawn().with_context(|| format!("cannot start {emulator}; `cargo xtask doctor` shows how to install it"))
}

/// Runs a firmware that ends by itself; `input` is its standard input.
pub fn run(mut command: Command, input: &[u8]) -> Result<Output> {
    let mut child = spawn(command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()))?;
    let mut stdin = child.stdin.take().context("QEMU has no standard input")?;
    std::thread::scope(|scope| {
        // A firmware that stops early closes the pipe; its exit status tells why.
        scope.spawn(move || drop(stdin.write_all(input)));
        child.wait_with_output().context("QEMU did not end")
    })
}

/// A step request of the pipe protocol.
pub fn step_request(observation: &[f32]) -> Vec<u8> {
    std::iter::once(STEP).chain(observation.iter().flat_map(|v| v.to_le_bytes())).collect()
}

/// A firmware under QEMU that serves a policy.
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
        self.send(&[RESET])
    }

    /// Returns the action for an observation.
    pub fn step(&mut self, observation: &[f32]) -> Result<Vec<f32>> {
        self.send(&step_request(observation))?;
        let mut bytes = vec![0; 4 * self.act_len];
        self.stdout.read_exact(&mut bytes).context("cannot read an action from the firmware")?;
        Ok(bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect())
    }

    /// Ends the firmware, which must succeed.
    pub fn finish(mut self) -> Result<()> {
        self.stdin = None;
        let status = self.child.wait().context("QEMU did not end")?;
        ensure!(status.success(), "the firmware failed: {status}");
        Ok(())
    }
}

/// Runs an image on observations, in QEMU and on the host, with a reset in the middle; every action must
/// have the same bits.
pub fn same_bits(target: Target, bytes: &[u8], observations: &[Vec<f32>]) -> Result<()> {
    let file = slot(bytes)?;
    let elf = harness(target)?;
    let buffer = ImageBuffer::new(bytes);
    let image = buffer.image(file.path())?;
    let mut server = Server::start(command_on(target, &elf, Some(file.path()), "serve")?, image.act_len())?;
    with_head(image, |head| {
        for (step, observation) in observations.iter().enumerate() {
            if step == observations.len() / 2 {
                head.reset();
                server.reset()?;
            }
            let expected = head.step(observation)?;
            let action = server.step(observation)?;
            let same = bits(&action) == bits(expected);
            ensure!(same, "{}, step {step}: {action:?} in QEMU, {expected:?} on the host", image.name());
        }
        Ok(())
    })?;
    server.finish()
}

/// The profile of the plugin (see `Cargo.toml`).
const PROFILE: &str = "checks";

/// Counts instructions in the regions that a firmware marks.
#[derive(Debug)]
pub struct Counter {
    plugin: PathBuf,
    out: NamedTempFile,
}

impl Counter {
    /// Builds the plugin for the installed QEMU.
    pub fn build() -> Result<Self> {
        let api = plugin_api()?;
        cargo_build(
            "the counting plugin",
            &["--profile", PROFILE, "--package", "insn-count"],
            &[("ACTQ_QEMU_API", &api.to_string())],
        )?;
        let name = format!("{}insn_count{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
        Ok(Self { plugin: target_dir().join(PROFILE).join(name), out: NamedTempFile::new()? })
    }

    /// Adds the plugin to a command that runs `elf`.
    pub fn attach(&self, command: &mut Command, elf: &Path) -> Result<()> {
        let mark = |name| symbol(elf, name)?.with_context(|| format!("{}: symbol {name} is missing", elf.display()));
        let ((begin, begin_len), (end, _)) = (mark("actq_count_begin")?, mark("actq_count_end")?);
        command.arg("-plugin").arg(format!(
            "{},out={},begin={begin:x},begin_end={:x},end={end:x}",
            self.plugin.display(),
            self.out.path().display(),
            begin + begin_len,
        ));
        Ok(())
    }

    /// Runs a firmware that ends by itself with this standard input, as [`command_on`] without arguments. Returns its
    /// output and the regions; the firmware must succeed.
    pub fn run(&self, target: Target, elf: &Path, slot: Option<&Path>, input: &[u8]) -> Result<(String, Vec<Region>)> {
        let mut command = command_on(target, elf, slot, "")?;
        self.attach(&mut command, elf)?;
        let output = run(command, input)?;
        ensure!(output.status.success(), "{}: {output:?}", elf.display());
        Ok((String::from_utf8(output.stdout)?, self.regions()?))
    }

    /// Returns the regions of the finished run, in order.
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

/// Counts between two marks.
#[derive(Clone, Debug)]
pub struct Region {
    /// Instructions.
    pub instructions: u64,
    /// Lines of data fetched from flash into a cache of 8 lines of 16 bytes, empty at first.
    pub data_lines: u64,
    /// Lines of code fetched from flash after a jump into a cache of 64 lines of 16 bytes, empty at first.
    pub code_lines: u64,
    /// Lines of code fetched into it after the previous line, by how many instructions, at least one, were executed
    /// there.
    pub next_lines: Vec<u64>,
    /// Executed instructions, by address.
    pub executed: Vec<Executed>,
}

/// The count of an instruction.
#[derive(Clone, Copy, Debug)]
pub struct Executed {
    /// Address.
    pub address: u64,
    /// Executions.
    pub count: u64,
    /// Executions that did not continue at the next instruction.
    pub jumps: u64,
}

/// Returns the plugin API of the installed QEMU: 1 up to 9.0, 2 from 9.1 on (QEMU's docs/devel/tcg-plugins). It assumes
/// that the emulators of all targets are of one release; QEMU refuses a plugin of another API.
fn plugin_api() -> Result<u32> {
    let emulator = Target::Fpu.board().emulator;
    let version = version(emulator).with_context(|| format!("{emulator} is not installed"))?;
    let number = version.split_whitespace().find(|w| w.starts_with(|c: char| c.is_ascii_digit()));
    let mut parts = number.unwrap_or("").split('.').map(|p| p.parse::<u32>().unwrap_or(0));
    let (major, minor) = (parts.next().unwrap_or(0), parts.next().unwrap_or(0));
    match (major, minor) {
        (..7, _) => bail!("{version} is too old; install 7.0 or newer"),
        (7 | 8, _) | (9, 0) => Ok(1),
        _ => Ok(2),
    }
}
