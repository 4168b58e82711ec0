//! A chain of particles joined by nonlinear springs.

use super::{System, between, parametric_fields};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::dot;
use contact_geom::numbers::{Coefficient, ScalarOver};
use contact_geom::{Lagrangian, PhasePoint, Scalar, Structure, Symmetry, VelocityPoint};

/// The boundary conditions of a [`Chain`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ends {
    /// Each end is bonded to a wall: `N + 1` bonds, with `q_0 = q_(N+1) = 0`.
    Fixed,
    /// Both ends are free: `N - 1` bonds.
    Free,
}

/// N particles on a line with bonds between neighbours and drag: the beta chain of Fermi, Pasta, Ulam and Tsingou,
/// `L = sum_i v_i^2/2 - sum_bonds (r^2/2 + beta r^4/4) + gamma z`, where r is the elongation of a bond. Dimensionless:
/// masses and linear spring constants are one.
///
/// Herglotz' equations are `q_i'' = f(q_(i+1) - q_i) - f(q_i - q_(i-1)) + gamma q_i'`, `f(r) = r + beta r^3`, where the
/// terms of missing bonds are omitted; nonlinear unless `beta = 0`, W the identity. With free ends a common translation
/// of all particles is a symmetry, and the total momentum decays as `e^(gamma t)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chain<const N: usize> {
    /// The boundary conditions.
    pub ends: Ends,
    /// The coefficient of the cubic part of the bonds' force.
    pub beta: f64,
    /// The rate `L_z` of the conformal factor, negative for dissipation.
    pub gamma: f64,
}

impl<const N: usize> Default for Chain<N> {
    /// The chain between two walls.
    fn default() -> Self {
        Chain { ends: Ends::Fixed, beta: 0.5, gamma: -0.1 }
    }
}

impl<const N: usize> Chain<N> {
    /// The chain with free ends.
    pub fn free() -> Self {
        Chain { ends: Ends::Free, ..Chain::default() }
    }

    /// The potential energy of the bonds.
    #[inline(always)]
    fn potential<C: Coefficient, T: ScalarOver<C>>(&self, beta: C, q: &SVector<T, N>) -> T {
        let bond = |r: T| {
            let square = r * r;
            square * (square * (beta * 0.25) + 0.5)
        };
        let inner = (1..N).fold(T::zero(), |sum, i| sum + bond(q[i] - q[i - 1]));
        match self.ends {
            Ends::Fixed if N > 0 => inner + bond(q[0]) + bond(q[N - 1]),
            _ => inner,
        }
    }

    /// The Lagrangian, over the type of its parameters.
    #[inline(always)]
    fn formula<C: Coefficient, T: ScalarOver<C>>(
        &self,
        [beta, gamma]: [C; 2],
        _t: T,
        q: &SVector<T, N>,
        v: &SVector<T, N>,
        z: T,
    ) -> T {
        dot(v, v) * 0.5 - self.potential(beta, q) + z * gamma
    }
}

impl<const N: usize> Lagrangian<N> for Chain<N> {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
        self.formula([self.beta, self.gamma], t, q, v, z)
    }

    fn structure(&self) -> Structure {
        Structure {
            autonomous: true,
            z_free: self.gamma == 0.0,
            z_affine: true,
            separable: true,
            quadratic: self.beta == 0.0,
            constant_mass: true,
            ..Structure::default()
        }
    }
}

parametric_fields!([const N: usize] Chain<N>, N, beta, gamma);

impl<const N: usize> System<N> for Chain<N> {
    fn name(&self) -> &'static str {
        match self.ends {
            Ends::Fixed => "chain_fixed",
            Ends::Free => "chain_free",
        }
    }

    /// The longest normal mode of the linear chain at rest; with free ends, a common drift is added.
    fn initial(&self) -> VelocityPoint<N> {
        let pi = std::f64::consts::PI;
        let wave = |i: usize| match self.ends {
            Ends::Fixed => (pi * (i as f64 + 1.0) / (N as f64 + 1.0)).sin(),
            Ends::Free => (pi * (i as f64 + 0.5) / N as f64).cos(),
        };
        let drift = if self.ends == Ends::Free { 0.2 } else { 0.0 };
        VelocityPoint { q: SVector::from_fn(|i, _| wave(i)), v: SVector::from_element(drift), z: 0.0 }
    }

    fn sample(&self, u: &[f64]) -> (f64, VelocityPoint<N>) {
        let q = SVector::from_fn(|i, _| between(-1.5, 1.5, u[i]));
        let v = SVector::from_fn(|i, _| between(-1.5, 1.5, u[N + i]));
        (between(0.0, 5.0, u[2 * N + 1]), VelocityPoint { q, v, z: between(-1.0, 1.0, u[2 * N]) })
    }

    fn hamiltonian<T: Scalar>(&self, _t: T, x: &PhasePoint<N, T>) -> Option<T> {
        Some(dot(x.p, x.p) * 0.5 + self.potential(self.beta, &x.q) - x.z * self.gamma)
    }

    fn symmetries(&self) -> Vec<Symmetry<N>> {
        match self.ends {
            Ends::Fixed => Vec::new(),
            Ends::Free => vec![Symmetry::Translation(SVector::from_element(1.0))],
        }
    }
}
