//! Policies: a message names each fault, and human-readable keys change nothing.

use std::fs;
use std::path::Path;

use actq::budget::Budget;
use actq::data::Recordings;
use actq::methods::{Method, Options};
use actq::pipeline;
use actq::policy::Policy;
use actq_bench::command::{actq, all, failed, run, succeeded};
use actq_kernels::Width;
use actq_testkit::{Dtype, f32_tensors};
use anyhow::{Context, Result, ensure};
use serde_json::{Value, json};

use super::fixture::{
    Fixture, HIDDEN, OBS, cut, description, draw_observations, edit, floats, replace, tensors, text, write_json,
    write_recording, write_tensors,
};

/// A change of the policy's folder, and the words of the message.
type Fault = (&'static str, fn(&Path) -> Result<()>, &'static [&'static str]);

const FAULTS: &[Fault] = &[
    ("no folder", |p| Ok(fs::remove_dir_all(p)?), &["policy"]),
    ("no policy.json", |p| Ok(fs::remove_file(p.join("policy.json"))?), &["policy.json"]),
    ("no weights", |p| Ok(fs::remove_file(p.join("policy.safetensors"))?), &["policy.safetensors"]),
    ("not JSON", |p| Ok(fs::write(p.join("policy.json"), "{\"name\": ")?), &["policy.json"]),
    ("not an object", |p| write_json(p, &json!([1, 2])), &["policy.json"]),
    ("truncated weights", |p| cut(&p.join("policy.safetensors"), 100), &["policy.safetensors"]),
    ("weights empty", |p| cut(&p.join("policy.safetensors"), 0), &["policy.safetensors"]),
    ("unknown op", |p| edit(p, "/ops/2", json!({"op": "swish"})), &["policy.json", "op 2", "swish"]),
    (
        "unknown key",
        |p| edit(p, "/ops/1/bias", json!("in.bias")),
        &["policy.json: op 1 (linear) has the key \"bias\"; its keys are op, input, save, w, b"],
    ),
    (
        "key of another op",
        |p| edit(p, "/ops/2/clip", json!(5)),
        &["policy.json: op 2 (tanh) has the key \"clip\"; its keys are op, input, save"],
    ),
    (
        "misspelt key",
        |p| edit(p, "/actoin", json!({"low": [0, 0, 0]})),
        &["policy.json: the key \"actoin\" is not known; the keys are name, kind,", "action, ops", "source"],
    ),
    ("key of another kind", |p| edit(p, "/euler_steps", json!(10)), &["policy.json", "euler_steps"]),
    (
        "key twice",
        |p| twice(p, "\"obs_dim\""),
        &["policy.json: not a policy description: the key \"obs_dim\" occurs twice"],
    ),
    ("key of an op twice", |p| twice(p, "\"clip\""), &["policy.json", "the key \"clip\" occurs twice"]),
    ("limits twice", |p| twice(p, "\"low\""), &["policy.json", "the key \"low\" occurs twice"]),
    ("tensor twice", tensor_twice, &["policy.safetensors", "the key \"out.weight\" occurs twice"]),
    (
        "control character in the name",
        |p| edit(p, "/name", json!("arm\u{1b}[2J")),
        &["policy.json: name \"arm\\u{1b}[2J\" holds the control character U+001B"],
    ),
    (
        "control character in a slot",
        |p| edit(p, "/ops/2/save", json!("h\n")),
        &["policy.json: ops[2].save \"h\\n\" holds the control character U+000A"],
    ),
    ("clip beyond f32", |p| edit(p, "/ops/0/clip", json!(1e39)), &["op 0", "clip is 1e39, beyond float32's range"]),
    ("pre_clip beyond f32", |p| edit(p, "/ops/0/pre_clip", json!(1e39)), &["op 0", "pre_clip is 1e39, beyond"]),
    (
        "clip below f32",
        |p| edit(p, "/ops/0/clip", json!(1e-50)),
        &["op 0", "clip is ", "; float32 rounds that to 0, and it must be above 0"],
    ),
    ("clip 0", |p| edit(p, "/ops/0/clip", json!(0)), &["op 0", "clip is 0.0; it must be above 0"]),
    ("eps beyond f32", |p| edit(p, "/ops/2", norm(1e39)), &["op 2", "eps is 1e39, beyond float32's range"]),
    ("eps below f32", |p| edit(p, "/ops/2", norm(1e-50)), &["op 2", "eps is ", "float32 rounds that to 0"]),
    ("rate beyond f32", |p| edit(p, "/control_hz", json!(1e39)), &["control_hz is 1e39, beyond float32's range"]),
    ("rate below f32", |p| edit(p, "/control_hz", json!(1e-50)), &["control_hz is ", "float32 rounds that to 0"]),
    (
        "limit beyond f32",
        |p| edit(p, "/action/high", json!([1, 1e39, 3])),
        &["policy.json: action.high[1] is 1e39, beyond float32's range"],
    ),
    (
        "weight beyond f32",
        |p| replace(p, "in.bias", Dtype::F64, &[HIDDEN], [-1e39f64; HIDDEN].map(f64::to_le_bytes).concat()),
        &["policy.safetensors", "op 1", "tensor \"in.bias\" holds -1e39, beyond float32's range, at position 0"],
    ),
    ("no op", |p| edit(p, "/ops", json!([])), &["policy.json", "ops"]),
    ("no w", |p| edit(p, "/ops/3", json!({"op": "linear"})), &["policy.json", "op 3", "linear"]),
    ("no such tensor", |p| edit(p, "/ops/3/w", json!("gone")), &["policy.safetensors", "op 3", "gone"]),
    ("wrong shape", |p| matrix(p, HIDDEN, OBS), &["policy.safetensors", "op 3", "mid.weight"]),
    ("no matrix", |p| edit(p, "/ops/3/w", json!("in.bias")), &["policy.safetensors", "op 3", "in.bias"]),
    ("wrong bias", |p| edit(p, "/ops/3/b", json!("out.bias")), &["policy.safetensors", "op 3", "out.bias"]),
    ("NaN weight", |p| bias(p, f32::NAN), &["policy.safetensors", "op 1", "in.bias", "NaN"]),
    ("infinite weight", |p| bias(p, f32::INFINITY), &["policy.safetensors", "op 1", "in.bias", "inf"]),
    (
        "integer tensor",
        |p| replace(p, "in.bias", Dtype::I64, &[HIDDEN], vec![0; 8 * HIDDEN]),
        &["policy.safetensors", "op 1", "in.bias", "int64"],
    ),
    ("slot not saved", |p| edit(p, "/ops/4/with", json!("skip")), &["policy.json", "op 4", "skip"]),
    ("slot saved later", |p| edit(p, "/ops/1/input", json!("h")), &["policy.json", "op 1", "\"h\""]),
    ("slice too long", |p| edit(p, "/ops/0/input", json!("obs[3:41]")), &["policy.json", "op 0", "obs[3:41]"]),
    ("slice reversed", |p| edit(p, "/ops/0/input", json!(["obs[3:1]"])), &["policy.json", "op 0", "obs[3:1]"]),
    ("no slice", |p| edit(p, "/ops/0/input", json!("obs[-1]")), &["policy.json", "op 0", "obs[-1]"]),
    ("no input", |p| edit(p, "/ops/0/input", json!([])), &["policy.json", "op 0", "input"]),
    ("unequal sum", |p| edit(p, "/ops/4/with", json!("obs")), &["policy.json", "op 4", "add"]),
    ("another act_dim", |p| edit(p, "/act_dim", json!(5)), &["policy.json", "act_dim"]),
    ("no act_dim", |p| edit(p, "/act_dim", Value::Null), &["policy.json"]),
    ("act_dim 0", |p| edit(p, "/act_dim", json!(0)), &["policy.json", "act_dim"]),
    ("unknown kind", |p| edit(p, "/kind", json!("flow")), &["policy.json", "flow"]),
    ("execute beyond chunk", |p| edit(p, "/execute", json!(5)), &["policy.json", "execute"]),
    // Sizes whose products do not fit a usize.
    ("vast chunk", |p| edit(p, "/chunk", json!(1u64 << 63)), &["policy.json", "chunk"]),
    ("vast hidden", |p| edit(p, "/ops/2", vast_lstm()), &["policy.json", "op 2", "hidden"]),
    ("vast obs_dim", |p| edit(p, "/obs_dim", json!(u64::MAX)), &["policy.json"]),
    ("long contract", |p| edit(p, "/action/low", json!([0, 0, 0, 0])), &["policy.json", "low"]),
    ("unknown contract", |p| edit(p, "/action/lowest", json!([0, 0, 0])), &["policy.json", "lowest"]),
    ("limits reversed", |p| edit(p, "/action/low", json!([0, 2, 0])), &["policy.json", "low"]),
    ("negative step", |p| edit(p, "/action/max_step", json!([1, -1, 1])), &["policy.json", "max_step"]),
    ("smoothing 0", |p| edit(p, "/action/smoothing", json!([1, 0, 1])), &["action.smoothing must be above 0"]),
    ("mean without std", |p| edit(p, "/action/mean", json!([0, 0, 0])), &["action has only one of mean and std"]),
    ("std 0", |p| both(p, ["mean", "std"], [json!([0, 0, 0]), json!([1, 0, 1])]), &["action.std[1] is 0.0"]),
    (
        "quantiles reversed",
        |p| both(p, ["q01", "q99"], [json!([0, null, 2]), json!([1, null, 1])]),
        &["action.q01[2] is 2.0, above action.q99[2], 1.0"],
    ),
    (
        "a quantile without the other",
        |p| both(p, ["q01", "q99"], [json!([0, 0, 0]), json!([1, null, 1])]),
        &["only one of action.q01[1] and action.q99[1] is null"],
    ),
    (
        "two ways to denormalize",
        |p| {
            both(p, ["mean", "std"], [json!([0, 0, 0]), json!([1, 1, 1])])?;
            let path = p.join("policy.json");
            let mut policy: Value = serde_json::from_slice(&fs::read(&path)?)?;
            policy["action"]["q01"] = json!([0, 0, 0]);
            policy["action"]["q99"] = json!([1, 1, 1]);
            Ok(fs::write(path, policy.to_string())?)
        },
        &["mean and std, and q01 and q99; remove one pair"],
    ),
    ("scale null", |p| edit(p, "/action/scale", json!([1, null, 1])), &["action.scale[1] is null"]),
    ("binarise in part", |p| edit(p, "/action/binarise", json!({"on": [1, 1, 1]})), &["action.binarise.off"]),
    ("thresholds reversed", |p| edit(p, "/action/binarise", binarise([0.5, 0.6], [1, 0])), &["binarise.off exceeds"]),
    ("one value", |p| edit(p, "/action/binarise", binarise([0.6, 0.5], [1, 1])), &["off_value[2] are both 1"]),
    ("overlap", |p| edit(p, "/overlap", json!(3)), &["overlap is 3, but only 2 actions of a chunk are left"]),
    ("deadline", |p| edit(p, "/deadline", json!(1)), &["deadline is 1; it must be 2"]),
    ("ensemble", |p| edit(p, "/ensemble", json!({"horizon": 4})), &["execute is 2", "execute must be 1"]),
    (
        "horizon 0",
        |p| edit(p, "/ensemble", json!({"horizon": 0})),
        &["ensemble.horizon is 0; it must be 1 to chunk (4)"],
    ),
    ("unknown ensemble", |p| edit(p, "/ensemble", json!({"horizons": 4})), &["policy.json", "horizons"]),
    ("control rate 0", |p| edit(p, "/control_hz", json!(0)), &["policy.json", "control_hz"]),
    (
        "no recording",
        |p| Ok(fs::remove_file(p.join("calib.npz"))?),
        &[
            "gptq needs recorded observations: put calib.npz, calib.npy or calib.safetensors beside policy.json",
            "--calib",
        ],
    ),
    (
        "two recordings",
        |p| Ok(fs::write(p.join("calib.npy"), "")?),
        &["policy: calib.npz and calib.npy are present; remove all but one"],
    ),
    (
        "two held-out recordings",
        |p| Ok(fs::write(p.join("heldout.safetensors"), "")?),
        &["heldout.npz and heldout.safetensors are present"],
    ),
    ("truncated held-out recording", |p| cut(&p.join("heldout.npz"), 100), &["heldout.npz", "truncated"]),
    ("too few frames", |p| calib(p, OBS, 0.0, 13), &["calib.npz", "it has 15 frames, but 16 are needed"]),
    ("truncated recording", |p| cut(&p.join("calib.npz"), 100), &["calib.npz"]),
    ("recording empty", |p| cut(&p.join("calib.npz"), 0), &["calib.npz"]),
    ("wider recording", |p| calib(p, OBS + 1, 0.0, 1), &["calib.npz", "obs", "41", "40"]),
    ("recorded NaN", |p| calib(p, OBS, f32::NAN, 1), &["calib.npz", "obs", "NaN"]),
    ("length beyond the array", |p| calib(p, OBS, 0.0, 21), &["calib.npz", "21", "20"]),
    ("negative length", |p| calib(p, OBS, 0.0, -1), &["calib.npz", "length"]),
];

/// The policy with two more keys in `action`.
fn both(policy: &Path, keys: [&str; 2], values: [Value; 2]) -> Result<()> {
    let mut json = description();
    for (key, value) in keys.into_iter().zip(values) {
        json["action"][key] = value;
    }
    Ok(fs::write(policy.join("policy.json"), json.to_string())?)
}

/// Sets a value for the last of three actions.
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

/// Gives a tensor the name of another one of equal length.
fn tensor_twice(policy: &Path) -> Result<()> {
    let path = policy.join("policy.safetensors");
    let mut bytes = fs::read(&path)?;
    let (from, to) = (b"mid.weight", b"out.weight");
    let at = bytes.windows(from.len()).position(|part| part == from).context("the file has no such name")?;
    bytes[at..at + to.len()].copy_from_slice(to);
    Ok(fs::write(&path, bytes)?)
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
fn faulty_policies_are_named_and_leave_no_file() -> Result<()> {
    let is_refused = |change: fn(&Path) -> Result<()>, options: &str, words: &[&str]| {
        let fixture = Fixture::new()?;
        change(&fixture.policy())?;
        let out = fixture.out("image.actq");
        for old in [None, Some("ACTQ: an image that is in use")] {
            if let Some(old) = old {
                fs::write(&out, old)?;
            }
            let before = fixture.snapshot()?;
            failed(&fixture.quantize(&out, options)?, 1, words)?;
            ensure!(fixture.snapshot()? == before, "files changed");
        }
        Ok(())
    };
    let few = "it has 47 frames, but 200 are needed: learning from fewer overfits";
    let learning = is_refused(|_| Ok(()), "--method distill", &["calib.npz", few]);
    let faults = FAULTS.iter().map(|(what, change, words)| ((*what).to_owned(), is_refused(*change, "", words)));
    all(faults.chain([("too few frames to learn from".to_owned(), learning)]))
}

/// Keys with which an exporter describes a policy to people.
#[test]
fn human_readable_keys_change_nothing() -> Result<()> {
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
fn file_content_cannot_control_the_terminal() -> Result<()> {
    let fixture = Fixture::new()?;
    // No image holds such a name.
    let mut policy = Policy::load(&fixture.policy())?;
    policy.name = "arm\x1b[2J\nmatrix\u{9b}".to_owned();
    let options = Options::new(Method::Rtn, Budget::Width(Width::W4));
    let refused = pipeline::quantize(&policy, &Recordings::default(), &options, ()).map(|_| ());
    ensure!(format!("{:#}", refused.expect_err("a name")).contains("control characters"));

    // The names of tensors in a message, and those of matrices in statistics.
    fs::write(fixture.policy().join("policy.safetensors"), f32_tensors([("w\x1b[2J", [1], [0.0])]))?;
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

/// Like an exporter that writes every key.
#[test]
fn a_key_without_value_counts_as_absent() -> Result<()> {
    let fixture = Fixture::new()?;
    let before = fs::read(fixture.image("")?)?;
    edit(&fixture.policy(), "/ops/2/clip", Value::Null)?;
    let after = fs::read(fixture.image("")?)?;
    // The folder's digest differs, and with it the checksum.
    assert_eq!(before[128..], after[128..]);
    Ok(())
}
