//! A PI controller with a limited output.

/// Proportional and integral control with anti-windup: while the output is limited, the integral is set to the value
/// that just reaches the limit. This is tracking with the shortest time (Åström and Hägglund, PID controllers, 1995,
/// section 3.5).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pi {
    integral: f32,
}

impl Pi {
    /// Creates a controller with a zero integral.
    pub const fn new() -> Self {
        Self { integral: 0.0 }
    }

    /// Returns the output for an error, within `-limit..=limit`. `proportional` is the gain; `integral` is the integral
    /// gain times the tick.
    pub fn step(&mut self, error: f32, proportional: f32, integral: f32, limit: f32) -> f32 {
        let direct = proportional * error;
        let integral = self.integral + integral * error;
        let output = (direct + integral).max(-limit).min(limit);
        // Without a limit, the output minus the direct part would differ from the integral in the last bit.
        self.integral = if output == direct + integral { integral } else { (output - direct).max(-limit).min(limit) };
        output
    }
}
