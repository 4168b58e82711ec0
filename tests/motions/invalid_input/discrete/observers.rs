//! Invalid input to observers: rows, events, observers with odd requests, and their views of a run.

use super::runs::{BY, seven, tame};
use crate::common::observers::Each;
use crate::invalid_input::InputTest;
use crate::invalid_input::numbers::{EVERYTHING, EXTREME, Report, fine, triples};
use contact_geom::VelocityPoint;
use discrete_herglotz::{
    AnyIntegrator, CsvRows, Event, Events, InputError, Observer, Outcome, OutputRequest, Problem, Progress, Quotient,
    Rows, RunInfo, State, Status, StepError, StepView, Steps, Stop, Until,
};
use std::ops::ControlFlow;

pub const TESTS: &[InputTest] = &[
    InputTest {
        entries: &[
            "Rows::every",
            "Rows::at",
            "Rows::column",
            "Rows::with_velocity",
            "Rows::with_energy",
            "Rows::with_conformal_factor",
            "Rows::without_action",
            "Rows::header",
            "Row::numbers",
            "CsvRows::new",
        ],
        run: rows,
    },
    InputTest { entries: &["Progress::new", "Quotient::new", "Quotient::largest_change"], run: progress_and_quotients },
    InputTest {
        entries: &[
            "Event::new",
            "Event::rising",
            "Event::falling",
            "Event::terminal",
            "Events::new",
            "Events::without_action",
        ],
        run: events,
    },
    InputTest { entries: &["Run::observe", "Stop::here", "Stop::failed", "OutputRequest::and"], run: odd_observers },
    InputTest {
        entries: &[
            "StepView::velocity",
            "StepView::velocity_at",
            "StepView::energy",
            "StepView::last_step",
            "LastStep::span",
            "LastStep::ends",
            "LastStep::at",
        ],
        run: moments,
    },
];

fn rows(report: &mut Report) {
    let problem = tame();
    report.check(Rows::every(0).is_err(), || "a row every 0 steps".into());
    for (stride, expected) in [(1, 8), (7, 2), (usize::MAX, 2)] {
        let mut rows = Rows::every(stride).unwrap().without_action().with_velocity();
        let outcome = seven(&problem, None).observe(&mut rows).run(Until::Time(0.5));
        report.check(rows.rows.len() == expected, || format!("a row every {stride} steps: {outcome:?}"));
        report.entry_point(
            &0.5,
            outcome.map(|_| {
                rows.rows.iter().map(|r| (r.t, r.q.clone(), (r.p.clone(), r.v.clone(), r.z))).collect::<Vec<_>>()
            }),
        );
        report.check(rows.rows.iter().all(|r| r.v.is_some() && r.z.is_none()), || format!("{:?}", rows.rows));
        // The energy depends on z, whether or not z is requested.
        let mut whole = Rows::every(stride).unwrap().without_action().with_energy().with_conformal_factor();
        let mut csv = CsvRows::new(Rows::every(stride).unwrap(), Vec::new());
        let outcome = seven(&problem, None).observe(&mut whole).observe(&mut csv).run(Until::Time(0.5));
        report.entry_point(
            &0.5,
            outcome.map(|_| whole.rows.iter().map(|r| (r.energy, r.log_factor)).collect::<Vec<_>>()),
        );
        let of_header = whole.rows.iter().all(|r| r.numbers().count() == whole.header().len());
        report.check(of_header && csv.error.is_none(), || format!("{:?}: {:?}", whole.header(), whole.rows));
    }
    for value in EXTREME {
        // Times in order and inside of the span.
        let two = Rows::at([0.1, value]);
        report.check(two.is_ok() == value.is_finite(), || format!("rows at 0.1 and {value}"));
        for integrator in BY {
            if let Ok(mut two) = Rows::at([0.1, value]) {
                let refused = seven(&problem, integrator).observe(&mut two).run(Until::Time(0.5));
                report.check(matches!(refused, Err(InputError::Times { .. })), || format!("{value}: {refused:?}"));
            }
            let Ok(mut one) = Rows::at([value]) else { continue };
            let outcome = seven(&problem, integrator).observe(&mut one).run(Until::Time(0.5));
            let inside = (0.0..=0.5).contains(&value);
            report.check(outcome.is_ok() == inside, || format!("a row at {value}: {outcome:?}"));
            let recorded = one.rows.iter().map(|r| (r.t, r.q.clone(), (r.p.clone(), r.z))).collect::<Vec<_>>();
            // A time that is closer to the start than a step may not be reached.
            let complete = outcome.is_ok_and(|o| o.status == Status::Completed);
            report.check(!complete || recorded.len() == 1 && recorded[0].0 == value, || format!("{recorded:?}"));
            report.entry_point(&value, fine(recorded));
        }
        // A column is the caller's function: its value is recorded as it is.
        let mut columns = Rows::every(7).unwrap().column("value", |_, _| value).column("t", |t, _| t);
        let outcome = seven(&problem, None).observe(&mut columns).run(Until::Time(0.5));
        let handed_on = columns.rows.iter().all(|r| r.columns[0].to_bits() == value.to_bits() && r.columns[1] == r.t);
        report.check(handed_on && outcome.is_ok(), || format!("a column {value}: {:?}", columns.rows));
    }
    for bad in [&[0.1, 0.1][..], &[0.1, 0.3, 0.2], &[f64::NAN], &[0.1, f64::INFINITY]] {
        let refused = Rows::at(bad.iter().copied()).err();
        report.check(matches!(refused, Some(InputError::Times { .. })), || format!("{bad:?}: {refused:?}"));
    }
    let mut none = Rows::at([]).unwrap();
    let outcome = seven(&problem, None).observe(&mut none).run(Until::Time(0.5));
    report.check(outcome.is_ok_and(|o| o.steps == 7) && none.rows.is_empty(), || "no rows".into());
    // Backward in time the times decrease.
    for (times, good) in [([-0.1, -0.3], true), ([-0.3, -0.1], false), ([0.1, -0.3], false)] {
        let mut back = Rows::at(times).unwrap();
        let outcome = seven(&problem, None).observe(&mut back).run(Until::Time(-0.5));
        let recorded: Vec<f64> = back.rows.iter().map(|r| r.t).collect();
        report.check(outcome.is_ok() == good && (!good || recorded == times), || format!("{times:?}: {recorded:?}"));
    }
}

