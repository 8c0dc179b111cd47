//! Makes a plan of a description.

use std::collections::BTreeMap;

use actq::error::{Context as _, Result, bail, ensure};

use super::names::Names;
use super::numbers;
use super::parts::{
    Feed, Plan, Planned, PlannedNetwork, PlannedState, PlannedTarget, TickStep, ValueIndex, ValueSource,
};
use crate::description::{Clock, Description, Order, SCHEMA, Target};
use crate::label::{Label, labels};
use crate::sources::Sources;

/// Most values that one name may have; an image can address no more.
pub(super) const MOST: usize = u16::MAX as usize;
/// Most values of all names together.
const MAX_IN_ALL: usize = 1 << 18;

impl Plan {
    /// Checks a description and opens its files.
    ///
    /// # Errors
    ///
    /// If a name, a length, an order or a number does not fit; the error names the key of `deploy.toml`.
    pub fn new(description: &Description, sources: &dyn Sources) -> Result<Self> {
        ensure!(
            description.schema == SCHEMA,
            "schema = {}: this version reads schema {SCHEMA}; import the bundle again",
            description.schema
        );
        let rate = description.rate_hz;
        ensure!(rate.is_finite() && rate > 0.0, "rate_hz = {rate}: give a number above 0");
        for (constant, by) in &description.rounding {
            ensure!(
                description.constants.contains_key(constant) && (0.0..f64::INFINITY).contains(by),
                "rounding.{constant} = {by}: give the name of a constant, and 0 or a number above it"
            );
        }
        let names = Names::of(description)?;
        let mut builder = Builder {
            description,
            names: &names,
            sources,
            values: BTreeMap::new(),
            open: Vec::new(),
            in_all: 0,
            plan: Self {
                values: Vec::new(),
                networks: Vec::new(),
                states: Vec::new(),
                inputs: Vec::new(),
                ranges: Vec::new(),
                names: Vec::new(),
                order: Vec::new(),
                action: 0,
                targets: Vec::new(),
            },
        };
        builder.build()?;
        Ok(builder.plan)
    }
}

/// Makes a plan, value by value, each after those that it reads.
pub(super) struct Builder<'a> {
    pub(super) description: &'a Description,
    names: &'a Names<'a>,
    sources: &'a dyn Sources,
    values: BTreeMap<String, ValueIndex>,
    /// Names whose values are being made.
    open: Vec<String>,
    /// Values of all names so far.
    in_all: usize,
    pub(super) plan: Plan,
}

