//! Systems that are defined at run time, compared with the types of the libraries.

#![allow(clippy::unwrap_used)] // Tests unwrap, in helpers too.

#[path = "motions/catalogue.rs"]
mod catalogue;
#[path = "motions/constrained_derivatives.rs"]
mod constrained_derivatives;
#[path = "motions/constraints.rs"]
mod constraints;
#[path = "motions/corners.rs"]
mod corners;
#[path = "motions/dimensions.rs"]
mod dimensions;
#[path = "motions/ensembles.rs"]
mod ensembles;
#[path = "motions/ensembles_own_steps.rs"]
mod ensembles_own_steps;
#[path = "motions/geometry.rs"]
mod geometry;
#[path = "motions/hamiltonian_derivatives.rs"]
mod hamiltonian_derivatives;
#[path = "motions/hamiltonians.rs"]
mod hamiltonians;
#[path = "motions/interrupted.rs"]
mod interrupted;

use contact_geom::VelocityPoint;
use discrete_herglotz::{AnyIntegrator, InputError, Problem, ResumeState, Status, Steps, Until};
use formula_lagrangian::Formula;
use herglotz_runtime::{
    CatalogueEntry, Check, Column, Crossing, Direction, Ensemble, Event, MemberEnd, Motion, OutputTimes, RunMonitor,
    RuntimeError, Sample, Start, StepControl, System, Varied,
};
use std::ops::ControlFlow;

const GAUSS: AnyIntegrator = AnyIntegrator::Gauss { stages: 8 };

fn by_steps(count: usize) -> StepControl {
    StepControl::Steps { by: GAUSS, steps: Steps::Count(count) }
}

fn accurate(error: f64) -> StepControl {
    StepControl::Accuracy { error, by: None }
}

fn pendulum() -> System {
    System::parse("theta'^2/2 + cos(theta) + gamma*z", &["theta"], &[("gamma", -0.1)]).unwrap()
}

fn start_of(entry: &CatalogueEntry) -> Start {
    Start::new(entry.t, entry.q, entry.v, 0.2)
}

/// Records of a motion.
#[derive(Default)]
pub struct Seen {
    pub rows: Vec<Vec<f64>>,
    pub crossings: Vec<Crossing>,
    /// The times of the nodes.
    pub nodes: Vec<f64>,
    /// The number of polls after which the motion is ended.
    pub polls: Option<usize>,
    pub interrupted: Option<ResumeState>,
}

impl RunMonitor for Seen {
    fn row(&mut self, numbers: &[f64]) -> ControlFlow<()> {
        self.rows.push(numbers.to_vec());
        ControlFlow::Continue(())
    }
    fn crossing(&mut self, crossing: &Crossing) -> ControlFlow<()> {
        self.crossings.push(crossing.clone());
        ControlFlow::Continue(())
    }
    fn node(&mut self, t: f64, _x: [&[f64]; 3], _z: f64) {
        self.nodes.push(t);
    }
    fn poll(&mut self, _part: f64) -> ControlFlow<()> {
        match &mut self.polls {
            Some(0) => ControlFlow::Break(()),
            Some(left) => {
                *left -= 1;
                ControlFlow::Continue(())
            }
            None => ControlFlow::Continue(()),
        }
    }
    fn interrupted(&mut self, at: ResumeState) {
        self.interrupted = Some(at);
    }
}

