//! The files of packages for build systems: what they name is in the package, and programs build by them.

use std::fs;
use std::path::Path;

use actq::runtime::ImageBuffer;
use actq_bench::capi::Core;
use actq_bench::{firmware, root, skipped};
use actq_kernels::Image;
use anyhow::{Context as _, Result, bail, ensure};
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
    let zephyr = read("zephyr/CMakeLists.txt")?;
    let named: Vec<&str> = zephyr.split("${CMAKE_CURRENT_LIST_DIR}/").skip(1).collect();
    ensure!(named.len() == 2, "{zephyr}");
    for path in named {
        exists(&format!("zephyr/{}", path.split(')').next().unwrap_or_default()))?;
    }
    Ok(())
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
    let [own, library] = ["cortex-m4f/src/cortex-m4/libactq.a", "cortex-m4f/lib/libactq.a"].map(at);
    ensure!(fs::read(own)? == fs::read(library)?, "Arduino's library is another");
    // ESP-IDF, on RISC-V only.
    let component = fs::read_to_string(at("rv32imac/idf_component.yml"))?;
    let version = format!("\"{}\"", env!("CARGO_PKG_VERSION"));
    ensure!(values(&component, "version:")? == [version] && values(&component, "- ")?.contains(&"esp32c6"));
    let cmake = fs::read_to_string(at("rv32imac/CMakeLists.txt"))?;
    ensure!(cmake.contains("(INCLUDE_DIRS include)") && cmake.contains("(actq lib/libactq.a)"), "{cmake}");
    ensure!(!at("cortex-m4f/CMakeLists.txt").exists() && !at("cortex-m4f/idf_component.yml").exists());
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

#[test]
fn arduinos_files_give_the_hosts_bits() -> Result<()> {
    let Some(dir) = folder(Runs::ThisImage)? else { return Ok(()) };
    let document = fs::read_to_string(root().join("docs/C.md"))?;
    let commands = listings(&document, "sh")[..2].concat();
    let [include, library] = ["-Iactq-cortex-m4f/include", "-Lactq-cortex-m4f/lib"];
    ensure!(commands.contains(include) && commands.contains(library), "docs/C.md names other folders");
    let commands = commands.replace(include, "-Iactq-cortex-m4f/src");
    let printed = shell(&dir, &commands.replace(library, "-Lactq-cortex-m4f/src/cortex-m4"))?;
    ensure!(printed.lines().count() == 2 && printed.lines().all(|line| line.ends_with("host's: 0")), "{printed}");
    Ok(())
}
