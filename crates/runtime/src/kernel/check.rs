//! The steps of a motion as maps: contact defects, Herglotz defects and residuals of the theorems.

use super::formula_system::FormulaSystem;
use super::sized::{Sized, coordinates};
use super::theorems::{Points, theorems};
use crate::{
    Check, Interrupt, MomentumSample, Motion, NotContact, Plan, RuntimeError, Sample, StatementResidual, StepControl,
};
use contact_geom::{
    ChartVector, Lagrangian, OneParameterGroup, PhasePoint, Statement,
    numbers::{max_abs_or_nan, max_or_nan},
};
use discrete_herglotz::{
    AnyIntegrator, InputError, Observer, Problem, Run, Start, StepView, Steps, Stop, Until, gauss::VirtualWork,
    hamiltonian, hamiltonian::ModifiedDefect, theory::legendre_inverse,
};
use formula_lagrangian::FormulaLagrangian;
use std::ops::ControlFlow;

/// The distance of the finite differences, relative to the size of a state: it balances their truncation error, of
/// sixth order, and round-off divided by the distance.
const RELATIVE_DISTANCE: f64 = 1e-3;

/// The number of samples at which the theorems are evaluated: few, since second derivatives of second derivatives are
/// expensive.
const THEOREM_SAMPLES: usize = 3;

/// The number of steps between two polls of the interrupt: a poll is then inexpensive compared with the steps.
const STEPS_BETWEEN_POLLS: usize = 256;

/// The number of steps of a motion whose modified Hamiltonians are compared.
const MODIFIED_STEPS: f64 = 256.0;

/// The number of stages of the discrete Lagrangian for the theorems, where the integrator of the motion is not a
/// collocation method: order 8.
const DEFAULT_STAGES: usize = 4;

/// The theorems are given up when the step has been halved six times without a discrete Lagrangian for its two points.
const MAX_STEP_DIVISION: f64 = 64.0;

/// The number of stages of collocation that stands for the most accurate method with constraints, of order 14.
const MOST_STAGES_WITH_CONSTRAINTS: usize = 7;

/// A sample of a motion: the time, the state, and the logarithm of the conformal factor.
type State<const N: usize> = (f64, PhasePoint<N>, f64);

/// The steps of a map: the integrator, or `None` for that which the constraints choose, the length of a step, and the
/// number of steps.
type MapOfSteps = (Option<AnyIntegrator>, f64, usize);

/// The run of a number of steps by an integrator, or by the one for the constraints.
fn run_by<'p, 'o, L: FormulaSystem<N>, const N: usize>(
    problem: &'p Problem<'p, L, N>,
    by: Option<AnyIntegrator>,
    count: usize,
) -> Result<Run<'p, 'o, Problem<'p, L, N>>, RuntimeError> {
    Ok(match (problem.lagrangian().constrained(by)?, by) {
        (Some(method), _) => problem.by(method).steps(Steps::Count(count)),
        (None, Some(by)) => problem.by(L::by(by)?).steps(Steps::Count(count)),
        (None, None) => problem.steps(Steps::Count(count)),
    })
}

/// The start, the end and the conformal factor of a map at a state, which is first moved to the constraints, if there are
/// any.
fn mapped<L: FormulaSystem<N>, const N: usize>(
    lagrangian: &L,
    (by, h, count): MapOfSteps,
    t: f64,
    from: &PhasePoint<N>,
) -> Result<([PhasePoint<N>; 2], f64), RuntimeError> {
    let mut problem = Problem::new(lagrangian, t, Start::from(*from))?;
    if lagrangian.formula().constraints() > 0 {
        problem = Problem::new(lagrangian, t, lagrangian.projected(t, *problem.start())?)?;
    }
    let plan = run_by(&problem, by, count)?.plan(Until::After(h))?;
    let mut stepper = plan.stepper()?;
    stepper.advance(count).map_err(|failure| failure.cause)?;
    Ok(([*problem.state(), stepper.state().fixed()], stepper.sigma()))
}

