//! Steps that end at named times.

use super::{GroupIntegrator, GroupState, GroupStep, ParametricGroupIntegrator};
use contact_geom::Scalar;
use contact_geom::groups::{GroupError, LieGroup};
use contact_geom::nalgebra::SVector;

/// An integrator of a Lagrangian or a force with kinks or jumps at known times, such as a pulse: a step that contains some
/// of them consists of parts that end there, by the same integrator.
///
/// ```
/// use contact_geom::groups::{GroupError, Inertia, LieGroup, NoPotential, RigidBody, Rotations};
/// use contact_geom::nalgebra::SVector;
/// use discrete_herglotz::groups::{GroupBreaks, GroupGauss, GroupMotion, GroupState};
/// let body = RigidBody::rotating(&Inertia::principal([1.0, 2.0, 3.0])?, NoPotential, -0.1)?;
/// let gauss = GroupGauss::new::<Rotations, 3>(&body, 4, 0.1)?;
/// let start = GroupState { g: Rotations::identity(), momentum: SVector::from([1.0, 1.0, 1.0]), z: 0.0 };
/// let mut motion = GroupMotion::<Rotations, 3>::new(0.0, start)?;
/// motion.advance(&GroupBreaks::new(gauss, vec![0.25, 0.37])?, 10)?;
/// # Ok::<(), GroupError>(())
/// ```
#[derive(Clone, Debug)]
pub struct GroupBreaks<I> {
    integrator: I,
    times: Vec<f64>,
}

impl<I> GroupBreaks<I> {
    /// The integrator with these times, in any order.
    ///
    /// # Errors
    /// [`GroupError::NonFinite`] for a time that is not finite.
    pub fn new(integrator: I, mut times: Vec<f64>) -> Result<Self, GroupError> {
        if let Some(&value) = times.iter().find(|t| !t.is_finite()) {
            return Err(GroupError::NonFinite { what: "a time of a break", value });
        }
        times.sort_by(f64::total_cmp);
        times.dedup();
        Ok(GroupBreaks { integrator, times })
    }

    /// The integrator.
    pub fn integrator(&self) -> &I {
        &self.integrator
    }

    /// Whether a step of the length h from the time t has parts.
    pub fn divides(&self, t: f64, h: f64) -> bool {
        self.within(t, h).next().is_some()
    }

    /// A step in parts, each of which is given by its length and its time.
    fn in_parts<G: LieGroup<N>, T: Scalar, const N: usize>(
        &self,
        (h, t): (f64, f64),
        from: &GroupState<G, N, T>,
        velocity: &SVector<T, N>,
        part: impl Fn((f64, f64), &GroupState<G, N, T>, &SVector<T, N>) -> Result<GroupStep<N, T>, GroupError>,
    ) -> Result<GroupStep<N, T>, GroupError> {
        let mut inside = self.within(t, h);
        let Some(mut end) = inside.next() else { return part((h, t), from, velocity) };
        let mut taken = part((end - t, t), from, velocity)?;
        let mut state = from.after(&taken);
        for next in inside.chain([t + h]) {
            let step = part((next - end, end), &state, &taken.velocity)?;
            (end, state) = (next, state.after(&step));
            taken = taken.followed_by::<G>(&step);
        }
        Ok(taken)
    }

    /// The times between two times, in the order of the motion; times that are those of an end up to round-off are not.
    fn within(&self, t: f64, h: f64) -> impl Iterator<Item = f64> {
        let rounding = 4.0 * f64::EPSILON * (t.abs() + h.abs());
        let (first, last) = if h > 0.0 { (t, t + h) } else { (t + h, t) };
        let from = self.times.partition_point(|b| *b <= first + rounding);
        let inside = self.times.get(from..).unwrap_or_default();
        let inside = inside.get(..inside.partition_point(|b| *b < last - rounding)).unwrap_or_default();
        let count = inside.len();
        (0..count).filter_map(move |k| inside.get(if h > 0.0 { k } else { count - 1 - k }).copied())
    }
}

impl<G: LieGroup<N>, I: GroupIntegrator<G, N>, const N: usize> GroupIntegrator<G, N> for GroupBreaks<I> {
    fn step_size(&self) -> f64 {
        self.integrator.step_size()
    }

    fn step_by<T: Scalar>(
        &self,
        h: f64,
        t: f64,
        from: &GroupState<G, N, T>,
        velocity: &SVector<T, N>,
    ) -> Result<GroupStep<N, T>, GroupError> {
        self.in_parts((h, t), from, velocity, |(h, t), from, velocity| self.integrator.step_by(h, t, from, velocity))
    }

    fn velocity(&self, t: f64, from: &GroupState<G, N>) -> Result<SVector<f64, N>, GroupError> {
        self.integrator.velocity(t, from)
    }
}

impl<G, I, const N: usize> ParametricGroupIntegrator<G, N> for GroupBreaks<I>
where
    G: LieGroup<N>,
    I: ParametricGroupIntegrator<G, N>,
{
    fn parameters(&self) -> Vec<f64> {
        self.integrator.parameters()
    }

    fn step_at<T: Scalar>(
        &self,
        theta: &[T],
        step: (f64, f64),
        from: &GroupState<G, N, T>,
        velocity: &SVector<T, N>,
    ) -> Result<GroupStep<N, T>, GroupError> {
        self.in_parts(step, from, velocity, |step, from, velocity| self.integrator.step_at(theta, step, from, velocity))
    }
}
