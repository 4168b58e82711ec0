//! The stage equations of contact Gauss collocation on a Lie group.

use super::derivatives::Along;
use crate::gauss::MAX_STAGES;
use contact_geom::groups::{GroupError, GroupLagrangian, GroupPartials, LieGroup, ParametricGroupLagrangian};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::MaxOrNan;
use contact_geom::{ChartVector, Scalar};
use std::marker::PhantomData;

/// The coefficients of Gauss collocation.
#[derive(Clone, Debug)]
pub(super) struct Table {
    pub s: usize,
    pub a: [[f64; MAX_STAGES]; MAX_STAGES],
    pub b: [f64; MAX_STAGES],
    pub c: [f64; MAX_STAGES],
    /// The Lagrange polynomials of the nodes at the end of the step.
    pub end: [f64; MAX_STAGES],
}

/// One vector for each stage.
pub(super) type Rows<const N: usize, T> = [SVector<T, N>; MAX_STAGES];

/// The unknowns and the values of the stages in one evaluation.
pub(super) struct Stages<G, const N: usize, T> {
    /// The velocities `V_k` in the chart.
    pub v: Rows<N, T>,
    /// The body velocities `omega_k = dexp V_k`.
    pub omega: Rows<N, T>,
    /// The Lagrangian at the stages.
    pub value: [T; MAX_STAGES],
    /// The integrating factors `rho_k / rho_1`, with `rho' = -rho l_z`.
    pub rho: [T; MAX_STAGES],
    /// `xi1 = h sum b_k V_k`.
    pub increment: SVector<T, N>,
    /// The impulse `d_c S`.
    pub impulse: SVector<T, N>,
    /// `sigma_d - 1`.
    pub sigma_minus_one: T,
    group: PhantomData<G>,
}

/// `h sum_j w_j x_j`.
#[inline]
fn combined<T: Scalar, const N: usize>(h: f64, weights: &[f64], x: &Rows<N, T>) -> SVector<T, N> {
    let mut sum = SVector::<T, N>::zeros();
    for (w, x) in weights.iter().zip(x) {
        for i in 0..N {
            sum[i] += x[i] * (h * w);
        }
    }
    sum
}

/// A Lagrangian over one number type.
pub(super) trait AtStages<G: LieGroup<N>, const N: usize, T: Scalar> {
    /// The first derivatives.
    fn partials(&self, t: T, g: &G::Element<T>, xi: &SVector<T, N>, z: T) -> GroupPartials<N, T>;

    /// Whether there is an applied force.
    fn is_forced(&self) -> bool;

    /// The applied force.
    fn applied_force(&self, t: T, g: &G::Element<T>, xi: &SVector<T, N>, z: T) -> SVector<T, N>;

    /// `l_xixi^-1 b`.
    fn solve_mass(
        &self,
        t: T,
        g: &G::Element<T>,
        xi: &SVector<T, N>,
        z: T,
        b: &SVector<T, N>,
    ) -> Result<SVector<T, N>, GroupError>;
}

/// A Lagrangian with its own parameters.
pub(super) struct Own<'a, L>(pub &'a L);

impl<G: LieGroup<N>, L: GroupLagrangian<G, N>, const N: usize, T: Scalar> AtStages<G, N, T> for Own<'_, L> {
    #[inline]
    fn partials(&self, t: T, g: &G::Element<T>, xi: &SVector<T, N>, z: T) -> GroupPartials<N, T> {
        self.0.partials(t, g, xi, z)
    }

    #[inline]
    fn is_forced(&self) -> bool {
        self.0.is_forced()
    }

    #[inline]
    fn applied_force(&self, t: T, g: &G::Element<T>, xi: &SVector<T, N>, z: T) -> SVector<T, N> {
        self.0.applied_force(t, g, xi, z)
    }

    #[inline]
    fn solve_mass(
        &self,
        t: T,
        g: &G::Element<T>,
        xi: &SVector<T, N>,
        z: T,
        b: &SVector<T, N>,
    ) -> Result<SVector<T, N>, GroupError> {
        self.0.solve_mass(t, g, xi, z, b).map_err(|singular| GroupError::Singular { pivot: singular.pivot })
    }
}

/// A Lagrangian for values of its parameters.
pub(super) struct AtParameters<'a, L, T> {
    pub lagrangian: &'a L,
    pub theta: &'a [T],
}

