//! What is known of a Lagrangian's form, and how to see whether a claim holds.

use crate::{Dual, Lagrangian, VelocityPoint};
use nalgebra::SVector;

/// The declared structure of a Lagrangian: claims that let a method skip work. A claim that is not made costs time only; a
/// false one would cost the answer, so [`Structure::defects`] measures each at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Structure {
    /// L does not depend on t.
    pub autonomous: bool,
    /// L does not depend on z: no dissipation.
    pub z_free: bool,
    /// `L = L0(t, q, v) + gamma(t) z`: the conformal factor depends on time alone.
    pub z_affine: bool,
    /// `L_z` is one number, at all times too: the conformal factor is `e^(gamma (t - t0))`. Said by `z_affine` already where
    /// L is autonomous.
    pub constant_rate: bool,
    /// `L = v.Mv/2 - V(t, q) + f(t, z)` with constant M.
    pub separable: bool,
    /// L is a polynomial of degree two in (q, v), plus `gamma(t) z`: the motion is linear.
    pub quadratic: bool,
    /// `W = L_vv` is constant.
    pub constant_mass: bool,
}

/// One claim of a [`Structure`] with the size of what it says is zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Defect {
    /// The name of the claim.
    pub claim: &'static str,
    /// The largest derivative that the claim says vanishes, relative to one plus the size of the second derivatives.
    pub size: f64,
}

impl Structure {
    /// Whether the claims say that `L_z` is constant.
    pub fn has_constant_rate(&self) -> bool {
        self.constant_rate || self.z_free || (self.z_affine && self.autonomous)
    }

    /// Whether the claims say that z does not act on the motion but by a rate that depends on time alone: L is affine in z.
    pub fn is_affine_in_z(&self) -> bool {
        self.z_affine || self.z_free || self.constant_rate
    }

    /// For each claim that is made, the size at one point of the derivatives that it says vanish.
    ///
    /// The claims concern derivatives up to the third: those of the Hessian are taken along one direction without special
    /// symmetry, which sees a dependence unless the point is itself special.
    pub fn defects<const N: usize>(
        &self,
        lagrangian: &impl Lagrangian<N>,
        t: f64,
        x: &VelocityPoint<N>,
    ) -> Vec<Defect> {
        type Line = SVector<f64, 1>;
        let golden = 0.618_033_988_749_894_9;
        let towards = |i: usize| Line::new(0.3 + ((i * i + 1) as f64 * golden).fract());
        let moving = VelocityPoint::<N, Dual<f64, Line>> {
            q: SVector::from_fn(|i, _| Dual { re: x.q[i], d: towards(i) }),
            v: SVector::from_fn(|i, _| Dual { re: x.v[i], d: towards(N + i) }),
            z: Dual { re: x.z, d: towards(2 * N) },
        };
        let still = VelocityPoint { q: x.q.map(Dual::constant), v: x.v.map(Dual::constant), z: Dual::constant(x.z) };
        let clock = Dual { re: t, d: Line::new(1.0) };

        // `f64::max` would hide a NaN.
        let worse = |m: f64, e: f64| if e.is_nan() { f64::INFINITY } else { m.max(e.abs()) };
        let largest = |entries: &mut dyn Iterator<Item = f64>| entries.fold(0.0, worse);
        let h = lagrangian.hessian(Dual::constant(t), &moving);
        let mixed_z = largest(&mut h.qz.iter().chain(&h.vz).map(|e| e.re));
        let scale = 1.0 + mixed_z.max(largest(&mut h.qq.iter().chain(&h.qv).chain(&h.vv).map(|e| e.re)));
        let qv = largest(&mut h.qv.iter().map(|e| e.re));
        let vv_changes = largest(&mut h.vv.iter().map(|e| e.d[0]));
        let quadratic_changes = largest(&mut h.qq.iter().chain(&h.qv).map(|e| e.d[0])).max(vv_changes);

        let mut defects = Vec::new();
        let mut claim = |made: bool, claim: &'static str, size: &dyn Fn() -> f64| {
            if made {
                let size = if scale.is_finite() { size() / scale } else { f64::INFINITY };
                defects.push(Defect { claim, size });
            }
        };
        claim(self.autonomous, "autonomous", &|| {
            let drift = lagrangian.gradient(clock, &still);
            let of_value = lagrangian.value(clock, &still.q, &still.v, still.z).d[0].abs();
            largest(&mut drift.x.iter().chain(&drift.y).map(|e| e.d[0])).max(drift.z.d[0].abs()).max(of_value)
        });
        claim(self.z_free, "z_free", &|| lagrangian.gradient(t, x).z.abs());
        claim(self.z_affine, "z_affine", &|| mixed_z.max(h.zz.re.abs()));
        claim(self.constant_rate, "constant_rate", &|| {
            lagrangian.gradient(clock, &still).z.d[0].abs().max(mixed_z).max(h.zz.re.abs())
        });
        claim(self.separable, "separable", &|| {
            // A term linear in v, at this time or soon after.
            let at_rest = VelocityPoint { v: SVector::from_element(Dual::constant(0.0)), ..still };
            let linear = largest(&mut lagrangian.gradient(clock, &at_rest).y.iter().flat_map(|p| [p.re, p.d[0]]));
            qv.max(mixed_z).max(vv_changes).max(linear)
        });
        claim(self.quadratic, "quadratic", &|| quadratic_changes.max(mixed_z).max(h.zz.re.abs()));
        claim(self.constant_mass, "constant_mass", &|| vv_changes);
        defects
    }
}
