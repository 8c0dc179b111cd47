//! Computations of constants in a file, against the same file with their results.

use actq::measure::actions::actions;
use actq_onnx::{Choice, proto};
use anyhow::Result;

use super::file::tensor;
use super::styles::{OBS, begun};
use super::{compare, drawn, imported, refused};

/// A tensor of these integers, of ONNX's type `kind`.
fn integers(name: &str, kind: i32, dims: &[usize], values: &[i64]) -> proto::Tensor {
    let int32_data = values.iter().map(|&v| v as i32).collect();
    let (int32_data, int64_data) = if kind == 7 { (vec![], values.to_vec()) } else { (int32_data, vec![]) };
    proto::Tensor { raw_data: None, data_type: Some(kind), int32_data, int64_data, ..tensor(name, dims, &[]) }
}

/// Requires that a constant, in a file with these initializers, equals this one.
fn is(expected: &str, constant: &str, initializers: &[proto::Tensor]) -> Result<()> {
    let network = |constant: &str| {
        let mut file = begun();
        initializers.iter().for_each(|tensor| file.initializer(tensor));
        file.write(&[], &format!("actions := gemm(obs, 3, 11) + {constant}"));
        file.output("actions", &[1, 3]);
        imported(&file.bytes(), &Choice::default())
    };
    let ((_, ours), (_, plain)) = (network(constant)?, network(expected)?);
    let observations = drawn(&ours);
    compare(&actions(&plain, &observations), &actions(&ours, &observations))
}

#[test]
fn places_of_a_mask_are_known() -> Result<()> {
    // x[:, mask], and the places of a matrix.
    is("[2.0, 4.0, 5.0]", "GatherND([1.0, 2.0, 3.0, 4.0, 5.0], Transpose(NonZero([0, 7, 0, -1, 2])))", &[])?;
    let matrix = "Reshape([0, 3, 0, 0, 5, 6], [2, 3])";
    is(
        "[1.0, 4.0, 5.0]",
        &format!("GatherND(Reshape([0.0, 1.0, 2.0, 3.0, 4.0, 5.0], [2, 3]), Transpose(NonZero({matrix})))"),
        &[],
    )
}

#[test]
fn casts_to_fewer_digits_round() -> Result<()> {
    // float16 has 11 digits, bfloat16 8.
    is("[0.30004883, 1000.5, -7.0]", "Cast(Cast([0.3, 1000.4, -7.0], to=10), to=1)", &[])?;
    is("[0.30078125, 1000.0, -7.0]", "Cast(Cast([0.3, 1000.4, -7.0], to=16), to=1)", &[])
}

#[test]
fn remainders_have_the_sign_of_onnx() -> Result<()> {
    is("[2.0, -2.0, 0.0]", "Cast(Mod([-7, 7, 6], [3, -3, 3], fmod=0), to=1)", &[])?;
    is("[-1.0, 1.0, 0.0]", "Cast(Mod([-7, 7, 6], [3, -3, 3], fmod=1), to=1)", &[])?;
    is("[-1.5, 1.5, 0.5]", "Mod([-3.5, 3.5, 2.5], [2.0, -2.0, 2.0], fmod=1)", &[])
}

#[test]
fn quantized_weights_are_read_as_their_values() -> Result<()> {
    let zero = |number| integers("zero", 3, &[], &[number]);
    let codes = [integers("q", 3, &[3], &[4, 1, 6]), zero(2)];
    is("[0.5, -0.25, 1.0]", "DequantizeLinear(q, 0.25, zero)", &codes)?;
    // A scale for each index of an axis, without zero points.
    let codes = [integers("q", 3, &[1, 3], &[1, 2, -4])];
    is("[0.5, 3.0, -1.0]", "DequantizeLinear(q, [0.5, 1.5, 0.25], axis=1)", &codes)?;
    // Values quantized at run time are not weights.
    let mut file = begun();
    file.initializer(&zero(0));
    file.write(&[], "scale = 0.1\nactions := DequantizeLinear(QuantizeLinear(obs, scale, zero), scale, zero)");
    file.output("actions", &[1, OBS as i64]);
    refused(&file.bytes(), "(QuantizeLinear): the file is already quantized");
    Ok(())
}
