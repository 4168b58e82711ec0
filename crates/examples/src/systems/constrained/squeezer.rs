//! Andrews' squeezing mechanism.

use contact_geom::constraints::Constraint;
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Scalar, Structure};

/// Andrews' squeezing mechanism: seven plane bodies in three closed loops, driven by a constant torque against a
/// spring, with linear drag. Seven angles `(beta, Theta, gamma, Phi, delta, Omega, epsilon)`, six constraints, one
/// degree of freedom. The mass matrix depends on the angles.
///
/// Definition, data and the reference solution without drag at `t = 0.03`: Mazzia and Magherini, Test Set for IVP
/// Solvers 2.4 (2008), chapter "Andrews' squeezing mechanism"; Hairer and Wanner, Solving ODEs II, section VII.7.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Squeezer {
    /// The rate `L_z` of the conformal factor, negative for dissipation; 0 in the test set.
    pub damping: f64,
}

impl Squeezer {
    /// The angles at the start, at which the mechanism is at rest.
    pub const START: [f64; 7] = [
        -0.061_713_890_014_276_45,
        0.0,
        0.455_279_819_163_070_37,
        0.222_668_390_165_885_88,
        0.487_364_979_543_842_56,
        -0.222_668_390_165_885_88,
        1.230_547_444_549_821_2,
    ];

    /// The angles at `t = 0.03` without drag, by the test set. Two independent methods that agree with each other to
    /// `1e-13` differ from them by up to `1.5e-9`.
    pub const REFERENCE: [f64; 7] = [
        15.810_771_196_299_04,
        -15.756_371_059_842_98,
        0.040_822_240_130_731_01,
        -0.534_730_116_322_694_8,
        0.524_409_965_880_530_4,
        0.534_730_116_322_694_8,
        1.048_080_741_042_263,
    ];
}

// The data of the test set, in SI units, with its names.
const MASSES: [f64; 7] = [0.04325, 0.00365, 0.02373, 0.00706, 0.07050, 0.00706, 0.05498];
const INERTIAS: [f64; 7] = [2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5];
const A: [f64; 2] = [-0.06934, -0.00227];
const B: [f64; 2] = [-0.03635, 0.03273];
const C: [f64; 2] = [0.014, 0.072];
const STIFFNESS: f64 = 4530.0;
const SPRING_LENGTH: f64 = 0.07785;
const TORQUE: f64 = 0.033;
const D: f64 = 0.028;
const DA: f64 = 0.0115;
const E: f64 = 0.02;
const EA: f64 = 0.01421;
const RR: f64 = 0.007;
const RA: f64 = 0.00092;
const SS: f64 = 0.035;
const SA: f64 = 0.01874;
const SB: f64 = 0.01043;
const SC: f64 = 0.018;
const SD: f64 = 0.02;
const TA: f64 = 0.02308;
const TB: f64 = 0.00916;
const U: f64 = 0.04;
const UA: f64 = 0.01228;
const UB: f64 = 0.00449;
const ZF: f64 = 0.02;
const ZT: f64 = 0.04;
const FA: f64 = 0.01421;

impl Lagrangian<7> for Squeezer {
    #[inline(always)]
    fn value<T: Scalar>(&self, _t: T, q: &SVector<T, 7>, v: &SVector<T, 7>, z: T) -> T {
        let [m1, m2, m3, m4, m5, m6, m7] = MASSES;
        let [i1, i2, i3, i4, i5, i6, i7] = INERTIAS;
        let (cos_theta, sin_phi, sin_omega) = (q[1].cos(), q[3].sin(), q[5].sin());
        let m11 = cos_theta * (-2.0 * m2 * DA * RR) + (m1 * RA * RA + m2 * (RR * RR + DA * DA) + i1 + i2);
        let m12 = cos_theta * (-m2 * DA * RR) + (m2 * DA * DA + i2);
        let m22 = m2 * DA * DA + i2;
        let m33 = m3 * (SA * SA + SB * SB) + i3;
        let arm = E - EA;
        let m44 = m4 * arm * arm + i4;
        let m45 = sin_phi * (m4 * ZT * arm) + (m4 * arm * arm + i4);
        let m55 = sin_phi * (2.0 * m4 * ZT * arm) + (m4 * (ZT * ZT + arm * arm) + m5 * (TA * TA + TB * TB) + i4 + i5);
        let arm = ZF - FA;
        let m66 = m6 * arm * arm + i6;
        let m67 = sin_omega * (-m6 * U * arm) + (m6 * arm * arm + i6);
        let m77 = sin_omega * (-2.0 * m6 * U * arm) + (m6 * (arm * arm + U * U) + m7 * (UA * UA + UB * UB) + i6 + i7);
        let kinetic = (m11 * v[0] * v[0] + m55 * v[4] * v[4] + m77 * v[6] * v[6]) * 0.5
            + v[1] * v[1] * (0.5 * m22)
            + v[2] * v[2] * (0.5 * m33)
            + v[3] * v[3] * (0.5 * m44)
            + v[5] * v[5] * (0.5 * m66)
            + m12 * v[0] * v[1]
            + m45 * v[3] * v[4]
            + m67 * v[5] * v[6];
        let (sin, cos) = q[2].sin_cos();
        let x = cos * SD + sin * SC + (B[0] - C[0]);
        let y = sin * SD - cos * SC + (B[1] - C[1]);
        let stretch = (x * x + y * y).sqrt() - SPRING_LENGTH;
        kinetic + q[0] * TORQUE - stretch * stretch * (0.5 * STIFFNESS) + z * self.damping
    }

    fn structure(&self) -> Structure {
        Structure { autonomous: true, z_free: self.damping == 0.0, z_affine: true, ..Structure::default() }
    }
}

impl Constraint<7, 6> for Squeezer {
    fn value<T: Scalar>(&self, q: &SVector<T, 7>) -> SVector<T, 6> {
        let (sin_beta, cos_beta) = q[0].sin_cos();
        let (sin_theta, cos_theta) = (q[0] + q[1]).sin_cos();
        let (sin_gamma, cos_gamma) = q[2].sin_cos();
        let (sin_phi, cos_phi) = (q[3] + q[4]).sin_cos();
        let (sin_delta, cos_delta) = q[4].sin_cos();
        let (sin_omega, cos_omega) = (q[5] + q[6]).sin_cos();
        let (sin_epsilon, cos_epsilon) = q[6].sin_cos();
        // The point P, from which the three loops return.
        let (x, y) = (cos_beta * RR - cos_theta * D, sin_beta * RR - sin_theta * D);
        SVector::from([
            x - sin_gamma * SS - B[0],
            y + cos_gamma * SS - B[1],
            x - sin_phi * E - cos_delta * ZT - A[0],
            y + cos_phi * E - sin_delta * ZT - A[1],
            x - cos_omega * ZF - sin_epsilon * U - A[0],
            y - sin_omega * ZF + cos_epsilon * U - A[1],
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mechanism is closed at its start and at the reference solution, to the round-off of their digits.
    #[test]
    fn constraints_hold_at_the_published_angles() {
        for angles in [Squeezer::START, Squeezer::REFERENCE] {
            let c = Constraint::value(&Squeezer::default(), &SVector::from(angles));
            assert!(c.amax() < 4.0 * f64::EPSILON, "{c}");
        }
    }
}
