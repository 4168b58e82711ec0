//! The stage equations of contact Gauss collocation and their Jacobian, for Newton's method in the general route and
//! for the discrete Lagrangian. For constant mass and constant rate
//! [`PositionNewton`](crate::gauss::stages::position_newton::PositionNewton) has fewer unknowns.

use crate::gauss::limits::MAX_NEWTON_ITERATIONS;
use crate::gauss::stages::applied_force::AppliedForce;
use crate::gauss::stages::damping::{Damping, Verdict, chances};
use crate::gauss::tables::coefficients::{Coefficients, MAX_STAGES};
use crate::numbers::array::from_fn;
use crate::solve::DenseLu;
use crate::solve::inverse::inverse;
use crate::solve::mass_matrix::BLOCK;
use crate::{StepError, solve::ITERATION_LIMIT};
use contact_geom::nalgebra::{DMatrix, DVector, SVector};
use contact_geom::{
    ChartVector, Derivatives, Dual, Hessian, Lagrangian, PhasePoint, Scalar, VelocityPoint, numbers::max_or_nan,
    support::seed,
};

/// The coefficients of the method multiplied by the step size, which may be negative.
#[derive(Clone, Debug)]
pub(crate) struct Products {
    pub s: usize,
    pub h: f64,
    a: [[f64; MAX_STAGES]; MAX_STAGES],
    b: [f64; MAX_STAGES],
    c: [f64; MAX_STAGES],
}

impl Products {
    pub fn new(s: usize, h: f64) -> Self {
        let g = Coefficients::of(s);
        Products { s, h, a: g.a.map(|row| row.map(|e| h * e.0)), b: g.b.map(|e| h * e.0), c: g.c.map(|e| h * e.0) }
    }
}

impl Products {
    /// The time `c_j h` of a stage, from the start of the step.
    pub fn time(&self, j: usize) -> f64 {
        self.c[j]
    }

    /// The quadrature weight `b_j` of a stage.
    pub fn weight(&self, j: usize) -> f64 {
        self.b[j] / self.h
    }
}

/// The given data of a step.
#[derive(Clone, Copy)]
pub(crate) enum Given<const N: usize, T> {
    /// The state `(q0, p0, z0)`.
    Start(PhasePoint<N, T>),
    /// `(q0, q1, z0)`; the momentum is an unknown.
    Ends { q0: SVector<T, N>, q1: SVector<T, N>, z0: T },
}

/// The unknowns: velocity, action and integrating factor of each stage, and the momentum at the start.
#[derive(Clone)]
pub(crate) struct StageUnknowns<const N: usize, T> {
    pub v: Vec<SVector<T, N>>,
    pub z: Vec<T>,
    pub rho: Vec<T>,
    pub p0: SVector<T, N>,
}

impl<const N: usize> StageUnknowns<N, f64> {
    /// Sets the unknowns to a motion of constant velocity.
    fn make_uniform(&mut self, v: &SVector<f64, N>, p0: &SVector<f64, N>, z0: f64) {
        self.v.fill(*v);
        self.z.fill(z0);
        self.rho.fill(1.0);
        self.p0 = *p0;
    }

    /// The largest integrating factor divided by the smallest, including the value 1 at the start. Momenta are sums of
    /// terms with all factors, divided by one of them; their round-off grows with this ratio.
    fn spread(&self) -> f64 {
        let over = |f: &dyn Fn(f64) -> f64| self.rho.iter().fold(1.0, |m, r| max_or_nan(m, f(*r)));
        over(&|r| r.abs()) * over(&|r| 1.0 / r.abs())
    }

    fn copy_from(&mut self, x: &Self) {
        self.v.copy_from_slice(&x.v);
        self.z.copy_from_slice(&x.z);
        self.rho.copy_from_slice(&x.rho);
        self.p0 = x.p0;
    }

    /// The same unknowns as constants over another scalar type.
    pub fn lifted<T: Scalar>(&self) -> StageUnknowns<N, T> {
        StageUnknowns {
            v: self.v.iter().map(|v| v.map(T::from)).collect(),
            z: self.z.iter().map(|z| T::from(*z)).collect(),
            rho: self.rho.iter().map(|r| T::from(*r)).collect(),
            p0: self.p0.map(T::from),
        }
    }
}

