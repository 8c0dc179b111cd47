//! Arrays as stored in files.

use half::{bf16, f16};

/// An array as stored, row-major.
#[derive(Clone, Debug)]
pub struct Tensor {
    /// Length of each axis.
    pub shape: Vec<usize>,
    /// The elements.
    pub values: Values,
}

/// Elements by type.
#[derive(Clone, Debug)]
pub enum Values {
    /// float32
    F32(Vec<f32>),
    /// float64
    F64(Vec<f64>),
    /// float16
    F16(Vec<f16>),
    /// bfloat16
    BF16(Vec<bf16>),
    /// int32
    I32(Vec<i32>),
    /// int64
    I64(Vec<i64>),
    /// Any other type; policies and recordings never use it.
    Other(String),
}

impl Values {
    /// Returns the values as f32, values beyond its range as infinities; `None` if their type is not one of real
    /// numbers.
    pub fn to_f32(&self) -> Option<Vec<f32>> {
        Some(match self {
            Self::F32(values) => values.clone(),
            Self::F64(values) => values.iter().map(|&v| v as f32).collect(),
            Self::F16(values) => values.iter().map(|v| v.to_f32()).collect(),
            Self::BF16(values) => values.iter().map(|v| v.to_f32()).collect(),
            Self::I32(_) | Self::I64(_) | Self::Other(_) => return None,
        })
    }

    /// Returns the values as f64; `None` if their type is not one of numbers.
    pub fn to_f64(&self) -> Option<Vec<f64>> {
        Some(match self {
            Self::F64(values) => values.clone(),
            Self::I32(values) => values.iter().map(|&v| v.into()).collect(),
            Self::I64(values) => values.iter().map(|&v| v as f64).collect(),
            _ => self.to_f32()?.into_iter().map(f64::from).collect(),
        })
    }

    /// Describes value `i`, which is not a finite f32.
    pub fn not_f32(&self, i: usize) -> String {
        match self {
            Self::F64(values) if values[i].is_finite() => format!("holds {:e}, beyond float32's range,", values[i]),
            _ => self.to_f32().map_or(String::new(), |values| format!("holds {}", values[i])),
        }
    }

    /// Returns the type's name.
    pub fn type_name(&self) -> &str {
        match self {
            Self::F32(_) => "float32",
            Self::F64(_) => "float64",
            Self::F16(_) => "float16",
            Self::BF16(_) => "bfloat16",
            Self::I32(_) => "int32",
            Self::I64(_) => "int64",
            Self::Other(name) => name,
        }
    }
}
