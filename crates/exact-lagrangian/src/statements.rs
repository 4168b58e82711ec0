//! Residuals of the statements of the paper's section 4: each statement is evaluated on a Lagrangian at a point of TQ x
//! R for a time step, relative to the size of its terms.
//!
//! The derivatives of `L_h^e` in the theorems are computed by dual numbers through flow and shooting, not by the
//! formulas of the theorems. Everything is evaluated on the branch of motions near the one from the given point, so
//! that conjugate points before h have no effect.
//!
//! The residual of a true statement is round-off. It is given in units of the condition number of the motion, the
//! largest entry of `T phi_h` where that is above one (its square for second derivatives): by this factor the motion
//! itself amplifies the rounding of its start, for example near a collision. Where a velocity is computed from two
//! rounded positions, the residual is given in units of the resulting loss of accuracy; see [`condition`].

// `f64::max` and `amax` discard a NaN, which would make a check pass.
#![deny(clippy::disallowed_methods)]

mod legendrian;

use crate::map::exponential::HerglotzFlow;
use crate::numerics::gauss::collocations;
use crate::{
    ContactExponential, ExactError, ExactLagrangian, compose, herglotz_flow,
    principle::{MotionCurve, NonHolonomic, VariedCurve, action, action_derivative},
    through,
};
use contact_geom::nalgebra::{DMatrix, SVector};
use contact_geom::{
    ChartVector, Derivatives, DiscreteJet, DiscretePoint, HerglotzField, Lagrangian, PhasePoint, Scalar,
    SecondDiscreteJet, Smooth, Statement, VelocityPoint, legendre,
    numbers::{MaxAbsOrNan, MaxOrNan, max_or_nan},
    support::{herglotz_rates, seed},
};
use discrete_herglotz::{
    DiscreteLagrangian, InputError, StepError,
    theory::{derived_jet, derived_second_jet, discrete_flow, legendre_minus_inverse},
};

/// The statements of section 4 that [`residual`] evaluates, [`Statement::HerglotzPrinciple`] of section 2, and
/// [`Statement::LegendrianGraph`].
pub const STATEMENTS: [Statement; 12] = [
    Statement::HerglotzPrinciple,
    Statement::ChetaevMultiplier,
    Statement::ProjectedFlow,
    Statement::ExponentialMap,
    Statement::NonHolonomicExponential,
    Statement::ImageProjection,
    Statement::ExactRetractions,
    Statement::LinearEquation,
    Statement::ExactDerivatives,
    Statement::ExactLegendreTransforms,
    Statement::ExactFlow,
    Statement::LegendrianGraph,
];

/// The residual of a statement for a Lagrangian at a time and a point of TQ x R, with a time step h; `None` where the
/// statement is not one of [`STATEMENTS`].
///
/// # Errors
/// Those of the motion over h (over 2h for [`Statement::ExactFlow`]).
pub fn residual<S: Lagrangian<N>, const N: usize>(
    statement: Statement,
    system: &S,
    t: f64,
    x: &VelocityPoint<N>,
    h: f64,
) -> Result<Option<f64>, ExactError<N>> {
    let at = Sample { system, t, x, h, exponential: ContactExponential::new(system, h)? };
    Ok(Some(match statement {
        Statement::HerglotzPrinciple => at.principle()?,
        Statement::ChetaevMultiplier => at.multiplier()?,
        Statement::ProjectedFlow => at.projected_flow()?,
        Statement::ExponentialMap => at.local_diffeomorphism()?,
        Statement::NonHolonomicExponential => at.two_exponentials()?,
        Statement::ImageProjection => at.projection()?,
        Statement::ExactRetractions => at.retraction()?,
        Statement::LinearEquation => at.linear_equation()?,
        Statement::ExactDerivatives => at.derivatives()?,
        Statement::ExactLegendreTransforms => at.legendre_transforms()?,
        Statement::ExactFlow => at.regular_and_exact()?,
        Statement::LegendrianGraph => legendrian::graph(&at)?,
        _ => return Ok(None),
    }))
}

