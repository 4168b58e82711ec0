//! Sums that may carry their rounding.

use contact_geom::nalgebra::SVector;

/// A vector that many small changes are added to, with what rounding has taken from it so far.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sum<const N: usize> {
    pub(super) value: SVector<f64, N>,
    carry: SVector<f64, N>,
}

impl<const N: usize> Sum<N> {
    pub(super) fn new(value: SVector<f64, N>) -> Self {
        Sum { value, carry: SVector::zeros() }
    }

    /// Adds `change(i, value_i)` to each component; compensated by Kahan's sum.
    #[inline(always)]
    pub(super) fn add<const COMPENSATED: bool>(&mut self, change: impl Fn(usize, f64) -> f64) {
        for i in 0..N {
            let before = self.value[i];
            if COMPENSATED {
                let change = change(i, before) + self.carry[i];
                self.value[i] = before + change;
                self.carry[i] = change - (self.value[i] - before);
            } else {
                self.value[i] = before + change(i, before);
            }
        }
    }
}
