//! Rays against their closed forms.

use super::systems::{Two, end, run};
use contact_examples::systems::hamiltonian::{Medium, Ray};
use contact_geom::PhasePoint;
use contact_geom::nalgebra::SVector;

/// The bound on the error of a ray of a length of 2 to 6: some thousand units of round-off.
const ROUND_OFF: f64 = 2e-13;

/// A ray and its position and momentum at the optical length t, where these are known as functions of tau.
fn compare(
    medium: Medium<2>,
    q: [f64; 2],
    direction: [f64; 2],
    tau: f64,
    exact: impl Fn(&PhasePoint<2>, f64) -> (f64, SVector<f64, 2>, SVector<f64, 2>),
) {
    let ray = Ray { medium };
    let start = ray.start(q.into(), direction.into());
    let (t, q, p) = exact(&start, tau);
    let found = end(Two::from(ray), (0.0, start), (8, t / 40.0), t);
    let off = (found.q - q).norm() + (found.p - p).norm();
    assert!(off < ROUND_OFF, "{medium:?}: {off:e}, {found:?}");
    assert!((found.p.norm() / medium.index(&found.q) - 1.0).abs() < ROUND_OFF);
    assert!(found.z.abs() < ROUND_OFF, "z' = p . H_p - H = 0, but z = {:e}", found.z);
}

/// `q = q0 + p0 tau + g tau^2/4`, `p = p0 + g tau/2`, and t is the integral of n^2 = |p|^2.
#[test]
fn a_parabola_where_the_square_of_the_index_is_linear() {
    let gradient = SVector::from([0.3, -0.5]);
    let medium = Medium::LinearSquare { constant: 2.0, gradient };
    compare(medium, [0.1, 0.2], [1.0, 1.0], 2.0, |x, tau| {
        let t = x.p.norm_squared() * tau
            + x.p.dot(&gradient) * tau * tau / 2.0
            + gradient.norm_squared() * tau.powi(3) / 12.0;
        (t, x.q + x.p * tau + gradient * (tau * tau / 4.0), x.p + gradient * (tau / 2.0))
    });
}

/// The horizontal ray from (0, y0) is the circle `(y0 tanh(a t), y0 sech(a t))`.
#[test]
fn a_circle_where_the_speed_of_light_is_linear() {
    let (slope, height) = (0.7, 1.5);
    compare(Medium::LinearSpeed { slope }, [0.0, height], [1.0, 0.0], 3.0, |_, t| {
        let angle = slope * t;
        let q = SVector::from([angle.tanh(), angle.cosh().recip()]) * height;
        (t, q, SVector::from([q[1], -q[0]]) / (height * slope * q[1]))
    });
}

/// `y = y0 cos(w tau)`, `x = p_x tau` with `w = alpha n0`, and t is the integral of `n0^2 - w^2 y^2`.
#[test]
fn an_oscillation_in_a_graded_lens() {
    let (axis, alpha, y) = (1.5, 0.6, 0.4);
    compare(Medium::Graded { axis, alpha }, [0.0, y], [1.0, 0.0], 3.0, |x, tau| {
        let w = axis * alpha;
        let (sin, cos) = (w * tau).sin_cos();
        let t = axis * axis * tau - (w * y).powi(2) * (tau / 2.0 + sin * cos / (2.0 * w));
        (t, SVector::from([x.p[0] * tau, y * cos]), SVector::from([x.p[0], -w * y * sin]))
    });
}

/// All rays from a point meet at its image after half a great circle, `pi n0 R/2`.
#[test]
fn the_image_of_the_fish_eye() {
    let (centre, radius) = (2.0, 1.3);
    let ray = Ray { medium: Medium::FishEye { centre, radius } };
    let q = SVector::from([0.5, -0.8]);
    let image = -q * (radius * radius / q.norm_squared());
    let t = std::f64::consts::FRAC_PI_2 * centre * radius;
    for angle in 0..6 {
        let (sin, cos) = f64::from(angle).sin_cos();
        let mut largest: f64 = 0.0;
        let start = ray.start(q, [cos, sin].into());
        let outcome = run(Two::from(ray), (0.0, start), (8, t / 80.0), t, |_, x, log_factor| {
            let h = x.p.norm() / ray.medium.index(&x.q);
            // H does not depend on z: no dissipation.
            assert_eq!(log_factor, 0.0);
            largest = if (h - 1.0).abs() <= largest { largest } else { (h - 1.0).abs() };
        });
        assert!(
            (outcome.q.fixed::<2>() - image).norm() < ROUND_OFF * 5.0,
            "{:e}",
            (outcome.q.fixed::<2>() - image).norm()
        );
        assert!(largest < ROUND_OFF, "{largest:e}");
    }
}
