//! The members of a sweep: all combinations of the values of the swept quantities.

use super::sweep::{Knob, Slot, put};
use crate::runtime::Start;

/// The members of a sweep by their index; the last swept quantity varies fastest.
#[derive(Clone, Copy, Debug)]
pub struct Members<'s> {
    knobs: &'s [Knob],
    start: &'s Start,
}

impl<'s> Members<'s> {
    pub(crate) fn new(knobs: &'s [Knob], start: &'s Start) -> Self {
        Members { knobs, start }
    }

    /// The number of members: 1 where nothing is swept.
    pub fn count(&self) -> usize {
        self.knobs.iter().map(|knob| knob.values.len()).product()
    }

    /// The swept quantities with their values for a member.
    fn knobs_of(&self, index: usize) -> impl Iterator<Item = (&'s Knob, f64)> {
        let mut after = self.count();
        self.knobs.iter().filter_map(move |knob| {
            after /= knob.values.len().max(1);
            Some((knob, *knob.values.get(index / after.max(1) % knob.values.len().max(1))?))
        })
    }

    /// The values of all swept quantities for a member, in their order.
    pub fn values(&self, index: usize) -> Vec<f64> {
        self.knobs_of(index).map(|(_, value)| value).collect()
    }

    /// The names of the swept parameters.
    pub fn parameters(&self) -> Vec<&'s str> {
        let of_parameters = self.knobs.iter().filter(|knob| knob.slot == Slot::Parameter);
        of_parameters.map(|knob| knob.name.as_str()).collect()
    }

    /// The values of the swept parameters for a member.
    pub fn parameter_values(&self, index: usize) -> Vec<f64> {
        self.knobs_of(index).filter(|(knob, _)| knob.slot == Slot::Parameter).map(|(_, value)| value).collect()
    }

    /// The initial state of a member.
    pub fn start(&self, index: usize) -> Start {
        let mut start = self.start.clone();
        for (knob, value) in self.knobs_of(index) {
            if let Slot::Start(part, entry) = knob.slot {
                put(&mut start, part, entry, value);
            }
        }
        start
    }

    /// The initial time, which all members share.
    pub fn t0(&self) -> f64 {
        self.start.t
    }
}
