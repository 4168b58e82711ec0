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
    /// The exponents, in descending order: `2n + 1`, or `2 (n - m) + 1` under m constraints.
    pub exponents: Vec<f64>,
    /// The same of the second half of the motion, in the same order.
    pub of_second_half: Vec<f64>,
    /// The exponents of n pairs of directions of the position and the momentum of a coordinate; with the rate they are
    /// all exponents if `L_z` is constant. Empty under constraints.
    pub pairs: Vec<[f64; 2]>,
    /// The mean of `ln(sigma_d)/h`, the rate of the conformal factor.
    pub rate: f64,
    /// The largest distance of the sum of a pair from the rate, where the two are equal but for round-off: for
    /// constant `L_z`, without an applied force, constraints, and resets that are not contact.
    pub pairing_defect: Option<f64>,
    /// The distance of the sum of all exponents from `n + 1` times the rate, where the two are equal but for round-off:
    /// without an applied force, constraints, and resets that are not contact.
    pub volume_defect: Option<f64>,
}

/// The defect of the sums of pairs, relative to the largest exponent, from which exponents are wrong: far more than
/// round-off, and than the error with which steps meet impacts.
const MOST_DEFECT: f64 = 1e-4;

impl LyapunovExponents {
    /// What contradicts the exponents, with the remedy: sums of pairs that are not equal to the rate.
    pub fn contradiction(&self) -> Option<String> {
        let defect = self.pairing_defect?;
        let size = self.exponents.iter().fold(self.rate.abs(), |size, x| size.max(x.abs()));
        // Written so that a NaN is a contradiction.
        if defect <= MOST_DEFECT * size {
            return None;
        }
        Some(format!(
            "the Lyapunov exponents are not accurate: the sums of their pairs differ by {defect:.1e} from the mean of \
             ln(sigma_d)/h, to which they are equal; take more and shorter steps, so that the tangent grows by less than \
             1e8 in one of them, or request a smaller error"
        ))
    }
}
