//! The flows of the action, and the hypotheses of splittings.

use super::{ActionFlow, ActionMap, ActionSplitting, Riccati, RiccatiMap, Splitting, action_flow};
use crate::test_lagrangians::{Curved, Magnetic, OnLine, Rate};
use crate::{InputError, SplittingScheme};
use contact_examples::systems::QuadraticInZ;
use contact_geom::{PhasePoint, Scalar, Structure};

/// The closed form of the Riccati flow is a one-parameter group with the stated rate, and NaN after the blow-up.
#[test]
fn the_riccati_flow_is_a_flow() {
    for (b, c) in [(0.0, 0.3), (-0.4, 0.3), (2.0, -1.0), (1e-9, 1.0), (0.5, 0.0)] {
        let flow = Riccati { b, c };
        for z in [-0.7, 1e-12, 0.4] {
            let twice = flow.over(0.3).apply(flow.over(0.2).apply(z));
            assert!((flow.over(0.5).apply(z) - twice).abs() <= 8.0 * f64::EPSILON * twice.abs(), "{b} {c} {z}");
            assert!(action_flow::is_flow_of_its_rate(&flow, z), "{b} {c} {z}");
        }
    }
    assert!(Riccati { b: 0.0, c: 1.0 }.over(2.0).apply(1.0_f64).is_nan());
}

/// An action flow that may differ from that of L, and whose maps may differ from the flow of its rate.
#[derive(Clone, Copy, Debug)]
struct Wrong {
    rate: f64,
    map: f64,
}

impl ActionFlow for Wrong {
    type Map = RiccatiMap;
    fn rate<T: Scalar>(&self, z: T) -> T {
        z * z * self.rate
    }
    fn over(&self, s: f64) -> RiccatiMap {
        Riccati { b: 0.0, c: self.map }.over(s)
    }
}

/// Euler's step in place of the flow, which is accurate for small times only.
struct Euler;

#[derive(Clone, Copy, Debug)]
struct EulerMap(f64);

impl ActionFlow for Euler {
    type Map = EulerMap;
    fn rate<T: Scalar>(&self, z: T) -> T {
        z * z * -0.2
    }
    fn over(&self, s: f64) -> EulerMap {
        EulerMap(s)
    }
}

impl ActionMap for EulerMap {
    fn apply<T: Scalar>(&self, z: T) -> T {
        z + Euler.rate(z) * self.0
    }
}

/// Each violated hypothesis yields the error that names it.
#[test]
fn what_does_not_fit_is_refused() {
    let (start, scheme) = (PhasePoint::new([1.0], [1.0], 0.2), &SplittingScheme::STRANG);
    let affine = || Structure { separable: true, z_affine: true, ..Structure::default() };
    let with_rate = |claims: Structure| OnLine::from(Rate(claims));
    let linear = |claims: Structure, h: f64| Splitting::new(&with_rate(claims), scheme, h, 0.0, start).err();
    assert_eq!(linear(affine(), 0.1), None);
    let steady = Structure { constant_rate: true, ..affine() };
    assert!(matches!(linear(steady, 0.1), Some(InputError::FalseClaim { claim: "constant_rate", .. })));
    let nonlinear = Structure { z_affine: false, ..affine() };
    let in_time = ActionSplitting::new(&with_rate(nonlinear), scheme, 0.1, 0.0, start).err();
    assert!(matches!(in_time, Some(InputError::Hypothesis { .. })));
    assert_eq!(linear(affine(), 0.0), Some(InputError::Step { h: 0.0 }));
    assert_eq!(linear(Structure::default(), 0.1), Some(InputError::Unclaimed { claim: "separable" }));
    let lie = Structure { autonomous: true, ..affine() };
    assert!(matches!(linear(lie, 0.1), Some(InputError::FalseClaim { claim: "autonomous", .. })));
    let magnetic = Splitting::new(&OnLine::from(Magnetic), scheme, 0.1, 0.0, start).err();
    assert!(matches!(magnetic, Some(InputError::FalseClaim { claim: "separable", .. })), "{magnetic:?}");
    let curved = OnLine::from(Curved);
    let refused = Splitting::new(&curved, scheme, 0.1, 0.0, start).err();
    assert_eq!(refused, Some(InputError::Unclaimed { claim: "z_affine" }));
    let nystrom = ActionSplitting::new(&curved, &SplittingScheme::BLANES_MOAN_6, 0.1, 0.0, start).err();
    assert!(matches!(nystrom, Some(InputError::Hypothesis { .. })));
    let quadratic = OnLine::from(QuadraticInZ { c: 0.4 });
    let with = |rate, map| ActionSplitting::with_flow(&quadratic, &Wrong { rate, map }, scheme, 0.1, 0.0, start).err();
    assert_eq!(with(-0.2, -0.2), None);
    assert!(matches!(with(-0.3, -0.3), Some(InputError::Hypothesis { .. })));
    assert!(matches!(with(-0.2, -0.3), Some(InputError::Hypothesis { .. })));
    let euler = ActionSplitting::with_flow(&quadratic, &Euler, scheme, 0.1, 0.0, start).err();
    assert!(matches!(euler, Some(InputError::Hypothesis { .. })));
}
