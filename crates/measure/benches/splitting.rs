//! Time of splitting schemes of the library, compared with loops written by hand for each problem: the same composition
//! and arithmetic, with the number of stages known to the compiler, kicks fused across steps, and no checks. A sample
//! has ten thousand steps.
//!
//! The library takes the force from the closed gradient of a Lagrangian, or derives it by automatic differentiation.
//! Both are measured, and compensated sums too.

use contact_geom::nalgebra::SVector;
use contact_geom::systems::{HarmonicOscillator, Kepler, Pendulum};
use contact_geom::{Lagrangian, PhasePoint, WithoutClosedDerivatives};
use criterion::{Criterion, criterion_group, criterion_main};
use discrete_herglotz::{SplittingScheme, Stepper, splitting::Splitting};
use std::hint::black_box;

const STEPS: usize = 10_000;

/// A potential and its force in closed form.
trait Problem<const D: usize> {
    fn force(q: [f64; D]) -> [f64; D];
    fn potential(q: [f64; D]) -> f64;
}

impl Problem<1> for HarmonicOscillator {
    #[inline(always)]
    fn force(q: [f64; 1]) -> [f64; 1] {
        [-q[0]]
    }
    #[inline(always)]
    fn potential(q: [f64; 1]) -> f64 {
        0.5 * q[0] * q[0]
    }
}

impl Problem<1> for Pendulum {
    #[inline(always)]
    fn force(q: [f64; 1]) -> [f64; 1] {
        [-q[0].sin()]
    }
    #[inline(always)]
    fn potential(q: [f64; 1]) -> f64 {
        1.0 - q[0].cos()
    }
}

impl Problem<2> for Kepler<2> {
    #[inline(always)]
    fn force([x, y]: [f64; 2]) -> [f64; 2] {
        let inverse = (x * x + y * y).sqrt().recip();
        let cube = inverse * inverse * inverse;
        [-x * cube, -y * cube]
    }
    #[inline(always)]
    fn potential([x, y]: [f64; 2]) -> f64 {
        -1.0 / (x * x + y * y).sqrt()
    }
}

/// The loop that one would write for one problem and one scheme of `S` stages that begins with a kick.
#[inline(never)]
fn by_hand<P: Problem<D>, const D: usize, const S: usize, const ACTION: bool>(
    scheme: &SplittingScheme,
    gamma: f64,
    h: f64,
    start: PhasePoint<D>,
) -> PhasePoint<D> {
    let (drifts, kicks) = scheme.coefficients();
    let (mut damping, mut length, mut lift, mut kick) = ([0.0; S], [0.0; S], [0.0; S], [0.0; S]);
    for i in 0..S {
        damping[i] = (gamma * h * drifts[i]).exp_m1();
        length[i] = damping[i] / gamma;
        lift[i] = 0.5 * (1.0 + damping[i]) * length[i];
        kick[i] = h * kicks[i + 1];
    }
    let half = h * kicks[0];
    kick[S - 1] += half;
    let (mut q, mut p, mut z) = (start.q.data.0[0], start.p.data.0[0], start.z);
    let force = P::force(q);
    for k in 0..D {
        p[k] += half * force[k];
    }
    if ACTION {
        z -= half * P::potential(q);
    }
    for _ in 0..STEPS {
        for i in 0..S {
            if ACTION {
                let mut square = 0.0;
                for p in p {
                    square += p * p;
                }
                z += damping[i] * z + lift[i] * square;
            }
            for k in 0..D {
                q[k] += length[i] * p[k];
                p[k] += damping[i] * p[k];
            }
            let force = P::force(q);
            for k in 0..D {
                p[k] += kick[i] * force[k];
            }
            if ACTION {
                z -= kick[i] * P::potential(q);
            }
        }
    }
    let force = P::force(q);
    for k in 0..D {
        p[k] -= half * force[k];
    }
    if ACTION {
        z += half * P::potential(q);
    }
    PhasePoint { q: SVector::from(q), p: SVector::from(p), z }
}

