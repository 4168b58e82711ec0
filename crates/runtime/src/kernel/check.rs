//! The steps of a motion as maps: contact defects, Herglotz defects and residuals of the theorems.

use super::Kernel;
use super::WITHOUT_CONSTRAINTS;
use super::discrete::{custom, has_custom, no_custom};
use super::formula_system::FormulaSystem;
use super::many::{ManyCoordinates, few, gauss};
use super::sized::{Sized, coordinates};
use super::theorems::{Points, theorems};
use crate::full::{FULL, not_compiled};
use crate::{
    Check, FormulaMethod, Interrupt, MomentumSample, Motion, NotContact, Plan, RuntimeError, Sample, StatementResidual,
    StepControl,
};
use contact_geom::{
    Lagrangian, OneParameterGroup, PhasePoint, Statement,
    numbers::{max_abs_or_nan, max_or_nan},
};
use discrete_herglotz::{
    AnyIntegrator, GaussCollocation, InputError, Observer, Problem, Run, Start, State, StepView, Steps, Stop,
    SystemProblem, Until, gauss::VirtualWork, hamiltonian, hamiltonian::ModifiedDefect, theory::legendre_inverse,
};
use formula_lagrangian::{Formula, FormulaLagrangian};
use std::ops::ControlFlow;

/// The distance of the finite differences, relative to the size of a state: it balances their truncation error, of
/// sixth order, and round-off divided by the distance.
const RELATIVE_DISTANCE: f64 = 1e-3;

/// The number of samples at which the theorems are evaluated: few, since second derivatives of second derivatives are
/// expensive.
const THEOREM_SAMPLES: usize = 3;

/// The number of coordinates up to which theorems are evaluated with the stages of the motion, and the number of stages in more.
const FEW_COORDINATES: usize = 4;
const STAGES_IN_MANY_COORDINATES: usize = 4;

/// The number of steps between two polls of the interrupt: a poll is then inexpensive compared with the steps.
const STEPS_BETWEEN_POLLS: usize = 256;

/// The number of steps of a motion whose modified Hamiltonians are compared.
const MODIFIED_STEPS: f64 = 256.0;

/// The number of stages of the discrete Lagrangian for the theorems, where the integrator of the motion is not a
/// collocation method: order 8.
const DEFAULT_STAGES: usize = 4;

/// The theorems are given up when the step has been halved six times without a discrete Lagrangian for its two points.
const MAX_STEP_DIVISION: f64 = 64.0;

/// The number of stages of the most accurate method.
const MOST_STAGES: usize = 16;

/// The number of stages of collocation that stands for the most accurate method with constraints, of order 14.
const MOST_STAGES_WITH_CONSTRAINTS: usize = 7;

/// A sample of a motion: the time, the state, and the logarithm of the conformal factor.
type StateAt = (f64, State, f64);

/// The integrator of a map: the one with this name, or `None` for that which the constraints choose; or a discrete Lagrangian
/// of one's own.
#[derive(Clone, Debug)]
enum MapBy {
    Named(Option<AnyIntegrator>),
    Method(FormulaMethod),
}

impl MapBy {
    fn gauss(stages: usize) -> Self {
        MapBy::Named(Some(AnyIntegrator::Gauss { stages }))
    }
}

/// The steps of a map: the integrator, the length of a step, and the number of steps.
type MapOfSteps<'b> = (&'b MapBy, f64, usize);

/// The maps of a system: the start, the end and the conformal factor of one at a state, which is first moved to the
/// constraints, if there are any.
type Maps<'m> = dyn Fn(MapOfSteps<'_>, f64, &State) -> Result<([State; 2], f64), RuntimeError> + 'm;

/// The run of a number of steps by an integrator, or by the one for the constraints.
fn run_by<'p, 'o, L: FormulaSystem<N>, const N: usize>(
    problem: &'p Problem<'p, L, N>,
    by: &MapBy,
    count: usize,
) -> Result<Run<'p, 'o, Problem<'p, L, N>>, RuntimeError> {
    let by = match by {
        MapBy::Named(by) => *by,
        MapBy::Method(method) => {
            // Written so that it is not compiled for Hamiltonians.
            if const { !has_custom::<L, N>() } {
                return Err(no_custom());
            } else {
                return Ok(problem.by(custom(method, problem.lagrangian())?).steps(Steps::Count(count)));
            }
        }
    };
    Ok(match (problem.lagrangian().constrained(by)?, by) {
        (Some(method), _) => problem.by(method).steps(Steps::Count(count)),
        (None, _) if const { !L::IS_FREE } => return Err(not_compiled(WITHOUT_CONSTRAINTS)),
        (None, Some(by)) => problem.by(L::by(by)?).steps(Steps::Count(count)),
        (None, None) => problem.steps(Steps::Count(count)),
    })
}

