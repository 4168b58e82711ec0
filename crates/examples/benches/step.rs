//! Time of steps of the paper's midpoint rule by automatic differentiation, compared with a hand-written Newton loop
//! with the same arithmetic and stopping criterion. A sample has a thousand steps.

use contact_examples::systems::{DoublePendulum, Pendulum};
use contact_geom::PhasePoint;
use contact_geom::nalgebra::{Matrix2, Vector2};
use criterion::{Criterion, criterion_group, criterion_main};
use discrete_herglotz::{
    DiscreteLagrangian, Stepper,
    rules::{Flow, Rule},
};
use std::hint::black_box;

const H: f64 = 0.1;
const STEPS: usize = 1000;

/// A run of the library that keeps only the final state.
fn by_library<const N: usize>(ld: &impl DiscreteLagrangian<N>, start: PhasePoint<N>) -> Option<PhasePoint<N>> {
    let mut flow = Flow::new(ld, 0.0, start).ok()?;
    flow.advance(STEPS).ok()?;
    Some(*flow.state())
}

/// The stopping criterion of the library for a rule explicit in z.
fn done(change: f64, before: f64, u: f64, residual: f64, terms: f64) -> bool {
    let next = change * (change / before) * (change / before);
    (before.is_finite() && next <= f64::EPSILON * u) || residual <= 8.0 * f64::EPSILON * terms
}

/// The hand-written loop for the pendulum.
fn pendulum_by_hand(gamma: f64, start: PhasePoint<1>) -> PhasePoint<1> {
    let (mut q, mut p, mut z) = (start.q[0], start.p[0], start.z);
    let (mut latest, mut before) = (p, p);
    let sigma = 1.0 + H * gamma;
    for _ in 0..STEPS {
        let (mut u, mut last) = (2.0 * latest - before, f64::INFINITY);
        loop {
            let (sin, cos) = (q + 0.5 * H * u).sin_cos();
            let residual = sigma * p - u - 0.5 * H * sin;
            let change = residual / (1.0 + 0.25 * H * H * cos);
            u += change;
            if done(change.abs(), last, u.abs(), residual.abs(), p.abs() + u.abs()) {
                break;
            }
            last = change.abs();
        }
        let (sin, cos) = (q + 0.5 * H * u).sin_cos();
        z += H * (0.5 * u * u + cos - 1.0 + gamma * z);
        p = u - 0.5 * H * sin;
        q += H * u;
        (before, latest) = (latest, u);
    }
    PhasePoint::new([q], [p], z)
}

/// The hand-written loop for the double pendulum.
fn double_pendulum_by_hand(l: &DoublePendulum, start: PhasePoint<2>) -> PhasePoint<2> {
    let ([m1, m2], [l1, l2]) = (l.masses, l.lengths);
    let (a, b, c) = ((m1 + m2) * l1 * l1, m2 * l2 * l2, m2 * l1 * l2);
    let (g1, g2) = ((m1 + m2) * l1, m2 * l2);
    let (half, quarter) = (0.5 * H, 0.25 * H * H);
    let sigma = 1.0 + H * l.gamma;
    let PhasePoint { mut q, mut p, mut z } = start;
    let (mut latest, mut before) = (p, p);
    for _ in 0..STEPS {
        let (mut u, mut last) = (latest * 2.0 - before, f64::INFINITY);
        loop {
            let m = q + u * half;
            let ((s1, c1), (s2, c2), (s, o)) = (m[0].sin_cos(), m[1].sin_cos(), (m[0] - m[1]).sin_cos());
            let (cs, co, uu) = (c * s, c * o, u[0] * u[1]);
            let l_q = Vector2::new(-uu * cs - g1 * s1, uu * cs - g2 * s2);
            let l_v = Vector2::new(a * u[0] + co * u[1], b * u[1] + co * u[0]);
            let residual = p * sigma - l_v + l_q * half;
            // L_qq/4 h^2 - W, and the skew part of L_qv.
            let (q11, q12, q22) = (-uu * co - g1 * c1, uu * co, -uu * co - g2 * c2);
            let skew = half * (-u[0] * cs - u[1] * cs);
            let jacobian = Matrix2::new(
                quarter * q11 - a,
                quarter * q12 + skew - co,
                quarter * q12 - skew - co,
                quarter * q22 - b,
            );
            let determinant = jacobian[(0, 0)] * jacobian[(1, 1)] - jacobian[(0, 1)] * jacobian[(1, 0)];
            let change = Vector2::new(
                jacobian[(0, 1)] * residual[1] - jacobian[(1, 1)] * residual[0],
                jacobian[(1, 0)] * residual[0] - jacobian[(0, 0)] * residual[1],
            ) / determinant;
            u += change;
            let terms = p.amax() + jacobian.amax() * u.amax();
            if done(change.amax(), last, u.amax(), residual.amax(), terms) {
                break;
            }
            last = change.amax();
        }
        let m = q + u * half;
        let ((s1, c1), (s2, c2), (s, o)) = (m[0].sin_cos(), m[1].sin_cos(), (m[0] - m[1]).sin_cos());
        let uu = u[0] * u[1];
        let kinetic = 0.5 * a * u[0] * u[0] + 0.5 * b * u[1] * u[1] + c * uu * o;
        z += H * (kinetic - g1 * (1.0 - c1) - g2 * (1.0 - c2) + l.gamma * z);
        p = Vector2::new(
            a * u[0] + c * o * u[1] + half * (-uu * c * s - g1 * s1),
            b * u[1] + c * o * u[0] + half * (uu * c * s - g2 * s2),
        );
        q += u * H;
        (before, latest) = (latest, u);
    }
    PhasePoint { q, p, z }
}

/// Measures both loops, after a check that they compute the same.
fn pair<const N: usize>(
    c: &mut Criterion,
    name: &str,
    ld: &impl DiscreteLagrangian<N>,
    by_hand: impl Fn(PhasePoint<N>) -> PhasePoint<N>,
    start: PhasePoint<N>,
) {
    let (library, hand) = (by_library(ld, start), by_hand(start));
    let agree = library.is_some_and(|l| (l.q - hand.q).amax().max((l.p - hand.p).amax()) < 1e-11);
    assert!(agree, "{name}: the two loops differ: {library:?}, {hand:?}");
    let mut group = c.benchmark_group(name);
    group.bench_function("by_hand", |b| b.iter(|| by_hand(black_box(start))));
    group.bench_function("library", |b| b.iter(|| by_library(ld, black_box(start))));
    group.finish();
}

fn steps(c: &mut Criterion) {
    let pendulum = Pendulum::default();
    if let Ok(ld) = Rule::LEFT_MIDPOINT.of(&pendulum, H) {
        let start = PhasePoint::new([1.0], [1.0], 0.0);
        pair(c, "pendulum", &ld, |start| pendulum_by_hand(black_box(pendulum.gamma), start), start);
    }
    let double = DoublePendulum::default();
    if let Ok(ld) = Rule::LEFT_MIDPOINT.of(&double, H) {
        let start = PhasePoint::new([1.0, 0.5], [0.3, -0.2], 0.0);
        pair(c, "double_pendulum", &ld, |start| double_pendulum_by_hand(black_box(&double), start), start);
    }
}

criterion_group!(benches, steps);
criterion_main!(benches);
