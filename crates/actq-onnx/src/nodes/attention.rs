//! Attention: products of two values, softmax, and ONNX's Attention operator, which consists of these.

use actq::error::{Context as _, Result, bail, ensure};
use actq::graph::ops::MAX_HEADS;
use actq_kernels::image::MAX_SLOTS;

use crate::nodes::arithmetic::two;
use crate::nodes::call::Call;
use crate::nodes::moves::{expanded, joined, transposed};
use crate::nodes::places::{axis, broadcast};
use crate::nodes::products;
use crate::patterns::attention::Scores;
use crate::values::elements::open_vector;
use crate::values::expr::{Attention, Expr, Exprs, Id, Products};
use crate::values::tensor::{Data, Element, Tensor, count};

/// Refusal of a product of two values that is not attention's.
pub(crate) const PRODUCT: &str = "multiplies two values of the network, and only attention does with a kernel: queries with keys, then the \
     softmax of that over the keys with values; export the part after it";

/// Refusal of a softmax elsewhere than in attention.
pub(crate) const SOFTMAX: &str = "has no kernel here; a softmax is supported in attention, over the products of queries and keys; if it only \
     chooses among actions, pass the value before it to actq import --output NAME";

/// Returns the outputs, if the node is such an operator.
pub(crate) fn run(call: &Call<'_>, exprs: &mut Exprs, budget: &mut usize) -> Result<Option<Vec<Tensor>>> {
    match call.op() {
        "Softmax" => {
            let x = call.input(0)?;
            ensure!(
                call.opset >= 13 || call.int("axis").is_some() || x.shape.len() <= 2,
                "names no axis, and in operator set {} goes over all but the first; export it with set 13 or above",
                call.opset
            );
            softmax(exprs, x, axis(call.int("axis").unwrap_or(-1), x.shape.len())?).map(|y| Some(vec![y]))
        }
        "Attention" if call.node.domain != "com.microsoft" => operator(call, exprs, budget).map(Some),
        _ => Ok(None),
    }
}

/// Computes `factor A B` of two values that are not known.
pub(crate) fn product(exprs: &mut Exprs, a: &Tensor, b: &Tensor, factor: f64, budget: usize) -> Result<Tensor> {
    let (&[ref of_a @ .., rows, inner], &[ref of_b @ .., of_rows, cols]) = (&a.shape[..], &b.shape[..]) else {
        bail!("{PRODUCT}")
    };
    ensure!(inner == of_rows && inner > 0, "multiplies {:?} with {:?}", a.shape, b.shape);
    let of_both = broadcast(of_a, of_b)?;
    let batch = count(&of_both)?;
    let fits = [batch, rows, cols].into_iter().try_fold(inner, usize::checked_mul).is_some_and(|work| work <= budget);
    ensure!(
        fits,
        "multiplies {:?} with {:?}, which takes more work than a policy of this size can have",
        a.shape,
        b.shape
    );
    let all = |x: &Tensor, last: [usize; 2]| expanded(x, &[&of_both[..], &last].concat(), budget);
    let (a, b) = (all(a, [rows, inner])?, all(b, [inner, cols])?);
    let shape = [&of_both[..], &[rows, cols]].concat();
    if let Some(&Element::Of(id, 0)) = a.elements().first()
        && matches!(exprs.get(id), Expr::Softmax(..))
    {
        let is_whole = a.len() == exprs.len_of(id) && (0..).zip(a.elements()).all(|(i, e)| e == Element::Of(id, i));
        ensure!(is_whole && factor == 1.0, "multiplies a part of a softmax; {PRODUCT}");
        return attention(exprs, id, &b, shape);
    }
    let mut order: Vec<usize> = (0..b.shape.len()).collect();
    order.swap(of_both.len(), of_both.len() + 1);
    let (a, b) = (open_vector(exprs, &a.elements())?, open_vector(exprs, &transposed(&b, &order)?.elements())?);
    let products = exprs.put(Expr::Products(Products { a, b, batch, rows, inner, cols }), batch * rows * cols);
    let scaled = exprs.scaled(products, factor, 0.0);
    Ok(Tensor::of_elements(shape, exprs.elements(scaled)))
}

/// Converts a softmax of attention's scores; of known elements, computes it.
fn softmax(exprs: &mut Exprs, x: &Tensor, at: usize) -> Result<Tensor> {
    let cols = x.shape[at];
    if let Some(values) = x.reals() {
        ensure!(at + 1 == x.shape.len(), "goes over axis {at} of a constant, and only the last axis is supported");
        let values = values.chunks(cols.max(1)).flat_map(known_softmax).collect();
        return Ok(Tensor::new(x.shape.clone(), Data::Real(values)));
    }
    let elements = x.elements();
    let scores = exprs.scores(&elements, cols)?.context(SOFTMAX)?;
    ensure!(
        at + 1 == x.shape.len(),
        "goes over axis {at} of {:?}, and attention goes over the keys, the last axis; transpose before it",
        x.shape
    );
    let Scores { products, factor, causal, valid } = scores;
    let weights = exprs.put(Expr::Softmax(products, factor, causal, valid), elements.len());
    Ok(Tensor::of_elements(x.shape.clone(), exprs.elements(weights)))
}

