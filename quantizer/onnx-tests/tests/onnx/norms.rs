//! Norms in every context, against tract: no factor, order or constant before or after them may hide one.

use anyhow::{Context as _, Result};

use super::file::{File, Value};
use super::rows::{NORMS, Norm};
use super::styles::{ACTIVATIONS, ended, ops};

/// Values of the observation, and of the norm's input.
const LEN: usize = 12;

/// Nodes after a norm: none, factors, factors and offsets.
const AFFINES: [&[&str]; 3] = [&[], &["Mul"], &["Mul", "Add"]];

/// Builds the values of a norm.
type Front = fn(&mut File) -> String;

fn begun() -> File {
    let mut file = File::default();
    file.input("obs", &[1, LEN as i64]);
    file
}

fn layer(file: &mut File) -> String {
    file.gemm("obs", LEN, LEN)
}

/// A layer and a function of it.
fn function(file: &mut File, op: &str, attributes: &[(&str, Value)]) -> String {
    let x = layer(file);
    file.node(op, &[&x], attributes)
}

fn halves(file: &mut File, x: &str) -> [&'static str; 2] {
    let lens = file.ints(&[6, 6]);
    file.nodes("Split", &[x, &lens], &["first", "second"], &[("axis", Value::Int(1))]);
    ["first", "second"]
}

/// A norm with its factors and offsets, and the resulting ops.
fn normed(file: &mut File, (name, written): (&str, Norm), x: &str, affine: &[&str]) -> (String, String) {
    let y = written(file, x, LEN);
    let y = affine.iter().fold(y, |y, op| {
        let w = file.drawn(&[LEN]);
        file.node(op, &[&y, &w], &[])
    });
    // An rmsnorm has no bias.
    let offset = if name == "rmsnorm" && affine.contains(&"Add") { " normalize" } else { "" };
    (y, format!("{name}{offset}"))
}

#[test]
fn activations_after_norms_are_one_op() -> Result<()> {
    for (i, norm) in NORMS.into_iter().enumerate() {
        for affine in AFFINES {
            for (k, (activation, written)) in ACTIVATIONS.into_iter().enumerate() {
                let mut file = begun();
                let x = layer(&mut file);
                let (x, norm) = normed(&mut file, norm, &x, affine);
                let x = written(&mut file, &x);
                let case = format!("norm {i} {affine:?} activation {k}");
                let found = ops(&ended(file, &x, LEN)).with_context(|| case.clone())?;
                assert_eq!(found, format!("linear {norm} {activation} linear"), "{case}");
            }
        }
    }
    Ok(())
}

