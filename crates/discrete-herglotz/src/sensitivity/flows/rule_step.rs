//! The derivative of a step of a quadrature rule.

use super::sources::Sources;
use super::sub_flow::SubFlow;
use super::tangent_matrix::TangentMatrix;
use crate::StepError;
use crate::integration::QuantityDerivatives;
use crate::rules::Node;
use crate::sensitivity::parametric_system::Quantity;
use crate::solve::ITERATION_LIMIT;
use contact_geom::nalgebra::{DMatrix, DVector, Dyn, LU, SMatrix, SVector};
use contact_geom::numbers::max_or_nan;
use contact_geom::support::seed;
use contact_geom::{ChartVector, Derivatives, Dual, Hessian, Parametric, PhasePoint, VelocityPoint};

/// A step of a quadrature rule on `Q x Q x R^2`, over a length h of either sign from the time t.
///
/// With `S = h sum_i w_i L_i` and the sums `F1 = h sum_i w_i (1 - a_i) f_i` and `F2 = h sum_i w_i a_i f_i` of a force, the
/// end of the step from `(q0, p0, z0)` is the solution of
///
/// `p0 (1 + S_z0) + S_1 + F1 = 0`, `z1 - z0 - S = 0`, `p1 (1 - S_z1) - S_2 - F2 = 0`;
///
/// its derivatives follow from the linearisation of these equations.
pub(super) struct RuleStep<'l, L> {
    pub lagrangian: &'l L,
    pub nodes: &'static [Node],
    pub t: f64,
    pub h: f64,
}

/// The values and derivatives of L and of the force at a node.
struct AtNode<const N: usize> {
    x: VelocityPoint<N>,
    t: f64,
    l: f64,
    gradient: ChartVector<N>,
    hessian: Hessian<N>,
    force: SVector<f64, N>,
    /// The derivatives of the force in q, v and z.
    force_slopes: (SMatrix<f64, N, N>, SMatrix<f64, N, N>, SVector<f64, N>),
}

/// A change of the ends of a step, of its length, and of a parameter or of its time.
struct Change<'e, const N: usize> {
    q0: SVector<f64, N>,
    q1: SVector<f64, N>,
    z0: f64,
    z1: f64,
    h: f64,
    /// The derivatives of L and f at each node in the parameter or in the time, which are multiplied by the place of the
    /// node for a change of h.
    explicit: &'e [QuantityDerivatives<N>],
}

impl<const N: usize> Change<'_, N> {
    const ZERO: Change<'static, N> = Change {
        q0: QuantityDerivatives::<N>::ZERO.force,
        q1: QuantityDerivatives::<N>::ZERO.force,
        z0: 0.0,
        z1: 0.0,
        h: 0.0,
        explicit: &[],
    };
}

/// The sums S, its partial derivatives, and those of the force; or their changes.
struct Sums<const N: usize> {
    s: f64,
    /// `S_1 + F1`, and `S_2 + F2`.
    start: SVector<f64, N>,
    end: SVector<f64, N>,
    z0: f64,
    z1: f64,
}

impl<const N: usize> Sums<N> {
    fn zero() -> Self {
        Sums { s: 0.0, start: SVector::zeros(), end: SVector::zeros(), z0: 0.0, z1: 0.0 }
    }

    /// Adds the terms of a node with these values, for a step of length h.
    fn add(&mut self, node: &Node, h: f64, l: f64, g: &ChartVector<N>, force: &SVector<f64, N>) {
        let (a, b, w) = (node.place, node.action, node.weight);
        let push = (g.x + force) * (h * w);
        self.s += h * w * l;
        self.start += push * (1.0 - a) - g.y * w;
        self.end += push * a + g.y * w;
        self.z0 += h * w * (1.0 - b) * g.z;
        self.z1 += h * w * b * g.z;
    }
}

/// The factors of the derivative of the first two equations of a step in `(q1, z1)`.
type Factors = LU<f64, Dyn, Dyn>;

/// A step with given ends, and the linearisation of its equations there.
struct RuleStepEnd<'s, 'l, L, const N: usize> {
    step: &'s RuleStep<'l, L>,
    start: PhasePoint<N>,
    end: PhasePoint<N>,
    at: Vec<AtNode<N>>,
    sums: Sums<N>,
}

