//! Run time of contact Gauss collocation for a contact Hamiltonian beside the same steps for its Lagrangian, and beside
//! dop853: `cargo run --release --features timings --bin hamiltonians`.
//!
//! The steps are taken by the steppers alone, without the checks of a run. The least time of some repetitions counts.
//! Lines with a Lagrangian compare equal steps; lines with dop853 compare the time to an error at the end.

use contact_geom::nalgebra::SVector;
use contact_geom::systems::{DoublePendulum, Pendulum, QuadraticInZ, Relativistic, System};
use contact_geom::{ContactHamiltonian, Lagrangian, OfHamiltonian, PhasePoint, Scalar, Structure, VelocityPoint};
use differential_equations::prelude::*;
use discrete_herglotz::gauss::GaussStepper;
use discrete_herglotz::{InputError, Problem, Stepper, StepperOptions};
use std::hint::black_box;
use std::time::Instant;

/// The time over which steps are repeated, in seconds.
const SAMPLE_SECONDS: f64 = 0.3;

/// The smallest number of repetitions.
const REPETITIONS: usize = 7;

/// The Hamiltonian of a system of the catalogue.
struct Known<S>(S);

impl<const N: usize, S: System<N>> ContactHamiltonian<N> for Known<S> {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, p: &SVector<T, N>, z: T) -> T {
        self.0.hamiltonian(t, &PhasePoint { q: *q, p: *p, z }).unwrap_or_else(|| T::from(f64::NAN))
    }
}

/// A Lagrangian without claims on its structure, whose steps take the general route.
struct Unclaimed<L>(L);

impl<const N: usize, L: Lagrangian<N>> Lagrangian<N> for Unclaimed<L> {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
        self.0.value(t, q, v, z)
    }
    fn structure(&self) -> Structure {
        Structure { autonomous: true, ..Structure::default() }
    }
}

/// The least seconds of some repetitions.
fn least<T>(mut action: impl FnMut() -> Result<T, InputError>) -> Result<f64, InputError> {
    let (mut least, mut count, start) = (f64::INFINITY, 0, Instant::now());
    while count < REPETITIONS || start.elapsed().as_secs_f64() < SAMPLE_SECONDS {
        let start = Instant::now();
        black_box(action()?);
        least = least.min(start.elapsed().as_secs_f64());
        count += 1;
    }
    Ok(least)
}

/// The state after some steps.
fn stepped<L: Lagrangian<N>, const N: usize>(
    problem: &Problem<'_, L, N>,
    (stages, h, steps): (usize, f64, usize),
) -> Result<PhasePoint<N>, InputError> {
    let options = StepperOptions { action: true, check_resolution: false };
    let mut stepper = GaussStepper::new(problem, stages, h, options)?;
    stepper.advance(steps).map_err(|failure| InputError::FirstStep(failure.cause))?;
    Ok(stepper.state())
}

/// Equal steps with the Hamiltonian, with the Lagrangian by its best route, and by the general route.
fn routes<S: System<N> + Copy, const N: usize>(system: S, (stages, h, t): (usize, f64, f64)) -> Result<(), InputError> {
    let steps = (t / h).round() as usize;
    let start: VelocityPoint<N> = system.initial();
    let (hamiltonian, general) = (OfHamiltonian(Known(system)), Unclaimed(system));
    let by_lagrangian = Problem::new(&system, 0.0, start)?;
    let by_general = Problem::new(&general, 0.0, start)?;
    let by_hamiltonian = Problem::of_hamiltonian(&hamiltonian, 0.0, *by_lagrangian.state())?;
    let length = (stages, h, steps);
    let best = least(|| stepped(&by_lagrangian, length))?;
    let general = least(|| stepped(&by_general, length))?;
    let direct = least(|| stepped(&by_hamiltonian, length))?;
    println!(
        "{},{stages},{steps},{:.2},{:.2},{:.2},{:.2},{:.2}",
        system.name(),
        1e6 * direct,
        1e6 * best,
        1e6 * general,
        direct / best,
        direct / general,
    );
    Ok(())
}