/// The end of a step, and the momentum at its start.
pub(crate) struct StepEnd<const N: usize, T> {
    pub p0: SVector<T, N>,
    pub q: SVector<T, N>,
    pub p: SVector<T, N>,
    /// `z1 - z0`.
    pub action: T,
    /// `rho` at the end, `1 / sigma_d`.
    pub rho: T,
}

/// L with its gradient at a stage, and `L_q + f` with the applied force f.
#[derive(Clone, Copy)]
pub(crate) struct StageValue<const N: usize, T> {
    pub l: Dual<T, ChartVector<N, T>>,
    pub force: SVector<T, N>,
}

/// The unknowns of solved stages over a scalar with derivatives, with L and its gradient there.
pub(crate) type LiftedStages<const N: usize, T> = (StageUnknowns<N, T>, Vec<StageValue<N, T>>);

/// The workspace of Newton's method; made once for a run, so that steps do not allocate.
pub(crate) struct Workspace<const N: usize> {
    /// The guess, then the solution.
    pub x: StageUnknowns<N, f64>,
    /// L and its gradient at the stages of the solution.
    pub l: Vec<StageValue<N, f64>>,
    /// The last accepted iterate.
    from: StageUnknowns<N, f64>,
    jacobian: DMatrix<f64>,
    /// The LU factors of the Jacobian in use, at the last accepted iterate or at an earlier one.
    lu: DenseLu,
    residual: DVector<f64>,
    correction: DVector<f64>,
    next: DVector<f64>,
}

/// The stage equations of a step.
pub(crate) struct StageEquations<'a, L, const N: usize> {
    pub lagrangian: &'a L,
    pub products: &'a Products,
    pub t: f64,
}

