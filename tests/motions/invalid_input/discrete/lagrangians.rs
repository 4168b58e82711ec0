//! Invalid input to discrete Lagrangians: their jets and single steps, the solvers of the steps, and paths.

use super::{STEPS, starts};
use crate::forces::forced_one;
use crate::invalid_input::InputTest;
use crate::invalid_input::numbers::{CLAIMING, EVERYTHING, EXTREME, Grade, Report, fine, grade, places, triples};
use crate::lagrangians::one;
use contact_examples::systems::{Pendulum, QuadraticInZ};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::statements::AnyForce;
use contact_geom::{ChartVector, DiscretePoint, Lagrangian, PhasePoint, Statement, Structure, Symmetry};
use discrete_herglotz::{
    AnyIntegrator, DiscreteLagrangian, DiscreteStep, MomentumDecay, MomentumRow, Problem, Steps, Until,
    checks::{check_claims, check_unforced},
    gauss::Gauss,
    rules::{Method, Rule},
    solve::{Solver, last_correction},
    splitting::{ActionStrang, Riccati, Strang},
    statements,
    theory::{
        DiscretePath, HamiltonianFlow, derived_jet, derived_second_jet, discrete_action, discrete_flow,
        discrete_flow_jacobian, discrete_forces, discrete_momentum, discrete_regularity, discrete_symmetry_defect,
        hamiltonian_flow, hamiltonian_flow_jacobian, legendre_inverse, legendre_minus, legendre_minus_inverse,
        legendre_plus, legendre_plus_inverse, sigma_d,
    },
};

pub const TESTS: &[InputTest] = &[
    InputTest { entries: &["DiscreteStep::checked"], run: transitions },
    InputTest {
        entries: &[
            "theory::derived_jet",
            "theory::derived_second_jet",
            "theory::sigma_d",
            "theory::legendre_minus",
            "theory::legendre_plus",
            "theory::discrete_regularity",
            "theory::discrete_momentum",
            "theory::discrete_symmetry_defect",
            "Quadrature::extended_jet",
            "theory::discrete_forces",
            "DiscreteLagrangian::forces",
            "DiscreteLagrangian::value",
            "DiscreteLagrangian::jet",
            "DiscreteLagrangian::second_jet",
        ],
        run: jets,
    },
    InputTest {
        entries: &[
            "theory::discrete_flow",
            "theory::discrete_flow_jacobian",
            "theory::hamiltonian_flow",
            "theory::hamiltonian_flow_jacobian",
            "theory::legendre_inverse",
            "theory::legendre_minus_inverse",
            "theory::legendre_plus_inverse",
            "DiscreteLagrangian::forward",
            "DiscreteLagrangian::backward",
        ],
        run: steps,
    },
    InputTest {
        entries: &[
            "Quadrature::new",
            "Rule::of",
            "Quadrature::lagrangian",
            "Gauss::new",
            "Gauss::stages",
            "Method::discretise",
            "Strang::new",
            "ActionStrang::new",
            "ActionStrang::with_flow",
            "DiscreteLagrangian::step_size",
        ],
        run: constructors,
    },
    InputTest {
        entries: &[
            "DiscretePath::new",
            "DiscretePath::points",
            "DiscretePath::steps",
            "DiscretePath::actions",
            "DiscretePath::action_differential",
            "DiscretePath::herglotz_residuals",
            "DiscretePath::extended_residuals",
            "theory::discrete_action",
        ],
        run: paths,
    },
    InputTest { entries: &["MomentumRow::defect", "MomentumDecay::new"], run: momenta },
    InputTest { entries: &["solve::last_correction"], run: corrections },
    InputTest { entries: &["Solver::on_the_stack", "Solver::by_faer", "Solver::solve"], run: solvers },
    InputTest { entries: &["statements::residual", "statements::forced_residual"], run: residuals },
    InputTest { entries: &["check_claims", "check_unforced"], run: claims },
];

fn transitions(report: &mut Report) {
    for x in triples() {
        for sigma in EXTREME {
            let made = DiscreteStep { end: PhasePoint::from(x), velocity: x.y, sigma, iterations: 1 };
            let checked = made.checked();
            let good = x.is_finite() && sigma.is_finite() && sigma > 0.0;
            report.check(checked.is_ok() == good, || format!("{made:?}: {checked:?}"));
        }
    }
}

