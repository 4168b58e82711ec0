//! The motion between the ends of a step, as polynomials that resolve it.

use crate::integration::motion::{Motion, NearbyVelocity};
use crate::run::discretization::Discretization;
use crate::{DenseStep, State, StepperOptions, Vector};
use contact_geom::Structure;
use contact_geom::numbers::max_or_nan;

/// The largest number of stages of a part. The next larger one than twice that of the step resolves the motion better than
/// the step does.
const MAX_STAGES: usize = 16;

/// The number of parts that is tried first, and the largest number of stages of the step for which it suffices in general:
/// the parts together have the order of the step at the distance of its nodes.
const FIRST_PARTS: [(usize, usize); 2] = [(8, 1), (16, 2)];

/// The largest number of parts. A motion that is not resolved by them is not smooth within the step.
const MAX_PARTS: usize = 16;

/// The largest error of the polynomials, relative to the error of the step.
const MAX_SHARE: f64 = 0.1;

/// The largest error of the polynomials, relative to the error of the run where one was requested.
const MAX_SHARE_OF_RUN: f64 = 0.01;

/// The relative round-off of the polynomials.
const ROUND_OFF: f64 = 8.0 * f64::EPSILON;

/// The motion between the ends of a step of collocation.
///
/// The collocation polynomial of a step with s stages has order s between the ends, whose states have order 2s. Here the
/// motion from the start of the step is that of collocation with more stages, or with shorter steps: these parts are
/// accepted where the last coefficients of their polynomials are small compared with the error of the step. That error,
/// the difference of the two states at the end, is added with the factor `u^(p + 1)` at the fraction u of the step, where p
/// is the order: so a step of the same method that ends there differs from the motion, up to the next order, and the curve is
/// continuous.
pub(crate) struct ResolvedStep {
    from: f64,
    length: f64,
    parts: Vec<DenseStep>,
    /// The logarithm of the conformal factor at the start of each part.
    log_factors: Vec<f64>,
    /// The difference of the step's end and that of the parts, and that of the logarithms of their conformal factors.
    difference: State,
    of_log_factor: f64,
    order: i32,
}

impl ResolvedStep {
    /// The state at a time in the step, and the conformal factor from its start.
    pub fn at(&self, t: f64) -> (State, f64) {
        let u = (t - self.from) / self.length;
        let k = ((u * self.parts.len() as f64) as usize).min(self.parts.len() - 1);
        let part = &self.parts[k];
        let (mut state, rho) = part.state_and_rho(t);
        let share = u.powi(self.order + 1);
        add(&mut state.q, &self.difference.q, share);
        add(&mut state.p, &self.difference.p, share);
        state.z += share * self.difference.z;
        (state, (self.log_factors[k] - rho.ln() + share * self.of_log_factor).exp())
    }
}

fn add(to: &mut [f64], difference: &[f64], factor: f64) {
    to.iter_mut().zip(difference).for_each(|(x, d)| *x += factor * d);
}

impl<'p> Discretization<'p> {
    /// The motion between the ends of a step that was not divided, with its conformal factor; `None` if the integrator is no
    /// collocation, if states within a step are to be computed by steps that end there, or if the motion is not resolved.
    pub fn resolve(
        &self,
        (from, to): (&(f64, State), &(f64, State)),
        sigma: f64,
        near: NearbyVelocity<'_>,
    ) -> Option<ResolvedStep> {
        let stages = self.info.collocation.filter(|_| !self.needs.exact)?;
        let mut count = FIRST_PARTS.iter().find(|(most, _)| stages <= *most)?.1;
        let v = self.velocity(from.0, &from.1, near).ok()?;
        let stages = (2 * stages + 1).min(MAX_STAGES);
        loop {
            let found = self.in_parts((stages, count), (from, to), &v, sigma);
            if found.is_some() || count >= MAX_PARTS {
                return found;
            }
            count *= 2;
        }
    }

    /// The motion by a number of stages in a number of parts, if they resolve it.
    fn in_parts(
        &self,
        (stages, count): (usize, usize),
        (from, to): (&(f64, State), &(f64, State)),
        v: &Vector,
        sigma: f64,
    ) -> Option<ResolvedStep> {
        let (length, start) = (to.0 - from.0, (from.0, &from.1));
        let is_equal = (length - self.h).abs() <= 4.0 * f64::EPSILON * (from.0.abs() + to.0.abs());
        // The double-double tables of the separable route depend on the step size: they are computed once for equal steps.
        let claimed = self.problem.structure;
        let quadratic = claimed.quadratic && is_equal && self.pays_for_a_matrix(stages);
        let structure = Structure { quadratic, separable: claimed.separable && is_equal, ..claimed };
        let mut kept = self.of_parts.take();
        let of_count = kept.iter().position(|(parts, _)| *parts == count && is_equal).map(|i| kept.swap_remove(i));
        let kept_stepper = of_count
            .and_then(|(_, mut stepper)| stepper.run_support_mut()?.restart(from.0, &from.1, v).then_some(stepper));
        let mut stepper = match kept_stepper {
            Some(stepper) => stepper,
            None => {
                let h = if is_equal { self.h } else { length } / count as f64;
                let options = StepperOptions { undivided: true, ..self.options(false) };
                let problem = self.problem_at(start, v, structure);
                self.integrator.stepper_with_stages(&problem, stages, h, options).ok()??
            }
        };
        let (mut parts, mut log_factors, mut log_factor) = (Vec::with_capacity(count), Vec::with_capacity(count), 0.0);
        for _ in 0..count {
            stepper.advance(1).ok()?;
            parts.push(stepper.dense()?);
            log_factors.push(log_factor);
            log_factor += stepper.sigma().ln();
        }
        let end = stepper.state();
        if is_equal {
            kept.push((count, stepper));
        }
        self.of_parts.replace(kept);
        let difference = State { q: &to.1.q - &end.q, p: &to.1.p - &end.p, z: to.1.z - end.z };
        let [q, p, z] = [difference.q.amax(), difference.p.amax(), difference.z.abs()].map(|d| MAX_SHARE * d);
        let tolerance = max_or_nan(ROUND_OFF, MAX_SHARE_OF_RUN * self.error.unwrap_or(0.0));
        let follows_z = self.needs.action || to.1.z != from.1.z;
        let is_resolved = parts.iter().all(|part| {
            let errors = part.truncation_errors();
            let bounds = [q, p, if follows_z { z } else { f64::INFINITY }];
            // Written so that a NaN is not resolved.
            errors.iter().zip(bounds).all(|([error, size], bound)| *error <= max_or_nan(bound, tolerance * size))
        });
        if !is_resolved {
            return None;
        }
        let of_log_factor = sigma.ln() - log_factor;
        Some(ResolvedStep {
            from: from.0,
            length,
            parts,
            log_factors,
            difference,
            of_log_factor,
            order: self.info.order as i32,
        })
    }
}

