//! Newton's method for the stages of a condensed step: the unknowns are the stage positions, and the Jacobian has the
//! derivative of the force at each stage.

use crate::StepError;
use crate::gauss::limits::MAX_NEWTON_ITERATIONS;
use crate::gauss::stages::damping::{Damping, Verdict, chances};
use crate::gauss::tables::condensed::Condensed;
use crate::solve::DenseLu;
use crate::solve::mass_matrix::BLOCK;
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{Derivatives, Lagrangian, VelocityPoint, numbers::max_abs_or_nan, support::KernelDual};

/// Solves `Q = q0 + u v0 + B a`, `a_i = M^-1 L_q(t_i, Q_i)`, for the positions Q of the stages: `s N` unknowns, with
/// the Newton correction `(1 - B a')^-1` times the residual. Made once for a run, so that steps do not allocate.
pub(crate) struct PositionNewton<const N: usize> {
    /// `q0 + u v0`.
    base: Vec<SVector<f64, N>>,
    /// The positions of the last accepted iterate and of the trial.
    x: Vec<SVector<f64, N>>,
    trial: Vec<SVector<f64, N>>,
    /// The accelerations at the trial positions, and the start time of the last step that was solved.
    a: Vec<SVector<f64, N>>,
    solved: f64,
    /// `a'` at the stages.
    slopes: Vec<SMatrix<f64, N, N>>,
    lu: DenseLu,
    residual: Vec<f64>,
    correction: Vec<f64>,
    next: Vec<f64>,
}

/// The system and the start of a step.
pub(crate) struct At<'a, L, const N: usize> {
    pub lagrangian: &'a L,
    pub table: &'a Condensed,
    /// `None` where M is the identity.
    pub inverse_mass: Option<&'a SMatrix<f64, N, N>>,
    pub t: f64,
    pub q: SVector<f64, N>,
    pub v: SVector<f64, N>,
}

/// `L_qq` at a time and a position, for separable L. Only the derivatives in q are computed, at a fraction of the cost
/// and of the memory of all second derivatives.
#[inline(never)]
pub(crate) fn curvature<const N: usize>(
    lagrangian: &impl Lagrangian<N>,
    t: f64,
    q: &SVector<f64, N>,
) -> SMatrix<f64, N, N> {
    if const { N > BLOCK } {
        by_directions::<N, BLOCK>(lagrangian, t, q)
    } else {
        by_directions::<N, N>(lagrangian, t, q)
    }
}

/// `L_qq` by dual numbers with B directions at once.
#[inline(always)]
fn by_directions<const N: usize, const B: usize>(
    lagrangian: &impl Lagrangian<N>,
    t: f64,
    q: &SVector<f64, N>,
) -> SMatrix<f64, N, N> {
    let constant = KernelDual::<f64, SVector<f64, B>>::constant;
    let still = VelocityPoint { q: q.map(constant), v: SVector::from_element(constant(0.0)), z: constant(0.0) };
    let mut curvature = SMatrix::zeros();
    for first in (0..N).step_by(B.max(1)) {
        let mut x = still;
        let directions = first..(first + B).min(N);
        for j in directions.clone() {
            x.q[j].d[j - first] = 1.0;
        }
        let force = lagrangian.force(constant(t), &x);
        for j in directions {
            for i in 0..N {
                curvature[(i, j)] = force[i].d[j - first];
            }
        }
    }
    curvature
}

impl<const N: usize> PositionNewton<N> {
    /// The workspace for steps of `s` stages.
    pub fn new(s: usize) -> Self {
        let (points, numbers) = (vec![SVector::zeros(); s], vec![0.0; s * N]);
        PositionNewton {
            base: points.clone(),
            x: points.clone(),
            trial: points.clone(),
            a: points,
            solved: f64::NEG_INFINITY,
            slopes: vec![SMatrix::zeros(); s],
            lu: DenseLu::new(s * N),
            residual: numbers.clone(),
            correction: numbers.clone(),
            next: numbers,
        }
    }

    /// The accelerations and the positions of the solved stages.
    pub fn stages(&self) -> impl Iterator<Item = (&SVector<f64, N>, &SVector<f64, N>)> {
        self.a.iter().zip(&self.trial)
    }

    /// Solves the stage equations; returns the number of iterations. The initial guess uses the forces of the step
    /// before if that was solved here; if this fails, or without such a step, it is a motion without forces.
    ///
    /// # Errors
    /// [`StepError::NotConverged`], [`StepError::Singular`], [`StepError::NonFinite`].
    pub fn solve<L: Lagrangian<N>>(&mut self, at: &At<L, N>) -> Result<u32, StepError> {
        for (base, u) in self.base.iter_mut().zip(&at.table.u) {
            *base = at.q + at.v * u.0;
        }
        let follows = at.t - self.solved <= 1.5 * at.table.h;
        self.solved = f64::NEG_INFINITY;
        self.x.copy_from_slice(&self.base);
        if follows {
            for (x, row) in self.x.iter_mut().zip(&at.table.b) {
                *x = self.a.iter().zip(row).fold(*x, |sum, (a, b)| sum + a * b.0);
            }
        }
        let mut outcome = self.iterate(at, if follows { 0 } else { chances(self.residual.len()) });
        if follows && outcome.is_err() {
            self.x.copy_from_slice(&self.base);
            outcome = self.iterate(at, chances(self.residual.len()));
        }
        if outcome.is_ok() {
            self.solved = at.t;
        }
        outcome
    }

