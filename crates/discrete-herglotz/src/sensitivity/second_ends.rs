//! The second derivatives of the momentum at the start of a run, and of the velocity at its end.

use crate::sensitivity::columns::Column;
use crate::sensitivity::end_state::VelocityDependence;
use crate::sensitivity::engine::second_order::SecondColumn;
use crate::sensitivity::second_derivatives::{PointTangent, SecondDerivatives};
use crate::sensitivity::{EndState, StateDerivative, Variable};
use crate::{Problem, StepError};
use contact_geom::nalgebra::SVector;
use contact_geom::numbers::max_or_nan;
use contact_geom::{ChartVector, Parametric, VelocityPoint};

/// A pair of tangents along which second derivatives are computed: a direction and a variable.
pub(crate) type Pair = (usize, usize);

/// The tangent of the start of a run, in `(q, v, z)`, along a direction, with the derivatives of its time and of the
/// parameters.
pub(crate) struct StartTangent<const N: usize> {
    x: ChartVector<N>,
    t: f64,
    theta: Vec<f64>,
}

impl<const N: usize> StartTangent<N> {
    /// The tangent along a direction, whose components are the changes of the variables. Those of momenta do not count,
    /// because the momentum is then linear in the variables.
    pub fn along<L: Parametric<N>>(problem: &Problem<'_, L, N>, variables: &[Variable], direction: &[f64]) -> Self {
        let lagrangian = problem.lagrangian;
        let zero = SVector::<f64, N>::zeros();
        let theta = vec![0.0; lagrangian.parameter_count()];
        let mut tangent = StartTangent { x: ChartVector { x: zero, y: zero, z: 0.0 }, t: 0.0, theta };
        for (variable, change) in variables.iter().zip(direction) {
            let component = match variable {
                Variable::Position(i) => tangent.x.x.get_mut(*i),
                Variable::Velocity(i) => tangent.x.y.get_mut(*i),
                Variable::Action => Some(&mut tangent.x.z),
                Variable::Parameter(name) => {
                    lagrangian.parameter_index(name).ok().and_then(|index| tangent.theta.get_mut(index))
                }
                Variable::StartTime => Some(&mut tangent.t),
                Variable::Momentum(_) | Variable::EndTime => None,
            };
            if let Some(component) = component {
                *component += change;
            }
        }
        tangent
    }

    /// The second derivative of the momentum of the start, which is `L_v(t, q, v, z; theta)` where the velocity was given.
    pub fn second_momentum<L: Parametric<N>>(
        problem: &Problem<'_, L, N>,
        of_two: &mut SecondDerivatives<N>,
        tangents: [&Self; 2],
    ) -> SVector<f64, N> {
        if problem.from_momentum {
            return SVector::zeros();
        }
        let [a, b] = tangents.map(|StartTangent { x, t, theta }| PointTangent { x: *x, rho: 0.0, t: *t, theta });
        of_two.at(problem.lagrangian, (problem.t0, &problem.start, 1.0), &a, &b).momentum
    }
}

/// What was carried to the end of a run.
pub(crate) struct CarriedDerivatives<const N: usize> {
    pub of_two: SecondDerivatives<N>,
    pub columns: Vec<Column<N>>,
    pub directions: Vec<Vec<f64>>,
    pub second: Vec<(Pair, SecondColumn<N>)>,
    /// The largest second derivative along the run.
    pub largest: f64,
    /// The number of steps.
    pub steps: usize,
}

/// The derivative of the end of a run along a direction, with those of its time and of the parameters.
#[derive(Clone)]
pub(crate) struct EndTangent<const N: usize> {
    pub state: StateDerivative<N>,
    pub t: f64,
    theta: Vec<f64>,
}