fn jets(report: &mut Report) {
    let ld = Rule::TRAPEZOIDAL.of(EVERYTHING, 0.1).unwrap();
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
        let forced = Rule::TRAPEZOIDAL.of(forced_one(EVERYTHING, AnyForce(0.3)), 0.1).unwrap();
        report.formula(&input, forced.forces(t, &at).map(|[minus, plus]| (minus, plus)));
        report.formula(&input, discrete_forces(&forced, t, &at).map(|f| (f.minus, f.plus)));
        report.formula(&input, legendre_minus(&ld, t, &at));
        report.formula(&input, legendre_plus(&ld, t, &at));
        report.formula(&input, discrete_regularity(&ld, t, &at).map(|r| (r.sigma, r.fibre.condition())));
        report.formula(&input, discrete_momentum(&ld, &group, t, &at));
        report.formula(&input, discrete_symmetry_defect(&ld, &group, t, &at));
        let s = ld.extended_jet(t, &at, 0.2);
        report.formula(&input, fine((s.value, (s.s1, s.s2), (s.z0, s.z1))));
    }
}

/// Single steps, which are finite or refused.
fn steps(report: &mut Report) {
    fn one<D: DiscreteLagrangian<1>>(report: &mut Report, ld: &D) {
        for (t, x) in starts() {
            let input = (t, x);
            let guess = SVector::from([0.5]);
            for solver in [&mut Solver::on_the_stack(), &mut Solver::by_faer()] {
                report.entry_point(&input, ld.forward(t, &x, &guess, solver).map(|s| (s.end, s.velocity, s.sigma)));
                report.entry_point(&input, ld.backward(t, &x, &guess, solver).map(|s| (s.end, s.velocity, s.sigma)));
            }
            report.entry_point(&input, legendre_inverse(&EVERYTHING, t, &x, &guess));
            report.entry_point(&input, legendre_minus_inverse(ld, t, &x, &guess));
            report.entry_point(&input, legendre_plus_inverse(ld, t, &x, &guess));
            for way in [HamiltonianFlow::Direct, HamiltonianFlow::ThroughPlus, HamiltonianFlow::ThroughMinus] {
                report.entry_point(&input, hamiltonian_flow(ld, t, &x, &guess, way));
            }
            let points = DiscretePoint::from(ChartVector::from(x));
            let image = discrete_flow(ld, t, &points);
            report.entry_point(&input, image);
            // The steps of a splitting do not depend on the action.
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
        for guess in EXTREME {
            // A poor guess costs iterations, or fails the step, and the step that is returned is finite.
            let step = ld.forward(0.4, &tame, &SVector::from([guess]), &mut Solver::default());
            let good = step.as_ref().map_or(true, |s| grade(&s.end) != Grade::Bad);
            report.check(good, || format!("the guess {guess} leads to {step:?}"));
        }
    }
    one(report, &Rule::MIDPOINT.of(EVERYTHING, 0.1).unwrap());
    one(report, &Rule::RECTANGLE.of(EVERYTHING, 0.1).unwrap());
    one(report, &Gauss::new(EVERYTHING, 3, 0.1).unwrap());
    one(report, &Strang::new(CLAIMING, 0.1, 0.4, &triples()[0].into()).unwrap());
}

fn constructors(report: &mut Report) {
    let tame: PhasePoint<1> = triples()[0].into();
    for h in EXTREME.into_iter().chain(STEPS) {
        let good = h != 0.0 && h.is_finite();
        let rule = Rule::MIDPOINT.of(EVERYTHING, h);
        report.check(rule.is_ok() == good && rule.as_ref().map_or(true, |r| r.step_size() == h), || format!("h = {h}"));
        report.check(rule.is_err() || rule.is_ok_and(|r| r.lagrangian().structure() == Structure::default()), || {
            "another".into()
        });
        report.check(Gauss::new::<1>(EVERYTHING, 8, h).is_ok() == good, || format!("Gauss with h = {h}"));
        let strang = Strang::new(CLAIMING, h, 0.4, &tame);
        report.check(good || strang.is_err(), || format!("Strang with h = {h}"));
        let strang = ActionStrang::new(one(QuadraticInZ::default()), h, 0.4, &tame);
        report.check(good || strang.is_err(), || format!("ActionStrang with h = {h}"));
        let strang = ActionStrang::with_flow(CLAIMING, &Riccati { b: -0.1, c: 0.0 }, h, 0.4, &tame);
        report.check(good || strang.is_err(), || format!("ActionStrang with a flow and h = {h}"));
        for method in Method::ALL {
            let made = method.discretise(CLAIMING, h, 0.4, &tame);
            report.check(good || made.is_err(), || format!("{method} with h = {h}"));
        }
    }
    for (t, x) in starts() {
        let bad = grade(&(t, x)) == Grade::Bad;
        report.check(!bad || Strang::new(CLAIMING, 0.1, t, &x).is_err(), || format!("Strang at t = {t}, {x:?}"));
    }
    for stages in [0, 1, 16, 17, usize::MAX] {
        let made = Gauss::new::<1>(EVERYTHING, stages, 0.1);
        let good = (1..=16).contains(&stages);
        report.check(made.is_ok() == good && made.is_ok_and(|g| g.stages() == stages) == good, || {
            format!("{stages} stages")
        });
    }
}

fn paths(report: &mut Report) {
    let ld = Rule::MIDPOINT.of(EVERYTHING, 0.1).unwrap();
    for points in [vec![], vec![SVector::from([0.1])]] {
        report.check(DiscretePath::<1>::new(points).is_err(), || "a path without a step".into());
    }
    for value in EXTREME {
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
    for value in EXTREME {
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
    for value in EXTREME {
        let row = MomentumRow { t: 0.0, momentum: value, predicted: 0.5 };
        report.formula(&value, fine(row.defect()));
        let row = MomentumRow { t: 0.0, momentum: 0.5, predicted: value };
        let defect = row.defect();
        // An infinite prediction gives NaN; a prediction of zero an infinite defect.
        report.check(!(defect <= 0.1), || format!("predicted {value}: {defect}"));
        let mut decay = MomentumDecay::new(Symmetry::Translation(SVector::from([1.0])));
        let problem = Problem::new(&CLAIMING, 0.4, PhasePoint::new([0.1], [value], 0.0));
        let observed = problem.and_then(|problem| {
            let run = problem.by(AnyIntegrator::Discrete(Method::Midpoint)).steps(Steps::Count(3)).observe(&mut decay);
            run.run(Until::Time(0.6)).map(|outcome| outcome.p)
        });
        let rows = decay.rows.iter().map(|row| (row.momentum, row.predicted)).collect::<Vec<_>>();
        report.check(observed.is_err() || rows[0] == (value, value), || format!("p = {value}: {rows:?}"));
        report.entry_point(&value, observed.map(|_| rows));
    }
}

/// An iteration does not end on a correction that is not a number.
fn corrections(report: &mut Report) {
    // Sizes are not negative.
    for value in EXTREME.into_iter().filter(|v| v.is_nan() || *v >= 0.0) {
        report.check(value.is_finite() || !last_correction(value, 1.0, 1e-16), || format!("the correction {value}"));
        report.check(!value.is_nan() || !last_correction(1.0, value, 1e-16), || format!("after {value}"));
        report.check(!value.is_nan() || !last_correction(1.0, 1.0, value), || format!("the tolerance {value}"));
    }
}

fn solvers(report: &mut Report) {
    for value in EXTREME {
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
                    // Numbers that are not finite do not stay in the workspace.
                    let mut b = SVector::from([2.0, 3.0]);
                    let good = solver.solve(&mut SMatrix::identity(), &mut b);
                    report
                        .check(good.is_ok() && b == SVector::from([2.0, 3.0]), || format!("{name}: after {matrix:?}"));
                }
            }
        }
    }
}

