//! Einsum of two operands, as a matrix product.

use actq::error::{Context as _, Result, ensure};

use crate::nodes::call::Call;
use crate::nodes::moves::transposed;
use crate::nodes::products::product;
use crate::values::expr::Exprs;
use crate::values::tensor::{Tensor, count};

/// Returns the output, if the node is an Einsum.
pub(crate) fn run(call: &Call<'_>, exprs: &mut Exprs, budget: &mut usize) -> Result<Option<Tensor>> {
    if call.op() != "Einsum" {
        return Ok(None);
    }
    let equation = call.text("equation").context("has no equation")?;
    let plain: String = equation.chars().filter(|c| !c.is_whitespace()).collect();
    let supported = "only a product of two operands is supported, as bi,oi->bo or bhqd,bhkd->bhqk";
    let (inputs, output) =
        plain.split_once("->").with_context(|| format!("{equation:?} names no output; {supported}"))?;
    let (a, b) = inputs.split_once(',').with_context(|| format!("{equation:?} has one operand; {supported}"))?;
    let [a, b, output] = [a, b, output].map(|axes| axes.chars().collect::<Vec<char>>());
    let named = |axes: &[char]| axes.iter().enumerate().all(|(i, c)| c.is_ascii_alphabetic() && !axes[..i].contains(c));
    let (x, y) = (call.input(0)?, call.input(1)?);
    ensure!(
        named(&a) && named(&b) && named(&output) && a.len() == x.shape.len() && b.len() == y.shape.len(),
        "{equation:?} does not fit {:?} and {:?}, or repeats an axis; {supported}",
        x.shape,
        y.shape
    );
    // Axes of both operands are summed over, or are a batch in the output; all others are in the output.
    let (batch, summed): (Vec<char>, Vec<char>) =
        a.iter().copied().filter(|c| b.contains(c)).partition(|c| output.contains(c));
    let rest =
        |axes: &[char], other: &[char]| axes.iter().copied().filter(|c| !other.contains(c)).collect::<Vec<char>>();
    let (of_a, of_b) = (rest(&a, &b), rest(&b, &a));
    let joined = [batch.clone(), of_a.clone(), of_b.clone()].concat();
    ensure!(
        joined.len() == output.len() && joined.iter().all(|c| output.contains(c)),
        "{equation:?} sums over an axis of one operand only; {supported}"
    );
    let (left, of_a) = turned(x, &a, [&batch, &of_a, &summed])?;
    let (right, of_b) = turned(y, &b, [&batch, &summed, &of_b])?;
    let shape = [&of_a[0][..], &of_a[1], &of_b[2]].concat();
    let result = product(exprs, &left, &right, 1.0, budget)?.reshaped(shape)?;
    let order = output.iter().map(|c| joined.iter().position(|other| other == c));
    let order: Vec<usize> = order.collect::<Option<_>>().context("lost an axis; internal error; please report it")?;
    transposed(&result, &order).map(Some)
}

/// Returns a tensor as matrices with these axes as batch, rows and columns, and the lengths of the axes.
fn turned(x: &Tensor, axes: &[char], sides: [&[char]; 3]) -> Result<(Tensor, [Vec<usize>; 3])> {
    let place = |c: &char| axes.iter().position(|axis| axis == c);
    let order: Vec<usize> = sides
        .concat()
        .iter()
        .map(place)
        .collect::<Option<_>>()
        .context("lost an axis; internal error; please report it")?;
    let turned = transposed(x, &order)?;
    let (batch, rest) = turned.shape.split_at(sides[0].len());
    let (rows, cols) = rest.split_at(sides[1].len());
    let mut shape = vec![count(rows)?, count(cols)?];
    if !batch.is_empty() {
        shape.insert(0, count(batch)?);
    }
    let lens = [batch, rows, cols].map(<[usize]>::to_vec);
    let matrix = turned.reshaped(shape)?;
    Ok((Tensor { name: x.name.clone(), ..matrix }, lens))
}
