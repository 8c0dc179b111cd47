//! The application's loop on the host, with a serial port and a watchdog that are none.

use std::cell::{Cell, RefCell};
use std::collections::VecDeque;

use actq::runtime::ImageBuffer;
use actq_bench::firmware::built_in;
use actq_boards::port::Buffers;
use actq_boards::seams::{Lost, Uart, Watchdog};
use actq_firmware_demo::application::{Application, Status};
use actq_firmware_demo::console::Console;
use actq_firmware_demo::output::Output;
use actq_firmware_demo::timing::Timing;
use actq_firmware_demo::work::Work;
use actq_kernels::{Head, StepError};
use anyhow::{Context, Result, ensure};
use embedded_io::Write;

/// Both directions of a line.
#[derive(Default)]
struct Line {
    to_board: VecDeque<u8>,
    from_board: Vec<u8>,
}

/// The board's end of it.
struct End<'l>(&'l RefCell<Line>);

impl Uart for End<'_> {
    fn receive(&mut self) -> Option<Result<u8, Lost>> {
        self.0.borrow_mut().to_board.pop_front().map(Ok)
    }

    fn transmit(&mut self, byte: u8) -> bool {
        self.0.borrow_mut().from_board.push(byte);
        true
    }

    fn ask_for_room(&mut self, _: bool) {}
}

/// Counts how often it was fed.
#[derive(Default)]
struct Fed(Cell<u32>);

impl Watchdog for Fed {
    fn start(&mut self, _: u16) -> bool {
        true
    }

    fn feed(&mut self) {
        self.0.set(self.0.get() + 1);
    }
}

fn buffers() -> &'static mut Buffers {
    Box::leak(Box::default())
}

#[test]
fn a_step_that_was_asked_for_comes_out_at_the_tick_and_at_the_port() -> Result<()> {
    let buffer = ImageBuffer::read(built_in()?)?;
    let image = buffer.image(built_in()?)?;
    let (observation, expected) = image.self_test(0).context("a self-test step is missing")?;
    ensure!(observation.len() == image.obs_len(), "a self-test step has no observation");
    let line = RefCell::new(Line { to_board: VecDeque::from(*b"s?"), ..Line::default() });
    let (mut wire, mut port) = buffers().split(End(&line), || ());
    let mut watchdog = Fed::default();
    let mut scratch = vec![0; image.scratch_words()];
    let head = Head::new(image, &mut scratch)?;
    let mut work = Work::new(Console::new(Some(image)), &mut port, &mut watchdog, Some(head), || 7);
    let mut output = Output::NONE;
    let mut turns = 0;
    while output.get().is_none() {
        wire.on_interrupt();
        work.turn(Timing::default(), |set| set(&mut output));
        turns += 1;
        ensure!(turns < 1000, "no action");
    }
    wire.on_interrupt();
    assert!(turns > 5, "a head of 330 thousand weights takes more than one slice");
    assert_eq!(watchdog.0.get(), turns, "fed in every turn");
    let bits: Vec<u32> = expected.iter().map(|word| u32::from_le(*word)).collect();
    let action: Vec<u32> = output.get().unwrap_or_default().iter().map(|value| value.to_bits()).collect();
    assert_eq!(action, bits);
    let said = String::from_utf8(line.borrow().from_board.clone())?;
    let (status, rest) = said.split_once('\n').context("two lines")?;
    assert!(status.starts_with("ready, ticks 0,") && status.ends_with("stack 7 bytes"), "{said}");
    let text: String = bits.iter().map(|bits| format!(" {bits:08x}")).collect();
    assert_eq!(rest, format!("action{text}\n"));
    Ok(())
}

/// Is never well, and shows observations that are no numbers.
#[derive(Default)]
struct Sick {
    errors: Vec<StepError>,
    observation: Vec<f32>,
}

impl Application for Sick {
    fn on_bytes(&mut self, _: &[u8], _: &Status, _: &mut impl Write) {}

    fn observation(&mut self) -> Option<&[f32]> {
        Some(&self.observation)
    }

    fn on_action(&mut self, action: Result<&[f32], StepError>, _: &mut impl Write) {
        self.errors.extend(action.err());
    }

    fn is_well(&mut self) -> bool {
        false
    }
}

#[test]
fn what_is_not_well_does_not_feed_and_a_bad_observation_gives_no_action() -> Result<()> {
    let buffer = ImageBuffer::read(built_in()?)?;
    let image = buffer.image(built_in()?)?;
    let line = RefCell::new(Line::default());
    let (_, mut port) = buffers().split(End(&line), || ());
    let mut watchdog = Fed::default();
    let mut scratch = vec![0; image.scratch_words()];
    let head = Head::new(image, &mut scratch)?;
    let sick = Sick { observation: vec![f32::NAN; image.obs_len()], ..Sick::default() };
    let mut work = Work::new(sick, &mut port, &mut watchdog, Some(head), || 0);
    let mut output = Output::NONE;
    for _ in 0..3 {
        work.turn(Timing::default(), |set| set(&mut output));
    }
    assert_eq!(work.application.errors, [StepError::ObservationNotFinite { index: 0 }; 3]);
    assert_eq!((output.get(), watchdog.0.get()), (None, 0));
    Ok(())
}
