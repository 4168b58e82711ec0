//! One Lagrangian with many variants, so that a single type covers all systems of a dimension.

use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{Lagrangian, Scalar, Structure, support::linear};

/// `L = kinetic - smooth potential - feature + force(t) q_1 + rate(t, q) z - action z^2 / 2`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Formula<const N: usize> {
    /// The kinetic energy.
    pub kinetic: Kinetic<N>,
    /// The smooth part of the potential.
    pub smooth: Smooth,
    /// An addition to the potential that may be singular, narrow or steep.
    pub feature: Feature,
    /// The coefficient of z.
    pub rate: Rate,
    /// The coefficient of `-z^2/2`.
    pub action: f64,
    /// The force on the first coordinate.
    pub force: Force,
    /// The structure that is claimed in place of the true one.
    pub claims: Option<Structure>,
}

/// The kinetic energies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kinetic<const N: usize> {
    /// `v.v / 2`.
    Unit,
    /// `v.Mv / 2`.
    Mass(SMatrix<f64, N, N>),
    /// `-sqrt(1 - v.v)`.
    Relativistic,
    /// `(v_1^2 + sin(q_1)^2 v_N^2) / 2`: on the sphere, with the angle from a pole as the first coordinate and the
    /// longitude as the last.
    Sphere,
    /// `q_1 v_1`: W is zero.
    Singular,
}

/// `linear q_1 + spring q.q/2 + quartic (q.q)^2/4 + swing (1 - cos q_1) + coupling q_1^2 q_N^2 / 2`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Smooth {
    pub linear: f64,
    pub spring: f64,
    pub quartic: f64,
    pub swing: f64,
    pub coupling: f64,
}

/// Singular, narrow or steep parts of a potential. Widths are those of a Gaussian or of a hyperbolic tangent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Feature {
    None,
    /// `-mu / |q|`.
    Centre {
        mu: f64,
    },
    /// `square q.Mq / 2` with the mass matrix M, so that each coordinate oscillates with the same frequency.
    Metric {
        square: f64,
    },
    /// A Gaussian hill along the first axis.
    Hill {
        at: f64,
        width: f64,
        height: f64,
    },
    /// `(q_1 / width)^40`.
    Wall {
        width: f64,
    },
    /// `slope |q_1 - at|`.
    Kink {
        at: f64,
        slope: f64,
    },
    /// A smooth step from 0 to a height.
    Step {
        at: f64,
        width: f64,
        height: f64,
    },
    /// `-sqrt(1 - q.q)`: not defined for |q| > 1.
    Domain,
    /// `q_1^(n+1) / (n+1)`.
    Power {
        n: i32,
    },
}

/// The coefficients of z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rate {
    Constant(f64),
    /// `size cos(frequency t)`.
    Swinging {
        size: f64,
        frequency: f64,
    },
    /// Of this size beyond a value of the first coordinate.
    Region {
        size: f64,
        at: f64,
        width: f64,
    },
    /// Of this size around a time.
    Pulse {
        size: f64,
        at: f64,
        width: f64,
    },
    /// `size / t`.
    OverTime(f64),
}

/// The forces on the first coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Force {
    None,
    /// `size cos(frequency t)`.
    Swinging {
        size: f64,
        frequency: f64,
    },
    /// Of this size around a time.
    Pulse {
        size: f64,
        at: f64,
        width: f64,
    },
}

/// `e^(-((x - at) / width)^2)`.
fn bell<T: Scalar>(x: T, at: f64, width: f64) -> T {
    let u = (x - at) / width;
    (-(u * u)).exp()
}

/// A smooth step from 0 to 1 at `at`.
fn ramp<T: Scalar>(x: T, at: f64, width: f64) -> T {
    (((x - at) / width).tanh() + 1.0) * 0.5
}

impl<const N: usize> Formula<N> {
    /// The free particle, `v.v/2`.
    pub const FREE: Self = Formula {
        kinetic: Kinetic::Unit,
        smooth: Smooth { linear: 0.0, spring: 0.0, quartic: 0.0, swing: 0.0, coupling: 0.0 },
        feature: Feature::None,
        rate: Rate::Constant(0.0),
        action: 0.0,
        force: Force::None,
        claims: None,
    };

