//! The contact Hamiltonians of these tests. Those with the same number of coordinates are one type, which is compiled once.

use contact_examples::systems::{OneCoordinate, Pendulum, System, TwoCoordinates};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::{Coefficient, ScalarOver};
use contact_geom::{
    ContactHamiltonian, Force, Forced, HamiltonianStructure, ParametricHamiltonian, PhasePoint, Scalar, VelocityPoint,
    lagrangian_enum,
};

lagrangian_enum! {
    /// Lagrangians with one coordinate, whose motions are those of contact Hamiltonians.
    pub enum Line<1> {
        Catalogue(OneCoordinate),
        Pushed(Forced<Pendulum, Push>),
    }
}

/// The force `-0.3 v + sin t`.
pub struct Push;

impl Force<1> for Push {
    fn value<T: Scalar>(&self, t: T, x: &VelocityPoint<1, T>) -> SVector<T, 1> {
        [x.v[0] * -0.3 + t.sin()].into()
    }
}

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
    /// A Hamiltonian with the parameters a and b.
    Family(Family, [f64; 2]),
}

/// Contact Hamiltonians with one coordinate and the parameters a and b, which depend on time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// The pendulum `a (p^2/2 + versin q) - b z`, without time.
    Pendulum,
    /// With a regular `H_pp`: `p^2/2 + p^4/20 + a sin(q) (1 + z/5) + b z + z^2/20 + a b p q cos(t)/5`.
    Nonlinear,
    /// Linear in p: `p (a cos q + z/5 + b sin(t)/3) + (q^2/2 + b z/10) z`.
    Linear,
    /// Homogeneous of degree one in p, but for the drag: `p (1 + a sin(q)^2 + b cos(t)/4) + z/10`.
    Homogeneous,
}

impl Family {
    #[inline(never)]
    fn formula<C: Coefficient, T: ScalarOver<C>>(self, [a, b]: [C; 2], t: T, x: T, y: T, z: T) -> T {
        match self {
            Family::Pendulum => (y * y * 0.5 + x.versine()) * a - z * b,
            Family::Nonlinear => {
                let well = x.sin() * (z * 0.2 + 1.0) * a + z * b + z * z * 0.05;
                y * y * 0.5 + y.powi(4) * 0.05 + well + y * x * t.cos() * a * b * 0.2
            }
            Family::Linear => y * (x.cos() * a + z * 0.2 + t.sin() * b / 3.0) + (x * x * 0.5 + z * b * 0.1) * z,
            Family::Homogeneous => y * (x.sin().powi(2) * a + t.cos() * b * 0.25 + 1.0) + z * 0.1,
        }
    }
}

impl ContactHamiltonian<1> for One {
    #[inline(never)]
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
            One::Family(family, parameters) => family.formula(*parameters, t, x, y, z),
        }
    }
    fn structure(&self) -> HamiltonianStructure {
        let none = HamiltonianStructure::default();
        match self {
            One::Of(_) | One::Stiff | One::Undefined | One::Family(..) => none,
            One::FalseClaim => HamiltonianStructure { degree: Some(2), ..none },
            One::Nonlinear => HamiltonianStructure { autonomous: true, degree: Some(4), ..none },
            One::Linear => HamiltonianStructure { autonomous: true, degree: Some(1), ..none },
            One::Homogeneous => {
                HamiltonianStructure { autonomous: true, z_affine: true, constant_rate: true, degree: Some(1), ..none }
            }
        }
    }
}

/// The parameters of a family; all others have none.
impl ParametricHamiltonian<1> for One {
    fn parameter_names(&self) -> Vec<String> {
        names(self.parameters().len())
    }
    fn parameters(&self) -> Vec<f64> {
        if let One::Family(_, parameters) = self { parameters.to_vec() } else { Vec::new() }
    }
    fn with_parameters(&self, theta: &[f64]) -> Option<Self> {
        let One::Family(family, _) = self else { return theta.is_empty().then_some(*self) };
        Some(One::Family(*family, theta.try_into().ok()?))
    }
    #[inline(never)]
    fn value_at<T: Scalar>(&self, theta: &[T], t: T, q: &SVector<T, 1>, p: &SVector<T, 1>, z: T) -> T {
        let (One::Family(family, _), [a, b]) = (self, theta) else { return self.value(t, q, p, z) };
        family.formula([*a, *b], t, q[0], p[0], z)
    }
}

/// The first of the names a and b.
fn names(count: usize) -> Vec<String> {
    ["a", "b"].into_iter().take(count).map(String::from).collect()
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
    /// A ray in a medium of index `1 + a x^2 + b y`, with a loss.
    Medium([f64; 2]),
}

impl Two {
    #[inline(never)]
    fn ray<C: Coefficient, T: ScalarOver<C>>([a, b]: [C; 2], q: &SVector<T, 2>, p: &SVector<T, 2>, z: T) -> T {
        (p[0] * p[0] + p[1] * p[1]).sqrt() / (q[0] * q[0] * a + q[1] * b + 1.0) + z * 0.05
    }
}

impl ContactHamiltonian<2> for Two {
    #[inline(never)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 2>, p: &SVector<T, 2>, z: T) -> T {
        match self {
            Two::Of(system) => {
                system.hamiltonian(t, &PhasePoint { q: *q, p: *p, z }).unwrap_or_else(|| T::from(f64::NAN))
            }
            Two::Ray => Self::ray([0.25, 0.125], q, p, z),
            Two::Medium(parameters) => Self::ray(*parameters, q, p, z),
            Two::Nonlinear => {
                let kinetic = (p[0] * p[0] + p[1] * p[1] * (q[0].cos() * 0.3 + 1.0)) * 0.5 + p[0] * p[1] * q[1] * 0.1;
                kinetic + q[0].cos() * q[1] * 0.5 + q[1] * q[1] + z * (p[0] * 0.1 + 0.1) + z * z * 0.02
            }
        }
    }
}

/// The parameters of a medium; all others have none.
impl ParametricHamiltonian<2> for Two {
    fn parameter_names(&self) -> Vec<String> {
        names(self.parameters().len())
    }
    fn parameters(&self) -> Vec<f64> {
        if let Two::Medium(parameters) = self { parameters.to_vec() } else { Vec::new() }
    }
    fn with_parameters(&self, theta: &[f64]) -> Option<Self> {
        let Two::Medium(_) = self else { return theta.is_empty().then_some(*self) };
        Some(Two::Medium(theta.try_into().ok()?))
    }
    #[inline(never)]
    fn value_at<T: Scalar>(&self, theta: &[T], t: T, q: &SVector<T, 2>, p: &SVector<T, 2>, z: T) -> T {
        let (Two::Medium(_), [a, b]) = (self, theta) else { return self.value(t, q, p, z) };
        Self::ray([*a, *b], q, p, z)
    }
}
