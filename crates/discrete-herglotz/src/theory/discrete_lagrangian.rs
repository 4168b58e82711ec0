//! Discrete Lagrangians on Q x Q x R.

use crate::solve::newton::{Linearised, NewtonStart, newton};
use crate::system::mass_matrix::BLOCK;
use crate::theory::discrete_forces::discrete_forces;
use crate::{InputError, StepError, solve::Solver};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{
    ChartVector, DiscreteJet, DiscretePoint, Dual, PhasePoint, Scalar, SecondDiscreteJet, support::seed,
};

/// A discrete Lagrangian `L_d : Q x Q x R -> R`, with the recursion `z1 = z0 + L_d(q0, q1, z0)` of the action; paper,
/// section 3.
///
/// Only the step size and the value, a generic function, are required. By default derivatives are computed by automatic
/// differentiation and steps by Newton's method; the discretisations of this crate override both with faster
/// implementations. For a time-dependent Lagrangian, `t` is the time `t_k` at the start of the step.
///
/// With discrete forces F- and F+ the momenta of a step are `p0 = -(D1 L_d + F-)/sigma_d` and `p1 = D2 L_d + F+`; the
/// flow has the contact defect `Phi* eta - sigma_d eta = -F-.dq0 - F+.dq1`.
pub trait DiscreteLagrangian<const N: usize> {
    /// Whether there may be [discrete forces](Self::forces). Where it is `false`, no code for them is compiled.
    const FORCED: bool = false;

    /// The time step h; negative for steps backward in time.
    fn step_size(&self) -> f64;

    /// The value `L_d(q0, q1, z0)`.
    ///
    /// # Errors
    /// A [`StepError`] where it is not defined, or where an implicit definition cannot be solved.
    fn value<T: Scalar>(&self, t: f64, x: &DiscretePoint<N, T>) -> Result<T, StepError>;

    /// Whether there are discrete forces; by default, where there may be some.
    fn has_forces(&self) -> bool {
        Self::FORCED
    }

    /// The discrete forces `[F-, F+]` on the two ends of a step. Set [`FORCED`](Self::FORCED) as well; by default there are
    /// none.
    ///
    /// # Errors
    /// Those of [`value`](Self::value).
    fn forces<T: Scalar>(&self, _t: f64, _x: &DiscretePoint<N, T>) -> Result<[SVector<T, N>; 2], StepError> {
        Ok([SVector::from_fn(|_, _| T::zero()); 2])
    }

    /// Checks the hypotheses at the initial state of a run, beyond the regularity of `L_d`: for example that the
    /// Lagrangian which `L_d` discretises is regular. By default there are none.
    ///
    /// # Errors
    /// An [`InputError`] that names the violated hypothesis.
    fn check_start(&self, _t: f64, _from: &PhasePoint<N>, _velocity: &SVector<f64, N>) -> Result<(), InputError> {
        Ok(())
    }

    /// The defect of a step, in units of the largest defect of a step that resolves the motion; `None` where it is at
    /// most one, and where it is unknown, as by default: a discrete Lagrangian may be exact for long steps.
    ///
    /// `velocities` are the mean velocities of the last four steps, the latest last; `to` and `sigma` are the final
    /// state and the conformal factor of the latest step.
    #[inline(always)]
    fn defect(&self, _velocities: [&SVector<f64, N>; 4], _to: &PhasePoint<N>, _sigma: f64) -> Option<f64> {
        None
    }

    /// The order of the flow; `None`, the default, where it is unknown.
    fn order(&self) -> Option<u32> {
        None
    }

    /// Whether steps are explicit. By default they are implicit.
    fn is_explicit(&self) -> bool {
        false
    }

    /// Whether `sigma_d` is known to be the same at all points. By default it is not.
    fn constant_rate(&self) -> bool {
        false
    }

    /// Value and first derivatives `D1 L_d, D2 L_d, Dz L_d`.
    ///
    /// # Errors
    /// Those of [`value`](Self::value).
    fn jet(&self, t: f64, x: &DiscretePoint<N>) -> Result<DiscreteJet<N>, StepError> {
        derived_jet(self, t, x)
    }

    /// Value, first and second derivatives.
    ///
    /// # Errors
    /// Those of [`value`](Self::value).
    fn second_jet(&self, t: f64, x: &DiscretePoint<N>) -> Result<SecondDiscreteJet<N>, StepError> {
        derived_second_jet(self, t, x)
    }

