//! Statement 40 (section 6, future work): the orders of `L_d - L_h^e`, of the discrete Legendre transforms, and of the flow.

use crate::common::discretise;
use contact_geom::systems::{System, SystemVisitor, visit_catalogue};
use discrete_herglotz::Method;
use exact_lagrangian::{ExactLagrangian, error_orders};

/// A generic point: no symmetry of the system makes a leading error vanish there.
fn fractions(n: usize) -> Vec<f64> {
    (0..n).map(|i| (4.0 * [2.0f64, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0, 23.0, 29.0][i % 10].sqrt()).fract()).collect()
}

/// With each method of order r on every system: `r + 1` for the value and the flow, r for the transforms, which are derivatives at
/// the scale h. Each slope within 0.15.
#[test]
fn every_method_on_every_system() {
    struct Systems;
    impl SystemVisitor for Systems {
        fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
            let (t, x) = system.sample(&fractions(2 * N + 2));
            for method in Method::applicable(&system.structure()) {
                let orders = error_orders(system, |h| discretise(method, system, h, t, &x), t, &x, 0.25);
                let name = format!("{} with {method}", system.name());
                assert!(orders.is_ok(), "{name}: {orders:?}");
                let Ok(orders) = orders else { continue };
                let r = f64::from(method.order());
                for (what, found, expected) in [
                    ("value", orders.value, r + 1.0),
                    ("F-", orders.legendre_minus, r),
                    ("F+", orders.legendre_plus, r),
                    ("flow", orders.flow, r + 1.0),
                ] {
                    // The drift of the splitting is the motion of a free particle.
                    if method == Method::Strang && system.name() == "free_particle" {
                        assert_eq!(found.order, f64::INFINITY, "{name}, {what}");
                        continue;
                    }
                    assert!(
                        found.fitted.len() >= 4,
                        "{name}, {what}: only {} steps above round-off",
                        found.fitted.len()
                    );
                    assert!((found.order - expected).abs() < 0.15, "{name}, {what}: {} for {expected}", found.order);
                }
            }
        }
    }
    visit_catalogue(&mut Systems);
}

/// The exact one is exact: all its errors are round-off, at every step.
#[test]
fn the_exact_one() {
    struct Systems;
    impl SystemVisitor for Systems {
        fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
            let (t, x) = system.sample(&fractions(2 * N + 2));
            let orders = error_orders(system, |h| ExactLagrangian::<_, N>::new(system, h), t, &x, 0.25);
            let flat = orders.is_ok_and(|o| {
                [o.value, o.legendre_minus, o.legendre_plus, o.flow].iter().all(|m| m.order == f64::INFINITY)
            });
            assert!(flat, "{}", system.name());
        }
    }
    visit_catalogue(&mut Systems);
}
