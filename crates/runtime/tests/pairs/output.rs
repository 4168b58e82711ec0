//! What is asked of the library, and whether it agrees with the reference.

use super::feature::Feature;
use super::problem::{Form, Problem};
use super::random::Random;
use super::reference::{Reference, motion};
use crate::motions::Seen;
use herglotz_runtime::{
    Column, Ensemble, Event, InitialVelocity, MemberEnd, MotionFit, Outcome, OutputTimes, Series, Start, Status,
    StepControl, System, Unknown, Varied,
};
use std::ops::ControlFlow;

/// An output of a run.
#[derive(Clone, Debug)]
pub enum Output {
    End,
    /// States at times.
    Rows(Vec<f64>),
    /// The times at which x crosses a position.
    Events(f64),
    /// A second run from the end of a first one, which ends at this part of the span or at an impact.
    Resume {
        part: f64,
        at_impact: bool,
    },
    /// The derivatives of the end in two variables.
    Sensitivity([String; 2]),
    /// A parameter, from states at these times.
    Fit(String, Vec<f64>),
    /// Members whose parameter differs.
    Ensemble(String),
}

/// How a case ended.
#[derive(Clone, Debug, PartialEq)]
pub enum Verdict {
    Right,
    /// An error, a status or a flag.
    Refused(String),
    /// Another result than the reference, without a word.
    Wrong(String),
    /// A problem that small changes of its start change much: another is drawn.
    Sensitive,
}

use Verdict::{Refused, Right, Sensitive, Wrong};

impl Output {
    pub fn draw(random: &mut Random, problem: &Problem) -> Self {
        let times = |random: &mut Random, count: usize| {
            let mut times: Vec<f64> = (0..count).map(|_| random.between(0.0, problem.end)).collect();
            times.sort_by(f64::total_cmp);
            times
        };
        let names: Vec<&str> = problem.parameters().iter().map(|(name, _)| *name).collect();
        let differentiable = problem.form == Form::Lagrangian
            && !problem.features.iter().any(|f| matches!(f, Feature::TerminalEvent { .. }));
        match random.below(7) {
            0 => Output::End,
            1 => Output::Rows(times(random, 7)),
            2 => Output::Events(problem.start[0] + random.between(-0.8, 0.8)),
            3 => Output::Resume { part: random.between(0.1, 0.9), at_impact: random.chance(0.5) },
            4 if differentiable => {
                let any = |random: &mut Random| match random.below(names.len() + 2) {
                    0 => "x",
                    1 => "x'",
                    i => names[i - 2],
                };
                let first = any(random);
                let second = std::iter::repeat_with(|| any(random)).find(|name| *name != first).unwrap();
                Output::Sensitivity([first.into(), second.into()])
            }
            5 if differentiable => {
                let name = names[random.below(names.len())];
                Output::Fit(name.into(), times(random, 12))
            }
            _ => Output::Ensemble(names[random.below(names.len())].into()),
        }
    }

    /// The verdict on the answer of the library.
    pub fn check(&self, problem: &Problem) -> Verdict {
        let Some((truth, growth)) = conditioned(problem, &[]) else { return Sensitive };
        // Where a pendulum turns over, an event is also on the other side of the circle.
        if problem.form == Form::Constrained && truth.farthest > 1.2 {
            return Sensitive;
        }
        let system = match problem.system() {
            Ok(system) => system,
            Err(message) => return Refused(message),
        };
        let size = 1.0 + truth.end.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
        let bound = size
            * match problem.step_control {
                StepControl::Accuracy { error, .. } => 10.0 * error,
                // Steps that resolve the smooth pieces to round-off: what grows is round-off and the location of jumps.
                StepControl::Steps { .. } => 1e-9 * (1.0 + growth),
            };
        let checked = match self {
            Output::End => end(problem, &system, &truth, bound),
            Output::Rows(times) => rows(problem, &system, times, bound),
            Output::Events(b) => events(problem, &system, *b, bound),
            Output::Resume { part, at_impact } => {
                let impact = truth.impacts.first().filter(|_| *at_impact).map(|(t, _)| *t);
                resume(problem, &system, impact.unwrap_or(part * truth.t), &truth, bound)
            }
            Output::Sensitivity(names) => sensitivity(problem, &system, names),
            Output::Fit(name, times) => fit(problem, &system, name, times),
            Output::Ensemble(name) => ensemble(problem, &system, name, bound),
        };
        checked.err().unwrap_or(Right)
    }
}

