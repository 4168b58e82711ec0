//! Systems of one to sixteen coordinates.

use super::{Seen, accurate, by_steps, members};
use contact_geom::switching::Impact;
use discrete_herglotz::{AnyIntegrator, SplittingScheme, Status, Steps};
use formula_lagrangian::{Direction, Reset};
use herglotz_runtime::{
    Column, Ensemble, Event, Formula, FormulaSymmetry, Motion, OutputTimes, Start, StepControl, System, Varied,
};

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
    let error = System::parse("q[0]", &["q[257]"], &[]).err().unwrap();
    assert!(error.to_string().contains("1 to 256"), "{error}");
}

/// Beyond sixteen coordinates a formula runs by collocation: the energy decays with the conformal factor, events are
/// found, a resumed run has the same bits, and what there is only for fewer coordinates is refused.
#[test]
fn more_than_sixteen_coordinates() {
    let text = "sum(i, 0, n-1, v[i]^2 - q[i]^2)/2 - sum(i, 1, n-1, (q[i] - q[i-1])^4)/4 + gamma*z";
    for n in [17, 60] {
        let system = System::parse(text, &[&format!("x[{n}]")], &[("gamma", -0.2)]).unwrap();
        let q: Vec<f64> = (0..n).map(|i| (0.4 * f64::from(i)).cos()).collect();
        let motion = Motion {
            rows: Some(OutputTimes::Every(usize::MAX)),
            columns: vec![Column::Energy, Column::LogFactor],
            ..Motion::new(Start::new(0.0, q.clone(), vec![0.1; q.len()], 0.0), 5.0, accurate(1e-9))
        };
        let (outcome, rows) = system.record(&motion).unwrap();
        let ([first, last], to) = ([rows[0][0], rows[1][0]], rows[1][1]);
        assert_eq!((outcome.status, outcome.unresolved, outcome.q.len()), (Status::Completed, None, q.len()));
        assert!((to + 1.0).abs() < 1e-13, "the factor is e^(gamma t): {to}");
        assert!((last / (first * to.exp()) - 1.0).abs() < 1e-8, "{n}: {first} to {last}");
    }
    let system = System::parse(text, &["x[17]"], &[("gamma", -0.2)]).unwrap();
    let steps = |by: AnyIntegrator| StepControl::Steps { by, steps: Steps::Count(50) };
    let gauss = steps(AnyIntegrator::Gauss { stages: 4 });
    let motion = |step_control| Motion::new(Start::new(0.0, vec![0.5; 17], vec![0.0; 17], 0.0), 2.0, step_control);
    let event = Event::new(system.formula().expression("x[0]").unwrap());
    let mut seen = Seen::default();
    system.run(&Motion { events: vec![event], ..motion(gauss) }, &mut seen).unwrap();
    let [found] = seen.crossings.as_slice() else { panic!("{} crossings", seen.crossings.len()) };
    assert!(found.q[0].abs() < 1e-12 && found.q.len() == 17, "{:?}", found.q);
    for by in [AnyIntegrator::Splitting(SplittingScheme::STRANG), AnyIntegrator::TransformedGauss { stages: 4 }] {
        let error = system.run(&motion(steps(by)), &mut ()).err().unwrap().to_string();
        assert!(error.contains("gauss_1"), "{error}");
    }
    let error = system.modified_defects(&motion(gauss), 3).err().unwrap().to_string();
    assert!(error.contains("16") && error.contains("modified"), "{error}");
    // The contact defect is the round-off of finite differences, and the rate is constant.
    let check = system.check(&motion(gauss), 3).unwrap();
    assert_eq!((check.integrator.as_str(), check.samples.len(), check.statements.len()), ("gauss_4", 3, 0));
    for sample in &check.samples {
        assert!(sample.contact_defect < 1e-9 && sample.herglotz_defect < 1e-9, "{sample:?}");
        assert!((sample.sigma / (-0.2 * check.step_size).exp() - 1.0).abs() < 1e-13, "{sample:?}");
    }
}

