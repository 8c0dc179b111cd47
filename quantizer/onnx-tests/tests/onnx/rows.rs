//! Norms and sums of one row and of several, as in histories and groups, against tract.

use anyhow::{Context as _, Result};

use super::file::{File, Value};
use super::same;
use super::styles::{OBS, begun, ended, ops};

/// A norm of the last axis of a value, which has this many elements.
pub(super) type Norm = fn(&mut File, &str, usize) -> String;

fn mean(file: &mut File, x: &str) -> String {
    file.node("ReduceMean", &[x], &[("axes", Value::Ints(vec![-1])), ("keepdims", Value::Int(1))])
}

fn root(file: &mut File, square: &str) -> String {
    let eps = file.reals(&[], &[1e-5]);
    let sum = file.node("Add", &[square, &eps], &[]);
    file.node("Sqrt", &[&sum], &[])
}

/// The op of each, and the nodes that exporters make of it.
pub(super) const NORMS: [(&str, Norm); 6] = [
    ("layernorm", |file, x, n| {
        // The first weight is 0, as after pruning.
        let weight: Vec<f32> = (0..n).map(|i| 0.1 * i as f32).collect();
        let (w, b) = (file.reals(&[n], &weight), file.drawn(&[n]));
        file.node("LayerNormalization", &[x, &w, &b], &[("axis", Value::Int(-1))])
    }),
    // Keras subtracts the mean after the product.
    ("layernorm", |file, x, n| {
        let m = mean(file, x);
        let d = file.node("Sub", &[x, &m], &[]);
        let s = file.node("Mul", &[&d, &d], &[]);
        let s = mean(file, &s);
        let r = root(file, &s);
        let r = file.node("Reciprocal", &[&r], &[]);
        let (w, b) = (file.drawn(&[n]), file.drawn(&[n]));
        let r = file.node("Mul", &[&r, &w], &[]);
        let (x, m) = (file.node("Mul", &[x, &r], &[]), file.node("Mul", &[&m, &r], &[]));
        let m = file.node("Sub", &[&b, &m], &[]);
        file.node("Add", &[&x, &m], &[])
    }),
    ("layernorm", |file, x, n| {
        let (m, two) = (mean(file, x), file.reals(&[], &[2.0]));
        let d = file.node("Sub", &[x, &m], &[]);
        let s = file.node("Pow", &[&d, &two], &[]);
        let s = mean(file, &s);
        let s = root(file, &s);
        let y = file.node("Div", &[&d, &s], &[]);
        let (w, b) = (file.drawn(&[n]), file.drawn(&[n]));
        let y = file.node("Mul", &[&y, &w], &[]);
        file.node("Add", &[&y, &b], &[])
    }),
    // flax: the variance as mean square less squared mean.
    ("layernorm", |file, x, _| {
        let m = mean(file, x);
        let s = file.node("Mul", &[x, x], &[]);
        let s = mean(file, &s);
        let mm = file.node("Mul", &[&m, &m], &[]);
        let v = file.node("Sub", &[&s, &mm], &[]);
        let r = root(file, &v);
        let r = file.node("Reciprocal", &[&r], &[]);
        let d = file.node("Sub", &[x, &m], &[]);
        file.node("Mul", &[&d, &r], &[])
    }),
    ("rmsnorm", |file, x, _| {
        let s = file.node("Mul", &[x, x], &[]);
        let s = mean(file, &s);
        let r = root(file, &s);
        file.node("Div", &[x, &r], &[])
    }),
    ("rmsnorm", |file, x, _| {
        let least = file.reals(&[], &[1e-12]);
        let axes = ("axes", Value::Ints(vec![-1]));
        let r = file.node("ReduceL2", &[x], &[axes, ("keepdims", Value::Int(1))]);
        let r = file.node("Clip", &[&r, &least], &[]);
        file.node("Div", &[x, &r], &[])
    }),
];

#[test]
fn norms_from_sums_and_roots_are_found() -> Result<()> {
    for (i, (name, written)) in NORMS.into_iter().enumerate() {
        let mut file = begun();
        let x = file.gemm("obs", 16, OBS);
        let x = written(&mut file, &x, 16);
        let found = ops(&ended(file, &x, 16)).with_context(|| format!("{i} {name}"))?;
        assert_eq!(found, format!("linear {name} linear"));
    }
    Ok(())
}