#[test]
fn a_run_is_that_of_the_typed_formula() {
    let system = pendulum();
    let formula = system.formula();
    let motion = Motion {
        rows: Some(OutputTimes::At(vec![0.0, 2.5, 5.0, 20.0])),
        columns: ["t", "theta", "theta'", "p_theta", "z", "energy", "exp(-gamma*t)*theta*theta'"]
            .map(|text| Column::parse(text, formula).unwrap())
            .into(),
        events: vec![Event { direction: Direction::Rising, ..Event::new(formula.expression("theta'").unwrap()) }],
        nodes: true,
        ..Motion::new(Start::new(0.0, [1.0], [0.0], 0.0), 20.0, by_steps(50))
    };
    let mut seen = Seen::default();
    let outcome = system.run(&motion, &mut seen).unwrap();

    let typed = formula.lagrangian::<1>().unwrap();
    let problem = Problem::new(&typed, 0.0, VelocityPoint::new([1.0], [0.0], 0.0)).unwrap();
    let expected = problem.by(GAUSS).steps(Steps::Count(50)).run(Until::Time(20.0)).unwrap();
    assert_eq!((outcome.q[0], outcome.p[0], outcome.z), (expected.q[0], expected.p[0], expected.z));
    assert_eq!((seen.nodes.len(), seen.rows.len()), (51, 4));
    let last = &seen.rows[3];
    assert_eq!([last[0], last[1], last[3]], [20.0, expected.q[0], expected.p[0]]);
    assert_eq!(last[6], (2.0f64).exp() * last[1] * last[2]);
    // theta' rises through 0 at the left turning points.
    assert!(seen.crossings.len() == 3, "{:?}", seen.crossings);
    for crossing in &seen.crossings {
        assert!(crossing.v[0].abs() < 1e-14 && crossing.q[0] < 0.0, "{crossing:?}");
    }
}

/// Energy, momenta and conformal factor by name in columns and events, for one motion and for an ensemble.
#[test]
fn quantities_in_columns_and_events() {
    let system = System::parse("x'^2 - x^2/2 + gamma*z", &["x"], &[("gamma", -0.2)]).unwrap();
    let formula = system.formula();
    let column = |text: &str| Column::parse(text, formula).unwrap();
    let event = |text: &str| Event::new(formula.expression(text).unwrap());
    let motion = Motion {
        rows: Some(OutputTimes::At(vec![1.0, 1.25, 3.0, 6.0])),
        columns: ["t", "energy/sigma", "sigma", "log_factor + 1", "p_x/2 - x'", "energy", "x'^2 + x^2/2 - gamma*z"]
            .map(column)
            .into(),
        events: ["sigma - 0.5", "energy - 0.25", "p_x"].map(event).into(),
        ..Motion::new(
            Start::new(1.0, [1.0], [0.0], 0.0),
            6.0,
            StepControl::Steps { by: GAUSS, steps: Steps::Count(50) },
        )
    };
    let mut seen = Seen::default();
    system.run(&motion, &mut seen).unwrap();
    for row in &seen.rows {
        let exact = f64::exp(-0.2 * (row[0] - 1.0));
        // The steps are exact to round-off: gauss_8 with h = 0.1.
        assert!((row[1] - 0.5).abs() < 1e-13 && (row[2] - exact).abs() < 1e-14, "{row:?}");
        assert!((row[3] - 1.0 - exact.ln()).abs() < 1e-14 && row[4].abs() < 1e-14, "{row:?}");
        assert!((row[5] - row[6]).abs() < 1e-14, "{row:?}");
    }
    // e^(gamma (t - t0)) = sigma = 1/2 at this time, where the energy sigma/2 is 1/4.
    let half = 1.0 + f64::ln(0.5) / -0.2;
    let times = |event: usize| seen.crossings.iter().filter(|c| c.event == event).map(|c| c.t).collect::<Vec<_>>();
    for event in 0..2 {
        assert!(matches!(times(event)[..], [t] if (t - half).abs() < 1e-11), "{:?}", times(event));
    }
    assert!(times(2).len() == 1 && seen.crossings.iter().all(|c| c.event != 2 || c.v[0].abs() < 1e-13));

    let starts = |i: usize| Start::new(1.0, [1.0 + i as f64], [0.0], 0.0);
    let many = Ensemble {
        count: 3,
        start: &starts,
        t0: 1.0,
        varied: Some(Varied { names: &["gamma"], values: &|i| vec![-0.1 * i as f64] }),
        end: 6.0,
        step_control: StepControl::Steps { by: GAUSS, steps: Steps::Count(50) },
        rows: None,
        columns: &["sigma", "energy"].map(column),
        events: &[event("sigma - 0.75")],
        threads: Some(1),
    };
    for (i, member) in members(&system, &many).into_iter().enumerate() {
        let (gamma, ending) = (-0.1 * i as f64, member.ending.unwrap());
        let (sigma, x) = (f64::exp(5.0 * gamma), 1.0 + i as f64);
        assert!((ending.columns[0] - sigma).abs() < 1e-14, "{:?}", ending.columns);
        assert!((ending.columns[1] - sigma * x * x / 2.0).abs() < 1e-12, "{:?}", ending.columns);
        assert_eq!(member.crossings.len(), usize::from(sigma < 0.75));
        assert!(member.crossings.iter().all(|c| (gamma * (c.t - 1.0) - f64::ln(0.75)).abs() < 1e-12));
    }

    // A rate that depends on the motion is known in rows, but not in events.
    let system = System::parse("x'^2/2 - x^2/2 - z^2/8", &["x"], &[]).unwrap();
    let function = system.formula().expression("sigma - 0.5").unwrap();
    let motion = Motion {
        rows: Some(OutputTimes::At(vec![0.55, 2.0])),
        columns: vec![
            Column::parse("log(sigma) - log_factor", system.formula()).unwrap(),
            Column::parse("log_factor", system.formula()).unwrap(),
        ],
        ..Motion::new(Start::new(0.0, [1.0], [0.0], 1.0), 2.0, by_steps(20))
    };
    let (_, rows) = system.record(&motion).unwrap();
    assert!(rows.iter().all(|row| row[0].abs() < 1e-15 && row[1] < -1e-3), "{rows:?}");
    let events = vec![Event::new(function)];
    let error = system.run(&Motion { events, ..motion }, &mut ()).unwrap_err();
    assert!(matches!(error, RuntimeError::FactorInEvent), "{error}");
}