impl<L: Lagrangian<N>, const N: usize> StageEquations<'_, L, N> {
    /// The number of unknowns.
    fn unknowns<T>(&self, given: &Given<N, T>) -> usize {
        self.products.s * (N + 2) + if matches!(given, Given::Ends { .. }) { N } else { 0 }
    }

    /// `q0 + hA V` at a stage.
    pub fn position<T: Scalar>(&self, given: &Given<N, T>, x: &StageUnknowns<N, T>, i: usize) -> SVector<T, N> {
        let (Given::Start(PhasePoint { q: q0, .. }) | Given::Ends { q0, .. }) = given;
        x.v.iter().zip(&self.products.a[i]).fold(*q0, |sum, (v, a)| sum + v.map(|e| e * *a))
    }

    /// Evaluates L and its gradient at the stages.
    fn stages<T: Scalar>(&self, given: &Given<N, T>, x: &StageUnknowns<N, T>, l: &mut Vec<StageValue<N, T>>) {
        l.clear();
        l.extend((0..self.products.s).map(|i| {
            let y = VelocityPoint { q: self.position(given, x, i), v: x.v[i], z: x.z[i] };
            let t = T::from(self.t + self.products.c[i]);
            // Dual numbers with many directions would not fit on the stack.
            let l = if const { N > BLOCK } {
                let (re, d) = self.lagrangian.with_gradient(t, &y);
                Dual { re, d }
            } else {
                self.lagrangian.along(t, &seed(&ChartVector::from(y)).into())
            };
            let mut force = l.d.x;
            if const { L::HINTS.forced } {
                let applied = self.lagrangian.applied_force(t, &y);
                for d in 0..N {
                    force[d] += applied[d];
                }
            }
            StageValue { l, force }
        }));
    }

    /// The workspace for steps with this kind of given data.
    pub fn workspace(&self, given: &Given<N, f64>) -> Workspace<N> {
        let (s, n) = (self.products.s, self.unknowns(given));
        let x =
            StageUnknowns { v: vec![SVector::zeros(); s], z: vec![0.0; s], rho: vec![1.0; s], p0: SVector::zeros() };
        let numbers = DVector::zeros(n);
        Workspace {
            from: x.clone(),
            x,
            l: Vec::with_capacity(s),
            jacobian: DMatrix::zeros(n, n),
            lu: DenseLu::new(n),
            residual: numbers.clone(),
            correction: numbers.clone(),
            next: numbers,
        }
    }

    /// The residuals, in the order: momenta, actions, integrating factors, end position.
    pub fn residual<T: Scalar>(
        &self,
        given: &Given<N, T>,
        x: &StageUnknowns<N, T>,
        l: &[StageValue<N, T>],
        out: &mut DVector<T>,
    ) {
        let Products { s, a, b, .. } = self.products;
        let (p0, z0) = match given {
            Given::Start(state) => (state.p, state.z),
            Given::Ends { z0, .. } => (x.p0, *z0),
        };
        for i in 0..*s {
            let mut momentum = SVector::<T, N>::from_fn(|d, _| x.rho[i] * l[i].l.d.y[d] - p0[d]);
            let (mut action, mut factor) = (x.z[i] - z0, x.rho[i] - 1.0);
            for j in 0..*s {
                for d in 0..N {
                    momentum[d] -= x.rho[j] * l[j].force[d] * a[i][j];
                }
                action -= l[j].l.re * a[i][j];
                factor += x.rho[j] * l[j].l.d.z * a[i][j];
            }
            for d in 0..N {
                out[i * N + d] = momentum[d];
            }
            out[s * N + i] = action;
            out[s * (N + 1) + i] = factor;
        }
        if let Given::Ends { q0, q1, .. } = given {
            for d in 0..N {
                let moved = x.v.iter().zip(b).fold(T::zero(), |sum, (v, b)| sum + v[d] * *b);
                out[s * (N + 2) + d] = q0[d] - q1[d] + moved;
            }
        }
    }

    /// The Jacobian of the residuals.
    pub fn jacobian(
        &self,
        given: &Given<N, f64>,
        x: &StageUnknowns<N, f64>,
        l: &[StageValue<N, f64>],
        out: &mut DMatrix<f64>,
    ) {
        let Products { s, a, b, c, .. } = self.products;
        let s = *s;
        out.fill(0.0);
        let (row_z, row_r) = (s * N, s * (N + 1));
        for k in 0..s {
            let y = VelocityPoint { q: self.position(given, x, k), v: x.v[k], z: x.z[k] };
            let Hessian { qq, qv, vv, qz, vz, zz } = &self.lagrangian.hessian(self.t + c[k], &y);
            let (rho, g, force) = (x.rho[k], &l[k].l.d, &l[k].force);
            // The derivatives of L_q + f.
            let (mut force_q, mut force_v, mut force_z) = (*qq, *qv, *qz);
            if let Some(applied) = AppliedForce::of(self.lagrangian, self.t + c[k], &y) {
                (force_q, force_v, force_z) = (force_q + applied.q, force_v + applied.v, force_z + applied.z);
            }
            let weights: [f64; MAX_STAGES] = from_fn(|i| a[i][k]);
            // The contribution of stage k to the equations of stage i through its velocity, action and factor.
            for i in 0..s {
                let (own, w) = (if i == k { 1.0 } else { 0.0 }, a[i][k]);
                for d in 0..N {
                    for e in 0..N {
                        out[(i * N + d, k * N + e)] += rho * (own * vv[(d, e)] - w * force_v[(d, e)]);
                    }
                    out[(i * N + d, row_z + k)] += rho * (own * vz[d] - w * force_z[d]);
                    out[(i * N + d, row_r + k)] += own * g.y[d] - w * force[d];
                    out[(row_z + i, k * N + d)] -= w * g.y[d];
                    out[(row_r + i, k * N + d)] += w * rho * vz[d];
                }
                out[(row_z + i, row_z + k)] += own - w * g.z;
                out[(row_r + i, row_z + k)] += w * rho * zz;
                out[(row_r + i, row_r + k)] += own + w * g.z;
            }
            // Its contribution through its position, which depends on the velocities of all stages.
            let n = out.nrows();
            for (j, &moved) in a[k][..s].iter().enumerate() {
                for e in 0..N {
                    let column = &mut out.as_mut_slice()[(j * N + e) * n..][..n];
                    let (momenta, rest) = column.split_at_mut(row_z);
                    let (actions, factors) = rest.split_at_mut(s);
                    for d in 0..N {
                        momenta[k * N + d] += rho * qv[(e, d)] * moved;
                    }
                    let (force, of_action, of_factor) =
                        (force_q.column(e) * (rho * moved), g.x[e] * moved, rho * qz[e] * moved);
                    for (momentum, w) in momenta.chunks_exact_mut(N).zip(&weights) {
                        for (entry, force) in momentum.iter_mut().zip(force.iter()) {
                            *entry -= w * force;
                        }
                    }
                    for ((action, factor), w) in actions.iter_mut().zip(factors).zip(&weights) {
                        *action -= w * of_action;
                        *factor += w * of_factor;
                    }
                }
            }
        }
        if let Given::Ends { .. } = given {
            let last = s * (N + 2);
            for d in 0..N {
                for i in 0..s {
                    out[(i * N + d, last + d)] = -1.0;
                    out[(last + d, i * N + d)] = b[i];
                }
            }
        }
    }

    /// Subtracts `part` times a Newton correction from the unknowns.
    fn add<T: Scalar>(&self, x: &mut StageUnknowns<N, T>, change: &DVector<T>, part: f64) {
        let s = self.products.s;
        for i in 0..s {
            for d in 0..N {
                x.v[i][d] -= change[i * N + d] * part;
            }
            x.z[i] -= change[s * N + i] * part;
            x.rho[i] -= change[s * (N + 1) + i] * part;
        }
        for (p, change) in x.p0.iter_mut().zip(change.iter().skip(s * (N + 2))) {
            *p -= *change * part;
        }
    }

    /// The size of a correction: the largest component, each kind relative to the largest unknown of that kind. The
    /// momentum at the start is compared with the momenta `L_v` of the stages too, since it vanishes if the motion
    /// starts at rest.
    fn size<T: Scalar>(&self, x: &StageUnknowns<N, T>, l: &[StageValue<N, T>], change: &DVector<T>) -> f64 {
        let s = self.products.s;
        let mut worst = 0.0f64;
        let mut see = |change: f64, size: f64| {
            let relative = if change > 0.0 && size > 0.0 { change / size } else { f64::from(u8::from(change > 0.0)) };
            // `f64::max` would hide a NaN.
            if relative > worst || relative.is_nan() {
                worst = relative;
            }
        };
        let of = |range: std::ops::Range<usize>| {
            change.iter().skip(range.start).take(range.len()).fold(0.0, |m, c| max_or_nan(m, c.extent()))
        };
        see(of(0..s * N), x.v.iter().flatten().fold(0.0, |m, v| max_or_nan(m, v.extent())));
        see(of(s * N..s * (N + 1)), x.z.iter().fold(0.0, |m, z| max_or_nan(m, z.extent())));
        see(of(s * (N + 1)..s * (N + 2)), x.rho.iter().fold(1.0, |m, r| max_or_nan(m, r.extent())));
        let momenta = l.iter().flat_map(|l| l.l.d.y.iter()).chain(x.p0.iter());
        see(of(s * (N + 2)..change.len()), momenta.fold(0.0, |m, p| max_or_nan(m, p.extent())));
        worst
    }

    /// Solves the stage equations by damped Newton iteration from a motion of constant velocity `v`, with the momentum
    /// `p0`. Returns the number of iterations.
    ///
    /// # Errors
    /// [`StepError::NotConverged`], [`StepError::Singular`], [`StepError::NonFinite`].
    pub fn solve(
        &self,
        given: &Given<N, f64>,
        v: &SVector<f64, N>,
        p0: &SVector<f64, N>,
        work: &mut Workspace<N>,
    ) -> Result<u32, StepError> {
        let Workspace { x, l, from, jacobian, lu, residual, correction, next } = work;
        let (Given::Start(PhasePoint { z: z0, .. }) | Given::Ends { z0, .. }) = given;
        x.make_uniform(v, p0, *z0);
        from.copy_from(x);
        self.stages(given, x, l);
        self.residual(given, x, l, residual);
        if !residual.iter().all(|r| r.is_finite()) {
            return Err(StepError::NonFinite);
        }
        let (mut damping, mut change) = (Damping::new(chances(residual.len())), f64::INFINITY);
        for iterations in 1..=MAX_NEWTON_ITERATIONS {
            if damping.renews() {
                self.jacobian(given, x, l, jacobian);
                lu.factorise(|i, j| jacobian[(i, j)])?;
                correction.copy_from(residual);
                lu.solve(correction.as_mut_slice())?;
            } else {
                std::mem::swap(correction, next);
            }
            let after = loop {
                x.copy_from(from);
                self.add(x, correction, damping.part());
                self.stages(given, x, l);
                self.residual(given, x, l, residual);
                next.copy_from(residual);
                let after = if lu.solve(next.as_mut_slice()).is_ok() { self.size(x, l, next) } else { f64::NAN };
                change = self.size(x, l, correction);
                // No damping once half of the digits are correct.
                match damping.judge(change, after, f64::EPSILON.sqrt()) {
                    Verdict::Taken => break after,
                    Verdict::Again => {}
                    Verdict::GivenUp => return Err(StepError::NotConverged { residual: change, iterations }),
                }
            };
            // The round-off of a solution, which grows with the number of unknowns; at most half of the digits.
            let round_off = f64::EPSILON * max_or_nan(1e3, 8.0 * residual.len() as f64);
            let near = (round_off * x.spread()).min(f64::EPSILON.sqrt());
            if after <= f64::EPSILON || damping.ratio() >= 0.5 && after <= near {
                return Ok(iterations);
            }
            if damping.ratio() * after <= f64::EPSILON {
                self.add(x, next, 1.0);
                self.stages(given, x, l);
                return Ok(iterations + 1);
            }
            from.copy_from(x);
        }
        Err(StepError::NotConverged { residual: change, iterations: MAX_NEWTON_ITERATIONS })
    }

    /// The end of a solved step, from L and its gradient at the stages.
    pub fn end<T: Scalar>(
        &self,
        given: &Given<N, T>,
        x: &StageUnknowns<N, T>,
        l: &[StageValue<N, T>],
    ) -> StepEnd<N, T> {
        let Products { b, .. } = self.products;
        let (q0, p0) = match given {
            Given::Start(state) => (state.q, state.p),
            Given::Ends { q0, .. } => (*q0, x.p0),
        };
        let sum = |f: &dyn Fn(usize) -> T| (0..self.products.s).fold(T::zero(), |sum, j| sum + f(j) * b[j]);
        let rho = -sum(&|j| x.rho[j] * l[j].l.d.z) + 1.0;
        StepEnd {
            p0,
            q: SVector::from_fn(|d, _| q0[d] + sum(&|j| x.v[j][d])),
            p: SVector::from_fn(|d, _| (p0[d] + sum(&|j| x.rho[j] * l[j].force[d])) / rho),
            action: sum(&|j| l[j].l.re),
            rho,
        }
    }

    /// The end of the step over a scalar with derivatives, from the solution over `f64`.
    ///
    /// # Errors
    /// Those of [`lifted`](Self::lifted).
    pub fn lifted_end<T: Scalar>(
        &self,
        given: &Given<N, T>,
        plain: &Given<N, f64>,
        work: &mut Workspace<N>,
    ) -> Result<StepEnd<N, T>, StepError> {
        let (x, l) = self.lifted(given, plain, work)?;
        Ok(self.end(given, &x, &l))
    }

    /// The solved stages over a scalar with derivatives, from the solution over `f64`: each correction by the inverse
    /// Jacobian determines one more order of derivatives.
    ///
    /// # Errors
    /// [`StepError::Singular`], [`StepError::NotConverged`].
    pub fn lifted<T: Scalar>(
        &self,
        given: &Given<N, T>,
        plain: &Given<N, f64>,
        work: &mut Workspace<N>,
    ) -> Result<LiftedStages<N, T>, StepError> {
        let n = self.unknowns(plain);
        self.jacobian(plain, &work.x, &work.l, &mut work.jacobian);
        let inverse = inverse(&work.jacobian).ok_or(StepError::Singular { pivot: 0.0 })?;
        let (mut x, mut l) = (work.x.lifted::<T>(), Vec::new());
        let (mut residual, mut change) = (DVector::from_element(n, T::zero()), DVector::from_element(n, T::zero()));
        let mut before = f64::INFINITY;
        for _ in 0..ITERATION_LIMIT {
            self.stages(given, &x, &mut l);
            self.residual(given, &x, &l, &mut residual);
            for i in 0..n {
                change[i] = (0..n).fold(T::zero(), |sum, j| sum + residual[j] * inverse[(i, j)]);
            }
            self.add(&mut x, &change, 1.0);
            let size = self.size(&x, &l, &change);
            // Apart from round-off the iteration is finite.
            if size <= f64::EPSILON || (size >= 0.5 * before && size <= 1e-10) {
                self.stages(given, &x, &mut l);
                return Ok((x, l));
            }
            before = size;
        }
        Err(StepError::NotConverged { residual: before, iterations: ITERATION_LIMIT })
    }
}
