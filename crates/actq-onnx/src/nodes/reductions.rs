//! Norms, and reductions over axes.

use actq::error::{Context as _, Result, ensure};
use actq::numbers::positive;

use crate::nodes::arithmetic::two;
use crate::nodes::call::Call;
use crate::nodes::known::{Reduced, reduced};
use crate::nodes::places::axis;
use crate::values::elements::{open_vector, value};
use crate::values::evaluation::computed;
use crate::values::expr::{Exprs, Id, Unary};
use crate::values::tensor::{Data, Element, Tensor, count};

/// The most values of a maximum, each of which takes several operations.
pub(crate) const MAX_COMPARED: usize = 64;

/// Returns the output, if the node is such an operator.
pub(crate) fn run(call: &Call<'_>, exprs: &mut Exprs) -> Result<Option<Tensor>> {
    let epsilon = call.float("epsilon").unwrap_or(1e-5);
    match call.op() {
        "LayerNormalization" => {
            let scale = call.reals(1, "the scale")?;
            let bias = if call.optional(2).is_some() { call.reals(2, "the bias")? } else { vec![0.0; scale.len()] };
            positive(epsilon, "epsilon")?;
            let normed = |exprs: &mut Exprs, x: Id| exprs.layer_norm(x, &scale, bias.clone(), epsilon);
            norm(call, exprs, scale.len(), bias.len(), &normed).map(Some)
        }
        "RMSNormalization" | "SimplifiedLayerNormalization" => {
            let scale = call.reals(1, "the scale")?;
            positive(epsilon, "epsilon")?;
            let normed = |exprs: &mut Exprs, x: Id| exprs.rms_norm(x, &scale, epsilon);
            norm(call, exprs, scale.len(), scale.len(), &normed).map(Some)
        }
        "BatchNormalization" => batch_norm(call, exprs, epsilon).map(Some),
        "InstanceNormalization" | "GroupNormalization" => group_norm(call, exprs, epsilon).map(Some),
        "ReduceSum" | "ReduceMean" | "ReduceMax" | "ReduceMin" | "ReduceL1" | "ReduceL2" | "ReduceSumSquare" => {
            reduce(call.op(), call.input(0)?, reduced(call)?, exprs).map(Some)
        }
        "GlobalAveragePool" | "GlobalMaxPool" => {
            let x = call.input(0)?;
            let positions = x.shape.len().saturating_sub(2);
            let shape = x.shape.iter().take(2).copied().chain(std::iter::repeat_n(1, positions)).collect();
            let op = if call.op() == "GlobalMaxPool" { "ReduceMax" } else { "ReduceMean" };
            reduce(op, x, Reduced { axes: (2..x.shape.len()).collect(), shape }, exprs).map(Some)
        }
        "LpNormalization" => {
            ensure!(call.int("p").unwrap_or(2) == 2, "has p = {}; only p = 2 is supported", call.int("p").unwrap_or(2));
            let x = call.input(0)?;
            let at = axis(call.int("axis").unwrap_or(-1), x.shape.len())?;
            ensure!(
                at + 1 == x.shape.len(),
                "normalizes axis {at}, and only the last axis is supported; export with Transpose around it"
            );
            rows(exprs, x, x.shape[at], &|exprs, row| {
                let length = root_of_squares(exprs, row);
                let inverse = exprs.unary(Unary::Reciprocal, length);
                let inverse = exprs.vector(&vec![(inverse, 0); exprs.len_of(row)]);
                exprs.mul(row, inverse)
            })
            .map(Some)
        }
        _ => Ok(None),
    }
}

fn root_of_squares(exprs: &mut Exprs, x: Id) -> Id {
    let squares = exprs.mul(x, x);
    let sum = exprs.sum(squares);
    exprs.unary(Unary::Sqrt, sum)
}

/// Applies `f` to a vector, evaluated if all elements are known.
fn of_row(exprs: &mut Exprs, row: &[Element], f: &dyn Fn(&mut Exprs, Id) -> Id) -> Result<Vec<Element>> {
    let known = |e: &Element| if let Element::Known(v) = e { Some(*v) } else { None };
    if let Some(numbers) = row.iter().map(known).collect::<Option<Vec<f64>>>() {
        return Ok(computed(&numbers, f)?.into_iter().map(Element::Known).collect());
    }
    let row = open_vector(exprs, row)?;
    let result = f(exprs, row);
    Ok(exprs.known_elements(result))
}

/// Applies a function of vectors to every run of `n` elements.
fn rows(exprs: &mut Exprs, x: &Tensor, n: usize, f: &dyn Fn(&mut Exprs, Id) -> Id) -> Result<Tensor> {
    ensure!(n > 0 && x.len() > 0, "reads no values");
    let mut all = Vec::with_capacity(x.len());
    for row in x.elements().chunks(n) {
        all.extend(of_row(exprs, row, f)?);
    }
    Ok(Tensor::of_elements(x.shape.clone(), all))
}

fn norm(
    call: &Call<'_>,
    exprs: &mut Exprs,
    scales: usize,
    biases: usize,
    normed: &dyn Fn(&mut Exprs, Id) -> Id,
) -> Result<Tensor> {
    let x = call.input(0)?;
    let at = axis(call.int("axis").unwrap_or(-1), x.shape.len())?;
    let n = count(&x.shape[at..])?;
    ensure!(scales == n && biases == n, "norms {n} values with {scales} scales and {biases} biases");
    rows(exprs, x, n, normed)
}

