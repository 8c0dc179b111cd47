//! What CI checks. Every step runs, and all failures are reported at the end.

use std::fs;
use std::process::Command;
use std::time::{Duration, Instant};

use actq_boards::{Target, root};
use anyhow::{Context, Result, bail};

use crate::{cargo, cpu, firmware, setup};

/// CPU-minutes that all steps may take from a fresh clone; `ACTQ_VERIFY_CPU_MINUTES` sets another number on a slower
/// machine, or where more is tested.
const CPU_MINUTES: f64 = 28.0;
const CPU_MINUTES_VARIABLE: &str = "ACTQ_VERIFY_CPU_MINUTES";
/// Minutes that this takes on two idle cores.
const MINUTES: f64 = 20.0;

/// The oldest compiler.
const OLDEST: &str = concat!(env!("CARGO_PKG_RUST_VERSION"), ".0");

/// A host whose words have 32 bits, and that runs where the other one does. `.cargo/config.toml` has its linker.
const NARROW: &str = "i686-unknown-linux-musl";

/// The packages that are built for boards only.
const FIRMWARE: [&str; 2] = ["actq-firmware-support", "actq-firmware-bench"];
/// The application, of which the host builds and tests what is not of a board.
const APPLICATION: &str = "actq-firmware-demo";
/// The head in firmware of other styles.
const STYLES: &str = "actq-firmware-styles";

/// The tests that compare with tract, a reader of ONNX that takes minutes to build, and the variable that asks for
/// them.
const ONNX_TESTS: &str = "actq-onnx-tests";
const ONNX_VARIABLE: &str = "ACTQ_TRACT";

/// A command with a name.
struct Step {
    name: String,
    /// The command, or why it cannot be run.
    command: Result<Command, String>,
}

enum Outcome {
    Ok,
    Failed,
    Skipped(String),
}

/// A step that has run.
struct Done {
    name: String,
    outcome: Outcome,
    took: Cost,
}

/// Time, and CPU time where the system tells it.
#[derive(Clone, Copy)]
struct Cost {
    wall: Duration,
    cpu: Option<Duration>,
}

impl Cost {
    fn text(self) -> String {
        let cpu = self.cpu.map_or_else(|| "-".to_owned(), |cpu| format!("{:.1}", cpu.as_secs_f64()));
        format!("{:8.1} {cpu:>8}", self.wall.as_secs_f64())
    }
}

/// Runs all steps.
pub(crate) fn run() -> Result<()> {
    let limit = match std::env::var(CPU_MINUTES_VARIABLE) {
        Ok(minutes) => {
            minutes.parse().with_context(|| format!("{CPU_MINUTES_VARIABLE} is {minutes:?}, not a number"))?
        }
        Err(_) => CPU_MINUTES,
    };
    println!(
        "verify: at most {limit} minutes of CPU, about {MINUTES} minutes on two idle cores, less where much is built"
    );
    setup::components()?;
    setup::ensure(&Target::ALL)?;
    let oldest = setup::toolchain(OLDEST);
    let narrow = match cfg!(all(target_arch = "x86_64", target_os = "linux")) {
        true => setup::rust_target(NARROW).map_err(|error| format!("{error:#}")),
        false => Err(format!("this machine does not run {NARROW}")),
    };
    // Where tests write what they skip.
    let skipped = std::env::temp_dir().join(format!("actq-skipped-{}", std::process::id()));
    let steps = steps(oldest, narrow, &skipped.to_string_lossy());
    let count = steps.len();
    let clock = Clock::start();
    let mut all = Vec::new();
    for (i, Step { name, command }) in steps.into_iter().enumerate() {
        let step = Clock::start();
        let outcome = match command {
            Ok(mut command) => {
                println!("\n== {}/{count} {name}: {}", i + 1, text(&command));
                match command.status().context("cargo cannot be started")?.success() {
                    true => Outcome::Ok,
                    false => Outcome::Failed,
                }
            }
            Err(why) => Outcome::Skipped(why),
        };
        let took = step.cost();
        let (seconds, so_far) = (took.wall.as_secs_f64(), clock.cost().wall.as_secs_f64() / 60.0);
        match &outcome {
            Outcome::Ok => println!("== {name}: ok in {seconds:.0} s, {so_far:.1} min so far"),
            Outcome::Failed => println!("== {name}: FAILED in {seconds:.0} s, {so_far:.1} min so far"),
            Outcome::Skipped(why) => println!("\n== {}/{count} {name}: SKIPPED: {why}", i + 1),
        }
        all.push(Done { name, outcome, took });
    }
    let tests = fs::read_to_string(&skipped).unwrap_or_default();
    let _ = fs::remove_file(&skipped);
    summary(&all, &tests, clock.cost(), limit)
}