/// The unavoidable relative error of the initial velocity when it is computed from two rounded positions, in units of
/// round-off: `|q| |(dq1/dv0)^-1| / |v|`, at least 1. It grows like `1/h` as h goes to 0.
///
/// # Errors
/// Those of the motion over h.
pub fn condition<const N: usize>(
    lagrangian: &impl Lagrangian<N>,
    t: f64,
    x: &VelocityPoint<N>,
    h: f64,
) -> Result<f64, ExactError<N>> {
    let differential = ContactExponential::new(lagrangian, h)?.differential(t, x)?;
    let position = x.q.max_abs_or_nan().max_or_nan(differential.image.q1.max_abs_or_nan());
    Ok((position / (differential.regularity().smallest * x.v.max_abs_or_nan())).max_or_nan(1.0))
}

/// The distance of the exact motion from the motion by the discrete Herglotz equations of `L_h^e`. These are solved
/// step by step from `(q(0), q(h), z(0))` and compared with the flow of `xi_L`: the largest difference of `q_k` and
/// `z_k` over a number of steps, in units of `k^2` times the largest position and action. The rounding of the two
/// positions of each step is an error of the velocity, which grows with the motion and to which each step adds.
/// Statement 36, item 3.
///
/// # Errors
/// Those of the motion and of the steps.
pub fn follows_motion<const N: usize>(
    lagrangian: &impl Lagrangian<N>,
    t: f64,
    x: &VelocityPoint<N>,
    h: f64,
    steps: usize,
) -> Result<f64, ExactError<N>> {
    let exact = ByEquations(ExactLagrangian::new(lagrangian, h)?);
    let mut at = herglotz_flow(lagrangian, t, x, h)?.end;
    let mut pair = DiscretePoint { q0: x.q, q1: at.q, z0: x.z };
    let (mut worst, mut size): (f64, f64) = (0.0, x.q.max_abs_or_nan().max_or_nan(x.z.abs()));
    for k in 1..=steps {
        let time = t + k as f64 * h;
        pair = discrete_flow(&exact, time - h, &pair).map_err(|e| ExactError::Input(InputError::FirstStep(e)))?;
        let z = at.z;
        at = herglotz_flow(lagrangian, time, &at, h)?.end;
        size = size.max_or_nan(at.q.max_abs_or_nan()).max_or_nan(at.z.abs());
        let growth = ((k + 1) * (k + 1)) as f64;
        worst = worst.max_or_nan((pair.q1 - at.q).max_abs_or_nan().max_or_nan((pair.z0 - z).abs()) / (size * growth));
    }
    Ok(worst)
}

/// An exact discrete Lagrangian whose steps are computed by solving the discrete Herglotz equations, as for any other
/// discrete Lagrangian, and not by the motion.
struct ByEquations<L, const N: usize>(ExactLagrangian<L, N>);

impl<L: Lagrangian<N>, const N: usize> DiscreteLagrangian<N> for ByEquations<L, N> {
    fn step_size(&self) -> f64 {
        self.0.step_size()
    }
    fn value<T: Scalar>(&self, t: f64, x: &DiscretePoint<N, T>) -> Result<T, StepError> {
        self.0.value(t, x)
    }
    fn jet(&self, t: f64, x: &DiscretePoint<N>) -> Result<DiscreteJet<N>, StepError> {
        self.0.jet(t, x)
    }
    fn second_jet(&self, t: f64, x: &DiscretePoint<N>) -> Result<SecondDiscreteJet<N>, StepError> {
        self.0.second_jet(t, x)
    }
}

/// The system, time, point and time step at which a statement is evaluated.
struct Sample<'a, S, const N: usize> {
    system: &'a S,
    t: f64,
    x: &'a VelocityPoint<N>,
    h: f64,
    exponential: ContactExponential<&'a S>,
}