    /// The step `(q0, p0, z0) -> (q1, p1, z1)` of the discrete Hamiltonian flow `F+L_d o (F-L_d)^-1`.
    ///
    /// Solves `D1 L_d + F- + sigma_d p0 = 0` for `q1`, starting from `q0 + h u` with the guess `u` of the mean velocity.
    ///
    /// # Errors
    /// A [`StepError`]: no convergence, a singular matrix, `sigma_d <= 0`, a non-finite value.
    fn forward(
        &self,
        t: f64,
        from: &PhasePoint<N>,
        guess: &SVector<f64, N>,
        solver: &mut Solver<N>,
    ) -> Result<DiscreteStep<N>, StepError> {
        let h = self.step_size();
        let point = |u: &SVector<f64, N>| DiscretePoint { q0: from.q, q1: from.q + u * h, z0: from.z };
        let start =
            NewtonStart { u: *guess, z: 0.0, resolution: from.q.amax() / h.abs(), impulse: from.p.amax() * h.abs() };
        let root = newton(
            start,
            solver,
            |_, _| [0.0; 2],
            |u, _| {
                let jet = self.second_jet(t, &point(u))?;
                let (mut pull, mut slope) = (jet.first.d1, jet.d12);
                if const { Self::FORCED } {
                    let forces = discrete_forces(self, t, &point(u))?;
                    pull += forces.minus;
                    slope += forces.minus_slopes.1;
                }
                Ok(Linearised {
                    residual: pull + from.p * jet.first.sigma(),
                    jacobian: (slope + from.p * jet.d2z.transpose()) * h,
                    size: pull.amax() + from.p.amax() * (1.0 + jet.first.dz.abs()),
                    z_change: 0.0,
                    z_slope: SVector::zeros(),
                })
            },
        )?;
        let x = point(&root.u);
        let jet = self.jet(t, &x)?;
        let mut p = jet.d2;
        if const { Self::FORCED } {
            p += self.forces(t, &x)?[1];
        }
        let end = PhasePoint { q: x.q1, p, z: from.z + jet.value };
        DiscreteStep { end, velocity: root.u, sigma: jet.sigma(), iterations: root.iterations }.checked()
    }

    /// The step `(q1, p1, z1) -> (q0, p0, z0)` of the inverse flow; `t` is the time at `(q0, p0, z0)`.
    ///
    /// Solves `D2 L_d + F+ = p1`, `z0 + L_d = z1` for `(q0, z0)`, starting from `q1 - h u`.
    ///
    /// # Errors
    /// Like those of [`forward`](Self::forward).
    fn backward(
        &self,
        t: f64,
        from: &PhasePoint<N>,
        guess: &SVector<f64, N>,
        solver: &mut Solver<N>,
    ) -> Result<DiscreteStep<N>, StepError> {
        let h = self.step_size();
        let point = |u: &SVector<f64, N>, z0: f64| DiscretePoint { q0: from.q - u * h, q1: from.q, z0 };
        let start =
            NewtonStart { u: *guess, z: from.z, resolution: from.q.amax() / h.abs(), impulse: from.p.amax() * h.abs() };
        let root = newton(
            start,
            solver,
            |_, _| [0.0; 2],
            |u, z0| {
                let jet = self.second_jet(t, &point(u, z0))?;
                let defect = z0 + jet.first.value - from.z;
                // z0 moves by -(defect + D1 . dq0) / sigma, and dq0 = -h du.
                let (z_change, z_slope) = (-defect / jet.first.sigma(), jet.first.d1 * (h / jet.first.sigma()));
                let (mut push, mut slope, mut of_z) = (jet.first.d2, jet.d12.transpose(), jet.d2z);
                if const { Self::FORCED } {
                    let forces = discrete_forces(self, t, &point(u, z0))?;
                    push += forces.plus;
                    slope += forces.plus_slopes.0;
                    of_z += forces.plus_slopes.2;
                }
                Ok(Linearised {
                    residual: push - from.p + of_z * z_change,
                    jacobian: slope * -h + of_z * z_slope.transpose(),
                    size: push.amax() + from.p.amax() + jet.d2z.amax() * (z0.abs() + jet.first.value.abs()),
                    z_change,
                    z_slope,
                })
            },
        )?;
        let x = point(&root.u, root.z);
        let jet = self.jet(t, &x)?;
        let (sigma, mut pull) = (jet.sigma(), jet.d1);
        if const { Self::FORCED } {
            pull += self.forces(t, &x)?[0];
        }
        let end = PhasePoint { q: x.q0, p: -pull / sigma, z: root.z };
        DiscreteStep { end, velocity: root.u, sigma, iterations: root.iterations }.checked()
    }
}

