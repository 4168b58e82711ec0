//! Sparse systems of few unknowns compared with the library for small systems, for every splitting scheme and the
//! midpoint rule.

use contact_examples::systems::{Chain, Ends};
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, PhasePoint, Scalar, Structure};
use discrete_herglotz::{
    SplittingScheme, Stepper,
    rules::{Flow, Rule},
    splitting::Splitting,
};
use sparse_herglotz::systems::{FputBond, SineGordon, Spring, fput_chain, lattice};
use sparse_herglotz::{Difference, FIXED, Potential, SparseMidpoint, SparseSplitting, SparseSystem, State};

const STEPS: usize = 20;
const H: f64 = 0.1;

/// Positions, velocities and the action of a start without symmetry, of size one.
fn start<const N: usize>() -> (SVector<f64, N>, SVector<f64, N>, f64) {
    let of = |i: usize, shift: f64| (1.7 * i as f64 + shift).sin();
    (SVector::from_fn(|i, _| of(i, 0.3)), SVector::from_fn(|i, _| of(i, 1.1)), 0.4)
}

/// The round-off of `STEPS` steps of a motion of size one. A stage has some twenty additions, each of which rounds
/// once, and over a time of 2 neighbouring motions diverge by at most a factor of ten.
fn tolerance(stages: usize) -> f64 {
    20.0 * 10.0 * f64::EPSILON * (STEPS * stages) as f64
}

fn assert_same<const N: usize>(name: &str, found: State, expected: PhasePoint<N>, masses: [f64; N], tolerance: f64) {
    for (i, mass) in masses.iter().enumerate() {
        let (dq, dp) = (found.q[i] - expected.q[i], mass * found.v[i] - expected.p[i]);
        assert!(dq.abs() <= tolerance && dp.abs() <= tolerance, "{name}, unknown {i}: {dq:e}, {dp:e} > {tolerance:e}");
    }
    let dz = found.z.unwrap() - expected.z;
    // The size of z is that of the number of unknowns.
    assert!(dz.abs() <= N as f64 * tolerance, "{name}: z differs by {dz:e}");
}

/// Compares both libraries for every scheme and for the midpoint rule.
fn compare<const N: usize, L: Lagrangian<N>>(small: &L, large: &SparseSystem, masses: [f64; N]) {
    let (q, v, z) = start::<N>();
    let p = SVector::from_fn(|i, _| masses[i] * v[i]);
    let from = State { t: 0.7, q: q.as_slice(), v: v.as_slice(), z: Some(z) };
    for h in [H, -H] {
        for scheme in SplittingScheme::ALL {
            let mut a = SparseSplitting::new(large, &scheme, h, from).unwrap();
            let mut b = Splitting::new(small, &scheme, h, from.t, PhasePoint { q, p, z }).unwrap();
            assert_eq!((a.advance(STEPS), b.advance(STEPS)), (Ok(()), Ok(())));
            let sigma = (a.sigma() - b.sigma()).abs();
            // One rounding of the product gamma h, and one of the exponential.
            assert!(sigma <= 2.0 * f64::EPSILON, "{}: sigma_d differs by {sigma:e}", scheme.name());
            assert_same(scheme.name(), a.state(), b.state().fixed(), masses, tolerance(scheme.stages()));
        }
        let mut a = SparseMidpoint::new(large, h, from, None).unwrap();
        let mut b = Flow::new(Rule::MIDPOINT.of(small, h).unwrap(), from.t, PhasePoint { q, p, z }).unwrap();
        assert_eq!((a.advance(STEPS), b.advance(STEPS)), (Ok(()), Ok(())));
        let sigma = (a.sigma() - b.sigma()).abs();
        assert!(sigma <= 4.0 * f64::EPSILON, "midpoint: sigma_d differs by {sigma:e}");
        // Newton's method stops within its round-off, which has the size of q/h.
        assert_same("midpoint", a.state(), Stepper::state(&b).fixed(), masses, tolerance(1) / H);
    }
}