/// Events by velocities of a mass matrix that is not diagonal: of a separable Lagrangian velocities are products of the
/// inverse of this matrix; of one with the rate of a function of x in addition, of the same motion, they are found at each
/// state.
#[test]
fn events_by_velocities() {
    let crossings = |more: &str| {
        let text = format!("x'^2 + x'*y' + 3*y'^2/2 + cos(x - y) - x^2/2{more}");
        let system = System::parse(&text, &["x", "y"], &[]).unwrap();
        let event = Event::new(system.formula().expression("x' - 0.3*y' - 0.1*x").unwrap());
        let start = Start::new(0.0, [1.0, 0.4], [0.2, -0.5], 0.0);
        let motion = Motion { events: vec![event], ..Motion::new(start, 20.0, by_steps(200)) };
        let mut seen = Seen::default();
        system.run(&motion, &mut seen).unwrap();
        (system.structure().separable, seen.crossings)
    };
    let ((is_separable, found), (is_other_separable, expected)) = (crossings(""), crossings(" + x*x'"));
    assert!(is_separable && !is_other_separable);
    assert!(found.len() > 5 && found.len() == expected.len(), "{found:?}, {expected:?}");
    for (a, b) in found.iter().zip(&expected) {
        let off = [a.t - b.t, a.v[0] - b.v[0], a.v[1] - b.v[1], a.v[0] - 0.3 * a.v[1] - 0.1 * a.q[0]];
        // The round-off of sixty steps, and of the time of a root.
        assert!(off.iter().all(|off| off.abs() <= 64.0 * 16.0 * f64::EPSILON), "{a:?}, {b:?}");
        // p = M v.
        let of_p = [a.p[0] - (2.0 * a.v[0] + a.v[1]), a.p[1] - (a.v[0] + 3.0 * a.v[1])];
        assert!(of_p.iter().all(|off| off.abs() <= 16.0 * f64::EPSILON), "{a:?}");
    }
}

