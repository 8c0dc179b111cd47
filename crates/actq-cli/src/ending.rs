//! Work that ends by itself at a signal, because it leaves a robot safe or a recording whole.

use std::io::{self, Read};
use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::thread;
use std::time::Duration;

/// `true` while the work ends by itself after a signal.
static GRACEFUL: AtomicBool = AtomicBool::new(false);
/// The signal that the work was told of; 0 for none.
static STOP_SIGNAL: AtomicI32 = AtomicI32::new(0);

/// Time between two looks at the signal, for work that waits for input.
const LOOK: Duration = Duration::from_millis(20);

/// While this lives, the first signal ends the work, which asks [`stop_signal`], and a second one the process.
#[derive(Debug)]
pub(crate) struct EndsItself(());

impl EndsItself {
    pub(crate) fn begin() -> Self {
        GRACEFUL.store(true, Ordering::SeqCst);
        Self(())
    }
}

impl Drop for EndsItself {
    fn drop(&mut self) {
        GRACEFUL.store(false, Ordering::SeqCst);
    }
}

/// Tells the work of a signal. Returns `false` if it does not end by itself, or has been told before.
#[cfg(unix)]
pub(crate) fn request_stop(signal: i32) -> bool {
    GRACEFUL.load(Ordering::SeqCst) && STOP_SIGNAL.swap(signal, Ordering::SeqCst) == 0
}

/// Returns the signal that the work was told of, if any.
pub(crate) fn stop_signal() -> Option<i32> {
    Some(STOP_SIGNAL.load(Ordering::SeqCst)).filter(|signal| *signal != 0)
}

/// Standard input that ends at a signal, also while nothing arrives. While it lives, the work [`EndsItself`].
#[derive(Debug)]
pub(crate) struct Input {
    _ends_itself: EndsItself,
    blocks: Receiver<io::Result<Vec<u8>>>,
    block: io::Cursor<Vec<u8>>,
}

impl Input {
    /// Reads standard input in a thread of its own, which ends with the process.
    pub(crate) fn stdin() -> Self {
        let (sender, blocks) = sync_channel(1);
        thread::spawn(move || {
            let mut stdin = io::stdin().lock();
            loop {
                let mut block = vec![0; 64 << 10];
                let read = stdin.read(&mut block).map(|count| {
                    block.truncate(count);
                    block
                });
                let is_last = read.as_ref().map_or(true, Vec::is_empty);
                if sender.send(read).is_err() || is_last {
                    return;
                }
            }
        });
        Self { _ends_itself: EndsItself::begin(), blocks, block: io::Cursor::default() }
    }
}

impl Read for Input {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while self.block.position() == self.block.get_ref().len() as u64 {
            if stop_signal().is_some() {
                return Ok(0);
            }
            match self.blocks.recv_timeout(LOOK) {
                Ok(block) => {
                    let block = block?;
                    if block.is_empty() {
                        return Ok(0);
                    }
                    self.block = io::Cursor::new(block);
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Ok(0),
            }
        }
        self.block.read(buffer)
    }
}
