//! Defect samples are bitwise those of their form for a number of coordinates known at compile time. To be removed together
//! with the latter.

use super::{Curve, SampleKernel};
use crate::gauss::dense::Solved as TypedSolved;
use crate::gauss::dynamic::dense::Solved;
use crate::gauss::dynamic::system::Typed;
use crate::gauss::resolution::defect_sample::{Compare, Curve as TypedCurve, SAMPLE_SETS};
use crate::gauss::stages::parametrization::{Fictitious, Parametrization, Physical};
use crate::numbers::instructions::Instructions;
use crate::numbers::registers::{MAX_STAGES, Stages};
use crate::test_lagrangians::{Curved, InPlane, OnLine};
use contact_examples::systems::{DoublePendulum, Kepler, QuadraticInZ};
use contact_geom::nalgebra::SVector;
use contact_geom::{ContactHamiltonian, Lagrangian, OfHamiltonian, PhasePoint, Scalar};
use std::array::from_fn;

struct Relativistic;

impl<const N: usize> ContactHamiltonian<N> for Relativistic {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, p: &SVector<T, N>, z: T) -> T {
        (p.dot(p) + 1.0).sqrt() + q.dot(q) * (t.cos() + 2.0) + z * z * 0.1
    }
}

/// Compares the samples of an arbitrary curve.
fn compare<L: Lagrangian<N>, P: Parametrization<N>, const N: usize>(
    lagrangian: &L,
    transformation: &P,
    state: &PhasePoint<N>,
) {
    let system = Typed::<L, N>(lagrangian);
    for s in 1..=MAX_STAGES {
        let row = |seed: f64| from_fn(|i| if i < s { (1.3 * i as f64 + seed).sin() * 0.1 + 0.3 } else { 0.0 });
        let solved = TypedSolved::<N> {
            v: from_fn(|d| row(d as f64)),
            force: from_fn(|d| row(0.3 + d as f64)),
            rate: row(0.2),
            l: row(0.7),
        };
        let rows = |x: &[[f64; MAX_STAGES]; N]| x.iter().map(|x| Stages(*x)).collect();
        let dynamic = Solved {
            v: rows(&solved.v),
            force: rows(&solved.force),
            rate: Stages(solved.rate),
            l: Stages(solved.l),
            knows_l: true,
        };
        let mut expected = TypedCurve::new(s, 0.4, 0.2, state);
        let mut curve = Curve::new(s, 0.4, 0.2, state.q.as_slice(), state.p.as_slice(), state.z);
        if P::PHYSICAL {
            expected.of_solved(&solved);
            curve.of_solved(&dynamic);
        } else {
            expected.of_transformed(&solved, [0.8, 0.9]);
            curve.of_transformed(&dynamic, [0.8, 0.9]);
        }
        for acts in [true, false] {
            (expected.acts, curve.acts) = (acts, acts);
            for set in 0..SAMPLE_SETS {
                let arch = Instructions::new();
                let found = system.sample_defect(arch, &curve, !P::PHYSICAL, set);
                let expected = arch.dispatch(Compare { lagrangian, transformation, curve: &expected, set });
                assert_eq!(found, expected, "{N} coordinates, {s} stages, set {set}");
            }
        }
    }
}

#[test]
fn samples_are_those_of_the_typed_curve() {
    let (line, plane) = (PhasePoint::new([0.4], [0.3], 0.1), PhasePoint::new([0.4, -0.3], [0.3, 0.2], 0.1));
    compare(&OnLine::Curved(Curved), &Physical, &line);
    compare(&OnLine::QuadraticInZ(QuadraticInZ::default()), &Physical, &line);
    compare(&DoublePendulum::default(), &Physical, &plane);
    compare(&OfHamiltonian(Relativistic), &Physical, &plane);
    let kepler = InPlane::Kepler(Kepler::default());
    compare(&kepler, &Fictitious(&kepler), &plane);
}
