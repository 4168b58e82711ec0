//! Every public function of exact-lagrangian with arguments that are NaN, infinite, tiny, zero or huge: each call returns an error or a
//! result without NaN, does not panic, and does a bounded amount of work.

use crate::lagrangians::{One, one};
use contact_examples::systems::{HarmonicOscillator, OneCoordinate, Pendulum};
use contact_geom::nalgebra::SVector;
use contact_geom::{DiscretePoint, PhasePoint, VelocityPoint};
use discrete_herglotz::{DiscreteLagrangian, rules::Rule, solve::Solver};
use exact_lagrangian::principle::{Curve, MotionCurve, NonHolonomic, SplineCurve, action, action_derivative};
use exact_lagrangian::{
    ContactExponential, ExactError, ExactLagrangian, QuadraticExact, compose, error_orders, herglotz_flow, statements,
    through,
};
use std::fmt::Debug;

/// The debug output of a result, in which a NaN can be found.
fn described<A: Debug, E: Debug>(answer: Result<A, E>) -> Option<String> {
    answer.ok().map(|a| format!("{a:?}"))
}

type Call = (&'static str, fn([f64; 5]) -> Option<String>);

const SYSTEM: One = One::Catalogue(OneCoordinate::Pendulum(Pendulum { gamma: -0.1 }));

fn start([_, _, q, v, z]: [f64; 5]) -> VelocityPoint<1> {
    VelocityPoint::new([q], [v], z)
}

fn points([_, _, q0, q1, z]: [f64; 5]) -> DiscretePoint<1> {
    DiscretePoint::new([q0], [q1], z)
}

fn phase([_, _, q, p, z]: [f64; 5]) -> PhasePoint<1> {
    PhasePoint::new([q], [p], z)
}

fn exponential(h: f64) -> Result<ContactExponential<One>, ExactError<1>> {
    Ok(ContactExponential::new(SYSTEM, h)?)
}

fn exact(h: f64) -> Result<ExactLagrangian<One, 1>, ExactError<1>> {
    Ok(ExactLagrangian::new(SYSTEM, h)?)
}

/// Each function as a function of `(t, h, q, v, z)`, with the coordinates of the point that it takes.
const CALLS: &[Call] = &[
    ("herglotz_flow", |a| described(herglotz_flow(&SYSTEM, a[0], &start(a), a[1]))),
    ("herglotz_flow back", |a| described(herglotz_flow(&SYSTEM, a[0], &start(a), -a[1]))),
    ("exp at", |a| described(exponential(a[1]).and_then(|e| e.at(a[0], &start(a))))),
    ("exp differential", |a| described(exponential(a[1]).and_then(|e| e.differential(a[0], &start(a))))),
    ("retract", |a| described(exponential(a[1]).and_then(|e| e.retract(a[0], &points(a))))),
    ("retract_near", |a| described(exponential(a[1]).and_then(|e| e.retract_near(a[0], &points(a), &[a[3]].into())))),
    ("branches", |a| described(exponential(a[1]).and_then(|e| e.branches(a[0], &points(a), &[[a[3]].into()])))),
    ("conjugate_points", |a| described(exponential(a[1]).and_then(|e| e.conjugate_points(a[0], &start(a))))),
    ("exact retract", |a| described(exact(a[1]).and_then(|e| e.near([a[3]].into()).retract(a[0], &points(a))))),
    ("exact value", |a| exact(a[1]).ok().and_then(|e| described(e.value(a[0], &points(a))))),
    ("exact jet", |a| exact(a[1]).ok().and_then(|e| described(e.jet(a[0], &points(a))))),
    ("exact second jet", |a| exact(a[1]).ok().and_then(|e| described(e.second_jet(a[0], &points(a))))),
    ("exact forward", |a| {
        exact(a[1]).ok().and_then(|e| described(e.forward(a[0], &phase(a), &[a[3]].into(), &mut Solver::default())))
    }),
    ("exact backward", |a| {
        exact(a[1]).ok().and_then(|e| described(e.backward(a[0], &phase(a), &[a[3]].into(), &mut Solver::default())))
    }),
    ("quadratic value", |a| {
        QuadraticExact::new(&one(HarmonicOscillator { gamma: -0.1 }), a[1])
            .ok()
            .and_then(|l| described(l.value(a[0], &points(a))))
    }),
    ("quadratic drag", |a| described(QuadraticExact::new(&one(HarmonicOscillator { gamma: a[3] }), a[1]))),
    ("chetaev", |a| {
        let system = NonHolonomic::new(SYSTEM);
        described(system.chetaev(a[0], &system.lift(a[0], &start(a))))
    }),
    ("chetaev flow", |a| {
        let system = NonHolonomic::new(SYSTEM);
        described(system.flow(a[0], &system.lift(a[0], &start(a)), a[1]))
    }),
    ("chetaev differential", |a| described(NonHolonomic::new(SYSTEM).exponential_differential(a[0], &start(a), a[1]))),
    ("projection", |a| described(NonHolonomic::new(SYSTEM).projection_regularity(a[0], &start(a), a[1]))),
    ("action", |a| {
        let curve = move |s: f64| (SVector::from([a[2] + a[3] * s]), SVector::from([a[3]]));
        described(action(&SYSTEM, &curve, (a[0], a[1]), a[4]))
    }),
    ("action_derivative", |a| {
        let curve = move |s: f64| (SVector::from([a[2] + a[3] * s]), SVector::from([a[3]]));
        described(action_derivative(&SYSTEM, &curve, &curve, (a[0], a[1]), (a[4], a[3])))
    }),
    ("motion curve", |a| described(MotionCurve { lagrangian: &SYSTEM, t0: a[0], start: start(a) }.at(a[1]))),
    ("spline", |a| {
        let nodes = [[0.1], [a[2]], [a[3]]].map(SVector::from);
        SplineCurve::new(&[a[0], a[0] + a[1], a[4] + 9.0], &nodes, None)
            .ok()
            .and_then(|s| described(s.at(a[0] + 0.5 * a[1])))
    }),
    ("compose", |a| {
        let one = exact(a[1]).ok()?;
        described(compose(&one, &one, a[0], (&[[a[2]].into(), [a[3]].into()], a[4]), &[0.5 * (a[2] + a[3])].into()))
    }),
    ("through", |a| {
        let one = exact(a[1]).ok()?;
        described(through(&one, &one, a[0], (&[[a[2]].into(), [a[3]].into()], a[4]), &[0.5 * (a[2] + a[3])].into()))
    }),
    ("error_orders", |a| described(error_orders(&SYSTEM, |h| Rule::MIDPOINT.of(SYSTEM, h), a[0], &start(a), a[1]))),
    ("condition", |a| described(statements::condition(&SYSTEM, a[0], &start(a), a[1]))),
    ("follows_motion", |a| described(statements::follows_motion(&SYSTEM, a[0], &start(a), a[1], 2))),
];

/// Replaces one argument at a time by a bad number.
#[test]
fn one_at_a_time() {
    let bad = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, 5e-324, 1e-310, 1e-160, 1e160, -1e300, f64::MAX];
    let good = [0.1, 0.5, 0.3, 0.6, 0.2];
    let mut found = Vec::new();
    for (name, call) in CALLS {
        assert!(call(good).is_some(), "{name} refuses good numbers");
        for (position, number) in (0..good.len()).flat_map(|p| bad.map(|b| (p, b))) {
            let mut arguments = good;
            arguments[position] = number;
            let since = std::time::Instant::now();
            let answer = call(arguments);
            // The work of one motion, and of a whole search, is bounded by about a second; 10 s allow for a busy
            // machine.
            if answer.is_some_and(|a| a.contains("NaN")) || since.elapsed().as_secs_f64() > 10.0 {
                found.push(format!("{name} at {arguments:?} after {:?}", since.elapsed()));
            }
        }
    }
    assert!(found.is_empty(), "{found:#?}");
}
