//! Invalid input to steppers: flows, Gauss collocation, splittings, compositions, and to what monitors them.

use super::{STEPS, starts};
use crate::common::forces::Drag;
use crate::common::gauss::GaussSteppers;
use crate::forces::forced_one;
use crate::invalid_input::InputTest;
use crate::invalid_input::numbers::{CLAIMING, EVERYTHING, EXTREME, Grade, Numbers, Report, fine, grade, triples};
use crate::lagrangians::one;
use contact_examples::systems::{Kepler, QuadraticInZ};
use contact_geom::nalgebra::SVector;
use contact_geom::statements::AnyForce;
use contact_geom::{ChartVector, DiscretePoint, Lagrangian, PhasePoint, Symmetry};
use discrete_herglotz::{
    DiscreteLagrangian, InputError, Problem, RunSupport, SplittingScheme, Start, StepDetails, Stepper, StepperOptions,
    Steps, TransformedGauss, Until,
    checks::{EnergyDrift, EnergySample},
    gauss::{Gauss, GaussRoute, GaussStepper, TransformedStepper, VirtualWork},
    rules::{Composition, Flow, Rule},
    splitting::{ActionFlow, ActionMap, ActionSplitting, DragSplitting, Riccati, Splitting},
};

pub const TESTS: &[InputTest] = &[
    InputTest { entries: &["Composition::new"], run: compositions },
    InputTest {
        entries: &[
            "Flow::new",
            "Flow::with_guess",
            "Flow::from_points",
            "Flow::state",
            "Flow::time",
            "Flow::step",
            "Flow::step_back",
            "Flow::unresolved",
            "DiscreteLagrangian::check_start",
            "DiscreteLagrangian::defect",
        ],
        run: flows,
    },
    InputTest {
        entries: &[
            "Gauss::lagrangian",
            "GaussStepper::new",
            "GaussStepper::without_newton",
            "GaussStepper::route",
            "GaussStepper::newton_steps",
            "StepDetails::dense",
            "DenseStep::span",
            "DenseStep::at",
            "DenseStep::velocity",
        ],
        run: gauss,
    },
    InputTest {
        entries: &["VirtualWork::of_step", "VirtualWork::residual", "VirtualWork::impulse"],
        run: virtual_work,
    },
    InputTest {
        entries: &[
            "TransformedStepper::new",
            "TransformedStepper::time_momentum",
            "TransformedStepper::advance_to",
            "RunSupport::advance_until",
        ],
        run: transformed,
    },
    InputTest {
        entries: &[
            "Splitting::new",
            "Splitting::without_action",
            "Splitting::compensated",
            "Splitting::with_resolution_check",
            "DragSplitting::new",
            "DragSplitting::without_action",
            "DragSplitting::with_resolution_check",
            "ActionSplitting::new",
            "ActionSplitting::with_flow",
            "ActionSplitting::compensated",
            "ActionMap::apply",
            "ActionMap::change",
        ],
        run: splittings,
    },
    InputTest {
        entries: &[
            "Stepper::advance",
            "Stepper::state",
            "Stepper::time",
            "Stepper::sigma",
            "Stepper::evaluations",
            "RunSupport::unresolved",
            "RunSupport::suspect_interval",
            "RunSupport::guess",
            "StepDetails::last_velocity",
        ],
        run: steppers,
    },
    InputTest { entries: &["EnergyDrift::new", "EnergyDrift::defect"], run: drifts },
];

/// Where an energy is not a number or is extreme, there is no defect, or one above 1.
fn drifts(report: &mut Report) {
    let tame = EnergySample { total: 1.0, kinetic: 0.5, terms: 0.5, log_factor: 0.0, taken: 0 };
    for value in EXTREME {
        let wild = [
            EnergySample { total: value, ..tame },
            EnergySample { kinetic: value, ..tame },
            EnergySample { terms: value, ..tame },
        ];
        for (start, wild) in wild.iter().flat_map(|w| [(tame, *w), (*w, tame), (*w, *w)]) {
            for log_factor in [0.0, -1.0, value] {
                let mut drift = EnergyDrift::new(2, &start);
                let found = drift.defect(&EnergySample { log_factor, taken: 100, ..wild }, |_| 0.0);
                report.check(found.is_none_or(|defect| defect > 1.0), || format!("{start:?}, {wild:?}: {found:?}"));
            }
        }
    }
}

/// An entry point that makes a stepper: a start that is not finite is refused, and the states are finite.
fn drive<S: Stepper>(report: &mut Report, input: &(impl Numbers + std::fmt::Debug), made: Result<S, InputError>) {
    let driven = made.map(|mut stepper| {
        let _ = stepper.advance(3);
        (stepper.state(), stepper.time(), if stepper.sigma() >= 0.0 { 0.0 } else { f64::NAN })
    });
    report.entry_point(input, driven);
}

