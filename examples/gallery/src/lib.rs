//! The example robots as a WebAssembly module: `gallery.js` drives them with heads of images, and draws them. The
//! functions exist for wasm32-unknown-unknown only; an instance has one robot.

#[cfg(target_family = "wasm")]
pub mod exports;
mod robot;

pub use robot::Robot;
