//! Properties that decide the layout of rows, beside their widths.

use actq_kernels::Width;
use actq_kernels::cost::Core;
use actq_kernels::layout::{BlockShape, Lanes};

/// Bits of the activations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Activations {
    /// -127 to 127
    Int8,
    /// Up to -32767 to 32767, as far as the int32 accumulator allows.
    Int16,
    /// int16 if it lowers the error noticeably, else int8; methods that do not measure it use int8.
    Auto,
    /// The setting of [`Self::Auto`] before it measures, with the same widths: for drafts, whose time counts.
    Unmeasured,
}

impl Activations {
    /// Returns the activations of these bits, 8 or 16.
    pub fn of_bits(bits: u32) -> Option<Self> {
        match bits {
            8 => Some(Self::Int8),
            16 => Some(Self::Int16),
            _ => None,
        }
    }

    /// Returns `true` if all matrices get the requested bits.
    pub fn are_asked_for(self) -> bool {
        matches!(self, Self::Int8 | Self::Int16)
    }

    /// Returns the largest magnitude.
    pub const fn limit(self) -> u16 {
        match self {
            Self::Int8 | Self::Auto | Self::Unmeasured => 127,
            Self::Int16 => i16::MAX as u16,
        }
    }
}

/// Packing of rows, beside their widths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Packing {
    /// Largest activation.
    pub x_max: u16,
    /// Columns per u8 scale; 0 = none.
    pub group: usize,
}

impl Packing {
    /// Returns the packing for activations up to this magnitude.
    pub fn of(x_max: u16, group: usize) -> Self {
        Self { x_max, group }
    }

    /// Returns the shape of a block of rows, in the default layouts.
    pub fn shape(self, width: Width, rows: usize, cols: usize) -> BlockShape {
        BlockShape { width, lanes: Lanes::of(self.x_max, self.group), rows, cols, group: self.group }
    }

    /// Returns the shape in the layouts of a core.
    pub fn shape_on(self, core: Core, shape: BlockShape) -> BlockShape {
        BlockShape { lanes: core.lanes(self.x_max, self.group), ..shape }
    }
}
