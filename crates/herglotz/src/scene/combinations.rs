//! The combinations of the values of swept quantities.

use super::sweep::SweptQuantity;

/// All combinations of the values of swept quantities, by an index; the last quantity varies fastest.
#[derive(Clone, Copy, Debug)]
pub struct Combinations<'s>(&'s [SweptQuantity]);

impl<'s> Combinations<'s> {
    pub(crate) fn new(swept: &'s [SweptQuantity]) -> Self {
        Combinations(swept)
    }

    /// The swept quantities.
    pub fn swept(&self) -> &'s [SweptQuantity] {
        self.0
    }

    /// Their number: 1 where nothing is swept.
    pub fn count(&self) -> usize {
        self.0.iter().map(|quantity| quantity.values.len()).product()
    }

    /// The swept quantities with their values for an index.
    pub fn at(&self, index: usize) -> impl Iterator<Item = (&'s SweptQuantity, f64)> + use<'s> {
        let mut after = self.count();
        self.0.iter().filter_map(move |quantity| {
            after /= quantity.values.len().max(1);
            Some((quantity, *quantity.values.get(index / after.max(1) % quantity.values.len().max(1))?))
        })
    }

    /// The values of all swept quantities for an index, in their order.
    pub fn values(&self, index: usize) -> Vec<f64> {
        self.at(index).map(|(_, value)| value).collect()
    }
}
