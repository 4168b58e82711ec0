//! Whether the user has asked to end a run.

use pyo3::prelude::*;
use runtime_herglotz::Interrupt;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// The time between two looks: short for a hand, long for a run.
const BETWEEN: Duration = Duration::from_millis(50);

/// The time of the last look, and what a signal's handler has raised.
struct Looked(Instant, Option<PyErr>);

/// Looks for signals from time to time, while the interpreter is left to others. Clones are of one and the same.
#[derive(Clone)]
pub struct Signals(Arc<Mutex<Looked>>);

impl Signals {
    pub fn new() -> Self {
        Signals(Arc::new(Mutex::new(Looked(Instant::now(), None))))
    }

    fn looked(&self) -> MutexGuard<'_, Looked> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether to go on.
    pub fn look(&self) -> ControlFlow<()> {
        let mut looked = self.looked();
        if looked.1.is_some() {
            return ControlFlow::Break(());
        }
        if looked.0.elapsed() < BETWEEN {
            return ControlFlow::Continue(());
        }
        looked.0 = Instant::now();
        match Python::attach(|py| py.check_signals()) {
            Ok(()) => ControlFlow::Continue(()),
            Err(raised) => {
                looked.1 = Some(raised);
                ControlFlow::Break(())
            }
        }
    }

    /// The same as a question that plans ask.
    pub fn interrupt(&self) -> Interrupt {
        let signals = self.clone();
        Interrupt::when(move || signals.look().is_break())
    }

    /// What a signal's handler has raised, which is forgotten.
    pub fn take(&self) -> Option<PyErr> {
        self.looked().1.take()
    }
}

/// Computes something on a thread of its own, while this one, which alone hears signals in Python, looks for them: what a handler raises is told
/// to the work, and comes back beside its result.
pub fn heard<T: Send>(py: Python<'_>, work: impl FnOnce(&Arc<AtomicBool>) -> T + Send) -> PyResult<(T, Option<PyErr>)> {
    let ended = Arc::new(AtomicBool::new(false));
    let (done, waits) = channel();
    let (found, raised) = py.detach(move || {
        std::thread::scope(|scope| {
            let (flag, mut raised) = (&ended, None);
            let worker = std::thread::Builder::new().spawn_scoped(scope, move || {
                let found = work(flag);
                // Who waits hears that it is over.
                drop(done);
                found
            })?;
            while let Err(RecvTimeoutError::Timeout) = waits.recv_timeout(BETWEEN) as Result<(), _> {
                if raised.is_none()
                    && let Err(error) = Python::attach(|py| py.check_signals())
                {
                    raised = Some(error);
                    ended.store(true, Ordering::Relaxed);
                }
            }
            Ok::<_, std::io::Error>((worker.join(), raised))
        })
    })?;
    match found {
        Ok(found) => Ok((found, raised)),
        Err(panic) => std::panic::resume_unwind(panic),
    }
}

/// Computes something that ends by itself after a second or so and asks no one, on a thread of its own: what a signal's handler raises is raised at once,
/// and the thread is left to its end.
pub fn heard_at_once<T: Send + 'static>(py: Python<'_>, work: impl FnOnce() -> T + Send + 'static) -> PyResult<T> {
    let (done, waits) = channel();
    std::thread::Builder::new().spawn(move || done.send(work()))?;
    py.detach(move || {
        loop {
            match waits.recv_timeout(BETWEEN) {
                Ok(found) => return Ok(found),
                Err(RecvTimeoutError::Timeout) => Python::attach(|py| py.check_signals())?,
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(pyo3::exceptions::PyRuntimeError::new_err(
                        "the computation has ended without a result",
                    ));
                }
            }
        }
    })
}
