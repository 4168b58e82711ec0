//! Tests of steps that are solved by Newton's method on all stages at once.

use contact_examples::systems::HarmonicOscillator;
use contact_geom::{ChartVector, DiscretePoint, VelocityPoint, legendre, numbers::max_abs_or_nan};
use discrete_herglotz::{DiscreteLagrangian, gauss::Gauss, solve::Solver};

/// Eight steps of order 24 by Newton's method on the stages agree with the closed form up to the round-off of eight
/// sums.
#[test]
fn newton_steps_of_gauss_collocation() {
    let damped = HarmonicOscillator { gamma: -0.5 };
    let x = VelocityPoint::new([1.0], [0.5], 0.3);
    let ld = Gauss::new(&damped, 12, 0.5).unwrap();
    let (mut state, mut velocity) = (legendre(&damped, 0.0, &x), x.v);
    for k in 0..8 {
        let step = ld.forward(0.5 * f64::from(k), &state, &velocity, &mut Solver::default()).unwrap();
        (state, velocity) = (step.end, step.velocity);
    }
    let expected = legendre(&damped, 4.0, &damped.solution(4.0, &x));
    let off = ChartVector::from(state).minus(expected.into());
    let off = max_abs_or_nan([off.x[0], off.y[0], off.z]);
    assert!(off <= 8.0 * 4.0 * f64::EPSILON, "{off:e}");
}

/// The points of a motion from rest determine its vanishing initial momentum up to the round-off of the positions.
#[test]
fn points_of_a_motion_that_starts_at_rest_tell_it() {
    let damped = HarmonicOscillator { gamma: -0.1 };
    let x = VelocityPoint::new([1.0], [0.0], 0.2);
    let start = legendre(&damped, 0.0, &x);
    for stages in 2..=16 {
        for h in [0.1, 0.09375, 0.4] {
            let ld = Gauss::new::<1>(&damped, stages, h).unwrap();
            let end = ld.forward(0.0, &start, &x.v, &mut Solver::default()).unwrap().end;
            let jet = ld.jet(0.0, &DiscretePoint { q0: x.q, q1: end.q, z0: x.z }).unwrap();
            // p0 = -D1 / sigma_d; its round-off is that of a velocity computed from two positions.
            assert!(jet.d1[0].abs() <= 16.0 * f64::EPSILON / h, "{stages} stages, h = {h}: {}", jet.d1[0]);
        }
    }
}
