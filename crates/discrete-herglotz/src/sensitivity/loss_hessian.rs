//! Second derivatives of losses of the end of a run.

use crate::run::{Outcome, Run, Until};
use crate::sensitivity::second_derivatives::{AlongTwo, along_two, mixed};
use crate::sensitivity::second_ends::{EndAlong, EndTangent};
use crate::sensitivity::second_tangent::Directions;
use crate::sensitivity::{EndState, Loss, SensitivityError, StateDerivative, Variable};
use contact_geom::Parametric;
use contact_geom::nalgebra::{DMatrix, DVector, SVector};

/// A run with the first and second derivatives of a loss of its end.
#[derive(Clone, Debug, PartialEq)]
pub struct LossHessian<const N: usize> {
    /// The outcome of the run.
    pub outcome: Outcome<N>,
    /// The loss with its derivatives; `None` if the run was not completed, for the reason that the status of the outcome
    /// gives.
    pub loss: Option<LossDerivatives>,
}

/// A loss with its first and second derivatives with respect to variables.
#[derive(Clone, Debug, PartialEq)]
pub struct LossDerivatives {
    /// The value.
    pub value: f64,
    /// The derivatives, in the order of the variables.
    pub gradient: DVector<f64>,
    /// The Hessian matrix; or its products with the given directions, each of which is a row.
    pub hessian: DMatrix<f64>,
    /// The factor by which round-off of the second derivatives of the end is amplified; see
    /// [`EndDerivatives::growth`](crate::sensitivity::EndDerivatives::growth).
    pub growth: f64,
}

impl<L: Parametric<N>, const N: usize> Run<'_, '_, L, N> {
    /// Performs the run, and computes a loss of its end with its gradient and its Hessian matrix with respect to variables.
    /// The derivatives are those of the discrete run, to round-off.
    ///
    /// ```
    /// use contact_geom::{Scalar, VelocityPoint, systems::Pendulum};
    /// use discrete_herglotz::{Problem, Steps, Until, sensitivity::{EndState, Loss, Variable}};
    /// struct Miss;
    /// impl Loss<1> for Miss {
    ///     fn value<T: Scalar>(&self, end: &EndState<1, T>) -> T {
    ///         (end.q[0] - 0.5).powi(2)
    ///     }
    /// }
    /// let pendulum = Pendulum { gamma: -0.01 };
    /// let problem = Problem::new(&pendulum, 0.0, VelocityPoint::new([1.0], [1.0], 0.0))?;
    /// let variables = [Variable::Velocity(0), Variable::Parameter("gamma".into())];
    /// let run = problem.steps(Steps::Size(0.5)).hessian(&Miss, &variables, Until::Time(10.0))?;
    /// if let Some(loss) = run.loss {
    ///     println!("{}, its Hessian {}", loss.value, loss.hessian);
    /// }
    /// # Ok::<(), discrete_herglotz::sensitivity::SensitivityError>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`second_tangent`](Self::second_tangent); [`SensitivityError::Loss`] where the loss or a derivative of it
    /// is not finite.
    pub fn hessian(
        self,
        loss: &impl Loss<N>,
        variables: &[Variable],
        until: Until,
    ) -> Result<LossHessian<N>, SensitivityError> {
        self.hessian_in(loss, variables, Directions::Variables, until)
    }

    /// The same with the products of the Hessian matrix with directions, which have a component for each variable.
    ///
    /// # Errors
    /// Those of [`hessian`](Self::hessian); [`SensitivityError::Direction`].
    pub fn hessian_along(
        self,
        loss: &impl Loss<N>,
        variables: &[Variable],
        directions: &[Vec<f64>],
        until: Until,
    ) -> Result<LossHessian<N>, SensitivityError> {
        self.hessian_in(loss, variables, Directions::Given(directions), until)
    }

    fn hessian_in(
        self,
        loss: &impl Loss<N>,
        variables: &[Variable],
        directions: Directions<'_>,
        until: Until,
    ) -> Result<LossHessian<N>, SensitivityError> {
        let run = self.second_order(variables, directions, until)?;
        let loss = run.end.map(|end| differentiate(loss, &end)).transpose()?;
        Ok(LossHessian { outcome: run.outcome, loss })
    }
}

/// A loss of the end of a run, with its derivatives by the chain rule.
fn differentiate<const N: usize>(loss: &impl Loss<N>, end: &EndAlong<N>) -> Result<LossDerivatives, SensitivityError> {
    let EndAlong { state, columns, along, second, growth } = end;
    let zero = SVector::zeros();
    let none = StateDerivative { q: zero, v: zero, p: zero, z: 0.0 };
    let (value, count) = (loss.value(state), columns.len());
    let of = |a: &EndTangent<N>, b: &EndTangent<N>, ab: &StateDerivative<N>| loss.value(&moved(state, [a, b], ab));
    let gradient = DVector::from_fn(count, |i, _| of(&columns[i], &columns[i], &none).re.d[0]);
    let hessian = DMatrix::from_fn(along.len(), count, |d, i| mixed(&of(&along[d], &columns[i], &second[d][i])));
    if !gradient.iter().chain(&hessian).chain([&value]).all(|x| x.is_finite()) {
        return Err(SensitivityError::Loss { value });
    }
    Ok(LossDerivatives { value, gradient, hessian, growth: *growth })
}

/// The state moved along two tangents, with its second derivative along them. Its time is linear in the variables.
fn moved<const N: usize>(
    state: &EndState<N>,
    [a, b]: [&EndTangent<N>; 2],
    ab: &StateDerivative<N>,
) -> EndState<N, AlongTwo> {
    let vector = |re: &SVector<f64, N>, of: &dyn Fn(&StateDerivative<N>) -> SVector<f64, N>| {
        let [a, b, ab] = [&a.state, &b.state, ab].map(of);
        SVector::<AlongTwo, N>::from_fn(|d, _| along_two(re[d], [a[d], b[d]], ab[d]))
    };
    EndState {
        t: along_two(state.t, [a.t, b.t], 0.0),
        q: vector(&state.q, &|x| x.q),
        v: vector(&state.v, &|x| x.v),
        p: vector(&state.p, &|x| x.p),
        z: along_two(state.z, [a.state.z, b.state.z], ab.z),
    }
}
