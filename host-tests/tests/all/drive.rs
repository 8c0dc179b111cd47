//! Driving, recording, and learning again: `actq serve --record`, `actq tune`, `actq eval --driven`, several
//! recordings.
#![cfg(unix)]

use std::fs;
use std::io::{Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};

use actq::data::{Dataset, Sizes, driven_by};
use actq::graph::Evaluator;
use actq::policy::Policy;
use actq::runtime::ImageBuffer;
use actq_bench::command::{actq, answered, failed, run, succeeded};
use actq_bench::golden::Random;
use actq_bench::qemu::step_request;
use actq_link::RESET;
use anyhow::{Context, Result, ensure};
use ndarray::Array3;
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::folder::{write_observations, write_policy};

const OBS: usize = 6;
const HIDDEN: usize = 16;
const ACT: usize = 2;
const CHUNK: usize = 3;
const EXECUTE: usize = 2;

/// The kind of network.
#[derive(Clone, Copy, PartialEq)]
enum Network {
    /// Feed-forward, with chunks.
    Chunk,
    /// Recurrent, one action per step.
    Lstm,
    /// Recurrent, with chunks.
    LstmChunk,
}

/// A folder with a policy in `policy`, its recordings, and the image `image.actq`; commands run in it.
struct Fixture {
    dir: TempDir,
    policy: Policy,
}

