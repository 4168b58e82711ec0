//! The stage equations of contact Gauss collocation and their Jacobian, for Newton's method in the general route and
//! for the discrete Lagrangian. For constant mass and constant rate
//! [`PositionNewton`](crate::gauss::stages::position_newton::PositionNewton) has fewer unknowns.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::gauss::stages::damped_newton::{DampedNewton, StageUnknowns};
use crate::gauss::stages::lifted_equations::{LiftedStages, StageUnknowns as TypedUnknowns, StageValue as TypedValue};
use crate::gauss::system::{PointDerivatives, PointGradient, PointRef, SystemAtPoints};
use crate::gauss::tables::coefficients::{Coefficients, MAX_STAGES};
use crate::numbers::array::from_fn;
use crate::solve::DenseLu;
use crate::solve::inverse::inverse;
use crate::{StepError, gauss::system::vector_of};
use contact_geom::nalgebra::{DMatrix, SVector};
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

/// The unknowns: velocity, action and integrating factor of each stage, and between given ends the momentum at the start.
pub(crate) struct Unknowns<'x> {
    /// The velocities, one stage after another.
    v: &'x [f64],
    z: &'x [f64],
    rho: &'x [f64],
    p0: &'x [f64],
    n: usize,
}

impl<'x> Unknowns<'x> {
    /// The unknowns of s stages and n coordinates, from one vector.
    fn of(x: &'x [f64], s: usize, n: usize) -> Self {
        let (v, x) = x.split_at(s * n);
        let (z, x) = x.split_at(s);
        let (rho, p0) = x.split_at(s);
        Unknowns { v, z, rho, p0, n }
    }

    /// The velocity of a stage.
    pub fn velocity(&self, i: usize) -> &'x [f64] {
        &self.v[i * self.n..][..self.n]
    }

    /// The integrating factor of a stage.
    pub fn factor(&self, i: usize) -> f64 {
        self.rho[i]
    }

    /// The largest integrating factor divided by the smallest, including the value 1 at the start. Momenta are sums of
    /// terms with all factors, divided by one of them; their round-off grows with this ratio.
    fn spread(&self) -> f64 {
        let over = |f: &dyn Fn(f64) -> f64| self.rho.iter().fold(1.0, |m, r| max_or_nan(m, f(*r)));
        over(&|r| r.abs()) * over(&|r| 1.0 / r.abs())
    }
}

/// L with its gradient at a stage, and `L_q + f` with the applied force f.
pub(crate) struct StageValue {
    pub l: f64,
    gradient: PointGradient,
    force: Vec<f64>,
}

/// The workspace of Newton's method; made once for a run, so that steps do not allocate.
pub(crate) struct Workspace {
    newton: DampedNewton,
    evaluated: Evaluated,
}

/// L with its derivatives at the stages.
pub(crate) struct Evaluated {
    s: usize,
    n: usize,
    /// L and its gradient at the stages.
    l: Vec<StageValue>,
    /// The derivatives at one point.
    derivatives: PointDerivatives,
    /// The position of a stage.
    q: Vec<f64>,
    /// The derivatives of `L_q + f` at a stage in q, v and z, and one column of the first times a factor.
    force_q: DMatrix<f64>,
    force_v: DMatrix<f64>,
    force_z: Vec<f64>,
    pushed: Vec<f64>,
    jacobian: DMatrix<f64>,
}

impl Workspace {
    /// The workspace for steps of s stages: from a state, or between given ends.
    pub fn new(system: &dyn SystemAtPoints, s: usize, between_ends: bool) -> Self {
        let n = system.dimension();
        let unknowns = s * (n + 2) + if between_ends { n } else { 0 };
        let value = |_| StageValue { l: 0.0, gradient: PointGradient::zeros(n), force: vec![0.0; n] };
        let evaluated = Evaluated {
            s,
            n,
            l: (0..s).map(value).collect(),
            derivatives: PointDerivatives::of(system),
            q: vec![0.0; n],
            force_q: DMatrix::zeros(n, n),
            force_v: DMatrix::zeros(n, n),
            force_z: vec![0.0; n],
            pushed: vec![0.0; n],
            jacobian: DMatrix::zeros(unknowns, unknowns),
        };
        Workspace { newton: DampedNewton::new(unknowns), evaluated }
    }