/// The reference with the growth of changes of its start; `None` where a small change of the start is no small change of
/// the motion, because a surface is touched.
fn conditioned(problem: &Problem, times: &[f64]) -> Option<(Reference, f64)> {
    const CHANGE: f64 = 1e-5;
    let truth = motion(problem, (0.0, problem.start), times, None)?;
    let mut growth: f64 = 0.0;
    for i in 0..2 {
        let near = |change: f64| {
            let mut start = problem.start;
            start[i] += change;
            motion(problem, (0.0, start), times, None)
        };
        let (above, below) = (near(CHANGE)?, near(-CHANGE)?);
        if above.impacts.len() != truth.impacts.len() || below.impacts.len() != truth.impacts.len() {
            return None;
        }
        let ends = |reference: &Reference| [reference.end[0], reference.end[1], reference.end[2], reference.t];
        let (above, below, truth) = (ends(&above), ends(&below), ends(&truth));
        for j in 0..4 {
            let (up, down) = (above[j] - truth[j], truth[j] - below[j]);
            if (up - down).abs() > 0.02 * (up.abs() + down.abs()) + 1e-7 {
                return None;
            }
            growth = growth.max((up.abs() / CHANGE).max(down.abs() / CHANGE));
        }
    }
    (growth < 1e3).then_some((truth, growth))
}

fn differ(what: &str, found: &[f64], expected: &[f64], bound: f64) -> Result<(), Verdict> {
    let far = |(a, b): (&f64, &f64)| (a - b).is_nan() || (a - b).abs() > bound;
    if found.len() != expected.len() || found.iter().zip(expected).any(far) {
        return Err(Wrong(format!("{what}: {found:?} for {expected:?}, bound {bound:.1e}")));
    }
    Ok(())
}

fn refused<T, E: std::fmt::Display>(result: Result<T, E>) -> Result<T, Verdict> {
    result.map_err(|error| Refused(error.to_string()))
}

/// The outcome, if it is one without a flag and with the status that it should have.
fn accepted(outcome: Outcome) -> Result<Outcome, Verdict> {
    if let Some(step) = outcome.unresolved {
        return Err(Refused(format!("flagged: {step:?}")));
    }
    match outcome.status {
        Status::Completed | Status::Stopped { .. } => Ok(outcome),
        other => Err(Refused(other.to_string())),
    }
}

fn state_of(problem: &Problem, outcome: &Outcome) -> [f64; 4] {
    let [x, v, z] = problem.observed_of(&outcome.q, &outcome.p, outcome.z.unwrap());
    [x, v, z, outcome.t]
}

fn end(problem: &Problem, system: &System, truth: &Reference, bound: f64) -> Result<(), Verdict> {
    let outcome = accepted(refused(system.run(&problem.motion(system), &mut ()))?)?;
    let [x, v, z] = problem.observed(truth.end);
    differ("end", &state_of(problem, &outcome), &[x, v, z, truth.t], bound)
}

fn columns(problem: &Problem, system: &System) -> Vec<Column> {
    ["x", problem.velocity(), "z"].map(|text| Column::parse(text, system.formula()).unwrap()).into()
}

fn rows(problem: &Problem, system: &System, times: &[f64], bound: f64) -> Result<(), Verdict> {
    let Some((truth, _)) = conditioned(problem, times) else { return Err(Sensitive) };
    // A row beside an impact is before or after it by round-off.
    if times.iter().any(|t| truth.impacts.iter().any(|(at, _)| (at - t).abs() < 1e-6)) {
        return Err(Sensitive);
    }
    let request = herglotz_runtime::Motion {
        rows: Some(OutputTimes::At(times.to_vec())),
        columns: columns(problem, system),
        ..problem.motion(system)
    };
    let mut seen = Seen::default();
    accepted(refused(system.run(&request, &mut seen))?)?;
    let expected: Vec<f64> = truth.rows.iter().flat_map(|row| problem.observed(*row)).collect();
    differ("rows", &seen.rows.concat(), &expected, bound)
}

