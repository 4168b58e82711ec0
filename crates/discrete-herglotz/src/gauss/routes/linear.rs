//! Steps of contact Gauss collocation for a linear motion: one precomputed matrix.

use crate::StepError;
use crate::gauss::dense::{Solved, SolvedStep, StepStart};
use crate::gauss::resolution::defect_sample::{Curve, SAMPLE_SETS};
use crate::gauss::routes::{RouteState, StageRoute, set_compensation};
use crate::gauss::stages::fixed_point::IterationOutcome;
use crate::gauss::tables::coefficients::MAX_STAGES;
use crate::gauss::tables::condensed::Condensed;
use crate::gauss::work_summary::GaussRoute;
use crate::numbers::array::from_fn;
use crate::numbers::compensated::{CompensatedSum, Unevaluated, values};
use crate::numbers::double_double::solve_exactly;
use crate::numbers::registers::Stages;
use crate::numbers::state_words::saved;
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{Derivatives, Hessian, Lagrangian, VelocityPoint, support::linear};
use num_traits::{One, Zero};
use pulp::Simd;
use qd::Quad;
use std::sync::Arc;

/// The change of the action in a step without the term `grow z`: a polynomial of degree two in the velocity and in the
/// position relative to a reference point. The reference point is the equilibrium if there is one; with another one the
/// terms would cancel as a motion comes to rest, and leave their round-off.
struct Action<const N: usize> {
    equilibrium_position: SVector<f64, N>,
    qq: SMatrix<f64, N, N>,
    qv: SMatrix<f64, N, N>,
    vv: SMatrix<f64, N, N>,
    q: SVector<f64, N>,
    v: SVector<f64, N>,
    constant: f64,
}

/// The state of a linear motion, and the affine map to its changes in a step, `q1 - q0` and `v1 - v0`.
pub(crate) struct Linear<'a, L, const N: usize> {
    lagrangian: &'a L,
    table: Arc<Condensed>,
    qq: [[Unevaluated; N]; N],
    qv: [[Unevaluated; N]; N],
    vq: [[Unevaluated; N]; N],
    vv: [[Unevaluated; N]; N],
    shift_q: [Unevaluated; N],
    shift_v: [Unevaluated; N],
    grow: Unevaluated,
    action: Option<Action<N>>,
    /// The accelerations of the stages as affine functions of (q0, v0), in row `i N + d`; for dense output.
    stages: Vec<Vec<f64>>,
    q: [CompensatedSum; N],
    v: [CompensatedSum; N],
    z: CompensatedSum,
}

/// The zero of a force that is affine in the positions, from its derivative and its value at the origin; the origin if
/// there is no zero, or more than one.
fn equilibrium<const N: usize>(slope: &SMatrix<f64, N, N>, at_origin: &SVector<f64, N>) -> SVector<f64, N> {
    let mut equilibrium_position = -at_origin;
    if equilibrium_position.iter().all(|x| *x == 0.0) {
        return SVector::zeros();
    }
    let solved = linear::solve(&mut slope.clone(), &mut equilibrium_position).is_ok()
        && equilibrium_position.iter().all(|x| x.is_finite());
    if solved { equilibrium_position } else { SVector::zeros() }
}

