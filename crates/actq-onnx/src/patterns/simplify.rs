//! Simplification: factors and offsets move into adjacent matrices, and rows without a reader are removed.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use actq_kernels::math::Function;

use crate::patterns::slices::sums_of_slices;
use crate::values::elements::value;
use crate::values::expr::{Expr, Exprs, Id, Matrix, Run, Unary};

/// Simplifies a value. `instead` maps expressions to their replacements.
pub(crate) fn simplify(exprs: &mut Exprs, root: Id, instead: &HashMap<Id, Id>) -> Id {
    let order = exprs.needed_instead(&[root], instead);
    let mut readers: HashMap<Id, Vec<Id>> = HashMap::from([(root, vec![root])]);
    for &id in &order {
        for operand in exprs.get(id).operands() {
            readers.entry(instead.get(&operand).copied().unwrap_or(operand)).or_default().push(id);
        }
    }
    let queries = read_queries(exprs, &order, &readers, instead);
    let mut new: HashMap<Id, Id> = HashMap::new();
    // Rows of ones by length, as sums of one length share a matrix.
    let mut rows_of_ones: HashMap<usize, Arc<Matrix>> = HashMap::new();
    // The first norm of each value.
    let mut norms: HashMap<Id, Id> = HashMap::new();
    for id in order {
        let old = exprs.get(id).clone();
        let of = |operand: &Id| {
            let operand = instead.get(operand).copied().unwrap_or(*operand);
            new.get(&operand).copied().unwrap_or(operand)
        };
        let read_by =
            |operand: &Id| readers.get(&instead.get(operand).copied().unwrap_or(*operand)).map_or(&[][..], |r| r);
        let len = exprs.len_of(id);
        let done = match old {
            Expr::Affine(x, a, b) => {
                let value = of(&x);
                match exprs.get(value) {
                    Expr::Linear(y, w, bias) if read_by(&x).len() == 1 => {
                        let (y, w, bias) = (
                            *y,
                            scaled(w, &a, |row, _| a[row]),
                            bias.iter().zip(&a).zip(&b).map(|((bias, a), b)| bias * a + b).collect(),
                        );
                        exprs.put(Expr::Linear(y, w, bias), len)
                    }
                    _ => exprs.put(Expr::Affine(value, a, b), len),
                }
            }
            Expr::Linear(x, w, bias) => {
                let value = of(&x);
                let all_linear = read_by(&x).iter().all(|&reader| matches!(exprs.get(reader), Expr::Linear(..)));
                match exprs.get(value) {
                    Expr::Affine(y, a, b) if all_linear && !exprs.is_observed(*y) => {
                        let (y, w, bias) = (*y, scaled(&w, a, |_, col| a[col]), offset(&w, b, bias));
                        exprs.put(Expr::Linear(y, w, bias), len)
                    }
                    _ => exprs.put(Expr::Linear(value, w, bias), len),
                }
            }
            Expr::Pick(runs) => {
                let runs = sums_of_slices(exprs, &runs, &of);
                let same = runs.iter().all(|run| run.of == runs[0].of);
                let before =
                    |run: &Run| queries.get(instead.get(&run.of).unwrap_or(&run.of)).map_or(0, |read| read.start);
                let moved = |run: &Run| Run { of: of(&run.of), from: run.from - before(run), ..*run };
                let runs: Vec<Run> = runs.iter().map(moved).collect();
                match exprs.get(runs[0].of) {
                    Expr::Linear(y, w, bias) if same && is_only_reader(&readers, id, exprs, instead) => {
                        // A row that is read several times, as one added to all tokens, is computed once.
                        let (mut rows, mut place_of) = (Vec::new(), HashMap::new());
                        let mut place = |row: usize| {
                            *place_of.entry(row).or_insert_with(|| {
                                rows.push(row);
                                rows.len() - 1
                            })
                        };
                        let places: Vec<usize> =
                            runs.iter().flat_map(|run| run.from..run.from + run.len).map(&mut place).collect();
                        let data = rows.iter().flat_map(|&r| &w.data[r * w.cols..(r + 1) * w.cols]).copied().collect();
                        let bias = rows.iter().map(|&r| bias[r]).collect();
                        let w = Matrix { name: w.name.clone(), rows: rows.len(), cols: w.cols, data };
                        let linear = exprs.linear(*y, Arc::new(w), bias);
                        exprs.vector(&places.iter().map(|&at| (linear, at)).collect::<Vec<_>>())
                    }
                    _ => exprs.put(Expr::Pick(runs), len),
                }
            }
            Expr::Unary(Unary::Abs, x) => {
                let x = of(&x);
                let negative = times(exprs, x, -1.0);
                let (up, down) = (exprs.function(Function::Relu, x), exprs.function(Function::Relu, negative));
                exprs.add(up, down)
            }
            // A remaining sum becomes a product with a row of ones.
            Expr::Sum(x) => {
                let x = of(&x);
                let cols = exprs.len_of(x);
                let ones = rows_of_ones.entry(cols).or_insert_with(|| {
                    let (name, data) = (Some("sum.weight".to_owned()), vec![1.0; cols]);
                    Arc::new(Matrix { name, rows: 1, cols, data })
                });
                exprs.put(Expr::Linear(x, Arc::clone(ones), vec![0.0]), len)
            }
            Expr::LayerNorm(x, ..) | Expr::RmsNorm(x, ..) => {
                let norm = exprs.put(old.over(of), len);
                reuse_norm(exprs, *norms.entry(of(&x)).or_insert(norm), norm)
            }
            Expr::Attention(_) => {
                let mut attention = old.over(of);
                let read = queries.get(&id).cloned().unwrap_or(0..len);
                if let Expr::Attention(all) = &mut attention
                    && read.len() < len
                {
                    let elements: Vec<(Id, usize)> = exprs.elements(all.queries).iter().filter_map(value).collect();
                    all.queries = exprs.vector(&elements[read.clone()]);
                }
                exprs.put(attention, read.len())
            }
            other => exprs.put(other.over(of), len),
        };
        exprs.keep_origin(id, done);
        new.insert(id, done);
    }
    new.get(&root).copied().unwrap_or(root)
}

