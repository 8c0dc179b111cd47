//! Sweeps as jobs: `actq plan`, `job`, `sweep --store` and `merge`, and the script for Slurm.
#![cfg(unix)]

use std::fs::{self, File};
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::thread::sleep;
use std::time::Duration;

use actq::data::NpzWriter;
use actq::runtime::ImageBuffer;
use actq_bench::command::{actq, binary, failed, run, succeeded};
use actq_bench::root;
use actq_testkit::snapshot;
use anyhow::{Context as _, Result, ensure};
use serde_json::Value;
use tempfile::TempDir;

use super::fixture::{Fixture, OBS};

/// A simulator of short episodes, whose observations depend on the seed.
const SIMULATOR: &str = r#"
last=$((ACTQ_SEED + ACTQ_EPISODES))
seed=$ACTQ_SEED
while [ $seed -lt $last ]; do
    printf R
    for step in 1 2 3 4 5 6 7 8 9 10; do
        value="\\$(printf %03o $(((7 * seed + step) % 100)))\\000\\200\\077"
        four=$value$value$value$value
        printf "S$four$four$four$four$four$four$four$four$four$four"
    done
    seed=$((seed + 1))
done | sh -c "$POLICY_CMD" > /dev/null
echo "{\"episodes\": $ACTQ_EPISODES, \"success\": 0.5}"
"#;

const SPEC: &str = r#"
policies = ["policy"]
methods = ["rtn", "distill"]
bpw = [4, 5]
steps = 2

[drive]
command = "sh simulator.sh"
files = ["simulator.sh"]
episodes = 4
first_seed = 100
per_job = 2

[learn]
rounds = 1
episodes = 1
first_seed = 10
"#;

/// A policy with a recording long enough to learn from, a simulator, and a spec; commands run beside them.
struct Sweep(Fixture);

impl Sweep {
    fn new() -> Result<Self> {
        let sweep = Self(Fixture::with_long_recording()?);
        fs::write(sweep.folder()?.join("simulator.sh"), SIMULATOR)?;
        fs::write(sweep.folder()?.join("sweep.toml"), SPEC)?;
        Ok(sweep)
    }

    fn folder(&self) -> Result<std::path::PathBuf> {
        Ok(self.0.policy().parent().context("a folder")?.to_owned())
    }

    fn command(&self, line: &str) -> Result<Command> {
        let mut command = actq(&line.split_whitespace().collect::<Vec<_>>());
        command.current_dir(self.folder()?);
        Ok(command)
    }

    fn run(&self, line: &str, input: &str) -> Result<Output> {
        run(self.command(line)?, input.as_bytes())
    }

    /// The names and contents of a store's files; hidden ones are those of killed processes.
    fn store(&self, name: &str) -> Result<Vec<(String, Option<Vec<u8>>)>> {
        let file_name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let files = snapshot(&self.folder()?.join(name))?.into_iter().map(|(path, file)| (file_name(&path), file));
        Ok(files.filter(|(name, _)| !name.starts_with('.')).collect())
    }
}