fn events(problem: &Problem, system: &System, b: f64, bound: f64) -> Result<(), Verdict> {
    let truth = motion(problem, (0.0, problem.start), &[], Some(b)).unwrap();
    for shift in [-1e-3, 1e-3] {
        let near = motion(problem, (0.0, problem.start), &[], Some(b + shift)).unwrap();
        let touched = |(a, b): (&f64, &f64)| (a - b).abs() > 0.02;
        if near.crossings.len() != truth.crossings.len() || near.crossings.iter().zip(&truth.crossings).any(touched) {
            return Err(Sensitive);
        }
    }
    // A crossing where the motion ends, or where it is reflected, is there or not by round-off.
    let apart = |at: &f64| (truth.t - at).abs() > 1e-3 && truth.impacts.iter().all(|(t, _)| (t - at).abs() > 1e-3);
    if !truth.crossings.iter().all(apart) {
        return Err(Sensitive);
    }
    let mut request = problem.motion(system);
    request.events.push(Event::new(system.formula().expression(&problem.crossing_of(&format!("{b:?}"))).unwrap()));
    let mut seen = Seen::default();
    accepted(refused(system.run(&request, &mut seen))?)?;
    let number = request.events.len() - 1;
    let found: Vec<f64> = seen.crossings.iter().filter(|c| c.event == number).map(|c| c.t).collect();
    // The speed of a crossing is at least 0.05, by the test above.
    differ("events", &found, &truth.crossings, 20.0 * bound)
}

fn resume(problem: &Problem, system: &System, middle: f64, truth: &Reference, bound: f64) -> Result<(), Verdict> {
    if middle >= truth.t || middle <= 0.0 {
        return Err(Sensitive);
    }
    let first = herglotz_runtime::Motion { end: middle, ..problem.motion(system) };
    let there = accepted(refused(system.run(&first, &mut ()))?)?;
    let velocity = InitialVelocity::Momentum(there.p.clone());
    let start = Start { t: there.t, q: there.q.clone(), velocity, z: there.z.unwrap() };
    let second = herglotz_runtime::Motion { start, ..problem.motion(system) };
    let outcome = accepted(refused(system.run(&second, &mut ()))?)?;
    let [x, v, z] = problem.observed(truth.end);
    differ(&format!("resumed at {middle:?}"), &state_of(problem, &outcome), &[x, v, z, truth.t], 3.0 * bound)
}

/// The derivative of the end of the reference, or of its rows, by differences of fourth order.
fn slopes(problem: &Problem, name: &str, times: &[f64]) -> Option<Vec<f64>> {
    let (value, h) = (problem.value(name), 5e-4);
    let impacts = motion(problem, (0.0, problem.start), times, None)?.impacts.len();
    let at = |i: f64| {
        let changed = problem.with(name, value + i * h);
        let found = motion(&changed, (0.0, changed.start), times, None)?;
        (found.impacts.len() == impacts).then(|| match times.is_empty() {
            true => found.end.to_vec(),
            false => found.rows.iter().map(|row| row[0]).collect(),
        })
    };
    let slope = |i: f64| {
        let (after, before) = (at(i)?, at(-i)?);
        Some(after.iter().zip(&before).map(|(after, before)| (after - before) / (2.0 * i * h)).collect::<Vec<f64>>())
    };
    let (wide, middle, narrow) = (slope(2.0)?, slope(1.0)?, slope(0.5)?);
    let order_four = |wide: &[f64], narrow: &[f64]| -> Vec<f64> {
        wide.iter().zip(narrow).map(|(wide, narrow)| (4.0 * narrow - wide) / 3.0).collect()
    };
    let (rough, fine) = (order_four(&wide, &middle), order_four(&middle, &narrow));
    // Differences of two lengths agree where nothing in between is touched, to a tenth of what is asked of derivatives.
    let close = rough.iter().zip(&fine).all(|(a, b)| (a - b).abs() < 1e-7 * (1.0 + a.abs()));
    close.then_some(fine)
}

fn sensitivity(problem: &Problem, system: &System, names: &[String; 2]) -> Result<(), Verdict> {
    let Some(expected) = names.iter().map(|name| slopes(problem, name, &[])).collect::<Option<Vec<_>>>() else {
        return Err(Sensitive);
    };
    let texts = names.each_ref().map(String::as_str);
    let found = refused(system.sensitivity(&problem.motion(system), &texts, &[problem.end], &mut ()))?;
    if found.status != Status::Completed {
        return Err(Refused(found.status.to_string()));
    }
    for ((name, column), expected) in texts.iter().zip(&found.rows[0]).zip(&expected) {
        let size = 1.0 + expected.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
        // The truncation of the differences.
        let what = format!("d/d{name}");
        differ(&what, &[column.q[0], column.v[0], column.z], expected, 1e-6 * size)?;
    }
    Ok(())
}

