//! Systems of many coordinates, compared with small systems of the same Lagrangian and with known results.

#![allow(clippy::unwrap_used)] // Tests unwrap, in helpers too.

use herglotz_runtime::{
    AnyIntegrator, Bodies, Boundary, Column, InitialVelocity, Lattice, Motion, Outcome, OutputTimes, RunMonitor,
    RuntimeError, SiteMotion, Start, Status, StepControl, Steps, System,
};
use std::f64::consts::PI;
use std::ops::ControlFlow;

/// Every kind of integrator of these systems.
const ALL: [&str; 6] = ["strang", "blanes_moan_6", "mclachlan_4", "midpoint", "gauss_1", "gauss_2"];

fn by(name: &str) -> AnyIntegrator {
    name.parse().unwrap()
}

fn chain(sites: usize, boundary: Boundary) -> Lattice {
    Lattice {
        site: "m*x'^2/2 - (1 - cos(x)) + gamma*z".into(),
        bond: Some("-k*(xr - xl)^2/2 - (xr - xl)^4/4".into()),
        sizes: vec![sites],
        boundary,
        parameters: [("m", 1.5), ("gamma", -0.1), ("k", 2.0)].map(|(name, x)| (name.to_owned(), x)).into(),
        ..Lattice::default()
    }
}

/// The rows of a small system with the same integrator, in the form of those of a sparse system.
fn small_rows(text: &str, coordinates: &str, parameters: &[(&str, f64)], motion: &SiteMotion) -> Vec<Vec<f64>> {
    let system = System::parse(text, &[coordinates], parameters).unwrap();
    let n = system.dimension();
    let mut columns = vec![Column::Time];
    columns.extend((0..n).map(Column::Position));
    columns.extend((0..n).map(Column::Velocity));
    columns.extend((0..n).map(Column::Momentum));
    columns.extend([Column::Action, Column::Energy]);
    columns.extend(motion.conformal_factor.then_some(Column::LogFactor));
    let step_control = StepControl::Steps { by: motion.by, steps: motion.steps };
    let asked = Motion {
        rows: Some(motion.rows.clone()),
        columns,
        conformal_factor: motion.conformal_factor,
        // As those of lattices.
        exact: true,
        ..Motion::new(motion.start.clone(), motion.end, step_control)
    };
    system.record(&asked).unwrap().1
}

/// The largest difference of two tables.
fn distance(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    assert_eq!((a.len(), a[0].len()), (b.len(), b[0].len()));
    let pairs = a.iter().flatten().zip(b.iter().flatten());
    pairs.fold(0.0, |m: f64, (a, b)| if (a - b).abs() <= m { m } else { (a - b).abs() })
}

/// Positions between -1 and 1.
fn waves(n: usize) -> Vec<f64> {
    (0..n).map(|i| (1.3 * i as f64).sin()).collect()
}

#[test]
fn a_short_lattice_is_the_small_system_of_its_formula() {
    let n = 5;
    let sites = "sum(i, 0, n-1, m*v[i]^2/2 - (1 - cos(q[i]))) + gamma*z";
    let bond = |l: &str, r: &str| format!("(-k*({r} - {l})^2/2 - ({r} - {l})^4/4)");
    let inner = format!("sum(i, 1, n-1, {})", bond("q[i-1]", "q[i]"));
    let ends = [
        (Boundary::Free, String::new()),
        (Boundary::Periodic, format!("+ {}", bond("q[n-1]", "q[0]"))),
        (Boundary::Fixed, format!("+ {} + {}", bond("0", "q[0]"), bond("q[n-1]", "0"))),
    ];
    for (boundary, ends) in ends {
        let lattice = chain(n, boundary).system().unwrap();
        for name in ALL {
            let start = Start::new(0.5, waves(n), vec![0.1; n], 0.2);
            let rows = OutputTimes::At(vec![0.5, 1.0, 1.03, 2.5]);
            let motion =
                SiteMotion { rows, conformal_factor: true, ..SiteMotion::new(start, 2.5, by(name), Steps::Size(0.1)) };
            let (outcome, found) = lattice.record(&motion).unwrap();
            assert_eq!((outcome.status, outcome.steps, outcome.t), (Status::Completed, 20, 2.5));
            let parameters = [("m", 1.5), ("gamma", -0.1), ("k", 2.0)];
            let small = small_rows(&format!("{sites} + {inner} {ends}"), "q[5]", &parameters, &motion);
            let off = distance(&found, &small);
            // Twenty steps on numbers of order one, and a row within a step: the bound is round-off, including that of
            // Newton's method.
            assert!(off < 1e-12, "{boundary:?} by {name}: {off:e}");
        }
    }
}

