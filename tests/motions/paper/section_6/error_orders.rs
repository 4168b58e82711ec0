//! Statement 40 (section 6, future work): the orders of `L_d - L_h^e`, of the discrete Legendre transforms, and of the
//! flow.

use crate::paper::table::discretise;
use contact_examples::systems::{System, SystemVisitor, visit_catalogue};
use discrete_herglotz::rules::Method;
use exact_lagrangian::{ExactLagrangian, Order, error_orders};

/// A point of the unit cube without symmetry; `which` selects one of many.
fn fractions(n: usize, which: f64) -> Vec<f64> {
    (0..n)
        .map(|i| (which * [2.0f64, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0, 23.0, 29.0][i % 10].sqrt()).fract())
        .collect()
}

/// With each method of order r on every system: `r + 1` for the value and the flow, r for the transforms, which are
/// derivatives at the scale h. Each slope within 0.15. Where the leading error almost vanishes at a point, the slopes
/// are taken at another point.
#[test]
fn every_method_on_every_system() {
    struct Systems;
    impl SystemVisitor for Systems {
        fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
            for method in Method::applicable(&system.structure()) {
                let outcome = slopes(system, method, 4.0).or_else(|first| {
                    slopes(system, method, 5.0).map_err(|second| format!("{first}; elsewhere {second}"))
                });
                assert_eq!(outcome, Ok(()), "statement 40 on {} with {method}", system.name());
            }
        }
    }
    visit_catalogue(&mut Systems);
}

/// The slopes of a method at a point of a system.
fn slopes<const N: usize, S: System<N>>(system: &S, method: Method, which: f64) -> Result<(), String> {
    let (t, x) = system.sample(&fractions(2 * N + 2, which));
    let orders =
        error_orders(system, |h| discretise(method, system, h, t, &x), t, &x, 0.25).map_err(|e| e.to_string())?;
    let r = f64::from(method.order());
    for (what, found, expected) in [
        ("value", orders.value, r + 1.0),
        ("F-", orders.legendre_minus, r),
        ("F+", orders.legendre_plus, r),
        ("flow", orders.flow, r + 1.0),
    ] {
        // The drift of the splitting is the motion of a free particle.
        if method == Method::Strang && system.name() == "free_particle" {
            if found.order != Order::Exact {
                return Err(format!("{what}: order {}", found.order));
            }
        } else if found.fitted.len() < 4 {
            return Err(format!("{what}: only {} steps above round-off", found.fitted.len()));
        } else if !found.order.is(expected, 0.15) {
            return Err(format!("{what}: {} for {expected}", found.order));
        }
    }
    Ok(())
}

/// All errors of the exact discrete Lagrangian are round-off, at every step.
#[test]
fn the_exact_one() {
    struct Systems;
    impl SystemVisitor for Systems {
        fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
            let (t, x) = system.sample(&fractions(2 * N + 2, 4.0));
            let orders = error_orders(system, |h| ExactLagrangian::<_, N>::new(system, h), t, &x, 0.25);
            let flat = orders.is_ok_and(|o| {
                [o.value, o.legendre_minus, o.legendre_plus, o.flow].iter().all(|m| m.order == Order::Exact)
            });
            assert!(flat, "statement 40 on {} with L_h^e", system.name());
        }
    }
    visit_catalogue(&mut Systems);
}
