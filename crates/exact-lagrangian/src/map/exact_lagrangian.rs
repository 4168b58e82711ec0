//! The exact discrete Lagrangian.

use crate::map::retraction::Retraction;
use crate::map::velocity_seed::seeded;
use crate::{ContactExponential, ExactError, Motion, herglotz_flow};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::support::linear::solve;
use contact_geom::{
    ChartVector, Derivatives, DiscreteJet, DiscretePoint, Dual, Lagrangian, PhasePoint, Scalar, SecondDiscreteJet,
    VelocityPoint,
};
use discrete_herglotz::{
    DiscreteLagrangian, DiscreteStep, InputError, StepError,
    checks::check_unforced,
    solve::{ITERATION_LIMIT, Solver, last_correction},
};

/// The exact discrete Lagrangian `L_h^e(q0, q1, z0) = int_0^h L o phi_t o R_h^(e-) dt = z(h) - z0`, the action along
/// the motion from `q0` to `q1` in time h; paper, section 4.2.
///
/// With `p = L_v` at the ends of that motion and `b = int L_z`: `D1 L_h^e = -p0 e^b`, `D2 L_h^e = p1`,
/// `Dz L_h^e = e^b - 1`, so that `sigma_d = e^b` and `F(+-)L_h^e = FL o R_h^(e+-)`. The jet is computed by these
/// formulas, the second jet from the first variational equation, and a step of the flow by the motion itself;
/// [`value`](DiscreteLagrangian::value) over duals instead differentiates the whole computation, flow and shooting.
///
/// It is regular where the exponential map is a local diffeomorphism, also on the diagonal `q0 = q1`.
#[derive(Clone, Copy, Debug)]
pub struct ExactLagrangian<L, const N: usize> {
    exponential: ContactExponential<L>,
    near: Option<SVector<f64, N>>,
}

impl<L: Lagrangian<N>, const N: usize> ExactLagrangian<L, N> {
    /// The exact discrete Lagrangian for a time step.
    ///
    /// # Errors
    /// [`InputError::Step`] unless `h` is positive and finite, [`InputError::Dimension`] for `N = 0`.
    pub fn new(lagrangian: L, h: f64) -> Result<Self, InputError> {
        if N == 0 {
            return Err(InputError::Dimension);
        }
        check_unforced(&lagrangian, "the exact discrete Lagrangian")?;
        Ok(ExactLagrangian { exponential: ContactExponential::new(lagrangian, h)?, near: None })
    }

    /// The exact discrete Lagrangian on the branch of motions whose initial velocity is near a guess, for points beyond
    /// a conjugate point or points that several motions join.
    pub fn near(self, guess: SVector<f64, N>) -> Self {
        ExactLagrangian { near: Some(guess), ..self }
    }

    /// The exponential map, which it inverts.
    pub fn exponential(&self) -> &ContactExponential<L> {
        &self.exponential
    }

    /// The motion between two points; its action is the value of the discrete Lagrangian.
    ///
    /// # Errors
    /// Those of [`ContactExponential::retract`].
    pub fn retract(&self, t: f64, x: &DiscretePoint<N>) -> Result<Retraction<N>, ExactError<N>> {
        match &self.near {
            None => self.exponential.retract(t, x),
            Some(guess) => self.exponential.retract_near(t, x, guess),
        }
    }

    /// The motion between two points without a search for conjugate points, which a jet does not need.
    fn between(&self, t: f64, x: &DiscretePoint<N>) -> Result<Retraction<N>, ExactError<N>> {
        match &self.near {
            None => self.exponential.between(t, x),
            Some(guess) => self.exponential.between_near(t, x, guess),
        }
    }

    /// The momentum `L_v` at a point of TQ x R.
    fn momentum(&self, t: f64, x: &VelocityPoint<N>) -> SVector<f64, N> {
        self.exponential.lagrangian.gradient(t, x).y
    }

    /// The first jet of a motion, by the formulas.
    fn jet_of(&self, t: f64, motion: &Retraction<N>) -> DiscreteJet<N> {
        let sigma = motion.b.exp();
        let p0 = self.momentum(t, &motion.start);
        let p1 = self.momentum(t + self.exponential.h, &motion.end);
        DiscreteJet::new(motion.action, -p0 * sigma, p1, motion.b.exp_m1()).with_sigma(sigma)
    }

    /// The velocity at which `L_v` is a given momentum, by Newton's method with the Jacobian W. It differs from
    /// [`legendre_inverse`](discrete_herglotz::theory::legendre_inverse) in its Jacobian, which is differentiated with
    /// the momentum by the same dual numbers as the motion, and in its criterion of convergence, so that the results
    /// differ in the last digit.
    fn velocity(&self, t: f64, x: &PhasePoint<N>, guess: &SVector<f64, N>) -> Result<SVector<f64, N>, StepError> {
        let (mut v, mut change) = (*guess, SVector::<f64, N>::zeros());
        let (mut before, mut residual) = (f64::INFINITY, f64::INFINITY);
        for _ in 0..ITERATION_LIMIT {
            let point = seeded(&VelocityPoint { q: x.q, v, z: x.z });
            let p = self.exponential.lagrangian.gradient(Dual::from(t), &point).y;
            let missed = SVector::<f64, N>::from_fn(|i, _| x.p[i] - p[i].re);
            if !missed.sum().is_finite() {
                // Outside the domain of L, for example beyond the speed of light: take half of the last change.
                if before == f64::INFINITY {
                    return Err(StepError::NonFinite);
                }
                change *= 0.5;
                v -= change;
                continue;
            }
            residual = missed.amax();
            change = missed;
            let mut w = SMatrix::<f64, N, N>::from_fn(|i, j| p[i].d[j]);
            solve(&mut w, &mut change).map_err(|e| StepError::Singular { pivot: e.pivot })?;
            v += change;
            let now = change.amax();
            let predicted = before.is_finite() && last_correction(now, before, f64::EPSILON * v.amax());
            if now == 0.0 || predicted || (now >= 0.5 * before && now <= 64.0 * f64::EPSILON * v.amax()) {
                return Ok(v);
            }
            before = now;
        }
        Err(StepError::NotConverged { residual, iterations: ITERATION_LIMIT })
    }

