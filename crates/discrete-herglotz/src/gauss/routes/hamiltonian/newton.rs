//! Newton's method for the stages of a step: simplified, with the derivatives of H at one point for all stages, and
//! damped, with the derivatives at each stage.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::StepError;
use crate::gauss::limits::MAX_NEWTON_ITERATIONS;
use crate::gauss::routes::hamiltonian::HamiltonianStages;
use crate::gauss::stages::applied_force::AppliedForce;
use crate::gauss::stages::damping::{Damping, Verdict, chances};
use crate::gauss::tables::modes::Modes;
use crate::gauss::tables::stage_table::StageTable;
use crate::numbers::registers::Stages;
use crate::numbers::state_words::saved;
use crate::solve::DenseLu;
use crate::solve::inverse::invert_complex;
use contact_geom::nalgebra::{Complex, SVector};
use contact_geom::{Hessian, Lagrangian, PhasePoint, VelocityPoint, numbers::max_or_nan};

/// Simplified Newton iteration for the right-hand sides K at the stages, `K = f(y0 + hA K)`: with `J = f'` at one point,
/// the change r of K in a fixed-point iteration becomes `(1 - hA (x) J)^-1 r`, one small complex system for each
/// eigenvalue of A.
pub(super) struct SimplifiedNewton {
    modes: &'static Modes,
    s: usize,
    h: f64,
    weights: Stages,
    /// The number of components of y = (q, P, z, 1 - rho).
    n: usize,
    /// `(1 - mu J)^-1` for each mode.
    inverses: Vec<Vec<Complex<f64>>>,
    /// The right-hand sides from which the next iteration starts, and those that the last iteration has found, multiplied
    /// by the weights, by components.
    base: Vec<Stages>,
    found: Vec<Stages>,
    /// The coefficients of one mode.
    coefficients: Vec<Complex<f64>>,
}

impl SimplifiedNewton {
    pub(super) fn new(table: &StageTable, n: usize) -> Self {
        let modes = Modes::of(table.s);
        SimplifiedNewton {
            modes,
            s: table.s,
            h: table.h,
            weights: table.weights,
            n,
            inverses: vec![vec![Complex::default(); n * n]; modes.iter().count()],
            base: vec![Stages::ZERO; n],
            found: vec![Stages::ZERO; n],
            coefficients: vec![Complex::default(); n],
        }
    }

    /// Inverts the matrices of the modes for a Jacobian by columns; `false` if one of them is singular.
    fn factorise(&mut self, jacobian: &[f64]) -> bool {
        let n = self.n;
        self.modes.iter().zip(&mut self.inverses).all(|(mode, inverse)| {
            let mu = mode.value * self.h;
            for (index, (entry, slope)) in inverse.iter_mut().zip(jacobian).enumerate() {
                let own = if index % (n + 1) == 0 { 1.0 } else { 0.0 };
                *entry = Complex::from(own) - mu * *slope;
            }
            let finite = |m: &[Complex<f64>]| m.iter().all(|e| e.re.is_finite() && e.im.is_finite());
            finite(inverse) && invert_complex(inverse, n) && finite(inverse)
        })
    }

    /// Replaces the right-hand sides that were found by those of the next iteration.
    fn correct(&mut self) {
        for (found, base) in self.found.iter_mut().zip(&self.base) {
            for i in 0..self.s {
                found.0[i] = (found.0[i] - base.0[i]) / self.weights.0[i];
            }
            self.modes.enter::<pulp::Scalar>(found);
        }
        for (mode, inverse) in self.modes.iter().zip(&self.inverses) {
            for (coefficient, found) in self.coefficients.iter_mut().zip(&self.found) {
                *coefficient = mode.of(found);
            }
            for (c, found) in self.found.iter_mut().enumerate() {
                let row = inverse.iter().skip(c).step_by(self.n);
                let sum = row.zip(&self.coefficients).fold(Complex::default(), |sum, (m, x)| sum + m * x);
                mode.set(found, sum);
            }
        }
        for (found, base) in self.found.iter_mut().zip(&mut self.base) {
            self.modes.leave::<pulp::Scalar>(found);
            for i in 0..self.s {
                found.0[i] = base.0[i] + found.0[i] * self.weights.0[i];
            }
            found.0[self.s..].fill(0.0);
            *base = *found;
        }
    }
}

saved!([] SimplifiedNewton { inverses, base });

