//! Policies whose attention reads a prefix: from policy.json and recordings to images.

use std::path::Path;

use actq::methods::Activations;
use actq::policy::Policy;
use actq::runtime::{ImageBuffer, prefix_bytes, with_head};
use actq_bench::command::{actq, failed, run, succeeded};
use actq_bench::rtn;
use actq_kernels::image::Cache;
use actq_kernels::{StepError, Width};
use actq_testkit::Random;
use anyhow::Result;
use ndarray::Array3;
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::folder::{write_observations, write_policy};

const TOKENS: usize = 5;
/// Keys or values of all tokens: one head of 4 elements.
const EACH: usize = 4 * TOKENS;
const OBS: usize = 3;

/// Writes a policy of three values, whose eight queries of one token attend to a prefix. `more` are further keys of that op.
fn write(folder: &Path, more: Value) -> Result<()> {
    let mut attention = json!({"op": "attention", "heads": 2, "kv_heads": 1, "dim": 4, "prefix": TOKENS});
    if let (Some(to), Value::Object(more)) = (attention.as_object_mut(), more) {
        to.extend(more);
    }
    let ops = [json!({"op": "linear", "w": "q", "b": "bq"}), attention, json!({"op": "linear", "w": "o"})];
    let mut random = Random::new(21);
    let mut draw = |n: usize| (0..n).map(|_| random.unit()).collect::<Vec<f32>>();
    let tensors = [("q", vec![8, OBS], draw(8 * OBS)), ("bq", vec![8], draw(8)), ("o", vec![2, 8], draw(16))];
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
    assert!(image.prefix_caches().eq([Cache { heads: 1, dim: 4, slots: TOKENS }]));
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

#[test]
fn keys_beside_a_prefix_are_refused() -> Result<()> {
    for more in [json!({"keys": "obs"}), json!({"causal": true}), json!({"context": 2})] {
        let dir = TempDir::new()?;
        write(dir.path(), more)?;
        let error = format!("{:#}", Policy::load(dir.path()).expect_err("it is refused"));
        assert!(error.contains("op 1 (attention): reads a prefix"), "{error}");
    }
    let dir = TempDir::new()?;
    write(dir.path(), json!({"prefix": 513}))?;
    let error = format!("{:#}", Policy::load(dir.path()).expect_err("it is refused"));
    assert!(error.contains("at most 512 are supported"), "{error}");
    // No host sends one to `actq serve`.
    let dir = TempDir::new()?;
    write(dir.path(), json!({}))?;
    let image = dir.path().join("policy.actq");
    std::fs::write(&image, rtn(&Policy::load(dir.path())?, Width::W8, 32, Activations::Int8)?)?;
    let input = [&[b'S'][..], &[0; 4 * OBS]].concat();
    let output = run(actq(&["serve", &image.display().to_string()]), &input)?;
    failed(&output, 1, &["reads a prefix"])
}
