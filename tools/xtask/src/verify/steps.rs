//! The steps of `cargo verify`.

use std::process::Command;

use actq_boards::{Target, root};

use crate::setup::cargo;
use crate::{PROFILE, firmware, python, setup, wasm};

/// The oldest supported compiler.
const OLDEST: &str = concat!(env!("CARGO_PKG_RUST_VERSION"), ".0");

/// A host target with 32-bit words that runs on x86-64 Linux. `.cargo/config.toml` has its linker.
const TARGET_32_BIT: &str = "i686-unknown-linux-musl";

/// The packages built only for boards.
const FIRMWARE: [&str; 2] = ["actq-firmware-support", "actq-firmware-bench"];
/// The application; its board-independent parts are built and tested on the host.
const APPLICATION: &str = "actq-firmware-demo";
/// The head in user firmware.
const STYLES: &str = "actq-firmware-styles";
/// The check of the C header, whose generator takes long to build.
const C_HEADER: &str = "actq-capi-header";

/// The tests in QEMU beyond the smoke run, a module of `host-tests/tests/all`.
const ON_TARGET: &str = "on_target::";
/// The tests that only `cargo verify --all` runs: these, and those that learn for long.
const SKIPPED_TESTS: [&str; 4] = ["--skip", ON_TARGET, "--skip", "learning::"];

/// A command with a name.
pub(super) struct Step {
    pub(super) name: String,
    /// The command, or why it cannot run.
    pub(super) command: Result<Command, String>,
    /// Runs beside the steps after it: most of its time only one core is busy, with the linker or QEMU.
    pub(super) is_beside: bool,
}

/// Requirements besides targets and QEMU: for each, why it is missing.
pub(super) struct Installed {
    /// The oldest supported compiler.
    pub(super) oldest: Result<(), String>,
    /// A host target with 32-bit words.
    pub(super) narrow: Result<(), String>,
    /// Python, for its package.
    pub(super) python: Result<(), String>,
    /// The target of browsers and Node.
    pub(super) wasm: Result<(), String>,
}

impl Installed {
    /// Installs the compilers if possible.
    pub(super) fn ensure() -> Self {
        let narrow = match cfg!(all(target_arch = "x86_64", target_os = "linux")) {
            true => setup::rust_target(TARGET_32_BIT).map_err(|error| format!("{error:#}")),
            false => Err(format!("this machine does not run {TARGET_32_BIT}")),
        };
        let wasm = setup::rust_target(wasm::TARGET).map_err(|error| format!("{error:#}"));
        Self { oldest: setup::toolchain(OLDEST), narrow, python: python::interpreter().map(drop), wasm }
    }
}

/// Returns the steps of the short run.
pub(super) fn short() -> Vec<Step> {
    let mut steps = Steps::default();
    steps.format_and_lints();
    steps.add("tests", &[&TESTS[..], &["--"], &SKIPPED_TESTS].concat());
    steps.0
}

