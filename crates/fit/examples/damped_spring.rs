//! The fit of a damped spring of diffsol's book: `L = v^2/2 - k x^2/2 - c z`, 101 positions between t = 0 and 40 of the
//! motion with k = 1, c = 0.1 from x = 1 at rest, start k = 0.9, c = 0.09. Prints the fit and its time, warm:
//! the median of 50 fits, and the fastest.
//!
//!     cargo run --release -p herglotz-fit --example damped_spring

use contact_geom::nalgebra::SVector;
use contact_geom::numbers::{Coefficient, ScalarOver};
use contact_geom::{Lagrangian, Parametric, Scalar, VelocityPoint};
use discrete_herglotz::sensitivity::Variable;
use herglotz_fit::{FitError, LeastSquares, MotionModel, Observed};
use std::time::Instant;

struct Spring {
    k: f64,
    c: f64,
}

impl Spring {
    #[inline(always)]
    fn formula<C: Coefficient, T: ScalarOver<C>>([k, c]: [C; 2], x: T, v: T, z: T) -> T {
        v * v * 0.5 - x * x * (k * 0.5) + z * (-c)
    }
}

impl Lagrangian<1> for Spring {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        Self::formula([self.k, self.c], q[0], v[0], z)
    }
}

impl Parametric<1> for Spring {
    fn parameter_names(&self) -> Vec<String> {
        ["k", "c"].map(String::from).into()
    }
    fn parameters(&self) -> Vec<f64> {
        vec![self.k, self.c]
    }
    fn parameter_count(&self) -> usize {
        2
    }
    fn with_parameters(&self, theta: &[f64]) -> Option<Self> {
        let [k, c] = *theta else { return None };
        Some(Spring { k, c })
    }
    #[inline(always)]
    fn value_at<T: Scalar>(&self, theta: &[T], _t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        Self::formula([theta[0], theta[1]], q[0], v[0], z)
    }
}

fn main() -> Result<(), FitError> {
    let times: Vec<f64> = (0..=100).map(|i| 0.4 * f64::from(i)).collect();
    let w = (1.0 - 0.0025f64).sqrt();
    let data: Vec<f64> = times.iter().map(|t| (-0.05 * t).exp() * ((w * t).cos() + 0.05 / w * (w * t).sin())).collect();
    let guess = Spring { k: 0.9, c: 0.09 };
    let unknowns = ["k", "c"].map(|name| Variable::Parameter(name.to_owned()));
    for (step, stages) in [(0.4, 4), (0.4, 6), (0.4, 8), (2.0, 8)] {
        let fit = || {
            let start = VelocityPoint::new([1.0], [0.0], 0.0);
            let model = MotionModel::new(&guess, 0.0, start, &unknowns, step)?.with_stages(stages);
            let model = model.observe(Observed::Position(0), &times)?;
            LeastSquares::new(&model, &data)?.solve(&model.start())
        };
        // The first one has cold caches.
        let result = fit()?;
        let mut seconds = Vec::new();
        for _ in 0..50 {
            let start = Instant::now();
            fit()?;
            seconds.push(start.elapsed().as_secs_f64());
        }
        seconds.sort_by(f64::total_cmp);
        let errors = [result.parameters[0] - 1.0, result.parameters[1] - 0.1];
        println!(
            "steps of {step}, {stages} stages: {} iterations, {} evaluations, errors {:.1e} and {:.1e}, {:.3} ms (the fastest {:.3} ms)",
            result.iterations,
            result.evaluations,
            errors[0].abs(),
            errors[1].abs(),
            1e3 * seconds[seconds.len() / 2],
            1e3 * seconds[0]
        );
    }
    Ok(())
}
