//! Contact Gauss collocation for constant mass and constant rate of the conformal factor, condensed to the positions.

// Several arrays share an index.
#![allow(clippy::needless_range_loop)]

use crate::gauss::limits::MIN_PIVOT;
use crate::gauss::tables::coefficients::{Coefficients, MAX_STAGES};
use crate::numbers::compensated::{Unevaluated, exact_sum, lost_in_product, product_plus};
use crate::numbers::double_double::{ExactRow, solve_exactly};
use crate::numbers::instructions::Instructions;
use crate::numbers::lanes::Lanes;
use crate::numbers::registers::{DoubleDoubleStages, StageMap, Stages, Weights, padded};
use crate::{InputError, StepError};
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::support::linear;
use num_traits::{One, Zero};
use pulp::{Simd, WithSimd};
use qd::Quad;
use std::array::from_fn;
use std::cell::RefCell;
use std::sync::{Arc, OnceLock};

/// The coefficients of a step of `L = v.Mv/2 - V(t, q) + gamma z` in terms of the accelerations
/// `a_i = M^-1 L_q(t_i, Q_i)` alone. With the stages `rho_i` of the integrating factor, which depend on `gamma h` only,
/// `Q = q0 + u v0 + B a`, `V_i = v0 / rho_i + (D a)_i`, and at the end `q1 = q0 + end_u v0 + end_b.a`,
/// `v1 = v0 + grow v0 + end_v.a`, `z1 = z0 + grow z0 + end_v.(L - gamma z)`, `sigma_d = 1 + grow`.
pub(crate) struct Condensed {
    pub s: usize,
    pub h: f64,
    pub gamma: f64,
    /// `B`, the map from the accelerations to the positions.
    pub b: [DoubleDoubleStages; MAX_STAGES],
    /// `u`.
    pub u: DoubleDoubleStages,
    /// `D`, the map from the accelerations to the velocities.
    pub d: StageMap,
    /// `1 / rho_i`.
    pub inverse_rho: Stages,
    /// The times of the stages relative to the start of the step.
    pub times: Stages,
    /// `end_u`.
    pub end_u: Unevaluated,
    pub end_b: Weights,
    /// `D`, `1 / rho`, `end_u`, `end_b`, `grow` and `end_v` in double-double precision.
    pub exact: Box<ExactEnd>,
    /// `sigma_d - 1`.
    pub grow: Unevaluated,
    pub end_v: Weights,
    /// The extrapolation from the stages of one step to those of the next.
    pub extrapolation: StageMap,
    /// See [`actions`](Self::actions).
    actions: OnceLock<Box<Actions>>,
}

/// The coefficients, by columns, of `gamma Z = from_start z0 + from_values (L - gamma z)` at the stages; not finite at
/// the pole of the collocation polynomial of z.
pub(crate) struct Actions {
    pub from_start: [f64; MAX_STAGES],
    pub from_values: [[f64; MAX_STAGES]; MAX_STAGES],
}

/// The coefficients of a [`Condensed`] step in double-double precision, for linear motions.
pub(crate) struct ExactEnd {
    pub d: [DoubleDoubleStages; MAX_STAGES],
    pub inverse_rho: DoubleDoubleStages,
    pub end_u: Quad,
    pub end_b: DoubleDoubleStages,
    pub grow: Quad,
    pub end_v: DoubleDoubleStages,
}

thread_local! {
    /// The two tables that were requested last: a plan and its run, and successive runs, use the same table, and each
    /// run compares some steps with steps of half the size.
    static LAST: RefCell<[Option<Arc<Condensed>>; 2]> = const { RefCell::new([None, None]) };
}

impl Condensed {
    /// The table for a number of stages, a step size and a rate.
    ///
    /// # Errors
    /// Those of [`new`](Self::new).
    pub fn of(s: usize, h: f64, gamma: f64) -> Result<Arc<Self>, InputError> {
        let same = |table: &Arc<Self>| {
            table.s == s && table.h.to_bits() == h.to_bits() && table.gamma.to_bits() == gamma.to_bits()
        };
        let [last, before] = LAST.take();
        let (table, other) = match (last, before) {
            (Some(last), before) if same(&last) => (last, before),
            (last, Some(before)) if same(&before) => (before, last),
            (last, _) => (Arc::new(Self::new(s, h, gamma)?), last),
        };
        LAST.set([Some(table.clone()), other]);
        Ok(table)
    }

