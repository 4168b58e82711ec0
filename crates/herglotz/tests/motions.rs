//! Systems that are defined at run time, compared with the types of the libraries.

#![allow(clippy::unwrap_used)] // Tests unwrap, in helpers too.

use contact_geom::systems as typed;
use contact_geom::{Derivatives, Lagrangian, VelocityPoint, herglotz_field};
use discrete_herglotz::{AnyIntegrator, InputError, Problem, ResumeState, Status, Steps, Until};
use formula_lagrangian::Formula;
use herglotz::runtime::{
    CATALOGUE, CatalogueEntry, Check, Column, Crossing, Direction, Ensemble, Event, FormulaSymmetry, MemberEnd, Motion,
    OutputTimes, RunMonitor, RuntimeError, Sample, Start, StepControl, System, Varied,
};
use std::ops::ControlFlow;

const GAUSS: AnyIntegrator = AnyIntegrator::Gauss { stages: 8 };

fn by_steps(count: usize) -> StepControl {
    StepControl::Steps { by: GAUSS, steps: Steps::Count(count) }
}

fn accurate(wanted: f64) -> StepControl {
    StepControl::Accuracy { wanted, by: None }
}

fn pendulum() -> System {
    System::parse("theta'^2/2 + cos(theta) + gamma*z", &["theta"], &[("gamma", -0.1)]).unwrap()
}

fn start_of(entry: &CatalogueEntry) -> Start {
    Start::new(entry.t, entry.q, entry.v, 0.2)
}

/// Checks that the Herglotz field of a catalogue entry is that of the type.
fn same<const N: usize>(name: &str, lagrangian: &impl Lagrangian<N>) {
    let entry = CatalogueEntry::find(name).unwrap();
    let system = System::new(&entry.formula().unwrap()).unwrap();
    let x = VelocityPoint::<N>::from_slices(entry.q, entry.v, 0.2).unwrap();
    let field = herglotz_field(lagrangian, entry.t, &x).unwrap().to_vector();
    let geometry = system.geometry(&start_of(entry)).unwrap();
    let size = field.amax();
    for (found, expected) in geometry.herglotz_field.iter().zip(&field) {
        assert!((found - expected).abs() <= 16.0 * f64::EPSILON * size, "{name}: {found} and {expected}");
    }
    let rate = lagrangian.gradient(entry.t, &x).z;
    assert!((geometry.rate - rate).abs() <= 16.0 * f64::EPSILON, "{name}: {}", geometry.rate);
}

#[test]
fn the_catalogue_has_the_formulas_of_the_types() {
    same("free_particle", &typed::FreeParticle { gamma: -0.1 });
    same("uniform_field", &typed::UniformField::<2> { field: [0.0, -1.0], gamma: -0.1 });
    same("harmonic_oscillator", &typed::HarmonicOscillator { gamma: -0.1 });
    same("pendulum", &typed::Pendulum { gamma: -0.1 });
    same("duffing", &typed::Duffing { alpha: -1.0, beta: 1.0, force: 0.3, omega: 1.2, gamma: -0.3 });
    same("quadratic_in_z", &typed::QuadraticInZ { c: 0.1 });
    same("coupled_in_z", &typed::CoupledInZ { a: 0.5, b: 0.1, gamma: -0.1 });
    same("relativistic", &typed::Relativistic { gamma: -0.1 });
    same("lane_emden", &typed::LaneEmden { n: 5 });
    same("kepler", &typed::Kepler::<2> { mu: 1.0, gamma: -0.01 });
    same("kepler_in_space", &typed::Kepler::<3> { mu: 1.0, gamma: -0.01 });
    same("perturbed_kepler", &typed::PerturbedKepler { mu: 1.0, alpha: 0.01, theta: std::f64::consts::PI });
    same("charged_particle", &typed::ChargedParticle { b: 1.0, k: 0.5, gamma: -0.1 });
    same("double_pendulum", &typed::DoublePendulum { masses: [1.0; 2], lengths: [1.0; 2], gamma: -0.1 });
    same("spherical_pendulum", &typed::SphericalPendulum { gamma: -0.1 });
    same("coupled_plane", &typed::CoupledPlane { a: 0.3, b: 0.4, c: 0.3 });
    same("chain", &typed::Chain::<6> { ends: typed::Ends::Fixed, beta: 0.5, gamma: -0.1 });
    assert_eq!(CATALOGUE.len(), 17, "each is compared above");
}

