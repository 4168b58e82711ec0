//! A quadrature of the action as a discrete Lagrangian.

use super::{MIDPOINT, Quadrature, place};
use crate::integration::Node;
use crate::resolution::monitor::{defect, factor_defect};
use crate::{DiscreteLagrangian, DiscreteStep, InputError, StepError, solve::Solver};
use contact_geom::nalgebra::{DMatrix, SMatrix, SVector};
use contact_geom::{
    Derivatives, DiscreteJet, DiscretePoint, GeometryError, Lagrangian, PhasePoint, Regularity, Scalar,
    SecondDiscreteJet, VelocityPoint,
};

impl<const N: usize, L: Lagrangian<N>> DiscreteLagrangian<N> for Quadrature<L> {
    const FORCED: bool = L::HINTS.forced;

    fn has_forces(&self) -> bool {
        self.lagrangian.has_force()
    }

    fn step_size(&self) -> f64 {
        self.h
    }

    fn forces<T: Scalar>(&self, t: f64, x: &DiscretePoint<N, T>) -> Result<[SVector<T, N>; 2], StepError> {
        let z1 = self.end_action(t, x)?;
        let [mut minus, mut plus] = [SVector::<T, N>::from_fn(|_, _| T::zero()); 2];
        let mut pivot = T::one();
        for node in self.rule.nodes {
            let (at, time, w) = (place(node, self.h, x, z1), T::from(t + node.place * self.h), self.h * node.weight);
            let force = self.lagrangian.applied_force(time, &at);
            for i in 0..N {
                minus[i] += force[i] * (w * (1.0 - node.place));
                plus[i] += force[i] * (w * node.place);
            }
            if node.action != 0.0 {
                pivot -= self.lagrangian.rate(time, &at) * (w * node.action);
            }
        }
        Ok([minus.map(|f| f / pivot), plus.map(|f| f / pivot)])
    }

    fn value<T: Scalar>(&self, t: f64, x: &DiscretePoint<N, T>) -> Result<T, StepError> {
        Ok(self.end_action(t, x)? - x.z0)
    }

    /// Returns an error for a Lagrangian with singular `W = L_vv`: its motion is constrained, which the rules do not
    /// handle. W is scaled by its rows, so that the result does not depend on the units of the coordinates.
    fn check_start(&self, t: f64, from: &PhasePoint<N>, velocity: &SVector<f64, N>) -> Result<(), InputError> {
        let w = self.lagrangian.mass_matrix(t, &VelocityPoint { q: from.q, v: *velocity, z: from.z });
        let rows: Vec<f64> =
            (0..N).map(|i| contact_geom::numbers::max_abs_or_nan((0..N).map(|j| w[(i, j)])).sqrt()).collect();
        let scaled = Regularity::of(DMatrix::from_fn(N, N, |i, j| w[(i, j)] / (rows[i] * rows[j])));
        // The comparison is written so that a NaN fails it.
        if scaled.condition() < 1.0 / f64::EPSILON {
            return Ok(());
        }
        let (what, remedy) = ("the matrix L_vv at the start", "use a regular Lagrangian");
        Err(GeometryError::Singular { what, pivot: scaled.smallest, remedy }.into())
    }

    #[inline(always)]
    fn defect(&self, velocities: [&SVector<f64, N>; 4], to: &PhasePoint<N>, sigma: f64) -> Option<f64> {
        factor_defect(sigma).or_else(|| defect(velocities, &to.q, self.h, 0.0))
    }

    fn order(&self) -> Option<u32> {
        Some(self.rule.order)
    }

    // Inlined into `second_jet`, so that both share their subexpressions.
    #[inline(always)]
    fn jet(&self, t: f64, x: &DiscretePoint<N>) -> Result<DiscreteJet<N>, StepError> {
        if !self.implicit {
            let s = self.extended_jet(t, x, x.z0);
            let jet = DiscreteJet::new(s.value, s.s1, s.s2, s.z0);
            return if s.value.is_finite() { Ok(jet) } else { Err(StepError::NonFinite) };
        }
        let z1 = self.end_action(t, x)?;
        let s = self.extended_jet(t, x, z1);
        let pivot = 1.0 - s.z1;
        Ok(DiscreteJet::new(s.value, s.s1 / pivot, s.s2 / pivot, (s.z0 + s.z1) / pivot))
    }

