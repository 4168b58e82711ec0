//! The slope of the force: its estimate in the matrix of the iteration, and secant steps between iterations.

use crate::gauss::limits::LONG_RUN;
use crate::gauss::routes::separable::SeparableStages;
use crate::numbers::lanes::Lanes;
use crate::numbers::registers::{Stages, blocks};
use contact_geom::Lagrangian;
use pulp::Simd;

impl<L: Lagrangian<N>, const N: usize> SeparableStages<'_, L, N> {
    /// Stores the positions and `rest` of this iteration in `[x, rest]`. With `ahead` it first takes a secant step,
    /// which uses the slope of the force between the last two iterations instead of an evaluation. For one coordinate
    /// only: a force of several coordinates has no such slope.
    #[inline(always)]
    pub(crate) fn store_values<S: Simd>(&mut self, [x, rest]: &mut [Stages; 2], ahead: bool) {
        let (s, base) = (self.table.s, &self.base[0]);
        let mut next = Stages::ZERO;
        if ahead {
            self.left.head.b.apply::<S>(&self.rest[0], s, &mut next, base);
        }
        // A steeper secant is due to round-off.
        let (most, least) = (Lanes::<S>::splat(self.left.kappa.abs()), Lanes::<S>::splat(f64::MIN_POSITIVE));
        for r in 0..blocks::<S>(s) {
            let (now, added) = (self.x[0].block::<S>(r), self.rest[0].block::<S>(r));
            if ahead {
                let (moved, more) = (now - x.block(r), added - rest.block(r));
                // The slope is zero for stages that have not moved.
                let slope = more * moved / moved.mul_add(moved, least);
                let slope = -(-slope.max(-most)).max(-most);
                self.rest[0].set(r, slope.mul_add(next.block::<S>(r) - now, added));
                self.x[0].set(r, next.block::<S>(r));
            }
            x.set(r, now);
            rest.set(r, added);
        }
    }

    /// The largest absolute value of `rest`.
    #[inline(always)]
    pub(crate) fn largest_rest<S: Simd>(&self) -> f64 {
        let mut largest = Lanes::<S>::splat(0.0);
        for rest in &self.rest {
            for r in 0..blocks::<S>(self.table.s) {
                largest = largest.max(rest.block::<S>(r).abs());
            }
        }
        largest.reduce_max()
    }

    /// Estimates the slope of the force, and refines the matrices if they are expected to be kept for long.
    pub(crate) fn update_matrix(&mut self) {
        self.adapt();
        if self.taken >= LONG_RUN {
            self.left.refine(&self.table);
        }
    }

    /// Estimates the slope of the force from the stages of the last step by least squares, and computes a new matrix if
    /// the slope has changed enough.
    #[inline(never)]
    fn adapt(&mut self) {
        let s = self.table.s;
        let (mut products, mut squares) = (0.0, 0.0);
        for d in 0..N {
            let (x, a) = (&self.x[d].0[..s], &self.a[d].0[..s]);
            let mean = |y: &[f64]| y.iter().sum::<f64>() / s as f64;
            let (mx, ma) = (mean(x), mean(a));
            for (x, a) in x.iter().zip(a) {
                products += (x - mx) * (a - ma);
                squares += (x - mx) * (x - mx);
            }
        }
        let kappa = -products / squares;
        // The longer a matrix is expected to be kept, the smaller the change of slope that justifies a new one.
        let worth = f64::min(0.02, 50.0 / (self.taken * self.taken) as f64);
        if !kappa.is_finite() || (kappa - self.left.kappa).abs() <= worth * kappa.abs() {
            return;
        }
        if let Some(left) = self.table.preconditioned(kappa) {
            let change = kappa - self.left.kappa;
            for (rest, x) in self.rest.iter_mut().zip(&self.x) {
                rest.0.iter_mut().zip(&x.0).for_each(|(r, x)| *r += change * x);
            }
            self.left = left;
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::gauss::{GaussRoute, GaussStepper};
    use crate::test_lagrangians::{Anharmonic, InPlane, OnLine};
    use crate::{Problem, Stepper, StepperOptions};
    use contact_geom::{Lagrangian, PhasePoint};

    /// The first coordinate after 100 units of time, the iterations per step, and the number of steps by Newton
    /// methods.
    fn motion<const N: usize>(anharmonic: &impl Lagrangian<N>, stages: usize, h: f64) -> (f64, f64, u64) {
        let start = PhasePoint::new(std::array::from_fn(|i| 1.2 * (i == 0) as u8 as f64), [0.0; N], 0.0);
        let problem = Problem::new(anharmonic, 0.0, start).unwrap();
        let mut run =
            GaussStepper::new(&problem, stages, h, StepperOptions { action: true, check_resolution: false }).unwrap();
        assert_eq!(run.route(), GaussRoute::Condensed);
        let steps = (100.0 / h).round() as usize;
        run.advance(steps).unwrap();
        let iterations = run.evaluations() as f64 / (stages * steps) as f64;
        (run.state().q[0], iterations, run.newton_steps())
    }

    /// The motion of one coordinate agrees with the same motion beside a second coordinate at rest, for which no secant
    /// steps are taken; it needs fewer iterations, and no more steps by Newton methods. The positions may differ by 500
    /// units of round-off after about a hundred oscillations.
    #[test]
    fn secants_spare_iterations_and_change_nothing() {
        let (alone, accompanied) = (OnLine::from(Anharmonic), InPlane::from(Anharmonic));
        for (stages, h, part) in [(8, 0.25, 0.9), (8, 0.5, 0.85), (16, 0.5, 0.9), (16, 1.0, 0.9)] {
            let ((q, iterations, newton), (beside, more, more_newton)) =
                (motion(&alone, stages, h), motion(&accompanied, stages, h));
            assert!((q - beside).abs() <= 500.0 * f64::EPSILON, "gauss_{stages}, h = {h}: {q:e}, {beside:e}");
            assert!(iterations <= part * more, "gauss_{stages}, h = {h}: {iterations}, {more} iterations");
            assert!(newton <= more_newton, "gauss_{stages}, h = {h}: {newton}, {more_newton} steps by Newton's method");
        }
    }
}
