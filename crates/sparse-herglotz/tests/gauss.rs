//! Contact Gauss collocation of sparse systems: agreement with the library for small systems, orders, momenta, and
//! the input that is rejected.

use contact_geom::nalgebra::SVector;
use contact_geom::{Derivatives, Lagrangian, PhasePoint, Scalar, VelocityPoint};
use discrete_herglotz::{
    InputError, Problem, SplittingScheme, Start, StepError, Stepper, StepperOptions, gauss::GaussStepper,
};
use sparse_herglotz::systems::{FputBond, fput_chain};
use sparse_herglotz::{
    FIXED, LocalLagrangian, Potential, SparseError, SparseGauss, SparseMidpoint, SparseSplitting, SparseSystem, State,
};

const N: usize = 5;
const H: f64 = 0.1;
const STEPS: usize = 20;

/// A linear finite element of a string with consistent masses, a gyroscopic and a time-dependent term, coupled
/// nonlinearly to z.
struct Piece;

impl LocalLagrangian<2, 1> for Piece {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T, c: &[T; 1]) -> T {
        let stretch = q[1] - q[0];
        let kinetic = (v[0] * v[0] + v[0] * v[1] + v[1] * v[1]) * c[0] * (q[0].sin() * 0.1 + 1.0);
        let gyroscopic = (q[0] * v[1] - q[1] * v[0]) * stretch * 0.2;
        let drag = (z.sin() + (v[0] + q[1]) * z * 0.3) * 0.05;
        kinetic + gyroscopic - stretch * stretch * (t.sin() * 0.2 + 0.5) - drag
    }
}

/// The potential of a site.
struct Site;

impl Potential<1> for Site {
    #[inline(always)]
    fn energy<T: Scalar>(&self, t: T, q: &SVector<T, 1>, _c: &[T; 0]) -> T {
        q[0].versine() * (t.cos() * 0.3 + 1.0)
    }
}

const PIECES: [([usize; 2], [f64; 1]); 6] =
    [([FIXED, 0], [0.5]), ([0, 1], [0.3]), ([1, 2], [0.4]), ([2, 3], [0.35]), ([3, 4], [0.45]), ([4, 1], [0.25])];

/// The masses in addition to those of the elements.
const MASSES: [f64; N] = [0.0, 0.0, 0.0, 0.0, 0.7];

fn large() -> SparseSystem {
    SparseSystem::new(N)
        .and_then(|s| s.with_masses(MASSES.to_vec()).with_drag(-0.15).with_potential(Site, (0..N).map(|i| [i])))
        .and_then(|s| s.with_term(Piece, PIECES))
        .unwrap()
}

/// The same system as a single Lagrangian.
struct Whole;

impl Lagrangian<N> for Whole {
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
        let mut l = z * -0.15;
        for i in 0..N {
            l += v[i] * v[i] * (0.5 * MASSES[i]);
            l -= Site.energy(t, &SVector::from([q[i]]), &[]);
        }
        let at = |x: &SVector<T, N>, i: usize| if i == FIXED { T::zero() } else { x[i] };
        for (unknowns, c) in PIECES {
            let of = |x: &SVector<T, N>| SVector::from(unknowns.map(|i| at(x, i)));
            l += Piece.value(t, &of(q), &of(v), z, &c.map(T::from));
        }
        l
    }
}

/// Positions, velocities and the action of a start without symmetry, of size one.
fn start() -> VelocityPoint<N> {
    let of = |i: usize, shift: f64| (1.7 * i as f64 + shift).sin();
    VelocityPoint { q: SVector::from_fn(|i, _| of(i, 0.3)), v: SVector::from_fn(|i, _| of(i, 1.1)), z: 0.4 }
}

