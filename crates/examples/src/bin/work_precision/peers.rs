//! Peers in Rust: two implementations of dop853, Hairer's explicit Runge-Kutta method of order 8, with hand-written
//! right-hand sides.

use crate::candidate::{Candidate, Control, Run, RunError};
use crate::problems::{DRAG, GRAVITY, KEPLER, OSCILLATOR, PENDULUM, Problem, QUADRATIC, System};
use crate::row::Action;
use differential_equations::methods::ExplicitRungeKutta;
use differential_equations::prelude::{IVP, ODE};
use ode_solvers::{Dop853, OutputType, SVector};
use std::time::Instant;

/// The largest number of steps of a run, of either peer.
const MAX_STEPS: u32 = 100_000_000;

/// The peers as candidates for a problem, with or without the action.
pub fn candidates(problem: &Problem, z: Action) -> Vec<Box<dyn Candidate>> {
    match (problem.system, z) {
        (System::Oscillator, Action::Off) => both(problem, |_, [q, v]: [f64; 2]| [v, OSCILLATOR.gamma * v - q]),
        (System::Oscillator, Action::On) => both(problem, |_, [q, v, z]: [f64; 3]| {
            let gamma = OSCILLATOR.gamma;
            [v, gamma * v - q, 0.5 * (v * v - q * q) + gamma * z]
        }),
        (System::Pendulum, Action::Off) => both(problem, |_, [q, v]: [f64; 2]| [v, PENDULUM.gamma * v - q.sin()]),
        (System::Pendulum, Action::On) => both(problem, |_, [q, v, z]: [f64; 3]| {
            let gamma = PENDULUM.gamma;
            [v, gamma * v - q.sin(), 0.5 * v * v - 1.0 + q.cos() + gamma * z]
        }),
        (System::Kepler, Action::Off) => both(problem, |_, [x, y, vx, vy]: [f64; 4]| {
            let (_, force) = attraction(x, y);
            [vx, vy, KEPLER.gamma * vx - x * force, KEPLER.gamma * vy - y * force]
        }),
        (System::Kepler, Action::On) => both(problem, |_, [x, y, vx, vy, z]: [f64; 5]| {
            let (inverse, force) = attraction(x, y);
            let gamma = KEPLER.gamma;
            let rate = 0.5 * (vx * vx + vy * vy) + inverse + gamma * z;
            [vx, vy, gamma * vx - x * force, gamma * vy - y * force, rate]
        }),
        (System::Quadratic, Action::On) => both(problem, |_, [q, v, z]: [f64; 3]| {
            [v, -q - QUADRATIC.c * z * v, 0.5 * (v * v - q * q) - 0.5 * QUADRATIC.c * z * z]
        }),
        (System::Projectile, Action::Off) => both(problem, |_, [_, _, vx, vy]: [f64; 4]| {
            let drag = DRAG * (vx * vx + vy * vy).sqrt();
            [vx, vy, -drag * vx, -GRAVITY - drag * vy]
        }),
        (System::Projectile, Action::On) => both(problem, |_, [_, y, vx, vy, _]: [f64; 5]| {
            let square = vx * vx + vy * vy;
            let drag = DRAG * square.sqrt();
            [vx, vy, -drag * vx, -GRAVITY - drag * vy, 0.5 * square - GRAVITY * y]
        }),
        (System::DoublePendulum, Action::Off) => both(problem, |t, [a, b, u, v]: [f64; 4]| {
            let [du, dv] = rods(t, a, b, u, v);
            [u, v, du, dv]
        }),
        (System::DoublePendulum, Action::On) => both(problem, |t, [a, b, u, v, _]: [f64; 5]| {
            let [du, dv] = rods(t, a, b, u, v);
            let kinetic = u * u + 0.5 * v * v + (a - b).cos() * u * v;
            [u, v, du, dv, kinetic - 2.0 * (1.0 - a.cos()) - (1.0 - b.cos())]
        }),
        // The equation of motion depends on the action.
        (System::Quadratic, Action::Off) => Vec::new(),
    }
}

/// `1/r` and `1/r^3`.
#[inline(always)]
fn attraction(x: f64, y: f64) -> (f64, f64) {
    let inverse = 1.0 / (x * x + y * y).sqrt();
    (inverse, inverse * inverse * inverse)
}

/// The accelerations of the double pendulum.
#[inline(always)]
fn rods(t: f64, a: f64, b: f64, u: f64, v: f64) -> [f64; 2] {
    let (sin, cos) = (a - b).sin_cos();
    let (drive, between) = (0.5 * (0.9 * t).cos(), 0.15 * (v - u));
    let f = [drive - 0.1 * u + between - 2.0 * a.sin() - sin * v * v, -between - b.sin() + sin * u * u];
    let determinant = 2.0 - cos * cos;
    [(f[0] - cos * f[1]) / determinant, (2.0 * f[1] - cos * f[0]) / determinant]
}

/// Both peers for a right-hand side with D variables.
fn both<const D: usize>(
    problem: &Problem,
    rhs: impl Fn(f64, [f64; D]) -> [f64; D] + Copy + 'static,
) -> Vec<Box<dyn Candidate>> {
    let adaptive = Adaptive { rhs: Rhs(rhs), problem: *problem };
    vec![Box::new(DifferentialEquations(adaptive)), Box::new(OdeSolvers(adaptive))]
}

/// A right-hand side.
#[derive(Clone, Copy)]
struct Rhs<F>(F);

