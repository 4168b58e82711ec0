//! Attacks on discrete-herglotz. What starts a motion refuses what is not finite, and what it hands out is finite; formulas hand
//! on what is not a number, or refuse it.

use super::numbers::{Claiming, Everything, Grade, HOSTILE, Numbers, Report, fine, grade, places, triples};
use super::{Attack, Exceptions};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::systems::{Kepler, Pendulum, QuadraticInZ};
use contact_geom::{DiscretePoint, Lagrangian, PhasePoint, Structure, Symmetry, Triple, VelocityPoint};
use discrete_herglotz::{
    ActionFlow, ActionMap, ActionSplitting, ActionStrang, Composition, DiscreteLagrangian, DiscretePath, Event,
    EventStatus, Every, FinalOnly, Flow, Gauss, GaussRoute, HamiltonianFlow, InputError, Integrator, Method, Midpoint,
    MomentumDecay, MomentumRow, Observer, Record, Rectangle, Riccati, Scene, Solver, Splitting, SplittingScheme,
    Status, Stepper, Steps, Strang, Transition, Trapezoidal, Wanted, derived_jet, derived_second_jet, discrete_action,
    discrete_flow, discrete_flow_jacobian, discrete_momentum, discrete_regularity, discrete_symmetry_defect,
    hamiltonian_flow, hamiltonian_flow_jacobian, last_correction, legendre_minus, legendre_minus_inverse,
    legendre_plus, legendre_plus_inverse, run_with_events, sigma_d, statements, verified,
};

pub const EXCEPTIONS: Exceptions = &[
    ("Method::name", "takes no number"),
    ("Method::order", "takes no number"),
    ("Method::symmetric", "takes no number"),
    ("Method::implicit_in_z", "takes no number"),
    ("Method::exact_rate", "takes no number"),
    ("Method::check", "takes no number"),
    ("Method::applicable", "takes no number"),
    ("SplittingScheme::*", "tables: take no number"),
    ("Integrator::all", "takes no number"),
    ("Integrator::order", "takes no number; that of any number of stages is in the attack on check"),
    ("ActionFlow::*", "the implementor's; that of Riccati is attacked with what calls it"),
    ("Observer::*", "the implementor's; those of the library see finite steps only"),
];

