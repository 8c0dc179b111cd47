//! Field-oriented control of a three-phase motor's current: from phase currents and rotor angle to duty cycles, in one
//! control tick.
//!
//! Clarke and Park transforms (amplitude-invariant), a PI controller for each axis of the rotor, and space-vector
//! modulation; an observer of the rotor for a sensor of sine and cosine. Arithmetic is f32 in a fixed order, sine,
//! cosine, arctangent and root among it ([`functions`]), so that a host, an emulator and a board give the same bits.
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