#[test]
fn rates_in_time_and_several_components_are_those_of_the_small_system() {
    let lattice = Lattice {
        coordinates: vec!["x".into(), "y".into()],
        site: "x'^2/2 + y'^2 - (x^2 + y^2)^2/4 + 0.3*sin(t)*x - 0.2*(1 + sin(t)^2)*z".into(),
        bond: Some("-((xr - xl)^2 + (yr - yl)^2)/2 - xl*yr/5".into()),
        sizes: vec![2, 2],
        boundary: Boundary::Free,
        ..Lattice::default()
    };
    // The coordinates of a site are contiguous.
    let small = "\
        sum(i, 0, 3, v[2*i]^2/2 + v[2*i+1]^2 - (q[2*i]^2 + q[2*i+1]^2)^2/4 + 0.3*sin(t)*q[2*i]) - 0.2*(1 + sin(t)^2)*z";
    let bonds: String = [(0, 1), (2, 3), (0, 2), (1, 3)]
        .map(|(l, r)| {
            let (xl, yl, xr, yr) = (2 * l, 2 * l + 1, 2 * r, 2 * r + 1);
            format!(" - ((q[{xr}] - q[{xl}])^2 + (q[{yr}] - q[{yl}])^2)/2 - q[{xl}]*q[{yr}]/5")
        })
        .concat();
    let system = lattice.system().unwrap();
    assert_eq!(system.dimension(), 8);
    for name in ALL {
        let start = Start::new(0.0, waves(8), vec![0.2; 8], 0.0);
        let motion = SiteMotion { conformal_factor: true, ..SiteMotion::new(start, 1.0, by(name), Steps::Count(20)) };
        let (_, found) = system.record(&motion).unwrap();
        let expected = small_rows(&format!("{small}{bonds}"), "q[8]", &[], &motion);
        let off = distance(&found, &expected);
        // The bound is as above. Rates in time are integrated by formulas of different order, which agree to round-off
        // over these steps.
        assert!(off < 1e-12, "by {name}: {off:e}");
    }
}

#[test]
fn few_bodies_are_the_small_system_of_their_formula() {
    for dimensions in [2, 3] {
        let count = 6 / dimensions;
        let (masses, n) = ([1.0, 0.5, 0.25][..count].to_vec(), 6);
        let bodies = Bodies { masses: masses.clone(), dimensions, g: 1.3, gamma: -0.05 }.system().unwrap();
        let q: Vec<f64> = (0..n).map(|k| (k / dimensions) as f64 * 2.0 + 0.3 * (1.7 * k as f64).sin()).collect();
        let v: Vec<f64> = (0..n).map(|k| 0.3 * (0.9 * k as f64).cos()).collect();
        let mut text = "-0.05*z".to_owned();
        for i in 0..count {
            for d in 0..dimensions {
                text += &format!(" + {}*v[{}]^2/2", masses[i], dimensions * i + d);
            }
            for j in 0..i {
                let square =
                    (0..dimensions).map(|d| format!("(q[{}] - q[{}])^2", dimensions * i + d, dimensions * j + d));
                text += &format!(" + {}/sqrt({})", 1.3 * masses[i] * masses[j], square.collect::<Vec<_>>().join(" + "));
            }
        }
        for name in ["strang", "blanes_moan_6", "midpoint"] {
            let start = Start { t: 0.0, q: q.clone(), velocity: InitialVelocity::Velocity(v.clone()), z: 0.0 };
            let motion = SiteMotion::new(start, 1.0, by(name), Steps::Count(20));
            let (_, found) = bodies.record(&motion).unwrap();
            let off = distance(&found, &small_rows(&text, &format!("q[{n}]"), &[], &motion));
            assert!(off < 1e-12, "{dimensions} dimensions by {name}: {off:e}");
        }
    }
}