/// Converts a batch norm in inference to a factor and an offset for each channel.
fn batch_norm(call: &Call<'_>, exprs: &mut Exprs, eps: f64) -> Result<Tensor> {
    let x = call.input(0)?;
    ensure!(
        x.shape.len() >= 2
            && call.int("training_mode").unwrap_or(0) == 0
            && call.node.outputs.iter().skip(1).all(String::is_empty),
        "is in training mode, or does not read [batch, channel, ..]; export for inference"
    );
    let [scale, bias, mean, variance] =
        [(1, "the scale"), (2, "the bias"), (3, "the mean"), (4, "the variance")].map(|(i, what)| call.reals(i, what));
    let (scale, bias, mean, variance) = (scale?, bias?, mean?, variance?);
    let n = x.shape[1];
    ensure!(
        [&scale, &bias, &mean, &variance].iter().all(|v| v.len() == n),
        "its constants are not one for each of {n} channels"
    );
    ensure!(variance.iter().all(|v| v + eps > 0.0), "has a variance that is not above 0 with epsilon {eps}");
    let a: Vec<f64> = scale.iter().zip(&variance).map(|(s, v)| s / (v + eps).sqrt()).collect();
    let b = bias.iter().zip(&mean).zip(&a).map(|((b, m), a)| b - m * a).collect();
    let mut shape = vec![n];
    shape.resize(x.shape.len() - 1, 1);
    let [a, b] = [a, b].map(|v| Tensor::new(shape.clone(), Data::Real(v)));
    let scaled = two("Mul", exprs, x, &a, x.len())?;
    two("Add", exprs, &scaled, &b, x.len())
}

/// Converts a group norm, or an instance norm with one channel in each group, then a factor and an offset for each
/// channel.
fn group_norm(call: &Call<'_>, exprs: &mut Exprs, eps: f64) -> Result<Tensor> {
    let x = call.input(0)?;
    ensure!(x.shape.len() >= 2 && x.shape[0] == 1, "reads the shape {:?}; export with [1, channel, ..]", x.shape);
    positive(eps, "epsilon")?;
    let n = x.shape[1];
    let groups = match call.int("num_groups") {
        _ if call.op() == "InstanceNormalization" => n,
        groups => groups.and_then(|g| usize::try_from(g).ok()).context("has no number of groups")?,
    };
    ensure!(groups > 0 && n.is_multiple_of(groups), "{n} channels cannot form {groups} groups");
    let each = x.len() / groups;
    let ones = vec![1.0; each];
    let y = rows(exprs, x, each, &|exprs, row| exprs.layer_norm(row, &ones, vec![0.0; each], eps))?;
    let constant = |i: usize, what: &str| -> Result<Tensor> {
        let values = call.reals(i, what)?;
        // Before operator set 21 there is one value for each group.
        let per = if values.len() == groups { n / groups } else { 1 };
        ensure!(values.len() * per == n, "{what} has {} values for {n} channels", values.len());
        let mut shape = vec![n];
        shape.resize(x.shape.len() - 1, 1);
        Ok(Tensor::new(shape, Data::Real(values.iter().flat_map(|&v| vec![v; per]).collect())))
    };
    let scaled = two("Mul", exprs, &y, &constant(1, "the scale")?, x.len())?;
    two("Add", exprs, &scaled, &constant(2, "the bias")?, x.len())
}

fn reduce(op: &str, x: &Tensor, reduced: Reduced, exprs: &mut Exprs) -> Result<Tensor> {
    let (runs, each) = reduced.runs(x)?;
    let one = |exprs: &mut Exprs, row: Id| match op {
        "ReduceL1" => {
            let sizes = exprs.unary(Unary::Abs, row);
            exprs.sum(sizes)
        }
        "ReduceL2" => root_of_squares(exprs, row),
        "ReduceSumSquare" => {
            let squares = exprs.mul(row, row);
            exprs.sum(squares)
        }
        "ReduceMean" => {
            let sum = exprs.sum(row);
            exprs.scaled(sum, 1.0 / each as f64, 0.0)
        }
        _ => exprs.sum(row),
    };
    let elements = runs.elements();
    let largest = matches!(op, "ReduceMax" | "ReduceMin");
    if largest || matches!(op, "ReduceSum" | "ReduceMean") && elements.chunks(each).all(of_different_values) {
        ensure!(
            !largest || each <= MAX_COMPARED,
            "takes the maximum or minimum of {each} values; the limit is {MAX_COMPARED}; export the part after it"
        );
        return slices_joined(op, exprs, &elements, each, reduced.shape);
    }
    let mut all = Vec::with_capacity(elements.len() / each);
    for row in elements.chunks(each) {
        all.extend(of_row(exprs, row, &one)?);
    }
    Ok(Tensor::of_elements(reduced.shape, all))
}

/// Returns `true` if a sum over these adds outputs of several layers rather than elements of one.
fn of_different_values(row: &[Element]) -> bool {
    let mut values: Vec<Id> = row.iter().filter_map(value).map(|(id, _)| id).collect();
    let open = values.len();
    values.sort_unstable();
    values.dedup();
    values.len() == open && row.len() > 1
}

/// Computes the sum, mean, maximum or minimum over runs of `each` elements by operations on whole vectors.
fn slices_joined(op: &str, exprs: &mut Exprs, elements: &[Element], each: usize, shape: Vec<usize>) -> Result<Tensor> {
    let slice = |k: usize| Tensor::of_elements(shape.clone(), elements[k..].iter().step_by(each).copied().collect());
    let two_of = match op {
        "ReduceMax" => "Max",
        "ReduceMin" => "Min",
        _ => "Add",
    };
    let mut all = slice(0);
    for k in 1..each {
        all = two(two_of, exprs, &all, &slice(k), elements.len())?;
    }
    if op == "ReduceMean" {
        let share = Tensor::new(vec![], Data::Real(vec![1.0 / each as f64]));
        all = two("Mul", exprs, &all, &share, elements.len())?;
    }
    Ok(all)
}
