//! The terms of the observation.

use std::f64::consts::TAU;

use actq::error::{Context as _, Result, ensure};
use actq_onnx::Signature;

use super::super::common::{ACTION, Histories, count, counts, given_gravity};
use super::Reader;
use super::schema::{Observation, Schema, Source, Term, TermSource, Terms};
use crate::description::{Clock, Fill, First, Op, Operand, Order, Standing, When};
use crate::document::fits;
use crate::facts::Facts;
use crate::yaml::Node;

/// Most values of a term, and most frames.
const MAX: usize = 10_000;

/// The graph's observation and action.
pub(super) struct Ports {
    pub(super) input: String,
    pub(super) output: String,
    inputs: Vec<String>,
    /// Lengths, unless an axis is dynamic.
    observation_len: Option<usize>,
    pub(super) action_len: Option<usize>,
    observation_at: String,
    pub(super) action_at: String,
}

impl Ports {
    pub(super) fn of(file: &str, signature: &Signature, schema: &Schema) -> Result<Self> {
        let find = |names: &[String], ports: &[(String, Option<usize>)], what: &str| {
            let found = match ports {
                [one] => Some(one),
                several => several.iter().find(|(name, _)| names.contains(name)),
            };
            let found = found
                .with_context(|| format!("{file}: it has {} {what}, and none is {}", ports.len(), names.join(" or ")));
            found.map(|(name, len)| (name.clone(), len.filter(|len| *len > 1)))
        };
        let (input, observation_len) = find(&schema.inputs, &signature.inputs, "inputs")?;
        let (output, action_len) = find(&schema.outputs, &signature.outputs, "outputs")?;
        let inputs = signature.inputs.iter().map(|(name, _)| name.clone()).collect();
        let (observation_at, action_at) = (format!("{file}, input {input:?}"), format!("{file}, output {output:?}"));
        Ok(Self { input, output, inputs, observation_len, action_len, observation_at, action_at })
    }
}

/// Returns one number, or a list.
pub(super) fn operand(list: Vec<f64>) -> Operand {
    if let [one] = list[..] { Operand::Number(one) } else { Operand::List(list) }
}

/// A term of the file: the part of its paths, its name, and the name of its kind.
struct Item {
    part: String,
    name: String,
    kind: String,
}

/// What a term is made of: a value, operations on it, and their length, unless it is a question.
struct Content {
    from: String,
    ops: Vec<Op>,
    len: Option<usize>,
}

