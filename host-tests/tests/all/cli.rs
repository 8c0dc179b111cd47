//! The command `actq` as other tools call it: exit status, messages, files, and the pipe protocol.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use actq::budget::Budget;
use actq::data::Recordings;
use actq::graph::Evaluator;
use actq::methods::{Method, Options};
use actq::pipeline;
use actq::policy::Policy;
use actq::runtime::{ImageBuffer, with_head};
use actq_bench::command::{actq, all, failed, run, succeeded};
use actq_bench::golden::Random;
use actq_bench::qemu::step_request;
use actq_bench::ur3;
use actq_kernels::Width;
use actq_link::{RESET, STEP};
use anyhow::{Context, Result, ensure};
use ndarray::{Array1, Array3};
use ndarray_npy::{NpzWriter, WriteNpyExt as _};
use safetensors::Dtype;
use safetensors::tensor::{TensorView, serialize};
use serde_json::{Value, json};
use tempfile::TempDir;

const OBS: usize = 40;
const HIDDEN: usize = 64;
const ACT: usize = 3;
const CHUNK: usize = 4;
const EXECUTE: usize = 2;
const EPISODES: usize = 3;
const STEPS: usize = 20;

/// A folder with a policy, its recordings and a place for images.
struct Fixture(TempDir);

impl Fixture {
    fn new() -> Result<Self> {
        let fixture = Self(TempDir::new()?);
        fs::create_dir(fixture.policy())?;
        fs::create_dir(fixture.0.path().join("out"))?;
        write_json(&fixture.policy(), &description())?;
        write_tensors(&fixture.policy(), &tensors())?;
        let policy = Policy::load(&fixture.policy())?;
        let mut evaluator = Evaluator::new(&policy.graph);
        for (name, seed) in [("calib.npz", 5), ("heldout.npz", 6)] {
            let obs = draw_observations(seed, OBS);
            let rows = obs.rows().into_iter().flat_map(|row| evaluator.step(&row.to_vec(), &mut |_, _| {}));
            let action = Array3::from_shape_vec((EPISODES, STEPS, CHUNK * ACT), rows.collect())?;
            write_recording(&fixture.policy().join(name), &obs, Some(&action), [STEPS as i64, 7, STEPS as i64])?;
        }
        Ok(fixture)
    }

    fn policy(&self) -> PathBuf {
        self.0.path().join("policy")
    }

    fn out(&self, name: &str) -> PathBuf {
        self.0.path().join("out").join(name)
    }

    /// `actq quantize` of the policy with more arguments, separated by spaces; by gptq where they name no method. (The default
    /// method learns, for which the recording here is too short.)
    fn quantize(&self, out: &Path, options: &str) -> Result<Output> {
        let method = if options.contains("--method") { "" } else { "--method gptq" };
        self.quantize_as_given(out, &format!("{options} {method}"))
    }

    fn quantize_as_given(&self, out: &Path, options: &str) -> Result<Output> {
        let mut command = actq(&["quantize"]);
        command.arg(self.policy()).arg("--out").arg(out).args(options.split_whitespace());
        run(command, b"")
    }

    /// An image that must come out.
    fn image(&self, options: &str) -> Result<PathBuf> {
        let out = self.out(&format!("{options}.actq"));
        succeeded(&self.quantize(&out, options)?).context(options.to_owned())?;
        Ok(out)
    }

    fn eval(&self, image: &Path) -> Result<Value> {
        let mut command = actq(&["eval"]);
        command.arg(image).arg("--policy").arg(self.policy()).arg("--json");
        Ok(serde_json::from_str(&succeeded(&run(command, b"")?)?)?)
    }

    /// Every file's content and every folder.
    fn snapshot(&self) -> Result<BTreeMap<PathBuf, Option<Vec<u8>>>> {
        let mut found = BTreeMap::new();
        let mut folders = vec![self.0.path().to_owned()];
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(&folder)? {
                let path = entry?.path();
                if path.is_dir() {
                    folders.push(path.clone());
                    found.insert(path, None);
                } else {
                    let content = fs::read(&path)?;
                    found.insert(path, Some(content));
                }
            }
        }
        Ok(found)
    }
}

fn description() -> Value {
    json!({
        "name": "tiny arm", "kind": "chunk", "chunk": CHUNK, "execute": EXECUTE, "obs_dim": OBS, "act_dim": ACT,
        "control_hz": 25,
        "action": {
            "scale": [0.5, 1.0, 2.0], "offset": [0.125, 0.0, -0.25],
            "low": [-0.75, -1.5, -2.5], "high": [0.8125, 1.5, 2.5],
        },
        "ops": [
            {"op": "normalize", "mean": "norm.mean", "scale": "norm.scale", "clip": 5},
            {"op": "linear", "w": "in.weight", "b": "in.bias"},
            {"op": "tanh", "save": "h"},
            {"op": "linear", "w": "mid.weight"},
            {"op": "add", "with": "h"},
            {"op": "linear", "w": "out.weight", "b": "out.bias"},
        ],
    })
}

type Tensors = BTreeMap<&'static str, (Dtype, Vec<usize>, Vec<u8>)>;

/// Drawn weights; matrices keep the variance of their input.
fn tensors() -> Tensors {
    let mut random = Random::new(4);
    let mut tensor = |name, shape: &[usize]| {
        let reach = if let [_, cols] = *shape { (3.0 / cols as f32).sqrt() } else { 1.0 };
        let bytes = (0..shape.iter().product()).flat_map(|_| (reach * random.unit()).to_le_bytes()).collect();
        (name, (Dtype::F32, shape.to_vec(), bytes))
    };
    Tensors::from([
        tensor("norm.mean", &[OBS]),
        tensor("norm.scale", &[OBS]),
        tensor("in.weight", &[HIDDEN, OBS]),
        tensor("in.bias", &[HIDDEN]),
        tensor("mid.weight", &[HIDDEN, HIDDEN]),
        tensor("out.weight", &[CHUNK * ACT, HIDDEN]),
        tensor("out.bias", &[CHUNK * ACT]),
    ])
}

fn write_json(policy: &Path, json: &Value) -> Result<()> {
    Ok(fs::write(policy.join("policy.json"), json.to_string())?)
}

fn write_tensors(policy: &Path, tensors: &Tensors) -> Result<()> {
    let views =
        tensors.iter().map(|(name, (dtype, shape, bytes))| Ok((*name, TensorView::new(*dtype, shape.clone(), bytes)?)));
    Ok(fs::write(policy.join("policy.safetensors"), serialize(views.collect::<Result<Vec<_>>>()?, None)?)?)
}

fn draw_observations(seed: u64, width: usize) -> Array3<f32> {
    let mut random = Random::new(seed);
    Array3::from_shape_simple_fn((EPISODES, STEPS, width), || 2.0 * random.unit())
}

fn write_recording(
    path: &Path,
    obs: &Array3<f32>,
    action: Option<&Array3<f32>>,
    length: [i64; EPISODES],
) -> Result<()> {
    let mut npz = NpzWriter::new(File::create(path)?);
    npz.add_array("obs", obs)?;
    if let Some(action) = action {
        npz.add_array("action", action)?;
    }
    npz.add_array("length", &Array1::from(length.to_vec()))?;
    npz.finish()?;
    Ok(())
}

/// Changes a value of policy.json, or adds a key.
fn edit(policy: &Path, pointer: &str, value: Value) -> Result<()> {
    let mut json = description();
    if let Some(place) = json.pointer_mut(pointer) {
        *place = value;
    } else {
        let (parent, key) = pointer.rsplit_once('/').context("no pointer")?;
        json.pointer_mut(parent).context("no such place")?[key] = value;
    }
    write_json(policy, &json)
}

/// Replaces a tensor.
fn replace(policy: &Path, name: &'static str, dtype: Dtype, shape: &[usize], bytes: Vec<u8>) -> Result<()> {
    let mut tensors = tensors();
    tensors.insert(name, (dtype, shape.to_vec(), bytes));
    write_tensors(policy, &tensors)
}

