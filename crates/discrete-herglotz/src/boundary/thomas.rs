//! Block elimination without exchanges of rows between points: the block Thomas algorithm, for paths whose points are
//! not close to conjugate points of the start.

use super::block_elimination::{BlockElimination, Carry, Eliminated, Equations, Measured, Nodes, Undefined};
use super::step_forces::StepForces;
use crate::DiscreteLagrangian;
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{DiscretePoint, SecondDiscreteJet};

/// The smallest admissible pivot, relative to its diagonal entry before the elimination. This bounds the loss of digits
/// in a correction; the residuals that measure the path are not affected.
const MIN_PIVOT: f64 = 1.0 / 8192.0;

/// The smallest regularity of the last block at which the loss of digits in the elimination cannot hide that the ends
/// are conjugate.
const MIN_REGULARITY: f64 = 1e-6;

/// The reason why a path needs the general elimination.
enum PivotFailure {
    /// The momenta of a step depend on the action.
    Coupled,
    /// A pivot is too small, or a number is not finite.
    Pivot,
}

/// The momentum and the action at a point as affine functions of its correction, after the elimination of all previous
/// positions.
struct Carried<const N: usize> {
    /// `D2 L_d + F+` of the previous step, the momentum at the point.
    p: SVector<f64, N>,
    /// `dp = schur dq + rhs`.
    schur: SMatrix<f64, N, N>,
    rhs: SVector<f64, N>,
    /// The diagonal of the derivative of p in q, which is that of `schur` before the elimination.
    diagonal: SVector<f64, N>,
    /// `dz = slope . dq + change`.
    slope: SVector<f64, N>,
    change: f64,
}

impl<const N: usize> BlockElimination<N> {
    /// Like [`forward`](BlockElimination::forward), for a path that is sufficiently regular; `None` otherwise.
    ///
    /// With `dq_k = r_k - X_k dq_{k+1}` at the previous points, the momentum at point k varies by `S dq_k + s`, where
    /// `S = D22 - D12^T X` and `s = D12^T r` of the previous step, and the action by `a . dq_k + c`. The discrete
    /// Herglotz equation `D1 + sigma p = 0` then has the blocks `D11 + sigma S` and `D12`, with terms of rank one where
    /// second derivatives in the action do not vanish. Where they vanish, the correction of the action is not needed.
    /// With discrete forces the derivatives of `D1 + F-` and of `D2 + F+` are in the place of the second derivatives.
    #[inline(always)]
    pub fn without_exchanges<D: DiscreteLagrangian<N>>(
        &mut self,
        of: &Equations<'_, D, N>,
        x: &mut Nodes<N>,
    ) -> Result<Option<Measured<N>>, Undefined> {
        if !self.coupled {
            match self.thomas::<D, false>(of, x)? {
                Ok(measured) => return Ok(Some(measured)),
                Err(PivotFailure::Coupled) => self.coupled = true,
                Err(PivotFailure::Pivot) => return Ok(None),
            }
        }
        Ok(self.thomas::<D, true>(of, x)?.ok())
    }

