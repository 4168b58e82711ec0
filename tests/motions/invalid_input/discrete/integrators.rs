//! Invalid input to integrators and their constructors, and to runs that are saved and resumed.

use super::runs::{BY, seven, tame};
use super::{STEPS, starts};
use crate::common::observers::Each;
use crate::invalid_input::InputTest;
use crate::invalid_input::numbers::{CLAIMING, EXTREME, Report};
use crate::lagrangians::One;
use contact_geom::{PhasePoint, VelocityPoint};
use discrete_herglotz::{
    AnyIntegrator, Checkpoint, CheckpointError, CustomMethod, DiscreteLagrangian, InputError, Integrator, MethodInfo,
    PlanEntry, Problem, ResumeState, SplittingScheme, Status, StepView, Stepper, StepperOptions, Steps, Until,
    rules::{CompositionMethod, DiscretizationMethod, Method, Rule},
};

pub const TESTS: &[InputTest] = &[
    InputTest {
        entries: &[
            "DiscretizationMethod::check",
            "DiscretizationMethod::discretise",
            "DiscretizationMethod::info",
            "CustomMethod::symmetric",
        ],
        run: discretisations,
    },
    InputTest {
        entries: &[
            "Integrator::check",
            "Integrator::info",
            "Integrator::stepper",
            "CompositionMethod::new",
            "RunSupport::work_summary",
            "RunSupport::has_constant_rate",
            "PlanEntry::computed",
            "PlanEntry::skipped",
        ],
        run: integrators,
    },
    InputTest { entries: &["CustomMethod::new", "MethodInfo::of_discrete", "Run::accuracy"], run: orders },
    InputTest { entries: &["RunSupport::save", "RunSupport::restore"], run: saved },
    InputTest {
        entries: &[
            "Checkpoint::every",
            "StepView::resume_state",
            "ResumeState::read",
            "ResumeState::write",
            "ResumeState::from_bytes",
            "ResumeState::to_bytes",
            "Run::resume",
        ],
        run: resumed,
    },
];

/// A discrete Lagrangian is made for every valid step.
fn discretisations(report: &mut Report) {
    fn one(report: &mut Report, rule: &impl DiscretizationMethod<'static, One, 1>) {
        let info = rule.info();
        report.check(rule.check(&CLAIMING).is_ok() && info.symmetric && info.order == 2, || format!("{info:?}"));
        for h in EXTREME.into_iter().chain(STEPS) {
            let made = rule.discretise(&tame(), h).map(|ld| ld.step_size());
            let good = h != 0.0 && h.is_finite();
            report.check(if good { made == Ok(h) } else { made.is_err() }, || format!("{}: {made:?}", info.name));
        }
    }
    one(report, &Rule::MIDPOINT);
    one(report, &Method::Trapezoidal);
    one(report, &CustomMethod::new("mine", 2, |h| Rule::MIDPOINT.of(CLAIMING, h)).symmetric());
}