#[test]
fn every_entry_runs_and_its_steps_are_contact() {
    for entry in CATALOGUE {
        let system = System::new(&entry.formula().unwrap()).unwrap();
        let motion = Motion::new(start_of(entry), entry.t + 3.0, accurate(1e-9));
        let outcome = system.run(&motion, &mut ()).unwrap();
        assert_eq!((outcome.status, outcome.unresolved), (Status::Completed, None), "{}", entry.name);
        let check = system.check(&motion, 3).unwrap_or_else(|error| panic!("{}: {error}", entry.name));
        assert!(check.is_contact(), "{}: {:e}", entry.name, check.contact_defect());
        assert!(check.momentum_defect() <= 1e-11, "{}: {:e}", entry.name, check.momentum_defect());
        for sample in &check.samples {
            // The whole motion has an error of 1e-9, so the error of a single step is below this bound.
            assert!(sample.herglotz_defect <= 1e-8, "{}: {:e}", entry.name, sample.herglotz_defect);
        }
        assert!(check.statements.len() >= 12, "{}", entry.name);
        for stated in &check.statements {
            assert!(stated.residual <= 1e-9, "{}: {:?} {:e}", entry.name, stated.statement, stated.residual);
        }
    }
}

/// The energy decays with the conformal factor, to the requested accuracy, in any number of coordinates.
#[test]
fn one_to_sixteen_coordinates() {
    for n in 1..=16 {
        let text = "sum(i, 0, n-1, v[i]^2 - q[i]^2)/2 - sum(i, 1, n-1, (q[i] - q[i-1])^4)/4 + gamma*z";
        let system = System::parse(text, &[&format!("x[{n}]")], &[("gamma", -0.2)]).unwrap();
        assert_eq!(system.dimension(), n);
        let motion = Motion {
            rows: Some(OutputTimes::Every(usize::MAX)),
            columns: vec![Column::Energy, Column::LogFactor],
            ..Motion::new(Start::new(0.0, vec![0.7; n], vec![0.1; n], 0.0), 5.0, accurate(1e-10))
        };
        let (outcome, rows) = system.record(&motion).unwrap();
        let ([first, last], [from, to]) = ([rows[0][0], rows[1][0]], [rows[0][1], rows[1][1]]);
        assert_eq!((outcome.status, from), (Status::Completed, 0.0));
        assert!((to + 1.0).abs() < 1e-14, "the factor is e^(gamma t): {to}");
        assert!((last / (first * to.exp()) - 1.0).abs() < 1e-9, "{n}: {first} to {last}");
    }
    let error = System::parse("q[0]", &["q[17]"], &[]).err().unwrap();
    assert!(error.to_string().contains("1 to 16"), "{error}");
}

/// The general case in sixteen coordinates fits into the stack of a thread: masses that depend on all positions, a rate
/// that depends on z.
#[test]
fn sixteen_coupled_coordinates() {
    let mass = "sum(i, 0, n-1, v[i]^2) + 0.05*sum(i, 0, n-1, v[i]*cos(q[i]))^2";
    let text = format!("({mass})/2 + sum(i, 0, n-1, cos(q[i])) + 0.1*cos(sum(i, 0, n-1, q[i])) - 0.05*z^2");
    let system = System::parse(&text, &["x[16]"], &[]).unwrap();
    let start = Start::new(0.0, vec![0.3; 16], (0..16).map(|i| 0.05 * f64::from(i)).collect::<Vec<_>>(), 0.5);
    let of = |step_control: StepControl| system.run(&Motion::new(start.clone(), 2.0, step_control), &mut ()).unwrap();
    let exact = of(accurate(1e-10));
    let six = of(StepControl::Steps { by: AnyIntegrator::Gauss { stages: 6 }, steps: Steps::Count(40) });
    assert_eq!((exact.status, six.status), (Status::Completed, Status::Completed));
    for (a, b) in exact.q.iter().zip(&six.q).chain(exact.p.iter().zip(&six.p)) {
        assert!((a - b).abs() < 1e-9, "{a} and {b}");
    }
    let all = |_: usize| start.clone();
    let many = Ensemble {
        count: 12,
        start: &all,
        t0: 0.0,
        varied: None,
        end: 2.0,
        step_control: StepControl::Steps { by: AnyIntegrator::Gauss { stages: 6 }, steps: Steps::Count(40) },
        rows: None,
        columns: &[],
        events: &[],
        threads: Some(2),
    };
    for member in members(&system, &many) {
        let ending = member.ending.unwrap();
        assert!(ending.q.iter().zip(&six.q).all(|(a, b)| (a - b).abs() < 1e-12), "{:?}", ending.q);
    }
}

