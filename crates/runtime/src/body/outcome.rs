//! Results of motions of rigid bodies.

use discrete_herglotz::AnyIntegrator;
use discrete_herglotz::groups::GroupStatus;

/// The result of a motion of a rigid body. Where the motion was ended early, it describes the part that was computed.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyOutcome {
    /// How it ended.
    pub status: GroupStatus,
    /// The integrator.
    pub by: AnyIntegrator,
    /// The length of a step, negative where the motion runs backward.
    pub step_size: f64,
    /// The steps taken.
    pub steps: usize,
    /// The time reached.
    pub t: f64,
    /// The attitude there, a unit quaternion with the real part first.
    pub attitude: [f64; 4],
    /// The momentum in the body there.
    pub momentum: [f64; 3],
    /// The angular velocity in the body there.
    pub omega: [f64; 3],
    /// The momentum in space there.
    pub spatial_momentum: [f64; 3],
    /// The [tip](crate::Body::tip) in space there.
    pub tip: [f64; 3],
    /// The energy there.
    pub energy: f64,
    /// The action there.
    pub z: f64,
    /// A bound of the error of the attitude (in radians) and of the momentum (relative), where an accuracy was
    /// requested.
    pub error_estimate: Option<f64>,
}

impl BodyOutcome {
    /// From the integrator, the length of a step and their number, and the [columns](crate::Body::COLUMNS) of the state.
    pub(super) fn new(
        status: GroupStatus,
        (by, step_size, steps): (AnyIntegrator, f64, usize),
        row: &[f64; 19],
        error_estimate: Option<f64>,
    ) -> Self {
        let [t, w, x, y, zz, p1, p2, p3, o1, o2, o3, m1, m2, m3, tx, ty, tz, energy, z] = *row;
        BodyOutcome {
            status,
            by,
            step_size,
            steps,
            t,
            attitude: [w, x, y, zz],
            momentum: [p1, p2, p3],
            omega: [o1, o2, o3],
            spatial_momentum: [m1, m2, m3],
            tip: [tx, ty, tz],
            energy,
            z,
            error_estimate,
        }
    }

    /// The [columns](crate::Body::COLUMNS) of the state that was reached.
    pub fn row(&self) -> [f64; 19] {
        let ([w, x, y, z], [p1, p2, p3], [o1, o2, o3]) = (self.attitude, self.momentum, self.omega);
        let ([m1, m2, m3], [tx, ty, tz]) = (self.spatial_momentum, self.tip);
        [self.t, w, x, y, z, p1, p2, p3, o1, o2, o3, m1, m2, m3, tx, ty, tz, self.energy, self.z]
    }
}
