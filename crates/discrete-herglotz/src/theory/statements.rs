//! Section 3 of the paper as residuals: each statement is evaluated for a discrete Lagrangian at a point, relative to
//! the size of its terms.
//!
//! The residual of a true statement is round-off times the condition numbers of the matrices involved. The tolerances
//! belong to the tests that call this module.

// `f64::max` and `amax` ignore a NaN, which a check must report.
#![deny(clippy::disallowed_methods)]

use crate::{
    DiscreteLagrangian, StepError,
    theory::{
        DiscretePath, HamiltonianFlow, derived_jet, derived_second_jet, discrete_action, discrete_flow,
        discrete_flow_jacobian, discrete_momentum, discrete_symmetry_defect, hamiltonian_flow,
        hamiltonian_flow_jacobian, legendre_minus, legendre_minus_inverse, legendre_plus, legendre_plus_inverse,
    },
};
use contact_geom::nalgebra::{DMatrix, SVector};
use contact_geom::{
    ChartVector, ContactForm, Darboux, DiscretePoint, Dual, EtaMinus, EtaPlus, GeometryError, OneParameterGroup,
    PhasePoint, Scalar, SecondDiscreteJet, Smooth, Statement, Symmetry, conformality,
    numbers::{MaxAbsOrNan, MaxOrNan, max_or_nan},
    support::{conformality_with_jacobian, generic, seed},
};

/// The statements of section 3 that [`residual`] evaluates.
pub const STATEMENTS: [Statement; 16] = [
    Statement::Volume,
    Statement::ReebField,
    Statement::ActionDifferential,
    Statement::TwoSteps,
    Statement::DiscreteHerglotzPrinciple,
    Statement::DiscreteRegularity,
    Statement::MomentumMatching,
    Statement::DiscreteFlowExists,
    Statement::HamiltonianFlowExpressions,
    Statement::DiscreteContactForms,
    Statement::DiscreteFormsAreConformal,
    Statement::DiscreteFlowIsConformal,
    Statement::HamiltonianFlowIsConformal,
    Statement::DiscreteInvariance,
    Statement::DiscreteNoether,
    Statement::MidpointRule,
];

/// The residual of a statement of section 3 for a discrete Lagrangian at a time and a point of Q x Q x R.
///
/// `None` where the hypotheses of the statement do not apply (a statement on symmetries without a symmetry), and for a
/// statement that is not one of [`STATEMENTS`]. [`Statement::Volume`] and [`Statement::ReebField`] are those of section
/// 2 on Q x Q x R.
///
/// # Errors
/// Those of the discrete Lagrangian and of its forms at a point where it is not regular.
pub fn residual<const N: usize>(
    statement: Statement,
    ld: &impl DiscreteLagrangian<N>,
    symmetries: &[Symmetry<N>],
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<Option<f64>, GeometryError> {
    Ok(match statement {
        Statement::Volume => Some(volume(ld, t, x)?),
        Statement::ReebField => Some(reeb(ld, t, x)?),
        Statement::ActionDifferential => Some(action_differential(ld, t, x, 12)?),
        Statement::TwoSteps => Some(two_steps(ld, t, x)?),
        Statement::DiscreteHerglotzPrinciple => Some(principle(ld, t, x)?),
        Statement::DiscreteRegularity => Some(both_local_diffeomorphisms(ld, t, x)?),
        Statement::MomentumMatching => Some(momentum_matching(ld, t, x)?),
        Statement::DiscreteFlowExists => Some(flow_exists(ld, t, x)?),
        Statement::HamiltonianFlowExpressions => Some(three_expressions(ld, t, x)?),
        Statement::DiscreteContactForms => Some(contact_forms(ld, t, x)?),
        Statement::DiscreteFormsAreConformal => Some(forms_are_related(ld, t, x)?),
        Statement::DiscreteFlowIsConformal => Some(discrete_flow_is_conformal(ld, t, x)?),
        Statement::HamiltonianFlowIsConformal => Some(hamiltonian_flow_is_conformal(ld, t, x)?),
        Statement::DiscreteInvariance => worst(symmetries, |group| Ok(discrete_symmetry_defect(ld, group, t, x)?))?,
        Statement::DiscreteNoether => worst(symmetries, |group| momentum_is_dissipated(ld, group, t, x))?,
        Statement::MidpointRule => Some(sigma_is_positive(ld, t, x)?),
        _ => None,
    })
}

fn worst<const N: usize>(
    symmetries: &[Symmetry<N>],
    mut residual: impl FnMut(&Symmetry<N>) -> Result<f64, GeometryError>,
) -> Result<Option<f64>, GeometryError> {
    let mut worst = None;
    for group in symmetries {
        let r = residual(group)?;
        worst = Some(worst.map_or(r, |w: f64| w.max_or_nan(r)));
    }
    Ok(worst)
}

/// The difference of two elements relative to the larger of them.
fn relative<const N: usize>(a: impl Into<ChartVector<N>>, b: impl Into<ChartVector<N>>) -> f64 {
    let (a, b) = (a.into(), b.into());
    a.minus(b).max_abs_or_nan() / a.max_abs_or_nan().max_or_nan(b.max_abs_or_nan())
}

fn relative_vector<const N: usize>(a: SVector<f64, N>, b: SVector<f64, N>, size: f64) -> f64 {
    (a - b).max_abs_or_nan() / size
}

fn jets<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
) -> impl Fn(&DiscretePoint<N>) -> Result<SecondDiscreteJet<N>, GeometryError> {
    move |x| Ok(ld.second_jet(t, x)?)
}

