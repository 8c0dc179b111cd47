//! Recorded observations: `calib.npz` and `heldout.npz`.

use std::fs::File;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use ndarray::{Array1, Array3, Axis};
use ndarray_npy::NpzReader;

/// Episodes of observations, with the f32 policy's own actions where they were recorded.
#[derive(Debug)]
pub struct Dataset {
    /// The file, for messages.
    pub path: PathBuf,
    /// `[episode, step, value]`
    pub obs: Array3<f32>,
    /// `[episode, step, value]`: the network's raw output at that observation.
    pub action: Option<Array3<f32>>,
    /// Valid steps of each episode.
    pub length: Vec<usize>,
}

impl Dataset {
    /// Reads an .npz with the arrays `obs` (f32, `[episode, step, obs_len]`) and, optionally, `action` and `length`; refuses
    /// other widths than the policy's, lengths beyond the array, NaN and infinities.
    pub fn load(path: &Path, obs_len: usize, out_len: usize) -> Result<Self> {
        Self::read(path, obs_len, out_len).with_context(|| path.display().to_string())
    }

    fn read(path: &Path, obs_len: usize, out_len: usize) -> Result<Self> {
        let file = File::open(path).context("cannot be read")?;
        let mut npz = NpzReader::new(file).context("not an .npz archive")?;
        let names = npz.names().context("not an .npz archive")?;
        let has = |name: &str| names.iter().any(|n| n.trim_end_matches(".npy") == name);
        ensure!(has("obs"), "array \"obs\" is missing; the archive holds {}", names.join(", "));
        let mut read = |name: &str| -> Result<Array3<f32>> {
            npz.by_name(name)
                .with_context(|| format!("array {name:?} must be float32 with the axes [episode, step, value]"))
        };
        let obs = read("obs")?;
        let action = if has("action") { Some(read("action")?) } else { None };
        let (episodes, steps, width) = obs.dim();
        ensure!(episodes > 0 && steps > 0, "array \"obs\" is empty");
        ensure!(width == obs_len, "array \"obs\" has {width} values a step, the policy takes {obs_len}");
        if let Some(action) = &action {
            let expected = (episodes, steps, out_len);
            ensure!(action.dim() == expected, "array \"action\" is {:?}, {expected:?} is needed", action.dim());
        }
        let length = match has("length") {
            false => vec![steps; episodes],
            true => lengths(&mut npz)?,
        };
        ensure!(length.len() == episodes, "array \"length\" has {} entries for {episodes} episodes", length.len());
        if let Some(at) = length.iter().position(|&n| n > steps) {
            bail!("episode {at} has the length {}, but the array holds {steps} steps", length[at]);
        }
        let dataset = Self { path: path.to_owned(), obs, action, length };
        dataset.check_finite()?;
        Ok(dataset)
    }

    fn check_finite(&self) -> Result<()> {
        for (name, array) in [("obs", Some(&self.obs)), ("action", self.action.as_ref())] {
            let Some(array) = array else { continue };
            for ((episode, step, value), v) in array.indexed_iter() {
                ensure!(
                    v.is_finite() || step >= self.length[episode],
                    "array {name:?} holds {v} at episode {episode}, step {step}, value {value}"
                );
            }
        }
        Ok(())
    }

    /// All valid steps.
    pub fn frames(&self) -> usize {
        self.length.iter().sum()
    }

    /// The observations of an episode, valid steps only.
    pub fn episode(&self, episode: usize) -> impl Iterator<Item = Vec<f32>> + '_ {
        (0..self.length[episode]).map(move |step| self.row(&self.obs, episode, step))
    }

    /// The recorded action at a step, where actions were recorded.
    pub fn action_at(&self, episode: usize, step: usize) -> Option<Vec<f32>> {
        Some(self.row(self.action.as_ref()?, episode, step))
    }

    fn row(&self, array: &Array3<f32>, episode: usize, step: usize) -> Vec<f32> {
        array.index_axis(Axis(0), episode).index_axis(Axis(0), step).to_vec()
    }
}

fn lengths(npz: &mut NpzReader<File>) -> Result<Vec<usize>> {
    let from_i64 = |a: Array1<i64>| a.iter().map(|&n| usize::try_from(n)).collect::<Result<Vec<_>, _>>();
    if let Ok(a) = npz.by_name::<ndarray::OwnedRepr<i64>, ndarray::Ix1>("length") {
        return from_i64(a).context("array \"length\" holds a negative number");
    }
    let a: Array1<i32> = npz.by_name("length").context("array \"length\" must be int64 or int32 with one axis")?;
    from_i64(a.mapv(i64::from)).context("array \"length\" holds a negative number")
}
