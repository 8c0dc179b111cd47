//! Comparison of a description with what upstream's deploy code computes: raw inputs, and observation, action and
//! target, tick by tick.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

use actq::data::arrays;
use actq::error::{Context as _, Result, bail, ensure};
use actq::text::count;

use crate::conventions::{Variant, variants};
use crate::description::Description;
use crate::plan::Plan;
use crate::run::{Runner, Tick};
use crate::sources::{Array, Sources};

/// Largest difference, as a share of the largest value of its array.
pub const TOLERANCE: f64 = 1e-5;

/// Raw inputs `[tick, value]` by name.
#[derive(Clone, Debug)]
pub struct Raw {
    /// Name of the file, for messages.
    name: String,
    ticks: usize,
    arrays: BTreeMap<String, Array>,
}

impl Raw {
    /// Reads the arrays of an .npz file.
    ///
    /// # Errors
    ///
    /// If it cannot be read, or its arrays have no ticks or different numbers of them.
    pub fn read(path: &Path) -> Result<Self> {
        let (name, arrays) = (path.display().to_string(), numbers(path)?);
        let ticks = ticks(&arrays, None).with_context(|| name.clone())?;
        Ok(Self { name, ticks, arrays })
    }

    /// Returns the raw arrays that no input has the name of.
    pub fn unused<'a>(&'a self, plan: &'a Plan) -> impl Iterator<Item = &'a str> {
        let known = |name: &&str| plan.inputs.iter().any(|(input, _)| input == name);
        self.arrays.keys().map(String::as_str).filter(move |name| !known(name))
    }

    /// Returns the raw inputs of each tick, in the order of `inputs`: names and lengths, as [`Plan::inputs`].
    ///
    /// # Errors
    ///
    /// If an input has no array, or one of another length.
    pub fn frames(&self, inputs: &[(String, usize)]) -> Result<Vec<Vec<Vec<f64>>>> {
        let mut frames = vec![Vec::with_capacity(inputs.len()); self.ticks];
        for (name, len) in inputs {
            let array = self.arrays.get(name).with_context(|| {
                let all = self.arrays.keys().cloned().collect::<Vec<_>>().join(", ");
                format!("{}: there is no raw array {name:?}; expected one of {all}", self.name)
            })?;
            let (_, row) = array.rows()?;
            ensure!(
                row == *len,
                "{}: raw array {name:?} has {} a tick, and the input {len}",
                self.name,
                count(row, "value")
            );
            for (frame, values) in frames.iter_mut().zip(array.values.chunks(row)) {
                frame.push(values.to_vec());
            }
        }
        Ok(frames)
    }

    /// Names a tick, for messages.
    fn at(&self, tick: usize) -> String {
        format!("{}: tick {tick}", self.name)
    }

    /// Runs a plan on the raw inputs.
    ///
    /// # Errors
    ///
    /// If an input is missing or has another length, or a quaternion is not an orientation.
    pub fn run(&self, plan: Plan) -> Result<Vec<Tick>> {
        let frames = self.frames(&plan.inputs)?;
        let mut runner = Runner::new(plan);
        let step = |(t, frame): (usize, &Vec<Vec<f64>>)| runner.step(frame).with_context(|| self.at(t));
        frames.iter().enumerate().map(step).collect()
    }
}

/// Tick that a comparison ends after.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Ends {
    /// The first that differs.
    First,
    /// The last.
    Last,
}

/// Actions that targets and states are made of.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Fed {
    /// Those of the reference, if it has some.
    Recorded,
    /// Those of the description.
    Own,
}

/// A reference: what goes in, and what comes out.
#[derive(Clone, Debug)]
pub struct Reference {
    raw: Raw,
    /// Of "observation", "action" and "target", those that the file has.
    expected: BTreeMap<&'static str, Array>,
}

/// Arrays of a reference's second file.
const KINDS: [&str; 3] = [OBSERVATION, ACTION, TARGET];
const OBSERVATION: &str = "observation";
const ACTION: &str = "action";
const TARGET: &str = "target";

/// Values of a tick, by kind.
pub(crate) type Values = [Vec<f64>; 3];

fn values_of(tick: Tick) -> Values {
    [tick.observation, tick.action, tick.targets.into_iter().flat_map(|(_, values)| values).collect()]
}

/// Reads all arrays of a file as numbers.
fn numbers(path: &Path) -> Result<BTreeMap<String, Array>> {
    let array = |(name, tensor)| {
        let array = Array::of(tensor).with_context(|| format!("{}: array {name:?}", path.display()))?;
        Ok((name, array))
    };
    arrays(path)?.into_iter().map(array).collect()
}