/// The constructor of a stepper with invalid starts and steps.
fn constructor<S: Stepper>(report: &mut Report, make: impl Fn(f64, f64, PhasePoint<1>) -> Result<S, InputError>) {
    for (t, x) in starts() {
        drive(report, &(t, x), make(0.1, t, x));
    }
    let tame: PhasePoint<1> = triples()[0].into();
    for h in EXTREME.into_iter().chain(STEPS) {
        let made = make(h, 0.4, tame);
        let refused = h == 0.0 || !h.is_finite();
        report.check(!refused || matches!(made, Err(InputError::Step { .. })), || format!("the step {h} is taken"));
        drive(report, &h, made);
    }
}

/// The contact defect of one step, from invalid starts and with invalid stages and steps.
fn virtual_work(report: &mut Report) {
    let forced = forced_one(EVERYTHING, AnyForce(0.3));
    let group = Symmetry::Translation(SVector::from([1.0]));
    let guess = SVector::from([0.5]);
    for (t, x) in starts() {
        let found = VirtualWork::of_step(&forced, 2, 0.1, t, &x, &guess);
        report.entry_point(&(t, x), found.map(|step| (step.end, step.residual(), step.impulse(&group))));
    }
    let tame: PhasePoint<1> = triples()[0].into();
    for h in EXTREME {
        let found = VirtualWork::of_step(&forced, 2, h, 0.4, &tame, &guess);
        let refused = h == 0.0 || !h.is_finite();
        report.check(!refused || matches!(found, Err(InputError::Step { .. })), || format!("the step {h} is taken"));
    }
    for stages in [0, 17] {
        let found = VirtualWork::of_step(&forced, stages, 0.1, 0.4, &tame, &guess);
        report.check(found == Err(InputError::Stages { found: stages }), || format!("{stages} stages: {found:?}"));
    }
}

fn compositions(report: &mut Report) {
    let scheme = SplittingScheme::YOSHIDA_4;
    constructor(report, |h, t, x| Composition::new(|h| Rule::MIDPOINT.of(EVERYTHING, h), &scheme, h, t, x));
}

fn splittings(report: &mut Report) {
    let scheme = SplittingScheme::BLANES_MOAN_6;
    constructor(report, |h, t, x| Splitting::new(&CLAIMING, &scheme, h, t, x));
    constructor(report, |h, t, x| {
        Splitting::new(&CLAIMING, &scheme, h, t, x).map(|s| s.with_resolution_check().compensated().without_action())
    });
    let dragged = forced_one(CLAIMING, Drag { c: 0.3, k: 0.0 });
    constructor(report, |h, t, x| {
        DragSplitting::new(&dragged, &scheme, h, t, x).map(|s| s.with_resolution_check().without_action())
    });
    let scheme = SplittingScheme::YOSHIDA_4;
    let turbulent = forced_one(CLAIMING, Drag { c: 0.3, k: 0.4 });
    constructor(report, |h, t, x| DragSplitting::new(&turbulent, &scheme, h, t, x));
    let system = one(QuadraticInZ::default());
    constructor(report, |h, t, x| ActionSplitting::new(&system, &scheme, h, t, x).map(ActionSplitting::compensated));
    let flow = Riccati { b: -0.1, c: 0.0 };
    constructor(report, |h, t, x| ActionSplitting::with_flow(&CLAIMING, &flow, &scheme, h, t, x));
    for value in EXTREME {
        // A flow that does not belong to the Lagrangian, or that is not a flow.
        let flow = Riccati { b: value, c: value };
        let made = ActionSplitting::with_flow(&CLAIMING, &flow, &scheme, 0.1, 0.0, triples()[0].into());
        report.check(made.is_err(), || format!("the flow {flow:?} is taken"));
        report.formula(
            &value,
            fine(Riccati { b: -0.1, c: 0.3 }.over(0.1).apply(value))
                .map(|z| if value.is_finite() && !z.is_finite() { 0.0 } else { z }),
        );
        let map = Riccati { b: -0.1, c: 0.3 }.over(0.1);
        let (change, end) = (map.change(value), map.apply(value));
        report.check(change.is_nan() == end.is_nan() || !value.is_finite(), || format!("{value} moves by {change}"));
    }
}

