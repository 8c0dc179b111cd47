//! Action heads of published sizes, as policy folders. **Their weights are seeded random numbers: sizes and times are
//! real, accuracy is not.**
#![forbid(unsafe_code)]

mod network;
pub mod octo;
pub mod oft;

use std::fs;
use std::path::Path;

use actq::data::{Dataset, Sizes};
use actq::policy::Policy;
use actq::random::Random;
use anyhow::{Context, Result};
use ndarray::Array3;
use serde_json::Value;

/// Observations in `calib.npz`: the minimum of every method.
const FRAMES: usize = 256;

/// A policy's two files.
#[derive(Debug)]
pub struct Head {
    /// `policy.json`
    pub json: Value,
    /// `policy.safetensors`
    pub weights: Vec<u8>,
}

impl Head {
    /// Parses the policy.
    pub fn policy(&self) -> Result<Policy> {
        let files = ["policy.json", "policy.safetensors"].map(Path::new);
        Ok(Policy::of_files(Path::new("."), files, self.json.to_string().as_bytes(), &self.weights)?)
    }

    /// Writes the policy's folder, with standard normal observations as `calib.npz`.
    pub fn write(&self, dir: &Path) -> Result<()> {
        let mut random = Random::new(1);
        let sizes = Sizes::of(&self.policy()?);
        let calib = Dataset {
            path: "calib.npz".into(),
            obs: Array3::from_shape_simple_fn((FRAMES, 1, sizes.obs), || random.normal()),
            action: None,
            length: vec![1; FRAMES],
            state: None,
        };
        fs::create_dir_all(dir).with_context(|| dir.display().to_string())?;
        let json = serde_json::to_vec_pretty(&self.json)?;
        for (name, bytes) in
            [("policy.json", json), ("policy.safetensors", self.weights.clone()), ("calib.npz", calib.npz(sizes)?)]
        {
            let path = dir.join(name);
            fs::write(&path, bytes).with_context(|| format!("cannot write {}", path.display()))?;
        }
        Ok(())
    }
}
