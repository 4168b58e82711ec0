//! Derivatives of motions under constraints, also in parameters that the constraints contain, against differences of runs.

use crate::event_times::crossings;
use herglotz_runtime::{
    AnyIntegrator, EndCovector, Event, Formula, Motion, MotionFit, OutputTimes, Series, Start, StepControl, Steps,
    System, Unknown,
};

const PARAMETERS: [(&str, f64); 4] = [("l", 1.3), ("g", 2.0), ("gamma", -0.1), ("k", 0.4)];

/// Two rods in the plane, of which the second is half as long as the first one, with a spring; the start is on the constraints.
/// A force acts where `forced`, and then the mass matrix varies too.
fn linkage(values: [f64; 4], forced: bool) -> System {
    let bent = if forced { " + x*x'*w'/5" } else { "" };
    let text = format!("(x'^2 + y'^2 + u'^2 + w'^2)/2 - g*(y + w) - k*(u - x)^2/2 + gamma*z{bent}");
    let formula = Formula::parse(&text, &["x", "y", "u", "w"], &PARAMETERS).unwrap();
    let formula = if forced { formula.with_force("u", "-k*u'*y").unwrap() } else { formula };
    let mut formula = formula.with_constraints(&["x^2 + y^2 = l^2", "(u - x)^2 + (w - y)^2 = l^2/4"]).unwrap();
    PARAMETERS.iter().zip(values).for_each(|((name, _), value)| formula.set(name, value).unwrap());
    System::new(&formula).unwrap()
}

/// The numbers of the start: the positions, then the velocities, along the constraints for the length 1.3.
const START: [f64; 8] = [1.3, 0.0, 1.3, -0.65, 0.0, 0.7, 0.4, 0.7];

fn motion(start: [f64; 8], by: AnyIntegrator) -> Motion {
    let start = Start::new(0.0, &start[..4], &start[4..], 0.2);
    let way = StepControl::Steps { by, steps: Steps::Count(40) };
    Motion { project: true, ..Motion::new(start, 2.0, way) }
}

fn methods() -> [(AnyIntegrator, bool); 3] {
    let gauss = AnyIntegrator::Gauss { stages: 3 };
    [(gauss, false), (gauss, true), ("kahan_li_6".parse().unwrap(), false)]
}

/// The rows of a motion: q, v, p of each coordinate, and z, at two times.
fn rows(system: &System, motion: &Motion) -> Vec<f64> {
    let names = ["x", "y", "u", "w"];
    let columns = names.iter().flat_map(|name| [(*name).to_owned(), format!("{name}'"), format!("p_{name}")]);
    let columns = columns.chain(["z".to_owned()]).map(|name| name.parse_for(system)).collect();
    let motion = Motion { rows: Some(OutputTimes::At(vec![0.73, 2.0])), columns, ..motion.clone() };
    system.record(&motion).unwrap().1.concat()
}

trait ParseFor {
    fn parse_for(&self, system: &System) -> herglotz_runtime::Column;
}

impl ParseFor for String {
    fn parse_for(&self, system: &System) -> herglotz_runtime::Column {
        herglotz_runtime::Column::parse(self, system.formula()).unwrap()
    }
}

