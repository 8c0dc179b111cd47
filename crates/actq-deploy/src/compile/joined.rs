//! Networks joined to one.

use actq::error::{Context as _, Result, bail, ensure};
use actq::graph::ops::{Concat, Span};
use actq::graph::{Graph, ValueId};
use actq_kernels::Kind;

use crate::plan::{Feed, Plan, Planned, PlannedOp, TickStep, ValueIndex, ValueSource};
use crate::sources::Part;

/// An output: its network, and its number there.
pub(super) type Output = (usize, usize);

/// A part of the joined network's observation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Source {
    /// A value.
    Value(ValueIndex),
    /// An output in the tick before.
    Before(Output),
}

impl Source {
    pub(super) fn len(self, plan: &Plan) -> usize {
        match self {
            Self::Value(index) => plan.values[index].labels.len(),
            Self::Before((network, output)) => plan.networks[network].compute.outputs()[output],
        }
    }
}

/// The networks as one.
#[derive(Debug)]
pub(super) struct Joined {
    pub(super) graph: Graph,
    /// Parts of its observation, one after the other.
    pub(super) observation: Vec<Source>,
    /// Outputs with weights, and their places in the joined output.
    pub(super) outputs: Vec<(Output, Span)>,
    /// `true` for each value that depends on a network with weights.
    pub(super) depends: Vec<bool>,
}

pub(super) fn part(plan: &Plan, (network, output): Output) -> Result<Part<'_>> {
    let is_own = |value: &Planned| matches!(value.source, ValueSource::Output(n, o) if (n, o) == (network, output));
    let name = || plan.values.iter().position(is_own).map_or("", |index| &plan.names[index]);
    let part = plan.networks[network].compute.part(output);
    let part = part.with_context(|| format!("value {:?}: a network of this kind cannot become an image", name()))?;
    ensure!(
        part.policy.kind == Kind::Step,
        "value {:?}: a network that gives an action chunk cannot have operations around it yet",
        name()
    );
    Ok(part)
}

/// Returns `true` if an output depends on weights, which the quantizer changes.
pub(super) fn has_weights(part: Part<'_>) -> bool {
    !part.policy.graph.matrices.is_empty()
}

/// Returns the sources of a feed whose first value is at `from`: the feed itself, and its parts.
pub(super) fn sources(plan: &Plan, network: usize, feed: &Feed, from: usize) -> Vec<(Source, usize)> {
    let index = match feed {
        Feed::Before(output, _) => return vec![(Source::Before((network, *output)), from)],
        Feed::Value(index) => *index,
    };
    let mut found = vec![(Source::Value(index), from)];
    if let ValueSource::Value(parts, steps) = &plan.values[index].source
        && steps.is_empty()
    {
        let mut at = from;
        for part in parts {
            found.extend(sources(plan, network, &Feed::Value(*part), at));
            at += plan.values[*part].labels.len();
        }
    }
    found
}

impl Joined {
    pub(super) fn of(plan: &Plan) -> Result<Self> {
        let mut builder = Builder { plan, depends: depends(plan)?, observation: Vec::new(), values: Vec::new() };
        let outputs = builder.used()?;
        ensure!(!outputs.is_empty(), "the targets depend on no network with weights");
        // The observation first: a graph's length is fixed when it is made.
        let mut all = Vec::new();
        for output in &outputs {
            builder.read(*output, &mut all)?;
        }
        let len = builder.observation.iter().map(|source| source.len(plan)).sum();
        let mut graph = Graph::new(len);
        let mut ids = Vec::new();
        for output in &outputs {
            ids.push(builder.append(&mut graph, *output, false)?);
        }
        let (mut spans, mut parts, mut from) = (Vec::new(), Vec::<(ValueId, Span)>::new(), 0);
        for (output, id) in outputs.iter().zip(ids) {
            let len = graph.len_of(id);
            let known = parts.iter().position(|(other, _)| *other == id);
            let place = match known {
                Some(i) => Span { from: parts[..i].iter().map(|(_, span)| span.len).sum(), len },
                None => {
                    parts.push((id, Span { from: 0, len }));
                    from += len;
                    Span { from: from - len, len }
                }
            };
            spans.push((*output, place));
        }
        if parts.len() > 1 || parts.iter().any(|(id, _)| *id != graph.output()) {
            let (ids, whole): (Vec<_>, Vec<_>) = parts.into_iter().unzip();
            graph.add(Concat(whole), &ids)?;
        }
        Ok(Self { graph, observation: builder.observation, outputs: spans, depends: builder.depends })
    }
}

/// Returns `true` for each value that depends on weights.
fn depends(plan: &Plan) -> Result<Vec<bool>> {
    let mut depends = vec![false; plan.values.len()];
    for work in &plan.order {
        let TickStep::Value(index) = *work else { continue };
        depends[index] = match &plan.values[index].source {
            ValueSource::Input(_) | ValueSource::State(_) | ValueSource::Motion { .. } => false,
            ValueSource::Clock(_, of) => of.iter().any(|value| depends[*value]),
            ValueSource::Value(from, steps) => {
                from.iter().copied().chain(steps.iter().flat_map(PlannedOp::read_values)).any(|value| depends[value])
            }
            ValueSource::Output(network, output) => {
                let part = part(plan, (*network, *output))?;
                let feeds = &plan.networks[*network].feeds;
                has_weights(part)
                    || part.reads.iter().any(|read| matches!(feeds[*read], Feed::Value(index) if depends[index]))
            }
        };
    }
    Ok(depends)
}