#[cfg(test)]
mod tests {
    use crate::test_lagrangians::OnLine;
    use crate::{GaussCollocation, Problem, Rows, Steps, Until};
    use contact_examples::systems::{DoublePendulum, HarmonicOscillator, Pendulum, QuadraticInZ, System};
    use contact_geom::numbers::max_or_nan;
    use contact_geom::{Lagrangian, VelocityPoint};

    const FRACTIONS: [f64; 6] = [0.04, 0.3, 0.5, 0.77, 0.99, 1.0];

    /// The states at the fractions of a span, each as one list of numbers.
    fn states<L: Lagrangian<1>>(lagrangian: &L, span: f64, stages: usize, count: usize, exact: bool) -> Vec<[f64; 4]> {
        let problem = Problem::new(lagrangian, 0.5, VelocityPoint::new([1.0], [0.7], 0.3)).unwrap();
        let mut rows = Rows::at(FRACTIONS.map(|u| 0.5 + u * span)).unwrap().with_conformal_factor();
        let run = problem.by(GaussCollocation { stages }).steps(Steps::Count(count)).observe(&mut rows);
        let run = if exact { run.with_exact_states() } else { run };
        run.run(Until::After(span)).unwrap();
        rows.rows.iter().map(|row| [row.q[0], row.p[0], row.z.unwrap(), row.log_factor.unwrap()]).collect()
    }

    fn distance(a: &[f64; 4], b: &[f64; 4]) -> f64 {
        a.iter().zip(b).fold(0.0, |most, (a, b)| max_or_nan(most, (a - b).abs()))
    }

    /// Between the ends of a step the error is at most that at its end, and for short steps the states are those of steps that
    /// end there, up to a part of it. The tolerance is the round-off of 33 evaluations with terms of size 1.
    fn check<L: Lagrangian<1>>(lagrangian: &L, name: &str) {
        let floor = 64.0 * f64::EPSILON;
        for stages in 1..=16 {
            for span in [0.02, 0.2, 0.8, -0.8, 2.0, 4.0] {
                let motion = states(lagrangian, span, 12, 64, true);
                let found = states(lagrangian, span, stages, 1, false);
                let steps = states(lagrangian, span, stages, 1, true);
                let at_end = distance(&found[5], &motion[5]);
                for i in 0..5 {
                    let (error, off) = (distance(&found[i], &motion[i]), distance(&found[i], &steps[i]));
                    assert!(error <= 1.2 * at_end + floor, "{name}, {stages}, {span}: {error:e} of {at_end:e}");
                    let most = if span.abs() < 1.0 { 0.2 * at_end } else { at_end } + floor;
                    assert!(off <= most, "{name}, {stages}, {span}: {off:e} from a step, of {at_end:e}");
                }
            }
        }
    }

    #[test]
    fn states_within_a_step_are_as_accurate_as_at_its_end() {
        check(&OnLine::from(Pendulum { gamma: -0.1 }), "pendulum");
        check(&OnLine::from(QuadraticInZ::default()), "quadratic in z");
    }

    /// A state between the ends of a step does not depend on the rows before it, bitwise, though the stepper of the parts is
    /// kept from step to step.
    #[test]
    fn a_row_does_not_depend_on_other_rows() {
        fn check<L: Lagrangian<N>, const N: usize>(lagrangian: &L, start: VelocityPoint<N>) {
            let problem = Problem::new(lagrangian, 0.0, start).unwrap();
            for stages in [3, 8, 16] {
                let last = |times: &[f64]| {
                    let mut rows = Rows::at(times.iter().copied()).unwrap().with_conformal_factor();
                    let run = problem.by(GaussCollocation { stages }).steps(Steps::Size(0.1)).observe(&mut rows);
                    run.run(Until::Time(10.0)).unwrap();
                    rows.rows.pop().unwrap()
                };
                let times: Vec<f64> = (0..40).map(|k| 0.25 * f64::from(k) + 0.01).collect();
                assert_eq!(last(&times), last(&times[39..]), "{stages}");
            }
        }
        let (start, double) = (VelocityPoint::new([1.0], [0.7], 0.3), DoublePendulum::default());
        check(&Pendulum { gamma: -0.1 }, start);
        check(&QuadraticInZ::default(), start);
        check(&HarmonicOscillator { gamma: -0.1 }, start);
        check(&double, double.initial());
    }
}