impl Reader<'_> {
    /// Adds the observation.
    pub(super) fn observe(&mut self, ports: &Ports) -> Result<()> {
        let document = self.values.document;
        let has = |form: &&Observation| {
            form.has.as_ref().is_none_or(|key| document.peek(key).is_some_and(|node| !node.is_null()))
                && form.input.as_ref().is_none_or(|input| ports.inputs.contains(input))
        };
        let form = self.schema.observations.iter().find(has);
        let form = form.with_context(|| format!("{}: no form of the profile's observation fits", document.file))?;
        let (items, at) = self.items(form)?;
        let names: Vec<String> = items.iter().map(|item| item.name.clone()).collect();
        form.agrees.iter().try_for_each(|rule| self.values.facts.agrees(rule, &names, &at))?;
        for (rule, value) in &form.stated {
            self.values.facts.agrees(rule, value, &at)?;
        }
        let clip_first = form.clip_first.as_ref().map_or(Ok(false), |rule| self.values.facts.value_or_default(rule))?;
        let is_open =
            matches!(&form.terms, Terms::Of(given) if given.rule.iter().any(|rule| self.values.facts.is_open(rule)));
        let (mut all, mut is_long) = ((!is_open).then_some(0), false);
        for (i, item) in items.iter().enumerate() {
            let is_taken = items[..i].iter().any(|other| other.name == item.name);
            ensure!(form.name.is_some() || !is_taken, "{at}: {:?} occurs twice", item.name);
            let kind = self.kind(form, item)?;
            let Content { from, mut ops, len } = self.content(form, item, kind.as_ref())?;
            let mut len = len;
            if let Some(key) = &form.select {
                let path = self.values.path(key, &item.part)?;
                if let Some(op) = self.selected(&path)? {
                    len = len.map(|_| if let Op::Select(Order::Places(places)) = &op { places.len() } else { 0 });
                    ops.push(op);
                }
            }
            self.check_dim(form, item, len)?;
            let (scale, mut source) = self.scale(form, item, kind.as_ref(), len)?;
            let clip = match &form.clip {
                Some(key) => {
                    self.values.pairs(&self.values.path(key, &item.part)?)?.map(|limits| Op::Clip(limits.map(operand)))
                }
                None => None,
            };
            let both = if clip_first { [clip, scale] } else { [scale, clip] };
            ops.extend(both.into_iter().flatten());
            let frames = self.frames(form, item)?;
            is_long |= frames > 1;
            let group = form.group.as_ref().map(|key| self.values.text(key, &item.part)).transpose()?;
            let name =
                if is_taken { format!("{}_{}", group.unwrap_or_default(), item.name) } else { item.name.clone() };
            self.parts.begin(&name, &from);
            let value = self.parts.term(ops, frames);
            if let Terms::Key(key) = &form.terms {
                source = document.location(&format!("{key}.{}", item.part));
            }
            self.values.facts.note(&value, source);
            all = all.zip(len).and_then(|(all, len): (usize, usize)| all.checked_add(len.checked_mul(frames)?));
        }
        let histories = self.histories(form, is_long)?;
        self.parts.observe(&histories)?;
        let mut source = at.clone();
        let rules = form.order.iter().chain(form.history.as_ref().and_then(|history| history.rule.as_ref()));
        for rule in rules.filter(|_| form.stated.is_empty()) {
            source = format!("{source}; {}", self.values.facts.source(rule));
        }
        if let Some(key) = &form.limit {
            let limit =
                document.optional(key, "a number above 0", |node| node.number().filter(|limit| *limit > 0.0))?;
            if let Some(limit) = limit {
                self.parts.observed(super::super::common::action::clip_to(limit));
                source = format!("{source}; {}", document.location(key));
            }
        }
        if is_long && form.stated.is_empty() {
            source = format!("{source}; {}", self.values.facts.source("history.layout"));
        }
        self.values.facts.note("observation", source);
        match (ports.observation_len, all) {
            (Some(fixed), Some(all)) if fixed != all => Err(Facts::contradiction(
                "length of the observation",
                (&ports.observation_at, &format!("{fixed} values")),
                (&at, &format!("{all} values of {} joints", self.robot.len)),
            )),
            _ => Ok(()),
        }
    }

    /// Returns the terms in their order, and where they are from.
    fn items(&mut self, form: &Observation) -> Result<(Vec<Item>, String)> {
        let document = self.values.document;
        let plain = |name: &String| Item { part: name.clone(), name: name.clone(), kind: name.clone() };
        let (mut items, at): (Vec<Item>, String) = match &form.terms {
            Terms::Listed(names) => (names.iter().map(plain).collect(), format!("profile {}", self.family)),
            Terms::Key(key) => {
                let listed = document.peek(key).and_then(Node::texts);
                // Switches among the terms are no terms; as keys that nothing reads, they are questions.
                let is_term = |name: &&str| {
                    let node = document.peek(&format!("{key}.{name}"));
                    node.is_none_or(|node| node.text().is_none() || node.is_null())
                };
                let keys = document.keys(key).into_iter().filter(is_term).map(str::to_owned).collect();
                if listed.is_some() {
                    document.node(key);
                }
                (listed.unwrap_or(keys).iter().map(plain).collect(), document.location(key))
            }
            Terms::Of(given) => {
                let rule =
                    given.rule.as_ref().with_context(|| format!("profile {}: terms have no rule", self.family))?;
                let names: Option<Vec<String>> = self.values.facts.value(rule)?;
                let at = format!("{rule} ({})", self.values.facts.source(rule));
                let names = names.or_else(|| self.values.facts.suggested(rule));
                let names = names.unwrap_or_else(|| vec![self.schema.terms[0].names[0].clone()]);
                (names.iter().map(plain).collect(), at)
            }
        };
        for item in &mut items {
            for (key, to) in [(&form.name, &mut item.name), (&form.kind, &mut item.kind)] {
                if let Some(key) = key {
                    *to = self.values.text(key, &item.part)?;
                }
            }
            let shown = actq::text::printable(&item.name);
            ensure!(!item.name.is_empty() && shown == item.name, "{at}: {shown:?} is not a name");
        }
        ensure!((1..=MAX).contains(&items.len()), "{at}: it has {} terms; give 1 to {MAX}", items.len());
        if let Some(rule) = &form.order
            && !form.stated.contains_key(rule)
            && !self.values.facts.is_choice(rule, "listed")?
        {
            items.sort_by(|first, second| first.name.cmp(&second.name));
        }
        Ok((items, at))
    }

    /// Returns the kind of a term, unless the profile does not know it.
    fn kind(&self, form: &Observation, item: &Item) -> Result<Option<Term>> {
        if let Some(key) = &form.params {
            let node = self.values.document.node(&self.values.path(key, &item.part)?);
            if node.is_some_and(|node| !node.entries().is_empty()) {
                return Ok(None);
            }
        }
        let is_one =
            |kind: &&Term| kind.names.iter().any(|name| fits(&name.replace('.', "/"), &item.kind.replace('.', "/")));
        Ok(self.schema.terms.iter().find(is_one).cloned())
    }

    /// Makes what a term begins with.
    fn content(&mut self, form: &Observation, item: &Item, kind: Option<&Term>) -> Result<Content> {
        let Some(kind) = kind else { return self.unknown(form, item) };
        let input = kind.input.as_deref().unwrap_or(&item.name).to_owned();
        let len = kind.len + kind.per_joint * self.robot.len;
        let mut ops = Vec::new();
        let (from, len) = match kind.is {
            TermSource::Raw => {
                self.parts.raw(&input, len, &kind.unit);
                ops.extend(self.clamp(kind)?);
                (input, len)
            }
            TermSource::Gravity => {
                let rule = kind.rule.as_deref().unwrap_or("gravity");
                let (name, len, made) = given_gravity(self.values.facts, rule, "vector", &input)?;
                self.parts.raw(name, len, "");
                self.values.facts.note(name, self.values.facts.source(rule));
                ops.extend(made);
                (name.to_owned(), 3)
            }
            TermSource::Joints => {
                if self.robot.is_named {
                    self.parts.raw_joints(&input, "robot", &kind.unit);
                } else {
                    self.parts.raw(&input, self.robot.len, &kind.unit);
                }
                ops.extend(self.robot.order().map(Op::Select));
                ops.extend(kind.relative.then(|| Op::Subtract(Operand::Name("default".to_owned()))));
                (input, self.robot.len)
            }
            TermSource::Action => {
                let fed_back: Option<String> =
                    self.schema.action.fed_back.as_ref().map_or(Ok(None), |rule| self.values.facts.value(rule))?;
                let next = match fed_back.as_deref() {
                    Some("processed") => self.processed(),
                    Some("clipped") => "clipped",
                    _ => ACTION,
                };
                let state = kind.input.clone().unwrap_or_else(|| format!("{}_state", item.name));
                self.parts.state(&state, self.action_len, next);
                if let Some(rule) = &self.schema.action.fed_back {
                    self.values.facts.note(&state, self.values.facts.source(rule));
                }
                (state, self.action_len)
            }
            TermSource::Phase | TermSource::Sin | TermSource::Cos => {
                let (name, len, turn) = self.phases()?;
                if kind.is != TermSource::Phase {
                    let in_turns = turn == 1.0;
                    ops.extend(in_turns.then_some(Op::Scale(Operand::Number(TAU))));
                    ops.push(if kind.is == TermSource::Sin { Op::Sin } else { Op::Cos });
                }
                (name, len)
            }
        };
        Ok(Content { from, ops, len: Some(len) })
    }

    /// Makes a term that only the application knows a raw input.
    fn unknown(&mut self, form: &Observation, item: &Item) -> Result<Content> {
        let key = format!("raw.{}", item.name);
        let dim = match &form.dim {
            Some(dim) => {
                self.values.document.optional(&self.values.path(dim, &item.part)?, "a number of values", count)?
            }
            None => match form.scale.as_ref().map(|scale| self.values.list(scale, &item.part)).transpose()?.flatten() {
                Some((scale, _)) if scale.len() > 1 => Some(scale.len()),
                _ => None,
            },
        };
        let len = match dim {
            Some(len) => {
                let meaning = format!(
                    "term {:?} ({}) is not known to this reader; does the application compute its {len} values (true)?",
                    item.name, item.kind
                );
                self.values.facts.require_from_application(&key, &meaning)?;
                Some(len)
            }
            None => {
                let meaning =
                    format!("term {:?}: unknown length; how many values does the application give?", item.name);
                self.values.facts.missing(&key, &meaning)?
            }
        };
        ensure!(len.is_none_or(|len| (1..=MAX).contains(&len)), "{key} = {len:?}: give 1 to {MAX}");
        self.parts.raw(&item.name, len.unwrap_or(1), "");
        Ok(Content { from: item.name.clone(), ops: Vec::new(), len })
    }

    /// Limits a command to the ranges of the training, if a rule says so.
    fn clamp(&mut self, kind: &Term) -> Result<Option<Op>> {
        let Some(rule) = &kind.clamp else { return Ok(None) };
        let is_clamped: bool = self.values.facts.value_or_default(rule)?;
        let mut limits = [Vec::new(), Vec::new()];
        for key in &kind.ranges {
            if is_clamped {
                let pair = self.values.document.required(key, "two numbers", Node::pair)?;
                limits.iter_mut().zip(pair).for_each(|(list, bound)| list.push(bound));
            } else {
                self.values.document.node(key);
            }
        }
        Ok(is_clamped.then(|| Op::Clip(limits.map(Operand::List))))
    }

    /// Returns the operation that takes the joints of a list, if the key has one.
    fn selected(&self, path: &str) -> Result<Option<Op>> {
        let document = self.values.document;
        if document.node(path).and_then(Node::numbers).is_none_or(|ids| ids.is_empty()) {
            return Ok(None);
        }
        let n = self.robot.len;
        let places = document.peek(path).and_then(counts).filter(|places| places.iter().all(|place| *place < n));
        let places =
            places.with_context(|| format!("{} must be numbers of joints below {n}", document.location(path)))?;
        Ok(Some(Op::Select(Order::Places(places))))
    }

    fn check_dim(&self, form: &Observation, item: &Item, len: Option<usize>) -> Result<()> {
        let Some(key) = &form.dim else { return Ok(()) };
        let path = self.values.path(key, &item.part)?;
        let dim = self.values.document.required(&path, "a number of values", count)?;
        if len.is_none_or(|len| len == dim) {
            return Ok(());
        }
        Err(Facts::contradiction(
            &format!("length of the term {:?}", item.name),
            (&self.values.document.location(&path), &dim.to_string()),
            (&format!("the joints of {}", self.robot.at), &len.unwrap_or_default().to_string()),
        ))
    }

    /// Returns the scale of a term, and where it is from.
    fn scale(
        &mut self,
        form: &Observation,
        item: &Item,
        kind: Option<&Term>,
        len: Option<usize>,
    ) -> Result<(Option<Op>, String)> {
        let own = kind.and_then(|kind| kind.scale.as_ref());
        let source = match (own, &form.scale) {
            // The form's key, and the rule of the kind.
            (Some(Source::Of(own)), Some(Source::Of(form))) => {
                let mut given = form.clone();
                given.rule.clone_from(&own.rule);
                &Source::Of(given)
            }
            (Some(own), _) => own,
            (None, Some(form)) => form,
            (None, None) => return Ok((None, format!("profile {}", self.family))),
        };
        let Some((list, at)) = self.values.list(source, &item.part)? else {
            return Ok((None, "a question".to_owned()));
        };
        if let Some(len) = len {
            ensure!([1, len].contains(&list.len()), "{at} must be one finite number, or {len}; it has {}", list.len());
        }
        Ok((Some(Op::Scale(operand(list))), at))
    }

    fn frames(&mut self, form: &Observation, item: &Item) -> Result<usize> {
        let Some(given) = &form.history else { return Ok(1) };
        let rule = given.rule.as_deref();
        if let Some(key) = &given.key {
            let path = self.values.path(key, &item.part)?;
            let frames = self.values.document.optional(&path, "a number of frames", count)?;
            let at = self.values.document.location(&path);
            if let (Some(rule), Some(frames)) = (rule, &frames) {
                self.values.facts.agrees(rule, frames, &at)?;
            }
            let frames = frames.unwrap_or(1).max(1);
            ensure!(frames <= MAX, "{at} = {frames}: give at most {MAX}");
            return Ok(frames);
        }
        let frames: usize = rule.map_or(Ok(None), |rule| self.values.facts.value(rule))?.unwrap_or(1);
        ensure!((1..=1000).contains(&frames), "{} = {frames}: give 1 to 1000", rule.unwrap_or_default());
        Ok(frames)
    }

    /// Returns the conventions of histories: those of the form, or of rules.
    fn histories(&mut self, form: &Observation, is_long: bool) -> Result<Histories> {
        let stated = |key: &str, text: &str| form.stated.get(key).and_then(toml::Value::as_str) == Some(text);
        if is_long && form.stated.is_empty() {
            return Histories::of(self.values.facts);
        }
        let first = if stated("history.first", "newest") { First::Newest } else { First::Oldest };
        let fill = if stated("history.fill", "first") { Fill::First } else { Fill::Zero };
        Ok(Histories { by_term: !stated("history.layout", "frame"), first, fill, stride: 1 })
    }

    /// Adds the clock, unless it is there; returns its name, the number of its phases, and its turn.
    fn phases(&mut self) -> Result<(String, usize, f64)> {
        let clock = self.schema.clock.as_ref();
        let clock =
            clock.with_context(|| format!("profile {}: a term has a phase, and there is no clock", self.family))?;
        let (start, start_at) =
            self.values.list(&clock.start, "")?.unwrap_or_else(|| (vec![0.0], "a question".to_owned()));
        let len = start.len();
        if self.clock.is_some() {
            return Ok((clock.name.clone(), len, clock.turn));
        }
        self.clock = Some(len);
        let (period, at) = self.values.positive(&clock.period)?;
        let when = clock.when.as_ref().map_or(Ok(None), |rule| self.values.facts.value(rule))?.unwrap_or(When::After);
        let standing = match &clock.standing {
            None => None,
            Some(stand) => {
                for name in &stand.of {
                    let kind = self.schema.terms.iter().find(|kind| kind.names.contains(name));
                    let kind = kind.with_context(|| format!("profile {}: no term {name}", self.family))?;
                    self.parts.raw(name, kind.len, &kind.unit);
                }
                let (below, _) = self.values.one(&stand.below, "", 0.0)?;
                let at = self.values.list(&stand.at, "")?.map_or_else(|| vec![0.0; len], |(at, _)| at);
                Some(Standing { of: stand.of.clone(), below, at })
            }
        };
        let advance = clock.turn / (self.rate * period);
        let (name, wrap) = (clock.name.clone(), clock.wrap);
        self.parts.clock(Clock { name: name.clone(), start, advance, when, wrap, restart_above: None, standing });
        self.values.facts.note(&name, format!("{at}; {start_at}"));
        Ok((name, len, clock.turn))
    }
}
