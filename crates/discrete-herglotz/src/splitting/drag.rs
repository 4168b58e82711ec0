//! A linear drag, and the flow of the kinetic part together with it.

use super::separable::SeparableForm;
use crate::InputError;
use crate::gauss::tables::coefficients::Coefficients;
use crate::numbers::array::from_fn;
use contact_geom::nalgebra::SVector;
use contact_geom::{Derivatives, Lagrangian, PhasePoint, VelocityPoint};

/// The number of nodes of the quadrature along a drift. Its order 12 is higher than that of every scheme here.
pub(crate) const QUADRATURE_NODES: usize = 6;

/// The rate `gamma(t) = L_z` of a linear drag.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Drag<const N: usize> {
    /// A constant rate.
    Constant(f64),
    /// A rate that depends on time, evaluated at a position and an action at which L is defined.
    Timed { q: SVector<f64, N>, z: f64 },
}

impl<const N: usize> Drag<N> {
    /// The drag of a separable Lagrangian.
    pub(crate) fn of<L: Lagrangian<N>>(
        form: &SeparableForm<L, N>,
        t: f64,
        state: &PhasePoint<N>,
    ) -> Result<Self, InputError> {
        let structure = form.lagrangian.structure();
        if !structure.is_affine_in_z() {
            return Err(InputError::Unclaimed { claim: "z_affine" });
        }
        let timed = Drag::Timed { q: state.q, z: state.z };
        Ok(if structure.has_constant_rate() { Drag::Constant(timed.rate(&form.lagrangian, t)) } else { timed })
    }

    /// `gamma(t)`.
    fn rate(&self, lagrangian: &impl Lagrangian<N>, t: f64) -> f64 {
        match self {
            Drag::Constant(gamma) => *gamma,
            Drag::Timed { q, z } => lagrangian.rate(t, &VelocityPoint { q: *q, v: SVector::zeros(), z: *z }),
        }
    }

    /// The drift over a time s of either sign, from the time t.
    #[inline(never)]
    pub(crate) fn drift(&self, lagrangian: &impl Lagrangian<N>, t: f64, s: f64) -> Drift {
        if let Drag::Constant(gamma) = self {
            return Drift::constant(*gamma, s);
        }
        // A step that begins with a kick ends with an empty drift.
        if s == 0.0 {
            return Drift { length: 0.0, damping: 0.0, lift: 0.0 };
        }
        let g = Coefficients::of(QUADRATURE_NODES);
        let rates: [f64; QUADRATURE_NODES] = from_fn(|j| self.rate(lagrangian, t + g.c[j].0 * s));
        let (mut growth, mut length) = (0.0, 0.0);
        for i in 0..QUADRATURE_NODES {
            growth += s * g.b[i].0 * rates[i];
            let so_far: f64 = rates.iter().zip(&g.a[i]).map(|(rate, a)| s * a.0 * rate).sum();
            length += s * g.b[i].0 * so_far.exp();
        }
        Drift::new(length, growth.exp_m1())
    }
}

/// The flow of the kinetic part with the drag over a time s: with `g` the integral of gamma from the start,
/// `q += length M^-1 p`, `p += damping p`, `z += damping z + lift p.M^-1 p`.
///
/// For any values of the two integrals it is a conformal contact map with the factor `1 + damping`.
#[derive(Clone, Copy, Debug)]
pub struct Drift {
    /// The integral of `e^g`; for a constant gamma `(e^(gamma s) - 1)/gamma`.
    pub length: f64,
    /// `e^g(s) - 1`: multiplying the momentum by `e^g` itself would accumulate the round-off of that factor.
    pub damping: f64,
    /// The coefficient of `p.M^-1 p` in the action, `e^g(s) length / 2`.
    pub lift: f64,
}

impl Drift {
    /// The drift with these two integrals.
    #[inline(always)]
    pub fn new(length: f64, damping: f64) -> Self {
        Drift { length, damping, lift: 0.5 * (1.0 + damping) * length }
    }

    /// The drift over a time s of either sign with a constant gamma.
    #[inline(always)]
    pub fn constant(gamma: f64, s: f64) -> Self {
        let damping = (gamma * s).exp_m1();
        Drift::new(if gamma == 0.0 { s } else { damping / gamma }, damping)
    }
}

#[cfg(test)]
mod tests {
    use crate::{SplittingScheme, Stepper, splitting::Splitting};
    use contact_geom::nalgebra::SVector;
    use contact_geom::{ChartVector, Lagrangian, PhasePoint, Scalar, Structure, VelocityPoint};
    use std::cell::Cell;

    /// `v^2/2 - q^2/2 + cos(t) z/10` with its derivatives in closed form; it counts their evaluations.
    #[derive(Default)]
    struct Counting {
        gradients: Cell<usize>,
        rates: Cell<usize>,
    }

    impl Lagrangian<1> for Counting {
        fn value<T: Scalar>(&self, t: T, q: &SVector<T, 1>, v: &SVector<T, 1>, z: T) -> T {
            (v[0] * v[0] - q[0] * q[0]) * 0.5 + t.cos() * z * 0.1
        }
        fn closed_gradient<T: Scalar>(&self, t: T, x: &VelocityPoint<1, T>) -> Option<ChartVector<1, T>> {
            self.gradients.set(self.gradients.get() + 1);
            Some(ChartVector { x: -x.q, y: x.v, z: t.cos() * 0.1 })
        }
        fn closed_force<T: Scalar>(&self, _t: T, x: &VelocityPoint<1, T>) -> Option<SVector<T, 1>> {
            Some(-x.q)
        }
        fn closed_rate<T: Scalar>(&self, t: T, _x: &VelocityPoint<1, T>) -> Option<T> {
            self.rates.set(self.rates.get() + 1);
            Some(t.cos() * 0.1)
        }
        fn structure(&self) -> Structure {
            Structure { separable: true, z_affine: true, constant_mass: true, ..Structure::default() }
        }
    }

    /// Steps evaluate a time-dependent rate without the gradient: once per node of each drift, and not for the empty
    /// drift at the end of a step.
    #[test]
    fn a_rate_in_time_is_asked_for_alone() {
        let system = Counting::default();
        let start = PhasePoint::new([1.0], [0.0], 0.0);
        let mut motion = Splitting::new(&system, &SplittingScheme::STRANG, 0.1, 0.0, start).unwrap();
        system.gradients.set(0);
        system.rates.set(0);
        for _ in 0..10 {
            motion.advance(1).unwrap();
        }
        assert_eq!((system.gradients.get(), system.rates.get()), (0, 10 * super::QUADRATURE_NODES));
    }
}
