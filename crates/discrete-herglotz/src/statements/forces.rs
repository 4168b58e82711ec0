//! Statements on forces, which the paper does not contain.

use crate::DiscreteLagrangian;
use crate::gauss::VirtualWork;
use crate::rules::Rule;
use crate::solve::Solver;
use crate::statements::measures::pull;
use crate::theory::{discrete_forces, discrete_momentum, hamiltonian_flow_jacobian, legendre_minus, legendre_plus};
use contact_geom::nalgebra::{DMatrix, SVector};
use contact_geom::{
    ChartVector, ContactForm, Darboux, DiscretePoint, GeometryError, Lagrangian, OneParameterGroup, Statement,
    Symmetry, VelocityPoint, legendre,
    numbers::{MaxAbsOrNan, MaxOrNan},
};

/// The statements on forces that [`forced_residual`] evaluates.
pub const FORCED_STATEMENTS: [Statement; 3] =
    [Statement::DiscreteForces, Statement::VirtualWork, Statement::ForcedMomentum];

/// The numbers of stages of the Gauss steps.
const STAGES: [usize; 3] = [1, 2, 5];

/// The residual of a statement on forces, for the steps of length `h` of a Lagrangian with an applied force, from a point
/// of TQ x R: those of contact Gauss collocation with 1, 2 and 5 stages, and of the quadrature rules around the point.
///
/// `None` for a statement on symmetries without a symmetry of L, which must be affine in the coordinates, and for a
/// statement that is not one of [`FORCED_STATEMENTS`].
///
/// # Errors
/// Those of the steps.
pub fn forced_residual<const N: usize>(
    statement: Statement,
    lagrangian: &impl Lagrangian<N>,
    symmetries: &[Symmetry<N>],
    h: f64,
    t: f64,
    x: &VelocityPoint<N>,
) -> Result<Option<f64>, GeometryError> {
    let undefined = |_| GeometryError::Undefined { what: "the step" };
    let gauss =
        |stages| VirtualWork::of_step(lagrangian, stages, h, t, &legendre(lagrangian, t, x), &x.v).map_err(undefined);
    if !FORCED_STATEMENTS.contains(&statement) || statement == Statement::ForcedMomentum && symmetries.is_empty() {
        return Ok(None);
    }
    let mut worst = 0.0_f64;
    if statement != Statement::DiscreteForces {
        for stages in STAGES {
            let step = gauss(stages)?;
            worst = worst.max_or_nan(match statement {
                Statement::VirtualWork => step.residual(),
                _ => momentum_of_gauss(&step, symmetries, &legendre(lagrangian, t, x)),
            });
        }
    }
    if statement != Statement::VirtualWork {
        let x = DiscretePoint { q0: x.q - x.v * (0.5 * h), q1: x.q + x.v * (0.5 * h), z0: x.z };
        let of = (t, &x, symmetries);
        for rule in Rule::ALL {
            worst = worst.max_or_nan(of_rule(statement, &rule.of(lagrangian, h).map_err(undefined)?, of)?);
        }
    }
    Ok(Some(worst))
}

/// The residual for a discrete Lagrangian.
fn of_rule<const N: usize>(
    statement: Statement,
    ld: &impl DiscreteLagrangian<N>,
    (t, x, symmetries): (f64, &DiscretePoint<N>, &[Symmetry<N>]),
) -> Result<f64, GeometryError> {
    match statement {
        Statement::DiscreteForces => contact_defect(ld, t, x),
        _ => momentum_of_rule(ld, symmetries, t, x),
    }
}