/// A run of the library.
fn by_library<L: Lagrangian<D>, const D: usize, const ACTION: bool, const COMPENSATED: bool>(
    lagrangian: &L,
    scheme: &SplittingScheme,
    h: f64,
    start: PhasePoint<D>,
) -> Option<PhasePoint<D>> {
    let mut motion = Splitting::new(lagrangian, scheme, h, 0.0, start).ok()?;
    if !ACTION {
        motion = motion.without_action();
    }
    if COMPENSATED {
        motion = motion.compensated();
    }
    motion.advance(STEPS).ok()?;
    Some(motion.state())
}

/// Measures both loops, after a check that they compute the same.
fn pair<L: Lagrangian<D> + Problem<D>, const D: usize, const S: usize, const ACTION: bool>(
    c: &mut Criterion,
    name: &str,
    (lagrangian, gamma): (&L, f64),
    scheme: &SplittingScheme,
    start: PhasePoint<D>,
) {
    let h = 0.002 * S as f64;
    let derived = WithoutClosedDerivatives(lagrangian);
    let hand = by_hand::<L, D, S, ACTION>(scheme, gamma, h, start);
    let name = format!("{name}/{}{}", scheme.name(), if ACTION { "/z" } else { "" });
    for library in [
        by_library::<_, D, ACTION, false>(lagrangian, scheme, h, start),
        by_library::<_, D, ACTION, false>(&derived, scheme, h, start),
    ] {
        let agree =
            library.is_some_and(|l| (l.q - hand.q).amax().max((l.p - hand.p).amax()).max((l.z - hand.z).abs()) < 1e-8);
        assert!(agree, "{name}: the two loops differ: {library:?}, {hand:?}");
    }
    let mut group = c.benchmark_group(name);
    group.throughput(criterion::Throughput::Elements(STEPS as u64));
    group.bench_function("by_hand", |b| {
        b.iter(|| by_hand::<L, D, S, ACTION>(black_box(scheme), black_box(gamma), h, black_box(start)));
    });
    group.bench_function("library", |b| {
        b.iter(|| by_library::<_, D, ACTION, false>(black_box(lagrangian), scheme, h, black_box(start)));
    });
    group.bench_function("library_compensated", |b| {
        b.iter(|| by_library::<_, D, ACTION, true>(black_box(lagrangian), scheme, h, black_box(start)));
    });
    group.bench_function("library_derived", |b| {
        b.iter(|| by_library::<_, D, ACTION, false>(black_box(&derived), scheme, h, black_box(start)));
    });
    group.finish();
}

/// Measures one problem with three schemes, with and without the action.
fn problem<L: Lagrangian<D> + Problem<D>, const D: usize>(
    c: &mut Criterion,
    name: &str,
    lagrangian: (&L, f64),
    start: PhasePoint<D>,
) {
    pair::<L, D, 1, false>(c, name, lagrangian, &SplittingScheme::STRANG, start);
    pair::<L, D, 1, true>(c, name, lagrangian, &SplittingScheme::STRANG, start);
    pair::<L, D, 11, false>(c, name, lagrangian, &SplittingScheme::BLANES_MOAN_6, start);
    pair::<L, D, 11, true>(c, name, lagrangian, &SplittingScheme::BLANES_MOAN_6, start);
    pair::<L, D, 17, false>(c, name, lagrangian, &SplittingScheme::KAHAN_LI_8, start);
    pair::<L, D, 17, true>(c, name, lagrangian, &SplittingScheme::KAHAN_LI_8, start);
}

fn splittings(c: &mut Criterion) {
    let gamma = -0.001;
    let start = PhasePoint::new([1.0], [1.0], 0.0);
    problem(c, "oscillator", (&HarmonicOscillator { gamma }, gamma), start);
    problem(c, "pendulum", (&Pendulum { gamma }, gamma), start);
    let apocentre = PhasePoint::new([1.5, 0.0], [0.0, (1.0 / 3.0_f64).sqrt()], 0.0);
    problem(c, "kepler", (&Kepler::<2> { mu: 1.0, gamma }, gamma), apocentre);
}

criterion_group!(benches, splittings);
criterion_main!(benches);
