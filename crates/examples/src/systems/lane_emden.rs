//! The Lane-Emden equation.

use super::{System, between};
use contact_geom::nalgebra::SVector;
use contact_geom::{Lagrangian, Parametric, PhasePoint, Scalar, Structure, VelocityPoint};

/// The Lane-Emden equation of index n as a Herglotz equation, `L = v^2/2 - q^(n+1)/(n+1) - (2/t) z`, `t > 0`.
/// Dimensionless: t is the radius of a polytropic star in Emden's unit, `q^n` its density in units of the central one.
///
/// Herglotz' equation is `q'' = -q^n - (2/t) q'`; nonlinear for `n > 1`, W = 1, the drag singular at `t = 0`. The
/// conformal factor from t to r is `(t/r)^2`. Bravetti, Seri, Vermeeren and Zadra, "Numerical integration in celestial
/// mechanics: a case for contact geometry", Celest. Mech. Dyn. Astron. 132 (2020).
///
/// The default index is 5: the only nonlinear case with a closed form, smooth and positive for all t. (For indices 0
/// and 1 the equation is linear, which can make the order of a method appear too high.)
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaneEmden {
    /// The polytropic index n.
    pub n: u8,
}

impl Default for LaneEmden {
    fn default() -> Self {
        LaneEmden { n: 5 }
    }
}

impl LaneEmden {
    /// The regular motion, `q = 1`, `q' = 0`, `z = 0` at `t = 0`, at the time t; known in closed form for `n` = 0, 1,
    /// 5.
    ///
    /// `q = 1 - t^2/6`, `sin(t)/t`, `(1 + t^2/3)^(-1/2)`; and `t^2 z = t^2 q v/2 + (1/2 - 1/(n+1)) I` where I, the
    /// integral of `t^2 q^(n+1)`, is known for these indices as well.
    pub fn solution(&self, t: f64) -> Option<VelocityPoint<1>> {
        if t.abs() < 0.5 && matches!(self.n, 0 | 1 | 5) {
            // The closed forms of v and I lose digits near 0.
            return Some(self.series(t));
        }
        let (q, v, z) = match self.n {
            0 => (1.0 - t * t / 6.0, -t / 3.0, t * (2.0 * t * t / 45.0 - 1.0 / 3.0)),
            1 => {
                let (sin, cos) = t.sin_cos();
                let (q, v) = (sin / t, (cos - sin / t) / t);
                (q, v, q * v * 0.5)
            }
            5 => {
                let q = (1.0 + t * t / 3.0).sqrt().recip();
                let v = -t / 3.0 * q.powi(3);
                let angle = (t / 3.0_f64.sqrt()).atan();
                let integral = 3.0 * 3.0_f64.sqrt() * (4.0 * angle - (4.0 * angle).sin()) / 32.0;
                (q, v, q * v * 0.5 + integral / (3.0 * t * t))
            }
            _ => return None,
        };
        Some(VelocityPoint::new([q], [v], z))
    }

    /// The regular motion by its power series in `x = t^2`: 20 terms, exact to round-off for `t <= 0.1` (and for
    /// `t < 0.5` up to `n = 5`). The coefficients of `q^n` follow from those of q, as `q (q^n)' = n q' q^n`.
    fn series(&self, t: f64) -> VelocityPoint<1> {
        const TERMS: usize = 20;
        let n = f64::from(self.n);
        let (mut q, mut power) = ([0.0; TERMS], [0.0; TERMS]);
        (q[0], power[0]) = (1.0, 1.0);
        for k in 1..TERMS {
            q[k] = -power[k - 1] / ((2 * k) * (2 * k + 1)) as f64;
            let sum: f64 = (1..=k).map(|j| ((n + 1.0) * j as f64 - k as f64) * q[j] * power[k - j]).sum();
            power[k] = sum / k as f64;
        }
        // t^2 z is the integral of t^2 (v^2/2 - q^(n+1)/(n+1)).
        let (x, mut z) = (t * t, [0.0; TERMS]);
        for (k, term) in z.iter_mut().enumerate() {
            let rest: f64 = (0..=k).map(|j| q[j] * power[k - j]).sum();
            let slopes: f64 = (1..=k).map(|j| (4 * j * (k + 1 - j)) as f64 * q[j] * q[k + 1 - j]).sum();
            *term = (slopes * 0.5 - rest / (n + 1.0)) / (2 * k + 3) as f64;
        }
        let at = |c: &[f64]| c.iter().rev().fold(0.0, |sum, c| sum * x + c);
        let slope = (1..TERMS).rev().fold(0.0, |sum, k| sum * x + 2.0 * k as f64 * q[k]);
        VelocityPoint::new([at(&q)], [t * slope], t * at(&z))
    }