pub const ATTACKS: &[Attack] = &[
    Attack { on: &["Composition::new"], run: compositions },
    Attack { on: &["Transition::checked"], run: transitions },
    Attack {
        on: &[
            "derived_jet",
            "derived_second_jet",
            "sigma_d",
            "legendre_minus",
            "legendre_plus",
            "discrete_regularity",
            "discrete_momentum",
            "discrete_symmetry_defect",
            "Quadrature::extended_jet",
            "DiscreteLagrangian::value",
            "DiscreteLagrangian::jet",
            "DiscreteLagrangian::second_jet",
        ],
        run: jets,
    },
    Attack {
        on: &[
            "discrete_flow",
            "discrete_flow_jacobian",
            "hamiltonian_flow",
            "hamiltonian_flow_jacobian",
            "legendre_minus_inverse",
            "legendre_plus_inverse",
            "DiscreteLagrangian::forward",
            "DiscreteLagrangian::backward",
        ],
        run: steps,
    },
    Attack {
        on: &[
            "Quadrature::new",
            "Quadrature::lagrangian",
            "Gauss::new",
            "Gauss::stages",
            "Method::discretise",
            "Strang::new",
            "ActionStrang::new",
            "ActionStrang::with_flow",
            "Every::new",
            "Every::into_inner",
            "DiscreteLagrangian::step_size",
        ],
        run: constructors,
    },
    Attack {
        on: &[
            "Flow::new",
            "Flow::with_guess",
            "Flow::from_points",
            "Flow::state",
            "Flow::time",
            "Flow::step",
            "Flow::run",
            "Flow::step_back",
            "Flow::suspicion",
            "DiscreteLagrangian::check_start",
            "DiscreteLagrangian::misfit",
        ],
        run: flows,
    },
    Attack {
        on: &[
            "Gauss::stepper",
            "Gauss::stepper_without_action",
            "GaussStepper::without_newton",
            "GaussStepper::route",
            "GaussStepper::newton_steps",
            "GaussStepper::dense",
            "DenseStep::span",
            "DenseStep::at",
            "DenseStep::velocity",
        ],
        run: gauss,
    },
    Attack {
        on: &["Gauss::clocked_stepper", "ClockedStepper::time_momentum", "ClockedStepper::advance_to"],
        run: clocked,
    },
    Attack { on: &["Event::new", "Event::in_direction", "Event::terminal", "run_with_events"], run: events },
    Attack {
        on: &[
            "Splitting::new",
            "Splitting::without_action",
            "Splitting::compensated",
            "Splitting::watched",
            "ActionSplitting::new",
            "ActionSplitting::with_flow",
            "ActionSplitting::compensated",
            "ActionMap::apply",
            "ActionMap::change",
        ],
        run: splittings,
    },
    Attack {
        on: &[
            "Stepper::advance",
            "Stepper::state",
            "Stepper::time",
            "Stepper::sigma",
            "Stepper::evaluations",
            "Stepper::suspicion",
        ],
        run: steppers,
    },
    Attack {
        on: &[
            "DiscretePath::new",
            "DiscretePath::points",
            "DiscretePath::steps",
            "DiscretePath::actions",
            "DiscretePath::action_differential",
            "DiscretePath::herglotz_residuals",
            "DiscretePath::extended_residuals",
            "discrete_action",
        ],
        run: paths,
    },
    Attack { on: &["MomentumRow::defect", "MomentumDecay::new"], run: momenta },
    Attack { on: &["last_correction"], run: corrections },
    Attack { on: &["Solver::on_the_stack", "Solver::by_faer", "Solver::solve"], run: solvers },
    Attack { on: &["Integrator::check"], run: integrators },
    Attack {
        on: &[
            "Scene::new",
            "Scene::from_time",
            "Scene::by",
            "Scene::steps",
            "Scene::wanting",
            "Scene::wanted",
            "Scene::plan",
            "Plan::step_size",
            "Plan::count",
            "Plan::error",
            "Plan::integrator",
            "Plan::items",
            "Plan::stepper",
            "Plan::run",
        ],
        run: scenes,
    },
    Attack { on: &["statements::residual"], run: residuals },
    Attack { on: &["verified"], run: claims },
];

/// Times and states to start from, and whether they are finite.
fn starts() -> Vec<(f64, PhasePoint<1>)> {
    places().into_iter().map(|(t, x)| (t, x.into())).collect()
}

/// Steps beside those that are refused.
const STEPS: [f64; 5] = [1e-300, 1e-12, 0.1, 1e3, 1e300];

/// A door that makes a stepper: it refuses a start that is not finite, and its states are finite.
fn drive<S: Stepper<1>>(report: &mut Report, input: &(impl Numbers + std::fmt::Debug), made: Result<S, InputError>) {
    let driven = made.map(|mut stepper| {
        let _ = stepper.advance(3);
        (stepper.state(), stepper.time(), if stepper.sigma() >= 0.0 { 0.0 } else { f64::NAN })
    });
    report.door(input, driven);
}

/// The constructor of a stepper under attack by its start and its step.
fn doors<S: Stepper<1>>(report: &mut Report, make: impl Fn(f64, f64, PhasePoint<1>) -> Result<S, InputError>) {
    for (t, x) in starts() {
        drive(report, &(t, x), make(0.1, t, x));
    }
    let tame: PhasePoint<1> = triples()[0].into();
    for h in HOSTILE.into_iter().chain(STEPS) {
        let made = make(h, 0.4, tame);
        let refused = !(h > 0.0 && h.is_finite());
        report.check(!refused || matches!(made, Err(InputError::Step { .. })), || format!("the step {h} is taken"));
        drive(report, &h, made);
    }
}

fn compositions(report: &mut Report) {
    let scheme = SplittingScheme::YOSHIDA_4;
    doors(report, |h, t, x| Composition::new(|h| Midpoint::new(Everything, h), &scheme, h, t, x));
}

