//! The declared structure of a Lagrangian, and the check of its claims.

use crate::dynamics::probe::{Moving, Probe, entries};
use crate::number::rounded::Rounded;
use crate::{
    Lagrangian, VelocityPoint,
    numbers::{max_abs_or_nan, max_or_nan},
};

/// The declared structure of a Lagrangian: claims that allow a method to skip work. Omitting a claim costs only time,
/// but a false claim makes results wrong; [`Structure::defects`] checks each claim at a point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Structure {
    /// L does not depend on t.
    pub autonomous: bool,
    /// L does not depend on z: no dissipation.
    pub z_free: bool,
    /// `L = L0(t, q, v) + gamma(t) z`: the conformal factor depends on time alone.
    pub z_affine: bool,
    /// `L_z` is constant, also in time: the conformal factor is `e^(gamma (t - t0))`. Where L is autonomous, this
    /// follows from `z_affine`.
    pub constant_rate: bool,
    /// `L = v.Mv/2 - V(t, q) + f(t, z)` with constant M.
    pub separable: bool,
    /// L is a polynomial of degree two in (q, v), plus `gamma(t) z`: the motion is linear.
    pub quadratic: bool,
    /// `W = L_vv` is constant.
    pub constant_mass: bool,
}

/// A claim on a Lagrangian, with the size of the derivatives that the claim states to be zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Defect {
    /// The name of the claim: a field of [`Structure`], or `closed_gradient` or `closed_hessian`.
    pub claim: &'static str,
    /// The largest derivative that should vanish, relative to the terms that it sums. Round-off if the claim holds, of
    /// order one if not, in any units.
    pub size: f64,
}

/// The defects of the claims that are made.
pub type Defects = std::iter::Flatten<std::array::IntoIter<Option<Defect>, 9>>;

impl Structure {
    /// Whether the claims imply that `L_z` is constant.
    pub fn has_constant_rate(&self) -> bool {
        self.constant_rate || self.z_free || (self.z_affine && self.autonomous)
    }

    /// Whether the claims imply that L is affine in z, so that z affects the motion only by a rate that depends on time
    /// alone.
    pub fn is_affine_in_z(&self) -> bool {
        self.z_affine || self.z_free || self.constant_rate
    }

    /// The defect at one point of each claim that is made. Closed derivatives, if there are any, are compared with
    /// those of the value. `None` where L or one of these derivatives is not finite: L is not defined or not smooth
    /// there, and its claims cannot be judged.
    ///
    /// The claims concern derivatives up to third order. They are taken along directions without special symmetry, so
    /// that a dependence is detected unless the point itself is special. A small derivative is distinguished from a
    /// rounding error by the size of its terms, which is computed along with it. Hence every dependence is detected
    /// that exceeds the rounding of L itself, and multiplying L by a constant leaves the sizes unchanged.
    pub fn defects<const N: usize>(
        &self,
        lagrangian: &impl Lagrangian<N>,
        t: f64,
        x: &VelocityPoint<N>,
    ) -> Option<Defects> {
        let (q, v, z) = (0, 1, 2);
        let probe = Probe::new(t, x);
        let l = probe.value(lagrangian);
        if !l.re.re.re.value.is_finite() {
            return None;
        }
        let worst = |sizes: &mut dyn Iterator<Item = Rounded>| max_abs_or_nan(sizes.map(Rounded::relative));
        // Second derivatives, with their derivatives along the line and in time.
        let all = |second: [(usize, usize); 3]| worst(&mut second.into_iter().flat_map(|(i, j)| entries(&l.d[i].d[j])));
        let changes = |i: usize, j: usize| l.d[i].d[j].d[0];
        let in_time = |m: &Moving| m.d[1];

        let affine = || all([(z, q), (z, v), (z, z)]);
        let constant_mass = || worst(&mut [changes(v, v), in_time(&l.d[v].d[v])].into_iter());
        let autonomous = || {
            let value = &l.re.re;
            let firsts = [q, v, z].map(|i| &l.re.d[i]);
            let seconds = [q, v, z].map(|i| [q, v, z].map(|j| &l.d[i].d[j]));
            worst(&mut [value].into_iter().chain(firsts).chain(seconds.into_iter().flatten()).map(in_time))
        };
        let separable = || {
            // A term linear in v: its coefficient and the derivative of that in time.
            let linear = probe.at_rest().value(lagrangian).re.d[v];
            let linear = worst(&mut [linear.re, linear.d[1]].into_iter());
            // A separable Lagrangian that is defined for some velocity is also defined at rest.
            let linear = if linear.is_nan() { f64::INFINITY } else { linear };
            [constant_mass(), all([(q, v), (z, q), (z, v)])].into_iter().fold(linear, max_or_nan)
        };
        let made =
            |made: bool, claim: &'static str, size: &dyn Fn() -> f64| made.then(|| Defect { claim, size: size() });
        let of = |claim, size: Option<f64>| size.map(|size| Defect { claim, size });
        let defects = [
            made(self.autonomous, "autonomous", &autonomous),
            made(self.z_free, "z_free", &|| max_or_nan(affine(), worst(&mut entries(&l.re.d[z]).into_iter()))),
            made(self.z_affine, "z_affine", &affine),
            made(self.constant_rate, "constant_rate", &|| max_or_nan(affine(), in_time(&l.re.d[z]).relative())),
            made(self.separable, "separable", &separable),
            made(self.quadratic, "quadratic", &|| {
                let second = [(q, q), (q, v), (v, v)].into_iter().map(|(i, j)| changes(i, j));
                max_or_nan(affine(), worst(&mut { second }))
            }),
            made(self.constant_mass, "constant_mass", &constant_mass),
            of("closed_gradient", probe.closed_gradient(lagrangian, &l)),
            of("closed_hessian", probe.closed_hessian(lagrangian, &l)),
        ];
        let smooth = !defects.iter().flatten().any(|d| d.size.is_nan());
        smooth.then(|| defects.into_iter().flatten())
    }
}

#[cfg(test)]
mod tests;