/// Ten coordinates are computed with the kernel for sixteen, and the other six are not visible: the motion is that of
/// its two parts, which have kernels of their own, and the geometry is that of ten coordinates.
#[test]
fn what_fills_a_kernel_is_not_seen() {
    // Pendula with masses 1, 2, ..., coupled by springs.
    let chain = |from: usize, to: usize, mass: usize| {
        let springs = format!("sum(i, {from}+1, {to}, (q[i] - q[i-1])^4)");
        format!("(sum(i, {from}, {to}, v[i]^2*(i + {mass})) + sum(i, {from}, {to}, cos(q[i])) - {springs})/2")
    };
    let whole = format!("{} + {} + gamma*z", chain(0, 6, 1), chain(7, 9, 1));
    let system = System::parse(&whole, &["x[10]"], &[("gamma", -0.2)]).unwrap();
    let (q, v): (Vec<f64>, Vec<f64>) = (0..10).map(|i| (0.1 * f64::from(i) - 0.3, 0.4 - 0.07 * f64::from(i))).unzip();
    let start = Start::new(0.0, q.clone(), v.clone(), 0.0);
    let event = Event::new(system.formula().expression("x[8] - x'[9]").unwrap());
    let motion = Motion {
        nodes: true,
        resumable: true,
        events: vec![event],
        rows: Some(OutputTimes::Every(8)),
        columns: vec![Column::Position(9), Column::parse("sum(i, 0, n-1, q[i])", system.formula()).unwrap()],
        ..Motion::new(start.clone(), 6.0, by_steps(24))
    };
    let mut seen = Seen::default();
    let outcome = system.run(&motion, &mut seen).unwrap();
    assert_eq!((outcome.q.len(), outcome.p.len(), outcome.v.as_ref().unwrap().len()), (10, 10, 10));
    let last = seen.rows.last().unwrap();
    assert_eq!(last[0], outcome.q[9]);
    assert!((last[1] - outcome.q.iter().sum::<f64>()).abs() < 1e-14);
    assert!(!seen.crossings.is_empty());
    assert!(seen.crossings.iter().all(|c| c.q.len() == 10 && (c.q[8] - c.v[9]).abs() < 1e-9), "{:?}", seen.crossings);
    for range in [0..7, 7..10] {
        let n = range.len();
        let text = format!("{} + gamma*z", chain(0, n - 1, range.start + 1));
        let part = System::parse(&text, &[&format!("x[{n}]")], &[("gamma", -0.2)]).unwrap();
        let start = Start::new(0.0, &q[range.clone()], &v[range.clone()], 0.0);
        let alone = part.run(&Motion::new(start, 6.0, by_steps(24)), &mut ()).unwrap();
        for (a, b) in alone.q.iter().zip(&outcome.q[range.clone()]).chain(alone.p.iter().zip(&outcome.p[range])) {
            assert!((a - b).abs() < 1e-13, "{n}: {a} and {b}");
        }
    }
    let member = Ensemble {
        count: 1,
        start: &|_| start.clone(),
        t0: 0.0,
        varied: None,
        end: 6.0,
        step_control: by_steps(24),
        rows: None,
        columns: &[],
        events: &[],
        threads: Some(1),
    };
    let member = members(&system, &member).remove(0).ending.unwrap();
    assert!(member.q.iter().zip(&outcome.q).all(|(a, b)| (a - b).abs() < 1e-13) && member.q.len() == 10);

    // W = diag(1, ..., 10).
    let geometry = system.geometry(&start).unwrap();
    assert_eq!((geometry.mass.len(), geometry.mass[9].len(), geometry.momentum.len()), (10, 10, 10));
    assert_eq!([&geometry.eta, &geometry.reeb, &geometry.herglotz_field].map(Vec::len), [21; 3]);
    let factorial: f64 = (1..=10).map(f64::from).product();
    assert!((geometry.condition - 10.0).abs() < 1e-12, "{}", geometry.condition);
    assert!((geometry.volume + factorial * factorial).abs() < 1e-9 * factorial.powi(2), "{:e}", geometry.volume);
    assert_eq!(geometry.eta[20], 1.0);

    let check = system.check(&motion, 2).unwrap();
    assert!(check.samples.iter().all(|sample| sample.contact_defect < 1e-9), "{:?}", check.samples);
    assert!(check.statements.iter().all(|stated| stated.residual < 1e-9), "{:?}", check.statements);
    let free = System::parse("sum(i, 0, n-1, v[i]^2)/2 - q[1]^2", &["x[9]"], &[]).unwrap();
    assert_eq!(free.symmetries().iter().filter(|s| matches!(s, FormulaSymmetry::Translation(_))).count(), 8);
    assert!(system.to_rust("Halves").unwrap().contains("impl Lagrangian<10> for Halves"));
}