/// The difference of two elements relative to the larger of them.
fn relative<const N: usize>(a: impl Into<ChartVector<N>>, b: impl Into<ChartVector<N>>) -> f64 {
    let (a, b) = (a.into(), b.into());
    a.minus(b).max_abs_or_nan() / a.max_abs_or_nan().max_or_nan(b.max_abs_or_nan())
}

/// The difference of two numbers relative to a size.
fn apart(a: f64, b: f64, size: f64) -> f64 {
    (a - b).abs() / size
}

impl<S: Lagrangian<N>, const N: usize> Sample<'_, S, N> {
    /// The exact discrete Lagrangian on the branch of the motion from `x`, and its point of Q x Q x R.
    fn exact(&self) -> Result<(ExactLagrangian<&S, N>, DiscretePoint<N>), ExactError<N>> {
        let exact = ExactLagrangian::new(self.system, self.h)?.near(self.x.v);
        Ok((exact, self.exponential.at(self.t, self.x)?))
    }

    /// The condition number of the motion: the largest entry of `T phi_h`, at least 1.
    fn growth(&self) -> Result<f64, ExactError<N>> {
        let end = self.exponential.varied(self.t, self.x)?.end;
        let of = |c: &SVector<_, N>| {
            c.iter().map(|e: &contact_geom::Dual<f64, ChartVector<N>>| e.d.max_abs_or_nan()).fold(1.0, max_or_nan)
        };
        Ok(of(&end.q).max_or_nan(of(&end.v)).max_or_nan(end.z.d.max_abs_or_nan()))
    }

    fn step_error(e: StepError) -> ExactError<N> {
        ExactError::Input(InputError::FirstStep(e))
    }

    /// Statement 10: along the motion the action's derivative vanishes for variations that vanish at the ends; along
    /// another curve with the same ends it does not; and `dZ/dz0 = e^(int L_z)`.
    fn principle(&self) -> Result<f64, ExactError<N>> {
        let Sample { system, t, x, h, .. } = *self;
        let curve = MotionCurve { lagrangian: system, t0: t, start: *x };
        let wave = |i: usize, k: f64| {
            move |s: f64| {
                let (sin, cos) = (k * std::f64::consts::PI * s / h).sin_cos();
                let mut unit = SVector::<f64, N>::zeros();
                unit[i] = 1.0;
                (unit * sin, unit * (cos * k * std::f64::consts::PI / h))
            }
        };
        let span = (t, h);
        let motion = herglotz_flow(system, t, x, h)?;
        // The size of the terms that cancel: L_v times the velocity of the variation, over the time, times the growth
        // sigma.
        let p = legendre(system, t, x)
            .p
            .max_abs_or_nan()
            .max_or_nan(legendre(system, t + h, &motion.end).p.max_abs_or_nan());
        let mut worst: f64 = 0.0;
        for i in 0..N {
            for k in [1.0, 2.0] {
                let variation = wave(i, k);
                let slope = action_derivative(system, &curve, &variation, span, (x.z, 0.0))?;
                let size = (1.0 + p) * k * std::f64::consts::PI * motion.sigma().max_or_nan(1.0);
                worst = worst.max_or_nan(slope.abs() / size);
            }
            let bent = VariedCurve { curve: &curve, variation: &wave(i, 1.0), by: 0.01 * h };
            let slope = action_derivative(system, &bent, &wave(i, 1.0), span, (x.z, 0.0))?;
            // The second variation is W pi^2/(2h) times the amplitude 0.01 h, minus h/2 times the gradient of the
            // force.
            if slope.abs() < 1e-4 {
                return Ok(f64::INFINITY);
            }
        }
        let still = |_: f64| (SVector::<f64, N>::zeros(), SVector::<f64, N>::zeros());
        let growth = action_derivative(system, &curve, &still, span, (x.z, 1.0))?;
        let along = action(system, &curve, span, x.z)?;
        let end = apart(along.z, motion.end.z, 1.0 + motion.end.z.abs());
        Ok(worst.max_or_nan(end).max_or_nan(apart(growth, along.b.exp(), growth)).max_or_nan(apart(
            along.b,
            motion.b,
            1.0 + motion.b.abs(),
        )))
    }

    /// Statement 27: Chetaev's multiplier is `-L_z`, and the accelerations are Herglotz'.
    fn multiplier(&self) -> Result<f64, ExactError<N>> {
        let Sample { system, t, x, .. } = *self;
        let chetaev = NonHolonomic::new(system);
        let solved = chetaev.chetaev(t, &chetaev.lift(t, x))?;
        let (field, rate) = herglotz_rates(system, t, x)?;
        let size = 1.0 + field.y.max_abs_or_nan().max_or_nan(rate.abs());
        Ok(((solved.a - field.y).max_abs_or_nan() / size).max_or_nan(apart(solved.multiplier, -rate, size)))
    }

    /// Statement 28: `T pi (Gamma) = xi_L o pi`, the flows are pi-related, and the constraint is preserved.
    fn projected_flow(&self) -> Result<f64, ExactError<N>> {
        let Sample { system, t, x, h, .. } = *self;
        let chetaev = NonHolonomic::new(system);
        let start = chetaev.lift(t, x);
        let gamma = chetaev.chetaev(t, &start)?;
        let projected = ChartVector { x: start.v, y: gamma.a, z: start.w };
        let field = relative(projected, HerglotzField { lagrangian: system, t }.at(&(*x).into())?);
        let along = chetaev.flow(t, &start, h)?;
        let flow = relative(along.end.project(), herglotz_flow(system, t, x, h)?.end) / self.growth()?;
        Ok(field.max_or_nan(flow).max_or_nan(along.defect))
    }

    /// Statement 29: `exp_h` is a local diffeomorphism: `T exp_h` and the derivative of the retraction, by duals
    /// through the shooting, are inverse to each other.
    fn local_diffeomorphism(&self) -> Result<f64, ExactError<N>> {
        let forward = self.exponential.differential(self.t, self.x)?;
        if forward.regularity().smallest == 0.0 {
            return Ok(f64::INFINITY);
        }
        let image: ChartVector<N> = forward.image.into();
        let (start, _) = self.exponential.lifted(self.t, &seed(&image).into(), Some(&self.x.v))?;
        let back = DMatrix::from_fn(2 * N + 1, 2 * N + 1, |i, j| match i {
            _ if i < N => start.q[i].d.component(j),
            _ if i < 2 * N => start.v[i - N].d.component(j),
            _ => start.z.d.component(j),
        });
        let jacobian = forward.jacobian();
        let defect = (&back * &jacobian - DMatrix::identity(2 * N + 1, 2 * N + 1)).max_abs_or_nan();
        Ok(defect / (back.max_abs_or_nan() * jacobian.max_abs_or_nan()).max_or_nan(self.growth()?))
    }

    /// Statement 30: `exp_h^xi = pr~_1 o exp_h^Gamma o (pi|M_L)^-1`.
    fn two_exponentials(&self) -> Result<f64, ExactError<N>> {
        let chetaev = NonHolonomic::new(self.system);
        let end = chetaev.flow(self.t, &chetaev.lift(self.t, self.x), self.h)?.end;
        let through = DiscretePoint { q0: self.x.q, q1: end.q, z0: self.x.z };
        Ok(relative(through, self.exponential.at(self.t, self.x)?) / self.growth()?)
    }

    /// Statement 31: `pr~_1` restricted to `M_d` is a local diffeomorphism, and the graph of `z1 = z0 + L_h^e` its
    /// inverse: the smallest singular value is `(1 + |D1|^2 + |D2|^2 + sigma_d^2)^(-1/2)`, with the derivatives by
    /// duals; and `T exp_h^xi = T pr~_1 T exp_h^Gamma T(pi|M_L)^-1`.
    fn projection(&self) -> Result<f64, ExactError<N>> {
        let Sample { system, t, x, h, .. } = *self;
        let chetaev = NonHolonomic::new(system);
        let (exact, y) = self.exact()?;
        let jet = derived_jet(&exact, t, &y).map_err(Self::step_error)?;
        let slope = 1.0 + jet.d1.norm_squared() + jet.d2.norm_squared() + jet.sigma().powi(2);
        let smallest = chetaev.projection_regularity(t, x, h)?.smallest;
        let graph = apart(smallest, slope.sqrt().recip(), smallest);
        // The basis is accurate to round-off times the condition number of the differential whose columns it spans.
        let condition = self.exponential.differential(t, x)?.jacobian().singular_values();
        let graph = graph / (condition.max_abs_or_nan() / condition.min());
        // Rows q0, z0, q1 of the differential, in the order q0, q1, z0.
        let differential = chetaev.exponential_differential(t, x, h)?;
        let row = |i: usize| match i {
            _ if i < N => i,
            _ if i < 2 * N => i + 1,
            _ => N,
        };
        let projected = DMatrix::from_fn(2 * N + 1, 2 * N + 1, |i, j| differential[(row(i), j)]);
        let jacobian = self.exponential.differential(t, x)?.jacobian();
        Ok(graph.max_or_nan((&projected - &jacobian).max_abs_or_nan() / jacobian.max_abs_or_nan()) / self.growth()?)
    }

    /// Statement 32: `R_h^(e-) o exp_h = id`, `exp_h o R_h^(e-) = id`, `R_h^(e+) = phi_h o R_h^(e-)`; velocities in
    /// units of the condition of the exponential map.
    fn retraction(&self) -> Result<f64, ExactError<N>> {
        let (exact, y) = self.exact()?;
        let found = exact.retract(self.t, &y)?;
        let condition = condition(self.system, self.t, self.x, self.h)?;
        let back = (found.start.v - self.x.v).max_abs_or_nan() / (self.x.v.max_abs_or_nan() * condition);
        let forth = relative(self.exponential.at(self.t, &found.start)?, y);
        let moved = HerglotzFlow { lagrangian: self.system, t: self.t, duration: self.h };
        let end = relative(moved.at(&found.start.into())?, found.end);
        Ok(back.max_or_nan(forth.max_or_nan(end) / self.growth()?))
    }

    /// Statement 33: along the motion a variation of z obeys `y' = a + b' y`, and is `e^b(t) (int a e^(-b) ds + y(0))`;
    /// `L_h^e = z(h) - z(0)`. The integrals are computed by Gauss quadrature with 24 nodes on quarters of the panels.
    fn linear_equation(&self) -> Result<f64, ExactError<N>> {
        let Sample { system, t, x, h, .. } = *self;
        let [.., g] = collocations();
        let (mut varied, end) = (seed(&ChartVector::from(*x)).into(), self.exponential.varied(t, x)?);
        let mut integrals = ChartVector::<N>::from_fn(|_| 0.0);
        let (mut sizes, mut action, mut exponent) = (0.0, 0.0, 0.0);
        let parts = 4 * end.panels;
        let part = h / f64::from(parts);
        for k in 0..parts {
            let from = t + f64::from(k) * part;
            for (c, weight) in g.c.iter().zip(&g.b) {
                let at = herglotz_flow(system, from, &varied, c * part)?;
                let point = VelocityPoint { q: at.end.q.map(|e| e.re), v: at.end.v.map(|e| e.re), z: at.end.z.re };
                let d = system.gradient(from + c * part, &point);
                let decay = (-exponent - at.b.re).exp() * weight * part;
                for i in 0..N {
                    let (by_q, by_v) = (at.end.q[i].d.scale(d.x[i] * decay), at.end.v[i].d.scale(d.y[i] * decay));
                    integrals = integrals.plus(by_q).plus(by_v);
                    sizes += by_q.max_abs_or_nan() + by_v.max_abs_or_nan();
                }
                action += system.value(from + c * part, &point.q, &point.v, point.z) * weight * part;
            }
            let next = herglotz_flow(system, from, &varied, part)?;
            exponent += next.b.re;
            varied = next.end;
        }
        let growth = end.b.re.exp();
        let formula = ChartVector { z: integrals.z + 1.0, ..integrals }.scale(growth);
        let size = formula.max_abs_or_nan().max_or_nan(end.end.z.d.max_abs_or_nan()).max_or_nan(sizes * growth);
        let formula = formula.minus(end.end.z.d).max_abs_or_nan() / size;
        let (exact, y) = self.exact()?;
        let value = exact.retract(t, &y)?.action;
        // The two positions are rounded, and the derivatives of the action with respect to them are the momenta.
        let terms = action.abs().max_or_nan(end.action.re.abs());
        let rounded = terms.max_or_nan(self.momenta()? * y.q0.max_abs_or_nan().max_or_nan(y.q1.max_abs_or_nan()));
        let along = apart(end.action.re, action, terms.max_or_nan(self.momenta()? * h));
        Ok(formula.max_or_nan(along).max_or_nan(apart(value, action, rounded)) / self.growth()?)
    }

    /// The size of the momenta at both ends of the motion.
    fn momenta(&self) -> Result<f64, ExactError<N>> {
        let end = herglotz_flow(self.system, self.t, self.x, self.h)?.end;
        let p0 = legendre(self.system, self.t, self.x).p.max_abs_or_nan();
        Ok(p0.max_or_nan(legendre(self.system, self.t + self.h, &end).p.max_abs_or_nan()))
    }

    /// Statement 34: `D1 L_h^e = -p0 e^b`, `D2 L_h^e = p1`, `Dz L_h^e = e^b - 1`, against the derivatives by duals; the
    /// second derivatives from the variational equation likewise.
    fn derivatives(&self) -> Result<f64, ExactError<N>> {
        let (exact, y) = self.exact()?;
        let of = |jet: DiscreteJet<N>| ChartVector { x: jet.d1, y: jet.d2, z: jet.dz };
        let formula = exact.jet(self.t, &y).map_err(Self::step_error)?;
        let derived = derived_jet(&exact, self.t, &y).map_err(Self::step_error)?;
        let first = relative(of(formula), of(derived)).max_or_nan(apart(
            formula.dz,
            derived.dz,
            derived.dz.abs().max_or_nan(self.h),
        ));
        let sigma =
            apart(formula.sigma(), herglotz_flow(self.system, self.t, self.x, self.h)?.sigma(), formula.sigma());
        let closed = exact.second_jet(self.t, &y).map_err(Self::step_error)?;
        let duals = derived_second_jet(&exact, self.t, &y).map_err(Self::step_error)?;
        let size = duals
            .d11
            .max_abs_or_nan()
            .max_or_nan(duals.d12.max_abs_or_nan())
            .max_or_nan(duals.d22.max_abs_or_nan())
            .max_or_nan(duals.d1z.max_abs_or_nan());
        let blocks = (closed.d11 - duals.d11).max_abs_or_nan().max_or_nan((closed.d12 - duals.d12).max_abs_or_nan());
        let blocks = blocks
            .max_or_nan((closed.d22 - duals.d22).max_abs_or_nan())
            .max_or_nan((closed.d1z - duals.d1z).max_abs_or_nan());
        let blocks =
            blocks.max_or_nan((closed.d2z - duals.d2z).max_abs_or_nan()).max_or_nan((closed.dzz - duals.dzz).abs());
        let growth = self.growth()?;
        Ok(first.max_or_nan(sigma).max_or_nan(blocks / (size * growth)) / growth)
    }

    /// The transforms `F-L_h^e` and `F+L_h^e` by their definition, the derivatives by duals.
    fn transforms(&self) -> Result<(PhasePoint<N>, PhasePoint<N>, DiscretePoint<N>), ExactError<N>> {
        let (exact, y) = self.exact()?;
        let jet = derived_jet(&exact, self.t, &y).map_err(Self::step_error)?;
        let minus = PhasePoint { q: y.q0, p: -jet.d1 / (1.0 + jet.dz), z: y.z0 };
        Ok((minus, PhasePoint { q: y.q1, p: jet.d2, z: y.z0 + jet.value }, y))
    }

    /// Statement 35: `F(+-)L_h^e = FL o R_h^(e+-)`.
    fn legendre_transforms(&self) -> Result<f64, ExactError<N>> {
        let (minus, plus, y) = self.transforms()?;
        let found = self.exact()?.0.retract(self.t, &y)?;
        let start = legendre(self.system, self.t, &found.start);
        let end = legendre(self.system, self.t + self.h, &found.end);
        Ok(relative(minus, start).max_or_nan(relative(plus, end)) / self.growth()?)
    }

    /// Statement 36: `L_h^e` is regular, `F+L_h^e = phi_h^{X_H} o F-L_h^e`, and one step of the discrete flow by the
    /// discrete Herglotz equations is the motion; [`follows_motion`] checks the many steps of item 3.
    fn regular_and_exact(&self) -> Result<f64, ExactError<N>> {
        let Sample { t, h, .. } = *self;
        let (minus, plus, y) = self.transforms()?;
        let (exact, _) = self.exact()?;
        let second = derived_second_jet(&exact, t, &y).map_err(Self::step_error)?;
        if second.regularity().smallest == 0.0 {
            return Ok(f64::INFINITY);
        }
        let guess = (y.q1 - y.q0) / h;
        let step = exact.forward(t, &minus, &guess, &mut Default::default()).map_err(Self::step_error)?;
        let flow = relative(step.end, plus);
        let solved = legendre_minus_inverse(&ByEquations(exact), t, &minus, &guess).map_err(Self::step_error)?;
        Ok(flow.max_or_nan(relative(solved, y)) / self.growth()?)
    }
}

