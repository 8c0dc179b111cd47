//! The compilers, and programs of the harness in QEMU.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use actq_bench::cycles::Code;
use actq_bench::qemu::Counter;
use actq_bench::{Target, capi, firmware, root};
use anyhow::{Context as _, Result, ensure};

use super::cases::{Case, STEPS};

/// A core.
#[derive(Debug)]
pub(crate) struct Core {
    pub(crate) name: &'static str,
    /// Its board.
    pub(crate) target: Target,
    /// Name of our package.
    pub(crate) package: Option<&'static str>,
    pub(crate) flags: &'static [&'static str],
    /// rustc's target and options.
    pub(crate) rust: (&'static str, &'static str),
    /// BakeNN's target with the fastest code.
    pub(crate) bakenn: &'static str,
}

const fn core(
    (name, package): (&'static str, Option<&'static str>),
    target: Target,
    flags: &'static [&'static str],
    rust: (&'static str, &'static str),
    bakenn: &'static str,
) -> Core {
    Core { name, target, package, flags, rust, bakenn }
}

const M4F: &[&str] = &["-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"];
const M55: &[&str] = &["-mcpu=cortex-m55", "-mthumb", "-mfloat-abi=hard"];
const RUST_M4F: (&str, &str) = ("thumbv7em-none-eabihf", "-Ctarget-cpu=cortex-m4");
const RUST_M55: (&str, &str) = ("thumbv8m.main-none-eabihf", "-Ctarget-cpu=cortex-m55");
const M3: &[&str] = &["-mcpu=cortex-m3", "-mthumb"];
const M0: &[&str] = &["-mcpu=cortex-m0plus", "-mthumb"];
const RV32: &[&str] = &["-march=rv32imac", "-mabi=ilp32"];
const RUST_RV32: (&str, &str) = ("riscv32imac-unknown-none-elf", "");

pub(crate) const CORES: [Core; 5] = [
    core(("m4f", Some("cortex-m4f")), Target::Fpu, M4F, RUST_M4F, "cortex-m4"),
    core(("m3", Some("cortex-m3")), Target::NoDsp, M3, ("thumbv7m-none-eabi", ""), "portable32"),
    core(("m0", Some("cortex-m0plus")), Target::V6m, M0, ("thumbv6m-none-eabi", ""), "cortex-m0plus"),
    core(("rv32imac", Some("rv32imac")), Target::Riscv, RV32, RUST_RV32, "rv32imc"),
    core(("m55", None), Target::M55, M55, RUST_M55, "cortex-m4"),
];

/// The sources and flags that a peer is compiled with.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sources {
    pub(crate) files: Vec<PathBuf>,
    pub(crate) includes: Vec<PathBuf>,
    /// Objects and libraries that are only linked.
    pub(crate) linked: Vec<PathBuf>,
    pub(crate) flags: Vec<String>,
}

/// The output of a program, and its figures.
#[derive(Debug)]
pub(crate) struct Measured {
    pub(crate) instructions: u64,
    /// Modelled cycles; only on the Cortex-M4.
    pub(crate) cycles: Option<u64>,
    /// Bytes, without the harness's.
    pub(crate) flash: u64,
    pub(crate) ram: u64,
    pub(crate) stack: u64,
    pub(crate) outputs: Vec<u32>,
}

/// Returns the folder of the harness.
pub(crate) fn harness() -> PathBuf {
    root().join("tools/bench/peers")
}

/// Runs a command to its end; an error has what it printed.
pub(crate) fn run(command: &mut Command) -> Result<String> {
    let output = command.output().with_context(|| format!("cannot start {}", command.get_program().display()))?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "{} failed: {}", command.get_program().display(), first_error(&text));
    Ok(text)
}

fn first_error(text: &str) -> &str {
    text.lines().find(|line| line.contains("error")).or(text.lines().last()).unwrap_or_default().trim()
}

impl Core {
    fn is_arm(&self) -> bool {
        self.target != Target::Riscv
    }

    /// Returns gcc's name, and Debian's packages of it.
    pub(crate) fn gcc(&self) -> (&'static str, &'static str) {
        match self.is_arm() {
            true => ("arm-none-eabi-gcc", "gcc-arm-none-eabi libnewlib-arm-none-eabi libstdc++-arm-none-eabi-newlib"),
            false => ("riscv64-unknown-elf-gcc", "gcc-riscv64-unknown-elf picolibc-riscv64-unknown-elf"),
        }
    }

    fn gcc_command(&self, options: &[&str]) -> Command {
        let mut command = Command::new(self.gcc().0);
        command.args(self.flags).args(options).args(["-w", "-ffunction-sections", "-fdata-sections"]);
        if !self.is_arm() {
            command.arg("--specs=picolibc.specs");
        }
        command
    }

