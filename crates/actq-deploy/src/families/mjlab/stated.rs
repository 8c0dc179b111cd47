//! What the metadata state of the terms from mjlab 1.6.0 on: scale, clip and history.

use actq::error::{Context as _, Result, ensure};
use actq::text::printable;

use super::frames::MOST;
use crate::description::{Op, Operand};
use crate::document::Document;
use crate::yaml::Node;

/// Keys of lists with an entry for each term.
const SCALE: &str = "observation_terms_scale";
const CLIP: &str = "observation_terms_clip";
const LENGTH: &str = "observation_terms_history_length";
const FLAT: &str = "observation_terms_flatten_history_dim";
/// Largest difference of a number from the metadata's, which has 3 decimals.
pub(super) const ROUNDING: f64 = 0.0005;

/// What the metadata state of the terms; nothing for older exports.
#[derive(Debug, Default)]
pub(super) struct Stated {
    /// Factors of each term: one, or one for each value.
    pub(super) scale: Option<Vec<Vec<f64>>>,
    /// Limits of each term; nothing for infinite ones.
    pub(super) clip: Option<Vec<Option<[f64; 2]>>>,
    /// Frames of each term.
    pub(super) frames: Option<Vec<usize>>,
}

impl Stated {
    pub(super) fn of(meta: &Document, terms: usize) -> Result<Self> {
        let of = |key: &str| entries(meta, key, terms);
        let scale = of(SCALE)?;
        if let Some(number) = scale.iter().flatten().flatten().find(|number| !number.is_finite()) {
            return Err(actq::error::Error::input(format!("{}: {number} is not finite", meta.location(SCALE))));
        }
        let pair = |entry: Vec<f64>| -> Result<Option<[f64; 2]>> {
            let pair = <[f64; 2]>::try_from(entry).ok().filter(|[low, high]| low <= high);
            let [low, high] =
                pair.with_context(|| format!("{}: give two numbers for each term", meta.location(CLIP)))?;
            Ok((low.is_finite() || high.is_finite()).then_some([low, high]))
        };
        let clip = of(CLIP)?.map(|clips| clips.into_iter().map(pair).collect::<Result<_>>()).transpose()?;
        let frames = of(LENGTH)?.map(|lens| lens.into_iter().map(|len| frames(meta, &len)).collect::<Result<Vec<_>>>());
        let frames = frames.transpose()?;
        let flat = of(FLAT)?.unwrap_or_else(|| vec![vec![1.0]; terms]);
        for (i, (flat, frames)) in flat.iter().zip(frames.iter().flatten()).enumerate() {
            ensure!(
                flat[..] == [1.0] || *frames == 1,
                "{}: term {i} (from 0) has {frames} frames with an axis of their own, which is not supported",
                meta.location(FLAT)
            );
        }
        Ok(Self { scale, clip, frames })
    }

    /// Returns the operations on a term of `len` values: its clip, then its scale, which is the constant that
    /// [`Self::constant`] gives.
    pub(super) fn ops(&self, term: usize, name: &str) -> Vec<Op> {
        let finite = |bound: f64| Operand::Number(bound.clamp(f64::from(f32::MIN), f64::from(f32::MAX)));
        let clip = self.clip.as_ref().and_then(|clips| clips[term]).map(|limits| Op::Clip(limits.map(finite)));
        let scale = self.is_scaled(term).then(|| Op::Scale(Operand::Name(format!("scale_{name}"))));
        clip.into_iter().chain(scale).collect()
    }

    /// Returns a term's factors, if they are not 1.
    pub(super) fn constant(&self, meta: &Document, term: usize, name: &str, len: usize) -> Result<Option<Vec<f64>>> {
        let Some(scale) = self.scale.as_ref().filter(|_| self.is_scaled(term)) else { return Ok(None) };
        let scale = &scale[term];
        ensure!(
            [1, len].contains(&scale.len()),
            "{}: term {:?} has {len} values, and {} factors",
            meta.location(SCALE),
            printable(name),
            scale.len()
        );
        Ok(Some(if scale.len() == len { scale.clone() } else { vec![scale[0]; len] }))
    }

    fn is_scaled(&self, term: usize) -> bool {
        self.scale.as_ref().is_some_and(|scale| scale[term].iter().any(|factor| *factor != 1.0))
    }

    /// Returns where the scales and clips are.
    pub(super) fn source(meta: &Document) -> String {
        format!("{}, {CLIP}", meta.location(SCALE))
    }

    /// Returns where the histories are.
    pub(super) fn length_source(meta: &Document) -> String {
        meta.location(LENGTH)
    }
}

/// Reads a number of frames, which has decimals; 0 is the current frame alone.
fn frames(meta: &Document, entry: &[f64]) -> Result<usize> {
    let [len] = *entry else {
        return Err(actq::error::Error::input(format!("{}: give a number for each term", meta.location(LENGTH))));
    };
    ensure!(
        len >= 0.0 && len.fract() == 0.0 && len <= MOST as f64,
        "{}: {len} is not a number of frames from 0 to {MOST}",
        meta.location(LENGTH)
    );
    Ok((len as usize).max(1))
}

/// Reads a list with commas between its entries and semicolons between an entry's numbers, which may be infinite.
fn entries(meta: &Document, key: &str, terms: usize) -> Result<Option<Vec<Vec<f64>>>> {
    let Some(text) = meta.optional(key, "a text", Node::text)? else { return Ok(None) };
    let number = |word: &str| {
        let number: Option<f64> = word.trim().parse().ok().filter(|number: &f64| !number.is_nan());
        number.with_context(|| format!("{}: {:?} is not a number", meta.location(key), printable(word.trim())))
    };
    let entry = |entry: &str| entry.split(';').map(number).collect::<Result<Vec<f64>>>();
    let entries = text.split(',').map(entry).collect::<Result<Vec<_>>>()?;
    ensure!(
        entries.len() == terms,
        "{} has {} entries, and observation_names {terms}",
        meta.location(key),
        entries.len()
    );
    Ok(Some(entries))
}
