//! Residuals of the statements of the paper's section 2, and of those on forces and impacts: each statement is
//! evaluated at a point of a system, relative to the size of its terms.
//!
//! The residual of a true statement is round-off times the condition numbers of the matrices involved. Tolerances are
//! set by the tests, not by this module.

// `f64::max` and `amax` discard a NaN, which would make a check pass.
#![deny(clippy::disallowed_methods)]

use crate::switching::Impact;
use crate::{
    ChartVector, ContactForm, Darboux, Derivatives, Dual, Energy, Form, GeometryError, HerglotzField, Lagrangian,
    LagrangianForm, Legendre, LiftedAction, NoetherMomentum, OneParameterGroup, PhasePoint, Quotient, Scalar, Smooth,
    SmoothFunction, Statement, VelocityPoint, conformality,
    hamiltonian::{
        DarbouxBracket, DarbouxField, conformal_factor_along, dissipation_defect, hamiltonian_vector_field,
        infinitesimal_conformality, jacobi_bracket, lie_bracket, lie_derivative,
    },
    herglotz_field, legendre, legendre_jacobian,
    numbers::{MaxAbsOrNan, MaxOrNan},
    regularity,
    support::generic,
};
use nalgebra::SVector;

mod forces;
mod impacts;
mod system;

pub use forces::AnyForce;
pub use system::System;

/// The statements of section 2, and on forces and impacts, that [`residual`] evaluates.
pub const STATEMENTS: [Statement; 13] = [
    Statement::Volume,
    Statement::ReebField,
    Statement::HamiltonianField,
    Statement::InfinitesimalContactomorphism,
    Statement::EnergyDecay,
    Statement::Regularity,
    Statement::HerglotzField,
    Statement::LegendreTransformation,
    Statement::DissipatedQuantities,
    Statement::Noether,
    Statement::ForcedEnergy,
    Statement::ElasticImpact,
    Statement::ConformalImpact,
];

/// The factor of the law of statement 47.
const CONFORMAL_IMPACT: f64 = 0.9;

/// The residual of a statement of section 2, or on forces and impacts, for a system at a time and a point of TQ x R;
/// `None` where the statement's hypotheses do not apply, as for Noether's theorem without a symmetry, or where it is not
/// one of [`STATEMENTS`].
///
/// # Errors
/// Those of the forms at a point where the system is not regular.
pub fn residual<const N: usize>(
    statement: Statement,
    system: &impl System<N>,
    t: f64,
    x: &VelocityPoint<N>,
) -> Result<Option<f64>, GeometryError> {
    Ok(match statement {
        Statement::Volume => Some(volume(system, t, x)?),
        Statement::ReebField => Some(reeb(system, t, x)?),
        Statement::HamiltonianField => Some(hamiltonian_field(system, t, x)?),
        Statement::InfinitesimalContactomorphism => Some(infinitesimal_conformal(system, t, x)?),
        Statement::EnergyDecay => Some(energy_decay(system, t, x)?),
        Statement::Regularity => Some(regular_iff_contact(system, t, x)?),
        Statement::HerglotzField => Some(second_order_equation(system, t, x)?),
        Statement::LegendreTransformation => Some(legendre_is_contact(system, t, x)?),
        Statement::DissipatedQuantities => Some(dissipated_quantities(system, t, x)?),
        Statement::Noether => noether(system, t, x)?,
        Statement::ForcedEnergy => Some(forces::forced_energy(system, t, x)?),
        Statement::ElasticImpact => Some(impacts::impact(system, Impact::Elastic, t, x)?),
        Statement::ConformalImpact => Some(impacts::impact(system, Impact::Conformal(CONFORMAL_IMPACT), t, x)?),
        _ => None,
    })
}

/// A function without symmetry on a contact manifold, for statements about any `f`: a sine plus a cubic, whose
/// coefficients depend on the parameter.
#[derive(Clone, Copy, Debug)]
pub struct AnyFunction(pub f64);

impl<const N: usize> SmoothFunction<N> for AnyFunction {
    fn value<T: Scalar>(&self, _t: T, x: &ChartVector<N, T>) -> T {
        let mut phase = T::from(self.0) + x.z * 0.4;
        let mut sum = x.z * self.0 + 0.3;
        for i in 0..N {
            let c = (self.0 * (1.7 + i as f64)).sin();
            phase += x.x[i] * 0.5 + x.y[i] * (0.7 * c);
            sum += x.x[i] * c - x.y[i] * (0.4 + 0.1 * i as f64);
        }
        phase.sin() + sum * sum * (x.z * 0.2 + 1.0) * 0.3
    }
}