/// Van der Pol's oscillator as a vector field on the plane, lifted: `H = p_x y + p_y (mu (1 - x^2) y - x)`.
struct VanDerPol;

impl ContactHamiltonian<2> for VanDerPol {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 2>, p: &SVector<T, 2>, _z: T) -> T {
        p[0] * q[1] + p[1] * ((-q[0] * q[0] + 1.0) * q[1] - q[0])
    }
}

/// The two equations of the oscillator, for dop853.
struct Rates;

impl ODE<f64, [f64; 2]> for Rates {
    #[inline(always)]
    fn diff(&self, _t: f64, y: &[f64; 2], rate: &mut [f64; 2]) {
        *rate = [y[1], (1.0 - y[0] * y[0]) * y[1] - y[0]];
    }
}

/// The time to an error of (x, y) for the lifted oscillator, beside dop853 for its two equations alone.
fn van_der_pol() -> Result<(), InputError> {
    let t_end = 20.0;
    let hamiltonian = OfHamiltonian(VanDerPol);
    let start = PhasePoint::new([2.0, 0.0], [0.0, 0.0], 0.0);
    let problem = Problem::of_hamiltonian(&hamiltonian, 0.0, start)?;
    let at = |stages: usize, steps: usize| {
        let x = stepped(&problem, (stages, t_end / steps as f64, steps))?;
        Ok::<_, InputError>([x.q[0], x.q[1]])
    };
    let exact = at(8, 4000)?;
    let error = |x: [f64; 2]| ((x[0] - exact[0]).powi(2) + (x[1] - exact[1]).powi(2)).sqrt();
    let peer = |tolerance: f64| {
        let method = ExplicitRungeKutta::dop853().rtol(tolerance).atol([tolerance; 2]).max_steps(1_000_000);
        let ivp = IVP::ode(&Rates, 0.0, t_end, [2.0, 0.0]).t_eval([t_end]).method(method);
        ivp.solve().ok().and_then(|s| s.y.last().copied()).unwrap_or([f64::NAN; 2])
    };
    for level in [1e-6, 1e-9, 1e-12] {
        let mut best = (f64::INFINITY, 0, 0);
        for stages in 3..=12 {
            let counts = (3..60).map(|k| (8.0 * 1.1_f64.powi(k)) as usize);
            let Some(count) = counts.into_iter().find(|n| at(stages, *n).is_ok_and(|x| error(x) <= level)) else {
                continue;
            };
            let time = least(|| at(stages, count))?;
            if time < best.0 {
                best = (time, stages, count);
            }
        }
        let tolerances = (0..40).map(|k| level * 10f64.powf(1.0 - 0.25 * f64::from(k)));
        let other = tolerances.into_iter().find(|tolerance| error(peer(*tolerance)) <= level);
        let of_peer = other.map_or(Ok(f64::NAN), |tolerance| least(|| Ok(peer(tolerance))))?;
        println!(
            "van_der_pol to {level:e},{},{},{:.2},{:.2},{:.2},,",
            best.1,
            best.2,
            1e6 * best.0,
            1e6 * of_peer,
            best.0 / of_peer
        );
    }
    Ok(())
}

fn main() -> Result<(), InputError> {
    println!("system,stages,steps,hamiltonian_us,lagrangian_us,general_us,of_lagrangian,of_general");
    for stages in [4, 8] {
        let h = if stages == 4 { 0.1 } else { 0.25 };
        routes(Pendulum { gamma: -0.01 }, (stages, h, 100.0))?;
        routes(QuadraticInZ::default(), (stages, h, 100.0))?;
        routes(Relativistic::default(), (stages, h, 100.0))?;
        routes(DoublePendulum::default(), (stages, 0.2 * h, 20.0))?;
    }
    println!("problem,stages,steps,hamiltonian_us,dop853_us,ratio,,");
    van_der_pol()
}