fn residuals(report: &mut Report) {
    let ld = Rule::MIDPOINT.of(one(Pendulum::default()), 0.1).unwrap();
    for (t, x) in places() {
        for statement in Statement::ALL {
            let known = statements::STATEMENTS.contains(&statement);
            let found = statements::residual(statement, &ld, &[], t, &DiscretePoint::from(x));
            let good = match &found {
                Ok(None) => !known || [Statement::DiscreteInvariance, Statement::DiscreteNoether].contains(&statement),
                Ok(Some(r)) => known && (x.is_finite() || !(*r <= 1e-3)),
                Err(_) => known,
            };
            report.check(good, || format!("statement {statement} at t = {t}, {x:?}: {found:?}"));
            let forced = forced_one(one(Pendulum::default()), AnyForce(0.3));
            let known = statements::FORCED_STATEMENTS.contains(&statement);
            let found = statements::forced_residual(statement, &forced, &[], 0.1, t, &x.into());
            let good = match &found {
                Ok(None) => !known || statement == Statement::ForcedMomentum,
                Ok(Some(r)) => known && (x.is_finite() && t.is_finite() || !(*r <= 1e-3)),
                Err(_) => known,
            };
            report.check(good, || format!("statement {statement} at t = {t}, {x:?}: {found:?}"));
        }
    }
}

/// A property is verified where L is defined; elsewhere it is not assumed to hold.
fn claims(report: &mut Report) {
    let forced = forced_one(CLAIMING, AnyForce(0.3));
    let refused =
        check_unforced::<1>(&forced, "a method").is_err() && check_unforced::<1>(&CLAIMING, "a method").is_ok();
    report.check(refused, || "a force is taken".into());
    for (t, x) in places() {
        let found = check_claims(&CLAIMING, t, &x.into());
        // The properties do not depend on the action.
        let bad = grade(&(t, (x.x, x.y))) == Grade::Bad;
        report.check(!bad || found.is_err(), || format!("at t = {t}, {x:?}: {found:?}"));
        report.check(grade(&(t, x)) != Grade::Tame || found == Ok(CLAIMING.structure()), || {
            format!("at t = {t}, {x:?}: {found:?}")
        });
    }
}
