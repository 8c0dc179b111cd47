//! A serial port with two queues between an interrupt and the program: [`Wire`] is the interrupt's end, [`Port`] the
//! program's. Neither waits for the other or for the line.

use core::convert::Infallible;

use embedded_io::{ErrorType, Read, ReadReady};
use heapless::spsc::{Consumer, Producer, Queue};

use crate::hal::Uart;

/// Memory of a port: two queues of `LEN` bytes, each with one byte always free. `LEN` is a power of two, so that its
/// remainders are masks.
#[derive(Debug)]
pub struct Buffers<const LEN: usize> {
    input: Queue<u8, LEN>,
    output: Queue<u8, LEN>,
}

impl<const LEN: usize> Buffers<LEN> {
    /// Creates empty queues.
    pub const fn new() -> Self {
        Self { input: Queue::new(), output: Queue::new() }
    }

    /// Splits the port into its ends. `kick` triggers the interrupt of `uart` when there are bytes to transmit.
    pub fn split<U: Uart>(&mut self, uart: U, kick: fn()) -> (Wire<'_, U, LEN>, Port<'_, LEN>) {
        let Self { input, output } = self;
        let ((received, input), (output, waiting)) = (input.split(), output.split());
        (Wire { uart, input: received, output: waiting }, Port { input, output, kick })
    }
}

impl<const LEN: usize> Default for Buffers<LEN> {
    fn default() -> Self {
        Self::new()
    }
}

/// The interrupt's end.
pub struct Wire<'b, U, const LEN: usize> {
    uart: U,
    input: Producer<'b, u8>,
    output: Consumer<'b, u8>,
}

impl<U: Uart, const LEN: usize> Wire<'_, U, LEN> {
    /// Handles the interrupt: takes received bytes and transmits waiting ones.
    pub fn on_interrupt(&mut self) {
        let Self { uart, input, output } = self;
        while let Some(byte) = uart.receive() {
            // A byte that is lost here damages its frame, which the link counts.
            if let Ok(byte) = byte {
                put::<LEN>(input, byte);
            }
        }
        // The producer cannot interrupt this function, so a visible byte is complete.
        while let Some(byte) = output.peek() {
            if !uart.transmit(*byte) {
                break;
            }
            take::<LEN>(output);
        }
        uart.set_transmit_interrupt(output.ready());
    }
}

/// The program's end.
pub struct Port<'b, const LEN: usize> {
    input: Consumer<'b, u8>,
    output: Producer<'b, u8>,
    kick: fn(),
}

impl<const LEN: usize> Port<'_, LEN> {
    /// Triggers the transmission of waiting bytes, for ports whose interrupt does not come automatically. Call it
    /// regularly.
    pub fn pump(&self) {
        if has_bytes::<LEN>(&self.output) {
            (self.kick)();
        }
    }

    /// Queues a frame to transmit as a whole. Returns `false`, with nothing queued, if it does not fit, such as when
    /// the other end does not read.
    pub fn send(&mut self, frame: &[u8]) -> bool {
        let has_room = room::<LEN>(&self.output) >= frame.len();
        if has_room {
            frame.iter().for_each(|byte| _ = put::<LEN>(&mut self.output, *byte));
        }
        self.pump();
        has_room
    }
}

impl<const LEN: usize> ErrorType for Port<'_, LEN> {
    type Error = Infallible;
}

impl<const LEN: usize> ReadReady for Port<'_, LEN> {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(self.input.ready())
    }
}

impl<const LEN: usize> Read for Port<'_, LEN> {
    /// Waits for a byte, then takes all received bytes that fit.
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        if buffer.is_empty() {
            return Ok(0);
        }
        while !self.input.ready() {
            core::hint::spin_loop();
        }
        let mut read = 0;
        for (place, byte) in buffer.iter_mut().zip(core::iter::from_fn(|| take::<LEN>(&mut self.input))) {
            *place = byte;
            read += 1;
        }
        Ok(read)
    }
}

// Producer and consumer refer to their queue as a view, whose length the compiler does not know. So each remainder
// would be a division with a panic at zero. The comparison in these functions states the length, which makes it a mask.
// The test of the application's ELF file fails if a panic remains.

/// Queues a byte; returns `false` if the queue is full.
fn put<const LEN: usize>(queue: &mut Producer<'_, u8>, byte: u8) -> bool {
    queue.capacity() == LEN - 1 && queue.enqueue(byte).is_ok()
}

/// Takes the next byte, if any.
fn take<const LEN: usize>(queue: &mut Consumer<'_, u8>) -> Option<u8> {
    if queue.capacity() == LEN - 1 { queue.dequeue() } else { None }
}

/// Returns the free bytes of the queue.
fn room<const LEN: usize>(queue: &Producer<'_, u8>) -> usize {
    if queue.capacity() == LEN - 1 { LEN - 1 - queue.len() } else { 0 }
}