/// F-L_d or F+L_d as a differentiable map, by automatic differentiation of the value alone.
struct Transform<'a, D> {
    ld: &'a D,
    t: f64,
    plus: bool,
}

impl<const N: usize, D: DiscreteLagrangian<N>> Smooth<N> for Transform<'_, D> {
    fn at<T: Scalar>(&self, x: &ChartVector<N, T>) -> Result<ChartVector<N, T>, GeometryError> {
        let l = self.ld.value(self.t, &seed(x).into())?;
        Ok(if self.plus {
            ChartVector { x: x.y, y: l.d.y, z: x.z + l.re }
        } else {
            let sigma = l.d.z + 1.0;
            ChartVector { x: x.x, y: l.d.x.map(|d| -d / sigma), z: x.z }
        })
    }
}

/// The pullbacks of Darboux' form and of its differential along a transform by definition, `J^T eta` and `J^T d eta J`.
fn pulled_back<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    x: &DiscretePoint<N>,
    plus: bool,
) -> Result<(ChartVector<N>, DMatrix<f64>), GeometryError> {
    let (image, jacobian) = Transform { ld, t, plus }.with_jacobian(&(*x).into())?;
    let d_eta = jacobian.transpose() * Darboux.d_eta(&image)? * &jacobian;
    Ok((pull(&jacobian, &Darboux.eta(&image)?), d_eta))
}

fn form_residual<const N: usize>(
    closed: &impl ContactForm<N>,
    (eta, d_eta): (ChartVector<N>, DMatrix<f64>),
    x: &ChartVector<N>,
) -> Result<f64, GeometryError> {
    Ok(relative(closed.eta(x)?, eta).max_or_nan((closed.d_eta(x)? - &d_eta).max_abs_or_nan() / d_eta.max_abs_or_nan()))
}

/// Statement 1 on Q x Q x R: the volume forms of eta+ and eta- do not vanish, and their closed form agrees with the
/// generic one.
fn volume<const N: usize>(ld: &impl DiscreteLagrangian<N>, t: f64, x: &DiscretePoint<N>) -> Result<f64, GeometryError> {
    let point = (*x).into();
    let of = |closed: f64, generic: f64| {
        if generic == 0.0 { f64::INFINITY } else { (closed - generic).abs() / generic.abs() }
    };
    let (minus, plus) = (EtaMinus(jets(ld, t)), EtaPlus(jets(ld, t)));
    Ok(of(minus.volume(&point)?, generic::volume(&minus, &point)?)
        .max_or_nan(of(plus.volume(&point)?, generic::volume(&plus, &point)?)))
}

/// Statement 2 on Q x Q x R: Reeb fields, flat and sharp of eta+ and eta-, in closed form against the generic
/// computation and by definition.
fn reeb<const N: usize>(ld: &impl DiscreteLagrangian<N>, t: f64, x: &DiscretePoint<N>) -> Result<f64, GeometryError> {
    fn of<const N: usize>(form: &impl ContactForm<N>, x: &ChartVector<N>) -> Result<f64, GeometryError> {
        let (eta, reeb) = (form.eta(x)?, form.reeb(x)?);
        let mut worst = relative(reeb, generic::reeb(form, x)?)
            .max_or_nan((eta.dot(&reeb) - 1.0).abs() / eta.max_abs_or_nan().max_or_nan(1.0));
        worst = worst.max_or_nan(
            form.flat(x, &reeb)?.minus(eta).max_abs_or_nan()
                / (form.d_eta(x)?.max_abs_or_nan() * reeb.max_abs_or_nan()),
        );
        for j in 0..ChartVector::<N>::DIMENSION {
            let e = ChartVector::from_fn(|i| f64::from(u8::from(i == j)));
            worst = worst.max_or_nan(relative(form.sharp(x, &form.flat(x, &e)?)?, e));
        }
        Ok(worst)
    }
    let point = (*x).into();
    Ok(of(&EtaMinus(jets(ld, t)), &point)?.max_or_nan(of(&EtaPlus(jets(ld, t)), &point)?))
}

