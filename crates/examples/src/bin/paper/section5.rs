//! Section 5: the examples' equations as the paper writes them, against the library's.

use crate::closed_exact::ClosedExact;
use crate::explicit::Explicit;
use crate::section3::{STEPS, straight_step};
use crate::series::{Example, GAMMA, STEP};
use contact_examples::systems::{Duffing, FreeParticle, HarmonicOscillator, Kepler, Pendulum, System};
use contact_examples::{Checks, Subject, fractions};
use contact_geom::nalgebra::SVector;
use contact_geom::{DiscretePoint, GeometryError, PhasePoint, Statement, VelocityPoint, legendre};
use discrete_herglotz::{
    DiscreteLagrangian, InputError,
    rules::Rule,
    theory::{HamiltonianFlow, derived_jet, discrete_flow, hamiltonian_flow, sigma_d},
};
use exact_lagrangian::QuadraticExact;

/// The points at which each example is checked.
const SAMPLES: usize = 32;

/// The rates and steps of the explicit formulas: the paper's, and a strong drag in a long step.
const CASES: [(f64, f64); 3] = [(GAMMA, STEP), (GAMMA, 0.1), (-1.0, STEP)];

/// Statements 37, 38 and 39.
pub fn check(checks: &mut Checks) {
    for ((gamma, h), i) in CASES.iter().flat_map(|case| (0..SAMPLES).map(move |i| (*case, i))) {
        let (free, spring) = (FreeParticle { gamma }, HarmonicOscillator { gamma });
        let (t, x) = free.sample(&fractions(i, 4));
        let points = straight_step(&x, h);
        let closed = ClosedExact::corrected(gamma, h);
        for (statement, system, method, residual) in [
            (Statement::FreeParticle, free.name(), "rectangle", free_particle_step(&free, h, t, &points)),
            (Statement::FreeParticle, free.name(), "closed_exact", exact(&closed, &free, gamma, t, &points)),
            (
                Statement::FreeParticle,
                free.name(),
                "quadratic_exact",
                linear(QuadraticExact::new(&free, h), &free, gamma, t, &points),
            ),
            (Statement::HarmonicOscillator, spring.name(), "left_midpoint", oscillator_step(&spring, h, t, &points)),
            (Statement::HarmonicOscillator, spring.name(), "closed_motion", Ok(oscillator_motion(&spring, h, x.v[0]))),
            (
                Statement::HarmonicOscillator,
                spring.name(),
                "quadratic_exact",
                linear(QuadraticExact::new(&spring, h), &spring, gamma, t, &points),
            ),
        ] {
            checks.record(&Subject::discrete(statement, system, method, h), residual.map(Some));
        }
    }
    let spring = |stiffness: f64| move |q: &SVector<f64, 1>| q * stiffness;
    midpoint(&FreeParticle::default(), FreeParticle::default().gamma, spring(0.0), checks);
    midpoint(&HarmonicOscillator::default(), HarmonicOscillator::default().gamma, spring(1.0), checks);
    midpoint(&Pendulum::default(), Pendulum::default().gamma, |q| q.map(f64::sin), checks);
    let duffing = Duffing::default();
    midpoint(&duffing, duffing.gamma, |q| q * duffing.alpha + q.map(|q| q * q * q) * duffing.beta, checks);
    midpoint(&Kepler::<2>::default(), Kepler::<2>::default().gamma, |q| q / q.norm().powi(3), checks);
    midpoint(&Kepler::<3>::default(), Kepler::<3>::default().gamma, |q| q / q.norm().powi(3), checks);
}

/// How far the next position and action of the discrete flow are from explicit formulas; the position relative to the
/// rounding of the three that enter.
fn next_step(
    ld: &impl DiscreteLagrangian<1>,
    t: f64,
    x: &DiscretePoint<1>,
    q2: f64,
    z1: f64,
) -> Result<f64, GeometryError> {
    let next = discrete_flow(ld, t, x)?;
    let positions = x.q0[0].abs().max(x.q1[0].abs()).max(q2.abs());
    let apart = (next.q1[0] - q2).abs() / positions;
    Ok(apart.max((next.z0 - z1).abs() / (1.0 + z1.abs())).max((next.q0[0] - x.q1[0]).abs()))
}