fn steppers(report: &mut Report) {
    let start: PhasePoint<1> = triples()[0].into();
    let gauss = Gauss::new(EVERYTHING, 4, 0.1).unwrap();
    let ld = Rule::MIDPOINT.of(EVERYTHING, 0.1).unwrap();
    let steppers: [Box<dyn RunSupport + '_>; 4] = [
        Box::new(gauss.stepper(0.0, start, start.p).unwrap()),
        Box::new(Flow::new(&ld, 0.0, start).unwrap()),
        Box::new(Splitting::new(&CLAIMING, &SplittingScheme::STRANG, 0.1, 0.0, start).unwrap()),
        Box::new(
            Composition::new(|h| Rule::MIDPOINT.of(EVERYTHING, h), &SplittingScheme::YOSHIDA_4, 0.1, 0.0, start)
                .unwrap(),
        ),
    ];
    let mut other = gauss.stepper(0.0, PhasePoint { p: -start.p, ..start }, -start.p).unwrap();
    let foreign = other.advance(1).ok().and_then(|()| other.dense()).unwrap();
    for mut stepper in steppers {
        // No step changes nothing.
        report.check(stepper.advance(0).is_ok() && stepper.state() == start && stepper.time() == 0.0, || {
            "no step".into()
        });
        let blank = stepper.sigma() == 1.0 && stepper.unresolved().is_none() && stepper.suspect_interval().is_none();
        let velocity = |stepper: &dyn RunSupport| stepper.last_step().and_then(|step| step.last_velocity());
        report.check(blank && velocity(&*stepper).is_none(), || "before the first step".into());
        // The guess of another motion changes the work alone.
        stepper.guess(&foreign);
        report.check(stepper.advance(2).is_ok() && stepper.evaluations() > 0, || "two steps".into());
        let v = velocity(&*stepper);
        report.check(v.as_ref().is_none_or(|v| v.iter().all(|v| v.is_finite())), || format!("{v:?}"));
        report.check(stepper.suspect_interval().is_none_or(|d| d.step + d.steps <= 2), || {
            "a suspect interval beyond the steps taken".into()
        });
    }
}

fn flows(report: &mut Report) {
    let ld = Rule::MIDPOINT.of(EVERYTHING, 0.1).unwrap();
    for (t, x) in starts() {
        drive(report, &(t, x), Flow::new(&ld, t, x));
        drive(report, &(t, x), Flow::from_points(&ld, t, DiscretePoint::from(ChartVector::from(x))));
        if let Ok(mut flow) = Flow::new(&ld, t, x) {
            let _ = flow.advance(3);
            let seen = flow.state().check().is_ok() && flow.time().is_finite();
            report.check(seen, || format!("{x:?}: {:?}", flow.state()));
            let valid = flow.unresolved().is_none_or(|s| s.step < 3 && s.defect >= 1.0);
            report.check(valid, || format!("{x:?}: {:?}", flow.unresolved()));
            let back = flow.step_back().is_err() || flow.state().check().is_ok();
            report
                .check(back && flow.step().map_or(true, |s| s.to.check().is_ok()), || format!("{x:?}: back and forth"));
        }
    }
    let tame: PhasePoint<1> = triples()[0].into();
    for guess in EXTREME {
        let made = Flow::with_guess(&ld, 0.0, tame, SVector::from([guess]));
        report.check(made.map_or(true, |f| f.state() == &tame), || format!("the guess {guess}"));
    }
    for number in EXTREME {
        let (state, v) = (PhasePoint::new([number], [1.0], 0.0), SVector::from([number]));
        // Where W is not finite it is not regular, and no motion is resolved.
        let start = ld.check_start(0.0, &state, &v);
        report.check(number.is_finite() || start.is_err(), || format!("a start at {number}"));
        let calm = SVector::from([1.0]);
        let defect = ld.defect([&calm, &calm, &calm, &calm], &tame, number);
        let regular = (0.5..=2.0).contains(&number);
        report.check(defect.is_none() == regular || number.abs() > 1.0, || format!("sigma = {number}: {defect:?}"));
    }
}

fn tame_start<L: Lagrangian<1>>(lagrangian: &L) -> Problem<'_, L, 1> {
    Problem::new(lagrangian, 0.0, Start::Momentum(triples()[0].into(), SVector::from([1.0]))).unwrap()
}