/// A stepper starts at a finite state with a valid step, and its states are finite.
fn integrators(report: &mut Report) {
    fn one(report: &mut Report, by: &dyn Integrator<'static, One, 1>, options: StepperOptions) {
        let info = by.info();
        let said = !info.name.is_empty() && info.order > 0 && info.cost_per_evaluation > 0;
        report.check(said && by.check(&CLAIMING).is_ok(), || format!("{info:?}"));
        let driven = |mut stepper: Box<dyn Stepper>| {
            let _ = stepper.advance(3);
            (stepper.state(), stepper.time())
        };
        for (t, x) in starts() {
            let made = Problem::new(&CLAIMING, t, x).and_then(|problem| by.stepper(&problem, 0.1, options));
            report.entry_point(&(t, x), made.map(driven));
        }
        for h in EXTREME.into_iter().chain(STEPS) {
            let made = by.stepper(&tame(), h, options);
            let refused = h == 0.0 || !h.is_finite();
            report.check(!refused || made.is_err(), || format!("{}: the step {h} is taken", info.name));
            report.entry_point(&h, made.map(driven));
        }
        let mut stepper = by.stepper(&tame(), 0.1, options).unwrap();
        let support = stepper.run_support().unwrap();
        let (work_summary, constant_rate) = (support.work_summary(), support.has_constant_rate());
        report.check(!work_summary.is_empty() && work_summary.iter().all(|i| !i.why.is_empty()), || {
            format!("{work_summary:?}")
        });
        // An integrator that reports a constant rate has the same rate in all steps.
        let mut rate = || stepper.advance(1).map(|()| stepper.sigma());
        let same = rate() == rate();
        report.check(same || !constant_rate, || format!("{}: another rate", info.name));
    }
    let rule = Rule::MIDPOINT;
    for options in [
        StepperOptions::default(),
        StepperOptions { action: true, check_resolution: true, ..StepperOptions::default() },
    ] {
        one(report, &rule, options);
        one(report, &CompositionMethod::new(rule, SplittingScheme::YOSHIDA_4), options);
        for by in BY.into_iter().flatten() {
            one(report, &by, options);
        }
    }
    let nystrom = CompositionMethod::new(rule, SplittingScheme::BLANES_MOAN_6);
    let refused = Integrator::<'_, One, 1>::check(&nystrom, &CLAIMING);
    report.check(matches!(refused, Err(InputError::Hypothesis { .. })), || format!("{refused:?}"));
    let items = [PlanEntry::computed("this", "said"), PlanEntry::skipped("that", "said")];
    report.check(items.map(|item| item.computed) == [true, false], || "items".into());
}

/// The order is given by the user; a false one costs evaluations, or fails the run.
fn orders(report: &mut Report) {
    let problem = tame();
    for order in [0, 1, 2, 1000, u32::MAX] {
        let by = || CustomMethod::new("mine", order, |h| Rule::MIDPOINT.of(CLAIMING, h));
        report.check(MethodInfo::of_discrete::<1>("mine", order).order == order, || "another order".into());
        let given = problem.by(by()).steps(Steps::Count(7)).run(Until::Time(0.5)).map(|o| (o.q, o.p));
        report.check(given.is_ok() == (order > 0), || format!("order {order}: {given:?}"));
        for error in [1e-4, 0.0, f64::NAN, -1.0] {
            let found = problem.by(by()).accuracy(error).run(Until::Time(0.5)).map(|o| (o.q, o.p));
            let reported = matches!(found, Ok(_) | Err(InputError::Accuracy { .. }));
            let good = if order > 0 && error > 0.0 { reported } else { found.is_err() };
            report.check(good, || format!("order {order} to an error of {error}: {found:?}"));
        }
    }
}

/// Data that are too short or too long for the state of a stepper.
fn saved(report: &mut Report) {
    let start: PhasePoint<1> = *tame().state();
    for by in BY.into_iter().flatten() {
        let stepper = || {
            Integrator::stepper(
                &by,
                &tame(),
                0.1,
                StepperOptions { action: true, check_resolution: true, ..StepperOptions::default() },
            )
            .unwrap()
        };
        let restores =
            |stepper: &mut Box<dyn Stepper>, words: &[u64]| stepper.run_support_mut().unwrap().restore(words);
        let mut first = stepper();
        report.check(first.advance(3).is_ok(), || format!("{by}: three steps"));
        let words = first.run_support().unwrap().save().unwrap();
        for cut in [0, 1, words.len() / 2, words.len() - 1] {
            report.check(!restores(&mut stepper(), &words[..cut]), || format!("{by}: {cut} words of {}", words.len()));
        }
        let longer: Vec<u64> = words.iter().copied().chain([0]).collect();
        report.check(!restores(&mut stepper(), &longer), || format!("{by}: a word too many"));
        let mut second = stepper();
        report.check(second.state() == start && restores(&mut second, &words), || format!("{by}: its own words"));
        let on = first.advance(2).is_ok() && second.advance(2).is_ok();
        let same = (first.state(), first.time(), first.sigma()) == (second.state(), second.time(), second.sigma());
        report.check(on && same, || format!("{by}: {:?} and {:?}", first.state(), second.state()));
    }
}

