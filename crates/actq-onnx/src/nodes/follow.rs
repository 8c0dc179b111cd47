//! Conversion of a graph to expressions, node by node from its inputs to the requested values.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::rc::Rc;

use actq::error::{Context as _, Result, bail, ensure};
use actq::text::printable;

use crate::file::kinds;
use crate::file::model::{Graph, MAX_DEPTH, Model, Node, Port};
use crate::file::proto;
use crate::nodes::attention;
use crate::nodes::call::Call;
use crate::nodes::cells;
use crate::nodes::conditions;
use crate::nodes::convolutions;
use crate::nodes::einsum;
use crate::nodes::integers;
use crate::nodes::known;
use crate::nodes::moves;
use crate::nodes::pointwise;
use crate::nodes::pools;
use crate::nodes::products;
use crate::nodes::reductions;
use crate::values::expr::{Expr, Exprs};
use crate::values::tensor::{Data, Element, Tensor, count};

/// ONNX's type number of booleans.
const TRUTH: i64 = 9;

/// ONNX's type numbers of int32 and int64.
pub(crate) const INTEGERS: [i32; 2] = [6, 7];

/// Values so far, by name.
pub(crate) type Scope = HashMap<String, Rc<Tensor>>;

/// A conversion in progress.
pub(crate) struct Follower<'m> {
    pub(crate) model: &'m Model,
    pub(crate) exprs: Exprs,
    /// Elements that further results may have.
    pub(crate) budget: usize,
    /// Indices of the graph inputs that were read.
    pub(crate) read: Vec<usize>,
    /// Attributes of the function that is being converted.
    given: Attributes,
}

type Attributes = HashMap<String, proto::Attribute>;

/// Replaces attributes that name one of the function around them. One without a value has the operator's default.
fn bind(graph: &mut Graph, given: &Attributes) {
    for node in &mut graph.nodes {
        for attribute in node.attributes.values_mut() {
            if let Some(name) = &attribute.ref_attr_name {
                *attribute = given.get(name).cloned().unwrap_or_default();
            }
        }
        node.attributes.retain(|_, attribute| attribute.name.is_some());
    }
}

/// Elements that the results of any file may have.
const BASE_BUDGET: usize = 1 << 22;
/// Further elements of results for each element of a tensor in the file.
const BUDGET_PER_ELEMENT: usize = 8;

impl<'m> Follower<'m> {
    pub(crate) fn new(model: &'m Model) -> Self {
        Self { model, exprs: Exprs::default(), budget: BASE_BUDGET, read: Vec::new(), given: Attributes::new() }
    }

    /// Returns the value of this name.
    pub(crate) fn value(&mut self, name: &str) -> Result<Tensor> {
        let mut scope = Scope::new();
        let model = self.model;
        self.run(&model.graph, &mut scope, &[name.to_owned()], MAX_DEPTH)?;
        let value = scope.get(name).with_context(|| format!("no node gives the value {:?}", printable(name)))?;
        Ok(Tensor::clone(value))
    }

    /// Converts the nodes that `targets` need.
    fn run(&mut self, graph: &'_ Graph, scope: &mut Scope, targets: &[String], depth: usize) -> Result<()> {
        ensure!(depth > 0, "more than {MAX_DEPTH} graphs or functions are nested");
        let needed = needed(graph, scope, targets)?;
        let top = std::ptr::eq(graph, &self.model.graph);
        for name in &needed.names {
            if let Some(bytes) = graph.initializers.get(name) {
                let tensor = self.model.tensor(bytes)?;
                self.budget = self.budget.saturating_add(BUDGET_PER_ELEMENT * tensor.len());
                scope.insert(name.clone(), Rc::new(tensor));
            }
        }
        // In the file's order, as in the observation, so that sorting by value ids is reproducible.
        for (i, port) in graph.inputs.iter().enumerate().filter(|_| top) {
            if needed.names.contains(&port.name) && !scope.contains_key(&port.name) {
                let tensor = self.input(i, port)?;
                scope.insert(port.name.clone(), Rc::new(tensor));
            }
        }
        for (i, node) in graph.nodes.iter().enumerate().filter(|(i, _)| needed.nodes.contains(i)) {
            if top {
                self.exprs.node = i;
            }
            self.node(node, scope, depth).with_context(|| {
                let op = if node.domain.is_empty() {
                    node.op.clone()
                } else {
                    format!("{}.{}", printable(&node.domain), node.op)
                };
                format!("node {i} {:?} ({op})", node.name)
            })?;
        }
        Ok(())
    }

