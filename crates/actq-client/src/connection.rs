//! Frames over a port that is reopened when it breaks.

use std::io::{self, ErrorKind, Read as _, Write as _};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use actq_link::report::Counters;
use actq_link::{Message, Receiver, Sender, frame};
use anyhow::{Context as _, Result, bail};

use crate::event::Event;
use crate::port::{Address, Port};

/// Time between two attempts to reopen a port.
const RETRY: Duration = Duration::from_millis(200);
/// Time without a good frame after which the controller may have restarted, with new sequence numbers.
const QUIET: Duration = Duration::from_millis(500);

/// Opens a port; called again after it broke.
pub type Opener = Box<dyn FnMut() -> io::Result<Box<dyn Port>> + Send>;

/// A host's time in µs; wraps.
pub type Clock = Box<dyn Fn() -> u32 + Send>;

fn since_epoch() -> Duration {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default()
}

/// A link to a controller.
pub struct Connection {
    /// Name of the port in errors.
    name: String,
    open: Opener,
    port: Option<Box<dyn Port>>,
    receiver: Receiver<{ frame::bytes(frame::MAX_PAYLOAD) }>,
    sender: Sender,
    /// Clock for the frames' times, in µs.
    clock: Clock,
    /// Time after which reopening the port is given up.
    timeout: Duration,
    /// Time and error of the port's loss.
    gone: Option<(Instant, io::Error)>,
    tried: Instant,
    heard: Instant,
    /// `true` after the first received byte.
    has_read: bool,
    /// Number of times that the port was reopened.
    reopened: u32,
}

impl Connection {
    /// Opens `address`. If it breaks later, tries to reopen it for `timeout`.
    ///
    /// # Errors
    ///
    /// Fails if it cannot be opened now.
    pub fn open(address: Address, timeout: Duration) -> Result<Self> {
        Self::open_with(address.to_string(), Box::new(move || address.open()), timeout)
    }

    /// Opens a port that has no [`Address`], as [`Self::open`] does; errors use `name`.
    ///
    /// # Errors
    ///
    /// Fails as [`Self::open`] does.
    pub fn open_with(name: String, mut open: Opener, timeout: Duration) -> Result<Self> {
        let port = open().with_context(|| format!("{name}: the port cannot be opened"))?;
        let now = Instant::now();
        // Larger than the numbers of an earlier process that sent fewer than a thousand frames a second.
        let first = since_epoch().as_millis() as u32;
        // From the time of day, so that a process continues the times of an earlier one, and then monotonic: a clock
        // that is set back would make observations old.
        let start = since_epoch().as_micros() as u32;
        let clock = Box::new(move || start.wrapping_add(now.elapsed().as_micros() as u32));
        Ok(Self {
            name,
            open,
            port: Some(port),
            receiver: Receiver::new(),
            sender: Sender::new(first),
            clock,
            timeout,
            gone: None,
            tried: now,
            heard: now,
            has_read: false,
            reopened: 0,
        })
    }

    /// Replaces the system's clock by another one, such as a simulator's.
    pub fn set_clock(&mut self, clock: Clock) {
        self.clock = clock;
    }

    /// Sends a message and returns its sequence number. Without a port the message is lost, as on any line.
    ///
    /// # Errors
    ///
    /// Fails if the message is longer than a frame.
    pub fn send(&mut self, message: &Message<'_>) -> Result<u32> {
        let number = self.sender.next();
        let mut buffer = [0; frame::wire_bytes(frame::MAX_PAYLOAD)];
        let wire =
            self.sender.frame(message, (self.clock)(), &mut buffer).context("the message is longer than a frame")?;
        // A zero first, so that an earlier frame whose end was lost does not merge with this one.
        self.raw(&[&[0], wire].concat());
        Ok(number)
    }

    /// Sends bytes that are not a message, for tests.
    pub fn raw(&mut self, bytes: &[u8]) {
        if let Some(port) = &mut self.port
            && let Err(error) = port.write_all(bytes).and_then(|()| port.flush())
        {
            self.lose(error);
        }
    }

    /// Reads the received bytes; waits at most [`crate::port::READ_TIMEOUT`] if there are none.
    ///
    /// # Errors
    ///
    /// Fails if the port is lost and could not be reopened within the timeout.
    pub fn poll(&mut self, mut event: impl FnMut(Event)) -> Result<()> {
        if self.heard.elapsed() > QUIET {
            self.receiver.reopen();
            self.heard = Instant::now();
        }
        let Some(port) = &mut self.port else { return self.reopen() };
        let mut bytes = [0; 4096];
        match port.read(&mut bytes) {
            Ok(0) => self.lose(ErrorKind::UnexpectedEof.into()),
            Ok(count) => {
                self.has_read = true;
                for byte in bytes.iter().take(count) {
                    let Some(received) = self.receiver.push(*byte) else { continue };
                    self.heard = Instant::now();
                    Event::of(&received.message, received.micros).into_iter().for_each(&mut event);
                }
            }
            Err(e) if matches!(e.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted) => {}
            Err(error) => self.lose(error),
        }
        Ok(())
    }

    fn lose(&mut self, error: io::Error) {
        self.port = None;
        self.gone.get_or_insert((Instant::now(), error));
    }

    fn reopen(&mut self) -> Result<()> {
        if self.tried.elapsed() < RETRY {
            std::thread::sleep(crate::port::READ_TIMEOUT);
            return Ok(());
        }
        self.tried = Instant::now();
        match ((self.open)(), &self.gone) {
            (Ok(port), _) => {
                (self.port, self.gone) = (Some(port), None);
                self.reopened += 1;
                self.receiver.reopen();
            }
            (Err(error), Some((since, first))) if since.elapsed() >= self.timeout => {
                bail!("{}: connection lost ({first}) and not reopened within {:.1?}: {error}", self.name, self.timeout)
            }
            (Err(_), _) => {}
        }
        Ok(())
    }

    /// Returns `true` unless the port is lost.
    pub(crate) const fn is_open(&self) -> bool {
        self.port.is_some()
    }

    /// Number of times that the port was reopened.
    pub const fn reopened(&self) -> u32 {
        self.reopened
    }

    /// Returns the likely reason for missing answers.
    pub(crate) const fn silence(&self) -> &'static str {
        match (self.has_read, self.counters().good) {
            (false, _) => {
                "no bytes received; check that the controller runs and that no other program has the port open"
            }
            (true, 0) => "no valid frame received; check that this is a controller's port and that the speed matches",
            (true, _) => {
                "only other frames received; check that firmware and program have the same version and that the line works both ways"
            }
        }
    }

    /// Returns the counters of this end's receiver.
    pub const fn counters(&self) -> Counters {
        self.receiver.counters()
    }
}
