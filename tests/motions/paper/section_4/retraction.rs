//! Statement 32 (section 4.1): the exact retraction without a guess, at small steps, near conjugate points and by each
//! of its routes.

use crate::paper::table::{AlongMotion, EXACT_TOLERANCE, OverMotions};
use contact_examples::systems::{HarmonicOscillator, OneCoordinate, Pendulum, System, visit_catalogue};
use contact_geom::nalgebra::SVector;
use contact_geom::{
    DiscretePoint, Lagrangian, Scalar, Statement, VelocityPoint,
    numbers::{MaxAbsOrNan, MaxOrNan},
};
use exact_lagrangian::{ContactExponential, ExactError, RetractionRoute, herglotz_flow, statements};

/// Without a guess the motion that is found joins the points, but need not be the one from which they were made.
#[test]
fn without_a_guess() {
    struct Unguided;
    impl AlongMotion for Unguided {
        fn residual<const N: usize, S: System<N>>(
            &mut self,
            system: &S,
            t: f64,
            x: &VelocityPoint<N>,
            h: f64,
        ) -> Result<f64, ExactError<N>> {
            let h = 0.3 * h;
            let exp = ContactExponential::new(system, h)?;
            let y = exp.at(t, x)?;
            let found = match exp.retract(t, &y) {
                // Two distant points need not be joined by a motion near the straight line.
                Err(ExactError::NotConverged { .. } | ExactError::ConjugatePoint { .. }) if h > 0.1 => return Ok(0.0),
                found => found?,
            };
            let reached = exp.at(t, &found.start)?.q1;
            let condition = -(-statements::condition(system, t, &found.start, h)?).max_or_nan(-1e3);
            Ok((reached - y.q1).max_abs_or_nan() / (condition * (1.0 + y.q1.max_abs_or_nan())))
        }
    }
    let name = "statement 32 without a guess".into();
    visit_catalogue(&mut OverMotions { name, bound: EXACT_TOLERANCE, residual: Unguided });
}

/// Down to h = 1e-8 the error of the velocity is that given by the condition of the exponential map: the residual in
/// units of the condition stays at round-off while the condition grows like 1/h.
#[test]
fn the_loss_at_small_steps_is_the_condition() {
    let (system, x) = (OneCoordinate::from(Pendulum::default()), VelocityPoint::new([1.0], [0.7], 0.1));
    for k in 0..=8 {
        let h = 10f64.powi(-k);
        let condition = statements::condition(&system, 0.0, &x, h).unwrap_or(f64::NAN);
        let residual =
            statements::residual(Statement::ExactRetractions, &system, 0.0, &x, h).ok().flatten().unwrap_or(f64::NAN);
        assert!(residual < 4.0 * f64::EPSILON, "h = {h}: {residual:e}");
        assert!((0.2..5.0).contains(&(condition * h)), "h = {h}: condition {condition:e}");
    }
}

/// Each route is taken where the one before fails: near a conjugate point the iteration with both ends given does not
/// contract, and beyond it Newton's method needs continuation.
#[test]
fn routes() {
    let route = |h: f64, q: f64, v: f64| {
        let exp = ContactExponential::new(OneCoordinate::from(HarmonicOscillator { gamma: 0.0 }), h)
            .map_err(ExactError::from)?;
        let found = exp.retract(0.0, &exp.at(0.0, &VelocityPoint::new([q], [v], 0.0))?)?;
        Ok::<_, ExactError<1>>((found.route, found.conjugate.is_some()))
    };
    assert_eq!(route(1.0, 0.4, 1.2), Ok((RetractionRoute::Collocation, false)));
    assert_eq!(route(3.0, 0.4, 1.2), Ok((RetractionRoute::Newton, false)));
    assert_eq!(route(3.2, 1.0, 0.0), Ok((RetractionRoute::Continuation, true)));
    // Under strong damping the iteration with both ends given does not contract, and Newton's method converges.
    for gamma in [-50.0, -20.0, 5.0] {
        let exp = ContactExponential::new(OneCoordinate::from(HarmonicOscillator { gamma }), 1.0).unwrap();
        let x = VelocityPoint::new([0.4], [1.2], 0.3);
        let found = exp.at(0.0, &x).and_then(|y| exp.retract(0.0, &y)).map_or(f64::NAN, |r| r.start.v[0]);
        // dq1/dv0 is 1/50, so that the error is that of 50 roundings of q.
        assert!((found - 1.2).abs() < 64.0 * 4.0 * f64::EPSILON, "gamma = {gamma}: {found}");
    }
}

/// Uniform motion, and an oscillator under a small force.
struct Tremor {
    force: f64,
    stiffness: f64,
}
impl Lagrangian<2> for Tremor {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, _z: T) -> T {
        (v[0] * v[0] + v[1] * v[1] - q[1] * q[1] * self.stiffness) * 0.5 + q[1] * self.force
    }
}

/// Slow contraction of the iteration, near a conjugate point, is not mistaken for convergence.
#[test]
fn a_slow_iteration_is_not_taken_for_one_that_has_ended() {
    for force in [1e-6, 1e-8, 1e-10, 1e-11, 1e-12, 1e-13] {
        for part in [0.5, 0.7, 0.8, 0.9, 0.95, 0.97] {
            let w = std::f64::consts::PI * f64::sqrt(part);
            let exp = ContactExponential::new(Tremor { force, stiffness: w * w }, 1.0).unwrap();
            let found = exp.retract(0.0, &DiscretePoint::new([0.0, 0.0], [1.0, 0.0], 0.0));
            let off = found.map_or(f64::NAN, |r| (r.start.v[1] + force / w * (0.5 * w).tan()).abs());
            assert!(off < 1e-13, "force {force:e}, {part} of the way to a conjugate point: {off:e}");
        }
    }
}

/// The end, the action and b of a retraction are those of the motion from its start, also after the last small
/// correction.
#[test]
fn the_end_belongs_to_the_start() {
    let pendulum = OneCoordinate::from(Pendulum { gamma: -0.05 });
    let exp = ContactExponential::new(pendulum, 8.0).unwrap();
    let y = exp.at(0.0, &VelocityPoint::new([0.0], [1.0], 0.3)).unwrap();
    // From some guesses no motion is found.
    let mut found_from = 0;
    for k in -8..=8 {
        let Ok(found) = exp.retract_near(0.0, &y, &[0.24 * f64::from(k)].into()) else { continue };
        found_from += 1;
        let motion = herglotz_flow(&pendulum, 0.0, &found.start, 8.0);
        let apart = motion.map_or(f64::NAN, |m| {
            let end = (m.end.v - found.end.v).max_abs_or_nan().max_or_nan((m.end.z - found.end.z).abs());
            end.max_or_nan((m.action - found.action).abs()).max_or_nan((m.b - found.b).abs())
        });
        assert!(apart < 1e-13, "guess {k}: {apart:e}");
    }
    assert!(found_from >= 9, "{found_from} of 17");
}
