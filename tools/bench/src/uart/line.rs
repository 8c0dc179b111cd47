//! The line between host and board, and its faults.

use std::collections::VecDeque;
use std::io::{self, ErrorKind, Read, Write};
use std::mem;
use std::sync::{Arc, Mutex, MutexGuard};

use actq_client::event::Event;
use actq_client::port::Port;
use actq_link::{Receiver, frame};
use actq_ur3::random::Random;

/// Shares of the frames with a fault, in each direction; a frame has one fault at most.
#[derive(Clone, Copy, Debug, Default)]
pub struct Noise {
    /// Lost.
    pub drop: f64,
    /// Delayed by up to 150 ms, and so after newer frames.
    pub delay: f64,
    /// Sent twice.
    pub duplicate: f64,
    /// With a wrong byte.
    pub corrupt: f64,
}

/// The longest delay of a frame, µs.
const MAX_DELAY: f64 = 150_000.0;

/// Counts of the frames to the board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// All sent frames.
    pub sent: u32,
    /// Lost, including those sent while the line was cut.
    pub dropped: u32,
    /// Delayed.
    pub delayed: u32,
    /// Sent twice.
    pub duplicated: u32,
    /// With a wrong byte.
    pub corrupted: u32,
}

/// A message of the board.
pub(super) struct Heard {
    pub(super) event: Event,
    /// Frames before it that the board dropped, because its port had no room: the host reads too slowly.
    pub(super) dropped: u32,
}

/// A line with faults. Both its ends are in this process: [`Line::host_end`] is the host's port; the board's end is the
/// port that the line was created with.
#[derive(Clone)]
pub struct Line(Arc<Mutex<Wires>>);

struct Wires {
    board: Box<dyn Port>,
    /// Frames from the board, before any fault.
    tap: Receiver<{ frame::bytes(frame::MAX_PAYLOAD) }>,
    heard: VecDeque<Heard>,
    /// Sequence number of the board's next frame.
    next: u32,
    /// The board's time in µs, summed over its resets. It is the time of the line, as a busy machine stops QEMU now and
    /// then.
    now: u64,
    /// Time stamp of the board's last frame.
    micros: u32,
    down: Wire,
    up: Wire,
    noise: Noise,
    cut: bool,
    held: bool,
    random: Random,
}

/// A direction: an unfinished frame, and the frames on their way.
#[derive(Default)]
struct Wire {
    partial: Vec<u8>,
    waiting: Vec<(u64, Vec<u8>)>,
    tally: Tally,
}

impl Wire {
    /// Takes bytes; each complete frame may get a fault.
    fn take(&mut self, bytes: &[u8], now: u64, noise: &Noise, cut: bool, random: &mut Random) {
        for byte in bytes {
            self.partial.push(*byte);
            if *byte == 0 {
                let frame = mem::take(&mut self.partial);
                self.send(frame, now, noise, cut, random);
            }
        }
    }

    fn send(&mut self, mut frame: Vec<u8>, now: u64, noise: &Noise, cut: bool, random: &mut Random) {
        let content = frame.len() - 1;
        // A zero between frames is no frame.
        if content == 0 {
            if !cut {
                self.waiting.push((now, frame));
            }
            return;
        }
        self.tally.sent += 1;
        let (mut fate, tally) = (random.unit(), &mut self.tally);
        let mut falls = |share: f64| {
            fate -= share;
            fate < 0.0
        };
        if cut || falls(noise.drop) {
            tally.dropped += 1;
        } else if falls(noise.delay) {
            tally.delayed += 1;
            self.waiting.push((now + (MAX_DELAY * random.unit()) as u64, frame));
        } else if falls(noise.duplicate) {
            tally.duplicated += 1;
            self.waiting.extend([(now, frame.clone()), (now, frame)]);
        } else {
            if falls(noise.corrupt) {
                tally.corrupted += 1;
                let byte = &mut frame[(random.unit() * content as f64) as usize];
                // A different one, and not zero: that would split the frame.
                *byte = if *byte == 1 { 2 } else { *byte ^ 1 };
            }
            self.waiting.push((now, frame));
        }
    }