    /// The guess, then the solution.
    pub fn unknowns(&self) -> Unknowns<'_> {
        Unknowns::of(&self.newton.x, self.evaluated.s, self.evaluated.n)
    }

    /// The value of L at a stage of the solution.
    pub fn value(&self, i: usize) -> f64 {
        self.evaluated.l[i].l
    }

    /// The workspace for derivatives at one point.
    pub fn derivatives(&mut self) -> &mut PointDerivatives {
        &mut self.evaluated.derivatives
    }

    /// The solution, with L and its gradient there, for code that is compiled for N coordinates.
    pub fn solution<const N: usize>(&self) -> LiftedStages<N, f64> {
        let x = self.unknowns();
        let unknowns = TypedUnknowns {
            v: (0..x.z.len()).map(|i| vector_of(x.velocity(i))).collect(),
            z: x.z.to_vec(),
            rho: x.rho.to_vec(),
            p0: if x.p0.is_empty() { SVector::zeros() } else { vector_of(x.p0) },
        };
        let value = |StageValue { l, gradient: PointGradient { q, v, z }, force }: &StageValue| TypedValue {
            l: Dual { re: *l, d: ChartVector { x: vector_of(q), y: vector_of(v), z: *z } },
            force: vector_of(force),
        };
        (unknowns, self.evaluated.l.iter().map(value).collect())
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
    fn position(&self, given: &Given<'_>, x: &Unknowns<'_>, i: usize, q: &mut [f64]) {
        let (Given::Start(PointRef { q: q0, .. }) | Given::Ends { q0, .. }) = given;
        q.copy_from_slice(q0);
        for j in 0..self.products.s {
            for (q, v) in q.iter_mut().zip(x.velocity(j)) {
                *q += v * self.products.a[i][j];
            }
        }
    }

    /// Evaluates L and its gradient at the stages.
    fn stages(&self, given: &Given<'_>, x: &Unknowns<'_>, q: &mut [f64], l: &mut [StageValue]) {
        for (i, StageValue { l, gradient, force }) in l.iter_mut().enumerate() {
            self.position(given, x, i, q);
            let at = PointRef { q, v: x.velocity(i), z: x.z[i] };
            *l = self.system.stage_value(self.t + self.products.c[i], at, gradient, force);
        }
    }

    /// The residuals, in the order: momenta, actions, integrating factors, end position.
    fn residual(&self, given: &Given<'_>, x: &Unknowns<'_>, l: &[StageValue], out: &mut [f64]) {
        let Products { s, a, b, .. } = self.products;
        let (s, n, z0) = (*s, x.n, given.z0());
        let p0 = match given {
            Given::Start(state) => state.v,
            Given::Ends { .. } => x.p0,
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

    /// Computes the Jacobian of the residuals at the unknowns `x`, at which L is evaluated.
    fn jacobian(&self, given: &Given<'_>, x: &Unknowns<'_>, at: &mut Evaluated) {
        let Evaluated { l, derivatives, q, force_q, force_v, force_z, pushed, jacobian: out, .. } = at;
        let Products { s, a, b, c, .. } = self.products;
        let (s, n) = (*s, x.n);
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
        let Workspace { newton, evaluated } = work;
        self.jacobian(given, &Unknowns::of(&newton.x, evaluated.s, evaluated.n), evaluated);
        inverse(&evaluated.jacobian)
    }

    /// Solves the stage equations by damped Newton iteration from a motion of constant velocity `v`, with the momentum
    /// `p0`. Returns the number of iterations.
    ///
    /// # Errors
    /// [`StepError::NotConverged`], [`StepError::Singular`], [`StepError::NonFinite`].
    pub fn solve(&self, given: &Given<'_>, v: &[f64], p0: &[f64], work: &mut Workspace) -> Result<u32, StepError> {
        let Workspace { newton, evaluated } = work;
        let (of_v, x) = newton.x.split_at_mut(evaluated.s * evaluated.n);
        let (of_z, x) = x.split_at_mut(evaluated.s);
        let (of_rho, of_p0) = x.split_at_mut(evaluated.s);
        of_v.chunks_exact_mut(v.len()).for_each(|of_v| of_v.copy_from_slice(v));
        of_z.fill(given.z0());
        of_rho.fill(1.0);
        of_p0.iter_mut().zip(p0).for_each(|(of_p0, p0)| *of_p0 = *p0);
        let chances = newton.chances();
        newton.solve(&mut Stated { equations: self, given, evaluated }, chances)
    }
}

/// The stage equations of a step with its given data.
struct Stated<'r> {
    equations: &'r StageEquations<'r>,
    given: &'r Given<'r>,
    evaluated: &'r mut Evaluated,
}

impl StageUnknowns for Stated<'_> {
    fn residuals(&mut self, x: &[f64], out: &mut [f64]) {
        let Evaluated { s, n, l, q, .. } = &mut *self.evaluated;
        let x = Unknowns::of(x, *s, *n);
        self.equations.stages(self.given, &x, q, l);
        self.equations.residual(self.given, &x, l, out);
        out.iter_mut().for_each(|out| *out = -*out);
    }

    fn factorise(&mut self, x: &[f64], lu: &mut DenseLu) -> Result<(), StepError> {
        let x = Unknowns::of(x, self.evaluated.s, self.evaluated.n);
        self.equations.jacobian(self.given, &x, self.evaluated);
        lu.factorise(|i, j| self.evaluated.jacobian[(i, j)])
    }

    fn size(&mut self, x: &[f64], correction: &[f64]) -> f64 {
        size(&Unknowns::of(x, self.evaluated.s, self.evaluated.n), &self.evaluated.l, correction)
    }

    /// It grows with the number of unknowns; at most half of the digits.
    fn round_off(&self, x: &[f64]) -> f64 {
        let of_sums = f64::EPSILON * max_or_nan(1e3, 8.0 * x.len() as f64);
        (of_sums * Unknowns::of(x, self.evaluated.s, self.evaluated.n).spread()).min(f64::EPSILON.sqrt())
    }
}

/// The size of a correction: the largest component, each kind relative to the largest unknown of that kind. The
/// momentum at the start is compared with the momenta `L_v` of the stages too, since it vanishes if the motion starts at
/// rest.
fn size(x: &Unknowns<'_>, l: &[StageValue], change: &[f64]) -> f64 {
    let (of_v, rest) = change.split_at(x.v.len());
    let (of_z, rest) = rest.split_at(x.z.len());
    let (of_rho, of_p0) = rest.split_at(x.rho.len());
    let largest = |from: f64, x: &[f64]| x.iter().fold(from, |m, x| max_or_nan(m, x.extent()));
    let of_momenta = l.iter().fold(0.0, |m, l| largest(m, &l.gradient.v));
    let kinds = [
        (of_v, largest(0.0, x.v)),
        (of_z, largest(0.0, x.z)),
        (of_rho, largest(1.0, x.rho)),
        (of_p0, largest(of_momenta, x.p0)),
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
