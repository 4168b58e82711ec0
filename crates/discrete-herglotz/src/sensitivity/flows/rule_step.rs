//! The derivative of a step of a quadrature rule.

use super::sub_flow::SubFlow;
use super::tangent_matrix::TangentMatrix;
use crate::rules::Node;
use crate::sensitivity::parametric_system::{ExplicitDerivatives, Quantities, Quantity};
use crate::solve::ITERATION_LIMIT;
use crate::system::products::{times, transposed_times};
use crate::{Components, ForceDerivatives, Point, SecondDerivatives, State, StepError, System, Vector};
use contact_geom::nalgebra::{DMatrix, DVector, Dyn, LU};
use contact_geom::numbers::max_or_nan;

/// A step of a quadrature rule on `Q x Q x R^2`, over a length h of either sign from the time t.
///
/// With `S = h sum_i w_i L_i` and the sums `F1 = h sum_i w_i (1 - a_i) f_i` and `F2 = h sum_i w_i a_i f_i` of a force, the
/// end of the step from `(q0, p0, z0)` is the solution of
///
/// `p0 (1 + S_z0) + S_1 + F1 = 0`, `z1 - z0 - S = 0`, `p1 (1 - S_z1) - S_2 - F2 = 0`;
///
/// its derivatives follow from the linearisation of these equations.
pub(super) struct RuleStep<'l> {
    pub system: &'l dyn System,
    pub nodes: &'static [Node],
    pub t: f64,
    pub h: f64,
}

/// The values and derivatives of L and of the force at a node.
struct AtNode {
    x: Point,
    t: f64,
    l: f64,
    gradient: Components,
    hessian: SecondDerivatives,
    force: Option<ForceDerivatives>,
}

/// A change of the ends of a step, of its length, and of a parameter or of its time.
struct Change<'e> {
    q0: Vector,
    q1: Vector,
    z0: f64,
    z1: f64,
    h: f64,
    /// The derivatives of L and f at each node in the parameter or in the time, which are multiplied by the place of the
    /// node for a change of h.
    explicit: &'e [ExplicitDerivatives],
}

impl Change<'_> {
    /// That of nothing, for n coordinates.
    fn zero(n: usize) -> Self {
        Change { q0: Vector::zeros(n), q1: Vector::zeros(n), z0: 0.0, z1: 0.0, h: 0.0, explicit: &[] }
    }
}

/// The sums S, its partial derivatives, and those of the force; or their changes.
struct Sums {
    s: f64,
    /// `S_1 + F1`, and `S_2 + F2`.
    start: Vector,
    end: Vector,
    z0: f64,
    z1: f64,
}

impl Sums {
    fn zero(n: usize) -> Self {
        Sums { s: 0.0, start: Vector::zeros(n), end: Vector::zeros(n), z0: 0.0, z1: 0.0 }
    }

    /// Adds the terms of a node with these values, for a step of length h.
    fn add(&mut self, node: &Node, h: f64, l: f64, g: &Components, force: Option<&Vector>) {
        let (a, b, w) = (node.place, node.action, node.weight);
        let push = force.map_or_else(|| g.x.clone(), |force| &g.x + force) * (h * w);
        self.s += h * w * l;
        self.start += &push * (1.0 - a) - &g.y * w;
        self.end += push * a + &g.y * w;
        self.z0 += h * w * (1.0 - b) * g.z;
        self.z1 += h * w * b * g.z;
    }
}

/// The factors of the derivative of the first two equations of a step in `(q1, z1)`.
type Factors = LU<f64, Dyn, Dyn>;

/// A step with given ends, and the linearisation of its equations there.
struct RuleStepEnd<'s> {
    step: &'s RuleStep<'s>,
    start: &'s State,
    end: State,
    at: Vec<AtNode>,
    sums: Sums,
}