/// The Hamiltonian of a system that has one in closed form.
pub struct SystemHamiltonian<'a, S>(pub &'a S);

impl<const N: usize, S: System<N>> SmoothFunction<N> for SystemHamiltonian<'_, S> {
    fn value<T: Scalar>(&self, t: T, x: &ChartVector<N, T>) -> T {
        // Constructed only where `hamiltonian` is known, which does not depend on the point.
        self.0.hamiltonian(t, &(*x).into()).unwrap_or_else(T::zero)
    }
}

/// The Hamiltonian of a system as a function on T\*Q x R, where it is known in closed form.
pub fn known_hamiltonian<const N: usize, S: System<N>>(system: &S) -> Option<SystemHamiltonian<'_, S>> {
    let (t, x) = system.sample(&vec![0.5; 2 * N + 2]);
    system.hamiltonian(t, &PhasePoint { q: x.q, p: x.v, z: x.z }).map(|_| SystemHamiltonian(system))
}

/// The difference of two elements relative to the larger of them, or to `least` where both are smaller.
fn relative<const N: usize>(a: ChartVector<N>, b: ChartVector<N>, least: f64) -> f64 {
    a.minus(b).max_abs_or_nan() / a.max_abs_or_nan().max_or_nan(b.max_abs_or_nan()).max_or_nan(least)
}

/// The difference of two numbers relative to the larger of them, or to `least` where both are smaller.
fn relative_number(a: f64, b: f64, least: f64) -> f64 {
    (a - b).abs() / a.abs().max_or_nan(b.abs()).max_or_nan(least)
}

/// The residual of flat, sharp and Reeb field of one form: the closed expressions against the generic ones, and against
/// their definitions.
fn form_residual<const N: usize>(form: &impl ContactForm<N>, x: &ChartVector<N>) -> Result<f64, GeometryError> {
    let (eta, d_eta, reeb) = (form.eta(x)?, form.d_eta(x)?, form.reeb(x)?);
    let contraction = crate::forms::smooth::apply_transposed(&d_eta, &reeb).max_abs_or_nan()
        / (d_eta.max_abs_or_nan() * reeb.max_abs_or_nan());
    let mut worst = contraction
        .max_or_nan((eta.dot(&reeb) - 1.0).abs() / (eta.max_abs_or_nan() * reeb.max_abs_or_nan()).max_or_nan(1.0));
    worst = worst.max_or_nan(relative(reeb, generic::reeb(form, x)?, 0.0));
    worst = worst.max_or_nan(relative(form.flat(x, &reeb)?, eta, 0.0));
    for j in 0..ChartVector::<N>::DIMENSION {
        let e = ChartVector::from_fn(|i| f64::from(u8::from(i == j)));
        let flat = form.flat(x, &e)?;
        worst = worst.max_or_nan(relative(flat, generic::flat(form, x, &e)?, 0.0));
        worst = worst.max_or_nan(relative(form.sharp(x, &flat)?, e, 0.0)).max_or_nan(relative(
            generic::sharp(form, x, &flat)?,
            e,
            0.0,
        ));
    }
    Ok(worst)
}

/// The forms of a system with their points: the point of the Darboux form, the form eta_L, and its point.
fn forms<'a, const N: usize, L: Lagrangian<N>>(
    lagrangian: &'a L,
    t: f64,
    x: &VelocityPoint<N>,
) -> (ChartVector<N>, LagrangianForm<'a, L>, ChartVector<N>) {
    (legendre(lagrangian, t, x).into(), LagrangianForm { lagrangian, t }, (*x).into())
}

/// The difference of the closed and the generic volume of a form; infinite where the volume vanishes.
fn volume_residual<const N: usize>(form: &impl ContactForm<N>, x: &ChartVector<N>) -> Result<f64, GeometryError> {
    let (closed, generic) = (form.volume(x)?, generic::volume(form, x)?);
    Ok(if generic == 0.0 { f64::INFINITY } else { (closed - generic).abs() / generic.abs() })
}

