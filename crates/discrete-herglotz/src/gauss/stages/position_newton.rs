//! Newton's method for the stages of a condensed step: the unknowns are the stage positions, and the Jacobian has the
//! derivative of the force at each stage.

use crate::StepError;
use crate::gauss::stages::damped_newton::{DampedNewton, StageUnknowns};
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
    /// The unknowns are the positions.
    newton: DampedNewton,
    /// `q0 + u v0`.
    base: Vec<f64>,
    /// The accelerations at the positions, and the start time of the last step that was solved.
    a: Vec<f64>,
    solved: f64,
    /// The force at one stage, and its derivative.
    force: Vec<f64>,
    curvature: DMatrix<f64>,
    /// `a'` at the stages.
    slopes: Vec<DMatrix<f64>>,
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
            newton: DampedNewton::new(s * n),
            base: numbers(),
            a: numbers(),
            solved: f64::NEG_INFINITY,
            force: vec![0.0; n],
            curvature: DMatrix::zeros(n, n),
            slopes: vec![DMatrix::zeros(n, n); s],
        }
    }

    /// The accelerations and the positions of the solved stages.
    pub fn stages(&self) -> impl Iterator<Item = (&[f64], &[f64])> {
        self.a.chunks_exact(self.n).zip(self.newton.x.chunks_exact(self.n))
    }

    /// Solves the stage equations; returns the number of iterations. The initial guess uses the forces of the step
    /// before if that was solved here; if this fails, or without such a step, it is a motion without forces.
    ///
    /// # Errors
    /// [`StepError::NotConverged`], [`StepError::Singular`], [`StepError::NonFinite`].
    pub fn solve(&mut self, at: &At<'_>) -> Result<u32, StepError> {
        let PositionNewton { n, newton, base, a, solved, force, curvature, slopes } = self;
        let n = *n;
        for (base, u) in base.chunks_exact_mut(n).zip(&at.table.u) {
            for (base, (q, v)) in base.iter_mut().zip(at.q.iter().zip(at.v)) {
                *base = q + v * u.0;
            }
        }
        let follows = at.t - *solved <= 1.5 * at.table.h;
        *solved = f64::NEG_INFINITY;
        newton.x.copy_from_slice(base);
        if follows {
            for (x, row) in newton.x.chunks_exact_mut(n).zip(&at.table.b) {
                add_products(x, row, a);
            }
        }
        let chances = newton.chances();
        let mut positions = Positions { at, n, base, a, force, curvature, slopes };
        let mut outcome = newton.solve(&mut positions, if follows { 0 } else { chances });
        if follows && outcome.is_err() {
            newton.x.copy_from_slice(positions.base);
            outcome = newton.solve(&mut positions, chances);
        }
        if outcome.is_ok() {
            *solved = at.t;
        }
        outcome
    }
}

/// The equations for the positions.
struct Positions<'r> {
    at: &'r At<'r>,
    n: usize,
    base: &'r [f64],
    a: &'r mut [f64],
    force: &'r mut [f64],
    curvature: &'r mut DMatrix<f64>,
    slopes: &'r mut [DMatrix<f64>],
}

impl Positions<'_> {
    /// The largest coordinate of the positions, and the largest component of their distance from the start.
    fn extents(&self, x: &[f64]) -> (f64, f64) {
        let distances = x.chunks_exact(self.n).flat_map(|x| x.iter().zip(self.at.q).map(|(x, start)| x - start));
        (extent(x), max_abs_or_nan(distances))
    }
}

impl StageUnknowns for Positions<'_> {
    fn residuals(&mut self, x: &[f64], out: &mut [f64]) {
        let at = self.at;
        let stages = self.a.chunks_exact_mut(self.n).zip(x.chunks_exact(self.n));
        for ((a, q), time) in stages.zip(&at.table.times.0) {
            let t = at.t + time;
            match at.inverse_mass {
                None => at.system.force(t, q, a),
                Some(inverse) => {
                    at.system.force(t, q, self.force);
                    product(inverse, self.force, a);
                }
            }
        }
        for ((residual, base), x) in out.iter_mut().zip(self.base).zip(x) {
            *residual = base - x;
        }
        for (residual, row) in out.chunks_exact_mut(self.n).zip(&at.table.b) {
            add_products(residual, row, self.a);
        }
    }

    /// The Jacobian is `1 - B a'`.
    fn factorise(&mut self, x: &[f64], lu: &mut DenseLu) -> Result<(), StepError> {
        let (n, at) = (self.n, self.at);
        for ((slope, q), time) in self.slopes.iter_mut().zip(x.chunks_exact(n)).zip(&at.table.times.0) {
            let t = at.t + time;
            match at.inverse_mass {
                None => at.system.curvature(t, q, slope),
                Some(inverse) => {
                    at.system.curvature(t, q, self.curvature);
                    matrix_product(inverse, self.curvature, slope);
                }
            }
        }
        lu.factorise(|row, column| {
            let (i, j) = (row / n, column / n);
            let own = if row == column { 1.0 } else { 0.0 };
            own - at.table.b[i][j].0 * self.slopes[j][(row % n, column % n)]
        })
    }

    fn size(&mut self, x: &[f64], correction: &[f64]) -> f64 {
        relative(extent(correction), self.extents(x).0)
    }

    /// Round-off of the distance from the start, which determines the accelerations.
    fn exact(&mut self, x: &[f64]) -> f64 {
        let (position, moved) = self.extents(x);
        f64::EPSILON * relative(moved, position)
    }

    fn round_off(&self, _x: &[f64]) -> f64 {
        1e3 * f64::EPSILON
    }
}

/// Adds the sum of the stages of `a`, multiplied by a row of B, to a vector.
fn add_products(to: &mut [f64], row: &DoubleDoubleStages, a: &[f64]) {
    for (a, b) in a.chunks_exact(to.len()).zip(row) {
        to.iter_mut().zip(a).for_each(|(to, a)| *to += a * b.0);
    }
}

/// A size divided by another one; 0 for a size of 0.
fn relative(size: f64, other: f64) -> f64 {
    if size == 0.0 { 0.0 } else { size / other }
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
