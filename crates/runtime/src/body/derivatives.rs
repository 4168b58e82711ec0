//! Derivatives of motions of rigid bodies.

use super::integrator::{BodyIntegrator, BodyMethod, ForcedBody, with_ends};
use super::run::Prepared;
use super::steps::of_integrator;
use super::{Body, BodyMotion};
use crate::{RuntimeError, StepControl};
use contact_geom::groups::Rotations;
use contact_geom::nalgebra::{DMatrix, Matrix3, Vector3};
use discrete_herglotz::AnyIntegrator;
use discrete_herglotz::groups::{GroupDerivatives, GroupGauss};

/// The derivatives of the end of a motion of a rigid body, those of the discrete motion.
///
/// The end has the coordinates `turn1`, `turn2`, `turn3` (the rotation `R exp(turn)` in the body, in radians), the momentum
/// `Pi1`, `Pi2`, `Pi3` in the body, and `z`: the rows, in this order.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyDerivatives {
    /// In the start, one column for each of `turn1`, `turn2`, `turn3`, `omega1`, `omega2`, `omega3`, `z`.
    pub in_start: DMatrix<f64>,
    /// In the [parameters](Body::PARAMETERS) for a fixed start, one column for each.
    pub in_parameters: DMatrix<f64>,
    /// The logarithm of the conformal factor.
    pub log_factor: f64,
    /// The largest component of `Phi* eta - sigma eta`, relative to that of `Phi* eta`, for the contact form
    /// `eta = dz - Pi . (R^-1 dR)`.
    pub contact_defect: f64,
}

/// The entries of the inertia tensor of the parameters.
const ENTRIES: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

impl Body {
    /// The names of the parameters in the order of the [derivatives](Self::derivatives): the entries of the inertia tensor
    /// about the centre of mass, of which those off the diagonal change with their mirror images, the mass, the centre of
    /// mass, gravity and the rate.
    pub const PARAMETERS: [&'static str; 14] = [
        "inertia11",
        "inertia12",
        "inertia13",
        "inertia22",
        "inertia23",
        "inertia33",
        "mass",
        "centre1",
        "centre2",
        "centre3",
        "gravity1",
        "gravity2",
        "gravity3",
        "gamma",
    ];

    /// The derivatives of a motion in its start and in the [parameters](Self::PARAMETERS), by dual numbers through every
    /// step of a Gauss method.
    ///
    /// ```
    /// use herglotz_runtime::{AnyIntegrator, Body, BodyMotion, StepControl, Steps};
    /// let body = Body { inertia: Body::principal([1.0, 2.0, 3.0]), gamma: -0.1, ..Body::default() };
    /// let by = AnyIntegrator::Gauss { stages: 4 };
    /// let steps = StepControl::Steps { by, steps: Steps::Count(50) };
    /// let found = body.derivatives(&BodyMotion::new([1.0, 0.0, 0.0, 0.0], [1.0, 0.5, 0.25], 5.0, steps))?;
    /// println!("d Pi3/d gamma = {}", found.in_parameters[(5, 13)]);
    /// # Ok::<(), herglotz_runtime::RuntimeError>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`run`](Self::run); [`RuntimeError::Argument`] for a splitting, whose derivatives in the inertia are not
    /// known, and for a step that fails.
    pub fn derivatives(&self, motion: &BodyMotion) -> Result<BodyDerivatives, RuntimeError> {
        let named = match motion.step_control {
            StepControl::Steps { by, .. } => Some(by),
            StepControl::Accuracy { by, .. } => by,
        };
        // The advice for a motion that another integrator cannot take would name those without derivatives.
        let Prepared { by, steps, step_size, state, rows, .. } = match named {
            Some(by) if !matches!(by, AnyIntegrator::Gauss { .. }) => return Err(without_derivatives(by)),
            _ => self.prepare(motion)?,
        };
        let AnyIntegrator::Gauss { stages } = by else {
            return Err(without_derivatives(by));
        };
        let body = ForcedBody { lagrangian: rows.lagrangian, force: self.torque.clone() };
        let gauss = GroupGauss::new::<Rotations, 3>(body.clone(), stages, step_size);
        let gauss = gauss.and_then(|gauss| with_ends(gauss, &body, motion.interrupt.as_ref()));
        let gauss = gauss.map_err(|error| of_integrator(&error))?;
        let found = GroupDerivatives::with_parameters(&gauss, motion.t, &state.state(), steps);
        let found = found.map_err(|error| of_integrator(&error))?;
        let omega = Vector3::from(motion.omega);
        // A velocity at the start is a momentum J omega.
        let of_velocity = found.in_start.columns(3, 3) * rows.lagrangian.mass();
        let mut in_start = found.in_start.clone();
        in_start.columns_mut(3, 3).copy_from(&of_velocity);
        let mut in_parameters = DMatrix::zeros(7, Self::PARAMETERS.len());
        for (k, column) in self.tangents().iter().enumerate() {
            // The inertia about the fixed point changes the momentum at the start, and the motion.
            let inertia = Matrix3::from_fn(|i, j| column.inertia[(i.min(j), i.max(j))]);
            let mut sum = found.in_start.columns(3, 3) * (inertia * omega);
            for (c, (i, j)) in ENTRIES.iter().enumerate() {
                sum += found.in_parameters.column(c) * inertia[(*i, *j)];
            }
            for i in 0..3 {
                sum += found.in_parameters.column(6 + i) * column.weight[i];
                sum += found.in_parameters.column(9 + i) * column.centre[i];
            }
            sum += found.in_parameters.column(12) * column.gamma;
            in_parameters.set_column(k, &sum);
        }
        let contact_defect = found.contact_defect();
        Ok(BodyDerivatives { in_start, in_parameters, log_factor: found.log_factor, contact_defect })
    }

