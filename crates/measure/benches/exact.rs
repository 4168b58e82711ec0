//! Time of `L_h^e` with its first derivatives at a point, compared with dop853 of another library over `[0, h]`, on the
//! same vector field in `(q, v, z)` by automatic differentiation and with a tolerance of 1e-13. It also measures how
//! much time the formulas for the derivatives save over differentiation of the whole computation.

use contact_geom::systems::{DoublePendulum, Kepler, Pendulum, System};
use contact_geom::{ChartVector, DiscretePoint, VelocityPoint, herglotz_field};
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use differential_equations::prelude::{ExplicitRungeKutta, IVP, ODE};
use discrete_herglotz::{DiscreteLagrangian, theory::derived_jet};
use exact_lagrangian::{ContactExponential, ExactLagrangian, herglotz_flow};
use std::hint::black_box;

/// Herglotz' equations as a first-order system; `M = 2N + 1`.
struct FirstOrder<'a, S, const N: usize, const M: usize>(&'a S);

impl<S: System<N>, const N: usize, const M: usize> ODE<f64, [f64; M]> for FirstOrder<'_, S, N, M> {
    fn diff(&self, t: f64, y: &[f64; M], d: &mut [f64; M]) {
        let x = ChartVector::<N>::from_fn(|i| y[i]);
        match herglotz_field(self.0, t, &x.into()) {
            Ok(f) => (0..M).for_each(|i| d[i] = f.component(i)),
            Err(_) => d.fill(f64::NAN),
        }
    }
}

/// The final state by dop853.
fn by_dop853<S: System<N>, const N: usize, const M: usize>(
    system: &S,
    x: &VelocityPoint<N>,
    h: f64,
) -> Option<[f64; M]> {
    let (method, x) = (ExplicitRungeKutta::dop853().rtol(1e-13).atol(1e-13), ChartVector::from(*x));
    let ode = FirstOrder::<S, N, M>(system);
    let start = std::array::from_fn(|i| x.component(i));
    let solution = IVP::ode(&ode, 0.0, h, start).method(method).solve().ok()?;
    solution.y.last().copied()
}

fn compare<S: System<N>, const N: usize, const M: usize>(c: &mut Criterion, system: &S) {
    let x = system.initial();
    for h in [0.01, 0.1, 0.5] {
        let exact = ExactLagrangian::<_, N>::new(system, h);
        let point = ContactExponential::new(system, h).ok().and_then(|e| e.at(0.0, &x).ok());
        let (Ok(exact), Some(point)) = (exact, point) else { continue };
        agree::<S, N, M>(system, &exact, &point, h);
        let mut group = c.benchmark_group(system.name());
        group.bench_function(BenchmarkId::new("dop853", h), |b| {
            b.iter(|| by_dop853::<S, N, M>(system, black_box(&x), h))
        });
        group.bench_function(BenchmarkId::new("flow", h), |b| b.iter(|| herglotz_flow(system, 0.0, black_box(&x), h)));
        group.bench_function(BenchmarkId::new("jet", h), |b| b.iter(|| exact.jet(0.0, black_box(&point))));
        group.bench_function(BenchmarkId::new("jet_by_duals", h), |b| {
            b.iter(|| derived_jet(&exact, 0.0, black_box(&point)))
        });
        group
            .bench_function(BenchmarkId::new("second_jet", h), |b| b.iter(|| exact.second_jet(0.0, black_box(&point))));
        group.finish();
    }
}

/// Checks that both integrators reach the same action.
fn agree<S: System<N>, const N: usize, const M: usize>(
    system: &S,
    exact: &ExactLagrangian<&S, N>,
    point: &DiscretePoint<N>,
    h: f64,
) {
    let end = by_dop853::<S, N, M>(system, &system.initial(), h);
    let ours = exact.retract(0.0, point);
    let same = matches!((end, ours), (Some(a), Ok(b)) if (a[M - 1] - b.end.z).abs() < 1e-11);
    assert!(same, "{}: the two integrators differ", system.name());
}

fn exact(c: &mut Criterion) {
    compare::<_, 1, 3>(c, &Pendulum::default());
    compare::<_, 2, 5>(c, &DoublePendulum::default());
    compare::<_, 2, 5>(c, &Kepler::<2>::default());
}

criterion_group!(benches, exact);
criterion_main!(benches);
