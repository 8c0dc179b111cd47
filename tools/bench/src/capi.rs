//! Packages the C interface for a core: header, library, files for build systems, licences and a manifest.

use std::fs;
use std::io::{Cursor, Write as _};
use std::path::{Path, PathBuf};
use std::process::Command;

use actq_boards::{Target, root, target_dir, version};
use actq_cli::outputs;
use actq_cli::report::export::sha256;
use actq_kernels::Image;
use anyhow::{Context as _, Result, ensure};
use serde_json::{Value, json};
use tempfile::TempDir;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use crate::firmware::{cargo, flash_bytes, lock};

/// Version of the packages.
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// A core for which there is a package.
#[derive(Clone, Copy, Debug)]
pub struct Core {
    /// Its name.
    pub name: &'static str,
    /// Its target; `None` for the host.
    pub target: Option<Target>,
    /// Options of arm-none-eabi-gcc, or of riscv64-unknown-elf-gcc.
    pub flags: &'static [&'static str],
    /// Its condition in Zephyr's Kconfig.
    kconfig: &'static str,
    /// Its condition in C, by macros of GCC and Clang.
    macros: &'static str,
}

const fn core(name: &'static str, target: Option<Target>, flags: &'static [&'static str]) -> Core {
    Core { name, target, flags, kconfig: "y", macros: "1" }
}

impl Core {
    const fn is(self, kconfig: &'static str, macros: &'static str) -> Self {
        Self { kconfig, macros, ..self }
    }
}

/// All of them.
pub const CORES: &[Core] = &[
    core("cortex-m0plus", Some(Target::Small), &["-mcpu=cortex-m0plus", "-mthumb"])
        .is("CPU_CORTEX_M0 || CPU_CORTEX_M0PLUS", "__ARM_ARCH == 6 && __ARM_ARCH_PROFILE == 'M'"),
    core("cortex-m3", Some(Target::NoDsp), &["-mcpu=cortex-m3", "-mthumb"])
        .is("CPU_CORTEX_M3", "__ARM_ARCH == 7 && __ARM_ARCH_PROFILE == 'M' && !defined(__ARM_FEATURE_DSP)"),
    core(SOFT_FLOAT, Some(Target::NoFpu), &["-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=soft"]).is(
        "(CPU_CORTEX_M4 || CPU_CORTEX_M7) && !FP_HARDABI",
        "__ARM_ARCH == 7 && __ARM_ARCH_PROFILE == 'M' && defined(__ARM_FEATURE_DSP) && !defined(__ARM_PCS_VFP)",
    ),
    core("cortex-m4f", Some(Target::Fpu), &["-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"])
        .is("CPU_CORTEX_M4", "__ARM_ARCH == 7 && __ARM_ARCH_PROFILE == 'M' && defined(__ARM_FEATURE_DSP)"),
    core("cortex-m7", Some(Target::M7), &["-mcpu=cortex-m7", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv5-sp-d16"])
        .is("CPU_CORTEX_M7", "__ARM_ARCH == 7 && __ARM_ARCH_PROFILE == 'M' && defined(__ARM_FEATURE_DSP)"),
    core("cortex-m33", Some(Target::M33), &["-mcpu=cortex-m33", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv5-sp-d16"])
        .is(
            "CPU_CORTEX_M33 && ARMV8_M_DSP",
            "__ARM_ARCH == 8 && __ARM_ARCH_PROFILE == 'M' && defined(__ARM_FEATURE_DSP)",
        ),
    core("rv32imac", Some(Target::Riscv), &["-march=rv32imac", "-mabi=ilp32"]).is(
        "RISCV && !64BIT && RISCV_ISA_EXT_M && RISCV_ISA_EXT_C && !FLOAT_HARD",
        "__riscv_xlen == 32 && defined(__riscv_mul) && defined(__riscv_compressed) && defined(__riscv_float_abi_soft)",
    ),
    core("host", None, &[]),
];

/// The core whose library also is for programs that pass floats in integer registers on cores with an FPU.
const SOFT_FLOAT: &str = "cortex-m4";

impl Core {
    /// Returns the core with this name.
    pub fn of(name: &str) -> Option<Self> {
        CORES.iter().find(|core| core.name == name).copied()
    }

    /// Name of the core in Arduino's `build.mcu`, which is gcc's: `None` if it is not a Cortex-M.
    fn mcu(self) -> Option<&'static str> {
        self.flags.iter().find_map(|flag| flag.strip_prefix("-mcpu="))
    }

    /// Folder of the library among Arduino's: `src/MCU/FPU-ABI`, or `src/MCU` for programs of any other ABI.
    fn arduino(self) -> Option<String> {
        let mcu = self.mcu()?;
        let value = |name: &str| self.flags.iter().find_map(|flag| flag.strip_prefix(name));
        Some(match (value("-mfpu="), value("-mfloat-abi=")) {
            (Some(fpu), Some(abi)) => format!("src/{mcu}/{fpu}-{abi}"),
            _ => format!("src/{mcu}"),
        })
    }

    /// The core of the library that a package for a core with an FPU also has.
    fn soft_float(self) -> Option<Self> {
        self.flags.contains(&"-mfloat-abi=hard").then(|| Self::of(SOFT_FLOAT)).flatten()
    }

    fn has_assembler(self) -> bool {
        self.target.is_some_and(Target::has_assembler)
    }

    /// Templates of the package's files for build systems (in `capi/package`), and their names in the package.
    fn templates(self) -> Vec<(&'static str, &'static str)> {
        let mut all = vec![
            ("actqConfig.cmake", "lib/cmake/actq/actqConfig.cmake"),
            ("actqConfigVersion.cmake", "lib/cmake/actq/actqConfigVersion.cmake"),
            ("actq.pc", "lib/pkgconfig/actq.pc"),
            ("zephyr/module.yml", "zephyr/module.yml"),
            ("zephyr/Kconfig", "zephyr/Kconfig"),
            ("zephyr/CMakeLists.txt", "zephyr/CMakeLists.txt"),
            ("library.json", "library.json"),
        ];
        if self.mcu().is_some() {
            all.push(("library.properties", "library.properties"));
        }
        if self.target == Some(Target::Riscv) {
            all.extend(["CMakeLists.txt", "idf_component.yml"].map(|name| (name, name)));
        }
        all
    }

    /// Builds the library for this core with these features, and reads it.
    ///
    /// # Errors
    ///
    /// If cargo cannot build it, or the file cannot be read.
    fn library(self, features: &str) -> Result<Vec<u8>> {
        let profile = if self.has_assembler() { "capi" } else { "capi-portable" };
        let mut arguments = vec!["rustc", "--quiet", "--package", "actq-capi", "--lib", "--crate-type", "staticlib"];
        let features = format!("panic-handler {features}");
        arguments.extend(["--no-default-features", "--features", &features, "--profile", profile]);
        let mut folder = target_dir();
        if let Some(target) = self.target {
            arguments.extend(["--target", target.triple()]);
            folder.push(target.triple());
        }
        // The libraries of all features have one name: no other is built until this one has been read.
        let _building = lock("actq-capi.lock")?;
        cargo("the C interface", &arguments, &[])?;
        let file = folder.join(profile).join("libactq_c.a");
        fs::read(&file).with_context(|| file.display().to_string())
    }

    /// Returns the features of a library for `image`, or for any.
    fn features(self, image: Option<&Image<'_>>, compact: bool) -> String {
        let mut features = image.map_or_else(|| vec!["default"], |image| image.features().collect());
        // The layouts of the core's own images.
        features.extend((image.is_none() && !self.has_assembler()).then_some("scalar"));
        features.extend(compact.then_some("compact"));
        features.join(" ")
    }

    /// Returns the bytes of code and constants that a program links from the library for `image`, if it opens the image,
    /// makes a head and runs steps. It takes rustc's linker, and no C compiler.
    ///
    /// # Errors
    ///
    /// If the library cannot be built or linked.
    pub fn linked_bytes(self, image: &Image<'_>) -> Result<u64> {
        let folder = TempDir::new()?;
        let [library, program] = ["libactq.a", "program.elf"].map(|name| folder.path().join(name));
        fs::write(&library, self.library(&self.features(Some(image), false))?)?;
        let roots = ["actq_image_open", "actq_image_sizes", "actq_head_init"].map(|name| format!("--undefined={name}"));
        let output = Command::new(linker()?)
            .args(["-flavor", "gnu", "--gc-sections", "--entry=actq_step"])
            .args(roots)
            .arg(&library)
            .arg("-o")
            .arg(&program)
            .output()
            .context("cannot start rust-lld")?;
        ensure!(output.status.success(), "cannot link: {}", String::from_utf8_lossy(&output.stderr));
        flash_bytes(&program)
    }

    /// Writes the package to `out`: an archive if its name ends in `.zip`, otherwise a folder. Neither may exist
    /// before, but for an empty folder. The library runs any image, or only images that need no other features of the
    /// kernels than `image`; its loops are short if `compact`.
    ///
    /// # Errors
    ///
    /// If the core has no loops that could be short, the library cannot be built, or a file cannot be written.
    pub fn package(self, out: &Path, image: Option<&Image<'_>>, compact: bool) -> Result<()> {
        ensure!(
            !compact || self.has_assembler(),
            "--compact shortens loops in assembler, and {} has none; leave it out",
            self.name
        );
        let is_archive = out.extension().is_some_and(|extension| extension == "zip");
        let is_free =
            if is_archive { !out.exists() } else { fs::read_dir(out).map_or(true, |mut files| files.next().is_none()) };
        ensure!(is_free, "{}: exists already; remove it, or name another file or folder", out.display());
        let mut files = Files::default();
        let features = self.features(image, compact);
        let library = self.library(&features)?;
        files.put("lib/libactq.a", &library);
        let capi = root().join("capi");
        for header in ["actq.h", "actq.hpp"] {
            files.put(&format!("include/{header}"), &fs::read(capi.join("include").join(header))?);
        }
        let soft_float = self.soft_float().map(|core| core.library(&features)).transpose()?;
        if let Some(library) = &soft_float {
            files.put("lib/soft-float/libactq.a", library);
        }
        if let (Some(mcu), Some(folder)) = (self.mcu(), self.arduino()) {
            // Arduino looks only below `src`.
            files.put(&format!("{folder}/libactq.a"), &library);
            if let Some(library) = &soft_float {
                files.put(&format!("src/{mcu}/libactq.a"), library);
            }
            for header in ["actq.h", "actq.hpp"] {
                files.put(&format!("src/{header}"), format!("#include \"../include/{header}\"\n").as_bytes());
            }
        }
        for (from, to) in self.templates() {
            let text = fs::read_to_string(capi.join("package").join(from)).with_context(|| from.to_owned())?;
            let values = [
                ("@VERSION@", VERSION),
                ("@CORE@", self.name),
                ("@KCONFIG@", self.kconfig),
                ("@MACROS@", self.macros),
                ("@FLAGS@", &self.flags.join(" ")),
            ];
            let text = values.iter().fold(text, |text, (key, value)| text.replace(key, value));
            files.put(to, text.as_bytes());
        }
        let parts = licences(&mut files)?;
        let digests: serde_json::Map<String, Value> =
            files.0.iter().map(|(name, bytes)| (name.clone(), sha256(bytes).into())).collect();
        let manifest = json!({
            "schema": 1,
            "actq": VERSION,
            "core": self.name,
            "features": features,
            "flags": self.flags,
            "compiler": version("rustc")?,
            "parts": parts,
            "sha256": digests,
            "not_measured": ["time, stack and power on a real board"],
            "not_run": ["builds by Zephyr, ESP-IDF and Arduino"],
        });
        files.put("manifest.json", format!("{manifest:#}\n").as_bytes());
        let write = || if is_archive { files.write_archive(out, self.name) } else { files.write_folder(out) };
        write().with_context(|| out.display().to_string())
    }
}

/// The files of a package: names and content.
#[derive(Default)]
struct Files(Vec<(String, Vec<u8>)>);

impl Files {
    fn put(&mut self, name: &str, bytes: &[u8]) {
        self.0.push((name.to_owned(), bytes.to_vec()));
    }

    fn write_folder(&self, out: &Path) -> Result<()> {
        for (name, bytes) in &self.0 {
            let path = out.join(name);
            fs::create_dir_all(path.parent().unwrap_or(out))?;
            fs::write(&path, bytes).with_context(|| name.clone())?;
        }
        Ok(())
    }

    /// Writes a zip archive with one folder, uncompressed: the same bytes for the same content.
    fn write_archive(&self, out: &Path, core: &str) -> Result<()> {
        let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
        for (name, bytes) in &self.0 {
            let stored = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
            archive.start_file(format!("actq-{core}/{name}"), stored)?;
            archive.write_all(bytes)?;
        }
        outputs::files::write(out, &archive.finish()?.into_inner())
    }
}

/// Returns the path of the linker that is a part of rustc.
fn linker() -> Result<PathBuf> {
    let output = Command::new("rustc").args(["--print", "target-libdir"]).output().context("cannot start rustc")?;
    let folder = PathBuf::from(String::from_utf8(output.stdout)?.trim_end());
    Ok(folder.with_file_name("bin").join("rust-lld"))
}

/// Adds the licences of the crates in the library; returns these with their versions and licences.
fn licences(files: &mut Files) -> Result<Vec<Value>> {
    let own = ["LICENSE-MIT", "LICENSE-APACHE"];
    for name in own {
        files.put(name, &fs::read(root().join(name))?);
    }
    let metadata = cargo("the list of crates", &["metadata", "--format-version", "1", "--locked"], &[])?;
    let metadata: Value = serde_json::from_str(&metadata)?;
    let tree = ["tree", "--package", "actq-capi", "--edges", "normal", "--prefix", "none", "--format", "{p}"];
    let mut used: Vec<String> = cargo("the tree of crates", &tree, &[])?
        .lines()
        .map(|line| line.split(' ').take(2).collect::<Vec<_>>().join(" ").replace(" v", " "))
        .collect();
    used.sort();
    used.dedup();
    let mut parts = Vec::new();
    for package in metadata["packages"].as_array().context("packages")? {
        let text = |key: &str| package[key].as_str().unwrap_or_default();
        let (name, number) = (text("name"), text("version"));
        if used.binary_search(&format!("{name} {number}")).is_err() {
            continue;
        }
        let mut part = json!({ "name": name, "version": number, "licence": text("license") });
        let folder = Path::new(text("manifest_path")).parent().context("no folder")?;
        part["files"] = match package["source"].is_null() {
            // A crate of this project.
            true => own.map(str::to_owned).to_vec().into(),
            false => licences_of(name, folder, files)?.into(),
        };
        parts.push(part);
    }
    let compiled_in = json!({ "name": "core and compiler_builtins of Rust", "licence": "MIT OR Apache-2.0" });
    parts.push(compiled_in);
    Ok(parts)
}

/// Adds the licences in a crate's folder; returns their names. Some crates have none; the texts of MIT and Apache-2.0
/// are at the top of the package.
fn licences_of(name: &str, folder: &Path, files: &mut Files) -> Result<Vec<String>> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let file = entry.file_name().to_string_lossy().into_owned();
        if entry.path().is_file() && ["LICENSE", "COPYING"].iter().any(|start| file.starts_with(start)) {
            let to = format!("licences/{name}/{file}");
            files.put(&to, &fs::read(folder.join(&file))?);
            found.push(to);
        }
    }
    Ok(found)
}
