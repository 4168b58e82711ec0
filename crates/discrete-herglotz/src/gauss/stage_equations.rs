//! The stage equations of contact Gauss collocation, with their Jacobian: for Newton's method, and for the discrete Lagrangian.

use super::coefficients::{Coefficients, MOST};
use crate::solver::DenseLu;
use crate::step_equations::BLOCK;
use crate::{ITERATION_LIMIT, StepError};
use contact_geom::nalgebra::{DMatrix, DVector, SVector};
use contact_geom::{Dual, Hessian, Lagrangian, PhasePoint, Scalar, Triple, VelocityPoint, seed};

/// The products of the coefficients with a step, which may be negative.
#[derive(Clone, Debug)]
pub(super) struct Products {
    pub s: usize,
    pub h: f64,
    a: [[f64; MOST]; MOST],
    b: [f64; MOST],
    c: [f64; MOST],
}

impl Products {
    pub fn new(s: usize, h: f64) -> Self {
        let g = Coefficients::of(s);
        Products { s, h, a: g.a.map(|row| row.map(|e| h * e.0)), b: g.b.map(|e| h * e.0), c: g.c.map(|e| h * e.0) }
    }
}

impl Products {
    /// The weight of a stage in a mean over the step.
    pub fn weight(&self, j: usize) -> f64 {
        self.b[j] / self.h
    }
}

/// What a step starts from.
#[derive(Clone, Copy)]
pub(super) enum Given<const N: usize, T> {
    /// The state `(q0, p0, z0)`.
    Start(PhasePoint<N, T>),
    /// `(q0, q1, z0)`; the momentum is an unknown.
    Ends { q0: SVector<T, N>, q1: SVector<T, N>, z0: T },
}

/// The unknowns: velocity, action and integrating factor of each stage, and the momentum at the start.
#[derive(Clone)]
pub(super) struct Unknowns<const N: usize, T> {
    pub v: Vec<SVector<T, N>>,
    pub z: Vec<T>,
    pub rho: Vec<T>,
    pub p0: SVector<T, N>,
}

impl<const N: usize> Unknowns<N, f64> {
    /// A motion of constant velocity.
    fn make_uniform(&mut self, v: &SVector<f64, N>, p0: &SVector<f64, N>, z0: f64) {
        self.v.fill(*v);
        self.z.fill(z0);
        self.rho.fill(1.0);
        self.p0 = *p0;
    }

    /// The largest factor over the smallest, the start's 1 included: momenta are sums of terms with all of them, divided by
    /// one, and their round-off grows with this.
    fn spread(&self) -> f64 {
        let over = |f: &dyn Fn(f64) -> f64| self.rho.iter().fold(1.0, |m, r| larger(m, f(*r)));
        over(&|r| r.abs()) * over(&|r| 1.0 / r.abs())
    }

    /// The same over another scalar, without differentials.
    pub fn lifted<T: Scalar>(&self) -> Unknowns<N, T> {
        Unknowns {
            v: self.v.iter().map(|v| v.map(T::from)).collect(),
            z: self.z.iter().map(|z| T::from(*z)).collect(),
            rho: self.rho.iter().map(|r| T::from(*r)).collect(),
            p0: self.p0.map(T::from),
        }
    }
}

/// The end of a step, and the momentum at its start.
pub(super) struct End<const N: usize, T> {
    pub p0: SVector<T, N>,
    pub q: SVector<T, N>,
    pub p: SVector<T, N>,
    /// `z1 - z0`.
    pub action: T,
    /// `rho` at the end, `1 / sigma_d`.
    pub rho: T,
}

/// What Newton's method works in; made once for a run, so that no step allocates.
pub(super) struct Workspace<const N: usize> {
    /// The guess, then the solution.
    pub x: Unknowns<N, f64>,
    /// L and its gradient at the stages of the solution.
    pub l: Vec<Dual<f64, Triple<N>>>,
    jacobian: DMatrix<f64>,
    /// The factors of the Jacobian that an iteration uses: of its own iterate, or of one before.
    lu: DenseLu,
    residual: DVector<f64>,
}

