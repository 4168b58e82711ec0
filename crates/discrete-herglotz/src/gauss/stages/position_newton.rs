//! Newton's method for the stages of a condensed step: the unknowns are the stage positions, and the Jacobian has the
//! derivative of the force at each stage.

use crate::StepError;
use crate::gauss::limits::MAX_NEWTON_ITERATIONS;
use crate::gauss::stages::damping::{Damping, Verdict, chances};
use crate::gauss::stages::product::{matrix_product, product};
use crate::gauss::system::CollocationSystem;
use crate::gauss::tables::condensed::Condensed;
use crate::numbers::registers::DoubleDoubleStages;
use crate::solve::DenseLu;
use contact_geom::nalgebra::DMatrix;
use contact_geom::numbers::max_abs_or_nan;

/// Solves `Q = q0 + u v0 + B a`, `a_i = M^-1 L_q(t_i, Q_i)`, for the positions Q of the stages: `s n` unknowns, with
/// the Newton correction `(1 - B a')^-1` times the residual. Made once for a run, so that steps do not allocate.
///
/// Vectors have the n components of one stage after those of another.
pub(crate) struct PositionNewton {
    n: usize,
    /// `q0 + u v0`.
    base: Vec<f64>,
    /// The positions of the last accepted iterate and of the trial.
    x: Vec<f64>,
    trial: Vec<f64>,
    /// The accelerations at the trial positions, and the start time of the last step that was solved.
    a: Vec<f64>,
    solved: f64,
    /// The force at one stage, and its derivative.
    force: Vec<f64>,
    curvature: DMatrix<f64>,
    /// `a'` at the stages.
    slopes: Vec<DMatrix<f64>>,
    lu: DenseLu,
    residual: Vec<f64>,
    correction: Vec<f64>,
    next: Vec<f64>,
}

/// The system and the start of a step.
pub(crate) struct At<'a> {
    pub system: &'a dyn CollocationSystem,
    pub table: &'a Condensed,
    /// `None` where M is the identity.
    pub inverse_mass: Option<&'a DMatrix<f64>>,
    pub t: f64,
    pub q: &'a [f64],
    pub v: &'a [f64],
}

impl PositionNewton {
    /// The workspace for steps of `s` stages and n coordinates.
    pub fn new(s: usize, n: usize) -> Self {
        let numbers = || vec![0.0; s * n];
        PositionNewton {
            n,
            base: numbers(),
            x: numbers(),
            trial: numbers(),
            a: numbers(),
            solved: f64::NEG_INFINITY,
            force: vec![0.0; n],
            curvature: DMatrix::zeros(n, n),
            slopes: vec![DMatrix::zeros(n, n); s],
            lu: DenseLu::new(s * n),
            residual: numbers(),
            correction: numbers(),
            next: numbers(),
        }
    }

    /// The accelerations and the positions of the solved stages.
    pub fn stages(&self) -> impl Iterator<Item = (&[f64], &[f64])> {
        self.a.chunks_exact(self.n).zip(self.trial.chunks_exact(self.n))
    }