#[test]
fn a_thousand_sites_move_in_their_normal_modes() {
    // In a linear chain between walls each mode has the frequency 2 sin(pi k/(2 (n + 1))), and is damped independently.
    let (n, gamma, k, time) = (1000, -0.02, 37.0, 50.0);
    let lattice = Lattice {
        site: "x'^2/2 + gamma*z".into(),
        bond: Some("-(xr - xl)^2/2".into()),
        sizes: vec![n],
        boundary: Boundary::Fixed,
        parameters: vec![("gamma".into(), gamma)],
        ..Lattice::default()
    };
    let shape: Vec<f64> = (1..=n).map(|i| (PI * k * i as f64 / (n + 1) as f64).sin()).collect();
    let omega = 2.0 * (PI * k / (2.0 * (n + 1) as f64)).sin();
    let damped = (omega * omega - 0.25 * gamma * gamma).sqrt();
    let amplitude = |t: f64| (0.5 * gamma * t).exp() * ((damped * t).cos() - 0.5 * gamma / damped * (damped * t).sin());
    let start = Start::new(0.0, shape.clone(), vec![0.0; n], 0.0);
    let motion = SiteMotion {
        rows: OutputTimes::Every(50),
        ..SiteMotion::new(start, time, by("blanes_moan_6"), Steps::Size(0.1))
    };
    let (_, rows) = lattice.system().unwrap().record(&motion).unwrap();
    assert_eq!(rows.len(), 11);
    for row in rows {
        for (x, s) in row[1..=n].iter().zip(&shape) {
            // The truncation error of order 6 with omega h = 0.01 is far below round-off, which accumulates to less
            // than this in 500 steps.
            assert!((x - s * amplitude(row[0])).abs() < 1e-12, "at {}", row[0]);
        }
    }
}

#[test]
fn energy_over_sigma_is_conserved() {
    let lattice = chain(200, Boundary::Periodic).system().unwrap();
    for (name, bound) in [("blanes_moan_6", 1e-10), ("gauss_2", 1e-6), ("strang", 1e-3)] {
        let start = Start::new(0.0, waves(200), vec![0.0; 200], 0.0);
        let steps = Steps::Size(0.02);
        let motion = SiteMotion {
            rows: OutputTimes::Every(50),
            conformal_factor: true,
            ..SiteMotion::new(start, 20.0, by(name), steps)
        };
        let (_, rows) = lattice.record(&motion).unwrap();
        let scaled = |row: &Vec<f64>| row[row.len() - 2] / row[row.len() - 1].exp();
        // The bounds are the errors of the methods, of order 6, 4 and 2, without a drift.
        let off = rows.iter().map(|row| (scaled(row) / scaled(&rows[0]) - 1.0).abs()).fold(0.0, f64::max);
        assert!(off < bound, "{name}: {off:e}");
        let factor = rows.last().unwrap().last().copied().unwrap();
        // sigma is e^(gamma t); for collocation it is accurate to the order of the method.
        assert!((factor + 2.0).abs() < 1e-8, "{name}: {factor}");
    }
}

