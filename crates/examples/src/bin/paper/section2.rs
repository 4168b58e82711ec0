//! Section 2: the statements about flows, and about Hamiltonians that no regular Lagrangian has.

use contact_examples::systems::{FreeParticle, HarmonicOscillator, Lienard, VanDerPol};
use contact_examples::{Checks, Subject, fractions};
use contact_geom::statements::{ActionSquared, ClosedFlow, conformal_flow};
use contact_geom::{
    AsFunction, ChartVector, ContactForm, Darboux, GeometryError, Smooth, SmoothFunction, Statement,
    hamiltonian::{DarbouxField, dissipation_defect, hamiltonian_vector_field, infinitesimal_conformality},
};

/// The points at which each statement is checked on each system.
pub const SAMPLES: usize = 32;

/// A point of T\*Q x R with `|q|, |p| < 2` and `|z| < 1`.
fn phase_point(i: usize) -> ChartVector<1> {
    let u = fractions(i, 3);
    ChartVector { x: [4.0 * u[0] - 2.0].into(), y: [4.0 * u[1] - 2.0].into(), z: 2.0 * u[2] - 1.0 }
}

/// Statements 5 and 11 along flows in closed form.
pub fn closed_flows(checks: &mut Checks) {
    closed_flow(&FreeParticle::default(), checks);
    closed_flow(&HarmonicOscillator::default(), checks);
    closed_flow(&ActionSquared { c: 0.3 }, checks);
}

fn closed_flow(flow: &impl ClosedFlow, checks: &mut Checks) {
    for (i, t) in (0..SAMPLES).flat_map(|i| [0.3, 2.0].map(|t| (i, t))) {
        let residual = conformal_flow(flow, t, &phase_point(i), &gauss_legendre(t));
        for statement in [Statement::ConformalFactor, Statement::DissipatedQuantities] {
            checks.record(&Subject::continuous(statement, flow.name()), residual.map(Some));
        }
    }
}

/// Gauss and Legendre's quadrature with 16 nodes on `[0, t]`, as pairs of a time and a weight: its error is far below
/// round-off for the rates of the flows here, whose nearest pole is at a distance of two intervals.
///
/// The nodes are the roots of the Legendre polynomial, by Newton's method from Tricomi's approximation.
fn gauss_legendre(t: f64) -> Vec<(f64, f64)> {
    const NODES: u32 = 16;
    let n = f64::from(NODES);
    let node = |k: u32| {
        let mut x = (std::f64::consts::PI * (f64::from(k) + 0.75) / (n + 0.5)).cos();
        let mut slope = 0.0;
        // Quadratic from an error of 1e-4: the fourth step changes nothing.
        for _ in 0..5 {
            let (mut before, mut p) = (1.0, x);
            for j in 2..=NODES {
                let j = f64::from(j);
                (before, p) = (p, ((2.0 * j - 1.0) * x * p - (j - 1.0) * before) / j);
            }
            slope = n * (x * p - before) / (x * x - 1.0);
            x -= p / slope;
        }
        (0.5 * t * (1.0 + x), t / ((1.0 - x * x) * slope * slope))
    };
    (0..NODES).map(node).collect()
}

/// Statements 3, 4 and 6 for contact Hamiltonians that have no regular Lagrangian.
pub fn without_lagrangian(checks: &mut Checks) {
    hamiltonian("lienard", &AsFunction(&Lienard::default()), checks);
    hamiltonian("van_der_pol", &AsFunction(&VanDerPol::default()), checks);
}

fn hamiltonian(name: &'static str, h: &impl SmoothFunction<1>, checks: &mut Checks) {
    for i in 0..SAMPLES {
        let x = phase_point(i);
        for (statement, residual) in [
            (Statement::HamiltonianField, field_in_darboux_coordinates(h, &x)),
            (Statement::InfinitesimalContactomorphism, conformal_at_the_rate_of_the_reeb_field(h, &x)),
            (Statement::EnergyDecay, dissipation_defect(&Darboux, h, h, 0.0, &x)),
        ] {
            checks.record(&Subject::continuous(statement, name), residual.map(Some));
        }
    }
}

fn field_in_darboux_coordinates(h: &impl SmoothFunction<1>, x: &ChartVector<1>) -> Result<f64, GeometryError> {
    let closed = DarbouxField { hamiltonian: h, t: 0.0 }.at(x)?;
    let generic = hamiltonian_vector_field(&Darboux, h, 0.0, x)?;
    Ok(closed.minus(generic).amax() / closed.amax().max(generic.amax()))
}

fn conformal_at_the_rate_of_the_reeb_field(
    h: &impl SmoothFunction<1>,
    x: &ChartVector<1>,
) -> Result<f64, GeometryError> {
    let measured = infinitesimal_conformality(&Darboux, &DarbouxField { hamiltonian: h, t: 0.0 }, x)?;
    let rate = -h.differential(0.0, x).dot(&Darboux.reeb(x)?);
    Ok(measured.defect.max((measured.rate - rate).abs() / (1.0 + rate.abs())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_quadrature_is_exact_for_polynomials() {
        // Degree 31 is the highest for 16 nodes; each sum has 16 roundings.
        for degree in [0, 1, 7, 31] {
            let sum: f64 = gauss_legendre(2.0).iter().map(|(s, weight)| weight * s.powi(degree)).sum();
            let expected = 2f64.powi(degree + 1) / f64::from(degree + 1);
            assert!((sum - expected).abs() <= 32.0 * f64::EPSILON * expected, "{degree}: {sum} for {expected}");
        }
    }
}