fn text(path: &Path) -> String {
    path.display().to_string()
}

#[test]
fn inspect_shows_name_source_scratch_and_contract() -> Result<()> {
    let fixture = Fixture::new()?;
    let path = fixture.image("")?;
    let report = succeeded(&run(actq(&["inspect", &text(&path)]), b"")?)?;
    let digest: String = Policy::load(&fixture.policy())?.digest.iter().map(|b| format!("{b:02x}")).collect();
    let scratch = 4 * ImageBuffer::read(&path)?.image(&path)?.scratch_words();
    for part in ["tiny arm", &digest, &format!("{scratch} bytes"), "chunk of 4, 2 executed", "25 Hz"] {
        ensure!(report.contains(part), "{part:?} is not in\n{report}");
    }
    let row = ["1", "1", "0", "-1.5", "1.5", "-"];
    ensure!(report.lines().any(|line| line.split_whitespace().eq(row)), "no line {row:?} in\n{report}");
    Ok(())
}

#[test]
fn inspect_predicts_the_time_of_every_operation() -> Result<()> {
    let fixture = Fixture::new()?;
    let path = text(&fixture.image("")?);
    let inspect = |arguments: &[&str]| succeeded(&run(actq(&[&["inspect", &path], arguments].concat()), b"")?);
    let json = |clock: &str| -> Result<Value> { Ok(serde_json::from_str(&inspect(&["--json", "--clock", clock])?)?) };
    let step = json("100M")?;
    let ops = step["ops"].as_array().context("no operations")?;
    for key in ["instructions", "cycles", "macs"] {
        let number = |value: &Value| value[key].as_u64().with_context(|| format!("{key} is no number"));
        let sum = ops.iter().map(number).sum::<Result<u64>>()?;
        // Operations are rounded one by one.
        ensure!(sum.abs_diff(number(&step)?) <= ops.len() as u64 && sum > 0, "{key}: {sum} against {step}");
    }
    let milliseconds = |step: &Value| step["milliseconds"].as_f64().context("no milliseconds");
    let cycles = step["cycles"].as_f64().context("no cycles")?;
    ensure!((milliseconds(&step)? - cycles / 100e3).abs() < 1e-9, "{step}");
    ensure!((milliseconds(&json("50000K")?)? - 2.0 * milliseconds(&step)?).abs() < 1e-9, "half the clock");
    let report = inspect(&[])?;
    let cycles = step["cycles"].to_string();
    ensure!(report.contains("at 168 MHz") && report.contains(&cycles), "{report}");
    Ok(())
}

#[test]
fn a_budget_of_time_is_kept_or_refused() -> Result<()> {
    let fixture = Fixture::new()?;
    let (policy, out) = (text(&fixture.policy()), text(&fixture.out("timed.actq")));
    let quantize = |arguments: &[&str]| {
        run(actq(&[&["quantize", &policy, "--out", &out, "--method", "rtn", "--clock", "1M"], arguments].concat()), b"")
    };
    let time = || -> Result<f64> {
        let json = succeeded(&run(actq(&["inspect", &out, "--json", "--clock", "1M"]), b"")?)?;
        serde_json::from_str::<Value>(&json)?["milliseconds"].as_f64().context("no milliseconds")
    };
    ensure!(succeeded(&quantize(&["--ms", "1000"])?)?.contains("A step takes"), "the time is not printed");
    let slowest = time()?;
    let refused = quantize(&["--ms", "0.001"])?;
    failed(&refused, 1, &["0.001 ms are allowed", "the fastest is", "1 MHz"])?;
    let limit = 0.98 * slowest;
    let kept = quantize(&["--ms", &limit.to_string()])?;
    succeeded(&kept)?;
    ensure!(time()? <= limit, "{} ms for {limit}", time()?);
    Ok(())
}

#[test]
fn eval_prints_one_object_with_six_numbers() -> Result<()> {
    let fixture = Fixture::new()?;
    let path = fixture.image("--bits 8")?;
    let report = fixture.eval(&path)?;
    let keys: Vec<_> = report.as_object().context("no object")?.keys().map(String::as_str).collect();
    let mut expected = ["nmse", "worst_nmse", "max_abs", "steps", "bpw", "bytes"];
    expected.sort_unstable();
    assert_eq!(keys, expected);
    assert_eq!(report["steps"], json!(2 * STEPS + 7));
    assert_eq!(report["bytes"], json!(fs::metadata(&path)?.len()));
    let number = |key: &str| report[key].as_f64().with_context(|| format!("{key} is no number"));
    ensure!(number("nmse")? > 0.0 && number("nmse")? <= number("worst_nmse")? && number("worst_nmse")? < 1e-2);
    ensure!(number("max_abs")? > 0.0 && number("bpw")? > 8.0);
    let people = run(actq(&["eval", &text(&path), "--policy", &text(&fixture.policy())]), b"")?;
    ensure!(succeeded(&people)?.contains("nmse"), "the report for people lacks the error");
    Ok(())
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|v| v.to_le_bytes()).collect()
}

#[test]
fn serve_plays_a_chunk_and_plans_again() -> Result<()> {
    let fixture = Fixture::new()?;
    let path = fixture.image("--bits 4")?;
    let obs: Vec<Vec<f32>> = draw_observations(9, OBS).rows().into_iter().take(6).map(|row| row.to_vec()).collect();
    let json = description();
    let action = |raw: &[f32], position: usize| -> Vec<f32> {
        let at = |name: &str, i: usize| json["action"][name][i].as_f64().unwrap_or(f64::NAN) as f32;
        let scaled = (0..ACT).map(|i| raw[position * ACT + i] * at("scale", i) + at("offset", i));
        scaled.enumerate().map(|(i, a)| a.clamp(at("low", i), at("high", i))).collect()
    };
    let buffer = ImageBuffer::read(&path)?;
    let raw = with_head(buffer.image(&path)?, |head| {
        obs.iter().map(|obs| Ok(head.infer(obs)?.to_vec())).collect::<Result<Vec<_>>>()
    })?;
    // Observation, and whose plan at which position is the answer; None resets. The policy has no recurrent state.
    let session = [
        Some((0, 0, 0)),
        Some((1, 0, 1)),
        Some((2, 2, 0)),
        None,
        Some((3, 3, 0)),
        Some((4, 3, 1)),
        Some((5, 5, 0)),
        None,
    ];

    // As a simulator does it: every answer is read before the next request.
    let mut child = actq(&["serve", &text(&path)]).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
    let mut stdin = child.stdin.take().context("no standard input")?;
    let mut stdout = child.stdout.take().context("no standard output")?;
    let mut answers = Vec::new();
    for part in session {
        let Some((seen, plan, position)) = part else {
            stdin.write_all(&[RESET])?;
            continue;
        };
        stdin.write_all(&step_request(&obs[seen]))?;
        let mut answer = vec![0; 4 * ACT];
        stdout.read_exact(&mut answer)?;
        assert_eq!(answer, floats(&action(&raw[plan], position)), "observation {seen}");
        answers.extend(answer);
    }
    drop(stdin);
    let mut rest = Vec::new();
    stdout.read_to_end(&mut rest)?;
    ensure!(rest.is_empty(), "{} bytes that nobody asked for", rest.len());
    ensure!(child.wait()?.code() == Some(0), "the end of the input is no error");

    // The same in one go.
    let requests = session.map(|part| part.map_or(vec![RESET], |(seen, ..)| step_request(&obs[seen]))).concat();
    let output = run(actq(&["serve", &text(&path)]), &requests)?;
    assert_eq!((output.status.code(), output.stdout), (Some(0), answers));
    Ok(())
}

