//! Run time against error of motions with forces, beside dop853: `cargo run --release --features timings --bin forces`.
//!
//! Two problems: a projectile in the plane with quadratic drag, and a driven double pendulum with friction in both joints.
//! For each method and each error level the table has the least time of the settings that reach the level. Errors are
//! those of the final (q, v), relative to the norm of a reference with half of the shortest steps. Times are those of the
//! steps: a run adds its checks of the input, some 0.1 ms.

use contact_geom::systems::DoublePendulum;
use contact_geom::{Force, Forced, Lagrangian, PhasePoint, Scalar, Structure, VelocityPoint, nalgebra::SVector};
use differential_equations::methods::ExplicitRungeKutta;
use differential_equations::prelude::{IVP, ODE};
use discrete_herglotz::gauss::GaussStepper;
use discrete_herglotz::theory::legendre_inverse;
use discrete_herglotz::{InputError, Problem, Stepper, StepperOptions};
use std::hint::black_box;
use std::time::Instant;

/// The errors at which times are compared.
const LEVELS: [f64; 2] = [1e-6, 1e-10];

/// The least time of this many repetitions counts.
const REPETITIONS: usize = 9;

/// The time over which a repetition is repeated, in seconds, so that the clock resolves it.
const SAMPLE_SECONDS: f64 = 2e-3;

/// A projectile in the plane.
struct Projectile;

impl Lagrangian<2> for Projectile {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 2>, v: &SVector<T, 2>, _z: T) -> T {
        v.dot(v) * 0.5 - q[1] * 9.81
    }
    fn structure(&self) -> Structure {
        Structure { autonomous: true, z_free: true, separable: true, constant_mass: true, ..Structure::default() }
    }
}

/// `-c |v| v`.
struct Quadratic(f64);

impl Force<2> for Quadratic {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, x: &VelocityPoint<2, T>) -> SVector<T, 2> {
        x.v * (x.v.dot(&x.v).sqrt() * -self.0)
    }
}

/// A torque on the upper rod, and friction in both joints.
struct Joints;

impl Force<2> for Joints {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, x: &VelocityPoint<2, T>) -> SVector<T, 2> {
        let (drive, between) = ((t * 0.9).cos() * 0.5, (x.v[1] - x.v[0]) * 0.15);
        SVector::from([drive - x.v[0] * 0.1 + between, -between])
    }
}

/// The state (q, v) at the end.
type End = [f64; 4];

fn error(found: &End, exact: &End) -> f64 {
    let norm = |x: &[f64; 4]| x.iter().map(|x| x * x).sum::<f64>().sqrt();
    norm(&std::array::from_fn(|i| found[i] - exact[i])) / norm(exact)
}

/// The least seconds of some runs.
fn seconds(mut run: impl FnMut()) -> f64 {
    let (clock, mut count) = (Instant::now(), 0u32);
    while clock.elapsed().as_secs_f64() < SAMPLE_SECONDS {
        run();
        count += 1;
    }
    let mut least = f64::INFINITY;
    for _ in 0..REPETITIONS {
        let clock = Instant::now();
        for _ in 0..count {
            run();
        }
        least = least.min(clock.elapsed().as_secs_f64() / f64::from(count));
    }
    least
}

/// The state after some steps of Gauss collocation, without the checks of a run.
fn stepped<F: Force<2>, L: Lagrangian<2>>(
    problem: &Problem<'_, Forced<L, F>, 2>,
    t_end: f64,
    stages: usize,
    count: usize,
) -> Result<PhasePoint<2>, InputError> {
    let h = t_end / count as f64;
    let mut stepper = GaussStepper::new(problem, stages, h, StepperOptions::default())?;
    stepper.advance(count).map_err(|failure| InputError::FirstStep(failure.cause))?;
    Ok(stepper.state())
}

/// The end of such a motion as (q, v).
fn gauss<F: Force<2>, L: Lagrangian<2>>(
    problem: &Problem<'_, Forced<L, F>, 2>,
    t_end: f64,
    stages: usize,
    count: usize,
) -> Result<End, InputError> {
    let state = stepped(problem, t_end, stages, count)?;
    let end = legendre_inverse(problem.lagrangian(), t_end, &state, &state.p).map_err(InputError::FirstStep)?;
    Ok([end.q[0], end.q[1], end.v[0], end.v[1]])
}

/// The right-hand side of the peer.
struct Rhs<F>(F);

