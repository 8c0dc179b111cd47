//! Policies whose attention reads a prefix: from policy.json and recordings to images.

use std::mem::MaybeUninit;
use std::path::Path;

use actq::data::arrays;
use actq::methods::Activations;
use actq::policy::Policy;
use actq::runtime::{ImageBuffer, prefix_bytes, take_prefix, with_head};
use actq_bench::command::{actq, failed, run, succeeded};
use actq_bench::rtn;
use actq_c::{
    Code, actq_begin, actq_clear_prefix, actq_head_init, actq_image_open, actq_prefix_bytes, actq_set_prefix, actq_step,
};
use actq_kernels::image::Cache;
use actq_kernels::{StepError, Width};
use actq_testkit::Random;
use anyhow::{Context as _, Result};
use ndarray::Array3;
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::folder::{write_observations, write_policy};

const TOKENS: usize = 5;
/// Keys or values of all tokens: one head of 4 elements.
const EACH: usize = 4 * TOKENS;
const OBS: usize = 3;

/// Writes a policy of three values, whose eight queries of one token attend to a prefix; the slot `own` has two tokens of keys
/// or values. `more` are further keys of that op.
fn write(folder: &Path, more: Value) -> Result<()> {
    let mut attention = json!({"op": "attention", "heads": 2, "kv_heads": 1, "dim": 4, "prefix": TOKENS});
    if let (Some(to), Value::Object(more)) = (attention.as_object_mut(), more) {
        to.extend(more);
    }
    let own = json!({"op": "linear", "w": "k", "save": "own"});
    let queries = json!({"op": "linear", "input": "obs", "w": "q", "b": "bq"});
    let ops = [own, queries, attention, json!({"op": "linear", "w": "o"})];
    let mut random = Random::new(21);
    let mut draw = |n: usize| (0..n).map(|_| random.unit()).collect::<Vec<f32>>();
    let tensors = [
        ("q", vec![8, OBS], draw(8 * OBS)),
        ("bq", vec![8], draw(8)),
        ("o", vec![2, 8], draw(16)),
        ("k", vec![8, OBS], draw(8 * OBS)),
    ];
    write_policy(folder, &json!({"name": "prefixed", "obs_dim": OBS, "act_dim": 2, "ops": ops}), tensors)
}

#[test]
fn an_image_reads_the_prefix_of_its_policy() -> Result<()> {
    let dir = TempDir::new()?;
    write(dir.path(), json!({}))?;
    let policy = Policy::load(dir.path())?;
    assert_eq!((policy.graph.own_len(), policy.graph.prefix_len), (OBS, 2 * EACH));
    let bytes = rtn(&policy, Width::W8, 32, Activations::Int8)?;
    let buffer = ImageBuffer::new(&bytes);
    let image = buffer.image(dir.path())?;
    assert!(image.prefix_caches().eq([Cache { heads: 1, dim: 4, slots: TOKENS, own: 0 }]));
    assert_eq!(image.obs_len(), OBS);
    let mut random = Random::new(22);
    let row: Vec<f32> = (0..OBS + 2 * EACH).map(|_| random.unit()).collect();
    let (keys, values) = row[OBS..].split_at(EACH);
    let expected = actq::graph::Evaluator::new(&policy.graph).step(&row, &mut |_, _| {});
    with_head::<_, anyhow::Error>(image, |head| {
        assert_eq!(head.step(&row[..OBS]), Err(StepError::NoPrefix));
        head.set_prefix(&prefix_bytes(&image, &[[keys, values]])?)?;
        let action = head.step(&row[..OBS])?.to_vec();
        assert!(action.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 0.05), "{action:?} for {expected:?}");
        // Fewer tokens are another prefix.
        head.set_prefix(&prefix_bytes(&image, &[[&keys[..4], &values[..4]]])?)?;
        assert_ne!(head.step(&row[..OBS])?, &action[..]);
        Ok(())
    })?;
    let wrong: [&[[&[f32]; 2]]; 3] = [&[], &[[keys, &values[..4]]], &[[&keys[..3], &values[..3]]]];
    assert!(wrong.iter().all(|parts| prefix_bytes(&image, parts).is_err()));
    Ok(())
}

