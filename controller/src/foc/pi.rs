//! A PI controller with a limited output.

/// Proportional and integral control. What the limit takes away is not integrated: the integral is set to what would
/// just reach it (anti-windup by tracking; Åström and Hägglund, PID controllers, 1995, section 3.5, with the shortest
/// tracking time).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pi {
    integral: f32,
}

impl Pi {
    /// From nothing.
    pub const fn new() -> Self {
        Self { integral: 0.0 }
    }

    /// The output for an error, within `-limit..=limit`, where `proportional` is the gain and `integral` the gain by
    /// the time of a tick.
    pub fn step(&mut self, error: f32, proportional: f32, integral: f32, limit: f32) -> f32 {
        let direct = proportional * error;
        let integral = self.integral + integral * error;
        let output = (direct + integral).max(-limit).min(limit);
        // Where nothing is limited, the sum less the direct part would not be the integral to the last bit.
        self.integral = if output == direct + integral { integral } else { (output - direct).max(-limit).min(limit) };
        output
    }
}
