//! The parts of a plan.

use crate::description::{Clock, End, Op, TargetKind};
use crate::label::{Label, labels};
use crate::sources::{Array, Compute};

/// Index of a value among all of a description.
pub(crate) type ValueIndex = usize;

pub(crate) enum ValueSource {
    /// Raw input `0`, which the application writes.
    Input(usize),
    /// State `0`.
    State(usize),
    /// Clock `0`, which reads the norms of these values.
    Clock(Clock, Vec<ValueIndex>),
    /// A row of a table.
    Motion { rows: Array, lag: usize, end: End },
    /// Operations on these values, one after the other.
    Value(Vec<ValueIndex>, Vec<PlannedOp>),
    /// Output `1` of network `0`.
    Output(usize, usize),
}

pub(crate) struct Planned {
    pub(crate) source: ValueSource,
    /// One for each of its numbers.
    pub(crate) labels: Vec<Label>,
    /// The list of joints that its values are in the order of.
    pub(crate) joints: Option<String>,
}

/// Source of a network's input.
pub(crate) enum Feed {
    /// A value of this tick.
    Value(ValueIndex),
    /// Output number `0` in the tick before, of length `1`; zeros in the first.
    Before(usize, usize),
}

/// A network with its inputs.
pub(crate) struct PlannedNetwork {
    pub(crate) compute: Box<dyn Compute>,
    pub(crate) feeds: Vec<Feed>,
    /// Names of its inputs.
    pub(crate) inputs: Vec<String>,
}

pub(crate) struct PlannedState {
    pub(crate) start: Vec<f64>,
    pub(crate) next: ValueIndex,
}

pub(crate) struct PlannedTarget {
    pub(crate) kind: TargetKind,
    pub(crate) value: ValueIndex,
    /// Its joints, if they are given or known.
    pub(crate) joints: Vec<String>,
    /// Lowest and highest values, if they are given.
    pub(crate) limits: Option<[Vec<f64>; 2]>,
}

/// One computation of a tick.
#[derive(Clone, Copy)]
pub(crate) enum TickStep {
    /// Computes a value.
    Value(ValueIndex),
    /// Runs a network.
    Network(usize),
}

/// A checked description.
pub struct Plan {
    pub(crate) values: Vec<Planned>,
    pub(crate) networks: Vec<PlannedNetwork>,
    pub(crate) states: Vec<PlannedState>,
    /// Raw inputs with their lengths.
    pub(crate) inputs: Vec<(String, usize)>,
    /// Lowest and highest value of each raw input, if they are given.
    pub(crate) ranges: Vec<Option<[f64; 2]>>,
    pub(crate) names: Vec<String>,
    pub(crate) order: Vec<TickStep>,
    pub(crate) action: ValueIndex,
    pub(crate) targets: Vec<PlannedTarget>,
}

impl Plan {
    /// Returns the raw inputs that a tick takes, with their lengths.
    pub fn inputs(&self) -> &[(String, usize)] {
        &self.inputs
    }

    /// Splits raw values that follow each other, as an image takes them, into the inputs of a tick. Values that are
    /// missing make the last inputs shorter.
    pub fn split(&self, raw: &[f32]) -> Vec<Vec<f64>> {
        let mut rest = raw.iter().map(|value| f64::from(*value));
        self.inputs.iter().map(|(_, len)| rest.by_ref().take(*len).collect()).collect()
    }

    /// Returns the number of values of the action.
    pub fn action_len(&self) -> usize {
        self.values[self.action].labels.len()
    }

    /// Returns lowest and highest value of each value of each target, infinite where it has no limits.
    pub(crate) fn target_limits(&self) -> Vec<Vec<[f64; 2]>> {
        let of = |target: &PlannedTarget| match &target.limits {
            Some([low, high]) => low.iter().zip(high).map(|(low, high)| [*low, *high]).collect(),
            None => vec![[f64::NEG_INFINITY, f64::INFINITY]; self.values[target.value].labels.len()],
        };
        self.targets.iter().map(of).collect()
    }

    /// Returns the labels of the networks' inputs, one after the other.
    pub(crate) fn observation_labels(&self) -> Vec<Label> {
        let feeds = self.networks.iter().flat_map(|network| network.feeds.iter().zip(&network.inputs));
        let labels = feeds.map(|(feed, input)| match feed {
            Feed::Value(index) => self.values[*index].labels.clone(),
            Feed::Before(_, len) => labels(input, *len, None),
        });
        labels.flatten().collect()
    }
}

/// A second operand.
pub(crate) enum Arg {
    /// Numbers, one for all or one for each.
    Numbers(Vec<f64>),
    /// A value.
    Value(ValueIndex),
}

/// An operation with its places and operands looked up.
pub(crate) type PlannedOp = Op<Vec<usize>, Arg>;

impl PlannedOp {
    /// Returns the values that it reads beside the one that it changes.
    pub(crate) fn read_values(&self) -> Vec<ValueIndex> {
        let args: &[Arg] = match self {
            Self::Add(arg) | Self::Subtract(arg) | Self::Scale(arg) | Self::Divide(arg) => std::slice::from_ref(arg),
            Self::Clip(both) => both,
            _ => &[],
        };
        args.iter().filter_map(|arg| if let Arg::Value(index) = arg { Some(*index) } else { None }).collect()
    }
}