#[test]
fn momenta_of_bodies_decay_as_the_factor() {
    for dimensions in [2, 3] {
        let n = 20;
        let masses: Vec<f64> = (0..n).map(|i| 1.0 / (1 + i) as f64).collect();
        let gamma = -0.1;
        let bodies = Bodies { masses, dimensions, g: 0.1, gamma }.system().unwrap();
        let angle = |k: usize| 2.4 * (k / dimensions) as f64 + 1.57 * (k % dimensions) as f64;
        let q: Vec<f64> = (0..n * dimensions).map(|k| (1.0 + (k / dimensions) as f64) * angle(k).cos()).collect();
        let v: Vec<f64> = (0..n * dimensions).map(|k| 0.3 * (angle(k) + 1.0).cos()).collect();
        let start = Start::new(0.0, q, v, 0.0);
        let motion = SiteMotion {
            rows: OutputTimes::Every(20),
            ..SiteMotion::new(start, 10.0, by("strang"), Steps::Size(0.05))
        };
        let (outcome, rows) = bodies.record(&motion).unwrap();
        assert_eq!(outcome.status, Status::Completed);
        let momenta = |row: &[f64]| -> Vec<f64> {
            let (q, p) = (&row[1..], &row[1 + 2 * n * dimensions..]);
            let at = |x: &[f64], i: usize, d: usize| x[i * dimensions + d];
            let total = (0..dimensions).map(|d| (0..n).map(|i| at(p, i, d)).sum::<f64>());
            let turning = [(0, 1), (1, 2), (2, 0)].into_iter().filter(|(a, b)| *a < dimensions && *b < dimensions);
            let angular =
                turning.map(|(a, b)| (0..n).map(|i| at(q, i, a) * at(p, i, b) - at(q, i, b) * at(p, i, a)).sum());
            total.chain(angular).collect()
        };
        let first = momenta(&rows[0]);
        assert!(first.iter().all(|m| m.abs() > 1e-3), "{first:?}");
        for row in &rows {
            for (m, m0) in momenta(row).iter().zip(&first) {
                // Round-off of 200 steps of 20 bodies at distances up to 20.
                assert!((m - m0 * (gamma * row[0]).exp()).abs() < 1e-12, "{dimensions}: {m} of {m0} at {}", row[0]);
            }
        }
    }
}

