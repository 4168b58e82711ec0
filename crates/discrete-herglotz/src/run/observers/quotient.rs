//! Quotients of dissipated quantities along a run.

use crate::State;
use crate::run::{Observer, OutputRequest, StepView, Stop};
use std::ops::ControlFlow;

/// A quantity `f(t, state)`.
type Quantity<'f> = Box<dyn FnMut(f64, &State) -> f64 + 'f>;

/// Observes the quotient of two quantities that are dissipated at the same rate. Momenta of symmetries, and the energy
/// of an autonomous motion, decay with the conformal factor; the quotient of two of them is conserved (section 2 of the
/// paper).
///
/// ```
/// use contact_examples::systems::Kepler;
/// use contact_geom::VelocityPoint;
/// use discrete_herglotz::{GaussCollocation, Problem, Quotient, State, Steps, Until};
/// let kepler = Kepler::<2> { mu: 1.0, gamma: -0.01 };
/// let problem = Problem::new(&kepler, 0.0, VelocityPoint::new([1.0, 0.0], [0.0, 1.1], 0.0))?;
/// let angular = |_, x: &State| x.q[0] * x.p[1] - x.q[1] * x.p[0];
/// let energy = |_, x: &State| 0.5 * x.p.norm_squared() - 1.0 / x.q.norm() + 0.01 * x.z;
/// let mut quotient = Quotient::new(angular, energy);
/// problem.by(GaussCollocation { stages: 8 }).steps(Steps::Size(0.1)).observe(&mut quotient).run(Until::Time(10.0))?;
/// assert!(quotient.largest_change() < 1e-12);
/// # Ok::<(), discrete_herglotz::InputError>(())
/// ```
pub struct Quotient<'f> {
    /// Times and quotients so far, those of the start first.
    pub rows: Vec<(f64, f64)>,
    above: Quantity<'f>,
    below: Quantity<'f>,
}

impl<'f> Quotient<'f> {
    /// The quotient of `above` by `below`.
    pub fn new(above: impl FnMut(f64, &State) -> f64 + 'f, below: impl FnMut(f64, &State) -> f64 + 'f) -> Self {
        Quotient { rows: Vec::new(), above: Box::new(above), below: Box::new(below) }
    }

    /// The largest change since the start, relative to the quotient there; NaN if a quotient is NaN.
    pub fn largest_change(&self) -> f64 {
        let Some((_, first)) = self.rows.first() else { return 0.0 };
        contact_geom::numbers::max_abs_or_nan(self.rows.iter().map(|(_, quotient)| (quotient - first) / first))
    }
}

impl Observer for Quotient<'_> {
    /// The quantities may depend on the action.
    fn needs(&self) -> OutputRequest {
        OutputRequest::ACTION
    }

    fn start(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        self.rows.clear();
        self.step(at)
    }

    fn step(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        let quotient = (self.above)(at.t, &at.state) / (self.below)(at.t, &at.state);
        self.rows.push((at.t, quotient));
        ControlFlow::Continue(())
    }
}
