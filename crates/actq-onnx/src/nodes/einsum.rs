//! Einsum of a value with a constant, as a matrix product.

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
    let supported = "only the product of a value with a constant is supported, as bi,oi->bo";
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
    // Axes of both operands are summed over; all others are in the output.
    let summed: Vec<char> = a.iter().copied().filter(|c| b.contains(c)).collect();
    let rest = |axes: &[char]| axes.iter().copied().filter(|c| !summed.contains(c)).collect::<Vec<char>>();
    let (of_a, of_b) = (rest(&a), rest(&b));
    let joined = [of_a.clone(), of_b.clone()].concat();
    ensure!(
        joined.len() == output.len() && joined.iter().all(|c| output.contains(c)),
        "{equation:?} sums over an axis of one operand only, or keeps an axis of both; {supported}"
    );
    let (left, of_a) = turned(x, &a, [&of_a, &summed])?;
    let (right, of_b) = turned(y, &b, [&summed, &of_b])?;
    let result = product(exprs, &left, &right, 1.0, budget)?.reshaped([&of_a[0][..], &of_b[1]].concat())?;
    let order = output.iter().map(|c| joined.iter().position(|other| other == c));
    let order: Vec<usize> = order.collect::<Option<_>>().context("lost an axis; internal error; please report it")?;
    transposed(&result, &order).map(Some)
}

/// Returns a tensor as a matrix with these axes as rows and columns, and the lengths of the axes.
fn turned(x: &Tensor, axes: &[char], sides: [&[char]; 2]) -> Result<(Tensor, [Vec<usize>; 2])> {
    let place = |c: &char| axes.iter().position(|axis| axis == c);
    let order: Vec<usize> = sides
        .concat()
        .iter()
        .map(place)
        .collect::<Option<_>>()
        .context("lost an axis; internal error; please report it")?;
    let turned = transposed(x, &order)?;
    let (rows, cols) = turned.shape.split_at(sides[0].len());
    let matrix = turned.reshaped(vec![count(rows)?, count(cols)?])?;
    Ok((Tensor { name: x.name.clone(), ..matrix }, [rows.to_vec(), cols.to_vec()]))
}
