//! `agent.yaml`: the configuration of the learner, which Isaac Lab stores beside `env.yaml`.

use actq::error::{Result, bail};
use actq::graph::{Graph, NodeKind};
use actq::text::printable;

use super::model::Sourced;
use crate::document::Document;
use crate::facts::Facts;
use crate::families::common::count;
use crate::yaml::Node;

/// Facts about the policy in a learner's configuration.
#[derive(Debug, Default)]
pub(super) struct Agent {
    /// Limit of the action, which the learner's wrapper of the environment applies.
    pub(super) clip: Option<Sourced>,
    /// Group of observations that the policy reads, with its file and key.
    pub(super) group: Option<(String, String)>,
}

/// Keys of RSL-RL 5, RSL-RL 2 and 3, rl_games, skrl and Stable-Baselines3 that say whether the observation is
/// normalized; skrl names a class.
const NORMALIZERS: [&str; 7] = [
    "actor.obs_normalization",
    "policy.actor_obs_normalization",
    "empirical_normalization",
    "params.config.normalize_input",
    "agent.state_preprocessor",
    "agent.observation_preprocessor",
    "normalize_input",
];
/// Keys of the hidden layers' activation.
const ACTIVATIONS: [&str; 5] = [
    "actor.activation",
    "policy.activation",
    "params.network.mlp.activation",
    "models.policy.network.0.activations",
    "policy_kwargs.activation_fn",
];
/// Keys of the hidden layers' lengths.
const WIDTHS: [&str; 5] = [
    "actor.hidden_dims",
    "policy.actor_hidden_dims",
    "params.network.mlp.units",
    "models.policy.network.0.layers",
    "policy_kwargs.net_arch",
];
/// Keys of skrl and Stable-Baselines3 that say whether the action is limited.
const LIMITED: [&str; 2] = ["models.policy.clip_actions", "policy_kwargs.squash_output"];
/// With this key, or without it, rl_games limits the action to ±1 and multiplies it by the limit in [`SCALE`].
const RESCALED: &str = "params.config.clip_actions";
const SCALE: &str = "params.env.clip_actions";
/// Keys of the recurrent cells, below "actor" or "policy".
const RECURRENT: [&str; 3] = ["rnn_type", "rnn_hidden_dim", "rnn_num_layers"];
/// Activations that are one operation of a graph, and other names of them.
const FUNCTIONS: [(&str, &str); 9] = [
    ("elu", "elu"),
    ("relu", "relu"),
    ("silu", "silu"),
    ("swish", "silu"),
    ("gelu", "gelu"),
    ("tanh", "tanh"),
    ("sigmoid", "sigmoid"),
    ("softplus", "softplus"),
    ("mish", "mish"),
];

impl Agent {
    pub(super) fn of(yaml: &Document) -> Result<Self> {
        let clip = clip(yaml)?;
        // Wrappers that limit nothing; those that do are a question.
        for path in LIMITED {
            if yaml.peek(path).is_some_and(|node| node.truth() == Some(false)) {
                yaml.node(path);
            }
        }
        // Of Stable-Baselines3 a class, whose network the graph has.
        if yaml.peek("policy").is_some_and(|node| node.text().is_some()) {
            yaml.node("policy");
        }
        // The network has another name in later versions.
        let path = ["obs_groups.actor", "obs_groups.policy"].into_iter().find(|path| yaml.peek(path).is_some());
        let group = match path.map(|path| Ok::<_, actq::error::Error>((path, yaml.texts(path)?))).transpose()? {
            None => None,
            Some((path, groups)) => match <[String; 1]>::try_from(groups) {
                Ok([group]) => Some((group, yaml.location(path))),
                Err(groups) => bail!(
                    "{}: the policy reads {} groups of observations ({}), and one is supported; write deploy.toml by docs/DEPLOY.md",
                    yaml.location(path),
                    groups.len(),
                    printable(&groups.join(", "))
                ),
            },
        };
        Ok(Self { clip, group })
    }
}

