//! Named times of kinks and jumps.

use crate::dynamics::lagrangian::forward_lagrangian;
use crate::switching::Control;
use crate::{GeometryError, Hints, Lagrangian, Parametric, PhasePoint, Scalar, VelocityPoint};
use nalgebra::{SMatrix, SVector};

/// A [named time](Lagrangian::breaks) of a kink or a jump with its derivative in a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BreakRate {
    /// The time.
    pub time: f64,
    /// Its derivative.
    pub rate: f64,
}

/// A Lagrangian, or a Lagrangian with a force, that has a kink or a jump in time at each of these times: steps end
/// there, whatever the integrator.
///
/// ```
/// use contact_examples::systems::Pendulum;
/// use contact_geom::{Lagrangian, switching::Breaks};
/// let driven = Breaks::new(Pendulum { gamma: -0.1 }, vec![3.0, 1.0])?;
/// assert_eq!(Lagrangian::<1>::breaks(&driven), [1.0, 3.0]);
/// # Ok::<(), contact_geom::GeometryError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Breaks<L> {
    lagrangian: L,
    times: Vec<f64>,
}

impl<L> Breaks<L> {
    /// The Lagrangian with these times, in any order.
    ///
    /// # Errors
    /// [`GeometryError::NonFinite`] for a time that is not finite.
    pub fn new(lagrangian: L, mut times: Vec<f64>) -> Result<Self, GeometryError> {
        if let Some((index, &value)) = times.iter().enumerate().find(|(_, t)| !t.is_finite()) {
            return Err(GeometryError::NonFinite { what: "breaks", index, value });
        }
        times.sort_by(f64::total_cmp);
        times.dedup();
        Ok(Breaks { lagrangian, times })
    }
}

impl<const N: usize, L: Lagrangian<N>> Lagrangian<N> for Breaks<L> {
    const HINTS: Hints = Hints { switching_functions: true, over_slices: false, ..L::HINTS };

    forward_lagrangian!(of_value, self => self.lagrangian);
    forward_lagrangian!(of_force, self => self.lagrangian);

    fn structure(&self) -> crate::Structure {
        self.lagrangian.structure()
    }
    fn switching_functions(&self, t: f64, x: &VelocityPoint<N>, values: &mut Vec<f64>) {
        self.lagrangian.switching_functions(t, x, values);
    }
    fn at_switch(&self, index: usize, t: f64, x: &VelocityPoint<N>, rising: bool) -> Control<N> {
        self.lagrangian.at_switch(index, t, x, rising)
    }
    fn at_accumulation(&self, index: usize, t: f64, x: &VelocityPoint<N>) -> Control<N> {
        self.lagrangian.at_accumulation(index, t, x)
    }
    fn breaks(&self) -> &[f64] {
        &self.times
    }
    fn has_cones(&self) -> bool {
        self.lagrangian.has_cones()
    }
}

/// The parameters of the Lagrangian; the times are none of them, since a run is not differentiated in its breaks.
impl<const N: usize, L: Parametric<N>> Parametric<N> for Breaks<L> {
    fn parameter_names(&self) -> Vec<String> {
        self.lagrangian.parameter_names()
    }
    fn parameters(&self) -> Vec<f64> {
        self.lagrangian.parameters()
    }
    #[inline(always)]
    fn parameter_count(&self) -> usize {
        self.lagrangian.parameter_count()
    }
    fn with_parameters(&self, theta: &[f64]) -> Option<Self> {
        Some(Breaks { lagrangian: self.lagrangian.with_parameters(theta)?, times: self.times.clone() })
    }
    #[inline(always)]
    fn value_at<T: Scalar>(&self, theta: &[T], t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
        self.lagrangian.value_at(theta, t, q, v, z)
    }
    #[inline(always)]
    fn force_at<T: Scalar>(&self, theta: &[T], t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        self.lagrangian.force_at(theta, t, x)
    }
    #[inline(always)]
    fn hamiltonian_at<T: Scalar>(&self, theta: &[T], t: T, x: &PhasePoint<N, T>) -> Option<T> {
        self.lagrangian.hamiltonian_at(theta, t, x)
    }
    /// The times do not depend on the parameters.
    fn break_rates(&self, _parameter: usize) -> Option<Vec<BreakRate>> {
        Some(self.times.iter().map(|time| BreakRate { time: *time, rate: 0.0 }).collect())
    }
    fn switching_function_at<T: Scalar>(&self, theta: &[T], index: usize, t: T, x: &VelocityPoint<N, T>) -> Option<T> {
        self.lagrangian.switching_function_at(theta, index, t, x)
    }
    fn state_after_switch_at<T: Scalar>(
        &self,
        theta: &[T],
        index: usize,
        t: T,
        x: &VelocityPoint<N, T>,
    ) -> Option<VelocityPoint<N, T>> {
        self.lagrangian.state_after_switch_at(theta, index, t, x)
    }
}