fn known_softmax(row: &[f64]) -> Vec<f64> {
    let most = row.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let powers: Vec<f64> = row.iter().map(|v| libm::exp(v - most)).collect();
    let sum: f64 = powers.iter().sum();
    powers.iter().map(|power| power / sum).collect()
}

/// Multiplies the weights of a softmax with values `[.., key, element]`, to `[.., query, element]` of `shape`.
fn attention(exprs: &mut Exprs, weights: Id, values: &Tensor, shape: Vec<usize>) -> Result<Tensor> {
    let &Expr::Softmax(scores, factor, causal, ref valid) = exprs.get(weights) else { bail!("{PRODUCT}") };
    let (valid, &Expr::Products(of)) = (valid.clone(), exprs.get(scores)) else { bail!("{PRODUCT}") };
    let Products { a, b, batch: heads, rows, inner: dim, cols } = of;
    let of_values = shape[shape.len() - 1];
    ensure!(
        of_values == dim,
        "has heads of {dim} elements in its keys and of {of_values} in its values; only equal ones are supported"
    );
    ensure!(heads <= MAX_HEADS, "has {heads} heads; at most {MAX_HEADS} are supported, and a batch of 1");
    ensure!(cols <= MAX_SLOTS, "reads {cols} tokens; attention to at most {MAX_SLOTS} is supported");
    let (queries, keys, values) = (exprs.elements(a), exprs.elements(b), values.elements());
    let kv_heads = heads / shared_heads(&keys, &values, heads);
    // [head, token, element] to [token, head, element]
    let mut by_token = |elements: &[Element], tokens: usize, heads_of: usize| {
        let each = heads / heads_of;
        let place = |token: usize, head: usize| (head * each * tokens + token) * dim;
        let all = (0..tokens).flat_map(|token| (0..heads_of).map(move |head| (token, head)));
        let turned: Vec<Element> =
            all.flat_map(|(token, head)| elements[place(token, head)..][..dim].to_vec()).collect();
        open_vector(exprs, &turned)
    };
    let (queries, keys) = (by_token(&queries, rows, heads)?, by_token(&keys, cols, kv_heads)?);
    let values = by_token(&values, cols, kv_heads)?;
    let (queries, keys, factor) = unscaled(exprs, queries, keys, factor);
    let (queries, keys) = (exprs.rotated(queries), exprs.rotated(keys));
    let all = Attention { queries, keys, values, heads, kv_heads, dim, factor, causal, valid, context: 0 };
    let y = exprs.put(Expr::Attention(Box::new(all)), heads * rows * dim);
    let place = |head: usize, token: usize| (token * heads + head) * dim;
    let all = (0..heads).flat_map(|head| (0..rows).map(move |token| place(head, token)));
    let elements = all.flat_map(|at| (at..at + dim).map(|i| Element::Of(y, i))).collect();
    Ok(Tensor::of_elements(shape, elements))
}

/// Moves the factors of queries and keys to that of the scores, which must be above 0.
fn unscaled(exprs: &mut Exprs, queries: Id, keys: Id, factor: f64) -> (Id, Id, f64) {
    let mut factor = factor;
    let [mut queries, keys] = [queries, keys].map(|id| match exprs.without_factor(id) {
        Some((x, k)) => {
            factor *= k;
            x
        }
        None => id,
    });
    if factor < 0.0 {
        queries = exprs.scaled(queries, -1.0, 0.0);
    }
    (queries, keys, factor.abs())
}

/// Returns the most neighbouring heads that have the same keys and values.
fn shared_heads(keys: &[Element], values: &[Element], heads: usize) -> usize {
    let is_shared = |each: &usize| {
        heads.is_multiple_of(*each)
            && [keys, values].iter().all(|of| {
                let len = of.len() / heads;
                (0..heads).all(|head| of[head * len..][..len] == of[head / each * each * len..][..len])
            })
    };
    (1..=heads).rev().find(is_shared).unwrap_or(1)
}

