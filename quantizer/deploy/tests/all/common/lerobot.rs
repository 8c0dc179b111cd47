//! Files of LeRobot's policies of states, as LeRobot writes them.

use actq::error::Result;
use actq_testkit::f32_tensors;

use super::made::{Files, Tick};
use super::onnx;

pub(crate) const CONFIG: &str = r#"{
    "type": "act",
    "n_obs_steps": 1,
    "input_features": {
        "observation.state": {
            "type": "STATE",
            "shape": [
                3
            ]
        }
    },
    "output_features": {
        "action": {
            "type": "ACTION",
            "shape": [
                2
            ]
        }
    },
    "device": "cuda",
    "use_amp": false,
    "chunk_size": 100,
    "n_action_steps": 1,
    "normalization_mapping": {
        "VISUAL": "MEAN_STD",
        "STATE": "MIN_MAX",
        "ACTION": "MEAN_STD"
    },
    "dim_model": 512,
    "temporal_ensemble_coeff": null
}"#;

pub(crate) const BEFORE: &str = r#"{
  "name": "policy_preprocessor",
  "steps": [
    {
      "registry_name": "rename_observations_processor",
      "config": {
        "rename_map": {}
      }
    },
    {
      "registry_name": "to_batch_processor",
      "config": {}
    },
    {
      "registry_name": "device_processor",
      "config": {
        "device": "cuda",
        "float_dtype": null
      }
    },
    {
      "registry_name": "normalizer_processor",
      "config": {
        "eps": 1e-08,
        "features": {
          "observation.state": {
            "type": "STATE",
            "shape": [
              3
            ]
          },
          "action": {
            "type": "ACTION",
            "shape": [
              2
            ]
          }
        },
        "norm_map": {
          "VISUAL": "MEAN_STD",
          "STATE": "MIN_MAX",
          "ACTION": "MEAN_STD"
        }
      },
      "state_file": "policy_preprocessor_step_3_normalizer_processor.safetensors"
    }
  ]
}"#;

pub(crate) const AFTER: &str = r#"{
  "name": "policy_postprocessor",
  "steps": [
    {
      "registry_name": "unnormalizer_processor",
      "config": {
        "eps": 1e-08,
        "features": {
          "action": {
            "type": "ACTION",
            "shape": [
              2
            ]
          }
        },
        "norm_map": {
          "VISUAL": "MEAN_STD",
          "STATE": "MIN_MAX",
          "ACTION": "MEAN_STD"
        }
      },
      "state_file": "policy_postprocessor_step_0_unnormalizer_processor.safetensors"
    },
    {
      "registry_name": "device_processor",
      "config": {
        "device": "cpu",
        "float_dtype": null
      }
    }
  ]
}"#;

pub(crate) const INFO: &str = r#"{
    "codebase_version": "v3.0",
    "robot_type": "so101_follower",
    "fps": 30,
    "features": {
        "action": {
            "dtype": "float32",
            "shape": [
                2
            ],
            "names": [
                "pan.pos",
                "gripper.pos"
            ]
        },
        "observation.state": {
            "dtype": "float32",
            "shape": [
                3
            ],
            "names": [
                "pan.pos",
                "lift.pos",
                "gripper.pos"
            ]
        }
    }
}"#;

pub(crate) const STATE_FILES: [&str; 2] = [
    "policy_preprocessor_step_3_normalizer_processor.safetensors",
    "policy_postprocessor_step_0_unnormalizer_processor.safetensors",
];
/// Statistics by feature: the last value of the state has the same minimum and maximum, and no deviation.
pub(crate) const STATISTICS: [(&str, &str, &[f32]); 14] = [
    ("observation.state", "mean", &[0.5, -1.0, 0.25]),
    ("observation.state", "std", &[0.5, 2.0, 0.0]),
    ("observation.state", "min", &[-1.0, -4.0, 0.25]),
    ("observation.state", "max", &[2.0, 3.5, 0.25]),
    ("observation.state", "q01", &[-0.75, -3.0, 0.25]),
    ("observation.state", "q99", &[1.5, 3.0, 0.25]),
    ("observation.state", "q10", &[-0.5, -2.0, 0.25]),
    ("observation.state", "q90", &[1.25, 2.0, 0.25]),
    ("action", "mean", &[10.0, -20.0]),
    ("action", "std", &[3.0, 0.0]),
    ("action", "min", &[-50.0, 5.0]),
    ("action", "max", &[70.0, 5.0]),
    ("action", "q01", &[-40.0, 5.0]),
    ("action", "q99", &[60.0, 5.0]),
];

pub(crate) fn statistics(feature: &str, name: &str) -> Vec<f64> {
    let found = STATISTICS.iter().find(|(of, statistic, _)| (*of, *statistic) == (feature, name));
    found.map_or(Vec::new(), |(.., values)| values.iter().map(|value| f64::from(*value)).collect())
}

/// Returns the tensors of the statistics, each of which has its feature's length.
fn tensors<'a>(all: impl IntoIterator<Item = (String, &'a [f32])>) -> Vec<u8> {
    f32_tensors(all.into_iter().map(|(name, values)| (name, [values.len()], values)))
}

fn named_statistics() -> impl Iterator<Item = (String, &'static [f32])> + Clone {
    STATISTICS.iter().map(|(feature, name, values)| (format!("{feature}.{name}"), *values))
}

/// The files of a policy with processors.
pub(crate) fn files() -> Files {
    let files = Files::default()
        .with_file("config.json", CONFIG)
        .with_file("policy_preprocessor.json", BEFORE)
        .with_file("policy_postprocessor.json", AFTER)
        .with_file("meta/info.json", INFO)
        .with_file("policy.onnx", onnx::linear(3, 2, &[]));
    STATE_FILES.iter().fold(files, |files, file| files.with_file(file, tensors(named_statistics())))
}

/// The files of an older policy, whose weights have buffers.
pub(crate) fn older() -> Files {
    let replaced = [STATE_FILES[0], STATE_FILES[1], "policy_preprocessor.json", "policy_postprocessor.json"];
    let files = replaced.iter().fold(files(), |files, file| files.without(file));
    let names = |feature: &str| if feature == "action" { "unnormalize_outputs" } else { "normalize_inputs" };
    let all = STATISTICS.iter().filter(|(_, name, _)| !name.starts_with('q')).map(|(feature, name, values)| {
        (format!("{}.buffer_{}.{name}", names(feature), feature.replace('.', "_")), *values)
    });
    files.with_file("model.safetensors", tensors(all.chain([("model.weight".to_owned(), &[0.5][..])])))
}

/// Raw values of a tick. The last one of a state is near its minimum, so that eps counts.
pub(crate) fn raw(tick: usize, len: usize) -> Vec<f64> {
    let t = tick as f64;
    [0.7 * t - 5.0, (0.9 * t).sin(), 0.25 + 2e-9 * (t - 4.0)][..len].to_vec()
}

/// Runs 20 ticks with these raw values.
pub(crate) fn run(files: &Files, answers: &str) -> Result<Vec<Tick>> {
    files.run(answers, 20, |_, len, tick| raw(tick, len))
}

/// Returns a state file with another statistic, or without it.
pub(crate) fn statistics_with(name: &str, values: &[f32]) -> Vec<u8> {
    let all = named_statistics().map(|(own, old)| if own == name { (own, values) } else { (own, old) });
    tensors(all.filter(|(_, values)| !values.is_empty()))
}