fn progress_and_quotients(report: &mut Report) {
    let problem = tame();
    for value in EXTREME {
        let mut parts = Vec::new();
        let mut progress = Progress::new(|part| parts.push(part));
        let outcome = seven(&problem, None).observe(&mut progress).run(Until::Time(value));
        let completed = outcome.is_ok_and(|o| o.status == Status::Completed);
        report.check(!completed || parts.last() == Some(&1.0), || format!("to {value}: {parts:?}"));
        // A quotient that is not defined is reported.
        let mut quotient = Quotient::new(move |_, _: &State| value, |_, _| 1.0);
        let outcome = seven(&problem, None).observe(&mut quotient).run(Until::Time(0.5));
        let change = quotient.largest_change();
        let good = if value.is_finite() && value != 0.0 { change == 0.0 } else { change.is_nan() };
        report.check(outcome.is_ok() && good, || format!("{value} over one changes by {change}"));
    }
    report.check(Quotient::new(|_, _| 1.0, |_, _| 1.0).largest_change() == 0.0, || "of no run".into());
}

/// A run of [`EVERYTHING`] by Gauss steps of a tenth with events, from t = 0.
fn with_events(events: &mut Events<'_>, until: Until) -> Result<Outcome, InputError> {
    let problem = Problem::new(&EVERYTHING, 0.0, VelocityPoint::from(triples()[0]))?;
    problem.by(AnyIntegrator::Gauss { stages: 4 }).steps(Steps::Size(0.1)).observe(events).run(until)
}

