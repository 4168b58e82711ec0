//! The integrators of the library as candidates.

use crate::candidate::{Candidate, call, of_library};
use crate::problems::{KEPLER, OSCILLATOR, PENDULUM, Problem, QUADRATIC, System};
use crate::row::Action;
use contact_examples::Failure;
use contact_geom::Lagrangian;
use discrete_herglotz::AnyIntegrator;
use formula_lagrangian::Formula;

/// What is timed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Timed {
    /// The steps of each integrator that applies.
    Steps,
    /// Whole calls: for a requested error, the first candidate, and with given steps of Gauss collocation.
    Calls,
}

/// The numbers of stages of the given steps of calls.
const STAGES: [usize; 6] = [4, 6, 8, 10, 12, 16];

/// The integrators of the library that apply to a problem, with or without the action. The flow of a discrete
/// Lagrangian always computes the action; without the action, it is ignored.
///
/// # Errors
/// Where the Lagrangian as text is invalid.
pub fn candidates(problem: &Problem, z: Action, timed: Timed) -> Result<Vec<Box<dyn Candidate>>, Failure> {
    if let Some(text) = problem.text {
        let formula = Formula::parse(text.formula, text.coordinates, text.parameters)?;
        return match text.coordinates.len() {
            1 => Ok(of(&formula.lagrangian::<1>()?, problem, z, timed)),
            _ => Ok(of(&formula.lagrangian::<2>()?, problem, z, timed)),
        };
    }
    Ok(match problem.system {
        System::Oscillator => of(&OSCILLATOR, problem, z, timed),
        System::Pendulum => of(&PENDULUM, problem, z, timed),
        System::Kepler => of::<_, 2>(&KEPLER, problem, z, timed),
        System::Quadratic => of(&QUADRATIC, problem, z, timed),
        // They have forces, which are given as text.
        System::Projectile | System::DoublePendulum => Vec::new(),
    })
}

fn of<L: Lagrangian<N> + Clone + 'static, const N: usize>(
    lagrangian: &L,
    problem: &Problem,
    z: Action,
    timed: Timed,
) -> Vec<Box<dyn Candidate>> {
    if timed == Timed::Calls {
        let given = STAGES.into_iter().map(|stages| Some(AnyIntegrator::Gauss { stages }));
        return [None].into_iter().chain(given).map(|by| call(lagrangian.clone(), by, problem, z)).collect();
    }
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
