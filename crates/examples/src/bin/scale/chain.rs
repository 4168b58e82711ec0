//! Fermi-Pasta-Ulam-Tsingou (FPUT) chains: time of explicit steps relative to a hand-written loop and to a copy of
//! memory, and of implicit steps relative to one factorisation by faer.

use crate::memory::peak;
use crate::seconds::{best, done, together};
use contact_examples::Failure;
use contact_examples::Report;
use discrete_herglotz::SplittingScheme;
use faer::prelude::Solve;
use faer::sparse::linalg::solvers::{Llt, SymbolicLlt};
use faer::sparse::{SparseColMat, Triplet};
use faer::{Mat, Side};
use sparse_herglotz::systems::{FputBond, fput_chain};
use sparse_herglotz::{SparseGauss, SparseMidpoint, SparseSplitting, SparseSystem, State};
use std::hint::black_box;

const GAMMA: f64 = -0.01;
const BOND: FputBond = FputBond { alpha: 0.0, beta: 1.0 };

/// Run times of Boost.odeint in seconds on problem P4, without z, at the errors 1e-4, 1e-8 and 1e-12, from the table of
/// peers: measured with another program on a machine of this kind.
const BOOST: [(f64, f64); 3] = [(1e-4, 574e-6), (1e-8, 585e-6), (1e-12, 585e-6)];

pub fn run(report: &mut Report) -> Result<(), Failure> {
    p4(report)?;
    sizes(report)?;
    copy(report, 1_000_000)?;
    factorisation(report, if report.quick { 100_000 } else { 1_000_000 })
}

/// The first normal mode with amplitude one, at rest.
fn start(n: usize) -> (Vec<f64>, Vec<f64>) {
    let of = |i: usize| (std::f64::consts::PI * (i + 1) as f64 / (n + 1) as f64).sin();
    ((0..n).map(of).collect(), vec![0.0; n])
}

fn chain(n: usize) -> Result<SparseSystem, Failure> {
    fput_chain(n, BOND, GAMMA).map_err(Failure::from)
}

/// Problem P4, the FPUT-beta chain with 1000 sites until t = 100: the shortest run time that reaches an error, over
/// several schemes and step sizes.
fn p4(report: &mut Report) -> Result<(), Failure> {
    let n = 1000;
    let system = chain(n)?;
    let (q, v) = start(n);
    // The action is not computed: the potential energies for it would be part of the measured time.
    let from = State { t: 0.0, q: &q, v: &v, z: None };
    let reference = {
        let scheme = SplittingScheme::SOFRONIOU_SPALETTA_10;
        let mut motion = SparseSplitting::new(&system, &scheme, 0.25, from)?;
        let _ = motion.advance(400);
        let end = motion.state();
        [end.q, end.v].concat()
    };
    let norm = reference.iter().map(|x| x * x).sum::<f64>().sqrt();
    let error =
        |y: &mut dyn Iterator<Item = f64>| y.zip(&reference).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt() / norm;
    let rounds = if report.quick { 50 } else { 400 };
    // Error, run time of the library, and run time of the hand-written loop.
    let mut found: Vec<[f64; 3]> = Vec::new();
    let schemes = [SplittingScheme::STRANG, SplittingScheme::BLANES_MOAN_4, SplittingScheme::BLANES_MOAN_6];
    for (scheme, counts) in schemes.iter().zip([[100, 200, 400], [20, 50, 100], [13, 16, 20]]) {
        for steps in counts {
            let h = 100.0 / steps as f64;
            let mut error_here = f64::NAN;
            let mut library = || {
                let Ok(mut motion) = SparseSplitting::new(&system, scheme, h, from) else { return };
                let _ = motion.advance(steps);
                let end = motion.state();
                error_here = error(&mut end.q.iter().chain(end.v).copied());
            };
            library();
            let mut hand = || done(by_hand(scheme, h, steps, &q, &v));
            let mut motion = SparseSplitting::new(&system, scheme, h, from)?;
            let mut steps_only = || {
                let _ = motion.advance(steps);
                black_box(motion.state().z);
            };
            let [library, hand] = together(rounds, [&mut steps_only, &mut hand]);
            if error_here < 0.1 {
                found.push([error_here, library, hand]);
            }
        }
    }
    for (level, boost) in BOOST {
        let cheapest = |k: usize| found.iter().filter(|f| f[0] <= level).map(|f| f[k]).fold(f64::INFINITY, f64::min);
        report.row(&format!("P4 to {level:e}"), n, cheapest(1), None)?;
        report.row(&format!("P4 to {level:e} by a loop"), n, cheapest(2), None)?;
        report.at_most(&format!("P4 to {level:e} over a loop written by hand"), cheapest(1) / cheapest(2), 1.2)?;
        report.at_most(&format!("P4 to {level:e} over Boost.odeint as tabulated"), cheapest(1) / boost, 0.25)?;
    }
    Ok(())
}

