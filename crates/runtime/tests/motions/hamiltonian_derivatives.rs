//! Derivatives of the motions of contact Hamiltonians, regular or linear in p, against differences of runs.

use crate::event_times::crossings;
use herglotz_runtime::{
    AnyIntegrator, Column, EndCovector, Event, Formula, FormulaNames, InitialVelocity, Motion, OutputTimes, Start,
    StepControl, Steps, System,
};

const PARAMETERS: [(&str, f64); 2] = [("k", 1.3), ("c", 0.2)];
const START: [f64; 5] = [0.7, -0.3, 0.4, 0.9, 0.1];

/// One that is regular, and van der Pol's oscillator with its costates, which is linear in p and has no Lagrangian.
const TEXTS: [&str; 2] =
    ["(p_x^2 + p_y^2*(1 + x^2/4))/2 + k*cos(x - y) + c*z + c*z^2/8", "p_x*y + p_y*(k*(1 - x^2)*y - x) + c*z"];

fn system(text: &str, values: [f64; 2]) -> System {
    let mut formula = Formula::parse_hamiltonian(text, &FormulaNames::new(&["x", "y"], &PARAMETERS)).unwrap();
    PARAMETERS.iter().zip(values).for_each(|((name, _), value)| formula.set(name, value).unwrap());
    System::new(&formula).unwrap()
}

fn motion(system: &System, start: [f64; 5]) -> Motion {
    let way = StepControl::Steps { by: AnyIntegrator::Gauss { stages: 4 }, steps: Steps::Count(30) };
    let velocity = InitialVelocity::Momentum(start[2..4].to_vec());
    let start = Start { t: 0.0, q: start[..2].to_vec(), velocity, z: start[4] };
    let event = |text: &str| Event::new(system.formula().expression(text).unwrap());
    Motion { events: vec![event("x - c"), event("p_y - k*y/4")], ..Motion::new(start, 3.0, way) }
}

fn rows(system: &System, motion: &Motion) -> Vec<f64> {
    let columns = ["x", "y", "x'", "y'", "p_x", "p_y", "z"].map(|name| Column::parse(name, system.formula()).unwrap());
    let rows = Some(OutputTimes::At(vec![1.13, 3.0]));
    system.record(&Motion { rows, columns: columns.to_vec(), events: Vec::new(), ..motion.clone() }).unwrap().1.concat()
}

/// The rows of a motion, and the times of its sign changes.
type Seen = (Vec<f64>, Vec<f64>);

#[test]
fn derivatives_of_hamiltonians() {
    let names = ["k", "c", "x", "y", "p_x", "p_y", "z"];
    for text in TEXTS {
        let values = PARAMETERS.map(|(_, value)| value);
        let of = system(text, values);
        let at = motion(&of, START);
        let found = crossings(&of, &at);
        assert!(found.len() >= 2, "{found:?}");
        let slopes = of.sensitivity_with_events(&at, &names, &[1.13, 3.0], &found, &mut ()).unwrap();
        for (k, name) in names.iter().enumerate() {
            let moved = |by: f64| {
                let (mut values, mut start) = (values, START);
                if k < 2 {
                    values[k] += by
                } else {
                    start[k - 2] += by
                }
                let of = system(text, values);
                let at = motion(&of, start);
                let times = crossings(&of, &at).iter().map(|at| at.t).collect::<Vec<_>>();
                (rows(&of, &at), times)
            };
            let d = 1e-3;
            let [a, b, c, e] = [d, -d, 2.0 * d, -2.0 * d].map(moved);
            let slope = |of: &dyn Fn(&Seen) -> f64| (8.0 * (of(&a) - of(&b)) - (of(&c) - of(&e))) / (12.0 * d);
            let columns = slopes.rows.iter().flat_map(|row| {
                let row = &row[k];
                row.q.iter().chain(&row.v).chain(&row.p).copied().chain([row.z]).collect::<Vec<_>>()
            });
            for (i, found) in columns.enumerate() {
                let expected = slope(&|of| of.0[i]);
                assert!((found - expected).abs() <= 1e-9 * (1.0 + expected.abs()), "{name}, {i}: {found}, {expected}");
            }
            for (i, found) in slopes.event_times.iter().enumerate() {
                let expected = slope(&|of| of.1[i]);
                // The times are known to the error of the polynomials.
                let off = (found[k] - expected).abs();
                assert!(off <= 1e-6 * (1.0 + expected.abs()), "the time {i}, {name}: {}, {expected}", found[k]);
            }
        }
        let weights =
            EndCovector { t: 0.0, q: [0.3, -0.8].into(), v: [0.2, 0.5].into(), p: [1.1, -0.4].into(), z: 0.6 };
        let all = [weights.clone(), weights.clone()];
        let gradient = of.gradient(&at, &[1.13, 3.0], &mut |_| (0.0, all.to_vec()), &mut ()).unwrap().loss.unwrap().1;
        let by_adjoint = gradient.parameters.iter().chain(&gradient.q).chain(&gradient.rate).chain([&gradient.z]);
        for ((k, name), by_adjoint) in names.iter().enumerate().zip(by_adjoint) {
            let forward: f64 = slopes.rows.iter().map(|row| row[k].dot(&weights)).sum();
            assert!((by_adjoint - forward).abs() <= 1e-12 * (1.0 + forward.abs()), "{name}: {by_adjoint}, {forward}");
        }
    }
}