/// The command as one types it.
fn text(command: &Command) -> String {
    let arguments: Vec<_> = command.get_args().map(|argument| argument.to_string_lossy()).collect();
    let program = command.get_program().to_string_lossy();
    let name = if program.ends_with("rustup") { "rustup" } else { "cargo" };
    format!("{name} {}", arguments.join(" "))
}

fn steps(oldest: Result<(), String>, narrow: Result<(), String>, skipped: &str) -> Vec<Step> {
    let mut steps = Vec::new();
    let mut add = |name: &str, arguments: &[&str], environment: &[(&str, &str)]| {
        let mut command = cargo();
        command.current_dir(root()).args(arguments).envs(environment.iter().copied());
        steps.push(Step { name: name.to_owned(), command: Ok(command) });
    };
    // One profile for all that is built for the host.
    let host = ["--profile", "host"];
    let [support, benches] = FIRMWARE;
    let all_but_firmware = ["--workspace", "--exclude", support, "--exclude", benches, "--exclude", ONNX_TESTS];
    // The firmware includes an image by path. Lints and documentation do not run it, so any file will do for them.
    let any_file = root().join("Cargo.toml").display().to_string();
    let image = ("ACTQ_IMAGE", any_file.as_str());
    let packages = [&["--package", "actq-kernels"][..], &FIRMWARE.map(|name| ["--package", name]).concat()].concat();
    let deny = ["--", "-D", "warnings"];
    let deny_in_documentation = ("RUSTDOCFLAGS", "-D warnings");

    add("format", &["fmt", "--all", "--check"], &[]);
    add("lints", &[&["clippy", "--all-targets"], &host[..], &all_but_firmware, &deny].concat(), &[]);
    for target in Target::ALL {
        let mut arguments = vec!["clippy", "--target", target.triple(), "--profile", target.profile()];
        arguments.extend(&packages);
        arguments.extend(["--lib", "--bin", "harness"]);
        arguments.extend(target.board().shows.iter().flat_map(|binary| ["--bin", binary]));
        arguments.extend(["--features", target.feature().unwrap_or_default()]);
        arguments.extend(deny);
        add(&format!("lints of the firmware, {target:?}"), &arguments, &[image]);
    }
    for (target, _) in firmware::boards() {
        let build = ["--target", target.triple(), "--profile", target.profile()];
        let what = ["--package", APPLICATION, "--package", "actq-boards", "--lib", "--bin", "controller", "--features"];
        let name = target.board().name;
        let features = [name, "defmt-rtt", "faults"].map(|feature| format!("{APPLICATION}/{feature}")).join(",");
        let arguments = [&["clippy"][..], &build, &what, &[&features], &deny].concat();
        add(&format!("lints of the application, {name}"), &arguments, &[image]);
    }
    let fpu = ["--target", Target::Fpu.triple(), "--profile", Target::Fpu.profile()];
    let other = ["clippy", "--package", APPLICATION, "--lib", "--bin", "controller", "--features"];
    let other = [&other[..], &["mps2-an386,tick-8khz,foc,signed"], &fpu, &deny].concat();
    // Any digits will do.
    let digits = "0".repeat(64);
    add("lints of the application's other features", &other, &[image, ("ACTQ_PUBLIC_KEY", &digits)]);
    let host_features = ["test", "--package", APPLICATION, "--lib", "--features", "foc"];
    add("tests of the application's current loop", &[&host_features[..], &host].concat(), &[]);
    let styles = ["clippy", "--package", STYLES, "--lib", "--bins"];
    add("lints of the styles", &[&styles[..], &fpu, &deny].concat(), &[image]);
    let defmt = ["clippy", "--package", "actq-kernels", "--features", "defmt"];
    add("optional features", &[&defmt[..], &fpu, &deny].concat(), &[]);
    let doc = ["doc", "--no-deps"];
    let documented = [&doc[..], &host, &all_but_firmware, &["--exclude", "xtask"]].concat();
    add("documentation", &documented, &[deny_in_documentation]);
    add("documentation of the firmware", &[&doc[..], &fpu, &packages].concat(), &[deny_in_documentation, image]);
    add("tests", &[&["test", "--no-fail-fast"], &host[..]].concat(), &[("ACTQ_SKIPPED", skipped)]);
    add("budgets", &[&["run"], &host[..], &["--package", "actq-bench", "--", "budgets"]].concat(), &[]);

    // By itself: what it shows is a matter of time.
    add("faults on the line", &[&["run"], &host[..], &["--package", "actq-bench", "--", "faults"]].concat(), &[]);

    let asked = std::env::var_os(ONNX_VARIABLE).is_some_and(|value| !value.is_empty());
    let command = asked.then(|| {
        let mut command = cargo();
        command.current_dir(root()).args(["test", "--package", ONNX_TESTS]).args(host).env("ACTQ_SKIPPED", skipped);
        command
    });
    let why = format!("{ONNX_VARIABLE} is not set: tract takes minutes to build");
    steps.push(Step { name: "ONNX files against tract".to_owned(), command: command.ok_or(why) });
    let command = narrow.map(|()| {
        let mut command = cargo();
        command.current_dir(root()).args(["test", "--package", "actq-kernels", "--target", NARROW]).args(host);
        command
    });
    steps.push(Step { name: "kernels' tests with words of 32 bits".to_owned(), command });
    let command = oldest.map(|()| {
        let mut command = Command::new("rustup");
        command.current_dir(root()).args(["run", OLDEST, "cargo", "check"]).args(host).args(all_but_firmware);
        command
    });
    steps.push(Step { name: format!("oldest compiler, {OLDEST}"), command });
    steps
}