/// Statement 37: `q2 = (h gamma + 2) q1 - (h gamma + 1) q0`, `z1 = (q1 - q0)^2/(2h) + (h gamma + 1) z0`.
fn free_particle_step(system: &FreeParticle, h: f64, t: f64, x: &DiscretePoint<1>) -> Result<f64, GeometryError> {
    let ld =
        Rule::RECTANGLE.of::<1, _>(system, h).map_err(|_| GeometryError::Undefined { what: "the rectangle rule" })?;
    let (q0, q1, drag) = (x.q0[0], x.q1[0], h * system.gamma);
    let q2 = system.third_point(q0, q1, h);
    next_step(&ld, t, x, q2, (q1 - q0) * (q1 - q0) / (2.0 * h) + (drag + 1.0) * x.z0)
}

/// [`exact`] for one of the library's.
fn linear<E: Example>(
    ld: Result<impl DiscreteLagrangian<1>, InputError>,
    system: &E,
    gamma: f64,
    t: f64,
    x: &DiscretePoint<1>,
) -> Result<f64, GeometryError> {
    exact(&ld.map_err(|_| GeometryError::Undefined { what: "the exact discrete Lagrangian" })?, system, gamma, t, x)
}

/// Statements 37 and 38: an exact discrete Lagrangian has `D_z L_h^e = e^(gamma h) - 1`, is the increment of the action
/// along the true motion, and its flow is that motion.
fn exact<E: Example>(
    ld: &impl DiscreteLagrangian<1>,
    system: &E,
    gamma: f64,
    t: f64,
    x: &DiscretePoint<1>,
) -> Result<f64, GeometryError> {
    let h = ld.step_size();
    let jet = derived_jet(ld, t, x)?;
    let slope = (gamma * h).exp_m1();
    let velocity = system
        .velocity_through(x.q0[0], x.q1[0], h)
        .ok_or(GeometryError::Undefined { what: "the motion through q0 and q1" })?;
    let from = VelocityPoint::new(x.q0, [velocity], x.z0);
    let to = system.motion(h, &from);
    let increment = (jet.value - (to.z - x.z0)).abs() / (1.0 + to.z.abs() + x.z0.abs());
    let guess = (x.q1 - x.q0) / h;
    let end = hamiltonian_flow(ld, t, &legendre(system, t, &from), &guess, HamiltonianFlow::Direct)?;
    let expected: PhasePoint<1> = legendre(system, t + h, &to);
    let apart = |a: f64, b: f64| (a - b).abs() / (1.0 + b.abs());
    let motion = apart(end.q[0], expected.q[0]).max(apart(end.p[0], expected.p[0])).max(apart(end.z, expected.z));
    Ok(increment.max(motion).max((jet.dz - slope).abs() / slope.abs()))
}

/// Statement 38: `q2 = -((h^3 gamma + 4 h gamma + h^2 + 4) q0 + (h^3 gamma - 4 h gamma + 2 h^2 - 8) q1)/(h^2 + 4)` and
/// `z1 = (q1 - q0)^2/(2h) - h (q1 + q0)^2/8 + (h gamma + 1) z0`.
fn oscillator_step(system: &HarmonicOscillator, h: f64, t: f64, x: &DiscretePoint<1>) -> Result<f64, GeometryError> {
    let ld = Rule::LEFT_MIDPOINT
        .of::<1, _>(system, h)
        .map_err(|_| GeometryError::Undefined { what: "the midpoint rule" })?;
    let (q0, q1, gamma) = (x.q0[0], x.q1[0], system.gamma);
    let q2 = system.third_point(q0, q1, h);
    let kinetic = (q1 - q0) * (q1 - q0) / (2.0 * h);
    next_step(&ld, t, x, q2, kinetic - h * (q1 + q0) * (q1 + q0) / 8.0 + (h * gamma + 1.0) * x.z0)
}