#[test]
fn a_terminal_event_ends_the_rows_too() {
    let system = pendulum();
    let event = Event { terminal: true, ..Event::new(system.formula().expression("theta").unwrap()) };
    let motion = Motion {
        rows: Some(OutputTimes::At((0..=40).map(|k| 0.1 * f64::from(k)).collect())),
        columns: vec![Column::Time, Column::Position(0)],
        events: vec![event],
        ..Motion::new(Start::new(0.0, [1.0], [0.0], 0.0), 4.0, by_steps(4))
    };
    let mut seen = Seen::default();
    let outcome = system.run(&motion, &mut seen).unwrap();
    assert!(matches!(outcome.status, Status::Stopped { .. }) && outcome.q[0].abs() < 1e-15, "{outcome:?}");
    // All rows before the event, and none after it.
    let times: Vec<f64> = seen.rows.iter().map(|row| row[0]).collect();
    let expected = (0..=40).map(|k| 0.1 * f64::from(k)).filter(|t| *t <= outcome.t).collect::<Vec<_>>();
    assert_eq!(times, expected);
    assert!(seen.rows.iter().all(|row| row[1] > 0.0));
}

#[test]
fn an_interrupted_motion_goes_on_to_the_last_bit() {
    goes_on(&pendulum(), OutputTimes::Every(100), 100.0, by_steps(2000));
    // Rows at given times of the whole motion, one of which is the time of the interruption; forward and backward.
    let times = |end: f64| (0..=1000).map(move |k| if k == 1000 { end } else { end * f64::from(k) / 1000.0 }).collect();
    for end in [100.0, -100.0] {
        goes_on(&pendulum(), OutputTimes::At(times(end)), end, by_steps(2000));
        let slow = System::parse("x'^2/2 + cos(x) - 0.001*z", &["x"], &[]).unwrap();
        goes_on(&slow, OutputTimes::At(times(30.0 * end)), 30.0 * end, accurate(1e-6));
    }
}

fn goes_on(system: &System, rows: OutputTimes, end: f64, control: StepControl) {
    let motion = Motion {
        rows: Some(rows),
        columns: vec![Column::Time, Column::Position(0), Column::Action],
        resumable: true,
        ..Motion::new(Start::new(0.0, [1.0], [0.0], 0.0), end, control)
    };
    let mut whole = Seen::default();
    let expected = system.run(&motion, &mut whole).unwrap();
    // A run to an accuracy has fewer steps.
    let polls = if let StepControl::Accuracy { .. } = control { 1 } else { 3 };
    let mut first = Seen { polls: Some(polls), ..Seen::default() };
    let ended = system.run(&motion, &mut first).unwrap();
    assert!(matches!(ended.status, Status::Stopped { .. }) && ended.t.abs() < end.abs(), "{ended:?}");
    let mut rest = Seen::default();
    let interrupted = first.interrupted.unwrap();
    if let StepControl::Accuracy { .. } = control {
        // The same steps, when given, are those of another run: its iterations end at round-off.
        let plan = system.plan(&motion).unwrap();
        let steps = StepControl::Steps { by: plan.by().unwrap(), steps: Steps::Count(plan.steps) };
        let given = Motion { step_control: steps, ..motion.clone() };
        assert!(system.resume(&given, interrupted.clone(), &mut Seen::default()).is_err());
    }
    let outcome = system.resume(&motion, interrupted, &mut rest).unwrap();
    assert_eq!(outcome, expected);
    let rows: Vec<_> = first.rows.into_iter().chain(rest.rows).collect();
    assert_eq!(rows, whole.rows);
}

/// The members of an ensemble, in their order.
fn members(system: &System, ensemble: &Ensemble<'_>) -> Vec<MemberEnd> {
    let mut all = Vec::new();
    let mut keep = |member| {
        all.push(member);
        ControlFlow::Continue(())
    };
    let tally = system.ensemble(ensemble, &mut keep).unwrap();
    assert_eq!(tally.members, ensemble.count);
    all
}

