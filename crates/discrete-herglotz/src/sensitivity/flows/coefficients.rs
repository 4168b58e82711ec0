//! The coefficients of a splitting, and their derivatives in the parameters.

use super::sources::Sources;
use crate::sensitivity::parametric_system::Quantity;
use contact_geom::VelocityPoint;
use contact_geom::nalgebra::{SMatrix, SVector};

/// The bound, relative to the size, on a derivative that vanishes if a hypothesis of a splitting holds for all values of
/// the parameters.
const MAX_DEFECT: f64 = 1e-9;

/// The derivatives in one parameter of the coefficients of a splitting: of the mass matrix, of the rate gamma of a linear
/// drag in z, and of the drag `-c_i v_i - k |v| v_i` of the velocity.
#[derive(Clone, Debug)]
pub(super) struct CoefficientDerivatives<const N: usize> {
    pub mass: SMatrix<f64, N, N>,
    pub gamma: f64,
    /// The change of that derivative where z increases by 1: `f_z` is not constant if it is not 0.
    pub bend: f64,
    pub linear: SVector<f64, N>,
    pub quadratic: f64,
}

impl<const N: usize> CoefficientDerivatives<N> {
    /// Those of the duration and of the time, on which no coefficient depends.
    pub fn zero() -> Self {
        CoefficientDerivatives {
            mass: SMatrix::zeros(),
            gamma: 0.0,
            bend: 0.0,
            linear: SVector::zeros(),
            quadratic: 0.0,
        }
    }

    /// The derivatives in each parameter, at a time and a position; `forced` states that there may be a force. They are evaluated at points where the others vanish,
    /// as `L_v = M v` and `f(v) - f(0)` are of these forms.
    pub fn all(forced: bool, of: &mut Sources<'_>, t: f64, rest: &VelocityPoint<N>) -> Vec<Self> {
        (0..of.count())
            .map(|k| {
                let mut at = |v: SVector<f64, N>| of.at(Quantity::Parameter(k), t, &VelocityPoint { v, ..*rest });
                let still = at(SVector::zeros());
                let mut mass = SMatrix::<f64, N, N>::zeros();
                for i in 0..N {
                    let unit = SVector::from_fn(|j, _| f64::from(u8::from(i == j)));
                    mass.set_column(i, &(at(unit).gradient.y - still.gradient.y));
                }
                let (mut linear, mut quadratic) = (SVector::<f64, N>::zeros(), 0.0);
                if forced {
                    // With |v| = u sqrt(n) for the velocity u (1, ..., 1), u = 1 and u = 2.
                    let ones = SVector::<f64, N>::from_element(1.0);
                    let [once, twice] = [1.0, 2.0].map(|u| at(ones * u).force - still.force);
                    let bend = (once * 2.0 - twice) * 0.5;
                    quadratic = bend.mean() / (N as f64).sqrt();
                    linear = -once - bend;
                }
                let above = VelocityPoint { z: rest.z + 1.0, ..*rest };
                let bend = of.at(Quantity::Parameter(k), t, &above).gradient.z - still.gradient.z;
                CoefficientDerivatives { mass, gamma: still.gradient.z, bend, linear, quadratic }
            })
            .collect()
    }

    /// Why a splitting with a linear drag in z is not differentiable in the parameter: it makes L nonlinear in z.
    pub fn obstacle_in_action(&self) -> Option<&'static str> {
        let bends = self.bend.abs() > MAX_DEFECT * (1.0 + self.gamma.abs());
        bends.then_some(" in a parameter that makes the Lagrangian nonlinear in z, as it is not for the present value")
    }

    /// Whether the parameter changes the drag of the velocity.
    pub fn has_drag(&self) -> bool {
        self.linear.norm() + self.quadratic.abs() > MAX_DEFECT
    }

    /// Why the flow with a drag of the velocity is not differentiable in the parameter: it requires a diagonal mass matrix,
    /// and for a quadratic drag equal masses and equal linear drags, which `equal` states of the present values, and a scheme
    /// that is not of Runge-Kutta-Nyström type.
    pub fn obstacle(&self, has_quadratic: bool, equal: bool, nystrom: bool) -> Option<&'static str> {
        if let Some(obstacle) = self.obstacle_in_action() {
            return Some(obstacle);
        }
        let size = MAX_DEFECT * (1.0 + self.mass.norm() + self.linear.norm());
        let diagonal = self.mass.diagonal();
        if (self.mass - SMatrix::from_diagonal(&diagonal)).norm() > size {
            return Some(" in a parameter that changes entries of the mass matrix outside of its diagonal");
        }
        let together = |x: &SVector<f64, N>| x.iter().all(|entry| (entry - x[0]).abs() <= size);
        if has_quadratic && !(together(&diagonal) && together(&self.linear)) {
            return Some(
                " with a quadratic drag, in a parameter that changes masses or linear drags by different amounts",
            );
        }
        if self.quadratic.abs() > size && !equal {
            return Some(" with different masses or linear drags, in a parameter of a quadratic drag");
        }
        if self.quadratic.abs() > size && nystrom {
            return Some(", a Runge-Kutta-Nyström scheme, in a parameter of a quadratic drag");
        }
        None
    }
}
