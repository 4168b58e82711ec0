//! Time of the mixed second derivatives `L_qv` of the double pendulum: by the nested dual numbers of this workspace, by
//! the hyper-dual vectors of num-dual, and by hand. The comparison is the reason for the workspace's own dual numbers.

use contact_geom::nalgebra::{Matrix2, SVector, Vector2};
use contact_geom::systems::DoublePendulum;
use contact_geom::{Dual, Lagrangian};
use criterion::{Criterion, criterion_group, criterion_main};
use num_dual::{DualNum, partial_hessian};
use std::hint::black_box;

type Nested = Dual<Dual<f64, Vector2<f64>>, SVector<Dual<f64, Vector2<f64>>, 2>>;

fn by_nested_duals(l: &DoublePendulum, q: Vector2<f64>, v: Vector2<f64>) -> Matrix2<f64> {
    let constant = |re: f64| -> Nested { Dual::constant(Dual::constant(re)) };
    let (mut qs, mut vs) = (q.map(constant), v.map(constant));
    for i in 0..2 {
        qs[i].d[i] = Dual::constant(1.0);
        vs[i].re.d[i] = 1.0;
    }
    let value = l.value(Nested::from(0.0), &qs, &vs, Nested::from(0.0));
    Matrix2::from_fn(|i, j| value.d[i].d[j])
}

/// The same formula with the numbers of num-dual.
fn by_num_dual(l: &DoublePendulum, q: Vector2<f64>, v: Vector2<f64>) -> Matrix2<f64> {
    let ([m1, m2], [l1, l2]) = (l.masses, l.lengths);
    partial_hessian(
        |(q, v): (SVector<num_dual::HyperDualSVec64<2, 2>, 2>, SVector<num_dual::HyperDualSVec64<2, 2>, 2>)| {
            let versine = |x: num_dual::HyperDualSVec64<2, 2>| {
                let s = (x * 0.5).sin();
                s * s * 2.0
            };
            let turning = v[0] * v[0] * (0.5 * (m1 + m2) * l1 * l1) + v[1] * v[1] * (0.5 * m2 * l2 * l2);
            turning + (q[0] - q[1]).cos() * v[0] * v[1] * (m2 * l1 * l2)
                - versine(q[0]) * ((m1 + m2) * l1)
                - versine(q[1]) * (m2 * l2)
        },
        (&q, &v),
    )
    .3
}

fn by_hand(l: &DoublePendulum, q: Vector2<f64>, v: Vector2<f64>) -> Matrix2<f64> {
    let s = l.masses[1] * l.lengths[0] * l.lengths[1] * (q[0] - q[1]).sin();
    Matrix2::new(-v[1] * s, -v[0] * s, v[1] * s, v[0] * s)
}

fn derivatives(c: &mut Criterion) {
    let (l, q, v) = (DoublePendulum::default(), Vector2::new(0.7, -0.4), Vector2::new(0.3, 1.1));
    for other in [by_num_dual(&l, q, v), by_hand(&l, q, v)] {
        assert!((by_nested_duals(&l, q, v) - other).amax() < 1e-14, "the routes differ");
    }
    let mut group = c.benchmark_group("mixed_second_derivatives");
    group.bench_function("by_hand", |b| b.iter(|| by_hand(&l, black_box(q), black_box(v))));
    group.bench_function("nested_duals", |b| b.iter(|| by_nested_duals(&l, black_box(q), black_box(v))));
    group.bench_function("num_dual", |b| b.iter(|| by_num_dual(&l, black_box(q), black_box(v))));
    group.finish();
}

criterion_group!(benches, derivatives);
criterion_main!(benches);
