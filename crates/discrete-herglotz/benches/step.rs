//! One step by automatic differentiation against a hand-written Newton loop of the same arithmetic and stopping rule.

use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::systems::Pendulum;
use contact_geom::{Lagrangian, PhasePoint, Scalar};
use criterion::{Criterion, criterion_group, criterion_main};
use discrete_herglotz::{DiscreteLagrangian, LeftMidpoint, Solver};
use std::hint::black_box;

const H: f64 = 0.1;
const STEPS: usize = 1000;

struct DoublePendulum {
    m1: f64,
    m2: f64,
    l1: f64,
    l2: f64,
    gamma: f64,
}
impl Lagrangian<2> for DoublePendulum {
    #[inline]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, z: T) -> T {
        let (m1, m2, l1, l2) = (self.m1, self.m2, self.l1, self.l2);
        v[0] * v[0] * (0.5 * (m1 + m2) * l1 * l1)
            + v[1] * v[1] * (0.5 * m2 * l2 * l2)
            + v[0] * v[1] * (q[0] - q[1]).cos() * (m2 * l1 * l2)
            + q[0].cos() * ((m1 + m2) * l1)
            + q[1].cos() * (m2 * l2)
            + z * self.gamma
    }
}

/// The run of a discrete Lagrangian with the linearly extrapolated start that the hand-written loops use too.
fn by_library<const N: usize>(ld: &impl DiscreteLagrangian<N>, mut state: PhasePoint<N>) -> (PhasePoint<N>, u32) {
    let mut solver = Solver::default();
    let (mut u, mut last) = (state.p, state.p);
    let mut its = 0;
    for _ in 0..STEPS {
        match ld.forward(0.0, &state, &(u * 2.0 - last), &mut solver) {
            Ok(step) => {
                state = step.end;
                (last, u) = (u, step.velocity);
                its += step.iterations;
            }
            Err(e) => panic!("{e}"),
        }
    }
    (state, its)
}

fn pendulum_by_hand(gamma: f64, mut q: f64, mut p: f64, mut z: f64) -> (f64, f64, f64, u32) {
    let (mut u, mut last) = (p, p);
    let mut its = 0;
    let sigma = 1.0 + H * gamma;
    for _ in 0..STEPS {
        let mut w = 2.0 * u - last;
        let mut last_size = f64::INFINITY;
        for _ in 0..50 {
            its += 1;
            let (sin, cos) = (q + 0.5 * H * w).sin_cos();
            // r = sigma p - v - (h/2) sin.
            let residual = sigma * p - w - 0.5 * H * sin;
            let slope = -1.0 - 0.25 * H * H * cos;
            let change = -residual / slope;
            w += change;
            let size = change.abs();
            let next = size * (size / last_size) * (size / last_size);
            if (last_size.is_finite() && next <= f64::EPSILON * w.abs())
                || residual.abs() <= 8.0 * f64::EPSILON * (p.abs() + w.abs())
            {
                break;
            }
            last_size = size;
        }
        let (sin, cos) = (q + 0.5 * H * w).sin_cos();
        z += H * (0.5 * w * w + cos - 1.0 + gamma * z);
        p = w - 0.5 * H * sin;
        q += H * w;
        (last, u) = (u, w);
    }
    (q, p, z, its)
}