    /// # Errors
    /// [`StepError::StageFactor`] if a stage of the integrating factor is not positive, [`InputError::Sigma`] if its
    /// value at the end is not positive: the step is then too long for this rate.
    pub fn new(s: usize, h: f64, gamma: f64) -> Result<Self, InputError> {
        let g = Coefficients::of(s);
        let (one, zero, step, rate) = (Quad::one(), Quad::zero(), Quad::from(h), Quad::from(gamma));
        let mut rho: DoubleDoubleStages = [one; MAX_STAGES];
        if gamma != 0.0 {
            // (1 + gamma h A) rho = 1.
            let factor = rate * step;
            let entry = |i: usize, j: usize| if i == j { one + factor * g.a[i][j] } else { factor * g.a[i][j] };
            let row = |i: usize| (0..s).map(|j| entry(i, j)).chain([one]).collect();
            let mut rows: Vec<Vec<Quad>> = (0..s).map(row).collect();
            if !solve_exactly(&mut rows) {
                return Err(InputError::Sigma { sigma: f64::NAN });
            }
            rho = from_fn(|i| if i < s { rows[i][s] } else { one });
        }
        let sum = |f: &dyn Fn(usize) -> Quad| (0..s).fold(zero, |sum, j| sum + f(j));
        let one_minus_rho = step * rate * sum(&|j| g.b[j] * rho[j]);
        let end_rho = one - one_minus_rho;
        // Written so that a NaN is an error.
        if let Some(rho) = rho[..s].iter().map(|rho| rho.0).find(|rho| !(*rho > 0.0 && rho.is_finite())) {
            return Err(InputError::FirstStep(StepError::StageFactor { rho }));
        }
        if !(end_rho.0 > 0.0 && end_rho.0.is_finite()) {
            return Err(InputError::Sigma { sigma: 1.0 / end_rho.0 });
        }
        let AccelerationProducts { velocity, positions } = Instructions::new().dispatch(Multiply { s, h, rho: &rho });
        let exact = ExactEnd {
            d: velocity.map(|row| from_fn(|j| row.at(j))),
            inverse_rho: rho.map(|r| if gamma == 0.0 { one } else { one / r }),
            end_u: positions[s].at(MAX_STAGES),
            end_b: from_fn(|k| positions[s].at(k)),
            grow: one_minus_rho / end_rho,
            end_v: from_fn(|j| if j < s { step * g.b[j] * rho[j] / end_rho } else { zero }),
        };
        let b = from_fn(|i| from_fn(|k| positions[i].at(k)));
        let u = from_fn(|i| positions[i].at(MAX_STAGES));
        Ok(Condensed {
            s,
            h,
            gamma,
            b,
            u,
            d: StageMap::from_exact(&exact.d, s),
            inverse_rho: padded(&exact.inverse_rho, s),
            times: padded(&g.c.map(|c| c * step), s),
            end_u: exact.end_u.into(),
            end_b: Weights::new(&exact.end_b),
            grow: exact.grow.into(),
            end_v: Weights::new(&exact.end_v),
            extrapolation: StageMap::new(&g.extrapolation, s),
            exact: Box::new(exact),
            actions: OnceLock::new(),
        })
    }

    /// The solution of `Z = z0 + hA (L - gamma z) + gamma hA Z` for the actions of the stages; computed at the first
    /// request.
    pub fn actions(&self) -> &Actions {
        self.actions.get_or_init(|| {
            let (s, g) = (self.s, Coefficients::of(self.s));
            let entry = |i: usize, j: usize| if i < s && j < s { self.gamma * self.h * g.a[i][j].0 } else { 0.0 };
            let left =
                SMatrix::<f64, MAX_STAGES, MAX_STAGES>::from_fn(|i, j| f64::from(u8::from(i == j)) - entry(i, j));
            let solved = |column: &dyn Fn(usize) -> f64| {
                let mut column = SVector::<f64, MAX_STAGES>::from_fn(|i, _| if i < s { column(i) } else { 0.0 });
                // Without a solution the end of the step is still defined, but not its dense output.
                match linear::solve(&mut left.clone_owned().view_mut((0, 0), (s, s)), &mut column.rows_mut(0, s)) {
                    Ok(_) => column.into(),
                    Err(_) => [f64::NAN; MAX_STAGES],
                }
            };
            Box::new(Actions {
                from_start: solved(&|_| self.gamma),
                from_values: from_fn(|j| if j < s { solved(&|i| entry(i, j)) } else { [0.0; MAX_STAGES] }),
            })
        })
    }

