//! Computations of constants in a file, against the same file with their results.

use actq::measure::actions::actions;
use actq_onnx::{Choice, proto};
use anyhow::Result;

use super::file::{File, Value, tensor};
use super::styles::{OBS, begun};
use super::{compare, drawn, imported};

/// A tensor of these integers, of ONNX's type `kind`.
fn integers(name: &str, kind: i32, dims: &[usize], values: &[i64]) -> proto::Tensor {
    let int32_data = values.iter().map(|&v| v as i32).collect();
    let (int32_data, int64_data) = if kind == 7 { (vec![], values.to_vec()) } else { (int32_data, vec![]) };
    proto::Tensor { raw_data: None, data_type: Some(kind), int32_data, int64_data, ..tensor(name, dims, &[]) }
}

/// Requires that the constant computed by `write` equals this one.
fn is(expected: [f32; 3], write: impl FnOnce(&mut File) -> String) -> Result<()> {
    let network = |constant: &mut dyn FnMut(&mut File) -> String| {
        let mut file = begun();
        let y = file.gemm("obs", 3, OBS);
        let c = constant(&mut file);
        file.nodes("Add", &[&y, &c], &["actions"], &[]);
        file.output("actions", &[1, 3]);
        imported(&file.bytes(), &Choice::default())
    };
    let mut write = Some(write);
    let (_, ours) = network(&mut |file| write.take().map(|write| write(file)).unwrap_or_default())?;
    let (_, plain) = network(&mut |file| file.reals(&[3], &expected))?;
    let observations = drawn(&ours);
    compare(&actions(&plain, &observations), &actions(&ours, &observations))
}

#[test]
fn casts_to_fewer_digits_round() -> Result<()> {
    // float16 has 11 digits, bfloat16 8.
    for (to, expected) in [(10, [0.300_048_83, 1000.5, -7.0]), (16, [0.300_781_25, 1000.0, -7.0])] {
        is(expected, |file| {
            let x = file.reals(&[3], &[0.3, 1000.4, -7.0]);
            let x = file.node("Cast", &[&x], &[("to", Value::Int(to))]);
            file.node("Cast", &[&x], &[("to", Value::Int(1))])
        })?;
    }
    Ok(())
}

#[test]
fn remainders_have_the_sign_of_onnx() -> Result<()> {
    let whole = |fmod: i64| {
        move |file: &mut File| {
            let (x, y) = (file.ints(&[-7, 7, 6]), file.ints(&[3, -3, 3]));
            let rest = file.node("Mod", &[&x, &y], &[("fmod", Value::Int(fmod))]);
            file.node("Cast", &[&rest], &[("to", Value::Int(1))])
        }
    };
    is([2.0, -2.0, 0.0], whole(0))?;
    is([-1.0, 1.0, 0.0], whole(1))?;
    is([-1.5, 1.5, 0.5], |file| {
        let (x, y) = (file.reals(&[3], &[-3.5, 3.5, 2.5]), file.reals(&[3], &[2.0, -2.0, 2.0]));
        file.node("Mod", &[&x, &y], &[("fmod", Value::Int(1))])
    })
}

#[test]
fn quantized_weights_are_read_as_their_values() -> Result<()> {
    is([0.5, -0.25, 1.0], |file| {
        file.initializer(&integers("q", 3, &[3], &[4, 1, 6]));
        file.initializer(&integers("zero", 3, &[], &[2]));
        let scale = file.reals(&[], &[0.25]);
        file.node("DequantizeLinear", &["q", &scale, "zero"], &[])
    })?;
    // A scale for each index of an axis, without zero points.
    is([0.5, 3.0, -1.0], |file| {
        file.initializer(&integers("q", 3, &[1, 3], &[1, 2, -4]));
        let scales = file.reals(&[3], &[0.5, 1.5, 0.25]);
        file.node("DequantizeLinear", &["q", &scales], &[("axis", Value::Int(1))])
    })?;
    // Values quantized at run time are not weights.
    let mut file = begun();
    let (scale, zero) = (file.reals(&[], &[0.1]), integers("zero", 3, &[], &[0]));
    file.initializer(&zero);
    let x = file.node("QuantizeLinear", &["obs", &scale, "zero"], &[]);
    file.nodes("DequantizeLinear", &[&x, &scale, "zero"], &["actions"], &[]);
    file.output("actions", &[1, OBS as i64]);
    let error = imported(&file.bytes(), &Choice::default()).expect_err("quantized");
    assert!(format!("{error:#}").contains("(QuantizeLinear): the file is already quantized"), "{error:#}");
    Ok(())
}
