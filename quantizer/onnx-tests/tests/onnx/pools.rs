//! Pools over few positions, against tract.

use anyhow::{Context as _, Result};

use super::styles::{found, network};
use super::{refused, same};

/// A pool after a layer of `count` values, which have this shape, then an activation and a layer of `len` values.
fn pooled(pool: &str, (count, shape): (usize, &str), len: usize) -> Vec<u8> {
    let pool = pool.replacen("(x", &format!("(Reshape(gemm(obs, {count}, 11), {shape})"), 1);
    network(&format!("Tanh(Flatten({pool}))"), len)
}

#[test]
fn pools_become_sums_and_maxima_of_slices() -> Result<()> {
    for (shape, attributes, len) in [
        ((24, "[1, 4, 6]"), "kernel_shape=[2], strides=[2]", 12),
        ((24, "[1, 4, 6]"), "kernel_shape=[3], pads=[1, 1]", 24),
        ((24, "[1, 4, 6]"), "kernel_shape=[3], pads=[1, 1], count_include_pad=1", 24),
        ((32, "[1, 2, 4, 4]"), "kernel_shape=[2, 2], strides=[2, 2]", 8),
    ] {
        for op in ["AveragePool", "MaxPool"] {
            if op == "AveragePool" || !attributes.contains("count_include_pad") {
                let pool = format!("{op}(x, {attributes})");
                same(&pooled(&pool, shape, len)).with_context(|| pool.clone())?;
            }
        }
    }
    Ok(())
}

#[test]
fn positions_with_only_padding_are_constants() -> Result<()> {
    let conv = "Conv(Reshape(gemm(obs, 8, 11), [1, 4, 2]), drawn(5, 4, 1), kernel_shape=[1], strides=[2], pads=[1, 1])";
    // Without a bias, a position with only padding is 0: the maximum is a relu of the other.
    for (op, expected) in [("GlobalMaxPool", "linear tanh relu linear"), ("GlobalAveragePool", "linear tanh linear")] {
        let found = found(&format!("Flatten({op}(Tanh({conv})))"), 5)?;
        assert_eq!(found, format!("linear {expected}"), "{op}");
    }
    Ok(())
}

#[test]
fn pools_that_need_an_operation_are_refused() {
    for (pool, shape, expected) in [
        ("MaxPool(x, kernel_shape=[65])", (72, "[1, 1, 72]"), "(MaxPool): has windows of 65 values; the limit is 64"),
        (
            "MaxPool(x, kernel_shape=[4], strides=[4], ceil_mode=1)",
            (48, "[1, 8, 6]"),
            "(MaxPool): has a last window that extends past the end",
        ),
        ("AveragePool(x)", (48, "[1, 8, 6]"), "(AveragePool): its kernel does not fit the shape [1, 8, 6]"),
    ] {
        refused(&pooled(pool, shape, 8), expected);
    }
}
