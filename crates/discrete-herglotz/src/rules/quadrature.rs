//! Discrete Lagrangians by quadrature of the action: the common part of the rules of [`crate::rules`].

use crate::integration::Node;
use crate::resolution::monitor::{defect, factor_defect, value_rounding};
use crate::rules::Rule;
use crate::rules::step_equations::{BLOCK, Frame, Sums, rates_at};
use crate::solve::newton::{Linearised, NewtonStart, max_abs, newton};
use crate::{DiscreteLagrangian, DiscreteStep, InputError, StepError, solve::Solver};
use contact_geom::nalgebra::{DMatrix, SMatrix, SVector};
use contact_geom::{
    ChartVector, Derivatives, DiscreteJet, DiscretePoint, Dual, GeometryError, Lagrangian, PhasePoint, Regularity,
    Scalar, SecondDiscreteJet, VelocityPoint,
    numbers::{AugmentedVector, TangentVector},
    support::gradient_rounding,
};

/// The round-off allowed in a residual, in units of the round-off of the terms of L: a few nodes with a few units each.
const RESIDUAL_ROUNDINGS: f64 = 64.0;

/// The discrete Lagrangian of a [`Rule`]: `L_d(q0, q1, z0) = z1 - z0`, where
/// `z1 = z0 + S(q0, q1, z0, z1)` and `S = h sum_i w_i L(node i)`.
///
/// `S` is a discrete Lagrangian on `Q x Q x R^2` in the sense of Vermeeren, Bravetti and Seri; solving for `z1` gives
/// one on `Q x Q x R`. With the partial derivatives `S_1, S_2, S_z0, S_z1` of `S`, `sigma_d = (1 + S_z0)/(1 - S_z1)`,
/// `p0 = -S_1/(1 + S_z0)` and `p1 = S_2/(1 - S_z1)`.
///
/// An applied force f is evaluated at the same nodes, with places `a_i`: the discrete forces are
/// `F- = h sum_i w_i (1 - a_i) f_i / (1 - S_z1)` and `F+ = h sum_i w_i a_i f_i / (1 - S_z1)`.
#[derive(Clone, Copy, Debug)]
pub struct Quadrature<L> {
    lagrangian: L,
    h: f64,
    rule: Rule,
    /// Whether the rule, and its adjoint, is implicit in the action at the end of the step.
    implicit: bool,
    adjoint_is_implicit: bool,
    /// Whether it is the symmetric midpoint rule, which is its own adjoint.
    is_midpoint: bool,
}

/// The partial derivatives of `S` on `Q x Q x R^2`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExtendedJet<const N: usize> {
    /// `S(q0, q1, z0, z1)`.
    pub value: f64,
    /// The derivative in `q0`.
    pub s1: SVector<f64, N>,
    /// The derivative in `q1`.
    pub s2: SVector<f64, N>,
    /// The derivative in `z0`.
    pub z0: f64,
    /// The derivative in `z1`.
    pub z1: f64,
}

impl<L> Quadrature<L> {
    /// A rule applied to a Lagrangian with the time step `h`.
    ///
    /// # Errors
    /// [`InputError::Step`] unless `h` is finite and not 0 (it is negative for steps backward in time),
    /// [`InputError::Dimension`] if `N = 0`.
    pub fn new<const N: usize>(rule: Rule, lagrangian: L, h: f64) -> Result<Self, InputError>
    where
        L: Lagrangian<N>,
    {
        if N == 0 {
            return Err(InputError::Dimension);
        }
        if !(h != 0.0 && h.is_finite()) {
            return Err(InputError::Step { h });
        }
        let adjoint_is_implicit = rule.nodes.iter().any(|node| node.action != 1.0);
        let is_midpoint = rule.nodes == Rule::MIDPOINT.nodes;
        Ok(Quadrature { lagrangian, h, rule, implicit: rule.is_implicit_in_z(), adjoint_is_implicit, is_midpoint })
    }

    /// The Lagrangian.
    pub fn lagrangian(&self) -> &L {
        &self.lagrangian
    }

    /// The rule.
    pub fn rule(&self) -> &Rule {
        &self.rule
    }