fn double_by_hand(
    l: &DoublePendulum,
    mut q: SVector<f64, 2>,
    mut p: SVector<f64, 2>,
    mut z: f64,
) -> (SVector<f64, 2>, SVector<f64, 2>, f64, u32) {
    let (a, b, c) = ((l.m1 + l.m2) * l.l1 * l.l1, l.m2 * l.l2 * l.l2, l.m2 * l.l1 * l.l2);
    let (g1, g2) = ((l.m1 + l.m2) * l.l1, l.m2 * l.l2);
    let sigma = 1.0 + H * l.gamma;
    let (mut u, mut last) = (p, p);
    let mut its = 0;
    for _ in 0..STEPS {
        let mut w = u * 2.0 - last;
        let mut last_size = f64::INFINITY;
        for _ in 0..50 {
            its += 1;
            let m = q + w * (0.5 * H);
            let (s1, c1) = m[0].sin_cos();
            let (s2, c2) = m[1].sin_cos();
            let (s, co) = (m[0] - m[1]).sin_cos();
            let (cs, cc) = (c * s, c * co);
            let vv = w[0] * w[1];
            let lq = SVector::<f64, 2>::new(-vv * cs - g1 * s1, vv * cs - g2 * s2);
            let lv = SVector::<f64, 2>::new(a * w[0] + cc * w[1], b * w[1] + cc * w[0]);
            let residual = p * sigma - lv + lq * (0.5 * H);
            let (q11, q12, q22) = (-vv * cc - g1 * c1, vv * cc, -vv * cc - g2 * c2);
            // L_{q_i v_j}.
            let (x11, x12, x21, x22) = (-w[1] * cs, -w[0] * cs, w[1] * cs, w[0] * cs);
            let k = 0.25 * H * H;
            let half = 0.5 * H;
            let jac = SMatrix::<f64, 2, 2>::new(
                k * q11 + half * x11 - half * x11 - a,
                k * q12 + half * x12 - half * x21 - cc,
                k * q12 + half * x21 - half * x12 - cc,
                k * q22 + half * x22 - half * x22 - b,
            );
            let det = jac[(0, 0)] * jac[(1, 1)] - jac[(0, 1)] * jac[(1, 0)];
            let change = SVector::<f64, 2>::new(
                -(jac[(1, 1)] * residual[0] - jac[(0, 1)] * residual[1]) / det,
                -(jac[(0, 0)] * residual[1] - jac[(1, 0)] * residual[0]) / det,
            );
            w += change;
            let size = change.amax();
            let next = size * (size / last_size) * (size / last_size);
            if (last_size.is_finite() && next <= f64::EPSILON * w.amax())
                || residual.amax() <= 8.0 * f64::EPSILON * (p.amax() + jac.amax() * w.amax())
            {
                break;
            }
            last_size = size;
        }
        let m = q + w * (0.5 * H);
        let (s1, c1) = m[0].sin_cos();
        let (s2, c2) = m[1].sin_cos();
        let (s, co) = (m[0] - m[1]).sin_cos();
        let vv = w[0] * w[1];
        z += H * (0.5 * a * w[0] * w[0] + 0.5 * b * w[1] * w[1] + c * vv * co + g1 * c1 + g2 * c2 + l.gamma * z);
        p = SVector::<f64, 2>::new(
            a * w[0] + c * co * w[1] + 0.5 * H * (-vv * c * s - g1 * s1),
            b * w[1] + c * co * w[0] + 0.5 * H * (vv * c * s - g2 * s2),
        );
        q += w * H;
        (last, u) = (u, w);
    }
    (q, p, z, its)
}

fn steps(c: &mut Criterion) {
    let pendulum = Pendulum { gamma: -0.1 };
    let Ok(ld) = LeftMidpoint::new(&pendulum, H) else { return };
    let start = PhasePoint::new([1.0], [1.0], 0.0);
    println!("{:?} {:?}", by_library(&ld, start), pendulum_by_hand(-0.1, 1.0, 1.0, 0.0));
    let mut group = c.benchmark_group("pendulum");
    group.bench_function("hand", |b| b.iter(|| pendulum_by_hand(black_box(-0.1), black_box(1.0), 1.0, 0.0)));
    group.bench_function("ad", |b| b.iter(|| by_library(&ld, black_box(start))));
    group.finish();
    let double = DoublePendulum { m1: 1.0, m2: 1.0, l1: 1.0, l2: 1.0, gamma: -0.1 };
    let Ok(ld) = LeftMidpoint::new(&double, H) else { return };
    let start = PhasePoint::new([1.0, 0.5], [0.3, -0.2], 0.0);
    println!("{:?} {:?}", by_library(&ld, start), double_by_hand(&double, start.q, start.p, 0.0));
    let mut group = c.benchmark_group("double_pendulum");
    group.bench_function("hand", |b| b.iter(|| double_by_hand(black_box(&double), start.q, start.p, 0.0)));
    group.bench_function("ad", |b| b.iter(|| by_library(&ld, black_box(start))));
    group.finish();
}

criterion_group!(benches, steps);
criterion_main!(benches);
