//! Interruption of a computation.

use std::fmt::{Debug, Formatter};
use std::sync::Arc;

/// A condition that is polled during a computation and ends it, for example when the user has pressed Ctrl-C.
#[derive(Clone)]
pub struct Interrupt(Arc<dyn Fn() -> bool + Send + Sync>);

impl Interrupt {
    /// Ends the computation once the condition is true.
    pub fn when(is_wanted: impl Fn() -> bool + Send + Sync + 'static) -> Self {
        Interrupt(Arc::new(is_wanted))
    }

    /// Whether the condition is true.
    pub fn is_wanted(&self) -> bool {
        (self.0)()
    }

    /// The same condition in the form that integrators take.
    pub(crate) fn for_integrators(&self) -> discrete_herglotz::Interrupt<'_> {
        discrete_herglotz::Interrupt::when(&*self.0)
    }
}

impl Debug for Interrupt {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.write_str("Interrupt")
    }
}
