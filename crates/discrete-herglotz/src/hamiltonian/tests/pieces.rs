//! Every kind of piece: its flow is conformally contact with its factor, solves the contact Hamiltonian equations, and
//! is a group.

use super::{Coefficients, Plane, Squares, distance, pullback, random_point, runge_kutta};
use crate::hamiltonian::{
    ActionPart, ActionTimesHomogeneous, AffineFlow, ContactPiece, Kinetic, PieceList, PolynomialInAction, Potential,
    Prolonged, Quadratic,
};
use crate::splitting::Riccati;
use contact_geom::PhasePoint;
use contact_geom::nalgebra::SMatrix;

/// A quadratic form without symmetries, with gyroscopic terms and drag.
pub(super) fn quadratic() -> Quadratic<2> {
    let of = |a: [f64; 4]| SMatrix::<f64, 2, 2>::from_row_slice(&a);
    Quadratic::new(of([1.5, 0.3, 0.3, 0.8]), of([0.2, -0.7, 0.4, 0.1]), of([1.2, -0.4, -0.4, 0.9]), -0.3)
}

/// An affine field that mixes q and z.
fn affine() -> AffineFlow<2> {
    AffineFlow {
        qq: SMatrix::from_row_slice(&[0.3, -1.0, 0.8, -0.2]),
        qz: [0.5, -0.3].into(),
        q: [0.2, 0.1].into(),
        zq: [-0.4, 0.6].into(),
        zz: -0.2,
        z: 0.3,
    }
}

/// The statements for a piece at random points, for times of both signs.
fn check<P: ContactPiece<2>>(name: &str, piece: &P) {
    for k in 0..8 {
        let (x, tau, t) = (random_point::<2>(k), if k % 2 == 0 { 0.3 } else { -0.25 }, 0.4);
        let map = piece.over(tau);
        let change = piece.change(&map, t, &x);
        let (end, sigma) = (change.after(&x), 1.0 + change.sigma_minus_one);
        // Contact, with the factor of the increment. The entries of the Jacobians are below 10.
        let (defect, factor) = pullback(&x, |x| Ok::<_, ()>(piece.change(&map, t, x).after(x)));
        assert!(defect < 1e-13, "{name} {k}: defect {defect:e}");
        assert!((factor - sigma).abs() < 1e-13 * sigma, "{name} {k}: factor {factor}, {sigma}");
        // The error of the reference is some (tau/400)^4, 1e-13.
        let (exact, log) = runge_kutta(piece, (t, tau), &x, 600, true);
        assert!(distance(&end, &exact) < 2e-12, "{name} {k}: {end:?}, {exact:?}");
        assert!((sigma.ln() - log).abs() < 2e-12, "{name} {k}: {sigma}, {log}");
        // Two flows over half the time, and the way back.
        let half = piece.over(0.5 * tau);
        let between = piece.change(&half, t, &x).after(&x);
        let twice = piece.change(&half, t, &between).after(&between);
        let back = piece.change(&piece.over(-tau), t, &end).after(&end);
        let apart = [distance(&twice, &end), distance(&back, &x)];
        assert!(apart.iter().all(|d| *d < 1e-13), "{name} {k}: {apart:?}");
    }
}

#[test]
fn every_piece_has_the_contact_flow_of_its_hamiltonian() {
    check("kinetic", &Kinetic(Plane::Kinetic));
    check("potential", &Potential(Plane::Potential));
    check("quadratic", &quadratic());
    check("affine", &Prolonged(affine()));
    for sign in [1.0, -1.0, 0.0, 2.0, -2.0] {
        check("polynomial in z", &Prolonged(PolynomialInAction(Coefficients(sign))));
    }
    check("action", &Prolonged(ActionPart(Riccati { b: -0.4, c: 0.3 })));
    check("user's flow", &Prolonged(Squares));
    for degree in [1.0, 1.5, 2.0, -0.5, 0.0] {
        check("z T(p)", &ActionTimesHomogeneous { momentum_function: Plane::Homogeneous(degree), degree });
    }
}

