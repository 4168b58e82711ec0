//! Kinks and jumps of contact Hamiltonians, compared with exact motions and with those of Lagrangians.

use super::{accurate, by_steps};
use contact_geom::table::{Interpolation, Table};
use discrete_herglotz::{AnyIntegrator, Status, Steps};
use formula_lagrangian::{Formula, FormulaNames};
use herglotz_runtime::{InitialVelocity, Motion, Outcome, Start, StepControl, System};

/// The depths and the speeds of sound of a table: three layers in each of which rays are arcs of circles.
const DEPTHS: [f64; 4] = [0.0, 10.0, 30.0, 60.0];
const SPEEDS: [f64; 4] = [1.0, 1.05, 1.4, 1.5];

/// A formula, with the table `c` of the speeds and the parameter k.
fn formula(text: &str, coordinates: &[&str]) -> Formula {
    let tables = [("c", Table::new(&DEPTHS, &SPEEDS, Interpolation::Linear).unwrap())];
    let names = FormulaNames { tables: &tables, ..FormulaNames::new(coordinates, &[("k", 0.3)]) };
    let parse = if text.contains("p_") { Formula::parse_hamiltonian } else { Formula::parse_lagrangian };
    parse(text, &names).unwrap()
}

/// The motion from a momentum, from the time 0.
fn run(formula: &Formula, q: &[f64], p: &[f64], t: f64, control: StepControl) -> Outcome {
    let start = Start { velocity: InitialVelocity::Momentum(p.to_vec()), ..Start::new(0.0, q, p, 0.1) };
    let outcome = System::new(formula).unwrap().run(&Motion::new(start, t, control), &mut ()).unwrap();
    assert_eq!(outcome.status, Status::Completed, "{control:?}");
    outcome
}

fn by_gauss(stages: usize, h: f64) -> StepControl {
    StepControl::Steps { by: AnyIntegrator::Gauss { stages }, steps: Steps::Size(h) }
}