impl<const N: usize, D: DiscreteLagrangian<N>> DiscreteLagrangian<N> for &D {
    const FORCED: bool = D::FORCED;

    fn has_forces(&self) -> bool {
        (**self).has_forces()
    }

    fn step_size(&self) -> f64 {
        (**self).step_size()
    }
    fn value<T: Scalar>(&self, t: f64, x: &DiscretePoint<N, T>) -> Result<T, StepError> {
        (**self).value(t, x)
    }
    fn forces<T: Scalar>(&self, t: f64, x: &DiscretePoint<N, T>) -> Result<[SVector<T, N>; 2], StepError> {
        (**self).forces(t, x)
    }
    fn check_start(&self, t: f64, from: &PhasePoint<N>, velocity: &SVector<f64, N>) -> Result<(), InputError> {
        (**self).check_start(t, from, velocity)
    }
    #[inline(always)]
    fn defect(&self, velocities: [&SVector<f64, N>; 4], to: &PhasePoint<N>, sigma: f64) -> Option<f64> {
        (**self).defect(velocities, to, sigma)
    }
    fn order(&self) -> Option<u32> {
        (**self).order()
    }
    fn is_explicit(&self) -> bool {
        (**self).is_explicit()
    }
    fn constant_rate(&self) -> bool {
        (**self).constant_rate()
    }
    fn jet(&self, t: f64, x: &DiscretePoint<N>) -> Result<DiscreteJet<N>, StepError> {
        (**self).jet(t, x)
    }
    #[inline(always)]
    fn second_jet(&self, t: f64, x: &DiscretePoint<N>) -> Result<SecondDiscreteJet<N>, StepError> {
        (**self).second_jet(t, x)
    }
    #[inline(always)]
    fn forward(
        &self,
        t: f64,
        from: &PhasePoint<N>,
        guess: &SVector<f64, N>,
        solver: &mut Solver<N>,
    ) -> Result<DiscreteStep<N>, StepError> {
        (**self).forward(t, from, guess, solver)
    }
    #[inline]
    fn backward(
        &self,
        t: f64,
        from: &PhasePoint<N>,
        guess: &SVector<f64, N>,
        solver: &mut Solver<N>,
    ) -> Result<DiscreteStep<N>, StepError> {
        (**self).backward(t, from, guess, solver)
    }
}

/// One step of a discrete Hamiltonian flow, forward or backward.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiscreteStep<const N: usize> {
    /// The final state of the step.
    pub end: PhasePoint<N>,
    /// The mean velocity `(q1 - q0) / h`, stored because the difference of the positions suffers from cancellation.
    pub velocity: SVector<f64, N>,
    /// `sigma_d = 1 + Dz L_d` at the step's point of Q x Q x R.
    pub sigma: f64,
    /// Newton iterations taken.
    pub iterations: u32,
}

impl<const N: usize> DiscreteStep<N> {
    /// Returns the step if it is finite with `sigma_d > 0`, and an error otherwise.
    ///
    /// # Errors
    /// [`StepError::NonFinite`], [`StepError::SigmaVanished`].
    #[inline(always)]
    pub fn checked(self) -> Result<Self, StepError> {
        if !(ChartVector::from(self.end).is_finite() && self.sigma.is_finite()) {
            return Err(StepError::NonFinite);
        }
        if self.sigma <= 0.0 {
            return Err(StepError::SigmaVanished { sigma: self.sigma });
        }
        Ok(self)
    }
}