#[test]
fn serve_refuses_what_is_not_the_protocol() -> Result<()> {
    let fixture = Fixture::new()?;
    let path = text(&fixture.image("")?);
    let good = step_request(&[0.5; OBS]);
    let cases: [(&str, Vec<u8>, usize, &[&str]); 4] = [
        ("unknown byte", vec![RESET, b'X'], 0, &["0x58"]),
        ("end inside an observation", good[..good.len() - 1].to_vec(), 0, &["observation"]),
        ("end behind S", [&good[..], &[STEP]].concat(), 1, &["observation"]),
        ("text", [&good[..], &good[..], b"\n"].concat(), 2, &["0x0a"]),
    ];
    all(cases.map(|(what, input, answers, words)| {
        let result = run(actq(&["serve", &path]), &input).and_then(|output| {
            ensure!(output.stdout.len() == answers * 4 * ACT, "{} bytes of answers", output.stdout.len());
            failed(&output, 1, words)
        });
        (what.to_owned(), result)
    }))
}

#[test]
fn serve_answers_what_is_not_finite_with_no_action_and_goes_on() -> Result<()> {
    let fixture = Fixture::new()?;
    // Nothing bounds what the network computes with.
    edit(&fixture.policy(), "/ops/0/clip", Value::Null)?;
    let path = text(&fixture.image("--bits 4")?);
    let serve = |frames: &[&[u8]]| -> Result<Vec<Vec<u8>>> {
        let output = run(actq(&["serve", &path]), &frames.concat())?;
        ensure!(output.status.code() == Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        Ok(output.stdout.chunks(4 * ACT).map(<[u8]>::to_vec).collect())
    };
    let observations = draw_observations(9, OBS);
    let rows: Vec<Vec<u8>> = observations.rows().into_iter().take(3).map(|row| step_request(&row.to_vec())).collect();
    let mut one_nan = [0.25; OBS];
    one_nan[OBS - 1] = f32::NAN;
    // The end of a chunk, and the middle of one.
    let expected = serve(&[&rows[0], &rows[0], b"R", &rows[1], b"R", &rows[2]])?;
    let no_action = 0x7fc0_0000u32.to_le_bytes().repeat(ACT);
    for (what, bad) in [
        ("NaN", step_request(&one_nan)),
        ("infinity", step_request(&[f32::NEG_INFINITY; OBS])),
        ("overflow inside", step_request(&[f32::MAX; OBS])),
    ] {
        // Behind it the policy plans anew, as after a reset.
        let answers = serve(&[&rows[0], &rows[0], &bad, &rows[1], &step_request(&one_nan), &rows[2]])?;
        let right = [&expected[0], &expected[1], &no_action, &expected[2], &no_action, &expected[3]];
        ensure!(answers.iter().eq(right), "{what}: {answers:02x?}");
    }
    Ok(())
}

/// The widths of an image's matrices, narrow to wide.
fn widths(path: &Path) -> Result<Vec<u32>> {
    let buffer = ImageBuffer::read(path)?;
    let matrices = buffer.image(path)?.ops().filter_map(|op| op.matrix());
    let mut widths: Vec<u32> = matrices.flat_map(|m| m.blocks().map(|rows| rows.block.shape().width.bits())).collect();
    widths.sort_unstable();
    Ok(widths)
}

#[test]
fn every_width_does_what_it_says() -> Result<()> {
    let fixture = Fixture::new()?;
    let mut last = (f64::INFINITY, 0.0);
    for width in Width::ALL {
        let bits = width.bits();
        let path = fixture.image(&format!("--bits {bits}"))?;
        assert_eq!(widths(&path)?, [bits; 3]);
        let report = fixture.eval(&path)?;
        let (nmse, bpw) = (report["nmse"].as_f64().context("nmse")?, report["bpw"].as_f64().context("bpw")?);
        ensure!(nmse < last.0 && bpw > last.1 && bpw >= f64::from(bits), "{bits} bits: nmse {nmse}, {bpw} bits/weight");
        last = (nmse, bpw);
    }
    Ok(())
}

#[test]
fn a_budget_is_kept_and_used() -> Result<()> {
    let fixture = Fixture::new()?;
    let mut errors = Vec::new();
    for budget in [3.1, 3.7, 4.2, 4.9, 6.0, 7.3, 12.0] {
        let path = fixture.image(&format!("--bpw {budget}"))?;
        let report = fixture.eval(&path)?;
        let bpw = report["bpw"].as_f64().context("bpw")?;
        ensure!(bpw <= budget + 1e-9, "--bpw {budget} gave {bpw}");
        errors.push((budget, report["nmse"].as_f64().context("nmse")?));
    }
    ensure!(errors.windows(2).all(|pair| pair[1].1 <= pair[0].1), "more bits, more error: {errors:?}");
    assert_eq!(widths(&fixture.out("--bpw 12.actq"))?, [8; 3]);
    Ok(())
}

#[test]
fn a_budget_that_is_too_small_names_the_least() -> Result<()> {
    let fixture = Fixture::new()?;
    let narrowest = fixture.eval(&fixture.image("--bits 2")?)?["bpw"].as_f64().context("bpw")?;
    let before = fixture.snapshot()?;
    let output = fixture.quantize(&fixture.out("small.actq"), "--bpw 2.0")?;
    let weights = HIDDEN * OBS + HIDDEN * HIDDEN + CHUNK * ACT * HIDDEN;
    let bytes = (narrowest * weights as f64 / 8.0).round();
    failed(&output, 1, &["budget", &format!("{bytes} bytes")])?;
    ensure!(fixture.snapshot()? == before, "files have changed");
    // The least itself is enough.
    fixture.image(&format!("--bpw {}", narrowest + 1e-6))?;
    Ok(())
}

#[test]
fn the_default_method_follows_from_what_is_there() -> Result<()> {
    let fixture = Fixture::new()?;
    let out = fixture.out("default.actq");
    let bytes = |options: &str| Ok::<_, anyhow::Error>(fs::read(fixture.image(options)?)?);
    let default = |options: &str| {
        succeeded(&fixture.quantize_as_given(&out, options)?)?;
        Ok::<_, anyhow::Error>(fs::read(&out)?)
    };
    let rtn = bytes("--bits 3 --method rtn --activations 8")?;
    // A recording: the method that learns, which says how many frames it needs.
    failed(&fixture.quantize_as_given(&out, "")?, 1, &["calib.npz", "frames", "200"])?;
    fs::remove_file(fixture.policy().join("calib.npz"))?;
    assert_eq!(default("")?, rtn);
    Ok(())
}

#[test]
fn groups_and_activations_reach_the_image() -> Result<()> {
    let fixture = Fixture::new()?;
    for (group, activations) in [(0, 8), (32, 16), (64, 8), (128, 16)] {
        let path = fixture.image(&format!("--group {group} --activations {activations}"))?;
        let buffer = ImageBuffer::read(&path)?;
        for matrix in buffer.image(&path)?.ops().filter_map(|op| op.matrix()) {
            assert_eq!((matrix.group, matrix.x_max > 127), (group, activations == 16));
        }
        fixture.eval(&path)?;
    }
    Ok(())
}

#[test]
fn choices_of_actquant_reach_the_image() -> Result<()> {
    let folder = TempDir::new()?;
    let out = folder.path().join("image.actq");
    let quantize = |options: &str| {
        let mut command = actq(&["quantize"]);
        command.arg(ur3()).arg("--out").arg(&out).args(options.split_whitespace());
        run(command, b"")
    };
    let image = |choices: &str| -> Result<Vec<u8>> {
        succeeded(&quantize(&format!("--method actquant --bpw 2.5 {choices}"))?)?;
        Ok(fs::read(&out)?)
    };
    let plain = image("")?;
    let defaults =
        "bandwidth=median,frames=512,score=gain,noise=codes,widest=8,head=free,samples=4096,batch=1,signs=random";
    ensure!(image(&format!("--actquant {defaults},magnitude=no"))? == plain, "these are the defaults");
    for choices in ["magnitude=yes", "samples=100"] {
        ensure!(image(&format!("--actquant {choices}"))? != plain, "{choices} changes nothing");
    }

    fs::remove_file(&out)?;
    for (options, status, words) in [
        ("--method gptq --actquant authors", 1, "--actquant goes with method actquant, not with gptq"),
        ("--actquant authors", 1, "not with best"),
        ("--method actquant --actquant heads=8", 2, "heads is no key; the keys are bandwidth, frames"),
        ("--method actquant --actquant head=5", 2, "head takes 2, 3, 4 or 8, or free"),
    ] {
        failed(&quantize(options)?, status, &[words])?;
    }
    ensure!(!out.exists(), "a file was written");
    let mut sweep = actq(&["sweep"]);
    sweep.arg(ur3()).args(["--methods", "rtn", "--actquant", "head=4"]);
    failed(&run(sweep, b"")?, 1, &["not with rtn"])
}

#[test]
fn the_same_input_gives_the_same_bytes() -> Result<()> {
    let fixture = Fixture::new()?;
    for options in ["--bits 2", "--bits 3 --method rtn --group 32", "--bpw 4.5 --activations 16"] {
        let first = fs::read(fixture.image(options)?)?;
        // Another folder, and the old image in the way.
        let copy = Fixture::new()?;
        fs::write(copy.out(&format!("{options}.actq")), "old")?;
        ensure!(first == fs::read(copy.image(options)?)?, "{options}: two runs differ");
    }
    Ok(())
}

#[test]
fn a_wrong_command_line_has_status_2() -> Result<()> {
    let fixture = Fixture::new()?;
    let before = fixture.snapshot()?;
    let options = [
        ("--bits 5", "bits"),
        ("--bits 0", "bits"),
        ("--bits three", "bits"),
        ("--group 7", "group"),
        ("--activations 12", "activations"),
        ("--method foo", "method"),
        ("--bits 3 --bpw 3", "bpw"),
        ("--bpw many", "bpw"),
        ("--bpw 0", "bpw"),
        ("--bpw nan", "bpw"),
        ("--bpw inf", "bpw"),
        ("--bpw=-1", "bpw"),
        ("--threads 257", "0..=256"),
        ("--threads 5000", "threads"),
        ("--colour", "colour"),
    ];
    let policy = text(&fixture.policy());
    let lines: [&[&str]; 4] = [&[], &["paint"], &["quantize", &policy], &["eval", "x.actq"]];
    let out = fixture.out("image");
    let quantized = options.map(|(options, word)| {
        (options.to_owned(), fixture.quantize(&out, options).and_then(|output| failed(&output, 2, &[word])))
    });
    let other =
        lines.map(|line| (format!("{line:?}"), run(actq(line), b"").and_then(|output| failed(&output, 2, &[]))));
    all(quantized.into_iter().chain(other))?;
    ensure!(fixture.snapshot()? == before, "files have changed");
    Ok(())
}

/// How to spoil a policy's folder, the options to quantize with, and what the message must name.
type Spoilt = (&'static str, fn(&Path) -> Result<()>, &'static str, &'static [&'static str]);