impl<L: Parametric<N>, const N: usize> RuleStepEnd<'_, '_, L, N> {
    /// The change of the sums along a change of the ends, of the length, and of a parameter or the time.
    fn change(&self, change: &Change<'_, N>) -> Sums<N> {
        let RuleStep { nodes, h, .. } = *self.step;
        let mut sums = Sums::zero();
        for (i, (node, at)) in nodes.iter().zip(&self.at).enumerate() {
            let (a, b) = (node.place, node.action);
            let q = change.q0 * (1.0 - a) + change.q1 * a;
            let v = (change.q1 - change.q0 - at.x.v * change.h) / h;
            let z = change.z0 * (1.0 - b) + change.z1 * b;
            let Hessian { qq, qv, vv, qz, vz, zz } = &at.hessian;
            let mut l = at.gradient.dot(&ChartVector { x: q, y: v, z });
            let mut g = ChartVector {
                x: qq * q + qv * v + qz * z,
                y: qv.tr_mul(&q) + vv * v + vz * z,
                z: qz.dot(&q) + vz.dot(&v) + zz * z,
            };
            let (of_q, of_v, of_z) = &at.force_slopes;
            let mut force = of_q * q + of_v * v + of_z * z;
            if let Some(explicit) = change.explicit.get(i) {
                let factor = if change.h == 0.0 { 1.0 } else { a * change.h };
                l += factor * explicit.l;
                g = g.plus(explicit.gradient.scale(factor));
                force += explicit.force * factor;
            }
            sums.add(node, h, l, &g, &force);
            if change.h != 0.0 {
                // The momenta L_v have no factor h.
                let still = ChartVector { y: SVector::zeros(), ..at.gradient };
                sums.add(node, change.h, at.l, &still, &at.force);
            }
        }
        sums
    }

    /// The derivative of the end along a change of the start, where q1 and z1 do not change, of `p0`, and of the others.
    fn end_along(
        &self,
        factors: &Factors,
        mut change: Change<'_, N>,
        p0: &SVector<f64, N>,
    ) -> Result<ChartVector<N>, StepError> {
        let sums = self.change(&change);
        let of_momentum = p0 * (1.0 + self.sums.z0) + self.start.p * sums.z0 + sums.start;
        let of_action = -change.z0 - sums.s;
        let residual = DVector::from_fn(N + 1, |i, _| if i < N { of_momentum[i] } else { of_action });
        let solved = factors.solve(&residual).ok_or(StepError::Singular { pivot: 0.0 })?;
        change.q1 = SVector::from_fn(|i, _| -solved[i]);
        change.z1 = -solved[N];
        let sums = self.change(&change);
        let p1 = (self.end.p * sums.z1 + sums.end) / (1.0 - self.sums.z1);
        Ok(ChartVector { x: change.q1, y: p1, z: change.z1 })
    }
}

