//! Files of LeRobot's policies of states, as LeRobot writes them.

use actq::error::{Context as _, Result, ensure};
use actq_deploy::Reading;
use safetensors::Dtype;
use safetensors::tensor::{TensorView, serialize};
use std::collections::BTreeMap;

use super::made::{Made, Tick};
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

/// Returns a .safetensors file.
pub(crate) fn tensors<'a>(all: impl IntoIterator<Item = (String, &'a [f32])>) -> Result<Vec<u8>> {
    let bytes = all.into_iter().map(|(name, values)| {
        (name, vec![values.len()], values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>())
    });
    let bytes: Vec<_> = bytes.collect();
    let views = bytes.iter().map(|(name, shape, bytes)| Ok((name, TensorView::new(Dtype::F32, shape.clone(), bytes)?)));
    Ok(serialize(views.collect::<Result<Vec<_>>>()?, None)?)
}

pub(crate) fn statistics(feature: &str, name: &str) -> Vec<f64> {
    let found = STATISTICS.iter().find(|(of, statistic, _)| (*of, *statistic) == (feature, name));
    found.map_or(Vec::new(), |(.., values)| values.iter().map(|value| f64::from(*value)).collect())
}

/// The files of a policy.
#[derive(Clone)]
pub(crate) struct Files(pub(crate) BTreeMap<String, Vec<u8>>);

impl Files {
    /// Those of a policy with processors.
    pub(crate) fn new() -> Result<Self> {
        let all = STATISTICS.iter().map(|(feature, name, values)| (format!("{feature}.{name}"), *values));
        let mut files = Self(BTreeMap::new());
        for file in STATE_FILES {
            files.set(file, &tensors(all.clone())?);
        }
        files.set("config.json", CONFIG.as_bytes());
        files.set("policy_preprocessor.json", BEFORE.as_bytes());
        files.set("policy_postprocessor.json", AFTER.as_bytes());
        files.set("meta/info.json", INFO.as_bytes());
        files.set("policy.onnx", &onnx::linear(3, 2, &[]));
        Ok(files)
    }

    /// Those of an older policy, whose weights have buffers.
    pub(crate) fn older() -> Result<Self> {
        let mut files = Self::new()?;
        for file in STATE_FILES.into_iter().chain(["policy_preprocessor.json", "policy_postprocessor.json"]) {
            files.0.remove(file);
        }
        let names = |feature: &str| if feature == "action" { "unnormalize_outputs" } else { "normalize_inputs" };
        let all = STATISTICS.iter().filter(|(_, name, _)| !name.starts_with('q')).map(|(feature, name, values)| {
            (format!("{}.buffer_{}.{name}", names(feature), feature.replace('.', "_")), *values)
        });
        files.set("model.safetensors", &tensors(all.chain([("model.weight".to_owned(), &[0.5][..])]))?);
        Ok(files)
    }

    pub(crate) fn set(&mut self, file: &str, bytes: &[u8]) {
        self.0.insert(file.to_owned(), bytes.to_vec());
    }

    /// Replaces a text in all of the JSON files that have it.
    pub(crate) fn with(&self, from: &str, to: &str) -> Result<Self> {
        let mut files = self.clone();
        let mut found = false;
        for bytes in files.0.iter_mut().filter(|(name, _)| name.ends_with("json")).map(|(_, bytes)| bytes) {
            let text = String::from_utf8_lossy(bytes).into_owned();
            found |= text.contains(from);
            *bytes = text.replace(from, to).into_bytes();
        }
        ensure!(found, "no file has {from:?}");
        Ok(files)
    }

    /// Replaces a text in one file.
    pub(crate) fn with_in(&self, file: &str, from: &str, to: &str) -> Result<Self> {
        let mut files = self.clone();
        let text = String::from_utf8_lossy(self.0.get(file).context("no such file")?).into_owned();
        ensure!(text.contains(from), "{file} has no {from:?}");
        files.set(file, text.replace(from, to).as_bytes());
        Ok(files)
    }

    pub(crate) fn with_file(&self, file: &str, bytes: &[u8]) -> Self {
        let mut files = self.clone();
        files.set(file, bytes);
        files
    }

    pub(crate) fn without(&self, file: &str) -> Self {
        let mut files = self.clone();
        files.0.remove(file);
        files
    }

    pub(crate) fn made(&self) -> Result<Made> {
        Made::of(&self.0)
    }

    pub(crate) fn reading(&self, accepted: bool, answers: &str) -> Result<Reading> {
        self.made()?.reading(accepted, answers)
    }

    /// Returns the keys of the questions.
    pub(crate) fn asked(&self, accepted: bool, answers: &str) -> Result<Vec<String>> {
        let mut asked: Vec<String> =
            self.reading(accepted, answers)?.questions.into_iter().map(|question| question.key).collect();
        asked.sort();
        Ok(asked)
    }

    /// Runs 20 ticks with the raw values of [`raw`]: the observation and the target of each.
    pub(crate) fn run(&self, answers: &str) -> Result<Vec<Tick>> {
        self.made()?.run(answers, 20, |_, len, tick| raw(tick, len))
    }
}

/// Raw values of a tick. The last one of a state is near its minimum, so that eps counts.
pub(crate) fn raw(tick: usize, len: usize) -> Vec<f64> {
    let t = tick as f64;
    [0.7 * t - 5.0, (0.9 * t).sin(), 0.25 + 2e-9 * (t - 4.0)][..len].to_vec()
}

/// Replaces a statistic in one of the state files.
pub(crate) fn with_statistic(file: &str, name: &str, values: &[f32]) -> Result<Files> {
    let all = STATISTICS.iter().map(|(feature, statistic, values)| (format!("{feature}.{statistic}"), *values));
    let all = all.map(|(own, old)| if own == name { (own, values) } else { (own, old) });
    Ok(Files::new()?.with_file(file, &tensors(all.filter(|(_, values)| !values.is_empty()))?))
}
