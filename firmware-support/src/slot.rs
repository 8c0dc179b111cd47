//! The image slot, and two for updates: regions of code memory that the linker script names, outside the firmware.

use core::cell::Cell;

use actq_kernels::image::header::{MAGIC, W_BYTES};

unsafe extern "C" {
    static _image_slot_start: u32;
    static _image_slot_end: u32;
}

/// The bytes of the image in the slot, as long as its header says; `None` where there is none. Nothing but the length
/// is checked here.
pub fn image() -> Option<&'static [u8]> {
    let (start, end) = (&raw const _image_slot_start, &raw const _image_slot_end);
    let bytes = end as usize - start as usize;
    // SAFETY: the linker script gives the slot these bounds in readable memory, aligned to 4; where there is no slot,
    // they are equal.
    let word = |at: usize| (at < bytes / 4).then(|| unsafe { start.add(at).read_volatile() });
    if word(0)? != MAGIC {
        return None;
    }
    let length = word(W_BYTES)? as usize;
    // SAFETY: within the slot, as above. Nothing writes there while an image is in it: where updates have the same
    // memory, the application leaves it alone then.
    (length <= bytes).then(|| unsafe { core::slice::from_raw_parts(start.cast(), length) })
}

/// The memory of the slots for updates; empty on a board without.
///
/// # Safety
///
/// To be called once.
pub unsafe fn updates() -> &'static [Cell<u8>] {
    unsafe extern "C" {
        static _update_slots_start: Cell<u8>;
        static _update_slots_end: Cell<u8>;
    }
    let (start, end) = (&raw const _update_slots_start, &raw const _update_slots_end);
    // SAFETY: the linker script gives the slots these bounds in memory of which only the board's flash changes a cell,
    // as the caller calls once; where there are none, they are equal and not null.
    unsafe { core::slice::from_raw_parts(start, end as usize - start as usize) }
}

/// Part of a flash in memory, to run an image in place.
///
/// # Safety
///
/// Nothing writes there for as long as the bytes are used.
pub unsafe fn mapped(flash: &'static [Cell<u8>], address: u32, length: u32) -> Option<&'static [u8]> {
    let cells = flash.get(address as usize..)?.get(..length as usize)?;
    // SAFETY: a cell of a byte is a byte in memory, and the caller promises that none changes.
    Some(unsafe { core::slice::from_raw_parts(cells.as_ptr().cast(), cells.len()) })
}