    /// Returns clang with gcc's headers.
    fn clang(&self, options: &[&str], is_cpp: bool) -> Result<Command> {
        let mut clang = Command::new("clang");
        clang.arg(if self.is_arm() { "--target=arm-none-eabi" } else { "--target=riscv32-unknown-elf" });
        clang.args(self.flags).args(options).args(["-w", "-ffunction-sections", "-fdata-sections"]);
        let language = if is_cpp { "c++" } else { "c" };
        let text = run(self.gcc_command(&[]).args(["-E", "-v", "-x", language, "/dev/null"]))?;
        let folders = text.lines().skip_while(|line| !line.starts_with("#include <")).skip(1);
        // clang has its own headers of the compiler.
        let folders = folders.take_while(|line| line.starts_with(' ')).map(str::trim);
        let folders = folders.filter(|line| line.contains("..") || !line.contains("/gcc/"));
        Ok(folders.fold(clang, |mut clang, folder| {
            clang.arg("-isystem").arg(folder);
            clang
        }))
    }

    /// Compiles and links a program of the harness in `folder`. `options` begin with the compiler: gcc or clang.
    pub(crate) fn build(&self, case: &Case, sources: &Sources, options: &[&str], folder: &Path) -> Result<PathBuf> {
        let _ = fs::remove_dir_all(folder);
        fs::create_dir_all(folder)?;
        let c = root().join("examples/c");
        let numbers = [
            format!("-DSTEPS={STEPS}"),
            format!("-DINPUTS={}", case.inputs()),
            format!("-DOUTPUTS={}", case.outputs()),
            format!("-DLAYERS={}", case.lengths.len() - 1),
            format!("-DWIDEST={}", case.lengths[1..].iter().max().unwrap_or(&0)),
        ];
        let with_includes = |mut command: Command| {
            command.current_dir(folder).args(&numbers).args(&sources.flags);
            command.arg("-I").arg(harness()).arg("-I").arg(&c);
            for path in &sources.includes {
                command.arg("-I").arg(path);
            }
            command
        };
        // The harness is always the same code.
        let own = [harness().join("harness.c"), c.join("startup.c")];
        let mut own_objects = with_includes(self.gcc_command(&["-O2", "-c"]));
        own_objects.args(&own[..1 + usize::from(self.is_arm())]);
        own_objects.args(["-std=gnu11"]);
        run(&mut own_objects)?;
        let mut link = with_includes(self.gcc_command(if options[0] == "gcc" { &options[1..] } else { &[] }));
        for object in ["harness.o", "startup.o"].iter().take(1 + usize::from(self.is_arm())) {
            link.arg(object);
        }
        if options[0] == "gcc" {
            link.args(&sources.files);
        } else {
            let is_cpp = sources.files.iter().any(|file| file.extension().is_some_and(|e| e == "cpp"));
            run(with_includes(self.clang(&options[1..], is_cpp)?).arg("-c").args(&sources.files))?;
            let objects =
                sources.files.iter().map(|file| Path::new(file.file_name().unwrap_or_default()).with_extension("o"));
            if options.contains(&"-flto") {
                // gcc's linker does not read clang's bitcode: this makes one object of it.
                run(Command::new("ld.lld").current_dir(folder).args(["-r", "--lto-O3", "-o", "all.o"]).args(objects))?;
                link.arg("all.o");
            } else {
                link.args(objects);
            }
        }
        let script = match self.target {
            Target::M55 => harness().join("mps3-an547.ld"),
            Target::Riscv => harness().join("riscv.ld"),
            _ => c.join("mps2-an386.ld"),
        };
        link.args(&sources.linked).arg("-L").arg(&c).arg("-T").arg(script);
        link.args(["-nostartfiles", "-Wl,--gc-sections", "-lm", "-o", "peer.elf"]);
        run(&mut link)?;
        Ok(folder.join("peer.elf"))
    }

    /// Runs a program.
    pub(crate) fn measure(&self, case: &Case, counter: &Counter, elf: &Path) -> Result<Measured> {
        let mut command = self.target.run(elf);
        counter.attach(&mut command, elf)?;
        let text = run(&mut command)?;
        let words = |kind: &str| -> Result<Vec<u32>> {
            let lines = text.lines().filter_map(|line| line.strip_prefix(kind));
            lines.map(|word| Ok(u32::from_str_radix(word.trim(), 16)?)).collect()
        };
        let (outputs, stack) = (words("v ")?, words("s ")?);
        ensure!(outputs.len() == STEPS * case.outputs(), "the program printed {} outputs", outputs.len());
        let regions = counter.regions()?;
        let region = regions.first().context("nothing was counted")?;
        let cycles = if self.target == Target::Fpu { Some(Code::read(elf)?.cycles(region, 0)?) } else { None };
        Ok(Measured {
            instructions: region.instructions,
            cycles,
            flash: firmware::flash_bytes(elf)?,
            ram: firmware::ram_bytes(elf)?,
            stack: u64::from(*stack.first().context("the program did not measure its stack")?),
            outputs,
        })
    }

    /// Packages our library for an image: its header and archive.
    pub(crate) fn library(&self, image: &actq_kernels::Image<'_>, folder: &Path) -> Result<Sources> {
        let package = capi::Core::of(self.package.context("no package")?).context("no core")?;
        package.package(folder, Some(image), false)?;
        Ok(Sources {
            includes: vec![folder.join("include")],
            linked: vec![folder.join("lib/libactq.a")],
            ..Sources::default()
        })
    }
}
