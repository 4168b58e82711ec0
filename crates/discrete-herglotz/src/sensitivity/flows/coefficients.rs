//! The coefficients of a splitting, and their derivatives in the parameters.

use crate::sensitivity::parametric_system::{Quantities, Quantity};
use crate::{Point, Vector};
use contact_geom::nalgebra::DMatrix;

/// The bound, relative to the size, on a derivative that vanishes if a hypothesis of a splitting holds for all values of
/// the parameters.
const MAX_DEFECT: f64 = 1e-9;

/// The derivatives in one parameter of the coefficients of a splitting: of the mass matrix, of the rate gamma of a linear
/// drag in z, and of the drag `-c_i v_i - k |v| v_i` of the velocity.
#[derive(Clone, Debug)]
pub(super) struct CoefficientDerivatives {
    pub mass: DMatrix<f64>,
    pub gamma: f64,
    /// The change of that derivative where z increases by 1: `f_z` is not constant if it is not 0.
    pub bend: f64,
    pub linear: Vector,
    pub quadratic: f64,
}

impl CoefficientDerivatives {
    /// Those of the duration and of the time, on which no coefficient depends; for n coordinates.
    pub fn zero(n: usize) -> Self {
        CoefficientDerivatives {
            mass: DMatrix::zeros(n, n),
            gamma: 0.0,
            bend: 0.0,
            linear: Vector::zeros(n),
            quadratic: 0.0,
        }
    }

    /// The derivatives in each parameter, at a time and a position; `forced` states that there may be a force. They are evaluated at points where the others vanish,
    /// as `L_v = M v` and `f(v) - f(0)` are of these forms.
    pub fn all(forced: bool, of: &mut dyn Quantities, t: f64, rest: &Point) -> Vec<Self> {
        let n = rest.q.len();
        (0..of.count())
            .map(|k| {
                let mut at = |v: Vector| of.at(Quantity::Parameter(k), t, &Point { v, ..rest.clone() });
                let still = at(Vector::zeros(n));
                let mut mass = DMatrix::zeros(n, n);
                for i in 0..n {
                    let unit = Vector::from_fn(n, |j| f64::from(u8::from(i == j)));
                    let column = at(unit).gradient.y - &still.gradient.y;
                    mass.column_mut(i).iter_mut().zip(&column).for_each(|(entry, x)| *entry = *x);
                }
                let (mut linear, mut quadratic) = (Vector::zeros(n), 0.0);
                if forced {
                    // With |v| = u sqrt(n) for the velocity u (1, ..., 1), u = 1 and u = 2.
                    let [once, twice] = [1.0, 2.0].map(|u| at(Vector::repeat(n, u)).force - &still.force);
                    let bend = (&once * 2.0 - twice) * 0.5;
                    quadratic = mean(&bend) / (n as f64).sqrt();
                    linear = -once - bend;
                }
                let above = Point { z: rest.z + 1.0, ..rest.clone() };
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
        if (&self.mass - DMatrix::from_diagonal(&diagonal)).norm() > size {
            return Some(" in a parameter that changes entries of the mass matrix outside of its diagonal");
        }
        let together = |x: &[f64]| x.iter().all(|entry| (entry - x[0]).abs() <= size);
        if has_quadratic && !(together(diagonal.as_slice()) && together(&self.linear)) {
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

/// The mean of the components.
pub(super) fn mean(x: &[f64]) -> f64 {
    x.iter().sum::<f64>() / x.len() as f64
}