/// General terms with consistent masses, gyroscopic and time-dependent terms, nonlinear in z: the map is that of the
/// library for small systems, for one and two stages, forward and backward in time.
#[test]
fn general_terms_are_those_of_the_whole() {
    let (system, x) = (large(), start());
    let p = Whole.gradient(0.7, &x).y;
    let from = State { t: 0.7, q: x.q.as_slice(), v: x.v.as_slice(), z: Some(x.z) };
    for (stages, h) in [(1, H), (2, H), (1, -H), (2, -H)] {
        let mut a = SparseGauss::new(&system, stages, h, from, None).unwrap();
        let momentum = Start::Momentum(PhasePoint { q: x.q, p, z: x.z }, x.v);
        let problem = Problem::new(&Whole, from.t, momentum).unwrap();
        let mut b =
            GaussStepper::new(&problem, stages, h, StepperOptions { action: true, ..StepperOptions::default() })
                .unwrap();
        assert_eq!((a.advance(STEPS), b.advance(STEPS)), (Ok(()), Ok(())));
        // Newton's methods stop within the round-off of q/h. Neighbouring motions diverge by at most a factor of ten
        // over the time of 2, and W has a condition number of about ten.
        let tolerance = 100.0 * f64::EPSILON * STEPS as f64 / H;
        let expected = b.state();
        for i in 0..N {
            let (dq, dp) = (a.q()[i] - expected.q[i], a.p()[i] - expected.p[i]);
            assert!(dq.abs() <= tolerance && dp.abs() <= tolerance, "{stages} stages, {i}: {dq:e}, {dp:e}");
        }
        assert!(
            (a.z().unwrap() - expected.z).abs() <= N as f64 * tolerance,
            "z differs by {:e}",
            a.z().unwrap() - expected.z
        );
        // The velocity of a state has the momentum of the state.
        let (momenta, state) = (a.p().to_vec(), a.state().unwrap());
        let end = VelocityPoint {
            q: SVector::from_column_slice(state.q),
            v: SVector::from_column_slice(state.v),
            z: state.z.unwrap(),
        };
        let off = Whole.gradient(state.t, &end).y - SVector::<f64, N>::from_column_slice(&momenta);
        assert!(off.amax() <= 100.0 * f64::EPSILON, "p - L_v = {:e}", off.amax());
    }
}

