//! Other projects' code and ours, built in its fastest form and run by one harness.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use actq::emit::{self, repack};
use actq::runtime::ImageBuffer;
use actq_bench::qemu::Counter;
use actq_boards::version;
use actq_cli::report::table::table;
use actq_kernels::Width;
use anyhow::{Context as _, Result, bail, ensure};
use serde::Serialize;
use serde_json::Value;

use super::cases::{CASES, Case};
use super::compilers::{CORES, Core, Measured, Sources, harness, run};

/// Installed without what they depend on: their headers and sources are enough, and BakeNN needs numpy.
const PACKAGES: [&str; 6] =
    ["bakenn==1.0.0", "emlearn==0.23.2", "rltools==2.2.1", "numpy==2.4.6", "flatbuffers==25.12.19", "tflite==2.18.0"];

/// microflow with crates that its macro names.
const MICROFLOW: &str = "microflow = \"=0.1.3\"\nmicroflow-macros = \"=0.1.1\"
nalgebra = { version = \"=0.32.6\", default-features = false, features = [\"macros\"] }";

/// Widths of our images.
const WIDTHS: [Width; 3] = [Width::W8, Width::W3, Width::W2];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Peer {
    CmsisNn,
    BakeNn,
    EspNn,
    Emlearn,
    RlTools,
    EmbeddedNn,
    MicroFlow,
    Actq(Width),
}

const PEERS: [Peer; 10] = [
    Peer::Actq(WIDTHS[0]),
    Peer::Actq(WIDTHS[1]),
    Peer::Actq(WIDTHS[2]),
    Peer::CmsisNn,
    Peer::BakeNn,
    Peer::EspNn,
    Peer::EmbeddedNn,
    Peer::MicroFlow,
    Peer::Emlearn,
    Peer::RlTools,
];

/// The best figures of a peer.
#[derive(Debug, Serialize)]
struct Row {
    core: &'static str,
    network: &'static str,
    peer: String,
    build: String,
    instructions: u64,
    macs: usize,
    /// Modelled cycles of a Cortex-M4.
    cycles: Option<u64>,
    /// Bytes of code and network.
    flash: u64,
    /// Bytes of variables.
    ram: u64,
    stack: u64,
    /// Largest difference from the same network in f64, in percent of the largest output.
    error: f64,
}

impl Peer {
    fn name(self) -> String {
        let name = match self {
            Self::CmsisNn => "CMSIS-NN 4.0.0",
            Self::BakeNn => "BakeNN 1.0.0",
            Self::EspNn => "ESP-NN 1.2.6",
            Self::Emlearn => "emlearn 0.23.2, f32",
            Self::RlTools => "RLtools 2.2.1, f32",
            Self::EmbeddedNn => "embedded-nn 0.2.3",
            Self::MicroFlow => "microflow 0.1.3",
            Self::Actq(width) => return format!("actq, {} bits", width.bits()),
        };
        name.to_owned()
    }

    /// Key of its expected outputs.
    fn form(self) -> String {
        let name = match self {
            Self::BakeNn => "bakenn",
            Self::Emlearn | Self::RlTools => "f32",
            Self::MicroFlow => "int8 to f32",
            Self::Actq(width) => return format!("actq {}", width.bits()),
            _ => "int8",
        };
        name.to_owned()
    }

    /// Returns why it cannot run a network.
    fn lacks(self, core: &Core, case: &Case) -> Option<&'static str> {
        match (self, case.name) {
            (Self::Actq(_), _) if core.package.is_none() => Some("it has no package for this core"),
            (Self::MicroFlow, "mlp relu") => Some("rustc takes many minutes for its constants"),
            (Self::MicroFlow, _) if core.name != "m4f" => {
                Some("rustc takes minutes for its constants; run for m4f alone")
            }
            (Self::Actq(_), _) | (_, "layer" | "mlp relu") | (Self::RlTools, "gru") => None,
            (Self::EmbeddedNn, "gru") => Some("it has an LSTM and no GRU"),
            (_, "gru") => Some("it has no GRU"),
            _ => Some("it has no ELU"),
        }
    }

    /// Compilers with options that could give the fastest code.
    fn builds(self) -> Vec<Vec<&'static str>> {
        // One file has nothing to optimize across.
        let options: &[&[&str]] = match self {
            Self::Actq(_) | Self::EmbeddedNn | Self::MicroFlow => return vec![vec!["gcc", "-O2"]],
            Self::Emlearn | Self::RlTools => &[&["-O3"], &["-Ofast"]],
            _ => &[&["-O2"], &["-O3"], &["-O3", "-flto"]],
        };
        let with = |compiler| options.iter().map(move |&options| [&[compiler], options].concat());
        with("gcc").chain(with("clang")).collect()
    }
}

