//! A serial port of two queues between an interrupt and the program: [`Wire`] is the interrupt's end, [`Port`] the
//! program's, with embedded-io's traits.

use core::convert::Infallible;
use core::sync::atomic::{AtomicU32, Ordering};

use embedded_io::{ErrorType, Read, ReadReady, Write, WriteReady};
use heapless::spsc::{Consumer, Producer, Queue};

use crate::seams::Uart;

/// Bytes that wait in each direction at most.
pub const ROOM: usize = LEN - 1;
/// Bytes of memory of a queue, one of which is always free. A power of two, for its remainders.
const LEN: usize = 512;

/// The memory of a port.
#[derive(Debug)]
pub struct Buffers {
    input: Queue<u8, LEN>,
    output: Queue<u8, LEN>,
    lost: AtomicU32,
}

impl Buffers {
    /// Empty.
    pub const fn new() -> Self {
        Self { input: Queue::new(), output: Queue::new(), lost: AtomicU32::new(0) }
    }

    /// Both ends. `kick` makes the interrupt of `uart` come: what it is to transmit is there.
    pub fn split<U: Uart>(&mut self, uart: U, kick: fn()) -> (Wire<'_, U>, Port<'_>) {
        let Self { input, output, lost } = self;
        let ((received, input), (output, waiting)) = (input.split(), output.split());
        (Wire { uart, input: received, output: waiting, lost }, Port { input, output, lost, kick })
    }
}

impl Default for Buffers {
    fn default() -> Self {
        Self::new()
    }
}

/// The interrupt's end.
pub struct Wire<'b, U> {
    uart: U,
    input: Producer<'b, u8>,
    output: Consumer<'b, u8>,
    lost: &'b AtomicU32,
}

impl<U: Uart> Wire<'_, U> {
    /// What the interrupt does: takes what has come, gives what can go.
    pub fn on_interrupt(&mut self) {
        let Self { uart, input, output, lost } = self;
        while let Some(byte) = uart.receive() {
            if !byte.is_ok_and(|byte| put(input, byte)) {
                // Written here alone, so a load and a store lose nothing.
                lost.store(lost.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
            }
        }
        // What puts bytes in cannot interrupt this, so a byte that is seen is whole.
        while let Some(byte) = output.peek() {
            if !uart.transmit(*byte) {
                break;
            }
            take(output);
        }
        uart.ask_for_room(output.ready());
    }
}

/// The program's end.
pub struct Port<'b> {
    input: Consumer<'b, u8>,
    output: Producer<'b, u8>,
    lost: &'b AtomicU32,
    kick: fn(),
}

impl Port<'_> {
    /// Bytes that were received and lost since the start, modulo 2^32: overrun, wrongly framed, or without room in the
    /// queue.
    pub fn lost(&self) -> u32 {
        self.lost.load(Ordering::Relaxed)
    }

    /// Lets what waits go on, where the interrupt does not come by itself; to be called again and again.
    pub fn pump(&self) {
        if has_bytes(&self.output) {
            (self.kick)();
        }
    }
}

impl ErrorType for Port<'_> {
    type Error = Infallible;
}

impl ReadReady for Port<'_> {
    fn read_ready(&mut self) -> Result<bool, Infallible> {
        Ok(self.input.ready())
    }
}

impl WriteReady for Port<'_> {
    fn write_ready(&mut self) -> Result<bool, Infallible> {
        Ok(has_room(&self.output))
    }
}

impl Read for Port<'_> {
    /// Waits for a byte, and takes as many as have come.
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
        if buffer.is_empty() {
            return Ok(0);
        }
        while !self.input.ready() {
            core::hint::spin_loop();
        }
        let mut read = 0;
        for (place, byte) in buffer.iter_mut().zip(core::iter::from_fn(|| take(&mut self.input))) {
            *place = byte;
            read += 1;
        }
        Ok(read)
    }
}