    /// The stage equations with the linear force `-kappa q` on the left-hand side, solved for the positions:
    /// `Q = left q0 + left_u v0 + left_b (a + kappa Q)`.
    ///
    /// The solution is the same for every kappa; the iteration converges the faster, the nearer kappa is to the
    /// negative slope of the force. `None` if the matrix `1 + kappa B` is nearly singular.
    pub fn preconditioned(&self, kappa: f64) -> Option<Preconditioned> {
        let s = self.s;
        let mut rows: LeftRows = from_fn(|i| {
            from_fn(|j| match j {
                MAX_STAGES => 1.0,
                j if j > MAX_STAGES => self.u[i].0,
                j => self.b[i][j].0,
            })
        });
        let mut left: [[f64; MAX_STAGES]; MAX_STAGES] =
            from_fn(|i| from_fn(|j| if i == j { 1.0 } else { 0.0 } + kappa * self.b[i][j].0));
        if kappa != 0.0 {
            for k in 0..s {
                if left[k][k].abs() < MIN_PIVOT {
                    return None;
                }
                let inverse = 1.0 / left[k][k];
                left[k].iter_mut().for_each(|e| *e *= inverse);
                rows[k].iter_mut().for_each(|e| *e *= inverse);
                let (above, above_right) = (left[k], rows[k]);
                for i in (0..s).filter(|i| *i != k) {
                    let factor = left[i][k];
                    left[i].iter_mut().zip(&above).for_each(|(e, a)| *e -= factor * a);
                    rows[i].iter_mut().zip(&above_right).for_each(|(e, a)| *e -= factor * a);
                }
            }
        }
        Some(Preconditioned { kappa, head: Left::new(&rows, s), tail: None })
    }

    /// The round-off of the matrices of [`preconditioned`](Self::preconditioned), to first order:
    /// `(1 + kappa B)^-1 (B - (1 + kappa B) left_b)`, and likewise for `left` and `left_u`, with
    /// `(1 + kappa B)^-1 = 1 - kappa left_b`.
    ///
    /// Uncorrected it would act in the same direction in every step. To be compiled for instruction sets with fused
    /// multiply-add.
    #[inline(always)]
    fn left_out(&self, left: &Preconditioned) -> Left {
        let (s, kappa, head) = (self.s, left.kappa, &left.head);
        let row = |i: usize| -> [f64; MAX_STAGES + 2] {
            from_fn(|j| match j {
                MAX_STAGES => head.q.0[i],
                j if j > MAX_STAGES => head.u.0[i],
                j => head.b.0[j].0[i],
            })
        };
        let rows: LeftRows = from_fn(row);
        let mut residual: LeftRows = [[0.0; MAX_STAGES + 2]; MAX_STAGES];
        for i in 0..s {
            // The residual, in two parts.
            let (mut sum, mut lost) = (rows[i].map(|e| -e), [0.0; MAX_STAGES + 2]);
            for j in 0..MAX_STAGES + 2 {
                let (head, tail) = match j {
                    MAX_STAGES => (1.0, 0.0),
                    j if j > MAX_STAGES => (self.u[i].0, self.u[i].1),
                    j => (self.b[i][j].0, self.b[i][j].1),
                };
                let (total, error) = exact_sum(sum[j], head);
                (sum[j], lost[j]) = (total, error + tail);
            }
            for k in 0..s {
                let Quad(b, b_tail) = self.b[i][k];
                let factor = -kappa * b;
                let factor_tail = lost_in_product(-kappa, b, factor) - kappa * b_tail;
                for j in 0..MAX_STAGES + 2 {
                    let product = factor * rows[k][j];
                    let error = lost_in_product(factor, rows[k][j], product);
                    let (total, rounding) = exact_sum(sum[j], product);
                    sum[j] = total;
                    lost[j] += product_plus(factor_tail, rows[k][j], error + rounding);
                }
            }
            residual[i] = from_fn(|j| sum[j] + lost[j]);
        }
        let mut tail = residual;
        for i in 0..s {
            for k in 0..s {
                let factor = -kappa * rows[i][k];
                tail[i].iter_mut().zip(&residual[k]).for_each(|(e, r)| *e += factor * r);
            }
        }
        Left::new(&tail, s)
    }
}