/// The text of a Hamiltonian, with q and p at the start, the final time, and q and p there.
type HamiltonianCase = (&'static str, &'static [f64], &'static [f64], f64, &'static [f64], &'static [f64]);

/// By steps and by accuracy, against exact motions.
#[test]
fn kinks_and_jumps_of_a_hamiltonian_are_located() {
    // The root of 0.4.
    const C: f64 = 0.632_455_532_033_675_9;
    const R: f64 = std::f64::consts::SQRT_2;
    // A jump of the potential, over which H is conserved; a wall that is too high; a kink; a switch of a time-optimal
    // control, whose H is linear in p on each side; jumps and kinks in time.
    let cases: [HamiltonianCase; 7] = [
        ("p_x^2/2 + if(x > 0.5, 0.3, 0)", &[0.0], &[1.0], 2.0, &[0.5 + 1.5 * C], &[C]),
        ("p_x^2/2 + if(x > 0.5, 0.8, 0)", &[0.0], &[1.0], 2.0, &[-1.0], &[-1.0]),
        ("p_x^2/2 + abs(x)", &[-1.0], &[0.0], 1.5 * R, &[0.75], &[0.5 * R]),
        ("p_x*y - abs(p_y)", &[1.0, 0.0], &[1.0, 1.0], 2.0, &[0.0, 0.0], &[1.0, -1.0]),
        ("p_x*if(x > 1, 0.5, 1)", &[0.0], &[1.0], 2.0, &[1.5], &[2.0]),
        ("p_x^2/2 - x*if(t > 0.37, if(t < 0.371, 1000, 0), 0)", &[0.0], &[0.0], 1.0, &[0.6295], &[1.0]),
        ("p_x^2/2 + x*max(1 - t, 0)", &[0.0], &[0.0], 2.0, &[-1.0 / 3.0 - 0.5], &[-0.5]),
    ];
    for (text, q, p, t, at, momentum) in cases {
        let formula = formula(text, if q.len() == 1 { &["x"] } else { &["x", "y"] });
        let controls = [accurate(1e-9), by_steps(7), by_gauss(2, 0.1), by_gauss(1, 0.003)];
        for (control, bound) in controls.into_iter().zip([1e-9, 1e-12, 1e-6, 1e-5]) {
            let found = run(&formula, q, p, t, control);
            for (found, exact) in found.q.iter().zip(at).chain(found.p.iter().zip(momentum)) {
                assert!((found - exact).abs() < bound, "{text}, {control:?}: {found} for {exact}");
            }
        }
    }
}

/// The time, the distance and the momentum of a ray at its turning point, from Snell's law in each layer.
#[test]
fn a_ray_turns_where_the_table_says() {
    let (slowness, energy) = (0.75_f64, 1.0_f64);
    let (mut time, mut distance, mut depth) = (0.0, 0.0, 0.0);
    for (layer, c) in SPEEDS.windows(2).enumerate() {
        let gradient = (c[1] - c[0]) / (DEPTHS[layer + 1] - DEPTHS[layer]);
        let sine = |c: f64| (c * slowness).min(1.0);
        let cosine = |c: f64| (1.0 - sine(c) * sine(c)).sqrt();
        time += ((1.0 / sine(c[0])).acosh() - (1.0 / sine(c[1])).acosh()) / gradient;
        distance += (cosine(c[0]) - cosine(c[1])) / (gradient * slowness);
        depth += (c[1].min(1.0 / slowness) - c[0]) / gradient;
        if c[1] * slowness >= 1.0 {
            break;
        }
    }
    let ray = formula("c(y)*hypot(p_x, p_y)", &["x", "y"]);
    let p = [slowness, (energy - slowness * slowness).sqrt()];
    for (control, bound) in [(accurate(1e-10), 1e-9), (by_steps(9), 1e-9), (by_gauss(2, 0.5), 1e-5)] {
        let found = run(&ray, &[0.0, 0.0], &p, time, control);
        let off = [found.q[0] - distance, found.q[1] - depth, found.p[0] - slowness, found.p[1]];
        assert!(off.iter().all(|off| off.abs() < bound * distance), "{control:?}: {off:?}");
    }
}

/// A Hamiltonian with a Lagrangian has its motions, over each kind of surface.
#[test]
fn switches_are_those_of_the_lagrangian() {
    let pairs: [(&str, &str, &[&str]); 7] = [
        ("x'^2/2 - x^2/2 - k*abs(z)", "p_x^2/2 + x^2/2 + k*abs(z)", &["x"]),
        ("x'^2/2 - x^2/2 - k*z - abs(x - 0.3)*z", "p_x^2/2 + x^2/2 + k*z + abs(x - 0.3)*z", &["x"]),
        ("x'^2/2*if(x > 0.3, 2, 1) - x^2", "p_x^2/2/if(x > 0.3, 2, 1) + x^2", &["x"]),
        ("x'^2/2 - if(x > 0.8*k*t, 0.1, 0)", "p_x^2/2 + if(x > 0.8*k*t, 0.1, 0)", &["x"]),
        ("x'^2/2 - c(8 + 9*x)*x^2 - k*z", "p_x^2/2 + c(8 + 9*x)*x^2 + k*z", &["x"]),
        (
            "(x'^2 + y'^2)/2 - if(x + y^2/4 > 0.5, 0.2, 0) - k*z",
            "(p_x^2 + p_y^2)/2 + if(x + y^2/4 > 0.5, 0.2, 0) + k*z",
            &["x", "y"],
        ),
        (
            "(x'^2 + y'^2)/2 - min(x*y, x - y) - (x^2 + y^2)",
            "(p_x^2 + p_y^2)/2 + min(x*y, x - y) + x^2 + y^2",
            &["x", "y"],
        ),
    ];
    for (l, h, coordinates) in pairs {
        let [of_l, of_h] = [l, h].map(|text| formula(text, coordinates));
        for k in 0..6 {
            let of = |i: usize| ((k * 5 + i) as f64 * 0.618_033_988_749_894_9).fract() * 2.0 - 0.9;
            let (q, p) = ([of(1), of(2)], [of(3), of(4)]);
            let n = coordinates.len();
            let [expected, found] = [&of_l, &of_h].map(|formula| run(formula, &q[..n], &p[..n], 3.0, accurate(1e-10)));
            let all = |of: &Outcome| [&of.q[..], &of.p, of.z.as_slice()].concat();
            for (found, expected) in all(&found).iter().zip(all(&expected)) {
                assert!((found - expected).abs() < 2e-9, "{h} from {q:?}, {p:?}: {found} for {expected}");
            }
        }
    }
}

/// Named times end steps.
#[test]
fn breaks_of_a_hamiltonian_end_steps() {
    let pulse = formula("p_x^2/2 - x*tanh((t - 1)*1e9)", &["x"]).with_breaks(&[1.0]).unwrap();
    for control in [accurate(1e-9), by_steps(7), by_gauss(2, 0.3)] {
        let found = run(&pulse, &[0.0], &[0.0], 2.0, control);
        assert!((found.q[0] + 1.0).abs() + found.p[0].abs() < 1e-8, "{control:?}: {:?}, {:?}", found.q, found.p);
    }
}

/// Where H is linear in p its value, and with it `p . v`, may vanish or decay while momenta do not: the action has the
/// round-off of the terms of `p . v`. The bound is that of the reference, by given steps.
#[test]
fn the_accuracy_of_a_hamiltonian_that_is_linear_in_momenta() {
    let cases: [(&str, [f64; 2], [f64; 2], f64); 3] = [
        // Van der Pol, where H decays as e^-t; a rotation with H = 0; a lift that is not damped, whose momenta grow.
        ("p_x*y + p_y*((1 - x^2)*y - x) + z", [2.0, 0.0], [1.0, 0.5], 100.0),
        ("p_x*y - p_y*x + z", [2.0, 0.0], [1.0, 0.0], 30.0),
        ("p_x*y + p_y*((1 - x^2)*y - x)", [2.0, 0.0], [1.0, 0.5], 40.0),
    ];
    for (text, q, p, t) in cases {
        let h = formula(text, &["x", "y"]);
        let reference = run(&h, &q, &p, t, by_gauss(12, 0.02));
        for error in [1e-3, 1e-6, 1e-9] {
            let found = run(&h, &q, &p, t, accurate(error));
            for (found, expected) in [(&found.q, &reference.q), (&found.p, &reference.p)] {
                let size = expected.iter().fold(0.0, |size: f64, x| size.max(x.abs()));
                let off = found.iter().zip(expected).map(|(a, b)| (a - b).abs());
                assert!(
                    off.fold(0.0, f64::max) < error.max(1e-11) * size,
                    "{text}, {error}: {found:?} for {expected:?}"
                );
            }
        }
    }
}

/// In coordinates that fill a kernel and in others.
#[test]
fn rates_are_the_contact_field() {
    let systems =
        [("p_x^2/2 + x^2/2 + k*z", &["x"][..]), ("p_x^2/2 + x*p_y*z + c(2 + x^2) + y*w*p_w", &["x", "y", "w"])];
    for (text, coordinates) in systems {
        let (system, n) = (System::new(&formula(text, coordinates)).unwrap(), coordinates.len());
        let (q, p) = (&[0.7, -0.4, 1.3][..n], [0.3, 1.1, -0.6][..n].to_vec());
        let y = [q, &p, &[0.2]].concat();
        let mut rates = vec![0.0; 2 * n + 1];
        system.rates(0.5, &y, &mut rates);
        let at = Start { velocity: InitialVelocity::Momentum(p), ..Start::new(0.5, q, [], 0.2) };
        assert_eq!(rates, system.hamiltonian_geometry(&at).unwrap().field, "{text}");
        system.rates(0.5, &y[1..], &mut rates);
        assert!(rates.iter().all(|rate| rate.is_nan()), "{text}");
    }
}
