//! Motions between two configurations.

use super::{heavy_top, heavy_top_start};
use contact_geom::groups::{GroupError, LieGroup, Rotations};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::MaxAbsOrNan;
use discrete_herglotz::groups::{GroupEnds, GroupGauss, GroupMotion, GroupState};

/// A reorientation: the momentum of a motion is found from its ends, from a guess that is off by a tenth.
#[test]
fn a_momentum_is_found_from_two_attitudes() {
    let top = heavy_top(-0.2);
    let momentum = top.momentum(&SVector::from([1.0, 1.5, -0.7]));
    let start = GroupState { momentum, ..heavy_top_start(&top) };
    let gauss = GroupGauss::new::<Rotations, 3>(&top, 3, 0.02).unwrap();
    let mut motion = GroupMotion::<Rotations, 3>::new(0.3, start).unwrap();
    motion.advance(&gauss, 30).unwrap();
    let end = motion.state();
    let ends = GroupEnds::<Rotations, 3> { t0: 0.3, g0: start.g, g1: end.g, z0: start.z, steps: 30 };
    let found = ends.search(&gauss, &(momentum * 1.1)).unwrap();
    // The end depends on the momentum with a derivative above 0.01; the residual is some round-off.
    let off = (found.start.momentum - momentum).max_abs_or_nan();
    assert!(found.residual < 1e-13 && off < 1e-11, "{off:e}, {found:?}");
    assert!((found.end.momentum - end.momentum).max_abs_or_nan() < 1e-10 && (found.end.z - end.z).abs() < 1e-10);
    // Newton's method.
    assert!((2..8).contains(&found.iterations), "{found:?}");
}

/// Guesses that are not finite, and ends between which no motion near the guess leads, are errors.
#[test]
fn motions_that_are_not_found_are_errors() {
    let top = heavy_top(0.0);
    let gauss = GroupGauss::new::<Rotations, 3>(&top, 3, 0.02).unwrap();
    let turned = Rotations::exp(&SVector::from([0.0, 0.0, 3.0]));
    let ends = GroupEnds::<Rotations, 3> { t0: 0.0, g0: Rotations::identity(), g1: turned, z0: 0.0, steps: 1 };
    let nan = ends.search(&gauss, &SVector::from([f64::NAN, 0.0, 0.0])).err();
    assert!(matches!(nan, Some(GroupError::NonFinite { .. })), "{nan:?}");
    // Half a turn in one step is beyond what the iteration of a step finds.
    let far = ends.search(&gauss, &SVector::zeros()).err();
    let expected = |e: &GroupError| {
        matches!(
            e,
            GroupError::NoMotionBetween { .. } | GroupError::NotConverged { .. } | GroupError::BeyondChart { .. }
        )
    };
    assert!(far.as_ref().is_some_and(expected), "{far:?}");
}