/// A row of a matrix over the stages, followed by the coefficient of the velocity; padded to whole registers.
type Wide = ExactRow<{ MAX_STAGES + 8 }>;

/// The products of coefficients that multiply the accelerations and the velocity in a [`Condensed`] step.
struct AccelerationProducts {
    /// `D` and `1 / rho`.
    velocity: [Wide; MAX_STAGES],
    /// `B` and `u`; row `s` has `end_b` and `end_u`.
    positions: [Wide; MAX_STAGES + 1],
}

/// The kernel that computes the [`AccelerationProducts`] from the stages of the integrating factor.
struct Multiply<'a> {
    s: usize,
    h: f64,
    rho: &'a DoubleDoubleStages,
}

impl WithSimd for Multiply<'_> {
    type Output = AccelerationProducts;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> AccelerationProducts {
        let Multiply { s, h, rho } = self;
        let (g, step, zero) = (Coefficients::of(s), Quad::from(h), Quad::zero());
        let factors = Wide::from_fn(|j| if j < s { step * rho[j] } else { zero });
        let mut velocity = [Wide::ZERO; MAX_STAGES];
        for i in 0..s {
            let inverse = rho[i].recip();
            let unit = Wide::from_fn(|j| if j == MAX_STAGES { inverse } else { zero });
            let row = Wide::from_fn(|j| if j < s { g.a[i][j] } else { zero }).times(&factors);
            velocity[i].add(inverse, &row);
            velocity[i].add(Quad::one(), &unit);
        }
        let mut positions = [Wide::ZERO; MAX_STAGES + 1];
        for i in 0..=s {
            for j in 0..s {
                let weight = if i < s { g.a[i][j] } else { g.b[j] };
                positions[i].add(step * weight, &velocity[j]);
            }
        }
        AccelerationProducts { velocity, positions }
    }
}

/// The rows of `left_b`, followed by the entries of `left` and `left_u`.
type LeftRows = [[f64; MAX_STAGES + 2]; MAX_STAGES];

/// The matrices of [`Condensed::preconditioned`], or their round-off.
#[repr(C)] // The matrix comes last, see `Vectors` of the separable route.
pub(crate) struct Left {
    pub q: Stages,
    pub u: Stages,
    pub b: StageMap,
}

impl Left {
    fn new(rows: &LeftRows, s: usize) -> Self {
        let column = |j: usize| Stages(from_fn(|i| rows[i.min(s - 1)][j]));
        Left { q: column(MAX_STAGES), u: column(MAX_STAGES + 1), b: StageMap(from_fn(column)) }
    }

    /// `left q0 + left_u v0` for the stages in the r-th register.
    #[inline(always)]
    pub fn of_state<S: Simd>(&self, q: Lanes<S>, v: Lanes<S>, r: usize) -> Lanes<S> {
        self.u.block::<S>(r).mul_add(v, self.q.block::<S>(r) * q)
    }
}

/// See [`Condensed::preconditioned`].
#[repr(C)] // The head comes last, see `Vectors` of the separable route.
pub(crate) struct Preconditioned {
    pub kappa: f64,
    /// The round-off of the head, if it was computed by [`refine`](Self::refine).
    pub tail: Option<Left>,
    pub head: Left,
}

impl Preconditioned {
    /// Computes the tail, at the cost of about three steps, for matrices that are kept for long.
    pub fn refine(&mut self, table: &Condensed) {
        if self.tail.is_none() {
            self.tail = Some(Instructions::new().dispatch(LeftOut { table, left: self }));
        }
    }
}

/// The kernel of [`Condensed::left_out`].
struct LeftOut<'a> {
    table: &'a Condensed,
    left: &'a Preconditioned,
}