    /// By the chain rule from the Hessian of L at the nodes, where `z1` depends on `(q0, q1, z0)` with the derivatives
    /// `(D1, D2, sigma_d)`.
    #[inline(always)]
    fn second_jet(&self, t: f64, x: &DiscretePoint<N>) -> Result<SecondDiscreteJet<N>, StepError> {
        let first = self.jet(t, x)?;
        let (h, z1) = (self.h, x.z0 + first.value);
        let mut jet = SecondDiscreteJet {
            first,
            d11: SMatrix::zeros(),
            d12: SMatrix::zeros(),
            d22: SMatrix::zeros(),
            d1z: SVector::zeros(),
            d2z: SVector::zeros(),
            dzz: 0.0,
        };
        let mut slope = 0.0;
        for node in self.rule.nodes {
            let (at, time, w) = (place(node, h, x, z1), t + node.place * h, h * node.weight);
            let l = self.lagrangian.hessian(time, &at);
            // The derivatives of the position in `q0` and `q1`; those of the velocity are `-1/h` and `1/h`.
            let (start, end) = (1.0 - node.place, node.place);
            let (qq, qv, vv) = ([start * start * w, start * end * w, end * end * w], node.weight, node.weight / h);
            for j in 0..N {
                for i in 0..N {
                    let (mixed, transposed) = (l.qv[(i, j)], l.qv[(j, i)]);
                    let (both, kinetic) = ((mixed + transposed) * qv, l.vv[(i, j)] * vv);
                    jet.d11[(i, j)] += l.qq[(i, j)] * qq[0] - both * start + kinetic;
                    jet.d12[(i, j)] += l.qq[(i, j)] * qq[1] + (mixed * start - transposed * end) * qv - kinetic;
                    jet.d22[(i, j)] += l.qq[(i, j)] * qq[2] + both * end + kinetic;
                }
            }
            let z = (1.0 - node.action) + node.action * first.sigma();
            let moving = l.vz * (1.0 / h);
            let (start, end) = (l.qz * start - moving, l.qz * end + moving);
            jet.d1z += start * (w * z);
            jet.d2z += end * (w * z);
            jet.dzz += l.zz * (w * z * z);
            if node.action != 0.0 {
                slope += w * node.action * self.lagrangian.gradient(time, &at).z;
                // The derivatives of the action at the node in `q0` and `q1`.
                let (of_start, of_end) = (first.d1 * node.action, first.d2 * node.action);
                let form =
                    |a: &SVector<f64, N>, of_a: &SVector<f64, N>, b: &SVector<f64, N>, of_b: &SVector<f64, N>| {
                        a * of_b.transpose() + of_a * (b + of_b * l.zz).transpose()
                    };
                jet.d11 += form(&start, &of_start, &start, &of_start) * w;
                jet.d12 += form(&start, &of_start, &end, &of_end) * w;
                jet.d22 += form(&end, &of_end, &end, &of_end) * w;
                jet.d1z += of_start * (l.zz * w * z);
                jet.d2z += of_end * (l.zz * w * z);
            }
        }
        if self.implicit {
            let factor = 1.0 / (1.0 - slope);
            jet.d11 *= factor;
            jet.d12 *= factor;
            jet.d22 *= factor;
            jet.d1z *= factor;
            jet.d2z *= factor;
            jet.dzz *= factor;
        }
        Ok(jet)
    }

    #[inline(always)]
    fn forward(
        &self,
        t: f64,
        from: &PhasePoint<N>,
        guess: &SVector<f64, N>,
        solver: &mut Solver<N>,
    ) -> Result<DiscreteStep<N>, StepError> {
        // Inlined, a step with one unknown stays in registers (58 against 81 ns for the pendulum). With more unknowns
        // it spills, and a separate function is faster (162 against 209 ns for the double pendulum). The nodes, or their
        // number and weight, are constants of these steps.
        if self.is_midpoint && N == 1 {
            return self.step(MIDPOINT, t, self.h, from, guess, solver)?.checked();
        }
        if self.is_midpoint {
            return self.midpoint_step((t, self.h), from, guess, solver)?.checked();
        }
        match self.rule.nodes {
            [node @ Node { weight: 1.0, action: 0.0, .. }] => {
                self.explicit_step(node, t, from, guess, solver)?.checked()
            }
            _ => self.step_of_nodes(false, t, from, guess, solver)?.checked(),
        }
    }

    /// The forward step of the adjoint rule with `-h`: each node is reflected.
    fn backward(
        &self,
        t: f64,
        from: &PhasePoint<N>,
        guess: &SVector<f64, N>,
        solver: &mut Solver<N>,
    ) -> Result<DiscreteStep<N>, StepError> {
        let back = if self.is_midpoint {
            self.midpoint_step((t + self.h, -self.h), from, guess, solver)
        } else {
            self.step_of_nodes(true, t + self.h, from, guess, solver)
        }?;
        DiscreteStep { sigma: 1.0 / back.sigma, ..back }.checked()
    }
}
