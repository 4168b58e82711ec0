//! The members of a sweep: all combinations of the values of the swept quantities.

use super::combinations::Combinations;
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

    /// The combinations of the swept values.
    pub fn combinations(&self) -> Combinations<'s> {
        Combinations::new(self.swept)
    }

    /// The number of members: 1 where nothing is swept.
    pub fn count(&self) -> usize {
        self.combinations().count()
    }

    /// The values of all swept quantities for a member, in their order.
    pub fn values(&self, index: usize) -> Vec<f64> {
        self.combinations().values(index)
    }

    /// The names of the swept parameters.
    pub fn parameters(&self) -> Vec<&'s str> {
        let of_parameters = self.swept.iter().filter(|quantity| quantity.slot == Slot::Parameter);
        of_parameters.map(|quantity| quantity.name.as_str()).collect()
    }

    /// The values of the swept parameters for a member.
    pub fn parameter_values(&self, index: usize) -> Vec<f64> {
        let of_parameters = self.combinations().at(index).filter(|(quantity, _)| quantity.slot == Slot::Parameter);
        of_parameters.map(|(_, value)| value).collect()
    }

    /// The initial state of a member.
    pub fn start(&self, index: usize) -> Start {
        let mut start = self.start.clone();
        for (quantity, value) in self.combinations().at(index) {
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