#[test]
fn every_method_learns_from_recorded_prefixes() -> Result<()> {
    let dir = TempDir::new()?;
    write(dir.path(), json!({}))?;
    let at = |name: &str| dir.path().join(name).display().to_string();
    let mut random = Random::new(23);
    let rows = Array3::from_shape_fn((6, 50, OBS + 2 * EACH), |_| random.unit());
    for name in ["calib.npz", "heldout.npz"] {
        write_observations(&dir.path().join(name), &rows)?;
    }
    let [folder, out, heldout] = [at(""), at("policy.actq"), at("heldout.npz")];
    for method in [&["rtn"][..], &["gptq"], &["distill", "--steps", "20"]] {
        let budget = ["--bits", "8"];
        let budget = if method[0] == "distill" { ["--bpw", "16"] } else { budget };
        let words = [&["quantize", &folder, "--method"], method, &budget, &["--out", &out]].concat();
        succeeded(&run(actq(&words), b"")?)?;
        succeeded(&run(actq(&["eval", &out, "--policy", &folder, "--heldout", &heldout]), b"")?)?;
        std::fs::remove_file(&out)?;
    }
    Ok(())
}

/// One softmax over the prefix and over keys and values that the network has itself.
#[test]
fn own_tokens_follow_a_prefix() -> Result<()> {
    let dir = TempDir::new()?;
    // Keys and values of two tokens of four elements.
    write(dir.path(), json!({"keys": "own", "values": "own", "causal": true}))?;
    let policy = Policy::load(dir.path())?;
    let image = rtn(&policy, Width::W8, 32, Activations::Int8)?;
    let buffer = ImageBuffer::new(&image);
    let image = buffer.image(dir.path())?;
    assert!(image.prefix_caches().eq([Cache { heads: 1, dim: 4, slots: TOKENS + 2, own: 2 }]));
    let mut random = Random::new(24);
    with_head::<_, anyhow::Error>(image, |head| {
        for _ in 0..5 {
            let row: Vec<f32> = (0..OBS + 2 * EACH).map(|_| random.unit()).collect();
            let expected = actq::graph::Evaluator::new(&policy.graph).step(&row, &mut |_, _| {});
            let (observation, _) = take_prefix(head, &row)?;
            let action = head.step(observation)?;
            assert!(action.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 0.05), "{action:?} for {expected:?}");
        }
        Ok(())
    })
}

#[test]
fn a_prefix_has_no_order_and_no_window() -> Result<()> {
    let own = json!({"keys": "own", "values": "own", "context": 2});
    for more in [json!({"causal": true}), json!({"context": 2}), own] {
        let dir = TempDir::new()?;
        write(dir.path(), more)?;
        let error = format!("{:#}", Policy::load(dir.path()).expect_err("it is refused"));
        assert!(error.contains("(attention): reads a prefix"), "{error}");
    }
    for one in ["keys", "values"] {
        let dir = TempDir::new()?;
        write(dir.path(), json!({one: "own"}))?;
        let error = format!("{:#}", Policy::load(dir.path()).expect_err("it is refused"));
        assert!(error.contains("(attention)") && !error.contains(&format!("{one:?}")), "{error}");
    }
    let dir = TempDir::new()?;
    write(dir.path(), json!({"prefix": 513}))?;
    let error = format!("{:#}", Policy::load(dir.path()).expect_err("it is refused"));
    assert!(error.contains("at most 512 are supported"), "{error}");
    Ok(())
}

#[test]
fn a_simulator_sends_a_prefix() -> Result<()> {
    let dir = TempDir::new()?;
    write(dir.path(), json!({}))?;
    let bytes = rtn(&Policy::load(dir.path())?, Width::W8, 32, Activations::Int8)?;
    let [path, recording] = ["policy.actq", "recorded.npz"].map(|name| dir.path().join(name).display().to_string());
    std::fs::write(&path, &bytes)?;
    let mut random = Random::new(25);
    let row: Vec<f32> = (0..OBS + 2 * EACH).map(|_| random.unit()).collect();
    let [observation, prefix] = [(b'S', &row[..OBS]), (b'P', &row[OBS..])]
        .map(|(command, values)| [&[command][..], bytemuck::cast_slice(values)].concat());
    let serve = |input: &[u8]| run(actq(&["serve", &path, "--record", &recording]), input);
    let output = serve(&[&prefix[..], &observation, &observation].concat())?;
    let buffer = ImageBuffer::new(&bytes);
    let expected = with_head::<_, anyhow::Error>(buffer.image(dir.path())?, |head| {
        let (observation, _) = take_prefix(head, &row)?;
        Ok(head.step(observation)?.to_vec())
    })?;
    assert!(output.status.success(), "{output:?}");
    assert_eq!(output.stdout, bytemuck::cast_slice::<f32, u8>(&expected).repeat(2));
    // The recording is one to learn from, with the prefix in each row.
    assert_eq!(arrays(recording.as_ref())?["obs"].values.to_f32().context("numbers")?, row.repeat(2));
    failed(&serve(&observation)?, 1, &["reads a prefix", "send P"])?;
    failed(&serve(&prefix[..9])?, 1, &["the input ends inside a prefix of 160 bytes"])?;
    failed(&serve(&[b"P", &[0xff; 160][..]].concat())?, 1, &["not finite"])
}

