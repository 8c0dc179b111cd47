//! Several recordings, learned from as one.

use std::path::PathBuf;

use ndarray::{Array2, Array3, s};

use super::dataset::Dataset;
use super::recording::Recording;
use super::sizes::Sizes;
use super::thinning::{Place, episodes, frames, places};
use crate::error::{Context as _, Result, ensure};
use crate::graph::Graph;
use crate::policy::Policy;

/// Most frames to learn from; a larger recording is thinned to the most diverse frames (`docs/QUANTIZER.md`,
/// Recordings). Statistics are collected frame by frame, in order.
pub const MAX_FRAMES: usize = 400_000;
/// Most bytes of a joined recording, padding counted.
const MAX_BYTES: usize = 4 << 30;

/// The recording to learn from, and its sources.
#[derive(Clone, Debug)]
pub struct Learned {
    /// All sources as one recording.
    pub dataset: Dataset,
    /// Share of every file, in the order in which they were named.
    pub shares: Vec<Share>,
}

/// Contribution of one file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Share {
    /// The file.
    pub path: PathBuf,
    /// Episodes of the file that hold a step.
    pub episodes: usize,
    /// Frames of the file.
    pub frames: usize,
    /// Frames that are learned from.
    pub kept: usize,
}

impl Learned {
    /// Reads `files`, or without any the recording in the policy's folder; `None` if it has none. Every error names the
    /// file.
    pub fn load(policy: &Policy, files: &[PathBuf]) -> Result<Option<Self>> {
        let sizes = Sizes::of(policy);
        let mut parts = files.iter().map(|file| Dataset::load(file, sizes)).collect::<Result<Vec<_>>>()?;
        if files.is_empty() {
            parts.extend(Recording::Calib.load(Some(&policy.dir), None, sizes)?);
        }
        if parts.is_empty() { Ok(None) } else { Self::join(&mut parts, &policy.graph).map(Some) }
    }

    /// Joins recordings that fit the network. Episodes are padded to the longest. If only some have actions, the f32
    /// network fills in the others (in `parts` as well); if only some have states, the others are zero.
    pub fn join(parts: &mut [Dataset], graph: &Graph) -> Result<Self> {
        Self::at_most(MAX_FRAMES, parts, graph)
    }

    fn at_most(most: usize, parts: &mut [Dataset], graph: &Graph) -> Result<Self> {
        let share = |part: &Dataset| Share {
            path: part.path.clone(),
            episodes: part.length.iter().filter(|n| **n > 0).count(),
            frames: part.frames(),
            kept: part.frames(),
        };
        let mut shares: Vec<Share> = parts.iter().map(share).collect();
        let whole = shares.iter().map(|share| share.frames).sum::<usize>() <= most;
        if let ([one], true) = (&*parts, whole) {
            return Ok(Self { dataset: one.clone(), shares });
        }
        if parts.iter().any(|part| part.action.is_some()) {
            parts.iter_mut().for_each(|part| part.fill_actions(graph));
        }
        if whole {
            return Ok(Self { dataset: joined(parts, graph.state_len())?, shares });
        }
        let chosen = if graph.state_len() > 0 { episodes(parts, most) } else { vec![frames(parts, most)] };
        let mut kept = vec![0; parts.len()];
        chosen.iter().flatten().for_each(|place| kept[place.part] += 1);
        shares.iter_mut().zip(kept).for_each(|(share, kept)| share.kept = kept);
        Ok(Self { dataset: gather(parts, &chosen, graph.state_len())?, shares })
    }
}

/// Joins several recordings into one, without actions if one has none; `state_len` is that of their policy.
pub fn joined(parts: &[Dataset], state_len: usize) -> Result<Dataset> {
    let episodes = places(parts);
    gather(parts, &if state_len > 0 { episodes } else { cut(episodes) }, state_len)
}

/// Returns the steps after which episodes of a feed-forward policy are cut, so that padding is at most twice their
/// `frames` frames, however long the longest is.
pub fn longest_piece(frames: usize, episodes: usize) -> usize {
    (2 * frames).div_ceil(episodes.max(1)).max(1)
}

/// Cuts long episodes of a feed-forward policy; its result does not change.
fn cut(episodes: Vec<Vec<Place>>) -> Vec<Vec<Place>> {
    let steps = longest_piece(episodes.iter().map(Vec::len).sum(), episodes.len());
    episodes.iter().flat_map(|episode| episode.chunks(steps)).map(<[Place]>::to_vec).collect()
}

