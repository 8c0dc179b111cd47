//! The part of the vector table that belongs to a device: the handler `SERIAL`, which the application has, at its
//! place. `device.x` ([`crate::link`] on the host) gives a program without it the default handler.

/// A handler.
pub(crate) type Vector = unsafe extern "C" fn();

unsafe extern "C" {
    fn SERIAL();
    fn DefaultHandler();
}

/// A table with `SERIAL` at one place.
pub(crate) const fn table<const LEN: usize>(serial: usize) -> [Vector; LEN] {
    let mut table = [DefaultHandler as Vector; LEN];
    table[serial] = SERIAL as Vector;
    table
}

/// Declares, for a device, what RTIC asks for and the vector table: the number of the serial port's interrupt and of
/// all of them.
macro_rules! interrupts {
    ($serial:literal of $all:literal) => {
        /// The interrupts that the application has handlers for.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u16)]
        #[allow(clippy::upper_case_acronyms, reason = "the name of a handler")]
        pub enum Interrupt {
            /// Of the serial port.
            SERIAL = $serial,
        }

        // The name under which RTIC looks for it.
        pub use self::Interrupt as interrupt;

        // SAFETY: the number is that of the serial port's interrupt, and does not change.
        unsafe impl cortex_m::interrupt::InterruptNumber for Interrupt {
            fn number(self) -> u16 {
                self as u16
            }
        }

        /// The interrupts' part of the vector table.
        #[unsafe(no_mangle)]
        #[unsafe(link_section = ".vector_table.interrupts")]
        pub static __INTERRUPTS: [crate::vectors::Vector; $all] = crate::vectors::table::<$all>($serial);
    };
}
pub(crate) use interrupts;
