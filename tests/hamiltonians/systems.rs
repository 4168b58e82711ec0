//! The contact Hamiltonians of these tests. Those with the same number of coordinates are one type, which is compiled once.

use contact_geom::nalgebra::SVector;
use contact_geom::systems::{OneCoordinate, System, TwoCoordinates};
use contact_geom::{ContactHamiltonian, HamiltonianStructure, PhasePoint, Scalar};

/// Contact Hamiltonians with one coordinate.
#[derive(Clone, Copy, Debug)]
pub enum One {
    /// The Hamiltonian of a system of the catalogue.
    Of(OneCoordinate),
    /// Nonlinear in q, p and z, with a regular `H_pp`: `p^2/2 + p^4/20 + sin(q)(1 + z/5) + z^2/20 + z/10`.
    Nonlinear,
    /// Linear in p: `p (cos q + z/5) + (q^2/2 + z/10) z`.
    Linear,
    /// Homogeneous of degree one in p, with `H_pp = 0`: `(1 + sin(q)^2/4) |p|`, for a motion with p > 0, which needs no
    /// root: `p (1 + sin(q)^2/4)`; the drag is `z/10`.
    Homogeneous,
    /// Stiff relaxation to a slow motion: `-1000 p (q - cos t)`.
    Stiff,
    /// `p ln q`, which is not defined for q < 0.
    Undefined,
    /// `p^3`, with the false claim to be quadratic in p.
    FalseClaim,
}

impl ContactHamiltonian<1> for One {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, p: &SVector<T, 1>, z: T) -> T {
        let (x, y) = (q[0], p[0]);
        match self {
            One::Of(system) => {
                system.hamiltonian(t, &PhasePoint { q: *q, p: *p, z }).unwrap_or_else(|| T::from(f64::NAN))
            }
            One::Nonlinear => y * y * 0.5 + y.powi(4) * 0.05 + x.sin() * (z * 0.2 + 1.0) + z * z * 0.05 + z * 0.1,
            One::Linear => y * (x.cos() + z * 0.2) + (x * x * 0.5 + z * 0.1) * z,
            One::Homogeneous => y * (x.sin().powi(2) * 0.25 + 1.0) + z * 0.1,
            One::Stiff => y * (x - t.cos()) * -1000.0,
            One::Undefined => y * x.ln(),
            One::FalseClaim => y.powi(3),
        }
    }
    fn structure(&self) -> HamiltonianStructure {
        let none = HamiltonianStructure::default();
        match self {
            One::Of(_) | One::Stiff | One::Undefined => none,
            One::FalseClaim => HamiltonianStructure { degree: Some(2), ..none },
            One::Nonlinear => HamiltonianStructure { autonomous: true, degree: Some(4), ..none },
            One::Linear => HamiltonianStructure { autonomous: true, degree: Some(1), ..none },
            One::Homogeneous => {
                HamiltonianStructure { autonomous: true, z_affine: true, constant_rate: true, degree: Some(1), ..none }
            }
        }
    }
}

/// Contact Hamiltonians with two coordinates.
#[derive(Clone, Copy, Debug)]
pub enum Two {
    /// The Hamiltonian of a system of the catalogue.
    Of(TwoCoordinates),
    /// A ray in a medium of index `n = 1 + x^2/4 + y/8`, with a loss: `|p| / n + z/20`; `H_pp` has rank one.
    Ray,
    /// Coupled and nonlinear in all variables.
    Nonlinear,
}

impl ContactHamiltonian<2> for Two {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 2>, p: &SVector<T, 2>, z: T) -> T {
        match self {
            Two::Of(system) => {
                system.hamiltonian(t, &PhasePoint { q: *q, p: *p, z }).unwrap_or_else(|| T::from(f64::NAN))
            }
            Two::Ray => {
                let index = q[0] * q[0] * 0.25 + q[1] * 0.125 + 1.0;
                (p[0] * p[0] + p[1] * p[1]).sqrt() / index + z * 0.05
            }
            Two::Nonlinear => {
                let kinetic = (p[0] * p[0] + p[1] * p[1] * (q[0].cos() * 0.3 + 1.0)) * 0.5 + p[0] * p[1] * q[1] * 0.1;
                kinetic + q[0].cos() * q[1] * 0.5 + q[1] * q[1] + z * (p[0] * 0.1 + 0.1) + z * z * 0.02
            }
        }
    }
}
