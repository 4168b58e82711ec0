//! Runs, their reference solutions, and the classification of their outcomes.

use crate::formula::Formula;
use contact_geom::nalgebra::SVector;
use contact_geom::{ChartVector, PhasePoint, VelocityPoint, legendre, numbers::max_or_nan, support::herglotz_rates};
use differential_equations::methods::ExplicitRungeKutta;
use differential_equations::prelude::{IVP, ODE};
use discrete_herglotz::{
    AnyIntegrator, InputError, Outcome, Run, SplittingScheme, Status, StepError, Steps, Until, rules::Method,
};
use exact_lagrangian::{ExactError, herglotz_flow};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// An error of order one.
pub const ORDER_ONE: f64 = 0.1;

/// A motion to be computed.
#[derive(Clone, Copy, Debug)]
pub struct Problem<const N: usize> {
    pub system: Formula<N>,
    pub t0: f64,
    pub start: VelocityPoint<N>,
    pub span: f64,
}

/// The same problem as a type of the library.
pub type Motion<'a, const N: usize> = discrete_herglotz::Problem<'a, Formula<N>, N>;

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RunEnd<const N: usize> {
    /// At the end of the span, without any report of a failure.
    Completed(PhasePoint<N>),
    /// At the end of the span, with a step that is flagged as unresolved.
    Unresolved(PhasePoint<N>),
    /// Before the end of the span, by a failed step.
    Failed(StepError),
    /// Not started: the input was refused.
    Refused(InputError),
    /// It panicked.
    Panicked,
}

/// The classification of an outcome.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    /// Within the bound.
    Right,
    /// Above the bound although each step resolves the motion: the accumulated error of a method of low order, for
    /// which the choice of the step is responsible.
    Coarse,
    /// Flagged as unresolved. This outcome and the two below are reported failures, whatever the error.
    Unresolved,
    Failed,
    Refused,
    /// Above the bound without any report, which must not happen.
    Wrong,
    /// A result that contains a NaN or an infinity.
    NonFinite,
    Panicked,
}

impl Verdict {
    /// Whether the outcome must never occur.
    pub fn is_failure(self) -> bool {
        matches!(self, Verdict::Wrong | Verdict::NonFinite | Verdict::Panicked)
    }

    pub fn name(self) -> &'static str {
        match self {
            Verdict::Right => "right",
            Verdict::Coarse => "coarse",
            Verdict::Unresolved => "marked",
            Verdict::Failed => "halted",
            Verdict::Refused => "refused",
            Verdict::Wrong => "wrong",
            Verdict::NonFinite => "not_a_number",
            Verdict::Panicked => "panicked",
        }
    }
}

impl<const N: usize> RunEnd<N> {
    /// The error of the final state against the reference, by [`distance`].
    pub fn error(&self, truth: &PhasePoint<N>, scale: f64) -> f64 {
        match self {
            RunEnd::Completed(state) | RunEnd::Unresolved(state) => distance(state, truth, scale),
            _ => f64::NAN,
        }
    }

    /// The classification of the outcome for a bound on the error.
    pub fn verdict(&self, truth: &PhasePoint<N>, scale: f64, bound: f64) -> Verdict {
        match self {
            RunEnd::Completed(state) | RunEnd::Unresolved(state) if !ChartVector::from(*state).is_finite() => {
                Verdict::NonFinite
            }
            RunEnd::Completed(state) if distance(state, truth, scale) <= bound => Verdict::Right,
            RunEnd::Completed(_) => Verdict::Wrong,
            RunEnd::Unresolved(_) => Verdict::Unresolved,
            RunEnd::Failed(_) => Verdict::Failed,
            RunEnd::Refused(_) => Verdict::Refused,
            RunEnd::Panicked => Verdict::Panicked,
        }
    }
}

/// The 2-norm of a vector, without overflow or underflow of the squares.
pub fn norm(entries: &[f64]) -> f64 {
    let size = contact_geom::numbers::max_abs_or_nan(entries.iter().copied());
    if size > 0.0 && size.is_finite() {
        size * entries.iter().map(|e| (e / size).powi(2)).sum::<f64>().sqrt()
    } else {
        size
    }
}

