//! Norms in every context, against tract: no factor, order or constant before or after them may hide one.

use anyhow::{Context as _, Result};

use super::file::File;
use super::rows::{NORMS, norm};
use super::styles::{ACTIVATIONS, ended, ops};

/// Values of the observation, and of the norm's input.
const LEN: usize = 12;

/// Nodes after a norm: none, factors, factors and offsets.
const AFFINES: [&str; 3] = ["x", "x * drawn(12)", "x * drawn(12) + drawn(12)"];

/// Returns the ops of a norm after `front`, and of the nodes of `texts` after it, before a layer.
fn found(front: &str, written: &str, texts: &[&str]) -> Result<String> {
    let mut file = File::default();
    file.input("obs", &[1, LEN as i64]);
    let x = file.write(&[], front);
    let x = norm(&mut file, written, &x, LEN);
    let x = texts.iter().fold(x, |x, text| file.write(&[&x], text));
    ops(&ended(file, &x, LEN)).with_context(|| format!("{front:?}, {written:?}, {texts:?}"))
}

/// The op of the offsets after a norm: an rmsnorm has no bias.
fn offset(name: &str, affine: &str) -> &'static str {
    if name == "rmsnorm" && affine == AFFINES[2] { " normalize" } else { "" }
}

#[test]
fn activations_after_norms_are_one_op() -> Result<()> {
    for (name, written) in NORMS {
        for affine in AFFINES {
            for (activation, text) in ACTIVATIONS {
                let found = found("gemm(obs, 12, 12)", written, &[affine, text])?;
                let offset = offset(name, affine);
                assert_eq!(found, format!("linear {name}{offset} {activation} linear"), "{written} {affine} {text}");
            }
        }
    }
    Ok(())
}

/// The ops before the norm, and the nodes.
const FRONTS: [(&str, &str); 15] = [
    ("", "obs"),
    ("linear ", "gemm(obs, 12, 12)"),
    ("linear tanh ", "Tanh(gemm(obs, 12, 12))"),
    ("linear relu normalize add ", "LeakyRelu(gemm(obs, 12, 12), alpha=0.1)"),
    ("linear elu relu normalize add ", "Selu(gemm(obs, 12, 12))"),
    // Celu in its parts: tract's own loses the last factor.
    ("linear elu ", "Elu(gemm(obs, 12, 12) / 0.7) * 0.7"),
    ("normalize ", "obs * drawn(12)"),
    ("normalize ", "Clip(obs, -0.5, 0.5)"),
    ("linear tanh ", "Tanh(gemm(obs, 12, 12)) * 3.0"),
    ("linear tanh ", "Neg(Tanh(gemm(obs, 12, 12)))"),
    ("linear relu normalize normalize add ", "PRelu(gemm(obs, 12, 12), drawn(12))"),
    // Halves in the other order.
    (
        "linear tanh ",
        "first, second := Split(Tanh(gemm(obs, 12, 12)), [6, 6], axis=1)
         Concat(second, first, axis=1)",
    ),
    (
        "linear tanh linear add ",
        "x = Tanh(gemm(obs, 12, 12))
         x + gemm(x, 12, 12)",
    ),
    // Of three positions with four channels each, in sequence.
    ("linear linear linear tanh ", "Flatten(Tanh(Conv(Reshape(obs, [1, 3, 4]), drawn(4, 3, 2))))"),
    // A norm of another norm, with a factor.
    ("layernorm ", "LayerNormalization(obs, drawn(12), drawn(12), axis=-1) * 3.0"),
];

#[test]
fn norms_after_any_values_are_one_op() -> Result<()> {
    for (before, front) in FRONTS {
        for (name, written) in NORMS {
            let found = found(front, written, &[AFFINES[2], "Tanh(x)"])?;
            let offset = offset(name, AFFINES[2]);
            assert_eq!(found, format!("{before}{name}{offset} tanh linear"), "{front} {written}");
        }
    }
    Ok(())
}

#[test]
fn constants_in_vectors_hide_no_norm() -> Result<()> {
    let masked = "obs * [0.0, 1.0, 1.0, 1.0, 0.0, 1.0, 1.0, 1.0, 0.0, 1.0, 1.0, 1.0]";
    let beside_constants = "first, second := Split(Tanh(gemm(obs, 12, 12)), [6, 6], axis=1)
                            Concat(drawn(1, 6), second, axis=1)";
    for (name, written) in NORMS {
        // Zeros do not count in a mean of squares, but they do in a mean.
        let is_rms = name == "rmsnorm";
        let expected = if is_rms { "rmsnorm normalize" } else { "linear layernorm" };
        let ops = found(masked, written, &[AFFINES[2], "Tanh(x)"])?;
        assert_eq!(ops, format!("{expected} tanh linear"), "masked, {written}");
        let expected = if is_rms { "rmsnorm normalize" } else { "layernorm" };
        let ops = found(beside_constants, written, &[AFFINES[2], "Tanh(x)"])?;
        assert_eq!(ops, format!("linear tanh linear {expected} tanh linear"), "beside constants, {written}");
    }
    Ok(())
}
