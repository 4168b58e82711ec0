//! The motion between the ends of a step, as polynomials that resolve it.

use crate::gauss::{MAX_STAGES, curve_through};
use crate::integration::motion::{Motion, NearbyVelocity};
use crate::integration::{Piece, PieceStart};
use crate::run::discretization::Discretization;
use crate::{DenseStep, State, Stepper, StepperOptions, Vector};
use contact_geom::Structure;
use contact_geom::numbers::max_or_nan;

/// The smallest number of stages with which the collocation polynomial of a step itself is tried: with fewer it resolves the
/// motion only where the steps are far too short.
const MIN_STAGES: usize = 6;

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
/// The collocation polynomial of a step with s stages has order s between the ends, whose states have order 2s. Where it does
/// not resolve the motion, collocation with 2s + 1 stages, at most 16, does so from the start of the step, over the whole of it
/// or over equal parts. Polynomials are accepted where their errors, estimated from their last coefficients, are small compared
/// with the error of the step. That error, the difference of the two states at the end, is added with the factor `u^(p + 1)` at
/// the fraction u of the step, where p is the order: so a step of the same method that ends there differs from the motion, up
/// to the next order, and the curve is continuous.
pub(crate) struct ResolvedStep {
    parts: Parts,
    /// The time at the start, and the length.
    t: f64,
    length: f64,
    /// The difference of the step's end and that of the parts, and that of the logarithms of their conformal factors.
    difference: State,
    of_log_factor: f64,
    order: i32,
}

impl ResolvedStep {
    /// The state at a time in the step, and the conformal factor from its start.
    pub fn at(&self, t: f64) -> (State, f64) {
        let (curves, u) = (&self.parts.curves, (t - self.t) / self.length);
        let k = ((u * curves.len() as f64) as usize).min(curves.len() - 1);
        let (mut state, rho) = curves[k].state_and_rho(t);
        let share = u.powi(self.order + 1);
        let add = |to: &mut Vector, d: &Vector| to.iter_mut().zip(d).for_each(|(x, d)| *x += share * d);
        add(&mut state.q, &self.difference.q);
        add(&mut state.p, &self.difference.p);
        state.z += share * self.difference.z;
        (state, (self.parts.log_factors[k] - rho.ln() + share * self.of_log_factor).exp())
    }
}

/// Equal parts of a step.
struct Parts {
    curves: Vec<DenseStep>,
    /// The logarithm of the conformal factor at the start of each part, and at the end of the last.
    log_factors: Vec<f64>,
    end: State,
}

impl Parts {
    /// The curve of the last step of a stepper, without its action where that is not needed.
    fn curve(stepper: &dyn Stepper, with_action: bool) -> Option<DenseStep> {
        let without_action = if with_action { None } else { stepper.solved_stages().map(curve_through) };
        without_action.or_else(|| stepper.dense())
    }

    /// The last step of a stepper as a whole; its curve may be known.
    fn whole((stepper, known): (&dyn Stepper, Option<&DenseStep>), with_action: bool) -> Option<Self> {
        let log_factors = vec![0.0, stepper.sigma().ln()];
        let curve = known.cloned().or_else(|| Self::curve(stepper, with_action))?;
        Some(Parts { curves: vec![curve], log_factors, end: stepper.state() })
    }

    /// The next steps of a stepper.
    fn of_steps(stepper: &mut dyn Stepper, count: usize, with_action: bool) -> Option<Self> {
        let (mut curves, mut log_factors, mut log_factor) = (Vec::with_capacity(count), vec![0.0], 0.0);
        for _ in 0..count {
            stepper.advance(1).ok()?;
            curves.push(Self::curve(stepper, with_action)?);
            log_factor += stepper.sigma().ln();
            log_factors.push(log_factor);
        }
        Some(Parts { curves, log_factors, end: stepper.state() })
    }