/// Forces, kinks, jumps, resets and impacts in seventeen coordinates, of which sixteen are at rest or move freely, are those of one
/// coordinate: to 1e-12, the round-off of these runs.
#[test]
fn forces_kinks_and_resets_in_many_coordinates() {
    let by = StepControl::Steps { by: AnyIntegrator::Gauss { stages: 6 }, steps: Steps::Count(60) };
    let forced = |formula: Formula, forces: &[(&str, &str)]| formula.with_forces(forces).unwrap();
    let bounce = Reset { when: "x", direction: Direction::Falling, then: &[("x'", "-0.8*x'")], rest: None };
    let struck = |formula: Formula, law: Impact| formula.with_impact("x", law, None).unwrap();
    type Change<'c> = &'c dyn Fn(Formula) -> Formula;
    let cases: [(&str, Change<'_>); 8] = [
        ("x'^2/2 - x^2/2 - 0.1*z", &|f| forced(f, &[("x", "-0.2*x'*x'^2 + sin(t)")])),
        ("x'^2/2 - x^2/2 + abs(x)/4 - 0.1*z", &|f| f),
        ("x'^2/2*if(x < 0, 2, 1) - x^2/2", &|f| forced(f, &[("x", "-0.1*x'")])),
        ("x'^2/2 - x^2/2 + if(t > 1.3, x, 0)", &|f| f),
        ("x'^2/2 - 9.81*x", &|f| f.with_reset(bounce).unwrap()),
        ("x'^2/2*(1 + x^2) - 9.81*x - 0.1*z", &|f| struck(f, Impact::Elastic)),
        ("x'^2/2 - 9.81*x - 0.1*z", &|f| struck(f, Impact::Restitution(0.9))),
        ("x'^2/2 - 9.81*x - 0.1*z", &|f| struck(f, Impact::Conformal(0.8))),
    ];
    for (text, change) in cases {
        let of = |n: usize| {
            let others: Vec<String> = (1..n).map(|i| format!("y{i}")).collect();
            let names: Vec<&str> = std::iter::once("x").chain(others.iter().map(String::as_str)).collect();
            let free: String = others.iter().map(|y| format!(" + {y}'^2/2")).collect();
            let formula = change(Formula::parse(&format!("{text}{free}"), &names, &[]).unwrap());
            let (mut q, mut v) = (vec![0.0; n], vec![0.0; n]);
            (q[0], v[0]) = (1.0, 0.3);
            let motion = Motion { conformal_factor: true, ..Motion::new(Start::new(0.0, q, v, 0.0), 3.0, by) };
            System::new(&formula).unwrap().run(&motion, &mut ()).unwrap()
        };
        let (one, many) = (of(1), of(17));
        assert_eq!((one.status, many.status, many.q.len()), (Status::Completed, Status::Completed, 17), "{text}");
        match (one.log_factor, many.log_factor) {
            (Some(a), Some(b)) => assert!((a - b).abs() <= 1e-12, "{text}: {a} and {b}"),
            factors => assert_eq!(factors, (None, None), "{text}"),
        }
        let off =
            (one.q[0] - many.q[0]).abs() + (one.p[0] - many.p[0]).abs() + (one.z.unwrap() - many.z.unwrap()).abs();
        assert!(off <= 1e-12 && many.q[16] == 0.0, "{text}: off by {off:e}");
    }
}

/// The derivatives of motions of ten and of seventeen coordinates, with and without a force, in starts and parameters, are
/// differences of motions: to 1e-7, the round-off of the motions divided by the distance 1e-5, and its square times their
/// third derivatives. The exponents have the sum that they have for any formula.
#[test]
fn derivatives_in_many_coordinates() {
    let by = StepControl::Steps { by: AnyIntegrator::Gauss { stages: 4 }, steps: Steps::Count(20) };
    let motion = |n: usize, q2: f64| {
        let (mut q, v) = (vec![0.5; n], (0..n).map(|i| 0.1 * i as f64).collect::<Vec<_>>());
        q[2] += q2;
        Motion::new(Start::new(0.0, q, v, 0.0), 2.0, by)
    };
    let text = "sum(i, 0, n-1, v[i]^2*(1 + q[i]^2/10) - k*q[i]^2)/2 - sum(i, 1, n-1, (q[i] - q[i-1])^4)/4 - z*k/5";
    for (n, forces) in [(10, &[][..]), (10, &[("x[3]", "-k*v[3] + t")]), (17, &[]), (17, &[("x[3]", "-k*v[3] + t")])] {
        let formula = Formula::parse(text, &[&format!("x[{n}]")], &[("k", 1.0)]).unwrap();
        let formula = if forces.is_empty() { formula } else { formula.with_forces(forces).unwrap() };
        let system = System::new(&formula).unwrap();
        let found = system.sensitivity(&motion(n, 0.0), &["x[2]", "k", "t0"], &[2.0], &mut ()).unwrap();
        let loss = formula.expression("x[1]*x[3] + v[3]^2 + z*k").unwrap();
        let gradient = system.end_gradient(&motion(n, 0.0), &loss, &mut ()).unwrap().loss.unwrap().1;
        let h = 1e-5;
        let at = |q2: f64, k: f64| system.with_parameters(&[("k", k)]).unwrap().run(&motion(n, q2), &mut ()).unwrap();
        let value = |end: &herglotz_runtime::Outcome, k: f64| {
            let v = end.v.as_ref().unwrap();
            end.q[1] * end.q[3] + v[3] * v[3] + end.z.unwrap() * k
        };
        for (column, slope, [before, after]) in
            [(0, gradient.q[2], [(-h, 1.0), (h, 1.0)]), (1, gradient.parameters[0], [(0.0, 1.0 - h), (0.0, 1.0 + h)])]
        {
            let [a, b] = [before, after].map(|(q2, k)| (at(q2, k), k));
            let of = &found.rows[0][column];
            for i in 0..n {
                let expected = (b.0.q[i] - a.0.q[i]) / (2.0 * h);
                assert!((of.q[i] - expected).abs() <= 1e-7 * (1.0 + expected.abs()), "{n}, {i}: {expected}");
            }
            let expected = (value(&b.0, b.1) - value(&a.0, a.1)) / (2.0 * h);
            assert!((slope - expected).abs() <= 1e-7 * (1.0 + expected.abs()), "{n}: {slope} and {expected}");
        }
    }
    let free = System::parse("sum(i, 0, n-1, v[i]^2/2 + cos(q[i])) - z/5", &["x[17]"], &[]).unwrap();
    let exponents = free.lyapunov_exponents(&motion(17, 0.0), &mut ()).unwrap();
    assert_eq!(exponents.exponents.len(), 35);
    assert!(exponents.pairing_defect.unwrap() < 1e-11 && exponents.volume_defect.unwrap() < 1e-10, "{exponents:?}");
}

/// Ensembles in seventeen coordinates: each member, with parameters, rows and an event of its own, is its single run.
#[test]
fn ensembles_in_many_coordinates() {
    let text = "sum(i, 0, n-1, v[i]^2/2 + cos(q[i])) + k*q[0]*q[16] + gamma*z";
    let system = System::parse(text, &["x[17]"], &[("k", 0.1), ("gamma", -0.2)]).unwrap();
    let start = |i: usize| Start::new(0.0, vec![0.5 + 0.1 * i as f64; 17], vec![0.0; 17], 0.0);
    let values = |i: usize| vec![0.1 * i as f64, if i == 3 { f64::NAN } else { -0.1 }];
    let events = [Event::new(system.formula().expression("x[0] - k").unwrap())];
    let columns = [Column::Position(16), Column::parse("k*q[0]", system.formula()).unwrap()];
    for step_control in
        [accurate(1e-9), StepControl::Steps { by: AnyIntegrator::Gauss { stages: 4 }, steps: Steps::Count(20) }]
    {
        let many = Ensemble {
            count: 5,
            start: &start,
            t0: 0.0,
            varied: Some(Varied { names: &["k", "gamma"], values: &values }),
            end: 4.0,
            step_control,
            rows: Some(OutputTimes::At(vec![1.0, 4.0])),
            columns: &columns,
            events: &events,
            threads: Some(2),
        };
        for (i, member) in members(&system, &many).into_iter().enumerate() {
            if i == 3 {
                assert!(member.ending.is_err() && member.rows.is_empty(), "{member:?}");
                continue;
            }
            let of = system.with_parameters(&[("k", values(i)[0]), ("gamma", -0.1)]).unwrap();
            let own = Event::new(of.formula().expression("x[0] - k").unwrap());
            let motion = Motion {
                events: vec![own],
                rows: Some(OutputTimes::At(vec![1.0, 4.0])),
                columns: vec![Column::Position(16), Column::parse("k*q[0]", of.formula()).unwrap()],
                ..Motion::new(start(i), 4.0, step_control)
            };
            let mut seen = Seen::default();
            let alone = of.run(&motion, &mut seen).unwrap();
            let ending = member.ending.unwrap();
            assert_eq!((ending.q, ending.p, Some(ending.z)), (alone.q, alone.p, alone.z), "{i}");
            assert_eq!((member.rows, member.crossings.len()), (seen.rows, seen.crossings.len()), "{i}");
            assert!(!member.crossings.is_empty());
        }
        let kepler = |_: usize| Start::new(0.0, vec![0.5; 17], vec![0.0; 17], 0.0);
        let by = StepControl::Steps { by: AnyIntegrator::Splitting(SplittingScheme::STRANG), steps: Steps::Count(20) };
        let refused = Ensemble { start: &kepler, varied: None, step_control: by, ..many };
        let error = system.ensemble(&refused, &mut |_| std::ops::ControlFlow::Continue(())).unwrap_err();
        assert!(error.to_string().contains("at most 16 coordinates"), "{error}");
    }
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
    // The motion has eight stages; with these the theorems would take seconds.
    assert!(check.statements.len() > 10 && check.statements.iter().all(|stated| stated.method == "gauss_4"));
    let free = System::parse("sum(i, 0, n-1, v[i]^2)/2 - q[1]^2", &["x[9]"], &[]).unwrap();
    assert_eq!(free.symmetries().iter().filter(|s| matches!(s, FormulaSymmetry::Translation(_))).count(), 8);
}
