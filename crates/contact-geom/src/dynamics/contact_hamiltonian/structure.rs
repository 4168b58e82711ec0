//! The declared structure of a contact Hamiltonian, and the check of its claims.

use crate::{
    ContactHamiltonian, Defect, Dual, HamiltonianDerivatives, PhasePoint, Structure,
    numbers::{max_abs_or_nan, max_or_nan},
};
use nalgebra::SVector;

/// The declared structure of a contact Hamiltonian: claims that allow a method to skip work, and that select its pieces.
/// Omitting a claim costs only time, but a false claim makes results wrong; [`defect`](Self::defect) checks them at a
/// point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HamiltonianStructure {
    /// H does not depend on t.
    pub autonomous: bool,
    /// H does not depend on z: no dissipation.
    pub z_free: bool,
    /// `H = H0(t, q, p) - gamma(t) z`: the conformal factor depends on time alone.
    pub z_affine: bool,
    /// `H_z` is constant, also in time.
    pub constant_rate: bool,
    /// `H = T(p) + V(t, q) + f(t, z)`.
    pub separable: bool,
    /// H is a polynomial of this degree in p, or of a lower one.
    pub degree: Option<u32>,
    /// H is homogeneous of degree one in p: `p . H_p = H`.
    pub homogeneous: bool,
}

impl HamiltonianStructure {
    /// What they imply for the Lagrangian, where there is one.
    pub fn of_lagrangian(&self) -> Structure {
        Structure {
            autonomous: self.autonomous,
            z_free: self.z_free,
            z_affine: self.z_affine,
            constant_rate: self.constant_rate,
            ..Structure::default()
        }
    }

    /// The first claim that is false at a point, with the size of the derivatives that it states to be zero, relative to
    /// the largest derivative of their order. `None` where H is not finite.
    pub fn defect<H: ContactHamiltonian<N> + ?Sized, const N: usize>(
        &self,
        hamiltonian: &H,
        t: f64,
        x: &PhasePoint<N>,
    ) -> Option<Defect> {
        /// The bound on a claim: some thousand units of round-off, since the constants of H are rounded.
        const LARGEST: f64 = 1e-12;
        let (h, d) = hamiltonian.with_gradient(t, x);
        if !(h.is_finite() && d.is_finite()) {
            return None;
        }
        // The derivatives of H and of its gradient in time.
        let timed = Dual::<f64, SVector<f64, 1>> { re: t, d: [1.0].into() };
        let constant = |e: f64| Dual::<f64, SVector<f64, 1>>::constant(e);
        let still = PhasePoint { q: x.q.map(constant), p: x.p.map(constant), z: constant(x.z) };
        let in_time = || hamiltonian.with_gradient(timed, &still);
        let second = hamiltonian.hessian(t, x);
        let of = |entries: &mut dyn Iterator<Item = f64>| max_abs_or_nan(entries);
        let all = [second.qq, second.qv, second.vv].map(|m| of(&mut m.iter().copied()));
        let [qz, pz] = [second.qz, second.vz].map(|v| of(&mut v.iter().copied()));
        let largest = all.into_iter().chain([qz, pz, second.zz.abs()]).fold(0.0, max_or_nan);
        let first = max_or_nan(d.amax(), largest);
        let mixed = max_or_nan(max_or_nan(qz, pz), second.zz.abs());
        let rate_in_time = || in_time().1.z.d[0].abs();
        let mut found = None;
        let mut claim = |made: bool, claim: &'static str, size: &dyn Fn() -> f64, scale: f64| {
            if made && found.is_none() {
                let size = size();
                let relative = if size == 0.0 { 0.0 } else { size / scale };
                if relative > LARGEST || relative.is_nan() {
                    found = Some(Defect { claim, size: relative });
                }
            }
        };
        claim(
            self.autonomous,
            "autonomous",
            &|| {
                let (h, d) = in_time();
                let slopes = d.x.iter().chain(d.y.iter()).chain([&d.z, &h]).map(|e| e.d[0]);
                max_abs_or_nan(slopes)
            },
            max_or_nan(first, h.abs()),
        );
        claim(self.z_free, "z_free", &|| max_or_nan(mixed, d.z.abs()), first);
        claim(self.z_affine, "z_affine", &|| mixed, first);
        claim(self.constant_rate, "constant_rate", &|| max_or_nan(mixed, rate_in_time()), first);
        claim(self.separable, "separable", &|| max_or_nan(all[1], max_or_nan(qz, pz)), first);
        let terms = (0..N).fold(h.abs(), |sum, i| sum + (x.p[i] * d.y[i]).abs());
        claim(self.homogeneous, "homogeneous", &|| (x.p.dot(&d.y) - h).abs(), terms);
        if let Some(degree) = self.degree {
            let (size, terms) = beyond_degree(hamiltonian, t, x, degree);
            claim(true, "degree", &|| size, terms);
        }
        found
    }
}

/// The difference of order `degree + 1` of H along a line in the momenta, which vanishes for a polynomial of this degree,
/// and the sum of the magnitudes of its terms.
fn beyond_degree<H: ContactHamiltonian<N> + ?Sized, const N: usize>(
    hamiltonian: &H,
    t: f64,
    x: &PhasePoint<N>,
    degree: u32,
) -> (f64, f64) {
    let long = 0.5 + max_abs_or_nan(x.p.iter().copied());
    let direction = SVector::<f64, N>::from_fn(|i, _| long * (0.3 + (0.618 * (i + 1) as f64).fract()));
    let (mut sum, mut terms, mut binomial) = (0.0, 0.0, 1.0);
    for k in 0..=degree + 1 {
        let p = x.p + direction * (f64::from(k) - 0.5 * f64::from(degree + 1));
        let term = binomial * hamiltonian.value(t, &x.q, &p, x.z);
        sum += if k % 2 == 0 { term } else { -term };
        terms += term.abs();
        binomial *= f64::from(degree + 1 - k) / f64::from(k + 1);
    }
    (sum.abs(), terms)
}
