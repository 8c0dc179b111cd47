//! The object `action` of `policy.json`, and its keys for the playback of actions.

use serde::{Deserialize, Serialize};

use crate::contract::{ActionContract, Binarise};
use crate::error::{Context, Result, bail, ensure};
use crate::numbers::real;

/// Constant that RLDS adds to the distance of two quantiles, so that it is not 0.
const QUANTILE_EPS: f64 = 1e-8;

/// An array with a value for each action; null if it does not apply to an action.
pub type Array = Option<Vec<Option<f64>>>;

/// Keys of `action`.
#[derive(Clone, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct JsonContract {
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean: Array,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub std: Array,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub q01: Array,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub q99: Array,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale: Array,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub offset: Array,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub binarise: Option<JsonBinarise>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub low: Array,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub high: Array,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_step: Array,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub smoothing: Array,
}

/// Keys of `action.binarise`.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct JsonBinarise {
    on: Array,
    off: Array,
    on_value: Array,
    off_value: Array,
}

/// Limits that a user states for the actions: one value for all of them, one for each, or none. Infinite values limit
/// nothing.
#[derive(Clone, Debug, Default)]
pub struct StatedLimits {
    /// Lowest values, in the unit of the actions.
    pub low: Vec<f64>,
    /// Highest values.
    pub high: Vec<f64>,
    /// Largest changes from one action to the next, above 0.
    pub max_step: Vec<f64>,
}

impl StatedLimits {
    /// Returns `true` if nothing is stated.
    pub fn is_empty(&self) -> bool {
        self.low.is_empty() && self.high.is_empty() && self.max_step.is_empty()
    }

    /// Returns the limits of each of `act_dim` actions: of those stated and those in `known`, the stricter ones. `of`
    /// says in an error what `known` belongs to.
    ///
    /// # Errors
    ///
    /// If the number of values is neither 1 nor `act_dim`, a value is NaN or beyond f32, or no value is within both.
    pub fn within(&self, known: &[[f64; 2]], of: &str) -> Result<Vec<[f64; 2]>> {
        let sides = [("low", &self.low, f64::NEG_INFINITY), ("high", &self.high, f64::INFINITY)];
        let [low, high] = sides.map(|(name, values, none)| each(name, values, none, known.len()));
        let limits = low?.into_iter().zip(high?).zip(known).enumerate();
        let stricter = |(i, ((low, high), [known_low, known_high])): (usize, ((f64, f64), &[f64; 2]))| {
            ensure!(low <= high, "low of action {i} is {low:?}, above its high, {high:?}");
            let both = [low.max(*known_low), high.min(*known_high)];
            ensure!(
                both[0] <= both[1],
                "no value of action {i} is within {low:?} to {high:?}, as you state, and within {known_low:?} to {known_high:?}, as {of} says"
            );
            Ok(both)
        };
        limits.map(stricter).collect()
    }
}

/// Returns a value for each of `len` actions.
fn each(name: &str, values: &[f64], none: f64, len: usize) -> Result<Vec<f64>> {
    ensure!(
        values.len() <= 1 || values.len() == len,
        "{name} has {} values for {len} actions; give one for each, or one for all",
        values.len()
    );
    if let Some(i) = values.iter().position(|x| x.is_nan() || x.is_finite() && !(*x as f32).is_finite()) {
        bail!("{name}[{i}] is {:?}; it must be a number within the range of float32", values[i]);
    }
    let value = |i: usize| values.get(i).or(values.first()).map_or(none, |x| *x);
    Ok((0..len).map(value).collect())
}

/// Keys of `ensemble`.
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct JsonEnsemble {
    pub horizon: usize,
    pub m: Option<f64>,
}

impl JsonContract {
    /// Returns gain and shift of each action, `a = x * gain + shift`, if the network's output is normalized.
    fn unnormalise(&self, act_dim: usize) -> Result<Option<Vec<[f64; 2]>>> {
        let normal = pairs(["mean", "std"], [&self.mean, &self.std], act_dim)?;
        let quantiles = pairs(["q01", "q99"], [&self.q01, &self.q99], act_dim)?;
        let pairs = match (&normal, &quantiles) {
            (None, None) => return Ok(None),
            (Some(_), Some(_)) => bail!("action has both mean and std, and q01 and q99; remove one pair"),
            (Some(pairs), None) | (None, Some(pairs)) => pairs,
        };
        let affine = |(i, pair): (usize, &Option<[f64; 2]>)| {
            let Some([first, second]) = *pair else { return Ok([1.0, 0.0]) };
            if normal.is_some() {
                ensure!(second > 0.0, "action.std[{i}] is {second:?}; it must be above 0");
                return Ok([second, first]);
            }
            ensure!(first <= second, "action.q01[{i}] is {first:?}, above action.q99[{i}], {second:?}");
            let half = 0.5 * (second - first + QUANTILE_EPS);
            Ok([half, half + first])
        };
        pairs.iter().enumerate().map(affine).collect::<Result<_>>().map(Some)
    }

