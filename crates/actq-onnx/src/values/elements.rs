//! Functions of the elements of a tensor, some of which may be constant.

use std::collections::BTreeSet;
use std::sync::Arc;

use actq::error::{Context as _, Result};

use crate::values::evaluation::computed;
use crate::values::expr::{Exprs, Id, Matrix};
use crate::values::tensor::{Element, Tensor};

/// Applies a function of vectors to all elements. Known elements give known elements.
pub(crate) fn each(exprs: &mut Exprs, x: &Tensor, f: &dyn Fn(&mut Exprs, Id) -> Id) -> Result<Tensor> {
    let mut all = x.elements();
    let at: Vec<usize> = (0..all.len()).filter(|&i| value(&all[i]).is_some()).collect();
    let at = in_order(at, &|i| [value(&all[i]).unwrap_or_default(); 2]);
    let values: Vec<(Id, usize)> = at.iter().filter_map(|&i| value(&all[i])).collect();
    let (known, numbers): (Vec<usize>, Vec<f64>) = all
        .iter()
        .enumerate()
        .filter_map(|(i, e)| if let Element::Known(v) = e { Some((i, *v)) } else { None })
        .unzip();
    let open = if values.is_empty() { Vec::new() } else { apply(exprs, &values, f) };
    let computed = computed(&numbers, f)?.into_iter().map(Element::Known);
    at.into_iter().zip(open).chain(known.into_iter().zip(computed)).for_each(|(i, element)| all[i] = element);
    Ok(Tensor::of_elements(x.shape.clone(), all))
}

/// Sorts places by their values, if that gives fewer runs of neighbours. Elements that a transpose scattered are then
/// computed in the order of the layer before it, and scattered afterwards.
pub(crate) fn in_order(at: Vec<usize>, values: &dyn Fn(usize) -> [(Id, usize); 2]) -> Vec<usize> {
    let breaks = |order: &[usize]| {
        let is_break = |pair: &&[usize]| values(pair[0]).map(|(of, i)| (of, i + 1)) != values(pair[1]);
        order.windows(2).filter(is_break).count()
    };
    let given = breaks(&at);
    if given == 0 {
        return at;
    }
    let mut sorted = at.clone();
    sorted.sort_by_key(|&i| values(i));
    if breaks(&sorted) < given { sorted } else { at }
}

/// Applies `f` to these elements, none of which is known.
pub(crate) fn apply(exprs: &mut Exprs, values: &[(Id, usize)], f: &dyn Fn(&mut Exprs, Id) -> Id) -> Vec<Element> {
    let x = exprs.vector(values);
    let y = f(exprs, x);
    exprs.elements(y)
}

/// Returns the value and the place of an element; `None` for a known one.
pub(crate) fn value(element: &Element) -> Option<(Id, usize)> {
    if let Element::Of(id, i) = element { Some((*id, *i)) } else { None }
}

/// Lists the expressions that elements need, each after its operands.
pub(crate) fn needed(exprs: &Exprs, elements: impl IntoIterator<Item = Element>) -> Vec<Id> {
    let ids: BTreeSet<Id> = elements.into_iter().filter_map(|element| value(&element)).map(|(id, _)| id).collect();
    exprs.needed(&Vec::from_iter(ids))
}

/// Makes a vector of these elements, at least one of which is not known. Known elements become the biases of a layer
/// with zero weights.
pub(crate) fn open_vector(exprs: &mut Exprs, elements: &[Element]) -> Result<Id> {
    let first =
        elements.iter().find_map(value).context("all operands are constant; let the exporter fold constants")?;
    let known = |element: &Element| if let Element::Known(v) = element { Some(*v) } else { None };
    let biases: Vec<f64> = elements.iter().filter_map(known).collect();
    let mut constants = Vec::new();
    if !biases.is_empty() {
        let one = exprs.vector(&[first]);
        let (rows, name) = (biases.len(), Some("constant.weight".to_owned()));
        let layer = exprs.linear(one, Arc::new(Matrix { name, rows, cols: 1, data: vec![0.0; rows] }), biases);
        constants.extend((0..rows).map(|k| (layer, k)));
    }
    let mut constants = constants.into_iter();
    let values: Option<Vec<(Id, usize)>> = elements.iter().map(|e| value(e).or_else(|| constants.next())).collect();
    Ok(exprs.vector(&values.context("lost a constant; internal error; please report it")?))
}
