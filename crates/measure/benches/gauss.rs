//! Time of steps of contact Gauss collocation: for Lagrangians of the catalogue with gradients in closed form, for the
//! same with automatic differentiation, for a Lagrangian as a user would define it, and for a hand-written loop.

use contact_geom::nalgebra::SVector;
use contact_geom::systems::{DoublePendulum, Kepler, Pendulum, QuadraticInZ, System};
use contact_geom::{Lagrangian, Scalar, VelocityPoint, WithoutClosedDerivatives};
use criterion::{Criterion, criterion_group, criterion_main};
use discrete_herglotz::{Problem, Stepper, StepperOptions, gauss::GaussStepper};
use std::hint::black_box;

/// The number of steps in a sample: few, so that the motion stays near its start.
const STEPS: usize = 100;

/// The pendulum as a user would define it in the documentation: only by its value.
struct Users {
    gamma: f64,
}

impl Lagrangian<1> for Users {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        v[0] * v[0] * 0.5 + q[0].cos() + z * self.gamma
    }
}

/// Measures a hundred steps from a start.
fn measure<L: Lagrangian<N>, const N: usize>(
    c: &mut Criterion,
    (group, name): (&str, &str),
    lagrangian: &L,
    start: &VelocityPoint<N>,
    (stages, h): (usize, f64),
) {
    let Ok(problem) = Problem::new(lagrangian, 0.0, *start) else { return };
    let options = StepperOptions { action: true, ..StepperOptions::default() };
    let mut group = c.benchmark_group(format!("{group}_gauss_{stages}"));
    group.bench_function(name, |b| {
        b.iter_batched_ref(
            || GaussStepper::new(&problem, stages, h, options).ok(),
            |stepper| black_box(stepper.as_mut().map(|s| s.advance(STEPS))),
            criterion::BatchSize::SmallInput,
        );
    });
    group.finish();
}

/// The pendulum by the Gauss method with four stages, as one would write it: fixed-point iteration to round-off for the
/// accelerations, started from those of the last step, with z; coefficients with 16 digits.
fn by_hand(gamma: f64, start: [f64; 3], h: f64) -> [f64; 3] {
    const A: [[f64; 4]; 4] = [
        [0.08696371128436346, -0.026604180084998793, 0.012627462689404725, -0.0035551496857956832],
        [0.18811811749986807, 0.16303628871563654, -0.027880428602470894, 0.006_735_500_594_538_155],
        [0.16719192197418877, 0.35395300603374397, 0.16303628871563654, -0.014190694931141143],
        [0.177_482_572_254_522_62, 0.31344511474186835, 0.35267675751627186, 0.08696371128436346],
    ];
    const B: [f64; 4] = [0.17392742256872693, 0.32607257743127307, 0.32607257743127307, 0.17392742256872693];
    let [mut q, mut v, mut z] = start;
    let mut a = [-q.sin() + gamma * v; 4];
    for _ in 0..STEPS {
        let (mut vs, mut zs) = ([v; 4], [z; 4]);
        for _ in 0..60 {
            let mut change = 0.0f64;
            for i in 0..4 {
                vs[i] = v + h * (0..4).map(|j| A[i][j] * a[j]).sum::<f64>();
            }
            for i in 0..4 {
                let x = q + h * (0..4).map(|j| A[i][j] * vs[j]).sum::<f64>();
                let next = -x.sin() + gamma * vs[i];
                change = change.max((next - a[i]).abs());
                a[i] = next;
            }
            if change <= 1e-16 {
                break;
            }
        }
        let l = |i: usize, z: f64, vs: &[f64; 4]| {
            let x = q + h * (0..4).map(|j| A[i][j] * vs[j]).sum::<f64>();
            0.5 * vs[i] * vs[i] - 1.0 + x.cos() + gamma * z
        };
        for _ in 0..8 {
            let ls: [f64; 4] = std::array::from_fn(|i| l(i, zs[i], &vs));
            zs = std::array::from_fn(|i| z + h * (0..4).map(|j| A[i][j] * ls[j]).sum::<f64>());
        }
        z += h * (0..4).map(|j| B[j] * l(j, zs[j], &vs)).sum::<f64>();
        q += h * (0..4).map(|j| B[j] * vs[j]).sum::<f64>();
        v += h * (0..4).map(|j| B[j] * a[j]).sum::<f64>();
    }
    [q, v, z]
}

fn steps(c: &mut Criterion) {
    let swing = VelocityPoint::new([1.0], [1.0], 0.0);
    let pendulum = Pendulum { gamma: -0.01 };
    for stages in [4, 8, 16] {
        let size = (stages, [0.25, 1.0, 2.5][stages / 8]);
        measure(c, ("pendulum", "derived"), &WithoutClosedDerivatives(pendulum), &swing, size);
        measure(c, ("pendulum", "written"), &pendulum, &swing, size);
        measure(c, ("pendulum", "users"), &Users { gamma: -0.01 }, &swing, size);
    }
    let mut group = c.benchmark_group("pendulum_gauss_4");
    group.bench_function("by_hand", |b| b.iter(|| by_hand(black_box(-0.01), [1.0, 1.0, 0.0], 0.25)));
    group.finish();
    let kepler = Kepler::<2> { mu: 1.0, gamma: -1e-4 };
    let square = QuadraticInZ { c: 0.1 };
    let circle = VelocityPoint::new([1.0], [0.0], 1.0);
    for (stages, h) in [(8, 0.2), (16, 0.5)] {
        measure(c, ("kepler", "derived"), &WithoutClosedDerivatives(kepler), &kepler.initial(), (stages, h));
        measure(c, ("kepler", "written"), &kepler, &kepler.initial(), (stages, h));
        measure(c, ("quadratic", "derived"), &WithoutClosedDerivatives(square), &circle, (stages, 4.0 * h));
        measure(c, ("quadratic", "written"), &square, &circle, (stages, 4.0 * h));
    }
    let double = DoublePendulum::default();
    measure(c, ("double_pendulum", "derived"), &double, &double.initial(), (8, 0.2));
}

criterion_group!(benches, steps);
criterion_main!(benches);