struct Builder<'a> {
    plan: &'a Plan,
    depends: Vec<bool>,
    observation: Vec<Source>,
    /// Values of outputs, `true` with their contracts.
    values: Vec<((Output, bool), ValueId)>,
}

impl Builder<'_> {
    /// Lists the outputs with weights that something outside of networks reads.
    fn used(&self) -> Result<Vec<Output>> {
        let plan = self.plan;
        let mut read: Vec<ValueIndex> = vec![plan.action];
        read.extend(plan.targets.iter().map(|target| target.value));
        read.extend(plan.states.iter().map(|state| state.next));
        let mut seen = vec![false; plan.values.len()];
        let mut used = Vec::new();
        let mut add = |output: Output| -> Result<()> {
            if has_weights(part(plan, output)?) && !used.contains(&output) {
                used.push(output);
            }
            Ok(())
        };
        while let Some(index) = read.pop() {
            if std::mem::replace(&mut seen[index], true) {
                continue;
            }
            match &plan.values[index].source {
                ValueSource::Output(network, output) => {
                    add((*network, *output))?;
                    if !has_weights(part(plan, (*network, *output))?) {
                        let feeds = plan.networks[*network].feeds.iter();
                        read.extend(feeds.filter_map(|f| if let Feed::Value(index) = f { Some(*index) } else { None }));
                    }
                }
                ValueSource::Clock(_, of) => read.extend(of),
                ValueSource::Value(from, steps) => {
                    read.extend(from.iter().copied().chain(steps.iter().flat_map(PlannedOp::read_values)))
                }
                _ => {}
            }
        }
        for (n, network) in plan.networks.iter().enumerate() {
            for feed in &network.feeds {
                if let Feed::Before(output, _) = feed {
                    add((n, *output))?;
                }
            }
        }
        used.sort_unstable();
        Ok(used)
    }

    /// Returns the parts of a value that a network reads.
    fn parts(&self, index: ValueIndex) -> Result<Vec<ValueIndex>> {
        if !self.depends[index] {
            return Ok(vec![index]);
        }
        match &self.plan.values[index].source {
            ValueSource::Output(network, output) if has_weights(part(self.plan, (*network, *output))?) => {
                Ok(vec![index])
            }
            ValueSource::Value(from, steps) if steps.is_empty() => {
                let parts = from.iter().map(|index| self.parts(*index)).collect::<Result<Vec<_>>>()?;
                Ok(parts.concat())
            }
            _ => bail!(
                "value {:?} lies between two networks; an image can only put outputs and values one after the other there",
                self.plan.names[index]
            ),
        }
    }

    /// Returns the sources that an output's network reads, one after the other.
    fn reads(&self, output: Output) -> Result<Vec<Source>> {
        let mut reads = Vec::new();
        for read in part(self.plan, output)?.reads {
            match &self.plan.networks[output.0].feeds[*read] {
                Feed::Before(before, _) => reads.push(Source::Before((output.0, *before))),
                Feed::Value(index) => reads.extend(self.parts(*index)?.into_iter().map(Source::Value)),
            }
        }
        Ok(reads)
    }

    /// Returns the output that a source is, if it is no part of the observation.
    fn inner(&self, source: Source) -> Option<Output> {
        let Source::Value(index) = source else { return None };
        match self.plan.values[index].source {
            ValueSource::Output(network, output) if self.depends[index] => Some((network, output)),
            _ => None,
        }
    }

    /// Collects the sources that an output's network, and those before it, read.
    fn read(&mut self, output: Output, seen: &mut Vec<Output>) -> Result<()> {
        if seen.contains(&output) {
            return Ok(());
        }
        seen.push(output);
        for source in self.reads(output)? {
            match self.inner(source) {
                Some(inner) => self.read(inner, seen)?,
                None if self.observation.contains(&source) => {}
                None => self.observation.push(source),
            }
        }
        Ok(())
    }

    /// Returns the part of the observation that a source is.
    fn span(&self, source: Source) -> (ValueId, Span) {
        let before = self.observation.iter().take_while(|other| **other != source);
        (0, Span { from: before.map(|other| other.len(self.plan)).sum(), len: source.len(self.plan) })
    }

    /// Appends the network of an output, after those that it reads; returns the output's value, with its contract if
    /// another network reads it.
    fn append(&mut self, graph: &mut Graph, output: Output, is_inner: bool) -> Result<ValueId> {
        if let Some((_, value)) = self.values.iter().find(|(known, _)| *known == (output, is_inner)) {
            return Ok(*value);
        }
        let mut parts = Vec::new();
        for source in self.reads(output)? {
            parts.push(match self.inner(source) {
                None => self.span(source),
                Some(inner) => {
                    let value = self.append(graph, inner, true)?;
                    (value, Span { from: 0, len: graph.len_of(value) })
                }
            });
        }
        let input = graph.join(merged(parts))?;
        let part = part(self.plan, output)?;
        let value = graph.append(if is_inner { part.inner } else { &part.policy.graph }, input)?;
        self.values.push(((output, is_inner), value));
        Ok(value)
    }
}

/// Merges parts of a value that follow each other in it.
fn merged(parts: Vec<(ValueId, Span)>) -> Vec<(ValueId, Span)> {
    let mut merged: Vec<(ValueId, Span)> = Vec::new();
    for (value, span) in parts {
        match merged.last_mut() {
            Some((last, before)) if *last == value && before.from + before.len == span.from => before.len += span.len,
            _ => merged.push((value, span)),
        }
    }
    merged
}
