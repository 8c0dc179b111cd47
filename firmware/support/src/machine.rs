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

/// Executes an undefined instruction.
pub fn undefined() -> ! {
    #[cfg(target_arch = "arm")]
    asm::udf();
    #[cfg(target_arch = "riscv32")]
    // SAFETY: the instruction does nothing but an exception.
    unsafe {
        core::arch::asm!("c.unimp", options(noreturn))
    }
}

/// Returns the stack pointer.
#[inline(always)]
pub fn stack_pointer() -> usize {
    #[cfg(target_arch = "arm")]
    return cortex_m::register::msp::read() as usize;
    #[cfg(target_arch = "riscv32")]
    {
        let pointer;
        // SAFETY: reads a register.
        unsafe { core::arch::asm!("mv {}, sp", out(reg) pointer, options(nomem, nostack, preserves_flags)) };
        pointer
    }
}