/// Records of a motion.
#[derive(Default)]
struct Seen {
    rows: Vec<Vec<f64>>,
    crossings: Vec<Crossing>,
    nodes: usize,
    /// The number of polls after which the motion is ended.
    polls: Option<usize>,
    interrupted: Option<ResumeState>,
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
    fn node(&mut self, _t: f64, _x: [&[f64]; 3], _z: f64) {
        self.nodes += 1;
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
    assert_eq!((seen.nodes, seen.rows.len()), (51, 4));
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
    goes_on(OutputTimes::Every(100), 100.0);
    // Rows at given times of the whole motion, one of which is the time of the interruption; forward and backward.
    let times = |end: f64| (0..=1000).map(move |k| if k == 1000 { end } else { end * f64::from(k) / 1000.0 }).collect();
    goes_on(OutputTimes::At(times(100.0)), 100.0);
    goes_on(OutputTimes::At(times(-100.0)), -100.0);
}

fn goes_on(rows: OutputTimes, end: f64) {
    let system = pendulum();
    let motion = Motion {
        rows: Some(rows),
        columns: vec![Column::Time, Column::Position(0), Column::Action],
        resumable: true,
        ..Motion::new(Start::new(0.0, [1.0], [0.0], 0.0), end, by_steps(2000))
    };
    let mut whole = Seen::default();
    let expected = system.run(&motion, &mut whole).unwrap();
    let mut first = Seen { polls: Some(3), ..Seen::default() };
    let ended = system.run(&motion, &mut first).unwrap();
    assert!(matches!(ended.status, Status::Stopped { .. }) && ended.t.abs() < 100.0, "{ended:?}");
    let mut rest = Seen::default();
    let outcome = system.resume(&motion, first.interrupted.unwrap(), &mut rest).unwrap();
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

#[test]
fn members_are_single_runs_whatever_the_threads() {
    let system = pendulum();
    let start = |i: usize| Start::new(0.0, [0.1 + 0.01 * i as f64], [0.0], 0.0);
    // One member has an invalid parameter.
    let values = |i: usize| vec![if i == 7 { f64::NAN } else { -0.05 - 0.001 * i as f64 }];
    let columns = [Column::Position(0), Column::Energy];
    let of = |threads| Ensemble {
        count: 20,
        start: &start,
        t0: 0.0,
        varied: Some(Varied { names: &["gamma"], values: &values }),
        end: 10.0,
        step_control: by_steps(40),
        rows: None,
        columns: &columns,
        events: &[],
        threads: Some(threads),
    };
    let (one, three) = (members(&system, &of(1)), members(&system, &of(3)));
    for (i, (a, b)) in one.iter().zip(&three).enumerate() {
        // Compared as text, since NaN is not equal to itself.
        assert_eq!((a.index, format!("{:?}", a.ending)), (i, format!("{:?}", b.ending)));
        let Ok(ending) = &a.ending else {
            assert_eq!(i, 7);
            continue;
        };
        let own = system.with_parameters(&[("gamma", values(i)[0])]).unwrap();
        let outcome = own.run(&Motion::new(start(i), 10.0, by_steps(40)), &mut ()).unwrap();
        // The sine of the SIMD lanes differs by some units in the last place, and the motion does not amplify the
        // difference.
        let near = |x: f64, y: f64| (x - y).abs() < 1e-14;
        assert!(near(ending.q[0], outcome.q[0]) && near(ending.p[0], outcome.p[0]), "{i}: {ending:?} {outcome:?}");
        assert_eq!(ending.columns[0], ending.q[0]);
    }
    assert!(one[7].ending.is_err());

    // Rows are those of a single run.
    let recorded = Ensemble { rows: Some(OutputTimes::At(vec![0.0, 5.0, 10.0])), varied: None, ..of(2) };
    let all = members(&system, &recorded);
    let motion =
        Motion { rows: recorded.rows.clone(), columns: columns.to_vec(), ..Motion::new(start(4), 10.0, by_steps(40)) };
    assert_eq!(all[4].rows, system.record(&motion).unwrap().1);
    // The final state does not depend on the rows, also where the last row is before the end.
    let early = Ensemble { rows: Some(OutputTimes::At(vec![0.0, 5.0])), varied: None, ..of(2) };
    let ending = members(&system, &early).swap_remove(4).ending.unwrap();
    let end_of_all = all[4].ending.clone().unwrap();
    assert_eq!((ending.v, ending.columns), (end_of_all.v, end_of_all.columns));
    // With a requested accuracy.
    let accurate = Ensemble { step_control: accurate(1e-8), ..of(2) };
    for (a, b) in members(&system, &accurate).iter().zip(&one) {
        if let (Ok(a), Ok(b)) = (&a.ending, &b.ending) {
            assert!((a.q[0] - b.q[0]).abs() < 1e-8, "{a:?} {b:?}");
        }
    }
}

/// The events of each member are those of a single run with its parameters. A terminal event ends its member only, and
/// nothing beyond it is reported.
#[test]
fn events_of_members_are_those_of_single_runs() {
    let system = pendulum();
    // All start below the upper equilibrium with weak damping, so that all pass the lower equilibrium.
    let start = |i: usize| Start::new(0.0, [0.3 + 0.05 * i as f64], [0.0], 0.0);
    let values = |i: usize| vec![-0.01 * i as f64];
    let columns = [Column::Time, Column::Velocity(0)];
    let of = |text: &str| system.formula().expression(text).unwrap();
    for terminal in [false, true] {
        // One event contains a parameter of the member.
        let slow = Event::new(of("theta' - gamma*theta"));
        let down = Event { direction: Direction::Falling, terminal, ..Event::new(of("theta")) };
        let events = [slow, down];
        let rows = Some(OutputTimes::At((0..=8).map(f64::from).collect()));
        let many = Ensemble {
            count: 40,
            start: &start,
            t0: 0.0,
            varied: Some(Varied { names: &["gamma"], values: &values }),
            end: 8.0,
            step_control: by_steps(32),
            rows: rows.clone(),
            columns: &columns,
            events: &events,
            threads: Some(2),
        };
        for member in members(&system, &many) {
            let i = member.index;
            let own = system.with_parameters(&[("gamma", values(i)[0])]).unwrap();
            // Events that are parsed again have the parameter values of the member.
            let of = |text: &str| own.formula().expression(text).unwrap();
            let slow = Event { function: of("theta' - gamma*theta"), ..events[0].clone() };
            let motion = Motion {
                rows: rows.clone(),
                columns: columns.to_vec(),
                events: vec![slow, events[1].clone()],
                ..Motion::new(start(i), 8.0, by_steps(32))
            };
            let mut alone = Seen::default();
            let outcome = own.run(&motion, &mut alone).unwrap();
            let ending = member.ending.unwrap();
            assert_eq!((ending.t, &ending.q, &ending.p), (outcome.t, &outcome.q, &outcome.p), "{i}");
            assert_eq!(ending.t < 8.0, terminal, "{i}");
            assert_eq!((member.rows, member.crossings), (alone.rows, alone.crossings), "{i}");
        }
    }
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

#[test]
fn symmetries_and_source() {
    let kepler = System::new(&CatalogueEntry::find("kepler").unwrap().formula().unwrap()).unwrap();
    assert_eq!(kepler.symmetries(), [FormulaSymmetry::Rotation(vec![(0, 1)])]);
    let free = System::new(&CatalogueEntry::find("free_particle").unwrap().formula().unwrap()).unwrap();
    assert_eq!(free.symmetries(), [FormulaSymmetry::Translation(vec![0])]);
    assert!(free.structure().separable && free.is_smooth());
    assert!(free.to_rust("Free").unwrap().contains("impl Lagrangian<1> for Free"));
    assert!(free.to_rust("not a type").is_err());
}

/// With the factor 0, or one that is not finite, the pullback is not a contact form.
#[test]
fn a_factor_that_is_none_is_not_contact() {
    let check = |sigma: f64| {
        let (contact_defect, herglotz_defect, momenta) = (0.0, 0.0, Vec::new());
        let sample = Sample { t: 0.0, sigma, log_factor: 0.0, contact_defect, herglotz_defect, momenta };
        Check { integrator: String::new(), step_size: 1.0, samples: vec![sample], statements: Vec::new() }
    };
    assert!([1.0, -2.0, 1e-300, f64::from_bits(1)].into_iter().all(|sigma| check(sigma).is_contact()));
    for none in [0.0, -0.0, f64::NAN, f64::INFINITY] {
        assert!(!check(none).is_contact() && check(none).loses_the_form(), "{none}");
    }
}