/// Times of 1e-12 and 20: the matrix exponential and the entire functions have no cancellation, and no bound on the
/// time.
#[test]
fn flows_over_tiny_and_long_times() {
    let (x, one) = (random_point::<2>(3), SMatrix::<f64, 2, 2>::identity());
    for tau in [1e-12, -1e-9, 1e-4] {
        let piece = quadratic();
        let change = piece.change(&piece.over(tau), 0.0, &x);
        let field = (quadratic(),).field(0, 0.0, &x).unwrap();
        // The next term of the increment is of the relative size tau.
        assert!((change.z / tau - field.z).abs() < 4.0 * tau.abs() + 1e-14, "{tau}: {}, {}", change.z / tau, field.z);
        assert!((change.q[0] / tau - field.x[0]).abs() < 4.0 * tau.abs() + 1e-14);
    }
    // Both closed forms of the Riccati equation for arguments beyond 1: c2 = -15 and c2 = 15.
    for (sign, z) in [(30.0, -0.5), (-30.0, 1.0)] {
        let (x, riccati) =
            (PhasePoint { q: [0.0, 0.4].into(), z, ..x }, Prolonged(PolynomialInAction(Coefficients(sign))));
        let end = riccati.change(&0.3, 0.0, &x).after(&x);
        let (exact, _) = runge_kutta(&riccati, (0.0, 0.3), &x, 3000, true);
        assert!(distance(&end, &exact) < 1e-11, "{sign}: {end:?}, {exact:?}");
    }
    // The damped oscillator in closed form: w = sqrt(1 - gamma^2/4), q(t) = e^(gamma t/2) (cos w t - gamma/(2 w) sin w
    // t).
    let (gamma, tau) = (-0.1f64, 20.0f64);
    let damped = Quadratic::new(one, one * 0.0, one, gamma);
    let start = PhasePoint::new([1.0, 0.0], [0.0, 0.0], 0.0);
    let end = damped.change(&damped.over(tau), 0.0, &start).after(&start);
    let w = (1.0 - 0.25 * gamma * gamma).sqrt();
    let exact = (0.5 * gamma * tau).exp() * ((w * tau).cos() - 0.5 * gamma / w * (w * tau).sin());
    assert!((end.q[0] - exact).abs() < 1e-13, "{} {exact}", end.q[0]);
}

/// Where a flow ends, its increment is NaN: z' = z^2 from z = 1 at time 1, also after the next branch of the closed
/// form begins; a projected graph at a caustic.
#[test]
fn flows_beyond_their_domain_are_undefined() {
    let x = PhasePoint::new([0.0, 0.0], [0.5, 0.0], 1.0);
    // z' = -c0 - c1 z - c2 z^2 with a negative discriminant: z is a tangent, with poles pi/sqrt(-D) apart.
    let tangent = Prolonged(PolynomialInAction(Coefficients(-40.0)));
    let blow_up = |tau: f64| tangent.change(&tau, 0.0, &x).z.is_nan();
    assert!(!blow_up(0.01) && !blow_up(-0.01));
    assert!((1..200).filter(|k| blow_up(-0.02 * f64::from(*k))).count() > 100);
    let first = (1..2000).find(|k| blow_up(0.01 * f64::from(*k))).unwrap();
    assert!((first..2000).all(|k| blow_up(0.01 * f64::from(k))));
    // H = z p_1: q1 = q0 + tau z, and the graph with slope p0 is vertical at 1 + tau p0 = 0.
    let shear = Prolonged(AffineFlow::<2> { qz: [1.0, 0.0].into(), ..AffineFlow::ZERO });
    assert!(shear.change(&shear.over(-2.0), 0.0, &x).p[0].is_nan());
    let power = ActionTimesHomogeneous { momentum_function: Plane::Homogeneous(2.0), degree: 2.0 };
    assert!(power.change(&-3.0, 0.0, &x).p[0].is_nan() && !power.change(&3.0, 0.0, &x).p[0].is_nan());
}