/// Checks the frontier in the report of an image of the store `whole`.
fn report_shows_the_sweep(sweep: &Sweep, merged: &Value) -> Result<()> {
    let folder = sweep.folder()?;
    let images = merged["policies"][0]["images"].as_array().context("no images")?;
    let own = images.iter().find(|image| !image["made"]["driven"].is_null()).context("no driven image")?;
    let address = own["address"].as_str().context("no address")?;
    succeeded(&sweep.run(&format!("report whole/{address}.actq --store whole --out report.html --quiet"), "")?)?;
    let page = fs::read_to_string(folder.join("report.html"))?;
    let data = page.split_once("id=\"data\">").and_then(|(_, rest)| rest.split_once("</script>")).context("no data")?;
    let data: Value = serde_json::from_str(data.0)?;
    let shown = data["sweep"]["images"].as_array().context("no sweep")?;
    let made: Vec<&Value> = images.iter().map(|image| &image["made"]).filter(|made| !made.is_null()).collect();
    let figures = |bytes: &Value, nmse: &Value| (bytes.as_u64(), nmse.as_f64());
    let expected: Vec<_> = made.iter().map(|made| figures(&made["image"]["bytes"], &made["nmse"])).collect();
    assert_eq!(shown.iter().map(|one| figures(&one["bytes"], &one["nmse"])).collect::<Vec<_>>(), expected);
    let marked: Vec<&Value> = shown.iter().filter(|one| one["is_own"] == true).collect();
    ensure!(!marked.is_empty() && marked.iter().all(|one| one["bytes"] == own["made"]["image"]["bytes"]), "{marked:?}");
    assert_eq!(
        (&data["success"][1], &data["success"][2]),
        (&own["made"]["driven"]["episodes"], &own["made"]["interval"])
    );
    // An outcome beside the recording of a rollout that names this image; without it, and beside that of another image.
    fs::write(folder.join("outcome.json"), "{\"success\": 0.25, \"episodes\": 8}\n")?;
    fs::write(folder.join("none.json"), "{\"reward\": 1}\n")?;
    let path = folder.join(format!("whole/{address}.actq"));
    let crc = ImageBuffer::read(&path)?.image(&path)?.crc();
    for (name, crc) in [("own.npz", crc), ("other.npz", crc ^ 1)] {
        let mut npz = NpzWriter::new(File::create(folder.join(name))?);
        npz.array("obs", &[1, 20, OBS], (0..20 * OBS).map(|i| (0.7 * i as f64).sin()))?;
        npz.array("crc32", &[], [i64::from(crc)])?;
        npz.finish()?;
    }
    let line = |file: &str, beside: &str| {
        let driven = format!("--driven {file} {beside}");
        format!("report whole/{address}.actq --policy policy {driven} --out driven.html --quiet")
    };
    failed(&sweep.run(&line("none.json", "--driven own.npz"), "")?, 1, &["none.json", "episodes"])?;
    failed(&sweep.run(&line("outcome.json", ""), "")?, 1, &["outcome.json", "--driven FILE.npz"])?;
    failed(&sweep.run(&line("outcome.json", "--driven other.npz"), "")?, 1, &["other.npz", "another image"])?;
    failed(&sweep.run(&line("policy/heldout.npz", ""), "")?, 1, &["heldout.npz", "names no image"])?;
    succeeded(&sweep.run(&line("outcome.json", "--driven own.npz"), "")?)?;
    ensure!(fs::read_to_string(folder.join("driven.html"))?.contains("\"success\":[0.25,8,["), "no success");
    Ok(())
}

/// Counts the results in a store.
fn results(store: &Path) -> usize {
    let names = fs::read_dir(store).into_iter().flatten().flatten().map(|entry| entry.file_name());
    names.filter(|name| name.to_string_lossy().ends_with(".json") && name != "store.json").count()
}

#[test]
fn damaged_results_are_named_and_made_again() -> Result<()> {
    let sweep = Sweep::new()?;
    let spec = "policies = [\"policy\"]\nmethods = [\"rtn\"]\nbpw = [4, 5]\n";
    fs::write(sweep.folder()?.join("sweep.toml"), spec)?;
    let table = succeeded(&sweep.run("sweep sweep.toml --store whole --quiet", "")?)?;
    let whole = sweep.store("whole")?;
    let folder = sweep.folder()?.join("whole");
    for key in ["\"bytes\":", "\"cycles\":", "\"bpw\":", ""] {
        let (name, content) = whole
            .iter()
            .filter_map(|(name, content)| Some((name, content.as_ref()?)))
            .find(|(name, content)| match key {
                "" => name.ends_with(".actq"),
                _ => String::from_utf8_lossy(content).contains(key),
            })
            .context("no such result")?;
        let mut damaged = content.clone();
        match key {
            "" => damaged.truncate(damaged.len() / 2),
            _ => {
                let at = String::from_utf8_lossy(content).find(key).context("no such key")? + key.len();
                damaged[at] = if damaged[at] == b'7' { b'8' } else { b'7' };
            }
        }
        fs::write(folder.join(name), damaged)?;
        let merge = sweep.run("merge sweep.toml --store whole", "")?;
        failed(&merge, 1, &[name, "is damaged", "1 result damaged; run `actq sweep sweep.toml"])?;
        ensure!(merge.stdout.is_empty(), "a damaged result is shown");
        let missing = sweep.run("plan sweep.toml --missing whole", "")?;
        ensure!(succeeded(&missing)?.lines().count() == 1, "its job is missing");
        let again = sweep.run("sweep sweep.toml --store whole --quiet", "")?;
        ensure!(String::from_utf8_lossy(&again.stderr).contains(&format!("{name}: is damaged")));
        ensure!(succeeded(&again)? == table && sweep.store("whole")? == whole, "{key}");
    }
    Ok(())
}

