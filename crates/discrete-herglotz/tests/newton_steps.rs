//! Steps that are solved by Newton's method on all stages at once, with the feature `faer` or without: `.ci/run` runs both.

use contact_geom::systems::HarmonicOscillator;
use contact_geom::{Triple, VelocityPoint, largest, legendre};
use discrete_herglotz::{DiscreteLagrangian, Gauss, Solver};

/// Eight steps of order 24 by Newton's method on the stages meet the closed form, to the rounding of eight sums.
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
    let off = Triple::from(state).minus(expected.into());
    let off = largest([off.x[0], off.y[0], off.z]);
    assert!(off <= 8.0 * 4.0 * f64::EPSILON, "{off:e}");
}
