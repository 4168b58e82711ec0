//! Contact Gauss collocation on Lie groups.

use super::derivatives::{Along, check, lifted};
use super::stages::{AtParameters, AtStages, Factors, Given, Own, Stages, Table};
use super::{GroupIntegrator, GroupState, GroupStep, ParametricGroupIntegrator};
use crate::gauss::MAX_STAGES;
use crate::gauss::tables::coefficients::Coefficients;
use crate::numbers::extent::extent;
use contact_geom::groups::{GroupError, GroupLagrangian, LieGroup, ParametricGroupLagrangian};
use contact_geom::nalgebra::SVector;
use contact_geom::{ChartVector, Scalar};
use std::f64::consts::PI;

/// Contact Gauss collocation with s stages, of order 2s, for a regular Lagrangian `l(t, g, xi, z)` on a Lie group.
///
/// Its discrete Lagrangian is the critical value S of collocation from 0 to `xi1 = log(g0^-1 g1)` in the chart
/// `xi -> g0 exp(xi)`. With the momentum p1 of that chart at xi1 and `f = exp(xi1)`, the two discrete Legendre
/// transformations are
///
/// `Pi1 = dexp_xi1^-T p1`, `sigma_d Pi0 = Ad_(f^-1)^T Pi1 - d_c S`,
///
/// where `d_c S = h sum_j b_j R_j Ad_(exp -Xi_j)^T l_g` is the derivative of S in the centre g0 of the chart. The flow
/// is conformally contact, and momenta of symmetries scale by `sigma_d`, up to round-off. For a constant rate gamma the
/// factor `e^(gamma t)` is integrated exactly: `sigma_d = e^(gamma h)`.
#[derive(Clone, Debug)]
pub struct GroupGauss<L> {
    lagrangian: L,
    table: Table,
    h: f64,
    /// For a constant rate.
    constant: Option<Factors>,
}

/// The factors for a constant rate.
fn constant_factors<T: Scalar>(gamma: T, h: f64, table: &Table) -> Factors<T> {
    (table.c.map(|c| (gamma * h * (1.0 - c)).exp()), (gamma * h).exp_m1())
}

/// Factors over another number type.
fn over<T: Scalar>((rho, sigma_minus_one): Factors) -> Factors<T> {
    (rho.map(T::from), T::from(sigma_minus_one))
}

/// The largest number of sweeps of the fixed-point iteration.
const SWEEPS: u32 = 200;

/// Sweeps without progress, close to the solution, until the iteration has reached round-off.
const STAGNANT: u32 = 3;

impl<L> GroupGauss<L> {
    /// The method with `stages` from 1 to 16 and the step h.
    ///
    /// # Errors
    /// [`GroupError::Stages`], [`GroupError::Step`].
    pub fn new<G: LieGroup<N>, const N: usize>(lagrangian: L, stages: usize, h: f64) -> Result<Self, GroupError>
    where
        L: GroupLagrangian<G, N>,
    {
        if stages == 0 || stages > MAX_STAGES {
            return Err(GroupError::Stages { found: stages });
        }
        if !(h.is_finite() && h != 0.0) {
            return Err(GroupError::Step { h });
        }
        let exact = Coefficients::of(stages);
        let (b, c) = (exact.b.map(|x| x.0), exact.c.map(|x| x.0));
        let table = Table { s: stages, a: exact.a.map(|row| row.map(|x| x.0)), b, c, end: exact.ends[1] };
        let constant = lagrangian.constant_rate().map(|gamma| constant_factors(gamma, h, &table));
        Ok(GroupGauss { lagrangian, table, h, constant })
    }

    /// The Lagrangian.
    pub fn lagrangian(&self) -> &L {
        &self.lagrangian
    }

    /// The number of stages s; the order is 2s.
    pub fn stages(&self) -> usize {
        self.table.s
    }
}

impl<G: LieGroup<N>, L: GroupLagrangian<G, N>, const N: usize> GroupIntegrator<G, N> for GroupGauss<L> {
    fn step_size(&self) -> f64 {
        self.h
    }

    /// Solves the stage equations by fixed-point iteration to round-off, from a constant body velocity.
    fn step_by<T: Scalar>(
        &self,
        h: f64,
        t: f64,
        from: &GroupState<G, N, T>,
        velocity: &SVector<T, N>,
    ) -> Result<GroupStep<N, T>, GroupError> {
        let constant = match self.lagrangian.constant_rate() {
            Some(gamma) if h != self.h => Some(constant_factors(gamma, h, &self.table)),
            _ => self.constant,
        };
        let lagrangian = &Own(&self.lagrangian);
        let given = self.given(lagrangian, constant.map(over), (h, t), from);
        self.end(&given, self.solve(&given, velocity)?)
    }

    fn velocity(&self, t: f64, from: &GroupState<G, N>) -> Result<SVector<f64, N>, GroupError> {
        let mut xi = SVector::<f64, N>::zeros();
        let mut change = f64::INFINITY;
        for _ in 0..50 {
            let residual = from.momentum - self.lagrangian.partials(t, &from.g, &xi, from.z).momentum;
            let step = self
                .lagrangian
                .solve_mass(t, &from.g, &xi, from.z, &residual)
                .map_err(|singular| GroupError::Singular { pivot: singular.pivot })?;
            xi += step;
            change = extent(&step);
            // The velocity is a guess; Newton's method is quadratic.
            if change <= 1e-8 * extent(&xi) {
                return Ok(xi);
            }
        }
        Err(GroupError::NotConverged { iterations: 50, change })
    }
}

