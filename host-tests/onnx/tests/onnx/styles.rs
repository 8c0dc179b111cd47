//! Each style in which exporters write a policy, against tract.

use actq::data::{Recording, Sizes};
use actq_bench::shared_policies;
use actq_onnx::{ImportOptions, Onnx};
use anyhow::{Context as _, Result};
use proptest::prelude::*;

use super::file::{File, external};
use super::{by_tract, compare, drawn, imported, refused, same};
use actq::import::Importer as _;
use actq::measure::actions::actions;
use actq::policy::Policy;
use actq_onnx::import;

/// Values of the observation, in texts of the notation 11.
pub(super) const OBS: usize = 11;

pub(super) fn begun() -> File {
    let mut file = File::default();
    file.input("obs", &[1, OBS as i64]);
    file
}

/// Adds a last layer and the output `actions`.
pub(super) fn ended(mut file: File, last: &str, len: usize) -> Vec<u8> {
    let y = file.gemm(last, 3, len);
    file.nodes("Identity", &[&y], &["actions"], &[]);
    file.output("actions", &[1, 3]);
    file.bytes()
}

/// Writes a network of the observation, whose last value has `len` elements, and a last layer.
pub(super) fn network(text: &str, len: usize) -> Vec<u8> {
    let mut file = begun();
    let last = file.write(&[], text);
    ended(file, &last, len)
}

#[test]
fn weights_of_other_files_are_imported() -> Result<()> {
    let dir = tempfile::TempDir::new()?;
    let data: Vec<f32> = (0..3 * OBS).map(|i| i as f32 / 20.0 - 0.7).collect();
    let mut file = begun();
    let outside = external(&[OBS, 3], &[("location", "model.data"), ("offset", "16")]);
    file.initializer(&outside);
    file.nodes("MatMul", &["obs", "w"], &["actions"], &[]);
    file.output("actions", &[1, 3]);
    let bytes: Vec<u8> = [vec![0; 16], data.iter().flat_map(|v| v.to_le_bytes()).collect()].concat();
    std::fs::write(dir.path().join("model.data"), bytes)?;
    let path = dir.path().join("model.onnx");
    std::fs::write(&path, file.bytes())?;
    let policy = Onnx.load(&path)?;
    let obs: Vec<f32> = (0..OBS).map(|i| i as f32).collect();
    let expected = (0..3).map(|k| (0..OBS).map(|i| obs[i] * data[3 * i + k]).sum()).collect();
    compare(&[expected], &actions(&policy, &[obs]))
}