impl<F: Fn(f64, &End) -> [f64; 2]> ODE<f64, End> for Rhs<F> {
    #[inline(always)]
    fn diff(&self, t: f64, y: &End, rate: &mut End) {
        let [a, b] = (self.0)(t, y);
        *rate = [y[2], y[3], a, b];
    }
}

fn dop853<F: Fn(f64, &End) -> [f64; 2]>(rhs: &Rhs<F>, (start, t_end): (End, f64), tolerance: f64) -> Option<End> {
    let method = ExplicitRungeKutta::dop853().rtol(tolerance).atol([tolerance; 4]).max_steps(1_000_000);
    let ivp = IVP::ode(rhs, 0.0, t_end, start).t_eval([t_end]).method(method);
    ivp.solve().ok()?.y.last().copied()
}

/// Writes the least times at each level.
fn compare<L: Lagrangian<2>, F: Force<2>, R: Fn(f64, &End) -> [f64; 2]>(
    name: &str,
    forced: &Forced<L, F>,
    rhs: R,
    motion: (End, f64),
    counts: &[usize],
) -> Result<(), InputError> {
    let longest = counts.last().copied().unwrap_or(1);
    let (start, t_end) = motion;
    let [x, y, u, v] = start;
    let problem = Problem::new(forced, 0.0, VelocityPoint::new([x, y], [u, v], 0.0))?;
    let exact = gauss(&problem, t_end, 8, 2 * longest)?;
    let rhs = Rhs(rhs);
    let peer = dop853(&rhs, motion, 1e-14).unwrap_or([f64::NAN; 4]);
    println!("{name}: reference {exact:.13?}, dop853 with 1e-14 differs by {:.1e}", error(&peer, &exact));
    for level in LEVELS {
        let mut best = (f64::INFINITY, String::new());
        for stages in 2..=12 {
            let reached = counts
                .iter()
                .find(|count| gauss(&problem, t_end, stages, **count).is_ok_and(|end| error(&end, &exact) <= level));
            if let Some(&count) = reached {
                let time = seconds(|| {
                    let _ = black_box(stepped(&problem, t_end, stages, count));
                });
                if time < best.0 {
                    best = (time, format!("gauss_{stages} with {count} steps"));
                }
            }
        }
        let tolerances = (8..=56).map(|k| f64::powf(10.0, -0.25 * f64::from(k)));
        let reached = tolerances
            .into_iter()
            .find(|tolerance| dop853(&rhs, motion, *tolerance).is_some_and(|end| error(&end, &exact) <= level));
        let of_peer = reached.map_or(f64::NAN, |tolerance| {
            seconds(|| {
                let _ = black_box(dop853(&rhs, motion, tolerance));
            })
        });
        println!(
            "{name},{level:e},{},{:.2} us,dop853,{:.2} us,ratio {:.3}",
            best.1,
            best.0 * 1e6,
            of_peer * 1e6,
            best.0 / of_peer
        );
    }
    Ok(())
}

fn main() -> Result<(), InputError> {
    let c = 0.02;
    let projectile = Forced::new(Projectile, Quadratic(c));
    let drag = move |_: f64, y: &End| {
        let speed = (y[2] * y[2] + y[3] * y[3]).sqrt();
        [-c * speed * y[2], -9.81 - c * speed * y[3]]
    };
    let counts: Vec<usize> = (0..60).map(|k| f64::powf(1.12, f64::from(k)).ceil() as usize).collect();
    compare("projectile", &projectile, drag, ([0.0, 0.0, 30.0, 40.0], 10.0), &counts)?;

    let pendulum = Forced::new(DoublePendulum { gamma: 0.0, ..DoublePendulum::default() }, Joints);
    let joints = |t: f64, y: &End| {
        let [a, b, u, v] = *y;
        let (sin, cos) = (a - b).sin_cos();
        let (drive, between) = (0.5 * (0.9 * t).cos(), 0.15 * (v - u));
        let f = [drive - 0.1 * u + between - 2.0 * a.sin() - sin * v * v, -between - b.sin() + sin * u * u];
        let determinant = 2.0 - cos * cos;
        [(f[0] - cos * f[1]) / determinant, (2.0 * f[1] - cos * f[0]) / determinant]
    };
    let counts: Vec<usize> = (10..80).map(|k| f64::powf(1.12, f64::from(k)).ceil() as usize).collect();
    compare("double_pendulum", &pendulum, joints, ([1.0, 1.2, 0.0, 0.0], 30.0), &counts)
}