impl<G, L, const N: usize> ParametricGroupIntegrator<G, N> for GroupGauss<L>
where
    G: LieGroup<N>,
    L: ParametricGroupLagrangian<G, N>,
{
    fn parameters(&self) -> Vec<f64> {
        self.lagrangian.parameters()
    }

    fn step_at<T: Scalar>(
        &self,
        theta: &[T],
        (h, t): (f64, f64),
        from: &GroupState<G, N, T>,
        velocity: &SVector<T, N>,
    ) -> Result<GroupStep<N, T>, GroupError> {
        let rate = self.lagrangian.constant_rate_at(theta);
        let constant = rate.map(|gamma| constant_factors(gamma, h, &self.table));
        let lagrangian = &AtParameters { lagrangian: &self.lagrangian, theta };
        let given = self.given(lagrangian, constant, (h, t), from);
        self.end(&given, self.solve(&given, velocity)?)
    }
}

impl<L> GroupGauss<L> {
    /// The virtual work `h sum_j b_j R_j f_j . (g_j^-1 dg_j)` of the applied force in a step from a state, a covector in body
    /// coordinates at the state: the contact form is multiplied by `sigma_d` up to it, `Phi* eta = sigma_d eta - work`.
    ///
    /// # Errors
    /// Those of the state and of the step.
    pub fn virtual_work<G: LieGroup<N>, const N: usize>(
        &self,
        t: f64,
        from: &GroupState<G, N>,
    ) -> Result<ChartVector<N>, GroupError>
    where
        L: GroupLagrangian<G, N>,
    {
        check(t, from)?;
        let velocity = GroupIntegrator::<G, N>::velocity(self, t, from)?.map(Along::<N>::constant);
        let (lagrangian, from) = (&Own(&self.lagrangian), lifted(from, true));
        let given = self.given(lagrangian, self.constant.map(over), (self.h, t), &from);
        Ok(self.solve(&given, &velocity)?.virtual_work(&given))
    }

    /// What a step from a state is computed from.
    fn given<'a, G: LieGroup<N>, V, const N: usize, T: Scalar>(
        &'a self,
        lagrangian: &'a V,
        constant: Option<Factors<T>>,
        (h, t): (f64, f64),
        from: &GroupState<G, N, T>,
    ) -> Given<'a, V, G::Element<T>, N, T> {
        let (table, momentum) = (&self.table, from.momentum);
        Given { lagrangian, table, constant, t, h, g0: from.g, momentum, z0: from.z }
    }

    /// Solves the stage equations by fixed-point iteration to round-off, from a constant body velocity.
    fn solve<G: LieGroup<N>, V: AtStages<G, N, T>, const N: usize, T: Scalar>(
        &self,
        given: &Given<'_, V, G::Element<T>, N, T>,
        velocity: &SVector<T, N>,
    ) -> Result<Stages<G, N, T>, GroupError> {
        let h = given.h;
        let angle = G::angle(&velocity.map(|x| x.re() * h));
        if angle >= PI {
            return Err(GroupError::BeyondChart { h, angle, largest: PI * h.abs() / angle });
        }
        let mut stages = Stages::<G, N, T>::guess(velocity);
        if let Some((rho, sigma_minus_one)) = given.constant {
            (stages.rho, stages.sigma_minus_one) = (rho, sigma_minus_one);
        }
        let (mut smallest, mut stagnant) = (f64::INFINITY, 0);
        for iterations in 1..=SWEEPS {
            let change = stages.sweep(given)?;
            let size = stages.v[..self.table.s].iter().fold(f64::MIN_POSITIVE, |size, v| size.max(extent(v)));
            if !change.is_finite() {
                return Err(GroupError::NotConverged { iterations, change });
            }
            // The iteration is at round-off once its changes are negligible, or small and no longer decreasing.
            stagnant = if change < 0.9 * smallest { 0 } else { stagnant + 1 };
            if change < smallest {
                smallest = change;
            }
            let negligible = change <= 0.0625 * f64::EPSILON * size;
            if negligible || (change <= 64.0 * f64::EPSILON * size && stagnant >= STAGNANT) {
                return Ok(stages);
            }
            if iterations == SWEEPS {
                return Err(GroupError::NotConverged { iterations, change });
            }
        }
        Err(GroupError::NotConverged { iterations: SWEEPS, change: smallest })
    }

    /// The step from the solved stages.
    fn end<G: LieGroup<N>, V, const N: usize, T: Scalar>(
        &self,
        given: &Given<'_, V, G::Element<T>, N, T>,
        stages: Stages<G, N, T>,
    ) -> Result<GroupStep<N, T>, GroupError> {
        let sigma = stages.sigma_minus_one.re() + 1.0;
        if sigma <= 0.0 || stages.rho[..self.table.s].iter().any(|rho| rho.re() <= 0.0) {
            return Err(GroupError::SigmaVanished { sigma });
        }
        let angle = G::angle(&stages.increment.map(|x| x.re()));
        if angle >= PI {
            return Err(GroupError::BeyondChart { h: given.h, angle, largest: PI * given.h.abs() / angle });
        }
        Ok(GroupStep {
            increment: stages.increment,
            impulse: stages.impulse,
            sigma_minus_one: stages.sigma_minus_one,
            action: stages.action(given),
            velocity: stages.end_velocity(&self.table),
        })
    }
}
