//! Parts that the reader of a page chooses from.

use serde::Serialize;

/// A microcontroller.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Part {
    /// Name.
    pub name: &'static str,
    /// Core.
    pub core: &'static str,
    /// Bytes of flash; for parts without their own, of the usual one beside them.
    pub flash: usize,
    /// `true` if the flash is a chip of its own.
    pub is_external: bool,
    /// Bytes of RAM.
    pub ram: usize,
    /// Highest clock in MHz.
    pub megahertz: u32,
    /// `true` if the core has the DSP extension, and so the default layouts.
    pub has_dsp: bool,
    /// `true` if the cost model is of this core.
    pub is_modelled: bool,
}

const KB: usize = 1024;
const M4F: Part = Part {
    name: "",
    core: "Cortex-M4F",
    flash: 0,
    is_external: false,
    ram: 0,
    megahertz: 0,
    has_dsp: true,
    is_modelled: true,
};

/// The parts, by their vendors' data sheets.
pub const PARTS: &[Part] = &[
    Part { name: "STM32F405", flash: 1024 * KB, ram: 192 * KB, megahertz: 168, ..M4F },
    Part { name: "STM32G474", flash: 512 * KB, ram: 128 * KB, megahertz: 170, ..M4F },
    Part {
        name: "STM32H743",
        core: "Cortex-M7",
        flash: 2048 * KB,
        ram: 1024 * KB,
        megahertz: 480,
        is_modelled: false,
        ..M4F
    },
    Part {
        name: "RP2040",
        core: "Cortex-M0+",
        flash: 2048 * KB,
        is_external: true,
        ram: 264 * KB,
        megahertz: 133,
        has_dsp: false,
        is_modelled: false,
    },
    Part {
        name: "RP2350",
        core: "Cortex-M33",
        flash: 4096 * KB,
        is_external: true,
        ram: 520 * KB,
        megahertz: 150,
        is_modelled: false,
        ..M4F
    },
    Part { name: "nRF52840", flash: 1024 * KB, ram: 256 * KB, megahertz: 64, ..M4F },
    Part {
        name: "ESP32-C3",
        core: "RV32IMC",
        flash: 4096 * KB,
        is_external: true,
        ram: 400 * KB,
        megahertz: 160,
        has_dsp: false,
        is_modelled: false,
    },
];

/// Bytes of code that opens, checks and runs any image on a Cortex-M4F ("whole runtime" of budgets.json).
pub const RUNTIME: usize = 36840;

#[cfg(test)]
mod tests {
    use super::*;

    /// The figure may be a little old, but not wrong.
    #[test]
    fn the_runtime_takes_the_bytes_of_the_budget() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../budgets.json");
        // A published crate has no budgets.
        let Ok(text) = std::fs::read_to_string(path) else { return };
        let budgets: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        let bytes = budgets["figures"]["bytes of code, whole runtime"].as_u64().expect("the figure") as f64;
        assert!((bytes / RUNTIME as f64 - 1.0).abs() < 0.02, "RUNTIME is {RUNTIME}, the budget {bytes}");
    }
}