/// The state after a time h in `count` steps, and the conformal factor of the last step.
fn step<L: FormulaSystem<N>, const N: usize>(
    lagrangian: &L,
    map: MapOfSteps,
    t: f64,
    from: &PhasePoint<N>,
) -> Result<(PhasePoint<N>, f64), RuntimeError> {
    let ([_, end], sigma) = mapped(lagrangian, map, t, from)?;
    Ok((end, sigma))
}

/// The distance of the pullback of `dz - p dq` by a step from `sigma (dz - p dq)`, relative to its size: by derivatives
/// along curves of starts. With constraints these are curves in T\*N x R, whose tangent vectors are all of them.
fn contact_defect<L: FormulaSystem<N>, const N: usize>(
    lagrangian: &L,
    map: MapOfSteps,
    t: f64,
    at: &PhasePoint<N>,
) -> Result<f64, RuntimeError> {
    let center = ChartVector::from(*at);
    let ([from, end], sigma) = mapped(lagrangian, map, t, at)?;
    let size = |x: f64| if x > 0.0 { x } else { 1.0 };
    let sizes = [size(at.q.amax()), size(at.p.amax()), size(at.z.abs())];
    let mut differences = Vec::with_capacity(2 * N + 1);
    for k in 0..=2 * N {
        let unit = sizes[k / N.max(1)];
        let distance = RELATIVE_DISTANCE * unit;
        let moved = |by: f64| -> Result<[ChartVector<N>; 2], RuntimeError> {
            let there = ChartVector::<N>::from_fn(|i| center.component(i) + if i == k { by * distance } else { 0.0 });
            Ok(mapped(lagrangian, map, t, &there.into())?.0.map(ChartVector::from))
        };
        let mut slopes = [ChartVector::<N>::from_fn(|_| 0.0); 2];
        for (by, weight) in [(1.0, 45.0), (2.0, -9.0), (3.0, 1.0)] {
            let (ahead, behind) = (moved(by)?, moved(-by)?);
            for (slope, (ahead, behind)) in slopes.iter_mut().zip(ahead.into_iter().zip(behind)) {
                *slope = slope.plus(ahead.minus(behind).scale(weight / (60.0 * distance)));
            }
        }
        let [source, image] = slopes;
        let pulled_back = image.z - end.p.dot(&image.x);
        let eta = source.z - from.p.dot(&source.x);
        // In units of the coordinates.
        differences.push(((pulled_back - sigma * eta) * unit, pulled_back * unit));
    }
    let apart = max_abs_or_nan(differences.iter().map(|d| d.0));
    Ok(if apart == 0.0 { 0.0 } else { apart / max_abs_or_nan(differences.iter().map(|d| d.1)) })
}

/// The distance of a step from the exact motion, relative to the size of the state and per unit of time.
fn herglotz_defect<L: FormulaSystem<N>, const N: usize>(
    lagrangian: &L,
    map: MapOfSteps,
    t: f64,
    at: &PhasePoint<N>,
) -> Result<f64, RuntimeError> {
    let stages = if lagrangian.formula().constraints() > 0 { MOST_STAGES_WITH_CONSTRAINTS } else { 16 };
    let exact = (Some(AnyIntegrator::Gauss { stages }), map.1, 2);
    let (a, b) =
        (ChartVector::from(step(lagrangian, map, t, at)?.0), ChartVector::from(step(lagrangian, exact, t, at)?.0));
    Ok(a.minus(b).amax() / max_or_nan(b.amax(), ChartVector::from(*at).amax()) / map.1.abs())
}

/// The contact and Herglotz defects of the steps of a motion, without the theorems on discrete Lagrangians.
pub(super) fn of_steps<L: FormulaSystem<N>, const N: usize>(
    system: &Sized<L, N>,
    motion: &Motion,
    samples: usize,
) -> Result<Check, RuntimeError> {
    Ok(along(system, motion, samples)?.0)
}

/// Records the states at multiples of a number of steps, and ends the run if its interruption is wanted.
struct Recorded<I, const N: usize> {
    states: Vec<State<N>>,
    stride: usize,
    interrupted: I,
}