    /// Damped Newton iteration from the positions `x`.
    fn iterate<L: Lagrangian<N>>(&mut self, at: &At<L, N>, chances: u32) -> Result<u32, StepError> {
        self.trial.copy_from_slice(&self.x);
        self.evaluate(at);
        if !self.residual.iter().all(|r| r.is_finite()) {
            return Err(StepError::NonFinite);
        }
        let mut damping = Damping::new(chances);
        let mut change = f64::INFINITY;
        for iterations in 1..=MAX_NEWTON_ITERATIONS {
            if damping.renews() {
                self.factorise(at)?;
                self.correction.copy_from_slice(&self.residual);
                self.lu.solve(&mut self.correction)?;
            } else {
                std::mem::swap(&mut self.correction, &mut self.next);
            }
            let correction = extent(&self.correction);
            let (position, moved) = self.extents(&at.q);
            change = correction / position;
            let next = loop {
                let steps = self.correction.chunks_exact(N);
                for ((trial, x), step) in self.trial.iter_mut().zip(&self.x).zip(steps) {
                    *trial = x + SVector::from_column_slice(step) * damping.part();
                }
                self.evaluate(at);
                self.next.copy_from_slice(&self.residual);
                let next = if self.lu.solve(&mut self.next).is_ok() { extent(&self.next) } else { f64::NAN };
                // No damping once half of the digits are correct.
                match damping.judge(correction, next, f64::EPSILON.sqrt() * position) {
                    Verdict::Taken => break next,
                    Verdict::Again => {}
                    Verdict::GivenUp => return Err(StepError::NotConverged { residual: change, iterations }),
                }
            };
            self.x.copy_from_slice(&self.trial);
            let stagnant = damping.ratio() >= 0.5 && next <= 1e3 * f64::EPSILON * position;
            if next <= f64::EPSILON * moved || stagnant {
                return Ok(iterations);
            }
            if damping.ratio() * next <= f64::EPSILON * moved {
                for (trial, step) in self.trial.iter_mut().zip(self.next.chunks_exact(N)) {
                    *trial += SVector::from_column_slice(step);
                }
                self.evaluate(at);
                return Ok(iterations + 1);
            }
        }
        Err(StepError::NotConverged { residual: change, iterations: MAX_NEWTON_ITERATIONS })
    }

    /// Evaluates the accelerations and the residual at the trial positions.
    fn evaluate<L: Lagrangian<N>>(&mut self, at: &At<L, N>) {
        for (i, (a, q)) in self.a.iter_mut().zip(&self.trial).enumerate() {
            let (t, x) = (at.t + at.table.times.0[i], VelocityPoint { q: *q, v: SVector::zeros(), z: 0.0 });
            let force = at.lagrangian.force(t, &x);
            *a = at.inverse_mass.map_or(force, |inverse| inverse * force);
        }
        for (i, out) in self.residual.chunks_exact_mut(N).enumerate() {
            let start = self.base[i] - self.trial[i];
            let row = &at.table.b[i];
            let lack = self.a.iter().zip(row).fold(start, |sum, (a, b)| sum + a * b.0);
            out.copy_from_slice(lack.as_slice());
        }
    }

    /// Factorises `1 - B a'` at the last iterate.
    fn factorise<L: Lagrangian<N>>(&mut self, at: &At<L, N>) -> Result<(), StepError> {
        for (i, (slope, q)) in self.slopes.iter_mut().zip(&self.x).enumerate() {
            *slope = curvature(at.lagrangian, at.t + at.table.times.0[i], q);
            if let Some(inverse) = at.inverse_mass {
                *slope = inverse * *slope;
            }
        }
        self.lu.factorise(|row, column| {
            let (i, j) = (row / N, column / N);
            let own = if row == column { 1.0 } else { 0.0 };
            own - at.table.b[i][j].0 * self.slopes[j][(row % N, column % N)]
        })
    }

    /// The largest coordinate of the trial positions, and the largest component of their distance from the start.
    fn extents(&self, start: &SVector<f64, N>) -> (f64, f64) {
        let of = |f: &dyn Fn(&SVector<f64, N>) -> SVector<f64, N>| {
            max_abs_or_nan(self.trial.iter().map(|x| max_abs_or_nan(f(x).iter().copied())))
        };
        (of(&|x| *x), of(&|x| x - start))
    }
}

