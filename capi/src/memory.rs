//! Memory of the caller.

use core::mem::{align_of, size_of};
use core::ops::Range;
use core::ptr::NonNull;

use crate::status::{Code, Failure};

/// Memory of the caller: `len` values at an address that is not null and aligned, or none.
pub(crate) struct Buffer<T> {
    pointer: *mut T,
    len: usize,
}

impl<T> Buffer<T> {
    /// Checks a pointer to `len` values.
    pub(crate) fn new(pointer: *const T, len: usize) -> Result<Self, Failure> {
        check(pointer as usize, align_of::<T>(), size_of::<T>(), len)?;
        Ok(Self { pointer: pointer.cast_mut(), len })
    }

    /// The same, where a buffer may be empty; it may be null then.
    pub(crate) fn or_empty(pointer: *const T, len: usize) -> Result<Self, Failure> {
        let pointer = if len == 0 { NonNull::dangling().as_ptr() } else { pointer };
        Self::new(pointer, len)
    }

    /// Returns the address of the values.
    pub(crate) fn pointer(&self) -> *const T {
        self.pointer
    }

    /// Returns the addresses of the values. An empty buffer has none.
    pub(crate) fn addresses(&self) -> Range<usize> {
        // The check has refused a length for which this would wrap.
        let from = self.pointer as usize;
        from..from.wrapping_add(self.len * size_of::<T>())
    }

    /// Borrows the values to read.
    ///
    /// # Safety
    ///
    /// The pointer is valid for reads of `len` initialized values that nothing writes while `'a` lasts.
    pub(crate) unsafe fn read<'a>(&self) -> &'a [T] {
        // SAFETY: it is not null, aligned, and of a possible length; the caller promises the rest.
        unsafe { core::slice::from_raw_parts(self.pointer, self.len) }
    }

    /// Borrows the values to write.
    ///
    /// # Safety
    ///
    /// The pointer is valid for reads and writes of `len` values that nothing else uses while `'a` lasts. Any bits are
    /// a value of `T`.
    pub(crate) unsafe fn write<'a>(&self) -> &'a mut [T] {
        // SAFETY: it is not null, aligned, and of a possible length; the caller promises the rest.
        unsafe { core::slice::from_raw_parts_mut(self.pointer, self.len) }
    }

    /// Writes the first value, of at least one.
    ///
    /// # Safety
    ///
    /// The pointer is valid for a write.
    pub(crate) unsafe fn put(self, value: T) {
        // SAFETY: it is not null and aligned; the caller promises the rest.
        unsafe { self.pointer.write(value) };
    }
}

/// Checks an address of values of any type.
fn check(address: usize, align: usize, size: usize, len: usize) -> Result<(), Failure> {
    if address == 0 {
        return Err(Code::Null.into());
    }
    if !address.is_multiple_of(align) {
        return Err(Code::Alignment.into());
    }
    // The longest slice that Rust allows.
    let bytes = len.checked_mul(size).filter(|bytes| isize::try_from(*bytes).is_ok());
    match bytes.and_then(|bytes| address.checked_add(bytes)) {
        Some(_) => Ok(()),
        None => Err(Code::Length.into()),
    }
}

pub(crate) fn addresses<T>(values: &[T]) -> Range<usize> {
    let ends = values.as_ptr_range();
    ends.start as usize..ends.end as usize
}

/// Requires that two ranges share no byte.
pub(crate) fn apart(one: &Range<usize>, other: &Range<usize>) -> Result<(), Failure> {
    if one.start < other.end && other.start < one.end { Err(Code::Overlap.into()) } else { Ok(()) }
}

/// Requires that no two of these ranges share a byte.
pub(crate) fn all_apart(ranges: &[&Range<usize>]) -> Result<(), Failure> {
    let mut rest = ranges;
    while let Some((one, others)) = rest.split_first() {
        others.iter().try_for_each(|other| apart(one, other))?;
        rest = others;
    }
    Ok(())
}

/// The first word of an opened structure. It depends on the structure's address, so that a copy is not taken for it:
/// two copies of a head would share its memory.
pub(crate) fn seal<T>(of: *const T, magic: u32) -> usize {
    const { assert!(align_of::<usize>() == size_of::<usize>()) };
    (of as usize) ^ magic as usize
}
