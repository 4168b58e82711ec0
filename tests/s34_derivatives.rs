//! Statement 34 (section 4.2): `D1 L_h^e = -p0 e^b`, `D2 L_h^e = p1`, `Dz L_h^e = e^b - 1`; `sigma_d = e^b`.

use crate::common::over_motions;
use contact_geom::systems::{DoublePendulum, HarmonicOscillator, QuadraticInZ, System};
use contact_geom::{DiscretePoint, Triple, VelocityPoint};
use discrete_herglotz::DiscreteLagrangian;
use exact_lagrangian::{ContactExponential, ExactLagrangian};

/// First and second derivatives, against duals through flow and shooting, along random motions of every system.
#[test]
fn on_every_system() {
    over_motions(34);
}

/// A third way, without duals: central differences of the value, extrapolated twice. With a step d they err by d^6 and eps/d.
fn by_differences<const N: usize>(system: &impl System<N>, x: &VelocityPoint<N>, h: f64) -> f64 {
    let t = system.initial_time();
    let (Ok(exp), Ok(ld)) = (ContactExponential::new(system, h), ExactLagrangian::<_, N>::new(system, h)) else {
        return f64::NAN;
    };
    let Ok(y) = exp.at(t, x) else { return f64::NAN };
    let Ok(jet) = ld.jet(t, &y) else { return f64::NAN };
    let slope = |i: usize, d: f64| {
        let value = |by: f64| {
            let unit = Triple::<N>::from_fn(|j| if i == j { by } else { 0.0 });
            let moved: DiscretePoint<N> = Triple::from(y).plus(unit).into();
            ld.value(t, &moved).unwrap_or(f64::NAN)
        };
        (value(d) - value(-d)) / (2.0 * d)
    };
    let extrapolated = |i: usize| {
        let [a, b, c] = [0.02, 0.01, 0.005].map(|d| slope(i, d * h.min(0.5)));
        let (once, again) = ((4.0 * b - a) / 3.0, (4.0 * c - b) / 3.0);
        (16.0 * again - once) / 15.0
    };
    let (formula, found) = (Triple { x: jet.d1, y: jet.d2, z: jet.dz }, Triple::<N>::from_fn(extrapolated));
    formula.minus(found).amax() / formula.amax()
}

/// The formulas against differences, to 1e-9.
#[test]
fn against_differences() {
    for h in [0.1, 0.5] {
        let residuals = [
            by_differences(&DoublePendulum::default(), &VelocityPoint::new([0.7, -0.4], [0.5, 0.9], 0.3), h),
            by_differences(&QuadraticInZ { c: 1.0 }, &VelocityPoint::new([0.7], [0.5], 0.3), h),
        ];
        assert!(residuals.iter().all(|r| *r < 1e-9), "h = {h}: {residuals:?}");
    }
}

/// sigma_d keeps its digits where `1 + Dz L_d` has none left: `e^-50`.
#[test]
fn sigma_under_strong_damping() {
    let (Ok(exp), Ok(ld)) = (
        ContactExponential::new(HarmonicOscillator { gamma: -50.0 }, 1.0),
        ExactLagrangian::<_, 1>::new(HarmonicOscillator { gamma: -50.0 }, 1.0),
    ) else {
        return;
    };
    let y = exp.at(0.0, &VelocityPoint::new([0.4], [1.2], 0.3));
    let sigma = y.ok().and_then(|y| ld.jet(0.0, &y).ok()).map_or(f64::NAN, |jet| jet.sigma());
    // The rounding of b = -50 is worth 32 units.
    let truth = (-50f64).exp();
    assert!((sigma - truth).abs() < 64.0 * f64::EPSILON * truth, "{sigma:e}");
}
