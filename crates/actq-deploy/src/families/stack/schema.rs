//! A stack as a profile's tables describe it. A path of a key may have `{term}`, which stands for a term, and one `*`,
//! which stands for the only key at its place.

use std::collections::BTreeMap;

use serde::Deserialize;

use crate::description::{Numbers, TargetKind};

/// Files, joints, observation and action of a stack.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Schema {
    /// Ending of the path of the file with the keys; none for the metadata of the ONNX file.
    pub(super) file: Option<String>,
    /// Ending of the path of the network; none for the only ONNX file.
    pub(super) network: Option<String>,
    /// Names of the graph's observation among several inputs, and of its action among several outputs.
    #[serde(default)]
    pub(super) inputs: Vec<String>,
    #[serde(default)]
    pub(super) outputs: Vec<String>,
    pub(super) rate: Rate,
    pub(super) joints: Joints,
    /// Forms of the observation; the first that fits the files is read.
    #[serde(rename = "observation")]
    pub(super) observations: Vec<Observation>,
    /// Kinds of terms.
    #[serde(rename = "term")]
    pub(super) terms: Vec<Term>,
    pub(super) clock: Option<Phases>,
    pub(super) action: Action,
}

/// Numbers: those of a key, else those of a rule, else those that the profile states.
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged)]
pub(super) enum Source {
    Stated(Numbers),
    Key(String),
    Of(Sourced),
}

impl Source {
    /// Returns the name of its key or rule, for errors.
    pub(super) fn name(&self) -> &str {
        match self {
            Self::Stated(_) => "the profile's number",
            Self::Key(key) => key,
            Self::Of(given) => given.key.as_ref().or(given.rule.as_ref()).map_or("", String::as_str),
        }
    }
}

/// A key, and a rule if the file does not have it. Answers to the rule must agree with the key.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Sourced {
    pub(super) key: Option<String>,
    pub(super) rule: Option<String>,
}

/// Ticks per second, or the seconds of a tick, which may be a number of steps of the simulation.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum Rate {
    Hz(Source),
    Period(Source),
    Steps([Source; 2]),
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Joints {
    /// Key of the names, in the order of the raw values.
    pub(super) names: Option<String>,
    /// Key of the raw value of each joint of the policy.
    pub(super) map: Option<String>,
    /// Default position of each joint of the policy.
    pub(super) default: Source,
    pub(super) stiffness: Option<Source>,
    pub(super) damping: Option<Source>,
    /// Rule that says "policy" if the gains are in its order, not that of the raw values.
    pub(super) gains_order: Option<String>,
}

/// Names of terms: a key of a map, of a list of names, or of a list of maps; a rule; or the names.
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged)]
pub(super) enum Terms {
    Key(String),
    Listed(Vec<String>),
    Of(Sourced),
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Observation {
    /// Key that the file must have for this form.
    pub(super) has: Option<String>,
    /// Input that the graph must have for this form.
    pub(super) input: Option<String>,
    pub(super) terms: Terms,
    /// Rule of the order of the terms, "listed" or "sorted".
    pub(super) order: Option<String>,
    /// Keys of a term's name, of its group, which is part of a name that occurs again, of its kind's name, and of
    /// parameters, with which a term is unknown.
    pub(super) name: Option<String>,
    pub(super) group: Option<String>,
    pub(super) kind: Option<String>,
    pub(super) params: Option<String>,
    /// Keys of a term's number of values, of limits, of its number of frames, and of the joints that it selects.
    pub(super) dim: Option<String>,
    pub(super) clip: Option<String>,
    pub(super) history: Option<Sourced>,
    pub(super) select: Option<String>,
    /// Factors of terms whose kind has none.
    pub(super) scale: Option<Source>,
    /// Rule that is true if a term is clipped before it is scaled.
    pub(super) clip_first: Option<String>,
    /// Key of the limit of the whole observation's absolute values.
    pub(super) limit: Option<String>,
    /// Rules whose answers must be the terms' names.
    #[serde(default)]
    pub(super) agrees: Vec<String>,
    /// Values of rules that this form states.
    #[serde(default)]
    pub(super) stated: BTreeMap<String, toml::Value>,
}

/// A kind of terms.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Term {
    /// Names, with `*` for any text.
    pub(super) names: Vec<String>,
    pub(super) is: TermSource,
    /// Name of the raw input or of the state, if it is not that of the term.
    pub(super) input: Option<String>,
    /// Number of values, and of values for each joint.
    #[serde(default)]
    pub(super) len: usize,
    #[serde(default)]
    pub(super) per_joint: usize,
    #[serde(default)]
    pub(super) unit: String,
    /// Rule of the direction of gravity.
    pub(super) rule: Option<String>,
    /// The default is subtracted.
    #[serde(default)]
    pub(super) relative: bool,
    /// Factors.
    pub(super) scale: Option<Source>,
    /// Keys of the lowest and highest number of each value, and the rule that is true if they limit it.
    #[serde(default)]
    pub(super) ranges: Vec<String>,
    pub(super) clamp: Option<String>,
}

/// Content of a term.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum TermSource {
    /// A value of the application.
    Raw,
    /// The direction of gravity in the body's frame.
    Gravity,
    /// A value of each joint.
    Joints,
    /// The action before.
    Action,
    /// The clock's phases, or their sines or cosines.
    Phase,
    Sin,
    Cos,
}

/// Phases that advance with the ticks.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Phases {
    pub(super) name: String,
    /// Phases at a reset.
    pub(super) start: Source,
    /// Seconds in which a phase advances by `turn`.
    pub(super) period: Source,
    pub(super) turn: f64,
    /// Rule of the time of the advance; after a tick without one.
    pub(super) when: Option<String>,
    pub(super) wrap: Option<[f64; 2]>,
    pub(super) standing: Option<Stand>,
}

/// Condition under which the robot stands, and its phases then.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Stand {
    /// Terms of raw values.
    pub(super) of: Vec<String>,
    pub(super) below: Source,
    pub(super) at: Source,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Action {
    /// The target's kind, or a map of kinds by the name of the only key of `key`.
    pub(super) kind: Option<TargetKind>,
    pub(super) key: Option<String>,
    #[serde(default)]
    pub(super) kinds: BTreeMap<String, TargetKind>,
    /// Limit of the absolute values, before the scale.
    pub(super) limit: Option<Source>,
    pub(super) scale: Option<Source>,
    pub(super) offset: Option<Source>,
    /// The default is added.
    #[serde(default)]
    pub(super) relative: bool,
    /// Key of limits after the scale, a pair for each value.
    pub(super) clip: Option<String>,
    /// Key of the action's joints. Another list than all in order is a question, as nothing reads it.
    pub(super) joints: Option<String>,
    /// Rule of the value that is fed back: "raw", "clipped" or "processed".
    pub(super) fed_back: Option<String>,
    /// Rule that is true if an action of fewer values than joints moves the last ones.
    pub(super) last_joints: Option<String>,
}