const SPOILT: &[Spoilt] = &[
    ("no folder", |p| Ok(fs::remove_dir_all(p)?), "", &["policy"]),
    ("no policy.json", |p| Ok(fs::remove_file(p.join("policy.json"))?), "", &["policy.json"]),
    ("no weights", |p| Ok(fs::remove_file(p.join("policy.safetensors"))?), "", &["policy.safetensors"]),
    ("not JSON", |p| Ok(fs::write(p.join("policy.json"), "{\"name\": ")?), "", &["policy.json"]),
    ("not an object", |p| write_json(p, &json!([1, 2])), "", &["policy.json"]),
    ("weights cut off", |p| cut(&p.join("policy.safetensors"), 100), "", &["policy.safetensors"]),
    ("weights empty", |p| cut(&p.join("policy.safetensors"), 0), "", &["policy.safetensors"]),
    ("unknown op", |p| edit(p, "/ops/2", json!({"op": "swish"})), "", &["policy.json", "op 2", "swish"]),
    (
        "unknown key",
        |p| edit(p, "/ops/1/bias", json!("in.bias")),
        "",
        &["policy.json: op 1 (linear) has the key \"bias\"; its keys are op, input, save, w, b"],
    ),
    (
        "key of another op",
        |p| edit(p, "/ops/2/clip", json!(5)),
        "",
        &["policy.json: op 2 (tanh) has the key \"clip\"; its keys are op, input, save"],
    ),
    (
        "misspelt key",
        |p| edit(p, "/actoin", json!({"low": [0, 0, 0]})),
        "",
        &["policy.json: the key \"actoin\" is not known; known are name, kind,", "action, ops", "source"],
    ),
    ("key of another kind", |p| edit(p, "/euler_steps", json!(10)), "", &["policy.json", "euler_steps"]),
    (
        "key twice",
        |p| twice(p, "\"obs_dim\""),
        "",
        &["policy.json: not a policy description: the key \"obs_dim\" is there twice"],
    ),
    ("key of an op twice", |p| twice(p, "\"clip\""), "", &["policy.json", "the key \"clip\" is there twice"]),
    ("limits twice", |p| twice(p, "\"low\""), "", &["policy.json", "the key \"low\" is there twice"]),
    ("tensor twice", tensor_twice, "", &["policy.safetensors", "the key \"out.weight\" is there twice"]),
    (
        "control character in the name",
        |p| edit(p, "/name", json!("arm\u{1b}[2J")),
        "",
        &["policy.json: name \"arm\\u{1b}[2J\" holds the control character U+001B"],
    ),
    (
        "control character in a slot",
        |p| edit(p, "/ops/2/save", json!("h\n")),
        "",
        &["policy.json: ops[2].save \"h\\n\" holds the control character U+000A"],
    ),
    ("clip beyond f32", |p| edit(p, "/ops/0/clip", json!(1e39)), "", &["op 0", "clip is 1e39, beyond float32's range"]),
    ("pre_clip beyond f32", |p| edit(p, "/ops/0/pre_clip", json!(1e39)), "", &["op 0", "pre_clip is 1e39, beyond"]),
    (
        "clip below f32",
        |p| edit(p, "/ops/0/clip", json!(1e-50)),
        "",
        &["op 0", "clip is ", "; float32 rounds that to 0, and it must be above 0"],
    ),
    ("clip 0", |p| edit(p, "/ops/0/clip", json!(0)), "", &["op 0", "clip is 0.0; it must be above 0"]),
    ("eps beyond f32", |p| edit(p, "/ops/2", norm(1e39)), "", &["op 2", "eps is 1e39, beyond float32's range"]),
    ("eps below f32", |p| edit(p, "/ops/2", norm(1e-50)), "", &["op 2", "eps is ", "float32 rounds that to 0"]),
    ("rate beyond f32", |p| edit(p, "/control_hz", json!(1e39)), "", &["control_hz is 1e39, beyond float32's range"]),
    ("rate below f32", |p| edit(p, "/control_hz", json!(1e-50)), "", &["control_hz is ", "float32 rounds that to 0"]),
    (
        "limit beyond f32",
        |p| edit(p, "/action/high", json!([1, 1e39, 3])),
        "",
        &["policy.json: action.high[1] is 1e39, beyond float32's range"],
    ),
    (
        "weight beyond f32",
        |p| replace(p, "in.bias", Dtype::F64, &[HIDDEN], [-1e39f64; HIDDEN].map(f64::to_le_bytes).concat()),
        "",
        &["policy.safetensors", "op 1", "tensor \"in.bias\" holds -1e39, beyond float32's range, at position 0"],
    ),
    ("no op", |p| edit(p, "/ops", json!([])), "", &["policy.json", "ops"]),
    ("no w", |p| edit(p, "/ops/3", json!({"op": "linear"})), "", &["policy.json", "op 3", "linear"]),
    ("no such tensor", |p| edit(p, "/ops/3/w", json!("gone")), "", &["policy.safetensors", "op 3", "gone"]),
    ("wrong shape", |p| matrix(p, HIDDEN, OBS), "", &["policy.safetensors", "op 3", "mid.weight"]),
    ("no matrix", |p| edit(p, "/ops/3/w", json!("in.bias")), "", &["policy.safetensors", "op 3", "in.bias"]),
    ("wrong bias", |p| edit(p, "/ops/3/b", json!("out.bias")), "", &["policy.safetensors", "op 3", "out.bias"]),
    ("NaN weight", |p| bias(p, f32::NAN), "", &["policy.safetensors", "op 1", "in.bias", "NaN"]),
    ("infinite weight", |p| bias(p, f32::INFINITY), "", &["policy.safetensors", "op 1", "in.bias", "inf"]),
    (
        "integer tensor",
        |p| replace(p, "in.bias", Dtype::I64, &[HIDDEN], vec![0; 8 * HIDDEN]),
        "",
        &["policy.safetensors", "op 1", "in.bias", "int64"],
    ),
    ("slot not saved", |p| edit(p, "/ops/4/with", json!("skip")), "", &["policy.json", "op 4", "skip"]),
    ("slot saved later", |p| edit(p, "/ops/1/input", json!("h")), "", &["policy.json", "op 1", "\"h\""]),
    ("slice too long", |p| edit(p, "/ops/0/input", json!("obs[3:41]")), "", &["policy.json", "op 0", "obs[3:41]"]),
    ("slice reversed", |p| edit(p, "/ops/0/input", json!(["obs[3:1]"])), "", &["policy.json", "op 0", "obs[3:1]"]),
    ("no slice", |p| edit(p, "/ops/0/input", json!("obs[-1]")), "", &["policy.json", "op 0", "obs[-1]"]),
    ("no input", |p| edit(p, "/ops/0/input", json!([])), "", &["policy.json", "op 0", "input"]),
    ("unequal sum", |p| edit(p, "/ops/4/with", json!("obs")), "", &["policy.json", "op 4", "add"]),
    ("another act_dim", |p| edit(p, "/act_dim", json!(5)), "", &["policy.json", "act_dim"]),
    ("no act_dim", |p| edit(p, "/act_dim", Value::Null), "", &["policy.json"]),
    ("act_dim 0", |p| edit(p, "/act_dim", json!(0)), "", &["policy.json", "act_dim"]),
    ("unknown kind", |p| edit(p, "/kind", json!("flow")), "", &["policy.json", "flow"]),
    ("execute beyond chunk", |p| edit(p, "/execute", json!(5)), "", &["policy.json", "execute"]),
    // Sizes whose products do not fit a usize.
    ("vast chunk", |p| edit(p, "/chunk", json!(1u64 << 63)), "", &["policy.json", "chunk"]),
    ("vast hidden", |p| edit(p, "/ops/2", vast_lstm()), "", &["policy.json", "op 2", "hidden"]),
    ("vast obs_dim", |p| edit(p, "/obs_dim", json!(u64::MAX)), "", &["policy.json"]),
    ("long contract", |p| edit(p, "/action/low", json!([0, 0, 0, 0])), "", &["policy.json", "low"]),
    ("unknown contract", |p| edit(p, "/action/lowest", json!([0, 0, 0])), "", &["policy.json", "lowest"]),
    ("limits reversed", |p| edit(p, "/action/low", json!([0, 2, 0])), "", &["policy.json", "low"]),
    ("negative step", |p| edit(p, "/action/max_step", json!([1, -1, 1])), "", &["policy.json", "max_step"]),
    ("smoothing 0", |p| edit(p, "/action/smoothing", json!([1, 0, 1])), "", &["action.smoothing must be above 0"]),
    ("mean alone", |p| edit(p, "/action/mean", json!([0, 0, 0])), "", &["action has mean or std alone"]),
    ("std 0", |p| both(p, ["mean", "std"], [json!([0, 0, 0]), json!([1, 0, 1])]), "", &["action.std[1] is 0.0"]),
    (
        "quantiles reversed",
        |p| both(p, ["q01", "q99"], [json!([0, null, 2]), json!([1, null, 1])]),
        "",
        &["action.q01[2] is 2.0, above action.q99[2], 1.0"],
    ),
    (
        "a quantile without the other",
        |p| both(p, ["q01", "q99"], [json!([0, 0, 0]), json!([1, null, 1])]),
        "",
        &["action.q01[1] or action.q99[1] alone is null"],
    ),
    (
        "two ways to un-normalise",
        |p| {
            both(p, ["mean", "std"], [json!([0, 0, 0]), json!([1, 1, 1])])?;
            let path = p.join("policy.json");
            let mut policy: Value = serde_json::from_slice(&fs::read(&path)?)?;
            policy["action"]["q01"] = json!([0, 0, 0]);
            policy["action"]["q99"] = json!([1, 1, 1]);
            Ok(fs::write(path, policy.to_string())?)
        },
        "",
        &["mean and std, and q01 and q99: leave one pair"],
    ),
    ("scale null", |p| edit(p, "/action/scale", json!([1, null, 1])), "", &["action.scale[1] is null"]),
    ("binarise in part", |p| edit(p, "/action/binarise", json!({"on": [1, 1, 1]})), "", &["action.binarise.off"]),
    (
        "thresholds reversed",
        |p| edit(p, "/action/binarise", binarise([0.5, 0.6], [1, 0])),
        "",
        &["binarise.off exceeds"],
    ),
    ("one value", |p| edit(p, "/action/binarise", binarise([0.6, 0.5], [1, 1])), "", &["off_value[2] are both 1"]),
    ("overlap", |p| edit(p, "/overlap", json!(3)), "", &["overlap is 3, of a chunk 2 actions are left"]),
    ("deadline", |p| edit(p, "/deadline", json!(1)), "", &["deadline is 1, it must be 2"]),
    ("ensemble", |p| edit(p, "/ensemble", json!({"horizon": 4})), "", &["execute is 2", "execute must be 1"]),
    (
        "horizon 0",
        |p| edit(p, "/ensemble", json!({"horizon": 0})),
        "",
        &["ensemble.horizon is 0, it must be 1 to chunk (4)"],
    ),
    ("unknown ensemble", |p| edit(p, "/ensemble", json!({"horizons": 4})), "", &["policy.json", "horizons"]),
    ("control rate 0", |p| edit(p, "/control_hz", json!(0)), "", &["policy.json", "control_hz"]),
    (
        "no recording",
        |p| Ok(fs::remove_file(p.join("calib.npz"))?),
        "--method gptq",
        &[
            "gptq needs recorded observations: put calib.npz, calib.npy or calib.safetensors beside policy.json",
            "--calib",
        ],
    ),
    (
        "two recordings",
        |p| Ok(fs::write(p.join("calib.npy"), "")?),
        "",
        &["policy: calib.npz and calib.npy are there; leave one of them"],
    ),
    (
        "two held-out recordings",
        |p| Ok(fs::write(p.join("heldout.safetensors"), "")?),
        "",
        &["heldout.npz and heldout.safetensors are there"],
    ),
    ("held-out recording cut off", |p| cut(&p.join("heldout.npz"), 100), "", &["heldout.npz", "cut off"]),
    ("too few frames", |p| calib(p, OBS, 0.0, 13), "", &["calib.npz", "15 frames are recorded, 16 are needed"]),
    (
        "too few frames to learn from",
        |_| Ok(()),
        "--method best",
        &["calib.npz", "47 frames are recorded, 200 are needed: learning from fewer repeats them by heart"],
    ),
    ("recording cut off", |p| cut(&p.join("calib.npz"), 100), "", &["calib.npz"]),
    ("recording empty", |p| cut(&p.join("calib.npz"), 0), "", &["calib.npz"]),
    ("wider recording", |p| calib(p, OBS + 1, 0.0, 1), "", &["calib.npz", "obs", "41", "40"]),
    ("recorded NaN", |p| calib(p, OBS, f32::NAN, 1), "", &["calib.npz", "obs", "NaN"]),
    ("length beyond the array", |p| calib(p, OBS, 0.0, 21), "", &["calib.npz", "21", "20"]),
    ("negative length", |p| calib(p, OBS, 0.0, -1), "", &["calib.npz", "length"]),
];

