//! Values of an observation or an action.

use crate::fields::{Field, Reader, Writer};

/// f32 values, from memory or from the wire.
#[derive(Clone, Copy, Debug)]
pub enum Floats<'a> {
    /// In memory.
    Values(&'a [f32]),
    /// As received: little-endian, always whole values.
    Wire(&'a [[u8; 4]]),
}

impl<'a> Floats<'a> {
    /// Returns the number of values.
    pub const fn len(&self) -> usize {
        match self {
            Self::Values(values) => values.len(),
            Self::Wire(values) => values.len(),
        }
    }

    /// Returns `true` if there are no values.
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns an iterator over the values in order.
    pub fn iter(&self) -> impl Iterator<Item = f32> + use<'a> {
        let (values, wire): (&'a [f32], &'a [[u8; 4]]) = match *self {
            Self::Values(values) => (values, &[]),
            Self::Wire(wire) => (&[], wire),
        };
        values.iter().copied().chain(wire.iter().map(|bytes| f32::from_le_bytes(*bytes)))
    }
}

/// All values up to the end of the payload.
impl<'a> Field<'a> for Floats<'a> {
    fn write(&self, w: &mut Writer<'_>) {
        match self {
            Self::Values(values) => values.iter().for_each(|value| value.write(w)),
            Self::Wire(values) => w.bytes(values.as_flattened()),
        }
    }

    fn read(r: &mut Reader<'a>) -> Option<Self> {
        let (values, rest) = r.rest().as_chunks();
        rest.is_empty().then_some(Self::Wire(values))
    }
}

/// Compares bit for bit, so that a NaN equals itself.
impl PartialEq for Floats<'_> {
    fn eq(&self, other: &Self) -> bool {
        self.iter().map(f32::to_bits).eq(other.iter().map(f32::to_bits))
    }
}
