//! Long work in a thread of its own, while the calling thread waits for signals, progress and questions.
//!
//! The work holds no lock of Python. Ctrl-C, or an exception of a callback, is raised at once, and the thread is
//! abandoned: at its next report of progress it unwinds, and everything that it holds is dropped. It writes no files but
//! temporary ones: the calling thread writes the results, so that nothing is written after an interrupt.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use pyo3::prelude::*;

use crate::error::{error, raise};
use crate::process::refuse_forked;

/// Time between two looks at signals and progress.
const INTERVAL: Duration = Duration::from_millis(50);

/// A call of Python on behalf of the work, which waits for it.
type Call = Box<dyn FnOnce(Python<'_>) -> PyResult<()> + Send>;

enum Event<T> {
    Call(Call),
    Done(thread::Result<anyhow::Result<T>>),
}

/// The state that the two threads share.
#[derive(Default)]
struct Shared {
    is_abandoned: AtomicBool,
    /// The present work and its share, if they are new.
    progress: Mutex<Option<(String, f64)>>,
}

/// The payload of the unwinding of abandoned work.
struct Abandoned;

/// The work's end of the connection.
pub(crate) struct Worker {
    shared: Arc<Shared>,
    call: Box<dyn Fn(Call) + Send>,
}

impl Worker {
    /// Reports the present work and the share of it that is done.
    pub(crate) fn report(&self, work: &str, share: f64) {
        if self.shared.is_abandoned.load(Ordering::Relaxed) {
            // Unlike a panic, it prints nothing.
            resume_unwind(Box::new(Abandoned));
        }
        *self.shared.progress.lock().unwrap_or_else(PoisonError::into_inner) = Some((work.to_owned(), share));
    }

    /// Calls Python in the thread that waits, and returns the result. It does not return if the call fails: that thread
    /// raises the exception.
    pub(crate) fn call<R: Send + 'static>(&self, call: impl FnOnce(Python<'_>) -> PyResult<R> + Send + 'static) -> R {
        let (sender, receiver) = channel();
        (self.call)(Box::new(move |py| {
            // A receiver that is gone has no use for it.
            drop(sender.send(call(py)?));
            Ok(())
        }));
        receiver.recv().unwrap_or_else(|_| resume_unwind(Box::new(Abandoned)))
    }
}

/// Does `work` in a thread, and returns its result. `progress` is `None`, or called as `progress(work, share)`.
pub(crate) fn run<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Worker) -> anyhow::Result<T> + Send + 'static,
) -> PyResult<T> {
    refuse_forked()?;
    interruptible(py, progress, work)
}

/// As [`run`], for work in one thread, which a forked process can do, too.
pub(crate) fn interruptible<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Worker) -> anyhow::Result<T> + Send + 'static,
) -> PyResult<T> {
    let shared = Arc::new(Shared::default());
    let events = start(&shared, work)?;
    let result = wait(py, progress, &shared, &Mutex::new(events));
    shared.is_abandoned.store(true, Ordering::Relaxed);
    result
}

fn start<T: Send + 'static>(
    shared: &Arc<Shared>,
    work: impl FnOnce(&Worker) -> anyhow::Result<T> + Send + 'static,
) -> PyResult<Receiver<Event<T>>> {
    let (sender, receiver) = channel();
    let calls: Sender<Event<T>> = sender.clone();
    let call = Box::new(move |call| drop(calls.send(Event::Call(call))));
    let worker = Worker { shared: shared.clone(), call };
    let run = move || {
        let outcome = catch_unwind(AssertUnwindSafe(|| work(&worker)));
        drop(sender.send(Event::Done(outcome)));
    };
    thread::Builder::new().name("actq".to_owned()).spawn(run).map_err(raise)?;
    Ok(receiver)
}

fn wait<T: Send>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    shared: &Shared,
    events: &Mutex<Receiver<Event<T>>>,
) -> PyResult<T> {
    loop {
        let event = py.detach(|| events.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(INTERVAL));
        py.check_signals()?;
        let news = shared.progress.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let (Some(progress), Some(news)) = (progress, news) {
            progress.call1(news)?;
        }
        match event {
            Ok(Event::Call(call)) => call(py)?,
            Ok(Event::Done(Ok(outcome))) => return outcome.map_err(raise),
            Ok(Event::Done(Err(panic))) => resume_unwind(panic),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return Err(error!("the work ended without a result")),
        }
    }
}
