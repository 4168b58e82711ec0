//! Derivatives of motions of rigid bodies.

use super::integrator::{BodyIntegrator, BodyMethod, ForcedBody, with_ends};
use super::observer::Rows;
use super::run::Prepared;
use super::steps::of_integrator;
use super::{Body, BodyMotion};
use crate::{RuntimeError, StepControl};
use contact_geom::groups::{GroupForce, Rotations, UniformGravity};
use contact_geom::nalgebra::{DMatrix, Matrix3, Vector3};
use discrete_herglotz::groups::{GroupDerivatives, GroupGauss, GroupState, StepsAndRest};
use discrete_herglotz::{AnyIntegrator, InputError};

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
    /// The [columns](Body::COLUMNS) of the state.
    pub columns: [f64; 19],
    /// Their derivatives in time along the motion.
    pub rates: [f64; 19],
    /// The derivatives of the columns, one row for each, in the start and in the parameters, one column for
    /// each in this order.
    pub of_columns: DMatrix<f64>,
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
        let found = self.derivatives_at(motion, &[motion.end])?.pop();
        found.ok_or_else(|| RuntimeError::argument("times", "are empty; give the times of the derivatives"))
    }

    /// The same at several times of a motion, in their order along it: after its steps, and where a time is between two of them
    /// after a shorter one.
    ///
    /// # Errors
    /// Those of [`derivatives`](Self::derivatives); [`RuntimeError::Input`] for times that are not in order or not of the
    /// motion.
    pub fn derivatives_at(&self, motion: &BodyMotion, times: &[f64]) -> Result<Vec<BodyDerivatives>, RuntimeError> {
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
        let ends = ends(motion, times, step_size, steps)?;
        let found = GroupDerivatives::of_rows_with_parameters(&gauss, motion.t, &state.state(), &ends);
        let found = found.map_err(|error| of_integrator(&error))?;
        let all = found.iter().zip(times);
        Ok(all.map(|(found, t)| self.of_end(found, *t, &rows, Vector3::from(motion.omega))).collect())
    }

    /// The derivatives of a state in the start, of which the velocity is given, and in the parameters.
    fn of_end(
        &self,
        found: &GroupDerivatives<Rotations, 3>,
        t: f64,
        rows: &Rows,
        omega: Vector3<f64>,
    ) -> BodyDerivatives {
        // A velocity at the start is a momentum J omega.
        let of_velocity = found.in_start.columns(3, 3) * rows.lagrangian.mass();
        let mut in_start = found.in_start.clone();
        in_start.columns_mut(3, 3).copy_from(&of_velocity);
        let mut in_parameters = DMatrix::zeros(7, Self::PARAMETERS.len());
        let tangents = self.tangents();
        for (k, column) in tangents.iter().enumerate() {
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
        let mut of_columns = DMatrix::zeros(Self::COLUMNS.len(), 7 + Self::PARAMETERS.len());
        let changes = in_start.column_iter().map(|change| (change, Tangent::null()));
        let changes = changes.chain(in_parameters.column_iter().zip(tangents));
        for (mut to, (change, of)) in of_columns.column_iter_mut().zip(changes) {
            let of_tip = if self.centre == [0.0; 3] { Vector3::zeros() } else { of.centre };
            to.copy_from_slice(&rows.change(&found.end, change.as_slice(), (&of, of_tip)));
        }
        let rates = rows.change(&found.end, &self.rates(rows, t, &found.end), (&Tangent::null(), Vector3::zeros()));
        BodyDerivatives {
            in_start,
            in_parameters,
            columns: rows.row(t, &found.end),
            rates: std::array::from_fn(|k| if k == 0 { 1.0 } else { rates[k] }),
            of_columns,
            log_factor: found.log_factor,
            contact_defect: found.contact_defect(),
        }
    }

    /// The derivatives in time of the body coordinates of a state: `Pi' = Pi x omega + X x (R^T m g) + gamma Pi + f`, `z' = l`.
    fn rates(&self, rows: &Rows, t: f64, at: &GroupState<Rotations, 3>) -> [f64; 7] {
        let (omega, UniformGravity { weight, centre }) =
            (rows.lagrangian.velocity(&at.momentum), rows.lagrangian.potential());
        let (weight, centre, gamma) = (Vector3::from(*weight), Vector3::from(*centre), rows.lagrangian.gamma());
        let in_body = |x: Vector3<f64>| Vector3::from_fn(|i, _| x.dot(&at.g.apply(&Vector3::ith(i, 1.0))));
        let force = self.torque.value(t, &at.g, &omega, at.z);
        let momentum = at.momentum.cross(&omega) + centre.cross(&in_body(weight)) + at.momentum * gamma + force;
        let z = 0.5 * omega.dot(&at.momentum) + weight.dot(&at.g.apply(&centre)) + gamma * at.z;
        let mut rates = [0.0; 7];
        let parts = omega.iter().chain(&momentum).chain([&z]);
        rates.iter_mut().zip(parts).for_each(|(to, from)| *to = *from);
        rates
    }

    /// The derivatives of the coefficients of the Lagrangian in the parameters.
    fn tangents(&self) -> Vec<Tangent> {
        let (m, x, g) = (self.mass, Vector3::from(self.centre), Vector3::from(self.gravity));
        let null = Tangent::null();
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
pub(super) struct Tangent {
    pub inertia: Matrix3<f64>,
    pub weight: Vector3<f64>,
    pub centre: Vector3<f64>,
    pub gamma: f64,
}

impl Tangent {
    /// No change.
    fn null() -> Self {
        Tangent { inertia: Matrix3::zeros(), weight: Vector3::zeros(), centre: Vector3::zeros(), gamma: 0.0 }
    }
}

/// The numbers of steps to times of a motion, with the length of the step that remains.
fn ends(motion: &BodyMotion, times: &[f64], h: f64, steps: usize) -> Result<Vec<StepsAndRest>, RuntimeError> {
    let mut last = motion.t;
    let of = |(index, t): (usize, &f64)| {
        // Written so that a NaN is refused.
        let in_order = (t - last) * h >= 0.0 && (motion.end - t) * h >= 0.0;
        if !in_order {
            return Err(InputError::Times { index, t: *t }.into());
        }
        last = *t;
        let round_off = 4.0 * f64::EPSILON * (motion.t.abs() + motion.end.abs()) / h.abs();
        let whole = (((t - motion.t) / h + round_off).floor() as usize).min(steps);
        let rest = t - (motion.t + whole as f64 * h);
        let is_round_off = rest.abs() <= round_off * h.abs() || *t == motion.end;
        Ok((whole, if is_round_off { 0.0 } else { rest }))
    };
    times.iter().enumerate().map(of).collect()
}

/// The error of an integrator that has no derivatives.
fn without_derivatives(by: AnyIntegrator) -> RuntimeError {
    let why = format!(
        "is \"{by}\", whose derivatives in the parameters are not known; derivatives take a Gauss method such as \"gauss_4\""
    );
    RuntimeError::argument("integrator", why)
}
