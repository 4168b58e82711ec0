//! Steps of contact Gauss collocation for `L = v.Mv/2 - V(t, q) + gamma z`.

mod finish;
mod in_registers;
mod kernel;
mod route;
mod slope;
mod vectors;

pub(crate) use kernel::{Iterated, IterationStart, SeparableKernel};

use crate::gauss::limits::{MIN_JACOBIAN_AGE, SLOW_NEWTON, TAIL_PERIOD};
use crate::gauss::resolution::tail::Tail;
use crate::gauss::routes::separable::finish::Finish;
use crate::gauss::routes::separable::vectors::{Parts, Vectors};
use crate::gauss::stages::fixed_point::{FixedPointIteration, IterationOutcome};
use crate::gauss::stages::position_newton::PositionNewton;
use crate::gauss::stages::product::product_of_sizes;
use crate::gauss::stages::slope_newton::SlopeNewton;
use crate::gauss::stages::stage_values::CondensedStages;
use crate::gauss::system::{CollocationSystem, PointGradient, PointRef};
use crate::gauss::tables::condensed::{Condensed, Preconditioned};
use crate::numbers::compensated::{CompensatedSum, Unevaluated, copy_values};
use crate::numbers::instructions::Instructions;
use crate::numbers::registers::Stages;
use crate::numbers::state_words::{Saved, load_option, save_option, saved};
use crate::resolution::thresholds::{COLLOCATION_ROUNDINGS, MIN_CHECKED_CHANGE};
use contact_geom::nalgebra::DMatrix;
use contact_geom::numbers::max_abs_or_nan;
use std::sync::Arc;

/// The state and the workspace of the condensed step.
pub(crate) struct Separable {
    /// The instruction set of the kernels.
    pub arch: Instructions,
    table: Arc<Condensed>,
    /// The matrix of the iteration, and the vectors of the stages.
    vectors: Vectors,
    /// `M^-1`; `None` where M is the identity.
    inverse_mass: Option<DMatrix<f64>>,
    wants_z: bool,
    q: Vec<CompensatedSum>,
    v: Vec<CompensatedSum>,
    z: CompensatedSum,
    /// The positions and `rest` of the iteration before, for one coordinate.
    before: [Stages; 2],
    /// The changes of q and v in a step.
    changes: [Vec<Unevaluated>; 2],
    /// The velocities at the stages of an iterate that is accepted.
    velocities: Vec<Stages>,
    /// `L - gamma z` at the stages, if z is advanced.
    values: Stages,
    point: Point,
    /// Whether the initial guesses are too inaccurate for the terms with the tails of the matrices.
    far: bool,
    /// Whether `rest` is the solution of the step before.
    warm: bool,
    /// Simplified Newton iteration, used while the fixed-point iteration does not converge.
    newton: Option<Box<SlopeNewton>>,
    /// Its workspace while it is not used.
    suspended_newton: Option<Box<SlopeNewton>>,
    /// Newton's method in the stage positions, for steps in which simplified Newton iteration does not converge; made
    /// for the first step in which the fixed-point iteration does not converge.
    positions: Option<Box<PositionNewton>>,
    /// Whether the stages of the next step are solved already, with their solution in `rest`.
    solved: bool,
    /// The number of further steps whose initial guess is a motion by the linear force alone.
    steps_without_predictor: u32,
    /// The number of steps since the Jacobian of the simplified Newton iteration was computed.
    age: u32,
    tail: Tail,
    /// The defect of the last step; above one if it does not resolve the motion.
    defect: f64,
    /// The number of steps taken, and the number at which the slope of the force is estimated again.
    taken: usize,
    review: usize,
    evaluations: u64,
    /// See [`set_tolerance`](crate::gauss::routes::StageRoute::set_tolerance).
    tolerance: f64,
}

/// A point at which the derivatives or the round-off of the force are evaluated.
struct Point {
    q: Vec<f64>,
    v: Vec<f64>,
    rounding: PointGradient,
    /// The round-off of the accelerations.
    of_acceleration: Vec<f64>,
}