    /// A step of the flow on T\*Q x R by the motion itself; `duration` is h, or -h for a step backward in time.
    fn along(
        &self,
        t: f64,
        from: &PhasePoint<N>,
        guess: &SVector<f64, N>,
        duration: f64,
    ) -> Result<DiscreteStep<N>, StepError> {
        let v = self.velocity(t, from, guess)?;
        let start = VelocityPoint { q: from.q, v, z: from.z };
        let motion: Motion<N> = herglotz_flow(&self.exponential.lagrangian, t, &start, duration)?;
        let end = motion.end;
        let p = self.momentum(t + duration, &end);
        let forward = if duration > 0.0 { motion.b } else { -motion.b };
        let end = PhasePoint { q: end.q, p, z: end.z };
        DiscreteStep { end, velocity: motion.displacement / duration, sigma: forward.exp(), iterations: 1 }.checked()
    }
}

impl<L: Lagrangian<N>, const N: usize> DiscreteLagrangian<N> for ExactLagrangian<L, N> {
    fn step_size(&self) -> f64 {
        self.exponential.h
    }

    fn value<T: Scalar>(&self, t: f64, x: &DiscretePoint<N, T>) -> Result<T, StepError> {
        Ok(self.exponential.lifted(t, x, self.near.as_ref())?.1.action)
    }

    fn jet(&self, t: f64, x: &DiscretePoint<N>) -> Result<DiscreteJet<N>, StepError> {
        Ok(self.jet_of(t, &self.between(t, x)?))
    }

    /// Computed from the derivatives of the motion with respect to its start. With `dq1 = A dq0 + B dv0 + c dz0` the
    /// variation of `v0` is `B^-1 (dq1 - A dq0 - c dz0)`, from which those of `p0`, `p1` and b follow.
    fn second_jet(&self, t: f64, x: &DiscretePoint<N>) -> Result<SecondDiscreteJet<N>, StepError> {
        let (retraction, h) = (self.between(t, x)?, self.exponential.h);
        let varied = self.exponential.varied(t, &retraction.start)?;
        let slope = SMatrix::<f64, N, N>::from_fn(|i, j| varied.displacement[i].d.y[j]);
        let inverse = slope.try_inverse().ok_or(StepError::ConjugatePoint { smallest: 0.0 })?;
        let by_q0 = SMatrix::<f64, N, N>::from_fn(|i, j| varied.end.q[i].d.x[j]);
        let by_z0 = SVector::<f64, N>::from_fn(|i, _| varied.end.q[i].d.z);
        // The derivatives of v0 with respect to q0, q1 and z0.
        let (v_q0, v_q1, v_z0) = (-inverse * by_q0, inverse, -inverse * by_z0);
        // The derivatives with respect to q0, q1 and z0 of a function of the start, whose velocity depends on them.
        let total = |d: &ChartVector<N>| ChartVector {
            x: d.x + v_q0.transpose() * d.y,
            y: v_q1.transpose() * d.y,
            z: d.z + v_z0.dot(&d.y),
        };
        let lagrangian = &self.exponential.lagrangian;
        let of_start = |x: &VelocityPoint<N, Dual<f64, ChartVector<N>>>, t| {
            let p = lagrangian.gradient(Dual::from(t), x).y;
            SVector::<ChartVector<N>, N>::from_fn(|i, _| total(&p[i].d))
        };
        let p0 = of_start(&contact_geom::support::seed(&ChartVector::from(retraction.start)).into(), t);
        let p1 = of_start(&varied.end, t + h);
        let b = total(&varied.b.d);
        let first = self.jet_of(t, &retraction);
        let sigma = first.sigma();
        // D1 = -sigma p0, and d sigma = sigma db.
        let d1 = |i: usize| ChartVector {
            x: p0[i].x * -sigma + b.x * first.d1[i],
            y: p0[i].y * -sigma + b.y * first.d1[i],
            z: p0[i].z * -sigma + b.z * first.d1[i],
        };
        Ok(SecondDiscreteJet {
            first,
            d11: SMatrix::from_fn(|i, j| d1(i).x[j]),
            d12: SMatrix::from_fn(|i, j| p1[j].x[i]),
            d22: SMatrix::from_fn(|i, j| p1[i].y[j]),
            d1z: SVector::from_fn(|i, _| d1(i).z),
            d2z: SVector::from_fn(|i, _| p1[i].z),
            dzz: sigma * b.z,
        })
    }

    /// The motion itself: `F+L_h^e o (F-L_h^e)^-1 = FL o phi_h o FL^-1`.
    fn forward(
        &self,
        t: f64,
        from: &PhasePoint<N>,
        guess: &SVector<f64, N>,
        _solver: &mut Solver<N>,
    ) -> Result<DiscreteStep<N>, StepError> {
        self.along(t, from, guess, self.exponential.h)
    }

    /// The motion backward in time.
    fn backward(
        &self,
        t: f64,
        from: &PhasePoint<N>,
        guess: &SVector<f64, N>,
        _solver: &mut Solver<N>,
    ) -> Result<DiscreteStep<N>, StepError> {
        let h = self.exponential.h;
        self.along(t + h, from, guess, -h)
    }
}