/// The ops before the norm, and the nodes.
const FRONTS: [(&str, Front); 15] = [
    ("", |_| "obs".to_owned()),
    ("linear ", layer),
    ("linear tanh ", |file| function(file, "Tanh", &[])),
    ("linear relu normalize add ", |file| function(file, "LeakyRelu", &[("alpha", Value::Real(0.1))])),
    ("linear elu relu normalize add ", |file| function(file, "Selu", &[])),
    // Celu in its parts: tract's own loses the last factor.
    ("linear elu ", |file| {
        let (x, alpha) = (layer(file), file.reals(&[], &[0.7]));
        let x = file.node("Div", &[&x, &alpha], &[]);
        let x = file.node("Elu", &[&x], &[]);
        file.node("Mul", &[&x, &alpha], &[])
    }),
    ("normalize ", |file| {
        let factors = file.drawn(&[LEN]);
        file.node("Mul", &["obs", &factors], &[])
    }),
    ("normalize ", |file| {
        let [low, high] = [-0.5, 0.5].map(|v| file.reals(&[], &[v]));
        file.node("Clip", &["obs", &low, &high], &[])
    }),
    ("linear tanh ", |file| {
        let (x, three) = (function(file, "Tanh", &[]), file.reals(&[], &[3.0]));
        file.node("Mul", &[&x, &three], &[])
    }),
    ("linear tanh ", |file| {
        let x = function(file, "Tanh", &[]);
        file.node("Neg", &[&x], &[])
    }),
    ("linear relu normalize normalize add ", |file| {
        let (x, slopes) = (layer(file), file.drawn(&[LEN]));
        file.node("PRelu", &[&x, &slopes], &[])
    }),
    // Halves in the other order.
    ("linear tanh ", |file| {
        let x = function(file, "Tanh", &[]);
        let [first, second] = halves(file, &x);
        file.node("Concat", &[second, first], &[("axis", Value::Int(1))])
    }),
    ("linear tanh linear add ", |file| {
        let x = function(file, "Tanh", &[]);
        let y = file.gemm(&x, LEN, LEN);
        file.node("Add", &[&x, &y], &[])
    }),
    // Of three positions with four channels each, in sequence.
    ("linear linear linear tanh ", |file| {
        let (apart, w) = (file.ints(&[1, 3, 4]), file.drawn(&[4, 3, 2]));
        let x = file.node("Reshape", &["obs", &apart], &[]);
        let x = file.node("Conv", &[&x, &w], &[]);
        let x = file.node("Tanh", &[&x], &[]);
        file.node("Flatten", &[&x], &[])
    }),
    // A norm of another norm, with a factor.
    ("layernorm ", |file| {
        let (w, b, three) = (file.drawn(&[LEN]), file.drawn(&[LEN]), file.reals(&[], &[3.0]));
        let x = file.node("LayerNormalization", &["obs", &w, &b], &[("axis", Value::Int(-1))]);
        file.node("Mul", &[&x, &three], &[])
    }),
];

/// Returns the ops of a norm after a front, before a tanh and a layer.
fn found(front: Front, norm: (&str, Norm)) -> Result<String> {
    let mut file = begun();
    let x = front(&mut file);
    let (x, _) = normed(&mut file, norm, &x, &["Mul", "Add"]);
    let x = file.node("Tanh", &[&x], &[]);
    ops(&ended(file, &x, LEN))
}

#[test]
fn norms_after_any_values_are_one_op() -> Result<()> {
    for (k, (before, front)) in FRONTS.into_iter().enumerate() {
        for (i, norm) in NORMS.into_iter().enumerate() {
            let found = found(front, norm).with_context(|| format!("front {k} norm {i}"))?;
            let offset = if norm.0 == "rmsnorm" { " normalize" } else { "" };
            assert_eq!(found, format!("{before}{}{offset} tanh linear", norm.0), "front {k} norm {i}");
        }
    }
    Ok(())
}

#[test]
fn constants_in_vectors_hide_no_norm() -> Result<()> {
    fn masked(file: &mut File) -> String {
        let mask: Vec<f32> = (0..LEN).map(|i| f32::from(u8::from(i % 4 > 0))).collect();
        let mask = file.reals(&[LEN], &mask);
        file.node("Mul", &["obs", &mask], &[])
    }
    fn beside_constants(file: &mut File) -> String {
        let (x, constants) = (function(file, "Tanh", &[]), file.drawn(&[1, 6]));
        let [_, second] = halves(file, &x);
        file.node("Concat", &[&constants, second], &[("axis", Value::Int(1))])
    }
    for (i, norm) in NORMS.into_iter().enumerate() {
        // Zeros do not count in a mean of squares, but they do in a mean.
        let expected = if norm.0 == "rmsnorm" { "rmsnorm normalize" } else { "linear layernorm" };
        let ops = found(masked, norm).with_context(|| format!("masked, norm {i}"))?;
        assert_eq!(ops, format!("{expected} tanh linear"), "masked, norm {i}");
        let expected = if norm.0 == "rmsnorm" { "rmsnorm normalize" } else { "layernorm" };
        let ops = found(beside_constants, norm).with_context(|| format!("beside constants, norm {i}"))?;
        assert_eq!(ops, format!("linear tanh linear {expected} tanh linear"), "beside constants, norm {i}");
    }
    Ok(())
}