/// The value and first derivatives, by automatic differentiation of the value.
///
/// # Errors
/// Those of the value.
pub fn derived_jet<const N: usize>(
    ld: &(impl DiscreteLagrangian<N> + ?Sized),
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<DiscreteJet<N>, StepError> {
    if const { N > BLOCK } {
        let (mut value, mut d) = (0.0, ChartVector { x: SVector::zeros(), y: SVector::zeros(), z: 0.0 });
        for start in blocks::<N>() {
            let l = ld.value(t, &lifted(x, start))?;
            value = l.re;
            for (k, slope) in l.d.iter().enumerate() {
                match start + k {
                    i if i < N => d.x[i] = *slope,
                    i if i < 2 * N => d.y[i - N] = *slope,
                    i if i == 2 * N => d.z = *slope,
                    _ => {}
                }
            }
        }
        return Ok(DiscreteJet::new(value, d.x, d.y, d.z));
    }
    let l = ld.value(t, &seed(&ChartVector::from(*x)).into())?;
    Ok(DiscreteJet::new(l.re, l.d.x, l.d.y, l.d.z))
}

/// The value, first and second derivatives, by automatic differentiation of the value.
///
/// # Errors
/// Those of the value.
pub fn derived_second_jet<const N: usize>(
    ld: &(impl DiscreteLagrangian<N> + ?Sized),
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<SecondDiscreteJet<N>, StepError> {
    if const { N > BLOCK } {
        return second_jet_by_blocks(ld, t, x);
    }
    let l: Dual<Dual<f64, ChartVector<N>>, _> = ld.value(t, &seed(&seed(&ChartVector::from(*x))).into())?;
    Ok(SecondDiscreteJet {
        first: DiscreteJet::new(l.re.re, l.re.d.x, l.re.d.y, l.re.d.z),
        d11: SMatrix::from_fn(|i, j| l.d.x[i].d.x[j]),
        d12: SMatrix::from_fn(|i, j| l.d.x[i].d.y[j]),
        d22: SMatrix::from_fn(|i, j| l.d.y[i].d.y[j]),
        d1z: SVector::from_fn(|i, _| l.d.x[i].d.z),
        d2z: SVector::from_fn(|i, _| l.d.y[i].d.z),
        dzz: l.d.z.d.z,
    })
}

/// The first indices of the blocks into which the `2N + 1` coordinates are divided.
fn blocks<const N: usize>() -> impl Iterator<Item = usize> {
    (0..=2 * N).step_by(BLOCK)
}

/// The point as dual numbers, with the [`BLOCK`] coordinates from `start` as directions, in the order `q0, q1, z0`: one
/// block of [`seed`].
fn lifted<T: Scalar, const N: usize>(
    x: &DiscretePoint<N, T>,
    start: usize,
) -> DiscretePoint<N, Dual<T, SVector<T, BLOCK>>> {
    let one = |i: usize, re: T| {
        let mut number = Dual::<T, SVector<T, BLOCK>>::constant(re);
        if (start..start + BLOCK).contains(&i) {
            number.d[i - start] = T::one();
        }
        number
    };
    DiscretePoint {
        q0: SVector::from_fn(|i, _| one(i, x.q0[i])),
        q1: SVector::from_fn(|i, _| one(N + i, x.q1[i])),
        z0: one(2 * N, x.z0),
    }
}

/// [`derived_second_jet`] for many coordinates, by blocks of directions, which bounds the use of the stack.
fn second_jet_by_blocks<const N: usize>(
    ld: &(impl DiscreteLagrangian<N> + ?Sized),
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<SecondDiscreteJet<N>, StepError> {
    let (matrix, vector) = (SMatrix::zeros(), SVector::zeros());
    let first = derived_jet(ld, t, x)?;
    let mut jet =
        SecondDiscreteJet { first, d11: matrix, d12: matrix, d22: matrix, d1z: vector, d2z: vector, dzz: 0.0 };
    for (a, b) in blocks::<N>().flat_map(|a| blocks::<N>().filter(move |b| *b >= a).map(move |b| (a, b))) {
        let second = ld.value(t, &lifted(&lifted(x, a), b))?.d;
        for (k, m) in (0..BLOCK).flat_map(|k| (0..BLOCK).map(move |m| (k, m))) {
            let (i, j) = ((a + m).min(b + k), (a + m).max(b + k));
            let entry = second[k].d[m];
            match (i / N, j / N) {
                _ if j > 2 * N => {}
                (0, 0) => (jet.d11[(i, j)], jet.d11[(j, i)]) = (entry, entry),
                (0, 1) => jet.d12[(i, j - N)] = entry,
                (1, 1) => (jet.d22[(i - N, j - N)], jet.d22[(j - N, i - N)]) = (entry, entry),
                (0, _) => jet.d1z[i] = entry,
                (1, _) => jet.d2z[i - N] = entry,
                _ => jet.dzz = entry,
            }
        }
    }
    Ok(jet)
}