/// The ratio of two changes above which the Jacobian is taken anew: an iteration with the old one costs a tenth of it or less.
const CONTRACTION: f64 = 0.2;

/// The stage equations of a step.
pub(super) struct StageEquations<'a, L, const N: usize> {
    pub lagrangian: &'a L,
    pub products: &'a Products,
    pub t: f64,
}

impl<L: Lagrangian<N>, const N: usize> StageEquations<'_, L, N> {
    /// The number of unknowns.
    pub fn size<T>(&self, given: &Given<N, T>) -> usize {
        self.products.s * (N + 2) + if matches!(given, Given::Ends { .. }) { N } else { 0 }
    }

    /// `q0 + hA V` at a stage.
    pub fn position<T: Scalar>(&self, given: &Given<N, T>, x: &Unknowns<N, T>, i: usize) -> SVector<T, N> {
        let (Given::Start(PhasePoint { q: q0, .. }) | Given::Ends { q0, .. }) = given;
        x.v.iter().zip(&self.products.a[i]).fold(*q0, |sum, (v, a)| sum + v.map(|e| e * *a))
    }

    /// L and its gradient at the stages.
    fn stages<T: Scalar>(&self, given: &Given<N, T>, x: &Unknowns<N, T>, l: &mut Vec<Dual<T, Triple<N, T>>>) {
        l.clear();
        l.extend((0..self.products.s).map(|i| {
            let y = VelocityPoint { q: self.position(given, x, i), v: x.v[i], z: x.z[i] };
            let t = T::from(self.t + self.products.c[i]);
            // The numbers of many directions would not fit on the stack.
            if const { N > BLOCK } {
                let (re, d) = self.lagrangian.with_gradient(t, &y);
                return Dual { re, d };
            }
            self.lagrangian.along(t, &seed(&Triple::from(y)).into())
        }));
    }

    /// The workspace for steps of this kind.
    pub fn workspace(&self, given: &Given<N, f64>) -> Workspace<N> {
        let (s, n) = (self.products.s, self.size(given));
        let x = Unknowns { v: vec![SVector::zeros(); s], z: vec![0.0; s], rho: vec![1.0; s], p0: SVector::zeros() };
        Workspace {
            x,
            l: Vec::with_capacity(s),
            jacobian: DMatrix::zeros(n, n),
            lu: DenseLu::new(n),
            residual: DVector::zeros(n),
        }
    }

    /// The residuals: of the momenta, then of the actions, the factors, and the end position.
    pub fn residual<T: Scalar>(
        &self,
        given: &Given<N, T>,
        x: &Unknowns<N, T>,
        l: &[Dual<T, Triple<N, T>>],
        out: &mut DVector<T>,
    ) {
        let Products { s, a, b, .. } = self.products;
        let (p0, z0) = match given {
            Given::Start(state) => (state.p, state.z),
            Given::Ends { z0, .. } => (x.p0, *z0),
        };
        for i in 0..*s {
            let mut momentum = SVector::<T, N>::from_fn(|d, _| x.rho[i] * l[i].d.y[d] - p0[d]);
            let (mut action, mut factor) = (x.z[i] - z0, x.rho[i] - 1.0);
            for j in 0..*s {
                for d in 0..N {
                    momentum[d] -= x.rho[j] * l[j].d.x[d] * a[i][j];
                }
                action -= l[j].re * a[i][j];
                factor += x.rho[j] * l[j].d.z * a[i][j];
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

    /// The derivatives of the residuals.
    pub fn jacobian(
        &self,
        given: &Given<N, f64>,
        x: &Unknowns<N, f64>,
        l: &[Dual<f64, Triple<N>>],
        out: &mut DMatrix<f64>,
    ) {
        let Products { s, a, b, c, .. } = self.products;
        let s = *s;
        out.fill(0.0);
        let (row_z, row_r) = (s * N, s * (N + 1));
        for k in 0..s {
            let y = VelocityPoint { q: self.position(given, x, k), v: x.v[k], z: x.z[k] };
            let Hessian { qq, qv, vv, qz, vz, zz } = &self.lagrangian.hessian(self.t + c[k], &y);
            let (rho, g) = (x.rho[k], &l[k].d);
            // What stage k adds to the equations of stage i, through its own velocity, action and factor.
            for i in 0..s {
                let (own, w) = (if i == k { 1.0 } else { 0.0 }, a[i][k]);
                for d in 0..N {
                    for e in 0..N {
                        out[(i * N + d, k * N + e)] += rho * (own * vv[(d, e)] - w * qv[(d, e)]);
                    }
                    out[(i * N + d, row_z + k)] += rho * (own * vz[d] - w * qz[d]);
                    out[(i * N + d, row_r + k)] += own * g.y[d] - w * g.x[d];
                    out[(row_z + i, k * N + d)] -= w * g.y[d];
                    out[(row_r + i, k * N + d)] += w * rho * vz[d];
                }
                out[(row_z + i, row_z + k)] += own - w * g.z;
                out[(row_r + i, row_z + k)] += w * rho * zz;
                out[(row_r + i, row_r + k)] += own + w * g.z;
            }
            // And through its position, which the velocities of all stages move.
            for j in 0..s {
                let moved = a[k][j];
                for e in 0..N {
                    for d in 0..N {
                        out[(k * N + d, j * N + e)] += rho * qv[(e, d)] * moved;
                    }
                    for i in 0..s {
                        let w = a[i][k] * moved;
                        for d in 0..N {
                            out[(i * N + d, j * N + e)] -= w * rho * qq[(d, e)];
                        }
                        out[(row_z + i, j * N + e)] -= w * g.x[e];
                        out[(row_r + i, j * N + e)] += w * rho * qz[e];
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

    /// Adds a correction to the unknowns; returns the largest, each in units of the largest of its kind.
    fn correct<T: Scalar>(&self, x: &mut Unknowns<N, T>, change: &DVector<T>, with_momentum: bool) -> f64 {
        let s = self.products.s;
        let mut worst = 0.0f64;
        let mut see = |change: f64, size: f64| {
            let relative = if change > 0.0 { change / size } else { change };
            // `f64::max` would hide a NaN.
            if relative > worst || relative.is_nan() {
                worst = relative;
            }
        };
        let (mut dv, mut sv, mut dz, mut sz, mut dr, mut dp, mut sp) =
            (0.0f64, 0.0f64, 0.0f64, 0.0f64, 0.0f64, 0.0f64, 0.0f64);
        for i in 0..s {
            for d in 0..N {
                x.v[i][d] -= change[i * N + d];
                dv = larger(dv, change[i * N + d].extent());
                sv = larger(sv, x.v[i][d].extent());
            }
            x.z[i] -= change[s * N + i];
            x.rho[i] -= change[s * (N + 1) + i];
            dz = larger(dz, change[s * N + i].extent());
            sz = larger(sz, x.z[i].extent());
            dr = larger(dr, change[s * (N + 1) + i].extent());
        }
        if with_momentum {
            for d in 0..N {
                x.p0[d] -= change[s * (N + 2) + d];
                dp = larger(dp, change[s * (N + 2) + d].extent());
                sp = larger(sp, x.p0[d].extent());
            }
        }
        see(dv, sv);
        see(dz, sz);
        see(dr, x.rho.iter().fold(1.0, |m, r| larger(m, r.extent())));
        see(dp, sp);
        worst
    }

    /// Solves the stage equations by Newton's method from a motion of constant velocity `v`, with the momentum `p0`. Returns
    /// the iterations.
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
        let Workspace { x, l, jacobian, lu, residual } = work;
        let (Given::Start(PhasePoint { z: z0, .. }) | Given::Ends { z0, .. }) = given;
        x.make_uniform(v, p0, *z0);
        self.stages(given, x, l);
        let ends = matches!(given, Given::Ends { .. });
        let (mut before, mut ratio) = (f64::INFINITY, f64::INFINITY);
        for iterations in 1..=ITERATION_LIMIT {
            self.residual(given, x, l, residual);
            // Newton's iteration, until the changes fall so fast that its Jacobian need not be that of the last iterate.
            if ratio > CONTRACTION {
                self.jacobian(given, x, l, jacobian);
                lu.factorise(|i, j| jacobian[(i, j)])?;
            }
            lu.solve(residual.as_mut_slice())?;
            let change = self.correct(x, residual, ends);
            if !change.is_finite() {
                return Err(StepError::NonFinite);
            }
            self.stages(given, x, l);
            ratio = if before.is_finite() { change / before } else { 1.0 };
            let predicted = ratio * change <= f64::EPSILON;
            // With half of the digits at the least.
            let near = (1e3 * f64::EPSILON * x.spread()).min(f64::EPSILON.sqrt());
            let stagnant = ratio >= 0.5 && change <= near;
            if change <= f64::EPSILON || predicted || stagnant {
                return Ok(iterations);
            }
            before = change;
        }
        Err(StepError::NotConverged { residual: before, iterations: ITERATION_LIMIT })
    }

    /// The end of the step whose stages are solved, from L and its gradient there.
    pub fn end<T: Scalar>(&self, given: &Given<N, T>, x: &Unknowns<N, T>, l: &[Dual<T, Triple<N, T>>]) -> End<N, T> {
        let Products { b, .. } = self.products;
        let (q0, p0) = match given {
            Given::Start(state) => (state.q, state.p),
            Given::Ends { q0, .. } => (*q0, x.p0),
        };
        let sum = |f: &dyn Fn(usize) -> T| (0..self.products.s).fold(T::zero(), |sum, j| sum + f(j) * b[j]);
        let rho = -sum(&|j| x.rho[j] * l[j].d.z) + 1.0;
        End {
            p0,
            q: SVector::from_fn(|d, _| q0[d] + sum(&|j| x.v[j][d])),
            p: SVector::from_fn(|d, _| (p0[d] + sum(&|j| x.rho[j] * l[j].d.x[d])) / rho),
            action: sum(&|j| l[j].re),
            rho,
        }
    }

    /// The end of the step over a scalar with differentials, from the solution without: each correction by the inverse Jacobian
    /// settles one more order of derivatives.
    ///
    /// # Errors
    /// [`StepError::Singular`], [`StepError::NotConverged`].
    pub fn lifted_end<T: Scalar>(
        &self,
        given: &Given<N, T>,
        plain: &Given<N, f64>,
        work: &mut Workspace<N>,
    ) -> Result<End<N, T>, StepError> {
        let n = self.size(plain);
        self.jacobian(plain, &work.x, &work.l, &mut work.jacobian);
        let inverse = work.jacobian.clone().try_inverse().ok_or(StepError::Singular { pivot: 0.0 })?;
        let (mut x, mut l) = (work.x.lifted::<T>(), Vec::new());
        let (mut residual, mut change) = (DVector::from_element(n, T::zero()), DVector::from_element(n, T::zero()));
        let mut before = f64::INFINITY;
        for _ in 0..ITERATION_LIMIT {
            self.stages(given, &x, &mut l);
            self.residual(given, &x, &l, &mut residual);
            for i in 0..n {
                change[i] = (0..n).fold(T::zero(), |sum, j| sum + residual[j] * inverse[(i, j)]);
            }
            let size = self.correct(&mut x, &change, matches!(given, Given::Ends { .. }));
            // The iteration ends in finitely many steps but for round-off.
            if size <= f64::EPSILON || (size >= 0.5 * before && size <= 1e-10) {
                self.stages(given, &x, &mut l);
                return Ok(self.end(given, &x, &l));
            }
            before = size;
        }
        Err(StepError::NotConverged { residual: before, iterations: ITERATION_LIMIT })
    }
}

/// The larger; a NaN counts as infinite in an extent, so that none is hidden.
fn larger(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}
