//! The Strang splitting for a nonlinear drag, as a discrete Lagrangian.

use super::action_flow::{ActionFlow, ActionMap, Riccati, check_flow, with_slope};
use super::separable::SeparableForm;
use crate::resolution::monitor::defect;
use crate::{DiscreteLagrangian, DiscreteStep, InputError, StepError, solve::Solver};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::dot;
use contact_geom::{DiscretePoint, Dual, Lagrangian, PhasePoint, Scalar};

/// The substep `C B A B C` of [`ActionSplitting`](crate::splitting::ActionSplitting) as a discrete Lagrangian of order
/// 2: with the flow `phi` of `f(z)` over half a step,
///
/// `z0 + L_d = phi(phi(z0) + (q1 - q0).M(q1 - q0)/(2h) - h/2 V(t, q0) - h/2 V(t + h, q1))`.
///
/// It is symmetric and explicit; `sigma_d` is the product of the two factors `phi'`.
#[derive(Clone, Debug)]
pub struct ActionStrang<L, F: ActionFlow, const N: usize> {
    form: SeparableForm<L, N>,
    h: f64,
    forth: F::Map,
    back: F::Map,
    /// The action at which L is evaluated for the potential, and the value of f there.
    rest: (f64, f64),
}

impl<L: Lagrangian<N>, const N: usize> ActionStrang<L, Riccati, N> {
    /// The splitting for a Lagrangian whose f is a polynomial of degree two, which is determined and verified at a time
    /// and a state.
    ///
    /// # Errors
    /// Those of [`ActionSplitting::new`](crate::splitting::ActionSplitting::new) except [`InputError::FirstStep`].
    pub fn new(lagrangian: L, h: f64, t: f64, state: &PhasePoint<N>) -> Result<Self, InputError> {
        let form = SeparableForm::read(lagrangian, h, t, state)?;
        let flow = Riccati::of(&form.lagrangian, t, state)?;
        Self::of(form, &flow, h, t, state)
    }
}

impl<L: Lagrangian<N>, F: ActionFlow, const N: usize> ActionStrang<L, F, N> {
    /// The splitting for a Lagrangian with the given flow of its f, verified at a time and a state.
    ///
    /// # Errors
    /// Those of [`ActionSplitting::with_flow`](crate::splitting::ActionSplitting::with_flow) except
    /// [`InputError::FirstStep`] and the one for a Runge-Kutta-Nystrom scheme.
    pub fn with_flow(lagrangian: L, flow: &F, h: f64, t: f64, state: &PhasePoint<N>) -> Result<Self, InputError> {
        Self::of(SeparableForm::read(lagrangian, h, t, state)?, flow, h, t, state)
    }

    fn of(form: SeparableForm<L, N>, flow: &F, h: f64, t: f64, state: &PhasePoint<N>) -> Result<Self, InputError> {
        form.check_steady_drag(t, state)?;
        check_flow(flow, &form.lagrangian, t, state)?;
        let (forth, back) = (flow.over(0.5 * h), flow.over(-0.5 * h));
        Ok(ActionStrang { form, h, forth, back, rest: (state.z, flow.rate(state.z)) })
    }

    /// The action after the last kick, before the last map of the action.
    fn action_between<T: Scalar>(&self, t: f64, x: &DiscretePoint<N, T>) -> T {
        let (rest, constant) = self.rest;
        let still = SVector::from_element(T::zero());
        let kick = |t: f64, q: &SVector<T, N>| {
            (self.form.lagrangian.value(T::from(t), q, &still, T::from(rest)) - constant) * (0.5 * self.h)
        };
        let kinetic = self.form.twice_kinetic(&(x.q1 - x.q0)) * (0.5 / self.h);
        self.forth.apply(x.z0) + kinetic + kick(t, &x.q0) + kick(t + self.h, &x.q1)
    }

    /// One step of length h, of either sign, from the time `t`, with the map over `h/2`. Returns the final state, the
    /// mean velocity and the conformal factor.
    #[inline(always)]
    fn step(&self, t: f64, from: &PhasePoint<N>, h: f64, map: &F::Map) -> (PhasePoint<N>, SVector<f64, N>, f64) {
        let (change, first) = with_slope(|z| map.change(z), from.z);
        let z = from.z + change;
        let (value, force) = self.form.kick(t, &from.q, self.rest.0);
        // Both changes are added in one sum, as for a linear drag.
        let p = from.p + (from.p * first + force * (0.5 * h));
        let v = self.form.velocity(&p);
        let q = from.q + v * h;
        let (next, pull) = self.form.kick(t + h, &q, self.rest.0);
        let z = z + 0.5 * h * (dot(p, v) + (value - self.rest.1) + (next - self.rest.1));
        let (change, second) = with_slope(|z| map.change(z), z);
        let pull = pull * (0.5 * h);
        let p = p + (pull + (p + pull) * second);
        (PhasePoint { q, p, z: z + change }, v, (1.0 + first) * (1.0 + second))
    }
}

impl<L: Lagrangian<N>, F: ActionFlow, const N: usize> DiscreteLagrangian<N> for ActionStrang<L, F, N> {
    const FORCED: bool = L::HINTS.forced;

    fn has_forces(&self) -> bool {
        self.form.lagrangian.has_force()
    }

    fn step_size(&self) -> f64 {
        self.h
    }

    fn value<T: Scalar>(&self, t: f64, x: &DiscretePoint<N, T>) -> Result<T, StepError> {
        Ok(self.forth.apply(self.action_between(t, x)) - x.z0)
    }

    /// Those of the two kicks, times the slope of the last map of the action: `F- = phi' h/2 f(t, q0)` and
    /// `F+ = phi' h/2 f(t + h, q1)`.
    fn forces<T: Scalar>(&self, t: f64, x: &DiscretePoint<N, T>) -> Result<[SVector<T, N>; 2], StepError> {
        let z = Dual { re: self.action_between(t, x), d: SVector::<T, 1>::new(T::one()) };
        let slope = self.forth.apply(z).d[0] * (0.5 * self.h);
        let kick = |t: f64, q: &SVector<T, N>| self.form.applied_force(t, q, T::from(self.rest.0)).map(|f| f * slope);
        Ok([kick(t, &x.q0), kick(t + self.h, &x.q1)])
    }

    #[inline(always)]
    fn defect(&self, velocities: [&SVector<f64, N>; 4], to: &PhasePoint<N>, _sigma: f64) -> Option<f64> {
        defect(velocities, &to.q, self.h, 0.0)
    }

    fn order(&self) -> Option<u32> {
        Some(2)
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
        let (end, velocity, sigma) = self.step(t, from, self.h, &self.forth);
        DiscreteStep { end, velocity, sigma, iterations: 0 }.checked()
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
        let (end, velocity, factor) = self.step(t + self.h, from, -self.h, &self.back);
        DiscreteStep { end, velocity, sigma: 1.0 / factor, iterations: 0 }.checked()
    }
}