/// The same steps by loops that are written for this chain only.
fn by_hand(scheme: &SplittingScheme, h: f64, steps: usize, q0: &[f64], v0: &[f64]) -> Vec<f64> {
    let n = q0.len();
    let (drifts, kicks) = scheme.coefficients();
    let s = drifts.len();
    let mut q = vec![0.0; n + 2];
    q[1..=n].copy_from_slice(q0);
    let mut v = v0.to_vec();
    kick(&q, &mut v, h * kicks[0]);
    for step in 0..steps {
        for i in 0..s {
            let damping = (GAMMA * drifts[i] * h).exp_m1();
            let length = damping / GAMMA;
            for (q, v) in q[1..=n].iter_mut().zip(&mut v) {
                *q = length.mul_add(*v, *q);
                *v = damping.mul_add(*v, *v);
            }
            let joined = if i + 1 == s && step + 1 < steps { kicks[s] + kicks[0] } else { kicks[i + 1] };
            kick(&q, &mut v, h * joined);
        }
    }
    v.extend(&q[1..=n]);
    v
}

fn kick(q: &[f64], v: &mut [f64], h: f64) {
    for (q, v) in q.windows(3).zip(v) {
        let (left, right) = (q[1] - q[0], q[2] - q[1]);
        let force = (right * right).mul_add(right, right) - (left * left).mul_add(left, left);
        *v = h.mul_add(force, *v);
    }
}

/// Time per step and peak memory against the number of sites.
fn sizes(report: &mut Report) -> Result<(), Failure> {
    let sizes: &[usize] = if report.quick { &[1000, 10_000, 100_000] } else { &[1000, 10_000, 100_000, 1_000_000] };
    for &n in sizes {
        let (q, v) = start(n);
        // The action is not computed: the potential energies for it would be part of the measured time.
        let from = State { t: 0.0, q: &q, v: &v, z: None };
        for scheme in [SplittingScheme::STRANG, SplittingScheme::BLANES_MOAN_4, SplittingScheme::BLANES_MOAN_6] {
            let (seconds, bytes) = peak(|| {
                let system = chain(n)?;
                let mut motion = SparseSplitting::new(&system, &scheme, 0.1, from)?;
                Ok::<f64, Failure>(best(3, || done((motion.advance(10), motion.state().z))) / 10.0)
            });
            report.row(&format!("a step by {}", scheme.name()), n, seconds?, Some(bytes))?;
            if n == sizes[sizes.len() - 1] && scheme == SplittingScheme::STRANG {
                // The initial vectors belong to the caller and are not counted.
                let vectors = bytes as f64 / (8 * n) as f64;
                report.at_most("vectors of n held by an explicit chain and its motion", vectors, 6.0)?;
            }
        }
        let (seconds, bytes) = peak(|| {
            let system = chain(n)?;
            let mut motion = SparseMidpoint::new(&system, 0.1, from, None)?;
            Ok::<f64, Failure>(best(3, || done(motion.advance(3))) / 3.0)
        });
        report.row("a step by the midpoint rule", n, seconds?, Some(bytes))?;
        let (seconds, bytes) = peak(|| {
            let system = chain(n)?;
            let mut motion = SparseGauss::new(&system, 2, 0.1, from, None)?;
            Ok::<f64, Failure>(best(3, || done(motion.advance(3))) / 3.0)
        });
        report.row("a step by Gauss collocation, s = 2", n, seconds?, Some(bytes))?;
    }
    Ok(())
}