/// Statement 1: `eta ^ (d eta)^n` is a volume form on T\*Q x R and TQ x R.
fn volume<const N: usize>(system: &impl System<N>, t: f64, x: &VelocityPoint<N>) -> Result<f64, GeometryError> {
    let (phase, eta_l, velocity) = forms(system, t, x);
    Ok(volume_residual(&Darboux, &phase)?.max_or_nan(volume_residual(&eta_l, &velocity)?))
}

/// Statement 2: the Reeb field; flat and sharp are inverse; `flat(R) = eta`; `R = d/dz` in Darboux coordinates.
fn reeb<const N: usize>(system: &impl System<N>, t: f64, x: &VelocityPoint<N>) -> Result<f64, GeometryError> {
    let (phase, eta_l, velocity) = forms(system, t, x);
    let dz = ChartVector { x: SVector::zeros(), y: SVector::zeros(), z: 1.0 };
    let darboux = relative(generic::reeb(&Darboux, &phase)?, dz, 0.0).max_or_nan(form_residual(&Darboux, &phase)?);
    // Compare d eta_L in closed form with the derivative of its components.
    let (closed, derived) = (eta_l.d_eta(&velocity)?, Form(&eta_l).d_eta(&velocity)?);
    let d_eta = (&closed - &derived).max_abs_or_nan() / derived.max_abs_or_nan();
    Ok(darboux.max_or_nan(d_eta).max_or_nan(form_residual(&eta_l, &velocity)?))
}

/// The residual of `flat(X_f) = df - (f + R(f)) eta` and `f = -eta(X_f)`, for one form and one function.
fn hamiltonian_field_residual<const N: usize>(
    form: &impl ContactForm<N>,
    f: &impl SmoothFunction<N>,
    t: f64,
    x: &ChartVector<N>,
) -> Result<f64, GeometryError> {
    let field = hamiltonian_vector_field(form, f, t, x)?;
    let (value, df, eta) = (f.value(t, x), f.differential(t, x), form.eta(x)?);
    let contracted = df.minus(eta.scale(value + df.dot(&form.reeb(x)?)));
    let size = df.max_abs_or_nan().max_or_nan(contracted.max_abs_or_nan());
    let flat = form.flat(x, &field)?.minus(contracted).max_abs_or_nan() / size;
    let terms = eta.x.abs().dot(&field.x.abs()) + eta.y.abs().dot(&field.y.abs()) + (eta.z * field.z).abs();
    Ok(flat.max_or_nan((value + eta.dot(&field)).abs() / terms.max_or_nan(value.abs())))
}

/// Statement 3: the contact Hamiltonian vector field, of E_L on TQ x R and of any f on both spaces, and its closed form
/// in Darboux coordinates.
fn hamiltonian_field<const N: usize>(
    system: &impl System<N>,
    t: f64,
    x: &VelocityPoint<N>,
) -> Result<f64, GeometryError> {
    let (phase, eta_l, velocity) = forms(system, t, x);
    let any = AnyFunction(0.37);
    let closed = DarbouxField { hamiltonian: &any, t }.at(&phase)?;
    Ok(relative(closed, hamiltonian_vector_field(&Darboux, &any, t, &phase)?, 0.0)
        .max_or_nan(hamiltonian_field_residual(&Darboux, &any, t, &phase)?)
        .max_or_nan(hamiltonian_field_residual(&eta_l, &any, t, &velocity)?)
        .max_or_nan(hamiltonian_field_residual(&eta_l, &Energy(system), t, &velocity)?))
}

/// A function of `(q, p)` alone, for an infinitesimal strict contactomorphism: `R(f) = 0`.
struct WithoutAction(AnyFunction);

impl<const N: usize> SmoothFunction<N> for WithoutAction {
    fn value<T: Scalar>(&self, t: T, x: &ChartVector<N, T>) -> T {
        self.0.value(t, &ChartVector { z: T::zero(), ..*x })
    }
}

/// The residual of `L_X eta = -R(f) eta` for `X = X_f`.
fn conformal_residual<const N: usize, F: Smooth<N> + ContactForm<N>>(
    form: &F,
    field: &impl Smooth<N>,
    f: &impl SmoothFunction<N>,
    t: f64,
    x: &ChartVector<N>,
) -> Result<f64, GeometryError> {
    let measured = infinitesimal_conformality(form, field, x)?;
    let rate = -f.differential(t, x).dot(&form.reeb(x)?);
    let size = 1.0 + lie_derivative(form, field, x)?.max_abs_or_nan();
    Ok(measured.defect.max_or_nan((measured.rate - rate).abs() / size))
}

