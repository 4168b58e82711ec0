//! The resets along a run.

use crate::Reset;
use crate::run::{Observer, OutputRequest, StepView, Stop};
use std::ops::ControlFlow;

/// Records the resets along a run: the times at which the Lagrangian replaces the state
/// ([`at_switch`](contact_geom::Lagrangian::at_switch)), with the states before and after.
///
/// ```
/// use contact_examples::systems::UniformField;
/// use contact_geom::switching::{Impact, Impacts, Surface};
/// use contact_geom::{Scalar, VelocityPoint, nalgebra::SVector};
/// use discrete_herglotz::{GaussCollocation, Problem, Resets, Steps, Until};
/// struct Floor;
/// impl Surface<1> for Floor {
///     fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>) -> T {
///         q[0]
///     }
/// }
/// let ball = Impacts::new(UniformField::<1> { field: [-1.0], gamma: 0.0 }, Floor, Impact::Elastic);
/// let problem = Problem::new(&ball, 0.0, VelocityPoint::new([1.0], [0.0], 0.0))?;
/// let mut bounces = Resets::new();
/// problem.by(GaussCollocation { stages: 2 }).steps(Steps::Size(0.5)).observe(&mut bounces).run(Until::Time(5.0))?;
/// assert_eq!(bounces.resets.len(), 2);
/// # Ok::<(), discrete_herglotz::InputError>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct Resets {
    /// The resets so far, in the order of the run.
    pub resets: Vec<Reset>,
}

impl Resets {
    /// An observer that has seen no resets.
    pub fn new() -> Self {
        Resets { resets: Vec::new() }
    }
}

impl Observer for Resets {
    fn needs(&self) -> OutputRequest {
        OutputRequest::default()
    }

    fn step(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        self.resets.extend_from_slice(at.resets());
        ControlFlow::Continue(())
    }
}
