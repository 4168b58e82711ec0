//! Contact Gauss collocation on Lie groups.

use super::stages::{AtParameters, AtStages, Factors, Given, Own, Stages, Table};
use super::{GroupIntegrator, GroupState, GroupStep};
use crate::gauss::MAX_STAGES;
use crate::gauss::tables::coefficients::Coefficients;
use crate::numbers::extent::extent;
use contact_geom::Scalar;
use contact_geom::groups::{GroupError, GroupLagrangian, LieGroup, ParametricGroupLagrangian};
use contact_geom::nalgebra::SVector;
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
        let constant = constant.map(|(rho, sigma_minus_one)| (rho.map(T::from), T::from(sigma_minus_one)));
        self.solve(&Own(&self.lagrangian), constant, (h, t), from, velocity)
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

impl<L> GroupGauss<L> {
    /// The step from a state, for values of the parameters of the Lagrangian.
    pub(super) fn step_at<G: LieGroup<N>, const N: usize, T: Scalar>(
        &self,
        theta: &[T],
        t: f64,
        from: &GroupState<G, N, T>,
        velocity: &SVector<T, N>,
    ) -> Result<GroupStep<N, T>, GroupError>
    where
        L: ParametricGroupLagrangian<G, N>,
    {
        let rate = self.lagrangian.constant_rate_at(theta);
        let constant = rate.map(|gamma| constant_factors(gamma, self.h, &self.table));
        self.solve(&AtParameters { lagrangian: &self.lagrangian, theta }, constant, (self.h, t), from, velocity)
    }

    /// Solves the stage equations by fixed-point iteration to round-off, from a constant body velocity.
    fn solve<G: LieGroup<N>, V: AtStages<G, N, T>, const N: usize, T: Scalar>(
        &self,
        lagrangian: &V,
        constant: Option<Factors<T>>,
        (h, t): (f64, f64),
        from: &GroupState<G, N, T>,
        velocity: &SVector<T, N>,
    ) -> Result<GroupStep<N, T>, GroupError> {
        let angle = G::angle(&velocity.map(|x| x.re() * h));
        if angle >= PI {
            return Err(GroupError::BeyondChart { h, angle, largest: PI * h.abs() / angle });
        }
        let (table, momentum) = (&self.table, from.momentum);
        let given = Given { lagrangian, table, constant, t, h, g0: from.g, momentum, z0: from.z };
        let mut stages = Stages::<G, N, T>::guess(velocity);
        if let Some((rho, sigma_minus_one)) = constant {
            (stages.rho, stages.sigma_minus_one) = (rho, sigma_minus_one);
        }
        let (mut smallest, mut stagnant) = (f64::INFINITY, 0);
        for iterations in 1..=SWEEPS {
            let change = stages.sweep(&given)?;
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
                return self.end(&given, stages);
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