    /// Returns the bytes that have arrived, in the order of arrival.
    fn arrived(&mut self, now: u64) -> Vec<u8> {
        let (mut there, waiting): (Vec<_>, Vec<_>) =
            mem::take(&mut self.waiting).into_iter().partition(|(due, _)| *due <= now);
        self.waiting = waiting;
        there.sort_by_key(|(due, _)| *due);
        there.into_iter().flat_map(|(_, frame)| frame).collect()
    }
}

impl Wires {
    /// Delivers the arrived bytes to the board.
    fn deliver(&mut self) -> io::Result<()> {
        if self.held {
            return Ok(());
        }
        let bytes = self.down.arrived(self.now);
        self.board.write_all(&bytes)
    }

    /// Reads the bytes from the board.
    fn listen(&mut self) -> io::Result<()> {
        // Read everything: a host that falls behind would hear old times.
        let mut bytes = vec![0; 64 << 10];
        let count = match self.board.read(&mut bytes) {
            Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
            Ok(count) => count,
            Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => 0,
            Err(error) => return Err(error),
        };
        let bytes = bytes.get(..count).unwrap_or_default();
        for byte in bytes {
            // Accept all frames: after a reset the board counts from 0.
            self.tap.reopen();
            let Some(received) = self.tap.push(*byte) else { continue };
            // After a reset the board's time and numbers start at 0.
            let (passed, dropped) = match received.micros.checked_sub(self.micros) {
                Some(passed) => (passed, received.sequence.wrapping_sub(self.next)),
                None => (received.micros, received.sequence),
            };
            (self.now, self.micros) = (self.now + u64::from(passed), received.micros);
            self.next = received.sequence.wrapping_add(1);
            let event = Event::of(&received.message, received.micros);
            self.heard.extend(event.map(|event| Heard { event, dropped }));
        }
        self.up.take(bytes, self.now, &self.noise, self.cut, &mut self.random);
        Ok(())
    }
}

impl Line {
    /// Creates a line to a board, without faults. The seed draws later faults.
    pub fn new(board: Box<dyn Port>, seed: u64) -> Self {
        Self(Arc::new(Mutex::new(Wires {
            board,
            tap: Receiver::new(),
            heard: VecDeque::new(),
            next: 0,
            now: 0,
            micros: 0,
            down: Wire::default(),
            up: Wire::default(),
            noise: Noise::default(),
            cut: false,
            held: false,
            random: Random::new(seed),
        })))
    }

    fn wires(&self) -> MutexGuard<'_, Wires> {
        // A panic of another thread leaves nothing half-done: whole frames move.
        self.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    /// Returns the host's end.
    pub fn host_end(&self) -> Box<dyn Port> {
        Box::new(HostEnd(self.clone()))
    }

    /// Sets the shares of the faults.
    pub fn set_noise(&self, noise: Noise) {
        self.wires().noise = noise;
    }

    /// Cuts the line in both directions, or restores it.
    pub fn cut(&self, cut: bool) {
        self.wires().cut = cut;
    }

    /// Holds back the frames from the host, as a stalled driver does, or releases them all at once.
    pub fn hold(&self, held: bool) {
        self.wires().held = held;
    }

    /// Returns the board's time in µs, summed over its resets, as of its last frame.
    pub fn now(&self) -> u64 {
        self.wires().now
    }

    /// Returns the board's messages since the last call, before any fault.
    pub(super) fn heard(&self) -> VecDeque<Heard> {
        mem::take(&mut self.wires().heard)
    }

    /// Returns `true` while frames to the board are on their way.
    pub fn is_waiting(&self) -> bool {
        !self.wires().down.waiting.is_empty()
    }

    /// Returns the counts of the frames to the board.
    pub fn tally(&self) -> Tally {
        self.wires().down.tally
    }
}

struct HostEnd(Line);

