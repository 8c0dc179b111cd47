//! The device's part of the vector table, with the application's handler `SERIAL` at its place. `device.x`
//! ([`crate::link`] on the host) provides the default handler to programs without it.

/// A handler in the vector table.
pub(crate) type Vector = unsafe extern "C" fn();

unsafe extern "C" {
    fn SERIAL();
    fn DefaultHandler();
}

/// Returns a table with `SERIAL` at the index `serial`.
pub(crate) const fn table<const LEN: usize>(serial: usize) -> [Vector; LEN] {
    let mut table = [DefaultHandler as Vector; LEN];
    table[serial] = SERIAL as Vector;
    table
}

/// Declares a device's interrupts for RTIC and its vector table, from the serial port's interrupt number and the number
/// of interrupts.
macro_rules! interrupts {
    ($serial:literal of $all:literal) => {
        /// The interrupts that the application has handlers for.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u16)]
        #[allow(clippy::upper_case_acronyms, reason = "the name of a handler")]
        pub enum Interrupt {
            /// The serial port's interrupt.
            SERIAL = $serial,
        }

        // RTIC looks for this name.
        pub use self::Interrupt as interrupt;

        // SAFETY: the number is the serial port's interrupt number and does not change.
        unsafe impl cortex_m::interrupt::InterruptNumber for Interrupt {
            fn number(self) -> u16 {
                self as u16
            }
        }

        /// The interrupts' part of the vector table.
        #[unsafe(no_mangle)]
        #[unsafe(link_section = ".vector_table.interrupts")]
        pub static __INTERRUPTS: [crate::target::vectors::Vector; $all] =
            crate::target::vectors::table::<$all>($serial);
    };
}
pub(crate) use interrupts;
