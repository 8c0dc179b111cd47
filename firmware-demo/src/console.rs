//! A console in place of a link: an application that answers single bytes by lines of text. `?` tells the status, `s` runs a step on the
//! next observation of the image's self-test and tells the action's bits.

use actq_kernels::{Image, StepError};
use embedded_io::Write;

use crate::application::{Application, Status};
use crate::text::Text;

/// The console.
#[derive(Debug)]
pub struct Console<'i> {
    image: Option<Image<'i>>,
    /// Steps that were asked for and have not begun.
    asked: u32,
    /// The self-test's observation that comes next.
    next: usize,
    /// Whether it says that all is well.
    well: bool,
}

impl<'i> Console<'i> {
    /// For an image, where there is one.
    pub fn new(image: Option<Image<'i>>) -> Self {
        Self { image, asked: 0, next: 0, well: true }
    }

    fn on_byte(&mut self, byte: u8, status: &Status, out: &mut impl Write) {
        let Status { timing, lost, stack, ready } = status;
        match byte {
            b'?' => Text::to(out)
                .text(if *ready { "ready" } else { "not ready" })
                .text(", ticks ")
                .number(timing.ticks)
                .text(", longest ")
                .number(timing.worst)
                .text(" cycles, jitter ")
                .number(timing.jitter())
                .text(" cycles, overruns ")
                .number(timing.overruns)
                .text(", lost bytes ")
                .number(*lost)
                .text(", stack ")
                .number(stack())
                .text(" bytes")
                .end(),
            b's' if *ready => self.asked = self.asked.saturating_add(1),
            b's' => Text::to(out).text("no action: not ready").end(),
            #[cfg(feature = "faults")]
            b'w' => self.well = false,
            #[cfg(all(feature = "faults", target_os = "none"))]
            b'h' => cortex_m::asm::udf(),
            #[cfg(feature = "faults")]
            b'p' => panic!("asked for"),
            b'\r' | b'\n' => {}
            _ => Text::to(out).text("? tells the status, s runs a step").end(),
        }
    }
}

impl Application for Console<'_> {
    fn on_bytes(&mut self, bytes: &[u8], status: &Status, out: &mut impl Write) {
        for byte in bytes {
            self.on_byte(*byte, status, out);
        }
    }

    fn observation(&mut self) -> Option<&[f32]> {
        self.asked = self.asked.checked_sub(1)?;
        let image = self.image.as_ref()?;
        let (observation, _) = image.self_test(self.next).or_else(|| image.self_test(0))?;
        self.next = if self.next + 1 < image.self_test_steps() { self.next + 1 } else { 0 };
        Some(bytemuck::must_cast_slice(observation))
    }

    fn on_action(&mut self, action: Result<&[f32], StepError>, out: &mut impl Write) {
        match action {
            Ok(action) => {
                let text = Text::to(out).text("action");
                action.iter().fold(text, |text, value| text.text(" ").hex(value.to_bits())).end();
            }
            Err(error) => Text::to(out).text("no action: error ").number(error.code().into()).end(),
        }
    }

    fn is_well(&mut self) -> bool {
        self.well
    }
}