impl<const N: usize> EndTangent<N> {
    /// The sum of multiples of tangents.
    fn combination(columns: &[Self], factors: &[f64], parameters: usize) -> Self {
        let zero = SVector::zeros();
        let state = StateDerivative { q: zero, v: zero, p: zero, z: 0.0 };
        let mut sum = EndTangent { state, t: 0.0, theta: vec![0.0; parameters] };
        for (column, factor) in columns.iter().zip(factors) {
            sum.state.q += column.state.q * *factor;
            sum.state.v += column.state.v * *factor;
            sum.state.p += column.state.p * *factor;
            sum.state.z += column.state.z * factor;
            sum.t += column.t * factor;
            sum.theta.iter_mut().zip(&column.theta).for_each(|(sum, theta)| *sum += theta * factor);
        }
        sum
    }

    fn at_point(&self) -> PointTangent<'_, N> {
        let StateDerivative { q, v, z, .. } = self.state;
        PointTangent { x: ChartVector { x: q, y: v, z }, rho: 0.0, t: self.t, theta: &self.theta }
    }
}

/// The end of a run with its first and second derivatives.
pub(crate) struct EndAlong<const N: usize> {
    pub state: EndState<N>,
    /// The derivatives in the variables, and those along the directions.
    pub columns: Vec<EndTangent<N>>,
    pub along: Vec<EndTangent<N>>,
    /// The derivative of each column along each direction.
    pub second: Vec<Vec<StateDerivative<N>>>,
    pub growth: f64,
}

impl<const N: usize> EndAlong<N> {
    /// The derivatives of the end from those of `(q, p, z)`; `symmetric` states that the directions are the variables, and
    /// that only the pairs with `d <= i` are given.
    ///
    /// The second derivative of the velocity is the solution of `W v_ab = p_ab - L_vq q_ab - L_vz z_ab - (L_v)_ab`, where
    /// the last term is the second derivative along the first ones.
    ///
    /// # Errors
    /// [`StepError::Singular`] where W is singular, [`StepError::NonFinite`] where a derivative is not finite.
    pub fn new<L: Parametric<N>>(
        problem: &Problem<'_, L, N>,
        state: EndState<N>,
        carried: CarriedDerivatives<N>,
        symmetric: bool,
    ) -> Result<Self, StepError> {
        let CarriedDerivatives { mut of_two, columns, directions, second: pairs, largest, steps } = carried;
        let (lagrangian, x) = (problem.lagrangian, VelocityPoint { q: state.q, v: state.v, z: state.z });
        let of_velocity = VelocityDependence::at(problem, state.t, &x, &state.p)?;
        let parameters = lagrangian.parameter_count();
        let columns: Vec<EndTangent<N>> = columns
            .iter()
            .map(|column| {
                let Column { q, p, z, parameter, .. } = *column;
                let t = column.time_after(steps);
                let v = of_velocity.along(&q, &p, z, parameter, t);
                let theta = (0..parameters).map(|k| f64::from(u8::from(parameter == Some(k)))).collect();
                EndTangent { state: StateDerivative { q, v, p, z }, t, theta }
            })
            .collect();
        let along: Vec<_> = directions.iter().map(|d| EndTangent::combination(&columns, d, parameters)).collect();
        let zero = SVector::zeros();
        let none = StateDerivative { q: zero, v: zero, p: zero, z: 0.0 };
        let mut second = vec![vec![none; columns.len()]; directions.len()];
        let mut size = 0.0;
        for ((d, i), of) in &pairs {
            let [a, b] = [along[*d].at_point(), columns[*i].at_point()];
            let of_first = of_two.at(lagrangian, (state.t, &x, 1.0), &a, &b).momentum;
            let v = of_velocity.along(&of.q, &(of.p - of_first), of.z, None, 0.0);
            let derivative = StateDerivative { q: of.q, v, p: of.p, z: of.z };
            size = max_or_nan(size, of.size());
            second[*d][*i] = derivative;
            if symmetric {
                second[*i][*d] = derivative;
            }
        }
        if !columns.iter().map(|column| &column.state).chain(second.iter().flatten()).all(is_finite) {
            return Err(StepError::NonFinite);
        }
        let growth = if largest > size { largest / size } else { 1.0 };
        Ok(EndAlong { state, columns, along, second, growth })
    }
}

fn is_finite<const N: usize>(of: &StateDerivative<N>) -> bool {
    of.q.iter().chain(&of.v).chain(&of.p).chain([&of.z]).all(|x| x.is_finite())
}