impl Write for Port<'_> {
    /// Waits for room, and gives as many bytes as there is.
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        if bytes.is_empty() {
            return Ok(0);
        }
        while !has_room(&self.output) {
            self.pump();
        }
        let written = bytes.iter().take_while(|byte| put(&mut self.output, **byte)).count();
        (self.kick)();
        Ok(written)
    }

    /// Waits for room for all of them. (The trait's own way panics where a port takes nothing.)
    fn write_all(&mut self, bytes: &[u8]) -> Result<(), Infallible> {
        for byte in bytes {
            while !put(&mut self.output, *byte) {
                self.pump();
            }
        }
        self.pump();
        Ok(())
    }

    /// Waits until all has gone to the transmitter.
    fn flush(&mut self) -> Result<(), Infallible> {
        while has_bytes(&self.output) {
            self.pump();
        }
        Ok(())
    }
}

// Producer and consumer refer to their queue as a view. The compiler then does not know its length, and each remainder
// is a division with a panic at zero. The comparison in these functions states the length, which makes it a mask. The
// test of the application's ELF file fails if a panic is left.

/// Puts a byte in; `false` if there is no room.
fn put(queue: &mut Producer<'_, u8>, byte: u8) -> bool {
    queue.capacity() == ROOM && queue.enqueue(byte).is_ok()
}

/// Takes the next byte, if there is one.
fn take(queue: &mut Consumer<'_, u8>) -> Option<u8> {
    if queue.capacity() == ROOM { queue.dequeue() } else { None }
}

/// Returns `true` if there is room for a byte.
fn has_room(queue: &Producer<'_, u8>) -> bool {
    queue.capacity() == ROOM && queue.ready()
}

/// Returns `true` if a byte that was put in has not been taken.
fn has_bytes(queue: &Producer<'_, u8>) -> bool {
    queue.capacity() == ROOM && !queue.is_empty()
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;
    use std::vec::Vec;

    use super::*;
    use crate::seams::Lost;

    /// A port with these bytes on its line; its transmitter has room for `room`.
    #[derive(Default)]
    struct Mock {
        line: VecDeque<Result<u8, Lost>>,
        sent: Vec<u8>,
        room: usize,
        asked: bool,
    }

    impl Uart for &mut Mock {
        fn receive(&mut self) -> Option<Result<u8, Lost>> {
            self.line.pop_front()
        }

        fn transmit(&mut self, byte: u8) -> bool {
            let room = self.sent.len() < self.room;
            if room {
                self.sent.push(byte);
            }
            room
        }

        fn ask_for_room(&mut self, on: bool) {
            self.asked = on;
        }
    }

    #[test]
    fn bytes_come_in_order_and_what_has_no_room_is_counted() {
        // The queue wraps.
        let mut mock = Mock::default();
        let mut buffers = Buffers::new();
        for start in 0..5u32 {
            let line = |i: u32| if i == 2 { Err(Lost) } else { Ok((start + i) as u8) };
            mock.line = (0..ROOM as u32 + 4).map(line).collect();
            let (mut wire, mut port) = buffers.split(&mut mock, || ());
            assert_eq!(port.read_ready(), Ok(false));
            wire.on_interrupt();
            let mut bytes = [0; 2 * ROOM];
            assert_eq!(port.read(&mut bytes), Ok(ROOM));
            let good = (0..ROOM as u32 + 1).filter(|i| *i != 2).map(|i| (start + i) as u8);
            assert!(bytes[..ROOM].iter().copied().eq(good));
            assert_eq!(port.lost(), 4 * (start + 1));
            assert_eq!(port.read(&mut []), Ok(0));
        }
    }

    #[test]
    fn what_the_transmitter_refuses_waits() {
        let mut mock = Mock { room: 2, ..Mock::default() };
        let mut buffers = Buffers::new();
        let (mut wire, mut port) = buffers.split(&mut mock, || ());
        assert_eq!(port.write(&[7; ROOM + 1]), Ok(ROOM), "as much as there is room");
        assert_eq!(port.write_ready(), Ok(false));
        wire.on_interrupt();
        assert!(wire.uart.asked);
        assert_eq!((port.write(&[1, 2, 3]), wire.uart.sent.len()), (Ok(2), 2));
        wire.uart.room = 2 * ROOM;
        wire.on_interrupt();
        assert_eq!((wire.uart.sent.len(), &wire.uart.sent[ROOM..], wire.uart.asked), (ROOM + 2, &[1, 2][..], false));
        assert_eq!(port.flush(), Ok(()));
    }
}