impl<'a, L: Lagrangian<N>, const N: usize> Linear<'a, L, N> {
    /// The step for `a = M^-1 L_q = -K q + f`; `None` if the stage equations are singular.
    #[inline(never)]
    pub fn new(
        lagrangian: &'a L,
        table: &Arc<Condensed>,
        inverse_mass: &SMatrix<f64, N, N>,
        t: f64,
        start: &VelocityPoint<N>,
        wants_z: bool,
    ) -> Option<Box<Self>> {
        let (s, zero, one) = (table.s, Quad::zero(), Quad::one());
        let origin = VelocityPoint::new([0.0; N], [0.0; N], 0.0);
        let Hessian { qq, qv, vv, .. } = lagrangian.hessian(t, start);
        let at_origin = lagrangian.gradient(t, &origin);
        let (slope, constant) = (inverse_mass * qq, inverse_mass * at_origin.x);
        let unit = |d: usize, e: usize, x: Quad| if d == e { x } else { zero };
        let equilibrium_position = equilibrium(&qq, &at_origin.x);
        let there = VelocityPoint { q: equilibrium_position, v: SVector::zeros(), z: 0.0 };
        let at_place = lagrangian.gradient(t, &there);
        let constant_at_place = inverse_mass * at_place.x;
        // The equations of the stage accelerations, in rows (i, d): a_id - sum slope B a = slope (q0 + u v0) + f. The
        // right-hand sides are those of the unit vectors of q0 and v0, then f at the origin and f at the reference
        // point.
        let [last, from_place] = [2 * N, 2 * N + 1];
        let sides = 2 * N + 2;
        let mut rows: Vec<Vec<Quad>> = (0..s * N)
            .map(|row| {
                let (i, d) = (row / N, row % N);
                let left = (0..s * N).map(|column| {
                    let (k, e) = (column / N, column % N);
                    unit(row, column, one) - Quad::from(slope[(d, e)]) * table.b[i][k]
                });
                let right = (0..sides).map(|side| match side {
                    side if side < N => Quad::from(slope[(d, side)]),
                    side if side < 2 * N => Quad::from(slope[(d, side - N)]) * table.u[i],
                    side if side == last => Quad::from(constant[d]),
                    _ => Quad::from(constant_at_place[d]),
                });
                left.chain(right).collect()
            })
            .collect();
        if !solve_exactly(&mut rows) {
            return None;
        }
        let a = |i: usize, d: usize, side: usize| rows[i * N + d][s * N + side];
        let exact = &table.exact;
        let sum = |w: &[Quad], d: usize, side: usize| (0..s).fold(zero, |sum, j| sum + w[j] * a(j, d, side));
        let action = wants_z.then(|| {
            // The stages as affine functions of (q0, v0, 1), with positions relative to the reference point, and the
            // weighted sum of L over them.
            let position = |i: usize, d: usize, side: usize| {
                unit(side, d, one) + unit(side, N + d, table.u[i]) + sum(&table.b[i], d, side)
            };
            let velocity =
                |i: usize, d: usize, side: usize| unit(side, N + d, exact.inverse_rho[i]) + sum(&exact.d[i], d, side);
            let rest = lagrangian.value(t, &equilibrium_position, &origin.v, 0.0);
            let form = |a: usize, b: usize| {
                (0..s).fold(0.0, |total, i| {
                    let x = |side: usize| SVector::<f64, N>::from_fn(|d, _| position(i, d, side).0);
                    let y = |side: usize| SVector::<f64, N>::from_fn(|d, _| velocity(i, d, side).0);
                    let (xa, xb, ya, yb) = (x(a), x(b), y(a), y(b));
                    let second = xa.dot(&(qq * xb)) + ya.dot(&(vv * yb)) + xa.dot(&(qv * yb)) + xb.dot(&(qv * ya));
                    let first = |side: usize| at_place.x.dot(&x(side)) + at_place.y.dot(&y(side));
                    let linear = if b == from_place { first(a) } else { 0.0 };
                    let (half, once) =
                        if a == from_place { (0.5, rest) } else { (if b == from_place { 1.0 } else { 0.5 }, 0.0) };
                    total + exact.end_v[i].0 * (half * second + linear + once)
                })
            };
            Action {
                equilibrium_position,
                qq: SMatrix::from_fn(&form),
                qv: SMatrix::from_fn(|a, b| 2.0 * form(a, N + b)),
                vv: SMatrix::from_fn(|a, b| form(N + a, N + b)),
                q: SVector::from_fn(|a, _| form(a, from_place)),
                v: SVector::from_fn(|a, _| form(N + a, from_place)),
                constant: form(from_place, from_place),
            }
        });
        let entries = |f: &dyn Fn(usize, usize) -> Quad| from_fn(|d| from_fn(|e| f(d, e).into()));
        Some(Box::new(Linear {
            lagrangian,
            table: table.clone(),
            qq: entries(&|d, e| sum(&exact.end_b, d, e)),
            qv: entries(&|d, e| unit(d, e, exact.end_u) + sum(&exact.end_b, d, N + e)),
            vq: entries(&|d, e| sum(&exact.end_v, d, e)),
            vv: entries(&|d, e| unit(d, e, exact.grow) + sum(&exact.end_v, d, N + e)),
            shift_q: from_fn(|d| sum(&exact.end_b, d, last).into()),
            shift_v: from_fn(|d| sum(&exact.end_v, d, last).into()),
            grow: table.grow,
            action,
            stages: rows.iter().map(|row| row[s * N..=s * N + last].iter().map(|e| e.0).collect()).collect(),
            q: from_fn(|i| start.q[i].into()),
            v: from_fn(|i| start.v[i].into()),
            z: start.z.into(),
        }))
    }

    /// Takes steps until the state is not finite; the state is then that before the failed step. Returns the number of
    /// steps, and the start of the last one.
    ///
    /// The state is checked at the end of all steps; only if it is not finite they are repeated from the start with a
    /// check after each step.
    #[inline(always)]
    fn advance(&mut self, steps: usize) -> (usize, StepStart<N>) {
        let start = (self.q, self.v, self.z);
        for _ in 1..steps {
            self.step();
        }
        let last = self.start();
        self.step();
        if self.is_finite() {
            return (steps, last);
        }
        (self.q, self.v, self.z) = start;
        let mut taken = 0;
        loop {
            let before = (self.q, self.v, self.z);
            self.step();
            if !self.is_finite() {
                (self.q, self.v, self.z) = before;
                return (taken, self.start());
            }
            taken += 1;
        }
    }

    fn start(&self) -> StepStart<N> {
        StepStart { q: values(&self.q), y: values(&self.v), z: self.z.value }
    }