/// Statement 4: `L_{X_f} eta = -R(f) eta`, strict where `R(f) = 0`, and `X_{f,g} = [X_f, X_g]`, on T\*Q x R; the first
/// for xi_L on TQ x R.
fn infinitesimal_conformal<const N: usize>(
    system: &impl System<N>,
    t: f64,
    x: &VelocityPoint<N>,
) -> Result<f64, GeometryError> {
    let (phase, eta_l, velocity) = forms(system, t, x);
    let (f, g) = (AnyFunction(0.37), AnyFunction(1.31));
    let field = |h| DarbouxField { hamiltonian: h, t };
    let mut worst = conformal_residual(&Darboux, &field(&f), &f, t, &phase)?;
    let strict = WithoutAction(f);
    let strict_field = DarbouxField { hamiltonian: &strict, t };
    let change = lie_derivative(&Darboux, &strict_field, &phase)?;
    worst = worst.max_or_nan(change.max_abs_or_nan() / (1.0 + strict_field.at(&phase)?.max_abs_or_nan()));
    worst = worst.max_or_nan(conformal_residual(
        &eta_l,
        &HerglotzField { lagrangian: system, t },
        &Energy(system),
        t,
        &velocity,
    )?);
    let bracket = DarbouxBracket { f: &f, g: &g };
    let commutator = lie_bracket(&field(&f), &field(&g), &phase)?;
    worst = worst.max_or_nan(relative(DarbouxField { hamiltonian: &bracket, t }.at(&phase)?, commutator, 1.0));
    let forward = jacobi_bracket(&Darboux, &f, &g, t, &phase)?;
    let backward = jacobi_bracket(&Darboux, &g, &f, t, &phase)?;
    worst = worst.max_or_nan(relative_number(forward, bracket.value(t, &phase), 1.0));
    Ok(worst.max_or_nan(relative_number(forward, -backward, 1.0)))
}

/// Statement 6: `X_H(H) = -R(H) H`, for E_L and any f.
fn energy_decay<const N: usize>(system: &impl System<N>, t: f64, x: &VelocityPoint<N>) -> Result<f64, GeometryError> {
    let (phase, eta_l, velocity) = forms(system, t, x);
    let (energy, any) = (Energy(system), AnyFunction(0.37));
    Ok(dissipation_defect(&eta_l, &energy, &energy, t, &velocity)?
        .max_or_nan(dissipation_defect(&Darboux, &any, &any, t, &phase)?))
}

/// Statement 7: L is regular if and only if eta_L is contact, since `eta_L ^ (d eta_L)^n` is `det W` times the
/// canonical volume; the formula for R_L in terms of W.
fn regular_iff_contact<const N: usize>(
    system: &impl System<N>,
    t: f64,
    x: &VelocityPoint<N>,
) -> Result<f64, GeometryError> {
    let (_, eta_l, velocity) = forms(system, t, x);
    let mut determinant = generic::volume(&Darboux, &velocity)?;
    let h = system.hessian(t, x);
    determinant *= nalgebra::DMatrix::from_fn(N, N, |i, j| h.vv[(i, j)]).determinant();
    if regularity(system, t, x).smallest == 0.0 {
        return Ok(f64::INFINITY);
    }
    let reeb = eta_l.reeb(&velocity)?;
    let through_w = (h.vv * reeb.y + h.vz).max_abs_or_nan() / h.vv.max_abs_or_nan().max_or_nan(h.vz.max_abs_or_nan());
    Ok(relative_number(generic::volume(&eta_l, &velocity)?, determinant, 0.0).max_or_nan(through_w))
}

