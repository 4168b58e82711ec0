//! Whether what is computed is to end before its time.

use std::fmt::{Debug, Formatter};
use std::sync::Arc;

/// A question that is asked from time to time while something is computed: whether to end it, as a user may wish who has pressed Ctrl-C.
#[derive(Clone)]
pub struct Interrupt(Arc<dyn Fn() -> bool + Send + Sync>);

impl Interrupt {
    /// Ends what is computed once this is true.
    pub fn when(is_wanted: impl Fn() -> bool + Send + Sync + 'static) -> Self {
        Interrupt(Arc::new(is_wanted))
    }

    /// Whether it is.
    pub fn is_wanted(&self) -> bool {
        (self.0)()
    }

    /// The same as integrators ask it.
    pub(crate) fn asked(&self) -> discrete_herglotz::Interrupt<'_> {
        discrete_herglotz::Interrupt::when(&*self.0)
    }
}

impl Debug for Interrupt {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.write_str("Interrupt")
    }
}
