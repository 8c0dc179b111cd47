//! Norms and sums of one row and of several, as in histories and groups, against tract.

use anyhow::{Context as _, Result};

use super::file::File;
use super::same;
use super::styles::{OBS, begun, between, ended, ops};

/// The op of each, and the nodes that exporters make of it: a norm of the last axis of `x`, with `weights` that rise
/// from 0, as after pruning, and `drawn(n)` for a value of `n` elements.
pub(super) const NORMS: [(&str, &str); 6] = [
    ("layernorm", "LayerNormalization(x, weights, drawn(n), axis=-1)"),
    // Keras subtracts the mean after the product.
    (
        "layernorm",
        "m = ReduceMean(x, axes=[-1], keepdims=1)
         d = x - m
         r = Reciprocal(Sqrt(ReduceMean(d * d, axes=[-1], keepdims=1) + 1e-5)) * drawn(n)
         x * r + (drawn(n) - m * r)",
    ),
    (
        "layernorm",
        "d = x - ReduceMean(x, axes=[-1], keepdims=1)
         d / Sqrt(ReduceMean(Pow(d, 2.0), axes=[-1], keepdims=1) + 1e-5) * drawn(n) + drawn(n)",
    ),
    // flax: the variance as mean square less squared mean.
    (
        "layernorm",
        "m = ReduceMean(x, axes=[-1], keepdims=1)
         r = Reciprocal(Sqrt(ReduceMean(x * x, axes=[-1], keepdims=1) - m * m + 1e-5))
         (x - m) * r",
    ),
    ("rmsnorm", "x / Sqrt(ReduceMean(x * x, axes=[-1], keepdims=1) + 1e-5)"),
    ("rmsnorm", "x / Clip(ReduceL2(x, axes=[-1], keepdims=1), 1e-12)"),
];

/// Writes one of [`NORMS`] of `x`, which has `len` elements in a row.
pub(super) fn norm(file: &mut File, written: &str, x: &str, len: usize) -> String {
    let weights: Vec<String> = (0..len).map(|i| format!("{:.1}", 0.1 * i as f32)).collect();
    let text = written.replace("drawn(n)", &format!("drawn({len})"));
    file.write(&[x], &text.replace("weights", &format!("[{}]", weights.join(", "))))
}

#[test]
fn norms_from_sums_and_roots_are_found() -> Result<()> {
    for (name, written) in NORMS {
        let mut file = begun();
        let x = file.gemm("obs", 16, OBS);
        let x = norm(&mut file, written, &x, 16);
        let found = ops(&ended(file, &x, 16)).with_context(|| written.to_owned())?;
        assert_eq!(found, format!("linear {name} linear"));
    }
    Ok(())
}

#[test]
fn norms_of_rows_are_found_by_row() -> Result<()> {
    for (name, written) in NORMS {
        // Of groups of a layer's values.
        let mut file = begun();
        let x = file.write(&[], "Reshape(gemm(obs, 12, 11), [1, 3, 4])");
        let x = norm(&mut file, written, &x, 4);
        let x = file.write(&[&x], "Reshape(x, [1, 12])");
        let found = ops(&ended(file, &x, 12)).with_context(|| format!("{written} of groups"))?;
        assert_eq!(found, format!("linear {name} {name} {name} linear"), "{written}");
        // Of the steps of a history.
        let mut file = File::default();
        file.input("history", &[1, 3, 4]);
        let x = norm(&mut file, written, "history", 4);
        let x = file.write(&[&x], "Reshape(x, [1, 12])");
        let found = ops(&ended(file, &x, 12)).with_context(|| format!("{written} of steps"))?;
        assert_eq!(found, format!("{name} {name} {name} linear"), "{written}");
    }
    Ok(())
}

#[test]
fn norms_after_factors_are_found() -> Result<()> {
    // Each after a factor for each value, as in SimbaV2's L2 norms.
    for (name, written) in NORMS {
        let mut file = begun();
        let x = file.write(&[], "obs * drawn(11)");
        let x = norm(&mut file, written, &x, OBS);
        let found = ops(&ended(file, &x, OBS)).with_context(|| written.to_owned())?;
        assert_eq!(found, format!("normalize {name} linear"), "{written}");
    }
    Ok(())
}

#[test]
fn shared_norms_are_computed_once() -> Result<()> {
    between(&[
        ("layernorm relu normalize add", "LeakyRelu(LayerNormalization(x, drawn(16), drawn(16), axis=-1))"),
        ("layernorm relu normalize relu add", "Abs(LayerNormalization(x, drawn(16), drawn(16), axis=-1))"),
    ])
}

#[test]
fn means_over_time_become_sums_of_slices() -> Result<()> {
    let history = |dims: &[i64], text: &str, len: usize| {
        let mut file = File::default();
        file.input("history", dims);
        let x = file.write(&[], text);
        ended(file, &x, len)
    };
    let mean = "Tanh(ReduceMean(history, axes=[1], keepdims=0))";
    assert_eq!(ops(&history(&[1, 3, 8], mean, 8))?, "identity add identity add normalize tanh linear");
    // Fewer rows than elements per row remain products with ones.
    let found = ops(&history(&[1, 8, 3], mean, 3))?;
    assert_eq!(found.matches("linear").count(), 4, "{found}");
    // The second of two means keeps its place among other values.
    let both = "Concat(ReduceMean(history, axes=[-1], keepdims=0), ReduceMean(history, axes=[1], keepdims=0), axis=1)";
    same(&history(&[1, 3, 8], both, 11))?;
    Ok(())
}
