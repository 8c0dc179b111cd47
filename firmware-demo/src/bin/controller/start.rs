//! The start: what was found is told, the image is checked and tested.

use actq_boards::device::NMI;
use actq_boards::port::Port;
use actq_boards::seams::{Cause, Source};
use actq_firmware_demo::output::MAX_ACTION;
use actq_firmware_demo::text::Text;
use actq_firmware_support::crumb::Kind;
use actq_firmware_support::slot;
use actq_firmware_support::stack::Room;
use actq_kernels::{Head, Image};

use crate::app::Found;
use crate::log::info;

/// Includes a file at an address that is a multiple of 4.
#[repr(C, align(4))]
struct Aligned<T: ?Sized>(T);
static BUILT_IN: &Aligned<[u8]> = &Aligned(*include_bytes!(env!(
    "ACTQ_IMAGE",
    "set ACTQ_IMAGE to the absolute path of the image to build in; `cargo xtask firmware` does"
)));

/// Tells what was found, and makes the head of the image in the slot or of the one that was built in. `None`, and the reason is told,
/// where the image may not run.
pub(crate) fn head<'s>(port: &mut Port<'static>, found: &Found, scratch: &'s mut [u32]) -> Option<Head<'static, 's>> {
    report(port, found);
    let bytes = slot::image().unwrap_or(&BUILT_IN.0);
    let image = match Image::new_checked(bytes) {
        Ok(image) => image,
        Err(error) => {
            Text::to(port)
                .text("image refused: ")
                .text(error.text())
                .text(", error ")
                .number(error.code().into())
                .end();
            return None;
        }
    };
    Text::to(port).text("image ").text(image.name()).text(", crc32 ").hex(image.crc()).end();
    if image.act_len() > MAX_ACTION {
        let text = Text::to(port).text("image refused: its action has ").number(image.act_len() as u32);
        text.text(" values, the tick takes ").number(MAX_ACTION as u32).end();
        return None;
    }
    let mut head = match Head::new(image, scratch) {
        Ok(head) => head,
        Err(error) => {
            let text = Text::to(port).text("image refused: it needs ").number(image.scratch_words() as u32);
            text.text(" words of scratch memory, error ").number(error.code().into()).end();
            return None;
        }
    };
    if let Err(error) = head.self_test() {
        Text::to(port).text("image refused: its self-test fails, error ").number(error.code().into()).end();
        return None;
    }
    info!("{=str} is ready", image.name());
    Text::to(port).text("self-test passed, ready").end();
    Some(head)
}

fn report(port: &mut Port<'static>, found: &Found) {
    let cause = match (found.cause, found.crumb.map(|crumb| crumb.kind)) {
        // The board tells nothing itself.
        (Cause::Unknown, Some(Kind::Nmi)) => NMI,
        (Cause::Unknown, Some(Kind::Panic | Kind::HardFault)) => Cause::Software.text(),
        (cause, _) => cause.text(),
    };
    info!("reset by {=str}, {=u32} Hz", cause, found.clock.hz);
    Text::to(port).text("actq controller, reset by ").text(cause).end();
    if let Some(crumb) = found.crumb {
        let text = Text::to(port).text("before it: ");
        match crumb.kind {
            Kind::Panic => text.text("panic in line ").number(crumb.at),
            Kind::HardFault => text.text("hard fault at ").hex(crumb.at).text(" called from ").hex(crumb.from),
            Kind::Nmi => text.text(NMI).text(" at ").hex(crumb.at).text(" called from ").hex(crumb.from),
        }
        .end();
    }
    let source = match found.clock.source {
        Source::Crystal => " Hz",
        Source::Fallback => " Hz, without its crystal",
    };
    let text = Text::to(port).text("clock ").number(found.clock.hz).text(source);
    text.text(if found.watchdog { ", watchdog runs" } else { ", NO WATCHDOG" }).end();
}

/// Words of stack that are painted: more than the program takes, less than any board has.
const STACK: usize = 2048;

fn room() -> Room {
    // SAFETY: every board's memory leaves the stack as many words; the linker's script puts it behind all else.
    unsafe { Room::of_stack(STACK) }
}

/// Prepares [`stack`]. To be called before any interrupt comes.
pub(crate) fn paint_stack() {
    // SAFETY: no interrupt comes yet.
    unsafe { room().paint() }
}

/// Bytes of stack that were in use at most.
pub(crate) fn stack() -> u32 {
    room().used() as u32
}
