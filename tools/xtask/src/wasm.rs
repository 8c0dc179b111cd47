//! `cargo xtask wasm`: the kernels as a WebAssembly module, which the report and the npm package have.

use std::fs;
use std::io::{Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::Command;

use actq_boards::{root, target_dir};
use anyhow::{Context as _, Result, bail, ensure};
use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;

use crate::{Words, measuring, setup};

/// rustc's target.
pub(crate) const TARGET: &str = "wasm32-unknown-unknown";
/// The package, whose folder has the module.
const PACKAGE: &str = "actq-wasm";
const MODULE: &str = "javascript/actq.wasm.gz";

/// Options of `cargo xtask wasm`.
#[derive(clap::Args)]
pub(crate) struct Options {
    /// Compare the module in the tree with a new one, and run the package's tests in Node, instead
    #[arg(long)]
    check: bool,
}

/// Compiles the robots, and builds the gallery with them.
pub(crate) fn gallery(Words { mut words }: Words) -> Result<()> {
    setup::rust_target(TARGET)?;
    compile("actq-gallery", "actq_gallery")?;
    words.extend(["--robots".to_owned(), place("actq_gallery").display().to_string()]);
    measuring("actq-bench", "gallery", Words { words })
}

/// Returns the path of a compiled module.
fn place(name: &str) -> PathBuf {
    target_dir().join(TARGET).join("wasm").join(format!("{name}.wasm"))
}

/// Compiles the module, and writes or compares it.
pub(crate) fn run(options: &Options) -> Result<()> {
    setup::rust_target(TARGET)?;
    let compiled = compile(PACKAGE, "actq_wasm")?;
    let path = root().join(MODULE);
    if options.check {
        compare(&compiled, &fs::read(&path).with_context(|| format!("{MODULE}: cannot read the file"))?)?;
        return test_in_node();
    }
    let mut gzip = GzEncoder::new(Vec::new(), Compression::best());
    gzip.write_all(&compiled)?;
    let packed = gzip.finish()?;
    println!("{MODULE}: {} bytes, {} compiled", packed.len(), compiled.len());
    fs::write(&path, packed).with_context(|| format!("{MODULE}: cannot write the file"))
}

/// Compiles a package to a module, and returns its bytes.
pub(crate) fn compile(package: &str, name: &str) -> Result<Vec<u8>> {
    let arguments = ["rustc", "--package", package, "--lib", "--crate-type", "cdylib", "--target", TARGET];
    let mut cargo = setup::cargo();
    cargo.current_dir(root()).args(arguments).args(["--profile", "wasm"]);
    ensure!(cargo.status().context("cannot start cargo")?.success(), "{package}: cannot be compiled to WebAssembly");
    let path = place(name);
    fs::read(&path).with_context(|| format!("{}: cannot read the file", path.display()))
}

/// Compares the compiled module with the packed one of the tree. Another compiler gives other bytes.
fn compare(compiled: &[u8], packed: &[u8]) -> Result<()> {
    let mut own = Vec::new();
    GzDecoder::new(packed).read_to_end(&mut own).with_context(|| format!("{MODULE}: is damaged"))?;
    let version = Command::new("rustc").arg("-vV").output().context("cannot start rustc")?;
    let version = String::from_utf8_lossy(&version.stdout).into_owned();
    // The standard library's paths in the module name its commit.
    let commit = version.lines().find_map(|line| line.strip_prefix("commit-hash: ")).unwrap_or("unknown");
    if !own.windows(commit.len()).any(|bytes| bytes == commit.as_bytes()) {
        println!("SKIPPED: {MODULE} was made by another compiler than {commit}; its bytes are not compared");
        return Ok(());
    }
    if own != compiled {
        bail!("{MODULE}: differs from the kernels of this tree; run `cargo xtask wasm`, and commit the file");
    }
    println!("{MODULE}: equal to a new one");
    Ok(())
}

/// Runs the tests of the npm package, if there is a Node that can; with a browser, also those of the pages.
fn test_in_node() -> Result<()> {
    if let Err(why) = setup::node() {
        println!("SKIPPED: tests of the npm package and of the pages: {why}");
        return Ok(());
    }
    let folder = root().join("javascript");
    let run = |program: &str, arguments: &[&str], pages: &Path| -> Result<()> {
        let status = Command::new(program).args(arguments).env("ACTQ_PAGES", pages).current_dir(&folder).status();
        let text = format!("{program} {}", arguments.join(" "));
        ensure!(status.with_context(|| format!("cannot start {program}"))?.success(), "{text} failed");
        Ok(())
    };
    let pages = target_dir().join("pages");
    if let Err(why) = setup::browser() {
        println!("SKIPPED: tests of the pages: {why}");
        return run("node", &["--test", "test/head.test.js"], &pages);
    }
    let words = ["--quick", "--out"].map(str::to_owned).into_iter().chain([pages.display().to_string()]);
    gallery(Words { words: words.collect() })?;
    // The client of the browser; it brings no browser. Without it, the tests of the pages skip themselves.
    if let Err(why) = run("npm", &["ci", "--ignore-scripts", "--no-audit", "--no-fund"], &pages) {
        println!("SKIPPED: tests of the pages: {why:#}");
    }
    // Node 21 and later take no folder.
    run("node", &["--test", "test/head.test.js", "test/pages.test.js"], &pages)
}
