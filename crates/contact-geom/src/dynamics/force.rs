//! Forces that no Lagrangian contains.

use crate::dynamics::lagrangian::forward_lagrangian;
use crate::numbers::dot;
use crate::{Hints, Lagrangian, Scalar, Structure, VelocityPoint, vector};
use nalgebra::{SMatrix, SVector};

/// A force on a motion, in the Lagrange-d'Alembert-Herglotz equations
///
/// `d/dt L_v - L_q - L_z L_v = f(t, q, v, z)`, `zdot = L`.
///
/// They follow from the principle `rho(T) dz(T) + int rho f . dq dt = 0` for variations with fixed ends, where
/// `rho = exp(-int L_z)`. The force does no work in `zdot = L`; the energy `E = v . L_v - L` changes as
/// `Edot = L_z E - L_t + f . v`. Written once as a generic function, like a [`Lagrangian`].
///
/// ```
/// use contact_geom::{nalgebra::SVector, Force, Scalar, VelocityPoint};
/// /// `-c |v| v`.
/// struct QuadraticDrag { c: f64 }
/// impl<const N: usize> Force<N> for QuadraticDrag {
///     #[inline(always)]
///     fn value<T: Scalar>(&self, _t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
///         let speed = x.v.dot(&x.v).sqrt();
///         x.v.map(|v| -(v * speed * self.c))
///     }
/// }
/// let drag = QuadraticDrag { c: 0.5 };
/// assert_eq!(drag.value(0.0, &VelocityPoint::new([0.0, 0.0], [3.0, 4.0], 0.0)), SVector::from([-7.5, -10.0]));
/// ```
///
/// Annotate `value` with `#[inline(always)]`, as that of a Lagrangian.
pub trait Force<const N: usize> {
    /// The force `f(t, q, v, z)`.
    fn value<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> SVector<T, N>;

    /// What integrators may rely on; by default nothing. A false claim makes results wrong.
    fn structure(&self) -> ForceStructure<N> {
        ForceStructure::General
    }
}

/// The declared structure of an applied force.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum ForceStructure<const N: usize> {
    /// There is no force.
    None,
    /// Nothing is known.
    General,
    /// `f_i(t, q, v) = f_i(t, q, 0) - linear_i v_i - quadratic |v| v_i`: a force of the positions, with drag.
    Drag {
        /// The coefficients of the linear drag of each velocity.
        linear: SVector<f64, N>,
        /// The coefficient of the quadratic drag of the velocity.
        quadratic: f64,
    },
}

impl<const N: usize> ForceStructure<N> {
    /// A force `f(t, q)`.
    pub fn of_positions() -> Self {
        ForceStructure::Drag { linear: SVector::zeros(), quadratic: 0.0 }
    }

    /// The structure of a sum of two forces.
    pub fn plus(self, other: Self) -> Self {
        use ForceStructure::{Drag, General, None};
        match (self, other) {
            (None, one) | (one, None) => one,
            (Drag { linear: c, quadratic: k }, Drag { linear, quadratic }) => {
                Drag { linear: c + linear, quadratic: k + quadratic }
            }
            (General, _) | (_, General) => General,
        }
    }

    /// Whether the force depends on time and positions alone; so does a force that does not exist.
    pub fn is_of_positions(&self) -> bool {
        match self {
            ForceStructure::None => true,
            ForceStructure::General => false,
            ForceStructure::Drag { linear, quadratic } => *quadratic == 0.0 && linear.iter().all(|c| *c == 0.0),
        }
    }
}

impl<const N: usize, F: Force<N>> Force<N> for &F {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        (**self).value(t, x)
    }
    fn structure(&self) -> ForceStructure<N> {
        (**self).structure()
    }
}

/// The drag `-linear_i v_i - quadratic |v| v_i` of a velocity, by a viscous medium and by a turbulent one.
///
/// ```
/// use contact_examples::systems::Pendulum;
/// use contact_geom::{Forced, VelocityDrag, VelocityPoint, herglotz_field, nalgebra::SVector};
/// let drag = VelocityDrag { linear: SVector::from([0.5]), quadratic: 0.25 };
/// let damped = Forced { lagrangian: Pendulum { gamma: 0.0 }, force: drag };
/// let field = herglotz_field(&damped, 0.0, &VelocityPoint::new([0.0], [2.0], 0.0))?;
/// assert_eq!(field.y[0], -2.0);
/// # Ok::<(), contact_geom::GeometryError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VelocityDrag<const N: usize> {
    /// The coefficients of the linear drag.
    pub linear: SVector<f64, N>,
    /// The coefficient of the quadratic drag.
    pub quadratic: f64,
}

impl<const N: usize> Force<N> for VelocityDrag<N> {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        if self.quadratic == 0.0 {
            return vector!(|i| -(x.v[i] * self.linear[i]));
        }
        let speed = dot(x.v, x.v).sqrt() * self.quadratic;
        vector!(|i| -(x.v[i] * (speed + self.linear[i])))
    }
    fn structure(&self) -> ForceStructure<N> {
        ForceStructure::Drag { linear: self.linear, quadratic: self.quadratic }
    }
}

/// A Lagrangian with a [`Force`], which is added to that of the Lagrangian if there is one. Its derivatives are those of the Lagrangian; [`herglotz_field`](crate::herglotz_field)
/// contains the force. Integrators that do not take forces refuse it.
///
/// The flow is not conformally contact: its defect is the virtual work of the force.
#[derive(Clone, Copy, Debug)]
pub struct Forced<L, F> {
    /// The Lagrangian.
    pub lagrangian: L,
    /// The force.
    pub force: F,
}

impl<L, F> Forced<L, F> {
    /// A Lagrangian with a force.
    pub fn new(lagrangian: L, force: F) -> Self {
        Forced { lagrangian, force }
    }
}

impl<const N: usize, L: Lagrangian<N>, F: Force<N>> Lagrangian<N> for Forced<L, F> {
    const HINTS: Hints = Hints { forced: true, over_slices: false, ..L::HINTS };

    forward_lagrangian!(of_value, self => self.lagrangian);
    forward_lagrangian!(of_switches, self => self.lagrangian);

    #[inline(always)]
    fn applied_force<T: Scalar>(&self, t: T, x: &VelocityPoint<N, T>) -> SVector<T, N> {
        let force = self.force.value(t, x);
        if const { L::HINTS.forced } {
            let other = self.lagrangian.applied_force(t, x);
            return vector!(|i| force[i] + other[i]);
        }
        force
    }
    fn force_structure(&self) -> ForceStructure<N> {
        self.force.structure().plus(self.lagrangian.force_structure())
    }
    /// Of the structure of the Lagrangian, what holds with a force: its motion may depend on time and is not linear. The
    /// claims on the form of L remain; a method that relies on `separable` reads the
    /// [structure of the force](Lagrangian::force_structure) too.
    fn structure(&self) -> Structure {
        let of_lagrangian = self.lagrangian.structure();
        let constant_mass = of_lagrangian.constant_mass || of_lagrangian.separable || of_lagrangian.quadratic;
        Structure {
            autonomous: false,
            quadratic: false,
            constant_mass,
            constant_rate: of_lagrangian.has_constant_rate(),
            z_affine: of_lagrangian.is_affine_in_z(),
            ..of_lagrangian
        }
    }
}
