//! Observers, which record a run and may end it.

pub(crate) mod checkpoint;
pub(crate) mod crossings;
#[cfg(feature = "csv")]
pub(crate) mod csv_rows;
pub(crate) mod event;
pub(crate) mod event_roots;
pub(crate) mod events;
pub(crate) mod interruption;
pub(crate) mod last_step;
pub(crate) mod momentum;
pub(crate) mod observer;
pub(crate) mod output_request;
pub(crate) mod progress;
pub(crate) mod quotient;
pub(crate) mod resets;
pub(crate) mod rows;
pub(crate) mod step_view;
