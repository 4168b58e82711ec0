//! The axioms of a Lie group and of its exponential map, once for all groups.

use super::*;
use crate::numbers::{MaxAbsOrNan, MaxOrNan};
use crate::{Dual, Scalar};
use nalgebra::SVector;

const EPS: f64 = f64::EPSILON;

/// Numbers of `[-1, 1]` that look random, different for each seed.
fn sample<const N: usize>(seed: u32) -> SVector<f64, N> {
    SVector::from_fn(|i, _| (f64::from(seed + 1) * 12.9898 + i as f64 * 78.233).sin() * 43758.5453 % 1.0)
}

/// The difference of two elements as an element of the algebra.
fn off<G: LieGroup<N>, const N: usize>(a: &G::Element<f64>, b: &G::Element<f64>) -> f64 {
    G::log(&G::compose(&G::inverse(a), b)).max_abs_or_nan()
}

/// `e^(s ad_xi) eta` and `sum_k (-1)^k ad_xi^k eta/(k+1)!` by their series; `|xi|` is at most pi.
fn series<G: LieGroup<N>, const N: usize>(xi: &SVector<f64, N>, eta: &SVector<f64, N>) -> [SVector<f64, N>; 2] {
    let (mut term, mut exponential, mut dexp) = (*eta, *eta, *eta);
    for k in 1..40 {
        term = G::bracket(xi, &term) / f64::from(k);
        exponential += term;
        dexp += term / f64::from(if k % 2 == 0 { k + 1 } else { -(k + 1) });
    }
    [exponential, dexp]
}

