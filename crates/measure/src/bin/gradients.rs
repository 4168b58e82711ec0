//! Run time of the value and the full gradient of a loss of the end of a run, beside the run itself:
//! `cargo run --release --features timings --bin gradients`.
//!
//! P2, P3 and P6 are the problems of `docs/performance.md`; the others are the double pendulum, and a sun with one planet.
//! The gradient is that in the start, all parameters and both times. The least time of some repetitions counts; it
//! includes the checks of the input, some 0.1 ms.

use contact_geom::systems::{Bodies, DoublePendulum, Kepler, Pendulum, QuadraticInZ, System};
use contact_geom::{Parametric, Scalar, VelocityPoint};
use discrete_herglotz::sensitivity::{EndState, Loss, SensitivityError};
use discrete_herglotz::{GaussCollocation, Problem, Steps, Until};
use std::hint::black_box;
use std::time::Instant;

/// The time over which runs are repeated, in seconds.
const SAMPLE_SECONDS: f64 = 0.5;

/// The smallest number of repetitions.
const REPETITIONS: usize = 7;

/// A function of position, velocity and action.
struct Quadratic;

impl<const N: usize> Loss<N> for Quadratic {
    fn value<T: Scalar>(&self, end: &EndState<N, T>) -> T {
        end.q.dot(&end.q) + end.v.dot(&end.q) + end.z * 0.3
    }
}

/// The least time of repetitions of an action, in seconds.
fn least(mut action: impl FnMut() -> Result<(), SensitivityError>) -> Result<f64, SensitivityError> {
    let (mut least, mut count, start) = (f64::INFINITY, 0, Instant::now());
    while count < REPETITIONS || start.elapsed().as_secs_f64() < SAMPLE_SECONDS {
        let start = Instant::now();
        action()?;
        least = least.min(start.elapsed().as_secs_f64());
        count += 1;
    }
    Ok(least)
}

fn line<const N: usize>(
    name: &str,
    lagrangian: &impl Parametric<N>,
    start: VelocityPoint<N>,
    (stages, h, t): (usize, f64, f64),
) -> Result<(), SensitivityError> {
    let problem = Problem::new(lagrangian, 0.0, start)?;
    let run = || problem.by(GaussCollocation { stages }).steps(Steps::Size(h));
    let steps = run().run(Until::Time(t))?.steps;
    let alone = least(|| {
        black_box(run().run(Until::Time(t))?);
        Ok(())
    })?;
    let with_gradient = least(|| {
        black_box(run().gradient(&Quadratic, Until::Time(t))?);
        Ok(())
    })?;
    println!(
        "| {name} | {stages} | {steps} | {:.1} | {:.1} | {:.2} |",
        alone * 1e6,
        with_gradient * 1e6,
        with_gradient / alone
    );
    Ok(())
}

fn main() -> Result<(), SensitivityError> {
    println!("| problem | stages | steps | run, us | with gradient, us | ratio |");
    println!("|---|---|---|---|---|---|");
    for (stages, step) in [(8, 1.0), (16, 4.0)] {
        let pendulum = VelocityPoint::new([1.0], [1.0], 0.0);
        line("P2", &Pendulum { gamma: -0.01 }, pendulum, (stages, 0.5 * step, 1000.0))?;
        let kepler = Kepler::<2> { mu: 1.0, gamma: -1e-4 };
        line("P3", &kepler, kepler.initial(), (stages, 0.0625 * step, 2000.0))?;
        let oscillator = VelocityPoint::new([1.0], [0.0], 1.0);
        line("P6", &QuadraticInZ { c: 0.1 }, oscillator, (stages, 0.25 * step, 1000.0))?;
        let double = DoublePendulum::default();
        line("double pendulum", &double, double.initial(), (stages, 0.0625 * step, 100.0))?;
        let pair = Bodies::<6>::new(|i| [1.0, 1e-3][i], 1.0, -1e-4);
        let start = VelocityPoint::new([0.0, 0.0, 0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0, 1.0, 0.1], 0.0);
        line("sun and planet", &pair, start, (stages, 0.25 * step, 1000.0))?;
    }
    Ok(())
}
