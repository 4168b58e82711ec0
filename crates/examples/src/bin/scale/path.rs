//! Boundary-value paths: time against the number of nodes, compared with Newton's method written by hand for one system
//! and with faer's sparse LU.

use crate::sparse_path;
use contact_examples::Failure;
use contact_examples::Report;
use contact_examples::systems::Chain;
use contact_geom::nalgebra::{SMatrix, SVector};
use contact_geom::{
    ChartVector, Hessian, Lagrangian, Scalar, VelocityPoint,
    numbers::{max_abs_or_nan, max_or_nan},
};
use discrete_herglotz::{
    DiscreteLagrangian,
    boundary::{BoundaryPath, End},
    rules::Rule,
};
use std::hint::black_box;
use std::time::Instant;

const SPAN: f64 = 1.0;
const BETA: f64 = 0.5;
const GAMMA: f64 = -0.1;

/// The time per iteration for n = 2 and n = 6 from 1e2 to 1e5 nodes, its log-log slope, and its ratios to the
/// hand-written loop and to sparse LU.
pub fn run(report: &mut Report) -> Result<(), Failure> {
    of::<2>(report, ["n=2", "n=2 by hand", "n=2 ratio to the hand-written Newton", "n=2 slope from 1e3 to 1e5"])?;
    of::<6>(report, ["n=6", "n=6 by hand", "n=6 ratio to the hand-written Newton", "n=6 slope from 1e3 to 1e5"])
}

fn of<const N: usize>(report: &mut Report, [name, by_hand, ratio, slope]: [&str; 4]) -> Result<(), Failure> {
    let mut sizes = vec![100, 1000, 10_000];
    if !report.quick {
        sizes.push(100_000);
    }
    let mut times = Vec::new();
    for &steps in &sizes {
        let [mut best, mut best_by_hand, mut best_sparse] = [f64::INFINITY; 3];
        // NaN where a competitor finds no path.
        let mut differences = [f64::NAN; 2];
        // The three alternate, so that other load on the machine affects all of them.
        for _ in 0..(200_000 / steps).clamp(3, 50) {
            let ld = Rule::LEFT_MIDPOINT.of(Springs::<N>, SPAN / steps as f64)?;
            let problem = BoundaryPath::new(&ld, steps, ends().map(End::Position))?;
            let start = Instant::now();
            let found = black_box(problem.search());
            let seconds = start.elapsed().as_secs_f64();
            // One forward elimination precedes the first correction, and one follows each correction.
            best = best.min(seconds / f64::from(found.iterations + 1));
            let start = Instant::now();
            let (points, actions, sweeps) = black_box(by_hand_newton::<N>(steps, ld.step_size()));
            best_by_hand = best_by_hand.min(start.elapsed().as_secs_f64() / f64::from(sweeps));
            let start = Instant::now();
            let sparse = black_box(sparse_path::newton::<N>(&ld, steps, ends()));
            let seconds = start.elapsed().as_secs_f64();
            let off = |points: &[SVector<f64, N>]| {
                max_abs_or_nan(points.iter().zip(&found.points).flat_map(|(a, b)| (a - b).data.0[0]))
            };
            let of_actions = max_abs_or_nan(actions.iter().zip(&found.actions).map(|(a, b)| a - b));
            differences[0] = if actions.is_empty() { f64::NAN } else { max_or_nan(off(&points), of_actions) };
            if let Some((points, corrections)) = sparse {
                best_sparse = best_sparse.min(seconds / f64::from(corrections));
                differences[1] = off(&points);
            }
        }
        report.row(name, steps, best, None)?;
        report.row(by_hand, steps, best_by_hand, None)?;
        report.row(&format!("{name} by faer's sparse LU"), steps, best_sparse, None)?;
        // All three solve the same equations, which the differences verify. The round-off of the positions, eps q / h
        // in each equation, accumulates over the path.
        for (rival, off) in ["the loop by hand", "faer's sparse LU"].into_iter().zip(differences) {
            let what = format!("{name} difference from the path by {rival} at N={steps}");
            report.at_most(&what, off, 1e-15 * (steps as f64).powf(1.5))?;
        }
        report.at_most(&format!("{name} ratio to faer's sparse LU at N={steps}"), best / best_sparse, 1.0)?;
        report.at_most(&format!("{ratio} at N={steps}"), best / best_by_hand, 1.5)?;
        times.push(best);
    }
    if let [_, from, .., to] = times[..] {
        let decades = (sizes[sizes.len() - 1] as f64 / 1e3).log10();
        report.at_most(slope, (to / from).log10() / decades, 1.05)?;
    }
    if !report.quick {
        // The time of a whole search, with derivatives by automatic differentiation.
        let ld = Rule::LEFT_MIDPOINT.of(Chain::<N> { beta: BETA, gamma: GAMMA, ..Chain::default() }, SPAN / 1e5)?;
        let start = Instant::now();
        let found = BoundaryPath::new(&ld, 100_000, ends().map(End::Position))?.search();
        let seconds = start.elapsed().as_secs_f64();
        let what = format!("{name} search with derived derivatives");
        report.row(&what, 100_000, seconds, None)?;
        if N == 2 {
            let figure = if found.is_found() { seconds } else { f64::NAN };
            report.at_most(&format!("{what}: seconds at N=1e5"), figure, 2.0)?;
        }
    }
    Ok(())
}

