//! Derivatives of expressions.

use crate::Expression;
use crate::evaluation::At;
use crate::parametric_nodes::ParametricNodes;
use contact_geom::Dual;
use contact_geom::nalgebra::SVector;

/// The value of an expression with its partial derivatives in time, state and parameters.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ExpressionGradient {
    /// The value.
    pub value: f64,
    /// In the time.
    pub t: f64,
    /// In the positions.
    pub q: Vec<f64>,
    /// In the velocities.
    pub v: Vec<f64>,
    /// In the action.
    pub z: f64,
    /// In the parameters, in their order.
    pub parameters: Vec<f64>,
}

/// A number with a derivative along one direction.
type Along = Dual<f64, SVector<f64, 1>>;

impl Expression {
    /// The value at a time and a state with its partial derivatives. All of them are NaN if a slice has fewer entries
    /// than there are coordinates, or if the expression depends on the [conformal factor](Self::has_conformal_factor),
    /// which is no function of the state.
    ///
    /// ```
    /// use formula_lagrangian::Formula;
    /// let formula = Formula::parse("x'^2/2 - k*x^2/2", &["x"], &[("k", 2.0)])?;
    /// let energy = formula.expression("energy")?.gradient_at(0.0, &[3.0], &[4.0], 0.0);
    /// assert_eq!((energy.value, energy.q[0], energy.v[0], energy.parameters[0]), (17.0, 6.0, 4.0, 4.5));
    /// # Ok::<(), formula_lagrangian::FormulaError>(())
    /// ```
    pub fn gradient_at(&self, t: f64, q: &[f64], v: &[f64], z: f64) -> ExpressionGradient {
        let nodes = ParametricNodes::new(&self.graph, &[self.root]);
        let n = self.names.dimension;
        let known = if self.has_conformal_factor() { &[] } else { q.get(..n).unwrap_or(&[]) };
        let constant = |x: &[f64]| x.iter().map(|x| Along::from(*x)).collect::<Vec<_>>();
        // The inputs t, z, q, v and the parameters, one after the other.
        let mut inputs = constant(&[t, z]);
        inputs.extend(constant(known));
        let first_velocity = inputs.len();
        inputs.extend(constant(v.get(..n).unwrap_or(&[])));
        let first_parameter = inputs.len();
        inputs.extend(constant(&self.values));
        let evaluate = |inputs: &[Along]| {
            let mut value = [Along::from(f64::NAN)];
            let (state, theta) = inputs.split_at(first_parameter);
            let (start, v) = state.split_at(first_velocity);
            if let [t, z, q @ ..] = start {
                nodes.evaluate(theta, At { q, v, z: *z, t: *t }, &mut value);
            }
            value[0]
        };
        let value = evaluate(&inputs).re;
        let mut slopes = Vec::with_capacity(inputs.len());
        for i in 0..inputs.len() {
            let set = |inputs: &mut [Along], slope: f64| {
                if let Some(input) = inputs.get_mut(i) {
                    input.d = SVector::<f64, 1>::from_element(slope);
                }
            };
            set(&mut inputs, 1.0);
            slopes.push(evaluate(&inputs).d[0]);
            set(&mut inputs, 0.0);
        }
        let part = |from: usize, to: usize| slopes.get(from..to).map_or_else(Vec::new, <[f64]>::to_vec);
        let first = |i: usize| slopes.get(i).copied().unwrap_or(f64::NAN);
        ExpressionGradient {
            value,
            t: first(0),
            q: part(2, first_velocity),
            v: part(first_velocity, first_parameter),
            z: first(1),
            parameters: part(first_parameter, slopes.len()),
        }
    }
}