#[test]
fn what_is_wrong_is_said_with_the_argument() {
    let message = |lattice: Lattice| lattice.system().err().unwrap().to_string();
    let of = |site: &str, bond: &str| Lattice {
        site: site.into(),
        bond: Some(bond.into()),
        sizes: vec![20],
        ..Lattice::default()
    };
    let good = "x'^2/2";
    let cases = [
        (of("x'^2/2 - cos(y)", "xl*xr"), "`site`: line 1, column 14: unknown name `y`"),
        (of(good, "xl*x"), "`bond`: line 1, column 4: unknown name `x`"),
        (of("x'^2/2 - z^2", "xl*xr"), "`site` depends on z in another form than `gamma*z`"),
        (of("x*x'^2/2", "xl*xr"), "`site` is not of the form m*x'^2/2 - V(t, x) + gamma*z"),
        (of("x'", "xl*xr"), "`site` is not of the form"),
        (of("-x'^2/2", "xl*xr"), "`site` has the mass -1"),
        (of(good, "xl*xr + z"), "`bond` depends on z"),
        (of(good, "-(xr' - xl')^2/2"), "`bond` depends on velocities"),
        (of(good, "xl*xr'"), "`bond` depends on velocities"),
        (Lattice { sizes: vec![], ..of(good, "xl*xr") }, "`sites` has no direction"),
        (Lattice { sizes: vec![1], ..of(good, "xl*xr") }, "`sites` has 1 along a direction; at least 2"),
        (
            Lattice { parameters: vec![("gama".into(), 1.0)], ..of(good, "xl*xr") },
            "`parameters` has `gama`, which is used neither",
        ),
        (Lattice { coordinates: vec![], ..of(good, "xl*xr") }, "`coordinates` has 0 names"),
    ];
    for (lattice, expected) in cases {
        let found = message(lattice);
        assert!(found.starts_with(expected), "{found:?} for {expected:?}");
    }
    assert!("Periodic".parse::<Boundary>().unwrap_err().to_string().starts_with("`boundary` is \"Periodic\""));
    let bodies = |masses: &[f64], dimensions| Bodies { masses: masses.into(), dimensions, g: 1.0, gamma: 0.0 }.system();
    for (refused, expected) in [
        (bodies(&[1.0], 2), "`masses` has 1 bodies"),
        (bodies(&[1.0, 0.0], 2), "`masses` has 0 for body 1"),
        (bodies(&[1.0, f64::NAN], 2), "`masses` has NaN for body 1"),
        (bodies(&[1.0, 1.0], 4), "`q0` has 4 components for each body"),
    ] {
        let found = refused.err().unwrap().to_string();
        assert!(found.starts_with(expected), "{found:?} for {expected:?}");
    }
    let system = of(good, "-(xr - xl)^2/2").system().unwrap();
    let ask = |change: &dyn Fn(&mut SiteMotion)| {
        let start = Start::new(0.0, vec![0.0; 20], vec![1.0; 20], 0.0);
        let mut motion = SiteMotion::new(start, 1.0, by("strang"), Steps::Count(2));
        change(&mut motion);
        system.run(&motion, &mut ()).err().unwrap().to_string()
    };
    for (found, expected) in [
        (ask(&|m| m.by = by("gauss_8")), "`integrator` is \"gauss_8\", which is for up to 16 coordinates"),
        (ask(&|m| m.end = 0.0), "`t` ends at 0, and the motion starts at 0"),
        (ask(&|m| m.steps = Steps::Size(-0.1)), "`step` is -0.1"),
        (ask(&|m| m.steps = Steps::Size(1e-300)), "`step` gives 1.0e300 steps"),
        (ask(&|m| m.rows = OutputTimes::Every(0)), "`every` is 0"),
        (ask(&|m| m.rows = OutputTimes::At(vec![0.5, 0.2])), "the time t = 0.2 of row 1 is out of order"),
        (ask(&|m| m.rows = OutputTimes::At(vec![f64::NAN])), "the time t = NaN of row 0"),
        (ask(&|m| m.start.q = vec![0.0; 3]), "`q` has 3 numbers, but the system has 20"),
        (ask(&|m| m.start.q[7] = f64::NAN), "`q[7]` is NaN"),
        (ask(&|m| m.start.z = f64::INFINITY), "`z` is inf"),
    ] {
        assert!(found.starts_with(expected), "{found:?} for {expected:?}");
    }
    let none = SiteMotion::new(Start::new(0.0, vec![0.0; 20], vec![1.0; 20], 0.0), 1.0, by("strang"), Steps::Count(0));
    assert!(matches!(system.run(&none, &mut ()), Err(RuntimeError::Input(_))));
}

/// Ends a motion after a number of rows.
struct Until(usize);

impl RunMonitor for Until {
    fn row(&mut self, _: &[f64]) -> ControlFlow<()> {
        self.0 -= 1;
        if self.0 == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

#[test]
fn a_motion_that_is_stopped_or_fails_has_a_state_of_numbers() {
    let lattice = chain(30, Boundary::Free).system().unwrap();
    let start = Start::new(0.0, waves(30), vec![0.0; 30], 0.0);
    let motion = SiteMotion::new(start, 1.0, by("strang"), Steps::Count(10));
    let stopped = lattice.run(&motion, &mut Until(4)).unwrap();
    assert!(matches!(stopped.status, Status::Stopped { step: 3, .. }), "{}", stopped.status);
    assert_eq!((stopped.steps, stopped.t), (3, 1.0 / 10.0 * 3.0));
    // Steps far beyond the stability limit.
    let start = Start::new(0.0, waves(30), vec![0.0; 30], 0.0);
    let motion =
        SiteMotion { rows: OutputTimes::Every(1000), ..SiteMotion::new(start, 1e5, by("strang"), Steps::Size(10.0)) };
    let Outcome { status, q, p, v, z, .. } = lattice.run(&motion, &mut ()).unwrap();
    assert!(matches!(status, Status::Failed { .. }), "{status}");
    assert!(q.iter().chain(&p).chain(&v.unwrap()).chain(&z).all(|x| x.is_finite()));
}
