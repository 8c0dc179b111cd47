//! ONNX's types of elements, by their numbers in onnx.proto.

use actq::error::{Result, bail, ensure};
use half::{bf16, f16};
use prost::bytes::Bytes;

use crate::file::proto;
use crate::values::tensor::Data;

const NAMES: [&str; 29] = [
    "undefined",
    "float32",
    "uint8",
    "int8",
    "uint16",
    "int16",
    "int32",
    "int64",
    "string",
    "bool",
    "float16",
    "float64",
    "uint32",
    "uint64",
    "complex64",
    "complex128",
    "bfloat16",
    "FLOAT8E4M3FN",
    "FLOAT8E4M3FNUZ",
    "FLOAT8E5M2",
    "FLOAT8E5M2FNUZ",
    "UINT4",
    "INT4",
    "FLOAT4E2M1",
    "FLOAT8E8M0",
    "UINT2",
    "INT2",
    "FLOAT6E2M3",
    "FLOAT6E3M2",
];

/// Returns the name of a type of elements.
pub(crate) fn name(kind: i32) -> String {
    let name = usize::try_from(kind).ok().and_then(|kind| NAMES.get(kind));
    name.map_or_else(|| format!("with ONNX's number {kind}"), |name| (*name).to_owned())
}

/// Returns the bits of an element; `None` for a type that [`elements`] does not read.
pub(crate) fn bits(kind: i32) -> Option<usize> {
    Some(match kind {
        7 | 11 => 64,
        1 | 6 | 12 => 32,
        4 | 5 | 10 | 16 => 16,
        2 | 3 | 9 | 17 | 19 => 8,
        21..=23 => 4,
        25 | 26 => 2,
        _ => return None,
    })
}

/// Decodes the `n` elements of a tensor, from its bytes `raw` or else from its typed fields.
pub(crate) fn elements(tensor: &proto::Tensor, kind: i32, raw: Option<Bytes>, n: usize) -> Result<Data> {
    let real = |v: &f32| f64::from(*v);
    Ok(match (kind, &raw) {
        (1, Some(raw)) => Data::Real(cut(raw, |b| f64::from(f32::from_le_bytes(b)))?),
        (1, None) => Data::Real(tensor.float_data.iter().map(real).collect()),
        (11, Some(raw)) => Data::Real(cut(raw, f64::from_le_bytes)?),
        (11, None) => Data::Real(tensor.double_data.clone()),
        (10, Some(raw)) => Data::Real(cut(raw, |b| f16::from_le_bytes(b).to_f64())?),
        (10, None) => Data::Real(tensor.int32_data.iter().map(|&b| f16::from_bits(b as u16).to_f64()).collect()),
        (16, Some(raw)) => Data::Real(cut(raw, |b| bf16::from_le_bytes(b).to_f64())?),
        (16, None) => Data::Real(tensor.int32_data.iter().map(|&b| bf16::from_bits(b as u16).to_f64()).collect()),
        (7, Some(raw)) => Data::Int(cut(raw, i64::from_le_bytes)?),
        (7, None) => Data::Int(tensor.int64_data.clone()),
        (6, Some(raw)) => Data::Int(cut(raw, |b| i32::from_le_bytes(b).into())?),
        (4, Some(raw)) => Data::Int(cut(raw, |b| u16::from_le_bytes(b).into())?),
        (5, Some(raw)) => Data::Int(cut(raw, |b| i16::from_le_bytes(b).into())?),
        (12, Some(raw)) => Data::Int(cut(raw, |b| u32::from_le_bytes(b).into())?),
        (3, Some(raw)) => Data::Int(cut(raw, |b| i8::from_le_bytes(b).into())?),
        (2 | 9, Some(raw)) => Data::Int(cut(raw, |b| u8::from_le_bytes(b).into())?),
        (2..=6 | 9, None) => Data::Int(tensor.int32_data.iter().map(|&v| v.into()).collect()),
        (12, None) => Data::Int(tensor.uint64_data.iter().map(|&v| v as i64).collect()),
        (17 | 19 | 21..=23 | 25 | 26, raw) => {
            // The typed field has one byte in each of its numbers.
            let typed = || tensor.int32_data.iter().map(|&byte| byte as u8).collect();
            let bytes: Vec<u8> = raw.as_ref().map_or_else(typed, |raw| raw.to_vec());
            let bits = bits(kind).unwrap_or(8);
            let codes = unpacked(&bytes, bits, n)?;
            match kind {
                17 => Data::Real(codes.iter().map(|&code| e4m3(code)).collect()),
                // The upper half of a float16.
                19 => Data::Real(codes.iter().map(|&code| f16::from_bits(u16::from(code) << 8).to_f64()).collect()),
                23 => Data::Real(codes.iter().map(|&code| e2m1(code)).collect()),
                21 | 25 => Data::Int(codes.into_iter().map(i64::from).collect()),
                _ => Data::Int(
                    codes.into_iter().map(|code| i64::from((code << (8 - bits)) as i8 >> (8 - bits))).collect(),
                ),
            }
        }
        _ => bail!("the type {} has no elements here; internal error; please report it", name(kind)),
    })
}

