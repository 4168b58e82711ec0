//! Time of the linear solve in a Newton step, by elimination on the stack and by faer's LU, to find the size from which
//! faer is faster.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use discrete_herglotz::contact_geom::nalgebra::{SMatrix, SVector};
use discrete_herglotz::solve::Solver;
use std::hint::black_box;

/// Measures both solvers for one size, with a matrix for which the choice of pivots is not critical.
fn size<const N: usize>(c: &mut Criterion) {
    let a = SMatrix::<f64, N, N>::from_fn(|i, j| f64::from(u8::from(i == j)) * 2.0 + ((i * 7 + j * 3) as f64).sin());
    let b = SVector::<f64, N>::from_fn(|i, _| (i as f64).cos());
    let mut group = c.benchmark_group("solve");
    for (name, mut solver) in [("stack", Solver::<N>::on_the_stack()), ("faer", Solver::<N>::by_faer())] {
        group.bench_function(BenchmarkId::new(name, N), |bench| {
            bench.iter(|| {
                let (mut m, mut x) = (black_box(a), b);
                (solver.solve(&mut m, &mut x), x)
            });
        });
    }
    group.finish();
}

fn sizes(c: &mut Criterion) {
    size::<1>(c);
    size::<2>(c);
    size::<4>(c);
    size::<8>(c);
    size::<16>(c);
    size::<24>(c);
    size::<32>(c);
    size::<40>(c);
    size::<48>(c);
    size::<64>(c);
}

criterion_group!(benches, sizes);
criterion_main!(benches);