/// Returns `true` if a queued byte has not been taken.
fn has_bytes<const LEN: usize>(queue: &Producer<'_, u8>) -> bool {
    queue.capacity() == LEN - 1 && !queue.is_empty()
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;
    use std::vec;
    use std::vec::Vec;

    use super::*;
    use crate::hal::UartError;

    /// A UART with these bytes on its line; its transmitter takes `room` bytes.
    #[derive(Default)]
    struct Mock {
        line: VecDeque<Result<u8, UartError>>,
        sent: Vec<u8>,
        room: usize,
        asked: bool,
    }

    impl Uart for &mut Mock {
        fn receive(&mut self) -> Option<Result<u8, UartError>> {
            self.line.pop_front()
        }

        fn transmit(&mut self, byte: u8) -> bool {
            let room = self.sent.len() < self.room;
            if room {
                self.sent.push(byte);
            }
            room
        }

        fn set_transmit_interrupt(&mut self, on: bool) {
            self.asked = on;
        }
    }

    const LEN: usize = 16;
    const ROOM: usize = LEN - 1;

    #[test]
    fn bytes_keep_their_order_and_wrong_ones_are_left_out() {
        // The queue wraps.
        let mut mock = Mock::default();
        let mut buffers = Buffers::<LEN>::new();
        for start in 0..5u32 {
            let line = |i: u32| if i == 2 { Err(UartError) } else { Ok((start + i) as u8) };
            mock.line = (0..ROOM as u32 + 4).map(line).collect();
            let (mut wire, mut port) = buffers.split(&mut mock, || ());
            assert_eq!(port.read_ready(), Ok(false));
            wire.on_interrupt();
            let mut bytes = [0; 2 * ROOM];
            assert_eq!(port.read(&mut bytes), Ok(ROOM));
            let good = (0..ROOM as u32 + 1).filter(|i| *i != 2).map(|i| (start + i) as u8);
            assert!(bytes[..ROOM].iter().copied().eq(good));
            assert_eq!(port.read(&mut []), Ok(0));
        }
    }

    /// Applies all sequences of six calls to ports of this length, and compares them with queues that have no length.
    fn sequences_keep_order<const LEN: usize>() {
        for case in 0..7usize.pow(6) {
            let (mut mock, mut buffers) = (Mock::default(), Buffers::<LEN>::new());
            let (mut wire, mut port) = buffers.split(&mut mock, || ());
            let (mut input, mut output, mut sent) = (VecDeque::new(), VecDeque::<u8>::new(), Vec::new());
            for (i, call) in (0..6).map(|i| case / 7usize.pow(i) % 7).enumerate() {
                let bytes: Vec<u8> = (0..LEN).map(|k| (LEN * i + k) as u8).collect();
                match call {
                    frame @ 0..=2 => {
                        let frame = &bytes[..[1, LEN - 1, LEN][frame]];
                        let fits = output.len() + frame.len() < LEN;
                        assert_eq!(port.send(frame), fits);
                        output.extend(frame.iter().filter(|_| fits));
                    }
                    count @ 3..=4 => {
                        let count = [1, LEN][count - 3];
                        wire.uart.room += count;
                        wire.uart.line.extend(bytes[..count].iter().map(|byte| Ok(*byte)));
                        wire.on_interrupt();
                        sent.extend(output.drain(..output.len().min(wire.uart.room - sent.len())));
                        input.extend(&bytes[..count.min(LEN - 1 - input.len())]);
                        assert_eq!((&wire.uart.sent, wire.uart.asked), (&sent, !output.is_empty()));
                    }
                    count => {
                        let mut found = vec![0; [1, LEN][count - 5]];
                        let ready = !input.is_empty();
                        assert_eq!(port.read_ready(), Ok(ready));
                        // It waits for a byte.
                        let read = if ready { port.read(&mut found).unwrap_or_default() } else { 0 };
                        let expected: Vec<u8> = input.drain(..input.len().min(found.len())).collect();
                        assert_eq!(&found[..read], &expected[..]);
                    }
                }
            }
        }
    }

    #[test]
    fn short_queues_keep_every_sequence_of_calls_in_order() {
        sequences_keep_order::<2>();
        sequences_keep_order::<4>();
    }

    #[test]
    fn frames_are_sent_whole_or_not_at_all() {
        let mut mock = Mock { room: 2, ..Mock::default() };
        let mut buffers = Buffers::<LEN>::new();
        let (mut wire, mut port) = buffers.split(&mut mock, || ());
        assert!(!port.send(&[7; ROOM + 1]), "longer than the queue");
        assert!(port.send(&[7; ROOM - 1]) && !port.send(&[8, 9]) && port.send(&[1]), "frames that fit");
        wire.on_interrupt();
        assert_eq!((wire.uart.sent.len(), wire.uart.asked), (2, true));
        // The queue wraps.
        assert!(!port.send(&[8, 9, 10]) && port.send(&[2, 3]) && port.send(&[]));
        wire.uart.room = 2 * ROOM;
        wire.on_interrupt();
        assert_eq!((&wire.uart.sent[ROOM - 1..], wire.uart.asked), (&[1, 2, 3][..], false));
    }
}
