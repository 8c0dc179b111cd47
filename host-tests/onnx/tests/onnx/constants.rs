//! Computations of constants in a file, against the same file with their results.

use actq::measure::actions::actions;
use actq_onnx::{ImportOptions, proto};
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
        imported(&file.bytes(), &ImportOptions::default())
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
    // Codes of 4 and 2 bits, the first in the lowest bits.
    for (kind, byte) in [(22, [0x14, 0xfa]), (21, [0x14, 0x0a])] {
        let values = if kind == 22 { "[2.0, 0.5, -3.0]" } else { "[2.0, 0.5, 5.0]" };
        let typed = integers("q", kind, &[3], &byte);
        let raw = proto::Tensor {
            raw_data: Some(byte.map(|byte| byte as u8).to_vec().into()),
            ..integers("q", kind, &[3], &[])
        };
        is(values, "DequantizeLinear(q, 0.5)", &[typed])?;
        is(values, "DequantizeLinear(q, 0.5)", &[raw])?;
    }
    for (kind, values) in [(26, "[-1.0, 0.5, -0.5]"), (25, "[1.0, 0.5, 1.5]")] {
        is(values, "DequantizeLinear(q, 0.5)", &[integers("q", kind, &[3], &[0b00_11_01_10])])?;
    }
    is("[2.0, -0.875, 0.5]", "DequantizeLinear(q, 2.0)", &[integers("q", 17, &[3], &[0x38, 0xae, 0x28])])?;
    // Values quantized at run time are not weights.
    let mut file = begun();
    file.initializer(&zero(0));
    file.write(&[], "scale = 0.1\nactions := DequantizeLinear(QuantizeLinear(obs, scale, zero), scale, zero)");
    file.output("actions", &[1, OBS as i64]);
    refused(&file.bytes(), "(QuantizeLinear): the file is already quantized");
    Ok(())
}

#[test]
fn weights_of_blocks_have_their_blocks_scale() -> Result<()> {
    // Blocks of 2 along either axis; the last one of a row is shorter.
    let rows = [integers("q", 3, &[1, 3], &[1, 2, 4]), integers("zero", 3, &[1, 2], &[1, -1])];
    is("[0.0, 0.5, 15.0]", "DequantizeLinear(q, Reshape([0.5, 3.0], [1, 2]), zero, axis=1, block_size=2)", &rows)?;
    // Column sums of 1 .. 12, the upper and the lower half scaled by 1, 10, 100 and by 2, 1, 3.
    let columns = [integers("q", 3, &[4, 3], &(1..=12).collect::<Vec<_>>())];
    is(
        "[39.0, 89.0, 963.0]",
        "ReduceSum(DequantizeLinear(q, Reshape([1.0, 10.0, 100.0, 2.0, 1.0, 3.0], [2, 3]), axis=0, block_size=2), [0], keepdims=0)",
        &columns,
    )
}

#[test]
fn other_quantized_weights_are_refused_by_name() {
    let network = |codes: &proto::Tensor, text: &str| {
        let mut file = begun();
        file.initializer(codes);
        file.write(&[], &format!("actions := gemm(obs, 3, 11) + {text}"));
        file.output("actions", &[1, 3]);
        file.bytes()
    };
    for (kind, name) in [(18, "FLOAT8E4M3FNUZ"), (24, "FLOAT8E8M0"), (28, "FLOAT6E3M2"), (99, "with ONNX's number 99")]
    {
        let bytes = network(&integers("q", kind, &[3], &[1, 2, 3]), "DequantizeLinear(q, 0.5)");
        refused(&bytes, &format!("tensor \"q\": the type {name} is not supported; export it as float32 or int64"));
    }
    let odd = network(&integers("q", 22, &[3], &[1, 2, 3]), "DequantizeLinear(q, 0.5)");
    refused(&odd, "tensor \"q\": 3 elements of 4 bits need 2 bytes, and 3 are present");
    let shape = network(
        &integers("q", 3, &[1, 3], &[1, 2, 3]),
        "DequantizeLinear(q, Reshape([1.0, 2.0, 3.0], [1, 3]), axis=1, block_size=2)",
    );
    refused(
        &shape,
        "has scales of the shape [1, 3] for weights of [1, 3] along axis 1 with block_size 2; the shape [1, 2] fits",
    );
}
