//! Frames over a port that may break, and is opened again.

use std::io::{self, ErrorKind, Read as _, Write as _};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use actq_link::report::Counters;
use actq_link::{Message, Receiver, Sender, frame};
use anyhow::{Context as _, Result, bail};

use crate::event::Event;
use crate::port::{Address, Port};

/// Between two attempts to open a port again.
const RETRY: Duration = Duration::from_millis(200);
/// After so long without a good frame the controller may have started anew, and counts from the beginning.
const QUIET: Duration = Duration::from_millis(500);

/// Opens a port; called again where it has broken.
pub type Opener = Box<dyn FnMut() -> io::Result<Box<dyn Port>> + Send>;

/// A host's time in µs; wraps.
pub type Clock = Box<dyn Fn() -> u32 + Send>;

fn since_epoch() -> Duration {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default()
}

/// A link to a controller.
pub struct Connection {
    /// What errors call it.
    name: String,
    open: Opener,
    port: Option<Box<dyn Port>>,
    receiver: Receiver<{ frame::bytes(frame::MAX_PAYLOAD) }>,
    sender: Sender,
    /// What a frame says about its time, µs.
    clock: Clock,
    /// How long to try to open the port again.
    patience: Duration,
    /// Since when the port is gone.
    gone: Option<(Instant, io::Error)>,
    tried: Instant,
    heard: Instant,
    /// Whether anything has come.
    has_read: bool,
    /// Times that the port was opened again.
    reopened: u32,
}

impl Connection {
    /// Opens `address`; where it breaks later, tries for `patience` to open it again.
    ///
    /// # Errors
    ///
    /// Where it cannot be opened now.
    pub fn open(address: Address, patience: Duration) -> Result<Self> {
        Self::open_by(address.to_string(), Box::new(move || address.open()), patience)
    }

    /// As [`Self::open`], for a port that has no [`Address`]: `name` is what errors call it.
    ///
    /// # Errors
    ///
    /// As [`Self::open`].
    pub fn open_by(name: String, mut open: Opener, patience: Duration) -> Result<Self> {
        let port = open().with_context(|| format!("{name}: cannot be opened"))?;
        let now = Instant::now();
        // Ahead of what an earlier process has sent, as long as that was less than a thousand frames a second.
        let first = since_epoch().as_millis() as u32;
        Ok(Self {
            name,
            open,
            port: Some(port),
            receiver: Receiver::new(),
            sender: Sender::new(first),
            clock: Box::new(|| since_epoch().as_micros() as u32),
            patience,
            gone: None,
            tried: now,
            heard: now,
            has_read: false,
            reopened: 0,
        })
    }

    /// Takes the time from another clock than the system's: a simulator's.
    pub fn set_clock(&mut self, clock: Clock) {
        self.clock = clock;
    }

    /// Sends a message and gives its sequence number. On a port that is gone it is lost, as on any line.
    ///
    /// # Errors
    ///
    /// Where the message is longer than a frame may be.
    pub fn send(&mut self, message: &Message<'_>) -> Result<u32> {
        let number = self.sender.next();
        let mut buffer = [0; frame::wire_bytes(frame::MAX_PAYLOAD)];
        let wire =
            self.sender.frame(message, (self.clock)(), &mut buffer).context("the message is longer than a frame")?;
        // A zero first, so that a frame whose end was lost on the way does not take this one with it.
        self.raw(&[&[0], wire].concat());
        Ok(number)
    }

    /// Sends bytes that are no message: what tests need.
    pub fn raw(&mut self, bytes: &[u8]) {
        if let Some(port) = &mut self.port
            && let Err(error) = port.write_all(bytes).and_then(|()| port.flush())
        {
            self.lose(error);
        }
    }

    /// Reads what has come, at most for [`crate::port::WAIT`] where there is nothing.
    ///
    /// # Errors
    ///
    /// Where the port is gone and could not be opened again for the patience.
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
            std::thread::sleep(crate::port::WAIT);
            return Ok(());
        }
        self.tried = Instant::now();
        match ((self.open)(), &self.gone) {
            (Ok(port), _) => {
                (self.port, self.gone) = (Some(port), None);
                self.reopened += 1;
                self.receiver.reopen();
            }
            (Err(error), Some((since, first))) if since.elapsed() >= self.patience => {
                bail!("{}: lost ({first}), and not there again for {:.1?}: {error}", self.name, self.patience)
            }
            (Err(_), _) => {}
        }
        Ok(())
    }

    /// Times that the port was opened again.
    pub const fn reopened(&self) -> u32 {
        self.reopened
    }

    /// Why nothing is answered, as far as it can be seen here.
    pub(crate) const fn silence(&self) -> &'static str {
        match (self.has_read, self.counters().good) {
            (false, _) => "nothing came; is it a controller that runs, and has no other program the port?",
            (true, 0) => "what came is not this link's; is it a controller, and at this speed?",
            (true, _) => {
                "other frames came; are its firmware and this program of one version, and does the line carry both ways?"
            }
        }
    }

    /// What this end's receiver has seen.
    pub const fn counters(&self) -> Counters {
        self.receiver.counters()
    }
}
