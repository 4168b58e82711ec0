//! Named times of kinks and jumps.

use crate::common::draws::Draws;
use crate::lagrangians::SwitchingOne;
use contact_geom::switching::Breaks;
use contact_geom::{Lagrangian, Scalar, VelocityPoint, nalgebra::SVector};
use discrete_herglotz::{AnyIntegrator, Problem, Status, Steps, Until};

/// An oscillator with a force that is `push` between two times.
#[derive(Clone, Copy)]
pub struct Pushed {
    from: f64,
    to: f64,
    push: f64,
}

impl Lagrangian<1> for Pushed {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        let (zero, push) = (T::zero(), T::from(self.push));
        let force = t.if_less(T::from(self.from), zero, t.if_less(T::from(self.to), push, zero));
        v[0] * v[0] * 0.5 - q[0] * q[0] * 0.5 + q[0] * force
    }
}

impl Pushed {
    /// From rest at t = 0: `q = push (cos(t - to) - cos(t - from))` after the push.
    fn exact(&self, t: f64) -> f64 {
        self.push * (f64::cos(if self.to < t { t - self.to } else { 0.0 }) - f64::cos(t - self.from))
    }
    fn breaking(self) -> SwitchingOne {
        Breaks::new(self, vec![self.from, self.to]).unwrap().into()
    }
}

#[test]
fn every_integrator_ends_its_steps_on_named_times() {
    let pushed = Pushed { from: 0.75, to: 1.33, push: 1.0 };
    let problem_of = pushed.breaking();
    let problem = Problem::new(&problem_of, 0.0, VelocityPoint::new([0.0], [0.0], 0.0)).unwrap();
    for name in ["rectangle", "midpoint", "trapezoidal", "gauss_1", "gauss_2", "gauss_8", "divided_gauss_4_1e-6"] {
        let integrator: AnyIntegrator = name.parse().unwrap();
        let order = match name {
            "rectangle" => 1,
            "gauss_2" => 4,
            "gauss_8" | "divided_gauss_4_1e-6" => 8,
            _ => 2,
        };
        let error = |count: usize| {
            let outcome = problem.by(integrator).steps(Steps::Count(count)).run(Until::Time(2.0)).unwrap();
            assert_eq!(outcome.status, Status::Completed, "{name}");
            (outcome.q[0] - pushed.exact(2.0)).abs()
        };
        let (coarse, fine) = (error(32), error(64));
        // The parts before and after a break are not half as long in half the steps: a factor of two.
        assert!(fine <= 2.0 * coarse / f64::powi(2.0, order) + 1e-14, "{name}: {coarse:e} {fine:e}");
    }
}

/// A pulse of a ten-thousandth of the span is met to 1e-12, wherever it is, forward and backward in time, without a search.
#[test]
fn short_pulses_at_named_times_are_met() {
    for case in 0..334 {
        let draws = &mut Draws::of(case);
        let from = draws.between(0.0, 9.9);
        let pushed = Pushed { from, to: from + 1e-3, push: 100.0 };
        let problem_of = pushed.breaking();
        let problem = Problem::new(&problem_of, 0.0, VelocityPoint::new([0.0], [0.0], 0.0)).unwrap();
        let outcome = problem.accuracy(1e-12).run(Until::Time(10.0)).unwrap();
        assert!(
            (outcome.q[0] - pushed.exact(10.0)).abs() <= 1e-12,
            "case {case}: {:e}",
            outcome.q[0] - pushed.exact(10.0)
        );
        assert_eq!(outcome.unresolved, None, "case {case}");
        let end = VelocityPoint { q: outcome.q.fixed(), v: outcome.v.unwrap().fixed(), z: 0.0 };
        let back = Problem::new(&problem_of, 10.0, end).unwrap();
        let back = back.by(AnyIntegrator::Gauss { stages: 8 }).steps(Steps::Count(20));
        let back = back.run(Until::Time(0.0)).unwrap();
        assert!(back.q[0].abs() <= 1e-11, "case {case}: {:e}", back.q[0]);
    }
}

/// Times outside of the span and on its ends change nothing.
#[test]
fn times_beyond_the_run_are_ignored() {
    let pushed = Pushed { from: -1.0, to: 5.0, push: 1.0 };
    let outcome_with = |times: Vec<f64>| {
        let problem_of = SwitchingOne::from(Breaks::new(pushed, times).unwrap());
        let problem = Problem::new(&problem_of, 0.0, VelocityPoint::new([0.0], [0.0], 0.0)).unwrap();
        problem.by(AnyIntegrator::Gauss { stages: 3 }).steps(Steps::Count(8)).run(Until::Time(4.0)).unwrap()
    };
    let (with, without) = (outcome_with(vec![-1.0, 0.0, 4.0, 5.0]), outcome_with(vec![]));
    assert_eq!((with.q, with.p, with.steps), (without.q, without.p, without.steps));
}