/// Statement 43: `Phi~* eta = sigma_d eta - F-.dq0 - F+.dq1`, with the linearisation of the flow; and the step of the
/// discrete Lagrangian goes from F-L_d to F+L_d, forward and backward.
fn contact_defect<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<f64, GeometryError> {
    let (from, to) = (legendre_minus(ld, t, x)?, legendre_plus(ld, t, x)?);
    let jacobian = hamiltonian_flow_jacobian(ld, t, x)?;
    let (forces, jet) = (discrete_forces(ld, t, x)?, ld.second_jet(t, x)?);
    let image = pull(&jacobian, &Darboux.eta(&to.into())?);
    // The rows of dq1, as a function of the state at the start.
    let end = DMatrix::from_fn(2 * N + 1, N, |i, j| jacobian[(j, i)]);
    let of_end = end * forces.plus;
    let mut expected = Darboux.eta(&from.into())?.scale(jet.first.sigma()).minus(ChartVector::from_fn(|i| of_end[i]));
    expected.x -= forces.minus;
    let size = (1.0 + to.p.max_abs_or_nan()) * jacobian.max_abs_or_nan();
    let defect = image.minus(expected).max_abs_or_nan() / size;

    let (guess, mut solver) = ((x.q1 - x.q0) / ld.step_size(), Solver::default());
    let forward = ld.forward(t, &from, &guess, &mut solver)?.end;
    let backward = ld.backward(t, &to, &guess, &mut solver)?.end;
    // The momentum is computed from rounded positions, on which it depends through W/h.
    let size =
        |state| ChartVector::from(state).max_abs_or_nan().max_or_nan(jet.d12.max_abs_or_nan() * x.q1.max_abs_or_nan());
    let of = |a, b| ChartVector::from(a).minus(ChartVector::from(b)).max_abs_or_nan() / size(b);
    Ok(defect.max_or_nan(of(forward, to)).max_or_nan(of(backward, from)))
}

/// Statement 45 for discrete forces: `J1 = sigma_d J0 + F-.xi(q0) + F+.xi(q1)`.
fn momentum_of_rule<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    symmetries: &[Symmetry<N>],
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<f64, GeometryError> {
    let (forces, sigma, end) = (discrete_forces(ld, t, x)?, ld.jet(t, x)?.sigma(), legendre_plus(ld, t, x)?);
    let mut worst = 0.0_f64;
    for group in symmetries {
        let before = discrete_momentum(ld, group, t, x)?;
        let (xi0, xi1) = (group.generator(&x.q0), group.generator(&x.q1));
        let terms = [sigma * before, forces.minus.dot(&xi0), forces.plus.dot(&xi1)];
        let off = group.momentum(&end.q, &end.p) - terms.iter().sum::<f64>();
        // Positions are rounded, and the momentum depends on them through W/h.
        let slope = ld.second_jet(t, x)?.d12.max_abs_or_nan() * x.q1.max_abs_or_nan();
        worst = worst.max_or_nan(off.abs() / size_of_momentum(&end.p, slope, [&xi0, &xi1]));
    }
    Ok(worst)
}

/// Statement 45 for a Gauss step: `J1 = sigma_d (J0 + h sum_j b_j rho_j f_j.xi(Q_j))`.
fn momentum_of_gauss<const N: usize>(
    step: &VirtualWork<N>,
    symmetries: &[Symmetry<N>],
    from: &contact_geom::PhasePoint<N>,
) -> f64 {
    let mut worst = 0.0_f64;
    for group in symmetries {
        let impulse = step.impulse(group);
        let expected = step.sigma * (group.momentum(&from.q, &from.p) + impulse);
        let off = group.momentum(&step.end.q, &step.end.p) - expected;
        let xi = [&group.generator(&from.q), &group.generator(&step.end.q)];
        worst = worst.max_or_nan(off.abs() / size_of_momentum(&step.end.p, from.p.max_abs_or_nan(), xi));
    }
    worst
}

/// The size of the terms of a momentum of a group.
fn size_of_momentum<const N: usize>(p: &SVector<f64, N>, other: f64, xi: [&SVector<f64, N>; 2]) -> f64 {
    p.max_abs_or_nan().max_or_nan(other) * xi[0].max_abs_or_nan().max_or_nan(xi[1].max_abs_or_nan())
}