impl Builder<'_> {
    fn build(&mut self) -> Result<()> {
        let description = self.description;
        for (i, input) in description.inputs.iter().enumerate() {
            let key = format!("input {:?}", input.name);
            let joints = input.joints.as_ref().map(|order| self.joints(order, &key)).transpose()?;
            let len = match (input.len, joints) {
                (Some(len), Some(joints)) => {
                    ensure!(
                        len == joints.len(),
                        "{key}: len = {len}, but joints.{} has {} names",
                        input.joints.as_deref().unwrap_or_default(),
                        joints.len()
                    );
                    len
                }
                (Some(len), None) => len,
                (None, Some(joints)) => joints.len(),
                (None, None) => bail!("{key}: give len or joints"),
            };
            ensure!(0 < len && len <= MOST, "{key}: len = {len}; give 1 to {MOST}");
            if let Some([low, high]) = input.range {
                ensure!(low < high, "{key}: range = [{low}, {high}]; give the lowest number first");
            }
            let labels = labels(&input.name, len, joints);
            self.plan.inputs.push((input.name.clone(), len));
            self.plan.ranges.push(input.range);
            self.add(&input.name, ValueSource::Input(i), labels, input.joints.clone())?;
        }
        for (i, state) in description.states.iter().enumerate() {
            ensure!(
                0 < state.len && state.len <= MOST,
                "state {:?}: len = {}; give 1 to {MOST}",
                state.name,
                state.len
            );
            self.add(&state.name, ValueSource::State(i), labels(&state.name, state.len, None), None)?;
        }
        // Every value is made and so checked, even if nothing reads it.
        let all: Vec<String> = self.names.all().map(str::to_owned).collect();
        for name in &all {
            self.value(name, "")?;
        }
        for state in &description.states {
            let key = format!("state {:?}: next", state.name);
            let next = self.value(&state.next, &key)?;
            let len = self.plan.values[next].labels.len();
            ensure!(len == state.len, "{key} = {:?} has {len} values, but len = {}", state.next, state.len);
            let start =
                numbers::each(&state.start, state.len).with_context(|| format!("state {:?}: start", state.name))?;
            self.plan.states.push(PlannedState { start, next });
        }
        self.plan.action = self.value(&description.action, "action")?;
        ensure!(!description.targets.is_empty(), "[[target]]: give at least one");
        for target in &description.targets {
            let target = self.target(target)?;
            self.plan.targets.push(target);
        }
        self.gains()
    }

    fn target(&mut self, target: &Target) -> Result<PlannedTarget> {
        let key = format!("target {:?}", target.value);
        let index = self.value(&target.value, &format!("{key}: value"))?;
        let value = &self.plan.values[index];
        let len = value.labels.len();
        if let Some(order) = &target.joints {
            let names = self.joints(order, &key)?.len();
            ensure!(names == len, "{key}: it has {len} values, but joints.{order} has {names} names");
            let own = value.joints.as_ref();
            ensure!(
                own.is_none_or(|own| own == order),
                "{key}: its values are in the order joints.{}, not joints.{order}; add {{ place = {order:?} }}",
                own.map_or("", String::as_str)
            );
        }
        let order = target.joints.as_ref().or(value.joints.as_ref());
        let joints = order.map_or(Ok(Vec::new()), |order| self.joints(order, &key).map(<[_]>::to_vec))?;
        let limits = target.limits.as_ref().map(|limits| -> Result<[Vec<f64>; 2]> {
            let [low, high] = [numbers::each(&limits[0], len)?, numbers::each(&limits[1], len)?];
            if let Some((i, (low, high))) = low.iter().zip(&high).enumerate().find(|(_, (low, high))| low > high) {
                bail!("value {i}: [{low}, {high}]; give the lowest number first");
            }
            Ok([low, high])
        });
        let limits = limits.transpose().with_context(|| format!("{key}: limits"))?;
        Ok(PlannedTarget { kind: target.kind, value: index, joints, limits })
    }

    fn gains(&self) -> Result<()> {
        let Some(gains) = &self.description.gains else { return Ok(()) };
        let [stiffness, damping] = [gains.stiffness.len(), gains.damping.len()];
        ensure!(
            stiffness == damping,
            "gains: stiffness has {stiffness} values, damping {damping}; give one each for a joint"
        );
        // With names of joints they may be those of the whole robot.
        if let (None, [target]) = (&gains.joints, &self.plan.targets[..]) {
            let len = self.plan.values[target.value].labels.len();
            ensure!(stiffness == len, "gains: they have {stiffness} values, and the target {len}");
        }
        for (name, list) in [("stiffness", &gains.stiffness), ("damping", &gains.damping)] {
            numbers::finite(list).with_context(|| format!("gains: {name}"))?;
            let negative = list.iter().position(|gain| *gain < 0.0);
            ensure!(negative.is_none(), "gains: {name}: gain {} is below 0", negative.unwrap_or(0));
            if let Some(order) = &gains.joints {
                let names = self.joints(order, "gains")?.len();
                ensure!(
                    list.len() == names,
                    "gains: {name} has {} values, but joints.{order} {names} names",
                    list.len()
                );
            }
        }
        Ok(())
    }

    pub(super) fn add(
        &mut self,
        name: &str,
        source: ValueSource,
        labels: Vec<Label>,
        joints: Option<String>,
    ) -> Result<ValueIndex> {
        self.in_all += labels.len();
        ensure!(self.in_all <= MAX_IN_ALL, "{name:?}: with it there are more than {MAX_IN_ALL} values");
        let index = self.plan.values.len();
        self.plan.values.push(Planned { source, labels, joints });
        self.plan.names.push(name.to_owned());
        self.values.insert(name.to_owned(), index);
        self.plan.order.push(TickStep::Value(index));
        Ok(index)
    }

    pub(super) fn joints(&self, order: &str, key: &str) -> Result<&[String]> {
        let joints = self.description.joints.get(order);
        joints.map(Vec::as_slice).with_context(|| format!("{key}: there is no list joints.{order}"))
    }

    /// Returns the value of a name that `key` refers to; makes it first.
    pub(super) fn value(&mut self, name: &str, key: &str) -> Result<ValueIndex> {
        if let Some(index) = self.values.get(name) {
            return Ok(*index);
        }
        if self.open.iter().any(|open| open == name) {
            bail!("{name:?} depends on itself through {}; keep one of them in a [[state]]", self.open.join(", "));
        }
        self.open.push(name.to_owned());
        let index = self.make(name, key)?;
        self.open.pop();
        Ok(index)
    }

    fn make(&mut self, name: &str, key: &str) -> Result<ValueIndex> {
        let description = self.description;
        if let Some(clock) = description.clocks.iter().find(|clock| clock.name == name) {
            return self.clock(clock);
        }
        if let Some(motion) = description.motions.iter().find(|motion| motion.name == name) {
            let key = format!("motion {name:?}");
            let array = self.sources.array(&motion.file, &motion.array).context(key.clone())?;
            let (rows, row) = array.rows().context(key.clone())?;
            ensure!(
                rows > 0 && row > 0 && row <= MOST,
                "{key}: {:?} in {} is empty or too long",
                motion.array,
                motion.file
            );
            numbers::finite(&array.values).context(key)?;
            let source = ValueSource::Motion { rows: array, lag: motion.lag, end: motion.end };
            return self.add(name, source, labels(name, row, None), None);
        }
        if let Some(value) = description.values.iter().find(|value| value.name == name) {
            return self.chain(value);
        }
        if let Some((network, _)) = self.names.output(name) {
            self.network(network)?;
            return self.values.get(name).copied().with_context(|| format!("{key}: {name:?} is not computed"));
        }
        bail!("{key} = {name:?}: there is no value of this name; expected one of {}", self.names.listed())
    }

    fn clock(&mut self, clock: &Clock) -> Result<ValueIndex> {
        let key = format!("clock {:?}", clock.name);
        ensure!(!clock.start.is_empty(), "{key}: start is empty");
        numbers::finite(&clock.start).with_context(|| format!("{key}: start"))?;
        numbers::finite(&[clock.advance]).with_context(|| format!("{key}: advance"))?;
        if let Some([low, high]) = clock.wrap {
            ensure!(
                low < high && high - low < f64::INFINITY,
                "{key}: wrap = [{low}, {high}]; give the lowest number first"
            );
        }
        let mut of = Vec::new();
        if let Some(standing) = &clock.standing {
            ensure!(
                standing.at.len() == clock.start.len(),
                "{key}: standing.at has {} values, and start {}",
                standing.at.len(),
                clock.start.len()
            );
            numbers::finite(&standing.at).with_context(|| format!("{key}: standing.at"))?;
            ensure!(!standing.of.is_empty(), "{key}: standing.of is empty; name the values whose norms decide");
            for name in &standing.of {
                of.push(self.value(name, &format!("{key}: standing.of"))?);
            }
        }
        let labels = labels(&clock.name, clock.start.len(), None);
        self.add(&clock.name, ValueSource::Clock(clock.clone(), of), labels, None)
    }

    /// Opens a network and adds the values of its outputs.
    fn network(&mut self, index: usize) -> Result<()> {
        let network = &self.description.networks[index];
        let key = format!("network {:?}", network.name);
        let outputs = self.names.outputs_of(index);
        let compute = self.sources.network(network, outputs).context(key.clone())?;
        let inputs = compute.inputs().to_vec();
        for given in network.inputs.keys().chain(network.states.keys()) {
            ensure!(
                inputs.iter().any(|(name, _)| name == given),
                "{key}: {} has no input {given:?} that its outputs depend on; these are {}",
                network.file,
                inputs.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(", ")
            );
        }
        let mut feeds = Vec::new();
        for (input, len) in &inputs {
            let own = format!("{key}: inputs.{input}");
            feeds.push(match (network.inputs.get(input), network.states.get(input)) {
                (Some(_), Some(_)) => bail!("{own}: it is a state, too; remove one of them"),
                (None, None) => bail!("{own} is missing: name the value of this input, or add it to states"),
                (Some(value), None) => {
                    let index = self.value(value, &own)?;
                    let given = self.plan.values[index].labels.len();
                    ensure!(given == *len, "{own} = {value:?} has {given} values, and the graph takes {len}");
                    Feed::Value(index)
                }
                (None, Some(output)) => {
                    let at = outputs.iter().position(|o| o == output).unwrap_or(0);
                    let given = compute.outputs()[at];
                    ensure!(
                        given == *len,
                        "{key}: states.{input} = {output:?} has {given} values, and the graph takes {len}"
                    );
                    Feed::Before(at, *len)
                }
            });
        }
        let lens = compute.outputs().to_vec();
        let number = self.plan.networks.len();
        let inputs = inputs.into_iter().map(|(name, _)| name).collect();
        self.plan.networks.push(PlannedNetwork { compute, feeds, inputs });
        self.plan.order.push(TickStep::Network(number));
        for (i, (output, len)) in outputs.iter().zip(lens).enumerate() {
            let name = format!("{}.{output}", network.name);
            let labels = labels(&name, len, None);
            self.add(&name, ValueSource::Output(number, i), labels, None)?;
        }
        Ok(())
    }

    /// Returns the places that `order` names in a value whose values are in the order `of`.
    pub(super) fn places(&self, order: &Order, of: Option<&str>, len: usize, key: &str) -> Result<Vec<usize>> {
        let places = match order {
            Order::Places(places) => places.clone(),
            Order::Joints(order) => {
                let of = of.with_context(|| {
                    format!("{key}: its values are in no order of joints; give places, or joints to the input")
                })?;
                let (from, to) = (self.joints(of, key)?, self.joints(order, key)?);
                let place = |joint: &String| {
                    let found = from.iter().position(|other| other == joint);
                    found.with_context(|| format!("{key}: joints.{of} has no {joint:?}, which joints.{order} has"))
                };
                to.iter().map(place).collect::<Result<_>>()?
            }
        };
        if let Some(place) = places.iter().find(|place| **place >= len) {
            bail!("{key}: place {place} (from 0) is not in {len} values");
        }
        Ok(places)
    }
}