impl<F: Fn(f64, [f64; D]) -> [f64; D], const D: usize> ODE<f64, [f64; D]> for Rhs<F> {
    #[inline(always)]
    fn diff(&self, t: f64, y: &[f64; D], rate: &mut [f64; D]) {
        *rate = (self.0)(t, *y);
    }
}

impl<F: Fn(f64, [f64; D]) -> [f64; D], const D: usize> ode_solvers::System<f64, SVector<f64, D>> for Rhs<F> {
    #[inline(always)]
    fn system(&self, t: f64, y: &SVector<f64, D>, rate: &mut SVector<f64, D>) {
        rate.data.0 = [(self.0)(t, y.data.0[0])];
    }
}

/// A problem with D variables, and its right-hand side.
#[derive(Clone, Copy)]
struct Adaptive<F, const D: usize> {
    rhs: Rhs<F>,
    problem: Problem,
}

impl<F, const D: usize> Adaptive<F, D> {
    /// The initial values.
    fn start(&self) -> [f64; D] {
        std::array::from_fn(|i| self.problem.start.get(i).copied().unwrap_or(f64::NAN))
    }

    /// The absolute tolerances, relative to the size of the motion at its end, since it decays by many orders of
    /// magnitude.
    fn absolute(&self, tolerance: f64) -> [f64; D] {
        let components = self.problem.components();
        std::array::from_fn(|i| tolerance * if i < components { self.problem.amplitude } else { self.problem.z_scale })
    }
}

/// dop853 of the crate differential-equations.
struct DifferentialEquations<F, const D: usize>(Adaptive<F, D>);

impl<F: Fn(f64, [f64; D]) -> [f64; D], const D: usize> Candidate for DifferentialEquations<F, D> {
    fn name(&self) -> &str {
        "differential_equations_dop853"
    }

    fn order(&self) -> u32 {
        8
    }

    fn control(&self) -> Control {
        Control::Tolerance
    }

    fn run(&self, tolerance: f64) -> Result<Run, RunError> {
        let Adaptive { rhs, problem } = &self.0;
        let method = ExplicitRungeKutta::dop853().rtol(tolerance).atol(self.0.absolute(tolerance));
        let ivp = IVP::ode(rhs, 0.0, problem.duration, self.0.start())
            .t_eval([problem.duration])
            .method(method.max_steps(MAX_STEPS as usize));
        let clock = Instant::now();
        let solution = ivp.solve().map_err(|error| RunError::Peer(format!("{error:?}")))?;
        let seconds = clock.elapsed().as_secs_f64();
        let end = solution.y.last().ok_or_else(|| RunError::Peer("no final state".into()))?;
        Ok(Run {
            state: end.to_vec(),
            steps: solution.steps.accepted as u64,
            evaluations: solution.evals.function as u64,
            seconds,
        })
    }
}

/// dop853 of the crate ode_solvers. It has one absolute tolerance for all variables: that of (q, v).
struct OdeSolvers<F, const D: usize>(Adaptive<F, D>);

impl<F: Fn(f64, [f64; D]) -> [f64; D] + Copy, const D: usize> Candidate for OdeSolvers<F, D> {
    fn name(&self) -> &str {
        "ode_solvers_dop853"
    }

    fn order(&self) -> u32 {
        8
    }

    fn control(&self) -> Control {
        Control::Tolerance
    }

    fn run(&self, tolerance: f64) -> Result<Run, RunError> {
        let Adaptive { rhs, problem } = self.0;
        let end = problem.duration;
        // The defaults of the crate, except for the number of steps, the sparse output, and the test for stiffness,
        // which is disabled.
        let mut solver = Dop853::from_param(
            rhs,
            0.0,
            end,
            end,
            SVector::from(self.0.start()),
            tolerance,
            tolerance * problem.amplitude,
            0.9,
            0.0,
            0.333,
            6.0,
            end,
            0.0,
            MAX_STEPS,
            u32::MAX,
            OutputType::Sparse,
        );
        let clock = Instant::now();
        let stats = solver.integrate().map_err(|error| RunError::Peer(error.to_string()))?;
        let seconds = clock.elapsed().as_secs_f64();
        let state = solver.y_out().last().ok_or_else(|| RunError::Peer("no final state".into()))?;
        Ok(Run {
            state: state.iter().copied().collect(),
            steps: u64::from(stats.accepted_steps),
            evaluations: u64::from(stats.num_eval),
            seconds,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problems::PROBLEMS;

    #[test]
    fn right_hand_sides_are_those_of_the_problems() -> Result<(), RunError> {
        for (problem, z) in PROBLEMS.iter().flat_map(|problem| Action::ALL.map(|z| (problem, z))) {
            let peers = candidates(problem, z);
            assert_eq!(peers.len(), if problem.needs_z() && z == Action::Off { 0 } else { 2 });
            for peer in peers {
                let run = peer.run(1e-12)?;
                // The orbit of P3 amplifies the tolerance by 1e6; a wrong term would change the first digit.
                assert!(problem.error(&run.state) < 1e-5, "{} {}: {run:?}", problem.name, peer.name());
                assert_eq!(problem.error_z(&run.state).is_some(), z == Action::On);
                assert!(problem.error_z(&run.state).is_none_or(|e| e < 1e-7), "{} {}", problem.name, peer.name());
                assert!(run.steps > 0 && run.evaluations >= 11 * run.steps);
            }
        }
        Ok(())
    }
}