    fn thomas<D: DiscreteLagrangian<N>, const COUPLED: bool>(
        &mut self,
        of: &Equations<'_, D, N>,
        x: &mut Nodes<N>,
    ) -> Result<Result<Measured<N>, PivotFailure>, Undefined> {
        let (start, end) = of.conditions.momenta();
        let (zero, h) = (SVector::<f64, N>::zeros(), of.ld.step_size());
        let mut measured = Measured::new();
        let mut carried = Carried {
            p: start.unwrap_or(zero),
            schur: SMatrix::zeros(),
            rhs: zero,
            diagonal: zero,
            slope: zero,
            change: 0.0,
        };
        self.after.clear();
        for k in 0..of.steps {
            let (q0, q1, t) = (&x.q[k], &x.q[k + 1], of.t0 + k as f64 * h);
            let at = DiscretePoint { q0: *q0, q1: *q1, z0: x.z[k] };
            let jet = of.ld.second_jet(t, &at);
            let jet = match &jet {
                Ok(jet) => jet,
                Err(cause) => return Err(Undefined { step: k, cause: *cause }),
            };
            let forces = StepForces::at(of.ld, t, &at).map_err(|cause| Undefined { step: k, cause })?;
            if !COUPLED && (is_coupled(jet) || forces.depend_on_action()) {
                return Ok(Err(PivotFailure::Coupled));
            }
            let sigma = jet.first.sigma();
            measured.factor(k, sigma);
            self.momenta[k] = Carry::of(jet, &forces);
            x.z[k + 1] = x.z[k] + jet.first.value;
            let mut point = Eliminated { next: SMatrix::zeros(), rhs: zero };
            if k > 0 || start.is_some() {
                let p = &carried.p;
                let of_position = forces.pull_in_q0(jet);
                let (mut here, mut next) = (of_position + carried.schur * sigma, forces.pull_in_q1(jet));
                let mut value = forces.pull(jet) + p * sigma;
                if let Some(load) = of.load.get(k) {
                    value += load;
                }
                let mut rhs = -value - carried.rhs * sigma;
                if COUPLED {
                    let by_action = forces.pull_in_z(jet) + p * jet.dzz;
                    here += p * jet.d1z.transpose() + by_action * carried.slope.transpose();
                    next += p * jet.d2z.transpose();
                    rhs -= by_action * carried.change;
                }
                // The effect of the round-off of the three positions in the equation.
                let rounding = magnitudes(&next, q1) * 4.0;
                measured.take(&value, &(forces.pull_size(jet) + p.abs() * sigma.abs() + rounding));
                let diagonal = (of_position.diagonal() + carried.diagonal * sigma).abs();
                if k + 1 == of.steps && end.is_none() {
                    // The last position is given.
                    measured.regularity = self.finish(&here, &rhs, &diagonal);
                } else if !reduce(&mut here, &diagonal, &mut next, &mut rhs) {
                    return Ok(Err(PivotFailure::Pivot));
                }
                point = Eliminated { next, rhs };
            }
            let mut before = forces.momentum_in_q0(jet);
            if COUPLED {
                let momentum_in_z = forces.momentum_in_z(jet);
                before += momentum_in_z * carried.slope.transpose();
                let by_before = carried.slope * sigma + jet.first.d1;
                carried.rhs = momentum_in_z * carried.change;
                carried.change = by_before.dot(&point.rhs) + sigma * carried.change;
                carried.slope = jet.first.d2 - point.next.tr_mul(&by_before);
            } else {
                carried.rhs = zero;
            }
            (carried.p, carried.schur) = (forces.momentum(jet), forces.momentum_in_q1(jet));
            carried.diagonal = carried.schur.diagonal();
            for m in 0..N {
                let column = before.column(m);
                carried.rhs += column * point.rhs[m];
                for c in 0..N {
                    let entry = point.next[(m, c)];
                    for i in 0..N {
                        carried.schur[(i, c)] -= column[i] * entry;
                    }
                }
            }
            self.points[k] = point;
            if k + 1 == of.steps
                && let Some(p) = &end
            {
                let value = carried.p - p;
                let rounding = magnitudes(&forces.momentum_in_q0(jet), q0) * 2.0;
                measured.take(&value, &(carried.p.abs() + p.abs() + rounding));
                measured.regularity = self.finish(&carried.schur, &(-value - carried.rhs), &carried.diagonal.abs());
            }
        }
        measured.log_factor += measured.factors.ln();
        // Paths with non-finite values or a small regularity are left to the general elimination.
        let sound =
            measured.squares.sum().is_finite() && x.z[of.steps].is_finite() && measured.regularity >= MIN_REGULARITY;
        Ok(if sound { Ok(measured) } else { Err(PivotFailure::Pivot) })
    }
}

/// Whether a second derivative in the action is nonzero or NaN.
#[inline(always)]
fn is_coupled<const N: usize>(jet: &SecondDiscreteJet<N>) -> bool {
    let mut size = jet.dzz.abs();
    for i in 0..N {
        size += jet.d1z[i].abs() + jet.d2z[i].abs();
    }
    // The comparison is written so that it holds for a NaN.
    size != 0.0
}

/// `|m| |x|` with absolute values of the entries.
#[inline(always)]
fn magnitudes<const N: usize>(m: &SMatrix<f64, N, N>, x: &SVector<f64, N>) -> SVector<f64, N> {
    let mut sum = SVector::zeros();
    for c in 0..N {
        let size = x[c].abs();
        for i in 0..N {
            sum[i] += m[(i, c)].abs() * size;
        }
    }
    sum
}

/// Multiplies `next` and `rhs` by the inverse of a block, by Gauss-Jordan elimination with pivots on the diagonal.
/// Returns `false` where a pivot is too small or not finite.
#[inline(always)]
fn reduce<const N: usize>(
    block: &mut SMatrix<f64, N, N>,
    diagonal: &SVector<f64, N>,
    next: &mut SMatrix<f64, N, N>,
    rhs: &mut SVector<f64, N>,
) -> bool {
    let mut sound = true;
    for j in 0..N {
        let pivot = block[(j, j)];
        let size = pivot.abs();
        sound &= size >= MIN_PIVOT * diagonal[j] && size > 0.0 && size < f64::INFINITY;
        let inverse = 1.0 / pivot;
        let others = SVector::<f64, N>::from_fn(|i, _| block[(i, j)]);
        // Whole columns are written at a time: a separate write of one entry would delay the reads of its column.
        let reduced = |i: usize, x: f64, entry: f64| if i == j { entry } else { x - others[i] * entry };
        for c in j + 1..N {
            let entry = block[(j, c)] * inverse;
            for i in 0..N {
                block[(i, c)] = reduced(i, block[(i, c)], entry);
            }
        }
        for c in 0..N {
            let entry = next[(j, c)] * inverse;
            for i in 0..N {
                next[(i, c)] = reduced(i, next[(i, c)], entry);
            }
        }
        let entry = rhs[j] * inverse;
        for i in 0..N {
            rhs[i] = reduced(i, rhs[i], entry);
        }
    }
    sound
}