#[test]
fn interrupted_sweeps_resume_to_the_same_store() -> Result<()> {
    let sweep = Sweep::new()?;
    let plan = succeeded(&sweep.run("plan sweep.toml", "")?)?;
    let jobs = plan.lines().count();
    let table = succeeded(&sweep.run("sweep sweep.toml --store whole --threads 1 --quiet --json whole.json", "")?)?;
    ensure!(table.contains("distill, round 1") && table.contains("0.500"), "{table}");
    ensure!(results(&sweep.folder()?.join("whole")) == jobs, "one result a job");
    let merged = succeeded(&sweep.run("merge sweep.toml --store whole --json merged.json", "")?)?;
    ensure!(merged == table, "{merged}");
    let read = |name: &str| -> Result<Vec<u8>> { Ok(fs::read(sweep.folder()?.join(name))?) };
    ensure!(read("merged.json")? == read("whole.json")?);
    report_shows_the_sweep(&sweep, &serde_json::from_slice(&read("merged.json")?)?)?;
    // `merge` only reads, also where the plan's last job has no result.
    let last: Value = serde_json::from_str(plan.lines().last().context("an empty plan")?)?;
    let address = last["address"].as_str().context("no address")?;
    fs::remove_file(sweep.folder()?.join("whole").join(format!("{address}.json")))?;
    ensure!(succeeded(&sweep.run("merge sweep.toml --store whole", "")?)? == table, "without the merge's result");
    ensure!(results(&sweep.folder()?.join("whole")) == jobs - 1, "merge wrote a result");
    succeeded(&sweep.run("sweep sweep.toml --store whole --quiet", "")?)?;

    // Killed several times, each after one result more, by signals that it can and cannot catch.
    let store = sweep.folder()?.join("killed");
    for signal in ["KILL", "TERM", "INT", "KILL"] {
        let before = results(&store);
        let mut child = sweep
            .command("sweep sweep.toml --store killed --threads 2 --quiet")?
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()?;
        while results(&store) <= before && child.try_wait()?.is_none() {
            sleep(Duration::from_millis(2));
        }
        Command::new("kill").args([&format!("-{signal}"), &child.id().to_string()]).stderr(Stdio::null()).status()?;
        child.wait()?;
    }
    failed(
        &sweep.run("merge sweep.toml --store killed", "")?,
        1,
        &["jobs have no result yet; run `actq sweep sweep.toml"],
    )
    .or_else(|error| if results(&store) == jobs { Ok(()) } else { Err(error) })?;
    // The plan as a file gives the same.
    fs::write(sweep.folder()?.join("plan.jsonl"), &plan)?;
    let again = succeeded(&sweep.run("sweep plan.jsonl --store killed --threads 2 --quiet --log log.jsonl", "")?)?;
    ensure!(again == table, "{again}");
    ensure!(sweep.store("killed")? == sweep.store("whole")?, "the stores differ");
    // Nothing is left to do.
    let path = sweep.folder()?.join("log.jsonl");
    // No file, if the sweep had ended before it was killed.
    let log = || fs::read_to_string(&path).unwrap_or_default();
    let before = log();
    succeeded(&sweep.run("sweep sweep.toml --store killed --quiet --log log.jsonl", "")?)?;
    ensure!(log() == before);
    Ok(())
}