impl<L> RuleStep<'_, L> {
    /// Applies the step to a state, with its derivatives; the solution is searched near the given position and action.
    ///
    /// # Errors
    /// [`StepError::Singular`], [`StepError::NonFinite`], [`StepError::NotConverged`].
    pub fn linearise<const N: usize>(
        &self,
        of: Option<&mut Sources<'_>>,
        guess: (SVector<f64, N>, f64),
        state: &mut PhasePoint<N>,
    ) -> Result<SubFlow<N>, StepError>
    where
        L: Parametric<N>,
    {
        let (solved, factors) = self.solve(state, guess)?;
        let zero = SVector::<f64, N>::zeros();
        let mut state_map = TangentMatrix::identity();
        for j in 0..=2 * N {
            let unit = |from: usize| SVector::<f64, N>::from_fn(|i, _| f64::from(u8::from(from + i == j)));
            let z0 = f64::from(u8::from(j == 2 * N));
            let image = solved.end_along(&factors, Change { q0: unit(0), z0, ..Change::ZERO }, &unit(N))?;
            state_map.set_column(j, &image);
        }
        let mut sources = Vec::new();
        if let Some(of) = of {
            let mut explicit = Vec::with_capacity(self.nodes.len());
            let quantities = (0..of.count()).map(Quantity::Parameter).chain([Quantity::Time]);
            for quantity in quantities {
                explicit.clear();
                explicit.extend(solved.at.iter().map(|at| of.at(quantity, at.t, &at.x)));
                sources.push(solved.end_along(&factors, Change { explicit: &explicit, ..Change::ZERO }, &zero)?);
            }
            // The derivatives in the time are still those of the nodes.
            sources.push(solved.end_along(&factors, Change { h: 1.0, explicit: &explicit, ..Change::ZERO }, &zero)?);
        }
        *state = solved.end;
        Ok(SubFlow { state: state_map, sources, start: 0.0, duration: 0.0 })
    }

    /// Solves the equations of the step by Newton's method; returns the solution with its factors.
    fn solve<'s, const N: usize>(
        &'s self,
        start: &PhasePoint<N>,
        (mut q1, mut z1): (SVector<f64, N>, f64),
    ) -> Result<(RuleStepEnd<'s, 's, L, N>, Factors), StepError>
    where
        L: Parametric<N>,
    {
        let mut last = f64::INFINITY;
        for _ in 0..ITERATION_LIMIT {
            let at: Vec<AtNode<N>> = self.nodes.iter().map(|node| self.at(node, start, &q1, z1)).collect();
            let mut sums = Sums::zero();
            for (node, at) in self.nodes.iter().zip(&at) {
                sums.add(node, self.h, at.l, &at.gradient, &at.force);
            }
            let end = PhasePoint { q: q1, p: sums.end / (1.0 - sums.z1), z: z1 };
            let solved = RuleStepEnd { step: self, start: *start, end, at, sums };
            let mut matrix = DMatrix::zeros(N + 1, N + 1);
            for j in 0..=N {
                let q1 = SVector::from_fn(|i, _| f64::from(u8::from(i == j)));
                let z1 = f64::from(u8::from(j == N));
                let of = solved.change(&Change { q1, z1, ..Change::ZERO });
                let momentum = start.p * of.z0 + of.start;
                for i in 0..N {
                    matrix[(i, j)] = momentum[i];
                }
                matrix[(N, j)] = z1 - of.s;
            }
            let factors = matrix.lu();
            let momentum = start.p * (1.0 + solved.sums.z0) + solved.sums.start;
            let action = z1 - start.z - solved.sums.s;
            let residual = DVector::from_fn(N + 1, |i, _| if i < N { momentum[i] } else { action });
            let change = factors.solve(&residual).ok_or(StepError::Singular { pivot: 0.0 })?;
            let (mut size, mut moved) = (0.0, 0.0);
            for i in 0..N {
                size = max_or_nan(size, q1[i].abs() + (q1[i] - start.q[i]).abs());
                moved = max_or_nan(moved, change[i].abs());
            }
            let relative = |change: f64, size: f64| if change == 0.0 { 0.0 } else { change / size };
            let of_action = relative(change[N].abs(), z1.abs() + start.z.abs() + solved.sums.s.abs());
            let moved = max_or_nan(relative(moved, size), of_action);
            if !moved.is_finite() {
                return Err(StepError::NonFinite);
            }
            if moved <= CONVERGED || moved >= last && moved <= STAGNATED {
                return Ok((solved, factors));
            }
            last = moved;
            q1 -= SVector::<f64, N>::from_fn(|i, _| change[i]);
            z1 -= change[N];
        }
        Err(StepError::NotConverged { residual: last, iterations: ITERATION_LIMIT })
    }

    fn at<const N: usize>(&self, node: &Node, start: &PhasePoint<N>, q1: &SVector<f64, N>, z1: f64) -> AtNode<N>
    where
        L: Parametric<N>,
    {
        let x = VelocityPoint {
            q: start.q * (1.0 - node.place) + q1 * node.place,
            v: (q1 - start.q) / self.h,
            z: start.z * (1.0 - node.action) + z1 * node.action,
        };
        let t = self.t + node.place * self.h;
        let (l, gradient) = self.lagrangian.with_gradient(t, &x);
        let hessian = self.lagrangian.hessian(t, &x);
        let zero = SMatrix::zeros();
        let mut at = AtNode {
            x,
            t,
            l,
            gradient,
            hessian,
            force: SVector::zeros(),
            force_slopes: (zero, zero, SVector::zeros()),
        };
        if const { L::HINTS.forced } {
            let ChartVector { x: q, y: v, z } = seed(&ChartVector::from(at.x));
            let force = self.lagrangian.applied_force(Dual::from(t), &VelocityPoint { q, v, z });
            at.force = force.map(|f| f.re);
            at.force_slopes = (
                SMatrix::from_fn(|i, j| force[i].d.x[j]),
                SMatrix::from_fn(|i, j| force[i].d.y[j]),
                SVector::from_fn(|i, _| force[i].d.z),
            );
        }
        at
    }
}

/// The relative change of Newton's method below which the step is solved: round-off of its equations.
const CONVERGED: f64 = 64.0 * f64::EPSILON;

/// The same where round-off prevents further convergence.
const STAGNATED: f64 = 1e-10;