    /// The difference of a state from that at the end.
    fn difference(&self, to: &State) -> State {
        State { q: &to.q - &self.end.q, p: &to.p - &self.end.p, z: to.z - self.end.z }
    }
}

/// The number of parts after a number of them whose error exceeds the bound by a factor, `None` beyond the most: the error
/// decreases as the power of their length that is the number of stages.
fn next_count(count: usize, excess: f64, stages: usize) -> Option<usize> {
    if count == 0 {
        return Some(1);
    }
    let predicted = count as f64 * excess.powf(1.0 / stages as f64);
    // Written so that a NaN is beyond it.
    let next =
        if predicted <= MAX_PARTS as f64 { (predicted.ceil() as usize).next_power_of_two() } else { return None };
    Some(next.max(2 * count)).filter(|next| *next <= MAX_PARTS)
}

impl<'p> Discretization<'p> {
    /// The motion between the ends of the last step of a stepper, which was not divided; `None` if the integrator is no
    /// collocation, if states within a step are to be computed by steps that end there, or if the motion is not resolved.
    pub fn resolve(
        &self,
        ends: (&(f64, State), &(f64, State)),
        step: (&dyn Stepper, Option<&DenseStep>),
        near: NearbyVelocity<'_>,
    ) -> Option<ResolvedStep> {
        let whole = || Parts::whole(step, self.follows_action(ends));
        self.resolve_between(ends, (&whole, true), [0.0, step.0.sigma().ln()], near)
    }

    /// The same for a piece of a step that was divided, with the conformal factor from the start of the step. After the zero of a
    /// switching function its own polynomial alone is tried: other steps would have to find the side of the motion again.
    pub fn resolve_piece(&self, piece: &Piece, near: NearbyVelocity<'_>) -> Option<ResolvedStep> {
        let Piece { from, to, log_factors: [before, after], dense, start } = piece;
        let whole = || {
            let curves = vec![dense.clone()?];
            Some(Parts { curves, log_factors: vec![0.0, after - before], end: to.1.clone() })
        };
        let is_divisible = matches!(start, PieceStart::Regular | PieceStart::Reset);
        self.resolve_between((from, to), (&whole, is_divisible), [*before, *after], near)
    }

    /// The motion between two states, of which a collocation polynomial may be known, with the logarithms of the conformal factor at
    /// both.
    fn resolve_between(
        &self,
        (from, to): (&(f64, State), &(f64, State)),
        (whole, is_divisible): (&dyn Fn() -> Option<Parts>, bool),
        [before, after]: [f64; 2],
        near: NearbyVelocity<'_>,
    ) -> Option<ResolvedStep> {
        let own = self.info.collocation.filter(|_| !self.needs.exact)?;
        let with_action = self.follows_action((from, to));
        let (stages, length) = ((2 * own + 1).min(MAX_STAGES), to.0 - from.0);
        // In transformed time its curve is no polynomial in t.
        let tries_own = own >= MIN_STAGES && !self.info.in_transformed_time;
        let mut found = if tries_own { whole() } else { None };
        // With the most stages the step itself is the first part.
        let mut count = usize::from(tries_own && own == MAX_STAGES);
        let mut v = None;
        loop {
            let excess = found.as_ref().map_or(f64::INFINITY, |parts| self.excess(parts, &to.1, with_action));
            if let Some(mut parts) = found.filter(|_| excess <= 1.0) {
                let of_log_factor = after - before - parts.log_factors.last()?;
                parts.log_factors.iter_mut().for_each(|factor| *factor += before);
                let (difference, order) = (parts.difference(&to.1), self.info.order as i32);
                return Some(ResolvedStep { parts, t: from.0, length, difference, of_log_factor, order });
            }
            if !is_divisible {
                return None;
            }
            count = next_count(count, excess, stages)?;
            if v.is_none() {
                v = Some(self.velocity(from.0, &from.1, near).ok()?);
            }
            found = Some(self.in_parts((stages, count), from, v.as_ref()?, length, with_action)?);
        }
    }

