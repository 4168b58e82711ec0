//! Lyapunov exponents of motions.

use discrete_herglotz::Status;

/// The Lyapunov exponents of a motion of n coordinates: the mean growth rates of its tangent in (q, p, z); see
/// [`System::lyapunov_exponents`](crate::System::lyapunov_exponents).
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct LyapunovExponents {
    /// How the motion ended. Where it was not completed the exponents are those of its whole steps.
    pub status: Status,
    /// The time that was reached.
    pub t: f64,
    /// The steps taken.
    pub steps: usize,
    /// The `2n + 1` exponents, in descending order.
    pub exponents: Vec<f64>,
    /// The same of the second half of the motion, in the same order.
    pub of_second_half: Vec<f64>,
    /// The exponents of n pairs of directions of the position and the momentum of a coordinate; with the rate they are
    /// all exponents if `L_z` is constant.
    pub pairs: Vec<[f64; 2]>,
    /// The mean of `ln(sigma_d)/h`, the rate of the conformal factor.
    pub rate: f64,
    /// The largest distance of the sum of a pair from the rate, where the two are equal but for round-off: for
    /// constant `L_z`, without an applied force.
    pub pairing_defect: Option<f64>,
    /// The distance of the sum of all exponents from `n + 1` times the rate, where the two are equal but for round-off:
    /// without an applied force.
    pub volume_defect: Option<f64>,
}