fn fit(problem: &Problem, system: &System, name: &str, times: &[f64]) -> Result<(), Verdict> {
    let value = problem.value(name);
    let guess = value + 0.01 * value.abs().max(0.1);
    let (Some((truth, _)), Some(slopes)) = (conditioned(problem, times), slopes(problem, name, times)) else {
        return Err(Sensitive);
    };
    // The data hold the parameter, and the search passes no other event.
    let strength = slopes.iter().fold(0.0_f64, |most, slope| most.max(slope.abs()));
    let sum_of_squares = |value: f64| {
        let changed = problem.with(name, value);
        let near = motion(&changed, (0.0, changed.start), times, None)?;
        let rows = near.rows.iter().zip(&truth.rows).map(|(a, b)| (a[0] - b[0]).powi(2));
        (near.impacts.len() == truth.impacts.len()).then(|| rows.sum::<f64>())
    };
    if strength < 0.1 || sum_of_squares(guess).is_none() {
        return Err(Sensitive);
    }
    let started = problem.with(name, guess);
    let values = truth.rows.iter().map(|row| row[0]).collect();
    let data = Series { quantity: "x".into(), times: times.to_vec(), values, deviations: None, event: None };
    let request = MotionFit::new(started.motion(system), [Unknown::free(name)], [data]);
    let started = refused(system.with_parameters(&[(name, guess)]))?;
    let fitted = refused(started.fit(&request, &mut ()))?;
    if !fitted.fit.status.is_converged() {
        return Err(Refused(fitted.fit.to_string()));
    }
    let found = fitted.fit.parameters[0];
    let right = differ(&format!("fit of {name}"), &[found], &[value], 1e-6 / strength.min(1.0));
    if right.is_ok() {
        return right;
    }
    // The sum of squares may have another minimum on the way: rows beside impacts have kinks.
    let beside = [-1e-4, 1e-4].map(|by| sum_of_squares(found + by * value.abs().max(0.1)));
    match (sum_of_squares(found), beside) {
        (Some(least), [Some(below), Some(above)]) if least < below.min(above) => Err(Sensitive),
        _ => right,
    }
}

fn ensemble(problem: &Problem, system: &System, name: &str, bound: f64) -> Result<(), Verdict> {
    let value = problem.value(name);
    let values: Vec<f64> = [-0.02, 0.0, 0.03].map(|part| value + part * value.abs().max(0.1)).into();
    let members: Vec<Problem> = values.iter().map(|value| problem.with(name, *value)).collect();
    let truths: Option<Vec<_>> = members.iter().map(|member| conditioned(member, &[])).collect();
    let Some(truths) = truths else { return Err(Sensitive) };
    let start = |i: usize| members[i].motion(system).start;
    let of_member = |i: usize| vec![values[i]];
    let names = [name];
    let request = Ensemble {
        count: 3,
        start: &start,
        t0: 0.0,
        varied: Some(Varied { names: &names, values: &of_member }),
        end: problem.end,
        step_control: problem.step_control,
        rows: None,
        columns: &[],
        events: &problem.events(system),
        threads: Some(1),
    };
    let mut ends: Vec<MemberEnd> = Vec::new();
    let mut keep = |member: MemberEnd| {
        ends.push(member);
        ControlFlow::Continue(())
    };
    refused(system.ensemble(&request, &mut keep))?;
    for ((member, (truth, growth)), problem) in ends.iter().zip(&truths).zip(&members) {
        let ending = refused(member.ending.clone())?;
        if let Some(step) = ending.unresolved {
            return Err(Refused(format!("a member is flagged: {step:?}")));
        }
        if !matches!(ending.status, Status::Completed | Status::Stopped { .. }) {
            return Err(Refused(format!("a member: {}", ending.status)));
        }
        let [x, v, z] = problem.observed(truth.end);
        let found = problem.observed_of(&ending.q, &ending.p, ending.z);
        differ(
            &format!("member {name}"),
            &[&found[..], &[ending.t]].concat(),
            &[x, v, z, truth.t],
            3.0 * bound * (1.0 + growth),
        )?;
    }
    Ok(())
}