/// The options of a command line are a spec: with a store they resume, and without one nothing stays.
#[test]
fn options_are_a_spec_in_memory() -> Result<()> {
    let sweep = Sweep::new()?;
    let line = "sweep policy --methods rtn,distill --bpw 4,5 --steps 2 --quiet --json";
    let table = succeeded(&sweep.run(&format!("{line} a.json"), "")?)?;
    let kept = succeeded(&sweep.run(&format!("{line} b.json --store store --threads 1 --log log"), "")?)?;
    ensure!(kept == table && table.contains("5 bits"), "{kept}");
    let json = |name: &str| -> Result<Value> { Ok(serde_json::from_slice(&fs::read(sweep.folder()?.join(name))?)?) };
    ensure!(json("a.json")? == json("b.json")?);
    // Two methods at two budgets, each made and measured, and the merge.
    ensure!(results(&sweep.folder()?.join("store")) == 9);
    let log = fs::read(sweep.folder()?.join("log"))?;
    ensure!(succeeded(&sweep.run(&format!("{line} c.json --store store --log log"), "")?)? == table);
    ensure!(fs::read(sweep.folder()?.join("log"))? == log, "a job with a result ran again");
    // No output replaces what the jobs read, or a file of the store.
    let policy = fs::read(sweep.folder()?.join("policy/policy.json"))?;
    let log = format!("{line} d.json --store store --log policy/policy.json");
    failed(&sweep.run(&log, "")?, 1, &["is the same file as", "an input"])?;
    fs::write(sweep.folder()?.join("one.toml"), "policies = [\"policy\"]\nmethods = [\"rtn\"]\nbpw = [4]\n")?;
    let same = format!("{line} new.json --store store --log new.json");
    failed(&sweep.run(&same, "")?, 1, &["new.json: is the same file as new.json"])?;
    ensure!(!sweep.folder()?.join("new.json").exists(), "something was written");
    let over = sweep.run("sweep one.toml --store one --quiet --json policy/policy.json", "")?;
    failed(&over, 1, &["is the same file as", "an input"])?;
    ensure!(fs::read(sweep.folder()?.join("policy/policy.json"))? == policy, "the policy has changed");
    succeeded(&sweep.run("sweep one.toml --store one --quiet", "")?)?;
    failed(&sweep.run("merge one.toml --store one --json one/store.json", "")?, 1, &["store.json: is in the store"])?;
    succeeded(&sweep.run("merge one.toml --store one", "")?)?;
    // A spec of the same options has the same jobs; more budgets run in the same store.
    let spec = "policies = [\"policy\"]\nmethods = [\"rtn\", \"distill\"]\nbpw = [4, 5]\nsteps = 2\n";
    fs::write(sweep.folder()?.join("same.toml"), spec)?;
    ensure!(succeeded(&sweep.run("plan same.toml --missing store", "")?)?.is_empty());
    fs::write(sweep.folder()?.join("more.toml"), spec.replace("bpw", "flash = [\"1K\", \"8K\"]\nbpw"))?;
    let more = succeeded(&sweep.run("sweep more.toml --store store --quiet", "")?)?;
    ensure!(more.contains("1024 bytes") && more.contains("8192 bytes") && more.contains("5 bits"), "{more}");
    ensure!(results(&sweep.folder()?.join("store")) == 9 + 2 * 2 * 2 + 1);
    Ok(())
}

/// `sbatch` as a script that runs the array's tasks as processes, several at a time.
const SBATCH: &str = r#"#!/bin/sh
while [ $# -gt 0 ]; do
    case $1 in
        --array=0-*) last=${1#--array=0-} ;;
        --*) ;;
        *) break ;;
    esac
    shift
done
task=0
while [ $task -le $last ]; do
    SLURM_ARRAY_JOB_ID=1 SLURM_ARRAY_TASK_ID=$task SLURM_ARRAY_TASK_COUNT=$((last + 1)) SLURM_CPUS_PER_TASK=1 sh "$@" >&2 &
    task=$((task + 1))
    if [ $((task % 3)) = 0 ]; then wait; fi
done
wait
echo 1
"#;

#[test]
fn slurm_arrays_give_the_same_store() -> Result<()> {
    let sweep = Sweep::new()?;
    succeeded(&sweep.run("sweep sweep.toml --store whole --threads 1 --quiet", "")?)?;
    let bin = sweep.folder()?.join("bin");
    fs::create_dir(&bin)?;
    fs::write(bin.join("sbatch"), SBATCH)?;
    fs::set_permissions(bin.join("sbatch"), fs::Permissions::from_mode(0o755))?;
    std::os::unix::fs::symlink(binary()?, bin.join("actq"))?;
    let path = format!("{}:{}", bin.display(), std::env::var("PATH").unwrap_or_default());
    let mut script = Command::new("sh");
    script.arg(root().join("examples/slurm/sweep.sh")).args(["sweep.toml", "array/", "--partition=any"]);
    script.current_dir(sweep.folder()?).env("PATH", path);
    succeeded(&run(script, b"")?)?;
    ensure!(sweep.store("array")? == sweep.store("whole")?, "the stores differ");
    succeeded(&sweep.run("merge sweep.toml --store array", "")?)?;
    Ok(())
}