fn cut<const N: usize, T>(raw: &Bytes, one: impl Fn([u8; N]) -> T) -> Result<Vec<T>> {
    let (whole, rest) = raw.as_chunks::<N>();
    ensure!(rest.is_empty(), "{} bytes are not a whole number of elements of {N} bytes", raw.len());
    Ok(whole.iter().map(|bytes| one(*bytes)).collect())
}

/// Splits bytes into `n` codes of 2, 4 or 8 bits, the first in the lowest bits.
fn unpacked(bytes: &[u8], bits: usize, n: usize) -> Result<Vec<u8>> {
    let needed = (n * bits).div_ceil(8);
    ensure!(bytes.len() == needed, "{n} elements of {bits} bits need {needed} bytes, and {} are present", bytes.len());
    let code = |byte: &u8, i: usize| byte >> (bits * i) & (0xff >> (8 - bits));
    let codes = bytes.iter().flat_map(|byte| (0..8 / bits).map(move |i| code(byte, i)));
    Ok(codes.take(n).collect())
}

/// Returns the value of FLOAT8E4M3FN: a sign, 4 bits of exponent with the bias 7, 3 of mantissa, no infinity.
fn e4m3(code: u8) -> f64 {
    let (exponent, mantissa) = (i32::from(code >> 3 & 15), f64::from(code & 7));
    let size = match (exponent, code & 7) {
        (15, 7) => f64::NAN,
        (0, _) => libm::ldexp(mantissa, -9),
        _ => libm::ldexp(8.0 + mantissa, exponent - 10),
    };
    if code & 0x80 == 0 { size } else { -size }
}

/// Returns the value of FLOAT4E2M1.
fn e2m1(code: u8) -> f64 {
    let size = [0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0][usize::from(code & 7)];
    if code & 8 == 0 { size } else { -size }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packed_codes_begin_in_the_lowest_bits() {
        assert_eq!(unpacked(&[0x21, 0x43], 4, 3).expect("codes"), [1, 2, 3]);
        assert_eq!(unpacked(&[0b11_10_01_00, 1], 2, 5).expect("codes"), [0, 1, 2, 3, 1]);
        let short = unpacked(&[0x21], 4, 3).expect_err("a byte is missing").to_string();
        assert_eq!(short, "3 elements of 4 bits need 2 bytes, and 1 are present");
    }

    #[test]
    fn small_floats_have_their_values() {
        // Values of ml_dtypes 0.6.0: the least, an odd one, 1, the largest, one negative.
        let e4m3: Vec<f64> = [0x01, 0x2b, 0x38, 0x7e, 0xc1].map(e4m3).into();
        assert_eq!(e4m3, [0.001_953_125, 0.343_75, 1.0, 448.0, -2.25]);
        assert!(super::e4m3(0xff).is_nan());
        assert_eq!([0, 1, 7, 13].map(e2m1), [0.0, 0.5, 6.0, -3.0]);
    }
}