/// Bonds in one run of elements, fixed at both ends (8 sites), and bonds outside runs (5 sites).
#[test]
fn chains_between_walls() {
    let chain = |n| fput_chain(n, FputBond { alpha: 0.0, beta: 0.5 }, -0.1).unwrap();
    compare(&Chain::<8> { ends: Ends::Fixed, beta: 0.5, gamma: -0.1 }, &chain(8), [1.0; 8]);
    compare(&Chain::<5> { ends: Ends::Fixed, beta: 0.5, gamma: -0.1 }, &chain(5), [1.0; 5]);
    compare(
        &Chain::<5> { ends: Ends::Fixed, beta: 0.5, gamma: 0.0 },
        &fput_chain(5, FputBond { alpha: 0.0, beta: 0.5 }, 0.0).unwrap(),
        [1.0; 5],
    );
}

/// A sine-Gordon lattice of 3 x 3 sites as a single Lagrangian.
struct Sites;

impl Lagrangian<9> for Sites {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 9>, v: &SVector<T, 9>, z: T) -> T {
        let mut l = v.dot(v) * 0.5 - z * 0.2;
        for x in 0..3 {
            for y in 0..3 {
                let here = q[x + 3 * y];
                l -= here.versine() * 1.5;
                if x < 2 {
                    l -= (q[x + 1 + 3 * y] - here).powi(2) * 0.35;
                }
                if y < 2 {
                    l -= (q[x + 3 * y + 3] - here).powi(2) * 0.35;
                }
            }
        }
        l
    }
    fn structure(&self) -> Structure {
        Structure { autonomous: true, separable: true, z_affine: true, constant_mass: true, ..Structure::default() }
    }
}

#[test]
fn a_lattice() {
    let large = lattice([3, 3], SineGordon { omega_squared: 1.5 }, 0.7, -0.2).unwrap();
    compare(&Sites, &large, [1.0; 9]);
}

const MASSES: [f64; 4] = [1.0, 2.0, 0.5, 3.0];

/// A time-dependent potential of three unknowns with two parameters.
struct Triangle;

impl Potential<3, 2> for Triangle {
    #[inline(always)]
    fn energy<T: Scalar>(&self, t: T, q: &SVector<T, 3>, c: &[T; 2]) -> T {
        (q[0] * q[1] - q[2] * c[0]).cos() * (t.sin() * 0.3 + 1.0) + (q[0] + q[1] + q[2]).powi(2) * c[1]
    }
}

/// The same system as a single Lagrangian.
struct Whole;

impl Lagrangian<4> for Whole {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 4>, v: &SVector<T, 4>, z: T) -> T {
        let mut l = -z * 0.15;
        for i in 0..4 {
            l += v[i] * v[i] * (0.5 * MASSES[i]);
        }
        for (x, c) in [([q[0], q[2], q[3]], [0.5, 1.0]), ([T::zero(), q[1], q[0]], [-0.7, 0.25])] {
            l -= Triangle.energy(t, &SVector::from(x), &c.map(T::from));
        }
        l - (q[3] - q[1]).powi(2)
    }
    fn structure(&self) -> Structure {
        Structure { separable: true, z_affine: true, constant_rate: true, constant_mass: true, ..Structure::default() }
    }
}

/// Unequal masses, parameters, a fixed component, a time-dependent force, and two lists.
#[test]
fn elements_of_any_kind() {
    let large = SparseSystem::new(4)
        .unwrap()
        .with_masses(MASSES.to_vec())
        .with_drag(-0.15)
        .with_potential(Triangle, [([0, 2, 3], [0.5, 1.0]), ([FIXED, 1, 0], [-0.7, 0.25])])
        .unwrap()
        .with_potential(Difference(Spring { stiffness: 2.0 }), [[1, 3]])
        .unwrap();
    compare(&Whole, &large, MASSES);
}