    /// `S` and its partial derivatives at a point of `Q x Q x R^2`; paper, section 6.
    #[inline(always)]
    pub fn extended_jet<const N: usize>(&self, t: f64, x: &DiscretePoint<N>, z1: f64) -> ExtendedJet<N>
    where
        L: Lagrangian<N>,
    {
        let h = self.h;
        let mut jet = ExtendedJet { value: 0.0, s1: SVector::zeros(), s2: SVector::zeros(), z0: 0.0, z1: 0.0 };
        for node in self.rule.nodes {
            let (at, w) = (place(node, h, x, z1), h * node.weight);
            let (value, g) = self.value_and_gradient(t + node.place * h, &at);
            jet.value += w * value;
            // The velocity is the difference of the positions divided by h.
            let slope = g.y * node.weight;
            jet.s1 += g.x * (w * (1.0 - node.place)) - slope;
            jet.s2 += g.x * (w * node.place) + slope;
            jet.z0 += w * (1.0 - node.action) * g.z;
            jet.z1 += w * node.action * g.z;
        }
        jet
    }

    /// The action `z1` at the end of the step, by Newton's method over any scalar type.
    fn end_action<T: Scalar, const N: usize>(&self, t: f64, x: &DiscretePoint<N, T>) -> Result<T, StepError>
    where
        L: Lagrangian<N>,
    {
        let mut z1 = x.z0;
        let mut last = f64::INFINITY;
        // After the value has converged, each further iteration makes the derivatives of one more order exact.
        let mut extra = 4;
        for _ in 0..crate::solve::newton::ITERATION_LIMIT {
            let unknown = Dual { re: z1, d: SVector::<T, 1>::new(T::one()) };
            let mut defect = Dual::constant(x.z0) - unknown;
            for node in self.rule.nodes {
                let lifted = DiscretePoint {
                    q0: x.q0.map(Dual::constant),
                    q1: x.q1.map(Dual::constant),
                    z0: Dual::constant(x.z0),
                };
                let at = place(node, self.h, &lifted, unknown);
                let time = Dual::from(t + node.place * self.h);
                defect += self.lagrangian.value(time, &at.q, &at.v, at.z) * (self.h * node.weight);
            }
            let change = -defect.re / defect.d[0];
            z1 += change;
            let size = change.pivot_size();
            if !size.is_finite() {
                return Err(StepError::NonFinite);
            }
            if !self.implicit {
                return Ok(z1);
            }
            if size <= f64::EPSILON * z1.pivot_size() || size >= last {
                extra -= 1;
                if extra == 0 {
                    return Ok(z1);
                }
            }
            last = size;
        }
        Err(StepError::NotConverged { residual: last, iterations: crate::solve::newton::ITERATION_LIMIT })
    }

    #[inline]
    fn value_and_gradient<const N: usize>(&self, t: f64, x: &VelocityPoint<N>) -> (f64, ChartVector<N>)
    where
        L: Lagrangian<N>,
    {
        self.lagrangian.with_gradient(t, x)
    }