impl<G, L, const N: usize, T: Scalar> AtStages<G, N, T> for AtParameters<'_, L, T>
where
    G: LieGroup<N>,
    L: ParametricGroupLagrangian<G, N>,
{
    fn partials(&self, t: T, g: &G::Element<T>, xi: &SVector<T, N>, z: T) -> GroupPartials<N, T> {
        self.lagrangian.partials_at(self.theta, t, g, xi, z)
    }

    fn is_forced(&self) -> bool {
        self.lagrangian.is_forced()
    }

    fn applied_force(&self, t: T, g: &G::Element<T>, xi: &SVector<T, N>, z: T) -> SVector<T, N> {
        self.lagrangian.applied_force(t, g, xi, z)
    }

    /// That of the own parameters: the iteration converges to the same stages.
    fn solve_mass(
        &self,
        t: T,
        g: &G::Element<T>,
        xi: &SVector<T, N>,
        z: T,
        b: &SVector<T, N>,
    ) -> Result<SVector<T, N>, GroupError> {
        AtStages::<G, N, T>::solve_mass(&Own(self.lagrangian), t, g, xi, z, b)
    }
}

/// The factors `rho_k/rho_1` at the nodes of a step and `sigma_d - 1`, for a constant rate.
pub(super) type Factors<T = f64> = ([T; MAX_STAGES], T);

/// What a step of a Lagrangian is computed from.
pub(super) struct Given<'a, V, E, const N: usize, T> {
    pub lagrangian: &'a V,
    pub table: &'a Table,
    /// For a constant rate.
    pub constant: Option<Factors<T>>,
    pub t: f64,
    pub h: f64,
    pub g0: E,
    pub momentum: SVector<T, N>,
    pub z0: T,
}

impl<G: LieGroup<N>, const N: usize, T: Scalar> Stages<G, N, T> {
    /// The stages of a motion with constant body velocity.
    pub fn guess(velocity: &SVector<T, N>) -> Self {
        Stages {
            v: [*velocity; MAX_STAGES],
            omega: [*velocity; MAX_STAGES],
            value: [T::zero(); MAX_STAGES],
            rho: [T::one(); MAX_STAGES],
            increment: *velocity * T::zero(),
            impulse: SVector::zeros(),
            sigma_minus_one: T::zero(),
            group: PhantomData,
        }
    }

    /// One sweep of the fixed-point iteration: evaluates the stages, and changes each velocity by `l_xixi^-1` times the
    /// residual of its momentum. Returns the largest change of a velocity.
    ///
    /// In the chart the Lagrangian is `l(g0 exp Xi, dexp_Xi V, Z)`. With `R = rho/rho_1` the stage equations are
    /// `R_k l_V = P_k = P0 + h sum_j a_kj R_j l_Xi,j`, and the momentum at the end is `p1 = P0 + h sum_j b_j R_j
    /// l_Xi,j`, where `p1 = dexp_(-xi1)^T (sigma_d Pi0 + d_c S)` is the equation of the discrete Legendre
    /// transformation at g0.
    pub fn sweep<V: AtStages<G, N, T>>(
        &mut self,
        given: &Given<'_, V, G::Element<T>, N, T>,
    ) -> Result<f64, GroupError> {
        let Given { lagrangian, table, h, .. } = given;
        let (s, h, forced) = (table.s, *h, lagrangian.is_forced());
        let zero = SVector::<T, N>::zeros();
        let (mut chart, mut force, mut body) = ([zero; MAX_STAGES], [zero; MAX_STAGES], [zero; MAX_STAGES]);
        let mut rates = [T::zero(); MAX_STAGES];
        let mut actions = [T::zero(); MAX_STAGES];
        let mut points = [given.g0; MAX_STAGES];
        let mut impulse = zero;
        for k in 0..s {
            let xi = combined(h, &table.a[k][..s], &self.v);
            let local = G::exp(&xi);
            points[k] = G::compose(&given.g0, &local);
            self.omega[k] = G::dexp(&xi, &self.v[k]);
            // With a constant rate the derivatives do not depend on z, and the action is integrated with its factor.
            if given.constant.is_none() {
                actions[k] = (0..s).fold(given.z0, |z, j| z + self.value[j] * (h * table.a[k][j]));
            }
            let time = T::from(given.t + h * table.c[k]);
            let mut partials = lagrangian.partials(time, &points[k], &self.omega[k], actions[k]);
            if forced {
                let z = if given.constant.is_some() { self.action_at(given, k) } else { actions[k] };
                partials.force += lagrangian.applied_force(time, &points[k], &self.omega[k], z);
            }
            self.value[k] = partials.value;
            rates[k] = partials.rate;
            let gradient = G::dexp_gradient(&xi, &self.v[k], &partials.momentum);
            force[k] = (G::dexp_transposed(&xi, &partials.force) + gradient) * self.rho[k];
            impulse += G::coadjoint(&G::inverse(&local), &partials.force) * (self.rho[k] * (h * table.b[k]));
            (chart[k], body[k]) = (xi, partials.momentum);
        }
        self.factors(given, &rates);
        self.increment = combined(h, &table.b[..s], &self.v);
        self.impulse = impulse;
        let start = given.momentum + given.momentum * self.sigma_minus_one + impulse;
        let p0 = G::dexp_transposed(&-self.increment, &start) - combined(h, &table.b[..s], &force);
        let mut largest = 0.0;
        for k in 0..s {
            let p = (p0 + combined(h, &table.a[k][..s], &force)) / self.rho[k];
            let residual = G::dexp_inverse_transposed(&chart[k], &p) - body[k];
            let time = T::from(given.t + h * table.c[k]);
            let change = lagrangian.solve_mass(time, &points[k], &self.omega[k], actions[k], &residual)?;
            let change = G::dexp_inverse(&chart[k], &change);
            self.v[k] += change;
            for i in 0..N {
                largest = largest.max_or_nan(change[i].extent());
            }
        }
        Ok(largest)
    }

