//! The declared properties of every system of the catalogue, checked at its initial data and at points of its domain.

use super::*;
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::support::linear::solve;
use contact_geom::{ChartVector, Derivatives, OneParameterGroup};

/// Weyl's sequence: the fractional parts of multiples of numbers that are independent over the rationals are
/// equidistributed in the cube.
fn weyl(k: u32, length: usize) -> Vec<f64> {
    const PRIMES: [f64; 12] = [2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0, 23.0, 29.0, 31.0, 37.0];
    assert!(length <= PRIMES.len());
    PRIMES[..length].iter().map(|p| (f64::from(k + 1) * p.sqrt()).fract()).collect()
}

/// The condition number of a matrix in the maximum row sum norm; infinite where it is singular.
fn condition<const N: usize>(w: &SMatrix<f64, N, N>) -> f64 {
    let norm = |m: &SMatrix<f64, N, N>| m.row_iter().map(|r| r.abs().sum()).fold(0.0, f64::max);
    let mut inverse = SMatrix::<f64, N, N>::zeros();
    for j in 0..N {
        let mut column = SVector::<f64, N>::from_fn(|i, _| f64::from(u8::from(i == j)));
        if solve(&mut w.clone_owned(), &mut column).is_err() {
            return f64::INFINITY;
        }
        inverse.set_column(j, &column);
    }
    norm(w) * norm(&inverse)
}

/// Applies a computation to every system at its initial data and at 64 points of its domain.
struct AtSamples<F>(F);

trait AtPoint {
    fn at<const N: usize, S: System<N>>(&mut self, system: &S, t: f64, x: &VelocityPoint<N>);
}

impl<F: AtPoint> SystemVisitor for AtSamples<F> {
    fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
        self.0.at(system, system.initial_time(), &system.initial());
        for k in 0..64 {
            let (t, x) = system.sample(&weyl(k, 2 * N + 2));
            self.0.at(system, t, &x);
        }
    }
}

#[test]
fn what_is_declared_holds() {
    struct Declared;
    impl AtPoint for Declared {
        fn at<const N: usize, S: System<N>>(&mut self, system: &S, t: f64, x: &VelocityPoint<N>) {
            let name = system.name();
            for defect in system.structure().defects(system, t, x).unwrap() {
                assert!(defect.size <= f64::EPSILON, "{name}: {} fails by {:e} at {x:?}", defect.claim, defect.size);
            }
            for symmetry in system.symmetries() {
                let defect = symmetry.symmetry_defect(system, t, x);
                assert!(defect <= 1e-12, "{name}: {symmetry:?} fails by {defect:e} at {x:?}");
            }
        }
    }
    visit_catalogue(&mut AtSamples(Declared));
}

#[test]
fn the_hamiltonian_is_the_energy_through_the_fibre_derivative() {
    struct Energy;
    impl AtPoint for Energy {
        fn at<const N: usize, S: System<N>>(&mut self, system: &S, t: f64, x: &VelocityPoint<N>) {
            let (p, value) = (system.gradient(t, x).y, system.value(t, &x.q, &x.v, x.z));
            let Some(h) = system.hamiltonian(t, &PhasePoint { q: x.q, p, z: x.z }) else { return };
            let (energy, size) = (x.v.dot(&p) - value, 1.0 + x.v.dot(&p).abs() + value.abs());
            assert!((energy - h).abs() <= 1e-12 * size, "{}: {energy} and {h} at {x:?}", system.name());
        }
    }
    visit_catalogue(&mut AtSamples(Energy));
}

#[test]
fn samples_are_finite_and_regular() {
    struct Regular;
    impl AtPoint for Regular {
        fn at<const N: usize, S: System<N>>(&mut self, system: &S, t: f64, x: &VelocityPoint<N>) {
            let (name, h) = (system.name(), system.hessian(t, x));
            let finite = ChartVector::from(*x).is_finite() && system.gradient(t, x).is_finite();
            assert!(t.is_finite() && finite && system.value(t, &x.q, &x.v, x.z).is_finite(), "{name} at {x:?}");
            let seconds = h.qq.iter().chain(&h.qv).chain(&h.vv).chain(&h.qz).chain(&h.vz);
            assert!(seconds.chain([&h.zz]).all(|e| e.is_finite()), "{name} at {x:?}");
            let condition = condition(&h.vv);
            assert!(condition <= 1e3, "{name}: the condition number of W is {condition:e} at {x:?}");
        }
    }
    visit_catalogue(&mut AtSamples(Regular));
}

#[test]
fn names_are_unique() {
    struct Names(Vec<&'static str>);
    impl SystemVisitor for Names {
        fn visit<const N: usize, S: System<N>>(&mut self, system: &S) {
            assert!(!self.0.contains(&system.name()), "{} stands twice", system.name());
            self.0.push(system.name());
        }
    }
    visit_catalogue(&mut Names(Vec::new()));
}