    /// The oscillator of frequency 1 with drag.
    pub fn oscillator(gamma: f64) -> Self {
        Formula { smooth: Smooth { spring: 1.0, ..Smooth::default() }, rate: Rate::Constant(gamma), ..Self::FREE }
    }

    /// The pendulum with drag.
    pub fn pendulum(gamma: f64) -> Self {
        Formula { smooth: Smooth { swing: 1.0, ..Smooth::default() }, rate: Rate::Constant(gamma), ..Self::FREE }
    }

    /// Kepler's problem with drag.
    pub fn kepler(gamma: f64) -> Self {
        Formula { feature: Feature::Centre { mu: 1.0 }, rate: Rate::Constant(gamma), ..Self::FREE }
    }

    /// The same Lagrangian without any claim of structure.
    pub fn claiming_nothing(self) -> Self {
        Formula { claims: Some(Structure::default()), ..self }
    }

    /// The velocity for a momentum; NaN where there is none.
    pub fn velocity(&self, q: &SVector<f64, N>, p: &SVector<f64, N>) -> SVector<f64, N> {
        let none = SVector::from_element(f64::NAN);
        match &self.kinetic {
            Kinetic::Unit => *p,
            Kinetic::Mass(mass) => {
                let mut v = *p;
                if linear::solve(&mut mass.clone_owned(), &mut v).is_ok() { v } else { none }
            }
            Kinetic::Relativistic => p / (1.0 + p.dot(p)).sqrt(),
            Kinetic::Sphere => SVector::from_fn(|i, _| if i == 0 { p[i] } else { p[i] / q[0].sin().powi(2) }),
            Kinetic::Singular => none,
        }
    }

    /// The true structure.
    fn truth(&self) -> Structure {
        let mass = matches!(self.kinetic, Kinetic::Unit | Kinetic::Mass(_));
        let affine = self.action == 0.0 && !matches!(self.rate, Rate::Region { .. });
        let Smooth { quartic, swing, coupling, .. } = self.smooth;
        let linear = matches!(self.feature, Feature::None | Feature::Metric { .. })
            && [quartic, swing, coupling].iter().all(|c| *c == 0.0);
        let constant = affine && matches!(self.rate, Rate::Constant(_));
        Structure {
            autonomous: self.force == Force::None && matches!(self.rate, Rate::Constant(_) | Rate::Region { .. }),
            z_free: affine && self.rate == Rate::Constant(0.0),
            z_affine: affine,
            constant_rate: constant,
            separable: mass && !matches!(self.rate, Rate::Region { .. }),
            quadratic: mass && linear && affine,
            constant_mass: mass,
        }
    }

    /// The features that are rare in mechanics, which are not inlined into the kernels.
    #[inline(never)]
    fn rare<T: Scalar>(&self, q: &SVector<T, N>) -> T {
        match self.feature {
            Feature::Hill { at, width, height } => bell(q[0], at, width) * height,
            Feature::Wall { width } => (q[0] / width).powi(40),
            Feature::Kink { at, slope } => {
                let x = q[0] - at;
                (x * x).sqrt() * slope
            }
            Feature::Step { at, width, height } => ramp(q[0], at, width) * height,
            Feature::Domain => -(-q.dot(q) + 1.0).sqrt(),
            Feature::Power { n } => q[0].powi(n + 1) / f64::from(n + 1),
            Feature::Metric { square } => match self.kinetic {
                Kinetic::Mass(mass) => quadratic(&mass, q) * (0.5 * square),
                _ => q.dot(q) * (0.5 * square),
            },
            Feature::None | Feature::Centre { .. } => T::zero(),
        }
    }

    /// The rates that are rare in mechanics, which are not inlined into the kernels.
    #[inline(never)]
    fn rare_rate<T: Scalar>(&self, t: T, x: T) -> T {
        match self.rate {
            Rate::Region { size, at, width } => ramp(x, at, width) * size,
            Rate::Pulse { size, at, width } => bell(t, at, width) * size,
            Rate::OverTime(size) => t.recip() * size,
            Rate::Constant(_) | Rate::Swinging { .. } => T::zero(),
        }
    }
}

/// `x.Mx`.
#[inline(always)]
fn quadratic<T: Scalar, const N: usize>(m: &SMatrix<f64, N, N>, x: &SVector<T, N>) -> T {
    let mut sum = T::zero();
    for i in 0..N {
        for j in 0..N {
            sum += x[i] * x[j] * m[(i, j)];
        }
    }
    sum
}