/// See [`Maps`].
fn mapped<L: FormulaSystem<N>, const N: usize>(
    lagrangian: &L,
    (by, h, count): MapOfSteps<'_>,
    t: f64,
    from: &State,
) -> Result<([State; 2], f64), RuntimeError> {
    let mut problem = Problem::new(lagrangian, t, Start::from(from.fixed()))?;
    if lagrangian.formula().constraints() > 0 {
        problem = Problem::new(lagrangian, t, lagrangian.projected(t, *problem.start())?)?;
    }
    let plan = run_by(&problem, by, count)?.plan(Until::After(h))?;
    let mut stepper = plan.stepper()?;
    stepper.advance(count).map_err(|failure| failure.cause)?;
    Ok(([problem.state().into(), stepper.state()], stepper.sigma()))
}

/// The state after a time h in `count` steps, and the conformal factor of the last step.
fn step(maps: &Maps<'_>, map: MapOfSteps<'_>, t: f64, from: &State) -> Result<(State, f64), RuntimeError> {
    let ([_, end], sigma) = maps(map, t, from)?;
    Ok((end, sigma))
}

/// The numbers of a state, in the order q, p, z.
fn numbers(State { q, p, z }: &State) -> Vec<f64> {
    [&q[..], p, &[*z]].concat()
}

/// The distance of the pullback of `dz - p dq` by a step from `sigma (dz - p dq)`, relative to its size: by derivatives
/// along curves of starts. With constraints these are curves in T\*N x R, whose tangent vectors are all of them.
fn contact_defect(maps: &Maps<'_>, map: MapOfSteps<'_>, t: f64, at: &State) -> Result<f64, RuntimeError> {
    let n = at.q.len();
    let ([from, end], sigma) = maps(map, t, at)?;
    let size = |x: f64| if x > 0.0 { x } else { 1.0 };
    let sizes = [size(at.q.amax()), size(at.p.amax()), size(at.z.abs())];
    let mut differences = Vec::with_capacity(2 * n + 1);
    for k in 0..=2 * n {
        let unit = sizes[k / n.max(1)];
        let distance = RELATIVE_DISTANCE * unit;
        let moved = |by: f64| -> Result<[Vec<f64>; 2], RuntimeError> {
            let mut there = at.clone();
            let all = there.q.iter_mut().chain(there.p.iter_mut()).chain([&mut there.z]);
            all.enumerate().for_each(|(i, x)| *x += if i == k { by * distance } else { 0.0 });
            Ok(maps(map, t, &there)?.0.map(|x| numbers(&x)))
        };
        let mut slopes = [(); 2].map(|_| vec![0.0; 2 * n + 1]);
        for (by, weight) in [(1.0, 45.0), (2.0, -9.0), (3.0, 1.0)] {
            let (ahead, behind) = (moved(by)?, moved(-by)?);
            for (slope, (ahead, behind)) in slopes.iter_mut().zip(ahead.into_iter().zip(behind)) {
                for (slope, (ahead, behind)) in slope.iter_mut().zip(ahead.into_iter().zip(behind)) {
                    *slope += (ahead - behind) * (weight / (60.0 * distance));
                }
            }
        }
        let [source, image] = slopes;
        let pulled_back = image[2 * n] - end.p.dot(&image[..n]);
        let eta = source[2 * n] - from.p.dot(&source[..n]);
        // In units of the coordinates.
        differences.push(((pulled_back - sigma * eta) * unit, pulled_back * unit));
    }
    let apart = max_abs_or_nan(differences.iter().map(|d| d.0));
    Ok(if apart == 0.0 { 0.0 } else { apart / max_abs_or_nan(differences.iter().map(|d| d.1)) })
}

/// The distance of a step from the exact motion, relative to the size of the state and per unit of time.
fn herglotz_defect(
    maps: &Maps<'_>,
    constrained: bool,
    map: MapOfSteps<'_>,
    t: f64,
    at: &State,
) -> Result<f64, RuntimeError> {
    let stages = if constrained { MOST_STAGES_WITH_CONSTRAINTS } else { MOST_STAGES };
    let by = MapBy::gauss(stages);
    let exact = (&by, map.1, 2);
    let (a, b) = (numbers(&step(maps, map, t, at)?.0), numbers(&step(maps, exact, t, at)?.0));
    let size = |x: &[f64]| max_abs_or_nan(x.iter().copied());
    let apart = max_abs_or_nan(a.iter().zip(&b).map(|(a, b)| a - b));
    Ok(apart / max_or_nan(size(&b), size(&numbers(at))) / map.1.abs())
}