    /// The potential `q^(n+1) / (n+1)`.
    #[inline(always)]
    fn potential<T: Scalar>(&self, q: T) -> T {
        q.powi(i32::from(self.n) + 1) / (f64::from(self.n) + 1.0)
    }
}

impl Lagrangian<1> for LaneEmden {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
        v[0] * v[0] * 0.5 - self.potential(q[0]) - z / t * 2.0
    }

    fn structure(&self) -> Structure {
        Structure {
            z_affine: true,
            separable: true,
            quadratic: self.n <= 1,
            constant_mass: true,
            ..Structure::default()
        }
    }
}

/// Without parameters: the index is an integer.
impl Parametric<1> for LaneEmden {}

impl System<1> for LaneEmden {
    fn name(&self) -> &'static str {
        "lane_emden"
    }

    /// The regular motion at [`initial_time`](System::initial_time), with `z = 0` at the centre.
    fn initial(&self) -> VelocityPoint<1> {
        self.series(self.initial_time())
    }

    fn initial_time(&self) -> f64 {
        0.1
    }

    fn sample(&self, u: &[f64]) -> (f64, VelocityPoint<1>) {
        let x = VelocityPoint::new([between(-1.2, 1.2, u[0])], [between(-1.0, 1.0, u[1])], between(-1.0, 1.0, u[2]));
        (between(0.5, 5.0, u[3]), x)
    }

    fn hamiltonian<T: Scalar>(&self, t: T, x: &PhasePoint<1, T>) -> Option<T> {
        Some(x.p[0] * x.p[0] * 0.5 + self.potential(x.q[0]) + x.z / t * 2.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closed_forms_continue_the_series() {
        // At 1/2 the closed forms lose a factor of 12 (v, n = 1) and 5 (I, n = 5): 64 units cover both.
        for n in [0, 1, 5] {
            let system = LaneEmden { n };
            for t in [0.5, 0.55, 0.6] {
                let Some(x) = system.solution(t) else { unreachable!("known for n = {n}") };
                let y = system.series(t);
                for (a, b) in [(x.q[0], y.q[0]), (x.v[0], y.v[0]), (x.z, y.z)] {
                    assert!((a - b).abs() <= 64.0 * f64::EPSILON * b.abs(), "n = {n}, t = {t}: {a} and {b}");
                }
            }
        }
        assert_eq!(LaneEmden { n: 3 }.solution(1.0), None);
    }

    #[test]
    fn the_closed_forms_solve_the_equation() {
        // Central differences of step d: an error of d^2/6 times a third derivative below 2, and of eps/d.
        let d = 1e-5;
        for n in [0, 1, 5] {
            let system = LaneEmden { n };
            for t in [0.1, 0.4, 0.7, 2.0, 5.0] {
                let (Some(a), Some(x), Some(b)) = (system.solution(t - d), system.solution(t), system.solution(t + d))
                else {
                    unreachable!("known for n = {n}")
                };
                let force = -x.q[0].powi(i32::from(n)) - 2.0 / t * x.v[0];
                let rates = [x.v[0], force, system.value(t, &x.q, &x.v, x.z)];
                let found = [b.q[0] - a.q[0], b.v[0] - a.v[0], b.z - a.z].map(|change| change / (2.0 * d));
                for (rate, found) in rates.iter().zip(found) {
                    assert!((rate - found).abs() <= 3e-10 * (1.0 + rate.abs()), "n = {n}, t = {t}: {found} for {rate}");
                }
            }
        }
    }
}
