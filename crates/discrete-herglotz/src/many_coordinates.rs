//! Systems of many coordinates, in the two mebibytes of stack that a thread of the standard library has.

use crate::{DiscreteLagrangian, Gauss, Midpoint, Solver, Splitting, SplittingScheme, Stepper, verified};
use contact_geom::nalgebra::SVector;
use contact_geom::systems::{Chain, Ends, System};
use contact_geom::{Lagrangian, PhasePoint, legendre};

const MEBIBYTE: usize = 1 << 20;

/// What a step gives for the longest wave of a chain: its amplitude and speed, and how far the sites are from a wave.
fn wave<const N: usize>(state: &PhasePoint<N>) -> ([f64; 2], f64) {
    let shape = Chain::<N>::default().initial().q;
    let [q, p] = [state.q, state.p].map(|x| x.dot(&shape) / shape.norm_squared());
    let off = contact_geom::largest((state.q - shape * q).iter().chain(&(state.p - shape * p)).copied());
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

/// Builds, verifies and takes steps by a rule, a splitting and collocation.
fn try_all<const N: usize>() {
    // The drag is below the critical one, which falls with N.
    let chain = Chain::<N> { ends: Ends::Fixed, beta: 0.0, gamma: -0.01 };
    let start = chain.initial();
    assert_eq!(verified(&chain, 0.0, &start), Ok(chain.structure()));
    let (h, from) = (0.5, legendre(&chain, 0.0, &start));
    let check = |what: &str, steps: f64, state: &PhasePoint<N>, tolerance: f64| {
        let ([q, p], off) = wave(state);
        let [q_exact, p_exact] = exact::<N>(chain.gamma, steps * h);
        let error = contact_geom::largest([q - q_exact, p - p_exact]);
        assert!(error <= tolerance && off <= 1e-13, "{what}, N = {N}: {error:e}, {off:e} off the wave");
    };
    // Of order two: h^2 times the time's third power of the frequency, below pi/N.
    let second = 0.1 * (h * std::f64::consts::PI / N as f64).powi(2);
    let midpoint = Midpoint::new(&chain, h).unwrap();
    let step = midpoint.forward(0.0, &from, &SVector::zeros(), &mut Solver::default()).unwrap();
    check("midpoint", 1.0, &step.end, second);
    let mut strang = Splitting::new(&chain, &SplittingScheme::STRANG, h, 0.0, from).unwrap();
    strang.advance(10).unwrap();
    check("Strang", 10.0, &strang.state(), 10.0 * second);
    let gauss = Gauss::new(chain, 2, h).unwrap();
    let mut run = gauss.stepper(0.0, from, SVector::zeros()).unwrap();
    run.advance(10).unwrap();
    check("Gauss", 10.0, &run.state(), 1e-3 * second);
    let step = gauss.forward(0.0, &from, &SVector::zeros(), &mut Solver::default()).unwrap();
    check("Gauss by Newton's method", 1.0, &step.end, 1e-3 * second);
}

fn in_small_thread(run: fn()) {
    let thread = std::thread::Builder::new().stack_size(2 * MEBIBYTE).spawn(run).unwrap();
    assert!(thread.join().is_ok());
}

#[test]
fn forty_coordinates_fit_a_thread() {
    in_small_thread(try_all::<40>);
}

#[test]
fn a_hundred_and_twenty_eight_coordinates_fit_a_thread() {
    in_small_thread(try_all::<128>);
}