/// Composition: `L_{h1+h2}^e(q0, q2, z0) = L_{h1}^e(q0, q1, z0) + L_{h2}^e(q1, q2, z1)` at the critical `q1`, which is
/// the position of the motion, and only there. The residual is that of the equality and of the point; it is infinite if
/// another point is as near to critical or has the same sum.
///
/// # Errors
/// Those of the motion over `h1 + h2` and of the steps.
pub fn composition<const N: usize>(
    lagrangian: &impl Lagrangian<N>,
    t: f64,
    x: &VelocityPoint<N>,
    (h1, h2): (f64, f64),
) -> Result<f64, ExactError<N>> {
    let failed = |e| ExactError::Input(InputError::FirstStep(e));
    let middle = herglotz_flow(lagrangian, t, x, h1)?.end;
    let whole = herglotz_flow(lagrangian, t, x, h1 + h2)?;
    let first = ExactLagrangian::new(lagrangian, h1)?.near(x.v);
    let second = ExactLagrangian::new(lagrangian, h2)?.near(middle.v);
    let ends = [x.q, whole.end.q];
    let aside = |by: f64| middle.q + SVector::from_element(by * (h1 + h2) * (1.0 + x.v.max_abs_or_nan()));
    let found = compose(&first, &second, t, (&ends, x.z), &aside(1e-3)).map_err(failed)?;
    let beside = through(&first, &second, t, (&ends, x.z), &aside(1e-2)).map_err(failed)?;
    let p = lagrangian
        .gradient(t, x)
        .y
        .max_abs_or_nan()
        .max_or_nan(lagrangian.gradient(t + h1, &middle).y.max_abs_or_nan());
    if beside.slope.max_abs_or_nan() < 1e-4 * p || beside.value == found.value {
        return Ok(f64::INFINITY);
    }
    let size = x.q.max_abs_or_nan().max_or_nan(whole.end.q.max_abs_or_nan()).max_or_nan(middle.q.max_abs_or_nan());
    // The rounding of the ends changes the value by p times itself.
    let value = apart(found.value, whole.action, whole.action.abs() + p * size);
    Ok(value.max_or_nan((found.q1 - middle.q).max_abs_or_nan() / size))
}