/// The axioms at elements of the algebra of the given size. `scale` is the size of the coordinates, by which round-off
/// is measured.
fn axioms<G: LieGroup<N>, const N: usize>(name: &str, seed: u32, size: f64) {
    let unit = |seed: u32| {
        let x = sample::<N>(seed);
        x / G::angle(&x).max_or_nan(x.norm())
    };
    let xi = unit(seed) * size;
    let (eta, zeta, mu) = (sample::<N>(seed + 100), sample::<N>(seed + 200), sample::<N>(seed + 300));
    let (g, a, b) = (G::exp(&xi), G::exp(&eta), G::exp(&zeta));
    let scale = 1.0 + xi.max_abs_or_nan();
    let tiny =
        |x: f64, bound: f64, what: &str| assert!(x <= bound, "{name}, {what}, size {size:e}: {x:e} of {bound:e}");
    let bound = 64.0 * EPS * scale * scale;

    // The group.
    let [ab, bg] = [G::compose(&a, &b), G::compose(&b, &g)];
    tiny(off::<G, N>(&G::compose(&ab, &g), &G::compose(&a, &bg)), bound, "associativity");
    tiny(off::<G, N>(&G::compose(&g, &G::inverse(&g)), &G::identity()), bound, "inverse");
    tiny(off::<G, N>(&G::compose(&g, &G::identity()), &g), bound, "identity");
    assert!(G::check(&g).is_ok());

    // exp and log, relative to xi: nothing is lost near 0, and eps near pi.
    tiny(
        (G::log(&g) - xi).max_abs_or_nan(),
        16.0 * EPS * xi.max_abs_or_nan().max_or_nan(f64::MIN_POSITIVE) * scale,
        "log exp",
    );
    tiny(off::<G, N>(&G::compose(&G::exp(&(xi * 0.25)), &G::exp(&(xi * 0.75))), &g), bound, "a one-parameter group");
    let conjugate = G::compose(&G::compose(&a, &G::exp(&(xi * 0.3))), &G::inverse(&a));
    tiny(off::<G, N>(&G::exp(&G::adjoint(&a, &(xi * 0.3))), &conjugate), bound, "g exp(xi) g^-1 = exp(Ad_g xi)");

    // Ad and ad.
    let [exponential, dexp] = series::<G, N>(&xi, &eta);
    tiny((G::adjoint(&g, &eta) - exponential).max_abs_or_nan(), 64.0 * bound, "Ad(exp xi) = e^(ad xi)");
    tiny(
        (G::adjoint(&ab, &xi) - G::adjoint(&a, &G::adjoint(&b, &xi))).max_abs_or_nan(),
        bound * 8.0,
        "Ad is a homomorphism",
    );
    let moved = G::bracket(&G::adjoint(&a, &eta), &G::adjoint(&a, &zeta));
    tiny((G::adjoint(&a, &G::bracket(&eta, &zeta)) - moved).max_abs_or_nan(), bound, "Ad keeps brackets");
    let jacobi = G::bracket(&xi, &G::bracket(&eta, &zeta))
        + G::bracket(&eta, &G::bracket(&zeta, &xi))
        + G::bracket(&zeta, &G::bracket(&xi, &eta));
    tiny(jacobi.max_abs_or_nan(), bound, "Jacobi's identity");
    tiny(G::bracket(&eta, &eta).max_abs_or_nan(), EPS, "ad is alternating");

    // dexp: its series, the derivative of exp by dual numbers, its inverse.
    let found = G::dexp(&xi, &eta);
    tiny((found - dexp).max_abs_or_nan(), 64.0 * bound, "dexp is its series");
    let along = SVector::<_, N>::from_fn(|i, _| Dual { re: xi[i], d: SVector::<f64, 1>::from([eta[i]]) });
    let back = G::lift(&G::inverse(&g), Dual::constant);
    let derivative = G::log(&G::compose(&back, &G::exp(&along))).map(|x: Dual<f64, SVector<f64, 1>>| x.d[0]);
    tiny((found - derivative).max_abs_or_nan(), 4.0 * bound, "dexp is the derivative of exp");
    tiny((G::dexp_inverse(&xi, &found) - eta).max_abs_or_nan(), 8.0 * bound, "dexp^-1 dexp");

    // Transposes and the gradient of mu . dexp_xi eta, against dual numbers along zeta.
    tiny((G::dexp_transposed(&xi, &mu).dot(&eta) - mu.dot(&found)).abs(), bound, "dexp^T");
    let inverse = G::dexp_inverse(&xi, &eta);
    tiny((G::dexp_inverse_transposed(&xi, &mu).dot(&eta) - mu.dot(&inverse)).abs(), 8.0 * bound, "dexp^-T");
    tiny((G::coadjoint(&g, &mu).dot(&eta) - mu.dot(&G::adjoint(&g, &eta))).abs(), bound, "Ad^T");
    tiny((G::cobracket(&xi, &mu).dot(&eta) - mu.dot(&G::bracket(&xi, &eta))).abs(), bound, "ad^T");
    let moving = SVector::<_, N>::from_fn(|i, _| Dual { re: xi[i], d: SVector::<f64, 1>::from([zeta[i]]) });
    let value = mu.map(Dual::constant).dot(&G::dexp(&moving, &eta.map(Dual::constant)));
    let gradient = G::dexp_gradient(&xi, &eta, &mu).dot(&zeta);
    tiny((gradient - value.d[0]).abs(), 4.0 * bound, "the gradient of dexp");
}

/// Sizes from the smallest numbers to pi, where the logarithm of a rotation is still accurate.
const SIZES: [f64; 14] =
    [1e-300, 1e-160, 1e-100, 1e-20, 1e-8, 1e-4, 1e-2, 0.1, 1.0, 1.5, 1.6, 2.5, 3.1, std::f64::consts::PI - 1e-9];

fn all_axioms<G: LieGroup<N>, const N: usize>(name: &str) {
    for size in SIZES {
        for seed in 0..12 {
            axioms::<G, N>(name, seed, size);
        }
    }
}

#[test]
fn axioms_of_all_groups() {
    all_axioms::<Rotations, 3>("SO(3)");
    all_axioms::<RigidMotions, 6>("SE(3)");
}

/// Half a turn: the logarithm has the length pi, about one of the two axes.
#[test]
fn half_turns() {
    for axis in [[1.0, 0.0, 0.0], [0.6, 0.0, -0.8]] {
        let xi = Rotations::log(&Rotation { w: 0.0, u: SVector::from(axis) });
        assert!((xi - SVector::from(axis) * std::f64::consts::PI).max_abs_or_nan() <= 4.0 * EPS);
    }
}

