//! Field-oriented control of a three-phase motor's current: from phase currents and rotor angle to duty cycles, in one
//! control tick.
//!
//! Clarke and Park transforms (amplitude-invariant), a PI controller for each axis of the rotor, and space-vector
//! modulation; a rotor observer for a sine-cosine sensor. All arithmetic is f32 in a fixed order, including sine,
//! cosine, arctangent and root ([`functions`]). So a host, an emulator and a board compute the same bits.
//!
//! SI units: ampere, volt, ohm, henry, second, radian (electrical).

mod current;
pub mod functions;
mod observer;
mod pi;
mod pwm;
mod transform;

pub use current::{CurrentLoop, Gains, Measured, Tick};
pub use observer::Observer;
pub use pi::Pi;
pub use pwm::duties;
pub use transform::{Angle, Rotor, Stator};
