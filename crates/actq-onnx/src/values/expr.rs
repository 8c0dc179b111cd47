//! Expressions over vectors, each stored once, in the order of the graph.

use std::collections::{BTreeSet, HashMap};
use std::mem::discriminant;
use std::sync::Arc;

use actq_kernels::math::Function;

/// Index of an expression.
pub(crate) type Id = usize;

/// A weight matrix, rows are outputs.
#[derive(Debug, PartialEq)]
pub(crate) struct Matrix {
    /// The initializer's name, if any.
    pub(crate) name: Option<String>,
    pub(crate) rows: usize,
    pub(crate) cols: usize,
    /// Row-major.
    pub(crate) data: Vec<f64>,
}

/// A value that is not finite, which a node tests for or limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Guard {
    Nan,
    Infinity,
}

/// A run of elements of an expression.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Run {
    pub(crate) of: Id,
    pub(crate) from: usize,
    pub(crate) len: usize,
}

/// A function of every element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Unary {
    /// A function that the network has.
    Known(Function),
    /// `ln x`. This function and those below are supported in patterns only.
    Log,
    /// Square root.
    Sqrt,
    /// The error function.
    Erf,
    /// `1 / x`
    Reciprocal,
    /// `|x|`
    Abs,
    /// 1 if x is above this limit, else 0.
    Above(f64),
}

/// An LSTM or GRU cell.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Cell {
    /// `true` for an LSTM, with gates `[i f g o]`; `false` for a GRU, with gates `[r z n]`.
    pub(crate) lstm: bool,
    /// Input of the cell.
    pub(crate) x: Id,
    pub(crate) w_ih: Arc<Matrix>,
    pub(crate) w_hh: Arc<Matrix>,
    pub(crate) b_ih: Vec<f64>,
    pub(crate) b_hh: Vec<f64>,
    /// Runs of graph inputs that hold the hidden state, and the cell state of an LSTM, before the step.
    pub(crate) states: Vec<Run>,
}

/// Products of the rows of two values, a batch of matrices each: `a b'` of `[batch, rows, inner]` and
/// `[batch, cols, inner]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Products {
    pub(crate) a: Id,
    pub(crate) b: Id,
    pub(crate) batch: usize,
    pub(crate) rows: usize,
    pub(crate) inner: usize,
    pub(crate) cols: usize,
}

/// `softmax(factor q k') v`: queries, keys and values, each `[token, head, element]`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Attention {
    pub(crate) queries: Id,
    pub(crate) keys: Id,
    pub(crate) values: Id,
    pub(crate) heads: usize,
    pub(crate) kv_heads: usize,
    /// Elements of a head.
    pub(crate) dim: usize,
    pub(crate) factor: f64,
    pub(crate) causal: bool,
    /// Element of a graph input for each token that is seen only if it is 1, not 0; empty if all always are.
    pub(crate) valid: Vec<Option<(Id, usize)>>,
    /// Tokens that the state keeps, of which an evaluation has the last; 0: it has all.
    pub(crate) context: usize,
}

/// Heads of a token, rotated by its position: of each, elements `x_i` and `x_j` with `j = i + cos.len()` become
/// `x_i cos_i - x_j sin_i` and `x_j cos_i + x_i sin_i`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Rotary {
    pub(crate) x: Id,
    pub(crate) heads: usize,
    pub(crate) cos: Vec<f64>,
    pub(crate) sin: Vec<f64>,
}

/// An expression; [`Exprs`] holds its length.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Expr {
    /// Graph input of this index.
    Input(usize),
    /// Graph input of this index, of integers that are not yet cast to float.
    Integers(usize),
    /// Concatenated runs.
    Pick(Vec<Run>),
    /// The one element of a value, repeated.
    Spread(Id),
    /// `a x + b`, element by element.
    Affine(Id, Vec<f64>, Vec<f64>),
    /// `W x + b`
    Linear(Id, Arc<Matrix>, Vec<f64>),
    Unary(Unary, Id),
    Add(Id, Id),
    Mul(Id, Id),
    /// The sum of all elements.
    Sum(Id),
    /// A value limited to this magnitude.
    Clip(Id, f64),
    /// Operand, weight, bias, epsilon of the variance.
    LayerNorm(Id, Vec<f64>, Vec<f64>, f64),
    /// Operand, weight, epsilon of the mean square.
    RmsNorm(Id, Vec<f64>, f64),
    /// Products of values, in patterns only.
    Products(Products),
    /// Softmax of the rows of products times a factor, `true` if a row sees no later column than its own. The elements
    /// are as in [`Attention::valid`]. In patterns only.
    Softmax(Id, f64, bool, Vec<Option<(Id, usize)>>),
    /// Queries or keys with rotary positions.
    Rotary(Box<Rotary>),
    /// Attention of queries to keys and values.
    Attention(Box<Attention>),
    /// The hidden state after the step.
    Cell(Box<Cell>),
    /// The cell state after the step of an LSTM.
    CellState(Id),
}

impl Expr {
    /// Returns the expressions that it reads.
    pub(crate) fn operands(&self) -> Vec<Id> {
        match self {
            Self::Input(_) | Self::Integers(_) => vec![],
            Self::Pick(runs) => runs.iter().map(|run| run.of).collect(),
            Self::Add(x, y) | Self::Mul(x, y) => vec![*x, *y],
            Self::Products(of) => vec![of.a, of.b],
            Self::Attention(of) => {
                let valid = of.valid.iter().flatten().map(|(id, _)| *id);
                [of.queries, of.keys, of.values].into_iter().chain(valid).collect()
            }
            Self::Cell(cell) => vec![cell.x],
            Self::Rotary(rotary) => vec![rotary.x],
            Self::Spread(x)
            | Self::Affine(x, ..)
            | Self::Linear(x, ..)
            | Self::Unary(_, x)
            | Self::Sum(x)
            | Self::Clip(x, _)
            | Self::LayerNorm(x, ..)
            | Self::RmsNorm(x, ..)
            | Self::Softmax(x, ..)
            | Self::CellState(x) => vec![*x],
        }
    }