impl<const N: usize> Lagrangian<N> for Formula<N> {
    /// That of Kepler's problem. Runs do not choose it, since it is not declared in `HINTS`.
    #[inline(always)]
    fn dt_dtau<T: Scalar>(&self, q: &SVector<T, N>) -> T {
        q.dot(q).sqrt().sqrt().powi(3)
    }

    /// Not inlined into the kernels, as it should be where speed matters: all its variants would be compiled into each
    /// kernel.
    #[inline(never)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
        let kinetic = match &self.kinetic {
            Kinetic::Unit => v.dot(v) * 0.5,
            Kinetic::Mass(mass) => quadratic(mass, v) * 0.5,
            Kinetic::Relativistic => -(-v.dot(v) + 1.0).sqrt(),
            Kinetic::Sphere => {
                let speed = q[0].sin() * v[N - 1];
                (v[0] * v[0] + speed * speed) * 0.5
            }
            Kinetic::Singular => q[0] * v[0],
        };
        let Smooth { linear, spring, quartic, swing, coupling } = self.smooth;
        let mut potential = match self.feature {
            Feature::None => T::zero(),
            Feature::Centre { mu } => q.dot(q).sqrt().recip() * -mu,
            _ => self.rare(q),
        };
        // Absent terms are skipped, since they would take time, a sine above all.
        if spring != 0.0 || quartic != 0.0 {
            let square = q.dot(q);
            potential += square * (square * (0.25 * quartic) + 0.5 * spring);
        }
        if swing != 0.0 {
            potential += q[0].versine() * swing;
        }
        if linear != 0.0 {
            potential += q[0] * linear;
        }
        if coupling != 0.0 {
            let product = q[0] * q[N - 1];
            potential += product * product * (0.5 * coupling);
        }
        let rate = match self.rate {
            Rate::Constant(size) => T::from(size),
            Rate::Swinging { size, frequency } => (t * frequency).cos() * size,
            _ => self.rare_rate(t, q[0]),
        };
        let mut value = kinetic - potential + z * rate;
        match self.force {
            Force::None => {}
            Force::Swinging { size, frequency } => value += q[0] * (t * frequency).cos() * size,
            Force::Pulse { size, at, width } => value += q[0] * bell(t, at, width) * size,
        }
        if self.action != 0.0 { value - z * z * (0.5 * self.action) } else { value }
    }

    fn structure(&self) -> Structure {
        self.claims.unwrap_or_else(|| self.truth())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use contact_geom::VelocityPoint;

    #[test]
    fn what_is_said_of_a_formula_is_true() {
        let features = [
            Feature::None,
            Feature::Centre { mu: 1.0 },
            Feature::Metric { square: 2.0 },
            Feature::Hill { at: 0.3, width: 0.5, height: 1.0 },
            Feature::Power { n: 3 },
        ];
        let rates = [
            Rate::Constant(0.0),
            Rate::Constant(-0.1),
            Rate::Swinging { size: -0.3, frequency: 2.0 },
            Rate::Region { size: -0.5, at: 0.4, width: 0.3 },
        ];
        let forces = [Force::None, Force::Swinging { size: 0.5, frequency: 0.7 }];
        let x = VelocityPoint::new([0.3, 0.7], [0.4, -0.2], 0.5);
        let mass = Kinetic::Mass(SMatrix::from([[2.0, 0.5], [0.5, 1.0]]));
        for kinetic in [Kinetic::Unit, mass, Kinetic::Relativistic, Kinetic::Sphere] {
            for ((feature, rate), (force, action)) in features
                .into_iter()
                .flat_map(|f| rates.map(|r| (f, r)))
                .flat_map(|fr| forces.into_iter().flat_map(move |f| [0.0, 0.2].map(move |a| (fr, (f, a)))))
            {
                let smooth = Smooth { spring: 1.0, ..Smooth::default() };
                let formula = Formula { kinetic, feature, rate, force, action, smooth, claims: None };
                for defect in formula.structure().defects(&formula, 0.3, &x).into_iter().flatten() {
                    assert!(defect.size < 1e-12, "{formula:?}: {defect:?}");
                }
            }
        }
    }
}