/// The workspace of Newton's method with the derivatives at each stage.
pub(super) struct FullNewton {
    lu: DenseLu,
    /// The right-hand sides, multiplied by the weights, stage by stage: the last accepted ones, and those on trial.
    from: Vec<f64>,
    k: Vec<f64>,
    residual: Vec<f64>,
    correction: Vec<f64>,
    next: Vec<f64>,
    /// The Jacobians of the stages, by columns.
    jacobians: Vec<Vec<f64>>,
}

impl FullNewton {
    fn new(s: usize, n: usize) -> Self {
        let numbers = || vec![0.0; s * n];
        FullNewton {
            lu: DenseLu::new(s * n),
            from: numbers(),
            k: numbers(),
            residual: numbers(),
            correction: numbers(),
            next: numbers(),
            jacobians: vec![vec![0.0; n * n]; s],
        }
    }
}

/// A stage: time, position, momentum `P = rho p`, action and `1 - rho`.
pub(super) struct Stage<const N: usize> {
    pub t: f64,
    pub q: SVector<f64, N>,
    pub scaled_p: SVector<f64, N>,
    pub z: f64,
    pub one_minus_rho: f64,
}

impl<const N: usize> Stage<N> {
    pub fn rho(&self) -> f64 {
        1.0 - self.one_minus_rho
    }
    pub fn phase_point(&self) -> PhasePoint<N> {
        PhasePoint { q: self.q, p: self.scaled_p / self.rho(), z: self.z }
    }
}

