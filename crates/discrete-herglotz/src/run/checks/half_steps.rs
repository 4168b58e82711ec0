//! Comparison of steps with twice as many steps of half their size: whether given steps resolve the motion.

use crate::resolution::monitor::rounding;
use crate::resolution::thresholds::{FIRST_ORDER_STEPS, MAX_HALF_STEP_DIFFERENCE, MIN_RELATIVE_DISPLACEMENT};
use crate::run::discretization::Discretization;
use crate::{Problem, integration::SuspectInterval, theory::legendre_inverse};
use contact_geom::nalgebra::SVector;
use contact_geom::{
    Lagrangian, PhasePoint, VelocityPoint,
    numbers::{max_abs_or_nan, max_or_nan},
};

impl<L: Lagrangian<N>, const N: usize> Discretization<'_, L, N> {
    /// The defect of some steps, above one if they do not resolve the motion. `None` if no comparison is possible.
    pub(crate) fn half_step_defect(
        &self,
        SuspectInterval { steps, t, from, to, .. }: &SuspectInterval<N>,
    ) -> Option<f64> {
        let Problem { lagrangian, start, .. } = *self.problem;
        let end = t + *steps as f64 * self.h;
        // If several velocities have the same momentum, the mean velocity selects that of the motion.
        let mean = (to.q - from.q) / (end - t);
        let guess = if self.problem.structure.constant_mass { start.v } else { mean };
        let VelocityPoint { v, .. } = legendre_inverse(lagrangian, *t, from, &guess).ok()?;
        let at_end = |x: &PhasePoint<N>| legendre_inverse(lagrangian, end, x, &v).map(|x| x.v).ok();
        if self.info.in_transformed_time {
            return None;
        }
        let Ok(fine) = self.advanced((*t, from), &v, 0.5 * self.h, (2 * steps, end), |_| ()) else {
            // Where shorter steps fail, a longer step should not succeed.
            return Some(f64::INFINITY);
        };
        let fine = fine.state();
        let (coarse_v, fine_v) = (at_end(to)?, at_end(&fine)?);
        let size = |x: [&SVector<f64, N>; 3]| max_abs_or_nan(x.into_iter().flat_map(|x| x.iter().copied()));
        let apart = |a: &SVector<f64, N>, b: &SVector<f64, N>| max_abs_or_nan((a - b).iter().copied());
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
    use crate::{GaussCollocation, Plan, Problem, Stepper, Steps, Until};
    use contact_geom::nalgebra::SVector;
    use contact_geom::{Lagrangian, Scalar, Structure, VelocityPoint};

    /// Oscillators with drag, of frequencies 1, 2 .. N: `v.v/2 - (k x_k)^2/2 - z/10`.
    struct Oscillators;

    impl<const N: usize> Lagrangian<N> for Oscillators {
        fn value<T: Scalar>(&self, _t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
            (0..N).fold(-z * 0.1, |l, k| l + (v[k] * v[k] - q[k] * q[k] * ((k + 1) as f64).powi(2)) * 0.5)
        }
        fn structure(&self) -> Structure {
            Structure {
                autonomous: true,
                separable: true,
                quadratic: true,
                z_affine: true,
                constant_rate: true,
                constant_mass: true,
                ..Structure::default()
            }
        }
    }

    const H: f64 = 0.0625;

    /// The plan of a number of steps from `q = 1, v = 0`.
    fn plan<'a, const N: usize>(
        problem: &'a Problem<'a, Oscillators, N>,
        stages: usize,
        steps: usize,
    ) -> Plan<'a, Oscillators, N> {
        let run = problem.by(GaussCollocation { stages }).steps(Steps::Size(H));
        run.plan(Until::Time(H * steps as f64)).unwrap()
    }

    fn problem<const N: usize>() -> Problem<'static, Oscillators, N> {
        Problem::new(&Oscillators, 0.0, VelocityPoint::new([1.0; N], [0.0; N], 0.0)).unwrap()
    }

    /// Whether a stepper multiplies by one matrix: it then makes no evaluations.
    fn by_one_matrix<const N: usize>(mut stepper: Box<dyn Stepper<N> + '_>) -> bool {
        stepper.advance(1).unwrap();
        stepper.evaluations() == 0
    }

    /// The matrix of a linear motion is computed for many steps of one size, but not for a single step of another size,
    /// as at the time of a row or of an event.
    #[test]
    fn a_step_of_another_length_makes_no_matrix() {
        let problem = problem::<2>();
        let plan = plan(&problem, 8, 100);
        assert!(by_one_matrix(plan.stepper().unwrap()));
        for h in [0.3 * H, -0.5 * H] {
            let part = plan.steps.advanced((0.0, &problem.state), &problem.start.v, h, (1, h), |_| ()).unwrap();
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

    /// The matrix is not computed for so few steps that it costs more than it saves: with 96 unknowns it takes as long
    /// as about a thousand steps, with half as many unknowns an eighth of that.
    #[test]
    fn a_few_steps_of_many_coordinates_make_no_matrix() {
        let problem = problem::<6>();
        for (steps, stages, expected) in [(500, 16, false), (1000, 16, true), (50, 8, false), (200, 8, true)] {
            let plan = plan(&problem, stages, steps);
            assert_eq!(by_one_matrix(plan.stepper().unwrap()), expected, "{steps} steps of {stages} stages");
        }
    }

    /// An oscillator in two nearly dependent coordinates: the mass matrix and the stiffness matrix have condition
    /// number 1e10.
    struct NearlyOne;

    impl Lagrangian<2> for NearlyOne {
        fn value<T: Scalar>(&self, t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
            let turned = |x: &SVector<T, 2>| {
                let (sin, cos) = 0.6f64.sin_cos();
                SVector::from([x[0] * cos + x[1] * sin, (x[1] * cos - x[0] * sin) * 1e-5])
            };
            Oscillators.value(t, &turned(q), &turned(v), z) + turned(q)[1] * turned(q)[1] * 1.5
        }
        fn structure(&self) -> Structure {
            Lagrangian::<2>::structure(&Oscillators)
        }
    }

    /// The stage equations of such a motion cannot be solved without the matrix: the comparison with half steps, and
    /// the states within a step, use it too.
    #[test]
    fn an_ill_conditioned_mass_matrix_is_no_flaw_of_the_steps() {
        let start = VelocityPoint::new([1.0, -0.4], [0.3, 0.8], 0.0);
        let problem = Problem::new(&NearlyOne, 0.0, start).unwrap();
        for stages in [1, 2] {
            let run = problem.by(GaussCollocation { stages }).steps(Steps::Count(64));
            assert_eq!(run.run(Until::Time(4.0)).unwrap().unresolved, None, "{stages} stages");
            let plan = problem.by(GaussCollocation { stages }).steps(Steps::Count(64)).plan(Until::Time(4.0)).unwrap();
            let part = plan.steps.advanced((0.0, &problem.state), &start.v, 0.03, (1, 0.03), |_| ()).unwrap();
            // A whole step of the same size, to the round-off amplified by the inverse of the mass matrix.
            let mut whole = problem.by(GaussCollocation { stages }).steps(Steps::Count(1));
            whole = whole.without_action();
            let whole = whole.run(Until::Time(0.03)).unwrap();
            assert!((part.state().q - whole.q).norm() <= 1e10 * 8.0 * f64::EPSILON);
        }
    }
}
