//! The integrators of the library as candidates.

use crate::candidate::{Candidate, of_library};
use crate::problems::{KEPLER, OSCILLATOR, PENDULUM, Problem, QUADRATIC, System};
use crate::row::Action;
use contact_examples::Failure;
use contact_geom::Lagrangian;
use discrete_herglotz::AnyIntegrator;
use formula_lagrangian::Formula;

/// The integrators of the library that apply to a problem, with or without the action. The flow of a discrete
/// Lagrangian always computes the action; without the action, it is ignored.
///
/// # Errors
/// Where the Lagrangian as text is invalid.
pub fn candidates(problem: &Problem, z: Action) -> Result<Vec<Box<dyn Candidate>>, Failure> {
    if let Some(text) = problem.text {
        let formula = Formula::parse(text.formula, text.coordinates, text.parameters)?;
        return match text.coordinates.len() {
            1 => Ok(of(&formula.lagrangian::<1>()?, problem, z)),
            _ => Ok(of(&formula.lagrangian::<2>()?, problem, z)),
        };
    }
    Ok(match problem.system {
        System::Oscillator => of(&OSCILLATOR, problem, z),
        System::Pendulum => of(&PENDULUM, problem, z),
        System::Kepler => of::<_, 2>(&KEPLER, problem, z),
        System::Quadratic => of(&QUADRATIC, problem, z),
        // They have forces, which are given as text.
        System::Projectile | System::DoublePendulum => Vec::new(),
    })
}

fn of<L: Lagrangian<N> + Clone + 'static, const N: usize>(
    lagrangian: &L,
    problem: &Problem,
    z: Action,
) -> Vec<Box<dyn Candidate>> {
    // Only integrators with a fixed step size: in transformed time, the number of steps is known only after the run.
    let fixed = |integrator: &AnyIntegrator| !matches!(integrator, AnyIntegrator::TransformedGauss { .. });
    let applicable = |integrator: &AnyIntegrator| fixed(integrator) && integrator.check(lagrangian).is_ok();
    let chosen = AnyIntegrator::all().into_iter().filter(applicable);
    chosen.map(|integrator| of_library(lagrangian.clone(), integrator, problem, z)).collect()
}

/// The integrators that are measured by default: one or two of each kind, as many as the legend of a diagram holds.
pub const DIAGRAMS: [&str; 10] = [
    "midpoint",
    "strang",
    "blanes_moan_6",
    "kahan_li_8",
    "sofroniou_spaletta_10",
    "midpoint_by_kahan_li_8",
    "gauss_4",
    "gauss_8",
    "gauss_12",
    "gauss_16",
];