/// Reads the limit of the action. That of rl_games is one if it does not scale the action, too; else it is a question.
fn clip(yaml: &Document) -> Result<Option<Sourced>> {
    let truth = |path: &str| yaml.peek(path).and_then(Node::truth);
    let is_limit = truth(RESCALED) == Some(false) || yaml.peek(SCALE).and_then(Node::number) == Some(1.0);
    let path = if is_limit { SCALE } else { "clip_actions" };
    if is_limit {
        yaml.node(RESCALED);
    }
    let limit = |node: &Node| node.number().filter(|limit| *limit > 0.0);
    let limit = yaml.optional(path, "a number above 0, or null", limit)?;
    Ok(limit.map(|limit| Sourced { numbers: vec![limit], from: yaml.location(path) }))
}

/// Refuses a graph that is not the network of a learner's configuration, unless the user decides for the graph.
pub(super) fn agrees(yaml: &Document, graph: &Graph, file: &str, facts: &mut Facts) -> Result<()> {
    let cells = ["actor", "policy"].map(|part| RECURRENT.map(|key| format!("{part}.{key}")));
    let keys = NORMALIZERS.iter().chain(&ACTIVATIONS).chain(&WIDTHS).copied();
    for path in keys.chain(cells.iter().flatten().map(String::as_str)) {
        yaml.node(path);
    }
    let key = "agent.network";
    let Some((what, at, declared, found)) = difference(yaml, graph) else { return Ok(()) };
    let meaning =
        format!("{}: {what} is {declared}, and {file} has {found}; is the graph right (\"graph\")?", yaml.file);
    match facts.missing::<String>(key, &meaning)?.as_deref() {
        Some("graph") => Ok(()),
        Some(other) => bail!("answer {key} = {other:?}: give \"graph\", or export the policy again"),
        None => Err(Facts::contradiction(
            &format!("{what} (answer {key} = \"graph\" if the graph is right)"),
            (&at, &declared),
            (file, &found),
        )),
    }
}

