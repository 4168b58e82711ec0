//! The members of a sweep: all combinations of the values of the swept quantities.

use super::sweep::{Slot, SweptQuantity, put};
use crate::runtime::Start;

/// The members of a sweep by their index; the last swept quantity varies fastest.
#[derive(Clone, Copy, Debug)]
pub struct Members<'s> {
    swept: &'s [SweptQuantity],
    start: &'s Start,
}

impl<'s> Members<'s> {
    pub(crate) fn new(swept: &'s [SweptQuantity], start: &'s Start) -> Self {
        Members { swept, start }
    }

    /// The number of members: 1 where nothing is swept.
    pub fn count(&self) -> usize {
        self.swept.iter().map(|quantity| quantity.values.len()).product()
    }

    /// The swept quantities with their values for a member.
    fn quantities_of(&self, index: usize) -> impl Iterator<Item = (&'s SweptQuantity, f64)> {
        let mut after = self.count();
        self.swept.iter().filter_map(move |quantity| {
            after /= quantity.values.len().max(1);
            Some((quantity, *quantity.values.get(index / after.max(1) % quantity.values.len().max(1))?))
        })
    }

    /// The values of all swept quantities for a member, in their order.
    pub fn values(&self, index: usize) -> Vec<f64> {
        self.quantities_of(index).map(|(_, value)| value).collect()
    }

    /// The names of the swept parameters.
    pub fn parameters(&self) -> Vec<&'s str> {
        let of_parameters = self.swept.iter().filter(|quantity| quantity.slot == Slot::Parameter);
        of_parameters.map(|quantity| quantity.name.as_str()).collect()
    }

    /// The values of the swept parameters for a member.
    pub fn parameter_values(&self, index: usize) -> Vec<f64> {
        self.quantities_of(index)
            .filter(|(quantity, _)| quantity.slot == Slot::Parameter)
            .map(|(_, value)| value)
            .collect()
    }

    /// The initial state of a member.
    pub fn start(&self, index: usize) -> Start {
        let mut start = self.start.clone();
        for (quantity, value) in self.quantities_of(index) {
            if let Slot::Start(part, entry) = quantity.slot {
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
