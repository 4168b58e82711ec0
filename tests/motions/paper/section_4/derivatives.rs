//! Statement 34 (section 4.2): the derivatives `D1 L_h^e = -p0 e^b`, `D2 L_h^e = p1`, `Dz L_h^e = e^b - 1` and `sigma_d
//! = e^b` against differences, under strong damping, for short steps, and where the momentum depends on time.

use contact_examples::systems::{
    DoublePendulum, HarmonicOscillator, OneCoordinate, QuadraticInZ, System, TwoCoordinates,
};
use contact_geom::nalgebra::SVector;
use contact_geom::{
    ChartVector, DiscretePoint, Lagrangian, Parametric, Scalar, VelocityPoint, legendre, numbers::MaxAbsOrNan,
};
use discrete_herglotz::{DiscreteLagrangian, rules::Rule, solve::Solver};
use exact_lagrangian::{ContactExponential, ExactLagrangian, error_orders, statements as exact};

/// The derivatives by central differences of the value, extrapolated twice, without duals: with a step d their error is
/// d^6 and eps/d.
fn by_differences<const N: usize>(system: &impl System<N>, x: &VelocityPoint<N>, h: f64) -> f64 {
    let t = system.initial_time();
    let (Ok(exp), Ok(ld)) = (ContactExponential::new(system, h), ExactLagrangian::<_, N>::new(system, h)) else {
        return f64::NAN;
    };
    let Ok(y) = exp.at(t, x) else { return f64::NAN };
    let Ok(jet) = ld.jet(t, &y) else { return f64::NAN };
    let slope = |i: usize, d: f64| {
        let value = |by: f64| {
            let unit = ChartVector::<N>::from_fn(|j| if i == j { by } else { 0.0 });
            let moved: DiscretePoint<N> = ChartVector::from(y).plus(unit).into();
            ld.value(t, &moved).unwrap_or(f64::NAN)
        };
        (value(d) - value(-d)) / (2.0 * d)
    };
    let extrapolated = |i: usize| {
        let [a, b, c] = [0.02, 0.01, 0.005].map(|d| slope(i, d * if h < 0.5 { h } else { 0.5 }));
        let (once, again) = ((4.0 * b - a) / 3.0, (4.0 * c - b) / 3.0);
        (16.0 * again - once) / 15.0
    };
    let (formula, found) = (ChartVector { x: jet.d1, y: jet.d2, z: jet.dz }, ChartVector::<N>::from_fn(extrapolated));
    formula.minus(found).max_abs_or_nan() / formula.max_abs_or_nan()
}

/// The formulas against differences, to 1e-9.
#[test]
fn against_differences() {
    for h in [0.1, 0.5] {
        let residuals = [
            by_differences(
                &TwoCoordinates::from(DoublePendulum::default()),
                &VelocityPoint::new([0.7, -0.4], [0.5, 0.9], 0.3),
                h,
            ),
            by_differences(&OneCoordinate::from(QuadraticInZ { c: 1.0 }), &VelocityPoint::new([0.7], [0.5], 0.3), h),
        ];
        assert!(residuals.iter().all(|r| *r < 1e-9), "h = {h}: {residuals:?}");
    }
}

/// sigma_d keeps its relative accuracy at `e^-50`, where `1 + Dz L_d` has lost all digits.
#[test]
fn sigma_under_strong_damping() {
    let exp = ContactExponential::new(OneCoordinate::from(HarmonicOscillator { gamma: -50.0 }), 1.0).unwrap();
    let ld = ExactLagrangian::<_, 1>::new(OneCoordinate::from(HarmonicOscillator { gamma: -50.0 }), 1.0).unwrap();
    let y = exp.at(0.0, &VelocityPoint::new([0.4], [1.2], 0.3));
    let sigma = y.ok().and_then(|y| ld.jet(0.0, &y).ok()).map_or(f64::NAN, |jet| jet.sigma());
    // The rounding of b = -50 changes e^b by 32 units in the last place.
    let truth = (-50f64).exp();
    assert!((sigma - truth).abs() < 64.0 * f64::EPSILON * truth, "{sigma:e}");
}

