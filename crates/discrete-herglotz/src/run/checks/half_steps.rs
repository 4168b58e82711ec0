//! Comparison of steps with twice as many steps of half their size: whether given steps resolve the motion.

use crate::integration::{SuspectInterval, SystemProblem};
use crate::resolution::monitor::rounding;
use crate::resolution::thresholds::{FIRST_ORDER_STEPS, MAX_HALF_STEP_DIFFERENCE, MIN_RELATIVE_DISPLACEMENT};
use crate::run::discretization::Discretization;
use crate::{State, Vector};
use contact_geom::numbers::{max_abs_or_nan, max_or_nan};

impl Discretization<'_> {
    /// The defect of some steps, above one if they do not resolve the motion. `None` if no comparison is possible.
    pub(crate) fn half_step_defect(&self, SuspectInterval { steps, t, from, to, .. }: &SuspectInterval) -> Option<f64> {
        let SystemProblem { start, structure, .. } = &self.problem;
        let end = t + *steps as f64 * self.h;
        // If several velocities have the same momentum, the mean velocity selects that of the motion.
        let mean = (&to.q - &from.q) / (end - t);
        let guess = if structure.constant_mass { &start.v } else { &mean };
        let v = self.velocity_near(*t, from, guess).ok()?;
        let at_end = |x: &State| self.velocity_near(end, x, &v).ok();
        if self.info.in_transformed_time {
            return None;
        }
        let Ok(fine) = self.advanced((*t, from), &v, 0.5 * self.h, (2 * steps, end), |_| ()) else {
            // Where shorter steps fail, a longer step should not succeed.
            return Some(f64::INFINITY);
        };
        let fine = fine.state();
        let (coarse_v, fine_v) = (at_end(to)?, at_end(&fine)?);
        let size = |x: [&Vector; 3]| max_abs_or_nan(x.into_iter().flat_map(|x| x.iter().copied()));
        let apart = |a: &Vector, b: &Vector| (a - b).amax();
        let relative = |apart: f64, size: f64| if apart == 0.0 { 0.0 } else { apart / size };
        // After n steps from rest, the error of a method of order one is the displacement divided by n.
        let moved =
            if self.info.order == 1 { FIRST_ORDER_STEPS * size([&coarse_v, &fine_v, &v]) * self.h.abs() } else { 0.0 };
        let width =
            max_or_nan(max_or_nan(size([&from.q, &to.q, &fine.q]), moved), rounding(&start.q, &start.v, self.h));
        let of_v = apart(&coarse_v, &fine_v);
        let of_v = if of_v * self.h.abs() > MIN_RELATIVE_DISPLACEMENT * width {
            relative(of_v, size([&v, &coarse_v, &fine_v]))
        } else {
            0.0
        };
        Some(max_or_nan(relative(apart(&to.q, &fine.q), width), of_v) / MAX_HALF_STEP_DIFFERENCE)
    }
}

#[cfg(test)]
mod tests {
    use crate::test_lagrangians::{InPlane, NearlyOne, Oscillators};
    use crate::{GaussCollocation, InputError, Integrator, MethodInfo, Plan, Problem, Stepper, StepperOptions};
    use crate::{Steps, Until};
    use contact_geom::VelocityPoint;

    const H: f64 = 0.0625;

