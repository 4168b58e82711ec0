//! Statement 32 (section 4.1): `R_h^(e-)` inverts `exp_h`, and `R_h^(e+) = phi_h o R_h^(e-)`.

use crate::common::{AlongMotion, OverMotions, over_motions};
use contact_geom::nalgebra::SVector;
use contact_geom::systems::{HarmonicOscillator, Pendulum, System, visit_catalogue};
use contact_geom::{DiscretePoint, Lagrangian, MaxAbsOrNan, MaxOrNan, Scalar, Statement, VelocityPoint};
use exact_lagrangian::{ContactExponential, ExactError, RetractionRoute, herglotz_flow, statements};

/// Along random motions of every system, from a guess on their branch.
#[test]
fn on_every_system() {
    over_motions(Statement::ExactRetractions);
}

/// Without a guess the motion that is found joins the points, whether or not it is the one that they were made from.
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
                // Two far points need not be joined by a motion near the straight line.
                Err(ExactError::NotConverged { .. } | ExactError::ConjugatePoint { .. }) if h > 0.1 => return Ok(0.0),
                found => found?,
            };
            let reached = exp.at(t, &found.start)?.q1;
            let condition = -(-statements::condition(system, t, &found.start, h)?).max_or_nan(-1e3);
            Ok((reached - y.q1).max_abs_or_nan() / (condition * (1.0 + y.q1.max_abs_or_nan())))
        }
    }
    visit_catalogue(&mut OverMotions(Unguided));
}

/// Down to h = 1e-8 the velocity is lost by what the condition of the exponential map says, and no more: the residual in its
/// units stays round-off while the condition grows like 1/h.
#[test]
fn the_loss_at_small_steps_is_the_condition() {
    let (system, x) = (Pendulum::default(), VelocityPoint::new([1.0], [0.7], 0.1));
    for k in 0..=8 {
        let h = 10f64.powi(-k);
        let condition = statements::condition(&system, 0.0, &x, h).unwrap_or(f64::NAN);
        let residual =
            statements::residual(Statement::ExactRetractions, &system, 0.0, &x, h).ok().flatten().unwrap_or(f64::NAN);
        assert!(residual < 4.0 * f64::EPSILON, "h = {h}: {residual:e}");
        assert!((0.2..5.0).contains(&(condition * h)), "h = {h}: condition {condition:e}");
    }
}

/// Each route is taken where the one before fails, and says so: near a conjugate point the iteration with both ends given does not
/// contract, and beyond it Newton's method may need to be led there.
#[test]
fn routes() {
    let route = |h: f64, q: f64, v: f64| {
        let exp = ContactExponential::new(HarmonicOscillator { gamma: 0.0 }, h).map_err(ExactError::from)?;
        let found = exp.retract(0.0, &exp.at(0.0, &VelocityPoint::new([q], [v], 0.0))?)?;
        Ok::<_, ExactError<1>>((found.route, found.conjugate.is_some()))
    };
    assert_eq!(route(1.0, 0.4, 1.2), Ok((RetractionRoute::Collocation, false)));
    assert_eq!(route(3.0, 0.4, 1.2), Ok((RetractionRoute::Newton, false)));
    assert_eq!(route(3.2, 1.0, 0.0), Ok((RetractionRoute::Continuation, true)));
    // Strong damping: the iteration with both ends given does not contract, Newton's method does.
    for gamma in [-50.0, -20.0, 5.0] {
        let exp = ContactExponential::new(HarmonicOscillator { gamma }, 1.0).unwrap();
        let x = VelocityPoint::new([0.4], [1.2], 0.3);
        let found = exp.at(0.0, &x).and_then(|y| exp.retract(0.0, &y)).map_or(f64::NAN, |r| r.start.v[0]);
        // dq1/dv0 is 1/50: 50 roundings of q.
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

/// An iteration that contracts slowly, near a conjugate point, is not taken for one that has ended.
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

/// The end, the action and b of a retraction are those of the motion from its start, also after the last small change.
#[test]
fn the_end_belongs_to_the_start() {
    let pendulum = Pendulum { gamma: -0.05 };
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
