//! The image slot: a region of code memory that the linker script names, outside the firmware.

use actq_kernels::image::header::{MAGIC, W_BYTES};

unsafe extern "C" {
    static _image_slot_start: u32;
    static _image_slot_end: u32;
}

/// The bytes of the image in the slot, as long as its header says; `None` where there is none. Nothing but the length is
/// checked here.
pub fn image() -> Option<&'static [u8]> {
    let (start, end) = (&raw const _image_slot_start, &raw const _image_slot_end);
    let words = (end as usize - start as usize) / 4;
    // SAFETY: the linker script gives the slot these bounds in readable memory, aligned to 4, which nothing else uses and nothing
    // writes while the firmware runs; where there is no slot, they are equal and not null.
    let slot = unsafe { core::slice::from_raw_parts(start, words) };
    if slot.first() != Some(&MAGIC) {
        return None;
    }
    bytemuck::cast_slice(slot).get(..*slot.get(W_BYTES)? as usize)
}
