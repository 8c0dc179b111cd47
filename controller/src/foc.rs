//! Field-oriented control of a three-phase motor's current: from phase currents and rotor angle to duty cycles, in one
//! control tick.
//!
//! Clarke and Park transforms (amplitude-invariant), a PI controller for each axis of the rotor, and space-vector
//! modulation. Arithmetic is f32 in a fixed order, and sine, cosine and root are those of the crate `libm`, in software
//! everywhere, so that a host, an emulator and a board give the same bits.
//!
//! SI units: ampere, volt, ohm, henry, second, radian (electrical).

mod current;
mod pi;
mod pwm;
mod transform;

pub use current::{CurrentLoop, Gains, Measured, Tick};
pub use pi::Pi;
pub use pwm::duties;
pub use transform::{Angle, Rotor, Stator};