    /// The step equations of the rule (or of its adjoint, with `h` negative), linearised at a mean velocity and an end
    /// action.
    ///
    /// With left directions `l_i = (h (1-a) e_i, -e_i, h (1-b) p0_i)` at each node, the momentum equation is
    /// `r_i = p0_i + sum w dL[l_i] = 0`; its derivatives are `d2L[l_i, r_j]` along the right directions
    /// `r_j = (h a e_j, e_j, 0)` of the velocity and `(0, 0, b)` of the end action. Nested dual numbers carry only
    /// these directions, in blocks. An applied force f adds `sum w h (1-a) f_i` to the residual.
    #[inline(always)]
    fn linearise<const N: usize>(
        &self,
        Form { nodes, adjoint, implicit }: Form<'_>,
        t: f64,
        h: f64,
        from: &PhasePoint<N>,
        u: &SVector<f64, N>,
        z1: f64,
    ) -> Linearised<N>
    where
        L: Lagrangian<N>,
    {
        let mut sums = Sums {
            value: 0.0,
            residual: from.p,
            right: SMatrix::zeros(),
            right_z: SVector::zeros(),
            slope: AugmentedVector::null(),
        };
        for node in nodes {
            let node = directed(node, adjoint);
            let at = VelocityPoint {
                q: from.q + u * (node.place * h),
                v: *u,
                z: if implicit { from.z * (1.0 - node.action) + z1 * node.action } else { from.z },
            };
            let frame = Frame { node, h, p: &from.p, t: t + node.place * h, at: &at };
            if const { N > BLOCK } {
                frame.by_blocks(&self.lagrangian, N + usize::from(implicit), &mut sums);
            } else if implicit {
                frame.accumulate::<AugmentedVector<N>, N, _>(&self.lagrangian, 0, 0, &mut sums);
            } else {
                frame.accumulate::<SVector<f64, N>, N, _>(&self.lagrangian, 0, 0, &mut sums);
            }
        }
        let size = max_abs(&from.p) + max_abs(&sums.right) * max_abs(u);
        if !implicit {
            return Linearised {
                residual: sums.residual,
                jacobian: sums.right,
                size,
                z_change: 0.0,
                z_slope: SVector::zeros(),
            };
        }
        let pivot = 1.0 - h * sums.slope.z;
        let (z_change, z_slope) = ((from.z - z1 + h * sums.value) / pivot, sums.slope.x * (h / pivot));
        Linearised {
            residual: sums.residual + sums.right_z * z_change,
            jacobian: sums.right + sums.right_z * z_slope.transpose(),
            size: size + max_abs(&sums.right_z) * (from.z.abs() + (h * sums.value).abs()),
            z_change,
            z_slope,
        }
    }

    /// One step of the rule (or of its adjoint, with `h` negative and `t` the time at its start).
    #[inline(always)]
    fn step<const N: usize>(
        &self,
        form: Form<'_>,
        t: f64,
        h: f64,
        from: &PhasePoint<N>,
        guess: &SVector<f64, N>,
        solver: &mut Solver<N>,
    ) -> Result<DiscreteStep<N>, StepError>
    where
        L: Lagrangian<N>,
    {
        let Form { nodes, adjoint, implicit } = form;
        let (resolution, impulse) = ((max_abs(&from.q) / h).abs(), max_abs(&from.p) * h.abs());
        let start = NewtonStart { u: *guess, z: from.z, resolution, impulse };
        let rounding = |u: &SVector<f64, N>, z1: f64| {
            let x = VelocityPoint { q: from.q + u * (0.5 * h), v: *u, z: z1 };
            rounding_of_residual(&self.lagrangian, (t + 0.5 * h, h), &x, &from.p)
        };
        let root = newton(
            start,
            solver,
            rounding,
            #[inline(always)]
            |u, z1| Ok(self.linearise(form, t, h, from, u, z1)),
        )?;
        let (u, mut force) = (root.u, SVector::<f64, N>::zeros());
        let (mut value, mut slope_0, mut slope_1) = (0.0, 0.0, 0.0);
        for node in nodes {
            let node = directed(node, adjoint);
            let at = VelocityPoint {
                q: from.q + u * (node.place * h),
                v: u,
                z: if implicit { from.z * (1.0 - node.action) + root.z * node.action } else { from.z },
            };
            let (l, pull, rate) = rates_at(&self.lagrangian, t + node.place * h, &at);
            value += node.weight * l;
            force += pull * node.weight;
            slope_0 += node.weight * (1.0 - node.action) * rate;
            slope_1 += node.weight * node.action * rate;
        }
        let (q, sigma) = (from.q + u * h, 1.0 + h * slope_0);
        // The momentum is updated by the difference of the two momentum equations,
        // `p1 (1 - S_z1) - p0 (1 + S_z0) = h sum w L_q`. This increment contains neither the round-off of u nor that of
        // `1 + S_z0`, which would have the same sign in all steps.
        let change = (force + from.p * (slope_0 + slope_1)) * h;
        if !implicit {
            let end = PhasePoint { q, p: from.p + change, z: from.z + h * value };
            return Ok(DiscreteStep { end, velocity: u, sigma, iterations: root.iterations });
        }
        let pivot = 1.0 - h * slope_1;
        // One more Newton step for z1, at no extra cost, so that its last digits agree with this evaluation.
        let z = root.z + (from.z - root.z + h * value) / pivot;
        // Dividing by the pivot directly would change each increment by the same relative round-off in all steps.
        let end = PhasePoint { q, p: from.p + (change + change * (h * slope_1 / pivot)), z };
        Ok(DiscreteStep { end, velocity: u, sigma: sigma / pivot, iterations: root.iterations })
    }
}

