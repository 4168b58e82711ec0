//! The paper's dashed curves, by the faulty formulas that produce them, and the published data of the free particle.

use crate::closed_exact::ClosedExact;
use crate::series::{GAMMA, Row, STEP, log_hamiltonian, start, true_start};
use contact_examples::Failure;
use contact_examples::systems::{FreeParticle, HarmonicOscillator};
use discrete_herglotz::rules::Flow;

/// A row of the curves that the paper calls exact.
#[derive(Clone, Copy, Debug)]
pub struct PublishedRow {
    /// The number of the step.
    pub k: usize,
    /// The time `k h`.
    pub t: f64,
    /// The position.
    pub q: f64,
    /// The action.
    pub z: f64,
    /// The logarithm of the Hamiltonian.
    pub log_hamiltonian: f64,
}

/// The names of a row's entries.
pub const COLUMNS: [&str; 5] = ["k", "t", "q_exact_published", "z_exact_published", "log_hamiltonian_exact_published"];

/// The free particle: the discrete Herglotz equations of the misprinted `L_h^e`, with the wrong sign of gamma on top, and
/// `H = p^2/2 + 0.05 z` at `F-L_h^e`.
pub fn free_particle(count: usize) -> Result<Vec<PublishedRow>, Failure> {
    let ld = ClosedExact::printed(-GAMMA, STEP);
    // Its H has the right sign: that of a particle with gamma = -0.05.
    let system = FreeParticle { gamma: GAMMA };
    let mut flow = Flow::from_points(&ld, 0.0, start())?;
    let mut rows = Vec::with_capacity(count);
    for k in 0..count {
        let (t, x) = (k as f64 * STEP, *flow.state());
        rows.push(PublishedRow { k, t, q: x.q[0], z: x.z, log_hamiltonian: log_hamiltonian(&system, t, &x) });
        flow.step()?;
    }
    Ok(rows)
}

/// The oscillator: position and Hamiltonian are the true ones, the action is [`faulty_action`].
pub fn harmonic_oscillator(truth: &[Row]) -> Result<Vec<PublishedRow>, Failure> {
    let velocity = true_start(&HarmonicOscillator { gamma: GAMMA })?.v[0];
    let row = |row: &Row| PublishedRow {
        k: row.k,
        t: row.t,
        q: row.q_exact,
        z: faulty_action(velocity, row.t),
        log_hamiltonian: row.log_hamiltonian_exact,
    };
    Ok(truth.iter().map(row).collect())
}

/// The solution of `zdot = v^2/2 - q^2/2 - gamma z`, `z(0) = 0`, along the true motion from `q = 0` with this velocity: the
/// sign of gamma is wrong.
///
/// With `q = B e^(a t) sin w t`, `a = gamma/2`, `w^2 = 1 - a^2`, the first two terms are
/// `B^2 e^(gamma t)/2 (w^2 cos 2wt + a w sin 2wt)`; so `e^(gamma t) z` is the integral of that times `e^(gamma t)`.
pub fn faulty_action(velocity: f64, t: f64) -> f64 {
    let a = GAMMA * 0.5;
    let w = (1.0 - a * a).sqrt();
    let amplitude = velocity / w;
    let (c, b) = (2.0 * GAMMA, 2.0 * w);
    let (sin, cos) = (b * t).sin_cos();
    // The integrals of e^(c s) cos(b s) and e^(c s) sin(b s) from 0 to t, both times c^2 + b^2.
    let growth = (c * t).exp();
    let cosine = growth * (c * cos + b * sin) - c;
    let sine = growth * (c * sin - b * cos) + b;
    (-GAMMA * t).exp() * 0.5 * amplitude * amplitude * (w * w * cosine + a * w * sine) / (c * c + b * b)
}

/// The solution of the free particle's discrete equations, `q_k = (q_1 - q_0) ((1 + h gamma)^k - 1)/(h gamma)`.
pub fn solved_recurrence(count: usize) -> Vec<f64> {
    let (x, drag) = (start(), STEP * GAMMA);
    (0..count).map(|k| (x.q1[0] - x.q0[0]) * (drag.ln_1p() * k as f64).exp_m1() / drag).collect()
}

/// The published data of one figure: its solid and its dashed curve.
#[derive(Clone, Debug, Default)]
pub struct Fixture {
    /// The times.
    pub t: Vec<f64>,
    /// The solid curve.
    pub discrete: Vec<f64>,
    /// The dashed curve.
    pub exact: Vec<f64>,
}

impl Fixture {
    /// The free particle's position.
    pub fn q() -> Self {
        Self::parse(include_str!("../../../fixtures/free_particle_qt.csv"))
    }

    /// The free particle's action.
    pub fn z() -> Self {
        Self::parse(include_str!("../../../fixtures/free_particle_zt.csv"))
    }

    /// The logarithm of the free particle's Hamiltonian.
    pub fn log_hamiltonian() -> Self {
        Self::parse(include_str!("../../../fixtures/free_particle_logH.csv"))
    }

    /// The columns `t, discrete, exact`. The text is part of the program; an entry that is no number becomes NaN and so
    /// an infinite deviation, never a good one.
    fn parse(text: &str) -> Self {
        let mut fixture = Fixture::default();
        for line in text.lines().skip(1).filter(|line| !line.trim().is_empty()) {
            let mut entries = line.split(',').map(|entry| entry.trim().parse().unwrap_or(f64::NAN));
            let mut next = || entries.next().unwrap_or(f64::NAN);
            fixture.t.push(next());
            fixture.discrete.push(next());
            fixture.exact.push(next());
        }
        fixture
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use contact_geom::VelocityPoint;

    #[test]
    fn the_faulty_action_solves_its_equation() {
        let (system, d) = (HarmonicOscillator { gamma: GAMMA }, 1e-4);
        let start = VelocityPoint::new([0.0], [1.3], 0.0);
        for t in [0.0, 0.4, 3.0, 20.0] {
            let x = system.solution(t, &start);
            let rate = (faulty_action(1.3, t + d) - faulty_action(1.3, t - d)) / (2.0 * d);
            let expected = 0.5 * (x.v[0] * x.v[0] - x.q[0] * x.q[0]) - GAMMA * faulty_action(1.3, t);
            // Central differences: d^2 times a third derivative below 10.
            assert!((rate - expected).abs() < 1e-7, "t = {t}: {rate} and {expected}");
        }
        assert_eq!(faulty_action(1.3, 0.0), 0.0);
    }

    #[test]
    fn the_fixtures_are_complete() {
        for (fixture, rows) in [(Fixture::q(), 100), (Fixture::z(), 100), (Fixture::log_hamiltonian(), 99)] {
            assert_eq!(fixture.t.len(), rows);
            assert!(fixture.t.iter().enumerate().all(|(k, t)| *t == k as f64 * STEP));
            assert!(fixture.discrete.iter().chain(&fixture.exact).all(|x| x.is_finite()));
        }
    }
}
