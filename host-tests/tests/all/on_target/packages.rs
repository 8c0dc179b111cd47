//! The files of packages for build systems: what they name is in the package, and programs build by them.

use std::fs;
use std::path::Path;

use actq::runtime::ImageBuffer;
use actq_bench::capi::Core;
use actq_bench::{firmware, root, skipped};
use actq_kernels::Image;
use anyhow::{Context as _, Result, bail, ensure};
use object::{Object as _, ObjectSection as _};
use serde_json::Value;
use tempfile::TempDir;

use super::c::{Runs, folder, is_installed, shell};
use crate::docs::listings;

fn package(dir: &TempDir, core: &str) -> Result<()> {
    Core::of(core).context("a core")?.package(&dir.path().join(core), None, false)
}

/// Returns the values of `key` in a text of lines `key<separator>value`.
fn values<'a>(text: &'a str, key: &str) -> Result<Vec<&'a str>> {
    let found: Vec<&str> = text.lines().filter_map(|line| line.trim().strip_prefix(key)).map(str::trim).collect();
    ensure!(!found.is_empty(), "no {key} in {text}");
    Ok(found)
}

/// Checks the files that every package has.
fn check_common(package: &Path) -> Result<()> {
    let read = |name: &str| fs::read_to_string(package.join(name)).with_context(|| name.to_owned());
    let exists = |name: &str| {
        ensure!(package.join(name).exists(), "{name} is missing in {}", package.display());
        Ok(())
    };
    let library: Value = serde_json::from_str(&read("library.json")?)?;
    let texts = |value: &Value| value.as_array().into_iter().flatten().map(|text| text.to_string()).collect::<Vec<_>>();
    for header in texts(&library["headers"]) {
        exists(&format!("include/{}", header.trim_matches('"')))?;
    }
    exists(library["build"]["includeDir"].as_str().context("includeDir")?)?;
    let flags = texts(&library["build"]["flags"]);
    // PlatformIO resolves this in the library's folder, wherever that is.
    ensure!(flags == ["\"-Llib\"", "\"-lactq\""], "{flags:?}");
    exists("lib/libactq.a")?;

    let module = read("zephyr/module.yml")?;
    exists(&format!("{}/CMakeLists.txt", values(&module, "cmake:")?[0]))?;
    exists(values(&module, "kconfig:")?[0])?;
    let kconfig = read("zephyr/Kconfig")?;
    ensure!(kconfig.contains("depends on ") && !kconfig.contains('@'), "{kconfig}");
    let zephyr = read("zephyr/CMakeLists.txt")?;
    let named: Vec<&str> = zephyr.split("${CMAKE_CURRENT_LIST_DIR}/").skip(1).collect();
    let named: Vec<&str> = named.iter().filter_map(|path| path.split(')').next()).collect();
    ensure!(named == ["../lib/libactq.a", "../lib/soft-float/libactq.a", "../include"], "{zephyr}");
    exists("include")
}

/// Cargo gives the libraries of all features one name.
#[test]
fn packages_have_their_own_libraries() -> Result<()> {
    let file = firmware::built_in()?;
    let buffer = ImageBuffer::read(file)?;
    let image = buffer.image(file)?;
    let core = Core::of("cortex-m4f").context("a core")?;
    let library = &|only: Option<&Image<'_>>| -> Result<Vec<u8>> {
        let dir = TempDir::new()?;
        core.package(dir.path(), only, false)?;
        Ok(fs::read(dir.path().join("lib/libactq.a"))?)
    };
    let alone = [library(None)?, library(Some(&image))?];
    ensure!(alone[0] != alone[1], "the features make no difference");
    for _ in 0..3 {
        let [any, this] = std::thread::scope(|scope| {
            [None, Some(&image)]
                .map(|only| scope.spawn(move || library(only)))
                .map(|made| made.join().expect("no panic"))
        });
        ensure!([any?, this?] == alone, "a package has the other's library");
    }
    Ok(())
}