    fn node(&mut self, node: &Node, scope: &mut Scope, depth: usize) -> Result<()> {
        let input = |name: &String| match name.as_str() {
            "" => Ok(None),
            name => match scope.get(name) {
                Some(tensor) => Ok(Some(Rc::clone(tensor))),
                None => bail!(
                    "reads {:?}, which no input, no initializer and no earlier node gives: the file has a cycle, unsorted nodes, a sparse \
                     initializer, or reads an operator's second output, which is not supported",
                    printable(name)
                ),
            },
        };
        let inputs = node.inputs.iter().map(input).collect::<Result<Vec<_>>>()?;
        let key = [node.domain.clone(), node.op.clone(), node.overload.clone()];
        let outputs = if let Some(function) = self.model.functions.get(&key) {
            let mut inner: Scope = Scope::new();
            ensure!(
                inputs.len() <= function.inputs.len(),
                "the function takes at most {} inputs",
                function.inputs.len()
            );
            let is_given = |i: usize| inputs.get(i).is_some_and(Option::is_some);
            let omitted = function.inputs.iter().enumerate().filter(|(i, _)| !is_given(*i)).map(|(_, name)| name);
            let omitted: Vec<&String> = omitted.collect();
            let mut graph = function.graph.clone();
            // Its nodes omit them, too.
            graph
                .nodes
                .iter_mut()
                .flat_map(|node| &mut node.inputs)
                .filter(|name| omitted.contains(&&**name))
                .for_each(String::clear);
            for (name, tensor) in function.inputs.iter().zip(inputs) {
                inner.extend(tensor.map(|tensor| (name.clone(), tensor)));
            }
            let mut given = function.defaults.clone();
            given.extend(node.attributes.clone());
            bind(&mut graph, &given);
            let outer = std::mem::replace(&mut self.given, given);
            let done = self.run(&graph, &mut inner, &function.outputs, depth - 1);
            self.given = outer;
            done?;
            function.outputs.iter().map(|name| inner.get(name).cloned()).collect()
        } else if node.op == "If" {
            let condition = inputs.first().cloned().flatten().context("has no condition")?;
            let Some(&[chosen]) = condition.integers() else {
                bail!("its condition depends on the observation; export one branch only");
            };
            let branch = if chosen != 0 { "then_branch" } else { "else_branch" };
            let bytes = node.attributes.get(branch).and_then(|a| a.g.as_ref()).context("has no branch")?;
            let mut graph = Graph::parse(bytes)?;
            bind(&mut graph, &self.given);
            let mut inner = scope.clone();
            let names: Vec<String> = graph.outputs.iter().map(|port| port.name.clone()).collect();
            self.run(&graph, &mut inner, &names, depth - 1)?;
            names.iter().map(|name| inner.get(name).cloned()).collect()
        } else {
            let inputs: Vec<Option<&Tensor>> = inputs.iter().map(Option::as_deref).collect();
            let call = Call { node, inputs: &inputs, opset: self.model.opset };
            self.operator(&call)?.into_iter().map(|tensor| Some(Rc::new(tensor))).collect::<Vec<_>>()
        };
        for (name, tensor) in node.outputs.iter().zip(outputs) {
            if !name.is_empty()
                && let Some(tensor) = tensor
            {
                self.budget = self
                    .budget
                    .checked_sub(tensor.len())
                    .context("gives more values than a policy of this size can have")?;
                let again = scope.insert(name.clone(), tensor).is_some();
                ensure!(!again, "gives {:?}, which already has a value", printable(name));
            }
        }
        Ok(())
    }