/// Prints what was done; an error where a step failed, or all took too long.
fn summary(all: &[Done], tests: &str, took: Cost, limit: f64) -> Result<()> {
    let name_width = all.iter().map(|done| done.name.len()).max().unwrap_or(0);
    println!("\n{:name_width$}  result   seconds      CPU", "step");
    for Done { name, outcome, took } in all {
        let (result, why) = match outcome {
            Outcome::Ok => ("ok", ""),
            Outcome::Failed => ("FAILED", ""),
            Outcome::Skipped(why) => ("SKIPPED", why.as_str()),
        };
        println!("{name:name_width$}  {result:7} {} {}", took.text(), why);
    }
    println!("{:name_width$}          {}", "all", took.text());

    let mut tests: Vec<&str> = tests.lines().collect();
    tests.sort_unstable();
    tests.dedup();
    let steps_skipped = all.iter().filter(|done| matches!(done.outcome, Outcome::Skipped(_))).count();
    if !tests.is_empty() {
        println!("\n{}", tests.join("\n"));
    }
    println!("\nskipped: {steps_skipped} steps, {} tests or parts of tests", tests.len());
    let wall = took.wall.as_secs_f64() / 60.0;
    let cpu = took.cpu.map(|cpu| cpu.as_secs_f64() / 60.0);
    match cpu {
        Some(cpu) => {
            println!("{wall:.1} minutes (about {MINUTES} from a fresh clone), {cpu:.1} of CPU (at most {limit})")
        }
        None => println!("{wall:.1} minutes (about {MINUTES} from a fresh clone); this system does not tell CPU time"),
    }
    let failed: Vec<&str> =
        all.iter().filter(|d| matches!(d.outcome, Outcome::Failed)).map(|d| d.name.as_str()).collect();
    if !failed.is_empty() {
        bail!("failed: {}", failed.join(", "));
    }
    if cpu.is_some_and(|cpu| cpu > limit) {
        bail!(
            "took more than {limit} minutes of CPU; {CPU_MINUTES_VARIABLE} sets another limit where the machine is slow"
        );
    }
    println!("all checks passed");
    Ok(())
}

/// Time since a moment.
struct Clock {
    start: Instant,
    cpu: Option<Duration>,
}

impl Clock {
    fn start() -> Self {
        Self { start: Instant::now(), cpu: cpu::of_children() }
    }

    fn cost(&self) -> Cost {
        let cpu = cpu::of_children().zip(self.cpu).map(|(now, then)| now.saturating_sub(then));
        Cost { wall: self.start.elapsed(), cpu }
    }
}