/// The contact and Herglotz defects of the steps of a motion, without the theorems on discrete Lagrangians.
pub(super) fn of_steps<L: FormulaSystem<N>, const N: usize>(
    system: &Sized<L, N>,
    motion: &Motion,
    samples: usize,
) -> Result<Check, RuntimeError> {
    Ok(along(system, motion, samples)?.0)
}

/// Whether the interruption of a motion is wanted.
fn is_interrupted(motion: &Motion) -> bool {
    motion.interrupt.as_ref().is_some_and(Interrupt::is_wanted)
}

/// Records the states at multiples of a number of steps, and ends the run if its interruption is wanted.
struct Recorded<'m> {
    states: Vec<StateAt>,
    stride: usize,
    motion: &'m Motion,
}

impl Observer for Recorded<'_> {
    fn step(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        if at.k.is_multiple_of(self.stride) && !at.last {
            self.states.push((at.t, at.state.clone(), at.log_factor.unwrap_or(f64::NAN)));
        }
        if at.k.is_multiple_of(STEPS_BETWEEN_POLLS) && is_interrupted(self.motion) {
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
) -> Result<(Check, Vec<StateAt>, Option<usize>), RuntimeError> {
    let plan = super::run::plan(system, motion)?;
    let (lagrangian, symmetries, formula) = (&system.0, system.0.symmetries(), system.0.formula());
    let by = integrator(formula, motion, &plan)?;
    let problem = system.problem_of(motion)?;
    let states = vec![(motion.start.t, problem.state().into(), 0.0)];
    let mut record = Recorded { states, stride: plan.steps.div_ceil(samples.max(1)), motion };
    run_by(&problem, &by, plan.steps)?.with_conformal_factor().observe(&mut record).run(Until::Time(motion.end))?;
    let states = record.states;
    let momenta = |x: &State| {
        let PhasePoint { q, p, .. } = x.fixed();
        symmetries.iter().map(|s| s.momentum(&q, &p)).collect()
    };
    let maps = |map: MapOfSteps<'_>, t: f64, from: &State| mapped(lagrangian, map, t, from);
    let samples = samples_at(&states, &maps, (formula.constraints() > 0, (&by, plan.step_size, 1)), &momenta, motion)?;
    Ok((checked(formula, lagrangian.has_force(), &plan, samples), states, plan.integrator.collocation))
}

/// The check of a motion with these samples, without the theorems.
fn checked(formula: &Formula, has_force: bool, plan: &Plan, samples: Vec<Sample>) -> Check {
    let not_contact = match has_force {
        true => Some(NotContact::Forced),
        false => formula.has_noncontact_resets().then_some(NotContact::Reset),
    };
    let integrator = plan.integrator.name.to_string();
    Check { integrator, step_size: plan.step_size, samples, statements: Vec::new(), not_contact }
}

/// The contact and Herglotz defects of the steps of a motion in many coordinates.
pub(super) fn of_many(system: &ManyCoordinates, motion: &Motion, samples: usize) -> Result<Check, RuntimeError> {
    let (plan, formula) = (Kernel::plan(system, motion)?, Kernel::formula(system));
    let by = integrator(formula, motion, &plan)?;
    let stages = |by: &MapBy| match by {
        MapBy::Named(by) => Ok(by.map_or(Ok(GaussCollocation { stages: MOST_STAGES }), gauss)?),
        MapBy::Method(_) => Err(few("methods of one's own")),
    };
    let problem = system.problem(motion)?;
    let states = vec![(motion.start.t, problem.state().clone(), 0.0)];
    let mut record = Recorded { states, stride: plan.steps.div_ceil(samples.max(1)), motion };
    let run = problem.by(stages(&by)?).steps(Steps::Count(plan.steps)).with_conformal_factor();
    run.observe(&mut record).run(Until::Time(motion.end))?;
    let maps = |(by, h, count): MapOfSteps<'_>, t: f64, from: &State| {
        let problem = SystemProblem::new(system, t, from.clone())?;
        let plan = problem.by(stages(by)?).steps(Steps::Count(count)).plan(Until::After(h))?;
        let mut stepper = plan.stepper()?;
        stepper.advance(count).map_err(|failure| failure.cause)?;
        Ok(([problem.state().clone(), stepper.state()], stepper.sigma()))
    };
    let symmetries = Kernel::symmetries(system);
    let momenta = |x: &State| symmetries.iter().map(|symmetry| symmetry.momentum(&x.q, &x.p)).collect();
    let samples = samples_at(&record.states, &maps, (false, (&by, plan.step_size, 1)), &momenta, motion)?;
    Ok(checked(formula, Kernel::has_force(system), &plan, samples))
}