fn splittings(report: &mut Report) {
    let scheme = SplittingScheme::BLANES_MOAN_6;
    doors(report, |h, t, x| Splitting::new(&Claiming, &scheme, h, t, x));
    doors(report, |h, t, x| {
        Splitting::new(&Claiming, &scheme, h, t, x).map(|s| s.watched().compensated().without_action())
    });
    let scheme = SplittingScheme::YOSHIDA_4;
    let system = QuadraticInZ::default();
    doors(report, |h, t, x| ActionSplitting::new(&system, &scheme, h, t, x).map(ActionSplitting::compensated));
    let flow = Riccati { b: -0.1, c: 0.0 };
    doors(report, |h, t, x| ActionSplitting::with_flow(&Claiming, &flow, &scheme, h, t, x));
    for value in HOSTILE {
        // A flow that is none of the Lagrangian's, or none at all.
        let flow = Riccati { b: value, c: value };
        let made = ActionSplitting::with_flow(&Claiming, &flow, &scheme, 0.1, 0.0, triples()[0].into());
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
    let gauss = Gauss::new(Everything, 4, 0.1).unwrap();
    let ld = Midpoint::new(Everything, 0.1).unwrap();
    let steppers: [Box<dyn Stepper<1> + '_>; 4] = [
        Box::new(gauss.stepper(0.0, start, start.p).unwrap()),
        Box::new(Flow::new(&ld, 0.0, start).unwrap()),
        Box::new(Splitting::new(&Claiming, &SplittingScheme::STRANG, 0.1, 0.0, start).unwrap()),
        Box::new(
            Composition::new(|h| Midpoint::new(Everything, h), &SplittingScheme::YOSHIDA_4, 0.1, 0.0, start).unwrap(),
        ),
    ];
    for mut stepper in steppers {
        // No step is no change.
        report.check(stepper.advance(0).is_ok() && stepper.state() == start && stepper.time() == 0.0, || {
            "no step".into()
        });
        report.check(stepper.sigma() == 1.0 && stepper.suspicion().is_none(), || "before the first step".into());
        report.check(stepper.advance(2).is_ok() && stepper.evaluations() > 0, || "two steps".into());
    }
}

fn transitions(report: &mut Report) {
    for x in triples() {
        for sigma in HOSTILE {
            let made = Transition { end: PhasePoint::from(x), velocity: x.y, sigma, iterations: 1 };
            let checked = made.checked();
            let good = x.is_finite() && sigma.is_finite() && sigma > 0.0;
            report.check(checked.is_ok() == good, || format!("{made:?}: {checked:?}"));
        }
    }
}

fn jets(report: &mut Report) {
    let ld = Trapezoidal::new(Everything, 0.1).unwrap();
    let group = Symmetry::Translation(SVector::from([1.0]));
    for (t, x) in places() {
        let at = DiscretePoint::from(x);
        let input = (t, x);
        report.formula(&input, ld.value(t, &at));
        for jet in [ld.jet(t, &at), derived_jet(&ld, t, &at)] {
            report.formula(&input, jet.map(|j| (j.value, (j.d1, j.d2), j.dz)));
        }
        for jet in [ld.second_jet(t, &at), derived_second_jet(&ld, t, &at)] {
            report.formula(&input, jet.map(|j| ((j.d11, j.d12, j.d22), (j.d1z, j.d2z, j.dzz))));
        }
        report.formula(&input, sigma_d(&ld, t, &at));
        report.formula(&input, legendre_minus(&ld, t, &at));
        report.formula(&input, legendre_plus(&ld, t, &at));
        report.formula(&input, discrete_regularity(&ld, t, &at).map(|r| (r.sigma, r.fibre.condition())));
        report.formula(&input, discrete_momentum(&ld, &group, t, &at));
        report.formula(&input, discrete_symmetry_defect(&ld, &group, t, &at));
        let s = ld.extended_jet(t, &at, 0.2);
        report.formula(&input, fine((s.value, (s.s1, s.s2), (s.z0, s.z1))));
    }
}

/// Single steps, of which only finite ones are handed out.
fn steps(report: &mut Report) {
    fn one<D: DiscreteLagrangian<1>>(report: &mut Report, ld: &D) {
        for (t, x) in starts() {
            let input = (t, x);
            let guess = SVector::from([0.5]);
            for solver in [&mut Solver::on_the_stack(), &mut Solver::by_faer()] {
                report.door(&input, ld.forward(t, &x, &guess, solver).map(|s| (s.end, s.velocity, s.sigma)));
                report.door(&input, ld.backward(t, &x, &guess, solver).map(|s| (s.end, s.velocity, s.sigma)));
            }
            report.door(&input, legendre_minus_inverse(ld, t, &x, &guess));
            report.door(&input, legendre_plus_inverse(ld, t, &x, &guess));
            for way in [HamiltonianFlow::Direct, HamiltonianFlow::ThroughPlus, HamiltonianFlow::ThroughMinus] {
                report.door(&input, hamiltonian_flow(ld, t, &x, &guess, way));
            }
            let points = DiscretePoint::from(Triple::from(x));
            let image = discrete_flow(ld, t, &points);
            report.door(&input, image);
            // Of a splitting they do not depend on the action.
            let without_z = (t, (x.q, x.p));
            let tame = grade(&input) != Grade::Bad;
            for jacobian in [hamiltonian_flow_jacobian(ld, t, &points), discrete_flow_jacobian(ld, t, &points, &points)]
            {
                if tame || grade(&without_z) == Grade::Bad {
                    report.formula(&input, jacobian);
                }
            }
        }
        let tame: PhasePoint<1> = triples()[0].into();
        for guess in HOSTILE {
            // A poor guess costs iterations, or the step: never a step that is none.
            let step = ld.forward(0.4, &tame, &SVector::from([guess]), &mut Solver::default());
            let good = step.as_ref().map_or(true, |s| grade(&s.end) != Grade::Bad);
            report.check(good, || format!("the guess {guess} leads to {step:?}"));
        }
    }
    one(report, &Midpoint::new(Everything, 0.1).unwrap());
    one(report, &Rectangle::new(Everything, 0.1).unwrap());
    one(report, &Gauss::new(Everything, 3, 0.1).unwrap());
    one(report, &Strang::new(Claiming, 0.1, 0.4, &triples()[0].into()).unwrap());
}

fn constructors(report: &mut Report) {
    let tame: PhasePoint<1> = triples()[0].into();
    for h in HOSTILE.into_iter().chain(STEPS) {
        let good = h > 0.0 && h.is_finite();
        let rule = Midpoint::new(Everything, h);
        report.check(rule.is_ok() == good && rule.as_ref().map_or(true, |r| r.step_size() == h), || format!("h = {h}"));
        report.check(rule.is_err() || rule.is_ok_and(|r| r.lagrangian().structure() == Structure::default()), || {
            "another".into()
        });
        report.check(Gauss::new::<1>(Everything, 8, h).is_ok() == good, || format!("Gauss with h = {h}"));
        let strang = Strang::new(Claiming, h, 0.4, &tame);
        report.check(good || strang.is_err(), || format!("Strang with h = {h}"));
        let strang = ActionStrang::new(QuadraticInZ::default(), h, 0.4, &tame);
        report.check(good || strang.is_err(), || format!("ActionStrang with h = {h}"));
        let strang = ActionStrang::with_flow(Claiming, &Riccati { b: -0.1, c: 0.0 }, h, 0.4, &tame);
        report.check(good || strang.is_err(), || format!("ActionStrang with a flow and h = {h}"));
        for method in Method::ALL {
            let made = method.discretise(Claiming, h, 0.4, &tame);
            report.check(good || made.is_err(), || format!("{method} with h = {h}"));
        }
    }
    for (t, x) in starts() {
        let bad = grade(&(t, x)) == Grade::Bad;
        report.check(!bad || Strang::new(Claiming, 0.1, t, &x).is_err(), || format!("Strang at t = {t}, {x:?}"));
    }
    for stages in [0, 1, 16, 17, usize::MAX] {
        let made = Gauss::new::<1>(Everything, stages, 0.1);
        let good = (1..=16).contains(&stages);
        report.check(made.is_ok() == good && made.is_ok_and(|g| g.stages() == stages) == good, || {
            format!("{stages} stages")
        });
    }
    report.check(Every::new(0, FinalOnly).is_err(), || "a stride of 0".into());
    let mut rare = Every::new(usize::MAX, Record::<1>::default()).unwrap();
    let ld = Midpoint::new(Everything, 0.1).unwrap();
    let status = Flow::new(&ld, 0.0, tame).unwrap().run(3, &mut rare);
    report.check(status == Ok(Status::Completed) && rare.into_inner().rows.len() == 1, || "a long stride".into());
}

fn flows(report: &mut Report) {
    let ld = Midpoint::new(Everything, 0.1).unwrap();
    for (t, x) in starts() {
        drive(report, &(t, x), Flow::new(&ld, t, x));
        drive(report, &(t, x), Flow::from_points(&ld, t, DiscretePoint::from(Triple::from(x))));
        if let Ok(mut flow) = Flow::new(&ld, t, x) {
            let seen = flow.run(3, &mut FinalOnly).is_ok() && flow.state().check().is_ok() && flow.time().is_finite();
            report.check(seen, || format!("{x:?}: {:?}", flow.state()));
            let mark = flow.suspicion().is_none_or(|s| s.step < 3 && s.misfit >= 1.0);
            report.check(mark, || format!("{x:?}: {:?}", flow.suspicion()));
            let back = flow.step_back().is_err() || flow.state().check().is_ok();
            report
                .check(back && flow.step().map_or(true, |s| s.to.check().is_ok()), || format!("{x:?}: back and forth"));
        }
    }
    let tame: PhasePoint<1> = triples()[0].into();
    for guess in HOSTILE {
        let made = Flow::with_guess(&ld, 0.0, tame, SVector::from([guess]));
        report.check(made.map_or(true, |f| f.state() == &tame), || format!("the guess {guess}"));
    }
    for number in HOSTILE {
        let (state, v) = (PhasePoint::new([number], [1.0], 0.0), SVector::from([number]));
        // What is not finite has no regular mass, and resolves nothing.
        let start = ld.check_start(0.0, &state, &v);
        report.check(number.is_finite() || start.is_err(), || format!("a start at {number}"));
        let calm = SVector::from([1.0]);
        let misfit = ld.misfit([&calm, &calm, &calm, &calm], &tame, number);
        let regular = (0.5..=2.0).contains(&number);
        report.check(misfit.is_none() == regular || number.abs() > 1.0, || format!("sigma = {number}: {misfit:?}"));
    }
    report.check(Flow::new(&ld, 0.0, tame).unwrap().run(0, &mut FinalOnly).is_err(), || "no step".into());
}

fn gauss(report: &mut Report) {
    let general = Gauss::new(Everything, 5, 0.1).unwrap();
    let condensed = Gauss::new(Claiming, 5, 0.1).unwrap();
    let one = SVector::from([1.0]);
    for (t, x) in starts() {
        drive(report, &(t, x), general.stepper(t, x, one));
        drive(report, &(t, x), condensed.stepper(t, x, one));
        drive(report, &(t, x), condensed.stepper_without_action(t, x, one));
        drive(report, &(t, x), general.stepper(t, x, one).map(|s| s.without_newton()));
    }
    for h in STEPS {
        let gauss = Gauss::new(Everything, 5, h).unwrap();
        drive(report, &h, gauss.stepper(0.0, triples()[0].into(), one));
        let gauss = Gauss::new(Claiming, 5, h).unwrap();
        drive(report, &h, gauss.stepper(0.0, triples()[0].into(), one));
    }
    for guess in HOSTILE {
        let made = general.stepper(0.0, triples()[0].into(), SVector::from([guess]));
        report.check(made.map_or(true, |s| grade(&s.state()) != Grade::Bad), || format!("the guess {guess}"));
    }
    let mut stepper = general.stepper(0.0, triples()[0].into(), one).unwrap();
    report.check(stepper.route() == GaussRoute::General && stepper.newton_steps() == 0, || "route".into());
    report
        .check(stepper.dense().is_none() && stepper.advance(2).is_ok(), || "dense output before the first step".into());
    let curve = stepper.dense().unwrap();
    report.check(curve.span() == (0.1, 0.2), || format!("the span {:?}", curve.span()));
    for t in HOSTILE {
        report.formula(&t, fine(curve.at(t)));
        report.formula(&t, fine(curve.velocity(t)));
    }
}

fn clocked(report: &mut Report) {
    let kepler = Kepler::<2>::default();
    let gauss = Gauss::new(kepler, 4, 0.2).unwrap();
    for value in HOSTILE {
        for x in [[value, 0.0, 0.0, 1.0], [1.0, value, 0.0, 1.0], [1.0, 0.0, value, 1.0], [value; 4]] {
            let start = PhasePoint::<2>::new([x[0], x[1]], [x[2], x[3]], 0.0);
            let made = gauss.clocked_stepper(kepler.clock(), 0.0, start, start.p).map(|mut stepper| {
                let _ = stepper.advance(3);
                (stepper.state(), stepper.time(), stepper.time_momentum())
            });
            report.door(&start, made);
        }
        let start = PhasePoint::<2>::new([1.0, 0.0], [0.0, 1.0], 0.0);
        report
            .check(value.is_finite() || gauss.clocked_stepper(kepler.clock(), value, start, start.p).is_err(), || {
                format!("from t = {value}")
            });
        // A time that is far away is not asked for: that many steps are what it takes.
        if !value.is_finite() || value.abs() < 1.0 {
            let mut stepper = gauss.clocked_stepper(kepler.clock(), 0.0, start, start.p).unwrap();
            let done = stepper.advance_to(value);
            let at = if value > 0.0 { value } else { 0.0 };
            // Of a time too short for its steps it says so, and stays.
            let there = done.is_ok() && (stepper.time() - at).abs() <= 1e-15;
            let refused = done.is_err() && stepper.time() == 0.0;
            let good = if value.is_finite() { there || refused && value < 1e-12 } else { refused };
            report.check(good, || format!("up to t = {value}: {done:?} at {}", stepper.time()));
        }
    }
}

fn events(report: &mut Report) {
    let gauss = Gauss::new(Everything, 4, 0.1).unwrap();
    let stepper = || gauss.stepper(0.0, triples()[0].into(), [0.5].into()).unwrap();
    for value in HOSTILE {
        let mut stepper = stepper();
        let run = run_with_events(&mut stepper, 5, &mut [Event::new(|_, _: &PhasePoint<1>| value).terminal()]).unwrap();
        let good = match run.status {
            EventStatus::Undefined { event: 0, .. } => !value.is_finite(),
            EventStatus::Completed => value.is_finite(),
            _ => false,
        };
        report.check(good && run.crossings.is_empty(), || format!("an event {value}: {:?}", run.status));
    }
    // One that is not a number in mid-run keeps what was found before.
    let late = Event::new(|t, _: &PhasePoint<1>| if t > 0.35 { f64::NAN } else { 0.25 - t });
    let run = run_with_events(&mut stepper(), 100, &mut [late]).unwrap();
    let good = matches!(run.status, EventStatus::Undefined { event: 0, t } if t > 0.35) && run.crossings.len() == 1;
    report.check(good && run.t <= 0.4 && run.state.check().is_ok(), || format!("{run:?}"));
    report.check(run_with_events(&mut stepper(), 0, &mut []).is_err(), || "no step".into());
    report.check(run_with_events(&mut stepper(), 3, &mut []).is_ok_and(|r| r.t > 0.29), || "no event".into());
    // As many steps as there are, ended by the event.
    let end = Event::new(|t, _: &PhasePoint<1>| t - 0.55).in_direction(discrete_herglotz::Direction::Rising).terminal();
    let run = run_with_events(&mut stepper(), usize::MAX, &mut [end]).unwrap();
    report.check(run.status == EventStatus::Terminated { event: 0 } && (run.t - 0.55).abs() < 1e-15, || {
        format!("{run:?}")
    });
}

fn paths(report: &mut Report) {
    let ld = Midpoint::new(Everything, 0.1).unwrap();
    for points in [vec![], vec![SVector::from([0.1])]] {
        report.check(DiscretePath::<1>::new(points).is_err(), || "a path without a step".into());
    }
    for value in HOSTILE {
        let points: Vec<_> = [0.3, value, 0.4].map(|q| SVector::from([q])).into();
        let path = DiscretePath::new(points.clone());
        report.check(path.is_ok() == value.is_finite(), || format!("a path through {value}"));
        let Ok(path) = path else {
            report.formula(&value, discrete_action(&ld, 0.0, &points, 0.0));
            continue;
        };
        report.check(path.steps() == 2 && path.points().len() == 3, || "its points".into());
        report.formula(&value, path.actions(&ld, 0.0, 0.0));
        report.formula(&value, path.action_differential(&ld, 0.0, 0.0));
        report.formula(&value, path.herglotz_residuals(&ld, 0.0, 0.0));
        report.formula(&value, path.extended_residuals(&ld, 0.0, 0.0));
        report.formula(&value, discrete_action(&ld, 0.0, &points, 0.0));
    }
    let path = DiscretePath::new([0.3, 0.35, 0.4].map(|q| SVector::from([q])).into()).unwrap();
    for value in HOSTILE {
        for (t0, z0) in [(value, 0.0), (0.0, value)] {
            report.formula(&value, path.actions(&ld, t0, z0));
            report.formula(&value, path.action_differential(&ld, t0, z0));
            report.formula(&value, path.herglotz_residuals(&ld, t0, z0));
            report.formula(&value, path.extended_residuals(&ld, t0, z0));
        }
    }
    report.check(discrete_action::<f64, 1>(&ld, 0.0, &[], 0.5) == Ok(0.5), || "the action of nothing".into());
}

fn momenta(report: &mut Report) {
    for value in HOSTILE {
        let row = MomentumRow { t: 0.0, momentum: value, predicted: 0.5 };
        report.formula(&value, fine(row.defect()));
        let row = MomentumRow { t: 0.0, momentum: 0.5, predicted: value };
        let defect = row.defect();
        // An infinite prediction is off by NaN; one of nothing by something that is infinite.
        report.check(!(defect <= 0.1), || format!("predicted {value}: {defect}"));
        let mut decay = MomentumDecay::new(Symmetry::Translation(SVector::from([1.0])));
        decay.start(0.0, &PhasePoint::new([0.1], [value], 0.0));
        report.check(decay.rows[0].momentum == value || decay.rows[0].momentum.is_nan() && value.is_nan(), || {
            format!("p = {value}")
        });
    }
}

/// An iteration does not end on a correction that is not a number.
fn corrections(report: &mut Report) {
    // Sizes are not negative.
    for value in HOSTILE.into_iter().filter(|v| v.is_nan() || *v >= 0.0) {
        report.check(value.is_finite() || !last_correction(value, 1.0, 1e-16), || format!("the correction {value}"));
        report.check(!value.is_nan() || !last_correction(1.0, value, 1e-16), || format!("after {value}"));
        report.check(!value.is_nan() || !last_correction(1.0, 1.0, value), || format!("the tolerance {value}"));
    }
}

fn solvers(report: &mut Report) {
    for value in HOSTILE {
        for matrix in [[1.0, value, 0.5, 2.0], [value, 0.0, 0.0, value], [value; 4], [value, 1.0, 1.0, value]] {
            for right in [[1.0, 1.0], [value, 1.0]] {
                for (name, mut solver) in [("stack", Solver::on_the_stack()), ("faer", Solver::by_faer())] {
                    let mut a = SMatrix::<f64, 2, 2>::from_row_slice(&matrix);
                    let mut b = SVector::from(right);
                    let solved = solver.solve(&mut a, &mut b);
                    let finite = b.iter().all(|x| x.is_finite());
                    let bad = matrix.iter().chain(&right).any(|x| !x.is_finite());
                    report
                        .check(solved.is_err() || finite && !bad, || format!("{name}: {matrix:?} of {right:?}: {b:?}"));
                    // What was bad does not stay in the workspace.
                    let mut b = SVector::from([2.0, 3.0]);
                    let good = solver.solve(&mut SMatrix::identity(), &mut b);
                    report
                        .check(good.is_ok() && b == SVector::from([2.0, 3.0]), || format!("{name}: after {matrix:?}"));
                }
            }
        }
    }
}

fn integrators(report: &mut Report) {
    let claims = Structure::default();
    for stages in [0, 17, usize::MAX] {
        let integrator = Integrator::Gauss { stages };
        let refused = integrator.check(&claims);
        report.check(refused == Err(InputError::Stages { found: stages }), || format!("{stages}: {refused:?}"));
    }
    report.check(Integrator::Splitting(SplittingScheme::STRANG).check(&claims).is_err(), || "unclaimed".into());
    let pair = Integrator::Composition(Method::Rectangle, SplittingScheme::YOSHIDA_4).check(&claims);
    report.check(matches!(pair, Err(InputError::Hypothesis { .. })), || format!("{pair:?}"));
}

fn scenes(report: &mut Report) {
    let start = VelocityPoint::from(triples()[0]);
    let scene = |span: f64| Scene::new(&Claiming, start, span).steps(Steps::Count(7));
    let run = |scene: &Scene<'_, Claiming, 1>| {
        scene.plan().and_then(|plan| plan.run()).map(|o| ((o.q, o.p), (o.z, o.t), o.conformal_factor))
    };
    for (t, x) in places() {
        let scene = Scene::new(&Claiming, x.into(), 0.5).from_time(t).steps(Steps::Count(7));
        for integrator in [
            Integrator::Gauss { stages: 6 },
            Integrator::Discrete(Method::Trapezoidal),
            Integrator::Splitting(SplittingScheme::BLANES_MOAN_6),
            Integrator::Composition(Method::Midpoint, SplittingScheme::YOSHIDA_4),
        ] {
            let made = Scene::new(&Claiming, x.into(), 0.5).from_time(t).steps(Steps::Count(7)).by(integrator);
            report.door(&(t, x), run(&made));
        }
        report.door(&(t, x), run(&scene));
    }
    for span in HOSTILE {
        let refused = !(span > 0.0 && span.is_finite());
        report.check(!refused || matches!(run(&scene(span)), Err(InputError::Span { .. })), || {
            format!("a span of {span}")
        });
        report.door(&span, run(&scene(span)));
    }
    for h in HOSTILE.into_iter().filter(|h| !(*h > 0.0 && *h < 1e-3)) {
        let made = scene(0.5).steps(Steps::Size(h));
        let refused = !(h > 0.0 && h.is_finite());
        report.check(!refused || matches!(run(&made), Err(InputError::Step { .. })), || format!("steps of {h}"));
        report.door(&h, run(&made));
    }
    for error in HOSTILE {
        let made = scene(0.5).steps(Steps::Accuracy(error));
        let refused = !(error > 0.0 && error.is_finite());
        report.check(!refused || matches!(run(&made), Err(InputError::Tolerance { .. })), || {
            format!("to an error of {error}")
        });
        if let Ok(plan) = made.plan() {
            let kept = plan.error().is_some_and(|found| found <= error) && plan.integrator().order() > 0;
            report.check(kept, || format!("{:?} where {error} is asked for", plan.error()));
        }
        report.door(&error, run(&made));
    }
    report.check(run(&scene(0.5).steps(Steps::Count(0))).is_err(), || "no step".into());
    for rows in [0, 1, usize::MAX] {
        let wanted = Wanted { rows: Some(rows), conformal_factor: true, ..Wanted::default() };
        let made = scene(0.5).wanting(wanted.clone());
        report.check(made.wanted() == &wanted, || "what is wanted".into());
        let outcome = made.plan().and_then(|plan| plan.run());
        let expected = [None, Some(8), Some(2)][[0, 1, usize::MAX].iter().position(|r| *r == rows).unwrap()];
        report.check(outcome.ok().map(|o| o.rows.len()) == expected, || format!("a row every {rows} steps"));
    }
    let plan = scene(0.5).plan().unwrap();
    report.check(plan.count() == 7 && (plan.step_size() - 0.5 / 7.0).abs() < 1e-16, || "seven steps".into());
    report.check(!plan.items().is_empty() && plan.stepper().is_ok(), || "a plan says what it does".into());
}

