//! Dense output of contact Gauss collocation, and events along it.

use crate::common::gauss::GaussSteppers;
use crate::common::lagrangians::WithStructure;
use crate::integrators::gauss::cut;
use crate::lagrangians::{One, one};
use contact_examples::systems::{HarmonicOscillator, OneCoordinate, Pendulum, QuadraticInZ};
use contact_geom::{
    ChartVector, Lagrangian, PhasePoint, VelocityPoint, legendre,
    numbers::{MaxAbsOrNan, MaxOrNan},
};
use discrete_herglotz::{
    AnyIntegrator, Crossing, Event, Events, InputError, Outcome, Problem, Status, StepDetails, StepError, Stepper,
    Steps, Until,
    gauss::{Gauss, GaussRoute},
};

/// Each route has the same curve, of order s between the nodes: half of the step divides the largest error along two
/// units of time by `2^(s+1)`, the local order of the polynomial of degree s.
#[test]
fn curves_have_the_order_of_the_stages() {
    let oscillator = HarmonicOscillator { gamma: -0.5 };
    let system = one(oscillator);
    let x = VelocityPoint::new([1.0], [0.5], 0.3);
    let exact = |t: f64| legendre(&system, t, &oscillator.solution(t, &x));
    for s in 1..=4 {
        let mut all = Vec::new();
        for route in [GaussRoute::Linear, GaussRoute::Condensed, GaussRoute::ConstantMass, GaussRoute::General] {
            let errors = [20, 40].map(|steps| {
                let h = 2.0 / f64::from(steps);
                let claims = WithStructure(OneCoordinate::from(oscillator), cut(&system, route));
                let gauss = Gauss::new(One::from(claims), s, h);
                let stepper = gauss.as_ref().map(|g| g.stepper(0.0, legendre(&system, 0.0, &x), x.v));
                let Ok(Ok(mut stepper)) = stepper else { panic!("no stepper") };
                let mut worst = [0.0f64; 3];
                for step in 0..steps {
                    assert_eq!(stepper.advance(1), Ok(()));
                    let Some(curve) = stepper.dense() else { panic!("no curve") };
                    for k in 0..=20 {
                        let t = h * (f64::from(step) + f64::from(k) / 20.0);
                        let (a, b) = (curve.at(t).fixed::<1>(), exact(t));
                        all.push(a);
                        let off = [(a.q - b.q).max_abs_or_nan(), (a.p - b.p).max_abs_or_nan(), (a.z - b.z).abs()];
                        worst = std::array::from_fn(|i| worst[i].max_or_nan(off[i]));
                    }
                }
                worst
            });
            for i in 0..3 {
                let observed = (errors[0][i] / errors[1][i]).log2();
                assert!((observed - (s + 1) as f64).abs() <= 0.15, "s = {s} {route:?} component {i}: {observed}");
            }
        }
        let count = all.len() / 4;
        for (k, x) in all.iter().enumerate() {
            let off = ChartVector::from(*x).minus(all[k % count].into()).max_abs_or_nan();
            assert!(off <= 1e-14, "s = {s}: routes differ by {off:e}");
        }
    }
}

/// A run with events, by Gauss steps of a number of stages up to a time, with the events that it finds.
fn events<'f, const N: usize, L: Lagrangian<N>>(
    system: &L,
    x: VelocityPoint<N>,
    (stages, steps, until): (usize, usize, f64),
    events: impl IntoIterator<Item = Event<'f>>,
) -> (Outcome, Vec<Crossing>) {
    let mut events = Events::new(events);
    let problem = Problem::new(system, 0.0, x).unwrap();
    let run = problem.by(AnyIntegrator::Gauss { stages }).steps(Steps::Count(steps)).observe(&mut events);
    let outcome = run.run(Until::Time(until)).unwrap();
    (outcome, events.crossings)
}

/// The zeros of a damped oscillation agree with the closed form, by direction, and so do the states there; to 1e-13,
/// since the error of 16 stages is smaller.
#[test]
fn crossings_are_those_of_the_closed_form() {
    let oscillator = HarmonicOscillator { gamma: -0.1 };
    let system = one(oscillator);
    let x = VelocityPoint::new([1.0], [0.0], 0.0);
    // q = e^(a t) (cos w t - (a/w) sin w t) vanishes where tan w t = w/a, a < 0.
    let a = 0.5 * oscillator.gamma;
    let w = (1.0 - a * a).sqrt();
    let expected = |k: usize| (k as f64 * std::f64::consts::PI + (w.atan2(a))) / w;
    let zero = || Event::new(|_, x| x.q[0]);
    let (outcome, crossings) = events(&system, x, (16, 30, 21.0), [zero(), zero().rising(), zero().falling()]);
    assert_eq!((outcome.status, outcome.t), (Status::Completed, 21.0));
    let of = |event: usize| crossings.iter().filter(|c| c.event == event).collect::<Vec<_>>();
    assert_eq!((of(0).len(), of(1).len(), of(2).len()), (7, 3, 4));
    for (k, c) in of(0).iter().enumerate() {
        assert!((c.t - expected(k)).abs() <= 1e-13 * expected(k), "{k}: {} {}", c.t, expected(k));
        let there = legendre(&system, c.t, &oscillator.solution(c.t, &x));
        let off = ChartVector::from(c.state.fixed::<1>()).minus(there.into()).max_abs_or_nan();
        assert!(off <= 1e-13, "{k}: {off:e}");
        // The first zero is a falling one.
        assert_eq!(c.t, of(if k % 2 == 0 { 2 } else { 1 })[k / 2].t);
    }
    assert!(crossings.is_sorted_by(|a, b| a.t <= b.t));
    // Backward from q > 0 the run passes the zeros before t = 0 in their order; a rising zero is one that rises along
    // the run.
    let (outcome, crossings) = events(&system, x, (16, 15, -10.5), [zero(), zero().rising(), zero().falling()]);
    assert_eq!((outcome.status, outcome.t), (Status::Completed, -10.5));
    let of = |event: usize| crossings.iter().filter(|c| c.event == event).collect::<Vec<_>>();
    assert_eq!((of(0).len(), of(1).len(), of(2).len()), (3, 1, 2));
    for (k, c) in of(0).iter().enumerate() {
        let before = expected(0) - (k as f64 + 1.0) * std::f64::consts::PI / w;
        assert!((c.t - before).abs() <= 1e-13 * before.abs(), "{k}: {} {before}", c.t);
        assert_eq!(c.t, of(if k % 2 == 0 { 2 } else { 1 })[k / 2].t);
    }
    assert!(crossings.is_sorted_by(|a, b| a.t >= b.t));
}