#[test]
fn published_files_are_imported() -> Result<()> {
    let Some(policies) = shared_policies() else { return Ok(()) };
    let folder = policies.with_file_name("onnx");
    for (name, expected) in [
        ("brax_go1", "normalize linear silu linear silu linear silu linear tanh"),
        ("mjlab_mecanum", "normalize linear elu linear elu linear elu linear"),
        ("limx_tron1_pf", "linear elu linear elu linear elu linear"),
    ] {
        let path = folder.join(name).join("model.onnx");
        let bytes = std::fs::read(&path)?;
        let file = import(&path, &ImportOptions::default())?;
        assert_eq!(file.ops.join(" "), expected);
        let policy = Onnx.load(&path)?;
        // Uses the recording if there is one: beyond its path, sums of random values lose more digits than the
        // tolerance allows.
        let observations = match name {
            "brax_go1" => {
                let recorded =
                    Recording::Calib.require(Some(&policies.join("go1_mlp")), None, Sizes::of(&policy), "this test")?;
                recorded.episode(0).take(64).collect()
            }
            _ => drawn(&policy),
        };
        compare(&by_tract(&bytes, &file, &observations)?, &actions(&policy, &observations))
            .with_context(|| name.to_owned())?;
    }
    // The same network, imported by another tool.
    let [ours, theirs] = [folder.join("brax_go1/model.onnx"), policies.join("go1_mlp")]
        .map(|path| if path.is_dir() { Policy::load(&path) } else { Onnx.load(&path) })
        .map(Result::unwrap);
    assert_eq!(ours.graph.matrices.len(), theirs.graph.matrices.len());
    for (a, b) in ours.graph.matrices.iter().zip(&theirs.graph.matrices) {
        assert_eq!((a.rows, a.cols, &a.data), (b.rows, b.cols, &b.data));
    }
    let observations = drawn(&ours);
    assert_eq!(actions(&ours, &observations), actions(&theirs, &observations));
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// A chain of random nodes, some joined with earlier values.
    #[test]
    fn random_graphs_agree_with_tract(steps in prop::collection::vec((0usize..14, any::<bool>()), 1..9), batch in any::<bool>()) {
        let mut file = File::default();
        file.input("obs", &[if batch { -1 } else { 1 }, OBS as i64]);
        let mut at = "obs".to_owned();
        let mut len = OBS;
        let mut before: Option<(String, usize)> = None;
        for (which, keep) in steps {
            let kept = (at.clone(), len);
            at = match which {
                0..=3 => {
                    let rows = 4 + 3 * which;
                    let y = file.gemm(&at, rows, len);
                    len = rows;
                    y
                }
                4 => file.write(&[&at], "Tanh(x)"),
                5 => file.write(&[&at], "Elu(x)"),
                6 => file.write(&[&at], "Sin(x)"),
                7 => file.write(&[&at], &format!("x * drawn({len})")),
                8 => file.write(&[&at], &format!("drawn(1, {len}) - x")),
                9 => file.write(&[&at], "Clip(x, -0.6, 0.9)"),
                10 => file.write(&[&at], "x * Sigmoid(x)"),
                11 => file.write(&[&at], &format!("LayerNormalization(x, drawn({len}), drawn({len}), axis=-1, epsilon=1e-2)")),
                12 => file.write(&[&at], "LeakyRelu(x, alpha=0.2)"),
                _ => match &before {
                    Some((other, n)) if *n == len => file.write(&[&at, other], if keep { "x + y" } else { "x * y" }),
                    Some((other, n)) => {
                        len += n;
                        file.write(&[other, &at], "Concat(x, y, axis=1)")
                    }
                    None => file.write(&[&at], "Relu(x)"),
                },
            };
            if keep {
                before = Some(kept);
            }
        }
        let bytes = ended(file, &at, len);
        let result = same(&bytes);
        prop_assert!(result.is_ok(), "{:?}", result.err());
    }
}

#[test]
fn a_critic_never_replaces_a_drawn_action() -> Result<()> {
    let text = "mu = gemm(obs, 3, 11)
         v = gemm(obs, 1, 11)
         actions := Identity(mu + RandomNormal(shape=[1, 3]))
         log_prob := ReduceSum(mu * RandomNormal(shape=[1, 3]), keepdims=0)
         value := Identity(v)
         std := Identity([0.5, 0.5, 0.5])
         mean := Identity(mu)";
    let with_outputs = |names: &[&str]| {
        let mut file = begun();
        file.write(&[], text);
        names.iter().for_each(|name| file.output(name, &[1, if *name == "value" { 1 } else { 3 }]));
        file.bytes()
    };
    for names in [
        ["actions", "value", "log_prob"],
        ["value", "actions", "log_prob"],
        ["log_prob", "value", "actions"],
        ["value", "log_prob", "std"],
        ["std", "log_prob", "value"],
    ] {
        refused(&with_outputs(&names), "choose one by actq import --output NAME: value (1 values)");
    }
    for names in [["log_prob", "value", "mean"], ["mean", "actions", "value"], ["std", "value", "mean"]] {
        let bytes = with_outputs(&names);
        refused(&bytes, "value (1 values)");
        refused(&bytes, "mean (3 values)");
        let options = ImportOptions { output: Some("mean".to_owned()), ..ImportOptions::default() };
        assert_eq!(imported(&bytes, &options)?.0.output, ("mean".to_owned(), 3));
    }
    Ok(())
}

#[test]
fn constants_that_are_inputs_are_questioned() {
    // As Keras writes a Normalization layer by tf2onnx, and the same without a batch axis.
    for (rows, expected) in [
        (-1, "has no dynamic axis, unlike \"obs\" of the same length: exporters make the mean"),
        (1, "has the name of a constant of the network: exporters make the mean"),
    ] {
        let (mut file, mean) = (File::default(), "model/normalization_1/Sub/y:0");
        file.input("obs", &[rows, 4]);
        file.input(mean, &[1, 4]);
        file.write(&[mean], "centred = Sub(obs, x)\naction := Identity(gemm(centred, 4, 4))");
        file.output("action", &[rows, 4]);
        refused(&file.bytes(), expected);
    }
}