/// The policy with two more keys in `action`.
fn both(policy: &Path, keys: [&str; 2], values: [Value; 2]) -> Result<()> {
    let mut json = description();
    for (key, value) in keys.into_iter().zip(values) {
        json["action"][key] = value;
    }
    Ok(fs::write(policy.join("policy.json"), json.to_string())?)
}

/// Of the last of three actions.
fn binarise([on, off]: [f64; 2], [on_value, off_value]: [i32; 2]) -> Value {
    let last = |value: Value| json!([null, null, value]);
    json!({
        "on": last(json!(on)), "off": last(json!(off)),
        "on_value": last(json!(on_value)), "off_value": last(json!(off_value)),
    })
}

fn vast_lstm() -> Value {
    json!({"op": "lstm", "hidden": 1u64 << 62, "w_ih": "in.weight", "w_hh": "mid.weight"})
}

fn norm(eps: f64) -> Value {
    json!({"op": "rmsnorm", "w_ln": "in.bias", "eps": eps})
}

/// Writes the key a second time, before its first.
fn twice(policy: &Path, key: &str) -> Result<()> {
    let json = description().to_string().replacen(key, &format!("{key}: 1, {key}"), 1);
    Ok(fs::write(policy.join("policy.json"), json)?)
}

/// Gives a tensor the name of another, which is as long.
fn tensor_twice(policy: &Path) -> Result<()> {
    let path = policy.join("policy.safetensors");
    let mut bytes = fs::read(&path)?;
    let (from, to) = (b"mid.weight", b"out.weight");
    let at = bytes.windows(from.len()).position(|part| part == from).context("no such name")?;
    bytes[at..at + to.len()].copy_from_slice(to);
    Ok(fs::write(&path, bytes)?)
}

