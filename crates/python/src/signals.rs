//! Signals of the user (Ctrl-C) during a run.

use herglotz_runtime::Interrupt;
use pyo3::prelude::*;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// The time between two checks for signals: short for a user, long for a run.
const SIGNAL_INTERVAL: Duration = Duration::from_millis(50);

/// The stack size of the thread of a computation, 8 MiB: that of a main thread. Numbers that carry derivatives are large.
const STACK_SIZE: usize = 1 << 23;

/// The time of the last check, and the exception that a signal handler has raised.
struct SignalState(Instant, Option<PyErr>);

/// Checks for signals at intervals, while the interpreter lock is released. Clones share their state.
#[derive(Clone)]
pub struct Signals(Arc<Mutex<SignalState>>);

impl Signals {
    pub fn new() -> Self {
        Signals(Arc::new(Mutex::new(SignalState(Instant::now(), None))))
    }

    fn state(&self) -> MutexGuard<'_, SignalState> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Checks whether to continue.
    pub fn check(&self) -> ControlFlow<()> {
        let mut state = self.state();
        if state.1.is_some() {
            return ControlFlow::Break(());
        }
        if state.0.elapsed() < SIGNAL_INTERVAL {
            return ControlFlow::Continue(());
        }
        state.0 = Instant::now();
        match Python::attach(|py| py.check_signals()) {
            Ok(()) => ControlFlow::Continue(()),
            Err(raised) => {
                state.1 = Some(raised);
                ControlFlow::Break(())
            }
        }
    }

    /// The same check as an interrupt of plans.
    pub fn interrupt(&self) -> Interrupt {
        let signals = self.clone();
        Interrupt::when(move || signals.check().is_break())
    }

    /// The exception that a signal handler has raised; it is cleared.
    pub fn take(&self) -> Option<PyErr> {
        self.state().1.take()
    }
}

/// Reports nothing.
pub fn no_report(_py: Python<'_>) -> PyResult<()> {
    Ok(())
}

/// Runs `work` on a thread of its own, while this thread, the only one on which Python handles signals, checks for
/// them, and calls `report`. An exception of a handler, or of the report, is signalled to the work by the flag, and is
/// returned together with its result.
pub fn with_signals<T: Send>(
    py: Python<'_>,
    report: impl Fn(Python<'_>) -> PyResult<()> + Send,
    work: impl FnOnce(&Arc<AtomicBool>) -> T + Send,
) -> PyResult<(T, Option<PyErr>)> {
    let ended = Arc::new(AtomicBool::new(false));
    let (done, waits) = channel();
    let (found, raised) = py.detach(move || {
        std::thread::scope(|scope| {
            let (flag, mut raised) = (&ended, None);
            let worker = std::thread::Builder::new().stack_size(STACK_SIZE).spawn_scoped(scope, move || {
                let found = work(flag);
                // Dropping the sender wakes the waiting thread.
                drop(done);
                found
            })?;
            while let Err(RecvTimeoutError::Timeout) = waits.recv_timeout(SIGNAL_INTERVAL) as Result<(), _> {
                if raised.is_none()
                    && let Err(error) = Python::attach(|py| py.check_signals().and_then(|()| report(py)))
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

/// Runs `work` on a thread of its own: a computation that cannot be interrupted but ends after about a second. An
/// exception of a signal handler is raised at once, and the thread is left to finish.
pub fn leaving_at_signals<T: Send + 'static>(py: Python<'_>, work: impl FnOnce() -> T + Send + 'static) -> PyResult<T> {
    let (done, waits) = channel();
    std::thread::Builder::new().spawn(move || done.send(work()))?;
    py.detach(move || {
        loop {
            match waits.recv_timeout(SIGNAL_INTERVAL) {
                Ok(found) => return Ok(found),
                Err(RecvTimeoutError::Timeout) => Python::attach(|py| py.check_signals())?,
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(pyo3::exceptions::PyRuntimeError::new_err("the computation ended without a result"));
                }
            }
        }
    })
}