impl WithSimd for LeftOut<'_> {
    type Output = Left;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _simd: S) -> Left {
        self.table.left_out(self.left)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use contact_geom::numbers::max_or_nan;

    /// A cached table is used only for the same number of stages, step size and rate.
    #[test]
    fn kept_tables_are_not_those_of_others() {
        let table = Condensed::of(4, 0.5, -0.1).unwrap();
        assert!(Arc::ptr_eq(&table, &Condensed::of(4, 0.5, -0.1).unwrap()));
        for (s, h, gamma) in [(5, 0.5, -0.1), (4, 0.25, -0.1), (4, 0.5, 0.1), (4, -0.5, -0.1)] {
            let _ = Condensed::of(4, 0.5, -0.1).unwrap();
            let other = Condensed::of(s, h, gamma).unwrap();
            assert_eq!((other.s, other.h, other.gamma), (s, h, gamma));
            // Two tables are kept, in either order of request.
            assert!(Arc::ptr_eq(&table, &Condensed::of(4, 0.5, -0.1).unwrap()));
            assert!(Arc::ptr_eq(&other, &Condensed::of(s, h, gamma).unwrap()));
        }
    }

    /// The products agree with sums term by term to double-double round-off: 1e-30 for up to sixteen terms below one.
    #[test]
    fn products_are_exact_in_two_parts() {
        for (s, h, gamma) in [(16, 0.7, -0.3), (8, 1.3, 0.0), (5, 0.01, 2.0), (1, 0.1, -1.0)] {
            let (table, g, step) = (Condensed::new(s, h, gamma).unwrap(), Coefficients::of(s), Quad::from(h));
            let exact = &table.exact;
            let small = |x: Quad| assert!(x.0.abs() <= 1e-30, "{s} stages: {:e}", x.0);
            let sum = |f: &dyn Fn(usize) -> Quad| (0..s).fold(Quad::zero(), |sum, j| sum + f(j));
            for i in 0..s {
                // rho = 1 - h A gamma rho
                let rho = |j: usize| exact.inverse_rho[j].recip();
                small(rho(i) + step * Quad::from(gamma) * sum(&|j| g.a[i][j] * rho(j)) - Quad::one());
                small(table.u[i] - step * sum(&|j| g.a[i][j] * exact.inverse_rho[j]));
                for k in 0..s {
                    small(exact.d[i][k] - step * g.a[i][k] * rho(k) * exact.inverse_rho[i]);
                    small(table.b[i][k] - step * sum(&|j| g.a[i][j] * exact.d[j][k]));
                }
                small(exact.end_b[i] - step * sum(&|j| g.b[j] * exact.d[j][i]));
            }
            small(exact.end_u - step * sum(&|j| g.b[j] * exact.inverse_rho[j]));
        }
    }

    /// Head and tail of the preconditioned matrices satisfy their equations to 1e-29, the square of the round-off with
    /// a margin for sums of sixteen terms.
    #[test]
    fn left_matrices_are_exact_in_two_parts() {
        let one = Quad::one();
        for (s, h, gamma, kappa) in
            [(16, 2.5, -0.01, 0.9), (16, 1.25, 0.0, 1.0), (8, 0.5, -1e-12, -0.7), (3, 0.1, 1.0, 40.0)]
        {
            let table = Condensed::new(s, h, gamma).unwrap();
            let mut left = table.preconditioned(kappa).unwrap();
            left.refine(&table);
            let tail = left.tail.as_ref().unwrap();
            let twofold = |a: f64, b: f64| Quad::from(a) + Quad::from(b);
            for i in 0..s {
                let mut worst = [0.0f64; 2];
                let product = |f: &dyn Fn(usize) -> Quad| {
                    (0..s).fold(f(i), |sum, k| sum + Quad::from(kappa) * table.b[i][k] * f(k))
                };
                let mut see = |found: Quad, true_one: Quad, head: Quad| {
                    worst = [
                        max_or_nan(worst[0], (found - true_one).0.abs()),
                        max_or_nan(worst[1], (head - true_one).0.abs()),
                    ];
                };
                see(
                    product(&|k| twofold(left.head.q.0[k], tail.q.0[k])),
                    one,
                    product(&|k| twofold(left.head.q.0[k], 0.0)),
                );
                see(
                    product(&|k| twofold(left.head.u.0[k], tail.u.0[k])),
                    table.u[i],
                    product(&|k| twofold(left.head.u.0[k], 0.0)),
                );
                for j in 0..s {
                    let two = |k: usize| twofold(left.head.b.0[j].0[k], tail.b.0[j].0[k]);
                    let head = |k: usize| twofold(left.head.b.0[j].0[k], 0.0);
                    see(product(&two), table.b[i][j], product(&head));
                }
                assert!(worst[0] <= 1e-29 && worst[1] > 1e-18, "s = {s}, row {i}: {worst:?}");
            }
        }
    }
}