/// The largest absolute component.
fn extent(x: &[f64]) -> f64 {
    max_abs_or_nan(x.iter().copied())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gauss::Gauss;
    use crate::gauss::GaussStepper;
    use crate::gauss::stages::equations::{Given, StageEquations};
    use crate::test_lagrangians::{Coupled, Cubic, InPlane, OnLine};
    use crate::{DiscreteLagrangian, Stepper, solve::Solver};
    use crate::{Problem, Start, StepperOptions};
    use contact_geom::{PhasePoint, Structure, numbers::max_or_nan};
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// The stages found from the positions alone are those found from velocities, actions and factors: to 64 units of
    /// round-off of the largest position or force, times the condition of the two systems, which is below 10 for these
    /// steps. Longer steps have several solutions.
    #[test]
    fn the_stages_are_those_of_all_equations() {
        let coupled = InPlane::from(Coupled);
        let mass: SMatrix<f64, 2, 2> = SMatrix::from(Coupled::MASS);
        let inverse = mass.try_inverse().unwrap();
        let (q, v) = (SVector::from([1.0, -2.0]), SVector::from([0.5, 1.0]));
        for s in [1, 2, 3, 5, 8, 16] {
            for h in [0.1, 0.4, 0.7] {
                let (t, gauss) = (0.4, Gauss::new::<2>(&coupled, s, h).unwrap());
                let equations: StageEquations<_, 2> = gauss.equations(t, true);
                let given = Given::Start(PhasePoint { q, p: mass * v, z: 0.0 });
                let mut work = equations.workspace(&given);
                equations.solve(&given, &v, &(mass * v), &mut work).unwrap();
                let table = Condensed::new(s, h, Coupled::GAMMA).unwrap();
                let mut positions = PositionNewton::new(s);
                let at = At { lagrangian: &coupled, table: &table, inverse_mass: Some(&inverse), t, q, v };
                positions.solve(&at).unwrap();
                let mut off = 0.0;
                for (i, (a, q)) in positions.stages().enumerate() {
                    let force = inverse * work.l[i].force;
                    let differences = [q - equations.position(&given, &work.x, i), a - force];
                    off = max_or_nan(off, max_abs_or_nan(differences.iter().flatten().copied()));
                }
                assert!(off <= 640.0 * f64::EPSILON * 4.0, "s = {s}, h = {h}: {off:e}");
            }
        }
    }

    /// A step without a solution fails after at most 60 evaluations of forces and second derivatives per stage, about
    /// 20 iterations, by both forms of the stage equations; 50 iterations took 100.
    #[test]
    fn a_step_without_a_solution_is_given_up_early() {
        let condensed = Structure { autonomous: true, separable: true, z_affine: true, ..Structure::default() };
        for s in [1, 4, 16] {
            for start in [1.0, 2.0] {
                let cubic = OnLine::from(Cubic { count: AtomicUsize::new(0), claims: condensed });
                let evaluations = || match &cubic {
                    OnLine::Cubic(cubic) => cubic.count.swap(0, Ordering::Relaxed) / s,
                    _ => unreachable!("it is the cubic potential"),
                };
                let table = Condensed::new(s, 5.0, -0.1).unwrap();
                let (q, v) = (SVector::from([start]), SVector::from([0.5]));
                let at = At { lagrangian: &cubic, table: &table, inverse_mass: None, t: 0.0, q, v };
                let outcome = PositionNewton::new(s).solve(&at);
                let of_positions = evaluations();
                assert!(matches!(outcome, Err(StepError::NotConverged { .. })), "{outcome:?}");
                let gauss = Gauss::new(&cubic, s, 5.0).unwrap();
                let state = PhasePoint { q, p: v, z: 0.2 };
                let outcome = gauss.forward(0.0, &state, &v, &mut Solver::default());
                let of_all = evaluations();
                assert!(matches!(outcome, Err(StepError::NotConverged { .. })), "{outcome:?}");
                assert!(of_positions <= 60 && of_all <= 60, "s = {s}: {of_positions}, {of_all} evaluations a stage");
            }
        }
    }

    /// A run reports the failure of such a step and keeps the state before it.
    #[test]
    fn a_run_ends_before_the_step_that_has_no_solution() {
        for claims in [
            Structure { autonomous: true, separable: true, z_affine: true, ..Structure::default() },
            Structure::default(),
        ] {
            let cubic = OnLine::from(Cubic { count: AtomicUsize::new(0), claims });
            let start = PhasePoint::new([1.0], [0.5], 0.2);
            let problem = Problem::new(&cubic, 0.0, Start::Momentum(start, [0.5].into())).unwrap();
            let mut run =
                GaussStepper::new(&problem, 8, 5.0, StepperOptions { action: true, check_resolution: false }).unwrap();
            let halt = run.advance(3).unwrap_err();
            assert!(halt.taken == 0 && matches!(halt.cause, StepError::NotConverged { .. }), "{halt:?}");
            assert_eq!(run.state(), start);
        }
    }
}
