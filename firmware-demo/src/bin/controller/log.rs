//! Logs, where a feature asks for them.

/// Logs as `defmt::info` does; without the feature `defmt`, nothing.
macro_rules! info {
    ($($text:tt)*) => {
        #[cfg(feature = "defmt")]
        defmt::info!($($text)*);
    };
}
pub(crate) use info;
