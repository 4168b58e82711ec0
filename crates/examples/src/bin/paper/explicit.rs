//! The paper's explicit formulas for `q2` in section 5, as printed.

use contact_examples::systems::{FreeParticle, HarmonicOscillator};

/// A system whose discrete Herglotz equations the paper solves for `q2` explicitly.
pub trait Explicit {
    /// `q2` from `q0` and `q1`, for the time step `h`.
    fn third_point(&self, q0: f64, q1: f64, h: f64) -> f64;
}

/// `q2 = (h gamma + 2) q1 - (h gamma + 1) q0`.
impl Explicit for FreeParticle {
    fn third_point(&self, q0: f64, q1: f64, h: f64) -> f64 {
        let drag = h * self.gamma;
        (drag + 2.0) * q1 - (drag + 1.0) * q0
    }
}

/// `q2 = -((h^3 gamma + 4 h gamma + h^2 + 4) q0 + (h^3 gamma - 4 h gamma + 2 h^2 - 8) q1)/(h^2 + 4)`.
impl Explicit for HarmonicOscillator {
    fn third_point(&self, q0: f64, q1: f64, h: f64) -> f64 {
        let (square, cube, gamma) = (h * h, h * h * h, self.gamma);
        let of_q0 = cube * gamma + 4.0 * h * gamma + square + 4.0;
        let of_q1 = cube * gamma - 4.0 * h * gamma + 2.0 * square - 8.0;
        -(of_q0 * q0 + of_q1 * q1) / (square + 4.0)
    }
}
