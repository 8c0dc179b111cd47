//! The image slot and two update slots: regions of code memory outside the firmware, named by the linker script.

use core::cell::Cell;

use actq_kernels::Image;

unsafe extern "C" {
    static _image_slot_start: u32;
    static _image_slot_end: u32;
}

/// Returns the bytes of the image in the slot, with the length from its header; `None` if the slot is empty. It checks
/// only the length.
pub fn image() -> Option<&'static [u8]> {
    let (start, end) = (&raw const _image_slot_start, &raw const _image_slot_end);
    let bytes = end as usize - start as usize;
    // SAFETY: the linker script gives the slot these bounds in readable memory, aligned to 4; without a slot they are
    // equal.
    let word = |at: usize| (at < bytes / 4).then(|| unsafe { start.add(at).read_volatile() });
    if word(0)? != Image::MAGIC {
        return None;
    }
    let length = word(Image::LENGTH_WORD)? as usize;
    // SAFETY: within the slot, as above. Nothing writes to it while it has an image: the application then makes no
    // updates in the same memory.
    (length <= bytes).then(|| unsafe { core::slice::from_raw_parts(start.cast(), length) })
}

/// Returns the memory of the update slots; empty on a board without them.
///
/// # Safety
///
/// Call it once.
pub unsafe fn updates() -> &'static [Cell<u8>] {
    unsafe extern "C" {
        static _update_slots_start: Cell<u8>;
        static _update_slots_end: Cell<u8>;
    }
    let (start, end) = (&raw const _update_slots_start, &raw const _update_slots_end);
    // SAFETY: the linker script gives the slots these bounds. Only the board's flash changes their cells, as the caller
    // calls this once. Without slots the bounds are equal and not null.
    unsafe { core::slice::from_raw_parts(start, end as usize - start as usize) }
}

/// Returns a part of a memory-mapped flash, to run an image in place.
///
/// # Safety
///
/// Nothing writes to this part while the bytes are in use.
pub unsafe fn mapped(flash: &'static [Cell<u8>], address: u32, length: u32) -> Option<&'static [u8]> {
    let cells = flash.get(address as usize..)?.get(..length as usize)?;
    // SAFETY: a cell of a byte is a byte in memory, and the caller promises that it does not change.
    Some(unsafe { core::slice::from_raw_parts(cells.as_ptr().cast(), cells.len()) })
}
