//! The discretisations of the action, one file each, and the table that generic tests walk.

mod left_midpoint;
mod midpoint;
mod rectangle;
mod trapezoidal;

pub use left_midpoint::{LeftMidpoint, LeftMidpointRule};
pub use midpoint::{Midpoint, MidpointRule};
pub use rectangle::{Rectangle, RectangleRule};
pub use trapezoidal::{Trapezoidal, TrapezoidalRule};

use crate::{DiscreteLagrangian, InputError, Quadrature, Rule};
use contact_geom::Lagrangian;

/// A method that makes a discrete Lagrangian from any regular Lagrangian.
pub trait Discretisation {
    /// The name in tables, in lower case with underscores.
    fn name(&self) -> &'static str;

    /// The order of the flow.
    fn order(&self) -> u32;

    /// The discrete Lagrangian of this method for a Lagrangian and a time step.
    ///
    /// # Errors
    /// [`InputError`] for a bad step.
    fn discretise<'a, const N: usize, L: Lagrangian<N>>(
        &self,
        lagrangian: &'a L,
        h: f64,
    ) -> Result<impl DiscreteLagrangian<N> + 'a, InputError>;
}

impl<R: Rule> Discretisation for R {
    fn name(&self) -> &'static str {
        R::NAME
    }

    fn order(&self) -> u32 {
        R::ORDER
    }

    fn discretise<'a, const N: usize, L: Lagrangian<N>>(
        &self,
        lagrangian: &'a L,
        h: f64,
    ) -> Result<impl DiscreteLagrangian<N> + 'a, InputError> {
        Quadrature::<&L, R>::new::<N>(lagrangian, h)
    }
}

/// Something done with every discretisation.
pub trait DiscretisationVisitor {
    /// Does it with one discretisation.
    fn visit(&mut self, method: &impl Discretisation);
}

/// Visits every discretisation of this crate.
pub fn visit_discretisations(visitor: &mut impl DiscretisationVisitor) {
    visitor.visit(&RectangleRule);
    visitor.visit(&LeftMidpointRule);
    visitor.visit(&MidpointRule);
    visitor.visit(&TrapezoidalRule);
}