    /// Whether the action changes in a step: one that is not requested, and does not act on the motion, keeps its value.
    fn follows_action(&self, (from, to): (&(f64, State), &(f64, State))) -> bool {
        self.needs.action || to.1.z != from.1.z
    }

    /// Dense output of the last step of a stepper.
    pub fn curve(&self, ends: (&(f64, State), &(f64, State)), stepper: &dyn Stepper) -> Option<DenseStep> {
        Parts::curve(stepper, self.follows_action(ends))
    }

    /// The motion from a state by a number of stages in a number of equal parts.
    fn in_parts(
        &self,
        (stages, count): (usize, usize),
        from: &(f64, State),
        v: &Vector,
        length: f64,
        with_action: bool,
    ) -> Option<Parts> {
        let is_equal = (length - self.h).abs() <= 4.0 * f64::EPSILON * (from.0.abs() + length.abs());
        // The tables and the matrix of the separable route depend on the step size: they are computed once for equal steps.
        let claimed = self.problem.structure;
        let quadratic = claimed.quadratic && is_equal && self.pays_for_a_matrix(stages);
        let structure = Structure { quadratic, separable: claimed.separable && is_equal, ..claimed };
        let h = if is_equal { self.h } else { length } / count as f64;
        let mut kept = self.of_parts.take();
        let place = kept.iter().position(|(parts, _)| *parts == count).filter(|_| is_equal);
        let restarted = |mut stepper: Box<dyn Stepper + 'p>| {
            stepper.run_support_mut()?.restart(from.0, &from.1, v).then_some(stepper)
        };
        let mut stepper = match place.and_then(|place| restarted(kept.swap_remove(place).1)) {
            Some(stepper) => stepper,
            None => {
                let options = StepperOptions { undivided: true, stages: Some(stages), ..self.options(false) };
                self.integrator.stepper(&self.problem_at((from.0, &from.1), v, structure), h, options).ok()?
            }
        };
        let parts = Parts::of_steps(&mut *stepper, count, with_action);
        if is_equal {
            kept.push((count, stepper));
        }
        self.of_parts.replace(kept);
        parts
    }

    /// The largest error of the parts, in units of the largest one that is accepted.
    fn excess(&self, parts: &Parts, to: &State, with_action: bool) -> f64 {
        let State { q, p, z } = parts.difference(to);
        let of_step = [q.amax(), p.amax(), z.abs()].map(|error| MAX_SHARE * error);
        let tolerance = max_or_nan(ROUND_OFF, MAX_SHARE_OF_RUN * self.error.unwrap_or(0.0));
        let quantities = if with_action { 3 } else { 2 };
        parts.curves.iter().fold(0.0, |most, curve| {
            let errors = curve.truncation_errors();
            errors.iter().zip(of_step).take(quantities).fold(most, |most, ([error, size], of_step)| {
                if *error == 0.0 { most } else { max_or_nan(most, error / max_or_nan(of_step, tolerance * size)) }
            })
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

    /// A time that is before the end of a step by its round-off has the state there, bitwise.
    #[test]
    fn a_time_next_to_the_end_of_a_step() {
        let problem = Problem::new(&Pendulum { gamma: -0.1 }, 0.0, VelocityPoint::new([1.0], [0.7], 0.3)).unwrap();
        let at = |t: f64| {
            let mut rows = Rows::at([t]).unwrap();
            let run = problem.by(GaussCollocation { stages: 4 }).steps(Steps::Size(0.3)).observe(&mut rows);
            run.run(Until::Time(3.0)).unwrap();
            rows.rows.pop().unwrap().q[0]
        };
        let end: f64 = 7.0 * 0.3;
        assert_eq!(at(end.next_down()), at(end));
        assert_ne!(at(end - 1e-12), at(end));
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