/// A task of an array whose jobs end with these statuses, in this order: whether it is queued again, and its status.
fn task_of(statuses: &[i32]) -> Result<(bool, Option<i32>)> {
    let dir = TempDir::new()?;
    let program = |name: &str, text: &str| -> Result<()> {
        fs::write(dir.path().join(name), format!("#!/bin/sh\n{text}\n"))?;
        Ok(fs::set_permissions(dir.path().join(name), fs::Permissions::from_mode(0o755))?)
    };
    program("actq", "read -r status; exit \"$status\"")?;
    program("scontrol", &format!("echo \"$@\" > {}", dir.path().join("queued").display()))?;
    let jobs = dir.path().join("jobs.jsonl");
    fs::write(&jobs, statuses.iter().map(|status| format!("{status}\n")).collect::<String>())?;
    let mut script = Command::new("sh");
    script.arg(root().join("examples/slurm/sweep.sh")).arg(&jobs).arg("store");
    script.env("PATH", format!("{}:{}", dir.path().display(), std::env::var("PATH").unwrap_or_default()));
    script.envs([("SLURM_ARRAY_JOB_ID", "1"), ("SLURM_ARRAY_TASK_ID", "0"), ("SLURM_ARRAY_TASK_COUNT", "1")]);
    let status = run(script, b"")?.status.code();
    Ok((dir.path().join("queued").exists(), status))
}

#[test]
fn slurm_tasks_that_may_succeed_are_queued_again() -> Result<()> {
    for (statuses, expected) in [
        (&[0, 0][..], (false, Some(0))),
        (&[0, 1], (false, Some(1))),
        (&[75, 0], (true, Some(75))),
        (&[137], (true, Some(75))),
        (&[1, 75], (true, Some(1))),
        (&[75, 1], (true, Some(1))),
        (&[], (false, Some(0))),
    ] {
        ensure!(task_of(statuses)? == expected, "{statuses:?}: {:?}", task_of(statuses)?);
    }
    Ok(())
}

#[test]
fn plans_without_a_merge_are_refused() -> Result<()> {
    let sweep = Sweep::new()?;
    let plan = succeeded(&sweep.run("plan sweep.toml", "")?)?;
    let (jobs, merge): (Vec<&str>, Vec<&str>) = plan.lines().partition(|line| !line.contains("\"kind\":\"merge\""));
    for (name, lines, why) in [
        ("none", jobs.clone(), "the plan has no job of kind merge"),
        ("several", [&jobs[..], &merge, &merge].concat(), "several jobs of kind merge"),
    ] {
        fs::write(sweep.folder()?.join("plan.jsonl"), lines.join("\n"))?;
        let output = sweep.run("sweep plan.jsonl --store unused", "")?;
        let stderr = String::from_utf8_lossy(&output.stderr);
        ensure!(output.status.code() == Some(1), "{name}: {output:?}");
        ensure!(stderr.contains(why) || stderr.contains("twice") || stderr.contains("same"), "{name}: {stderr}");
        ensure!(results(&sweep.folder()?.join("unused")) == 0, "{name}: it has run jobs");
    }
    Ok(())
}