/// End points far enough apart for the springs to be nonlinear.
fn ends<const N: usize>() -> [SVector<f64, N>; 2] {
    [SVector::from_fn(|i, _| 0.3 * i as f64), SVector::from_fn(|i, _| 1.0 - 0.4 * i as f64)]
}

/// The FPUT chain with derivatives in closed form, the same formulas as in the hand-written loop, so that the
/// evaluation of derivatives does not enter the comparison.
struct Springs<const N: usize>;

impl<const N: usize> Lagrangian<N> for Springs<N> {
    #[inline(always)]
    fn value<T: Scalar>(&self, t: T, q: &SVector<T, N>, v: &SVector<T, N>, z: T) -> T {
        Chain::<N> { beta: BETA, gamma: GAMMA, ..Chain::default() }.value(t, q, v, z)
    }

    #[inline(always)]
    fn closed_gradient<T: Scalar>(&self, _t: T, x: &VelocityPoint<N, T>) -> Option<ChartVector<N, T>> {
        Some(ChartVector { x: -springs(&x.q).0, y: x.v, z: T::from(GAMMA) })
    }

    #[inline(always)]
    fn closed_hessian<T: Scalar>(&self, _t: T, x: &VelocityPoint<N, T>) -> Option<Hessian<N, T>> {
        let one = |i, j| if i == j { T::one() } else { T::zero() };
        let (none, still) = (SMatrix::from_element(T::zero()), SVector::from_element(T::zero()));
        let qq = -springs(&x.q).1;
        Some(Hessian { qq, qv: none, vv: SMatrix::from_fn(one), qz: still, vz: still, zz: T::zero() })
    }
}

/// The gradient and the second derivative, a tridiagonal matrix, of the potential of the chain between two walls.
#[inline(always)]
fn springs<T: Scalar, const N: usize>(q: &SVector<T, N>) -> (SVector<T, N>, SMatrix<T, N, N>) {
    let (mut gradient, mut hessian) = (SVector::from_element(T::zero()), SMatrix::from_element(T::zero()));
    let bond = |r: T| (r + r * r * r * BETA, r * r * (3.0 * BETA) + 1.0);
    let (mut force, mut stiffness) = bond(q[0]);
    for i in 0..N {
        let right = if i + 1 < N { q[i + 1] } else { T::zero() };
        let (after, stiffness_after) = bond(right - q[i]);
        gradient[i] = force - after;
        hessian[(i, i)] = stiffness + stiffness_after;
        if i + 1 < N {
            hessian[(i, i + 1)] = -stiffness_after;
            hessian[(i + 1, i)] = -stiffness_after;
        }
        (force, stiffness) = (after, stiffness_after);
    }
    (gradient, hessian)
}

/// The potential of the chain between two walls.
#[inline(always)]
fn potential<const N: usize>(q: &SVector<f64, N>) -> f64 {
    let mut sum = 0.0;
    for bond in 0..=N {
        let r = if bond < N { q[bond] } else { 0.0 } - if bond > 0 { q[bond - 1] } else { 0.0 };
        sum += r * r * (0.5 + r * r * (0.25 * BETA));
    }
    sum
}

/// Positions, actions, and the number of iterations.
type ByHand<const N: usize> = (Vec<SVector<f64, N>>, Vec<f64>, u32);

