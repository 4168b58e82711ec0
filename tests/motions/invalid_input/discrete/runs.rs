//! Invalid input to problems, runs and plans.

use crate::invalid_input::InputTest;
use crate::invalid_input::numbers::{CLAIMING, EXTREME, Grade, Report, grade, places, triples};
use crate::lagrangians::One;
use contact_geom::nalgebra::SVector;
use contact_geom::{DiscretePoint, Lagrangian, PhasePoint, Scalar, VelocityPoint};
use discrete_herglotz::{
    AnyIntegrator, InputError, Outcome, Problem, Rows, Run, SplittingScheme, Start, Status, Steps, Until, Vector,
    rules::{Method, Rule},
};

pub const TESTS: &[InputTest] = &[
    InputTest { entries: &["AnyIntegrator::check"], run: integrators },
    InputTest {
        entries: &[
            "Problem::new",
            "Problem::from_points",
            "Problem::lagrangian",
            "Problem::t0",
            "Problem::start",
            "Problem::state",
            "Problem::structure",
            "Outcome::state",
        ],
        run: problems,
    },
    InputTest {
        entries: &[
            "Problem::by",
            "Problem::steps",
            "Problem::accuracy",
            "Run::by",
            "Run::steps",
            "Run::without_action",
            "Run::with_conformal_factor",
            "Run::with_error_estimate",
            "Run::with_exact_states",
            "Run::scales",
            "Run::plan",
            "Run::run",
            "Plan::step_size",
            "Plan::count",
            "Plan::error",
            "Plan::integrator",
            "Plan::entries",
            "Plan::stepper",
            "Plan::run",
        ],
        run: runs,
    },
];

/// A free particle that declares no structure.
#[derive(Clone, Copy, Debug)]
pub struct Silent;

impl Lagrangian<1> for Silent {
    fn value<T: Scalar>(&self, _t: T, _q: &SVector<T, 1>, v: &SVector<T, 1>, _z: T) -> T {
        v[0] * v[0] * 0.5
    }
}

/// A Lagrangian without coordinates.
struct Empty;

impl Lagrangian<0> for Empty {
    fn value<T: Scalar>(&self, _t: T, _q: &SVector<T, 0>, _v: &SVector<T, 0>, z: T) -> T {
        z
    }
}

fn integrators(report: &mut Report) {
    for stages in [0, 17, usize::MAX] {
        for integrator in [AnyIntegrator::Gauss { stages }, AnyIntegrator::TransformedGauss { stages }] {
            let refused = integrator.check(&CLAIMING);
            report.check(refused == Err(InputError::Stages { found: stages }), || format!("{integrator}: {refused:?}"));
        }
    }
    report.check(AnyIntegrator::Splitting(SplittingScheme::STRANG).check(&One::from(Silent)).is_err(), || {
        "unclaimed".into()
    });
    let pair = AnyIntegrator::Composition(Method::Rectangle, SplittingScheme::YOSHIDA_4).check(&One::from(Silent));
    report.check(matches!(pair, Err(InputError::Hypothesis { .. })), || format!("{pair:?}"));
}

/// Each kind of integrator for [`CLAIMING`], and none.
pub const BY: [Option<AnyIntegrator>; 5] = [
    None,
    Some(AnyIntegrator::Gauss { stages: 6 }),
    Some(AnyIntegrator::Discrete(Method::Trapezoidal)),
    Some(AnyIntegrator::Splitting(SplittingScheme::BLANES_MOAN_6)),
    Some(AnyIntegrator::Composition(Method::Midpoint, SplittingScheme::YOSHIDA_4)),
];

/// [`CLAIMING`] from an ordinary start at t = 0.
pub fn tame() -> Problem<'static, One, 1> {
    Problem::new(&CLAIMING, 0.0, VelocityPoint::from(triples()[0])).unwrap()
}

/// A run in seven steps.
pub fn seven<'p, 'o>(problem: &'p Problem<'p, One, 1>, by: Option<AnyIntegrator>) -> Run<'p, 'o, Problem<'p, One, 1>> {
    let run = problem.steps(Steps::Count(7));
    if let Some(by) = by { run.by(by) } else { run }
}

/// All numbers of an outcome.
type Ends = ((Vector, Vector), (Option<f64>, f64), (Option<Vector>, Option<f64>));

fn numbers(o: Outcome) -> Ends {
    ((o.q, o.p), (o.z, o.t), (o.v, o.log_factor))
}

