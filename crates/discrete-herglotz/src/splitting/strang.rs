//! The Strang splitting as a discrete Lagrangian.

use super::drag::{Drag, Drift};
use super::separable::SeparableForm;
use crate::resolution::monitor::defect;
use crate::{DiscreteLagrangian, DiscreteStep, InputError, StepError, solve::Solver};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::dot;
use contact_geom::{DiscretePoint, Lagrangian, PhasePoint, Scalar};

/// The Strang splitting of `L = v.Mv/2 - V(t, q) + gamma(t) z`, kick, drift, kick, as a discrete Lagrangian of order 2:
/// with `d = (e^(gamma h) - 1)/gamma`,
///
/// `L_d = e^(gamma h) ((q1 - q0).M(q1 - q0)/(2d) - h/2 V(t, q0)) - h/2 V(t + h, q1) + (e^(gamma h) - 1) z0`.
///
/// Where gamma depends on time, `gamma h` stands for its integral over the step, and d for the integral of the
/// exponential of that integral from the start. Hence `sigma_d = e^(gamma h)` at every point. The step is explicit,
/// because the drift alone connects the positions, which determines the momentum between the kicks. The method is
/// symmetric, and is the second-order member of [`SplittingScheme`](crate::SplittingScheme), whose stepper is
/// [`Splitting`](crate::splitting::Splitting).
///
/// ```
/// use contact_examples::systems::Pendulum;
/// use contact_geom::PhasePoint;
/// use discrete_herglotz::{Stepper, rules::Flow, splitting::Strang};
/// let pendulum = Pendulum { gamma: -0.1 };
/// let start = PhasePoint::new([1.0], [1.0], 0.0);
/// let ld = Strang::new(&pendulum, 0.1, 0.0, &start)?;
/// let mut flow = Flow::new(&ld, 0.0, start)?;
/// flow.advance(100)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Strang<L, const N: usize> {
    form: SeparableForm<L, N>,
    h: f64,
    drag: Drag<N>,
    /// For a constant drag, the drifts over h and -h.
    steady: Option<(Drift, Drift)>,
}

impl<L: Lagrangian<N>, const N: usize> Strang<L, N> {
    /// The splitting for a Lagrangian whose form is verified at a time and a state.
    ///
    /// # Errors
    /// Those of [`Splitting::new`](crate::splitting::Splitting::new) except [`InputError::FirstStep`].
    pub fn new(lagrangian: L, h: f64, t: f64, state: &PhasePoint<N>) -> Result<Self, InputError> {
        let form = SeparableForm::read(lagrangian, h, t, state)?;
        let drag = Drag::of(&form, t, state)?;
        let drift = |s| drag.drift(&form.lagrangian, t, s);
        let steady = matches!(drag, Drag::Constant(_)).then(|| (drift(h), drift(-h)));
        Ok(Strang { form, h, drag, steady })
    }

    /// The drift of a step from the time `t`, forward or backward.
    #[inline(always)]
    fn drift(&self, t: f64, forward: bool) -> Drift {
        match &self.steady {
            Some((forth, back)) => *if forward { forth } else { back },
            None => self.drag.drift(&self.form.lagrangian, t, if forward { self.h } else { -self.h }),
        }
    }

    /// Kick, drift, kick over a step from the time `t`, forward or backward.
    #[inline(always)]
    fn step(&self, t: f64, from: &PhasePoint<N>, forward: bool) -> Result<DiscreteStep<N>, StepError> {
        let h = if forward { self.h } else { -self.h };
        let drift = self.drift(t, forward);
        let PhasePoint { mut q, mut p, mut z } = *from;
        let (value, force) = self.form.kick(t, &q, 0.0);
        z += 0.5 * h * value;
        p += force * (0.5 * h);
        let v = self.form.velocity(&p);
        z += drift.damping * z + drift.lift * dot(p, v);
        q += v * drift.length;
        let (value, force) = self.form.kick(t + h, &q, 0.0);
        z += 0.5 * h * value;
        // Both changes are added in one sum: rounded separately, a small drag would have round-off of the same sign in
        // all steps.
        p += p * drift.damping + force * (0.5 * h);
        let velocity = v * (drift.length / h);
        let sigma = if forward { 1.0 + drift.damping } else { 1.0 / (1.0 + drift.damping) };
        DiscreteStep { end: PhasePoint { q, p, z }, velocity, sigma, iterations: 0 }.checked()
    }
}

impl<L: Lagrangian<N>, const N: usize> DiscreteLagrangian<N> for Strang<L, N> {
    const FORCED: bool = L::HINTS.forced;

    fn has_forces(&self) -> bool {
        self.form.lagrangian.has_force()
    }

    fn step_size(&self) -> f64 {
        self.h
    }

    fn value<T: Scalar>(&self, t: f64, x: &DiscretePoint<N, T>) -> Result<T, StepError> {
        let still = SVector::from_element(T::zero());
        let kick =
            |t: f64, q: &SVector<T, N>| self.form.lagrangian.value(T::from(t), q, &still, T::zero()) * (0.5 * self.h);
        let square = self.form.twice_kinetic(&(x.q1 - x.q0));
        let Drift { damping: growth, length, .. } = self.drift(t, true);
        let before = square * (0.5 / length) + kick(t, &x.q0);
        Ok(before * (1.0 + growth) + kick(t + self.h, &x.q1) + x.z0 * growth)
    }

    /// Those of the two kicks, `F- = (1 + damping) h/2 f(t, q0)` and `F+ = h/2 f(t + h, q1)`.
    fn forces<T: Scalar>(&self, t: f64, x: &DiscretePoint<N, T>) -> Result<[SVector<T, N>; 2], StepError> {
        let kick = |t: f64, q: &SVector<T, N>, s: f64| self.form.applied_force(t, q, T::zero()).map(|f| f * s);
        let before = 0.5 * self.h * (1.0 + self.drift(t, true).damping);
        Ok([kick(t, &x.q0, before), kick(t + self.h, &x.q1, 0.5 * self.h)])
    }

    #[inline(always)]
    fn defect(&self, velocities: [&SVector<f64, N>; 4], to: &PhasePoint<N>, _sigma: f64) -> Option<f64> {
        defect(velocities, &to.q, self.h, 0.0)
    }

    fn order(&self) -> Option<u32> {
        Some(2)
    }

    fn is_explicit(&self) -> bool {
        true
    }

    fn constant_rate(&self) -> bool {
        self.steady.is_some()
    }

    /// Explicit; the guess and the solver are not needed.
    #[inline(always)]
    fn forward(
        &self,
        t: f64,
        from: &PhasePoint<N>,
        _guess: &SVector<f64, N>,
        _solver: &mut Solver<N>,
    ) -> Result<DiscreteStep<N>, StepError> {
        self.step(t, from, true)
    }

    /// The step with `-h`, by symmetry.
    #[inline]
    fn backward(
        &self,
        t: f64,
        from: &PhasePoint<N>,
        _guess: &SVector<f64, N>,
        _solver: &mut Solver<N>,
    ) -> Result<DiscreteStep<N>, StepError> {
        self.step(t + self.h, from, false)
    }
}