impl RuleStepEnd<'_> {
    /// The change of the sums along a change of the ends, of the length, and of a parameter or the time.
    fn change(&self, change: &Change<'_>) -> Sums {
        let RuleStep { nodes, h, .. } = *self.step;
        let n = self.start.q.len();
        let mut sums = Sums::zero(n);
        for (i, (node, at)) in nodes.iter().zip(&self.at).enumerate() {
            let (a, b) = (node.place, node.action);
            let q = &change.q0 * (1.0 - a) + &change.q1 * a;
            let v = (&change.q1 - &change.q0 - &at.x.v * change.h) / h;
            let z = change.z0 * (1.0 - b) + change.z1 * b;
            let SecondDerivatives { qq, qv, vv, qz, vz, zz } = &at.hessian;
            let mut g = Components {
                x: times(qq, &q) + times(qv, &v) + qz * z,
                y: transposed_times(qv, &q) + times(vv, &v) + vz * z,
                z: qz.dot(&q) + vz.dot(&v) + zz * z,
            };
            let of_force = |of: &ForceDerivatives| times(&of.q, &q) + times(&of.v, &v) + &of.z * z;
            let mut force = at.force.as_ref().map(of_force);
            let mut l = at.gradient.dot(&Components { x: q, y: v, z });
            if let Some(explicit) = change.explicit.get(i) {
                let factor = if change.h == 0.0 { 1.0 } else { a * change.h };
                l += factor * explicit.l;
                g = g.plus(&explicit.gradient.scale(factor));
                let of_force = &explicit.force * factor;
                force = Some(force.map_or(of_force.clone(), |force| force + of_force));
            }
            sums.add(node, h, l, &g, force.as_ref());
            if change.h != 0.0 {
                // The momenta L_v have no factor h.
                let still = Components { y: Vector::zeros(n), ..at.gradient.clone() };
                sums.add(node, change.h, at.l, &still, at.force.as_ref().map(|force| &force.value));
            }
        }
        sums
    }

    /// The derivative of the end along a change of the start, where q1 and z1 do not change, of `p0`, and of the others.
    fn end_along(&self, factors: &Factors, mut change: Change<'_>, p0: &Vector) -> Result<Components, StepError> {
        let n = p0.len();
        let sums = self.change(&change);
        let of_momentum = p0 * (1.0 + self.sums.z0) + &self.start.p * sums.z0 + sums.start;
        let of_action = -change.z0 - sums.s;
        let residual = DVector::from_fn(n + 1, |i, _| if i < n { of_momentum[i] } else { of_action });
        let solved = factors.solve(&residual).ok_or(StepError::Singular { pivot: 0.0 })?;
        change.q1 = Vector::from_fn(n, |i| -solved[i]);
        change.z1 = -solved[n];
        let sums = self.change(&change);
        let p1 = (&self.end.p * sums.z1 + sums.end) / (1.0 - self.sums.z1);
        Ok(Components { x: change.q1, y: p1, z: change.z1 })
    }
}