    /// Adds what a user states; of two limits, the stricter one holds.
    ///
    /// # Errors
    ///
    /// As [`Self::contract`] and [`StatedLimits::within`], and for a `max_step` that is not above 0.
    pub fn limited(mut self, stated: &StatedLimits, act_dim: usize) -> Result<Self> {
        self.contract(act_dim)?;
        let known = |array: &Array, i: usize, none: f64| array.as_ref().and_then(|array| array[i]).unwrap_or(none);
        let unlimited = f64::from(f32::MAX);
        let own = |i: usize| [known(&self.low, i, -unlimited), known(&self.high, i, unlimited)];
        let limits = stated.within(&(0..act_dim).map(own).collect::<Vec<_>>(), "the network")?;
        if !stated.low.is_empty() || !stated.high.is_empty() {
            [self.low, self.high] = [0, 1].map(|side| Some(limits.iter().map(|limits| Some(limits[side])).collect()));
        }
        if !stated.max_step.is_empty() {
            let steps = each("max_step", &stated.max_step, unlimited, act_dim)?;
            if let Some(i) = steps.iter().position(|step| *step <= 0.0) {
                bail!("max_step[{i}] is {:?}; it must be above 0", steps[i]);
            }
            self.max_step = Some(steps.into_iter().map(|step| Some(step.min(unlimited))).collect());
        }
        Ok(self)
    }

    /// Returns the contract of `act_dim` actions, with denormalization folded into scale and offset.
    pub fn contract(&self, act_dim: usize) -> Result<ActionContract> {
        let values = |name: &str, array: &Array, missing: Option<f64>| values(name, array, missing, act_dim);
        let array = |name: &str, array: &Array| {
            let Some(values) = values(name, array, None)? else { return Ok(None) };
            reals(name, &values).map(Some)
        };
        let affine = self.unnormalise(act_dim)?;
        let (mut scale, mut offset) = (array("scale", &self.scale)?, array("offset", &self.offset)?);
        if let Some(affine) = affine {
            let (by, plus) = (values("scale", &self.scale, None)?, values("offset", &self.offset, None)?);
            let by = |i: usize| by.as_ref().map_or(1.0, |by| by[i]);
            let plus = |i: usize| plus.as_ref().map_or(0.0, |plus| plus[i]);
            let both = affine.iter().enumerate().map(|(i, [gain, shift])| (gain * by(i), shift * by(i) + plus(i)));
            let (gains, shifts): (Vec<f64>, Vec<f64>) = both.unzip();
            scale = Some(reals("scale, with denormalization,", &gains)?);
            offset = Some(reals("offset, with denormalization,", &shifts)?);
        }
        let binarise = self.binarise.as_ref().map(|json| json.binarise(act_dim)).transpose()?;
        let [low, high] = [array("low", &self.low)?, array("high", &self.high)?];
        let [max_step, smoothing] = [array("max_step", &self.max_step)?, array("smoothing", &self.smoothing)?];
        Ok(ActionContract { scale, offset, binarise, low, high, max_step, smoothing, ..ActionContract::default() })
    }
}

impl JsonBinarise {
    fn binarise(&self, act_dim: usize) -> Result<Binarise> {
        let named =
            [("on", &self.on), ("off", &self.off), ("on_value", &self.on_value), ("off_value", &self.off_value)];
        let mut arrays = named.map(|_| Vec::new());
        for (to, (key, array)) in arrays.iter_mut().zip(named) {
            let name = format!("binarise.{key}");
            // If both values are 0, the action is not binarized.
            let values = values(&name, array, Some(0.0), act_dim)?;
            *to = reals(&name, &values.with_context(|| format!("action.{name} is missing"))?)?;
        }
        let concerned = |array: &Array| array.iter().flatten().map(Option::is_some).collect::<Vec<bool>>();
        if let Some((key, _)) = named.iter().find(|(_, array)| concerned(array) != concerned(&self.on)) {
            bail!("action.binarise.{key} is null for other actions than action.binarise.on");
        }
        let [on, off, on_value, off_value] = arrays;
        for i in (0..act_dim).filter(|&i| self.on.as_ref().is_some_and(|on| on[i].is_some())) {
            let value = on_value[i];
            ensure!(value != off_value[i], "action.binarise.on_value[{i}] and off_value[{i}] are both {value:?}");
        }
        Ok(Binarise { on, off, on_value, off_value })
    }
}

/// Returns the pairs of two arrays. Both must be present or absent, and null in the same places.
fn pairs([one, two]: [&str; 2], arrays: [&Array; 2], act_dim: usize) -> Result<Option<Vec<Option<[f64; 2]>>>> {
    let [Some(first), Some(second)] = arrays else {
        ensure!(
            arrays[0].is_none() && arrays[1].is_none(),
            "action has only one of {one} and {two}; denormalization needs both"
        );
        return Ok(None);
    };
    for (name, array) in [(one, first), (two, second)] {
        let len = array.len();
        ensure!(len == act_dim, "action.{name} has {len} values, but act_dim is {act_dim}");
    }
    let pair = |(i, (first, second)): (usize, (&Option<f64>, &Option<f64>))| {
        let same = first.is_some() == second.is_some();
        ensure!(
            same,
            "only one of action.{one}[{i}] and action.{two}[{i}] is null; set both to null for an action that is not normalized"
        );
        Ok(first.zip(*second).map(|(first, second)| [first, second]))
    };
    first.iter().zip(second).enumerate().map(pair).collect::<Result<_>>().map(Some)
}

/// Returns an array's values; `missing` replaces null, which is refused without it.
fn values(name: &str, array: &Array, missing: Option<f64>, act_dim: usize) -> Result<Option<Vec<f64>>> {
    let Some(array) = array else { return Ok(None) };
    let len = array.len();
    ensure!(len == act_dim, "action.{name} has {len} values, but act_dim is {act_dim}");
    let one = |(i, v): (usize, &Option<f64>)| {
        v.or(missing).with_context(|| format!("action.{name}[{i}] is null; it must be a number"))
    };
    array.iter().enumerate().map(one).collect::<Result<_>>().map(Some)
}

fn reals(name: &str, values: &[f64]) -> Result<Vec<f32>> {
    values.iter().enumerate().map(|(i, v)| real(*v, &format!("action.{name}[{i}]"))).collect()
}