impl<I: Fn() -> bool, const N: usize> Observer for Recorded<I, N> {
    fn step(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        if at.k.is_multiple_of(self.stride) && !at.last {
            self.states.push((at.t, at.state.fixed(), at.log_factor.unwrap_or(f64::NAN)));
        }
        if at.k.is_multiple_of(STEPS_BETWEEN_POLLS) && (self.interrupted)() {
            ControlFlow::Break(Stop::here("the check"))
        } else {
            ControlFlow::Continue(())
        }
    }
}

/// The same, with the states at the samples, and with the number of stages of the integrator, if it is a collocation.
fn along<L: FormulaSystem<N>, const N: usize>(
    system: &Sized<L, N>,
    motion: &Motion,
    samples: usize,
) -> Result<(Check, Vec<State<N>>, Option<usize>), RuntimeError> {
    let plan = super::run::plan(system, motion)?;
    let by = integrator(system, motion, &plan)?;
    let (h, lagrangian, symmetries) = (plan.step_size, &system.0, system.0.symmetries());
    let problem = system.problem_of(motion)?;
    let interrupted = || motion.interrupt.as_ref().is_some_and(Interrupt::is_wanted);
    let stride = plan.steps.div_ceil(samples.max(1));
    let momenta = |x: &PhasePoint<N>| symmetries.iter().map(|s| s.momentum(&x.q, &x.p)).collect::<Vec<f64>>();
    let first = momenta(problem.state());
    let states = vec![(motion.start.t, *problem.state(), 0.0)];
    let mut record = Recorded { states, stride, interrupted: &interrupted };
    run_by(&problem, by, plan.steps)?.with_conformal_factor().observe(&mut record).run(Until::Time(motion.end))?;
    let states = record.states;
    let map = (by, h, 1);
    let mut along = Vec::with_capacity(states.len());
    for (t, x, log_factor) in &states {
        if interrupted() {
            return Err(InputError::Interrupted.into());
        }
        let there = momenta(x).into_iter().zip(&first);
        let momenta =
            there.map(|(momentum, first)| MomentumSample { momentum, predicted: first * log_factor.exp() }).collect();
        along.push(Sample {
            t: *t,
            sigma: step(lagrangian, map, *t, x)?.1,
            log_factor: *log_factor,
            contact_defect: contact_defect(lagrangian, map, *t, x)?,
            herglotz_defect: herglotz_defect(lagrangian, map, *t, x)?,
            momenta,
        });
    }
    let not_contact = match lagrangian.has_force() {
        true => Some(NotContact::Forced),
        false => lagrangian.formula().has_noncontact_resets().then_some(NotContact::Reset),
    };
    let integrator = plan.integrator.name.to_string();
    let check = Check { integrator, step_size: h, samples: along, statements: Vec::new(), not_contact };
    Ok((check, states, plan.integrator.collocation))
}

/// The integrator of a motion; `None` for that which the constraints choose.
fn integrator<L: FormulaSystem<N>, const N: usize>(
    system: &Sized<L, N>,
    motion: &Motion,
    plan: &Plan,
) -> Result<Option<AnyIntegrator>, RuntimeError> {
    Ok(match motion.step_control {
        StepControl::Steps { by, .. } | StepControl::Accuracy { by: Some(by), .. } => Some(by),
        StepControl::Accuracy { by: None, .. } if system.0.formula().constraints() > 0 => None,
        StepControl::Accuracy { by: None, .. } => Some(plan.integrator.name.parse()?),
    })
}

/// See [`System::modified_defects`](crate::System::modified_defects).
pub(super) fn modified_defects<L: FormulaSystem<N>, const N: usize>(
    system: &Sized<L, N>,
    motion: &Motion,
    most: usize,
) -> Result<Vec<ModifiedDefect>, RuntimeError> {
    let plan = super::run::plan(system, motion)?;
    let (by, h, problem) = (integrator(system, motion, &plan)?, plan.step_size, system.problem_of(motion)?);
    // Constraints are refused before.
    let Some(by) = by.map(L::by).transpose()? else {
        return Err(RuntimeError::WithConstraints { what: "modified Hamiltonians" });
    };
    let span = (motion.end - motion.start.t).abs().min(MODIFIED_STEPS * h.abs());
    Ok(hamiltonian::modified_defects(&problem, &by, span, &[h, 0.5 * h, 0.25 * h], most)?)
}

