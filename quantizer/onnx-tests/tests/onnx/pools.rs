//! Pools over few positions, against tract.

use anyhow::{Context as _, Result};

use actq_onnx::Choice;

use super::file::Value;
use super::styles::{OBS, begun, ended, ops};
use super::{imported, same};

/// A pool after a layer whose values have this shape, then an activation and a layer.
fn pooled(op: &str, shape: &[i64], attributes: &[(&str, Value)], behind: usize) -> Vec<u8> {
    let mut file = begun();
    let x = file.gemm("obs", shape.iter().product::<i64>() as usize, OBS);
    let shape = file.ints(shape);
    let x = file.node("Reshape", &[&x, &shape], &[]);
    let x = file.node(op, &[&x], attributes);
    let x = file.node("Flatten", &[&x], &[]);
    let x = file.node("Tanh", &[&x], &[]);
    ended(file, &x, behind)
}

#[test]
fn pools_become_sums_and_maxima_of_slices() -> Result<()> {
    let ints = |name, values: &[i64]| (name, Value::Ints(values.to_vec()));
    let counted = || ("count_include_pad", Value::Int(1));
    // Shape of the value, attributes, values after it.
    let cases = [
        (vec![1, 4, 6], vec![ints("kernel_shape", &[2]), ints("strides", &[2])], 12),
        (vec![1, 4, 6], vec![ints("kernel_shape", &[3]), ints("pads", &[1, 1])], 24),
        (vec![1, 4, 6], vec![ints("kernel_shape", &[3]), ints("pads", &[1, 1]), counted()], 24),
        (vec![1, 2, 4, 4], vec![ints("kernel_shape", &[2, 2]), ints("strides", &[2, 2])], 8),
    ];
    for op in ["AveragePool", "MaxPool"] {
        for (i, (shape, attributes, behind)) in cases.iter().enumerate() {
            if op == "AveragePool" || i != 2 {
                same(&pooled(op, shape, attributes, *behind)).with_context(|| format!("{op} {i}"))?;
            }
        }
    }
    Ok(())
}

#[test]
fn positions_with_only_padding_are_constants() -> Result<()> {
    let ints = |name, values: &[i64]| (name, Value::Ints(values.to_vec()));
    let conv = [ints("kernel_shape", &[1]), ints("strides", &[2]), ints("pads", &[1, 1])];
    // Without a bias, a position with only padding is 0: the maximum is a relu of the other.
    for (op, expected) in [("GlobalMaxPool", "linear tanh relu linear"), ("GlobalAveragePool", "linear tanh linear")] {
        let mut file = begun();
        let x = file.gemm("obs", 8, OBS);
        let (apart, w) = (file.ints(&[1, 4, 2]), file.drawn(&[5, 4, 1]));
        let x = file.node("Reshape", &[&x, &apart], &[]);
        let x = file.node("Conv", &[&x, &w], &conv);
        let x = file.node("Tanh", &[&x], &[]);
        let x = file.node(op, &[&x], &[]);
        let x = file.node("Flatten", &[&x], &[]);
        let found = ops(&ended(file, &x, 5)).with_context(|| op.to_owned())?;
        assert_eq!(found, format!("linear {expected}"), "{op}");
    }
    Ok(())
}

#[test]
fn pools_that_need_an_operation_are_refused() {
    let refused = |op: &str, shape: &[i64], attributes: &[(&str, Value)], expected: &str| {
        let error = imported(&pooled(op, shape, attributes, 8), &Choice::default()).expect_err(expected);
        let error = format!("{error:#}");
        assert!(error.contains(expected), "{error} instead of {expected}");
    };
    let kernel = |n: i64| ("kernel_shape", Value::Ints(vec![n]));
    refused("MaxPool", &[1, 1, 72], &[kernel(65)], "(MaxPool): has windows of 65 values; the limit is 64");
    let over = [kernel(4), ("strides", Value::Ints(vec![4])), ("ceil_mode", Value::Int(1))];
    refused("MaxPool", &[1, 8, 6], &over, "(MaxPool): has a last window that extends past the end");
    refused("AveragePool", &[1, 8, 6], &[], "(AveragePool): its kernel does not fit the shape [1, 8, 6]");
}