fn residuals(report: &mut Report) {
    let ld = Midpoint::new(Pendulum::default(), 0.1).unwrap();
    for (t, x) in places() {
        for statement in statements::STATEMENTS.into_iter().chain([0, 3, u32::MAX]) {
            let known = statements::STATEMENTS.contains(&statement);
            let found = statements::residual(statement, &ld, &[], t, &DiscretePoint::from(x));
            let good = match &found {
                Ok(None) => !known || [25, 26].contains(&statement),
                Ok(Some(r)) => known && (x.is_finite() || !(*r <= 1e-3)),
                Err(_) => known,
            };
            report.check(good, || format!("statement {statement} at t = {t}, {x:?}: {found:?}"));
        }
    }
}

/// A claim is verified where it can be, and where it cannot it is not taken for true.
fn claims(report: &mut Report) {
    for (t, x) in places() {
        let found = verified(&Claiming, t, &x.into());
        // The claims have nothing to do with the action.
        let bad = grade(&(t, (x.x, x.y))) == Grade::Bad;
        report.check(!bad || found.is_err(), || format!("at t = {t}, {x:?}: {found:?}"));
        report.check(grade(&(t, x)) != Grade::Tame || found == Ok(Claiming.structure()), || {
            format!("at t = {t}, {x:?}: {found:?}")
        });
    }
}