fn events(report: &mut Report) {
    for value in EXTREME {
        let mut events = Events::new([Event::new(|_, _: &State| value).terminal()]);
        let outcome = with_events(&mut events, Until::Steps(5)).unwrap();
        let good = match outcome.status {
            Status::Failed { step: 0, cause: StepError::Event { t: 0.0 }, .. } => !value.is_finite(),
            Status::Completed => value.is_finite(),
            _ => false,
        };
        report.check(good && events.crossings.is_empty(), || format!("an event {value}: {:?}", outcome.status));
        // A jump between any two values of different sign is found at its time.
        let mut jump = Events::new([Event::new(|t, _: &State| if t < 0.25 { value } else { -value })]).without_action();
        let outcome = with_events(&mut jump, Until::Steps(5)).unwrap();
        let there = jump.crossings.len() == 1 && (jump.crossings[0].t - 0.25).abs() < 1e-15;
        let good = if value == 0.0 || !value.is_finite() { jump.crossings.is_empty() } else { there };
        report.check(good && outcome.state().check().is_ok(), || format!("from {value}: {:?}", jump.crossings));
    }
    // Where a function becomes NaN during the run, the crossings found before are kept.
    let mut late = Events::new([Event::new(|t, _: &State| if t > 0.35 { f64::NAN } else { 0.25 - t })]);
    let outcome = with_events(&mut late, Until::Steps(100)).unwrap();
    let failed = matches!(outcome.status, Status::Failed { cause: StepError::Event { t }, .. } if t > 0.35);
    report.check(failed && late.crossings.len() == 1, || format!("{outcome:?}: {:?}", late.crossings));
    report.check(outcome.t <= 0.4 && outcome.state().check().is_ok(), || format!("{outcome:?}"));
    let mut none = Events::new([]);
    report.check(with_events(&mut none, Until::Steps(0)).is_err(), || "no step".into());
    report.check(with_events(&mut none, Until::Steps(3)).is_ok_and(|o| o.t > 0.29), || "no event".into());
    // The largest number of steps, ended by the event.
    let mut end = Events::new([Event::new(|t, _: &State| t - 0.55).rising().terminal()]);
    let outcome = with_events(&mut end, Until::Steps(1 << 42)).unwrap();
    let ended = matches!(outcome.status, Status::Stopped { step: 6, by: "an event", t } if t == outcome.t);
    report.check(ended && (outcome.t - 0.55).abs() < 1e-15, || format!("{outcome:?}"));
    // Directions are those of the run: backward in time a function of t falls.
    let of_time = |at: f64| Event::new(move |t, _: &State| t - at);
    for (at, found) in [(0.25, [0, 1]), (-0.25, [0, 2])] {
        let mut all = Events::new([of_time(at), of_time(at).rising(), of_time(at).falling()]);
        let outcome = with_events(&mut all, Until::Time(2.0 * at));
        let order: Vec<usize> = all.crossings.iter().map(|c| c.event).collect();
        report.check(outcome.is_ok() && order == found, || format!("{order:?} at {at}: {outcome:?}"));
    }
}

/// Ends the run at its start.
struct AtTheStart(Stop);

impl Observer for AtTheStart {
    fn start(&mut self, _at: &StepView<'_>) -> ControlFlow<Stop> {
        ControlFlow::Break(self.0.clone())
    }
    fn step(&mut self, _at: &StepView<'_>) -> ControlFlow<Stop> {
        ControlFlow::Continue(())
    }
}

/// Refuses every run.
struct Refusing;

impl Observer for Refusing {
    fn prepare(&mut self, course: &RunInfo) -> Result<(), InputError> {
        Err(InputError::Times { index: 0, t: course.t_end })
    }
    fn step(&mut self, _at: &StepView<'_>) -> ControlFlow<Stop> {
        ControlFlow::Continue(())
    }
}

/// Requests this step, whatever step has been taken, and records the steps that it sees.
struct AsksFor(usize, Vec<usize>);

impl Observer for AsksFor {
    fn next(&self, _taken: usize) -> usize {
        self.0
    }
    fn step(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        self.1.push(at.k);
        ControlFlow::Continue(())
    }
}

