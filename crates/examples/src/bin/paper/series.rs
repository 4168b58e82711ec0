//! The two examples of the paper's section 5: the discrete solution beside the true motion.

use crate::explicit::Explicit;
use contact_examples::Failure;
use contact_examples::systems::{FreeParticle, HarmonicOscillator, System};
use contact_geom::{ChartVector, DiscretePoint, Energy, GeometryError, PhasePoint, SmoothFunction, VelocityPoint};
use discrete_herglotz::{DiscreteLagrangian, rules::Flow, theory::legendre_minus};

/// The rate of the conformal factor in both examples, in inverse units of time.
pub const GAMMA: f64 = -0.05;

/// The time step of both examples.
pub const STEP: f64 = 0.5;

/// The start of the published data; the captions print `q0 = 1, q1 = 2`.
pub fn start() -> DiscretePoint<1> {
    DiscretePoint::new([0.0], [1.0], 0.0)
}

/// One of the paper's two systems: its discrete and its true motion are known explicitly.
pub trait Example: System<1> + Explicit {
    /// The velocity at `q0` of the motion that reaches `q1` after time `h`, where there is exactly one.
    fn velocity_through(&self, q0: f64, q1: f64, h: f64) -> Option<f64>;
    /// The motion after time `t`.
    fn motion(&self, t: f64, start: &VelocityPoint<1>) -> VelocityPoint<1>;
}

impl Example for FreeParticle {
    fn velocity_through(&self, q0: f64, q1: f64, h: f64) -> Option<f64> {
        self.velocity_through(q0, q1, h)
    }
    fn motion(&self, t: f64, start: &VelocityPoint<1>) -> VelocityPoint<1> {
        self.solution(t, start)
    }
}

impl Example for HarmonicOscillator {
    fn velocity_through(&self, q0: f64, q1: f64, h: f64) -> Option<f64> {
        self.velocity_through(q0, q1, h)
    }
    fn motion(&self, t: f64, start: &VelocityPoint<1>) -> VelocityPoint<1> {
        self.solution(t, start)
    }
}

/// The state of the true motion through `q0` at time 0 and `q1` at time `h`, at time 0.
pub fn true_start(system: &impl Example) -> Result<VelocityPoint<1>, Failure> {
    let x = start();
    let velocity = system
        .velocity_through(x.q0[0], x.q1[0], STEP)
        .ok_or(GeometryError::Undefined { what: "the motion through q0 and q1" })?;
    Ok(VelocityPoint::new(x.q0, [velocity], x.z0))
}

/// A row of the table of an example.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// The number of the step.
    pub k: usize,
    /// The time `k h`.
    pub t: f64,
    /// The discrete position `q_k`.
    pub q: f64,
    /// The discrete action `z_k`.
    pub z: f64,
    /// The logarithm of the energy at the middle of the step that starts here: what the paper plots.
    pub log_energy_midpoint: f64,
    /// The logarithm of `H o F-L_d (q_k, q_{k+1}, z_k)`: what the paper's captions say.
    pub log_hamiltonian: f64,
    /// The true position.
    pub q_exact: f64,
    /// The true action.
    pub z_exact: f64,
    /// The logarithm of the true Hamiltonian.
    pub log_hamiltonian_exact: f64,
}

/// The names of a row's entries.
pub const COLUMNS: [&str; 9] =
    ["k", "t", "q", "z", "log_energy_midpoint", "log_hamiltonian", "q_exact", "z_exact", "log_hamiltonian_exact"];

/// The first `count` rows of an example, from the start that the published data have, by the paper's own route: positions by
/// its explicit formula for `q2`, `z_{k+1} = z_k + L_d`, momenta by F-L_d.
///
/// The formula's coefficients are rounded, which the published data show: their positions drift from the solution of the
/// discrete Herglotz equations by 6.5e-12 in a hundred steps. The flow in `(q, p, z)` has no such drift, which a table
/// says; the rows are to be those of the figures. The entries of row k need `q_{k+1}`, so there is one step more than rows.
pub fn rows<E: Example>(system: &E, ld: &impl DiscreteLagrangian<1>, count: usize) -> Result<Vec<Row>, Failure> {
    let origin = true_start(system)?;
    let energy = Energy(system);
    let h = ld.step_size();
    let log_initial = energy.value(0.0, &origin.into()).ln();
    let mut step = start();
    let mut rows = Vec::with_capacity(count);
    for k in 0..count {
        let t = k as f64 * h;
        let middle = ChartVector { x: (step.q0 + step.q1) * 0.5, y: (step.q1 - step.q0) / h, z: step.z0 };
        let truth = system.motion(t, &origin);
        rows.push(Row {
            k,
            t,
            q: step.q0[0],
            z: step.z0,
            log_energy_midpoint: energy.value(t, &middle).ln(),
            log_hamiltonian: log_hamiltonian(system, t, &legendre_minus(ld, t, &step)?),
            q_exact: truth.q[0],
            z_exact: truth.z,
            // H is dissipated: H o phi_t = e^(gamma t) H.
            log_hamiltonian_exact: log_initial + GAMMA * t,
        });
        let z1 = step.z0 + ld.jet(t, &step)?.value;
        step = DiscretePoint::new(step.q1, [system.third_point(step.q0[0], step.q1[0], h)], z1);
    }
    Ok(rows)
}

/// The positions of the first `count` states of the library's flow in `(q, p, z)`, from the same start.
pub fn positions_by_flow(ld: &impl DiscreteLagrangian<1>, count: usize) -> Result<Vec<f64>, Failure> {
    let mut flow = Flow::from_points(ld, 0.0, start())?;
    let mut positions = vec![flow.state().q[0]];
    for _ in 1..count {
        positions.push(flow.step()?.to.q[0]);
    }
    Ok(positions)
}

/// The logarithm of the Hamiltonian at a state; NaN where the system has none in closed form, or it is not positive.
pub fn log_hamiltonian(system: &impl System<1>, t: f64, x: &PhasePoint<1>) -> f64 {
    system.hamiltonian(t, x).map_or(f64::NAN, f64::ln)
}

/// The largest distance of two columns; infinite where one has an entry that is no number.
pub fn distance(a: impl Iterator<Item = f64>, b: impl Iterator<Item = f64>) -> f64 {
    a.zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, |most, d| if d.is_nan() { f64::INFINITY } else { most.max(d) })
}