/// Statement 8: `xi_L = X_{E_L}` is a second-order equation that solves Herglotz' equations.
///
/// `X_{E_L}` is evaluated at a fixed time. The comparison therefore requires that `L_v` does not depend on time
/// explicitly, which holds in the whole catalogue.
fn second_order_equation<const N: usize>(
    system: &impl System<N>,
    t: f64,
    x: &VelocityPoint<N>,
) -> Result<f64, GeometryError> {
    let (_, eta_l, velocity) = forms(system, t, x);
    let field = herglotz_field(system, t, x)?;
    let hamiltonian = hamiltonian_vector_field(&eta_l, &Energy(system), t, &velocity)?;
    let second_order = (field.x - x.v).max_abs_or_nan().max_or_nan((hamiltonian.x - x.v).max_abs_or_nan())
        / (1.0 + x.v.max_abs_or_nan());
    // d/dt L_v along the field, by dual numbers in its direction.
    let along = |re: f64, d: f64| Dual { re, d: SVector::<f64, 1>::new(d) };
    let moving = VelocityPoint {
        q: SVector::<_, N>::from_fn(|i, _| along(x.q[i], field.x[i])),
        v: SVector::from_fn(|i, _| along(x.v[i], field.y[i])),
        z: along(x.z, field.z),
    };
    let g = system.gradient(along(t, 1.0), &moving);
    let mut herglotz: f64 = (field.z - system.value(t, &x.q, &x.v, x.z)).abs() / (1.0 + field.z.abs());
    for i in 0..N {
        let terms = [g.y[i].d[0], g.x[i].re, g.y[i].re * g.z.re];
        let size = 1.0 + terms.iter().fold(0.0, |m: f64, a| m.max_or_nan(a.abs()));
        herglotz = herglotz.max_or_nan((terms[0] - terms[1] - terms[2]).abs() / size);
    }
    Ok(relative(field, hamiltonian, 1.0).max_or_nan(second_order).max_or_nan(herglotz))
}

/// Statement 9: `FL* eta_Q = eta_L`; and where H is known, `E_L = H o FL` and `FL_* xi_L = X_H`.
fn legendre_is_contact<const N: usize>(
    system: &impl System<N>,
    t: f64,
    x: &VelocityPoint<N>,
) -> Result<f64, GeometryError> {
    let (phase, eta_l, velocity) = forms(system, t, x);
    let map = Legendre { lagrangian: system, t };
    let pullback = conformality(&eta_l, &Darboux, &map, &velocity)?;
    let mut worst = pullback.defect.max_or_nan((pullback.sigma - 1.0).abs());
    let jacobian = legendre_jacobian(system, t, x);
    let (_, derived) = map.with_jacobian(&velocity)?;
    worst = worst.max_or_nan((&jacobian - &derived).max_abs_or_nan() / derived.max_abs_or_nan());
    if let Some(h) = known_hamiltonian(system) {
        let energy = Energy(system).value(t, &velocity);
        worst = worst.max_or_nan(relative_number(energy, h.value(t, &phase), 1.0));
        let pushed = crate::forms::smooth::apply(&jacobian, &herglotz_field(system, t, x)?);
        worst = worst.max_or_nan(relative(pushed, DarbouxField { hamiltonian: &h, t }.at(&phase)?, 1.0));
    }
    Ok(worst)
}

/// Statement 11, infinitesimally: E_L is dissipated, and quotients of two dissipated quantities are conserved. The
/// residual is infinite if the defect of a function that is not dissipated is not detected.
fn dissipated_quantities<const N: usize>(
    system: &impl System<N>,
    t: f64,
    x: &VelocityPoint<N>,
) -> Result<f64, GeometryError> {
    let (_, eta_l, velocity) = forms(system, t, x);
    let energy = Energy(system);
    let mut worst = dissipation_defect(&eta_l, &energy, &energy, t, &velocity)?;
    for symmetry in system.symmetries() {
        let momentum = NoetherMomentum { lagrangian: system, group: &symmetry };
        worst = worst.max_or_nan(dissipation_defect(&eta_l, &energy, &momentum, t, &velocity)?);
        // Conserved: X_H(momentum / energy) = 0, relative to the size of its terms.
        let field = hamiltonian_vector_field(&eta_l, &energy, t, &velocity)?;
        let d = Quotient { f: &momentum, g: &energy }.differential(t, &velocity);
        let size = d.x.abs().dot(&field.x.abs()) + d.y.abs().dot(&field.y.abs()) + (d.z * field.z).abs();
        if size > 0.0 {
            worst = worst.max_or_nan(d.dot(&field).abs() / size);
        }
    }
    if dissipation_defect(&eta_l, &energy, &AnyFunction(0.37), t, &velocity)? < 1e-9 {
        return Ok(f64::INFINITY);
    }
    Ok(worst)
}