    /// The factors R and `sigma_d`: in closed form for a constant rate, by one sweep of `rho = 1 - hA (rho l_z)` else.
    fn factors<V, E>(&mut self, given: &Given<'_, V, E, N, T>, rates: &[T; MAX_STAGES]) {
        let (table, h) = (given.table, given.h);
        if let Some((rho, sigma_minus_one)) = given.constant {
            (self.rho, self.sigma_minus_one) = (rho, sigma_minus_one);
            return;
        }
        // R = sigma_d - hA (R l_z), sigma_d = 1 + hb.(R l_z).
        let slope = |k: usize, rho: &[T; MAX_STAGES]| rho[k] * rates[k] * h;
        let before = self.rho;
        let sum = (0..table.s).fold(T::zero(), |sum, k| sum + slope(k, &before) * table.b[k]);
        for k in 0..table.s {
            let inner = (0..table.s).fold(T::zero(), |sum, j| sum + slope(j, &before) * table.a[k][j]);
            self.rho[k] = sum - inner + 1.0;
        }
        self.sigma_minus_one = sum;
    }

    /// The action at a stage for a constant rate, from `(rho z)' = rho l_0`.
    fn action_at<V, E>(&self, given: &Given<'_, V, E, N, T>, k: usize) -> T {
        let mut sum = given.z0 + given.z0 * self.sigma_minus_one;
        for j in 0..given.table.s {
            sum += self.rho[j] * self.value[j] * (given.h * given.table.a[k][j]);
        }
        sum / self.rho[k]
    }

    /// `z1 - z0`.
    pub fn action<V, E>(&self, given: &Given<'_, V, E, N, T>) -> T {
        let mut sum = T::zero();
        for k in 0..given.table.s {
            let factor = if given.constant.is_some() { self.rho[k] } else { T::one() };
            sum += self.value[k] * factor * (given.h * given.table.b[k]);
        }
        match given.constant {
            Some((_, sigma_minus_one)) => sum + given.z0 * sigma_minus_one,
            None => sum,
        }
    }

    /// The body velocity at the end of the step, by the polynomial through the stages.
    pub fn end_velocity(&self, table: &Table) -> SVector<T, N> {
        combined(1.0, &table.end[..table.s], &self.omega)
    }
}

impl<G: LieGroup<N>, const N: usize> Stages<G, N, Along<N>> {
    /// `h sum_k b_k R_k f_k . (g_k^-1 dg_k)`, for stages with derivatives in the start.
    pub fn virtual_work<V>(&self, given: &Given<'_, V, G::Element<Along<N>>, N, Along<N>>) -> ChartVector<N>
    where
        V: AtStages<G, N, Along<N>>,
    {
        let (table, h) = (given.table, given.h);
        let mut work = ChartVector::from_fn(|_| 0.0);
        for k in 0..table.s {
            let point = G::compose(&given.g0, &G::exp(&combined(h, &table.a[k][..table.s], &self.v)));
            let plain = G::lift(&point, |x: Along<N>| Along::<N>::constant(x.re));
            let turned = G::log(&G::compose(&G::inverse(&plain), &point));
            let z = match given.constant {
                Some(_) => self.action_at(given, k),
                None => (0..table.s).fold(given.z0, |z, j| z + self.value[j] * (h * table.a[k][j])),
            };
            let time = Along::<N>::constant(given.t + h * table.c[k]);
            let force = given.lagrangian.applied_force(time, &point, &self.omega[k], z);
            for i in 0..N {
                work = work.plus(turned[i].d.scale(force[i].re * self.rho[k].re * h * table.b[k]));
            }
        }
        work
    }
}
