//! The rotation of a satellite with tides: the spin-orbit problem.

use contact_geom::nalgebra::SVector;
use contact_geom::{ContactHamiltonian, HamiltonianStructure, PhasePoint, Scalar};

/// The first harmonic of the torque.
const FIRST: i32 = -5;
/// The number of harmonics.
const HARMONICS: usize = 15;

/// The rotation of a satellite of small triaxiality on a Keplerian ellipse, with a linear tidal torque and a periodic
/// moment of inertia `c(t) = 1 + lambda cos(omega t)`. Time in units of the inverse mean motion.
///
/// With the angle q from the pericentre, `H = p^2/2 - (eps/(2 c)) sum_k W_k cos(2 q - k t) - mu q + (d + c'/c) z`, so that
/// `q'' = -(eps/c) sum_k W_k sin(2 q - k t) + mu - (d + c'/c) q'`. The sum is `(a/r)^3 sin(2 q - 2 f)` with the distance r
/// and the true anomaly f of the orbit: `W_k` are Hansen's coefficients, which are computed for the eccentricity, for k
/// from -5 to 9. The conformal factor from 0 to t is `c(0)/c(t) e^(-d t)`. Without torques the spin decays to `mu/d`; near
/// a resonance, as the synchronous one `q' = 1`, it may be captured. Gkolias, Efthymiopoulos, Pucacco and Celletti,
/// "Hamiltonian formulation of the spin-orbit model with time-varying non-conservative forces", Commun. Nonlinear Sci.
/// Numer. Simul. 51 (2017); Bravetti, Seri, Vermeeren and Zadra, "Numerical integration in celestial mechanics: a case
/// for contact geometry", Celest. Mech. Dyn. Astron. 132 (2020), section 4.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpinOrbit {
    /// The asphericity eps.
    pub asphericity: f64,
    /// The rate d of the tidal drag.
    pub drag: f64,
    /// The tidal torque mu.
    pub torque: f64,
    /// The amplitude lambda of the moment of inertia.
    pub amplitude: f64,
    /// The angular frequency omega of the moment of inertia.
    pub omega: f64,
    /// The coefficients `W_k` for k from -5 to 9, by default those of the orbit.
    pub coefficients: [f64; HARMONICS],
}

impl Default for SpinOrbit {
    /// The capture into the synchronous resonance of Bravetti, Seri, Vermeeren and Zadra.
    fn default() -> Self {
        SpinOrbit { drag: 1e-3, torque: 1e-3, amplitude: 1e-4, ..Self::rigid(0.01, 0.0075) }
    }
}

impl SpinOrbit {
    /// A rigid satellite without tides, for an eccentricity in [0, 1); other ones give coefficients that are NaN.
    pub fn rigid(eccentricity: f64, asphericity: f64) -> Self {
        let mut coefficients = [0.0; HARMONICS];
        for (coefficient, k) in coefficients.iter_mut().zip(FIRST..) {
            *coefficient = hansen(k, eccentricity);
        }
        SpinOrbit { asphericity, drag: 0.0, torque: 0.0, amplitude: 0.0, omega: 1.0, coefficients }
    }

    /// The initial data of the capture: `q = 2.7`, `q' = 3`.
    pub fn initial(&self) -> PhasePoint<1> {
        PhasePoint::new([2.7], [3.0], 0.0)
    }

    /// Hansen's coefficient `W_k`; 0 for a harmonic that is not included.
    pub fn coefficient(&self, k: i32) -> f64 {
        usize::try_from(k - FIRST).ok().and_then(|i| self.coefficients.get(i).copied()).unwrap_or(0.0)
    }
}

/// Hansen's coefficient `X_k^(-3, 2)`: the mean of `(a/r)^3 cos(2 f - k M)` over the mean anomaly M, by the trapezoidal
/// rule in the eccentric anomaly E, which converges exponentially.
fn hansen(k: i32, e: f64) -> f64 {
    const NODES: u32 = 512;
    let sum: f64 = (0..NODES)
        .map(|i| {
            let anomaly = std::f64::consts::TAU * f64::from(i) / f64::from(NODES);
            let (sin, cos) = anomaly.sin_cos();
            let distance = 1.0 - e * cos;
            let (x, y) = (cos - e, (1.0 - e * e).sqrt() * sin);
            let mean = anomaly - e * sin;
            // `dM = r dE`, and r^2 cos 2f = x^2 - y^2, r^2 sin 2f = 2 x y.
            let (sine, cosine) = (f64::from(k) * mean).sin_cos();
            ((x * x - y * y) * cosine + 2.0 * x * y * sine) / distance.powi(4)
        })
        .sum();
    sum / f64::from(NODES)
}

impl ContactHamiltonian<1> for SpinOrbit {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, p: &SVector<T, 1>, z: T) -> T {
        // The angle 2 q - k t, turned by -t from one harmonic to the next.
        let (sin_t, cos_t) = t.sin_cos();
        let (mut sine, mut cosine) = (q[0] * 2.0 - t * f64::from(FIRST)).sin_cos();
        let mut sum = T::zero();
        for coefficient in self.coefficients {
            sum += cosine * coefficient;
            (sine, cosine) = (sine * cos_t - cosine * sin_t, cosine * cos_t + sine * sin_t);
        }
        let (sin, cos) = (t * self.omega).sin_cos();
        let inertia = (cos * self.amplitude + 1.0).recip();
        let rate = sin * inertia * (-self.amplitude * self.omega) + self.drag;
        p[0] * p[0] * 0.5 - sum * inertia * (0.5 * self.asphericity) - q[0] * self.torque + z * rate
    }

    fn structure(&self) -> HamiltonianStructure {
        let (rigid, spherical) = (self.amplitude == 0.0 || self.omega == 0.0, self.asphericity == 0.0);
        HamiltonianStructure {
            autonomous: rigid && spherical,
            z_free: rigid && self.drag == 0.0,
            z_affine: true,
            constant_rate: rigid,
            separable: true,
            degree: Some(2),
            homogeneous: false,
        }
    }
}

/// Without parameters: its motions are differentiated in the start and in the times.
impl contact_geom::ParametricHamiltonian<1> for SpinOrbit {}