/// Returns the elements of each attention that are read, whole queries up to the last one if it is causal. There is none
/// if all are.
fn read_queries(
    exprs: &Exprs,
    order: &[Id],
    readers: &HashMap<Id, Vec<Id>>,
    instead: &HashMap<Id, Id>,
) -> HashMap<Id, Range<usize>> {
    let mut found = HashMap::new();
    for &id in order {
        let Expr::Attention(of) = exprs.get(id) else { continue };
        let (len, width) = (exprs.len_of(id), of.heads * of.dim);
        // Sums look through what they read.
        let is_summed = |reader: &Id| {
            readers.get(reader).is_some_and(|all| all.iter().any(|id| matches!(exprs.get(*id), Expr::Sum(_))))
        };
        let runs = |reader: &Id| match exprs.get(*reader) {
            Expr::Pick(runs) if !is_summed(reader) => {
                Some(runs.iter().filter(|run| *instead.get(&run.of).unwrap_or(&run.of) == id))
            }
            _ => None,
        };
        let Some(runs) = readers.get(&id).and_then(|all| all.iter().map(runs).collect::<Option<Vec<_>>>()) else {
            continue;
        };
        let runs: Vec<&Run> = runs.into_iter().flatten().collect();
        let start = runs.iter().map(|run| run.from / width * width).min().unwrap_or(0);
        let end = runs.iter().map(|run| (run.from + run.len).next_multiple_of(width)).max().unwrap_or(len);
        let end = if of.causal { len } else { end };
        if start > 0 || end < len {
            found.insert(id, start..end);
        }
    }
    found
}

/// Returns `k x` as a separate operation, also of a norm with other readers: a factor inside would need the norm twice.
fn times(exprs: &mut Exprs, x: Id, k: f64) -> Id {
    let len = exprs.len_of(x);
    exprs.put(Expr::Affine(x, vec![k; len], vec![0.0; len]), len)
}

/// Replaces a norm by a multiple of the `first` norm of the same value, if possible, as the sum of a LeakyReLU reads
/// both.
fn reuse_norm(exprs: &mut Exprs, first: Id, norm: Id) -> Id {
    match exprs.ratio(norm, first) {
        Some(k) if norm != first => times(exprs, first, k),
        _ => norm,
    }
}

/// Returns `true` if `reader` is the only reader of its operands.
fn is_only_reader(readers: &HashMap<Id, Vec<Id>>, reader: Id, exprs: &Exprs, instead: &HashMap<Id, Id>) -> bool {
    exprs.get(reader).operands().iter().all(|operand| {
        let operand = instead.get(operand).copied().unwrap_or(*operand);
        readers.get(&operand).is_some_and(|all| all.iter().all(|other| *other == reader))
    })
}

/// Returns the matrix with each element times the factor of its row and column.
fn scaled(w: &Arc<Matrix>, a: &[f64], factor: impl Fn(usize, usize) -> f64) -> Arc<Matrix> {
    if a.iter().all(|a| *a == 1.0) {
        return Arc::clone(w);
    }
    let data = w.data.iter().enumerate().map(|(i, element)| element * factor(i / w.cols, i % w.cols)).collect();
    Arc::new(Matrix { name: w.name.clone(), rows: w.rows, cols: w.cols, data })
}

fn offset(w: &Matrix, b: &[f64], bias: Vec<f64>) -> Vec<f64> {
    let products = w.data.chunks(w.cols).map(|row| row.iter().zip(b).map(|(w, b)| w * b).sum::<f64>());
    bias.into_iter().zip(products).map(|(bias, product)| bias + product).collect()
}