#[test]
fn norms_of_rows_are_found_by_row() -> Result<()> {
    for (i, (name, written)) in NORMS.into_iter().enumerate() {
        // Of groups of a layer's values.
        let mut file = begun();
        let x = file.gemm("obs", 12, OBS);
        let (rows, joined) = (file.ints(&[1, 3, 4]), file.ints(&[1, 12]));
        let x = file.node("Reshape", &[&x, &rows], &[]);
        let x = written(&mut file, &x, 4);
        let x = file.node("Reshape", &[&x, &joined], &[]);
        let found = ops(&ended(file, &x, 12)).with_context(|| format!("{i} {name} of groups"))?;
        assert_eq!(found, format!("linear {name} {name} {name} linear"), "{i}");
        // Of the steps of a history.
        let mut file = File::default();
        file.input("history", &[1, 3, 4]);
        let x = written(&mut file, "history", 4);
        let joined = file.ints(&[1, 12]);
        let x = file.node("Reshape", &[&x, &joined], &[]);
        let found = ops(&ended(file, &x, 12)).with_context(|| format!("{i} {name} of steps"))?;
        assert_eq!(found, format!("{name} {name} {name} linear"), "{i}");
    }
    Ok(())
}

#[test]
fn norms_after_factors_are_found() -> Result<()> {
    // Each after a factor for each value, as in SimbaV2's L2 norms.
    for (i, (name, written)) in NORMS.into_iter().enumerate() {
        let mut file = begun();
        let factors = file.drawn(&[OBS]);
        let x = file.node("Mul", &["obs", &factors], &[]);
        let x = written(&mut file, &x, OBS);
        let found = ops(&ended(file, &x, OBS)).with_context(|| format!("{i} {name}"))?;
        assert_eq!(found, format!("normalize {name} linear"), "{i}");
    }
    Ok(())
}

#[test]
fn shared_norms_are_computed_once() -> Result<()> {
    for (op, expected) in [("LeakyRelu", "relu normalize add"), ("Abs", "relu normalize relu add")] {
        let mut file = begun();
        let x = file.gemm("obs", 16, OBS);
        let (w, b) = (file.drawn(&[16]), file.drawn(&[16]));
        let x = file.node("LayerNormalization", &[&x, &w, &b], &[("axis", Value::Int(-1))]);
        let x = file.node(op, &[&x], &[]);
        assert_eq!(ops(&ended(file, &x, 16))?, format!("linear layernorm {expected} linear"), "{op}");
    }
    Ok(())
}

#[test]
fn means_over_time_become_sums_of_slices() -> Result<()> {
    let mut file = File::default();
    file.input("history", &[1, 3, 8]);
    let x = file.node("ReduceMean", &["history"], &[("axes", Value::Ints(vec![1])), ("keepdims", Value::Int(0))]);
    let x = file.node("Tanh", &[&x], &[]);
    assert_eq!(ops(&ended(file, &x, 8))?, "identity add identity add normalize tanh linear");
    // Fewer rows than elements per row remain products with ones.
    let mut file = File::default();
    file.input("history", &[1, 8, 3]);
    let x = file.node("ReduceMean", &["history"], &[("axes", Value::Ints(vec![1])), ("keepdims", Value::Int(0))]);
    let x = file.node("Tanh", &[&x], &[]);
    let found = ops(&ended(file, &x, 3))?;
    assert_eq!(found.matches("linear").count(), 4, "{found}");
    // The second of two means keeps its place among other values.
    let mut file = File::default();
    file.input("history", &[1, 3, 8]);
    let means = [-1, 1].map(|axis| {
        let axes = [("axes", Value::Ints(vec![axis])), ("keepdims", Value::Int(0))];
        file.node("ReduceMean", &["history"], &axes)
    });
    let x = file.node("Concat", &[&means[0], &means[1]], &[("axis", Value::Int(1))]);
    same(&ended(file, &x, 11))?;
    Ok(())
}