/// The time of one stage on a long chain, relative to a copy of its positions and velocities.
fn copy(report: &mut Report, n: usize) -> Result<(), Failure> {
    let system = chain(n)?;
    let (q, v) = start(n);
    // The action is not computed: the potential energies for it would be part of the measured time.
    let from = State { t: 0.0, q: &q, v: &v, z: None };
    let mut motion = SparseSplitting::new(&system, &SplittingScheme::STRANG, 0.1, from)?;
    let (mut a, mut b) = (q.clone(), v.clone());
    const STAGES: usize = 20;
    let mut copies = || {
        for _ in 0..STAGES {
            a.copy_from_slice(&q);
            b.copy_from_slice(&v);
            black_box((&mut a, &mut b));
        }
    };
    let mut steps = || done(motion.advance(STAGES));
    let [copies, steps] = together(if report.quick { 5 } else { 15 }, [&mut copies, &mut steps]);
    report.row("a stage", n, steps / STAGES as f64, None)?;
    report.row("a copy of positions and velocities", n, copies / STAGES as f64, None)?;
    report.at_most("a stage over a copy of positions and velocities", steps / copies, 1.1)?;
    Ok(())
}

/// The time of a step of the midpoint rule, relative to one factorisation and solve of its matrix.
fn factorisation(report: &mut Report, n: usize) -> Result<(), Failure> {
    let system = chain(n)?;
    let (q, v) = start(n);
    let h = 0.1;
    // The action is not computed: the potential energies for it would be part of the measured time.
    let from = State { t: 0.0, q: &q, v: &v, z: None };
    let mut motion = SparseMidpoint::new(&system, h, from, None)?;
    // M + (h^2/4) V_qq at the initial state.
    let place = |i: usize| if i == 0 || i > n { 0.0 } else { q[i - 1] };
    let slope = |i: usize| 0.25 * h * h * (1.0 + 3.0 * BOND.beta * (place(i + 1) - place(i)).powi(2));
    let mut entries = Vec::with_capacity(2 * n);
    for i in 0..n {
        entries.push(Triplet::new(i as u32, i as u32, 1.0 + slope(i) + slope(i + 1)));
        if i + 1 < n {
            entries.push(Triplet::new(i as u32 + 1, i as u32, -slope(i + 1)));
        }
    }
    let failed = |e: &dyn std::fmt::Debug| Failure::motion(format_args!("faer: {e:?}"));
    let matrix = SparseColMat::<u32, f64>::try_new_from_triplets(n, n, &entries).map_err(|e| failed(&e))?;
    let symbolic = SymbolicLlt::try_new(matrix.symbolic(), Side::Lower).map_err(|e| failed(&e))?;
    let mut x = Mat::<f64>::from_fn(n, 1, |i, _| q[i]);
    let mut factorise = || {
        if let Ok(llt) = Llt::try_new_with_symbolic(symbolic.clone(), matrix.as_ref(), Side::Lower) {
            llt.solve_in_place(x.as_mut());
        }
        black_box(&mut x);
    };
    const STEPS: usize = 4;
    let mut steps = || done(motion.advance(STEPS));
    let [factorise, steps] = together(if report.quick { 3 } else { 5 }, [&mut factorise, &mut steps]);
    report.row("faer's factorise and solve of the midpoint's matrix", n, factorise, None)?;
    report.at_most("a midpoint step over faer's factorise and solve", steps / STEPS as f64 / factorise, 3.0)?;
    let work = format!("{} factorisations, {} iterations", motion.factorisations(), motion.iterations());
    contact_examples::print(&format!("            {work}\n"))
}