/// The folder with the packages, the networks and the programs.
struct Work<'a> {
    folder: &'a Path,
    /// Installed Python packages.
    packages: PathBuf,
    counter: Counter,
}

/// Installs, builds and measures all that the installed compilers can, and prints it. Returns the rows. Without `words`,
/// these are all; otherwise only those in whose core, network and peer all words are.
pub(crate) fn measure(folder: &Path, words: &[String]) -> Result<Value> {
    let mut cores = Vec::new();
    for core in &CORES {
        let (gcc, packages) = core.gcc();
        match version(gcc) {
            Ok(version) => cores.push((core, version)),
            Err(_) => eprintln!("{}: skipped: {gcc} is missing; on Debian, install {packages}", core.name),
        }
    }
    let clang = version("clang").and_then(|clang| Ok(format!("{clang}, {}", version("ld.lld")?)));
    let mut tools: Vec<&str> = cores.iter().map(|(_, version)| version.as_str()).collect();
    tools.extend(clang.as_deref());
    tools.dedup();
    println!("{}", tools.join("\n"));
    if clang.is_err() {
        eprintln!("clang: skipped: clang or ld.lld is missing; on Debian, install clang lld");
    }
    let work = Work { folder, packages: install(folder)?, counter: Counter::build()? };
    let mut rows = Vec::new();
    // The builds of each peer on a core, the fastest first. Other networks have the first four.
    let mut ranked: BTreeMap<(&str, String), Vec<String>> = BTreeMap::new();
    for case in &CASES {
        let mut expected = None;
        for (core, _) in &cores {
            let whats = PEERS.map(|peer| (peer, format!("{}, {}, {}", core.name, case.name, peer.name())));
            let wanted = whats.into_iter().filter(|(_, what)| words.iter().all(|word| what.contains(word.as_str())));
            let mut empty = None;
            for (peer, what) in wanted {
                if let Some(reason) = peer.lacks(core, case) {
                    eprintln!("{what}: skipped: {reason}");
                    continue;
                }
                if expected.is_none() {
                    eprintln!("preparing {}", case.name);
                    expected = Some(work.prepare(case)?);
                }
                let expected = expected.as_ref().context("the network was not prepared")?;
                let known = ranked.get(&(core.name, peer.name()));
                let mut measured: Vec<(String, Measured)> = Vec::new();
                let mut failure = None;
                for (label, sources, options) in work.programs(peer, core, case)? {
                    let is_slow = known.is_some_and(|known| !known.iter().take(4).any(|name| *name == label));
                    if is_slow || options[0] == "clang" && clang.is_err() {
                        continue;
                    }
                    let built = sources.and_then(|sources| {
                        let elf = core.build(case, &sources, &options, &work.folder.join("program"))?;
                        core.measure(case, &work.counter, &elf)
                    });
                    match built {
                        Ok(result) => {
                            eprintln!("{what}, {label}: {} instructions", result.instructions);
                            measured.push((label, result));
                        }
                        Err(error) => {
                            eprintln!("{what}, {label}: {error:#}");
                            failure = Some(error);
                        }
                    }
                }
                measured.sort_by_key(|(_, result)| result.cycles.unwrap_or(result.instructions));
                let labels = measured.iter().map(|(label, _)| label.clone()).collect();
                ranked.entry((core.name, peer.name())).or_insert(labels);
                let Some((build, best)) = measured.into_iter().next() else {
                    // No build of the first network has worked, or all have failed here.
                    eprintln!(
                        "{what}: skipped: it does not build or run{}",
                        failure.map_or_else(String::new, |e| format!(": {e:#}"))
                    );
                    continue;
                };
                if empty.is_none() {
                    empty = Some(work.empty(core, case)?);
                }
                let empty = empty.as_ref().context("the harness was not measured")?;
                rows.push(Row {
                    core: core.name,
                    network: case.name,
                    peer: peer.name(),
                    build,
                    instructions: best.instructions,
                    macs: case.macs(),
                    cycles: best.cycles,
                    flash: best.flash.saturating_sub(empty.flash),
                    ram: best.ram.saturating_sub(empty.ram),
                    stack: best.stack.saturating_sub(empty.stack),
                    error: error(&best.outputs, &expected[&peer.form()])?,
                });
            }
        }
    }
    show(&rows);
    Ok(serde_json::to_value(rows)?)
}

