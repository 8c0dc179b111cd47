//! Lowering of expressions to the ops of policy.json, with their tensors.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::Arc;

use actq::error::{Context as _, Error, Result, bail, ensure};
use actq::import::json::{Input, JsonOp};
use actq::import::values::{Tensor, Values};

use crate::nodes::attention::{PRODUCT, SOFTMAX};
use crate::values::expr::{Attention, Cell, Expr, Exprs, Id, Matrix, Run, Unary};

/// A run of elements of a slot. Slot 0 has the network's inputs, slot `i + 1` the output of op `i`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Part {
    slot: usize,
    from: usize,
    len: usize,
}

/// The slot of a prefix, of which no op but attention reads.
const PREFIX: usize = usize::MAX;

/// The most repetitions of an element in one operand, each of which is a copy. A longer operand repeats an op with this
/// many copies.
const MAX_COPIES: usize = 64;

/// The ops and tensors.
pub(crate) struct Lowered {
    pub(crate) ops: Vec<JsonOp>,
    pub(crate) tensors: BTreeMap<String, Tensor>,
    /// Values of the inputs that are the prefix, in the order of the ops that read them: keys, then values.
    pub(crate) prefix: Vec<usize>,
    /// Input parts of each op, and the slots of its other operands.
    reads: Vec<(Vec<Part>, Vec<usize>)>,
    /// Names and lengths of the inputs in slot 0.
    inputs: Vec<(&'static str, usize)>,
    /// Length of slot 0, then of each op's output.
    lens: Vec<usize>,
    /// The last number that was appended to a name in use.
    numbers: HashMap<String, usize>,
    /// Names of the matrices. Several ops may share one.
    matrices: HashMap<*const Matrix, String>,
    /// Parts that hold each expression.
    places: HashMap<Id, Vec<Part>>,
    /// Expressions that the op of their reader includes.
    included: HashSet<Id>,
}

/// Places of graph inputs, by their indices.
#[derive(Clone, Copy)]
pub(crate) struct Offsets<'a> {
    /// In the policy's inputs, one after the other.
    pub(crate) observed: &'a HashMap<usize, usize>,
    /// In the inputs that are the prefix, likewise.
    pub(crate) prefix: &'a HashMap<usize, usize>,
}

