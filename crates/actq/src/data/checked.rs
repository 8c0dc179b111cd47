//! Arrays of a recording: the checks of their shapes, then their values.

use actq_kernels::ops::noise::normal;
use ndarray::{Array2, Array3, Axis, concatenate};

use super::arrays::{Arrays, floats};
use super::origin::APPLIED;
use super::sizes::Sizes;
use crate::error::{Context, Result, bail, ensure};
use crate::import::values::{Tensor, Values};
use crate::text::count;

/// Names by which other formats mark where episodes begin or end: Gymnasium's, D4RL's, RLDS', LeRobot's, Diffusion
/// Policy's and Stable-Baselines3's.
const MARKS: [&str; 14] = [
    "done",
    "dones",
    "terminated",
    "truncated",
    "terminal",
    "terminals",
    "timeouts",
    "is_first",
    "is_last",
    "is_terminal",
    "episode",
    "episode_index",
    "episode_ends",
    "episode_starts",
];

/// Arrays of a recording whose shapes fit each other and the sizes.
pub(super) struct CheckedArrays {
    sizes: Sizes,
    episodes: usize,
    steps: usize,
    obs: Tensor,
    noise: Option<Tensor>,
    action: Option<Tensor>,
    state: Option<Tensor>,
    /// Valid steps of each episode.
    length: Vec<usize>,
}

/// Values of a recording, as [`super::Dataset`] has them.
pub(super) struct Contents {
    pub(super) obs: Array3<f32>,
    pub(super) action: Option<Array3<f32>>,
    pub(super) state: Option<Array2<f32>>,
    pub(super) length: Vec<usize>,
}

impl CheckedArrays {
    /// Checks the shapes. Arrays that do not apply are dropped.
    pub(super) fn new(mut arrays: Arrays, sizes: Sizes) -> Result<Self> {
        let Some(obs) = arrays.take("obs") else {
            bail!("array \"obs\" is missing; the file holds {}", arrays.names())
        };
        let [episodes, steps] = frames(&obs, sizes)?;
        let noise = arrays.take("noise").filter(|_| sizes.noise > 0);
        check_beside(&obs, &noise, "noise", sizes.noise, "the policy's initial noise")?;
        // Actions from unknown noise cannot be compared, nor those of a controller, which are not the policy's.
        let comparable = !arrays.has(APPLIED) && (sizes.noise == 0 || noise.is_some());
        let action = arrays.take("action").filter(|_| comparable);
        check_beside(&obs, &action, "action", sizes.out, "the network's raw output")?;
        let state = arrays.take("state");
        if let Some(state) = &state {
            check_state(state, episodes, sizes)?;
        }
        let length = match arrays.take("length") {
            None => {
                if let Some(mark) = MARKS.iter().find(|name| arrays.has(name)) {
                    bail!(
                        "array {mark:?} says where episodes begin or end, and is not read: save \"obs\" as [episode, step, value], \
                         with the steps of each episode as \"length\", or leave that array out if all steps are one episode"
                    );
                }
                vec![steps; episodes]
            }
            Some(length) => lengths(&length, episodes, steps)?,
        };
        ensure!(length.iter().any(|n| *n > 0), "the recording holds no frame: every episode has length 0");
        Ok(Self { sizes, episodes, steps, obs, noise, action, state, length })
    }

    /// Converts the values to f32. Frames without noise get it from a fixed generator.
    pub(super) fn contents(self) -> Result<Contents> {
        let mut obs = self.rows("obs", &self.obs)?;
        if self.sizes.noise > 0 {
            let noise = match &self.noise {
                Some(noise) => self.rows("noise", noise)?,
                None => Array3::from_shape_fn((self.episodes, self.steps, self.sizes.noise), |(e, s, i)| {
                    drawn_noise(e * self.steps + s, i)
                }),
            };
            obs = concatenate(Axis(2), &[obs.view(), noise.view()])?.as_standard_layout().into_owned();
        }
        Ok(Contents {
            obs,
            action: self.action.as_ref().map(|action| self.rows("action", action)).transpose()?,
            state: self.state.as_ref().map(|state| self.states(state)).transpose()?,
            length: self.length,
        })
    }