fn show(rows: &[Row]) {
    let mut shown = table(&[
        "core",
        "network",
        "peer",
        "build",
        "instructions",
        "per MAC",
        "cycles",
        "flash",
        "RAM",
        "stack",
        "error, %",
    ]);
    for row in rows {
        shown.add_row([
            row.core.to_owned(),
            row.network.to_owned(),
            row.peer.clone(),
            row.build.clone(),
            row.instructions.to_string(),
            format!("{:.2}", row.instructions as f64 / row.macs as f64),
            row.cycles.map_or("-".to_owned(), |cycles| cycles.to_string()),
            row.flash.to_string(),
            row.ram.to_string(),
            row.stack.to_string(),
            format!("{:.2}", row.error),
        ]);
    }
    println!("{shown}");
}

/// Installs the Python packages; returns their folder.
fn install(folder: &Path) -> Result<PathBuf> {
    let packages = folder.join("packages");
    if !packages.is_dir() {
        eprintln!("installing {}", PACKAGES.join(" "));
        let mut pip = python();
        pip.args([
            "-m",
            "pip",
            "install",
            "--quiet",
            "--disable-pip-version-check",
            "--no-deps",
            "--only-binary",
            ":all:",
        ]);
        run(pip.arg("--target").arg(&packages).args(PACKAGES)).context("Python 3.11 or later with pip is needed")?;
    }
    Ok(packages)
}

fn python() -> Command {
    Command::new(std::env::var_os("ACTQ_PYTHON").unwrap_or_else(|| "python3".into()))
}

/// Returns the largest difference of outputs, in percent of the largest one.
fn error(outputs: &[u32], expected: &Value) -> Result<f64> {
    let exact =
        expected["values"].as_array().into_iter().flatten().flat_map(|step| step.as_array().into_iter().flatten());
    let exact: Vec<f64> = exact.filter_map(Value::as_f64).collect();
    ensure!(exact.len() == outputs.len(), "{} outputs, {} expected", outputs.len(), exact.len());
    let value = |&word: &u32| match (expected["scale"].as_f64(), expected["zero"].as_f64()) {
        (Some(scale), Some(zero)) => scale * (f64::from(word.cast_signed()) - zero),
        _ => f64::from(f32::from_bits(word)),
    };
    let differences = outputs.iter().map(value).zip(&exact).map(|(value, exact)| (value - exact).abs());
    let largest = exact.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
    // NaN must not be lost.
    let worst = differences.fold(0.0, |worst: f64, difference| if difference <= worst { worst } else { difference });
    Ok(100.0 * worst / largest)
}