/// Returns the number of ticks of arrays, which all have the same, and `expected` if it is given.
fn ticks<'a>(
    arrays: impl IntoIterator<Item = (&'a (impl AsRef<str> + ?Sized + 'a), &'a Array)>,
    expected: Option<usize>,
) -> Result<usize> {
    let mut ticks = expected;
    for (name, array) in arrays {
        let name = name.as_ref();
        let (rows, row) = array.rows().with_context(|| format!("array {name:?}"))?;
        let first = *ticks.get_or_insert(rows);
        ensure!(rows == first, "array {name:?} has {}, and others {first}", count(rows, "tick"));
        ensure!(row > 0, "array {name:?} has no values");
    }
    ticks.filter(|ticks| *ticks > 0).context("it has no ticks")
}

impl Reference {
    /// Reads the raw inputs and the expected results, two .npz files.
    ///
    /// # Errors
    ///
    /// If a file cannot be read, holds no ticks, or arrays of different numbers of ticks.
    pub fn read(raw: &Path, expect: &Path) -> Result<Self> {
        let (raw, mut expected) = (Raw::read(raw)?, numbers(expect)?);
        let expected: BTreeMap<_, _> =
            KINDS.into_iter().filter_map(|kind| Some((kind, expected.remove(kind)?))).collect();
        ensure!(!expected.is_empty(), "{}: it has none of the arrays {}", expect.display(), KINDS.join(", "));
        let named = expected.iter().map(|(name, array)| (*name, array));
        ticks(named, Some(raw.ticks)).with_context(|| expect.display().to_string())?;
        for (kind, array) in &expected {
            if let Some(i) = array.values.iter().position(|value| !value.is_finite()) {
                let ((_, row), value) = (array.rows()?, array.values[i]);
                bail!("{}: array {kind:?} is {value} at tick {}, value {}", expect.display(), i / row, i % row);
            }
        }
        Ok(Self { raw, expected })
    }

    /// Returns the raw inputs.
    pub fn raw(&self) -> &Raw {
        &self.raw
    }

    /// Returns an expected array `[tick, value]`: "observation", "action" or "target".
    pub fn array(&self, kind: &str) -> Option<&Array> {
        self.expected.get(kind)
    }

    /// Runs a description on the raw inputs and compares the results. Recorded actions, if the reference has them, take
    /// the place of the description's in all that follows from them, so that rounding does not add up; what the
    /// description makes of its own actions is the drift.
    ///
    /// # Errors
    ///
    /// If the description is wrong, an array is missing or has another length, or a quaternion is not an orientation.
    pub fn compare(&self, description: &Description, sources: &dyn Sources) -> Result<Comparison> {
        let plan = || Plan::new(description, sources);
        let mut comparison = self.run(plan()?, &self.rounding(description, sources)?, Ends::Last, Fed::Recorded)?;
        if comparison.first.is_none() && self.expected.contains_key(ACTION) {
            comparison.drift = self.run(plan()?, &[], Ends::Last, Fed::Own)?.largest;
        }
        Ok(comparison)
    }

    /// Returns the largest difference that the rounding of constants makes in each value of each tick.
    fn rounding(&self, description: &Description, sources: &dyn Sources) -> Result<Vec<Values>> {
        if description.rounding.is_empty() {
            return Ok(Vec::new());
        }
        let own = self.values(Plan::new(description, sources)?)?;
        let mut sizes = own.clone();
        sizes.iter_mut().flatten().flatten().for_each(|size| *size = 0.0);
        for (constant, by) in &description.rounding {
            let mut other = description.clone();
            other.constants.get_mut(constant).into_iter().flatten().for_each(|number| *number += by);
            let other = self.values(Plan::new(&other, sources)?)?;
            let all = |values: &[Values]| values.iter().flatten().flatten().copied().collect::<Vec<f64>>();
            let differences = all(&own).into_iter().zip(all(&other)).map(|(a, b)| (a - b).abs());
            sizes.iter_mut().flatten().flatten().zip(differences).for_each(|(size, difference)| *size += difference);
        }
        Ok(sizes)
    }

    /// Returns what a plan makes of the raw inputs and the recorded actions.
    pub(crate) fn values(&self, plan: Plan) -> Result<Vec<Values>> {
        let frames = self.raw.frames(&plan.inputs)?;
        let mut runner = Runner::new(plan);
        frames.iter().enumerate().map(|(t, frame)| self.tick(&mut runner, t, frame, Fed::Recorded)).collect()
    }

    fn tick(&self, runner: &mut Runner, t: usize, frame: &[Vec<f64>], fed: Fed) -> Result<Values> {
        let plan = runner.plan();
        let len = plan.values[plan.action].labels.len();
        let recorded = self
            .expected
            .get(ACTION)
            .filter(|_| fed == Fed::Recorded)
            .map(|array| self.row(array, ACTION, t, len))
            .transpose()?;
        Ok(values_of(runner.step_after(frame, recorded).with_context(|| self.raw.at(t))?))
    }

