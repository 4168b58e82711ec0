//! Tests of runs.

mod accuracy;
mod coarse;
mod many_coordinates;
mod observed;
mod round_off;
mod watch;
