//! Friction of the unknowns of a sparse system: compared with the splitting of small systems, and what refuses it.

use contact_examples::systems::{Chain, Ends};
use contact_geom::nalgebra::SVector;
use contact_geom::{Forced, PhasePoint, VelocityDrag};
use discrete_herglotz::{SplittingScheme, Stepper, splitting::DragSplitting};
use sparse_herglotz::systems::{FputBond, fput_chain};
use sparse_herglotz::{SparseError, SparseGauss, SparseMidpoint, SparseSplitting, SparseSystem, State};

const SITES: usize = 5;

fn chain(gamma: f64) -> SparseSystem {
    fput_chain(SITES, FputBond { alpha: 0.0, beta: 0.5 }, gamma).unwrap()
}

/// A different friction of each site.
fn friction() -> SVector<f64, SITES> {
    SVector::from_fn(|i, _| 0.3 + 0.2 * i as f64)
}

/// Every scheme takes the same steps as the splitting of small systems, with the action, forward and backward, and with
/// compensated sums, to the round-off of 40 steps with at most 30 stages each, which neighbouring motions enlarge ten
/// times.
#[test]
fn steps_are_those_of_small_systems() {
    let q = SVector::<f64, SITES>::from_fn(|i, _| (1.7 * i as f64).sin());
    let v = SVector::<f64, SITES>::from_fn(|i, _| (0.9 * i as f64).cos());
    for gamma in [0.0, -0.1] {
        let forced = Forced {
            lagrangian: Chain::<SITES> { ends: Ends::Fixed, beta: 0.5, gamma },
            force: VelocityDrag { linear: friction(), quadratic: 0.0 },
        };
        let large = chain(gamma).with_friction(friction().as_slice().to_vec());
        let from = State { t: 0.0, q: q.as_slice(), v: v.as_slice(), z: Some(0.4) };
        for (scheme, h) in SplittingScheme::ALL.into_iter().flat_map(|scheme| [(scheme, 0.05), (scheme, -0.05)]) {
            let mut small = DragSplitting::new(&forced, &scheme, h, 0.0, PhasePoint { q, p: v, z: 0.4 }).unwrap();
            small.advance(40).unwrap();
            let expected = small.state().fixed::<SITES>();
            for compensated in [false, true] {
                let large = SparseSplitting::new(&large, &scheme, h, from).unwrap();
                let mut large = if compensated { large.compensated() } else { large };
                large.advance(40).unwrap();
                let found = large.state();
                let size = 1.0 + expected.p.norm();
                let off = (SVector::from_column_slice(found.q) - expected.q).norm()
                    + (SVector::from_column_slice(found.v) - expected.p).norm();
                assert!(off <= 2e-12 * size, "{} h = {h}: {off:e}", scheme.name());
                let dz = (found.z.unwrap() - expected.z).abs();
                assert!(dz <= 1e-11 * (size * size), "{} h = {h}: z differs by {dz:e}", scheme.name());
            }
        }
    }
}

/// What takes no friction says so, and invalid coefficients are refused.
#[test]
fn other_methods_refuse_friction() {
    let start = State { t: 0.0, q: &[0.1; SITES], v: &[0.2; SITES], z: Some(0.0) };
    let system = chain(-0.1).with_friction(vec![0.1; SITES]);
    for refused in [
        SparseMidpoint::new(&system, 0.1, start, None).err(),
        SparseGauss::new(&system, 1, 0.1, start, None).err(),
        SparseSplitting::new(
            &chain(0.0).with_timed_drag(|t| -0.1 * t.cos()).with_friction(vec![0.1; SITES]),
            &SplittingScheme::STRANG,
            0.1,
            start,
        )
        .err(),
    ] {
        let told = refused.is_some_and(|e| e.to_string().contains("use `SparseSplitting`"));
        assert!(matches!(refused, Some(SparseError::Friction { .. })) && told, "{refused:?}");
    }
    let of =
        |c: Vec<f64>| SparseSplitting::new(&chain(0.0).with_friction(c), &SplittingScheme::STRANG, 0.1, start).err();
    assert!(matches!(of(vec![0.1; 2]), Some(SparseError::Length { what: "the friction", .. })));
    assert!(matches!(of(vec![f64::NAN; SITES]), Some(SparseError::NonFinite { what: "the friction", .. })));
}
