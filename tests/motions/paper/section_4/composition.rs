//! Composition: `L_{h1+h2}^e(q0, q2, z0) = L_{h1}^e(q0, q1, z0) + L_{h2}^e(q1, q2, z1)` at the critical `q1`, and only
//! there.

use crate::paper::table::{AlongMotion, EXACT_TOLERANCE, OverMotions};
use contact_examples::systems::{CoupledInZ, OneCoordinate, System, visit_catalogue};
use contact_geom::VelocityPoint;
use contact_geom::nalgebra::SVector;
use exact_lagrangian::{ExactError, ExactLagrangian, compose, statements, through};

/// Along random motions of every system, with unequal steps.
#[test]
fn on_every_system() {
    struct Composition;
    impl AlongMotion for Composition {
        fn residual<const N: usize, S: System<N>>(
            &mut self,
            system: &S,
            t: f64,
            x: &VelocityPoint<N>,
            h: f64,
        ) -> Result<f64, ExactError<N>> {
            statements::composition(system, t, x, (0.12 * h, 0.18 * h))
        }
    }
    visit_catalogue(&mut OverMotions { name: "composition".into(), bound: EXACT_TOLERANCE, residual: Composition });
}

/// The slope of a composition is the derivative of its value, by central differences, extrapolated once.
#[test]
fn the_slope_is_that_of_the_value() {
    let system = OneCoordinate::from(CoupledInZ::default());
    let [a, b] = [0.3, 0.4].map(|h| ExactLagrangian::<_, 1>::new(&system, h).unwrap());
    let ends = [SVector::from([0.3]), SVector::from([0.9])];
    let at = |q1: f64| through(&a, &b, 0.1, (&ends, 0.4), &SVector::from([q1]));
    let value = |q1: f64| at(q1).map_or(f64::NAN, |c| c.value);
    let slope = |d: f64| (value(0.7 + d) - value(0.7 - d)) / (2.0 * d);
    let differences = (4.0 * slope(5e-4) - slope(1e-3)) / 3.0;
    let formula = at(0.7).map_or(f64::NAN, |c| c.slope[0]);
    assert!((formula - differences).abs() < 1e-11 && formula.abs() > 0.1, "{formula} and {differences}");
    let critical = compose(&a, &b, 0.1, (&ends, 0.4), &SVector::from([0.6])).map_or(f64::NAN, |c| c.slope[0]);
    assert!(critical.abs() < 1e-13, "{critical:e}");
}