/// Returns what differs, the key that declares it, what it declares, and what the graph has.
fn difference(yaml: &Document, graph: &Graph) -> Option<(&'static str, String, String, String)> {
    let layers = Layers::of(graph);
    // From skrl 2 on, states are those of the critic, and observations have a key of their own.
    let has_own = yaml.peek("agent.observation_preprocessor").is_some();
    let normalized = NORMALIZERS.iter().filter(|path| !has_own || **path != "agent.state_preprocessor");
    let normalized = normalized.filter_map(|path| Some((*path, is_normalized(yaml, path)?)));
    let normalized: Vec<(&str, bool)> = normalized.collect();
    let declared = normalized.iter().find(|(_, is)| *is).or(normalized.first());
    if let Some((path, declared)) = declared
        && *declared != layers.is_normalized
    {
        let shown = |is: bool| if is { "a normalizer" } else { "no normalizer" }.to_owned();
        return Some((
            "normalizer of the observation",
            yaml.location(path),
            shown(*declared),
            shown(layers.is_normalized),
        ));
    }
    // An empty map is a value that was never set.
    let is_set = |node: &Node| !node.is_null() && (node.text().is_some() || !node.items().is_empty());
    let of = |paths: &[&'static str]| paths.iter().copied().find(|path| yaml.peek(path).is_some_and(is_set));
    let activation = match of(&ACTIVATIONS) {
        // Other activations are several operations of the graph, and no layers can be told from them.
        Some(path) => Some((path, activation(yaml.peek(path)?)?)),
        None => None,
    };
    let widths = of(&WIDTHS).and_then(|path| Some((path, list(yaml.peek(path)?)?)));
    if let Some((path, declared)) = widths {
        let own = |(given, width): (&i64, &usize)| *given == -1 && *width == graph.obs_len || *given == *width as i64;
        if declared.len() != layers.widths.len() || !declared.iter().zip(&layers.widths).all(own) {
            let (declared, found) = (format!("{declared:?}"), format!("{:?}", layers.widths));
            return Some(("lengths of the hidden layers", yaml.location(path), declared, found));
        }
    }
    if let Some((path, declared)) = activation
        && let Some(other) = layers.functions.iter().find(|name| !name.starts_with(declared))
    {
        return Some((
            "activation of the hidden layers",
            yaml.location(path),
            declared.to_owned(),
            (*other).to_owned(),
        ));
    }
    // Classes without cells may have the keys, too.
    let is_recurrent = |part: &&str| {
        let class = yaml.peek(&format!("{part}.class_name")).and_then(Node::text);
        let has_cells = class.is_none_or(|class| class.contains("RNN") || class.contains("Recurrent"));
        has_cells && yaml.peek(&format!("{part}.rnn_type")).is_some()
    };
    let part = ["actor", "policy"].into_iter().find(is_recurrent)?;
    let (kind, len) = (format!("{part}.rnn_type"), format!("{part}.rnn_hidden_dim"));
    let declared = (yaml.peek(&kind)?.text()?.to_lowercase(), yaml.peek(&len).and_then(count));
    let count = yaml.peek(&format!("{part}.rnn_num_layers")).and_then(count).unwrap_or(1);
    let fits = |(kind, len): &(&str, usize)| *kind == declared.0 && declared.1.is_none_or(|declared| declared == *len);
    if layers.cells.len() == count && layers.cells.iter().all(fits) {
        return None;
    }
    let len = declared.1.map_or_else(String::new, |len| format!(" of {len} values"));
    let declared = format!("{count} {}{len}", declared.0);
    let found: Vec<String> = layers.cells.iter().map(|(kind, len)| format!("{kind} of {len} values")).collect();
    let found = if found.is_empty() { "none".to_owned() } else { found.join(", ") };
    Some(("recurrent cells", yaml.location(&kind), declared, found))
}

/// Returns what a key says of a normalizer; nothing if it says nothing, as a null or an empty map.
fn is_normalized(yaml: &Document, path: &str) -> Option<bool> {
    let node = yaml.node(path)?;
    // A class, as in skrl, is a normalizer.
    node.truth().or_else(|| node.text().map(|_| true))
}

/// Reads lengths; -1 stands for that of the observation.
fn list(node: &Node) -> Option<Vec<i64>> {
    let lens = node.numbers()?;
    lens.iter().all(|len| len.fract() == 0.0 && len.abs() < 1e6).then(|| lens.iter().map(|len| *len as i64).collect())
}

/// Reads an activation's name, of which Stable-Baselines3 gives the class.
fn activation(node: &Node) -> Option<&'static str> {
    let name = node.text()?.rsplit(['.', ':']).next()?.to_lowercase();
    FUNCTIONS.iter().find(|(own, _)| *own == name).map(|(_, function)| *function)
}

/// Layers of a network.
struct Layers {
    is_normalized: bool,
    /// Lengths of the hidden layers.
    widths: Vec<usize>,
    /// Functions before the last layer.
    functions: Vec<&'static str>,
    /// Recurrent cells: kind and length.
    cells: Vec<(&'static str, usize)>,
}

impl Layers {
    fn of(graph: &Graph) -> Self {
        let mut layers = Self { is_normalized: false, widths: Vec::new(), functions: Vec::new(), cells: Vec::new() };
        let mut open = Vec::new();
        for node in &graph.nodes {
            match &node.kind {
                NodeKind::Normalize(_) => layers.is_normalized = true,
                NodeKind::Linear(_) => {
                    layers.widths.push(node.len);
                    layers.functions.append(&mut open);
                }
                NodeKind::Pointwise(function) => open.push(function.0.name()),
                NodeKind::Lstm(_) => layers.cells.push(("lstm", node.len)),
                NodeKind::Gru(_) => layers.cells.push(("gru", node.len)),
                _ => {}
            }
        }
        // The last one gives the action.
        layers.widths.pop();
        layers
    }
}