impl Fixture {
    fn new(network: Network) -> Result<Self> {
        let dir = TempDir::new()?;
        let folder = dir.path().join("policy");
        fs::create_dir(&folder)?;
        let chunk = if network == Network::Lstm { 1 } else { CHUNK };
        let front = match network {
            Network::Chunk => vec![json!({"op": "linear", "w": "in"}), json!({"op": "tanh"})],
            _ => vec![json!({"op": "lstm", "hidden": HIDDEN, "w_ih": "ih", "w_hh": "hh"})],
        };
        let ops = [front, vec![json!({"op": "linear", "w": "out"})]].concat();
        let mut json = json!({"name": "leg", "obs_dim": OBS, "act_dim": ACT, "ops": ops});
        if network != Network::Lstm {
            json["kind"] = "chunk".into();
            json["chunk"] = chunk.into();
            json["execute"] = EXECUTE.into();
        }
        let mut random = Random::new(21);
        let shapes = match network {
            Network::Chunk => vec![("in", HIDDEN, OBS)],
            _ => vec![("ih", 4 * HIDDEN, OBS), ("hh", 4 * HIDDEN, HIDDEN)],
        };
        let tensors = shapes.into_iter().chain([("out", chunk * ACT, HIDDEN)]).map(|(name, rows, cols)| {
            (name, vec![rows, cols], (0..rows * cols).map(|_| 0.7 * random.unit()).collect())
        });
        write_policy(&folder, &json, tensors)?;
        for (name, seed) in [("calib.npz", 1), ("heldout.npz", 2)] {
            write_recording(&folder.join(name), seed, 6, 50)?;
        }
        let policy = Policy::load(&folder)?;
        let fixture = Self { dir, policy };
        succeeded(&fixture.run("quantize policy --method gptq --bits 4 --out image.actq", b"")?)?;
        Ok(fixture)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    fn command(&self, line: &str) -> Command {
        let mut command = actq(&line.split_whitespace().collect::<Vec<_>>());
        command.current_dir(self.dir.path()).env_remove("ACTQ_POLICY");
        command
    }

    fn run(&self, line: &str, input: &[u8]) -> Result<Output> {
        run(self.command(line), input)
    }

    fn recording(&self, name: &str) -> Result<Dataset> {
        Ok(Dataset::load(&self.path(name), Sizes::of(&self.policy))?)
    }

    fn crc(&self, name: &str) -> Result<u32> {
        let path = self.path(name);
        Ok(ImageBuffer::read(&path)?.image(&path)?.crc())
    }

    /// The f32 policy's outputs in an episode.
    fn labels(&self, episode: &[Vec<f32>]) -> Vec<Vec<f32>> {
        let mut evaluator = Evaluator::new(&self.policy.graph);
        episode.iter().map(|obs| evaluator.step(obs, &mut |_, _| {})).collect()
    }
}

fn write_recording(path: &Path, seed: u64, episodes: usize, steps: usize) -> Result<()> {
    let mut random = Random::new(seed);
    write_observations(path, &Array3::from_shape_simple_fn((episodes, steps, OBS), || random.unit()))
}

fn draw(seed: u64, steps: usize) -> Vec<Vec<f32>> {
    let mut random = Random::new(seed);
    (0..steps).map(|_| (0..OBS).map(|_| 1.5 * random.unit()).collect()).collect()
}

/// The requests of whole episodes.
fn requests(episodes: &[Vec<Vec<f32>>]) -> Vec<u8> {
    let of =
        |episode: &Vec<Vec<f32>>| [vec![RESET], episode.iter().flat_map(|obs| step_request(obs)).collect()].concat();
    episodes.iter().flat_map(of).collect()
}

/// The content of a recording by episode.
fn episodes(dataset: &Dataset) -> Vec<Vec<Vec<f32>>> {
    (0..dataset.length.len()).map(|e| dataset.episode(e).collect()).collect()
}

fn actions(dataset: &Dataset) -> Result<Vec<Vec<f32>>> {
    let steps = dataset.length.iter().enumerate().flat_map(|(e, n)| (0..*n).map(move |s| (e, s)));
    steps.map(|(e, s)| dataset.action_at(e, s).context("the recording has no actions")).collect()
}

#[test]
fn observations_are_recorded_with_labels_of_f32() -> Result<()> {
    for network in [Network::Chunk, Network::Lstm, Network::LstmChunk] {
        let fixture = Fixture::new(network)?;
        let shown = [draw(3, 41), Vec::new(), draw(4, 300), draw(5, 2)];
        // For a recurrent policy with chunks, the observations that reach its network; for any other policy all.
        let every = if network == Network::LstmChunk { EXECUTE } else { 1 };
        let reach: Vec<Vec<Vec<f32>>> = shown
            .iter()
            .map(|e| e.iter().step_by(every).cloned().collect())
            .filter(|e: &Vec<_>| !e.is_empty())
            .collect();
        let plain = fixture.run("serve image.actq", &requests(&shown))?;
        let output = fixture.run("serve image.actq --record drive.npz --policy policy", &requests(&shown))?;
        assert_eq!(output.stdout, plain.stdout, "recording must not change an answer");
        answered(&output)?;
        let recorded = fixture.recording("drive.npz")?;
        let frames = |episodes: &[Vec<Vec<f32>>]| episodes.concat();
        assert_eq!(frames(&episodes(&recorded)), frames(&reach));
        if network != Network::Chunk {
            assert_eq!(episodes(&recorded), reach, "episodes of a recurrent policy stay whole");
        }
        assert_eq!(actions(&recorded)?, reach.iter().flat_map(|e| fixture.labels(e)).collect::<Vec<_>>());
        assert_eq!(driven_by(&fixture.path("drive.npz"))?, Some(fixture.crc("image.actq")?));
    }
    Ok(())
}

#[test]
fn an_observation_without_action_ends_the_episode() -> Result<()> {
    let fixture = Fixture::new(Network::Lstm)?;
    let (first, second) = (draw(3, 5), draw(4, 7));
    let mut bad = draw(5, 1);
    bad[0][2] = f32::NAN;
    let frames = [first.clone(), bad.clone(), bad.clone(), second.clone(), bad].concat();
    answered(&fixture.run("serve image.actq --record drive.npz --policy policy", &requests(&[frames]))?)?;
    let recorded = fixture.recording("drive.npz")?;
    assert_eq!(episodes(&recorded), [first.clone(), second.clone()]);
    assert_eq!(actions(&recorded)?, [fixture.labels(&first), fixture.labels(&second)].concat());
    Ok(())
}

#[test]
fn only_the_images_own_policy_labels() -> Result<()> {
    let fixture = Fixture::new(Network::Chunk)?;
    let input = requests(&[draw(3, 10)]);
    // Without its policy beside it: no labels, and one message.
    let output = fixture.run("serve image.actq --record bare.npz", &input)?;
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    answered(&output)?;
    assert_eq!(stderr.matches("gets no array \"action\"").count(), 1, "{stderr}");
    ensure!(fixture.recording("bare.npz")?.action.is_none());
    // With its policy beside it, or named by the environment, as actq tune does.
    fs::copy(fixture.path("image.actq"), fixture.path("policy/image.actq"))?;
    answered(&fixture.run("serve policy/image.actq --record beside.npz", &input)?)?;
    let mut command = fixture.command("serve image.actq --record named.npz");
    command.env("ACTQ_POLICY", fixture.path("policy"));
    answered(&run(command, &input)?)?;
    for name in ["beside.npz", "named.npz"] {
        ensure!(fixture.recording(name)?.action.is_some(), "{name}");
    }
    let other = Fixture::new(Network::Lstm)?;
    let line = format!("serve image.actq --record other.npz --policy {}", other.path("policy").display());
    failed(&fixture.run(&line, &input)?, 1, &["image.actq was made from another policy", "--policy"])?;
    failed(
        &fixture.run("serve image.actq --record no/drive.npz", &input)?,
        1,
        &["no/drive.npz", "folder no does not exist"],
    )?;
    let long = format!("serve image.actq --record {}.npz", "x".repeat(252));
    failed(&fixture.run(&long, &input)?, 1, &["xxx.npz: cannot write the file"])?;
    failed(&fixture.run("serve image.actq --record drive.npy", &input)?, 2, &["use a name that ends in .npz"])?;
    // Without observations nothing is written.
    answered(&fixture.run("serve image.actq --record empty.npz --policy policy", &[RESET; 3])?)?;
    for name in ["other.npz", "empty.npz"] {
        ensure!(!fixture.path(name).exists(), "{name}");
    }
    Ok(())
}

fn serve(fixture: &Fixture, line: &str) -> Result<Child> {
    let mut command = fixture.command(line);
    Ok(command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn()?)
}

/// Sends observations as a simulator does, each after the answer to the one before.
fn show(child: &mut Child, observations: &[Vec<f32>]) -> Result<()> {
    let stdin = child.stdin.as_mut().context("the command has no standard input")?;
    let stdout = child.stdout.as_mut().context("the command has no standard output")?;
    for observation in observations {
        stdin.write_all(&step_request(observation))?;
        stdout.read_exact(&mut [0; 4 * ACT])?;
    }
    Ok(())
}

#[test]
fn a_killed_recorder_keeps_earlier_observations() -> Result<()> {
    let fixture = Fixture::new(Network::Lstm)?;
    let observations = draw(6, 3000);
    let mut child = serve(&fixture, "serve image.actq --record drive.npz --policy policy")?;
    // One long episode: nothing waits for its end.
    show(&mut child, &observations)?;
    child.kill()?;
    child.wait()?;
    let recorded = fixture.recording("drive.npz")?;
    let kept = recorded.frames();
    // A twentieth may be missing, and the observations that wait to be recorded.
    assert!(kept >= 3000 * 19 / 20 - 2 * 256, "{kept}");
    assert_eq!(episodes(&recorded).concat(), observations[..kept]);
    let mut labels = fixture.labels(&observations);
    labels.truncate(kept);
    assert_eq!(actions(&recorded)?, labels);
    Ok(())
}

/// As by a simulator that terminates its policy.
#[cfg(unix)]
#[test]
fn a_terminated_recorder_keeps_all_observations() -> Result<()> {
    let fixture = Fixture::new(Network::Lstm)?;
    let observations = draw(6, 30);
    let mut child = serve(&fixture, "serve image.actq --record drive.npz --policy policy")?;
    show(&mut child, &observations)?;
    // `wait` closes the input, whose end could come before the signal.
    let _input = child.stdin.take();
    std::process::Command::new("kill").args(["-TERM", &child.id().to_string()]).status()?;
    let status = child.wait()?;
    ensure!(status.code() == Some(143), "{status}");
    assert_eq!(episodes(&fixture.recording("drive.npz")?).concat(), observations);
    Ok(())
}

#[test]
fn recorders_with_one_name_use_separate_files() -> Result<()> {
    let fixture = Fixture::new(Network::Chunk)?;
    fs::write(fixture.path("drive-2.npz"), "mine")?;
    let line = "serve image.actq --record drive.npz --policy policy";
    let mut children = [serve(&fixture, line)?, serve(&fixture, line)?];
    let shown = [draw(7, 700), draw(8, 400)];
    for (child, observations) in children.iter_mut().zip(&shown) {
        show(child, observations)?;
    }
    let mut stderr = String::new();
    for child in children {
        let output = child.wait_with_output()?;
        stderr += &String::from_utf8_lossy(&output.stderr);
        answered(&output)?;
    }
    assert_eq!(fs::read(fixture.path("drive-2.npz"))?, b"mine");
    ensure!(stderr.contains("drive.npz exists; recording to drive-3.npz"), "{stderr}");
    let read = |name: &str| Ok::<_, anyhow::Error>(episodes(&fixture.recording(name)?).concat());
    let mut recorded = [read("drive.npz")?, read("drive-3.npz")?];
    recorded.sort_by_key(|frames| std::cmp::Reverse(frames.len()));
    assert_eq!(recorded, shown);
    Ok(())
}

#[test]
fn a_closed_output_keeps_the_recording() -> Result<()> {
    let fixture = Fixture::new(Network::Chunk)?;
    let mut child = serve(&fixture, "serve image.actq --record drive.npz --policy policy")?;
    let observations = draw(9, 50);
    show(&mut child, &observations)?;
    drop(child.stdout.take());
    // The pipe may break at this answer or the next.
    let stdin = child.stdin.as_mut().context("no standard input")?;
    drop(stdin.write_all(&step_request(&observations[0])));
    failed(&child.wait_with_output()?, 1, &["cannot write the output"])?;
    let recorded = episodes(&fixture.recording("drive.npz")?).concat();
    assert_eq!(recorded[..50], observations);
    Ok(())
}

#[test]
fn quantize_learns_from_a_folder_of_recordings() -> Result<()> {
    let fixture = Fixture::new(Network::Chunk)?;
    fs::create_dir(fixture.path("drives"))?;
    let quantize = "quantize policy --method gptq --bits 4 --out x.actq";
    failed(&fixture.run(&format!("{quantize} --calib drives"), b"")?, 1, &["drives: the folder holds no recording"])?;
    write_recording(&fixture.path("drives/b.npz"), 11, 2, 30)?;
    write_recording(&fixture.path("drives/a.npz"), 12, 1, 40)?;
    let line = format!("{quantize} --calib policy/calib.npz --calib drives");
    let report = succeeded(&fixture.run(&line, b"")?)?;
    let lines: Vec<Vec<&str>> = report.lines().take(5).map(|line| line.split_whitespace().collect()).collect();
    assert_eq!(lines[0], ["learned", "from", "episodes", "frames", "kept"]);
    assert_eq!(lines[1], ["policy/calib.npz", "6", "300", "300"]);
    assert_eq!(lines[2], ["drives/a.npz", "1", "40", "40"]);
    assert_eq!(lines[3], ["drives/b.npz", "2", "60", "60"]);
    assert_eq!(lines[4], ["sum", "9", "400", "400"]);
    ensure!(fs::read(fixture.path("x.actq"))? != fs::read(fixture.path("image.actq"))?, "the image did not change");
    succeeded(&fixture.run("sweep policy --methods gptq --bpw 6 --calib policy/calib.npz --calib drives", b"")?)?;
    // The message names a malformed file.
    fs::write(fixture.path("drives/c.npz"), "no archive")?;
    failed(&fixture.run(&line, b"")?, 1, &["drives/c.npz: not an .npz archive"])?;
    let out = "quantize policy --method gptq --calib drives --out drives/a.npz";
    failed(&fixture.run(out, b"")?, 1, &["is the same file as drives/a.npz"])
}

#[test]
fn eval_measures_on_the_images_own_path() -> Result<()> {
    let fixture = Fixture::new(Network::Lstm)?;
    let input = requests(&[draw(3, 80), draw(4, 60)]);
    answered(&fixture.run("serve image.actq --record drive.npz --policy policy", &input)?)?;
    // If the recording has no labels, the policy computes them.
    answered(&fixture.run("serve image.actq --record bare.npz", &input)?)?;
    let mut own = Vec::new();
    for file in ["drive.npz", "bare.npz"] {
        let json = succeeded(&fixture.run(&format!("eval image.actq --policy policy --json --driven {file}"), b"")?)?;
        let json: Value = serde_json::from_str(&json)?;
        own.push(json["own_nmse"].as_f64().context("own_nmse")?);
        ensure!(json["nmse"].as_f64() != json["own_nmse"].as_f64() && own[0] > 0.0, "{json}");
    }
    ensure!((own[0] - own[1]).abs() < 1e-6 * own[0], "{own:?}");
    let text = succeeded(&fixture.run("eval image.actq --policy policy --driven drive.npz --driven bare.npz", b"")?)?;
    ensure!(text.contains("own path") && text.contains("(280 observations from the image's own"), "{text}");

    succeeded(&fixture.run("quantize policy --method gptq --bits 2 --out other.actq", b"")?)?;
    let error = fixture.run("eval other.actq --policy policy --driven drive.npz", b"")?;
    failed(&error, 1, &["drive.npz: is a rollout of another image"])?;
    // A recording that names no image is accepted.
    succeeded(&fixture.run("eval other.actq --policy policy --driven policy/calib.npz", b"")?)?;
    // The same image from several recordings, including its own.
    let line = "quantize policy --method rtn --bits 4 --out again.actq";
    succeeded(&fixture.run(line, b"")?)?;
    answered(&fixture.run("serve again.actq --record again.npz --policy policy", &input)?)?;
    let text = succeeded(&fixture.run(&format!("{line} --calib again.npz"), b"")?)?;
    ensure!(text.contains("error on its own path"), "{text}");
    Ok(())
}

/// A command that sends a file of requests to the policy, and reports success.
fn driver(fixture: &Fixture) -> Result<String> {
    fs::write(fixture.path("requests"), requests(&[draw(13, 60), draw(14, 50)]))?;
    Ok("eval \"$POLICY_CMD\" < requests > answers; echo driving; \
        echo \"{\\\"success\\\": 0.$((10 - ACTQ_ROUND)), \\\"ci\\\": [0.1, 0.9], \\\"episodes\\\": 2, \\\"tracking_error_mm\\\": 1.5}\"; \
        echo done"
        .to_owned())
}

fn tune(fixture: &Fixture, drive: &str, options: &str) -> Result<Output> {
    let mut command = fixture.command("tune policy --bits 3 --steps 8 --out tuned.actq --drive");
    command.arg(drive).args(options.split_whitespace());
    run(command, b"")
}

#[test]
fn tune_drives_and_learns_again() -> Result<()> {
    // A folder whose name a shell would split.
    let fixture = Fixture::new(Network::Chunk)?;
    let drive = driver(&fixture)?;
    let mut command = fixture.command("tune policy --bits 3 --steps 8 --rounds 2 --out tuned.actq");
    command.args(["--keep", "it's kept", "--json", "it's kept/tuned.json", "--drive", &drive]);
    let output = run(command, b"")?;
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    let table = succeeded(&output)?;
    assert_eq!((stderr.matches("driving\n").count(), stderr.matches("done\n").count()), (3, 3), "{stderr}");
    ensure!(stderr.contains("the image of round 0 has more success (0.900 (0.100-0.900))"), "{stderr}");
    let rows: Vec<Vec<&str>> = table.lines().map(|line| line.split_whitespace().collect()).collect();
    for (round, (episodes, frames)) in [("6", "300"), ("8", "410"), ("10", "520")].into_iter().enumerate() {
        assert_eq!(rows[round + 1][..3], [&*round.to_string(), episodes, frames], "{table}");
    }
    ensure!(rows[0].join(" ").contains("tracking error mm") && rows[3].contains(&"1.500"), "{table}");

    let json: Value = serde_json::from_slice(&fs::read(fixture.path("it's kept/tuned.json"))?)?;
    let rounds = json["rounds"].as_array().context("rounds")?;
    assert_eq!(rounds.len(), 3);
    assert_eq!(rounds[2]["driven"]["success"], 0.7);
    let size = fs::metadata(fixture.path("tuned.actq"))?.len();
    assert_eq!((rows[3][3], rounds[2]["bytes"].as_u64()), (&*size.to_string(), Some(size)));
    assert_eq!(rows[3][4], format!("{:.3}", rounds[2]["milliseconds"].as_f64().context("ms")?));
    assert_eq!(rounds[1]["driven"]["ci"], json!([0.1, 0.9]));
    ensure!(rounds.iter().all(|r| r["nmse"].as_f64() > Some(0.0) && r["own_nmse"].as_f64() > Some(0.0)), "{json}");
    assert_eq!(fs::read(fixture.path("tuned.actq"))?, fs::read(fixture.path("it's kept/round-2.actq"))?);
    for round in 0..3 {
        let kept = format!("it's kept/round-{round}");
        let recorded = fixture.recording(&format!("{kept}/drive.npz"))?;
        ensure!(recorded.action.is_some() && recorded.frames() == 110, "labelled by ACTQ_POLICY");
        assert_eq!(driven_by(&recorded.path)?, Some(fixture.crc(&format!("{kept}.actq"))?));
    }
    let first = fs::read(fixture.path("tuned.actq"))?;
    // A simulator that exits before the policy has written the observations.
    let gone = format!(
        "mkfifo to from; eval \"$POLICY_CMD\" < to > from & exec 3> to 4< from; cat requests >&3; \
         head -c {} <&4 > answers; rm to from",
        110 * 4 * ACT
    );
    succeeded(&tune(&fixture, &gone, "--keep gone")?)?;
    assert_eq!(fixture.recording("gone/round-0/drive.npz")?.obs, fixture.recording("gone/round-1/drive.npz")?.obs);
    // A repeated run gives the same bytes, and does not mix with kept files.
    failed(&tune(&fixture, &drive, "--keep policy")?, 1, &["policy: is not empty"])?;
    succeeded(&tune(&fixture, &drive, "--rounds 2")?)?;
    ensure!(fs::read(fixture.path("tuned.actq"))? == first, "the image differs");
    Ok(())
}

#[test]
fn tune_keeps_budgets_of_bytes_and_time() -> Result<()> {
    const LIMIT: usize = 720;
    let fixture = Fixture::new(Network::Chunk)?;
    let drive = driver(&fixture)?;
    let run_with = |budget: String| -> Result<Output> {
        let mut command = fixture.command(&format!("tune policy {budget} --steps 8 --out tuned.actq --drive"));
        command.arg(&drive);
        run(command, b"")
    };
    failed(&run_with("--flash 100".to_owned())?, 1, &["the budget is too small", "the limit is 100"])?;
    ensure!(!fixture.path("answers").exists(), "a budget is refused before the first rollout");
    succeeded(&run_with(format!("--flash {LIMIT}"))?)?;
    let size = fs::metadata(fixture.path("tuned.actq"))?.len() as usize;
    ensure!((LIMIT * 9 / 10..=LIMIT).contains(&size), "{size} bytes");
    let table = succeeded(&run_with(format!("--flash {LIMIT} --ms 1"))?)?;
    let row: Vec<&str> = table.lines().nth(1).context("a row")?.split_whitespace().collect();
    ensure!(row[3].parse::<usize>()? <= LIMIT && row[4].parse::<f64>()? <= 1.0, "{table}");
    Ok(())
}

#[test]
fn a_failed_drive_is_reported_and_writes_nothing() -> Result<()> {
    let fixture = Fixture::new(Network::Chunk)?;
    let drive = driver(&fixture)?;
    for (command, words) in [
        ("exit 3", &["round 0: the --drive command failed", "exit status: 3", "POLICY_CMD="][..]),
        ("kill -9 $$", &["command failed", "signal: 9"]),
        ("no-such-simulator", &["command failed", "exit status: 127"]),
        ("true", &["round 0: the --drive command recorded nothing", "POLICY_CMD"]),
    ] {
        failed(&tune(&fixture, command, "")?, 1, words).context(command)?;
    }
    // Recordings from before the failure are kept.
    let second = format!("test $ACTQ_ROUND = 1 || exit 4; {drive}");
    failed(
        &tune(&fixture, &second, "--keep kept")?,
        1,
        &["no image is written; kept holds the images", "round 1", "status: 4"],
    )?;
    ensure!(fixture.recording("kept/round-0/drive.npz")?.frames() == 110 && fixture.path("kept/round-1.actq").exists());
    ensure!(!fixture.path("tuned.actq").exists());
    let error = tune(&fixture, &drive, "--json policy/calib.npz")?;
    failed(&error, 1, &["is the same file as policy/calib.npz"])?;
    ensure!(!fixture.path("answers").exists() || fs::read(fixture.path("answers"))?.len() == 110 * 4 * ACT);
    Ok(())
}

#[test]
fn a_drive_without_a_success_figure_is_accepted() -> Result<()> {
    let fixture = Fixture::new(Network::Chunk)?;
    driver(&fixture)?;
    let drive =
        "eval \"$POLICY_CMD\" < requests > answers; echo '{\"success\": 1'; echo '{\"success\": \"yes\"}'; echo '[1]'";
    let output = tune(&fixture, drive, "")?;
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    let table = succeeded(&output)?;
    ensure!(stderr.contains("printed no line with one JSON object that holds a number \"success\""), "{stderr}");
    ensure!(table.lines().nth(1).is_some_and(|row| row.split_whitespace().nth(7) == Some("-")), "{table}");
    Ok(())
}