impl Separable {
    /// The route at a start (q, v, z), with the matrix for `kappa = 0`.
    pub fn new(
        table: Arc<Condensed>,
        left: Preconditioned,
        inverse_mass: Option<DMatrix<f64>>,
        start: PointRef<'_>,
        wants_z: bool,
    ) -> Self {
        let (tail, n) = (Tail::new(table.s), start.q.len());
        let (sums, zeros) = (|x: &[f64]| x.iter().map(|x| CompensatedSum::from(*x)).collect(), || vec![0.0; n]);
        Separable {
            arch: Instructions::new(),
            table,
            vectors: Vectors::new(left, n),
            inverse_mass,
            wants_z,
            q: sums(start.q),
            v: sums(start.v),
            z: start.z.into(),
            before: [Stages::ZERO; 2],
            changes: [vec![Unevaluated::default(); n], vec![Unevaluated::default(); n]],
            velocities: vec![Stages::ZERO; n],
            values: Stages::ZERO,
            point: Point { q: zeros(), v: zeros(), rounding: PointGradient::zeros(n), of_acceleration: zeros() },
            far: false,
            warm: false,
            newton: None,
            suspended_newton: None,
            positions: None,
            solved: false,
            steps_without_predictor: 0,
            age: 0,
            tail,
            defect: 0.0,
            taken: 0,
            review: 1,
            evaluations: 0,
            tolerance: 0.0,
        }
    }

    /// Switches to simplified Newton iteration with `L_qq` at a time and the position `self.point.q`; `false` if the
    /// Jacobian is singular or not finite.
    fn linearise(&mut self, system: &dyn CollocationSystem, t: f64) -> bool {
        self.prepare()
            && self
                .newton
                .as_mut()
                .is_some_and(|newton| newton.linearise(system, t, &self.point.q, self.inverse_mass.as_ref()))
    }

    /// Allocates simplified Newton iteration and sets kappa = 0; `false` if that is not possible. Not inlined, so that
    /// its matrices have a stack frame of their own.
    #[inline(never)]
    fn prepare(&mut self) -> bool {
        if self.newton.is_none() {
            let n = self.q.len();
            let Some(mut left) = self.table.preconditioned(0.0) else { return false };
            left.refine(&self.table);
            *self.vectors.parts(n).left = left;
            let suspended = self.suspended_newton.take();
            self.newton = suspended.or_else(|| Some(Box::new(SlopeNewton::new(&self.table, n))));
            self.forget();
        }
        true
    }

    /// Takes a motion without forces as the initial guess of the next step.
    fn forget(&mut self) {
        self.vectors.parts(self.q.len()).rest.fill(Stages::ZERO);
        self.warm = false;
    }

    /// Recomputes the Jacobian of the simplified Newton iteration at the middle stage of the last step.
    #[cold]
    #[inline(never)]
    fn renew(&mut self, system: &dyn CollocationSystem, t: f64) {
        self.age = 0;
        let time = self.enter_middle();
        if !self.linearise(system, t + time) {
            self.forget();
        }
    }

    /// Sets the position of `self.point` to that of the middle stage; returns its time relative to the start of the step.
    fn enter_middle(&mut self) -> f64 {
        let (i, [_, x]) = (self.table.s / 2, self.vectors.solved());
        self.point.q.iter_mut().zip(x).for_each(|(q, x)| *q = x.0[i]);
        self.table.times.0[i]
    }

    /// Whether a change of the accelerations is round-off of the forces: where terms of a force cancel, near an
    /// equilibrium, its round-off is that of the terms.
    #[cold]
    #[inline(never)]
    fn is_rounding(&mut self, system: &dyn CollocationSystem, t: f64, change: f64) -> bool {
        let time = self.enter_middle();
        let Point { q, v, rounding, of_acceleration } = &mut self.point;
        v.fill(0.0);
        system.rounding(t + time, PointRef { q, v, z: 0.0 }, rounding);
        match &self.inverse_mass {
            None => of_acceleration.copy_from_slice(&rounding.q),
            Some(inverse) => product_of_sizes(inverse, &rounding.q, of_acceleration),
        }
        change <= COLLOCATION_ROUNDINGS * max_abs_or_nan(of_acceleration.iter().copied())
    }