/// Lowers a value. `inputs` are the names and lengths of the policy's inputs. An error holds the expression without an op.
pub(crate) fn lower(
    exprs: &Exprs,
    root: Id,
    offsets: Offsets<'_>,
    inputs: Vec<(&'static str, usize)>,
) -> Result<Lowered, (Id, Error)> {
    let mut lowered = Lowered {
        ops: Vec::new(),
        tensors: BTreeMap::new(),
        prefix: Vec::new(),
        reads: Vec::new(),
        lens: vec![inputs.iter().map(|(_, len)| len).sum()],
        inputs,
        numbers: HashMap::new(),
        matrices: HashMap::new(),
        places: HashMap::new(),
        included: HashSet::new(),
    };
    let order = exprs.needed(&[root]);
    let mut readers: HashMap<Id, usize> = HashMap::new();
    order.iter().flat_map(|&id| exprs.get(id).operands()).for_each(|x| *readers.entry(x).or_default() += 1);
    // A clip and the factors around it are one op.
    for &id in &order {
        let inner = match *exprs.get(id) {
            Expr::Clip(x, _) if matches!(exprs.get(x), Expr::Affine(..)) => x,
            Expr::Affine(x, ..) if matches!(exprs.get(x), Expr::Clip(..)) => x,
            _ => continue,
        };
        // An op includes at most a clip, factors and a clip.
        let over = matches!(exprs.get(id), Expr::Affine(..))
            && matches!(exprs.get(inner), Expr::Clip(x, _) if lowered.included.contains(x));
        if readers.get(&inner) == Some(&1) && !over {
            lowered.included.insert(inner);
        }
    }
    for &id in &order {
        if !lowered.included.contains(&id) {
            lowered.value(exprs, id, offsets).map_err(|error| (id, error))?;
        }
    }
    lowered.end(root).map_err(|error| (root, error))?;
    let is_of_prefix = |part: &Part| part.slot == PREFIX;
    if lowered.reads.iter().any(|(parts, _)| parts.iter().any(is_of_prefix)) {
        let why =
            "reads a value of the prefix that is no key or value of attention before those of the network's own tokens";
        return Err((root, Error::input(why)));
    }
    lowered.slots();
    Ok(lowered)
}

impl Lowered {
    fn value(&mut self, exprs: &Exprs, id: Id, offsets: Offsets<'_>) -> Result<()> {
        let place = match exprs.get(id) {
            Expr::Input(i) => {
                let observed = offsets.observed.get(i).map(|from| (0, from));
                let place = observed.or(offsets.prefix.get(i).map(|from| (PREFIX, from)));
                let (slot, &from) = place.context("a recurrent state is read outside its cell")?;
                vec![Part { slot, from, len: exprs.len_of(id) }]
            }
            Expr::Pick(runs) => merged(runs.iter().flat_map(|run| self.cut(*run)).collect()),
            Expr::Spread(x) => self.spread(*x, exprs.len_of(id))?,
            _ => self.op(exprs, id)?,
        };
        self.places.insert(id, place);
        Ok(())
    }

    /// Repeats an element `n` times.
    fn spread(&mut self, x: Id, n: usize) -> Result<Vec<Part>> {
        let one = self.place(x);
        if n <= MAX_COPIES {
            return Ok(vec![one; n].concat());
        }
        let most = MAX_COPIES * MAX_COPIES;
        ensure!(n <= most, "repeats a value {n} times; the limit is {most}");
        let copies = self.push(JsonOp::new("identity"), vec![one; MAX_COPIES].concat(), &[], MAX_COPIES);
        let rest = copies.iter().map(|part| Part { len: n % MAX_COPIES, ..*part }).filter(|part| part.len > 0);
        Ok(vec![copies.clone(); n / MAX_COPIES].concat().into_iter().chain(rest).collect())
    }

    fn place(&self, id: Id) -> Vec<Part> {
        self.places.get(&id).cloned().unwrap_or_default()
    }

    /// Returns the parts that hold a run.
    fn cut(&self, run: Run) -> Vec<Part> {
        let (mut skip, mut left) = (run.from, run.len);
        let mut parts = Vec::new();
        for part in self.place(run.of) {
            let len = part.len.saturating_sub(skip).min(left);
            if len > 0 {
                parts.push(Part { from: part.from + skip, len, ..part });
            }
            skip = skip.saturating_sub(part.len);
            left -= len;
        }
        parts
    }

    fn op(&mut self, exprs: &Exprs, id: Id) -> Result<Vec<Part>> {
        let len = exprs.len_of(id);
        Ok(match exprs.get(id) {
            Expr::Affine(..) | Expr::Clip(..) => self.normalize(exprs, id)?,
            Expr::Linear(x, w, b) => {
                let name = self.matrix(w)?;
                let b = self.bias(&name, b)?;
                self.push(JsonOp::new("linear").key("w", Some(name)).key("b", b), self.place(*x), &[], len)
            }
            Expr::Unary(Unary::Known(f), x) => self.push(JsonOp::new(f.name()), self.place(*x), &[], len),
            Expr::Add(x, y) | Expr::Mul(x, y) => {
                let name = if matches!(exprs.get(id), Expr::Add(..)) { "add" } else { "mul" };
                let with = self.whole(*y);
                self.push(JsonOp::new(name), self.place(*x), &[("with", with)], len)
            }
            Expr::LayerNorm(x, weight, bias, eps) => {
                let w_ln = self.vector("norm.weight", weight)?;
                let b_ln = self.bias(&w_ln, bias)?;
                let op = JsonOp::new("layernorm").key("w_ln", Some(w_ln)).key("b_ln", b_ln).key("eps", Some(*eps));
                self.push(op, self.place(*x), &[], len)
            }
            Expr::RmsNorm(x, weight, eps) => {
                let w_ln = Some(self.vector("norm.weight", weight)?);
                let op = JsonOp::new("rmsnorm").key("w_ln", w_ln).key("eps", Some(*eps));
                self.push(op, self.place(*x), &[], len)
            }
            Expr::Rotary(of) => {
                let [cos, sin] = [("rotary.cos", &of.cos), ("rotary.sin", &of.sin)].map(|(n, v)| self.vector(n, v));
                let op = JsonOp::new("rotary").key("heads", Some(of.heads)).key("dim", Some(2 * of.cos.len()));
                let op = op.key("cos", Some(cos?)).key("sin", Some(sin?));
                self.push(op, self.place(of.x), &[], len)
            }
            Expr::Attention(of) => self.attention(of, len)?,
            Expr::Products(_) => bail!("{PRODUCT}"),
            Expr::Softmax(..) => bail!("{SOFTMAX}"),
            Expr::Cell(cell) => self.cell(cell, len)?,
            Expr::CellState(_) => bail!("an LSTM's cell state is read outside its cell; read the hidden state instead"),
            Expr::Unary(f, x) => {
                let x = if let Expr::Affine(inner, ..) = exprs.get(*x) { inner } else { x };
                let what = match f {
                    Unary::Log => "a logarithm",
                    Unary::Sqrt => "a square root",
                    Unary::Erf => "an error function",
                    Unary::Reciprocal if matches!(exprs.get(*x), Expr::Add(..)) => {
                        "a quotient by a sum of values, as the mean alpha / (alpha + beta) of a Beta distribution,"
                    }
                    Unary::Reciprocal => "a quotient by a value",
                    _ => "a comparison",
                };
                bail!(
                    "{what} has a kernel only within a norm, an activation or a cell; compute it before the policy, as an input, or \
                     after the policy, with the value before it as the action by --output NAME"
                )
            }
            Expr::Sum(_) | Expr::Input(_) | Expr::Integers(_) | Expr::Pick(_) | Expr::Spread(_) => {
                bail!("has no op; internal error; please report it")
            }
        })
    }

    fn attention(&mut self, of: &Attention, len: usize) -> Result<Vec<Part>> {
        ensure!(
            of.valid.is_empty(),
            "has a mask that depends on an input, and only that of a window of tokens in the state is supported; export \
             a causal or a full one"
        );
        let [keys, values] = [of.keys, of.values].map(|id| {
            let mut prefix = self.place(id);
            let own = prefix.split_off(prefix.iter().take_while(|part| part.slot == PREFIX).count());
            (prefix, own)
        });
        let (width, of_prefix) = (of.kv_heads * of.dim, [len_of(&keys.0), len_of(&values.0)]);
        ensure!(
            of_prefix[0] == of_prefix[1] && of_prefix[0].is_multiple_of(width),
            "reads {} keys and {} values of the prefix, which are not the same tokens of {width}",
            of_prefix[0],
            of_prefix[1]
        );
        self.prefix.extend([&keys.0, &values.0].into_iter().flatten().flat_map(|part| part.from..part.from + part.len));
        let mut others = Vec::new();
        if of_prefix[0] == 0 {
            others.extend([("keys", self.whole(of.keys)), ("values", self.whole(of.values))]);
        } else if !keys.1.is_empty() {
            others.extend([("keys", self.slot_of(keys.1)), ("values", self.slot_of(values.1))]);
        }
        let op = JsonOp::new("attention").key("heads", Some(of.heads)).key("kv_heads", Some(of.kv_heads));
        let op = op.key("dim", Some(of.dim)).key("factor", Some(of.factor)).key("causal", Some(of.causal));
        let op = op.key("context", (of.context > 0).then_some(of.context));
        let op = op.key("prefix", (of_prefix[0] > 0).then_some(of_prefix[0] / width));
        Ok(self.push(op, self.place(of.queries), &others, len))
    }

    fn cell(&mut self, cell: &Cell, hidden: usize) -> Result<Vec<Part>> {
        let (w_ih, w_hh) = (self.matrix(&cell.w_ih)?, self.matrix(&cell.w_hh)?);
        let (b_ih, b_hh) = (self.bias(&w_ih, &cell.b_ih)?, self.bias(&w_hh, &cell.b_hh)?);
        let name = if cell.lstm { "lstm" } else { "gru" };
        let op = JsonOp::new(name).key("hidden", Some(hidden)).key("w_ih", Some(w_ih)).key("w_hh", Some(w_hh));
        let op = op.key("b_ih", b_ih).key("b_hh", b_hh);
        Ok(self.push(op, self.place(cell.x), &[], hidden))
    }

    /// Lowers `clip(a clip(x) + b)`, with or without either clip.
    fn normalize(&mut self, exprs: &Exprs, id: Id) -> Result<Vec<Part>> {
        let len = exprs.len_of(id);
        let (mut at, mut clip, mut pre_clip) = (id, None, None);
        let (mut mean, mut scale) = (vec![0.0; len], vec![1.0; len]);
        if let Expr::Clip(x, limit) = exprs.get(at) {
            (at, clip) = (*x, Some(*limit));
        }
        if let Expr::Affine(x, a, b) = exprs.get(at)
            && (at == id || self.included.contains(&at))
        {
            at = *x;
            mean = a.iter().zip(b).map(|(a, b)| if *b == 0.0 { 0.0 } else { -b / a }).collect();
            scale.clone_from(a);
            if let Expr::Clip(x, limit) = exprs.get(at)
                && self.included.contains(&at)
            {
                (at, pre_clip) = (*x, Some(*limit));
            }
        }
        for limit in [clip, pre_clip].into_iter().flatten() {
            ensure!(limit > 0.0, "limits a value to a single number; fold it to a constant");
        }
        let mean = Some(self.vector("normalize.mean", &mean)?);
        let scale = Some(self.vector("normalize.scale", &scale)?);
        let op = JsonOp::new("normalize").key("mean", mean).key("scale", scale);
        let op = op.key("pre_clip", pre_clip).key("clip", clip);
        Ok(self.push(op, self.place(at), &[], len))
    }

    /// Appends an op with other operands by their keys.
    fn push(&mut self, op: JsonOp, input: Vec<Part>, others: &[(&str, usize)], len: usize) -> Vec<Part> {
        self.ops.push(others.iter().fold(op, |op, (key, slot)| op.key(key, Some(slot_name(*slot)))));
        self.reads.push((input, others.iter().map(|(_, slot)| *slot).collect()));
        self.lens.push(len);
        vec![Part { slot: self.ops.len(), from: 0, len }]
    }

    /// Returns the slot that consists of this value, or copies the value to a new one.
    fn whole(&mut self, id: Id) -> usize {
        let slot = self.slot_of(self.place(id));
        self.places.insert(id, vec![Part { slot, from: 0, len: self.lens[slot] }]);
        slot
    }

    /// Returns the slot that consists of these parts, or copies them to a new one.
    fn slot_of(&mut self, place: Vec<Part>) -> usize {
        match place[..] {
            [part] if self.is_whole(part) => part.slot,
            _ => {
                let n = len_of(&place);
                self.push(JsonOp::new("identity"), place, &[], n);
                self.ops.len()
            }
        }
    }

    /// Appends an op if the last op does not give the value.
    fn end(&mut self, root: Id) -> Result<()> {
        let last = self.ops.len();
        if self.place(root)[..] != [Part { slot: last, from: 0, len: self.lens[last] }] || last == 0 {
            let n = self.place(root).iter().map(|part| part.len).sum();
            ensure!(
                self.place(root) != [Part { slot: 0, from: 0, len: self.lens[0] }],
                "the action is the observation itself"
            );
            self.push(JsonOp::new("identity"), self.place(root), &[], n);
        }
        Ok(())
    }

    /// Names the slots that are read by an op other than the next one.
    fn slots(&mut self) {
        let mut named = HashSet::new();
        let mut ops = std::mem::take(&mut self.ops);
        for (i, ((input, others), op)) in self.reads.iter().zip(&mut ops).enumerate() {
            named.extend(others.iter().copied());
            op.input = match &input[..] {
                [part] if self.is_whole(*part) && part.slot == i => None,
                [part] if self.is_whole(*part) => Some(Input::One(slot_name(part.slot))),
                parts => Some(Input::Many(parts.iter().flat_map(|part| self.names(*part)).collect())),
            };
            if op.input.is_some() {
                named.extend(input.iter().map(|part| part.slot));
            }
        }
        for slot in named.into_iter().filter(|slot| *slot > 0) {
            ops[slot - 1].save = Some(slot_name(slot));
        }
        self.ops = ops;
    }

    /// Returns `true` if a part is all of a slot with a name.
    fn is_whole(&self, part: Part) -> bool {
        let has_name = part.slot > 0 || self.inputs.len() == 1;
        has_name && part.from == 0 && self.lens.get(part.slot) == Some(&part.len)
    }

    /// Returns the names of a part; of slot 0, one for each input in it.
    fn names(&self, part: Part) -> Vec<String> {
        let slot = [(slot_name(part.slot), self.lens[part.slot])];
        let inputs = self.inputs.iter().map(|(name, len)| ((*name).to_owned(), *len));
        let slots = if part.slot == 0 { inputs.collect() } else { slot.to_vec() };
        let (mut at, mut names) = (0, Vec::new());
        for (name, len) in slots {
            let [from, to] = [part.from, part.from + part.len].map(|end| end.clamp(at, at + len) - at);
            at += len;
            match (from, to) {
                _ if from == to => {}
                (0, to) if to == len => names.push(name),
                _ => names.push(format!("{name}[{from}:{to}]")),
            }
        }
        names
    }

    fn matrix(&mut self, w: &Arc<Matrix>) -> Result<String> {
        if let Some(name) = self.matrices.get(&Arc::as_ptr(w)) {
            return Ok(name.clone());
        }
        let wanted = w.name.clone().unwrap_or_else(|| "layer.weight".to_owned());
        let name = self.weight(&wanted, vec![w.rows, w.cols], &w.data)?;
        self.matrices.insert(Arc::as_ptr(w), name.clone());
        Ok(name)
    }

    fn vector(&mut self, name: &str, values: &[f64]) -> Result<String> {
        self.weight(name, vec![values.len()], values)
    }

    /// Adds the bias of a weight, if it is not zero.
    fn bias(&mut self, weight: &str, values: &[f64]) -> Result<Option<String>> {
        if values.iter().all(|v| *v == 0.0) {
            return Ok(None);
        }
        let name = match weight.rsplit_once("weight") {
            Some((before, after)) => format!("{before}bias{after}"),
            None => format!("{weight}.bias"),
        };
        self.vector(&name, values).map(Some)
    }

    /// Adds a tensor, rounded to f32. Returns its name, with a number if `wanted` is in use.
    fn weight(&mut self, wanted: &str, shape: Vec<usize>, values: &[f64]) -> Result<String> {
        let data: Vec<f32> = values.iter().map(|&v| v as f32).collect();
        ensure!(data.iter().all(|v| v.is_finite()), "tensor {wanted:?} holds a value that is not finite in float32");
        let mut name = wanted.to_owned();
        while self.tensors.contains_key(&name) {
            // One counter for each name, as a file may have thousands of equal names.
            let number = self.numbers.entry(wanted.to_owned()).or_insert(1);
            *number += 1;
            name = format!("{wanted}.{number}");
        }
        self.tensors.insert(name.clone(), Tensor { shape, values: Values::F32(data) });
        Ok(name)
    }
}

fn len_of(parts: &[Part]) -> usize {
    parts.iter().map(|part| part.len).sum()
}

fn slot_name(slot: usize) -> String {
    if slot == 0 { "obs".to_owned() } else { format!("v{slot}") }
}

/// Merges adjacent parts.
fn merged(parts: Vec<Part>) -> Vec<Part> {
    let mut all: Vec<Part> = Vec::new();
    for part in parts {
        match all.last_mut() {
            Some(last) if last.slot == part.slot && last.from + last.len == part.from => last.len += part.len,
            _ => all.push(part),
        }
    }
    all
}