pub(super) fn check<const N: usize>(
    system: &Sized<FormulaLagrangian<N>, N>,
    motion: &Motion,
    samples: usize,
) -> Result<Check, RuntimeError> {
    let (mut check, states, collocation) = along(system, motion, samples)?;
    if system.0.formula().constraints() > 0 {
        // The theorems are about discrete Lagrangians on Q x Q x R.
        return Ok(check);
    }
    let (h, lagrangian) = (check.step_size, &system.0);
    let interrupted = || motion.interrupt.as_ref().is_some_and(Interrupt::is_wanted);
    let of_theorems: Vec<_> = states.iter().step_by(states.len().div_ceil(THEOREM_SAMPLES)).collect();
    let stages = collocation.unwrap_or(DEFAULT_STAGES);
    let forced = Lagrangian::has_force(lagrangian);
    let mut shorter = h;
    check.statements = loop {
        if forced {
            // The theorems are about discrete Lagrangians, which do not exist with a force.
            break virtual_work(lagrangian, stages, h, &of_theorems)?;
        }
        if interrupted() {
            return Err(InputError::Interrupted.into());
        }
        match theorems_with(system, stages, (shorter, &of_theorems)) {
            // The discrete Lagrangian is defined for points that are close enough to each other.
            Err(RuntimeError::Geometry(_) | RuntimeError::Step(_)) if (h / shorter) < MAX_STEP_DIVISION => {
                shorter *= 0.5
            }
            ended => break ended?,
        }
    };
    Ok(check)
}

/// The contact defect of Gauss steps beside the virtual work of the force: the largest residual over some samples. Those
/// from which no step of this length is possible are left out, unless that holds for all of them.
fn virtual_work<const N: usize>(
    lagrangian: &FormulaLagrangian<N>,
    stages: usize,
    h: f64,
    samples: &[&State<N>],
) -> Result<Vec<StatementResidual>, RuntimeError> {
    let of = |(t, x, _): &&State<N>| -> Result<f64, RuntimeError> {
        let guess = legendre_inverse(lagrangian, *t, x, &x.p)?.v;
        Ok(VirtualWork::of_step(lagrangian, stages, h, *t, x, &guess)?.residual())
    };
    let found: Vec<Result<f64, RuntimeError>> = samples.iter().map(of).collect();
    let (known, failed): (Vec<_>, Vec<_>) = found.into_iter().partition(Result::is_ok);
    if let (true, Some(Err(error))) = (known.is_empty(), failed.into_iter().next()) {
        return Err(error);
    }
    let residual = max_abs_or_nan(known.into_iter().flatten());
    let method = AnyIntegrator::Gauss { stages }.to_string();
    Ok(vec![StatementResidual { statement: Statement::VirtualWork, method, step_size: h, residual }])
}

/// The theorems for the discrete Lagrangian of contact Gauss collocation with step h: the largest residuals over the
/// steps from some samples.
fn theorems_with<const N: usize>(
    system: &Sized<FormulaLagrangian<N>, N>,
    stages: usize,
    (h, samples): (f64, &[&State<N>]),
) -> Result<Vec<StatementResidual>, RuntimeError> {
    let n = system.0.formula().dimension();
    let mut points = Vec::with_capacity(samples.len());
    for (t, x, _) in samples {
        let q1 = step(&system.0, (Some(AnyIntegrator::Gauss { stages }), h, 1), *t, x)?.0.q;
        let [q0, q1] = [&x.q, &q1].map(|q| coordinates(q.as_slice(), n).to_vec());
        points.push(Points { t: *t, q0, q1, z0: x.z });
    }
    theorems(system.0.formula(), stages, h, &points)
}