/// The defects of a map, of a system that has constraints or none, and the momenta, at states of a motion.
fn samples_at(
    states: &[StateAt],
    maps: &Maps<'_>,
    (constrained, map): (bool, MapOfSteps<'_>),
    momenta: &dyn Fn(&State) -> Vec<f64>,
    motion: &Motion,
) -> Result<Vec<Sample>, RuntimeError> {
    let first = states.first().map_or_else(Vec::new, |(_, x, _)| momenta(x));
    let mut along = Vec::with_capacity(states.len());
    for (t, x, log_factor) in states {
        if is_interrupted(motion) {
            return Err(InputError::Interrupted.into());
        }
        let there = momenta(x).into_iter().zip(&first);
        let momenta =
            there.map(|(momentum, first)| MomentumSample { momentum, predicted: first * log_factor.exp() }).collect();
        along.push(Sample {
            t: *t,
            sigma: step(maps, map, *t, x)?.1,
            log_factor: *log_factor,
            contact_defect: contact_defect(maps, map, *t, x)?,
            herglotz_defect: herglotz_defect(maps, constrained, map, *t, x)?,
            momenta,
        });
    }
    Ok(along)
}

/// The integrator of a motion.
fn integrator(formula: &Formula, motion: &Motion, plan: &Plan) -> Result<MapBy, RuntimeError> {
    if let Some(method) = &motion.method {
        return Ok(MapBy::Method(method.clone()));
    }
    Ok(MapBy::Named(match motion.step_control {
        StepControl::Steps { by, .. } | StepControl::Accuracy { by: Some(by), .. } => Some(by),
        StepControl::Accuracy { by: None, .. } if formula.constraints() > 0 => None,
        StepControl::Accuracy { by: None, .. } => Some(plan.integrator.name.parse()?),
    }))
}

/// See [`System::modified_defects`](crate::System::modified_defects).
pub(super) fn modified_defects<L: FormulaSystem<N>, const N: usize>(
    system: &Sized<L, N>,
    motion: &Motion,
    most: usize,
) -> Result<Vec<ModifiedDefect>, RuntimeError> {
    let plan = super::run::plan(system, motion)?;
    let (by, h, problem) = (integrator(system.0.formula(), motion, &plan)?, plan.step_size, system.problem_of(motion)?);
    let span = (motion.end - motion.start.t).abs().min(MODIFIED_STEPS * h.abs());
    let by = match by {
        MapBy::Method(_) => {
            return Err(RuntimeError::argument("method", "has no modified Hamiltonian here; name an integrator"));
        }
        MapBy::Named(Some(by)) => L::by(by)?,
        // Constraints are refused before.
        MapBy::Named(None) => return Err(RuntimeError::WithConstraints { what: "modified Hamiltonians" }),
    };
    Ok(hamiltonian::modified_defects(&problem, &by, span, &[h, 0.5 * h, 0.25 * h], most)?)
}

pub(super) fn check<const N: usize>(
    system: &Sized<FormulaLagrangian<N>, N>,
    motion: &Motion,
    samples: usize,
) -> Result<Check, RuntimeError> {
    let (mut check, states, collocation) = along(system, motion, samples)?;
    let (lagrangian, formula) = (&system.0, system.0.formula());
    if const { !FULL } || formula.constraints() > 0 {
        // The theorems are about discrete Lagrangians on Q x Q x R.
        return Ok(check);
    }
    let of_theorems: Vec<_> = states.iter().step_by(states.len().div_ceil(THEOREM_SAMPLES)).collect();
    let stages = collocation.unwrap_or(DEFAULT_STAGES);
    // The theorems hold for any number of stages, and the time grows with the cube of their unknowns.
    let stages = if formula.dimension() > FEW_COORDINATES { stages.min(STAGES_IN_MANY_COORDINATES) } else { stages };
    check.statements = if Lagrangian::has_force(lagrangian) {
        // The theorems are about discrete Lagrangians, which do not exist with a force.
        virtual_work(stages, check.step_size, &of_theorems, &|stages, h, t, x| {
            let from = x.fixed();
            let guess = legendre_inverse(lagrangian, t, &from, &from.p)?.v;
            Ok(VirtualWork::of_step(lagrangian, stages, h, t, &from, &guess)?.residual())
        })?
    } else {
        let maps = |map: MapOfSteps<'_>, t: f64, from: &State| mapped(lagrangian, map, t, from);
        if let Some(method) = &motion.method {
            check.statements = theorems_of(method, formula, (&maps, check.step_size), &of_theorems)?;
            return Ok(check);
        }
        theorems_along(formula, &maps, (stages, check.step_size), &of_theorems, motion)?
    };
    Ok(check)
}

/// The residual of the contact form beside the virtual work, of a Gauss step with a number of stages and a length.
type WorkResidual<'w> = dyn Fn(usize, f64, f64, &State) -> Result<f64, RuntimeError> + 'w;

/// The contact defect of Gauss steps beside the virtual work of the force: the largest residual over some samples. Those
/// from which no step of this length is possible are left out, unless that holds for all of them.
fn virtual_work(
    stages: usize,
    h: f64,
    samples: &[&StateAt],
    of: &WorkResidual<'_>,
) -> Result<Vec<StatementResidual>, RuntimeError> {
    let found: Vec<Result<f64, RuntimeError>> = samples.iter().map(|(t, x, _)| of(stages, h, *t, x)).collect();
    let (known, failed): (Vec<_>, Vec<_>) = found.into_iter().partition(Result::is_ok);
    if let (true, Some(Err(error))) = (known.is_empty(), failed.into_iter().next()) {
        return Err(error);
    }
    let residual = max_abs_or_nan(known.into_iter().flatten());
    let method = AnyIntegrator::Gauss { stages }.to_string();
    Ok(vec![StatementResidual { statement: Statement::VirtualWork, method, step_size: h, residual }])
}

/// The theorems for the discrete Lagrangian of contact Gauss collocation with a number of stages and step h, or with a
/// shorter one.
fn theorems_along(
    formula: &Formula,
    maps: &Maps<'_>,
    (stages, h): (usize, f64),
    samples: &[&StateAt],
    motion: &Motion,
) -> Result<Vec<StatementResidual>, RuntimeError> {
    let mut shorter = h;
    loop {
        if is_interrupted(motion) {
            return Err(InputError::Interrupted.into());
        }
        match theorems_with(formula, maps, (stages, shorter), samples) {
            // The discrete Lagrangian is defined for points that are close enough to each other.
            Err(RuntimeError::Geometry(_) | RuntimeError::Step(_)) if (h / shorter) < MAX_STEP_DIVISION => {
                shorter *= 0.5
            }
            ended => return ended,
        }
    }
}

/// The largest residuals over the steps from some samples.
fn theorems_with(
    formula: &Formula,
    maps: &Maps<'_>,
    (stages, h): (usize, f64),
    samples: &[&StateAt],
) -> Result<Vec<StatementResidual>, RuntimeError> {
    let n = formula.dimension();
    let mut points = Vec::with_capacity(samples.len());
    for (t, x, _) in samples {
        points.push(points_of(maps, (&MapBy::gauss(stages), h, 1), (*t, x), n)?);
    }
    theorems(formula, stages, h, &points)
}

/// The largest residuals of a discrete Lagrangian of one's own, over its steps from some samples.
fn theorems_of(
    method: &FormulaMethod,
    formula: &Formula,
    (maps, h): (&Maps<'_>, f64),
    samples: &[&StateAt],
) -> Result<Vec<StatementResidual>, RuntimeError> {
    let by = MapBy::Method(method.clone());
    let points = samples.iter().map(|(t, x, _)| points_of(maps, (&by, h, 1), (*t, x), formula.dimension()));
    super::theorems::of_method(method, h, &points.collect::<Result<Vec<_>, _>>()?)
}

/// The two positions of a step from a state.
fn points_of(maps: &Maps<'_>, map: MapOfSteps<'_>, (t, x): (f64, &State), n: usize) -> Result<Points, RuntimeError> {
    let q1 = step(maps, map, t, x)?.0.q;
    let [q0, q1] = [&x.q, &q1].map(|q| coordinates(q, n).to_vec());
    Ok(Points { t, q0, q1, z0: x.z })
}
