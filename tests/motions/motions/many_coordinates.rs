//! Systems of many coordinates, in the two mebibytes of stack of a thread of the standard library.

use crate::common::gauss::GaussSteppers;
use contact_examples::systems::{Chain, Ends, System};
use contact_geom::nalgebra::SVector;
use contact_geom::{DiscretePoint, Lagrangian, PhasePoint, WithoutClosedDerivatives, legendre};
use discrete_herglotz::{
    DiscreteLagrangian, SplittingScheme, Stepper,
    checks::check_claims,
    gauss::Gauss,
    rules::Rule,
    solve::Solver,
    splitting::Splitting,
    theory::{derived_jet, derived_second_jet},
};

const MEBIBYTE: usize = 1 << 20;

/// The state of the longest wave of a chain: its amplitude and speed, and the distance of the sites from a wave.
fn wave<const N: usize>(state: &PhasePoint<N>) -> ([f64; 2], f64) {
    let shape = Chain::<N>::default().initial().q;
    let [q, p] = [state.q, state.p].map(|x| x.dot(&shape) / shape.norm_squared());
    let off =
        contact_geom::numbers::max_abs_or_nan((state.q - shape * q).iter().chain(&(state.p - shape * p)).copied());
    ([q, p], off)
}

/// The longest wave of the linear chain after a time: a damped oscillator.
fn exact<const N: usize>(gamma: f64, t: f64) -> [f64; 2] {
    let omega = 2.0 * (0.5 * std::f64::consts::PI / (N as f64 + 1.0)).sin();
    let (half, rate) = (0.5 * gamma, (omega * omega - 0.25 * gamma * gamma).sqrt());
    let (s, c) = (rate * t).sin_cos();
    let decay = (half * t).exp();
    [decay * (c - half / rate * s), -decay * omega * omega / rate * s]
}

/// The time step.
const STEP: f64 = 0.5;

/// The chain with a drag below the critical one, which falls with N.
fn chain<const N: usize>() -> Chain<N> {
    Chain { ends: Ends::Fixed, beta: 0.0, gamma: -0.01 }
}

fn start<const N: usize>() -> PhasePoint<N> {
    legendre(&chain::<N>(), 0.0, &chain::<N>().initial())
}

/// The error of one step of a method of order two: `h^2` times the time and the third power of the frequency, which is
/// below pi/N.
fn second<const N: usize>() -> f64 {
    0.1 * (STEP * std::f64::consts::PI / N as f64).powi(2)
}

fn check<const N: usize>(what: &str, steps: f64, state: &PhasePoint<N>, tolerance: f64) {
    let ([q, p], off) = wave(state);
    let [q_exact, p_exact] = exact::<N>(chain::<N>().gamma, steps * STEP);
    let error = contact_geom::numbers::max_abs_or_nan([q - q_exact, p - p_exact]);
    assert!(error <= tolerance && off <= 1e-13, "{what}, N = {N}: {error:e}, {off:e} off the wave");
}

fn claims<const N: usize>() {
    let chain = chain::<N>();
    assert_eq!(check_claims(&chain, 0.0, &chain.initial()), Ok(chain.structure()));
}

fn rule<const N: usize>() {
    let midpoint = Rule::MIDPOINT.of(chain::<N>(), STEP).unwrap();
    let step = midpoint.forward(0.0, &start(), &SVector::zeros(), &mut Solver::default()).unwrap();
    check::<N>("midpoint", 1.0, &step.end, second::<N>());
}

fn splitting<const N: usize>() {
    let chain = chain::<N>();
    let mut strang = Splitting::new(&chain, &SplittingScheme::STRANG, STEP, 0.0, start()).unwrap();
    strang.advance(10).unwrap();
    check::<N>("Strang", 10.0, &strang.state().fixed(), 10.0 * second::<N>());
}

fn collocation<const N: usize>() {
    let gauss = Gauss::new(chain::<N>(), 2, STEP).unwrap();
    let mut run = gauss.stepper(0.0, start(), SVector::zeros()).unwrap();
    run.advance(10).unwrap();
    check::<N>("Gauss", 10.0, &run.state().fixed(), 1e-3 * second::<N>());
}

fn collocation_by_newton<const N: usize>() {
    let gauss = Gauss::new(chain::<N>(), 2, STEP).unwrap();
    let step = gauss.forward(0.0, &start(), &SVector::zeros(), &mut Solver::default()).unwrap();
    check::<N>("Gauss by Newton's method", 1.0, &step.end, 1e-3 * second::<N>());
}

/// From the value of L alone: with W at the stages, and no declared structure.
fn collocation_of_values<const N: usize>() {
    let gauss = Gauss::new(WithoutClosedDerivatives(chain::<N>()), 2, STEP).unwrap();
    let mut run = gauss.stepper(0.0, start(), SVector::zeros()).unwrap();
    run.advance(2).unwrap();
    check::<N>("Gauss by values", 2.0, &run.state().fixed(), 1e-3 * second::<N>());
}

/// Constructs, verifies and takes steps by a rule, a splitting and collocation.
fn all<const N: usize>() -> [fn(); 6] {
    let gauss: [fn(); 3] = [collocation::<N>, collocation_by_newton::<N>, collocation_of_values::<N>];
    [claims::<N>, rule::<N>, splitting::<N>, gauss[0], gauss[1], gauss[2]]
}

fn in_small_thread(run: fn()) {
    let thread = std::thread::Builder::new().stack_size(2 * MEBIBYTE).spawn(run).unwrap();
    assert!(thread.join().is_ok());
}

#[test]
fn a_hundred_and_twenty_eight_coordinates_fit_a_thread() {
    all::<128>().into_iter().for_each(in_small_thread);
}

/// Jets by blocks of directional derivatives agree with those by the Hessian of L.
#[test]
fn derived_jets_of_many_coordinates() {
    const N: usize = 11;
    let chain = Chain::<N>::default();
    let midpoint = Rule::MIDPOINT.of(chain, 0.3).unwrap();
    let x = DiscretePoint {
        q0: SVector::<f64, N>::from_fn(|i, _| (1.7 * i as f64).sin()),
        q1: SVector::from_fn(|i, _| (1.7 * i as f64 + 0.2).sin()),
        z0: 0.4,
    };
    let (jet, second) = (derived_jet(&midpoint, 0.0, &x).unwrap(), derived_second_jet(&midpoint, 0.0, &x).unwrap());
    let closed = midpoint.second_jet(0.0, &x).unwrap();
    // The terms are at most the masses divided by the step, below 10.
    let close = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 100.0 * f64::EPSILON);
    for first in [jet, second.first] {
        let pairs = [(first.d1, closed.first.d1), (first.d2, closed.first.d2)];
        assert!(pairs.iter().all(|(a, b)| close(a.as_slice(), b.as_slice())));
        assert!(close(&[first.value, first.dz], &[closed.first.value, closed.first.dz]));
    }
    for (a, b) in [(second.d11, closed.d11), (second.d12, closed.d12), (second.d22, closed.d22)] {
        assert!(close(a.as_slice(), b.as_slice()), "{a} {b}");
    }
    for (a, b) in [(second.d1z, closed.d1z), (second.d2z, closed.d2z)] {
        assert!(close(a.as_slice(), b.as_slice()));
    }
    assert!(close(&[second.dzz], &[closed.dzz]));
}
