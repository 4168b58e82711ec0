//! Simplified Newton iteration for the stages of a step, with the derivatives of H at one point for all stages.

use crate::gauss::routes::hamiltonian::HamiltonianStages;
use crate::gauss::system::SystemAtPoints;
use crate::gauss::tables::modes::Modes;
use crate::gauss::tables::stage_table::StageTable;
use crate::numbers::registers::Stages;
use crate::numbers::state_words::saved;
use crate::solve::inverse::invert_complex;
use contact_geom::nalgebra::Complex;

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
    /// J by columns.
    jacobian: Vec<f64>,
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
    pub fn new(table: &StageTable, n: usize) -> Self {
        let modes = Modes::of(table.s);
        SimplifiedNewton {
            modes,
            s: table.s,
            h: table.h,
            weights: table.weights,
            n,
            jacobian: vec![0.0; n * n],
            inverses: vec![vec![Complex::default(); n * n]; modes.iter().count()],
            base: vec![Stages::ZERO; n],
            found: vec![Stages::ZERO; n],
            coefficients: vec![Complex::default(); n],
        }
    }

    /// Inverts the matrices of the modes for the Jacobian; `false` if one of them is singular.
    fn factorise(&mut self) -> bool {
        let n = self.n;
        self.modes.iter().zip(&mut self.inverses).all(|(mode, inverse)| {
            let mu = mode.value * self.h;
            for (index, (entry, slope)) in inverse.iter_mut().zip(&self.jacobian).enumerate() {
                let own = if index % (n + 1) == 0 { 1.0 } else { 0.0 };
                *entry = Complex::from(own) - mu * *slope;
            }
            let finite = |m: &[Complex<f64>]| m.iter().all(|e| e.re.is_finite() && e.im.is_finite());
            finite(inverse) && invert_complex(inverse, n) && finite(inverse)
        })
    }

    /// One simplified Newton iteration, in place of a fixed-point iteration: replaces the right-hand sides of the last
    /// iteration, those of (q, P) and of (z, 1 - rho), by those of the next one.
    #[cold]
    #[inline(never)]
    pub fn correct(&mut self, [moved, force]: [&mut [Stages]; 2], [l, rate]: [&mut Stages; 2]) {
        let scalars = [&*l, &*rate];
        for (found, now) in self.found.iter_mut().zip(moved.iter().chain(&*force).chain(scalars)) {
            *found = *now;
        }
        self.iterate();
        for (now, found) in moved.iter_mut().chain(force).chain([l, rate]).zip(&self.found) {
            *now = *found;
        }
    }

    /// Replaces the right-hand sides that were found by those of the next iteration.
    fn iterate(&mut self) {
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

impl HamiltonianStages {
    /// Keeps the right-hand sides of the current stages for the simplified Newton iteration, if it is used: those of the
    /// predictor, or 0 without one.
    pub(super) fn keep_iterate(&mut self, predicted: bool) {
        let Some(newton) = &mut self.newton else { return };
        for (base, now) in newton.base.iter_mut().zip(self.rows.right_hand_sides()) {
            *base = if predicted { *now } else { Stages::ZERO };
        }
    }

    /// Switches to simplified Newton iteration with the Jacobian at the stage of the workspace; `false` if it is singular
    /// or not finite.
    fn linearise(&mut self, system: &dyn SystemAtPoints) -> bool {
        let mut newton = self
            .newton
            .take()
            .or_else(|| self.suspended_newton.take())
            .unwrap_or_else(|| Box::new(SimplifiedNewton::new(&self.table, self.components())));
        self.evaluation.jacobian(system, &self.stage, &mut newton.jacobian);
        let regular = newton.jacobian.iter().all(|e| e.is_finite()) && newton.factorise();
        self.newton = Some(newton);
        (self.warm, self.age) = (false, 0);
        regular
    }

    /// The same at the state.
    pub(super) fn linearise_at(&mut self, system: &dyn SystemAtPoints, t: f64) -> bool {
        self.take_state(t);
        self.linearise(system)
    }

    /// Recomputes the Jacobian of the simplified Newton iteration at the middle stage of the last step, with rho = 1.
    #[cold]
    #[inline(never)]
    pub(super) fn renew(&mut self, system: &dyn SystemAtPoints, t: f64) {
        let i = self.table.s / 2;
        let (rows, stage) = (&self.rows, &mut self.stage);
        for (to, from) in stage.q.iter_mut().zip(rows.x()).chain(stage.scaled_p.iter_mut().zip(rows.p())) {
            *to = from.0[i];
        }
        (stage.t, stage.z, stage.one_minus_rho) = (t + self.table.times.0[i], rows.z().0[i], 0.0);
        stage.set_momentum();
        let warm = self.warm;
        let regular = self.linearise(system);
        self.warm = warm && regular;
    }
}