/// Forward derivatives of rows in all parameters and numbers of the start, and the adjoint as their transpose.
#[test]
fn derivatives_under_constraints() {
    let values = PARAMETERS.map(|(_, value)| value);
    let names = ["l", "g", "gamma", "k", "x", "y", "u", "w", "x'", "y'", "u'", "w'", "z"];
    let cases = methods().into_iter().flat_map(|(by, forced)| [(by, forced, 0.0), (by, forced, 0.05)]);
    for (by, forced, off) in cases {
        // A start beside the constraints is moved to them.
        let mut start = START;
        start.iter_mut().enumerate().for_each(|(i, x)| *x += off * f64::sin(i as f64));
        let (system, at) = (linkage(values, forced), motion(start, by));
        let found = system.sensitivity(&at, &names, &[0.73, 2.0], &mut ()).unwrap();
        for (k, name) in names.iter().enumerate() {
            let moved = |by_: f64| {
                let (mut values, mut start) = (values, start);
                match k {
                    0..4 => values[k] += by_,
                    4..12 => start[k - 4] += by_,
                    _ => {}
                }
                let mut at = motion(start, by);
                at.start.z += if k == 12 { by_ } else { 0.0 };
                rows(&linkage(values, forced), &at)
            };
            let d = 2e-4;
            let [a, b, c, e] = [d, -d, 2.0 * d, -2.0 * d].map(moved);
            let column = found.rows.iter().flat_map(|row| {
                let row = &row[k];
                (0..4).flat_map(move |i| [row.q[i], row.v[i], row.p[i]]).chain([row.z])
            });
            for (i, found) in column.enumerate() {
                let expected = (8.0 * (a[i] - b[i]) - (c[i] - e[i])) / (12.0 * d);
                // Differences of fourth order, and of the round-off of forty steps over d.
                let case = format!("{by}, forced {forced}, off {off}, {name}, {i}");
                assert!((found - expected).abs() <= 1e-9 * (1.0 + expected.abs()), "{case}: {found}, {expected}");
            }
        }
        let weights = |k: usize| EndCovector {
            q: [0.3, -0.8, 0.1, 0.5].map(|w| w + k as f64 / 7.0).into(),
            v: [0.2, 0.4, -0.6, 0.1].into(),
            p: [-0.4, 1.1, 0.3, 0.2].into(),
            z: 0.7,
            t: 0.0,
        };
        let of_rows = [weights(0), weights(1)];
        let gradient = system.gradient(&at, &[0.73, 2.0], &mut |_| (0.0, of_rows.to_vec()), &mut ()).unwrap();
        let gradient = gradient.loss.unwrap().1;
        let all = gradient.parameters.iter().chain(&gradient.q).chain(&gradient.rate).chain([&gradient.z]);
        for ((k, name), by_adjoint) in names.iter().enumerate().zip(all) {
            let forward: f64 = found.rows.iter().zip(&of_rows).map(|(row, of)| row[k].dot(of)).sum();
            assert!((by_adjoint - forward).abs() <= 1e-11 * (1.0 + forward.abs()), "{name}: {by_adjoint}, {forward}");
        }
    }
}

/// The times of events, of which one depends on the velocity, so that the force of the constraints matters.
#[test]
fn times_of_events_under_constraints() {
    let values = PARAMETERS.map(|(_, value)| value);
    let with_events = |system: &System, by| {
        let event = |text: &str| Event::new(system.formula().expression(text).unwrap());
        Motion { events: vec![event("y + l/2"), event("u' - k*x/4")], ..motion(START, by) }
    };
    for (by, forced) in methods() {
        let system = linkage(values, forced);
        let at = with_events(&system, by);
        let found = crossings(&system, &at);
        assert!((0..2).all(|k| found.iter().any(|at| at.event == k)), "{found:?}");
        let slopes = system.sensitivity_with_events(&at, &["l", "k"], &[], &found, &mut ()).unwrap();
        for (k, name) in [(0, "l"), (3, "k")] {
            let times = |by_: f64| {
                let mut values = values;
                values[k] += by_;
                let system = linkage(values, forced);
                crossings(&system, &with_events(&system, by))
            };
            let d = 1e-4;
            for (i, (after, before)) in times(d).iter().zip(&times(-d)).enumerate() {
                let (found, expected) = (slopes.event_times[i][k / 3], (after.t - before.t) / (2.0 * d));
                // The times are known to the error of the polynomials, and the differences to d^2.
                let off = (found - expected).abs();
                assert!(off <= 1e-5 * (1.0 + expected.abs()), "{by}, {name}, {i}: {found}, {expected}");
            }
        }
    }
}

/// The length of a rod and the field from measured positions.
#[test]
fn a_fit_of_the_length_of_a_rod() {
    let by = AnyIntegrator::Gauss { stages: 3 };
    let truth = linkage([1.3, 2.0, -0.1, 0.4], false);
    let times: Vec<f64> = (1..=20).map(|k| f64::from(k) / 10.0).collect();
    let columns = vec!["u".to_owned().parse_for(&truth)];
    let recorded = Motion { rows: Some(OutputTimes::At(times.clone())), columns, ..motion(START, by) };
    let values = truth.record(&recorded).unwrap().1.concat();
    let data = Series { quantity: "u".to_owned(), times, values, deviations: None, event: None };
    let guess = linkage([1.2, 1.8, -0.1, 0.4], false);
    let request = MotionFit::new(motion(START, by), ["l", "g"].map(Unknown::free), [data]);
    let fitted = guess.fit(&request, &mut ()).unwrap();
    assert!(fitted.fit.status.is_converged(), "{}", fitted.fit);
    for (found, expected) in fitted.fit.parameters.iter().zip([1.3, 2.0]) {
        assert!((found - expected).abs() <= 1e-9, "{}", fitted.fit);
    }
}
