//! Whether a run is to end before its time, as from outside.

use std::fmt::{Debug, Formatter};

/// Who ends a run that is interrupted, for its [`Status`](crate::Status).
pub const INTERRUPTION: &str = "an interruption";

/// The steps between two questions: some hundred microseconds of short ones.
pub(crate) const BETWEEN: usize = 256;

/// A question that is asked from time to time while a motion is computed: whether to end it, as a user may wish who has pressed Ctrl-C.
#[derive(Clone, Copy)]
pub struct Interrupt<'a>(&'a (dyn Fn() -> bool + Sync));

impl<'a> Interrupt<'a> {
    /// Ends what is computed once this is true. It is asked every few hundred steps, on the threads of the runs.
    pub fn when(is_wanted: &'a (dyn Fn() -> bool + Sync)) -> Self {
        Interrupt(is_wanted)
    }

    pub(crate) fn is_wanted(self) -> bool {
        (self.0)()
    }
}

impl Debug for Interrupt<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.write_str("Interrupt")
    }
}