/// Stumpff's functions against their closed forms on both sides of the change of formulas, and their recursion.
#[test]
fn stumpff_functions() {
    for x in [0.0, 1e-30, 0.3, 2.4999, 2.5001, 9.0, 400.0] {
        let c = stumpff::stumpff(x);
        let theta = f64::sqrt(x);
        assert!((c[0] - theta.cos()).abs() <= 4.0 * EPS, "{x}");
        for k in 0..4 {
            let factorial = [1.0, 1.0, 2.0, 6.0][k];
            assert!((x * c[k + 2] - (1.0 / factorial - c[k])).abs() <= 4.0 * EPS, "{x}, {k}");
        }
    }
    let below = stumpff::stumpff(2.5 - 4.0 * EPS);
    let above = stumpff::stumpff(2.5);
    for (k, (a, b)) in below.into_iter().zip(above).enumerate() {
        // Sine and cosine have absolute errors, the cosine near its zero as well.
        assert!((a - b).abs() <= 16.0 * EPS * a.abs().max_or_nan(if k < 2 { 0.25 } else { 0.0 }), "{k}: {a} {b}");
    }
}

/// A thousand small turns are one turn, to the round-off of one: compensated summation.
#[test]
fn many_small_turns() {
    let xi = SVector::from([0.3, -0.2, 0.7]) * 1e-3;
    let (mut g, mut rest) = (Rotations::identity(), Rotations::null());
    for _ in 0..100_000 {
        Rotations::advance(&mut g, &mut rest, &xi);
    }
    // 79 rad: the round-off of the angle of each turn is common to all of them.
    let expected = Rotations::exp(&(xi * 1e5));
    let off = off::<Rotations, 3>(&expected, &g);
    assert!(off <= 79.0 * EPS, "{off:e}");
    assert!((g.w * g.w + g.u.dot(&g.u) - 1.0).abs() <= 4.0 * EPS);
}

/// The closed derivatives of Lagrangians and potentials are those by dual numbers.
#[test]
fn closed_derivatives_of_bodies() {
    /// The same potential without a closed gradient.
    struct Open(UniformGravity);
    impl GroupPotential<Rotations, 3> for Open {
        fn value<T: Scalar>(&self, g: &Rotation<T>) -> T {
            self.0.value(g)
        }
    }
    let gravity = UniformGravity { weight: [0.3, -0.5, -1.2], centre: [0.4, 0.8, -0.3] };
    let g = Rotations::exp(&SVector::from([0.4, -1.1, 0.8]));
    let (closed, open) = (gravity.with_gradient(&g), Open(gravity).with_gradient(&g));
    assert!(
        (closed.0 - open.0).abs() <= 8.0 * EPS && (closed.1 - open.1).max_abs_or_nan() <= 16.0 * EPS,
        "{closed:?} {open:?}"
    );
}

#[test]
fn invalid_input_of_bodies() {
    let stretched = Rotation::from_quaternion([1.0, 1e-3, 0.0, 0.0]);
    assert!(matches!(stretched, Err(GroupError::NonUnitQuaternion { norm }) if norm > 1.0));
    assert!(matches!(Rotation::from_quaternion([f64::NAN, 0.0, 0.0, 1.0]), Err(GroupError::NonFinite { .. })));
    assert!(Rotation::from_quaternion([0.6, 0.0, 0.8 + 1e-9, 0.0]).is_ok());
    let asymmetric = nalgebra::Matrix3::new(1.0, 0.1, 0.0, 0.2, 1.0, 0.0, 0.0, 0.0, 1.0);
    assert!(matches!(Inertia::new(asymmetric), Err(GroupError::NotSymmetric { .. })));
    // A lamina has the largest moment that there is.
    assert!(Inertia::principal([0.1, 0.2, 0.1 + 0.2]).is_ok());
    assert!(matches!(Inertia::principal([1.0, 1.0, 2.001]), Err(GroupError::TriangleInequality { .. })));
    let ball = Inertia::principal([1.0; 3]).unwrap();
    assert!(matches!(RigidBody::moving(&ball, 0.0, NoPotential, 0.0), Err(GroupError::NotPositive { .. })));
    assert!(matches!(RigidBody::rotating(&ball, NoPotential, f64::NAN), Err(GroupError::NonFinite { .. })));
}