    #[inline(always)]
    fn is_finite(&self) -> bool {
        let mut finite = self.z.value.is_finite();
        for i in 0..N {
            finite &= self.q[i].value.is_finite() && self.v[i].value.is_finite();
        }
        finite
    }

    /// Takes one step.
    #[inline(always)]
    fn step(&mut self) {
        let (q, v) = (self.q, self.v);
        if let Some(action) = &self.action {
            let (q, v) = (SVector::from(values(&q)) - action.equilibrium_position, values(&v));
            let mut change = action.constant;
            for i in 0..N {
                let (mut of_q, mut of_v) = (action.q[i], action.v[i]);
                for j in 0..N {
                    of_q += action.qq[(i, j)] * q[j] + action.qv[(i, j)] * v[j];
                    of_v += action.vv[(i, j)] * v[j];
                }
                change += of_q * q[i] + of_v * v[i];
            }
            self.z.add(Unevaluated { head: change, tail: 0.0 } + self.grow * self.z.value);
        }
        for i in 0..N {
            let (mut dq, mut dv) = (self.shift_q[i], self.shift_v[i]);
            for j in 0..N {
                dq = dq.plus(self.qq[i][j].times(q[j]).plus(self.qv[i][j].times(v[j])));
                dv = dv.plus(self.vq[i][j].times(q[j]).plus(self.vv[i][j].times(v[j])));
            }
            self.q[i].add(dq);
            self.v[i].add(dv);
        }
    }

    /// The accelerations of the stages of the step that starts at a position and a velocity.
    fn accelerations(&self, q: &[f64; N], v: &[f64; N]) -> [[f64; MAX_STAGES]; N] {
        let side = |k: usize| {
            if k < N {
                q[k]
            } else if k < 2 * N {
                v[k - N]
            } else {
                1.0
            }
        };
        let s = self.stages.len() / N;
        from_fn(|d| {
            from_fn(|i| {
                if i >= s {
                    return 0.0;
                }
                self.stages[i * N + d].iter().enumerate().map(|(k, e)| e * side(k)).sum()
            })
        })
    }
}

saved!([L, const N: usize] Linear<'_, L, N> { q, v, z });

/// Its steps solve no equations: no iteration, and no Newton method.
impl<L: Lagrangian<N>, const N: usize> StageRoute<N> for Box<Linear<'_, L, N>> {
    fn route(&self) -> GaussRoute {
        GaussRoute::Linear
    }

    #[inline(always)]
    fn state(&self) -> RouteState<'_, N> {
        RouteState { q: &self.q, y: &self.v, z: self.z }
    }

    fn set_compensation(&mut self, terms: &StepStart<N>) {
        set_compensation((&mut self.q, &mut self.v, &mut self.z), terms);
    }

    #[inline(always)]
    fn step<S: Simd>(&mut self, _t: f64) -> IterationOutcome {
        if self.advance(1).0 == 1 { IterationOutcome::Done } else { IterationOutcome::NonFinite }
    }

    #[inline(always)]
    fn take_steps(&mut self, steps: usize) -> Option<(usize, StepStart<N>)> {
        Some(self.advance(steps))
    }

    #[inline(always)]
    fn defect(&self) -> f64 {
        0.0
    }

    /// A linear motion that is not resolved is unresolved in every step, and no step was sampled during the run.
    fn sample_sets(&self) -> usize {
        SAMPLE_SETS
    }

    fn sigma(&self) -> f64 {
        1.0 + self.table.grow.head
    }

    fn evaluations(&self) -> u64 {
        0
    }

    fn reserve_newton(&mut self) {}

    fn linearise_at_state(&mut self, _t: f64) -> bool {
        false
    }

    fn suspend_newton(&mut self) {}

    fn solve_stages(&mut self, _t: f64) -> Result<(), StepError> {
        Ok(())
    }

    fn solved(&self, step: &SolvedStep<'_, N>) -> Solved<N> {
        let a = self.accelerations(&step.from.q, &step.from.y);
        let x = self.table.positions(&step.from.q, &step.from.y, &a);
        Solved::from_accelerations(self.lagrangian, step, &self.table, [&a, &x], self.action.is_some())
    }

    fn solved_without_action(&self, step: &SolvedStep<'_, N>) -> Option<Solved<N>> {
        let a = self.accelerations(&step.from.q, &step.from.y);
        let x = self.table.positions(&step.from.q, &step.from.y, &a);
        Some(Solved::from_accelerations(self.lagrangian, step, &self.table, [&a, &x], false))
    }

    #[inline(always)]
    fn collect<S: Simd>(&self, step: &SolvedStep<'_, N>, curve: &mut Curve<N>) {
        let a = self.accelerations(&step.from.q, &step.from.y);
        let x = self.table.positions(&step.from.q, &step.from.y, &a);
        curve.of_accelerations::<S, L>(self.lagrangian, step, &self.table, [&a.map(Stages), &x.map(Stages)]);
    }
}
