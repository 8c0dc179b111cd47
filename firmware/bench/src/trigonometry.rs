//! The functions of a current loop, from each crate that has them. `src/bin/trigonometry.rs` counts them on the target,
//! and `host-tests/tests/all/on_target/foc.rs` compares them with the host's results.

use actq_controller::foc::functions;
use actq_kernels::math;
use micromath::F32;

/// Number of inputs of a function.
pub const LEN: usize = 256;

/// A function of up to two numbers.
#[derive(Debug)]
pub struct Case {
    /// Name of the function and its source.
    pub name: &'static str,
    /// Function to measure.
    pub function: fn(f32, f32) -> [f32; 2],
    /// Source of the inputs: [`angles`], [`vectors`] or [`squares`].
    pub inputs: fn() -> [[f32; 2]; LEN],
}

/// All cases. The first one measures the cost of a call.
pub const CASES: [Case; 13] = [
    Case { name: "nothing", function: |x, y| [x, y], inputs: vectors },
    Case { name: "sine and cosine: libm", function: |x, _| libm::sincosf(x).into(), inputs: angles },
    Case { name: "sine and cosine: kernels", function: |x, _| [math::sin(x), math::cos(x)], inputs: angles },
    Case { name: "sine and cosine: micromath", function: |x, _| [F32(x).sin().0, F32(x).cos().0], inputs: angles },
    Case { name: "sine and cosine: chosen", function: |x, _| functions::sin_cos(x).into(), inputs: angles },
    Case { name: "arctangent: libm", function: |y, x| [libm::atan2f(y, x), 0.0], inputs: vectors },
    Case { name: "arctangent: chosen", function: |y, x| [functions::atan2(y, x), 0.0], inputs: vectors },
    Case { name: "inverse root: libm", function: |x, _| [1.0 / libm::sqrtf(x), 0.0], inputs: squares },
    Case { name: "inverse root: micromath", function: |x, _| [F32(x).invsqrt().0, 0.0], inputs: squares },
    Case { name: "inverse root: chosen", function: |x, _| [functions::inverse_root_below(x), 0.0], inputs: squares },
    Case { name: "root: libm", function: |x, _| [libm::sqrtf(x), 0.0], inputs: squares },
    Case { name: "root: micromath", function: |x, _| [F32(x).sqrt().0, 0.0], inputs: squares },
    Case { name: "root: chosen", function: |x, _| [x * functions::inverse_root_below(x), 0.0], inputs: squares },
];

/// Returns angles around the circle, in radians.
pub fn angles() -> [[f32; 2]; LEN] {
    core::array::from_fn(|i| [(i as f32 + 0.5) * (core::f32::consts::TAU / LEN as f32) - core::f32::consts::PI, 0.0])
}

/// Returns vectors around the circle, of lengths from 0.5 to 1.5.
pub fn vectors() -> [[f32; 2]; LEN] {
    let mut i = 0.0;
    angles().map(|[radians, _]| {
        i += 1.0;
        let length = 0.5 + i / LEN as f32;
        [length * libm::sinf(radians), length * libm::cosf(radians)]
    })
}

/// Returns positive numbers with even and odd exponents.
pub fn squares() -> [[f32; 2]; LEN] {
    core::array::from_fn(|i| [(i as f32 + 0.5) * (4.0 / LEN as f32), 0.0])
}

/// Returns the results of a case.
pub fn results(case: &Case, inputs: &[[f32; 2]; LEN]) -> [[f32; 2]; LEN] {
    inputs.map(|[x, y]| (case.function)(x, y))
}