    /// Returns the values of a tick in an expected array of `len` values a tick.
    fn row<'a>(&self, array: &'a Array, kind: &str, t: usize, len: usize) -> Result<&'a [f64]> {
        let (_, row) = array.rows()?;
        ensure!(len == row, "{kind}: the description gives {len} values, and the reference has {row}");
        Ok(&array.values[t * row..][..row])
    }

    /// Returns the largest value of an expected array.
    fn largest(&self, kind: &str) -> f64 {
        let values = self.expected.get(kind).into_iter().flat_map(|array| &array.values);
        values.fold(f64::MIN_POSITIVE, |most, value| most.max(value.abs()))
    }

    /// Compares. `rounding` are the sizes of differences that need no other cause, none if it is empty.
    fn run(&self, plan: Plan, rounding: &[Values], ends: Ends, fed: Fed) -> Result<Comparison> {
        let frames = self.raw.frames(&plan.inputs)?;
        let labels: Vec<String> = plan.observation_labels().iter().map(ToString::to_string).collect();
        let (limits, scales) = (plan.target_limits().concat(), KINDS.map(|kind| self.largest(kind)));
        let mut runner = Runner::new(plan);
        let mut comparison = Comparison { ticks: self.raw.ticks, ..Comparison::default() };
        for (t, frame) in frames.iter().enumerate() {
            if ends == Ends::First && comparison.first.is_some() {
                break;
            }
            let values = self.tick(&mut runner, t, frame, fed)?;
            for (i, (kind, values)) in KINDS.into_iter().zip(&values).enumerate() {
                let Some(array) = self.expected.get(kind) else { continue };
                let expected = self.row(array, kind, t, values.len())?;
                let scale = scales[i];
                for (place, (got, &given)) in values.iter().zip(expected).enumerate() {
                    let mut expected = given;
                    if kind == TARGET
                        && let Some([low, high]) = limits.get(place)
                    {
                        expected = given.clamp(*low, *high);
                        comparison.held += usize::from(expected != given);
                    }
                    let difference = (got - expected).abs();
                    let largest = comparison.largest.entry(kind).or_insert(0.0);
                    // A NaN is a difference, too.
                    *largest = if difference.is_nan() { f64::INFINITY } else { largest.max(difference / scale) };
                    let size = rounding.get(t).map_or(0.0, |values| values[i][place]);
                    if difference <= TOLERANCE * scale {
                        continue;
                    }
                    if difference <= TOLERANCE * scale + size {
                        let [most, of] = comparison.rounded.entry(kind).or_insert([0.0; 2]);
                        (*most, *of) = (most.max(difference), of.max(size));
                    } else if comparison.first.is_none() {
                        let what = if kind == OBSERVATION { labels[place].clone() } else { format!("{kind}[{place}]") };
                        comparison.first = Some(Difference { tick: t, kind, what, got: *got, expected });
                    }
                }
            }
        }
        Ok(comparison)
    }
}

/// Returns the conventions that explain a difference: those that agree with the reference if they alone are changed.
///
/// # Errors
///
/// If the reference does not fit the description.
pub fn explain(description: &Description, sources: &dyn Sources, reference: &Reference) -> Result<Vec<String>> {
    let agrees = |variant: &Variant| -> bool {
        // A variant whose lengths do not fit is no explanation.
        let compared = Plan::new(&variant.description, sources)
            .and_then(|plan| reference.run(plan, &[], Ends::First, Fed::Recorded));
        compared.is_ok_and(|comparison| comparison.first.is_none())
    };
    reference.raw.frames(&Plan::new(description, sources)?.inputs)?;
    Ok(variants(description).into_iter().filter(agrees).map(|variant| variant.convention).collect())
}

/// Result of a comparison.
#[derive(Clone, Debug, Default)]
pub struct Comparison {
    /// Ticks that were compared.
    pub ticks: usize,
    /// Largest difference of each array, as a share of its largest value, with recorded actions fed back.
    pub largest: BTreeMap<&'static str, f64>,
    /// The same with the description's own actions, if the reference has actions.
    pub drift: BTreeMap<&'static str, f64>,
    /// Of arrays with differences above [`TOLERANCE`] that the rounding of constants explains: the largest difference,
    /// and the largest that rounding explains.
    pub rounded: BTreeMap<&'static str, [f64; 2]>,
    /// Expected targets beyond the limits of the description, which holds them there.
    pub held: usize,
    /// The first difference above [`TOLERANCE`].
    pub first: Option<Difference>,
}

/// A number that differs.
#[derive(Clone, Debug)]
pub struct Difference {
    /// Tick, from 0.
    pub tick: usize,
    /// Array.
    pub kind: &'static str,
    /// The number, by its term and joint.
    pub what: String,
    /// Its value by the description.
    pub got: f64,
    /// Its value in the reference.
    pub expected: f64,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { tick, kind, what, got, expected } = self;
        write!(f, "tick {tick}, {kind}: {what} is {got:.6}, and the reference has {expected:.6}")
    }
}