    /// Takes the last iterate as the solution of a step.
    #[cold]
    fn accept(&mut self, system: &dyn CollocationSystem, t: f64) {
        if self.newton.is_some() {
            let Parts { rest, a, .. } = self.vectors.parts(self.q.len());
            a.copy_from_slice(rest);
        }
        if self.wants_z {
            copy_values(&self.v, &mut self.point.v);
            let ([a, x], v) = (self.vectors.solved(), &mut self.velocities);
            let solved = CondensedStages { table: &self.table, t, v0: &self.point.v, a, x, v };
            self.values = system.stage_values(self.arch, solved);
        }
    }

    /// Takes one step from the time `t`; on failure the state is unchanged.
    fn take_step(&mut self, system: &dyn CollocationSystem, t: f64) -> IterationOutcome {
        if self.warm && self.newton.is_none() && self.taken >= self.review {
            self.review *= 2;
            self.update_matrix();
        }
        let solved = std::mem::take(&mut self.solved);
        let predicts = self.predict(solved);
        let weight = match self.taken % TAIL_PERIOD {
            _ if solved || self.newton.is_some() => 1.0,
            0 => TAIL_PERIOD as f64,
            _ => 0.0,
        };
        let Iterated { mut outcome, iteration, change } =
            system.iterate(self.arch, self, IterationStart { t, solved, predicts, weight });
        if matches!(outcome, IterationOutcome::Slow { .. }) && self.is_rounding(system, t, change) {
            self.accept(system, t);
            outcome = IterationOutcome::Done;
        }
        if outcome == IterationOutcome::Done {
            let predicted_well = iteration.first() <= MIN_CHECKED_CHANGE && !solved;
            outcome = self.finish(&iteration, [predicts, predicted_well]);
        }
        self.warm = outcome == IterationOutcome::Done;
        if !self.warm {
            // The result of a diverged iteration is a worse initial guess than a motion by the linear force alone.
            self.vectors.parts(self.q.len()).rest.fill(Stages::ZERO);
            return outcome;
        }
        if self.newton.is_some() {
            self.age = self.age.saturating_add(1);
            if iteration.count() > SLOW_NEWTON && self.age > MIN_JACOBIAN_AGE {
                self.renew(system, t);
            }
            return IterationOutcome::Done;
        }
        self.taken += 1;
        IterationOutcome::Done
    }

    /// Whether the initial guess of a step is extrapolated from the step before; if not, sets it.
    fn predict(&mut self, solved: bool) -> bool {
        let n = self.q.len();
        let predicts = self.warm && !solved && (self.steps_without_predictor == 0 || self.newton.is_some());
        if !predicts && !solved {
            self.vectors.parts(n).rest.fill(Stages::ZERO);
            self.steps_without_predictor = self.steps_without_predictor.saturating_sub(1);
        }
        predicts
    }

    /// The end of the step from its accelerations: `predicts` if the initial guess was extrapolated, `predicted_well` if
    /// it was so accurate that the step resolves the motion.
    fn finish(&mut self, iteration: &FixedPointIteration, [predicts, predicted_well]: [bool; 2]) -> IterationOutcome {
        let predictor_error = (predicts && self.q.len() == 1).then_some(iteration.first_change());
        self.arch.dispatch(Finish { run: self, predictor_error, predicted_well })
    }

    /// Saves kappa and whether the tail is present, which determine the matrices, and the simplified Newton iteration.
    fn save_solution(&self, to: &mut Vec<u64>) {
        let left = self.vectors.left();
        left.kappa.save(to);
        left.tail.is_some().save(to);
        save_option(self.newton.as_deref(), to);
    }

    /// Reads back what [`save_solution`](Self::save_solution) has written.
    fn load_solution(&mut self, from: &mut &[u64]) -> Option<()> {
        let (mut kappa, mut refined, n) = (0.0, false, self.q.len());
        kappa.load(from)?;
        refined.load(from)?;
        let left = self.vectors.parts(n).left;
        *left = self.table.preconditioned(kappa)?;
        if refined {
            left.refine(&self.table);
        }
        self.newton = load_option(from, || SlopeNewton::new(&self.table, n))?.map(Box::new);
        Some(())
    }
}

saved!([] Separable {
    vectors, q, v, z, far, warm, solved, steps_without_predictor, age, defect, taken, review, evaluations,
} and save_solution, load_solution);
