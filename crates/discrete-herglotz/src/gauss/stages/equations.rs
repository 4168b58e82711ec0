//! The stage equations of contact Gauss collocation and their Jacobian, for Newton's method in the general route and
//! for the discrete Lagrangian. For constant mass and constant rate
//! [`PositionNewton`](crate::gauss::stages::position_newton::PositionNewton) has fewer unknowns.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::gauss::limits::MAX_NEWTON_ITERATIONS;
use crate::gauss::stages::damping::{Damping, Verdict, chances};
use crate::gauss::stages::lifted_equations::{LiftedStages, StageUnknowns, StageValue as TypedValue};
use crate::gauss::system::{Gradient, PointDerivatives, PointRef, SystemAtPoints};
use crate::gauss::tables::coefficients::{Coefficients, MAX_STAGES};
use crate::numbers::array::from_fn;
use crate::solve::DenseLu;
use crate::solve::inverse::inverse;
use crate::{StepError, gauss::system::vector_of};
use contact_geom::nalgebra::DMatrix;
use contact_geom::{ChartVector, Dual, Scalar, numbers::max_or_nan};

/// The coefficients of the method multiplied by the step size, which may be negative.
#[derive(Clone, Debug)]
pub(crate) struct Products {
    pub s: usize,
    pub h: f64,
    pub a: [[f64; MAX_STAGES]; MAX_STAGES],
    pub b: [f64; MAX_STAGES],
    pub c: [f64; MAX_STAGES],
}

impl Products {
    pub fn new(s: usize, h: f64) -> Self {
        let g = Coefficients::of(s);
        Products { s, h, a: g.a.map(|row| row.map(|e| h * e.0)), b: g.b.map(|e| h * e.0), c: g.c.map(|e| h * e.0) }
    }

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
pub(crate) enum Given<'r> {
    /// The state `(q0, p0, z0)`.
    Start(PointRef<'r>),
    /// `(q0, q1, z0)`; the momentum is an unknown.
    Ends { q0: &'r [f64], q1: &'r [f64], z0: f64 },
}

impl Given<'_> {
    fn z0(&self) -> f64 {
        let (Given::Start(PointRef { z: z0, .. }) | Given::Ends { z0, .. }) = self;
        *z0
    }
}

/// The unknowns: velocity, action and integrating factor of each stage, and the momentum at the start.
#[derive(Clone)]
pub(crate) struct Unknowns {
    /// The velocities, one stage after another.
    v: Vec<f64>,
    z: Vec<f64>,
    rho: Vec<f64>,
    p0: Vec<f64>,
}

impl Unknowns {
    fn zeros(n: usize, s: usize) -> Self {
        Unknowns { v: vec![0.0; s * n], z: vec![0.0; s], rho: vec![1.0; s], p0: vec![0.0; n] }
    }

    /// The velocity of a stage.
    pub fn velocity(&self, i: usize) -> &[f64] {
        let n = self.p0.len();
        &self.v[i * n..][..n]
    }

    /// The integrating factor of a stage.
    pub fn factor(&self, i: usize) -> f64 {
        self.rho[i]
    }

    /// Sets the unknowns to a motion of constant velocity.
    fn make_uniform(&mut self, v: &[f64], p0: &[f64], z0: f64) {
        for i in 0..self.z.len() {
            self.v[i * v.len()..][..v.len()].copy_from_slice(v);
        }
        self.z.fill(z0);
        self.rho.fill(1.0);
        self.p0.copy_from_slice(p0);
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
        self.p0.copy_from_slice(&x.p0);
    }

    /// Subtracts `part` times a Newton correction.
    fn subtract(&mut self, change: &[f64], part: f64) {
        let unknowns = self.v.iter_mut().chain(&mut self.z).chain(&mut self.rho).chain(&mut self.p0);
        for (x, change) in unknowns.zip(change) {
            *x -= change * part;
        }
    }
}

/// L with its gradient at a stage, and `L_q + f` with the applied force f.
pub(crate) struct StageValue {
    pub l: f64,
    gradient: Gradient,
    force: Vec<f64>,
}