fn cut(path: &Path, len: usize) -> Result<()> {
    let bytes = fs::read(path)?;
    Ok(fs::write(path, &bytes[..len])?)
}

/// Gives mid.weight another shape.
fn matrix(policy: &Path, rows: usize, cols: usize) -> Result<()> {
    replace(policy, "mid.weight", Dtype::F32, &[rows, cols], vec![0; 4 * rows * cols])
}

/// Puts `value` at the end of in.bias.
fn bias(policy: &Path, value: f32) -> Result<()> {
    let mut values = [0.0; HIDDEN];
    values[HIDDEN - 1] = value;
    replace(policy, "in.bias", Dtype::F32, &[HIDDEN], floats(&values))
}

/// A recording of another width, with a value in the first observation and a length of the last episode.
fn calib(policy: &Path, width: usize, value: f32, length: i64) -> Result<()> {
    let mut obs = draw_observations(5, width);
    obs[[0, 0, 2]] = value;
    write_recording(&policy.join("calib.npz"), &obs, None, [1, 1, length])
}

#[test]
fn bad_policies_are_named_and_leave_no_file() -> Result<()> {
    all(SPOILT.iter().map(|(what, spoil, options, words)| {
        let run = || {
            let fixture = Fixture::new()?;
            spoil(&fixture.policy())?;
            let out = fixture.out("image.actq");
            for old in [None, Some("an image that is in use")] {
                if let Some(old) = old {
                    fs::write(&out, old)?;
                }
                let before = fixture.snapshot()?;
                failed(&fixture.quantize(&out, options)?, 1, words)?;
                ensure!(fixture.snapshot()? == before, "files have changed");
            }
            Ok(())
        };
        ((*what).to_owned(), run())
    }))
}

/// What an exporter tells people about a policy.
#[test]
fn keys_for_people_change_nothing() -> Result<()> {
    let fixture = Fixture::new()?;
    let before = fs::read(fixture.image("")?)?;
    let mut json = description();
    for (key, value) in [("source", "a\nb"), ("commit", ""), ("source_path", "x.pt"), ("license", "MIT")] {
        json[key] = value.into();
    }
    (json["recurrent"], json["n_params"]) = (json!(false), json!(12345));
    write_json(&fixture.policy(), &json)?;
    let after = fs::read(fixture.image("")?)?;
    // The folder's digest differs, and with it the checksum.
    assert_eq!(before[128..], after[128..]);
    Ok(())
}

#[test]
fn what_a_file_says_cannot_command_the_terminal() -> Result<()> {
    let fixture = Fixture::new()?;
    // No image holds such a name.
    let mut policy = Policy::load(&fixture.policy())?;
    policy.name = "arm\x1b[2J\nmatrix\u{9b}".to_owned();
    let options = Options::new(Method::Rtn, Budget::Width(Width::W4));
    let refused = pipeline::quantize(&policy, &Recordings::default(), &options, |_, _| {}).map(|_| ());
    ensure!(format!("{:#}", refused.expect_err("a name")).contains("control characters"));

    // The names of tensors in a message, and those of matrices in statistics.
    let view = TensorView::new(Dtype::F32, vec![1], &[0; 4])?;
    fs::write(fixture.policy().join("policy.safetensors"), serialize([("w\x1b[2J", view)], None)?)?;
    let output = fixture.quantize(&fixture.out("other.actq"), "")?;
    failed(&output, 1, &["the file holds w\\u{1b}[2J"])?;
    ensure!(!output.stderr.contains(&0x1b), "{:?}", String::from_utf8_lossy(&output.stderr));
    write_tensors(&fixture.policy(), &tensors())?;
    let (named, stats) = (fixture.out("stats.actq"), fixture.out("stats.json"));
    succeeded(&fixture.quantize(&named, &format!("--save-stats {}", text(&stats)))?)?;
    fs::write(&stats, fs::read_to_string(&stats)?.replace("mid.weight", "mid\\u001b[2J\\n.weight"))?;
    let report = run(actq(&["inspect", &text(&named), "--widths", "--stats", &text(&stats)]), b"")?;
    ensure!(succeeded(&report)?.contains("mid\\u{1b}[2J\\n.weight"), "{:?}", String::from_utf8_lossy(&report.stdout));
    Ok(())
}

/// As an exporter writes it that puts out every key.
#[test]
fn a_key_without_a_value_says_nothing() -> Result<()> {
    let fixture = Fixture::new()?;
    let before = fs::read(fixture.image("")?)?;
    edit(&fixture.policy(), "/ops/2/clip", Value::Null)?;
    let after = fs::read(fixture.image("")?)?;
    // The folder's digest differs, and with it the checksum.
    assert_eq!(before[128..], after[128..]);
    Ok(())
}

#[test]
fn an_output_that_cannot_be_written_leaves_no_file() -> Result<()> {
    let fixture = Fixture::new()?;
    fs::create_dir(fixture.out("folder"))?;
    let before = fixture.snapshot()?;
    all(["none/image.actq", "folder"].map(|name| {
        let out = fixture.out(name);
        (name.to_owned(), fixture.quantize(&out, "").and_then(|output| failed(&output, 1, &[&text(&out)])))
    }))?;
    ensure!(fixture.snapshot()? == before, "files have changed");
    Ok(())
}