type Program = (String, Result<Sources>, Vec<&'static str>);

impl Work<'_> {
    fn of_case(&self, case: &Case) -> PathBuf {
        self.folder.join(case.name.replace(' ', "-"))
    }

    /// Writes a network in the forms of all peers; returns the expected outputs.
    fn prepare(&self, case: &Case) -> Result<BTreeMap<String, Value>> {
        let folder = self.of_case(case);
        fs::create_dir_all(&folder)?;
        fs::write(folder.join("network.json"), case.description(&WIDTHS)?.to_string())?;
        let mut prepare = python();
        prepare.arg("-B").arg(harness().join("prepare.py")).arg(&folder).env("PYTHONPATH", &self.packages);
        run(&mut prepare)?;
        Ok(serde_json::from_str(&fs::read_to_string(folder.join("expected.json"))?)?)
    }

    /// Measures the harness.
    fn empty(&self, core: &Core, case: &Case) -> Result<Measured> {
        let sources = Sources { files: vec![harness().join("empty.c")], ..Sources::default() };
        let elf = core.build(case, &sources, &["gcc", "-O2"], &self.folder.join("empty"))?;
        core.measure(case, &self.counter, &elf)
    }

    /// Returns all ways to build a peer: a name, what is built, and a compiler with options.
    fn programs(&self, peer: Peer, core: &Core, case: &Case) -> Result<Vec<Program>> {
        let own = |file: &str| harness().join(file);
        let of = |files: Vec<PathBuf>, includes: Vec<PathBuf>, flags: &[&str]| Sources {
            files,
            includes: includes.into_iter().chain([self.of_case(case)]).collect(),
            flags: flags.iter().map(|&flag| flag.to_owned()).collect(),
            ..Sources::default()
        };
        let backend = self.packages.join("bakenn/backend");
        let forms: Vec<(&str, Result<Sources>)> = match peer {
            Peer::CmsisNn => {
                let root = backend.join("cmsis_nn/vendor");
                let source = root.join("cmsis_nn/Source");
                let files = vec![
                    own("cmsis_nn.c"),
                    source.join("FullyConnectedFunctions/arm_fully_connected_s8.c"),
                    source.join("NNSupportFunctions/arm_nn_vec_mat_mult_t_s8.c"),
                ];
                let includes = vec![root.join("cmsis_nn/Include"), root.join("cmsis_core/Include")];
                vec![("", Ok(of(files, includes, &[])))]
            }
            Peer::EspNn => {
                let root = backend.join("esp_nn/vendor/esp_nn");
                let files = vec![own("esp_nn.c"), root.join("src/fully_connected/esp_nn_fully_connected_ansi.c")];
                vec![("", Ok(of(files, vec![root.join("include"), root.join("src/common")], &[])))]
            }
            Peer::BakeNn => {
                let form = |name: &str| {
                    let root = self.of_case(case).join(format!("bakenn-{name}"));
                    let files = ["bknn_net.c", "bknn_net_kernels.c", "bknn_net_weights.c"].map(|file| root.join(file));
                    of([own("bakenn.c")].into_iter().chain(files).collect(), vec![root], &[])
                };
                vec![("plain kernels, ", Ok(form("plain"))), ("its fast kernels, ", Ok(form(core.bakenn)))]
            }
            Peer::Emlearn => vec![("", Ok(of(vec![own("emlearn.c")], vec![self.packages.join("emlearn")], &[])))],
            Peer::RlTools => {
                let include = self.packages.join("rltools/external/rl_tools/include");
                let gru: &[&str] = if case.function.is_none() { &["-DGRU"] } else { &[] };
                let flags =
                    [&["-std=gnu++17", "-fno-exceptions", "-fno-rtti", "-fno-threadsafe-statics"], gru].concat();
                vec![("", Ok(of(vec![own("rltools.cpp")], vec![include], &flags)))]
            }
            Peer::EmbeddedNn | Peer::MicroFlow => {
                let form = |level| {
                    let library = self.rust_library(peer, core, case, level)?;
                    Ok(Sources { linked: vec![library], ..of(vec![own("data.c")], vec![], &[]) })
                };
                vec![("rustc -O3, ", form("3")), ("rustc -O2, ", form("2")), ("rustc -Os, ", form("\"s\""))]
            }
            Peer::Actq(width) => vec![("", self.own_image(core, case, width))],
        };
        let mut programs = Vec::new();
        for (name, sources) in forms {
            match sources {
                Err(error) => programs.push((name.to_owned(), Err(error), vec!["gcc"])),
                Ok(sources) => {
                    for options in peer.builds() {
                        programs.push((format!("{name}{}", options.join(" ")), Ok(sources.clone()), options));
                    }
                }
            }
        }
        Ok(programs)
    }

    /// Builds our library for an image with what this image needs.
    fn own_image(&self, core: &Core, case: &Case, width: Width) -> Result<Sources> {
        let for_core = emit::Core::of_name(core.name);
        let bytes = repack(&case.quantized(width)?.0.image, for_core.context("no layout for this core")?)?;
        let folder = self.folder.join("actq");
        let _ = fs::remove_dir_all(&folder);
        fs::create_dir_all(&folder)?;
        let file = folder.join("image.actq");
        fs::write(&file, &bytes)?;
        let buffer = ImageBuffer::new(&bytes);
        let image = buffer.image(&file)?;
        let mut sources = core.library(&image, &folder.join("package"))?;
        sources.files.push(harness().join("actq.c"));
        sources.includes.push(self.of_case(case));
        // The C interface has one word more than the kernels.
        let scratch = image.scratch_words() + 1;
        sources.flags = vec![
            format!("-DIMAGE=\"{}\"", file.display()),
            format!("-DIMAGE_BYTES={}", bytes.len()),
            format!("-DSCRATCH={scratch}"),
        ];
        Ok(sources)
    }

    /// Builds a static library of a crate with its part of the harness.
    fn rust_library(&self, peer: Peer, core: &Core, case: &Case, level: &str) -> Result<PathBuf> {
        let (file, dependencies) = match peer {
            Peer::EmbeddedNn => ("embedded_nn.rs", "embedded-nn = { version = \"=0.2.3\", default-features = false }"),
            Peer::MicroFlow => ("microflow.rs", MICROFLOW),
            _ => bail!("no crate"),
        };
        let folder = self.folder.join("crate");
        fs::create_dir_all(&folder)?;
        let source = fs::read_to_string(harness().join(file))?;
        let source = source
            .replace("@MODEL@", &self.of_case(case).join("model.tflite").display().to_string())
            .replace("@INPUTS@", &case.inputs().to_string())
            .replace("@OUTPUTS@", &case.outputs().to_string())
            .replace("@LAYERS@", &(case.lengths.len() - 1).to_string())
            .replace("@WIDEST@", &case.lengths[1..].iter().max().unwrap_or(&0).to_string());
        fs::write(folder.join("lib.rs"), source)?;
        let manifest = format!(
            "[package]\nname = \"peer\"\nversion = \"0.0.0\"\nedition = \"2024\"\n\n[workspace]\n\n[lib]\npath = \"lib.rs\"\n\
             crate-type = [\"staticlib\"]\n\n[dependencies]\n{dependencies}\n\n[profile.release]\nopt-level = {level}\n\
             lto = \"fat\"\ncodegen-units = 1\npanic = \"abort\"\n"
        );
        fs::write(folder.join("Cargo.toml"), manifest)?;
        let (triple, flags) = core.rust;
        let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
        cargo.current_dir(&folder).args(["build", "--quiet", "--release", "--target", triple]);
        run(cargo.env("RUSTFLAGS", flags).env("CARGO_TARGET_DIR", folder.join("target")))?;
        // The next build has the same name.
        let library = folder.join(format!("libpeer-{}.a", level.trim_matches('"')));
        fs::copy(folder.join("target").join(triple).join("release/libpeer.a"), &library)?;
        Ok(library)
    }
}