/// The workspace of Newton's method; made once for a run, so that steps do not allocate.
pub(crate) struct Workspace {
    /// The guess, then the solution.
    pub x: Unknowns,
    /// L and its gradient at the stages of the solution.
    pub l: Vec<StageValue>,
    /// The derivatives at one point.
    pub derivatives: PointDerivatives,
    /// The last accepted iterate.
    from: Unknowns,
    /// The position of a stage.
    q: Vec<f64>,
    /// The derivatives of `L_q + f` at a stage in q, v and z, and one column of the first times a factor.
    force_q: DMatrix<f64>,
    force_v: DMatrix<f64>,
    force_z: Vec<f64>,
    pushed: Vec<f64>,
    jacobian: DMatrix<f64>,
    /// The LU factors of the Jacobian in use, at the last accepted iterate or at an earlier one.
    lu: DenseLu,
    residual: Vec<f64>,
    correction: Vec<f64>,
    next: Vec<f64>,
}

impl Workspace {
    /// The workspace for steps of s stages: from a state, or between given ends.
    pub fn new(system: &dyn SystemAtPoints, s: usize, between_ends: bool) -> Self {
        let n = system.dimension();
        let unknowns = s * (n + 2) + if between_ends { n } else { 0 };
        let value = |_| StageValue { l: 0.0, gradient: Gradient::zeros(n), force: vec![0.0; n] };
        let numbers = || vec![0.0; unknowns];
        Workspace {
            x: Unknowns::zeros(n, s),
            l: (0..s).map(value).collect(),
            derivatives: PointDerivatives::of(system),
            from: Unknowns::zeros(n, s),
            q: vec![0.0; n],
            force_q: DMatrix::zeros(n, n),
            force_v: DMatrix::zeros(n, n),
            force_z: vec![0.0; n],
            pushed: vec![0.0; n],
            jacobian: DMatrix::zeros(unknowns, unknowns),
            lu: DenseLu::new(unknowns),
            residual: numbers(),
            correction: numbers(),
            next: numbers(),
        }
    }

    /// The solution, with L and its gradient there, for code that is compiled for N coordinates.
    pub fn solution<const N: usize>(&self) -> LiftedStages<N, f64> {
        let x = &self.x;
        let unknowns = StageUnknowns {
            v: (0..x.z.len()).map(|i| vector_of(x.velocity(i))).collect(),
            z: x.z.clone(),
            rho: x.rho.clone(),
            p0: vector_of(&x.p0),
        };
        let value = |StageValue { l, gradient: Gradient { q, v, z }, force }: &StageValue| TypedValue {
            l: Dual { re: *l, d: ChartVector { x: vector_of(q), y: vector_of(v), z: *z } },
            force: vector_of(force),
        };
        (unknowns, self.l.iter().map(value).collect())
    }
}

/// The stage equations of a step.
#[derive(Clone, Copy)]
pub(crate) struct StageEquations<'a> {
    pub system: &'a dyn SystemAtPoints,
    pub products: &'a Products,
    pub t: f64,
}

