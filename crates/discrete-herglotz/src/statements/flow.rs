//! Statements on the Legendre transformations and on the flows.

use crate::DiscreteLagrangian;
use crate::statements::measures::{jets, pull, relative, relative_vector};
use crate::theory::{
    DiscretePath, HamiltonianFlow, discrete_flow, discrete_flow_jacobian, hamiltonian_flow, hamiltonian_flow_jacobian,
    legendre_minus, legendre_minus_inverse, legendre_plus, legendre_plus_inverse,
};
use contact_geom::{
    ChartVector, ContactForm, Darboux, DiscretePoint, EtaMinus, EtaPlus, GeometryError, PhasePoint,
    numbers::{MaxAbsOrNan, MaxOrNan},
    support::conformality_with_jacobian,
};

/// Statement 17: F+L_d is a local diffeomorphism if and only if F-L_d is, since `eta+ = sigma_d eta-` implies
/// `det T F+L_d = sigma_d^(n+1) det T F-L_d`.
pub(super) fn both_local_diffeomorphisms<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<f64, GeometryError> {
    let jet = ld.second_jet(t, x)?;
    let minus = jet.legendre_minus_jacobian().determinant();
    let plus = jet.legendre_plus_jacobian().determinant();
    let predicted = minus * jet.first.sigma().powi(N as i32 + 1);
    Ok(if minus == 0.0 || plus == 0.0 { f64::INFINITY } else { (plus - predicted).abs() / predicted.abs() })
}

/// Statement 18: `F+L_d (q0, q1, z0) = F-L_d (q1, q2, z1)` if and only if the discrete Herglotz equations hold.
pub(super) fn momentum_matching<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<f64, GeometryError> {
    let h = ld.step_size();
    let next = discrete_flow(ld, t, x)?;
    let (plus, minus) = (legendre_plus(ld, t, x)?, legendre_minus(ld, t + h, &next)?);
    // p1 depends on the round-off of q2 through W/h.
    let slope = ld.second_jet(t + h, &next)?.d12.max_abs_or_nan();
    let size = ChartVector::from(plus).max_abs_or_nan().max_or_nan(slope * next.q1.max_abs_or_nan());
    let matching = ChartVector::from(plus).minus(minus.into()).max_abs_or_nan() / size;
    // Away from a solution the difference of the momenta is the residual of the equations divided by sigma_d.
    let mut off = next;
    off.q1 += (next.q1 - next.q0) * 0.1;
    let path =
        DiscretePath::new(vec![x.q0, x.q1, off.q1]).map_err(|_| GeometryError::Undefined { what: "the path" })?;
    let residual = path.herglotz_residuals(ld, t, x.z0)?[0] / ld.jet(t + h, &off)?.sigma();
    let mismatch = plus.p - legendre_minus(ld, t + h, &off)?.p;
    let distinguishes = mismatch.max_abs_or_nan() > 1e-6 * slope * (off.q1 - next.q1).max_abs_or_nan();
    let equations = relative_vector(mismatch, residual, plus.p.max_abs_or_nan().max_or_nan(residual.max_abs_or_nan()));
    Ok(if distinguishes { matching.max_or_nan(equations) } else { f64::INFINITY })
}

/// Statement 19: the flow exists where F-L_d is a local diffeomorphism; the inverses of F-L_d and F+L_d return the
/// point.
pub(super) fn flow_exists<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<f64, GeometryError> {
    let guess = (x.q1 - x.q0) / ld.step_size();
    let minus = legendre_minus_inverse(ld, t, &legendre_minus(ld, t, x)?, &guess)?;
    let plus = legendre_plus_inverse(ld, t, &legendre_plus(ld, t, x)?, &guess)?;
    Ok(relative(minus, *x).max_or_nan(relative(plus, *x)))
}

/// Statement 20: the three expressions of Phi~_d agree.
pub(super) fn three_expressions<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<f64, GeometryError> {
    let state = legendre_minus(ld, t, x)?;
    let guess = (x.q1 - x.q0) / ld.step_size();
    let by = |expression| hamiltonian_flow(ld, t, &state, &guess, expression);
    let direct = by(HamiltonianFlow::Direct)?;
    let step = ld.forward(t, &state, &guess, &mut crate::solve::Solver::default())?;
    // The momentum is computed from rounded positions, on which it depends through W/h.
    let size = ChartVector::from(direct)
        .max_abs_or_nan()
        .max_or_nan(ld.second_jet(t, x)?.d12.max_abs_or_nan() * x.q1.max_abs_or_nan());
    let distance = |a: PhasePoint<N>| ChartVector::from(a).minus(direct.into()).max_abs_or_nan() / size;
    Ok(distance(by(HamiltonianFlow::ThroughPlus)?)
        .max_or_nan(distance(by(HamiltonianFlow::ThroughMinus)?))
        .max_or_nan(distance(step.end)))
}

/// Statement 23: `Phi_d* eta+ = (sigma_d o Phi_d) eta+` and `Phi_d* eta- = sigma_d eta-`.
pub(super) fn discrete_flow_is_conformal<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<f64, GeometryError> {
    let h = ld.step_size();
    let image = discrete_flow(ld, t, x)?;
    let jacobian = discrete_flow_jacobian(ld, t, x, &image)?;
    let (sigma, sigma_after) = (ld.jet(t, x)?.sigma(), ld.jet(t + h, &image)?.sigma());
    let (from, to) = ((*x).into(), image.into());
    // The residual is relative to the terms of the pullback, since these may cancel.
    let of = |before: ChartVector<N>, after: ChartVector<N>, sigma: f64| {
        let size = (after.max_abs_or_nan() * jacobian.max_abs_or_nan()).max_or_nan(before.max_abs_or_nan());
        pull(&jacobian, &after).minus(before.scale(sigma)).max_abs_or_nan() / size
    };
    let minus = of(EtaMinus(jets(ld, t)).eta(&from)?, EtaMinus(jets(ld, t + h)).eta(&to)?, sigma);
    let plus = of(EtaPlus(jets(ld, t)).eta(&from)?, EtaPlus(jets(ld, t + h)).eta(&to)?, sigma_after);
    Ok(minus.max_or_nan(plus))
}

/// Statement 24: `Phi~_d* eta = (sigma_d o (F-L_d)^-1) eta`.
pub(super) fn hamiltonian_flow_is_conformal<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<f64, GeometryError> {
    let (from, to) = (legendre_minus(ld, t, x)?, legendre_plus(ld, t, x)?);
    let jacobian = hamiltonian_flow_jacobian(ld, t, x)?;
    let measured = conformality_with_jacobian(&Darboux, &Darboux, &from.into(), &to.into(), &jacobian)?;
    let sigma = ld.jet(t, x)?.sigma();
    let size = (1.0 + to.p.max_abs_or_nan()) * jacobian.max_abs_or_nan();
    Ok((measured.defect * measured.pullback.max_abs_or_nan()).max_or_nan((measured.sigma - sigma).abs()) / size)
}

/// The second half of statement 39, that `sigma_d` is positive: 0 where it holds, infinity where it does not.
pub(super) fn sigma_is_positive<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<f64, GeometryError> {
    Ok(if ld.jet(t, x)?.sigma() > 0.0 { 0.0 } else { f64::INFINITY })
}