/// The 2-norm of the error of (q, p), relative to the norm of the reference or to `scale`, whichever is larger.
pub fn distance<const N: usize>(state: &PhasePoint<N>, truth: &PhasePoint<N>, scale: f64) -> f64 {
    let entries = |f: &dyn Fn(usize) -> f64| (0..2 * N).map(f).collect::<Vec<_>>();
    let (found, true_one) = (ChartVector::from(*state), ChartVector::from(*truth));
    let error = entries(&|i| found.component(i) - true_one.component(i));
    let size = norm(&entries(&|i| true_one.component(i)));
    let error = norm(&error);
    if error == 0.0 { 0.0 } else { error / size.max(scale) }
}

/// The result of a call, or `None` if it panics.
pub fn caught<T>(call: impl FnOnce() -> T) -> Option<T> {
    catch_unwind(AssertUnwindSafe(call)).ok()
}

impl<const N: usize> Problem<N> {
    /// The initial state.
    pub fn state(&self) -> PhasePoint<N> {
        legendre(&self.system, self.t0, &self.start)
    }

    /// The problem for the library, which may refuse the initial values.
    pub fn motion(&self) -> Result<Motion<'_, N>, InputError> {
        Motion::new(&self.system, self.t0, self.start)
    }

    /// The end of the runs.
    pub fn end(&self) -> Until {
        Until::Time(self.t0 + self.span)
    }

    /// The outcome of a run with a number of steps of one integrator.
    pub fn by(&self, integrator: AnyIntegrator, count: usize) -> RunEnd<N> {
        self.run(|motion| motion.by(integrator).steps(Steps::Count(count)))
    }

    /// The classification of a run with fixed steps, and its error. An error of order one without a report is coarse if
    /// every step has a smaller local error, and wrong otherwise.
    pub fn verdict(
        &self,
        integrator: AnyIntegrator,
        count: usize,
        truth: &PhasePoint<N>,
        scale: f64,
    ) -> (Verdict, f64) {
        let end = self.by(integrator, count);
        let (verdict, error) = (end.verdict(truth, scale, ORDER_ONE), end.error(truth, scale));
        let coarse =
            verdict == Verdict::Wrong && self.local_error(integrator, count, scale).is_some_and(|e| e <= ORDER_ONE);
        (if coarse { Verdict::Coarse } else { verdict }, error)
    }

    /// The largest local error of a run, where each step is compared with the exact motion from its own start; `None`
    /// where the exact motion is not known.
    fn local_error(&self, integrator: AnyIntegrator, count: usize, scale: f64) -> Option<f64> {
        let motion = self.motion().ok()?;
        let plan = motion.by(integrator).steps(Steps::Count(count)).plan(self.end()).ok()?;
        let mut stepper = plan.stepper().ok()?;
        let mut worst = 0.0;
        for _ in 0..count {
            let (before, t0): (PhasePoint<N>, f64) = (stepper.state().fixed(), stepper.time());
            stepper.advance(1).ok()?;
            let start = VelocityPoint { q: before.q, v: self.system.velocity(&before.q, &before.p), z: before.z };
            let exact = Problem { t0, start, span: plan.step_size(), ..*self }.exact().ok()?;
            worst = max_or_nan(worst, distance(&stepper.state().fixed(), &exact, scale));
            if worst > ORDER_ONE {
                break;
            }
        }
        Some(worst)
    }

    /// The outcome of a run to an accuracy, with the integrator that a run takes by default.
    pub fn to(&self, accuracy: f64) -> RunEnd<N> {
        self.run(|motion| motion.accuracy(accuracy))
    }

    /// The outcome of a run.
    fn run(&self, run_of: impl for<'p> FnOnce(&'p Motion<'p, N>) -> Run<'p, 'p, Motion<'p, N>>) -> RunEnd<N> {
        match caught(|| run_of(&self.motion()?).run(self.end())) {
            None => RunEnd::Panicked,
            Some(Err(refused)) => RunEnd::Refused(refused),
            Some(Ok(outcome)) => end_of_outcome(&outcome),
        }
    }

    /// The final state by the exact flow, in one call.
    pub fn exact(&self) -> Result<PhasePoint<N>, ExactError<N>> {
        self.exact_in(1)
    }

    /// The final state by the exact flow, restarted in each of `parts` equal parts of the span, so that no step of the
    /// flow is longer than a part.
    pub fn exact_in(&self, parts: usize) -> Result<PhasePoint<N>, ExactError<N>> {
        let (mut x, mut t) = (self.start, self.t0);
        for part in 1..=parts {
            let next = self.t0 + self.span * (part as f64 / parts as f64);
            x = herglotz_flow(&self.system, t, &x, next - t)?.end;
            t = next;
        }
        Ok(legendre(&self.system, t, &x))
    }
}