/// The comparison shows the orders, and the best run is the fastest of those that are accurate enough.
#[test]
fn a_comparison_ranks_integrators() {
    let system = System::new(&CatalogueEntry::find("quadratic_in_z").unwrap().formula().unwrap()).unwrap();
    let motion = Motion::new(Start::new(0.0, [1.0], [0.0], 1.0), 5.0, accurate(1e-9));
    // The first integrators of the table are enough.
    let comparison = system.compare(&motion, &[], &mut |part| part < 0.2).unwrap();
    assert!(comparison.ended && comparison.reference_error < 1e-13, "{comparison:?}");
    for (name, order) in [("midpoint", 2), ("gauss_2", 4), ("gauss_3", 6)] {
        let rows: Vec<_> = comparison.rows.iter().filter(|row| row.integrator == name).collect();
        let resolved = |error: f64| (1e-11..1e-3).contains(&error);
        let slopes = rows.windows(2).filter(|pair| pair.iter().all(|row| resolved(row.error)));
        let slopes: Vec<f64> = slopes.map(|pair| (pair[0].error / pair[1].error).log2()).collect();
        let last = slopes.last().copied().unwrap_or(f64::NAN);
        assert!((last - f64::from(order)).abs() < 0.15, "{name}: {slopes:?}");
    }
    let best = comparison.best(1e-6).unwrap();
    assert!(best.error <= 1e-6 && comparison.rows.iter().all(|row| row.error > 1e-6 || row.seconds >= best.seconds));
}

#[test]
fn bad_input_says_what_is_wrong() {
    let system = pendulum();
    let run = |start: Start, step_control: StepControl| {
        system.run(&Motion::new(start, 1.0, step_control), &mut ()).unwrap_err().to_string()
    };
    let good = || Start::new(0.0, [1.0], [0.0], 0.0);
    assert!(run(Start::new(0.0, [1.0, 2.0], [0.0], 0.0), by_steps(1)).contains("`q` has 2 numbers"));
    assert!(run(Start::new(0.0, [1.0], [f64::NAN], 0.0), by_steps(1)).contains("`v[0]` is NaN"));
    assert!(run(Start::new(0.0, [1.0], [0.0], f64::INFINITY), by_steps(1)).contains("`z` is inf"));
    assert!(run(good(), accurate(-1.0)).contains("relative error is -1"));
    assert!(run(good(), by_steps(0)).contains("at least 1"));
    let linear = System::parse("x'^2/2 + x*y'", &["x", "y"], &[]).unwrap();
    let error =
        linear.run(&Motion::new(Start::new(0.0, [1.0; 2], [0.0; 2], 0.0), 1.0, by_steps(1)), &mut ()).unwrap_err();
    assert!(matches!(&error, RuntimeError::NotRegular { velocities } if velocities == "y'"), "{error}");
    let unknown = CatalogueEntry::find("keplr").unwrap_err().to_string();
    assert!(unknown.contains("did you mean \"kepler\""), "{unknown}");
    let needs_separable = AnyIntegrator::Splitting(discrete_herglotz::SplittingScheme::BLANES_MOAN_6);
    let coupled = System::new(&CatalogueEntry::find("coupled_in_z").unwrap().formula().unwrap()).unwrap();
    assert_eq!(coupled.check_integrator(needs_separable), Err(InputError::Unclaimed { claim: "separable" }));
    assert!(Column::parse("thetta", system.formula()).unwrap_err().to_string().contains("did you mean `theta`"));
    let formula = Formula::parse("v[0]^2/2", &["x"], &[("energy", 1.0)]).unwrap();
    assert!(matches!(Column::parse("energy", &formula), Ok(Column::Expression(_))));
}

/// With the factor 0, or one that is not finite, the pullback is not a contact form.
#[test]
fn a_factor_that_is_none_is_not_contact() {
    let check = |sigma: f64| {
        let (contact_defect, herglotz_defect, momenta) = (0.0, 0.0, Vec::new());
        let sample = Sample { t: 0.0, sigma, log_factor: 0.0, contact_defect, herglotz_defect, momenta };
        Check {
            integrator: String::new(),
            step_size: 1.0,
            samples: vec![sample],
            statements: Vec::new(),
            not_contact: None,
        }
    };
    assert!([1.0, -2.0, 1e-300, f64::from_bits(1)].into_iter().all(|sigma| check(sigma).is_contact()));
    for none in [0.0, -0.0, f64::NAN, f64::INFINITY] {
        assert!(!check(none).is_contact() && check(none).loses_the_form(), "{none}");
    }
}