    /// Converts a node of a supported operator.
    fn operator(&mut self, call: &Call<'_>) -> Result<Vec<Tensor>> {
        let own =
            ["", "ai.onnx", "com.microsoft", "pkg.onnxscript.torch_lib.common"].contains(&call.node.domain.as_str());
        ensure!(own, "operators of this domain are not supported; {}", crate::nodes::call::HELP);
        let most = self.budget;
        if let Some(constant) = call.constant()? {
            return Ok(vec![self.model.tensor(&constant)?]);
        }
        if call.op() == "ConstantOfShape" {
            let fill = match call.node.attributes.get("value").and_then(|a| a.t.clone()) {
                Some(bytes) => self.model.tensor(&bytes)?,
                None => Tensor::new(vec![1], Data::Real(vec![0.0])),
            };
            return Ok(vec![moves::constant_of_shape(call, &fill.data, most)?]);
        }
        if call.op() == "Cast"
            && call.int("to") == Some(TRUTH)
            && let Some(truth) = conditions::as_truth(call.input(0)?, &self.exprs)
        {
            return Ok(vec![truth]);
        }
        if let Some(output) = integers::cast(call, &mut self.exprs)? {
            return Ok(vec![output]);
        }
        if let Some(outputs) = moves::run(call, most)? {
            return Ok(outputs);
        }
        if let Some(output) = known::run(call, most)? {
            return Ok(vec![output]);
        }
        if let Some(output) = pointwise::run(call, &mut self.exprs, most)? {
            return Ok(vec![output]);
        }
        let exprs = &mut self.exprs;
        if let Some(outputs) = attention::run(call, exprs, &mut self.budget)? {
            return Ok(outputs);
        }
        if let Some(output) = products::run(call, exprs, &mut self.budget)? {
            return Ok(vec![output]);
        }
        if let Some(output) = einsum::run(call, exprs, &mut self.budget)? {
            return Ok(vec![output]);
        }
        if let Some(output) = convolutions::run(call, exprs, &mut self.budget)? {
            return Ok(vec![output]);
        }
        if let Some(output) = pools::run(call, exprs, most)? {
            return Ok(vec![output]);
        }
        if let Some(output) = reductions::run(call, exprs)? {
            return Ok(vec![output]);
        }
        if let Some(outputs) = cells::run(call, exprs)? {
            return Ok(outputs);
        }
        call.refuse()
    }

    fn input(&mut self, i: usize, port: &Port) -> Result<Tensor> {
        let name = printable(&port.name);
        let integers = INTEGERS.contains(&port.kind);
        ensure!(
            integers || [0, 1, 11].contains(&port.kind),
            "the input {name:?} has the type {}, and an observation is float32; export the input as float32",
            kinds::name(port.kind)
        );
        let shape =
            port.shape.as_ref().with_context(|| format!("the input {name:?} has no shape; export it with one"))?;
        let last = shape.len().saturating_sub(1);
        let one = |(axis, n): (usize, &Option<usize>)| {
            ensure!(
                n.is_some() || axis < last,
                "the last axis of the input {name:?} has no length; export it with a fixed observation size"
            );
            // A dynamic axis is a batch or a time axis.
            Ok(n.unwrap_or(1))
        };
        let shape = shape.iter().enumerate().map(one).collect::<Result<Vec<usize>>>()?;
        let n = count(&shape)?;
        ensure!(
            (1..=usize::from(u16::MAX)).contains(&n),
            "the input {name:?} has {n} values; an observation has 1 to 65535"
        );
        let id = self.exprs.put(if integers { Expr::Integers(i) } else { Expr::Input(i) }, n);
        if !self.read.contains(&i) {
            self.read.push(i);
        }
        Ok(Tensor::new(shape, Data::Open((0..n).map(|k| Element::Of(id, k)).collect())))
    }
}

/// The nodes and names that the targets depend on.
pub(crate) struct Needed {
    pub(crate) nodes: HashSet<usize>,
    names: BTreeSet<String>,
}

pub(crate) fn needed(graph: &Graph, scope: &Scope, targets: &[String]) -> Result<Needed> {
    let mut giver: HashMap<&str, usize> = HashMap::new();
    for (i, node) in graph.nodes.iter().enumerate() {
        for name in node.outputs.iter().filter(|name| !name.is_empty()) {
            let again = giver.insert(name, i).is_some();
            ensure!(!again, "two nodes give the value {:?}", printable(name));
        }
    }
    let mut found = Needed { nodes: HashSet::new(), names: BTreeSet::new() };
    let mut open: Vec<String> = targets.to_vec();
    while let Some(name) = open.pop() {
        if scope.contains_key(&name) || !found.names.insert(name.clone()) {
            continue;
        }
        if let Some(&i) = giver.get(name.as_str())
            && found.nodes.insert(i)
        {
            open.extend(graph.nodes[i].inputs.iter().filter(|name| !name.is_empty()).cloned());
            captured(&graph.nodes[i], &mut open, MAX_DEPTH)?;
        }
    }
    Ok(found)
}

/// Collects the names that graphs in a node's attributes read, including those from outside.
fn captured(node: &Node, names: &mut Vec<String>, depth: usize) -> Result<()> {
    ensure!(depth > 0, "more than {MAX_DEPTH} graphs are nested");
    for bytes in node.attributes.values().filter_map(|attribute| attribute.g.as_ref()) {
        let inner = Graph::parse(bytes)?;
        names.extend(inner.outputs.iter().map(|port| port.name.clone()));
        for node in &inner.nodes {
            names.extend(node.inputs.iter().filter(|name| !name.is_empty()).cloned());
            captured(node, names, depth - 1)?;
        }
    }
    Ok(())
}