/// An initial state without symmetry.
fn motion_of(n: usize) -> (Vec<f64>, Vec<f64>) {
    let of = |shift: f64| (0..n).map(|i| 0.8 * (0.37 * i as f64 + shift).sin()).collect();
    (of(0.2), of(1.4))
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

/// With one stage the method is the midpoint rule, which is implemented separately.
#[test]
fn one_stage_is_the_midpoint_rule() {
    let n = 50;
    let chain = fput_chain(n, FputBond { alpha: 0.3, beta: 1.0 }, -0.1).unwrap();
    let (q, v) = motion_of(n);
    let from = State { t: 0.0, q: &q, v: &v, z: Some(0.2) };
    let mut a = SparseGauss::new(&chain, 1, H, from, None).unwrap();
    let mut b = SparseMidpoint::new(&chain, H, from, None).unwrap();
    assert_eq!((a.advance(STEPS), b.advance(STEPS)), (Ok(()), Ok(())));
    // One rounding of the product gamma h, and one of each quotient.
    assert!((a.sigma() - b.sigma()).abs() <= 8.0 * f64::EPSILON);
    let (a, b) = (a.state().unwrap(), b.state());
    // As in small_systems.rs: Newton's method stops within the round-off of q/h.
    let tolerance = 200.0 * f64::EPSILON * STEPS as f64 / H;
    assert!(distance(a.q, b.q) <= tolerance && distance(a.v, b.v) <= tolerance, "{:e}", distance(a.v, b.v));
    assert!((a.z.unwrap() - b.z.unwrap()).abs() <= n as f64 * tolerance, "{:e}", a.z.unwrap() - b.z.unwrap());
}

/// Two stages have order 4 on a nonlinear chain: the slope of the error is 4 to within 0.15.
#[test]
fn two_stages_have_order_four() {
    let n = 50;
    let chain = fput_chain(n, FputBond { alpha: 0.3, beta: 1.0 }, -0.1).unwrap();
    let (q, v) = motion_of(n);
    let from = State { t: 0.0, q: &q, v: &v, z: Some(0.2) };
    let mut exact = SparseSplitting::new(&chain, &SplittingScheme::SOFRONIOU_SPALETTA_10, 4.0 / 256.0, from).unwrap();
    exact.advance(256).unwrap();
    let end = exact.state();
    let exact = [end.q, end.v, &[end.z.unwrap()]].concat();
    let error = |steps: usize| {
        let mut motion = SparseGauss::new(&chain, 2, 4.0 / steps as f64, from, None).unwrap();
        motion.advance(steps).unwrap();
        let end = motion.state().unwrap();
        distance(&[end.q, end.v, &[end.z.unwrap()]].concat(), &exact)
    };
    let points = [48, 64, 96, 128].map(|steps| ((4.0 / steps as f64).ln(), error(steps).ln()));
    let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / points.len() as f64;
    let (mx, my) = (mean(|p| p.0), mean(|p| p.1));
    let slope = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum::<f64>()
        / points.iter().map(|p| (p.0 - mx).powi(2)).sum::<f64>();
    assert!((slope - 4.0).abs() <= 0.15, "order {slope}: {points:?}");
    // The errors are above round-off.
    assert!(points[3].1.exp() > 1e-11, "{points:?} is round-off");
}

/// Input that is rejected before the first step.
#[test]
fn bad_input() {
    let x = start();
    let from = State { t: 0.0, q: x.q.as_slice(), v: x.v.as_slice(), z: Some(x.z) };
    let refused = |system: &SparseSystem, stages, h, memory| SparseGauss::new(system, stages, h, from, memory).err();
    let system = large();
    for stages in [0, 3] {
        assert_eq!(refused(&system, stages, H, None), Some(InputError::Stages { found: stages }.into()));
    }
    assert_eq!(refused(&system, 2, 0.0, None), Some(InputError::Step { h: 0.0 }.into()));
    let explicit = SparseSplitting::new(&system, &SplittingScheme::STRANG, H, from).err();
    let midpoint = SparseMidpoint::new(&system, H, from, None).err();
    assert_eq!((explicit, midpoint), (Some(SparseError::NotSeparable), Some(SparseError::NotSeparable)));
    let list = |elements: &[[usize; 2]]| {
        let elements = elements.iter().map(|e| (*e, [1.0]));
        large().with_term(Piece, elements).err()
    };
    let out = SparseError::OutOfRange { list: 2, element: 1, unknown: 5, last: 4 };
    assert_eq!(list(&[[0, 1], [1, 5]]), Some(out));
    assert_eq!(list(&[[3, 3]]), Some(SparseError::Repeated { list: 2, element: 0, unknown: 3 }));
    // An unknown without mass that belongs to no general term, and a negative mass.
    let some = || SparseSystem::new(N).unwrap().with_masses(MASSES.to_vec());
    let first = some().with_term(Piece, PIECES[2..].iter().copied()).unwrap();
    assert_eq!(refused(&first, 1, H, None), Some(SparseError::Mass { unknown: 0, mass: 0.0 }));
    let negative = large().with_mass(-1.0);
    assert_eq!(refused(&negative, 1, H, None), Some(SparseError::Mass { unknown: 0, mass: -1.0 }));
    // The kinetic energy depends only on differences of velocities.
    let singular = SparseSystem::new(N).unwrap().with_term(Relative, (1..N).map(|i| [i - 1, i])).unwrap();
    assert_eq!(refused(&singular, 1, H, None), Some(SparseError::SingularMass));
    let undefined = large().with_term(Inverse, [[2]]).unwrap();
    let zero = [0.0; N];
    let at_zero = SparseGauss::new(&undefined, 2, H, State { q: &zero, ..from }, None).err();
    assert_eq!(at_zero, Some(SparseError::Undefined { unknown: 2 }));
    // A memory limit.
    let Some(SparseError::Memory { needed, limit: 100 }) = refused(&system, 2, H, Some(100)) else {
        panic!("100 bytes are not enough");
    };
    assert!(needed > 100);
}

/// A kinetic energy of the relative motion, whose matrix is singular.
struct Relative;

impl LocalLagrangian<2> for Relative {
    fn value<T: Scalar>(&self, _t: T, _q: &SVector<T, 2>, v: &SVector<T, 2>, _z: T, _c: &[T; 0]) -> T {
        (v[1] - v[0]).powi(2)
    }
}

/// A term that is not defined at 0.
struct Inverse;

impl LocalLagrangian<1> for Inverse {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, _v: &SVector<T, 1>, _z: T, _c: &[T; 0]) -> T {
        q[0].recip()
    }
}

/// With a drag so strong that a step has no positive conformal factor, the step returns a status and the state before
/// it is kept.
#[test]
fn a_step_that_fails_keeps_the_state() {
    let strong = large().with_drag(-60.0);
    let x = start();
    let from = State { t: 0.0, q: x.q.as_slice(), v: x.v.as_slice(), z: Some(x.z) };
    let mut motion = SparseGauss::new(&strong, 1, H, from, None).unwrap();
    let halt = motion.advance(3).unwrap_err();
    assert_eq!(halt.taken, 0);
    assert!(!matches!(halt.cause, StepError::Singular { .. }), "{halt}");
    assert_eq!((motion.q(), motion.time(), motion.z()), (x.q.as_slice(), 0.0, Some(x.z)));
}