fn problems(report: &mut Report) {
    let state: PhasePoint<1> = triples()[0].into();
    let rules = [0.1, -0.1].map(|h| Rule::MIDPOINT.of(CLAIMING, h).unwrap());
    for (t, x) in places() {
        let velocity = Problem::new(&CLAIMING, t, VelocityPoint::from(x));
        report.entry_point(&(t, x), velocity.map(|problem| (*problem.start(), *problem.state())));
        let kept = velocity.is_ok_and(|p| p.t0() == t && *p.structure() == p.lagrangian().structure());
        report.check(kept || velocity.is_err(), || format!("{velocity:?}"));
        let momentum = Problem::new(&CLAIMING, t, PhasePoint::from(x));
        report.entry_point(&(t, x), momentum.map(|problem| (*problem.start(), *problem.state())));
        for ld in &rules {
            let points = Problem::from_points(&CLAIMING, ld, t, DiscretePoint::from(x));
            report.entry_point(&(t, x), points.map(|problem| (*problem.start(), *problem.state())));
        }
        // The outcome of a run is a valid start.
        let outcome = velocity.and_then(|problem| seven(&problem, None).without_action().run(Until::Time(t + 0.5)));
        let again = outcome.as_ref().ok().map(|o| (o.state(), Problem::new(&CLAIMING, o.t, o)));
        let good = again.as_ref().is_none_or(|(state, _)| state.check().is_ok() && state.z == x.z);
        report.check(good, || format!("{outcome:?} leads to {again:?}"));
        let again = again.and_then(|(state, problem)| Some((state, *problem.ok()?.state())));
        report.check(again.as_ref().is_none_or(|(end, start)| end == start), || format!("{again:?}"));
    }
    for guess in EXTREME {
        // A poor guess costs iterations, or the start is refused; the velocity is finite.
        let made = Problem::new(&CLAIMING, 0.4, Start::Momentum(state, SVector::from([guess])));
        let good = made.is_ok_and(|problem| grade(&problem.start().v) != Grade::Bad && problem.state() == &state);
        report.check(good || made.is_err(), || format!("the guess {guess} leads to {made:?}"));
    }
    let nowhere = VelocityPoint { q: SVector::zeros(), v: SVector::zeros(), z: 0.3 };
    report.check(Problem::<_, 0>::new(&Empty, 0.0, nowhere).err() == Some(InputError::Dimension), || "empty".into());
}

fn runs(report: &mut Report) {
    for (t, x) in places() {
        for integrator in BY {
            let problem = Problem::new(&CLAIMING, t, VelocityPoint::from(x));
            let run = |problem: Problem<'_, _, 1>| seven(&problem, integrator).run(Until::Time(t + 0.5)).map(numbers);
            report.entry_point(&(t, x), problem.and_then(run));
        }
    }
    let problem = tame();
    let in_seven = |until| seven(&problem, None).with_conformal_factor().with_error_estimate().run(until).map(numbers);
    let by_steps = |steps| problem.steps(steps).run(Until::Time(0.5)).map(numbers);
    for span in EXTREME {
        report.check(span.is_finite() || matches!(in_seven(Until::Time(span)), Err(InputError::Span { .. })), || {
            format!("a span of {span}")
        });
        report.entry_point(&span, in_seven(Until::Time(span)));
    }
    for h in EXTREME.into_iter().filter(|h| !(*h > 0.0 && *h < 1e-3)) {
        let refused = !(h > 0.0 && h.is_finite());
        report.check(!refused || matches!(by_steps(Steps::Size(h)), Err(InputError::Step { .. })), || {
            format!("steps of {h}")
        });
        report.entry_point(&h, by_steps(Steps::Size(h)));
    }
    // A number of steps of a size, where no size is too small.
    for h in EXTREME {
        for count in [0, 1, 7, usize::MAX] {
            let ended = problem.steps(Steps::Size(h)).run(Until::Steps(count));
            let refused = h == 0.0 || !h.is_finite() || count == 0 || count == usize::MAX;
            report.check(!refused || ended.is_err(), || format!("{count} steps of {h}: {ended:?}"));
            report.entry_point(&h, ended.map(numbers));
        }
    }
    for error in EXTREME {
        let made = problem.accuracy(error);
        let refused = !(error > 0.0 && error.is_finite());
        let ended = problem.accuracy(error).run(Until::Time(0.5)).map(numbers);
        report.check(!refused || matches!(ended, Err(InputError::Tolerance { .. })), || {
            format!("to an error of {error}")
        });
        if let Ok(plan) = made.plan(Until::Time(0.5)) {
            let kept = plan.error().is_some_and(|found| found <= error) && plan.integrator().order > 0;
            report.check(kept, || format!("{:?} where {error} is asked for", plan.error()));
        }
        report.entry_point(&error, ended);
    }
    for scale in EXTREME {
        let ended = problem.accuracy(1e-3).scales([scale]).with_error_estimate().run(Until::Time(0.5)).map(numbers);
        let refused = !(scale > 0.0 && scale.is_finite());
        report.check(refused == matches!(ended, Err(InputError::Scale { .. })), || format!("a scale of {scale}"));
        report.entry_point(&scale, ended);
    }
    report.check(by_steps(Steps::Count(0)).is_err(), || "no step".into());
    let unsized_steps = problem.steps(Steps::Count(7)).run(Until::Steps(7));
    report.check(matches!(unsized_steps, Err(InputError::Hypothesis { .. })), || "steps of no size".into());
    for (until, way) in [(0.5, 1.0), (-0.5, -1.0)] {
        let mut rows = Rows::every(1).unwrap();
        let run = seven(&problem, None).observe(&mut rows);
        let plan = run.plan(Until::Time(until)).unwrap();
        let good = plan.count() == 7 && (plan.step_size() - way * 0.5 / 7.0).abs() < 1e-16;
        report.check(good, || format!("seven steps of {}", plan.step_size()));
        report.check(!plan.entries().is_empty() && plan.stepper().is_ok(), || "a plan says what it does".into());
        // The plan is run without observers.
        let (alone, observed) = (plan.run(), run.run(Until::Time(until)));
        report.check(alone == observed && alone.as_ref().is_ok_and(|o| o.status == Status::Completed), || {
            format!("{alone:?}")
        });
        report.check(rows.rows.len() == 8, || format!("{} rows", rows.rows.len()));
    }
}
