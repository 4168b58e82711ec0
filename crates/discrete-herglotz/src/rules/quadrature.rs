//! Discrete Lagrangians by quadrature of the action: the common part of the rules of [`crate::rules`].

mod discrete_lagrangian;

use crate::integration::Node;
use crate::resolution::monitor::value_rounding;
use crate::rules::Rule;
use crate::rules::step_equations::{BLOCK, Frame, Sums, rates_at};
use crate::solve::newton::{Linearised, NewtonStart, max_abs, newton};
use crate::{DiscreteStep, InputError, StepError, solve::Solver};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{
    ChartVector, Derivatives, DiscretePoint, Dual, Lagrangian, PhasePoint, Scalar, VelocityPoint,
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
