//! Orders of the methods in q, p and z, by slope on problems nonlinear in q and z.
//!
//! The errors against an independent integrator are fitted over steps small enough for the asymptotic regime, where
//! they are well above the error of that integrator; a slope may differ from the order by 0.15.

use crate::common::oracle::motion;
use crate::common::slope;
use crate::paper::table::discretise;
use contact_examples::systems::{
    CoupledInZ, CoupledPlane, DoublePendulum, OneCoordinate, QuadraticInZ, Relativistic, System, TwoCoordinates,
};
use contact_geom::{PhasePoint, legendre, numbers::MaxAbsOrNan};
use discrete_herglotz::{
    Stepper,
    rules::{Flow, Method},
};

/// The time over which the error is taken.
const SPAN: f64 = 1.0;

/// Ten times the tolerance of the integrator: smaller errors are not fitted.
const FLOOR: f64 = 3e-13;

/// The errors in q, p and z at the end for a number of steps.
fn errors<const N: usize, S: System<N>>(method: Method, system: &S, steps: usize, truth: &PhasePoint<N>) -> [f64; 3] {
    let t0 = system.initial_time();
    let ld = discretise(method, system, SPAN / steps as f64, t0, &system.initial());
    let start = legendre(system, t0, &system.initial());
    let end = ld.and_then(|ld| {
        let mut flow = Flow::new(&ld, t0, start)?;
        assert_eq!(flow.advance(steps), Ok(()));
        Ok(*flow.state())
    });
    assert!(end.is_ok(), "{}: {end:?}", system.name());
    end.map_or([f64::NAN; 3], |e| {
        [(e.q - truth.q).max_abs_or_nan(), (e.p - truth.p).max_abs_or_nan(), (e.z - truth.z).abs()]
    })
}

fn measure<const N: usize, S: System<N>>(system: &S) {
    let t0 = system.initial_time();
    let truth = legendre(system, t0 + SPAN, &motion(system, t0, &system.initial(), SPAN));
    for method in Method::applicable(&system.structure()) {
        // For order 4 and more, smaller steps leave errors close to those of the integrator.
        let counts = match method.order() {
            1 | 2 => [64, 128, 256, 512],
            4 => [8, 16, 32, 64],
            _ => [12, 16, 20, 24],
        };
        let runs: Vec<_> = counts
            .into_iter()
            .map(|steps| (SPAN / f64::from(steps), errors(method, system, steps as usize, &truth)))
            .collect();
        for (component, name) in ["q", "p", "z"].iter().enumerate() {
            let clear = runs.iter().map(|(h, e)| (*h, e[component])).take_while(|(_, error)| *error > FLOOR);
            let points: Vec<_> = clear.collect();
            assert!(points.len() >= 3, "{} with {method}: {runs:?}", system.name());
            let (observed, order) = (slope(&points), f64::from(method.order()));
            assert!(
                (observed - order).abs() < 0.15,
                "{} with {method}: order {observed:.3} in {name}, documented {order}; {points:?}",
                system.name()
            );
        }
    }
}

/// Problems nonlinear in q and z, one with W depending on q, v and z; under strong drag the rules explicit in z have
/// order one.
#[test]
fn orders_by_slope() {
    measure(&OneCoordinate::from(QuadraticInZ { c: 1.0 }));
    measure(&OneCoordinate::from(CoupledInZ { gamma: -1.0, ..CoupledInZ::default() }));
    measure(&TwoCoordinates::from(CoupledPlane { c: 1.5, ..CoupledPlane::default() }));
    measure(&OneCoordinate::from(Relativistic { gamma: -1.0 }));
    measure(&TwoCoordinates::from(DoublePendulum { gamma: -1.0, ..DoublePendulum::default() }));
}
