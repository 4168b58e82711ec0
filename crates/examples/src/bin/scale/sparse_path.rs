//! The boundary-value problem of `path` by Newton's method with faer's sparse LU on all unknowns at once. It is
//! compared with the block elimination of the library, and it verifies the path.

use contact_geom::DiscretePoint;
use contact_geom::nalgebra::SVector;
use discrete_herglotz::{DiscreteLagrangian, StepError};
use faer::linalg::solvers::Solve;
use faer::sparse::linalg::solvers::{Lu, SymbolicLu};
use faer::sparse::{Pair, SparseColMat, SymbolicSparseColMat};
use faer::{Mat, Par};

/// Newton's method on positions and actions together, without a line search, from the straight line between the ends.
/// Returns the positions and the number of corrections; `None` where it fails. The unknowns `(q_k, z_k)` of a point are
/// adjacent, and the sparsity pattern is analysed once.
pub fn newton<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    steps: usize,
    [from, to]: [SVector<f64, N>; 2],
) -> Option<(Vec<SVector<f64, N>>, u32)> {
    faer::set_global_parallelism(Par::Seq);
    let at = |k: usize| k as f64 / steps as f64;
    let mut q: Vec<_> = (0..=steps).map(|k| from * (1.0 - at(k)) + to * at(k)).collect();
    let mut z = vec![0.0; steps + 1];
    // The last point has only its action as an unknown.
    let size = (steps - 1) * (N + 1) + 1;
    let mut analysed = None;
    for iteration in 1..=50 {
        let mut rhs = Mat::<f64>::zeros(size, 1);
        let mut entries = Entries::default();
        equations(ld, &q, &z, &mut entries, &mut rhs).ok()?;
        if analysed.is_none() {
            let (pattern, order) = SymbolicSparseColMat::try_new_from_indices(size, size, &entries.positions).ok()?;
            let symbolic = SymbolicLu::try_new(pattern.as_ref()).ok()?;
            analysed = Some((pattern, order, symbolic));
        }
        let Some((pattern, order, symbolic)) = &analysed else { return None };
        let matrix = SparseColMat::new_from_argsort(pattern.clone(), order, &entries.values).ok()?;
        let lu = Lu::try_new_with_symbolic(symbolic.clone(), matrix.as_ref()).ok()?;
        lu.solve_in_place(&mut rhs);
        let (mut largest, mut most) = (0.0f64, 0.0f64);
        for k in 1..=steps {
            let place = (k - 1) * (N + 1);
            let dz = if k < steps {
                let change = SVector::<f64, N>::from_fn(|i, _| rhs[(place + i, 0)]);
                q[k] += change;
                largest = largest.max(change.amax());
                most = most.max(q[k].amax());
                rhs[(place + N, 0)]
            } else {
                rhs[(place, 0)]
            };
            z[k] += dz;
        }
        if largest <= 1e-10 * most {
            return Some((q, iteration));
        }
    }
    None
}

/// The entries of a sparse matrix, in the same order in each iteration.
#[derive(Default)]
struct Entries {
    positions: Vec<Pair<usize, usize>>,
    values: Vec<f64>,
}

impl Entries {
    fn push(&mut self, row: usize, col: usize, value: f64) {
        self.positions.push(Pair { row, col });
        self.values.push(value);
    }
}

/// The linearised equations of a path: the rows from `(k - 1)(N + 1)` on are the discrete Herglotz equation at point k,
/// followed by the recursion for its action.
fn equations<const N: usize>(
    ld: &impl DiscreteLagrangian<N>,
    q: &[SVector<f64, N>],
    z: &[f64],
    entries: &mut Entries,
    rhs: &mut Mat<f64>,
) -> Result<(), StepError> {
    let steps = q.len() - 1;
    let (h, place) = (ld.step_size(), |k: usize| (k - 1) * (N + 1));
    let jet = |k: usize| ld.second_jet(k as f64 * h, &DiscretePoint { q0: q[k], q1: q[k + 1], z0: z[k] });
    let mut before = jet(0)?;
    for k in 1..=steps {
        let action = if k < steps { place(k) + N } else { place(k) };
        // dz_k - sigma dz_{k-1} - D1 . dq_{k-1} - D2 . dq_k = z_{k-1} + L_d - z_k.
        rhs[(action, 0)] = z[k - 1] + before.first.value - z[k];
        entries.push(action, action, 1.0);
        for i in 0..N {
            if k > 1 {
                entries.push(action, place(k - 1) + i, -before.first.d1[i]);
            }
            if k < steps {
                entries.push(action, place(k) + i, -before.first.d2[i]);
            }
        }
        if k > 1 {
            entries.push(action, place(k - 1) + N, -before.first.sigma());
        }
        if k == steps {
            break;
        }
        let next = jet(k)?;
        let (p, sigma) = (before.first.d2, next.first.sigma());
        for i in 0..N {
            let row = place(k) + i;
            rhs[(row, 0)] = -(next.first.d1[i] + sigma * p[i]);
            for j in 0..N {
                if k > 1 {
                    entries.push(row, place(k - 1) + j, sigma * before.d12[(j, i)]);
                }
                let here = next.d11[(i, j)] + p[i] * next.d1z[j] + sigma * before.d22[(i, j)];
                entries.push(row, place(k) + j, here);
                if k + 1 < steps {
                    entries.push(row, place(k + 1) + j, next.d12[(i, j)] + p[i] * next.d2z[j]);
                }
            }
            if k > 1 {
                entries.push(row, place(k - 1) + N, sigma * before.d2z[i]);
            }
            entries.push(row, place(k) + N, next.d1z[i] + p[i] * next.dzz);
        }
        before = next;
    }
    Ok(())
}
