//! Tangents and covectors of starts that are projected to holonomic constraints.

use crate::integration::StartProjection;
use crate::run::discretization::Discretization;
use crate::sensitivity::EndCovector;
use crate::sensitivity::columns::{Column, Covector};
use crate::sensitivity::parametric_system::Differentiable;
use crate::sensitivity::velocity_dependence::VelocityDependence;
use crate::system::products::{times, transposed_times};
use crate::{SecondDerivatives, StepError, Vector};
use contact_geom::nalgebra::{DMatrix, DVector};

/// The projection of the start of a run to the constraints, in the coordinates `(q, p, z)`: the start moves with the
/// constraints where these contain a parameter, and only along them in the directions of its variables.
pub(super) struct ProjectedStart {
    projection: StartProjection,
    of_velocity: VelocityDependence,
    /// `L_qv` and `L_vv`, with `dp = L_vq dq + L_vv dv` for a change of the start.
    qv: DMatrix<f64>,
    vv: DMatrix<f64>,
}

impl ProjectedStart {
    /// That of a run; `None` without constraints.
    pub fn of<'p>(problem: &Differentiable<'p>, steps: &Discretization<'p>) -> Result<Option<Self>, StepError> {
        if !steps.info.constrained {
            return Ok(None);
        }
        let (of, count) = (&problem.problem, problem.of.parameters().len());
        let Some(projection) = steps.integrator.start_projection(of, count)? else { return Ok(None) };
        let of_velocity = VelocityDependence::at(problem, of.t0, &of.start, &of.state.p)?;
        let SecondDerivatives { qv, vv, .. } = of.system.hessian(of.t0, &of.start);
        Ok(Some(ProjectedStart { projection, of_velocity, qv, vv }))
    }

    /// The number of constraints.
    pub fn constraints(&self) -> usize {
        self.projection.jacobian.nrows()
    }

    /// Projects the tangent of a start.
    pub fn push(&self, column: &mut Column) {
        let StartProjection { response, jacobian, curvature, parameters } = &self.projection;
        let explicit = column.parameter.and_then(|k| parameters.get(k)?.as_ref());
        let add = |to: &mut Vector, which: usize| {
            if let Some(of) = explicit {
                to.iter_mut().zip(of[which].iter()).for_each(|(to, slope)| *to += slope);
            }
        };
        let dv = self.of_velocity.along(&column.q, &column.p, column.z, column.parameter, column.dt0);
        let mut distance = times(jacobian, &column.q);
        add(&mut distance, 0);
        let change_of_q = -times(response, &distance);
        column.q += &change_of_q;
        let mut normal = times(jacobian, &dv) + times(curvature, &column.q);
        add(&mut normal, 1);
        let change_of_v = -times(response, &normal);
        column.p += &(transposed_times(&self.qv, &change_of_q) + times(&self.vv, &change_of_v));
    }

    /// The transpose of [`push`](Self::push).
    pub fn pull(&self, covector: &mut Covector) {
        let StartProjection { response, jacobian, curvature, parameters } = &self.projection;
        let of_normal = -transposed_times(response, &times(&self.vv, &covector.p));
        let of_moved = transposed_times(curvature, &of_normal) + &covector.q;
        let of_distance = -transposed_times(response, &(times(&self.qv, &covector.p) + &of_moved));
        covector.q = transposed_times(jacobian, &of_distance) + &of_moved;
        for (sum, of) in covector.parameters.iter_mut().zip(parameters) {
            if let Some([of_value, of_velocity]) = of {
                *sum += product(of_value, &of_distance) + product(of_velocity, &of_normal);
            }
        }
        let of_v = transposed_times(jacobian, &of_normal);
        let zero = EndCovector::zero(of_v.len());
        let (state, parameters, time) = self.of_velocity.pull(&EndCovector { v: of_v, ..zero });
        covector.add_state(&state, &parameters);
        covector.add_time(time, 0);
    }
}

fn product(a: &DVector<f64>, b: &Vector) -> f64 {
    a.iter().zip(b.iter()).map(|(a, b)| a * b).sum()
}