    /// The plan of a number of steps from `q = 1, v = 0`.
    fn plan<'a>(
        problem: &'a Problem<'a, InPlane, 2>,
        integrator: impl Integrator<'a, InPlane, 2> + 'a,
        steps: usize,
    ) -> Plan<'a> {
        problem.by(integrator).steps(Steps::Size(H)).plan(Until::Time(H * steps as f64)).unwrap()
    }

    fn problem() -> Problem<'static, InPlane, 2> {
        let start = VelocityPoint::new([1.0; 2], [0.0; 2], 0.0);
        Problem::new(&InPlane::Oscillators(Oscillators), 0.0, start).unwrap()
    }

    /// Whether a stepper multiplies by one matrix: it then makes no evaluations.
    fn by_one_matrix(mut stepper: Box<dyn Stepper + '_>) -> bool {
        stepper.advance(1).unwrap();
        stepper.evaluations() == 0
    }

    /// The matrix of a linear motion is computed for many steps of one size, but not for a single step of another size,
    /// as at the time of a row or of an event.
    #[test]
    fn a_step_of_another_length_makes_no_matrix() {
        let problem = problem();
        let plan = plan(&problem, GaussCollocation { stages: 8 }, 100);
        assert!(by_one_matrix(plan.stepper().unwrap()));
        let (from, v) = (problem.state.into(), problem.start.v.into());
        for h in [0.3 * H, -0.5 * H] {
            let part = plan.steps.advanced((0.0, &from), &v, h, (1, h), |_| ()).unwrap();
            assert!(part.evaluations() > 0);
            // x = e^(-t/20) (cos w t + sin w t / (20 w)), w^2 = k^2 - 1/400; to round-off, of ten terms.
            let (t, state) = (h, part.state());
            for k in 0..2 {
                let w = (((k + 1) * (k + 1)) as f64 - 0.0025f64).sqrt();
                let exact = (-0.05 * t).exp() * ((w * t).cos() + 0.05 * (w * t).sin() / w);
                assert!((state.q[k] - exact).abs() <= 10.0 * f64::EPSILON, "{h}: {:e}, {exact:e}", state.q[k]);
            }
        }
    }

    /// Collocation with eight stages that states another number of them: with two coordinates it has as many unknowns as
    /// one with more coordinates.
    struct Stating {
        stages: usize,
    }

    impl<'a> Integrator<'a, InPlane, 2> for Stating {
        fn info(&self) -> MethodInfo {
            MethodInfo { collocation: Some(self.stages), ..MethodInfo::of_discrete::<2>("stating", 16) }
        }
        fn check(&self, _: &InPlane) -> Result<(), InputError> {
            Ok(())
        }
        fn stepper(
            &self,
            problem: &Problem<'a, InPlane, 2>,
            h: f64,
            options: StepperOptions,
        ) -> Result<Box<dyn Stepper + 'a>, InputError> {
            GaussCollocation { stages: 8 }.stepper(problem, h, options)
        }
    }

    /// The matrix is not computed for so few steps that it costs more than it saves: with 96 unknowns it takes as long
    /// as about a thousand steps, with half as many unknowns an eighth of that.
    #[test]
    fn a_few_steps_with_many_unknowns_make_no_matrix() {
        let problem = problem();
        for (steps, stages, expected) in [(500, 48, false), (1000, 48, true), (50, 24, false), (200, 24, true)] {
            let plan = plan(&problem, Stating { stages }, steps);
            assert_eq!(by_one_matrix(plan.stepper().unwrap()), expected, "{steps} steps of {stages} stages");
        }
    }

    /// The stage equations of a motion with an ill-conditioned mass matrix cannot be solved without the matrix: the
    /// comparison with half steps, and the states within a step, use it too.
    #[test]
    fn an_ill_conditioned_mass_matrix_is_no_flaw_of_the_steps() {
        let start = VelocityPoint::new([1.0, -0.4], [0.3, 0.8], 0.0);
        let system = InPlane::from(NearlyOne);
        let problem = Problem::new(&system, 0.0, start).unwrap();
        for stages in [1, 2] {
            let run = problem.by(GaussCollocation { stages }).steps(Steps::Count(64));
            assert_eq!(run.run(Until::Time(4.0)).unwrap().unresolved, None, "{stages} stages");
            let plan = problem.by(GaussCollocation { stages }).steps(Steps::Count(64)).plan(Until::Time(4.0)).unwrap();
            let (from, v) = (problem.state.into(), start.v.into());
            let part = plan.steps.advanced((0.0, &from), &v, 0.03, (1, 0.03), |_| ()).unwrap();
            // A whole step of the same size, to the round-off amplified by the inverse of the mass matrix.
            let mut whole = problem.by(GaussCollocation { stages }).steps(Steps::Count(1));
            whole = whole.without_action();
            let whole = whole.run(Until::Time(0.03)).unwrap();
            assert!((part.state().q - whole.q).norm() <= 1e10 * 8.0 * f64::EPSILON);
        }
    }
}