fn odd_observers(report: &mut Report) {
    let problem = tame();
    for integrator in BY {
        for until in [0.5, -0.5] {
            let mut weary = AtTheStart(Stop::here("one who is weary"));
            let run = seven(&problem, integrator).with_conformal_factor().observe(&mut weary);
            let outcome = run.run(Until::Time(until)).unwrap();
            let stopped = outcome.status == Status::Stopped { step: 0, t: 0.0, by: "one who is weary" };
            let nothing = (outcome.steps, outcome.t, outcome.log_factor) == (0, 0.0, Some(0.0));
            report.check(stopped && nothing && outcome.state() == *problem.state(), || format!("{outcome:?}"));
            let mut failing = AtTheStart(Stop::failed(StepError::NonFinite));
            let outcome = seven(&problem, integrator).observe(&mut failing).run(Until::Time(until)).unwrap();
            let failed = outcome.status == Status::Failed { step: 0, t: 0.0, cause: StepError::NonFinite };
            report.check(failed && outcome.state() == *problem.state(), || format!("{outcome:?}"));
            let refused = seven(&problem, integrator).observe(&mut Refusing).run(Until::Time(until));
            report.check(refused == Err(InputError::Times { index: 0, t: until }), || format!("{refused:?}"));
        }
        // A request for a past step is one for the next step; a request beyond the end is one for the last step.
        let every: Vec<usize> = (1..=7).collect();
        for (step, expected) in [(0, &every[..]), (3, &[3, 4, 5, 6, 7]), (7, &[7]), (usize::MAX, &[7])] {
            let mut odd = AsksFor(step, Vec::new());
            let outcome = seven(&problem, integrator).observe(&mut odd).run(Until::Time(0.5));
            report.check(outcome.is_ok() && odd.1 == expected, || format!("step {step}: {:?}, {outcome:?}", odd.1));
        }
    }
    // To the accuracy that is the default of a run.
    let mut last = AsksFor(usize::MAX, Vec::new());
    let outcome = problem.accuracy(1e-9).observe(&mut last).run(Until::Time(0.5)).unwrap();
    report.check(last.1 == [outcome.steps] && outcome.status == Status::Completed, || format!("{outcome:?}"));
    let all = [(false, false), (false, true), (true, false), (true, true)];
    for (a, b) in all.into_iter().flat_map(|a| all.map(|b| (a, b))) {
        let [of_a, of_b] = [a, b].map(|(action, conformal_factor)| OutputRequest {
            action,
            conformal_factor,
            ..OutputRequest::default()
        });
        let both = OutputRequest { action: a.0 || b.0, conformal_factor: a.1 || b.1, ..OutputRequest::default() };
        report.check(of_a.and(of_b) == both, || format!("{of_a:?} and {of_b:?}"));
    }
}

fn moments(report: &mut Report) {
    let problem = tame();
    for integrator in BY {
        for until in [0.5, -0.5] {
            let mut at_start = None;
            let mut seen = 0;
            let mut look = Each(|at: &StepView<'_>| {
                report.entry_point(&at.t, at.velocity());
                report.entry_point(&at.t, at.energy());
                for value in EXTREME {
                    report.entry_point(&value, at.velocity_at(at.t, &State::new([value], [value], value)));
                }
                let Some(step) = at.last_step() else { return };
                let (start, end) = step.ends();
                let (from, to) = (start.0, end.0);
                let met = at_start.replace(end.clone()).is_none_or(|before| before == *start);
                let at_ends = step.at(from).as_ref() == Ok(&start.1) && step.at(to).as_ref() == Ok(&end.1);
                let ends = at_ends && *end == (at.t, at.state.clone());
                report.check(met && ends && step.span() == (from, to), || format!("{from} to {to}"));
                for t in EXTREME {
                    report.entry_point(&t, step.at(t));
                }
                seen += 1;
            });
            let outcome = seven(&problem, integrator).observe(&mut look).run(Until::Time(until)).unwrap();
            report.check(outcome.status == Status::Completed && seen == 7, || format!("{outcome:?}"));
        }
    }
    // At the start there is no step; the last one may be taken by itself, since declared properties are checked there.
    let mut kinds = Vec::new();
    let mut start = Start(&mut kinds);
    let outcome = seven(&problem, None).observe(&mut start).run(Until::Time(0.5));
    let counted = kinds.first() == Some(&(0, false)) && kinds.len() == 2 && kinds[1].0 == 7;
    report.check(outcome.is_ok() && counted, || format!("{kinds:?}"));
}

/// Records whether there is a last step, at the start and after all steps.
struct Start<'k>(&'k mut Vec<(usize, bool)>);

impl Observer for Start<'_> {
    fn next(&self, _taken: usize) -> usize {
        usize::MAX
    }
    fn start(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        self.step(at)
    }
    fn step(&mut self, at: &StepView<'_>) -> ControlFlow<Stop> {
        self.0.push((at.k, at.last_step().is_some()));
        ControlFlow::Continue(())
    }
}