/// Statement 38: the exact dynamics from `q(0) = 0`, `z(0) = 0`. Its samples obey
/// `q_{k+1} = 2 e^(gamma h/2) cos(w h) q_k - e^(gamma h) q_{k-1}`, the action is `z = q v/2`, and the energy decays as
/// `e^(gamma t)`. Relative to the largest amplitude.
fn oscillator_motion(system: &HarmonicOscillator, h: f64, velocity: f64) -> f64 {
    let gamma = system.gamma;
    let w = (1.0 - 0.25 * gamma * gamma).sqrt();
    let (twice, product) = (2.0 * (0.5 * gamma * h).exp() * (w * h).cos(), (gamma * h).exp());
    let start = VelocityPoint::new([0.0], [velocity], 0.0);
    let at = |k: i32| system.solution(f64::from(k) * h, &start);
    let energy = |x: &VelocityPoint<1>| 0.5 * (x.v[0] * x.v[0] + x.q[0] * x.q[0]) - gamma * x.z;
    let (amplitude, initial) = (velocity.abs(), energy(&start));
    let mut worst: f64 = 0.0;
    for k in 1..20 {
        let (before, here, after) = (at(k - 1), at(k), at(k + 1));
        let recurrence = after.q[0] - (twice * here.q[0] - product * before.q[0]);
        let action = here.z - 0.5 * here.q[0] * here.v[0];
        let decay = energy(&here) - initial * (gamma * h * f64::from(k)).exp();
        worst = worst
            .max(recurrence.abs() / amplitude)
            .max(action.abs() / (amplitude * amplitude))
            .max(decay.abs() / initial);
    }
    worst
}

/// Statement 39: the equations of the midpoint rule for `v^2/2 - V(q) + gamma z`,
/// `u_0 - h/2 V'(m_0) = (u_1 + h/2 V'(m_1))/(1 + h gamma)` with the mean velocities `u` and the midpoints `m`, and
/// `sigma_d = 1 + h gamma > 0`.
fn midpoint<const N: usize>(
    system: &impl System<N>,
    gamma: f64,
    slope: impl Fn(&SVector<f64, N>) -> SVector<f64, N>,
    checks: &mut Checks,
) {
    let residual = |h: f64, t: f64, x: &DiscretePoint<N>| -> Result<f64, GeometryError> {
        let ld = Rule::LEFT_MIDPOINT
            .of::<N, _>(system, h)
            .map_err(|_| GeometryError::Undefined { what: "the midpoint rule" })?;
        let next = discrete_flow(&ld, t, x)?;
        let (u0, u1) = ((x.q1 - x.q0) / h, (next.q1 - next.q0) / h);
        let (before, after) = (slope(&((x.q0 + x.q1) * 0.5)), slope(&((next.q0 + next.q1) * 0.5)));
        let sigma = sigma_d(&ld, t, x)?;
        let equation = u0 - before * (0.5 * h) - (u1 + after * (0.5 * h)) / (1.0 + h * gamma);
        // A rounding of a position changes its mean velocity by 1/h times itself.
        let size = u0.amax().max(u1.amax()).max(x.q1.amax() / h);
        let rate = (sigma - (1.0 + h * gamma)).abs();
        Ok(if sigma > 0.0 { (equation.amax() / size).max(rate) } else { f64::INFINITY })
    };
    for (h, i) in STEPS.iter().flat_map(|h| (0..SAMPLES).map(move |i| (*h, i))) {
        let (t, x) = system.sample(&fractions(i, 2 * N + 2));
        let subject = Subject::discrete(Statement::MidpointRule, system.name(), "left_midpoint", h);
        checks.record(&subject, residual(h, t, &straight_step(&x, h)).map(Some));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use contact_examples::TOLERANCE;

    #[test]
    fn the_misprint_is_seen() {
        let (system, x) = (FreeParticle { gamma: GAMMA }, DiscretePoint::new([0.2], [1.0], 0.7));
        let residual = |ld| exact(&ld, &system, GAMMA, 0.0, &x).unwrap_or(f64::INFINITY);
        assert!(residual(ClosedExact::corrected(GAMMA, STEP)) <= TOLERANCE);
        assert!(residual(ClosedExact::printed(GAMMA, STEP)) > 1e-3);
    }
}