impl RuleStep<'_> {
    /// Applies the step to a state, with its derivatives; the solution is searched near the given position and action.
    ///
    /// # Errors
    /// [`StepError::Singular`], [`StepError::NonFinite`], [`StepError::NotConverged`].
    pub fn linearise(
        &self,
        of: Option<&mut (dyn Quantities + '_)>,
        guess: (Vector, f64),
        state: &mut State,
    ) -> Result<SubFlow, StepError> {
        let n = state.q.len();
        let (solved, factors) = self.solve(state, guess)?;
        let zero = Vector::zeros(n);
        let mut state_map = TangentMatrix::identity(n);
        for j in 0..=2 * n {
            let unit = |from: usize| Vector::from_fn(n, |i| f64::from(u8::from(from + i == j)));
            let z0 = f64::from(u8::from(j == 2 * n));
            let image = solved.end_along(&factors, Change { q0: unit(0), z0, ..Change::zero(n) }, &unit(n))?;
            state_map.set_column(j, image);
        }
        let mut sources = Vec::new();
        if let Some(of) = of {
            let mut explicit = Vec::with_capacity(self.nodes.len());
            let quantities = (0..of.count()).map(Quantity::Parameter).chain([Quantity::Time]);
            for quantity in quantities {
                explicit.clear();
                explicit.extend(solved.at.iter().map(|at| of.at(quantity, at.t, &at.x)));
                sources.push(solved.end_along(&factors, Change { explicit: &explicit, ..Change::zero(n) }, &zero)?);
            }
            // The derivatives in the time are still those of the nodes.
            sources.push(solved.end_along(
                &factors,
                Change { h: 1.0, explicit: &explicit, ..Change::zero(n) },
                &zero,
            )?);
        }
        *state = solved.end;
        Ok(SubFlow { state: state_map, sources, start: 0.0, duration: 0.0 })
    }

    /// Solves the equations of the step by Newton's method; returns the solution with its factors.
    fn solve<'s>(
        &'s self,
        start: &'s State,
        (mut q1, mut z1): (Vector, f64),
    ) -> Result<(RuleStepEnd<'s>, Factors), StepError> {
        let n = q1.len();
        let mut last = f64::INFINITY;
        for _ in 0..ITERATION_LIMIT {
            let at: Vec<AtNode> = self.nodes.iter().map(|node| self.at(node, start, &q1, z1)).collect();
            let mut sums = Sums::zero(n);
            for (node, at) in self.nodes.iter().zip(&at) {
                sums.add(node, self.h, at.l, &at.gradient, at.force.as_ref().map(|force| &force.value));
            }
            let end = State { q: q1.clone(), p: &sums.end / (1.0 - sums.z1), z: z1 };
            let solved = RuleStepEnd { step: self, start, end, at, sums };
            let mut matrix = DMatrix::zeros(n + 1, n + 1);
            for j in 0..=n {
                let q1 = Vector::from_fn(n, |i| f64::from(u8::from(i == j)));
                let z1 = f64::from(u8::from(j == n));
                let of = solved.change(&Change { q1, z1, ..Change::zero(n) });
                let momentum = &start.p * of.z0 + of.start;
                for i in 0..n {
                    matrix[(i, j)] = momentum[i];
                }
                matrix[(n, j)] = z1 - of.s;
            }
            let factors = matrix.lu();
            let momentum = &start.p * (1.0 + solved.sums.z0) + &solved.sums.start;
            let action = z1 - start.z - solved.sums.s;
            let residual = DVector::from_fn(n + 1, |i, _| if i < n { momentum[i] } else { action });
            let change = factors.solve(&residual).ok_or(StepError::Singular { pivot: 0.0 })?;
            let (mut size, mut moved) = (0.0, 0.0);
            for i in 0..n {
                size = max_or_nan(size, q1[i].abs() + (q1[i] - start.q[i]).abs());
                moved = max_or_nan(moved, change[i].abs());
            }
            let relative = |change: f64, size: f64| if change == 0.0 { 0.0 } else { change / size };
            let of_action = relative(change[n].abs(), z1.abs() + start.z.abs() + solved.sums.s.abs());
            let moved = max_or_nan(relative(moved, size), of_action);
            if !moved.is_finite() {
                return Err(StepError::NonFinite);
            }
            if moved <= CONVERGED || moved >= last && moved <= STAGNATED {
                return Ok((solved, factors));
            }
            last = moved;
            q1 -= Vector::from_fn(n, |i| change[i]);
            z1 -= change[n];
        }
        Err(StepError::NotConverged { residual: last, iterations: ITERATION_LIMIT })
    }

    fn at(&self, node: &Node, start: &State, q1: &Vector, z1: f64) -> AtNode {
        let (system, t) = (self.system, self.t + node.place * self.h);
        let x = Point {
            q: &start.q * (1.0 - node.place) + q1 * node.place,
            v: (q1 - &start.q) / self.h,
            z: start.z * (1.0 - node.action) + z1 * node.action,
        };
        let (l, gradient) = (system.value(t, &x), system.gradient(t, &x));
        let (hessian, force) = (system.hessian(t, &x), system.force_derivatives(t, &x));
        AtNode { x, t, l, gradient, hessian, force }
    }
}

/// The relative change of Newton's method below which the step is solved: round-off of its equations.
const CONVERGED: f64 = 64.0 * f64::EPSILON;

/// The same where round-off prevents further convergence.
const STAGNATED: f64 = 1e-10;
