//! Dry friction: stick and slip by resets.

use contact_geom::VelocityPoint;
use discrete_herglotz::{AnyIntegrator, Problem, Resets, Status, Steps, Until};
use formula_lagrangian::{Direction, Formula, Reset};
use std::f64::consts::PI;

/// `x'' = -x - 0.3 sign x'`, where m is a mode: 1 where the body sticks, since friction balances the spring.
fn oscillator() -> Formula {
    let text = "force[x] = if(m > 0.5, x, -0.3*sign(x'))\nx'^2/2 - x^2/2 + m'^2/2";
    let formula = Formula::parse(text, &["x", "m"], &[]).unwrap();
    let then = &[("x'", "0"), ("m", "if(abs(x) < 0.3, 1, 0)")];
    formula.with_reset(Reset { when: "x'", direction: Direction::Both, then, rest: None }).unwrap()
}

/// From 2 at rest the amplitudes are 2, 1.4, 0.8 and 0.2, at multiples of pi from 0, and the body sticks at t = 3 pi. The
/// reset at the start, which decides whether the body sticks there, is the first one.
#[test]
fn dry_friction_takes_its_amplitudes_and_sticks() {
    let lagrangian = oscillator().lagrangian::<2>().unwrap();
    let problem = Problem::new(&lagrangian, 0.0, VelocityPoint::new([2.0, 0.0], [0.0, 0.0], 0.0)).unwrap();
    for (integrator, h) in [("gauss_8", 0.5), ("gauss_8", 2.0), ("gauss_12", 10.0)] {
        let mut turns = Resets::new();
        let run = problem.by(integrator.parse::<AnyIntegrator>().unwrap()).steps(Steps::Size(h));
        let outcome = run.observe(&mut turns).run(Until::Time(20.0)).unwrap();
        assert_eq!((outcome.status, outcome.unresolved), (Status::Completed, None), "h = {h}");
        let turns: Vec<(f64, f64)> = turns.resets.iter().map(|turn| (turn.t, turn.before.q[0])).collect();
        assert_eq!(turns.len(), 4, "h = {h}: {turns:?}");
        for (k, (turn, amplitude)) in turns.iter().zip([2.0, -1.4, 0.8, -0.2]).enumerate() {
            let t = PI * k as f64;
            // The turn at an extremum of x is exact in x to second order of its time.
            let exact = (turn.0 - t).abs() <= 1e-12 && (turn.1 - amplitude).abs() <= 1e-12;
            assert!(exact, "h = {h}, turn {k} at {}: {}", turn.0 - t, turn.1 - amplitude);
        }
        assert!((outcome.q[0] + 0.2).abs() <= 1e-12 && outcome.q[1] == 1.0, "h = {h}: {:?}", outcome.q);
    }
}

/// The order of a method is kept across the turns.
#[test]
fn dry_friction_keeps_the_order() {
    let lagrangian = oscillator().lagrangian::<2>().unwrap();
    let problem = Problem::new(&lagrangian, 0.0, VelocityPoint::new([2.0, 0.0], [0.0, 0.0], 0.0)).unwrap();
    for (name, order) in [("gauss_1", 2.0), ("gauss_2", 4.0)] {
        let error = |count: usize| {
            let run = problem.by(name.parse::<AnyIntegrator>().unwrap()).steps(Steps::Count(count));
            // After two turns, the motion about 0.3 with the amplitude 0.5.
            let exact = 0.3 + 0.5 * f64::cos(8.0);
            (run.run(Until::Time(8.0)).unwrap().q[0] - exact).abs()
        };
        let slope = (error(40) / error(160)).log2() / 2.0;
        assert!((slope - order).abs() <= 0.15, "{name}: {slope}, {:e}", error(160));
    }
}