    /// The derivatives of the coefficients of the Lagrangian in the parameters.
    fn tangents(&self) -> Vec<Tangent> {
        let (m, x, g) = (self.mass, Vector3::from(self.centre), Vector3::from(self.gravity));
        let null =
            Tangent { inertia: Matrix3::zeros(), weight: Vector3::zeros(), centre: Vector3::zeros(), gamma: 0.0 };
        let of_inertia = ENTRIES.iter().map(|(i, j)| {
            let mut inertia = Matrix3::zeros();
            inertia[(*i, *j)] = 1.0;
            Tangent { inertia, ..null }
        });
        // J = I + m (|X|^2 1 - X X^T), weight = m g.
        let of_mass = Tangent { inertia: Matrix3::identity() * x.dot(&x) - x * x.transpose(), weight: g, ..null };
        let axis = |k: usize| Vector3::from_fn(|i, _| if i == k { 1.0 } else { 0.0 });
        let of_centre = (0..3).map(|k| {
            let e = axis(k);
            let inertia = (Matrix3::identity() * (2.0 * x.dot(&e)) - e * x.transpose() - x * e.transpose()) * m;
            Tangent { inertia, centre: e, ..null }
        });
        let of_gravity = (0..3).map(|k| Tangent { weight: axis(k) * m, ..null });
        let of_rate = Tangent { gamma: 1.0, ..null };
        of_inertia.chain([of_mass]).chain(of_centre).chain(of_gravity).chain([of_rate]).collect()
    }

    /// The integrator of a motion with the step of another one, by which it is compared.
    pub(super) fn with_step(&self, by: AnyIntegrator, h: f64) -> Result<BodyIntegrator, RuntimeError> {
        let body = ForcedBody { lagrangian: self.lagrangian()?, force: self.torque.clone() };
        BodyMethod::integrator(&body, by, h, None).map_err(|error| of_integrator(&error))
    }
}

/// A change of the coefficients of the Lagrangian; of the inertia the upper triangle is used.
#[derive(Clone, Copy)]
struct Tangent {
    inertia: Matrix3<f64>,
    weight: Vector3<f64>,
    centre: Vector3<f64>,
    gamma: f64,
}

/// The error of an integrator that has no derivatives.
fn without_derivatives(by: AnyIntegrator) -> RuntimeError {
    let why = format!(
        "is \"{by}\", whose derivatives in the parameters are not known; derivatives take a Gauss method such as \"gauss_4\""
    );
    RuntimeError::argument("integrator", why)
}