    /// Returns an array of frames, `[episode, step, value]`, whose values at valid steps are finite.
    fn rows(&self, name: &str, array: &Tensor) -> Result<Array3<f32>> {
        let values = floats(array, name)?;
        let frames = self.episodes * self.steps;
        let shaped = Array3::from_shape_vec((self.episodes, self.steps, values.len() / frames), values)?;
        let mut entries = shaped.indexed_iter().enumerate();
        let bad = entries.find(|(_, ((e, s, _), v))| !v.is_finite() && *s < self.length[*e]);
        if let Some((i, ((episode, step, value), _))) = bad {
            bail!("array {name:?} {} at episode {episode}, step {step}, value {value}", array.values.not_f32(i));
        }
        Ok(shaped)
    }

    /// Returns the recurrent state before each episode's first step.
    fn states(&self, array: &Tensor) -> Result<Array2<f32>> {
        let values = floats(array, "state")?;
        if let Some(i) = values.iter().position(|v| !v.is_finite()) {
            let (episode, value) = (i / self.sizes.state, i % self.sizes.state);
            bail!("array \"state\" {} at episode {episode}, value {value}", array.values.not_f32(i));
        }
        Ok(Array2::from_shape_vec((self.episodes, self.sizes.state), values)?)
    }
}

/// Returns a value of the noise of a frame, of a recording without noise.
pub(super) fn drawn_noise(frame: usize, i: usize) -> f32 {
    normal(0, frame as u32, i as u32)
}

/// Returns the episodes and the steps of each.
fn frames(obs: &Tensor, sizes: Sizes) -> Result<[usize; 2]> {
    let [episodes, steps, width] = match obs.shape[..] {
        [episodes, steps, width] => [episodes, steps, width],
        [frames, width] => [1, frames, width],
        _ => bail!(
            "array \"obs\" has the shape {:?}; use [episode, step, value], or [frame, value] for one episode",
            obs.shape
        ),
    };
    ensure!(episodes > 0 && steps > 0, "array \"obs\" is empty: {:?}", obs.shape);
    ensure!(width == sizes.obs, "array \"obs\" has {} per step, and {} are needed", count(width, "value"), sizes.obs);
    Ok([episodes, steps])
}

/// Refuses an array that does not have `width` values at every observation.
fn check_beside(obs: &Tensor, array: &Option<Tensor>, name: &str, width: usize, what: &str) -> Result<()> {
    let Some(array) = array else { return Ok(()) };
    let mut expected = obs.shape.clone();
    *expected.last_mut().unwrap_or(&mut 0) = width;
    ensure!(
        array.shape == expected,
        "array {name:?} has the shape {:?}; {expected:?} is needed: {what} at every observation",
        array.shape
    );
    Ok(())
}

fn check_state(state: &Tensor, episodes: usize, sizes: Sizes) -> Result<()> {
    ensure!(sizes.state > 0, "array \"state\" is present, but the policy has no recurrent state");
    let expected = [episodes, sizes.state];
    ensure!(
        state.shape == expected,
        "array \"state\" has the shape {:?}; {expected:?} is needed: the recurrent state before each episode's first step, \
         hidden then cell state of each lstm, the state of each gru, in the order of the ops",
        state.shape
    );
    Ok(())
}

/// Returns the valid steps of each episode.
fn lengths(array: &Tensor, episodes: usize, steps: usize) -> Result<Vec<usize>> {
    let numbers: Vec<i64> = match &array.values {
        Values::I32(values) => values.iter().map(|&n| n.into()).collect(),
        Values::I64(values) => values.clone(),
        other => bail!("array \"length\" is of type {}; use int32 or int64", other.type_name()),
    };
    ensure!(
        array.shape == [episodes],
        "array \"length\" has the shape {:?}; [{episodes}] is needed: the valid steps of each episode",
        array.shape
    );
    let one = |(episode, n): (usize, i64)| {
        let n = usize::try_from(n).ok().with_context(|| format!("array \"length\" holds {n} for episode {episode}"))?;
        ensure!(n <= steps, "episode {episode} has length {n}, but the array \"obs\" holds {}", count(steps, "step"));
        Ok(n)
    };
    numbers.into_iter().enumerate().map(one).collect()
}
