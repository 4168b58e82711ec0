//! The changes of the stages in an iteration, by kinds of variables.

use crate::numbers::lanes::Lanes;
use pulp::Simd;

/// The largest changes in an iteration, and the largest values, of each kind of variable.
pub(crate) struct Changes<S: Simd, const KINDS: usize> {
    change: [Lanes<S>; KINDS],
    size: [Lanes<S>; KINDS],
}

impl<S: Simd, const KINDS: usize> Changes<S, KINDS> {
    /// No changes yet, with the least values with which they are compared.
    #[inline(always)]
    pub fn compared_with(least: [Lanes<S>; KINDS]) -> Self {
        Changes { change: [Lanes::splat(0.0); KINDS], size: least }
    }

    #[inline(always)]
    pub fn see(&mut self, kind: usize, change: Lanes<S>, value: Lanes<S>) {
        self.change[kind] = self.change[kind].max(change.abs());
        self.size[kind] = self.size[kind].max(value.abs());
    }

    /// The largest change of one kind, relative to its largest value.
    #[inline(always)]
    pub fn relative(&self, kind: usize) -> f64 {
        let change = self.change[kind].reduce_max();
        if change > 0.0 { change / self.size[kind].reduce_max() } else { change }
    }

    /// The largest change of a kind relative to its largest value, over all kinds; NaN if one of them is.
    #[inline(always)]
    pub fn largest(&self) -> f64 {
        let mut largest = 0.0;
        for kind in 0..KINDS {
            let relative = self.relative(kind);
            // `f64::max` would hide a NaN.
            if relative > largest || relative.is_nan() {
                largest = relative;
            }
        }
        largest
    }
}