/// Converts ONNX's Attention operator.
fn operator(call: &Call<'_>, exprs: &mut Exprs, budget: &mut usize) -> Result<Vec<Tensor>> {
    ensure!(call.float("softcap").unwrap_or(0.0) == 0.0, "limits its scores (softcap); only plain ones are supported");
    for name in ["left_window_size", "right_window_size"] {
        ensure!(call.int(name).unwrap_or(-1) == -1, "has a sliding window ({name}); its mask must be causal or full");
    }
    let queries = call.input(0)?;
    let is_flat = queries.shape.len() == 3;
    let heads = |i: usize, name: &str| split_heads(call.input(i)?, call.int(name), name);
    let (queries, mut keys) = (heads(0, "q_num_heads")?, heads(1, "kv_num_heads")?);
    let mut values = heads(2, "kv_num_heads")?;
    let mut past = 0;
    if let (Some(of_keys), Some(of_values)) = (call.optional(4), call.optional(5)) {
        past = of_keys.shape.get(2).copied().context("has past keys without an axis of tokens")?;
        (keys, values) = (joined(&[of_keys, &keys], 2)?, joined(&[of_values, &values], 2)?);
    }
    let (&[batch, of_queries, rows, dim], &[_, of_keys, cols, _]) = (&queries.shape[..], &keys.shape[..]) else {
        bail!("reads the shapes {:?} and {:?}, not [batch, head, token, element]", queries.shape, keys.shape)
    };
    ensure!(batch == 1, "has a batch of {batch}; export with a batch of 1");
    ensure!(
        of_keys > 0 && of_queries.is_multiple_of(of_keys),
        "has {of_keys} heads of keys for {of_queries} of queries, which it does not divide"
    );
    let repeated = |x: &Tensor| {
        let len = x.len() / of_keys;
        let places: Vec<usize> =
            (0..of_queries).flat_map(|head| (0..len).map(move |i| head * of_keys / of_queries * len + i)).collect();
        x.taken([&[1, of_queries], &x.shape[2..]].concat(), &places)
    };
    let factor = call.float("scale").unwrap_or(1.0 / (dim as f64).sqrt());
    let turned = transposed(&repeated(&keys)?, &[0, 1, 3, 2])?;
    let mut scores = products::product(exprs, &queries, &turned, factor, budget)?;
    if let Some(mask) = mask(call, [rows, cols], past)? {
        scores = two("Add", exprs, &scores, &mask, *budget)?;
    }
    let weights = softmax(exprs, &scores, 3)?;
    let mut output = products::product(exprs, &weights, &repeated(&values)?, 1.0, budget)?;
    if is_flat {
        output = transposed(&output, &[0, 2, 1, 3])?.reshaped(vec![1, rows, output.len() / rows])?;
    }
    Ok(vec![output, keys, values])
}

/// Returns `[batch, head, token, element]` of that or of `[batch, token, head x element]`.
fn split_heads(x: &Tensor, heads: Option<i64>, name: &str) -> Result<Tensor> {
    let &[batch, tokens, width] = &x.shape[..] else { return Ok(x.clone()) };
    let heads = heads.and_then(|n| usize::try_from(n).ok()).with_context(|| format!("has no {name}"))?;
    ensure!(
        heads > 0 && width.is_multiple_of(heads),
        "has {name} = {heads} heads, which do not divide the width {width}"
    );
    transposed(&x.reshaped(vec![batch, tokens, heads, width / heads])?, &[0, 2, 1, 3])
}

/// Returns what is added to the scores `[query, key]`, if anything.
fn mask(call: &Call<'_>, [rows, cols]: [usize; 2], past: usize) -> Result<Option<Tensor>> {
    let bias = |seen: bool| if seen { 0.0 } else { f64::NEG_INFINITY };
    let mut all = vec![Element::Known(0.0); rows * cols];
    let mut shape = vec![rows, cols];
    if let Some(given) = call.optional(3) {
        ensure!(
            given.shape.last() == Some(&cols),
            "has a mask of {:?} for {cols} keys; export one of all keys",
            given.shape
        );
        all = match given.integers() {
            Some(truths) => truths.iter().map(|seen| Element::Known(bias(*seen != 0))).collect(),
            None => given.elements(),
        };
        shape.clone_from(&given.shape);
    }
    let mut mask = expanded(&Tensor::of_elements(shape.clone(), all), &broadcast(&shape, &[rows, cols])?, usize::MAX)?;
    let mut lost = vec![false; rows * cols];
    if call.int("is_causal").unwrap_or(0) != 0 {
        lost = (0..rows * cols).map(|i| i % cols > i / cols + past).collect();
    }
    if call.optional(6).is_some() {
        let tokens = call.integers(6, "nonpad_kv_seqlen, the number of tokens,")?;
        let tokens = tokens.first().copied().unwrap_or(0);
        lost.iter_mut().enumerate().for_each(|(i, lost)| *lost |= (i % cols) as i64 >= tokens);
    }
    let elements = mask.elements().into_iter().enumerate();
    let elements = elements.map(|(i, e)| if lost[i % lost.len()] { Element::Known(bias(false)) } else { e }).collect();
    mask = Tensor::of_elements(mask.shape.clone(), elements);
    let is_nothing = mask.reals().is_some_and(|values| values.iter().all(|v| *v == 0.0));
    Ok((!is_nothing).then_some(mask))
}