/// Returns the chosen frames of each episode as one recording.
fn gather(parts: &[Dataset], chosen: &[Vec<Place>], state_len: usize) -> Result<Dataset> {
    let first = parts.first().context("no recording to learn from")?;
    let longest = chosen.iter().map(Vec::len).max().unwrap_or(0);
    let widths = [Some(&first.obs), first.action.as_ref()].into_iter().flatten().map(|array| array.dim().2);
    let bytes = widths.sum::<usize>().saturating_mul(chosen.len()).saturating_mul(longest).saturating_mul(4);
    ensure!(
        bytes <= MAX_BYTES,
        "{} and the recordings joined with it: {} episodes, padded to the longest of {longest} steps, take {} MiB, {} are the \
         most; cut the longest into windows that begin with their \"state\"",
        first.path.display(),
        chosen.len(),
        bytes >> 20,
        MAX_BYTES >> 20
    );
    let rows = |array: &dyn Fn(&Dataset) -> Option<&Array3<f32>>| -> Option<Array3<f32>> {
        let arrays = parts.iter().map(array).collect::<Option<Vec<_>>>()?;
        let mut rows = Array3::zeros((chosen.len(), longest, arrays.first()?.dim().2));
        for (e, places) in chosen.iter().enumerate() {
            for (step, place) in places.iter().enumerate() {
                let from = arrays[place.part].slice(s![place.episode, place.step, ..]);
                rows.slice_mut(s![e, step, ..]).assign(&from);
            }
        }
        Some(rows)
    };
    let state = parts.iter().any(|part| part.state.is_some()).then(|| {
        let starts = chosen.iter().map(|places| {
            let first = places.first().filter(|place| place.step == 0);
            first.and_then(|place| parts[place.part].start(place.episode))
        });
        let mut state = Array2::zeros((chosen.len(), state_len));
        for (mut row, start) in state.rows_mut().into_iter().zip(starts) {
            row.iter_mut().zip(start.into_iter().flatten()).for_each(|(to, from)| *to = from);
        }
        state
    });
    let mut path = first.path.clone().into_os_string();
    if parts.len() > 1 {
        path.push(format!(" and {} more", parts.len() - 1));
    }
    Ok(Dataset {
        path: path.into(),
        obs: rows(&|part| Some(&part.obs)).context("no recording to learn from")?,
        action: rows(&|part| part.action.as_ref()),
        length: chosen.iter().map(Vec::len).collect(),
        state,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{dataset, lstm, mlp};

    fn named(name: &str, part: Dataset) -> Dataset {
        Dataset { path: format!("folder/{name}").into(), ..part }
    }

    fn rows(dataset: &Dataset) -> Vec<Vec<f32>> {
        dataset.observations().map(|row| row.to_vec()).collect()
    }

    #[test]
    fn one_short_recording_is_unchanged() {
        let graph = mlp();
        let whole = named("calib.npz", dataset(&graph, 3, 10));
        let joined = Learned::join(&mut [whole.clone()], &graph).expect("joined");
        assert_eq!((&joined.dataset.obs, &joined.dataset.path), (&whole.obs, &whole.path));
        let share = Share { path: whole.path, episodes: 3, frames: 30, kept: 30 };
        assert_eq!(joined.shares, [share]);
    }

    #[test]
    fn joining_fills_missing_arrays() {
        let graph = lstm();
        let (mut first, mut second) = (named("a.npz", dataset(&graph, 2, 8)), named("b.npz", dataset(&graph, 2, 5)));
        let labels = second.action.take();
        second.length = vec![5, 0];
        first.state = Some(Array2::ones((2, 6)));
        let joined = Learned::join(&mut [first.clone(), second.clone()], &graph).expect("joined");
        let all = &joined.dataset;
        assert_eq!((all.obs.dim(), &all.length[..]), ((3, 8, 2), &[8, 8, 5][..]), "an empty episode is dropped");
        assert_eq!(all.path.to_str(), Some("folder/a.npz and 1 more"));
        assert_eq!(rows(all), [rows(&first), rows(&second)].concat());
        assert_eq!(all.start(1), Some(vec![1.0; 6]));
        assert_eq!(all.start(2), Some(vec![0.0; 6]));
        let label = |a: &Dataset, e: usize, s: usize| a.action_at(e, s).expect("actions");
        let own = labels.expect("actions");
        assert_eq!(label(all, 1, 7), label(&first, 1, 7));
        let near = |a: &[f32], b: &[f32]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-5);
        assert!(near(&label(all, 2, 4), &own.slice(s![0, 4, ..]).to_vec()));
        let kept: Vec<_> = joined.shares.iter().map(|s| (s.episodes, s.frames, s.kept)).collect();
        assert_eq!(kept, [(2, 16, 16), (1, 5, 5)]);
    }

    #[test]
    fn thinning_keeps_actions_with_their_observations() {
        for graph in [mlp(), lstm()] {
            let mut parts = [named("a.npz", dataset(&graph, 6, 20)), named("b.npz", dataset(&graph, 4, 30))];
            let joined = Learned::at_most(100, &mut parts, &graph).expect("joined");
            let all = &joined.dataset;
            assert!(all.frames() <= 100 && all.frames() > 60, "{}", all.frames());
            assert_eq!(joined.shares.iter().map(|s| s.kept).sum::<usize>(), all.frames());
            let recorded: Vec<(Vec<f32>, Option<Vec<f32>>)> = parts
                .iter()
                .flat_map(|p| (0..p.length.len()).flat_map(move |e| (0..p.length[e]).map(move |s| (p, e, s))))
                .map(|(p, e, s)| (p.obs.slice(s![e, s, ..]).to_vec(), p.action_at(e, s)))
                .collect();
            for (e, length) in all.length.iter().enumerate() {
                for step in 0..*length {
                    let pair = (all.obs.slice(s![e, step, ..]).to_vec(), all.action_at(e, step));
                    assert!(recorded.contains(&pair), "episode {e}, step {step}");
                }
            }
            let again = Learned::at_most(100, &mut parts, &graph).expect("joined");
            assert_eq!((again.dataset.obs, again.shares), (joined.dataset.obs, joined.shares));
        }
    }

    #[test]
    fn one_long_episode_limits_padding() {
        let graph = mlp();
        let mut parts = [named("a.npz", dataset(&graph, 1, 1000)), named("b.npz", dataset(&graph, 100, 2))];
        let joined = Learned::join(&mut parts, &graph).expect("joined").dataset;
        let (episodes, steps, _) = joined.obs.dim();
        assert!(episodes * steps <= 3 * 1200, "{episodes} x {steps}");
        assert_eq!(rows(&joined), [rows(&parts[0]), rows(&parts[1])].concat());
    }
}