/// A path with this number of steps near the points of `x`, with velocities of the same size; it is not a solution.
fn wiggly_path<const N: usize>(x: &DiscretePoint<N>, steps: usize) -> Result<DiscretePath<N>, GeometryError> {
    let stride = x.q1 - x.q0;
    let points = (0..=steps).map(|k| x.q0 + stride * (0.6 * (1.3 * k as f64).sin() + 0.2 * k as f64)).collect();
    DiscretePath::new(points).map_err(|_| GeometryError::Undefined { what: "the path" })
}

/// The differential of A_d by dual numbers through the whole recursion, with the directions of one point at a time.
fn differentiated<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    path: &DiscretePath<N>,
    z0: f64,
) -> Result<Vec<SVector<f64, N>>, StepError> {
    let moving = |k: usize| -> Vec<SVector<Dual<f64, SVector<f64, N>>, N>> {
        let seeded = |j: usize, q: &SVector<f64, N>| {
            SVector::from_fn(|i, _| {
                let mut c: Dual<f64, SVector<f64, N>> = Dual::constant(q[i]);
                c.d[i] = f64::from(u8::from(j == k));
                c
            })
        };
        path.points().iter().enumerate().map(|(j, q)| seeded(j, q)).collect()
    };
    (0..path.points().len()).map(|k| Ok(discrete_action(ld, t, &moving(k), Dual::constant(z0))?.d)).collect()
}

/// Statement 13: the paper's formula for dA_d against the derivative of A_d, for paths of 1 to `most` steps; and
/// `z_{k+1} - z_k = L_d(q_k, q_{k+1}, z_k)`.
fn action_differential<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    x: &DiscretePoint<N>,
    most: usize,
) -> Result<f64, GeometryError> {
    let mut worst: f64 = 0.0;
    for steps in [1, 2, 3, most] {
        let path = wiggly_path(x, steps)?;
        let (formula, derived) = (path.action_differential(ld, t, x.z0)?, differentiated(ld, t, &path, x.z0)?);
        let size = ld
            .jet(t, x)?
            .d1
            .max_abs_or_nan()
            .max_or_nan(derived.iter().map(MaxAbsOrNan::max_abs_or_nan).fold(0.0, max_or_nan));
        for (a, b) in formula.iter().zip(&derived) {
            worst = worst.max_or_nan(relative_vector(*a, *b, size));
        }
        let z = path.actions(ld, t, x.z0)?;
        let end = discrete_action(ld, t, path.points(), x.z0)?;
        worst = worst.max_or_nan((z[steps] - end).abs() / (1.0 + end.abs()));
    }
    Ok(worst)
}

/// Statement 14: the remark on N = 2, its formula written out.
fn two_steps<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<f64, GeometryError> {
    let path = wiggly_path(x, 2)?;
    let q = path.points();
    let first = ld.jet(t, &DiscretePoint { q0: q[0], q1: q[1], z0: x.z0 })?;
    let second = ld.jet(t + ld.step_size(), &DiscretePoint { q0: q[1], q1: q[2], z0: x.z0 + first.value })?;
    let remark = [first.d1 * (1.0 + second.dz), second.d1 + first.d2 * (1.0 + second.dz), second.d2];
    let derived = differentiated(ld, t, &path, x.z0)?;
    let size = remark.iter().map(MaxAbsOrNan::max_abs_or_nan).fold(first.d2.max_abs_or_nan(), max_or_nan);
    Ok(remark.iter().zip(&derived).map(|(a, b)| relative_vector(*a, *b, size)).fold(0.0, max_or_nan))
}

