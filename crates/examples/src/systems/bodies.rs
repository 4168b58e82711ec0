//! The gravitational N-body problem in space, with drag.

use contact_geom::nalgebra::SVector;
use contact_geom::numbers::{Coefficient, ScalarOver};
use contact_geom::support::indexed_names;
use contact_geom::{ChartVector, Lagrangian, Parametric, Scalar, Structure, VelocityPoint, vector};

/// Bodies in space with Newtonian gravitation between all pairs, and linear drag,
/// `L = sum m_i |v_i|^2/2 + sum_(i<j) G m_i m_j/|q_i - q_j| + gamma z`. Body i has the coordinates `3i, 3i + 1, 3i + 2`
/// of N; a planet and its sun are `Bodies<6>`. Units are those of G.
///
/// Herglotz' equation is `q_i'' = sum_j G m_j (q_j - q_i)/|q_j - q_i|^3 + gamma q_i'`; nonlinear, singular where two
/// bodies collide, W diagonal. Translations and common rotations are symmetries: total and angular momentum decay as
/// `e^(gamma t)`.
///
/// For few bodies over many revolutions, Gauss collocation with two to five steps per period of the fastest body is
/// recommended. Its kernels are compiled for each N; this system is therefore not part of
/// [`visit_catalogue`](super::visit_catalogue). For any number of bodies see `bodies` of the crate
/// `sparse-herglotz`.
///
/// ```
/// use contact_examples::systems::Bodies;
/// use contact_geom::Lagrangian;
/// let pair = Bodies::<6>::new(|i| [1.0, 1e-3][i], 1.0, -1e-4);
/// let q = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0].into();
/// assert_eq!(pair.value(0.0, &q, &[0.0; 6].into(), 0.0), 1e-3);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bodies<const N: usize> {
    /// The mass of each coordinate, which is that of its body.
    masses: SVector<f64, N>,
    /// The gravitational constant.
    pub g: f64,
    /// The rate `L_z` of the conformal factor, negative for dissipation.
    pub gamma: f64,
}

impl<const N: usize> Bodies<N> {
    /// The system of bodies with masses `mass(i)`.
    pub fn new(mass: impl Fn(usize) -> f64, g: f64, gamma: f64) -> Self {
        const { assert!(N >= 6 && N.is_multiple_of(3), "two bodies have six coordinates, each further one has three") };
        Bodies { masses: SVector::from_fn(|d, _| mass(d / 3)), g, gamma }
    }

    /// The mass of each coordinate.
    pub fn masses(&self) -> &SVector<f64, N> {
        &self.masses
    }

    /// The vector from body i to body j, with the square of its length.
    #[inline(always)]
    fn pair<T: Scalar>(q: &SVector<T, N>, i: usize, j: usize) -> ([T; 3], T) {
        let r = [q[3 * j] - q[3 * i], q[3 * j + 1] - q[3 * i + 1], q[3 * j + 2] - q[3 * i + 2]];
        (r, r[0] * r[0] + r[1] * r[1] + r[2] * r[2])
    }

    /// The Lagrangian, over the type of its parameters; `mass` is that of a body.
    #[inline(always)]
    fn formula<C: Coefficient, T: ScalarOver<C>>(
        mass: impl Fn(usize) -> C,
        [g, gamma]: [C; 2],
        q: &SVector<T, N>,
        v: &SVector<T, N>,
        z: T,
    ) -> T {
        let mut l = z * gamma;
        for d in 0..N {
            l += v[d] * v[d] * (mass(d / 3) * 0.5);
        }
        for j in 0..N / 3 {
            for i in 0..j {
                let (_, square) = Self::pair(q, i, j);
                l += square.sqrt().recip() * (g * mass(i) * mass(j));
            }
        }
        l
    }

    #[inline(always)]
    fn forces<T: Scalar>(&self, q: &SVector<T, N>) -> SVector<T, N> {
        let mut force: SVector<T, N> = vector!(|_| T::zero());
        for j in 0..N / 3 {
            for i in 0..j {
                let (r, square) = Self::pair(q, i, j);
                let strength = self.g * self.masses[3 * i] * self.masses[3 * j];
                let pull = (square * square.sqrt()).recip() * strength;
                for d in 0..3 {
                    let along = r[d] * pull;
                    force[3 * i + d] += along;
                    force[3 * j + d] -= along;
                }
            }
        }
        force
    }
}

impl<const N: usize> Lagrangian<N> for Bodies<N> {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
        Self::formula(|body| self.masses[3 * body], [self.g, self.gamma], q, v, z)
    }

    #[inline(always)]
    fn closed_gradient<T: Scalar>(&self, _t: T, x: &VelocityPoint<N, T>) -> Option<ChartVector<N, T>> {
        let y: SVector<T, N> = vector!(|d| x.v[d] * self.masses[d]);
        Some(ChartVector { x: self.forces(&x.q), y, z: T::from(self.gamma) })
    }

    #[inline(always)]
    fn closed_force<T: Scalar>(&self, _t: T, x: &VelocityPoint<N, T>) -> Option<SVector<T, N>> {
        Some(self.forces(&x.q))
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
}

/// `masses[i]` of the bodies, `g` and `gamma`.
impl<const N: usize> Parametric<N> for Bodies<N> {
    fn parameter_names(&self) -> Vec<String> {
        indexed_names("masses", N / 3).chain(["g", "gamma"].map(String::from)).collect()
    }
    fn parameters(&self) -> Vec<f64> {
        self.masses.iter().step_by(3).copied().chain([self.g, self.gamma]).collect()
    }
    #[inline(always)]
    fn parameter_count(&self) -> usize {
        N / 3 + 2
    }
    fn with_parameters(&self, theta: &[f64]) -> Option<Self> {
        (theta.len() == N / 3 + 2).then(|| Bodies::new(|body| theta[body], theta[N / 3], theta[N / 3 + 1]))
    }
    #[inline(always)]
    fn value_at<T: Scalar>(&self, theta: &[T], _t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
        Self::formula(|body| theta[body], [theta[N / 3], theta[N / 3 + 1]], q, v, z)
    }
}