pub(super) fn all(installed: Installed) -> Vec<Step> {
    let mut steps = Steps::default();
    steps.format_and_lints();
    let tests = tests();
    steps.add("build of the tests", &[&tests[..], &["--no-run"]].concat());
    steps.add_beside("tests on the boards", &[&tests[..], &["--test", "all", "--", ON_TARGET]].concat());
    steps.add_beside("budgets", &["run", "--profile", PROFILE, "--package", "actq-bench", "--", "budgets"]);
    steps.add_beside("faults on the line", &["run", "--profile", PROFILE, "--package", "actq-bench", "--", "faults"]);
    steps.add("tests", &[&tests[..], &["--", "--skip", ON_TARGET]].concat());
    steps.least_kernels();
    steps.board_lints();
    steps.application_lints();
    steps.documentation();
    let publish = ["publish", "--workspace", "--dry-run", "--no-verify", "--allow-dirty", "--locked"];
    steps.add("crates to publish", &publish);
    let python = ["run", "--profile", PROFILE, "--package", "xtask", "--", "python"];
    steps.add_if(installed.python, "Python package", cargo(), &python);
    let wasm = ["clippy", "--package", "actq-wasm", "--target", wasm::TARGET, "--profile", "wasm"];
    steps.add_if(installed.wasm.clone(), "lints of the WebAssembly module", cargo(), &[&wasm[..], &DENY].concat());
    let wasm = ["run", "--profile", PROFILE, "--package", "xtask", "--", "wasm", "--check"];
    steps.add_if(installed.wasm, "WebAssembly module", cargo(), &wasm);
    let kernels =
        ["test", "--profile", PROFILE, "--package", "actq-kernels", "--features", "writer", "--target", TARGET_32_BIT];
    steps.add_if(installed.narrow, "kernels' tests with words of 32 bits", cargo(), &kernels);
    let check = [&["run", OLDEST, "cargo", "check", "--profile", PROFILE], &host_packages()[..]].concat();
    steps.add_if(installed.oldest, &format!("oldest compiler, {OLDEST}"), Command::new("rustup"), &check);
    steps.0
}

const TESTS: [&str; 4] = ["test", "--profile", PROFILE, "--no-fail-fast"];
const DENY: [&str; 3] = ["--", "-D", "warnings"];

/// Returns all packages for the host, without those built only for boards, and without one that takes long to build.
fn host_packages() -> Vec<&'static str> {
    let [support, benches] = FIRMWARE;
    vec!["--workspace", "--exclude", support, "--exclude", benches, "--exclude", C_HEADER]
}

/// Returns the command of all tests: with one selection of packages, cargo builds each crate with one set of features.
fn tests() -> Vec<&'static str> {
    let [support, benches] = FIRMWARE;
    let excluded = ["--exclude", support, "--exclude", benches, "--exclude", STYLES, "--exclude", "actq-python"];
    [&TESTS[..], &["--workspace"], &excluded].concat()
}

fn build_for(target: Target) -> [&'static str; 4] {
    ["--target", target.triple(), "--profile", target.profile()]
}

#[derive(Default)]
struct Steps(Vec<Step>);

impl Steps {
    /// Adds a cargo command with variables of its environment.
    fn add_with(&mut self, name: &str, arguments: &[&str], environment: &[(&str, &str)]) {
        let mut command = cargo();
        command.current_dir(root()).args(arguments).envs(environment.iter().copied());
        self.0.push(Step { name: name.to_owned(), command: Ok(command), is_beside: false });
    }

    fn add(&mut self, name: &str, arguments: &[&str]) {
        self.add_with(name, arguments, &[]);
    }

    fn add_beside(&mut self, name: &str, arguments: &[&str]) {
        self.add(name, arguments);
        self.0.last_mut().expect("the added step").is_beside = true;
    }

    /// Adds a command that reads the firmware without running it, with a valid image for it to include.
    fn add_of_firmware(&mut self, name: &str, arguments: &[&str], environment: &[(&str, &str)]) {
        let image = root().join("kernels/tests/valid.actq").display().to_string();
        self.add_with(name, arguments, &[environment, &[("ACTQ_IMAGE", &image)]].concat());
    }

    /// Adds a command that needs what may be missing.
    fn add_if(&mut self, installed: Result<(), String>, name: &str, program: Command, arguments: &[&str]) {
        let command = installed.map(|()| {
            let mut command = program;
            command.current_dir(root()).args(arguments);
            command
        });
        self.0.push(Step { name: name.to_owned(), command, is_beside: false });
    }

    /// Adds lints and a test of the kernels with the features that every build has.
    fn least_kernels(&mut self) {
        let least = ["--profile", PROFILE, "--package", "actq-kernels", "--no-default-features"];
        self.add("lints of the least kernels", &[&["clippy", "--all-targets"], &least[..], &DENY].concat());
        self.add("test of the least kernels", &[&["test"], &least[..], &["--lib", "--test", "left_out"]].concat());
    }