#[test]
fn damaged_images_are_refused_by_every_command() -> Result<()> {
    let fixture = Fixture::new()?;
    let good = fs::read(fixture.image("")?)?;
    let flipped = |at: usize| {
        let mut bytes = good.clone();
        bytes[at] ^= 1 << (at % 8);
        (format!("bit flipped in byte {at}"), bytes)
    };
    // Every word of the header, and samples of the rest.
    let flips = (0..good.len()).filter(|at| at % 4 == 1 && (*at < 128 || at % 509 == 0)).chain([good.len() - 1]);
    let shorter = [0, 1, 3, 100, 128, good.len() / 2, good.len() - 4, good.len() - 1];
    let longer = ("four bytes more".to_owned(), [&good[..], &[0; 4]].concat());
    let damaged = flips
        .map(flipped)
        .chain(shorter.map(|len| (format!("{len} bytes left"), good[..len].to_vec())))
        .chain([longer]);
    let path = fixture.out("damaged.actq");
    let (image, policy) = (text(&path), text(&fixture.policy()));
    let commands: [&[&str]; 4] = [
        &["inspect", &image],
        &["eval", &image, "--policy", &policy],
        &["eval", &image, "--policy", &policy, "--json"],
        &["serve", &image],
    ];
    let refused = |bytes: &[u8]| {
        fs::write(&path, bytes)?;
        commands.iter().try_for_each(|command| {
            let output = run(actq(command), &[RESET])?;
            ensure!(output.stdout.is_empty(), "{command:?} prints something");
            failed(&output, 1, &[&image]).with_context(|| format!("{command:?}"))
        })
    };
    all(damaged.map(|(what, bytes)| (what, refused(&bytes))))?;
    fs::remove_file(&path)?;
    all(commands.map(|command| {
        (
            format!("{command:?} without a file"),
            run(actq(command), b"").and_then(|output| failed(&output, 1, &[&image])),
        )
    }))
}

#[test]
fn eval_names_what_is_wrong_with_a_recording() -> Result<()> {
    let fixture = Fixture::new()?;
    let image = text(&fixture.image("")?);
    let path = fixture.policy().join("heldout.npz");
    let (obs, full) = (draw_observations(1, OBS), [STEPS as i64; EPISODES]);
    let action = |width| Array3::<f32>::zeros((EPISODES, STEPS, width));
    let eval = |words: &[&str]| {
        let output = run(actq(&["eval", &image, "--policy", &text(&fixture.policy()), "--json"]), b"")?;
        ensure!(output.stdout.is_empty(), "something is printed");
        failed(&output, 1, words)
    };
    write_recording(&path, &obs, Some(&action(ACT)), full)?;
    eval(&["heldout.npz", "action"]).context("actions of another width")?;
    write_recording(&path, &draw_observations(1, OBS - 1), Some(&action(CHUNK * ACT)), full)?;
    eval(&["heldout.npz", "obs"]).context("observations of another width")?;
    write_recording(&path, &obs, Some(&action(CHUNK * ACT)), full)?;
    eval(&["heldout.npz", "vary"]).context("actions that never vary")?;
    write_recording(&path, &obs, Some(&action(CHUNK * ACT)), [0; EPISODES])?;
    eval(&["heldout.npz"]).context("no steps")?;
    fs::remove_file(&path)?;
    eval(&["heldout.npz"]).context("no recording")
}

/// Writes a recording's observations alone.
fn write_npy(path: &Path, obs: &Array3<f32>) -> Result<()> {
    Ok(obs.write_npy(File::create(path)?)?)
}

#[test]
fn a_recording_may_be_named_and_of_any_format() -> Result<()> {
    let fixture = Fixture::new()?;
    let policy = fixture.policy();
    let image = fs::read(fixture.image("--bits 3 --group 32")?)?;
    // Another name and another format, the same frames: the same image.
    let obs = draw_observations(5, OBS);
    let named = fixture.out("mine.safetensors");
    let bytes: Vec<u8> = obs.iter().flat_map(|v| f64::from(*v).to_le_bytes()).collect();
    let length: Vec<u8> = [STEPS as i32, 7, STEPS as i32].iter().flat_map(|n| n.to_le_bytes()).collect();
    let views = [
        ("obs", TensorView::new(Dtype::F64, vec![EPISODES, STEPS, OBS], &bytes)?),
        ("length", TensorView::new(Dtype::I32, vec![EPISODES], &length)?),
    ];
    fs::write(&named, serialize(views, None)?)?;
    fs::remove_file(policy.join("calib.npz"))?;
    let options = format!("--bits 3 --group 32 --calib {}", text(&named));
    let out = fixture.out("named.actq");
    succeeded(&fixture.quantize(&out, &options)?)?;
    assert_eq!(fs::read(&out)?, image);
    // Where there is a recording, wherever it is, the default is the method that learns.
    failed(&fixture.quantize_as_given(&out, &options)?, 1, &["mine.safetensors", "frames", "200"])?;
    let missing = fixture.quantize(&out, "--calib none.npz")?;
    failed(&missing, 1, &["none.npz: cannot be read"])
}

#[test]
fn eval_takes_a_named_recording_and_asks_the_policy_for_its_actions() -> Result<()> {
    let fixture = Fixture::new()?;
    let image = text(&fixture.image("--bits 4")?);
    let policy = text(&fixture.policy());
    let heldout = fixture.policy().join("heldout.npz");
    let named = fixture.out("drive.npz");
    fs::rename(&heldout, &named)?;
    let eval = |arguments: &[&str]| run(actq(&[&["eval", &image, "--json"], arguments].concat()), b"");
    let expected = succeeded(&eval(&["--heldout", &text(&named)])?)?;
    assert_eq!(serde_json::from_str::<Value>(&expected)?["steps"], json!(2 * STEPS + 7));
    failed(
        &eval(&["--policy", &policy])?,
        1,
        &["actq eval needs recorded observations: put heldout.npz, heldout.npy or heldout.safetensors", "--heldout"],
    )?;
    failed(&eval(&[])?, 2, &["--policy"])?;
    // Observations alone: the image's own policy gives the actions, another does not.
    write_recording(&heldout, &draw_observations(6, OBS), None, [STEPS as i64, 7, STEPS as i64])?;
    assert_eq!(succeeded(&eval(&["--policy", &policy])?)?, expected);
    failed(&eval(&["--heldout", &text(&heldout)])?, 1, &["heldout.npz: array \"action\" is missing", "--policy"])?;
    fs::remove_file(&heldout)?;
    write_npy(&fixture.policy().join("heldout.npy"), &draw_observations(6, OBS))?;
    let all: Value = serde_json::from_str(&succeeded(&eval(&["--policy", &policy])?)?)?;
    assert_eq!(all["steps"], json!(EPISODES * STEPS));
    edit(&fixture.policy(), "/control_hz", json!(26))?;
    failed(&eval(&["--policy", &policy])?, 1, &["heldout.npy: array \"action\" is missing"])
}

#[test]
fn sweep_takes_named_recordings() -> Result<()> {
    let fixture = Fixture::new()?;
    let policy = fixture.policy();
    let (calib, heldout) = (fixture.out("c.npz"), fixture.out("h.npz"));
    fs::rename(policy.join("calib.npz"), &calib)?;
    fs::rename(policy.join("heldout.npz"), &heldout)?;
    let sweep = |more: &[&str]| {
        let policy = text(&policy);
        run(actq(&[&["sweep", &policy, "--methods", "rtn,gptq", "--bpw", "4"], more].concat()), b"")
    };
    failed(&sweep(&[])?, 1, &["actq sweep needs recorded observations: put heldout.npz", "--heldout"])?;
    failed(
        &sweep(&["--heldout", &text(&heldout)])?,
        1,
        &["gptq needs recorded observations: put calib.npz", "--calib"],
    )?;
    let table = succeeded(&sweep(&["--heldout", &text(&heldout), "--calib", &text(&calib)])?)?;
    ensure!(table.contains("4 bits") && table.contains("gptq"), "{table}");
    Ok(())
}

/// Lines on standard error, all of them notes.
fn notes(output: &Output) -> Result<Vec<String>> {
    succeeded(output)?;
    let text = String::from_utf8(output.stderr.clone())?;
    let lines: Vec<String> = text.lines().map(str::to_owned).collect();
    ensure!(!text.contains(['\r', '\x1b']) && lines.iter().all(|line| line.starts_with("note: ")), "{text:?}");
    Ok(lines)
}