/// Newton's method with block elimination, as one would write it for this system only, with derivatives by hand, for
/// the paper's midpoint rule `L_d = h (v^2/2 - V((q0 + q1)/2) + gamma z0)`. It makes the same corrections of positions
/// as the library's search and finds the same path and actions. The actions are computed once, after the last
/// iteration, since with linear drag they do not act on the positions. It has no line search, no pivoting between
/// points, no test of whether z acts on the positions, no sizes of terms and no relative residual, no product of the
/// sigma_d, and no status.
fn by_hand_newton<const N: usize>(steps: usize, h: f64) -> ByHand<N> {
    let [from, to] = ends::<N>();
    let at = |k: usize| k as f64 / steps as f64;
    let mut q: Vec<_> = (0..=steps).map(|k| from * (1.0 - at(k)) + to * at(k)).collect();
    let mut next = vec![SMatrix::<f64, N, N>::zeros(); steps];
    let mut rhs = vec![SVector::<f64, N>::zeros(); steps];
    let sigma = 1.0 + h * GAMMA;
    for sweep in 1..=50 {
        // For step k: the mean velocity, and `(h/2) V_q` and `(h/4) V_qq` at the midpoint.
        let of = |k: usize, q: &[SVector<f64, N>]| {
            let (g, k_mid) = springs(&((q[k] + q[k + 1]) * 0.5));
            (((q[k + 1] - q[k]) / h), g * (0.5 * h), k_mid * (0.25 * h))
        };
        let identity = SMatrix::<f64, N, N>::identity() / h;
        let (mut u, mut g, mut k_mid) = of(0, &q);
        for k in 1..steps {
            let (u1, g1, k1) = of(k, &q);
            let residual = -u1 - g1 + (u - g) * sigma;
            let lower = (-identity - k_mid) * sigma;
            let mut diagonal = identity - k1 + (identity - k_mid) * sigma;
            let mut right = -residual;
            if k > 1 {
                diagonal -= lower * next[k - 1];
                right -= lower * rhs[k - 1];
            }
            let mut upper = -identity - k1;
            eliminate(&mut diagonal, &mut upper, &mut right);
            (next[k], rhs[k]) = (upper, right);
            (u, g, k_mid) = (u1, g1, k1);
        }
        let (mut change, mut largest, mut size) = (SVector::<f64, N>::zeros(), 0.0f64, 0.0f64);
        for k in (1..steps).rev() {
            change = rhs[k] - next[k] * change;
            q[k] += change;
            largest = largest.max(change.amax());
            size = size.max(q[k].amax());
        }
        // Convergence is quadratic: after a relative correction of 1e-8 the next one is round-off. The library makes it
        // to be certain.
        if largest <= 1e-10 * size {
            let mut z = vec![0.0; steps + 1];
            for k in 0..steps {
                let v = (q[k + 1] - q[k]) / h;
                let value = v.norm_squared() * 0.5 - potential(&((q[k] + q[k + 1]) * 0.5)) + GAMMA * z[k];
                z[k + 1] = z[k] + h * value;
            }
            return (q, z, sweep);
        }
    }
    (q, Vec::new(), 50)
}

/// Solves `a x = b` for a matrix `b` and a vector `c` of right-hand sides, with row pivoting within the block.
#[inline(always)]
fn eliminate<const N: usize>(a: &mut SMatrix<f64, N, N>, b: &mut SMatrix<f64, N, N>, c: &mut SVector<f64, N>) {
    for j in 0..N {
        let pivot = (j..N).fold(j, |best, i| if a[(i, j)].abs() > a[(best, j)].abs() { i } else { best });
        if pivot != j {
            a.swap_rows(j, pivot);
            b.swap_rows(j, pivot);
            c.swap_rows(j, pivot);
        }
        let inverse = 1.0 / a[(j, j)];
        for i in j + 1..N {
            let factor = a[(i, j)] * inverse;
            for m in j + 1..N {
                a[(i, m)] -= factor * a[(j, m)];
            }
            for m in 0..N {
                b[(i, m)] -= factor * b[(j, m)];
            }
            c[i] -= factor * c[j];
        }
    }
    for j in (0..N).rev() {
        let inverse = 1.0 / a[(j, j)];
        for m in 0..N {
            b[(j, m)] *= inverse;
        }
        c[j] *= inverse;
        for i in 0..j {
            let factor = a[(i, j)];
            for m in 0..N {
                b[(i, m)] -= factor * b[(j, m)];
            }
            c[i] -= factor * c[j];
        }
    }
}