#[test]
fn files_that_a_package_names_are_in_it() -> Result<()> {
    let dir = TempDir::new()?;
    let at = |name: &str| dir.path().join(name);
    for core in ["cortex-m4f", "rv32imac"] {
        package(&dir, core)?;
        check_common(&at(core))?;
    }
    // Arduino, on Cortex-M only.
    let properties = fs::read_to_string(at("cortex-m4f/library.properties"))?;
    ensure!(values(&properties, "precompiled=")? == ["full"] && !at("rv32imac/library.properties").exists());
    for header in values(&properties, "includes=")? {
        let text = fs::read_to_string(at("cortex-m4f/src").join(header))?;
        ensure!(text == format!("#include \"../include/{header}\"\n"), "{text}");
    }
    let read = |name: &str| fs::read(at("cortex-m4f").join(name)).with_context(|| name.to_owned());
    let [hard, soft] = ["lib/libactq.a", "lib/soft-float/libactq.a"];
    ensure!(read(hard)? == read("src/cortex-m4/fpv4-sp-d16-hard/libactq.a")?, "Arduino's library is another");
    ensure!(read(soft)? == read("src/cortex-m4/libactq.a")?, "Arduino's library is another");
    ensure!(!at("rv32imac/lib/soft-float").exists());
    // ESP-IDF, on RISC-V only.
    let component = fs::read_to_string(at("rv32imac/idf_component.yml"))?;
    let version = format!("\"{}\"", env!("CARGO_PKG_VERSION"));
    ensure!(values(&component, "version:")? == [version] && values(&component, "- ")?.contains(&"esp32c6"));
    let cmake = fs::read_to_string(at("rv32imac/CMakeLists.txt"))?;
    ensure!(cmake.contains("(INCLUDE_DIRS include)") && cmake.contains("(actq lib/libactq.a)"), "{cmake}");
    ensure!(!at("cortex-m4f/CMakeLists.txt").exists() && !at("cortex-m4f/idf_component.yml").exists());
    Ok(())
}

/// The package for RV32IMAC is one for RV32IMC, too: the ESP32-C2 and C3 have no atomic instructions.
#[test]
fn the_library_for_risc_v_has_no_atomic_instructions() -> Result<()> {
    let dir = TempDir::new()?;
    package(&dir, "rv32imac")?;
    let bytes = fs::read(dir.path().join("rv32imac/lib/libactq.a"))?;
    let archive = object::read::archive::ArchiveFile::parse(&*bytes)?;
    let mut instructions = 0;
    for member in archive.members() {
        let Ok(file) = object::File::parse(member?.data(&*bytes)?) else { continue };
        for section in file.sections().filter(|section| section.kind() == object::SectionKind::Text) {
            let mut rest = section.data()?;
            while let Some(&first) = rest.first() {
                // The lowest bits say whether an instruction has two bytes or four, and AMO is an opcode of its own.
                ensure!(first & 0x7f != 0x2f, "{}: an atomic instruction", section.name()?);
                rest = rest.get(if first & 3 == 3 { 4 } else { 2 }..).unwrap_or_default();
                instructions += 1;
            }
        }
    }
    ensure!(instructions > 10_000, "{instructions} instructions");
    if !is_installed("riscv64-unknown-elf-gcc") {
        skipped("riscv64-unknown-elf-gcc is not installed");
        return Ok(());
    }
    fs::write(dir.path().join("program.c"), PROGRAM)?;
    let options =
        "-march=rv32imc -mabi=ilp32 -ffreestanding -nostdlib -Wl,--entry=main -Irv32imac/include -Lrv32imac/lib";
    shell(&dir, &format!("riscv64-unknown-elf-gcc {options} program.c -lactq -o program"))?;
    Ok(())
}

/// A program that fails unless header and library match.
const PROGRAM: &str = "#include \"actq.h\"\nint main(void) { return actq_abi() == ACTQ_ABI ? 0 : 1; }\n";

const PROJECT: &str = "
cmake_minimum_required(VERSION 3.13)
project(program C)
find_package(actq ${WANTED} REQUIRED)
add_executable(program program.c)
target_link_libraries(program actq::actq)
";

#[test]
fn programs_build_by_pkg_config_and_cmake() -> Result<()> {
    let dir = TempDir::new()?;
    let at = |name: &str| dir.path().join(name);
    package(&dir, "host")?;
    fs::write(at("program.c"), PROGRAM)?;
    fs::write(at("CMakeLists.txt"), PROJECT)?;
    if is_installed("cc") && is_installed("pkg-config") {
        let options = "$(PKG_CONFIG_PATH=host/lib/pkgconfig pkg-config --cflags --libs actq)";
        shell(&dir, &format!("cc program.c {options} -o program && ./program"))?;
    } else {
        skipped("cc or pkg-config is not installed");
    }
    if !is_installed("cc") || !is_installed("cmake") {
        skipped("cc or cmake is not installed");
        return Ok(());
    }
    let configure = |wanted: &str| {
        let command = "rm -rf build && cmake -DCMAKE_PREFIX_PATH=\"$PWD/host\" -S . -B build";
        shell(&dir, &format!("{command} -DWANTED={wanted}"))
    };
    let own = env!("CARGO_PKG_VERSION");
    let [major, minor, _] = own.split('.').collect::<Vec<_>>()[..] else { bail!("{own}") };
    let older = minor.parse::<u32>()?.checked_sub(1).map(|older| format!("{major}.{older}"));
    for refused in older.into_iter().chain([format!("{major}.{minor}.999"), "99.0".to_owned()]) {
        ensure!(configure(&refused).is_err(), "version {own} was taken for {refused}");
    }
    configure(own)?;
    configure(&format!("{major}.{minor}"))?;
    shell(&dir, "cmake --build build && ./build/program")?;
    Ok(())
}