/// Data that are no checkpoint are refused, and so is the checkpoint of another run.
fn resumed(report: &mut Report) {
    let path = std::env::temp_dir().join(format!("invalid_input_checkpoint_{}", std::process::id()));
    report.check(Checkpoint::every(0, &path).is_err(), || "a checkpoint every 0 steps".into());
    for count in 0..6 {
        for value in EXTREME {
            std::fs::write(&path, value.to_le_bytes().repeat(count)).unwrap();
            let read = ResumeState::read(&path);
            report.check(matches!(read, Err(CheckpointError::Foreign)), || format!("{count} of {value}: {read:?}"));
        }
    }
    let problem = tame();
    for by in BY {
        let until = Until::Time(0.5);
        let whole = seven(&problem, by).run(until).unwrap();
        for stride in [3, 7, usize::MAX] {
            let mut last = Checkpoint::every(stride, &path).unwrap();
            let outcome = seven(&problem, by).observe(&mut last).run(until).unwrap();
            report.check(outcome == whole && last.error.is_none(), || format!("{:?}: {outcome:?}", last.error));
            // The last checkpoint is at the end of the run, where no step is left.
            let resumed = || seven(&problem, by).resume(ResumeState::read(&path).unwrap());
            report.check(resumed().run(until).as_ref() == Ok(&whole), || format!("{:?}", resumed().run(until)));
            let others = [resumed().run(Until::Time(0.6)), resumed().steps(Steps::Count(8)).run(until)];
            let others = others.into_iter().chain([
                resumed().by(AnyIntegrator::Gauss { stages: 3 }).run(until),
                resumed().with_conformal_factor().run(until),
            ]);
            for other in others {
                report.check(other == Err(InputError::AnotherRun), || format!("another run: {other:?}"));
            }
        }
        // A state that is kept by hand in the middle of a run, and written to a path that does not exist.
        let mut kept = None;
        let mut keep = Each(|at: &StepView<'_>| {
            if at.k == 3 {
                kept = at.resume_state();
            }
        });
        seven(&problem, by).observe(&mut keep).run(until).unwrap();
        if let Some(kept) = kept {
            report.check(kept.write(path.join("below a file")).is_err(), || "a file below a file".into());
            kept.write(&path).unwrap();
            let read = ResumeState::read(&path).unwrap();
            report.check(read == kept && seven(&problem, by).resume(read).run(until).as_ref() == Ok(&whole), || {
                "by hand".into()
            });
            let bytes = kept.to_bytes();
            report.check(std::fs::read(&path).unwrap() == bytes, || "the bytes are not those of the file".into());
            for place in [0, 8, 20, bytes.len() / 2, bytes.len() - 1] {
                let mut other = bytes.clone();
                other[place] ^= 4;
                let cut = &bytes[..place];
                let read = [other.as_slice(), cut].map(ResumeState::from_bytes);
                report.check(read.iter().all(Result::is_err), || format!("{place} of {}: {read:?}", bytes.len()));
            }
        }
        for value in EXTREME.into_iter().filter(|value| value.abs() < 10.0) {
            let other = Problem::new(&CLAIMING, 0.0, VelocityPoint::new([value], [0.7], 0.2)).unwrap();
            let run = seven(&other, by).resume(ResumeState::read(&path).unwrap()).run(until);
            report.check(run == Err(InputError::AnotherRun), || format!("from {value}: {run:?}"));
        }
        report.check(whole.status == Status::Completed, || format!("{whole:?}"));
    }
    std::fs::remove_file(path).unwrap();
}
