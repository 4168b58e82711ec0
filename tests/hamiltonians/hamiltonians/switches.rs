//! Kinks and jumps of contact Hamiltonians: derivatives over them, and refusals.

use super::derivatives::{Case, two};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::{Coefficient, ScalarOver};
use contact_geom::switching::{Impact, Impacts, Surface};
use contact_geom::{ContactHamiltonian, OfHamiltonian, ParametricHamiltonian, PhasePoint, Scalar};
use discrete_herglotz::{InputError, Problem};

/// Contact Hamiltonians with a switching function and the parameters a and b.
#[derive(Clone, Copy, Debug)]
enum Kind {
    /// A step of the height a at a moving oblique surface.
    Step,
    /// A kink at `x = b`, where the rate of the action changes too.
    Kink,
    /// A switched control, linear in p: `p_x y - a |p_y + b x / 5|`.
    Control,
}

#[derive(Clone, Copy, Debug)]
struct Switched(Kind, [f64; 2]);

impl Switched {
    /// The switching function.
    fn surface<C: Coefficient, T: ScalarOver<C>>(self, b: C, t: T, q: &SVector<T, 2>, p: &SVector<T, 2>) -> T {
        match self.0 {
            Kind::Step => q[0] - q[1] * 0.2 - t * 0.1 + -b,
            Kind::Kink => q[0] + -b,
            Kind::Control => p[1] + q[0] * (b * 0.2),
        }
    }

    fn formula<C: Coefficient, T: ScalarOver<C>>(
        self,
        [a, b]: [C; 2],
        t: T,
        q: &SVector<T, 2>,
        p: &SVector<T, 2>,
        z: T,
    ) -> T {
        let (g, kinetic) = (self.surface(b, t, q, p), (p[0] * p[0] + p[1] * p[1]) * 0.5);
        match self.0 {
            Kind::Step => kinetic + g.if_less(T::zero(), T::zero(), T::zero() + a) + z * 0.1,
            Kind::Kink => kinetic + g.abs() * (z * 0.3 + 1.0) * a,
            Kind::Control => p[0] * q[1] - g.abs() * a + z * 0.2,
        }
    }
}

impl ContactHamiltonian<2> for Switched {
    const SWITCHING: bool = true;

    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 2>, p: &SVector<T, 2>, z: T) -> T {
        self.formula(self.1, t, q, p, z)
    }

    fn switching_functions(&self, t: f64, x: &PhasePoint<2>, values: &mut Vec<f64>) {
        values.push(self.surface(self.1[1], t, &x.q, &x.p));
    }
}

impl ParametricHamiltonian<2> for Switched {
    fn parameter_names(&self) -> Vec<String> {
        vec!["a".into(), "b".into()]
    }
    fn parameters(&self) -> Vec<f64> {
        self.1.to_vec()
    }
    fn with_parameters(&self, theta: &[f64]) -> Option<Self> {
        Some(Switched(self.0, theta.try_into().ok()?))
    }
    fn value_at<T: Scalar>(&self, theta: &[T], t: T, q: &SVector<T, 2>, p: &SVector<T, 2>, z: T) -> T {
        let [a, b] = theta else { return T::from(f64::NAN) };
        self.formula([*a, *b], t, q, p, z)
    }
}

/// Forward derivatives, adjoint ones and differences, over a refraction, a reflection, a kink and a switch of a control.
#[test]
fn derivatives_over_switches_agree() {
    for (kind, parameters) in
        [(Kind::Step, [-0.2, 0.9]), (Kind::Step, [5.0, 0.9]), (Kind::Kink, [0.6, 0.8]), (Kind::Control, [0.7, 0.3])]
    {
        let hamiltonian = OfHamiltonian(Switched(kind, parameters));
        for stages in [2, 5] {
            Case { lagrangian: &hamiltonian, start: two(), stages }.compare(&format!("{kind:?} {parameters:?}"));
        }
    }
}

struct Floor;

impl Surface<2> for Floor {
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 2>) -> T {
        q[1]
    }
}

/// The laws of impacts are those of velocities.
#[test]
fn impacts_of_a_hamiltonian_are_refused() {
    let bouncing = Impacts::new(OfHamiltonian(Switched(Kind::Kink, [0.6, 0.8])), Floor, Impact::Elastic);
    let refused = Problem::new(&bouncing, 0.0, two()).err();
    assert!(matches!(refused, Some(InputError::Hypothesis { .. })), "{refused:?}");
}
