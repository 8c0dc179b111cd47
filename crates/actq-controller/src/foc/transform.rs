//! Transforms between three phases, the stator's two axes, and the rotor's two axes.

use super::functions::sin_cos;

/// 1 / sqrt(3).
const INV_SQRT_3: f32 = 0.577_350_26;
/// sqrt(3) / 2.
const HALF_SQRT_3: f32 = 0.866_025_4;

/// A vector in the stator's axes: alpha along phase a, beta a quarter turn ahead.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stator {
    /// Component along phase a.
    pub alpha: f32,
    /// Component a quarter turn ahead.
    pub beta: f32,
}

/// A vector in the rotor's axes: d along its flux, q a quarter turn ahead.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rotor {
    /// Component along the flux.
    pub d: f32,
    /// Component a quarter turn ahead, which produces torque.
    pub q: f32,
}

/// Sine and cosine of the rotor's electrical angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Angle {
    /// The sine.
    pub sin: f32,
    /// The cosine.
    pub cos: f32,
}

impl Angle {
    /// Computes an angle from radians, with the error of [`sin_cos`].
    pub fn new(radians: f32) -> Self {
        let (sin, cos) = sin_cos(radians);
        Self { sin, cos }
    }
}

impl Stator {
    /// Computes the Clarke transform of three phases. It removes their common mode.
    pub fn of_phases([a, b, c]: [f32; 3]) -> Self {
        Self { alpha: (a + a - b - c) / 3.0, beta: (b - c) * INV_SQRT_3 }
    }

    /// Returns the three phases, whose sum is 0.
    pub fn phases(self) -> [f32; 3] {
        let (half, beta) = (-0.5 * self.alpha, HALF_SQRT_3 * self.beta);
        [self.alpha, half + beta, half - beta]
    }

    /// Computes the Park transform.
    pub fn to_rotor(self, Angle { sin, cos }: Angle) -> Rotor {
        Rotor { d: self.alpha * cos + self.beta * sin, q: self.beta * cos - self.alpha * sin }
    }
}

impl Rotor {
    /// Computes the inverse Park transform.
    pub fn to_stator(self, Angle { sin, cos }: Angle) -> Stator {
        Stator { alpha: self.d * cos - self.q * sin, beta: self.d * sin + self.q * cos }
    }
}
