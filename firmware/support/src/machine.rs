//! The processor's crates. Those for Cortex-M and for RISC-V have the same names for the firmware's needs: the entry
//! point, memory that is taken once, single instructions, and semihosting.

#[cfg(target_arch = "arm")]
pub use {
    cortex_m::{asm, singleton},
    cortex_m_rt::entry,
    cortex_m_semihosting as semihosting,
};
#[cfg(target_arch = "riscv32")]
pub use {
    riscv::{asm, singleton},
    riscv_rt::entry,
    riscv_semihosting as semihosting,
};