/// A Lagrangian whose momentum depends on time, unlike those of the catalogue: a mass that grows, and a velocity term
/// that is driven.
struct Swelling;
impl Lagrangian<1> for Swelling {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        let (q, v) = (q[0], v[0]);
        (t * 0.7).exp() * v * v * 0.5 + q * v * t.cos() * 0.4 - q * q * (t + 1.0) * 0.5 - z * (q * q + 0.3) * 0.2
    }
}
impl Parametric<1> for Swelling {}
impl System<1> for Swelling {
    fn name(&self) -> &'static str {
        "swelling"
    }
    fn initial(&self) -> VelocityPoint<1> {
        VelocityPoint::new([0.8], [0.3], 0.1)
    }
    fn sample(&self, u: &[f64]) -> (f64, VelocityPoint<1>) {
        let between = |u: f64| 2.0 * u - 1.0;
        (u[3], VelocityPoint::new([between(u[0])], [between(u[1])], between(u[2])))
    }
}

/// All statements of section 4, composition and the error orders for it.
#[test]
fn a_momentum_that_depends_on_time() {
    let (x, h) = (VelocityPoint::new([0.8], [0.3], 0.1), 0.4);
    for t in [0.0, 0.6] {
        for statement in exact::STATEMENTS {
            let residual = exact::residual(statement, &Swelling, t, &x, h);
            assert!(matches!(residual, Ok(Some(r)) if r < 1e-12), "statement {statement}, t = {t}: {residual:?}");
        }
        let composed = exact::composition(&Swelling, t, &x, (0.1, 0.2));
        assert!(composed.as_ref().is_ok_and(|r| *r < 1e-12), "t = {t}: {composed:?}");
        let orders = error_orders(&Swelling, |h| Rule::MIDPOINT.of(&Swelling, h), t, &x, 0.25);
        let ok = orders.as_ref().is_ok_and(|o| {
            let momenta = [&o.legendre_minus, &o.legendre_plus].iter().all(|m| m.order.is(2.0, 0.15));
            momenta && [&o.value, &o.flow].iter().all(|m| m.order.is(3.0, 0.15))
        });
        assert!(ok, "t = {t}: {orders:?}");
    }
}

/// A step forward and backward, with a momentum that depends on time: the state, the mean velocity and sigma return to
/// their values.
#[test]
fn forward_and_backward() {
    let (x, h, t) = (VelocityPoint::new([0.8], [0.3], 0.1), 0.4, 0.3);
    let ld = ExactLagrangian::<_, 1>::new(Swelling, h).unwrap();
    let (start, mut solver) = (legendre(&Swelling, t, &x), Solver::default());
    let forward = ld.forward(t, &start, &x.v, &mut solver).unwrap();
    let back = ld.backward(t, &forward.end, &forward.velocity, &mut solver).unwrap();
    let apart = ChartVector::from(back.end).minus(start.into()).max_abs_or_nan();
    assert!(apart < 1e-14 && (back.velocity - forward.velocity).max_abs_or_nan() < 1e-14, "{apart:e}");
    assert!((back.sigma / forward.sigma - 1.0).abs() < 1e-14, "{} and {}", forward.sigma, back.sigma);
}

/// `Dz L_h^e` keeps its relative accuracy where it is small.
#[test]
fn dz_of_a_short_step() {
    for h in [1e-3, 1e-5, 1e-7] {
        let ld = ExactLagrangian::<_, 1>::new(OneCoordinate::from(HarmonicOscillator { gamma: -0.3 }), h).unwrap();
        let dz = ld.jet(0.0, &DiscretePoint::new([0.4], [0.4 + 1.2 * h], 0.3)).map_or(f64::NAN, |jet| jet.dz);
        let truth = (-0.3 * h).exp_m1();
        assert!((dz / truth - 1.0).abs() < 1e-14, "h = {h}: {dz:e} for {truth:e}");
    }
}