/// Statement 12: a group that leaves L invariant acts by contactomorphisms of eta_L, and its momentum `-eta_L(xi)` is
/// dissipated.
fn noether<const N: usize>(
    system: &impl System<N>,
    t: f64,
    x: &VelocityPoint<N>,
) -> Result<Option<f64>, GeometryError> {
    let (_, eta_l, velocity) = forms(system, t, x);
    let mut worst = None;
    for group in system.symmetries() {
        let action = conformality(&eta_l, &eta_l, &LiftedAction { group: &group, s: 0.8 }, &velocity)?;
        let momentum = NoetherMomentum { lagrangian: system, group: &group };
        let (value, eta_xi) = (momentum.value(t, &velocity), eta_l.eta(&velocity)?.dot(&group.velocity_generator(x)));
        let residual = group
            .symmetry_defect(system, t, x)
            .max_or_nan(action.defect)
            .max_or_nan((action.sigma - 1.0).abs())
            .max_or_nan(relative_number(value, -eta_xi, 1.0))
            .max_or_nan(dissipation_defect(&eta_l, &Energy(system), &momentum, t, &velocity)?);
        worst = Some(worst.map_or(residual, |w: f64| w.max_or_nan(residual)));
    }
    Ok(worst)
}

/// A flow in closed form as a map of T\*Q x R, for the statements about flows.
pub trait ClosedFlow {
    /// The system's name.
    fn name(&self) -> &'static str;
    /// The state after time `t`.
    fn flow<T: Scalar>(&self, t: f64, x: &ChartVector<1, T>) -> ChartVector<1, T>;
    /// The Hamiltonian.
    fn hamiltonian<T: Scalar>(&self, x: &ChartVector<1, T>) -> T;
}

/// The contact Hamiltonian `c z^2 / 2`, nonlinear in z: its flow scales `z` by `1/(1 + c z t/2)` and `p` by the square
/// of this factor.
#[derive(Clone, Copy, Debug)]
pub struct ActionSquared {
    /// The coefficient.
    pub c: f64,
}

impl ClosedFlow for ActionSquared {
    fn name(&self) -> &'static str {
        "action_squared"
    }
    fn flow<T: Scalar>(&self, t: f64, x: &ChartVector<1, T>) -> ChartVector<1, T> {
        let factor = (x.z * (0.5 * self.c * t) + 1.0).recip();
        ChartVector { x: x.x, y: x.y * (factor * factor), z: x.z * factor }
    }
    fn hamiltonian<T: Scalar>(&self, x: &ChartVector<1, T>) -> T {
        x.z * x.z * (0.5 * self.c)
    }
}

/// A closed flow after a fixed time, as a map; and its Hamiltonian, as a function.
struct Closed<'a, F> {
    flow: &'a F,
    t: f64,
}

impl<F: ClosedFlow> Smooth<1> for Closed<'_, F> {
    fn at<T: Scalar>(&self, x: &ChartVector<1, T>) -> Result<ChartVector<1, T>, GeometryError> {
        Ok(self.flow.flow(self.t, x))
    }
}

impl<F: ClosedFlow> SmoothFunction<1> for Closed<'_, F> {
    fn value<T: Scalar>(&self, _t: T, x: &ChartVector<1, T>) -> T {
        self.flow.hamiltonian(x)
    }
}

/// Statements 5 and 11 along a flow in closed form: `phi_t* eta = sigma_t eta` with `sigma_t = exp(int a)`,
/// `a = -R(H)`, and `H o phi_t = sigma_t H`. The quadrature is on `[0, t]`; its own error is part of the residual.
///
/// # Errors
/// None in the domain of the flow.
pub fn conformal_flow(
    flow: &impl ClosedFlow,
    t: f64,
    x: &ChartVector<1>,
    quadrature: &[(f64, f64)],
) -> Result<f64, GeometryError> {
    let map = Closed { flow, t };
    let pullback = conformality(&Darboux, &Darboux, &map, x)?;
    let sigma = conformal_factor_along(&Darboux, &map, |s| flow.flow(s, x), quadrature)?;
    let (before, after) = (flow.hamiltonian(x), flow.hamiltonian(&flow.flow(t, x)));
    let decay = (after - sigma * before).abs() / (1.0 + before.abs());
    Ok(pullback.defect.max_or_nan(relative_number(pullback.sigma, sigma, 0.0)).max_or_nan(decay))
}
