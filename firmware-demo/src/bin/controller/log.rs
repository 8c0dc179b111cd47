//! Logs, enabled by a feature.

/// Logs as `defmt::info` does; does nothing without the feature `defmt`.
macro_rules! info {
    ($($text:tt)*) => {
        #[cfg(feature = "defmt")]
        defmt::info!($($text)*);
    };
}
pub(crate) use info;