    /// Solves the stage equations; returns the number of iterations. The initial guess uses the forces of the step
    /// before if that was solved here; if this fails, or without such a step, it is a motion without forces.
    ///
    /// # Errors
    /// [`StepError::NotConverged`], [`StepError::Singular`], [`StepError::NonFinite`].
    pub fn solve(&mut self, at: &At<'_>) -> Result<u32, StepError> {
        for (base, u) in self.base.chunks_exact_mut(self.n).zip(&at.table.u) {
            for (base, (q, v)) in base.iter_mut().zip(at.q.iter().zip(at.v)) {
                *base = q + v * u.0;
            }
        }
        let follows = at.t - self.solved <= 1.5 * at.table.h;
        self.solved = f64::NEG_INFINITY;
        self.x.copy_from_slice(&self.base);
        if follows {
            for (x, row) in self.x.chunks_exact_mut(self.n).zip(&at.table.b) {
                add_products(x, row, &self.a);
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
    fn iterate(&mut self, at: &At<'_>, chances: u32) -> Result<u32, StepError> {
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
            let (position, moved) = self.extents(at.q);
            change = correction / position;
            let next = loop {
                for ((trial, x), step) in self.trial.iter_mut().zip(&self.x).zip(&self.correction) {
                    *trial = x + step * damping.part();
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
                for (trial, step) in self.trial.iter_mut().zip(&self.next) {
                    *trial += step;
                }
                self.evaluate(at);
                return Ok(iterations + 1);
            }
        }
        Err(StepError::NotConverged { residual: change, iterations: MAX_NEWTON_ITERATIONS })
    }

    /// Evaluates the accelerations and the residual at the trial positions.
    fn evaluate(&mut self, at: &At<'_>) {
        let stages = self.a.chunks_exact_mut(self.n).zip(self.trial.chunks_exact(self.n));
        for ((a, q), time) in stages.zip(&at.table.times.0) {
            let t = at.t + time;
            match at.inverse_mass {
                None => at.system.force(t, q, a),
                Some(inverse) => {
                    at.system.force(t, q, &mut self.force);
                    product(inverse, &self.force, a);
                }
            }
        }
        for ((residual, base), trial) in self.residual.iter_mut().zip(&self.base).zip(&self.trial) {
            *residual = base - trial;
        }
        for (residual, row) in self.residual.chunks_exact_mut(self.n).zip(&at.table.b) {
            add_products(residual, row, &self.a);
        }
    }

    /// Factorises `1 - B a'` at the last iterate.
    fn factorise(&mut self, at: &At<'_>) -> Result<(), StepError> {
        let n = self.n;
        for ((slope, q), time) in self.slopes.iter_mut().zip(self.x.chunks_exact(n)).zip(&at.table.times.0) {
            let t = at.t + time;
            match at.inverse_mass {
                None => at.system.curvature(t, q, slope),
                Some(inverse) => {
                    at.system.curvature(t, q, &mut self.curvature);
                    matrix_product(inverse, &self.curvature, slope);
                }
            }
        }
        self.lu.factorise(|row, column| {
            let (i, j) = (row / n, column / n);
            let own = if row == column { 1.0 } else { 0.0 };
            own - at.table.b[i][j].0 * self.slopes[j][(row % n, column % n)]
        })
    }

    /// The largest coordinate of the trial positions, and the largest component of their distance from the start.
    fn extents(&self, start: &[f64]) -> (f64, f64) {
        let distances = self.trial.chunks_exact(self.n).flat_map(|x| x.iter().zip(start).map(|(x, start)| x - start));
        (extent(&self.trial), max_abs_or_nan(distances))
    }
}

/// Adds the sum of the stages of `a`, multiplied by a row of B, to a vector.
fn add_products(to: &mut [f64], row: &DoubleDoubleStages, a: &[f64]) {
    for (a, b) in a.chunks_exact(to.len()).zip(row) {
        to.iter_mut().zip(a).for_each(|(to, a)| *to += a * b.0);
    }
}

/// The largest absolute component.
fn extent(x: &[f64]) -> f64 {
    max_abs_or_nan(x.iter().copied())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::DiscreteLagrangian;
    use crate::gauss::Gauss;
    use crate::gauss::stages::equations::{Given as GivenValues, StageEquations as Plain, Workspace};
    use crate::gauss::stages::lifted_equations::{Given, StageEquations};
    use crate::gauss::system::PointRef;
    use crate::gauss::system::Typed;
    use crate::solve::Solver;
    use crate::test_lagrangians::{Coupled, Cubic, InPlane, OnLine};
    use contact_geom::nalgebra::{SMatrix, SVector};
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
        let inverse_mass = DMatrix::from_column_slice(2, 2, inverse.as_slice());
        let (q, v) = (SVector::from([1.0, -2.0]), SVector::from([0.5, 1.0]));
        for s in [1, 2, 3, 5, 8, 16] {
            for h in [0.1, 0.4, 0.7] {
                let (t, gauss) = (0.4, Gauss::new::<2>(&coupled, s, h).unwrap());
                let equations: StageEquations<_, 2> = gauss.equations(t, true);
                let given = Given::Start(PhasePoint { q, p: mass * v, z: 0.0 });
                let (system, p) = (Typed(&coupled), mass * v);
                let plain = Plain { system: &system, products: equations.products, t };
                let mut work = Workspace::new(&system, s, false);
                let start = PointRef { q: q.as_slice(), v: p.as_slice(), z: 0.0 };
                plain.solve(&GivenValues::Start(start), v.as_slice(), p.as_slice(), &mut work).unwrap();
                let (x, l) = work.solution::<2>();
                let table = Condensed::new(s, h, Coupled::GAMMA).unwrap();
                let mut positions = PositionNewton::new(s, 2);
                let (system, inverse_mass) = (&Typed::<_, 2>(&coupled), Some(&inverse_mass));
                let at = At { system, table: &table, inverse_mass, t, q: q.as_slice(), v: v.as_slice() };
                positions.solve(&at).unwrap();
                let mut off = 0.0;
                for (i, (a, q)) in positions.stages().enumerate() {
                    let [a, q] = [a, q].map(SVector::<f64, 2>::from_column_slice);
                    let force = inverse * l[i].force;
                    let differences = [q - equations.position(&given, &x, i), a - force];
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
                let system = &Typed::<_, 1>(&cubic);
                let at = At { system, table: &table, inverse_mass: None, t: 0.0, q: &[start], v: &[0.5] };
                let outcome = PositionNewton::new(s, 1).solve(&at);
                let of_positions = evaluations();
                assert!(matches!(outcome, Err(StepError::NotConverged { .. })), "{outcome:?}");
                let gauss = Gauss::new(&cubic, s, 5.0).unwrap();
                let (q, v) = (SVector::from([start]), SVector::from([0.5]));
                let state = PhasePoint { q, p: v, z: 0.2 };
                let outcome = gauss.forward(0.0, &state, &v, &mut Solver::default());
                let of_all = evaluations();
                assert!(matches!(outcome, Err(StepError::NotConverged { .. })), "{outcome:?}");
                assert!(of_positions <= 60 && of_all <= 60, "s = {s}: {of_positions}, {of_all} evaluations a stage");
            }
        }
    }
}
