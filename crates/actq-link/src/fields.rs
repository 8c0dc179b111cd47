//! Reader and writer of little-endian fields, and records of them.

use cobs::CobsEncoder;
use crc::{Digest, Table};

use crate::frame::CRC;

/// A value in a payload.
pub(crate) trait Field<'a>: Sized {
    fn write(&self, w: &mut Writer<'_>);

    /// Reads the value; `None` if bytes are missing or are no such value.
    fn read(r: &mut Reader<'a>) -> Option<Self>;
}

macro_rules! numbers {
    ($($number:ty)*) => {
        $(impl Field<'_> for $number {
            // Not inlined: fields are written in many places, and the controller's flash is small.
            #[inline(never)]
            fn write(&self, w: &mut Writer<'_>) {
                w.bytes(&self.to_le_bytes());
            }

            fn read(r: &mut Reader<'_>) -> Option<Self> {
                r.array().map(|bytes| Self::from_le_bytes(*bytes))
            }
        })*
    };
}
numbers! { u8 u16 u32 f32 }

impl Field<'_> for bool {
    fn write(&self, w: &mut Writer<'_>) {
        u8::from(*self).write(w);
    }

    fn read(r: &mut Reader<'_>) -> Option<Self> {
        match u8::read(r)? {
            0 => Some(false),
            1 => Some(true),
            _ => None,
        }
    }
}

/// All bytes up to the end of the payload.
impl<'a> Field<'a> for &'a [u8] {
    fn write(&self, w: &mut Writer<'_>) {
        w.bytes(self);
    }

    fn read(r: &mut Reader<'a>) -> Option<Self> {
        Some(r.rest())
    }
}

/// An array up to the end of the payload, or nothing.
impl<'a, const N: usize> Field<'a> for Option<&'a [u8; N]> {
    fn write(&self, w: &mut Writer<'_>) {
        w.bytes(self.map_or(&[], |bytes| bytes));
    }

    fn read(r: &mut Reader<'a>) -> Option<Self> {
        if r.is_empty() { Some(None) } else { r.array().map(Some) }
    }
}

/// Declares a structure whose fields are, in this order, those of a payload.
macro_rules! record {
    ($(#[$attribute:meta])* pub struct $name:ident { $($(#[$doc:meta])* pub $field:ident: $type:ty,)* }) => {
        $(#[$attribute])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub struct $name {
            $($(#[$doc])* pub $field: $type,)*
        }

        impl Field<'_> for $name {
            fn write(&self, w: &mut Writer<'_>) {
                $(self.$field.write(w);)*
            }

            fn read(r: &mut Reader<'_>) -> Option<Self> {
                Some(Self { $($field: r.field()?,)* })
            }
        }
    };
}
pub(crate) use record;

/// Reads fields from a payload.
#[derive(Clone, Copy)]
pub(crate) struct Reader<'a>(pub(crate) &'a [u8]);

impl<'a> Reader<'a> {
    /// Reads the next field.
    pub(crate) fn field<T: Field<'a>>(&mut self) -> Option<T> {
        T::read(self)
    }

    /// Returns the next `N` bytes, in place.
    pub(crate) fn array<const N: usize>(&mut self) -> Option<&'a [u8; N]> {
        let (array, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(array)
    }

    /// Returns the remaining bytes.
    pub(crate) fn rest(&mut self) -> &'a [u8] {
        core::mem::take(&mut self.0)
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

/// Stuffs fields into a buffer one by one and computes their checksum. [`Writer::finish`] reports a buffer that was too
/// small.
pub(crate) struct Writer<'b> {
    cobs: CobsEncoder<'b>,
    crc: Digest<'static, u32, Table<1>>,
    fits: bool,
}

impl<'b> Writer<'b> {
    pub(crate) fn new(buffer: &'b mut [u8]) -> Self {
        Self { cobs: CobsEncoder::new(buffer), crc: CRC.digest(), fits: true }
    }

    pub(crate) fn bytes(&mut self, bytes: &[u8]) {
        self.crc.update(bytes);
        self.push(bytes);
    }

    fn push(&mut self, bytes: &[u8]) {
        // `push` holds back the last byte of its argument, so it cannot take an empty one.
        self.fits &= bytes.is_empty() || self.cobs.push(bytes).is_ok();
    }

    /// Appends the checksum and returns the number of bytes in the buffer, without the zero that ends a frame. `None`
    /// if the buffer is too small.
    pub(crate) fn finish(mut self) -> Option<usize> {
        let crc = self.crc.clone().finalize();
        self.push(&crc.to_le_bytes());
        self.fits.then(|| self.cobs.finalize())
    }
}