/// Each core's package is found with that core's options only, and the library is that of the program's floats.
#[test]
fn cmake_takes_the_package_of_the_core() -> Result<()> {
    if !is_installed("arm-none-eabi-gcc") || !is_installed("cmake") {
        skipped("arm-none-eabi-gcc or cmake is not installed");
        return Ok(());
    }
    let dir = TempDir::new()?;
    let project = "
cmake_minimum_required(VERSION 3.13)
project(program ${LANGUAGE})
add_compile_options(${OPTIONS} $<$<COMPILE_LANGUAGE:CXX>:-fno-rtti>)
find_package(actq REQUIRED)
get_target_property(library actq::actq IMPORTED_LOCATION)
message(STATUS \"library ${library}\")
";
    fs::write(dir.path().join("CMakeLists.txt"), project)?;
    let [m0, m3, m4, m4f, m33] = ["cortex-m0plus", "cortex-m3", "cortex-m4", "cortex-m4f", "cortex-m33"];
    for core in [m0, m4, m4f] {
        package(&dir, core)?;
    }
    let [hard, soft] = ["lib/libactq.a", "lib/soft-float/libactq.a"].map(Some);
    let fpu = "-mfpu=fpv4-sp-d16;-mfloat-abi=";
    let options = |core: &str, float: &str| format!("-mthumb;-mcpu={}{float}", core.trim_end_matches('f'));
    for (package, core, float, expected) in [
        (m4f, m4, &*format!(";{fpu}hard"), hard),
        (m4f, m4, &format!(";{fpu}softfp"), soft),
        (m4f, m4, "", soft),
        (m4f, m3, "", None),
        (m4f, m0, "", None),
        (m4f, m33, ";-mfpu=fpv5-sp-d16;-mfloat-abi=hard", None),
        (m4, m4, "", hard),
        (m4, m4, &format!(";{fpu}hard"), None),
        (m0, m0, "", hard),
        (m0, m3, "", None),
    ] {
        for language in ["C", "CXX"] {
            let options = options(core, float);
            let command = format!(
                "rm -rf build && cmake -DCMAKE_SYSTEM_NAME=Generic -DCMAKE_C_COMPILER=arm-none-eabi-gcc \
                 -DCMAKE_CXX_COMPILER=arm-none-eabi-g++ -DCMAKE_TRY_COMPILE_TARGET_TYPE=STATIC_LIBRARY \
                 -DLANGUAGE={language} -DOPTIONS='{options}' -DCMAKE_FIND_ROOT_PATH=\"$PWD/{package}\" -S . -B build"
            );
            match (shell(&dir, &command), expected) {
                (Ok(printed), Some(library)) => {
                    ensure!(printed.contains(&format!("/{package}/{library}\n")), "{package}, {options}: {printed}");
                }
                (Err(error), None) => {
                    let printed = error.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
                    ensure!(printed.contains(&format!("The package is for {package}, and")), "{options}: {printed}");
                }
                (found, _) => bail!("{package}, {options}: {found:?}"),
            }
        }
    }
    Ok(())
}

#[test]
fn arduinos_files_give_the_hosts_bits() -> Result<()> {
    let Some(dir) = folder(Runs::ThisImage)? else { return Ok(()) };
    let document = fs::read_to_string(root().join("docs/C.md"))?;
    let commands = listings(&document, "sh")[..2].concat();
    let [include, library] = ["-Iactq-cortex-m4f/include", "-Lactq-cortex-m4f/lib"];
    ensure!(commands.contains(include) && commands.contains(library), "docs/C.md names other folders");
    let commands = commands.replace(include, "-Iactq-cortex-m4f/src");
    // A program that uses the FPU, and passes floats in integer registers, has the library without an FPU.
    let abi = "-mfloat-abi=hard";
    ensure!(commands.contains(abi), "docs/C.md has other options");
    let softfp = commands.replace(abi, "-mfloat-abi=softfp");
    for (commands, folder) in [(&commands, "cortex-m4/fpv4-sp-d16-hard"), (&softfp, "cortex-m4")] {
        let printed = shell(&dir, &commands.replace(library, &format!("-Lactq-cortex-m4f/src/{folder}")))?;
        ensure!(printed.lines().count() == 2 && printed.lines().all(|line| line.ends_with("host's: 0")), "{printed}");
    }
    Ok(())
}