impl StageEquations<'_> {
    /// `q0 + hA V` at a stage.
    fn position(&self, given: &Given<'_>, x: &Unknowns, i: usize, q: &mut [f64]) {
        let (Given::Start(PointRef { q: q0, .. }) | Given::Ends { q0, .. }) = given;
        q.copy_from_slice(q0);
        for j in 0..self.products.s {
            for (q, v) in q.iter_mut().zip(x.velocity(j)) {
                *q += v * self.products.a[i][j];
            }
        }
    }

    /// Evaluates L and its gradient at the stages.
    fn stages(&self, given: &Given<'_>, x: &Unknowns, q: &mut [f64], l: &mut [StageValue]) {
        for (i, StageValue { l, gradient, force }) in l.iter_mut().enumerate() {
            self.position(given, x, i, q);
            let at = PointRef { q, v: x.velocity(i), z: x.z[i] };
            *l = self.system.stage_value(self.t + self.products.c[i], at, gradient, force);
        }
    }

    /// The residuals, in the order: momenta, actions, integrating factors, end position.
    fn residual(&self, given: &Given<'_>, x: &Unknowns, l: &[StageValue], out: &mut [f64]) {
        let Products { s, a, b, .. } = self.products;
        let (s, n, z0) = (*s, x.p0.len(), given.z0());
        let p0 = match given {
            Given::Start(state) => state.v,
            Given::Ends { .. } => &x.p0,
        };
        for i in 0..s {
            let momentum = &mut out[i * n..][..n];
            for d in 0..n {
                momentum[d] = x.rho[i] * l[i].gradient.v[d] - p0[d];
            }
            let (mut action, mut factor) = (x.z[i] - z0, x.rho[i] - 1.0);
            for j in 0..s {
                for d in 0..n {
                    momentum[d] -= x.rho[j] * l[j].force[d] * a[i][j];
                }
                action -= l[j].l * a[i][j];
                factor += x.rho[j] * l[j].gradient.z * a[i][j];
            }
            out[s * n + i] = action;
            out[s * (n + 1) + i] = factor;
        }
        if let Given::Ends { q0, q1, .. } = given {
            for d in 0..n {
                let moved = (0..s).fold(0.0, |sum, j| sum + x.v[j * n + d] * b[j]);
                out[s * (n + 2) + d] = q0[d] - q1[d] + moved;
            }
        }
    }

    /// Computes the Jacobian of the residuals at the unknowns `x` with the values `l`.
    fn jacobian(&self, given: &Given<'_>, work: &mut Workspace) {
        let Workspace { x, l, derivatives, q, force_q, force_v, force_z, pushed, jacobian: out, .. } = work;
        let Products { s, a, b, c, .. } = self.products;
        let (s, n) = (*s, x.p0.len());
        out.fill(0.0);
        let (row_z, row_r, rows) = (s * n, s * (n + 1), out.nrows());
        for k in 0..s {
            self.position(given, x, k, q);
            let at = PointRef { q, v: x.velocity(k), z: x.z[k] };
            self.system.derivatives(self.t + c[k], at, derivatives);
            let PointDerivatives { qq, qv, vv, qz, vz, zz, force: applied, .. } = &*derivatives;
            let (rho, g, force) = (x.rho[k], &l[k].gradient, &l[k].force);
            // The derivatives of L_q + f.
            force_q.copy_from(qq);
            force_v.copy_from(qv);
            force_z.copy_from_slice(qz);
            if let Some(applied) = applied {
                *force_q += &applied.q;
                *force_v += &applied.v;
                force_z.iter_mut().zip(&applied.z).for_each(|(sum, z)| *sum += z);
            }
            let weights: [f64; MAX_STAGES] = from_fn(|i| a[i][k]);
            // The contribution of stage k to the equations of stage i through its velocity, action and factor.
            for i in 0..s {
                let (own, w) = (if i == k { 1.0 } else { 0.0 }, a[i][k]);
                for d in 0..n {
                    for e in 0..n {
                        out[(i * n + d, k * n + e)] += rho * (own * vv[(d, e)] - w * force_v[(d, e)]);
                    }
                    out[(i * n + d, row_z + k)] += rho * (own * vz[d] - w * force_z[d]);
                    out[(i * n + d, row_r + k)] += own * g.v[d] - w * force[d];
                    out[(row_z + i, k * n + d)] -= w * g.v[d];
                    out[(row_r + i, k * n + d)] += w * rho * vz[d];
                }
                out[(row_z + i, row_z + k)] += own - w * g.z;
                out[(row_r + i, row_z + k)] += w * rho * zz;
                out[(row_r + i, row_r + k)] += own + w * g.z;
            }
            // Its contribution through its position, which depends on the velocities of all stages.
            for (j, &moved) in a[k][..s].iter().enumerate() {
                for e in 0..n {
                    let column = &mut out.as_mut_slice()[(j * n + e) * rows..][..rows];
                    let (momenta, rest) = column.split_at_mut(row_z);
                    let (actions, factors) = rest.split_at_mut(s);
                    for d in 0..n {
                        momenta[k * n + d] += rho * qv[(e, d)] * moved;
                        pushed[d] = force_q[(d, e)] * (rho * moved);
                    }
                    let (of_action, of_factor) = (g.q[e] * moved, rho * qz[e] * moved);
                    for (momentum, w) in momenta.chunks_exact_mut(n).zip(&weights) {
                        for (entry, force) in momentum.iter_mut().zip(&*pushed) {
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
            let last = s * (n + 2);
            for d in 0..n {
                for i in 0..s {
                    out[(i * n + d, last + d)] = -1.0;
                    out[(last + d, i * n + d)] = b[i];
                }
            }
        }
    }

    /// The inverse of the Jacobian at the solution; `None` if it is singular.
    pub fn inverse_jacobian(&self, given: &Given<'_>, work: &mut Workspace) -> Option<DMatrix<f64>> {
        self.jacobian(given, work);
        inverse(&work.jacobian)
    }

    /// Solves the stage equations by damped Newton iteration from a motion of constant velocity `v`, with the momentum
    /// `p0`. Returns the number of iterations.
    ///
    /// # Errors
    /// [`StepError::NotConverged`], [`StepError::Singular`], [`StepError::NonFinite`].
    pub fn solve(&self, given: &Given<'_>, v: &[f64], p0: &[f64], work: &mut Workspace) -> Result<u32, StepError> {
        work.x.make_uniform(v, p0, given.z0());
        work.from.copy_from(&work.x);
        self.evaluate(given, work);
        if !work.residual.iter().all(|r| r.is_finite()) {
            return Err(StepError::NonFinite);
        }
        let unknowns = work.residual.len();
        let (mut damping, mut change) = (Damping::new(chances(unknowns)), f64::INFINITY);
        for iterations in 1..=MAX_NEWTON_ITERATIONS {
            if damping.renews() {
                self.jacobian(given, work);
                let Workspace { jacobian, lu, residual, correction, .. } = &mut *work;
                lu.factorise(|i, j| jacobian[(i, j)])?;
                correction.copy_from_slice(residual);
                lu.solve(correction)?;
            } else {
                std::mem::swap(&mut work.correction, &mut work.next);
            }
            let after = loop {
                work.x.copy_from(&work.from);
                work.x.subtract(&work.correction, damping.part());
                self.evaluate(given, work);
                let Workspace { x, l, lu, residual, correction, next, .. } = &mut *work;
                next.copy_from_slice(residual);
                let after = if lu.solve(next).is_ok() { size(x, l, next) } else { f64::NAN };
                change = size(x, l, correction);
                // No damping once half of the digits are correct.
                match damping.judge(change, after, f64::EPSILON.sqrt()) {
                    Verdict::Taken => break after,
                    Verdict::Again => {}
                    Verdict::GivenUp => return Err(StepError::NotConverged { residual: change, iterations }),
                }
            };
            // The round-off of a solution, which grows with the number of unknowns; at most half of the digits.
            let round_off = f64::EPSILON * max_or_nan(1e3, 8.0 * unknowns as f64);
            let near = (round_off * work.x.spread()).min(f64::EPSILON.sqrt());
            if after <= f64::EPSILON || damping.ratio() >= 0.5 && after <= near {
                return Ok(iterations);
            }
            if damping.ratio() * after <= f64::EPSILON {
                work.x.subtract(&work.next, 1.0);
                let Workspace { x, l, q, .. } = work;
                self.stages(given, x, q, l);
                return Ok(iterations + 1);
            }
            work.from.copy_from(&work.x);
        }
        Err(StepError::NotConverged { residual: change, iterations: MAX_NEWTON_ITERATIONS })
    }

    /// Evaluates L at the stages, and the residuals.
    fn evaluate(&self, given: &Given<'_>, work: &mut Workspace) {
        let Workspace { x, l, q, residual, .. } = work;
        self.stages(given, x, q, l);
        self.residual(given, x, l, residual);
    }
}

/// The size of a correction: the largest component, each kind relative to the largest unknown of that kind. The
/// momentum at the start is compared with the momenta `L_v` of the stages too, since it vanishes if the motion starts at
/// rest.
fn size(x: &Unknowns, l: &[StageValue], change: &[f64]) -> f64 {
    let (of_v, rest) = change.split_at(x.v.len());
    let (of_z, rest) = rest.split_at(x.z.len());
    let (of_rho, of_p0) = rest.split_at(x.rho.len());
    let largest = |from: f64, x: &[f64]| x.iter().fold(from, |m, x| max_or_nan(m, x.extent()));
    let of_momenta = l.iter().fold(0.0, |m, l| largest(m, &l.gradient.v));
    let kinds = [
        (of_v, largest(0.0, &x.v)),
        (of_z, largest(0.0, &x.z)),
        (of_rho, largest(1.0, &x.rho)),
        (of_p0, largest(of_momenta, &x.p0)),
    ];
    let mut worst = 0.0f64;
    for (change, size) in kinds {
        let change = largest(0.0, change);
        let relative = if change > 0.0 && size > 0.0 { change / size } else { f64::from(u8::from(change > 0.0)) };
        // `f64::max` would hide a NaN.
        if relative > worst || relative.is_nan() {
            worst = relative;
        }
    }
    worst
}
