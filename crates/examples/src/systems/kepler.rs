//! Kepler's problem with drag, in any dimension.

use super::{System, between, parametric_fields};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::dot;
use contact_geom::numbers::{Coefficient, ScalarOver};
use contact_geom::{ChartVector, Hints, Lagrangian, PhasePoint, Scalar, Structure, Symmetry, VelocityPoint};

/// Kepler's problem with linear drag, `L = |v|^2/2 + mu/|q| + gamma z` in R^D. Dimensionless: for `mu = 1`, lengths are
/// in units of the semi-major axis of the default initial orbit, times in units of its period over 2 pi.
///
/// Herglotz' equation is `q'' = -mu q/|q|^3 + gamma q'`; nonlinear, singular at `q = 0`, W the identity. Every rotation
/// is a symmetry: the angular momenta decay as `e^(gamma t)`, and the orbit stays in its plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kepler<const D: usize> {
    /// The gravitational parameter: the gravitational constant times the mass of the centre.
    pub mu: f64,
    /// The rate `L_z` of the conformal factor, negative for dissipation.
    pub gamma: f64,
}

impl<const D: usize> Default for Kepler<D> {
    fn default() -> Self {
        Kepler { mu: 1.0, gamma: -0.01 }
    }
}

impl<const D: usize> Lagrangian<D> for Kepler<D> {
    const HINTS: Hints = Hints { time_transformation: true, ..Hints::NONE };

    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, D>, v: &SVector<T, D>, z: T) -> T {
        self.formula([self.mu, self.gamma], t, q, v, z)
    }

    #[inline(always)]
    fn closed_gradient<T: Scalar>(&self, _t: T, x: &VelocityPoint<D, T>) -> Option<ChartVector<D, T>> {
        let inverse = dot(x.q, x.q).sqrt().recip();
        let pull = inverse * inverse * inverse * -self.mu;
        Some(ChartVector { x: x.q * pull, y: x.v, z: T::from(self.gamma) })
    }

    fn structure(&self) -> Structure {
        Structure {
            autonomous: true,
            z_free: self.gamma == 0.0,
            z_affine: true,
            separable: true,
            constant_mass: true,
            ..Structure::default()
        }
    }

    /// The rate `|q|^(3/2)` is proportional to the free-fall time to the centre, so that close and distant passages of
    /// the centre take the same number of steps.
    #[inline(always)]
    fn dt_dtau<T: Scalar>(&self, q: &SVector<T, D>) -> T {
        // SIMD registers support square roots and products, but no general powers.
        dot(q, q).sqrt().sqrt().powi(3)
    }
}

parametric_fields!([const D: usize] Kepler<D>, D, mu, gamma);

impl<const D: usize> System<D> for Kepler<D> {
    fn name(&self) -> &'static str {
        match D {
            2 => "kepler_planar",
            3 => "kepler_spatial",
            _ => "kepler",
        }
    }

    fn initial(&self) -> VelocityPoint<D> {
        pericentre(self.mu)
    }

    fn sample(&self, u: &[f64]) -> (f64, VelocityPoint<D>) {
        sample_annulus(u)
    }

    fn hamiltonian<T: Scalar>(&self, _t: T, x: &PhasePoint<D, T>) -> Option<T> {
        Some(dot(x.p, x.p) * 0.5 - attraction(self.mu, &x.q) - x.z * self.gamma)
    }

    fn symmetries(&self) -> Vec<Symmetry<D>> {
        (0..D).flat_map(|j| (0..j).map(move |i| Symmetry::Rotation(i, j))).collect()
    }
}

impl<const D: usize> Kepler<D> {
    /// The Lagrangian, over the type of its parameters.
    #[inline(always)]
    fn formula<C: Coefficient, T: ScalarOver<C>>(
        &self,
        [mu, gamma]: [C; 2],
        _t: T,
        q: &SVector<T, D>,
        v: &SVector<T, D>,
        z: T,
    ) -> T {
        dot(v, v) * 0.5 + attraction(mu, q) + z * gamma
    }
}

/// The negative potential `mu / |q|`.
#[inline(always)]
pub(super) fn attraction<C, T: ScalarOver<C>, const D: usize>(mu: C, q: &SVector<T, D>) -> T {
    dot(q, q).sqrt().recip() * mu
}

/// The pericentre of an orbit of semi-major axis 1 and eccentricity 1/2 without drag; in space its plane is inclined by
/// half a radian.
pub(super) fn pericentre<const D: usize>(mu: f64) -> VelocityPoint<D> {
    let speed = (3.0 * mu).sqrt();
    let (sin, cos) = if D > 2 { 0.5_f64.sin_cos() } else { (0.0, 1.0) };
    let q = SVector::from_fn(|i, _| if i == 0 { 0.5 } else { 0.0 });
    let v = SVector::from_fn(|i, _| match i {
        1 => speed * cos,
        2 => speed * sin,
        _ => 0.0,
    });
    VelocityPoint { q, v, z: 0.0 }
}

/// A sample with the position at a distance of 0.4 to 2 from the centre, in spherical coordinates of R^D.
pub(super) fn sample_annulus<const D: usize>(u: &[f64]) -> (f64, VelocityPoint<D>) {
    let mut radius = between(0.4, 2.0, u[0]);
    let mut q = SVector::zeros();
    for i in 0..D {
        // Each coordinate except the last takes its part of the remaining radius.
        let (sin, cos) = if i + 1 < D { (std::f64::consts::TAU * u[i + 1]).sin_cos() } else { (0.0, 1.0) };
        q[i] = radius * cos;
        radius *= sin;
    }
    let v = SVector::from_fn(|i, _| between(-1.5, 1.5, u[D + i]));
    (between(0.0, 5.0, u[2 * D + 1]), VelocityPoint { q, v, z: between(-1.0, 1.0, u[2 * D]) })
}