    /// Returns the same expression of other operands, which `of` maps its own to.
    pub(crate) fn over(mut self, of: impl Fn(&Id) -> Id) -> Self {
        match &mut self {
            Self::Input(_) | Self::Integers(_) => {}
            Self::Pick(runs) => runs.iter_mut().for_each(|run| run.of = of(&run.of)),
            Self::Add(x, y) | Self::Mul(x, y) => (*x, *y) = (of(x), of(y)),
            Self::Products(products) => (products.a, products.b) = (of(&products.a), of(&products.b)),
            Self::Attention(all) => {
                let valid = all.valid.iter_mut().flatten().map(|(id, _)| id);
                [&mut all.queries, &mut all.keys, &mut all.values].into_iter().chain(valid).for_each(|id| *id = of(id));
            }
            Self::Cell(cell) => cell.x = of(&cell.x),
            Self::Rotary(rotary) => rotary.x = of(&rotary.x),
            Self::Spread(x)
            | Self::Affine(x, ..)
            | Self::Linear(x, ..)
            | Self::Unary(_, x)
            | Self::Sum(x)
            | Self::Clip(x, _)
            | Self::LayerNorm(x, ..)
            | Self::RmsNorm(x, ..)
            | Self::Softmax(x, ..)
            | Self::CellState(x) => *x = of(x),
        }
        self
    }
}

/// All expressions.
#[derive(Debug, Default)]
pub(crate) struct Exprs {
    all: Vec<(Expr, usize)>,
    /// Expressions by kind, first operand, and the start of its run. The start keeps the lists short for rows of one
    /// value.
    known: HashMap<(std::mem::Discriminant<Expr>, Id, usize), Vec<Id>>,
    /// Values with a limit on one side: the operand and both limits, one of which is infinite.
    pub(crate) limited: HashMap<Id, (Id, f64, f64)>,
    /// Vectors that are limited on one side, each element by its own number: operand, limits, and 1 for lower ones, -1
    /// for upper ones.
    pub(crate) limited_each: HashMap<Id, (Id, Vec<f64>, f64)>,
    /// Nodes that give NaN or infinite values a meaning, which no kernel does.
    pub(crate) guards: BTreeSet<(usize, Guard)>,
    /// Index of the node that each expression comes from.
    origins: Vec<usize>,
    /// Index of the current node.
    pub(crate) node: usize,
}

impl Exprs {
    /// Adds an expression, or finds an equal one.
    pub(crate) fn put(&mut self, expr: Expr, len: usize) -> Id {
        let (first, from) = match &expr {
            Expr::Pick(runs) => runs.first().map_or((0, 0), |run| (run.of, run.from)),
            _ => (expr.operands().first().copied().unwrap_or(0), 0),
        };
        let key = (discriminant(&expr), first, from);
        let same = self.known.entry(key).or_default();
        if let Some(&id) = same.iter().find(|&&id| self.all[id].0 == expr && self.all[id].1 == len) {
            return id;
        }
        let id = self.all.len();
        same.push(id);
        self.all.push((expr, len));
        self.origins.push(self.node);
        id
    }

    pub(crate) fn get(&self, id: Id) -> &Expr {
        &self.all[id].0
    }

    pub(crate) fn len_of(&self, id: Id) -> usize {
        self.all[id].1
    }

    /// Returns the index of the node that an expression comes from.
    pub(crate) fn origin(&self, id: Id) -> usize {
        self.origins[id]
    }

    /// Gives `id` the origin of `old`.
    pub(crate) fn keep_origin(&mut self, old: Id, id: Id) {
        self.origins[id] = self.origins[old];
    }

    /// Returns `true` if a value consists of parts of the graph's inputs.
    pub(crate) fn is_observed(&self, id: Id) -> bool {
        match self.get(id) {
            Expr::Input(_) => true,
            Expr::Pick(runs) => runs.iter().all(|run| matches!(self.get(run.of), Expr::Input(_))),
            _ => false,
        }
    }

    /// Lists the expressions that `roots` need, and the roots, each after its operands.
    pub(crate) fn needed(&self, roots: &[Id]) -> Vec<Id> {
        self.needed_instead(roots, &HashMap::new())
    }

    /// Lists the same as [`Self::needed`], with some expressions replaced by those in `instead`.
    pub(crate) fn needed_instead(&self, roots: &[Id], instead: &HashMap<Id, Id>) -> Vec<Id> {
        let meant = |id: Id| instead.get(&id).copied().unwrap_or(id);
        let mut order = Vec::new();
        let mut seen = vec![false; self.all.len()];
        let mut stack: Vec<(Id, bool)> = roots.iter().rev().map(|&id| (meant(id), false)).collect();
        while let Some((id, done)) = stack.pop() {
            if done {
                order.push(id);
            } else if !std::mem::replace(&mut seen[id], true) {
                stack.push((id, true));
                stack.extend(self.get(id).operands().into_iter().rev().map(|id| (meant(id), false)));
            }
        }
        order
    }
}