fn gauss(report: &mut Report) {
    let general = Gauss::new(EVERYTHING, 5, 0.1).unwrap();
    let condensed = Gauss::new(CLAIMING, 5, 0.1).unwrap();
    let one = SVector::from([1.0]);
    for (t, x) in starts() {
        drive(report, &(t, x), general.stepper(t, x, one));
        drive(report, &(t, x), condensed.stepper(t, x, one));
        drive(report, &(t, x), condensed.stepper_without_action(t, x, one));
        drive(report, &(t, x), general.stepper(t, x, one).map(|s| s.without_newton()));
    }
    for h in STEPS {
        let gauss = Gauss::new(EVERYTHING, 5, h).unwrap();
        drive(report, &h, gauss.stepper(0.0, triples()[0].into(), one));
        let gauss = Gauss::new(CLAIMING, 5, h).unwrap();
        drive(report, &h, gauss.stepper(0.0, triples()[0].into(), one));
    }
    for guess in EXTREME {
        let made = general.stepper(0.0, triples()[0].into(), SVector::from([guess]));
        report.check(made.map_or(true, |s| grade(&s.state()) != Grade::Bad), || format!("the guess {guess}"));
    }
    let mut stepper = general.stepper(0.0, triples()[0].into(), one).unwrap();
    report.check(stepper.route() == GaussRoute::General && stepper.newton_steps() == 0, || "route".into());
    report
        .check(stepper.dense().is_none() && stepper.advance(2).is_ok(), || "dense output before the first step".into());
    let curve = stepper.dense().unwrap();
    report.check(curve.span() == (0.1, 0.2), || format!("the span {:?}", curve.span()));
    for t in EXTREME {
        report.formula(&t, fine(curve.at(t)));
        report.formula(&t, fine(curve.velocity(t)));
    }
    let problem = tame_start(&EVERYTHING);
    for (stages, h) in [0, 1, 16, 17, usize::MAX].into_iter().flat_map(|s| EXTREME.map(|h| (s, h))) {
        let made = GaussStepper::new(&problem, stages, h, StepperOptions::default());
        let good = (1..=16).contains(&stages) && h != 0.0 && h.is_finite();
        report.check(good || made.is_err(), || format!("{stages} stages, h = {h}"));
    }
    let back = Gauss::new(EVERYTHING, 5, -0.1).unwrap();
    let mut stepper = back.stepper(0.0, triples()[0].into(), one).unwrap();
    let span = stepper.advance(1).ok().and_then(|()| stepper.dense()).map(|curve| curve.span());
    report.check(span == Some((0.0, -0.1)), || format!("the span {span:?} of a step back"));
}

fn transformed(report: &mut Report) {
    let kepler = Kepler::<2>::default();
    let problem = Problem::new(&kepler, 0.0, PhasePoint::<2>::new([1.0, 0.0], [0.0, 1.0], 0.0)).unwrap();
    for (stages, h) in [0, 1, 16, 17, usize::MAX].into_iter().flat_map(|s| EXTREME.map(|h| (s, h))) {
        let good = (1..=16).contains(&stages) && h != 0.0 && h.is_finite();
        let made = TransformedStepper::new(&problem, stages, h).map(|stepper| stepper.time());
        report.check(good || made.is_err(), || format!("{stages} stages, h = {h}"));
        let own = problem.by(TransformedGauss { stages }).steps(Steps::Size(h)).run(Until::Steps(1)).is_err();
        report.check(good || own, || format!("TransformedGauss {stages}, h = {h}"));
    }
    for (value, h) in EXTREME.into_iter().flat_map(|value| [(value, 0.2), (value, -0.2)]) {
        let gauss = Gauss::new(kepler, 4, h).unwrap();
        for x in [[value, 0.0, 0.0, 1.0], [1.0, value, 0.0, 1.0], [1.0, 0.0, value, 1.0], [value; 4]] {
            let start = PhasePoint::<2>::new([x[0], x[1]], [x[2], x[3]], 0.0);
            let made = gauss.transformed_stepper(0.0, start, start.p).map(|mut stepper| {
                let _ = stepper.advance(3);
                (stepper.state(), stepper.time(), stepper.time_momentum())
            });
            report.entry_point(&start, made);
        }
        let start = PhasePoint::<2>::new([1.0, 0.0], [0.0, 1.0], 0.0);
        report.check(value.is_finite() || gauss.transformed_stepper(value, start, start.p).is_err(), || {
            format!("from t = {value}")
        });
        // A distant time is not requested, since it takes that many steps.
        if !value.is_finite() || value.abs() <= 1.0 {
            let mut stepper = gauss.transformed_stepper(0.0, start, start.p).unwrap();
            let done = stepper.advance_to(value);
            let at = if value * h > 0.0 { value } else { 0.0 };
            // A time that is too short for its steps is refused, and the state does not change.
            let there = done.is_ok() && (stepper.time() - at).abs() <= 1e-15;
            let refused = done.is_err() && stepper.time() == 0.0;
            let good = if value.is_finite() { there || refused && value.abs() < 1e-12 } else { refused };
            report.check(good, || format!("up to t = {value}: {done:?} at {}", stepper.time()));
        }
    }
}