#[test]
fn quantize_tells_both_errors_and_what_is_wrong_with_the_recordings() -> Result<()> {
    let fixture = Fixture::new()?;
    let policy = fixture.policy();
    let out = fixture.out("image.actq");
    let quantize = || fixture.quantize(&out, "--bits 8");
    // Every held-out value is within the calibrated range; no progress bar, no escape sequences where nobody looks.
    let wide = 1.3 * draw_observations(5, OBS);
    write_recording(&policy.join("calib.npz"), &wide, None, [STEPS as i64; EPISODES])?;
    let output = quantize()?;
    assert_eq!(notes(&output)?, Vec::<String>::new());
    let report = succeeded(&output)?;
    let number = |name: &str| -> Result<f64> {
        let line =
            report.lines().find_map(|line| line.strip_prefix(name)).with_context(|| format!("{name}: {report}"))?;
        Ok(line.split_whitespace().next().context("no number")?.trim_end_matches('%').parse()?)
    };
    let nmse = fixture.eval(&out)?["nmse"].as_f64().context("nmse")?;
    ensure!((number("held-out nmse")? / nmse - 1.0).abs() < 1e-3, "{nmse} in {report}");
    ensure!(number("calibration nmse")? > 0.0);
    // At 8 bits most of the error comes from the activations.
    ensure!((20.0..=100.0).contains(&number("activations")?) && report.contains("of the error (int8)"), "{report}");
    let people = succeeded(&run(actq(&["eval", &text(&out), "--policy", &text(&policy)]), b"")?)?;
    ensure!(people.contains("activations") && people.contains("of the error (int8)"), "{people}");

    // Two dimensions stand still in the recording, and one of them moves in the other.
    let mut obs = draw_observations(5, OBS);
    for row in obs.rows_mut() {
        let mut row = row;
        (row[4], row[5]) = (0.5, 0.25);
    }
    write_npy(&policy.join("calib.npy"), &obs)?;
    fs::remove_file(policy.join("calib.npz"))?;
    let mut moving = draw_observations(6, OBS);
    moving.rows_mut().into_iter().for_each(|mut row| row[4] = 0.5);
    write_recording(&policy.join("heldout.npz"), &moving, None, [STEPS as i64, 7, STEPS as i64])?;
    let warnings = notes(&quantize()?)?;
    ensure!(warnings.len() == 2, "{warnings:?}");
    ensure!(warnings[0].starts_with("note: observation dimensions 4-5 never change in calib.npy: "), "{warnings:?}");
    let outside = "note: 100.0% of the observations in heldout.npz leave the range of calib.npy by more than 10% of it, in \
                   dimensions 5 (100.0%)";
    ensure!(warnings[1].starts_with(outside), "{warnings:?}");
    let eval = run(actq(&["eval", &text(&out), "--policy", &text(&policy), "--json"]), b"")?;
    assert_eq!(notes(&eval)?, warnings[1..]);
    // A broken recording to compare with does not keep eval from its work.
    cut(&policy.join("calib.npy"), 100)?;
    let eval = notes(&run(actq(&["eval", &text(&out), "--policy", &text(&policy), "--json"]), b"")?)?;
    ensure!(eval.len() == 1 && eval[0].starts_with("note: the calibrated range is not known: "), "{eval:?}");
    Ok(())
}

#[test]
fn an_image_that_fits_its_calibration_alone_is_warned_of() -> Result<()> {
    let fixture = Fixture::new()?;
    // Held out are small motions, beside which the error that was small for large ones is large.
    let obs = 0.05 * draw_observations(6, OBS);
    write_recording(&fixture.policy().join("heldout.npz"), &obs, None, [STEPS as i64; EPISODES])?;
    let warnings = notes(&fixture.quantize(&fixture.out("image.actq"), "--bits 2")?)?;
    ensure!(warnings.len() == 1 && warnings[0].contains("times the calibration error"), "{warnings:?}");
    Ok(())
}

/// Ctrl-C while the quantizer learns.
#[cfg(unix)]
#[test]
fn an_interrupt_leaves_no_file() -> Result<()> {
    use std::os::unix::process::ExitStatusExt as _;
    let fixture = Fixture::new()?;
    let random = &mut Random::new(8);
    let obs = Array3::from_shape_simple_fn((1, 300, OBS), || 2.0 * random.unit());
    fs::remove_file(fixture.policy().join("calib.npz"))?;
    write_npy(&fixture.policy().join("calib.npy"), &obs)?;
    let out = fixture.out("image.actq");
    fs::write(&out, "an image that is in use")?;
    let before = fixture.snapshot()?;
    let policy = text(&fixture.policy());
    let mut command = actq(&["quantize", &policy, "--method", "best", "--steps", "100000000", "--out", &text(&out)]);
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn()?;
    sleep(Duration::from_secs(1));
    ensure!(child.try_wait()?.is_none(), "the command has ended by itself");
    interrupt(&child)?;
    let output = child.wait_with_output()?;
    assert_eq!(output.status.signal(), Some(15), "{output:?}");
    ensure!(fixture.snapshot()? == before, "files have changed");
    Ok(())
}

#[cfg(unix)]
fn interrupt(child: &Child) -> Result<()> {
    // SIGTERM ends the command as Ctrl-C does: it has a handler for neither. SIGINT is ignored by all that a shell starts in the
    // background, tests and their children among it. A child that has just ended cannot be interrupted, which is no error.
    Command::new("kill").args(["-TERM", &child.id().to_string()]).stderr(Stdio::null()).status()?;
    Ok(())
}

/// Interrupts all over the time that the command takes, the writing among it: the old image is there, or the whole new one.
#[cfg(unix)]
#[test]
fn an_interrupt_at_any_time_leaves_a_whole_image() -> Result<()> {
    const TRIES: u32 = 40;
    let fixture = Fixture::new()?;
    let out = fixture.out("image.actq");
    let (policy, file) = (text(&fixture.policy()), text(&out));
    let start = || {
        let mut command = actq(&["quantize", &policy, "--method", "rtn", "--out", &file]);
        command.stdout(Stdio::null()).stderr(Stdio::null()).spawn()
    };
    // The first one may have to wait for the command to be built.
    ensure!(start()?.wait()?.success());
    let began = Instant::now();
    ensure!(start()?.wait()?.success());
    let (whole, time) = (fs::read(&out)?, began.elapsed());
    let mut seen = [0; 2];
    for i in 0..TRIES {
        fs::write(&out, "old")?;
        let mut child = start()?;
        sleep(time * i / TRIES);
        interrupt(&child)?;
        child.wait()?;
        let found = fs::read(&out)?;
        ensure!(found == b"old" || found == whole, "{} bytes after interrupt {i}", found.len());
        seen[usize::from(found == whole)] += 1;
    }
    ensure!(seen[0] > 0, "no interrupt came in time: {seen:?}");
    Ok(())
}

/// `actq inspect image | head -1` is how people use it.
#[test]
fn a_reader_that_goes_away_is_no_panic() -> Result<()> {
    let fixture = Fixture::new()?;
    let image = text(&fixture.image("")?);
    let (policy, out) = (text(&fixture.policy()), text(&fixture.out("other.actq")));
    let commands: [&[&str]; 3] =
        [&["inspect", &image], &["eval", &image, "--policy", &policy], &["quantize", &policy, "--out", &out]];
    all(commands.map(|command| {
        let run = || {
            let (reader, writer) = std::io::pipe()?;
            drop(reader);
            let output = actq(command).stdout(writer).stderr(Stdio::piped()).spawn()?.wait_with_output()?;
            let message = String::from_utf8_lossy(&output.stderr);
            ensure!(!message.contains("panicked"), "{message}");
            Ok(())
        };
        (command[0].to_owned(), run())
    }))
}
