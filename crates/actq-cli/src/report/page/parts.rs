//! Parts that the reader of a page chooses from.

use actq::emit::Core;
use serde::Serialize;

/// A microcontroller.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Part {
    /// Name.
    pub name: &'static str,
    /// Name of its core.
    pub core: &'static str,
    /// Bytes of flash; for parts without their own, of the usual one beside them.
    pub flash: usize,
    /// `true` if the flash is a chip of its own.
    pub is_external: bool,
    /// Bytes of RAM.
    pub ram: usize,
    /// Highest clock in MHz.
    pub megahertz: u32,
}

const KB: usize = 1024;
const M4F: Part = Part { name: "", core: "m4f", flash: 0, is_external: false, ram: 0, megahertz: 0 };
const EXTERNAL: Part = Part { is_external: true, ..M4F };

/// The parts, by their vendors' data sheets.
pub const PARTS: &[Part] = &[
    Part { name: "STM32F405", flash: 1024 * KB, ram: 192 * KB, megahertz: 168, ..M4F },
    Part { name: "STM32G474", flash: 512 * KB, ram: 128 * KB, megahertz: 170, ..M4F },
    Part { name: "STM32H743", core: "m7", flash: 2048 * KB, ram: 1024 * KB, megahertz: 480, ..M4F },
    Part { name: "RP2040", core: "m0", flash: 2048 * KB, ram: 264 * KB, megahertz: 133, ..EXTERNAL },
    Part { name: "RP2350", core: "m33", flash: 4096 * KB, ram: 520 * KB, megahertz: 150, ..EXTERNAL },
    Part { name: "nRF52840", flash: 1024 * KB, ram: 256 * KB, megahertz: 64, ..M4F },
    Part { name: "ESP32-C3", core: "rv32imac", flash: 4096 * KB, ram: 400 * KB, megahertz: 160, ..EXTERNAL },
];

/// Bytes of code of the Cortex-M4F, and of M7 and M33.
const DSP: usize = 37_528;

/// Cores of a page, with the bytes of code that opens, checks and runs any image on them ("whole runtime" of budgets.json;
/// of RV32IMAC with slices). Cores of the same layouts follow each other.
pub const RUNTIMES: [(Core, usize); 6] = [
    (Core::M4f, DSP),
    (Core::M7, DSP),
    (Core::M33, DSP),
    (Core::M3, 72_124),
    (Core::M0, 72_312),
    (Core::Rv32imac, 82_194),
];

#[cfg(test)]
mod tests {
    use super::*;

    /// The figures may be a little old, but not wrong.
    #[test]
    fn the_runtime_takes_the_bytes_of_the_budget() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../budgets.json");
        // A published crate has no budgets.
        let Ok(text) = std::fs::read_to_string(path) else { return };
        let budgets: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        for (core, known) in RUNTIMES {
            let core = core.measured();
            let on = if core == Core::M4f { String::new() } else { format!(" on {}", core.name()) };
            let figure = format!("bytes of code, whole runtime{on}");
            let bytes = budgets["figures"][&figure].as_u64().unwrap_or_else(|| panic!("no figure {figure}")) as f64;
            assert!((bytes / known as f64 - 1.0).abs() < 0.02, "{core:?}: {known}, the budget {bytes}");
        }
    }

    #[test]
    fn the_page_knows_the_core_of_every_part() {
        assert!(PARTS.iter().all(|part| RUNTIMES.iter().any(|(core, _)| core.name() == part.core)));
    }
}