/// Statement 15: a path is critical for A_d with fixed ends if and only if it solves the discrete Herglotz equations.
///
/// Both directions are checked. Along the discrete flow the interior part of dA_d, differentiated independently,
/// vanishes; on a path that is not a solution it is the residual of the equations times the product of the later
/// sigma_d, none of which vanishes.
fn principle<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<f64, GeometryError> {
    let h = ld.step_size();
    let (mut points, mut step) = (vec![x.q0, x.q1], *x);
    for k in 0..2 {
        step = discrete_flow(ld, t + k as f64 * h, &step)?;
        points.push(step.q1);
    }
    let solution = DiscretePath::new(points).map_err(|_| GeometryError::Undefined { what: "the path" })?;
    let size = ld.jet(t, x)?.d1.max_abs_or_nan().max_or_nan(ld.jet(t, x)?.d2.max_abs_or_nan());
    // Round-off in a point of the path changes the residuals at its neighbours by D12 times that round-off.
    let second = ld.second_jet(t, x)?;
    let largest = solution.points().iter().map(MaxAbsOrNan::max_abs_or_nan).fold(0.0, max_or_nan);
    let size_of_solution = size.max_or_nan(second.d12.max_abs_or_nan() * largest);
    let differential = differentiated(ld, t, &solution, x.z0)?;
    let mut worst = differential[1..3].iter().map(|d| d.max_abs_or_nan() / size_of_solution).fold(0.0, max_or_nan);

    let path = wiggly_path(x, 5)?;
    let (differential, residuals) = (differentiated(ld, t, &path, x.z0)?, path.herglotz_residuals(ld, t, x.z0)?);
    let z = path.actions(ld, t, x.z0)?;
    let mut later = 1.0;
    for k in (1..5).rev() {
        worst = worst.max_or_nan(relative_vector(
            differential[k],
            residuals[k - 1] * later,
            size.max_or_nan(differential[k].max_abs_or_nan()),
        ));
        let at = DiscretePoint { q0: path.points()[k], q1: path.points()[k + 1], z0: z[k] };
        let sigma = ld.jet(t + k as f64 * h, &at)?.sigma();
        if sigma == 0.0 {
            return Ok(f64::INFINITY);
        }
        later *= sigma;
    }
    Ok(worst)
}