/// Converts an outcome of the library.
pub fn end_of_outcome<const N: usize>(outcome: &Outcome) -> RunEnd<N> {
    let state = outcome.state().fixed();
    match outcome.status {
        Status::Completed if outcome.unresolved.is_some() => RunEnd::Unresolved(state),
        Status::Completed => RunEnd::Completed(state),
        Status::Failed { cause, .. } => RunEnd::Failed(cause),
        _ => RunEnd::Unresolved(state),
    }
}

/// Herglotz' equations as a right-hand side for dop853, with `D = 2 N + 1` variables.
struct Equations<'a, const N: usize>(&'a Formula<N>);

impl<const N: usize, const D: usize> ODE<f64, [f64; D]> for Equations<'_, N> {
    fn diff(&self, t: f64, y: &[f64; D], rate: &mut [f64; D]) {
        let x = VelocityPoint { q: SVector::from_fn(|i, _| y[i]), v: SVector::from_fn(|i, _| y[N + i]), z: y[2 * N] };
        match herglotz_rates(self.0, t, &x) {
            Ok((field, _)) => {
                let field = ChartVector::from(VelocityPoint { q: x.v, v: field.y, z: field.z });
                *rate = std::array::from_fn(|i| field.component(i));
            }
            Err(_) => *rate = [f64::NAN; D],
        }
    }
}

/// The final state by dop853 of the crate differential-equations; `None` where it fails. `D = 2 N + 1`.
pub fn dop853<const N: usize, const D: usize>(
    problem: &Problem<N>,
    tolerance: f64,
    absolute: f64,
) -> Option<PhasePoint<N>> {
    let Problem { system, t0, start, span } = problem;
    let from = ChartVector::from(*start);
    let from: [f64; D] = std::array::from_fn(|i| from.component(i));
    let method = ExplicitRungeKutta::dop853().rtol(tolerance).atol(absolute).max_steps(10_000_000);
    let equations = Equations(system);
    let ivp = IVP::ode(&equations, *t0, t0 + span, from).t_eval([t0 + span]).method(method);
    let solution = caught(|| ivp.solve().ok()).flatten()?;
    let end = solution.y.last()?;
    let end = VelocityPoint::from(ChartVector::<N>::from_fn(|i| end[i]));
    Some(legendre(system, t0 + span, &end))
}

/// The same, restarted in each of `parts` equal parts of the span.
pub fn dop853_in<const N: usize, const D: usize>(
    problem: &Problem<N>,
    parts: usize,
    tolerance: f64,
    absolute: f64,
) -> Option<PhasePoint<N>> {
    let mut x = problem.state();
    for part in 0..parts {
        let [t0, t1] = [part, part + 1].map(|i| problem.t0 + problem.span * (i as f64 / parts as f64));
        let start = VelocityPoint { q: x.q, v: problem.system.velocity(&x.q, &x.p), z: x.z };
        x = dop853::<N, D>(&Problem { t0, start, span: t1 - t0, ..*problem }, tolerance, absolute)?;
    }
    Some(x)
}

/// A few integrators of every kind: discrete Lagrangians, splittings, a composition, Gauss methods of low to high
/// order.
pub const FAMILIES: [AnyIntegrator; 9] = [
    AnyIntegrator::Discrete(Method::Midpoint),
    AnyIntegrator::Discrete(Method::Trapezoidal),
    AnyIntegrator::Splitting(SplittingScheme::STRANG),
    AnyIntegrator::Splitting(SplittingScheme::BLANES_MOAN_6),
    AnyIntegrator::Splitting(SplittingScheme::KAHAN_LI_8),
    AnyIntegrator::Composition(Method::Midpoint, SplittingScheme::KAHAN_LI_8),
    AnyIntegrator::Gauss { stages: 2 },
    AnyIntegrator::Gauss { stages: 8 },
    AnyIntegrator::Gauss { stages: 16 },
];