impl<L: Lagrangian<N>, const N: usize> HamiltonianStages<'_, L, N> {
    /// The number of components of y.
    pub(super) const COMPONENTS: usize = 2 * N + 2;

    /// The right-hand sides at the stages, by components, in the order of y.
    fn right_hand_sides(&mut self) -> impl Iterator<Item = &mut Stages> {
        self.moved.iter_mut().chain(&mut self.force).chain([&mut self.l, &mut self.rate])
    }

    /// Keeps the right-hand sides of the current stages for the simplified Newton iteration: those of the predictor, or
    /// 0 without one.
    #[cold]
    #[inline(never)]
    pub(super) fn keep_iterate(&mut self, predicted: bool) {
        let Some(mut newton) = self.newton.take() else { return };
        let now = self.right_hand_sides();
        for (base, now) in newton.base.iter_mut().zip(now) {
            *base = if predicted { *now } else { Stages::ZERO };
        }
        self.newton = Some(newton);
    }

    /// One simplified Newton iteration, in place of a fixed-point iteration.
    #[cold]
    #[inline(never)]
    pub(super) fn correct(&mut self) {
        let Some(mut newton) = self.newton.take() else { return };
        newton.found.iter_mut().zip(self.right_hand_sides()).for_each(|(found, now)| *found = *now);
        newton.correct();
        self.right_hand_sides().zip(&newton.found).for_each(|(now, found)| *now = *found);
        self.newton = Some(newton);
    }

    /// Switches to simplified Newton iteration with the Jacobian at a state, where rho = 1; `false` if it is singular or
    /// not finite.
    pub(super) fn linearise(&mut self, t: f64, x: &PhasePoint<N>) -> bool {
        let n = Self::COMPONENTS;
        let mut newton = self
            .newton
            .take()
            .or_else(|| self.suspended_newton.take())
            .unwrap_or_else(|| Box::new(SimplifiedNewton::new(&self.table, n)));
        let mut jacobian = vec![0.0; n * n];
        let stage = Stage { t, q: x.q, scaled_p: x.p, z: x.z, one_minus_rho: 0.0 };
        self.jacobian(&stage, &mut jacobian);
        let regular = jacobian.iter().all(|e| e.is_finite()) && newton.factorise(&jacobian);
        self.newton = Some(newton);
        (self.warm, self.age) = (false, 0);
        regular
    }

    /// Recomputes the Jacobian of the simplified Newton iteration at the middle stage of the last step.
    #[cold]
    #[inline(never)]
    pub(super) fn renew(&mut self, t: f64) {
        let i = self.table.s / 2;
        let [q, p] = [&self.x, &self.p_stages].map(|of| SVector::from_fn(|d, _| of[d].0[i]));
        let warm = self.warm;
        let regular = self.linearise(t + self.table.times.0[i], &PhasePoint { q, p, z: self.z_stages.0[i] });
        self.warm = warm && regular;
    }

    /// Allocates the workspace of the Newton methods.
    pub(super) fn reserve(&mut self) {
        let (s, n) = (self.table.s, Self::COMPONENTS);
        self.full_newton.get_or_insert_with(|| Box::new(FullNewton::new(s, n)));
    }

    /// The right-hand side at a stage, in the order of y.
    fn right_hand_side(&self, stage: &Stage<N>, weight: f64, out: &mut [f64]) {
        let x = stage.phase_point();
        let Some((h, d)) = self.lagrangian.hamiltonian_with_gradient(stage.t, &x) else { return out.fill(f64::NAN) };
        let mut force = -d.x;
        if const { L::HINTS.forced } {
            force += self.lagrangian.applied_force(stage.t, &VelocityPoint { q: x.q, v: d.y, z: x.z });
        }
        let rho = stage.rho();
        for d_ in 0..N {
            out[d_] = weight * d.y[d_];
            out[N + d_] = weight * rho * force[d_];
        }
        out[2 * N] = weight * (x.p.dot(&d.y) - h);
        out[2 * N + 1] = -weight * rho * d.z;
    }

    /// The derivatives of the right-hand side at a stage in y, by columns. With `p = P / rho`,
    /// `dp = dP / rho + p d(1 - rho) / rho`.
    pub(super) fn jacobian(&self, stage: &Stage<N>, out: &mut [f64]) {
        let (n, x, rho) = (Self::COMPONENTS, stage.phase_point(), stage.rho());
        let (Some((_, d)), Some(hessian)) =
            (self.lagrangian.hamiltonian_with_gradient(stage.t, &x), self.lagrangian.hamiltonian_hessian(stage.t, &x))
        else {
            return out.fill(f64::NAN);
        };
        let Hessian { qq, qv: qp, vv: pp, qz, vz: pz, zz } = hessian;
        let applied = AppliedForce::of(self.lagrangian, stage.t, &VelocityPoint { q: x.q, v: d.y, z: x.z });
        // The derivatives along (dq, dp, dz, d(1 - rho)) of one column.
        let mut column = |index: usize, dq: SVector<f64, N>, dp: SVector<f64, N>, dz: f64, fallen: f64| {
            let of_v = qp.transpose() * dq + pp * dp + pz * dz;
            let mut of_force = -(qq * dq + qp * dp + qz * dz);
            let mut force = -d.x;
            if let Some(applied) = &applied {
                of_force += applied.q * dq + applied.v * of_v + applied.z * dz;
                force += applied.value;
            }
            let of_rate = qz.dot(&dq) + pz.dot(&dp) + zz * dz;
            let out = &mut out[index * n..][..n];
            for i in 0..N {
                out[i] = of_v[i];
                out[N + i] = rho * of_force[i] - fallen * force[i];
            }
            out[2 * N] = x.p.dot(&of_v) - d.x.dot(&dq) - d.z * dz;
            out[2 * N + 1] = fallen * d.z - rho * of_rate;
        };
        let (zero, unit) = (SVector::zeros(), |j: usize| SVector::from_fn(|i, _| f64::from(u8::from(i == j))));
        for j in 0..N {
            column(j, unit(j), zero, 0.0, 0.0);
            column(N + j, zero, unit(j) / rho, 0.0, 0.0);
        }
        column(2 * N, zero, zero, 1.0, 0.0);
        column(2 * N + 1, zero, x.p / rho, 0.0, 1.0);
    }

    /// A stage of given right-hand sides.
    fn stage(&self, t: f64, k: &[f64], i: usize) -> Stage<N> {
        let sum = |c: usize, start: f64| {
            (0..self.table.s).fold(start, |sum, j| sum + self.table.m.0[j].0[i] * k[j * Self::COMPONENTS + c])
        };
        Stage {
            t: t + self.table.times.0[i],
            q: SVector::from_fn(|d, _| sum(d, self.q[d].value)),
            scaled_p: SVector::from_fn(|d, _| sum(N + d, self.p[d].value)),
            z: sum(2 * N, self.z.value),
            one_minus_rho: sum(2 * N + 1, 0.0),
        }
    }

    /// The residuals `w f(y) - w K`.
    fn residuals(&self, t: f64, k: &[f64], out: &mut [f64]) {
        let n = Self::COMPONENTS;
        for (i, (out, k_i)) in out.chunks_exact_mut(n).zip(k.chunks_exact(n)).enumerate() {
            self.right_hand_side(&self.stage(t, k, i), self.table.weights.0[i], out);
            out.iter_mut().zip(k_i).for_each(|(out, k)| *out -= k);
        }
    }

    /// The size of a correction: the largest component, each kind relative to the largest stage value of that kind.
    fn size(&self, t: f64, k: &[f64], change: &[f64]) -> f64 {
        let n = Self::COMPONENTS;
        let mut largest = [[0.0, 0.0], [0.0, self.least[0]], [0.0, self.least[1]], [0.0, 1.0]];
        let kind = |c: usize| match c {
            c if c < N => 0,
            c if c < 2 * N => 1,
            c => 2 + c - 2 * N,
        };
        for (i, change) in change.chunks_exact(n).enumerate() {
            let stage = self.stage(t, k, i);
            let parts = stage.q.iter().chain(&stage.scaled_p).chain([&stage.z]);
            for (c, part) in parts.enumerate() {
                largest[kind(c)][1] = max_or_nan(largest[kind(c)][1], part.abs());
            }
            // An action may vanish by cancellation.
            let work = (0..N).map(|d| stage.scaled_p[d] * k[i * n + d] / self.table.weights.0[i] * self.table.h);
            largest[2][1] = work.fold(largest[2][1], |largest, work| max_or_nan(largest, work.abs()));
            for (c, change) in change.iter().enumerate() {
                largest[kind(c)][0] = max_or_nan(largest[kind(c)][0], change.abs());
            }
        }
        let relative = |[change, size]: [f64; 2]| if change == 0.0 { 0.0 } else { change / size };
        largest.into_iter().map(relative).fold(0.0, max_or_nan)
    }

    /// Solves the stage equations of the next step by damped Newton iteration from the right-hand side at its start.
    ///
    /// # Errors
    /// [`StepError::NotConverged`], [`StepError::Singular`], [`StepError::NonFinite`].
    pub(super) fn solve(&mut self, t: f64) -> Result<(), StepError> {
        self.reserve();
        self.admit_round_off(t);
        let Some(mut work) = self.full_newton.take() else { return Ok(()) };
        let solved = self.solve_with(t, &mut work);
        if solved.is_ok() {
            let n = Self::COMPONENTS;
            for (c, to) in self.right_hand_sides().enumerate() {
                for (to, k) in to.0.iter_mut().zip(work.from.chunks_exact(n)) {
                    *to = k[c];
                }
            }
            self.solved = true;
        }
        self.full_newton = Some(work);
        solved
    }

    fn solve_with(&self, t: f64, work: &mut FullNewton) -> Result<(), StepError> {
        let (s, n) = (self.table.s, Self::COMPONENTS);
        let FullNewton { lu, from, k, residual, correction, next, jacobians } = work;
        from.fill(0.0);
        let start = self.stage(t, from, 0);
        let start = Stage { t, ..start };
        for (i, k) in from.chunks_exact_mut(n).enumerate() {
            self.right_hand_side(&start, self.table.weights.0[i], k);
        }
        self.residuals(t, from, residual);
        if !residual.iter().all(|r| r.is_finite()) {
            return Err(StepError::NonFinite);
        }
        let (mut damping, mut change) = (Damping::new(chances(s * n)), f64::INFINITY);
        for iterations in 1..=MAX_NEWTON_ITERATIONS {
            if damping.renews() {
                for (i, jacobian) in jacobians.iter_mut().enumerate() {
                    self.jacobian(&self.stage(t, from, i), jacobian);
                }
                lu.factorise(|row, column| {
                    let ((i, c), (j, e)) = ((row / n, row % n), (column / n, column % n));
                    let own = if row == column { 1.0 } else { 0.0 };
                    own - self.table.weights.0[i] * self.table.m.0[j].0[i] * jacobians[i][e * n + c]
                })?;
                correction.copy_from_slice(residual);
                lu.solve(correction)?;
            } else {
                std::mem::swap(correction, next);
            }
            let after = loop {
                for ((k, from), correction) in k.iter_mut().zip(from.iter()).zip(correction.iter()) {
                    *k = from + damping.part() * correction;
                }
                self.residuals(t, k, residual);
                next.copy_from_slice(residual);
                let after = if lu.solve(next).is_ok() { self.size(t, k, next) } else { f64::NAN };
                change = self.size(t, k, correction);
                // No damping once half of the digits are correct.
                match damping.judge(change, after, f64::EPSILON.sqrt()) {
                    Verdict::Taken => break after,
                    Verdict::Again => {}
                    Verdict::GivenUp => return Err(StepError::NotConverged { residual: change, iterations }),
                }
            };
            from.copy_from_slice(k);
            // The round-off of a solution, which grows with the number of unknowns.
            let near = f64::EPSILON * max_or_nan(1e3, 8.0 * (s * n) as f64);
            if after <= f64::EPSILON || damping.ratio() >= 0.5 && after <= near {
                return Ok(());
            }
            if damping.ratio() * after <= f64::EPSILON {
                from.iter_mut().zip(next.iter()).for_each(|(from, next)| *from += next);
                return Ok(());
            }
        }
        Err(StepError::NotConverged { residual: change, iterations: MAX_NEWTON_ITERATIONS })
    }
}
