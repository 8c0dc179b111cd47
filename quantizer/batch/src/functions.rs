//! The elementwise functions, compiled for a level of vector instructions: those of [`actq_kernels::math`], element by
//! element.

use actq_kernels::math::{self, Function};
use fearless_simd::Simd;

/// Applies a function to every element, as [`Function::apply`] does.
#[inline(always)]
pub(crate) fn apply<S: Simd>(_: S, function: Function, x: &mut [f32]) {
    match function {
        Function::Relu => each(x, math::relu),
        Function::Elu => each(x, math::elu),
        Function::Silu => each(x, math::silu),
        Function::Gelu => each(x, math::gelu),
        Function::GeluTanh => each(x, math::gelu_tanh),
        Function::Tanh => each(x, math::tanh),
        Function::Sigmoid => each(x, math::sigmoid),
        Function::Exp => each(x, math::exp),
        Function::Sin => each(x, math::sin),
        Function::Cos => each(x, math::cos),
        Function::Softplus => each(x, math::softplus),
        Function::Mish => each(x, math::mish),
    }
}

#[inline(always)]
fn each(x: &mut [f32], function: impl Fn(f32) -> f32) {
    for x in x {
        *x = function(*x);
    }
}
