//! Checked pointers of the caller.

use core::mem::{align_of, size_of};
use core::ops::Range;

use crate::status::{Code, Failure};

/// Checks a pointer to `len` values.
pub(crate) fn check<T>(pointer: *const T, len: usize) -> Result<(), Failure> {
    if pointer.is_null() {
        return Err(Code::Null.into());
    }
    if !pointer.is_aligned() {
        return Err(Code::Alignment.into());
    }
    // The longest slice that Rust allows.
    let bytes = len.checked_mul(size_of::<T>()).filter(|bytes| isize::try_from(*bytes).is_ok());
    match bytes.and_then(|bytes| (pointer as usize).checked_add(bytes)) {
        Some(_) => Ok(()),
        None => Err(Code::Length.into()),
    }
}

/// Borrows `len` values to read. An empty buffer may be null.
///
/// # Safety
///
/// `pointer` is null, misaligned, or valid for reads of `len` initialized values that nothing writes while `'a` lasts.
pub(crate) unsafe fn slice<'a, T: Copy>(pointer: *const T, len: usize) -> Result<&'a [T], Failure> {
    if len == 0 {
        return Ok(&[]);
    }
    check(pointer, len)?;
    // SAFETY: it is not null, aligned, and of a possible length; the caller promises the rest.
    Ok(unsafe { core::slice::from_raw_parts(pointer, len) })
}

/// Borrows `len` values to write. An empty buffer may be null.
///
/// # Safety
///
/// `pointer` is null, misaligned, or valid for reads and writes of `len` values that nothing else uses while `'a`
/// lasts. Any bits are a value of `T`.
pub(crate) unsafe fn slice_mut<'a, T: Copy>(pointer: *mut T, len: usize) -> Result<&'a mut [T], Failure> {
    if len == 0 {
        return Ok(&mut []);
    }
    check(pointer, len)?;
    // SAFETY: it is not null, aligned, and of a possible length; the caller promises the rest.
    Ok(unsafe { core::slice::from_raw_parts_mut(pointer, len) })
}

/// Writes a value through a pointer of the caller.
///
/// # Safety
///
/// `pointer` is null, misaligned, or valid for a write.
pub(crate) unsafe fn put<T>(pointer: *mut T, value: T) -> Result<(), Failure> {
    check(pointer, 1)?;
    // SAFETY: it is not null and aligned; the caller promises the rest.
    unsafe { pointer.write(value) };
    Ok(())
}

/// Returns the addresses of `len` values; the range is empty if they would wrap.
pub(crate) fn addresses<T>(pointer: *const T, len: usize) -> Range<usize> {
    let from = pointer as usize;
    from..from.saturating_add(len.saturating_mul(size_of::<T>()))
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