/// Statement 17: F+L_d is a local diffeomorphism if and only if F-L_d is, since `eta+ = sigma_d eta-` implies
/// `det T F+L_d = sigma_d^(n+1) det T F-L_d`.
fn both_local_diffeomorphisms<const N: usize>(
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
fn momentum_matching<const N: usize>(
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
fn flow_exists<const N: usize>(
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
fn three_expressions<const N: usize>(
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

/// Statement 21: eta+ and eta- in closed form are the pullbacks of Darboux' form. Their jets and the linearised
/// transforms agree with automatic differentiation of the value.
fn contact_forms<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<f64, GeometryError> {
    let point = (*x).into();
    let minus = form_residual(&EtaMinus(jets(ld, t)), pulled_back(ld, t, x, false)?, &point)?;
    let plus = form_residual(&EtaPlus(jets(ld, t)), pulled_back(ld, t, x, true)?, &point)?;
    let (first, derived) = (ld.jet(t, x)?, derived_jet(ld, t, x)?);
    let of = |jet: contact_geom::DiscreteJet<N>| ChartVector { x: jet.d1, y: jet.d2, z: jet.dz };
    let (second, derived_second) = (ld.second_jet(t, x)?, derived_second_jet(ld, t, x)?);
    let blocks = (second.d11 - derived_second.d11)
        .max_abs_or_nan()
        .max_or_nan((second.d12 - derived_second.d12).max_abs_or_nan());
    let blocks = blocks
        .max_or_nan((second.d22 - derived_second.d22).max_abs_or_nan())
        .max_or_nan((second.d1z - derived_second.d1z).max_abs_or_nan());
    let blocks = blocks
        .max_or_nan((second.d2z - derived_second.d2z).max_abs_or_nan())
        .max_or_nan((second.dzz - derived_second.dzz).abs());
    let size = derived_second
        .d11
        .max_abs_or_nan()
        .max_or_nan(derived_second.d12.max_abs_or_nan())
        .max_or_nan(derived_second.d22.max_abs_or_nan());
    let jacobian = |plus| -> Result<f64, GeometryError> {
        let closed = if plus { second.legendre_plus_jacobian() } else { second.legendre_minus_jacobian() };
        let (_, derived) = Transform { ld, t, plus }.with_jacobian(&point)?;
        Ok((&closed - &derived).max_abs_or_nan() / derived.max_abs_or_nan())
    };
    let transforms = jacobian(false)?.max_or_nan(jacobian(true)?);
    Ok(minus
        .max_or_nan(plus)
        .max_or_nan(transforms)
        .max_or_nan(relative(of(first), of(derived)))
        .max_or_nan(blocks / size))
}

/// Statement 22: `eta+ = sigma_d eta-` and `Phi_d* eta- = eta+`.
fn forms_are_related<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<f64, GeometryError> {
    let h = ld.step_size();
    let point = (*x).into();
    let (minus, plus) = (EtaMinus(jets(ld, t)), EtaPlus(jets(ld, t)));
    let sigma = ld.jet(t, x)?.sigma();
    // Both forms are computed by definition, so that the identity is not built into the closed formulas.
    let (by_plus, by_minus) = (pulled_back(ld, t, x, true)?.0, pulled_back(ld, t, x, false)?.0);
    let proportional = relative(by_plus, by_minus.scale(sigma));
    let image = discrete_flow(ld, t, x)?;
    let jacobian = discrete_flow_jacobian(ld, t, x, &image)?;
    let next = EtaMinus(jets(ld, t + h));
    let pullback = pull(&jacobian, &next.eta(&image.into())?);
    let size = next.eta(&image.into())?.max_abs_or_nan() * jacobian.max_abs_or_nan();
    let related =
        pullback.minus(plus.eta(&point)?).max_abs_or_nan() / size.max_or_nan(plus.eta(&point)?.max_abs_or_nan());
    Ok(proportional.max_or_nan(related).max_or_nan(relative(plus.eta(&point)?, minus.eta(&point)?.scale(sigma))))
}

/// The pullback of a covector along a Jacobian.
fn pull<const N: usize>(jacobian: &DMatrix<f64>, covector: &ChartVector<N>) -> ChartVector<N> {
    let image = jacobian.tr_mul(&covector.to_vector());
    ChartVector::from_fn(|i| image[i])
}

/// Statement 23: `Phi_d* eta+ = (sigma_d o Phi_d) eta+` and `Phi_d* eta- = sigma_d eta-`.
fn discrete_flow_is_conformal<const N: usize>(
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
fn hamiltonian_flow_is_conformal<const N: usize>(
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

/// The lift of a group element to Q x Q x R.
struct Diagonal<'a, const N: usize>(&'a Symmetry<N>);

impl<const N: usize> Smooth<N> for Diagonal<'_, N> {
    fn at<T: Scalar>(&self, x: &ChartVector<N, T>) -> Result<ChartVector<N, T>, GeometryError> {
        Ok(self.0.on_discrete(T::from(0.6), x))
    }
}

/// Statement 26: the lifted action preserves eta+ and eta-, and `J_d o Phi_d = sigma_d J_d`.
fn momentum_is_dissipated<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    group: &Symmetry<N>,
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<f64, GeometryError> {
    let point = (*x).into();
    let (minus, plus) = (EtaMinus(jets(ld, t)), EtaPlus(jets(ld, t)));
    let (on_minus, on_plus) = (
        conformality(&minus, &minus, &Diagonal(group), &point)?,
        conformality(&plus, &plus, &Diagonal(group), &point)?,
    );
    let contact = on_minus
        .defect
        .max_or_nan(on_plus.defect)
        .max_or_nan((on_minus.sigma - 1.0).abs())
        .max_or_nan((on_plus.sigma - 1.0).abs());
    let h = ld.step_size();
    let image = discrete_flow(ld, t, x)?;
    let (before, after) = (discrete_momentum(ld, group, t, x)?, discrete_momentum(ld, group, t + h, &image)?);
    // p1 is computed from rounded positions: its error is W/h times their round-off, and J_d multiplies it by the
    // generator.
    let xi = group.generator(&image.q0).max_abs_or_nan();
    let size =
        before.abs().max_or_nan(xi * ld.second_jet(t + h, &image)?.d12.max_abs_or_nan() * image.q1.max_abs_or_nan());
    let sign = (before + minus.eta(&point)?.x.dot(&group.generator(&x.q0))).abs() / size;
    Ok(contact.max_or_nan(sign).max_or_nan((after - ld.jet(t, x)?.sigma() * before).abs() / size))
}

/// The second half of statement 39, that `sigma_d` is positive: 0 where it holds, infinity where it does not.
fn sigma_is_positive<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    t: f64,
    x: &DiscretePoint<N>,
) -> Result<f64, GeometryError> {
    Ok(if ld.jet(t, x)?.sigma() > 0.0 { 0.0 } else { f64::INFINITY })
}
