//! The stage equations of contact Gauss collocation over numbers with derivatives, for the discrete Lagrangian.

use crate::gauss::stages::equations::Products;
use crate::system::mass_matrix::BLOCK;
use crate::{StepError, solve::ITERATION_LIMIT};
use contact_geom::nalgebra::{DMatrix, DVector, SVector};
use contact_geom::{
    ChartVector, Derivatives, Dual, Lagrangian, PhasePoint, Scalar, VelocityPoint, numbers::max_or_nan, support::seed,
};

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

/// The stage equations of a step.
pub(crate) struct StageEquations<'a, L, const N: usize> {
    pub lagrangian: &'a L,
    pub products: &'a Products,
    pub t: f64,
}

impl<L: Lagrangian<N>, const N: usize> StageEquations<'_, L, N> {
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

    /// Subtracts a Newton correction from the unknowns.
    fn add<T: Scalar>(&self, x: &mut StageUnknowns<N, T>, change: &DVector<T>) {
        let s = self.products.s;
        for i in 0..s {
            for d in 0..N {
                x.v[i][d] -= change[i * N + d];
            }
            x.z[i] -= change[s * N + i];
            x.rho[i] -= change[s * (N + 1) + i];
        }
        for (p, change) in x.p0.iter_mut().zip(change.iter().skip(s * (N + 2))) {
            *p -= *change;
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

    /// The end of the step over a scalar with derivatives, from the solution over `f64` and the inverse Jacobian there.
    ///
    /// # Errors
    /// Those of [`lifted`](Self::lifted).
    pub fn lifted_end<T: Scalar>(
        &self,
        given: &Given<N, T>,
        x: &StageUnknowns<N, f64>,
        inverse: &DMatrix<f64>,
    ) -> Result<StepEnd<N, T>, StepError> {
        let (x, l) = self.lifted(given, x, inverse)?;
        Ok(self.end(given, &x, &l))
    }

    /// The solved stages over a scalar with derivatives, from the solution over `f64` and the inverse Jacobian there: each
    /// correction determines one more order of derivatives.
    ///
    /// # Errors
    /// [`StepError::NotConverged`].
    pub fn lifted<T: Scalar>(
        &self,
        given: &Given<N, T>,
        x: &StageUnknowns<N, f64>,
        inverse: &DMatrix<f64>,
    ) -> Result<LiftedStages<N, T>, StepError> {
        let n = inverse.nrows();
        let (mut x, mut l) = (x.lifted::<T>(), Vec::new());
        let (mut residual, mut change) = (DVector::from_element(n, T::zero()), DVector::from_element(n, T::zero()));
        let mut before = f64::INFINITY;
        for _ in 0..ITERATION_LIMIT {
            self.stages(given, &x, &mut l);
            self.residual(given, &x, &l, &mut residual);
            for i in 0..n {
                change[i] = (0..n).fold(T::zero(), |sum, j| sum + residual[j] * inverse[(i, j)]);
            }
            self.add(&mut x, &change);
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