/// The nodes of a step, whether they are reflected for the adjoint rule, and whether the step is implicit in the action.
#[derive(Clone, Copy)]
struct Form<'n> {
    nodes: &'n [Node],
    adjoint: bool,
    implicit: bool,
}

/// The symmetric midpoint rule, whose steps are those of compositions.
const MIDPOINT: Form<'static> = Form { nodes: Rule::MIDPOINT.nodes, adjoint: false, implicit: true };

impl<L> Quadrature<L> {
    /// A step of the symmetric midpoint rule over h; never inlined, see [`forward`](DiscreteLagrangian::forward).
    #[inline(never)]
    fn midpoint_step<const N: usize>(
        &self,
        (t, h): (f64, f64),
        from: &PhasePoint<N>,
        guess: &SVector<f64, N>,
        solver: &mut Solver<N>,
    ) -> Result<DiscreteStep<N>, StepError>
    where
        L: Lagrangian<N>,
    {
        self.step(MIDPOINT, t, h, from, guess, solver)
    }

    /// A step of a rule with one node that is explicit in z, of weight 1; never inlined.
    #[inline(never)]
    fn explicit_step<const N: usize>(
        &self,
        node: &Node,
        t: f64,
        from: &PhasePoint<N>,
        guess: &SVector<f64, N>,
        solver: &mut Solver<N>,
    ) -> Result<DiscreteStep<N>, StepError>
    where
        L: Lagrangian<N>,
    {
        let nodes = &[Node { weight: 1.0, action: 0.0, ..*node }];
        self.step(Form { nodes, adjoint: false, implicit: false }, t, self.h, from, guess, solver)
    }

    /// A step of any rule forward, or of its adjoint backward with `h` negative.
    #[inline(never)]
    fn step_of_nodes<const N: usize>(
        &self,
        adjoint: bool,
        t: f64,
        from: &PhasePoint<N>,
        guess: &SVector<f64, N>,
        solver: &mut Solver<N>,
    ) -> Result<DiscreteStep<N>, StepError>
    where
        L: Lagrangian<N>,
    {
        let (implicit, h) = if adjoint { (self.adjoint_is_implicit, -self.h) } else { (self.implicit, self.h) };
        self.step(Form { nodes: self.rule.nodes, adjoint, implicit }, t, h, from, guess, solver)
    }
}

/// Bounds for the round-off of L in the residual of a step of length h and in its action, at a point in the middle of
/// the step. Near an equilibrium the terms of the force cancel, and its round-off is that of these terms; the same
/// holds for the potential.
#[cold]
#[inline(never)]
fn rounding_of_residual<L: Lagrangian<N>, const N: usize>(
    lagrangian: &L,
    (t, h): (f64, f64),
    x: &VelocityPoint<N>,
    p: &SVector<f64, N>,
) -> [f64; 2] {
    let (of_value, once) = gradient_rounding(lagrangian, t, x);
    let of_action = value_rounding(of_value, once.x.as_slice(), x.q.as_slice());
    [h.abs() * (max_abs(&once.x) + max_abs(p) * once.z) + max_abs(&once.y), h.abs() * of_action]
        .map(|e| RESIDUAL_ROUNDINGS * e)
}

/// The node, or its reflection for the adjoint rule.
#[inline(always)]
fn directed(node: &Node, adjoint: bool) -> Node {
    if adjoint { node.reflected() } else { *node }
}

/// The point of TQ x R at which L is evaluated for a node.
#[inline]
fn place<T: Scalar, const N: usize>(node: &Node, h: f64, x: &DiscretePoint<N, T>, z1: T) -> VelocityPoint<N, T> {
    VelocityPoint {
        q: SVector::from_fn(|i, _| x.q0[i] * (1.0 - node.place) + x.q1[i] * node.place),
        v: SVector::from_fn(|i, _| (x.q1[i] - x.q0[i]) / h),
        z: x.z0 * (1.0 - node.action) + z1 * node.action,
    }
}

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