/// Two changes of sign within one step are both found; a terminal event ends the run at its state; later events are not
/// recorded; and a zero at the start is no change of sign.
#[test]
fn events_within_one_step() {
    let oscillator = HarmonicOscillator { gamma: -0.1 };
    let system = one(oscillator);
    let x = VelocityPoint::new([1.0], [0.0], 0.0);
    // q < -0.8 only for a short time around the first turning point, within one step.
    let dip = || Event::new(|_, x| x.q[0] + 0.8);
    let (_, crossings) = events(&system, x, (16, 1, 5.0), [dip()]);
    assert_eq!(crossings.len(), 2, "{crossings:?}");
    let turn = Event::new(|_, x| x.p[0]).terminal();
    let (outcome, crossings) = events(&system, x, (16, 3, 15.0), [dip(), turn]);
    assert_eq!(outcome.status, Status::Stopped { step: 1, t: outcome.t, by: "an event" });
    assert_eq!(crossings.iter().map(|c| c.event).collect::<Vec<_>>(), [0, 1]);
    let turning = std::f64::consts::PI / (1.0f64 - 0.0025).sqrt();
    assert!((outcome.t - turning).abs() <= 1e-11, "{} {turning}", outcome.t);
    assert_eq!(crossings.last().map(|c| (c.t, c.state.clone())), Some((outcome.t, outcome.state())));
}

/// A function that vanishes exactly at the end of a step, or of a part of it, changes its sign there once.
#[test]
fn a_zero_at_a_node_is_one_crossing() {
    let x = VelocityPoint::new([1.0], [0.0], 0.0);
    let steps = (4, 6, 3.0);
    let (_, crossings) = events(&one(Pendulum::default()), x, steps, [Event::new(|t, _| t - 1.0)]);
    assert_eq!(crossings.iter().map(|c| c.t).collect::<Vec<_>>(), [1.0]);
    // It touches zero without a change of sign.
    let (_, crossings) = events(&one(Pendulum::default()), x, steps, [Event::new(|t, _| (t - 1.0).powi(2))]);
    assert_eq!(crossings, []);
}

/// A function that is not finite ends the run with its time; events found before are kept.
#[test]
fn a_function_that_is_not_finite_is_a_status() {
    let x = VelocityPoint::new([1.0], [0.0], 1.0);
    let passes = || Event::new(|_, x| x.q[0]);
    let undefined = Event::new(|t, _| if t > 2.0 { f64::NAN } else { 1.0 });
    let (outcome, crossings) = events(&one(QuadraticInZ { c: 0.1 }), x, (5, 20, 6.0), [passes(), undefined]);
    let Status::Failed { step, t: ended, cause: StepError::Event { t } } = outcome.status else {
        panic!("{outcome:?}")
    };
    // It is noticed at the end of the step from 1.8 to 2.1.
    assert!(t > 2.0 && t <= 2.1 && ended <= 2.1, "{t}, {ended}");
    assert_eq!((outcome.steps, outcome.t, crossings.len()), (step, ended, 1));
    // A run without steps is refused.
    let (pendulum, mut none) = (one(Pendulum::default()), Events::new([]));
    let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([1.0], [0.0], 0.0)).unwrap();
    let refused = problem.steps(Steps::Count(0)).observe(&mut none).run(Until::Time(1.0));
    assert!(matches!(refused, Err(InputError::Count { found: 0, .. })), "{refused:?}");
}

/// Where the action is not requested, z keeps its value, and the rest of the curve is the same.
#[test]
fn without_action() {
    let system = one(Pendulum { gamma: -0.1 });
    let start = PhasePoint::new([1.0], [0.5], 0.25);
    let gauss = Gauss::new(system, 6, 0.3);
    let Ok(gauss) = &gauss else { panic!("no method") };
    let both = (gauss.stepper(0.0, start, [0.5].into()), gauss.stepper_without_action(0.0, start, [0.5].into()));
    let (Ok(mut with), Ok(mut without)) = both else { panic!("no stepper") };
    assert!(with.advance(2).is_ok() && without.advance(2).is_ok());
    let (Some(a), Some(b)) = (with.dense(), without.dense()) else { panic!("no curve") };
    for t in [0.3, 0.37, 0.6] {
        assert_eq!((a.at(t).q, a.at(t).p, b.at(t).z), (b.at(t).q, b.at(t).p, 0.25));
    }
}