    fn format_and_lints(&mut self) {
        self.add("format", &["fmt", "--all", "--check"]);
        let arguments = [&["clippy", "--all-targets", "--profile", PROFILE], &host_packages()[..], &DENY].concat();
        self.add_of_firmware("lints", &arguments, &[]);
        let kernels =
            [&["clippy", "--all-targets", "--profile", PROFILE, "--package", "actq-kernels"], &DENY[..]].concat();
        self.add("lints of the kernels without features", &kernels);
    }

    /// Adds the lints of the measuring firmware, for every target but those that compile the sources of another one.
    fn board_lints(&mut self) {
        let same = [Target::M7, Target::F405, Target::RiscvZb];
        for target in Target::ALL.into_iter().filter(|target| !same.contains(target)) {
            let mut arguments = [&["clippy"], &build_for(target)[..]].concat();
            arguments.extend(["--package", "actq-kernels"]);
            arguments.extend(FIRMWARE.iter().flat_map(|name| ["--package", name]));
            arguments.extend(["--lib", "--bin", "harness"]);
            arguments.extend(target.board().binaries.iter().flat_map(|binary| ["--bin", binary]));
            arguments.extend(["--features", target.feature().unwrap_or_default()]);
            arguments.extend(DENY);
            self.add_of_firmware(
                &format!("lints of the firmware, {target:?}"),
                &arguments,
                target.rustflags().as_slice(),
            );
        }
    }

    /// Adds the lints of the application with all its features, for every board, and of the other firmware styles.
    fn application_lints(&mut self) {
        let programs = ["--lib", "--bin", "controller", "--features"];
        // Any 64 digits will do.
        let digits = "0".repeat(64);
        let key = ("ACTQ_PUBLIC_KEY", digits.as_str());
        for (target, _) in firmware::boards() {
            let name = target.board().name;
            let features =
                [name, "defmt-rtt", "faults", "signed"].map(|feature| format!("{APPLICATION}/{feature}")).join(",");
            let packages = ["--package", APPLICATION, "--package", "actq-boards"];
            let arguments = [&["clippy"], &build_for(target)[..], &packages, &programs, &[&features], &DENY].concat();
            let environment: Vec<_> = target.rustflags().into_iter().chain([key]).collect();
            self.add_of_firmware(&format!("lints of the application, {name}"), &arguments, &environment);
        }
        let fpu = build_for(Target::Fpu);
        let features = ["mps2-an386,tick-8khz,foc"];
        let arguments = [&["clippy", "--package", APPLICATION], &fpu[..], &programs, &features, &DENY].concat();
        self.add_of_firmware("lints of the application's other features", &arguments, &[]);
        let styles = [&["clippy", "--package", STYLES, "--lib", "--bins"], &fpu[..], &DENY].concat();
        self.add_of_firmware("lints of the styles", &styles, &[]);
        let defmt = [&["clippy", "--package", "actq-kernels", "--features", "defmt"], &fpu[..], &DENY].concat();
        self.add("optional features", &defmt);
    }

    fn documentation(&mut self) {
        let deny = [("RUSTDOCFLAGS", "-D warnings")];
        let host =
            [&["doc", "--no-deps", "--profile", PROFILE], &host_packages()[..], &["--exclude", "xtask"]].concat();
        self.add_of_firmware("documentation", &host, &deny);
        let kernels = ["doc", "--no-deps", "--profile", PROFILE, "--package", "actq-kernels"];
        self.add_with("documentation of the kernels without features", &kernels, &deny);
        let firmware = FIRMWARE.map(|name| ["--package", name]).concat();
        let firmware = [&["doc", "--no-deps"], &build_for(Target::Fpu)[..], &firmware].concat();
        self.add_of_firmware("documentation of the firmware", &firmware, &deny);
    }
}
