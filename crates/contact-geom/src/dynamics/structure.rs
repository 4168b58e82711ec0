//! What is known of a Lagrangian's form, and how to see whether a claim holds.

use crate::dynamics::probe::{Moving, Probe, entries};
use crate::number::rounded::Rounded;
use crate::{Lagrangian, VelocityPoint, max_abs_or_nan, max_or_nan};

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

/// One claim on a Lagrangian with the size of what it says is zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Defect {
    /// The name of the claim: a field of [`Structure`], or `closed_gradient` or `closed_hessian`.
    pub claim: &'static str,
    /// The largest of the derivatives that the claim says vanish, each relative to the size of the terms that it is a sum of: a
    /// few units of round-off where the claim holds, of the order of one where it does not, in whatever units.
    pub size: f64,
}

/// The claims that are made, each with its size.
pub type Defects = std::iter::Flatten<std::array::IntoIter<Option<Defect>, 9>>;

impl Structure {
    /// Whether the claims say that `L_z` is constant.
    pub fn has_constant_rate(&self) -> bool {
        self.constant_rate || self.z_free || (self.z_affine && self.autonomous)
    }

    /// Whether the claims say that z does not act on the motion but by a rate that depends on time alone: L is affine in z.
    pub fn is_affine_in_z(&self) -> bool {
        self.z_affine || self.z_free || self.constant_rate
    }

    /// For each claim that is made, the size at one point of the derivatives that it says vanish; and that closed derivatives,
    /// where there are any, are those of the value. `None` where L or one of these derivatives is not finite: L is not defined
    /// or not smooth there, and nothing is said of its claims.
    ///
    /// The claims concern derivatives up to the third, which are taken along directions without special symmetry: they see a
    /// dependence unless the point is itself special. Rounding is told from a small number by the size of the terms that a
    /// derivative is the sum of, which the numbers carry along; so the smallest dependence is seen that is not lost in the
    /// rounding of L itself, and L times a constant gives the same sizes.
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
        // A first or second derivative with its changes along the line and in time.
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
            // A term linear in v, at this time or soon after.
            let linear = probe.at_rest().value(lagrangian).re.d[v];
            let linear = worst(&mut [linear.re, linear.d[1]].into_iter());
            // At rest such a Lagrangian is defined where it is in motion.
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