impl Read for HostEnd {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let mut wires = self.0.wires();
        wires.deliver()?;
        wires.listen()?;
        let now = wires.now;
        let bytes = wires.up.arrived(now);
        let (head, rest) = bytes.split_at(bytes.len().min(buffer.len()));
        if !rest.is_empty() {
            wires.up.waiting.push((now, rest.to_vec()));
        }
        if head.is_empty() {
            return Err(ErrorKind::TimedOut.into());
        }
        buffer[..head.len()].copy_from_slice(head);
        Ok(head.len())
    }
}

impl Write for HostEnd {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut wires = self.0.wires();
        let Wires { down, now, noise, cut, random, .. } = &mut *wires;
        down.take(bytes, *now, noise, *cut, random);
        wires.deliver()?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.wires().board.flush()
    }
}

#[cfg(test)]
mod tests {
    use actq_link::{Message, Sender};

    use super::*;

    /// A silent board that stores the bytes it receives.
    #[derive(Clone, Default)]
    struct Board(Arc<Mutex<Vec<u8>>>);

    impl Read for Board {
        fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
            Err(ErrorKind::WouldBlock.into())
        }
    }

    impl Write for Board {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.lock().expect("no panic").extend(bytes);
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    /// Counts the frames of `frames` at a receiver on the board: good, damaged, repeated.
    fn heard(frames: u32, set: impl FnOnce(&Line)) -> ([u32; 3], Tally) {
        let board = Board::default();
        let line = Line::new(Box::new(board.clone()), 1);
        set(&line);
        let (mut end, mut sender) = (line.host_end(), Sender::new(0));
        for _ in 0..frames {
            let mut buffer = [0; 64];
            let frame = sender.frame(&Message::Disarm, 0, &mut buffer).expect("room");
            end.write_all(&[&[0], frame].concat()).expect("it takes all");
        }
        let mut receiver = Receiver::<64>::new();
        for byte in board.0.lock().expect("no panic").iter() {
            receiver.push(*byte);
        }
        let counters = receiver.counters();
        ([counters.good, counters.damaged, counters.repeated], line.tally())
    }

    #[test]
    fn each_fault_is_what_its_name_says() {
        let none = Noise::default();
        assert_eq!(heard(50, |_| ()), ([50, 0, 0], Tally { sent: 50, ..Tally::default() }));
        let (found, tally) = heard(500, |line| line.set_noise(Noise { drop: 0.2, ..none }));
        assert!((70..130).contains(&tally.dropped) && found == [500 - tally.dropped, 0, 0], "{tally:?} {found:?}");
        let (found, tally) = heard(500, |line| line.set_noise(Noise { corrupt: 0.2, ..none }));
        assert!((70..130).contains(&tally.corrupted), "{tally:?}");
        assert_eq!(found, [500 - tally.corrupted, tally.corrupted, 0]);
        let (found, tally) = heard(500, |line| line.set_noise(Noise { duplicate: 0.2, ..none }));
        assert!((70..130).contains(&tally.duplicated) && found == [500, 0, tally.duplicated], "{tally:?} {found:?}");
        // The board is silent, so its time stands still, and delayed frames do not arrive.
        let (found, tally) = heard(500, |line| line.set_noise(Noise { delay: 0.2, ..none }));
        assert!((70..130).contains(&tally.delayed) && found == [500 - tally.delayed, 0, 0], "{tally:?} {found:?}");
    }

    #[test]
    fn cuts_drop_frames_and_holds_delay_them() {
        assert_eq!(heard(50, |line| line.cut(true)).0, [0; 3]);
        let board = Board::default();
        let line = Line::new(Box::new(board.clone()), 1);
        line.hold(true);
        let mut end = line.host_end();
        end.write_all(&[1, 2, 0]).expect("it takes all");
        assert!(board.0.lock().expect("no panic").is_empty() && line.is_waiting());
        line.hold(false);
        end.write_all(&[1, 3, 0]).expect("it takes all");
        assert_eq!(*board.0.lock().expect("no panic"), [1, 2, 0, 1, 3, 0]);
    }
}