#[test]
fn pages_and_golden_runs_have_no_prefix() -> Result<()> {
    let dir = TempDir::new()?;
    write(dir.path(), json!({}))?;
    let at = |name: &str| dir.path().join(name).display().to_string();
    let [image, page, folder, recording] = ["policy.actq", "page.html", "c", "heldout.npz"].map(at);
    std::fs::write(&image, rtn(&Policy::load(dir.path())?, Width::W8, 32, Activations::Int8)?)?;
    write_observations(recording.as_ref(), &Array3::from_elem((1, 3, OBS + 2 * EACH), 0.5f32))?;
    for line in
        [&["report", &image, "--out", &page][..], &["export-c", &image, "--golden", &recording, "--out", &folder]]
    {
        failed(&run(actq(line), b"")?, 1, &["reads a prefix", "`actq eval`"])?;
    }
    Ok(())
}

#[test]
fn a_c_head_reads_a_prefix() -> Result<()> {
    let dir = TempDir::new()?;
    write(dir.path(), json!({"keys": "own", "values": "own"}))?;
    let bytes = rtn(&Policy::load(dir.path())?, Width::W8, 32, Activations::Int8)?;
    let buffer = ImageBuffer::new(&bytes);
    let image = buffer.image(dir.path())?;
    let mut random = Random::new(26);
    let row: Vec<f32> = (0..OBS + 2 * EACH).map(|_| random.unit()).collect();
    let (observation, prefix) = row.split_at(OBS);
    let (keys, values) = prefix.split_at(EACH);
    let prefix = prefix_bytes(&image, &[[keys, values]])?;
    let expected = with_head::<_, anyhow::Error>(image, |head| {
        head.set_prefix(&prefix)?;
        Ok(head.step(observation)?.to_vec())
    })?;
    let (mut opened, mut head) = (Box::new(MaybeUninit::zeroed()), Box::new(MaybeUninit::zeroed()));
    let (opened, head) = (opened.as_mut_ptr(), head.as_mut_ptr());
    let mut scratch = vec![0u32; image.scratch_words() + 1];
    let (mut action, mut len) = ([0.0f32; 2], 0);
    // SAFETY: the pointers are valid for their lengths.
    unsafe {
        let mut step = || actq_step(head, observation.as_ptr(), OBS, action.as_mut_ptr(), 2);
        let set = |bytes: &[u8]| actq_set_prefix(head, bytes.as_ptr(), bytes.len());
        assert_eq!(actq_image_open(opened, buffer.bytes().as_ptr(), bytes.len()), Code::Ok as i32);
        assert_eq!(actq_head_init(head, opened, scratch.as_mut_ptr(), scratch.len()), Code::Ok as i32);
        assert_eq!((actq_prefix_bytes(head, &mut len), len), (Code::Ok as i32, prefix.len()));
        assert_eq!(step(), Code::NoPrefix as i32);
        assert_eq!(set(&prefix[4..]), Code::PrefixLength as i32);
        assert_eq!(set(&[&[0; 4], &prefix[4..]].concat()), Code::PrefixTokens as i32);
        assert_eq!(set(&[&prefix[..4], &[0xff; 4], &prefix[8..]].concat()), Code::PrefixNotFinite as i32);
        assert_eq!((set(&prefix), step()), (Code::Ok as i32, Code::Ok as i32));
        assert_eq!(actq_begin(head, observation.as_ptr(), OBS), Code::Ok as i32);
        assert_eq!(set(&prefix), Code::PrefixBegun as i32);
        assert_eq!((actq_clear_prefix(head), step()), (Code::Ok as i32, Code::NoPrefix as i32));
    }
    assert_eq!(action, expected[..]);
    Ok(())
}