#[test]
fn a_status_says_whether_another_try_helps() -> Result<()> {
    let sweep = Sweep::new()?;
    let plan = succeeded(&sweep.run("plan sweep.toml", "")?)?;
    let line = |kind: &str| {
        let is_kind = |line: &&str| line.contains(&format!("{{\"kind\":\"{kind}\"")) && line.contains("rtn at 5");
        plan.lines().find(is_kind).context("a job")
    };
    failed(&sweep.run("job - --store store", line("drive")?)?, 75, &["run that job first"])?;
    failed(&sweep.run("job - --store store", "{}")?, 1, &["standard input: is not one job"])?;
    // No file may grow: a stand-in for a full disk.
    let full = |line: &str| -> Result<Output> {
        let mut shell = Command::new("sh");
        let limited = format!("trap '' XFSZ; ulimit -f 0; exec '{}' job - --store store", binary()?.display());
        shell.args(["-c", &limited]).current_dir(sweep.folder()?);
        run(shell, line.as_bytes())
    };
    failed(&full(line("quantize")?)?, 75, &["cannot write the file"])?;
    ensure!(results(&sweep.folder()?.join("store")) == 0);
    let told = succeeded(&sweep.run("job - --store store --progress", line("quantize")?)?)?;
    let last: Value = serde_json::from_str(told.lines().last().context("lines")?)?;
    ensure!(last["cached"] == false && last["seconds"].is_f64(), "{last}");
    ensure!(succeeded(&sweep.run("job - --store store --progress", line("quantize")?)?)?.contains("\"cached\":true"));
    ensure!(results(&sweep.folder()?.join("store")) == 1);
    let with = |command: &str| -> Result<Output> {
        fs::write(sweep.folder()?.join("other.toml"), SPEC.replace("sh simulator.sh", command))?;
        let plan = succeeded(&sweep.run("plan other.toml", "")?)?;
        let is_drive = |line: &&str| line.contains("\"kind\":\"drive\"") && line.contains("rtn at 5");
        sweep.run("job - --store store", plan.lines().find(is_drive).context("a job")?)
    };
    failed(&with("exit 75")?, 75, &["the drive command failed", "exit 75"])?;
    failed(&with("exit 3")?, 1, &["the drive command failed", "exit 3"])?;
    failed(&with("kill -9 $$")?, 75, &["the drive command failed"])?;
    failed(&with("echo '{\\\"episodes\\\": 9}'")?, 1, &["ran 9 episodes instead of 2"])?;
    ensure!(results(&sweep.folder()?.join("store")) == 1);
    Ok(())
}

#[test]
fn failed_jobs_leave_the_other_results() -> Result<()> {
    let sweep = Sweep::new()?;
    fs::write(sweep.folder()?.join("broken.toml"), SPEC.replace("sh simulator.sh", "exit 75"))?;
    let output = sweep.run("sweep broken.toml --store store --tries 2 --quiet --log log.jsonl", "")?;
    // Each of the failed jobs may succeed later.
    failed(&output, 75, &["it is tried again", "no further try", "jobs failed, and", "the others have their results"])?;
    let log = fs::read_to_string(sweep.folder()?.join("log.jsonl"))?;
    let of = |kind: &str, status: &str| {
        log.lines().filter(|line| line.contains(&format!("\"{kind}\"")) && line.contains(status)).count()
    };
    // Two ranges of episodes of each of four images, and one to learn from of two of them, each two times.
    ensure!((of("drive", "\"status\":75"), of("quantize", "\"status\":0")) == (2 * (8 + 2), 4), "{log}");
    // One failure that every try repeats decides the status.
    let one = "if [ $ACTQ_SEED = 100 ]; then exit 3; else exit 75; fi";
    fs::write(sweep.folder()?.join("broken.toml"), SPEC.replace("sh simulator.sh", one))?;
    let output = sweep.run("sweep broken.toml --store store --tries 2 --quiet", "")?;
    failed(&output, 1, &["it is tried again", "no further try", "the others have their results"])?;
    // The images and their errors are in the table, but none was driven.
    let table = String::from_utf8_lossy(&output.stdout).into_owned();
    ensure!(table.matches("distill").count() == 2 && !table.contains("success"), "{table}");
    // Without the rollout that distill learns from, the images of the round before are driven.
    let learns = "if [ $ACTQ_SEED = 10 ]; then exit 3; else sh simulator.sh; fi";
    fs::write(sweep.folder()?.join("broken.toml"), SPEC.replace("sh simulator.sh", learns))?;
    let output = sweep.run("sweep broken.toml --store store --quiet --json new.json", "")?;
    failed(&output, 1, &["the table has 4 of 6 rows", "the others have their results"])?;
    let table = String::from_utf8_lossy(&output.stdout).into_owned();
    ensure!(
        table.matches("distill").count() == 2 && table.matches("rtn").count() == 2 && table.contains("0.500"),
        "{table}"
    );
    ensure!(!sweep.folder()?.join("new.json").exists(), "the file is of the whole plan");
    Ok(())
}
